//! Pictures of `chart --accuracy`: what was reached, and at which cost.

use super::chart::{Chart, HLine, Series, Style};
use super::csv_rows::AccuracyRow;
use super::{Axis, number};

/// Errors below this are drawn on the line of zeros.
const ROUND_OFF: f64 = 1e-12;

/// Two charts of `rows`: the error against what was asked, and the work of the run over that of the best
/// fixed setting. Each scene is a column.
pub fn accuracy_charts(rows: &[AccuracyRow]) -> Vec<Chart> {
    let mut scenes: Vec<&str> = rows.iter().map(|row| row.scene.as_str()).collect();
    scenes.dedup();
    let mut asked: Vec<f64> = rows.iter().map(|row| row.accuracy).collect();
    asked.sort_by(|a, b| b.total_cmp(a));
    asked.dedup();
    let column = |row: &AccuracyRow| {
        let k = scenes.iter().position(|name| *name == row.scene);
        k.map_or(f64::NAN, |k| (k + 1) as f64)
    };
    let mut errors = Chart::new(
        "Error reached with --accuracy",
        Axis::linear("scene"),
        Axis::log("error over accuracy asked for [-]"),
    );
    let mut costs = Chart::new(
        "Work of the run with --accuracy",
        Axis::linear("scene"),
        Axis::log("work over that of the best fixed setting [-]"),
    );
    let names: Vec<String> = (scenes.iter().enumerate())
        .map(|(k, name)| format!("{} {name}", k + 1))
        .collect();
    let held = rows.iter().filter(|row| row.error <= row.accuracy).count();
    errors.subtitle = format!(
        "{held} of {} runs hold the accuracy in every measure of their closed form, which has no part in the \
         choice. Scenes: {}",
        rows.len(),
        names.join(", ")
    );
    let worst = rows.iter().map(|row| row.ratio).fold(0.0, f64::max);
    costs.subtitle = format!(
        "Work: steps, events, sweeps, factorisations and pivots of the run, without the choice. The best fixed \
         setting is found by search with the closed form. Worst {}",
        number(worst, 3)
    );
    for accuracy in asked {
        let of = || rows.iter().filter(|row| row.accuracy == accuracy);
        let relative = |row: &AccuracyRow| (row.error / accuracy).max(ROUND_OFF);
        let points = of().map(|row| (column(row), relative(row))).collect();
        let name = format!("{accuracy:e}");
        errors
            .series
            .push(Series::new(&name, Style::Points, points));
        let points = of().map(|row| (column(row), row.ratio)).collect();
        costs.series.push(Series::new(&name, Style::Points, points));
    }
    let line = |value, label: &str| HLine {
        value,
        label: label.to_owned(),
    };
    errors.lines.push(line(1.0, "asked for"));
    errors.notes.push(format!(
        "Errors below {ROUND_OFF:e} of what is asked are drawn there."
    ));
    costs.lines = vec![line(1.0, "best"), line(1.5, "1.5"), line(3.0, "3")];
    vec![errors, costs]
}
