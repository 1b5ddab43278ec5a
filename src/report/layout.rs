use super::axis::{Ticks, ticks};
use super::canvas::Point;
use super::chart::{Chart, Extent};
use super::legend::Entry;

/// Lengths in pixels: of a plot with the labels beside it, so wide that text is legible on a screen of 400.
pub(super) const PLOT: Point = (455.0, 320.0);
pub(super) const MARGIN: f64 = 16.0;
pub(super) const TITLE: f64 = 16.0;
pub(super) const TEXT: f64 = 12.5;
pub(super) const SMALL: f64 = 11.5;
const LEGEND_ROW: f64 = 20.0;
/// From the left edge of an entry of the legend to its name.
pub(super) const LEGEND_NAME: f64 = 34.0;
pub(super) const NOTE_ROW: f64 = 1.5 * SMALL;

/// Width in px to allow for a text: a generic sans-serif may turn out as wide as DejaVu Sans.
pub(super) fn width_of(text: &str, size: f64) -> f64 {
    let em = text.chars().map(|c| match c {
        '\u{2e80}'.. => 1.05,
        c if c.is_uppercase() => 0.75,
        _ => 0.62,
    });
    size * em.sum::<f64>()
}

/// Splits at spaces into lines no wider than `width` px; a longer word stays whole.
pub(super) fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if width_of(line, size) + width_of(word, size) + size < width => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Lengths in pixels, from the top left of the picture.
pub(super) struct Layout {
    pub size: Point,
    /// Left, top, right and bottom of the plot.
    pub left: f64,
    pub top: f64,
    pub right: f64,
    pub bottom: f64,
    pub extent: Extent,
    pub x: Ticks,
    pub y: Ticks,
    pub title: Vec<String>,
    pub subtitle: Vec<String>,
    /// Where each entry of the legend begins, beneath the axis label, and the lines of its name.
    pub legend: Vec<(Point, Vec<String>)>,
    /// Labels of the reference lines, and how far below the top of the plot.
    pub lines: Vec<(f64, String)>,
    /// Lines of small print beneath the legend, and their top.
    pub notes: Vec<String>,
    pub notes_top: f64,
}

/// Close lines must not have their labels on top of each other.
fn line_labels(chart: &Chart, range: (f64, f64), height: f64) -> Vec<(f64, String)> {
    let down = |place: f64| (range.1 - place) / (range.1 - range.0) * height;
    let mut labels: Vec<(f64, String)> = chart
        .lines
        .iter()
        .filter_map(|l| Some((down(chart.y.scale.place(l.value)?), l.label.clone())))
        .collect();
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut free = f64::NEG_INFINITY;
    for (y, _) in &mut labels {
        *y = y.max(free);
        free = *y + 1.25 * SMALL;
    }
    labels
}

/// Names of a legend in as many columns of this width as there is room for, and how high they are.
fn in_columns(
    legend: &[Entry],
    (left, top): Point,
    width: f64,
) -> (Vec<(Point, Vec<String>)>, f64) {
    let names = legend
        .iter()
        .map(|e| wrapped(&e.name, TEXT, width - LEGEND_NAME));
    let names: Vec<Vec<String>> = names.collect();
    let lines = names.iter().flatten().map(|line| width_of(line, TEXT));
    let column = LEGEND_NAME + TEXT + lines.fold(0.0, f64::max);
    let columns = ((width + TEXT) / column).max(1.0) as usize;
    let (mut placed, mut y) = (Vec::new(), top);
    for row in names.chunks(columns) {
        let places = row.iter().enumerate();
        placed.extend(places.map(|(k, name)| ((left + column * k as f64, y), name.clone())));
        let lines = row.iter().map(Vec::len).fold(1, usize::max);
        y += LEGEND_ROW + 1.2 * TEXT * (lines - 1) as f64;
    }
    (placed, y - top)
}

impl Layout {
    pub(super) fn new(chart: &Chart, mut extent: Extent, legend: &[Entry], plot: Point) -> Self {
        // No axis is shorter than its label.
        let least = (
            width_of(&chart.x.label, TEXT),
            width_of(&chart.y.label, TEXT),
        );
        let widest = |texts: &mut dyn Iterator<Item = &str>, size: f64| {
            texts.map(|t| width_of(t, size)).fold(0.0, f64::max)
        };
        let line_width = widest(&mut chart.lines.iter().map(|l| l.label.as_str()), SMALL);
        let mut height = plot.1.max(least.1);
        let y_ticks = |extent: &Extent, height: f64| {
            let mut y = ticks(extent.y, chart.y.scale, (height / 42.0) as usize);
            if let Some(zero) = chart.zero.and_then(|zero| chart.y.scale.place(zero)) {
                y.major.retain(|(place, _)| *place > zero);
                y.minor.retain(|place| *place > zero);
                y.major.push((zero, "0".to_owned()));
            }
            let labels = widest(&mut y.major.iter().map(|t| t.1.as_str()), TEXT);
            (y, labels)
        };
        let beside = y_ticks(&extent, height).1 + line_width;
        let mut width = (plot.0 - beside).max(least.0);
        if chart.equal_aspect {
            let scale = |e: Extent| (e.x.1 - e.x.0, e.y.1 - e.y.0);
            let (most_wide, most_high) = (width, 1.5 * height);
            // Neither a ribbon nor a tower: widen the shorter range where the shape is extreme.
            let (w, h) = scale(extent);
            let grow = |range: (f64, f64), to: f64| {
                let more = (to - (range.1 - range.0)).max(0.0) / 2.0;
                (range.0 - more, range.1 + more)
            };
            extent.y = grow(extent.y, (least.1 / most_wide).max(0.2) * w);
            extent.x = grow(extent.x, (least.0 / most_high).max(0.5) * h);
            let (w, h) = scale(extent);
            let per_unit = (most_wide / w).min(most_high / h);
            (width, height) = (w * per_unit, h * per_unit);
        }
        let mut wanted = (width / 70.0) as usize;
        let x = loop {
            let x = ticks(extent.x, chart.x.scale, wanted);
            let label = widest(&mut x.major.iter().map(|t| t.1.as_str()), TEXT);
            if wanted <= 2 || (label + TEXT) * x.major.len() as f64 <= width {
                break x;
            }
            wanted -= 1;
        };
        let (y, y_labels) = y_ticks(&extent, height);
        let left = MARGIN + 1.6 * TEXT + y_labels + 14.0;
        let right = left + width;
        let last_tick = x.major.last().map_or(0.0, |t| width_of(&t.1, TEXT) / 2.0);
        let lines = line_labels(chart, extent.y, height);
        let lines_right = right + 6.0 + line_width;
        let total = lines_right.max(right + last_tick) + MARGIN;
        let title = wrapped(&chart.title, 1.1 * TITLE, total - left - MARGIN);
        let subtitle = wrapped(&chart.subtitle, TEXT, total - left - MARGIN);
        let top =
            MARGIN + 1.35 * TITLE * title.len() as f64 + 1.4 * TEXT * subtitle.len() as f64 + 10.0;
        let bottom = top + height;
        let apart = if legend.is_empty() { 2.8 } else { 3.8 };
        let legend_top = bottom + 8.0 + apart * TEXT;
        let (legend, legend_height) =
            in_columns(legend, (MARGIN, legend_top), total - 2.0 * MARGIN);
        let skipped = match chart.skipped() {
            0 => None,
            1 => Some("1 point not drawn: not finite, or not positive on a log axis".to_owned()),
            n => Some(format!(
                "{n} points not drawn: not finite, or not positive on a log axis"
            )),
        };
        let notes: Vec<String> = chart
            .notes
            .iter()
            .chain(&skipped)
            .flat_map(|note| wrapped(note, SMALL, total - left - MARGIN))
            .collect();
        Layout {
            size: (
                total,
                legend_top + legend_height + NOTE_ROW * notes.len() as f64 + MARGIN,
            ),
            left,
            top,
            right,
            bottom,
            extent,
            x,
            y,
            title,
            subtitle,
            legend,
            lines,
            notes,
            notes_top: legend_top + legend_height,
        }
    }

    /// Pixel of a pair of places along the axes.
    pub(super) fn pixel(&self, (x, y): Point) -> Point {
        let e = self.extent;
        let along = |v: f64, r: (f64, f64)| (v - r.0) / (r.1 - r.0);
        (
            self.left + along(x, e.x) * (self.right - self.left),
            self.bottom - along(y, e.y) * (self.bottom - self.top),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::axis::Axis;
    use super::super::chart::{Series, Style};
    use super::*;

    /// A picture is at most so wide that its text, at 12.5, is 8.5 on a screen of 400 less its margins of 16.
    #[test]
    fn a_picture_fits_a_telephone_with_its_legend() {
        let mut chart = Chart::new("t", Axis::linear("time [s]"), Axis::linear("height [m]"));
        for name in [
            "moreau, staggered, with events, tolerance 1e-8, effort exact, sixteen threads, resumed twice",
            "rapier",
            "Box2D",
            "rapier-stiff",
        ] {
            let points = vec![(0.0, 1e-6), (1.0, 2e-6)];
            chart.series.push(Series::new(name, Style::Line, points));
        }
        let svg = chart.to_svg().unwrap();
        let width = super::super::panels::size(&svg, "width");
        assert!(8.5 * width <= TEXT * (400.0 - 32.0), "{width}");
        for name in ["moreau,", "twice", "rapier-stiff"] {
            assert!(svg.contains(name), "{name}");
        }
    }
}
