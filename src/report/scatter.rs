use super::csv_rows::ResultRow;
use super::table::{number, step_length};

/// Ratio of half the range of a time to its median, above which the time counts as scattered.
const SCATTERS: f64 = 0.1;

/// A note about the scatter of times: how many points differ by more than ± 10 % between repeats, and
/// which differs most. `None` without repeats or without such points.
///
/// # Arguments
/// - `rows`: all rows of a point follow each other and have the same `spread`.
pub fn scatter(rows: &[ResultRow]) -> Option<String> {
    let of_point = |a: &ResultRow, b: &ResultRow| {
        (&a.scene, &a.rung, &a.engine, &a.scheme) == (&b.scene, &b.rung, &b.engine, &b.scheme)
            && (&a.solver, &a.setting, a.dt_s) == (&b.solver, &b.setting, b.dt_s)
    };
    let points = rows.chunk_by(of_point);
    let timed: Vec<(&ResultRow, f64)> =
        points.filter_map(|p| Some((&p[0], p[0].spread?))).collect();
    let scattered = timed.iter().filter(|(_, spread)| *spread > SCATTERS);
    let (worst, spread) = scattered.clone().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let name = [worst.scene.as_str(), &worst.engine, &worst.scheme];
    let name: Vec<&str> = name.into_iter().filter(|word| !word.is_empty()).collect();
    Some(format!(
        "times of {} of {} points scatter by more than ± {} % between repeats, most by ± {} % ({}, \
         {}, {}): differences within that mean nothing",
        scattered.count(),
        timed.len(),
        number(100.0 * SCATTERS, 2),
        number(100.0 * spread, 2),
        name.join(" "),
        step_length(worst.dt_s),
        worst.setting
    ))
}
