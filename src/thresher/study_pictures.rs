//! The pictures of the study's tables.

use super::rows::{ComparisonRow, FrictionDepthRow, FrictionRow};
use super::study_friction::ALSO;
use crate::report::{Axis, Chart, Colour, Series, Style};

/// Micrometre to millimetre.
const MM: f64 = 1e-3;

/// Depth over speed, a line for each torque, with the published points in the same colour.
///
/// # Arguments
/// - `rows`: any order of torques; speeds in order within one.
/// - `subtitle`: the reading and its settings.
///
/// The chart has no series, and so cannot be drawn, where `rows` is empty.
pub fn depth_over_speed(rows: &[ComparisonRow], subtitle: &str) -> Chart {
    let mut chart = Chart::new(
        "Wear depth of the study's tooth",
        Axis::linear("speed of the cylinder [rad/s]"),
        Axis::linear("depth of the deepest cell [mm]"),
    );
    chart.subtitle = subtitle.into();
    let mut torques: Vec<f64> = rows.iter().map(|r| r.torque_nm).collect();
    torques.sort_by(|a, b| b.total_cmp(a));
    torques.dedup();
    for (k, torque) in torques.into_iter().enumerate() {
        let own = || rows.iter().filter(|r| r.torque_nm == torque);
        let published = own().map(|r| (r.omega_rad_s, MM * r.published_um));
        for (what, style, points) in [
            (
                "computed",
                Style::Line,
                own().map(|r| (r.omega_rad_s, MM * r.computed_um)).collect(),
            ),
            (
                "published",
                Style::Points,
                published.filter(|p| p.1.is_finite()).collect::<Vec<_>>(),
            ),
        ] {
            let name = format!("{what}, {torque} N m");
            let mut series = Series::new(name, style, points);
            series.colour = Colour::Palette(k);
            if !series.points.is_empty() {
                chart.series.push(series);
            }
        }
    }
    if rows.iter().any(|r| r.calibrated) {
        let words = "The contact time is fitted to one of the published points.";
        chart.notes.push(words.to_owned());
    }
    chart
}

/// Life over friction with the published lives.
///
/// # Arguments
/// - `rows`: in the order of the frictions.
/// - `subtitle`: the operating point and the reading.
pub fn life_over_friction(rows: &[FrictionRow], subtitle: &str) -> Chart {
    let mut chart = Chart::new(
        "Life of the study's tooth over friction",
        Axis::linear("friction between crop and tooth"),
        Axis::linear("hours to the first limit [h]"),
    );
    chart.subtitle = subtitle.into();
    let own = rows.iter().map(|r| (r.friction, r.life_hours));
    let line = Series::new("computed", Style::LinePoints, own.collect());
    let published = rows.iter().map(|r| (r.friction, r.published_hours));
    let mut published: Vec<(f64, f64)> = published.filter(|p| p.1.is_finite()).collect();
    if published.iter().any(|p| p.0 == ALSO.0) {
        published.push(ALSO);
        chart.notes.push(format!(
            "Of a friction of {} the study says 14 h, and {} h elsewhere; of 0.18 it prints no hours.",
            ALSO.0, ALSO.1
        ));
    }
    let points = Series::new("published", Style::Points, published);
    chart.series = vec![line, points];
    chart.series.retain(|series| !series.points.is_empty());
    chart
}

/// Depth over friction at the torques of the published ranges, with the ranges as upright bars.
///
/// # Arguments
/// - `rows`: torque by torque, in the order of the frictions.
/// - `subtitle`: the speed and the reading.
pub fn depth_over_friction(rows: &[FrictionDepthRow], subtitle: &str) -> Chart {
    let mut chart = Chart::new(
        "Wear depth of the study's tooth over friction",
        Axis::linear("friction between crop and tooth"),
        Axis::linear("depth of the deepest cell [mm]"),
    );
    chart.subtitle = subtitle.into();
    for (k, own) in rows.chunk_by(|a, b| a.torque_nm == b.torque_nm).enumerate() {
        let points = own.iter().map(|r| (r.friction, MM * r.computed_um));
        let name = format!("computed, {} N m", own[0].torque_nm);
        let mut line = Series::new(name, Style::LinePoints, points.collect());
        line.colour = Colour::Palette(k);
        chart.series.push(line);
    }
    let torque = rows.first().map_or(0.0, |row| row.torque_nm);
    let ranges = rows
        .iter()
        .filter(|r| r.torque_nm == torque && r.published_most_um.is_finite());
    for (k, row) in ranges.enumerate() {
        let ends = [row.published_least_um, row.published_most_um];
        let name = match k {
            0 => "published range, 20.87 to 54.37 N m",
            _ => "",
        };
        let points = ends.map(|depth| (row.friction, MM * depth)).into();
        let mut bar = Series::new(name, Style::LinePoints, points);
        bar.colour = Colour::Palette(6);
        chart.series.push(bar);
    }
    chart.notes.push(
        "The study does not say whether its ranges are over cells or over torques.".to_owned(),
    );
    chart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_points_stand_beside_the_line_of_their_torque() {
        let row = |torque_nm: f64, omega_rad_s: f64, published_um: f64| ComparisonRow {
            torque_nm,
            omega_rad_s,
            published_um,
            computed_um: 100.0 * omega_rad_s,
            relative_error: 0.0,
            calibrated: omega_rad_s == 70.0,
            worn_through_cycles: f64::NAN,
        };
        let rows = [
            row(20.87, 70.0, 1130.0),
            row(20.87, 75.0, f64::NAN),
            row(146.39, 70.0, 7620.0),
        ];
        let chart = depth_over_speed(&rows, "");
        let names: Vec<&str> = chart.series.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(
            names[..2],
            ["computed, 146.39 N m", "published, 146.39 N m"]
        );
        assert_eq!(chart.series[2].points, [(70.0, 7.0), (75.0, 7.5)]);
        // a depth that was not published is no point
        assert_eq!(chart.series[3].points, [(70.0, MM * 1130.0)]);
        assert_eq!(chart.series[2].colour, chart.series[3].colour);
        assert_eq!(chart.notes.len(), 1);
        assert!(chart.to_svg().is_ok());
    }
}
