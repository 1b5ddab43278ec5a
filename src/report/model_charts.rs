//! Charts of `models.csv`: what each reduction of the model saves, and what it changes.

use super::axis::Axis;
use super::chart::{Chart, HLine, Series, Style};
use super::csv_rows::ModelRow;

/// Differences below are drawn here, and so are all that are exactly 0.
const LEAST: f64 = 1e-18;

/// Unknowns, time and difference of every scene, a series for each reduction.
pub fn model_charts(rows: &[ModelRow]) -> Vec<Chart> {
    let mut scenes: Vec<&str> = Vec::new();
    let mut reductions: Vec<&str> = Vec::new();
    for row in rows {
        for (list, name) in [(&mut scenes, &row.scene), (&mut reductions, &row.reduction)] {
            if !list.contains(&name.as_str()) {
                list.push(name);
            }
        }
    }
    let place = |row: &ModelRow| {
        let k = scenes.iter().position(|name| *name == row.scene);
        k.map_or(f64::NAN, |k| (k + 1) as f64)
    };
    let names: Vec<String> = (scenes.iter().enumerate())
        .map(|(k, name)| format!("{} {name}", k + 1))
        .collect();
    // a scene without contacts has no unknown: nothing is left out of it
    let unknowns = |row: &ModelRow| match row.unknowns_full {
        0 => 1.0,
        full => row.unknowns as f64 / full as f64,
    };
    let chart = |title: &str, y: Axis, value: &dyn Fn(&ModelRow) -> f64| {
        let mut chart = Chart::new(title, Axis::linear("scene"), y);
        for name in &reductions {
            let own = rows.iter().filter(|row| row.reduction == *name);
            let points = own.map(|row| (place(row), value(row))).collect();
            chart.series.push(Series::new(*name, Style::Points, points));
        }
        chart
    };
    let mut charts = vec![
        chart(
            "Unknowns with a reduction",
            Axis::linear("unknown impulses over those of the full model [-]"),
            &unknowns,
        ),
        chart(
            "Time with a reduction",
            Axis::log("wall time of all steps over that of the full model [-]"),
            &|row| row.time_ratio,
        ),
        chart(
            "Difference from the full model",
            Axis::log("largest distance of a body [m, rad]"),
            &|row| row.difference.max(LEAST),
        ),
    ];
    charts[0].subtitle = format!(
        "A full model is the scene without one reduction. Scenes: {}",
        names.join(", ")
    );
    charts[1].lines = vec![HLine {
        value: 1.0,
        label: "as the full model".to_owned(),
    }];
    charts[2].notes = vec![format!(
        "Differences below {LEAST:e} are drawn there. Redundant contacts have several solutions, and motion \
         after impacts forgets its start: there they grow from round-off."
    )];
    charts
}
