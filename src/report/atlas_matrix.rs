use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{FontTransform, RGBColor, WHITE};

use super::canvas::{Canvas, Drawn, picture, stroke};
use super::layout::{MARGIN, SMALL, TEXT, TITLE};
use super::{ReportError, ResultRow, palette};

/// Lengths in px.
const WIDTH: f64 = 1200.0;
const NAME: f64 = 150.0;
const ENGINE: f64 = 84.0;
const CELL: f64 = 112.0;
const LINE: f64 = 18.0;
const COLUMNS: usize = 9;

/// Fill and ink of a verdict: light, middle and dark, so that they differ in grey too.
fn look(verdict: &str) -> (RGBColor, RGBColor) {
    match verdict {
        "pass" => (RGBColor(205, 231, 222), palette::INK),
        "unsolved" => (RGBColor(240, 190, 80), palette::INK),
        "fail" => (RGBColor(160, 58, 0), WHITE),
        _ => (WHITE, palette::FAINT_INK),
    }
}

/// One verdict: an engine on a rung.
struct Cell<'a> {
    engine: &'a str,
    row: &'a ResultRow,
}

/// A rung of an entry, a cell an engine.
struct Column<'a> {
    rung: &'a str,
    cells: Vec<Cell<'a>>,
}

/// Rungs of `COLUMNS` at most, the whole ladder of an entry over one band or more.
struct Band<'a> {
    entry: &'a str,
    columns: Vec<Column<'a>>,
}

/// The atlas as a picture: a band for each entry, a column for each rung, a row for each engine. Each
/// cell has one word for the result, on a fill that shows the verdict.
///
/// # Arguments
/// - `rows`: of an atlas's `results.csv`, in their order.
///
/// # Errors
/// `ReportError::EmptyChart` without a row; `ReportError::Chart` with plotters' own word.
pub fn matrix(rows: &[ResultRow]) -> Result<String, ReportError> {
    let title = || "The failure atlas".to_owned();
    if rows.is_empty() {
        return Err(ReportError::EmptyChart {
            title: title(),
            skipped: 0,
        });
    }
    draw(&bands(rows)).map_err(|reason| ReportError::Chart {
        title: title(),
        reason,
    })
}

fn bands(rows: &[ResultRow]) -> Vec<Band<'_>> {
    let mut bands: Vec<Band<'_>> = Vec::new();
    for rung in rows.chunk_by(|a, b| a.scene == b.scene && a.rung == b.rung) {
        let engines = rung.chunk_by(|a, b| a.engine == b.engine);
        let column = Column {
            rung: &rung[0].rung,
            cells: engines
                .map(|rows| Cell {
                    engine: &rows[0].engine,
                    row: &rows[0],
                })
                .collect(),
        };
        match bands.last_mut() {
            Some(band) if band.entry == rung[0].scene && band.columns.len() < COLUMNS => {
                band.columns.push(column);
            }
            _ => bands.push(Band {
                entry: &rung[0].scene,
                columns: vec![column],
            }),
        }
    }
    bands
}

impl Band<'_> {
    fn lines(&self) -> usize {
        self.columns
            .iter()
            .map(|c| c.cells.len())
            .max()
            .unwrap_or(0)
    }

    fn height(&self) -> f64 {
        LINE * (self.lines() + 1) as f64 + 5.0
    }
}

fn draw(bands: &[Band<'_>]) -> Result<String, String> {
    let top = MARGIN + 1.35 * TITLE + 2.2 * TEXT;
    let height = top + bands.iter().map(Band::height).sum::<f64>() + MARGIN;
    picture((WIDTH, height), |canvas| {
        header(canvas)?;
        let mut y = top;
        let mut entry = "";
        for band in bands {
            draw_band(canvas, band, y, entry)?;
            entry = band.entry;
            y += band.height();
        }
        Ok(())
    })
}

const LEFT: (HPos, VPos) = (HPos::Left, VPos::Center);
const MIDDLE: (HPos, VPos) = (HPos::Center, VPos::Center);

fn header(canvas: &Canvas) -> Drawn {
    let flat = || FontTransform::None;
    let look_of = (TITLE, palette::INK);
    let corner = (HPos::Left, VPos::Top);
    canvas.text(
        "The failure atlas",
        (MARGIN, MARGIN),
        look_of,
        corner,
        flat(),
    )?;
    let y = MARGIN + 1.35 * TITLE + 0.9 * TEXT;
    let mut x = MARGIN;
    for (verdict, text) in [
        ("pass", "pass"),
        ("unsolved", "unsolved, and said so"),
        ("fail", "fail"),
        ("", "not run"),
    ] {
        let (fill, _) = look(verdict);
        frame(canvas, (x, y - 6.0), (x + 22.0, y + 6.0), fill)?;
        let at = (x + 28.0, y);
        canvas.text(text, at, (TEXT, palette::INK), LEFT, flat())?;
        x += 44.0 + super::layout::width_of(text, TEXT);
    }
    Ok(())
}

/// A filled rectangle with a thin edge.
pub(super) fn frame(canvas: &Canvas, a: (f64, f64), b: (f64, f64), fill: RGBColor) -> Drawn {
    canvas.rectangle(a, b, fill)?;
    let corners = [a, (b.0, a.1), b, (a.0, b.1), a];
    canvas.path(&corners, stroke(palette::GRID, 0.8))
}

/// `above`: the entry of the previous band.
fn draw_band(canvas: &Canvas, band: &Band<'_>, top: f64, above: &str) -> Drawn {
    let flat = || FontTransform::None;
    if band.entry != above {
        let ends = [(MARGIN, top), (WIDTH - MARGIN, top)];
        canvas.path(&ends, stroke(palette::AXIS, 0.8))?;
        let at = (MARGIN, top + 0.5 * LINE + 2.0);
        canvas.text(band.entry, at, (1.04 * TEXT, palette::INK), LEFT, flat())?;
    }
    let line = |k: usize| top + 2.0 + LINE * (k as f64 + 1.0);
    if let Some(column) = band.columns.first() {
        for (k, cell) in column.cells.iter().enumerate() {
            let at = (MARGIN + NAME - ENGINE + 62.0, line(k) + 0.5 * LINE);
            let ink = (SMALL, palette::FAINT_INK);
            canvas.text(cell.engine, at, ink, (HPos::Right, VPos::Center), flat())?;
        }
    }
    for (column, from) in band.columns.iter().zip(0..) {
        let left = MARGIN + NAME + CELL * f64::from(from);
        let middle = left + 0.5 * CELL;
        let at = (middle, top + 0.5 * LINE + 2.0);
        let size = fitting(column.rung, SMALL);
        canvas.text(column.rung, at, (size, palette::INK), MIDDLE, flat())?;
        for (k, cell) in column.cells.iter().enumerate() {
            let (fill, ink) = look(&cell.row.verdict);
            let (a, b) = (
                (left + 1.0, line(k) + 1.0),
                (left + CELL - 1.0, line(k) + LINE - 1.0),
            );
            frame(canvas, a, b, fill)?;
            let word = match cell.row.verdict.as_str() {
                "" if cell.row.mode == "cannot" => "–",
                _ => cell.row.mode.as_str(),
            };
            let at = (middle, line(k) + 0.5 * LINE);
            canvas.text(word, at, (fitting(word, SMALL), ink), MIDDLE, flat())?;
        }
    }
    Ok(())
}

/// The size \[px\], `size` at most, at which a text fits into a cell.
fn fitting(text: &str, size: f64) -> f64 {
    // the generous estimate of charts, a tenth less: most letters here are narrow ones
    let width = 0.9 * super::layout::width_of(text, size);
    size * ((CELL - 6.0) / width).min(1.0)
}

#[cfg(test)]
#[path = "atlas_matrix_tests.rs"]
mod tests;
