//! Charts of one run over its time, from the rows of `steps.csv` alone.

use super::StepRow;
use super::axis::Axis;
use super::chart::{Chart, HLine};
use super::panel::over_time;

/// Where values of 0 are drawn on a log axis: below round-off.
const ZERO: f64 = 1e-18;

/// Steps since the row before, whose counts a row has.
fn steps_since(rows: &[StepRow]) -> Vec<f64> {
    let mut before = match rows {
        [first, second, ..] => 2.0 * first.time_s - second.time_s,
        _ => 0.0,
    };
    let since = |row: &StepRow| {
        let span = row.time_s - std::mem::replace(&mut before, row.time_s);
        (span / row.dt_s).round().max(1.0)
    };
    rows.iter().map(since).collect()
}

/// Energy, work by source, worst gap, residual, and work of the solver. A chart for which nothing is
/// known, as of a peer's residual, is left out.
///
/// # Arguments
/// - `tolerance`: relative residual at which an island counts as solved; `None` for a peer.
pub fn run_charts(rows: &[StepRow], tolerance: Option<f64>) -> Vec<Chart> {
    let told = |value: &dyn Fn(&StepRow) -> Option<f64>| -> Vec<(f64, f64)> {
        let of = |row: &StepRow| Some((row.time_s, value(row)?));
        rows.iter().filter_map(of).collect()
    };
    let since = steps_since(rows);
    let count = |value: &dyn Fn(&StepRow) -> Option<usize>| -> Vec<(f64, f64)> {
        let all = rows.iter().zip(&since);
        all.filter_map(|(row, steps)| Some((row.time_s, value(row)? as f64 / steps)))
            .collect()
    };
    // a source that never works is left out
    let sum = |value: &dyn Fn(&StepRow) -> Option<f64>| -> Vec<(f64, f64)> {
        let mut so_far = 0.0;
        let mut points = told(value);
        for point in &mut points {
            so_far += point.1;
            point.1 = so_far;
        }
        match points.iter().any(|point| point.1 != 0.0) {
            true => points,
            false => Vec::new(),
        }
    };
    let log = |value: &dyn Fn(&StepRow) -> Option<f64>| -> Vec<(f64, f64)> {
        let mut points = told(value);
        points.retain(|point| point.1.is_finite());
        points.iter_mut().for_each(|p| p.1 = p.1.max(ZERO));
        points
    };
    let mut charts = vec![
        over_time(
            "Energy",
            Axis::linear("energy [J]"),
            vec![
                ("kinetic", told(&|r| Some(r.kinetic_j))),
                ("potential", told(&|r| Some(r.potential_j))),
                ("sum", told(&|r| Some(r.kinetic_j + r.potential_j))),
            ],
        ),
        over_time(
            "Work on the bodies since the start, by source",
            Axis::linear("work [J]"),
            vec![
                ("gravity and forces", sum(&|r| r.work_forces_j)),
                ("normal impulses", sum(&|r| r.work_contact_n_j)),
                ("friction", sum(&|r| r.work_contact_t_j)),
                ("joints", sum(&|r| r.work_joints_j)),
                ("motors and springs", sum(&|r| r.work_motors_j)),
                ("returned", sum(&|r| r.work_returned_j)),
                ("position corrections", sum(&|r| r.work_recovery_j)),
            ],
        ),
        over_time(
            "Deepest penetration and widest joint gap",
            Axis::log("length [m]"),
            vec![
                ("penetration", log(&|r| Some(r.penetration_m))),
                ("joint gap", log(&|r| r.joint_gap_m)),
            ],
        ),
        over_time(
            "Residual of the contact problems",
            Axis::log("relative residual"),
            vec![("worst island", log(&|r| r.residual))],
        ),
        over_time(
            "Work of the solver",
            Axis::linear("count in a step, mean since the row before"),
            vec![
                ("contacts", told(&|r| Some(r.contacts as f64))),
                ("sweeps", count(&|r| r.sweeps)),
                ("factorisations", count(&|r| r.factorisations)),
                ("pivots", count(&|r| r.pivots)),
            ],
        ),
    ];
    charts[3].lines.extend(tolerance.map(|value| HLine {
        value,
        label: "tolerance".to_owned(),
    }));
    for chart in &mut charts[2..4] {
        // nothing overlaps, no joint: a line along the bottom says nothing
        chart.series.retain(|s| s.points.iter().any(|p| p.1 > ZERO));
        let low = chart.series.iter().flat_map(|s| &s.points);
        if low.clone().any(|p| p.1 == ZERO) {
            chart.zero = Some(ZERO);
        }
    }
    charts.retain(|chart| !chart.series.is_empty());
    charts
}
