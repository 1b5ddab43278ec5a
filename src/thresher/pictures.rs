use super::rows::{LifeRow, ProfileRow, WearRow};
use crate::report::{
    Axis, Chart, Colour, HLine, Mark, PointLabel, ReportError, Series, Style, number, plus_minus,
};
use serde::{Deserialize, Serialize};

const MM: f64 = 1e3;
/// Most times in a picture: the same times in all pictures of a run.
const TIMES: usize = 9;

/// Tooth height of one bar at one time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeightPoint {
    pub hours: f64,
    pub bar: u32,
    /// In m.
    pub height: f64,
}

/// A tooth height at which something must be done.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeightLimit {
    /// As in [`LifeRow::limit`].
    pub name: String,
    /// In m.
    pub height: f64,
}

/// The worn profile of one bar on its base, at up to 9 times with the first and the last, light to
/// dark. The subtitle says if times are left out.
///
/// # Arguments
/// - `rows`: any order of times; nodes in order within one.
/// - `bar`: the bar drawn.
/// - `base_depth`: height of the base under y = 0 in m, 0 for none.
/// - `subtitle`: the scene and its settings.
///
/// # Errors
/// `ReportError::EmptyChart` where the bar has no rows; `ReportError::Chart` where a time is not
/// finite.
pub fn worn_profile(
    rows: &[ProfileRow],
    bar: u32,
    base_depth: f64,
    subtitle: &str,
) -> Result<Chart, ReportError> {
    let mut chart = Chart::new(
        "Worn profile of the tooth",
        Axis::linear("along the base [mm]"),
        Axis::linear("height above the base [mm]"),
    );
    chart.equal_aspect = true;
    let rows: Vec<&ProfileRow> = rows.iter().filter(|r| r.bar == bar).collect();
    let times = drawn_times(rows.iter().map(|r| r.hours), subtitle, &mut chart)?;
    let low = rows.iter().map(|r| r.x_m).fold(f64::INFINITY, f64::min);
    let high = rows.iter().map(|r| r.x_m).fold(f64::NEG_INFINITY, f64::max);
    if base_depth > 0.0 && low < high {
        let corners = [
            (low, -base_depth),
            (high, -base_depth),
            (high, 0.0),
            (low, 0.0),
        ];
        chart.series.push(Series::new(
            "base",
            Style::Body,
            corners.map(|(x, y)| (MM * x, MM * y)).to_vec(),
        ));
    }
    family(&mut chart, &times, Style::Line, |hours| {
        let at = rows.iter().filter(|r| r.hours == hours);
        at.map(|r| (MM * r.x_m, MM * r.y_m)).collect()
    });
    Ok(chart)
}

/// Worn depth of the cells of one bar along its base at the times of [`worn_profile`], light to
/// dark.
///
/// # Arguments
/// - `rows`: any order of times; cells in order within one.
/// - `bar`: the bar drawn.
/// - `subtitle`: the scene and its settings.
///
/// # Errors
/// As [`worn_profile`].
pub fn depth_per_cell(rows: &[WearRow], bar: u32, subtitle: &str) -> Result<Chart, ReportError> {
    let mut chart = Chart::new(
        "Wear depth along the tooth",
        Axis::linear("along the base, cells as of the new tooth [mm]"),
        Axis::linear("worn depth [mm]"),
    );
    let rows: Vec<&WearRow> = rows.iter().filter(|r| r.bar == bar).collect();
    let times = drawn_times(rows.iter().map(|r| r.hours), subtitle, &mut chart)?;
    family(&mut chart, &times, Style::LinePoints, |hours| {
        let at = rows.iter().filter(|r| r.hours == hours);
        at.map(|r| (MM * r.x_m, MM * r.depth_m)).collect()
    });
    // where cells are, by their number in the files
    let last = rows
        .iter()
        .filter(|r| Some(r.hours) == times.last().copied());
    chart
        .labels
        .extend(last.filter(|r| r.cell % 5 == 1).map(|r| PointLabel {
            x: MM * r.x_m,
            y: MM * r.depth_m,
            text: format!("cell {}", r.cell),
        }));
    Ok(chart)
}

/// Tooth heights from profiles: the highest node of each bar at each time, in the order of the
/// rows. Rows that are not finite are left out.
pub fn heights(rows: &[ProfileRow]) -> Vec<HeightPoint> {
    let mut points: Vec<HeightPoint> = Vec::new();
    for row in rows
        .iter()
        .filter(|r| r.hours.is_finite() && r.y_m.is_finite())
    {
        // Rows come in blocks of one bar and time.
        match points.last_mut() {
            Some(p) if p.bar == row.bar && p.hours == row.hours => p.height = p.height.max(row.y_m),
            _ => points.push(HeightPoint {
                hours: row.hours,
                bar: row.bar,
                height: row.y_m,
            }),
        }
    }
    points
}

/// Tooth height against hours, with the limits and when they are crossed.
///
/// # Arguments
/// - `points`: times ascending within a bar.
/// - `limits`: drawn as lines, such as 6 mm, "unfit".
/// - `life`: crossings, drawn with error bars on the limit of the same name; for each limit the
///   first in time. One of a limit that is not listed, such as a machine that no longer conveys, is
///   drawn on the curve of its bar, and left out where the curve does not reach it.
/// - `subtitle`: the scene and its settings.
///
/// The chart has no series, and so cannot be drawn, where `points` is empty.
pub fn tooth_height(
    points: &[HeightPoint],
    limits: &[HeightLimit],
    life: &[LifeRow],
    subtitle: &str,
) -> Chart {
    let mut chart = Chart::new(
        "Tooth height",
        Axis::linear("operating time [h]"),
        Axis::linear("tooth height [mm]"),
    );
    chart.subtitle = subtitle.into();
    let mut bars: Vec<u32> = points.iter().map(|p| p.bar).collect();
    bars.sort_unstable();
    bars.dedup();
    for &bar in &bars {
        let own = points.iter().filter(|p| p.bar == bar);
        let name = match bars.len() {
            1 => "tooth height".to_owned(),
            _ => format!("bar {bar}"),
        };
        let values = own.map(|p| (p.hours, MM * p.height)).collect();
        chart.series.push(Series::new(name, Style::Line, values));
    }
    let mark = |row: &LifeRow, height: f64| Mark {
        x: row.hours,
        y: MM * height,
        x_error: row.error_hours,
        label: match bars.len() {
            0 | 1 => crossing(row),
            _ => format!("{} (bar {})", crossing(row), row.bar),
        },
    };
    for limit in limits {
        chart.lines.push(HLine {
            value: MM * limit.height,
            label: format!("{} mm: {}", trimmed(MM * limit.height), limit.name),
        });
        let crossings = life
            .iter()
            .filter(|r| r.limit == limit.name && r.hours.is_finite());
        if let Some(first) = crossings.min_by(|a, b| a.hours.total_cmp(&b.hours)) {
            chart.marks.push(mark(first, limit.height));
        }
    }
    for row in life {
        let listed = limits.iter().any(|limit| limit.name == row.limit);
        let own: Vec<&HeightPoint> = points.iter().filter(|p| p.bar == row.bar).collect();
        if let Some(height) = height_at(&own, row.hours).filter(|_| !listed) {
            chart.marks.push(mark(row, height));
        }
    }
    chart
}

/// Height at a time between two points \[m\].
fn height_at(points: &[&HeightPoint], hours: f64) -> Option<f64> {
    let pair = (points.windows(2)).find(|p| (p[0].hours..=p[1].hours).contains(&hours))?;
    let (a, b) = (pair[0], pair[1]);
    let share = (hours - a.hours) / (b.hours - a.hours);
    Some(a.height + share * (b.height - a.height)).filter(|h| h.is_finite())
}

/// "unfit: 61.2 ± 0.8 h".
fn crossing(row: &LifeRow) -> String {
    format!(
        "{}: {} h",
        row.limit,
        plus_minus(row.hours, row.error_hours)
    )
}

/// A number without trailing zeros.
fn trimmed(value: f64) -> String {
    let text = number(value, 3);
    match text.contains('.') && !text.contains('e') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// One curve per time, coloured along the ramp by its time.
fn family(chart: &mut Chart, times: &[f64], style: Style, points: impl Fn(f64) -> Vec<(f64, f64)>) {
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
        return;
    };
    for &hours in times {
        let name = match hours {
            0.0 => "new".to_owned(),
            _ => format!("{} h", number(hours, 3)),
        };
        let mut series = Series::new(name, style, points(hours));
        let span = last - first;
        series.colour = Colour::Ramp(if span > 0.0 {
            (hours - first) / span
        } else {
            1.0
        });
        chart.series.push(series);
    }
}

/// The times to draw, by [`thinned`]; the chart's subtitle says how many of how many.
fn drawn_times(
    hours: impl Iterator<Item = f64>,
    subtitle: &str,
    chart: &mut Chart,
) -> Result<Vec<f64>, ReportError> {
    let all = distinct(hours, chart)?;
    let drawn = thinned(&all, TIMES);
    chart.subtitle = subtitle.to_owned();
    if drawn.len() < all.len() {
        let gap = if subtitle.is_empty() { "" } else { "; " };
        chart.subtitle += &format!("{gap}{} of {} times", drawn.len(), all.len());
    }
    Ok(drawn)
}

/// The distinct times, ascending.
fn distinct(hours: impl Iterator<Item = f64>, chart: &Chart) -> Result<Vec<f64>, ReportError> {
    let mut times: Vec<f64> = hours.collect();
    let refused = |error: fn(String) -> ReportError| error(chart.title.clone());
    if times.is_empty() {
        return Err(refused(|title| ReportError::EmptyChart {
            title,
            skipped: 0,
        }));
    }
    if times.iter().any(|t| !t.is_finite()) {
        return Err(refused(|title| ReportError::Chart {
            title,
            reason: "a row's hours are not finite".into(),
        }));
    }
    times.sort_by(f64::total_cmp);
    times.dedup();
    Ok(times)
}

/// At most `most` of ascending times, as evenly spaced in time as possible, with both ends.
fn thinned(times: &[f64], most: usize) -> Vec<f64> {
    if times.len() <= most {
        return times.to_vec();
    }
    let (first, last) = (times[0], times[times.len() - 1]);
    let mut drawn: Vec<f64> = (0..most)
        .map(|i| {
            let wanted = first + (last - first) * i as f64 / (most - 1) as f64;
            let next = times
                .partition_point(|&t| t < wanted)
                .clamp(1, times.len() - 1);
            let (a, b) = (times[next - 1], times[next]);
            if wanted - a <= b - wanted { a } else { b }
        })
        .collect();
    drawn.dedup();
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 41 times of a tooth that loses its top and a scar, two bars.
    fn profile() -> Vec<ProfileRow> {
        let mut rows = Vec::new();
        for (time, bar) in (0..=40).flat_map(|t| [(t, 1), (t, 2)]) {
            for node in 0..26 {
                let x = 0.002 * f64::from(node);
                rows.push(ProfileRow {
                    cycles: 1e5 * f64::from(time),
                    hours: 1.7 * f64::from(time),
                    bar,
                    node: node + 1,
                    x_m: x,
                    y_m: 0.0188 - 0.1014 * x - 5.539 * x * x - 1e-4 * f64::from(time),
                });
            }
        }
        rows
    }

    #[test]
    fn profile_is_in_millimetres_and_thinned_with_both_ends() {
        let chart = worn_profile(&profile(), 2, 0.008, "").unwrap();
        assert!(chart.equal_aspect);
        let curves: Vec<&Series> = chart
            .series
            .iter()
            .filter(|s| s.style == Style::Line)
            .collect();
        assert_eq!(curves.len(), TIMES);
        assert_eq!(chart.subtitle, "9 of 41 times");
        assert_eq!(
            (curves[0].name.as_str(), curves[8].name.as_str()),
            ("new", "68.0 h")
        );
        assert_eq!(curves[0].points.len(), 26);
        // one rounding in the profile, one in the unit
        assert!((curves[0].points[0].1 - 18.8).abs() < 1e-13);
        assert_eq!(chart.series[0].points[0], (0.0, -8.0), "the base");
        let svg = chart.to_svg().unwrap();
        let named = |c: &&Series| svg.contains(&c.name);
        assert_eq!(curves.iter().copied().filter(named).count(), TIMES);
    }

    #[test]
    fn crossing_is_marked_on_its_limit_with_its_error() {
        let limits = [HeightLimit {
            name: "unfit".into(),
            height: 0.006,
        }];
        let life = |hours, error_hours| LifeRow {
            limit: "unfit".into(),
            hours,
            cycles: 3e6,
            error_hours,
            bar: 1,
            cell: 3,
        };
        let points = heights(&profile());
        assert_eq!(points.len(), 82);
        let rows = [life(70.0, 1.0), life(61.2345, 1.83), life(f64::NAN, 1.0)];
        let chart = tooth_height(&points, &limits, &rows, "");
        assert_eq!(chart.series.len(), 2);
        assert_eq!(chart.lines[0].label, "6 mm: unfit");
        let mark = &chart.marks[0];
        assert_eq!((mark.x, mark.y, mark.x_error), (61.2345, 6.0, 1.83));
        assert_eq!(mark.label, "unfit: 61.2 ± 1.8 h (bar 1)");
        // a limit without a height lies on the curve of its bar
        let stops = |hours| LifeRow {
            limit: "stops".into(),
            ..life(hours, 2.0)
        };
        let rows = [stops(f64::NAN), stops(1e3), stops(0.85)];
        let chart = tooth_height(&points, &limits, &rows, "");
        let [mark] = &chart.marks[..] else {
            panic!("{:?}", chart.marks)
        };
        let [a, b] =
            [0, 1].map(|k| 1e3 * points.iter().filter(|p| p.bar == 1).nth(k).unwrap().height);
        assert!(
            (mark.y - 0.5 * (a + b)).abs() < 1e-12 && mark.x == 0.85,
            "{mark:?} {a} {b}"
        );
        assert_eq!(crossing(&life(61.2345, 12.0)), "unfit: 61 ± 12 h");
        assert_eq!(crossing(&life(61.2345, 0.0)), "unfit: 61.23 h");
    }

    #[test]
    fn depth_needs_rows_of_the_bar_and_finite_hours() {
        let row = |hours| WearRow {
            cycles: 1.0,
            hours,
            bar: 1,
            cell: 1,
            x_m: 0.002,
            depth_m: 0.00762,
            load_slip_nm_per_cycle: 1.0,
        };
        let chart = depth_per_cell(&[row(2.0)], 1, "").unwrap();
        assert_eq!(chart.series[0].points, [(2.0, 7.62)]);
        assert!(matches!(
            depth_per_cell(&[row(2.0)], 2, ""),
            Err(ReportError::EmptyChart { .. })
        ));
        assert!(matches!(
            depth_per_cell(&[row(f64::NAN)], 1, ""),
            Err(ReportError::Chart { .. })
        ));
    }

    /// Small jumps at the start of a life do not crowd the picture.
    #[test]
    fn times_are_even_in_time_not_in_number() {
        let many = (0..100).map(|i| 0.01 * f64::from(i)).chain([50.0, 100.0]);
        let many: Vec<f64> = many.collect();
        assert_eq!(thinned(&many, 5), [0.0, 0.99, 50.0, 100.0]);
        assert_eq!(thinned(&many[98..], 5), many[98..]);
    }
}
