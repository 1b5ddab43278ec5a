//! The table of a comparison for the terminal, made from the rows of `results.csv` alone.

use crate::experiment::Setting;
use crate::report::{Align, ResultRow, Table, number, quantity, step_length};

/// One line for each measure; one column for each of `columns` and one for the best point of the
/// engine `swept`. The settings of the best points follow below the table.
pub(super) fn table(rows: &[ResultRow], columns: &[Setting], swept: &str) -> String {
    let of = |setting: &Setting, measure: &str| {
        let label = setting.label();
        rows.iter().find(|r| {
            r.engine == setting.engine.name()
                && r.scheme == setting.scheme()
                && r.setting == label
                && r.dt_s == setting.step.dt
                && (r.measure == measure || measure.is_empty())
        })
    };
    let mut head = vec![("measure (less is better)".to_owned(), Align::Left)];
    for setting in columns {
        head.push((setting.name(), Align::Right));
    }
    head.push((format!("{swept}, best of all"), Align::Right));
    let mut table = Table::new(head);
    let mut below = String::new();
    for (measure, unit) in measures(rows) {
        // the axes of the charts use the same sign
        let unit = if unit == "1" { "-" } else { unit };
        let mut cells = vec![format!("{measure} [{unit}]")];
        for setting in columns {
            let row = of(setting, measure);
            cells.push(row.map_or("-".to_owned(), |r| match r.mode.as_str() {
                // the mode says why the value is NaN
                mode if r.value.is_nan() && !mode.is_empty() => mode.to_owned(),
                _ if r.verdict == "unsolved" => format!("{} (unsolved)", number(r.value, 3)),
                _ => number(r.value, 3),
            }));
        }
        if let Some(best) = best(rows, swept, measure) {
            cells.push(number(best.value, 3));
            let mut same = rows
                .iter()
                .filter(|r| r.engine == swept && r.measure == measure);
            // if all values are equal, no point is best
            if !same.all(|r| r.value == best.value) {
                below.push_str(&format!(
                    "  {measure}: dt {}, {}, {} per simulated second\n",
                    step_length(best.dt_s),
                    best.setting,
                    time(best)
                ));
            }
        } else {
            cells.push("-".to_owned());
        }
        table.push(cells);
    }
    let mut cells = vec!["time per simulated second".to_owned()];
    cells.extend(
        columns
            .iter()
            .map(|s| of(s, "").map_or("-".to_owned(), time)),
    );
    table.push(cells);
    if !below.is_empty() {
        below.insert_str(0, &format!("{swept}, its best point for each measure:\n"));
    }
    format!("{table}{below}")
}

/// Names and units of all measures, in the order of the rows.
fn measures(rows: &[ResultRow]) -> Vec<(&str, &str)> {
    let mut measures: Vec<(&str, &str)> = Vec::new();
    for row in rows {
        if !measures.iter().any(|(name, _)| *name == row.measure) {
            measures.push((&row.measure, &row.unit));
        }
    }
    measures
}

/// The least value, and of equal ones the fastest.
fn best<'a>(rows: &'a [ResultRow], engine: &str, measure: &str) -> Option<&'a ResultRow> {
    let key = |r: &ResultRow| {
        (
            r.value,
            r.seconds_per_simulated_second.unwrap_or(f64::INFINITY),
        )
    };
    rows.iter()
        .filter(|r| r.engine == engine && r.measure == measure && r.value.is_finite())
        .min_by(|a, b| {
            let (a, b) = (key(a), key(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        })
}

fn time(row: &ResultRow) -> String {
    match (row.seconds_per_simulated_second, row.spread) {
        (Some(t), Some(s)) => format!("{} ± {} %", quantity(t, "s", 3), number(100.0 * s, 2)),
        (Some(t), None) => quantity(t, "s", 3),
        _ => "-".to_owned(),
    }
}
