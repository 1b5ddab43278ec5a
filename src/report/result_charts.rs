//! Work-precision, convergence and energy, from the rows of `results.csv` alone.

use super::axis::Axis;
use super::chart::{Chart, Colour, HLine, PointLabel, Series, Style};
use super::csv_files::ResultRow;
use super::order::observed_order;
use super::table::number;

/// Rows that differ in their step length only, in its order.
struct Family<'a> {
    /// Index of the palette: one an engine and scheme.
    look: usize,
    name: String,
    rows: Vec<&'a ResultRow>,
}

/// Error against wall time for every measure that is not 0 everywhere: a chart a measure.
///
/// Points that differ in their step alone are joined where there are three or more; others are
/// single points of their engine. Each is labelled with what tells it from the others of its
/// engine, those first that no point of the same engine beats in both error and time.
///
/// # Arguments
/// - `rows`: of one scene. A row without a time is not drawn; one with a NaN is counted under
///   the picture.
pub fn work_precision(rows: &[ResultRow]) -> Vec<Chart> {
    let mut charts: Vec<Chart> = Vec::new();
    for measure in drawable(rows) {
        let of: Vec<&ResultRow> = rows.iter().filter(|r| r.measure == measure).collect();
        let mut chart = Chart::new(
            title(of[0]),
            Axis::log("wall time per simulated second [s]"),
            Axis::log(axis_label(of[0])),
        );
        if charts.is_empty() {
            chart.subtitle = format!(
                "Lower left is better; lines join steps of different length. {} Labels that \
                 find no room are in results.csv.",
                settings(rows)
            );
        }
        let floor = floor(&of, &mut chart);
        let mut labels = Vec::new();
        let families = families(rows, &measure);
        for family in &families {
            let ladder = family.rows.len() > 2;
            let points: Vec<(f64, f64)> = family.rows.iter().filter_map(|r| timed(r)).collect();
            let name = match ladder {
                true => family.name.clone(),
                false => single_name(family.rows[0], rows),
            };
            draw(&mut chart, family.look, name, &points, ladder, floor);
            for row in &family.rows {
                if let Some((x, y)) = timed(row) {
                    let beaten = of.iter().filter(|o| o.engine == row.engine).any(|o| {
                        timed(o).is_some_and(|(t, e)| t <= x && e <= y && (t, e) != (x, y))
                    });
                    let text = match ladder {
                        true => fraction(row.dt_s),
                        false => point_text(row, rows),
                    };
                    let y = if y > 0.0 { y } else { floor };
                    labels.push((beaten, PointLabel { x, y, text }));
                }
            }
        }
        labels.sort_by_key(|(beaten, _)| *beaten);
        chart.labels = labels.into_iter().map(|(_, label)| label).collect();
        charts.push(chart);
    }
    charts
}

/// Error against step length with the observed order, of the closed forms and of penetration: a
/// chart a measure, a line a setting with three steps or more.
pub fn convergence(rows: &[ResultRow]) -> Vec<Chart> {
    let energy = |r: &ResultRow| r.measure.starts_with("energy");
    against_step(rows, |r| {
        (r.reference == "closed form" && !energy(r)) || r.measure == "penetration"
    })
}

/// Every measure whose name starts with `energy` against step length, drawn as [`convergence`].
pub fn energy(rows: &[ResultRow]) -> Vec<Chart> {
    against_step(rows, |r| r.measure.starts_with("energy"))
}

fn against_step(rows: &[ResultRow], wanted: impl Fn(&ResultRow) -> bool) -> Vec<Chart> {
    let mut charts: Vec<Chart> = Vec::new();
    for measure in drawable(rows) {
        let of: Vec<&ResultRow> = rows.iter().filter(|r| r.measure == measure).collect();
        let families: Vec<Family> = families(rows, &measure)
            .into_iter()
            .filter(|f| f.rows.len() > 2)
            .collect();
        if !wanted(of[0]) || families.is_empty() {
            continue;
        }
        let mut chart = Chart::new(
            title(of[0]),
            Axis::log("step length [s]"),
            Axis::log(axis_label(of[0])),
        );
        if charts.is_empty() {
            chart.subtitle = format!(
                "Observed order by least squares, with its standard error. {}",
                settings(rows)
            );
        }
        let shown: Vec<&ResultRow> = families.iter().flat_map(|f| f.rows.clone()).collect();
        let floor = floor(&shown, &mut chart);
        for family in families {
            let points: Vec<(f64, f64)> = family.rows.iter().map(|r| (r.dt_s, r.value)).collect();
            let name = match observed_order(&points) {
                Some((order, error)) if error < 0.5 => {
                    format!("{}, order {order:.2} ± {error:.2}", family.name)
                }
                _ => format!("{}, no clear order", family.name),
            };
            draw(&mut chart, family.look, name, &points, true, floor);
        }
        charts.push(chart);
    }
    charts
}

/// Measures, in the order of the rows, of which some value can stand on a log axis.
fn drawable(rows: &[ResultRow]) -> Vec<String> {
    let mut measures: Vec<String> = Vec::new();
    for row in rows.iter().filter(|r| r.value > 0.0 && r.value.is_finite()) {
        if !measures.contains(&row.measure) {
            measures.push(row.measure.clone());
        }
    }
    measures
}

fn title(row: &ResultRow) -> String {
    format!("{}: {}", row.scene, row.measure)
}

fn axis_label(row: &ResultRow) -> String {
    match row.unit.as_str() {
        "1" => format!("{} [-]", row.measure),
        unit => format!("{} [{unit}]", row.measure),
    }
}

/// Where zeros are drawn: on a line of their own, a decade below the least positive value.
fn floor(rows: &[&ResultRow], chart: &mut Chart) -> f64 {
    let least = rows
        .iter()
        .map(|r| r.value)
        .filter(|v| *v > 0.0)
        .fold(f64::INFINITY, f64::min);
    let floor = 10f64.powf(least.log10().floor() - 1.0);
    if rows.iter().any(|r| r.value == 0.0) {
        chart.lines.push(HLine {
            value: floor,
            label: "0".to_owned(),
        });
    }
    floor
}

/// Adds `points` under one look: joined where positive, on the floor where 0.
fn draw(
    chart: &mut Chart,
    look: usize,
    mut name: String,
    points: &[(f64, f64)],
    joined: bool,
    floor: f64,
) {
    // single points of one engine share a line of the legend
    if !joined && chart.series.iter().any(|s| s.name == name) {
        name.clear();
    }
    let style = if joined {
        Style::LinePoints
    } else {
        Style::Points
    };
    let mut add = |points: Vec<(f64, f64)>, style: Style| {
        let mut series = Series::new(std::mem::take(&mut name), style, points);
        series.colour = Colour::Palette(look);
        chart.series.push(series);
    };
    for run in points.split(|p| p.1 == 0.0).filter(|run| !run.is_empty()) {
        add(run.to_vec(), style);
    }
    let zeros: Vec<(f64, f64)> = points
        .iter()
        .filter(|p| p.1 == 0.0)
        .map(|p| (p.0, floor))
        .collect();
    if !zeros.is_empty() {
        add(zeros, Style::Points);
    }
}

/// Time and error; a failed point keeps its NaN, one that was not timed has no place.
fn timed(row: &ResultRow) -> Option<(f64, f64)> {
    match row.seconds_per_simulated_second {
        Some(time) => Some((time, row.value)),
        None => row.value.is_nan().then_some((f64::NAN, f64::NAN)),
    }
}

/// What is drawn in one colour: ours by scheme and setting, peers by engine.
fn kind(row: &ResultRow, rows: &[ResultRow]) -> String {
    let mut words = vec![row.engine.clone()];
    if !row.scheme.is_empty() {
        words.push(row.scheme.clone());
        words.extend(own_parts(row, rows).into_iter().map(str::to_owned));
    }
    words.join(" ")
}

/// The parts of a row's setting that not every row of its engine and scheme has.
fn own_parts<'a>(row: &'a ResultRow, rows: &[ResultRow]) -> Vec<&'a str> {
    let like = |r: &&ResultRow| r.engine == row.engine && r.scheme == row.scheme;
    let common = |part: &str| {
        let has = |r: &ResultRow| r.setting.split(", ").any(|p| p == part);
        rows.iter().filter(like).all(has)
    };
    row.setting.split(", ").filter(|p| !common(p)).collect()
}

fn families<'a>(rows: &'a [ResultRow], measure: &str) -> Vec<Family<'a>> {
    let mut kinds: Vec<String> = Vec::new();
    let mut families: Vec<Family> = Vec::new();
    for row in rows {
        let kind = kind(row, rows);
        let look = kinds.iter().position(|k| *k == kind).unwrap_or(kinds.len());
        if look == kinds.len() {
            kinds.push(kind.clone());
        }
        if row.measure != measure {
            continue;
        }
        let key = |r: &'a ResultRow| (&r.engine, &r.scheme, &r.solver, &r.setting);
        match families.iter_mut().find(|f| key(f.rows[0]) == key(row)) {
            Some(family) => family.rows.push(row),
            None => families.push(Family {
                look,
                name: match row.scheme.is_empty() {
                    true => [vec![row.engine.as_str()], own_parts(row, rows)]
                        .concat()
                        .join(", "),
                    false => kind,
                },
                rows: vec![row],
            }),
        }
    }
    for family in &mut families {
        family.rows.sort_by(|a, b| b.dt_s.total_cmp(&a.dt_s));
    }
    families
}

/// What every engine has in common over its points.
fn settings(rows: &[ResultRow]) -> String {
    let mut texts: Vec<String> = Vec::new();
    for row in rows {
        let own = own_parts(row, rows);
        let common: Vec<&str> = row
            .setting
            .split(", ")
            .filter(|p| !own.contains(p))
            .collect();
        let text = format!("{}: {}.", row.engine, common.join(", "));
        if !common.is_empty() && !texts.contains(&text) {
            texts.push(text);
        }
    }
    texts.join(" ")
}

/// A step length as people write it.
fn fraction(dt: f64) -> String {
    let per_second = dt.recip().round();
    if (dt * per_second - 1.0).abs() < 1e-9 {
        format!("1/{per_second}")
    } else {
        format!("{} s", number(dt, 3))
    }
}

/// The numbers that tell a point of a sweep, in the order that [`single_name`] explains.
fn point_text(row: &ResultRow, rows: &[ResultRow]) -> String {
    let parts = own_parts(row, rows);
    let numbers = parts.iter().map(|p| p.split(' ').next().unwrap_or(p));
    [fraction(row.dt_s)]
        .into_iter()
        .chain(numbers.map(str::to_owned))
        .collect::<Vec<_>>()
        .join(" · ")
}

/// Legend of single points: what the numbers of their labels are.
fn single_name(row: &ResultRow, rows: &[ResultRow]) -> String {
    let parts = own_parts(row, rows);
    let words = parts.iter().filter_map(|p| p.split(' ').nth(1));
    let explained: Vec<&str> = ["step"].into_iter().chain(words).collect();
    format!("{}: {}", row.engine, explained.join(" · "))
}
