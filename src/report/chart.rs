use super::ReportError;
use super::axis::{Axis, Scale, padded};
use super::drawing;
use super::layout::PLOT;

/// How the points of a series are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Straight lines between the points; broken where a point cannot be drawn.
    Line,
    Points,
    LinePoints,
    /// One bar a point from 0 (from the lower edge of a log axis), side by side with the bars of
    /// other series.
    Bars,
    /// Each value holds until the next point.
    Step,
    /// A closed outline, filled grey: a body.
    Body,
}

/// Stroke of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Dash {
    #[default]
    Solid,
    Dashed,
    Dotted,
}

/// Colour of a series.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Colour {
    /// The next of the palette, in the order of the series.
    #[default]
    Next,
    /// This one of the palette (and of the marker shapes), starting over at the end: the same
    /// engine in the same colour in every chart, or two series that belong together.
    Palette(usize),
    /// Where in the sequential ramp, 0 light to 1 dark: for families of curves. The legend names up
    /// to nine of a family.
    Ramp(f64),
}

/// Points under one name.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; a series with an empty name is not in the legend.
    pub name: String,
    /// In the units of the axes. What is not finite, or not positive on a log axis, is skipped.
    pub points: Vec<(f64, f64)>,
    pub style: Style,
    pub dash: Dash,
    pub colour: Colour,
}

impl Series {
    /// A solid series in the next colour of the palette.
    pub fn new(name: impl Into<String>, style: Style, points: Vec<(f64, f64)>) -> Self {
        Series {
            name: name.into(),
            points,
            style,
            dash: Dash::Solid,
            colour: Colour::Next,
        }
    }
}

/// A horizontal reference line, labelled at its right end.
#[derive(Debug, Clone, PartialEq)]
pub struct HLine {
    pub value: f64,
    pub label: String,
}

/// A single point of note with a horizontal error bar, explained in the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Mark {
    pub x: f64,
    pub y: f64,
    /// Half length of the bar, in the unit of x; 0 or not finite draws none.
    pub x_error: f64,
    pub label: String,
}

/// The name of a point, drawn beside it where there is room.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLabel {
    pub x: f64,
    pub y: f64,
    pub text: String,
}

/// A chart: its data in the units of its axes, without pixels or fonts.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    pub title: String,
    pub subtitle: String,
    pub x: Axis,
    pub y: Axis,
    pub series: Vec<Series>,
    pub lines: Vec<HLine>,
    pub marks: Vec<Mark>,
    /// The most important first: labels without room are left out.
    pub labels: Vec<PointLabel>,
    /// Where on a log axis zeros are drawn: the axis says 0 there, and nothing below.
    pub zero: Option<f64>,
    /// One unit is as long in x as in y, so that a shape looks like itself.
    pub equal_aspect: bool,
    /// Sentences beneath the picture.
    pub notes: Vec<String>,
}

/// The part of a chart's plane that is shown, in places along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extent {
    pub x: (f64, f64),
    pub y: (f64, f64),
}

impl Chart {
    /// A chart without series.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Chart {
            title: title.into(),
            subtitle: String::new(),
            x,
            y,
            series: Vec::new(),
            lines: Vec::new(),
            marks: Vec::new(),
            labels: Vec::new(),
            zero: None,
            equal_aspect: false,
            notes: Vec::new(),
        }
    }

    /// Points, lines and marks that cannot be drawn: not finite, or not positive on a log axis.
    pub fn skipped(&self) -> usize {
        let points = self.series.iter().flat_map(|s| &s.points).copied();
        let marks = self.marks.iter().map(|m| (m.x, m.y));
        let lost = points.chain(marks).filter(|&p| self.place(p).is_none());
        let lines = self
            .lines
            .iter()
            .filter(|l| self.y.scale.place(l.value).is_none());
        lost.count() + lines.count()
    }

    /// The chart as an SVG document, the same bytes for the same chart.
    ///
    /// # Errors
    /// `ReportError::EmptyChart` where no point of any series can be drawn; `ReportError::Chart`
    /// for an equal aspect on a log axis, and for data too wide for a range in f64.
    pub fn to_svg(&self) -> Result<String, ReportError> {
        Ok(self.drawn(PLOT, true)?.0)
    }

    /// The chart with a plot of `plot` pixels, and where that lies.
    pub(super) fn drawn(
        &self,
        plot: (f64, f64),
        with_legend: bool,
    ) -> Result<(String, drawing::Window), ReportError> {
        let drawn = drawing::draw(self, self.extent()?, plot, with_legend);
        drawn.map_err(|reason| self.refused(&reason))
    }

    fn refused(&self, reason: &str) -> ReportError {
        ReportError::Chart {
            title: self.title.clone(),
            reason: reason.to_owned(),
        }
    }

    /// Where a point lies, along both axes.
    pub(super) fn place(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        Some((self.x.scale.place(x)?, self.y.scale.place(y)?))
    }

    /// Half the room a bar may take on either side of its point.
    pub(super) fn bar_half_width(&self) -> f64 {
        let mut places: Vec<f64> = self
            .series
            .iter()
            .filter(|s| s.style == Style::Bars)
            .flat_map(|s| &s.points)
            .filter_map(|&p| self.place(p).map(|p| p.0))
            .collect();
        places.sort_by(f64::total_cmp);
        places.dedup();
        let gap = places.windows(2).map(|w| w[1] - w[0]).reduce(f64::min);
        0.4 * gap.unwrap_or(1.0)
    }

    fn extent(&self) -> Result<Extent, ReportError> {
        if self.equal_aspect && (self.x.scale, self.y.scale) != (Scale::Linear, Scale::Linear) {
            return Err(self.refused("an equal aspect needs two linear axes"));
        }
        let mut xs = Vec::new();
        let mut ys = Vec::new();
        for series in &self.series {
            let bars = series.style == Style::Bars;
            for (x, y) in series.points.iter().filter_map(|&p| self.place(p)) {
                let half = if bars { self.bar_half_width() } else { 0.0 };
                xs.extend([x - half, x + half]);
                ys.push(y);
                if bars && self.y.scale == Scale::Linear {
                    ys.push(0.0);
                }
            }
        }
        if ys.is_empty() {
            return Err(ReportError::EmptyChart {
                title: self.title.clone(),
                skipped: self.skipped(),
            });
        }
        for mark in &self.marks {
            if let Some((x, y)) = self.place((mark.x, mark.y)) {
                xs.push(x);
                ys.push(y);
                xs.extend(mark.ends().iter().filter_map(|&e| self.x.scale.place(e)));
            }
        }
        ys.extend(
            self.lines
                .iter()
                .filter_map(|l| self.y.scale.place(l.value)),
        );
        let range = |values: &[f64], scale| {
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            padded(low, high, scale).ok_or_else(|| self.refused("the data are too wide to draw"))
        };
        Ok(Extent {
            x: range(&xs, self.x.scale)?,
            y: range(&ys, self.y.scale)?,
        })
    }
}

impl Mark {
    /// Both ends of the error bar.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.x - self.x_error, self.x + self.x_error]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<(f64, f64)>) -> Chart {
        let mut chart = Chart::new("t", Axis::linear("x [s]"), Axis::linear("y [m]"));
        chart
            .series
            .push(Series::new("a", Style::LinePoints, points));
        chart
    }

    #[test]
    fn the_same_chart_gives_the_same_bytes() {
        let chart = chart(vec![(0.0, 1.0), (1.0, 3.0), (2.0, 2.0)]);
        assert_eq!(chart.to_svg().unwrap(), chart.to_svg().unwrap());
    }

    #[test]
    fn what_is_not_finite_is_counted_and_never_drawn() {
        let mut chart = chart(vec![
            (0.0, 1.0),
            (f64::NAN, 1.0),
            (1.0, f64::INFINITY),
            (2.0, 2.0),
        ]);
        chart.lines.push(HLine {
            value: f64::NAN,
            label: "limit".into(),
        });
        chart.marks.push(Mark {
            x: 1.0,
            y: 1.0,
            x_error: f64::NAN,
            label: "crossing".into(),
        });
        assert_eq!(chart.skipped(), 3);
        let svg = chart.to_svg().unwrap();
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert!(svg.contains("3 points not drawn"), "the picture says so");
    }

    #[test]
    fn nothing_to_draw_is_an_error() {
        for points in [vec![], vec![(f64::NAN, 0.0)]] {
            let skipped = points.len();
            match chart(points).to_svg() {
                Err(ReportError::EmptyChart { skipped: s, .. }) => assert_eq!(s, skipped),
                other => panic!("{other:?}"),
            }
        }
        let mut log = chart(vec![(1.0, 0.0), (2.0, -1.0)]);
        log.y.scale = Scale::Log;
        assert!(matches!(
            log.to_svg(),
            Err(ReportError::EmptyChart { skipped: 2, .. })
        ));
    }

    #[test]
    fn contradictions_are_refused() {
        let mut log = chart(vec![(1.0, 1.0)]);
        log.y.scale = Scale::Log;
        log.equal_aspect = true;
        assert!(matches!(log.to_svg(), Err(ReportError::Chart { .. })));
        let wide = chart(vec![(0.0, f64::MAX), (1.0, -f64::MAX)]);
        assert!(matches!(wide.to_svg(), Err(ReportError::Chart { .. })));
    }

    /// Names come from scene files: they may hold anything.
    #[test]
    fn text_is_escaped() {
        let mut chart = chart(vec![(0.0, 1.0)]);
        chart.title = "a < b & \"c\"".into();
        let svg = chart.to_svg().unwrap();
        assert!(svg.contains("a &lt; b &amp; &quot;c&quot;"));
    }

    /// Equal values, single points, extreme magnitudes, every style and both scales.
    #[test]
    fn every_style_draws_awkward_data() {
        let styles = [
            Style::Line,
            Style::Points,
            Style::LinePoints,
            Style::Bars,
            Style::Step,
            Style::Body,
        ];
        for style in styles {
            for scale in [Scale::Linear, Scale::Log] {
                for points in [
                    vec![(1.0, 1.0)],
                    vec![(1.0, 1.0), (1.0, 1.0)],
                    vec![(5e-324, 1e-300), (1e-300, 1e300)],
                    vec![(1e15, 2.0), (1e15 + 1.0, 2.0 + 1e-15)],
                ] {
                    let mut chart = chart(points.clone());
                    chart.series[0].style = style;
                    (chart.x.scale, chart.y.scale) = (scale, scale);
                    let svg = chart.to_svg().unwrap();
                    assert!(!svg.contains("NaN"), "{style:?} {scale:?} {points:?}");
                }
            }
        }
    }
}
