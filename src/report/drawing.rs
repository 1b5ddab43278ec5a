use plotters::style::FontTransform;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas::{Canvas, Drawn, Point, picture, stroke};
use super::chart::{Chart, Dash, Extent, Style};
use super::labels;
use super::layout::{LEGEND_NAME, Layout, MARGIN, NOTE_ROW, SMALL, TEXT, TITLE};
use super::legend::{Entry, Look, legend, looks};
use super::palette;

/// Where the plot lies in its picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    /// Left and right edge of the plot as shares of the picture's width.
    pub edges: Point,
    /// Places along the x axis at these edges.
    pub values: Point,
}

/// Draws the chart as SVG with a plot of `plot` pixels; the error is plotters' own word. Only the
/// header's size is in pixels.
pub(super) fn draw(
    chart: &Chart,
    extent: Extent,
    plot: Point,
    with_legend: bool,
) -> Result<(String, Window), String> {
    let looks = looks(chart);
    let mut legend = legend(chart, &looks);
    if !with_legend {
        legend.clear();
    }
    let layout = Layout::new(chart, extent, &legend, plot);
    let svg = picture(layout.size, |canvas| {
        draw_frame(canvas, chart, &layout)?;
        for look in &looks {
            draw_series(canvas, chart, &layout, look, &looks)?;
        }
        draw_annotations(canvas, chart, &layout)?;
        draw_labels(canvas, chart, &layout)?;
        draw_legend(canvas, &layout, &legend)?;
        Ok(())
    })?;
    let window = Window {
        edges: (layout.left / layout.size.0, layout.right / layout.size.0),
        values: layout.extent.x,
    };
    Ok((svg, window))
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
    canvas.text(
        &chart.y.label,
        beside,
        label,
        centre,
        FontTransform::Rotate270,
    )?;
    let mut y = MARGIN;
    let corner = || (HPos::Left, VPos::Top);
    for line in &l.title {
        canvas.text(
            line,
            (l.left, y),
            (TITLE, palette::INK),
            corner(),
            flat.clone(),
        )?;
        y += 1.35 * TITLE;
    }
    for line in &l.subtitle {
        let look = (TEXT, palette::FAINT_INK);
        canvas.text(line, (l.left, y), look, corner(), flat.clone())?;
        y += 1.4 * TEXT;
    }
    let mut y = l.notes_top;
    for note in &l.notes {
        let look = (SMALL, palette::FAINT_INK);
        canvas.text(note, (l.left, y), look, corner(), flat.clone())?;
        y += NOTE_ROW;
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
    let line = stroke(
        look.colour,
        if series.style == Style::LinePoints {
            1.5
        } else {
            1.8
        },
    );
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
            let groups: Vec<&Look> = all
                .iter()
                .filter(|o| o.series.style == Style::Bars)
                .collect();
            let own = groups
                .iter()
                .position(|o| std::ptr::eq(*o, look))
                .unwrap_or(0);
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
    for value in chart.lines.iter().map(|line| line.value).chain(chart.zero) {
        if let Some(place) = chart.y.scale.place(value) {
            let y = l.pixel((l.extent.x.0, place)).1;
            let ends = [(l.left, y), (l.right, y)];
            canvas.dashed(&ends, Dash::Dashed, stroke(palette::FAINT_INK, 1.1))?;
        }
    }
    for (down, text) in &l.lines {
        let at = (l.right + 6.0, l.top + down);
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

fn draw_labels(canvas: &Canvas, chart: &Chart, l: &Layout) -> Drawn {
    let pixel = |&p: &(f64, f64)| chart.place(p).map(|place| l.pixel(place));
    let points = chart.series.iter().flat_map(|s| &s.points);
    let markers: Vec<Point> = points.filter_map(pixel).collect();
    let joined = chart
        .series
        .iter()
        .filter(|s| matches!(s.style, Style::Line | Style::LinePoints));
    let pieces = joined
        .flat_map(|s| s.points.windows(2))
        .filter_map(|pair| pixel(&pair[0]).zip(pixel(&pair[1])));
    let levels = chart.lines.iter().map(|line| line.value).chain(chart.zero);
    let across = levels.filter_map(|v| chart.y.scale.place(v)).map(|place| {
        let y = l.pixel((l.extent.x.0, place)).1;
        ((l.left, y), (l.right, y))
    });
    let lines: Vec<(Point, Point)> = pieces.chain(across).collect();
    for (at, text) in labels::place(chart, l, &markers, &lines) {
        let look = (SMALL, palette::FAINT_INK);
        let anchor = (HPos::Left, VPos::Center);
        canvas.text(&text, at, look, anchor, FontTransform::None)?;
    }
    Ok(())
}

fn draw_legend(canvas: &Canvas, l: &Layout, entries: &[Entry]) -> Drawn {
    for (entry, ((a, top), name)) in entries.iter().zip(&l.legend) {
        let (a, y) = (*a, top + 0.5 * TEXT);
        let b = a + LEGEND_NAME - 8.0;
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
        for (k, line) in name.iter().enumerate() {
            let at = (a + LEGEND_NAME, y + 1.2 * TEXT * k as f64);
            canvas.text(line, at, look, anchor, FontTransform::None)?;
        }
    }
    Ok(())
}
