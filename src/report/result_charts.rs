//! Work-precision, convergence and energy, from the rows of `results.csv` alone.

use super::axis::Axis;
use super::chart::{Chart, Colour, Dash, HLine, PointLabel, Series, Style};
use super::csv_rows::ResultRow;
use super::domination::{OURS, front};
use super::order::observed_order;
use super::table::{number, step_length};

/// Errors, relative or in SI units, below which only round-off is left.
const ROUND_OFF: f64 = 1e-12;
/// Standard error above which an order is not reported.
const UNCLEAR: f64 = 0.4;
/// Of the palette: black.
const FRONT: usize = 6;
/// Failed points of a kind that are named beneath a picture.
const LISTED: usize = 8;

/// Solved rows that differ only in their step length, in the order of the step length.
struct Family<'a> {
    /// Index of the palette: one for each engine and scheme.
    look: usize,
    measure: &'a str,
    name: String,
    rows: Vec<&'a ResultRow>,
}

/// Error against wall time: one chart for each measure that is not 0 everywhere.
///
/// A line joins three or more points that differ only in their step length. All others are single
/// points of their engine. The label of a point has the settings that distinguish it from the others
/// of its engine. Points that no point of the same engine beats in both error and time are labelled
/// first. Stairs show the Pareto fronts of our points and of those of the peers. Points that failed
/// or are marked unsolved are not drawn; notes below the chart list them with the cause. A measure
/// without drawable points has no chart.
///
/// # Arguments
/// - `rows`: rows of one scene. A row without a time is not drawn.
pub fn work_precision(rows: &[ResultRow]) -> Vec<Chart> {
    let mut charts: Vec<Chart> = Vec::new();
    let families = families(rows);
    for measure in drawable(rows.iter().filter(solved)) {
        let all = rows.iter().filter(|r| r.measure == measure);
        let of: Vec<&ResultRow> = all.clone().filter(solved).collect();
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
        for family in families.iter().filter(|f| f.measure == measure) {
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
                        true => step_length(row.dt_s),
                        false => point_text(row, rows),
                    };
                    let y = if y > 0.0 { y } else { floor };
                    labels.push((beaten, PointLabel { x, y, text }));
                }
            }
        }
        labels.sort_by_key(|(beaten, _)| *beaten);
        chart.labels = labels.into_iter().map(|(_, label)| label).collect();
        add_fronts(&mut chart, &of, floor);
        chart.lines.extend(error_bar(of[0]));
        chart.notes = failures(all, rows);
        charts.push(chart);
    }
    charts
}

/// An unsolved point is not drawn, however small its error.
fn solved(row: &&ResultRow) -> bool {
    row.verdict != "unsolved"
}

/// Draws the Pareto front of each side that has more than one point, below all other series.
fn add_fronts(chart: &mut Chart, of: &[&ResultRow], floor: f64) {
    for (ours, name, dash) in [
        (false, "front of the peers", Dash::Dotted),
        (true, "front of ours", Dash::Solid),
    ] {
        let side = of.iter().filter(|r| (r.engine == OURS) == ours);
        let points: Vec<(f64, f64)> = side.filter_map(|r| timed(r)).collect();
        if points.len() > 1 {
            let mut stairs = front(&points);
            for point in stairs.iter_mut().filter(|p| p.1 == 0.0) {
                point.1 = floor;
            }
            let mut series = Series::new(name, Style::Step, stairs);
            series.colour = Colour::Palette(FRONT);
            series.dash = dash;
            chart.series.insert(0, series);
        }
    }
}

/// The error of a computed reference, from its text `self-converged ±1e-6 ...`.
fn error_bar(row: &ResultRow) -> Option<HLine> {
    let (_, text) = row.reference.split_once('±')?;
    let value: f64 = text.split(' ').next()?.parse().ok()?;
    (value > 0.0).then(|| HLine {
        value,
        label: format!("reference ±{}", number(value, 2)),
    })
}

/// One sentence for each engine, scheme and kind of failure.
fn failures<'a>(of: impl Iterator<Item = &'a ResultRow>, rows: &[ResultRow]) -> Vec<String> {
    let mut groups: Vec<(String, Vec<String>)> = Vec::new();
    for row in of {
        let how = match row.verdict.as_str() {
            "" if row.value.is_nan() => "failed",
            "" => continue,
            "unsolved" if row.mode.is_empty() => "not drawn as islands were left unsolved",
            _ if row.mode.is_empty() => &row.verdict,
            _ => &row.mode,
        };
        let who = format!("{}, {how}", kind(row, rows));
        let which = point_text(row, rows);
        match groups.iter_mut().find(|(known, _)| *known == who) {
            Some((_, list)) => list.push(which),
            None => groups.push((who, vec![which])),
        }
    }
    let sentence = |(who, list): (String, Vec<String>)| {
        let shown = list.len().min(LISTED);
        let more = match list.len() - shown {
            0 => String::new(),
            n => format!("; and {n} more"),
        };
        format!("{who}: {}{more}", list[..shown].join("; "))
    };
    groups.into_iter().map(sentence).collect()
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
    let families = families(rows);
    let ladders: Vec<&Family> = families.iter().filter(|f| f.rows.len() > 2).collect();
    let shown = ladders.iter().flat_map(|f| f.rows.iter().copied());
    for measure in drawable(shown.clone()) {
        let of: Vec<&ResultRow> = shown.clone().filter(|r| r.measure == measure).collect();
        let all = rows.iter().filter(|r| r.measure == measure);
        if !wanted(of[0]) {
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
        let floor = floor(&of, &mut chart);
        for family in ladders.iter().filter(|f| f.measure == measure) {
            let points: Vec<(f64, f64)> = family.rows.iter().map(|r| (r.dt_s, r.value)).collect();
            let name = format!("{}, {}", family.name, order_text(&points));
            draw(&mut chart, family.look, name, &points, true, floor);
        }
        chart.notes = failures(all.filter(|r| !solved(r)), rows);
        charts.push(chart);
    }
    charts
}

/// Text of the observed order, if it can be determined; errors of round-off alone have no order.
fn order_text(points: &[(f64, f64)]) -> String {
    if points.iter().all(|p| p.1 == 0.0) {
        return "0".to_owned();
    }
    if points.iter().all(|p| p.1 < ROUND_OFF) {
        return format!("below {ROUND_OFF:e}");
    }
    match observed_order(points) {
        Some((order, error)) if error < UNCLEAR => {
            format!("order {order:.2} ± {error:.2}").replace('-', "−")
        }
        _ => "no clear order".to_owned(),
    }
}

/// Measures, in the order of the rows, of which some value can stand on a log axis.
fn drawable<'a>(rows: impl Iterator<Item = &'a ResultRow>) -> Vec<&'a str> {
    let mut measures: Vec<(&str, bool)> = Vec::new();
    for row in rows {
        let stands = row.value > 0.0 && row.value.is_finite();
        match measures.iter_mut().find(|(name, _)| *name == row.measure) {
            Some((_, drawable)) => *drawable |= stands,
            None => measures.push((&row.measure, stands)),
        }
    }
    let kept = measures.into_iter().filter(|(_, drawable)| *drawable);
    kept.map(|(name, _)| name).collect()
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

/// Where zeros are drawn: a decade below the least positive value.
fn floor(rows: &[&ResultRow], chart: &mut Chart) -> f64 {
    let least = rows
        .iter()
        .map(|r| r.value)
        .filter(|v| *v > 0.0)
        .fold(f64::INFINITY, f64::min);
    let floor = 10f64.powf(least.log10().floor() - 1.0);
    if rows.iter().any(|r| r.value == 0.0) {
        chart.zero = Some(floor);
    }
    floor
}

/// Adds `points` in one colour and marker: joined by a line where positive, on the floor where 0.
///
/// Lines are drawn in their order, markers over them in the reverse order, so that of lines and
/// points that lie on each other all can be seen; the name goes to the legend with a series that
/// has no points.
fn draw(
    chart: &mut Chart,
    look: usize,
    name: String,
    points: &[(f64, f64)],
    joined: bool,
    floor: f64,
) {
    let series = |name: &str, points: Vec<(f64, f64)>, style: Style| {
        let mut series = Series::new(name, style, points);
        series.colour = Colour::Palette(look);
        series.dash = [Dash::Solid, Dash::Dashed][look % 2];
        series
    };
    let mut lines = chart.series.partition_point(|s| s.style == Style::Line);
    let mut markers: Vec<(f64, f64)> = points.to_vec();
    if joined {
        for run in points.split(|p| p.1 == 0.0).filter(|run| !run.is_empty()) {
            chart
                .series
                .insert(lines, series("", run.to_vec(), Style::Line));
            lines += 1;
        }
        // a point that failed is counted once, with its line
        markers.retain(|p| p.1.is_finite());
    }
    for point in markers.iter_mut().filter(|p| p.1 == 0.0) {
        point.1 = floor;
    }
    chart
        .series
        .insert(lines, series("", markers, Style::Points));
    // single points of one engine share a line of the legend
    if !chart.series.iter().any(|s| s.name == name) {
        let style = if joined {
            Style::LinePoints
        } else {
            Style::Points
        };
        chart.series.push(series(&name, Vec::new(), style));
    }
}

/// Time and error of a point; `None` if it failed or was not timed.
fn timed(row: &ResultRow) -> Option<(f64, f64)> {
    let time = row.seconds_per_simulated_second?;
    row.value.is_finite().then_some((time, row.value))
}

/// What is drawn in one colour: ours by scheme and setting, whatever the tolerance; peers by
/// engine.
fn kind(row: &ResultRow, rows: &[ResultRow]) -> String {
    let mut words = vec![row.engine.clone()];
    if !row.scheme.is_empty() {
        words.push(row.scheme.clone());
        let parts = own_parts(row, rows).into_iter();
        let words_alone = parts.filter(|part| value_and_word(part).1.is_empty());
        words.extend(words_alone.map(str::to_owned));
    }
    words.join(" ")
}

/// "500 Hz" and "tolerance 1e-8" in value and word; what holds no number is all value.
fn value_and_word(part: &str) -> (&str, &str) {
    match part.split_once(' ') {
        Some((value, word)) if value.parse::<f64>().is_ok() => (value, word),
        Some((word, value)) if value.parse::<f64>().is_ok() => (value, word),
        _ => (part, ""),
    }
}

/// The solver, where not all rows of its engine and scheme have the same.
fn own_solver<'a>(row: &'a ResultRow, rows: &[ResultRow]) -> Option<&'a str> {
    let mut like = rows
        .iter()
        .filter(|r| r.engine == row.engine && r.scheme == row.scheme);
    like.any(|r| r.solver != row.solver)
        .then_some(row.solver.as_str())
}

/// The settings that distinguish a point from others of its kind, as value and word.
fn distinguishing<'a>(row: &'a ResultRow, rows: &[ResultRow]) -> Vec<(&'a str, &'a str)> {
    let parts = own_parts(row, rows).into_iter().map(value_and_word);
    let mut all: Vec<(&str, &str)> = parts.filter(|(_, word)| !word.is_empty()).collect();
    all.extend(own_solver(row, rows).map(|solver| (solver, "solver")));
    all
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

/// As [`distinguishing`], in the words of the setting.
fn apart_words<'a>(row: &'a ResultRow, rows: &[ResultRow]) -> Vec<&'a str> {
    let parts = own_parts(row, rows).into_iter();
    let mut all: Vec<&str> = parts
        .filter(|part| !value_and_word(part).1.is_empty())
        .collect();
    all.extend(own_solver(row, rows));
    all
}

fn families(rows: &[ResultRow]) -> Vec<Family<'_>> {
    let mut kinds: Vec<String> = Vec::new();
    let mut families: Vec<Family> = Vec::new();
    for row in rows {
        let kind = kind(row, rows);
        let look = kinds.iter().position(|k| *k == kind).unwrap_or(kinds.len());
        if look == kinds.len() {
            kinds.push(kind.clone());
        }
        let same = |r: &ResultRow| {
            (&r.measure, &r.engine, &r.scheme, &r.solver, &r.setting)
                == (
                    &row.measure,
                    &row.engine,
                    &row.scheme,
                    &row.solver,
                    &row.setting,
                )
        };
        match families.iter_mut().find(|f| same(f.rows[0])) {
            Some(family) => family.rows.push(row),
            None => families.push(Family {
                look,
                measure: &row.measure,
                name: [vec![kind.as_str()], apart_words(row, rows)]
                    .concat()
                    .join(", "),
                rows: vec![row],
            }),
        }
    }
    for family in &mut families {
        family.rows.retain(solved);
        family.rows.sort_by(|a, b| b.dt_s.total_cmp(&a.dt_s));
    }
    families.retain(|family| !family.rows.is_empty());
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

/// The step and what else tells a point of a sweep, in the order that [`single_name`] explains.
fn point_text(row: &ResultRow, rows: &[ResultRow]) -> String {
    let step = step_length(row.dt_s);
    let values = distinguishing(row, rows)
        .into_iter()
        .map(|(value, _)| value);
    let all: Vec<&str> = [step.as_str()].into_iter().chain(values).collect();
    all.join(" · ")
}

/// Legend of single points: what the parts of their labels are.
fn single_name(row: &ResultRow, rows: &[ResultRow]) -> String {
    let words = distinguishing(row, rows).into_iter().map(|(_, word)| word);
    let explained: Vec<&str> = ["step"].into_iter().chain(words).collect();
    format!("{}: {}", kind(row, rows), explained.join(" · "))
}
