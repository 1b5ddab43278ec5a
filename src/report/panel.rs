//! A chart for a page: small, without title and legend, which the page sets in its own text.

use super::ReportError;
use super::axis::Axis;
use super::chart::{Chart, Series, Style};
use super::drawing;
use super::legend::looks;
use super::palette;
use plotters::style::RGBColor;

/// Width of the plot with the labels beside it and height in pixels: with its axes as wide as a telephone.
const PLOT: (f64, f64) = (330.0, 150.0);
/// Columns of the plot in which points are told apart.
const COLUMNS: usize = 300;

/// A chart and what a page needs to write around it.
#[derive(Debug, Clone)]
pub struct Panel {
    pub title: String,
    pub notes: Vec<String>,
    pub svg: String,
    /// Name and colour of each series.
    pub legend: Vec<(String, String)>,
    /// Left and right edge of the plot as shares of the picture's width, and the values there.
    pub left: f64,
    pub right: f64,
    pub from: f64,
    pub to: f64,
}

impl Panel {
    /// Draws `chart` small; of several points in a column of pixels the first, the last, the lowest
    /// and the highest.
    ///
    /// # Errors
    /// Those of [`Chart::to_svg`].
    pub fn of(chart: &Chart) -> Result<Panel, ReportError> {
        let mut small = chart.clone();
        small.title.clear();
        small.subtitle.clear();
        small.notes.clear();
        for series in &mut small.series {
            series.points = thinned(&series.points);
        }
        let colour = |RGBColor(r, g, b): RGBColor| format!("#{r:02x}{g:02x}{b:02x}");
        let legend = looks(&small)
            .iter()
            .filter(|look| !look.series.name.is_empty())
            .map(|look| (look.series.name.clone(), colour(look.colour)))
            .chain((small.lines.iter()).map(|l| (l.label.clone(), colour(palette::FAINT_INK))))
            .collect();
        small.lines.iter_mut().for_each(|line| line.label.clear());
        let (svg, window) = small.drawn(PLOT, false)?;
        let drawing::Window { edges, values } = window;
        Ok(Panel {
            title: chart.title.clone(),
            notes: chart.notes.clone(),
            svg: inline(&svg),
            legend,
            left: edges.0,
            right: edges.1,
            from: values.0,
            to: values.1,
        })
    }
}

/// An SVG document as an element of a page, which needs no name space.
pub(super) fn inline(svg: &str) -> String {
    svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", "")
}

/// At most four points a column, in their order.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= 2 * COLUMNS {
        return points.to_vec();
    }
    let mut kept = Vec::new();
    for column in points.chunks(points.len().div_ceil(COLUMNS)) {
        let at = |better: fn(f64, f64) -> bool| {
            let mut best = 0;
            for (k, p) in column.iter().enumerate() {
                if better(p.1, column[best].1) {
                    best = k;
                }
            }
            best
        };
        let mut which = [0, at(|a, b| a < b), at(|a, b| a > b), column.len() - 1];
        which.sort_unstable();
        let mut before = None;
        for k in which {
            if before != Some(k) {
                kept.push(column[k]);
            }
            before = Some(k);
        }
    }
    kept
}

/// A chart over time.
pub(super) fn over_time(title: &str, y: Axis, series: Vec<(&str, Vec<(f64, f64)>)>) -> Chart {
    let mut chart = Chart::new(title, Axis::linear("time [s]"), y);
    for (name, points) in series {
        if !points.is_empty() {
            chart.series.push(Series::new(name, Style::Line, points));
        }
    }
    chart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_survive_the_thinning() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        points[77_777].1 = 3.0;
        points[12_345].1 = -2.0;
        let kept = thinned(&points);
        assert!(kept.len() <= 4 * COLUMNS, "{}", kept.len());
        assert!(kept.contains(&(77_777.0, 3.0)) && kept.contains(&(12_345.0, -2.0)));
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[99_999]));
        assert!(kept.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn a_panel_knows_where_its_values_lie() {
        let chart = over_time(
            "t",
            Axis::linear("y"),
            vec![("a", vec![(0.0, 1.0), (2.0, 3.0)])],
        );
        let panel = Panel::of(&chart).unwrap();
        assert!(0.0 < panel.left && panel.left < panel.right && panel.right < 1.0);
        assert!(panel.from <= 0.0 && panel.to >= 2.0);
        assert_eq!(panel.legend, [("a".to_owned(), "#0072b2".to_owned())]);
        assert!(!panel.svg.contains("://"), "{}", panel.svg);
    }
}
