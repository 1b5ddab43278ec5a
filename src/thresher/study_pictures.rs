//! The picture of the study's table.

use super::rows::ComparisonRow;
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
