//! Time of a step over the number of contacts.

use super::ResultRow;
use super::axis::Axis;
use super::chart::{Chart, PointLabel, Series, Style};

/// The rows of `bench` as a chart on log axes: a point for each scene and size, in a series for each
/// engine, setting and number of threads. `None` if there is no point with contacts to draw.
pub fn throughput(rows: &[ResultRow]) -> Option<Chart> {
    let mut chart = Chart::new(
        "Time of a step",
        Axis::log("contacts"),
        Axis::log("time of a step [s]"),
    );
    chart.subtitle = "mean of the middle half of the timed steps; less is better".to_owned();
    let mut scene = "";
    for step in rows.iter().filter(|r| r.measure == "step-time") {
        let same = |r: &&ResultRow| {
            r.measure == "contacts"
                && (&r.scene, &r.rung, &r.engine) == (&step.scene, &step.rung, &step.engine)
                && (&r.setting, r.threads) == (&step.setting, step.threads)
        };
        let Some(contacts) = rows.iter().find(same).map(|r| r.value) else {
            continue;
        };
        let point = (contacts, step.value);
        if !(point.0 > 0.0 && point.1 > 0.0 && point.0.is_finite() && point.1.is_finite()) {
            continue;
        }
        let mut name = format!("{}, {}", step.engine, step.setting);
        if step.threads > 1 {
            name.push_str(&format!(", {} threads", step.threads));
        }
        let at = chart.series.iter().position(|s| s.name == name);
        let at = at.unwrap_or_else(|| {
            let series = Series::new(name, Style::Points, Vec::new());
            chart.series.push(series);
            chart.series.len() - 1
        });
        chart.series[at].points.push(point);
        // the first size of a scene says which one it is
        if step.scene != scene {
            scene = &step.scene;
            chart.labels.push(PointLabel {
                x: point.0,
                y: point.1,
                text: step.scene.clone(),
            });
        }
    }
    (!chart.series.is_empty()).then_some(chart)
}
