//! The chart of `calibrate`: what was measured beside the run with the coefficient found.

use super::calibrate::Found;
use super::calibrate_data::Kind;
use crate::report::{Axis, Chart, Colour, Dash, Series, Style, number};
use crate::scene::Scene;

impl Found {
    /// The chart that fits the kind of measurement.
    pub(super) fn picture(&self, scene: &Scene) -> Chart {
        let subtitle = format!(
            "{}, {}: {} = {} m²/N",
            scene.name,
            self.worn.part,
            self.worn.key,
            number(self.coefficient(), 4)
        );
        let mut chart = match &self.data.kind {
            Kind::Profile(_, traced) => self.of_profile(traced),
            kind => self.of_numbers(kind),
        };
        chart.subtitle = subtitle;
        chart
    }

    /// The outline new and as fitted, with the traced points.
    fn of_profile(&self, traced: &[([f64; 2], u64)]) -> Chart {
        let mut chart = Chart::new(
            "A traced profile and the wear that fits it",
            Axis::linear("x in the frame of the part [mm]"),
            Axis::linear("y [mm]"),
        );
        let mm = |points: &[[f64; 2]]| points.iter().map(|p| (1e3 * p[0], 1e3 * p[1])).collect();
        let time = self.fit.ratio * self.data.hours[0];
        let points = &self.worn.points;
        let next = points
            .partition_point(|p| p.hours < time)
            .min(points.len() - 1);
        // the nearest of the run: outlines between have no nodes in common
        let near = |p: &usize| (points[*p].hours - time).abs();
        let shown = [next.saturating_sub(1), next].into_iter();
        let shown = shown
            .min_by(|a, b| near(a).total_cmp(&near(b)))
            .unwrap_or(next);
        let mut new = Series::new("new", Style::Line, mm(&points[0].outline));
        (new.dash, new.colour) = (Dash::Dashed, Colour::Palette(6));
        let name = format!(
            "run, {} h at the K found",
            number(points[shown].hours / self.fit.ratio, 4)
        );
        let mut worn = Series::new(name, Style::Line, mm(&points[shown].outline));
        worn.colour = Colour::Palette(0);
        let all: Vec<[f64; 2]> = traced.iter().map(|(p, _)| *p).collect();
        let name = format!("traced, after {} h", number(self.data.hours[0], 4));
        let mut points = Series::new(name, Style::Points, mm(&all));
        points.colour = Colour::Palette(1);
        chart.series = vec![new, worn, points];
        chart
    }

    /// The run with the coefficient found and with both ends of the interval, and the measurements.
    fn of_numbers(&self, kind: &Kind) -> Chart {
        let (label, scale) = match kind {
            Kind::Mass(_) => ("mass lost [g]", 1e3),
            _ => ("deepest wear [mm]", 1e3),
        };
        let mut chart = Chart::new(
            "Measured wear and the run that fits it",
            Axis::linear("hours of work [h]"),
            Axis::linear(label),
        );
        let longest = 1.25 * self.data.hours.iter().copied().fold(0.0, f64::max);
        let course = |ratio: f64| {
            let rows = self.course.hours.iter().zip(&self.course.found);
            let all = rows.map(|(hours, row)| (hours / ratio, scale * row[0]));
            all.take_while(|(hours, _)| *hours <= longest)
                .collect::<Vec<_>>()
        };
        let fit = &self.fit;
        let mut line = Series::new("run at the K found", Style::Line, course(fit.ratio));
        line.colour = Colour::Palette(0);
        chart.series.push(line);
        for (name, ratio) in [("least K", Some(fit.low)), ("largest K", fit.high)] {
            if let Some(ratio) = ratio.filter(|ratio| *ratio > 0.0) {
                let mut line = Series::new(name, Style::Line, course(ratio));
                (line.dash, line.colour) = (Dash::Dashed, Colour::Palette(0));
                chart.series.push(line);
            }
        }
        let data = self.measured.hours.iter().zip(&self.measured.values);
        let data = data.map(|(hours, value)| (*hours, scale * value)).collect();
        let mut points = Series::new("measured", Style::Points, data);
        points.colour = Colour::Palette(1);
        chart.series.push(points);
        chart
    }
}
