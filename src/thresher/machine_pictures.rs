//! Pictures of the machine at work: torque and power over its life, load over the angle of a bar.

use super::parameters::{Hold, Thresher};
use super::rows::{BarLoadRow, OperationRow};
use crate::report::{Axis, Chart, Colour, Dash, HLine, Series, Style, number};

/// Torque of the drive over the hours, with the operating torque, and with the feed held the largest
/// torque of the drive.
///
/// The chart has no series, and so cannot be drawn, where `points` is empty.
pub fn torque_over_hours(points: &[OperationRow], p: &Thresher, subtitle: &str) -> Chart {
    let mut chart = Chart::new(
        "Torque of the drive",
        Axis::linear("operating time [h]"),
        Axis::linear("mean torque of a revolution [N m]"),
    );
    chart.subtitle = subtitle.into();
    let values = points.iter().map(|p| (p.hours, p.torque_nm)).collect();
    chart
        .series
        .push(Series::new("torque", Style::LinePoints, values));
    let line = |value: f64, what: &str| HLine {
        value,
        label: format!("{} N m: {what}", number(value, 4)),
    };
    chart
        .lines
        .push(line(p.operating_torque, "operating torque"));
    if p.hold == Hold::Feed {
        let most = p.drive_torque_factor * p.operating_torque;
        chart.lines.push(line(most, "most the drive gives"));
    }
    chart
}

/// Power of the drive and of the feeder over the hours.
///
/// The chart has no series, and so cannot be drawn, where `points` is empty.
pub fn power_over_hours(points: &[OperationRow], subtitle: &str) -> Chart {
    let mut chart = Chart::new(
        "Power of the machine",
        Axis::linear("operating time [h]"),
        Axis::linear("mean power of a revolution [kW]"),
    );
    chart.subtitle = subtitle.into();
    let of = |value: fn(&OperationRow) -> f64| {
        points.iter().map(|p| (p.hours, 1e-3 * value(p))).collect()
    };
    chart
        .series
        .push(Series::new("drive", Style::LinePoints, of(|p| p.drive_w)));
    chart
        .series
        .push(Series::new("feeder", Style::LinePoints, of(|p| p.feeder_w)));
    chart
}

/// Normal and friction force on one bar over its angle, where any bar is loaded.
///
/// # Arguments
/// - `rows`: angles in order within one name of the teeth.
/// - `arc`: start and end of the concave \[degrees\].
///
/// The chart has no series, and so cannot be drawn, where nothing is loaded.
pub fn load_over_angle(rows: &[BarLoadRow], arc: [f64; 2], subtitle: &str) -> Chart {
    let mut chart = Chart::new(
        "Load on a bar",
        Axis::linear("angle of the bar from +x, in the sense of rotation [degrees]"),
        Axis::linear("mean force on the bar [N]"),
    );
    chart.subtitle = subtitle.into();
    let loaded = || {
        rows.iter()
            .filter(|r| r.normal_n > 0.0)
            .map(|r| r.angle_deg)
    };
    let low = loaded().fold(f64::INFINITY, f64::min);
    let high = loaded().fold(f64::NEG_INFINITY, f64::max);
    let mut teeth: Vec<&str> = rows.iter().map(|r| r.teeth.as_str()).collect();
    teeth.dedup();
    for (k, teeth) in teeth.into_iter().enumerate() {
        let own = || {
            let shown = |r: &&BarLoadRow| r.teeth == teeth && (low..=high).contains(&r.angle_deg);
            rows.iter().filter(shown)
        };
        for (what, dash, points) in [
            (
                "normal",
                Dash::Solid,
                own().map(|r| (r.angle_deg, r.normal_n)).collect(),
            ),
            (
                "friction",
                Dash::Dashed,
                own()
                    .map(|r| (r.angle_deg, r.friction_n))
                    .collect::<Vec<_>>(),
            ),
        ] {
            let mut series = Series::new(format!("{what}, {teeth} teeth"), Style::Line, points);
            series.colour = Colour::Palette(k);
            series.dash = dash;
            if !series.points.is_empty() {
                chart.series.push(series);
            }
        }
    }
    chart.notes.push(format!(
        "The concave lies from {} to {} degrees.",
        number(arc[0], 3),
        number(arc[1], 3)
    ));
    chart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn load_is_drawn_where_a_bar_is_loaded() {
        let row = |teeth: &str, angle_deg: f64, normal_n: f64| BarLoadRow {
            teeth: teeth.to_owned(),
            angle_deg,
            normal_n,
            friction_n: 0.25 * normal_n,
        };
        let rows = [
            row("new", 1.0, 0.0),
            row("new", 221.0, 80.0),
            row("new", 223.0, 0.0),
            row("worn", 223.0, 100.0),
            row("worn", 359.0, 0.0),
        ];
        let chart = load_over_angle(&rows, [215.0, 325.0], "");
        let names: Vec<&str> = chart.series.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names[0], "normal, new teeth");
        assert_eq!(names[3], "friction, worn teeth");
        assert_eq!(chart.series[0].points, [(221.0, 80.0), (223.0, 0.0)]);
        assert_eq!(chart.series[3].points, [(223.0, 25.0)]);
        assert!(chart.to_svg().is_ok());
        assert!(
            load_over_angle(&rows[..1], [215.0, 325.0], "")
                .to_svg()
                .is_err()
        );
    }

    #[test]
    fn power_is_in_kilowatts() {
        let points = [0.0, 10.0].map(|hours| OperationRow {
            hours,
            torque_nm: 146.0,
            demand_nm: 146.0,
            drive_w: 10_250.0,
            feeder_w: -500.0,
            cycles: 0.0,
            speed_rad_s: 70.0,
            crop_stiffness_pa_m: 1e7,
            crop_filled: 1.0,
            crop_out_kg_s: 5.2,
            conveys: true,
        });
        let chart = power_over_hours(&points, "");
        assert_eq!(chart.series[0].points[1], (10.0, 10.25));
        assert_eq!(chart.series[1].points[0], (0.0, -0.5));
        let labels = |hold: Hold| -> Vec<String> {
            let p = Thresher {
                hold,
                ..Thresher::default()
            };
            let chart = torque_over_hours(&points, &p, "");
            assert!(chart.to_svg().is_ok());
            chart.lines.into_iter().map(|line| line.label).collect()
        };
        let held = ["146.4 N m: operating torque"];
        assert_eq!(labels(Hold::Torque), held);
        let most = "292.8 N m: most the drive gives";
        assert_eq!(labels(Hold::Feed), [held[0], most]);
    }
}
