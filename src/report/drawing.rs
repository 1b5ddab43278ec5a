//! Draws a [`Chart`] with plotters.
//!
//! plotters places everything on whole units. A unit here is a tenth of a pixel, so that curves
//! stay smooth; only the size in the header is in pixels.

use plotters::coord::Shift;
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text};
use plotters::prelude::{DrawingArea, IntoDrawingArea, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBColor, ShapeStyle, TextStyle, WHITE,
};

use super::axis::{Ticks, ticks};
use super::chart::{Chart, Colour, Dash, Extent, Series, Style};
use super::palette;

/// Units in a pixel.
const U: f64 = 10.0;
const PLOT_WIDTH: f64 = 560.0;
const PLOT_HEIGHT: f64 = 340.0;
const MARGIN: f64 = 16.0;
const TITLE: f64 = 16.0;
const TEXT: f64 = 12.5;
const SMALL: f64 = 11.5;
const LEGEND_ROW: f64 = 20.0;
/// Of a longer family of curves the legend names this many.
const LEGEND_FAMILY: usize = 6;

type Point = (f64, f64);

/// Width [px] to allow for a text: a generic sans-serif may turn out as wide as DejaVu Sans.
fn width_of(text: &str, size: f64) -> f64 {
    0.64 * size * text.chars().count() as f64
}

/// Splits at spaces into lines no wider than `width` [px]; a longer word stays whole.
fn wrapped(text: &str, size: f64, width: f64) -> Vec<String> {
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
struct Layout {
    size: Point,
    /// Left, top, right and bottom of the plot.
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
    extent: Extent,
    x: Ticks,
    y: Ticks,
    title: Vec<String>,
    subtitle: Vec<String>,
    /// Left edge of the legend.
    legend: f64,
}

impl Layout {
    fn new(chart: &Chart, mut extent: Extent, legend: &[Entry]) -> Self {
        let (mut width, mut height) = (PLOT_WIDTH, PLOT_HEIGHT);
        if chart.equal_aspect {
            let scale = |e: Extent| (e.x.1 - e.x.0, e.y.1 - e.y.0);
            // Neither a ribbon nor a tower: widen the shorter range where the shape is extreme.
            let (w, h) = scale(extent);
            let grow = |range: (f64, f64), to: f64| {
                let more = (to - (range.1 - range.0)).max(0.0) / 2.0;
                (range.0 - more, range.1 + more)
            };
            extent.y = grow(extent.y, 0.2 * w);
            extent.x = grow(extent.x, 0.5 * h);
            let (w, h) = scale(extent);
            let per_unit = (PLOT_WIDTH / w).min(1.5 * PLOT_HEIGHT / h);
            (width, height) = (w * per_unit, h * per_unit);
        }
        let x = ticks(extent.x, chart.x.scale, (width / 80.0) as usize);
        let y = ticks(extent.y, chart.y.scale, (height / 52.0) as usize);
        let widest = |texts: &mut dyn Iterator<Item = &str>, size: f64| {
            texts.map(|t| width_of(t, size)).fold(0.0, f64::max)
        };
        let y_labels = widest(&mut y.major.iter().map(|t| t.1.as_str()), TEXT);
        let left = MARGIN + 1.6 * TEXT + y_labels + 14.0;
        let right = left + width;
        let last_tick = x.major.last().map_or(0.0, |t| width_of(&t.1, TEXT) / 2.0);
        let lines = widest(&mut chart.lines.iter().map(|l| l.label.as_str()), SMALL);
        let names = widest(&mut legend.iter().map(|e| e.name.as_str()), TEXT);
        let legend_left = right + 18.0 + if lines > 0.0 { lines + 10.0 } else { 0.0 };
        let legend_right = if legend.is_empty() {
            legend_left - 18.0
        } else {
            legend_left + 34.0 + names
        };
        let total = legend_right.max(right + last_tick) + MARGIN;
        let title = wrapped(&chart.title, 1.1 * TITLE, total - left - MARGIN);
        let subtitle = wrapped(&chart.subtitle, TEXT, total - left - MARGIN);
        let top = MARGIN
            + 1.35 * TITLE * title.len() as f64
            + 1.4 * TEXT * subtitle.len() as f64
            + 10.0;
        let bottom = top + height;
        let legend_bottom = top + LEGEND_ROW * legend.len() as f64;
        let note = if chart.skipped() > 0 { 1.6 * SMALL } else { 0.0 };
        Layout {
            size: (
                total,
                (bottom + 10.0 + 3.4 * TEXT + note).max(legend_bottom) + MARGIN,
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
            legend: legend_left,
        }
    }

    /// Pixel of a pair of places along the axes.
    fn pixel(&self, (x, y): Point) -> Point {
        let e = self.extent;
        let along = |v: f64, r: (f64, f64)| (v - r.0) / (r.1 - r.0);
        (
            self.left + along(x, e.x) * (self.right - self.left),
            self.bottom - along(y, e.y) * (self.bottom - self.top),
        )
    }
}

/// A series with the looks it was given.
struct Look<'a> {
    series: &'a Series,
    colour: RGBColor,
    marker: usize,
}

/// A line of the legend.
struct Entry<'a> {
    name: String,
    /// `None` for a mark.
    look: Option<&'a Look<'a>>,
}

fn looks(chart: &Chart) -> Vec<Look<'_>> {
    let mut next = 0;
    let mut looks = Vec::new();
    for series in &chart.series {
        let (colour, marker) = match series.colour {
            _ if series.style == Style::Body => (palette::BODY, 0),
            Colour::Ramp(fraction) => (palette::ramp(fraction), 0),
            Colour::Palette => {
                next += 1;
                let colours = palette::QUALITATIVE;
                (colours[(next - 1) % colours.len()], next - 1)
            }
        };
        looks.push(Look {
            series,
            colour,
            marker,
        });
    }
    looks
}

fn legend<'a>(chart: &Chart, looks: &'a [Look<'a>]) -> Vec<Entry<'a>> {
    let family = |l: &Look| matches!(l.series.colour, Colour::Ramp(_));
    let members = looks.iter().filter(|l| family(l)).count();
    let shown: Vec<usize> = spread(members, LEGEND_FAMILY);
    let mut member = 0;
    let mut entries = Vec::new();
    for look in looks {
        let mut named = !look.series.name.is_empty();
        if family(look) {
            named &= shown.contains(&member);
            member += 1;
        }
        if named {
            entries.push(Entry {
                name: look.series.name.clone(),
                look: Some(look),
            });
        }
    }
    for mark in chart.marks.iter().filter(|m| !m.label.is_empty()) {
        entries.push(Entry {
            name: mark.label.clone(),
            look: None,
        });
    }
    entries
}

/// At most `most` of the indices below `count`, evenly spread, with both ends.
fn spread(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    (0..most)
        .map(|i| (i * (count - 1) + (most - 1) / 2) / (most - 1))
        .collect()
}

/// The picture under way.
struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

type Drawn = Result<(), String>;

fn units((x, y): Point) -> (i32, i32) {
    ((x * U).round() as i32, (y * U).round() as i32)
}

fn stroke(colour: RGBColor, width: f64) -> ShapeStyle {
    colour.stroke_width((width * U).round() as u32)
}

impl Canvas<'_> {
    fn text(
        &self,
        text: &str,
        at: Point,
        (size, colour): (f64, RGBColor),
        (horizontal, vertical): (HPos, VPos),
        transform: FontTransform,
    ) -> Drawn {
        let weight = if size == TITLE {
            FontStyle::Bold
        } else {
            FontStyle::Normal
        };
        // plotters divides by 1.24 on the way to SVG.
        let font = FontDesc::new(FontFamily::SansSerif, size * U * 1.24, weight);
        let style = TextStyle::from(font.transform(transform))
            .color(&colour)
            .pos(Pos::new(horizontal, vertical));
        self.area
            .draw(&Text::new(text.to_owned(), units(at), style))
            .map_err(|e| e.to_string())
    }

    fn path(&self, points: &[Point], style: ShapeStyle) -> Drawn {
        let mut path: Vec<(i32, i32)> = points.iter().map(|&p| units(p)).collect();
        // A long run has thousands of points to a pixel.
        path.dedup();
        if path.len() < 2 {
            return Ok(());
        }
        self.area
            .draw(&PathElement::new(path, style))
            .map_err(|e| e.to_string())
    }

    fn dashed(&self, points: &[Point], dash: Dash, style: ShapeStyle) -> Drawn {
        let (on, off) = match dash {
            Dash::Solid => return self.path(points, style),
            Dash::Dashed => (7.0, 4.0),
            Dash::Dotted => (1.6, 3.0),
        };
        for piece in dashes(points, on, off) {
            self.path(&piece, style)?;
        }
        Ok(())
    }

    fn polygon(&self, points: &[Point], fill: RGBColor) -> Drawn {
        let corners: Vec<(i32, i32)> = points.iter().map(|&p| units(p)).collect();
        self.area
            .draw(&Polygon::new(corners, fill.filled()))
            .map_err(|e| e.to_string())
    }

    fn rectangle(&self, a: Point, b: Point, fill: RGBColor) -> Drawn {
        self.area
            .draw(&Rectangle::new([units(a), units(b)], fill.filled()))
            .map_err(|e| e.to_string())
    }

    /// One of five shapes, so that series differ without colour too.
    fn marker(&self, (x, y): Point, shape: usize, colour: RGBColor) -> Drawn {
        let around = |offsets: &[Point]| -> Vec<Point> {
            offsets.iter().map(|o| (x + o.0, y + o.1)).collect()
        };
        match shape % 5 {
            0 => self
                .area
                .draw(&Circle::new(units((x, y)), 3.2 * U, colour.filled()))
                .map_err(|e| e.to_string()),
            1 => self.rectangle((x - 2.9, y - 2.9), (x + 2.9, y + 2.9), colour),
            2 => self.polygon(&around(&[(0.0, -4.0), (3.7, 2.6), (-3.7, 2.6)]), colour),
            3 => {
                let diamond = [(0.0, -4.2), (4.2, 0.0), (0.0, 4.2), (-4.2, 0.0)];
                self.polygon(&around(&diamond), colour)
            }
            _ => self.polygon(&around(&[(0.0, 4.0), (3.7, -2.6), (-3.7, -2.6)]), colour),
        }
    }

    fn note_of_crossing(&self, at: Point, ends: Option<[f64; 2]>) -> Drawn {
        if let Some([a, b]) = ends {
            let line = stroke(palette::INK, 1.4);
            self.path(&[(a, at.1), (b, at.1)], line)?;
            for end in [a, b] {
                self.path(&[(end, at.1 - 5.0), (end, at.1 + 5.0)], line)?;
            }
        }
        self.marker(at, 0, palette::INK)?;
        self.area
            .draw(&Circle::new(units(at), 1.6 * U, WHITE.filled()))
            .map_err(|e| e.to_string())
    }
}

/// Cuts a path into dashes [px].
fn dashes(points: &[Point], on: f64, off: f64) -> Vec<Vec<Point>> {
    let mut pieces = Vec::new();
    let mut piece = Vec::new();
    let (mut drawing, mut left) = (true, on);
    for pair in points.windows(2) {
        let (mut a, b) = (pair[0], pair[1]);
        let mut rest = (b.0 - a.0).hypot(b.1 - a.1);
        if drawing && piece.is_empty() {
            piece.push(a);
        }
        while rest > left {
            let t = left / rest;
            a = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
            rest -= left;
            if drawing {
                piece.push(a);
                pieces.push(std::mem::take(&mut piece));
            } else {
                piece.push(a);
            }
            drawing = !drawing;
            left = if drawing { on } else { off };
        }
        left -= rest;
        if drawing {
            piece.push(b);
        }
    }
    if drawing {
        pieces.push(piece);
    }
    pieces
}

/// Draws the chart; the error is plotters' own word.
pub(super) fn draw(chart: &Chart, extent: Extent) -> Result<String, String> {
    let looks = looks(chart);
    let legend = legend(chart, &looks);
    let layout = Layout::new(chart, extent, &legend);
    let (w, h) = units(layout.size);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (w as u32, h as u32)).into_drawing_area();
        area.fill(&WHITE).map_err(|e| e.to_string())?;
        let canvas = Canvas { area };
        draw_frame(&canvas, chart, &layout)?;
        for look in &looks {
            draw_series(&canvas, chart, &layout, look, &looks)?;
        }
        draw_annotations(&canvas, chart, &layout)?;
        draw_legend(&canvas, &layout, &legend)?;
        canvas.area.present().map_err(|e| e.to_string())?;
    }
    let pixels = |units: i32| f64::from(units) / U;
    Ok(svg.replacen(
        &format!("width=\"{w}\" height=\"{h}\""),
        &format!("width=\"{}\" height=\"{}\"", pixels(w), pixels(h)),
        1,
    ))
}

fn draw_frame(canvas: &Canvas, chart: &Chart, l: &Layout) -> Drawn {
    let flat = FontTransform::None;
    let vertical = |x: f64, colour, w| {
        let x = l.pixel((x, l.extent.y.0)).0;
        canvas.path(&[(x, l.top), (x, l.bottom)], stroke(colour, w))
    };
    let horizontal = |y: f64, colour, w| {
        let y = l.pixel((l.extent.x.0, y)).1;
        canvas.path(&[(l.left, y), (l.right, y)], stroke(colour, w))
    };
    for &x in &l.x.minor {
        vertical(x, palette::MINOR_GRID, 0.8)?;
    }
    for &y in &l.y.minor {
        horizontal(y, palette::MINOR_GRID, 0.8)?;
    }
    for (x, _) in &l.x.major {
        vertical(*x, palette::GRID, 0.9)?;
    }
    for (y, _) in &l.y.major {
        horizontal(*y, palette::GRID, 0.9)?;
    }
    let axis = stroke(palette::AXIS, 1.0);
    canvas.path(
        &[(l.left, l.top), (l.left, l.bottom), (l.right, l.bottom)],
        axis,
    )?;
    let label = (TEXT, palette::INK);
    for (x, text) in &l.x.major {
        let x = l.pixel((*x, l.extent.y.0)).0;
        canvas.path(&[(x, l.bottom), (x, l.bottom + 4.0)], axis)?;
        let at = (x, l.bottom + 8.0);
        canvas.text(text, at, label, (HPos::Center, VPos::Top), flat.clone())?;
    }
    for (y, text) in &l.y.major {
        let y = l.pixel((l.extent.x.0, *y)).1;
        canvas.path(&[(l.left - 4.0, y), (l.left, y)], axis)?;
        let at = (l.left - 8.0, y);
        canvas.text(text, at, label, (HPos::Right, VPos::Center), flat.clone())?;
    }
    let centre = (HPos::Center, VPos::Top);
    let middle = (l.left + l.right) / 2.0;
    let below = l.bottom + 8.0 + 1.7 * TEXT;
    canvas.text(&chart.x.label, (middle, below), label, centre, flat.clone())?;
    let beside = (MARGIN, (l.top + l.bottom) / 2.0);
    let centre = (HPos::Center, VPos::Top);
    canvas.text(&chart.y.label, beside, label, centre, FontTransform::Rotate270)?;
    let mut y = MARGIN;
    let corner = || (HPos::Left, VPos::Top);
    for line in &l.title {
        canvas.text(line, (l.left, y), (TITLE, palette::INK), corner(), flat.clone())?;
        y += 1.35 * TITLE;
    }
    for line in &l.subtitle {
        let look = (TEXT, palette::FAINT_INK);
        canvas.text(line, (l.left, y), look, corner(), flat.clone())?;
        y += 1.4 * TEXT;
    }
    let skipped = chart.skipped();
    if skipped > 0 {
        let plural = if skipped == 1 { "point" } else { "points" };
        let note = format!("{skipped} {plural} not drawn: not finite, or not positive on a log axis");
        let look = (SMALL, palette::FAINT_INK);
        let at = (l.left, below + 1.7 * TEXT);
        canvas.text(&note, at, look, corner(), flat)?;
    }
    Ok(())
}

fn draw_series(canvas: &Canvas, chart: &Chart, l: &Layout, look: &Look, all: &[Look]) -> Drawn {
    let series = look.series;
    // Runs of points without a gap.
    let mut runs: Vec<Vec<Point>> = vec![Vec::new()];
    for &point in &series.points {
        match (chart.place(point), runs.last_mut()) {
            (Some(place), Some(run)) => run.push(l.pixel(place)),
            (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    let line = stroke(look.colour, if series.style == Style::LinePoints { 1.5 } else { 1.8 });
    match series.style {
        Style::Line | Style::LinePoints => {
            for run in &runs {
                canvas.dashed(run, series.dash, line)?;
            }
        }
        Style::Step => {
            for run in &runs {
                let mut stairs = Vec::with_capacity(2 * run.len());
                for (i, &(x, y)) in run.iter().enumerate() {
                    if i > 0 {
                        stairs.push((x, run[i - 1].1));
                    }
                    stairs.push((x, y));
                }
                canvas.dashed(&stairs, series.dash, line)?;
            }
        }
        Style::Bars => {
            let groups: Vec<&Look> = all.iter().filter(|o| o.series.style == Style::Bars).collect();
            let own = groups.iter().position(|o| std::ptr::eq(*o, look)).unwrap_or(0);
            let half = chart.bar_half_width();
            let width = 2.0 * half / groups.len() as f64;
            let base = chart.y.scale.place(0.0).unwrap_or(l.extent.y.0);
            for place in series.points.iter().filter_map(|&p| chart.place(p)) {
                let from = place.0 - half + own as f64 * width;
                let (a, b) = ((from, base), (from + width, place.1));
                canvas.rectangle(l.pixel(a), l.pixel(b), look.colour)?;
            }
        }
        Style::Body => {
            for run in runs.iter().filter(|r| r.len() > 2) {
                canvas.polygon(run, look.colour)?;
            }
        }
        Style::Points => {}
    }
    if matches!(series.style, Style::Points | Style::LinePoints) {
        for &point in runs.iter().flatten() {
            canvas.marker(point, look.marker, look.colour)?;
        }
    }
    Ok(())
}

fn draw_annotations(canvas: &Canvas, chart: &Chart, l: &Layout) -> Drawn {
    let mut labels = Vec::new();
    for line in &chart.lines {
        if let Some(place) = chart.y.scale.place(line.value) {
            let y = l.pixel((l.extent.x.0, place)).1;
            let ends = [(l.left, y), (l.right, y)];
            canvas.dashed(&ends, Dash::Dashed, stroke(palette::FAINT_INK, 1.1))?;
            labels.push((y, line.label.as_str()));
        }
    }
    // Close lines must not have their labels on top of each other.
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut free = f64::NEG_INFINITY;
    for (y, text) in labels {
        let y = y.max(free);
        free = y + 1.25 * SMALL;
        let at = (l.right + 6.0, y);
        let anchor = (HPos::Left, VPos::Center);
        canvas.text(text, at, (SMALL, palette::INK), anchor, FontTransform::None)?;
    }
    for mark in &chart.marks {
        if let Some(place) = chart.place((mark.x, mark.y)) {
            let [a, b] = mark.ends().map(|e| {
                let place = chart.x.scale.place(e)?;
                Some(l.pixel((place, place)).0)
            });
            let ends = a.zip(b).filter(|_| mark.x_error > 0.0);
            canvas.note_of_crossing(l.pixel(place), ends.map(|(a, b)| [a, b]))?;
        }
    }
    Ok(())
}

fn draw_legend(canvas: &Canvas, l: &Layout, entries: &[Entry]) -> Drawn {
    for (row, entry) in entries.iter().enumerate() {
        let y = l.top + LEGEND_ROW * (row as f64 + 0.5);
        let (a, b) = (l.legend, l.legend + 26.0);
        let middle = ((a + b) / 2.0, y);
        match entry.look {
            None => canvas.note_of_crossing(middle, Some([a + 2.0, b - 2.0]))?,
            Some(look) => {
                let style = look.series.style;
                if matches!(style, Style::Line | Style::LinePoints | Style::Step) {
                    let line = stroke(look.colour, 1.8);
                    canvas.dashed(&[(a, y), (b, y)], look.series.dash, line)?;
                }
                if matches!(style, Style::Points | Style::LinePoints) {
                    canvas.marker(middle, look.marker, look.colour)?;
                }
                if matches!(style, Style::Bars | Style::Body) {
                    canvas.rectangle((a + 4.0, y - 5.0), (b - 4.0, y + 5.0), look.colour)?;
                }
            }
        }
        let anchor = (HPos::Left, VPos::Center);
        let look = (TEXT, palette::INK);
        canvas.text(&entry.name, (b + 8.0, y), look, anchor, FontTransform::None)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn legend_of_a_family_keeps_both_ends() {
        assert_eq!(spread(3, 6), [0, 1, 2]);
        assert_eq!(spread(12, 6), [0, 2, 4, 7, 9, 11]);
        assert_eq!(spread(0, 6), [0usize; 0]);
    }

    /// Dashes cover on / (on + off) of a path of whole periods, over a corner too.
    #[test]
    fn dashes_keep_their_share_around_corners() {
        let path = [(0.0, 0.0), (5.0, 0.0), (5.0, 17.0)];
        let pieces = dashes(&path, 7.0, 4.0);
        let length: f64 = pieces
            .iter()
            .flat_map(|p| p.windows(2))
            .map(|w| (w[1].0 - w[0].0).hypot(w[1].1 - w[0].1))
            .sum();
        assert!((length - 14.0).abs() < 1e-12, "{length}");
        assert_eq!(pieces[0], [(0.0, 0.0), (5.0, 0.0), (5.0, 2.0)]);
    }
}
