//! A value over two variables: a cell for each pair, coloured and with the number in it.

use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{FontTransform, RGBColor, WHITE};

use super::atlas_matrix::frame;
use super::canvas::{Canvas, Drawn, Point, picture, stroke};
use super::layout::{MARGIN, NOTE_ROW, SMALL, TEXT, TITLE, width_of};
use super::{ReportError, number, palette};

/// Lengths in px.
const LINE: f64 = 24.0;
/// Height of a heading above its cells.
const HEADING: f64 = 26.0;
/// Width of all cells of a map at most, and that of a cell whose label is short.
const WIDE: f64 = 860.0;
const CELL: f64 = 66.0;
/// Width of a cell from which on its number has room.
const ROOM: f64 = 44.0;
/// Ratio of the largest to the smallest value from which on colours follow the logarithm.
const DECADES: f64 = 10.0;
const BROKEN: RGBColor = RGBColor(213, 94, 0);

/// Maps of one value, with one scale of colours.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueMap {
    pub title: String,
    pub subtitle: String,
    /// What runs to the right and upwards.
    pub x: String,
    pub y: String,
    pub maps: Vec<MapPanel>,
    /// Sentences beneath the picture.
    pub notes: Vec<String>,
}

/// One map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapPanel {
    /// What is the same in all its cells; may be empty.
    pub heading: String,
    pub columns: Vec<String>,
    /// From below.
    pub rows: Vec<String>,
    /// By row, then by column.
    pub cells: Vec<Vec<MapCell>>,
}

/// A cell of a map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapCell {
    /// `None`, or a number that is not finite: there is no value.
    pub value: Option<f64>,
    /// Framed, as not to be trusted.
    pub doubtful: bool,
}

impl MapCell {
    fn finite(&self) -> Option<f64> {
        self.value.filter(|value| value.is_finite())
    }
}

/// How values become colours.
struct Ramp {
    low: f64,
    high: f64,
    log: bool,
}

impl Ramp {
    fn of(maps: &[MapPanel]) -> Option<Ramp> {
        let cells = maps.iter().flat_map(|map| map.cells.iter().flatten());
        let values: Vec<f64> = cells.filter_map(MapCell::finite).collect();
        let low = values.iter().copied().reduce(f64::min)?;
        let high = values.iter().copied().reduce(f64::max)?;
        let log = low > 0.0 && high / low > DECADES;
        Some(Ramp { low, high, log })
    }

    /// 0 for the lowest value, 1 for the highest.
    fn share(&self, value: f64) -> f64 {
        let place = |x: f64| if self.log { x.ln() } else { x };
        let (low, high) = (place(self.low), place(self.high));
        match high > low {
            true => (place(value) - low) / (high - low),
            false => 0.0,
        }
    }

    fn value(&self, share: f64) -> f64 {
        match self.log {
            true => self.low * (self.high / self.low).powf(share),
            false => self.low + share * (self.high - self.low),
        }
    }
}

impl ValueMap {
    /// The maps below one another, as an SVG document: the same bytes for the same map.
    ///
    /// # Errors
    /// [`ReportError::EmptyChart`] where no cell has a value; [`ReportError::Chart`] with plotters' own
    /// word.
    pub fn to_svg(&self) -> Result<String, ReportError> {
        let ramp = Ramp::of(&self.maps).ok_or_else(|| ReportError::EmptyChart {
            title: self.title.clone(),
            skipped: self
                .maps
                .iter()
                .map(|m| m.cells.iter().flatten().count())
                .sum(),
        })?;
        self.drawn(&ramp).map_err(|reason| ReportError::Chart {
            title: self.title.clone(),
            reason,
        })
    }

    fn drawn(&self, ramp: &Ramp) -> Result<String, String> {
        let columns = self.maps.iter().map(|m| m.columns.len()).max().unwrap_or(1);
        let names = self.maps.iter().flat_map(|m| &m.columns);
        let names = names.map(|text| width_of(text, SMALL) + 8.0);
        let cell = (WIDE / columns.max(1) as f64).min(names.fold(CELL, f64::max));
        let labels = self.maps.iter().flat_map(|m| &m.rows);
        let labels = labels.map(|text| width_of(text, TEXT)).fold(20.0, f64::max);
        let left = MARGIN + 1.9 * TEXT + labels + 8.0;
        let notes = self.notes.iter().map(|note| width_of(note, SMALL));
        let words = [&self.title, &self.subtitle].map(|text| width_of(text, TITLE));
        let words = words.into_iter().chain(notes).fold(320.0, f64::max);
        let width = (left + cell * columns as f64).max(MARGIN + 0.85 * words) + MARGIN;
        let top = MARGIN + 1.35 * TITLE + 1.6 * TEXT + 3.0 * TEXT;
        let heights = self.maps.iter().map(|map| height(map, cell));
        // room for the label beside them, too
        let of_maps = heights.sum::<f64>().max(width_of(&self.y, TEXT));
        let bottom = top + of_maps + 1.9 * TEXT;
        let height_all = bottom + NOTE_ROW * self.notes.len() as f64 + MARGIN;
        picture((width, height_all), |canvas| {
            self.header(canvas, ramp)?;
            let mut y = top;
            for map in &self.maps {
                draw(canvas, map, ramp, (left, y), cell)?;
                y += height(map, cell);
            }
            let ink = (TEXT, palette::INK);
            let middle = left + 0.5 * cell * columns as f64;
            let at = (middle, y + 2.0);
            canvas.text(
                &self.x,
                at,
                ink,
                (HPos::Center, VPos::Top),
                FontTransform::None,
            )?;
            let at = (MARGIN, top + 0.5 * of_maps);
            let turned = FontTransform::Rotate270;
            canvas.text(&self.y, at, ink, (HPos::Center, VPos::Top), turned)?;
            for (k, note) in self.notes.iter().enumerate() {
                let at = (MARGIN, bottom + NOTE_ROW * (k as f64 + 0.5));
                plain(canvas, note, at, (SMALL, palette::FAINT_INK), HPos::Left)?;
            }
            Ok(())
        })
    }

    /// Title, and which colour is which value.
    fn header(&self, canvas: &Canvas, ramp: &Ramp) -> Drawn {
        let y = MARGIN + 0.5 * TITLE;
        plain(
            canvas,
            &self.title,
            (MARGIN, y),
            (TITLE, palette::INK),
            HPos::Left,
        )?;
        let y = MARGIN + 1.35 * TITLE + 0.6 * TEXT;
        let faint = (TEXT, palette::FAINT_INK);
        plain(canvas, &self.subtitle, (MARGIN, y), faint, HPos::Left)?;
        let y = y + 1.7 * TEXT;
        let (from, step, steps) = (MARGIN + 76.0, 3.0, 48);
        for k in 0..steps {
            let x = from + step * f64::from(k);
            let colour = palette::ramp(f64::from(k) / f64::from(steps - 1));
            canvas.rectangle((x, y - 6.0), (x + step + 0.2, y + 6.0), colour)?;
        }
        let ink = (SMALL, palette::INK);
        plain(
            canvas,
            &number(ramp.low, 4),
            (from - 6.0, y),
            ink,
            HPos::Right,
        )?;
        let (end, middle) = (from + step * f64::from(steps), ramp.value(0.5));
        let scale = match ramp.log {
            true => format!(", logarithmic, {} in the middle", number(middle, 3)),
            false => String::new(),
        };
        let text = format!("{}{scale}", number(ramp.high, 4));
        plain(canvas, &text, (end + 6.0, y), ink, HPos::Left)
    }
}

/// Height of a map with its heading and the labels below it.
fn height(map: &MapPanel, cell: f64) -> f64 {
    let heading = if map.heading.is_empty() { 6.0 } else { HEADING };
    heading + line(map, cell) * map.rows.len() as f64 + 1.7 * TEXT + 6.0
}

/// Height of a row.
fn line(map: &MapPanel, cell: f64) -> f64 {
    match map.rows.len() > 24 || cell < ROOM {
        true => LINE.min(cell.max(480.0 / map.rows.len() as f64)),
        false => LINE,
    }
}

fn plain(canvas: &Canvas, text: &str, at: Point, look: (f64, RGBColor), to: HPos) -> Drawn {
    canvas.text(text, at, look, (to, VPos::Center), FontTransform::None)
}

/// Labels of `texts` that have room side by side, each `size` px long: every n-th.
fn every(texts: &[String], size: f64, needed: impl Fn(&String) -> f64) -> usize {
    let longest = texts.iter().map(needed).fold(1.0, f64::max);
    (longest / size).ceil().max(1.0) as usize
}

fn draw(canvas: &Canvas, map: &MapPanel, ramp: &Ramp, (left, top): Point, cell: f64) -> Drawn {
    let ink = (TEXT, palette::INK);
    let mut y = top + 6.0;
    if !map.heading.is_empty() {
        plain(
            canvas,
            &map.heading,
            (left, top + 0.55 * HEADING),
            ink,
            HPos::Left,
        )?;
        y = top + HEADING;
    }
    let line = line(map, cell);
    let bottom = y + line * map.rows.len() as f64;
    let nth = every(&map.rows, line, |_| 1.2 * SMALL);
    for (k, (label, cells)) in map.rows.iter().zip(&map.cells).enumerate() {
        let row = bottom - line * (k as f64 + 1.0);
        if k.is_multiple_of(nth) {
            let at = (left - 8.0, row + 0.5 * line);
            plain(canvas, label, at, (SMALL, palette::INK), HPos::Right)?;
        }
        for (column, of) in cells.iter().enumerate() {
            let x = left + cell * column as f64;
            one(canvas, of, ramp, (x, row), (cell, line))?;
        }
    }
    let nth = every(&map.columns, cell, |text| width_of(text, SMALL) + 6.0);
    for (k, label) in map.columns.iter().enumerate().step_by(nth) {
        let at = (left + cell * (k as f64 + 0.5), bottom + 0.8 * TEXT);
        plain(canvas, label, at, (SMALL, palette::INK), HPos::Center)?;
    }
    Ok(())
}

fn one(canvas: &Canvas, cell: &MapCell, ramp: &Ramp, at: Point, size: Point) -> Drawn {
    let (a, b) = (at, (at.0 + size.0, at.1 + size.1));
    let (fill, ink) = match cell.finite() {
        None => (WHITE, palette::FAINT_INK),
        Some(value) => match ramp.share(value) {
            share if share < 0.35 => (palette::ramp(share), palette::INK),
            share => (palette::ramp(share), WHITE),
        },
    };
    frame(canvas, a, b, fill)?;
    if cell.doubtful {
        let (a, b) = ((a.0 + 1.5, a.1 + 1.5), (b.0 - 1.5, b.1 - 1.5));
        let corners = [a, (b.0, a.1), b, (a.0, b.1), a];
        canvas.path(&corners, stroke(BROKEN, 2.4))?;
    }
    if size.0 < ROOM || size.1 < LINE {
        return Ok(());
    }
    let text = cell.finite().map_or("–".to_owned(), |v| number(v, 4));
    let middle = (at.0 + 0.5 * size.0, at.1 + 0.5 * size.1);
    plain(canvas, &text, middle, (SMALL, ink), HPos::Center)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(columns: usize, rows: usize, value: impl Fn(usize, usize) -> Option<f64>) -> ValueMap {
        let names = |n: usize| (0..n).map(|k| format!("{k}.5")).collect();
        let cell = |row, column| MapCell {
            value: value(row, column),
            doubtful: row == column,
        };
        let cells = (0..rows).map(|r| (0..columns).map(|c| cell(r, c)).collect());
        ValueMap {
            title: "life <h>".to_owned(),
            subtitle: "s".to_owned(),
            x: "speed".to_owned(),
            y: "friction".to_owned(),
            maps: vec![MapPanel {
                heading: "torque = 20".to_owned(),
                columns: names(columns),
                rows: names(rows),
                cells: cells.collect(),
            }],
            notes: vec!["a note".to_owned()],
        }
    }

    #[test]
    fn a_map_draws_every_value_it_has_room_for() {
        let small = map(3, 2, |r, c| Some((10 * r + c) as f64 + 100.25));
        let svg = small.to_svg().unwrap();
        for text in [
            "100.2",
            "102.2",
            "112.2",
            "torque = 20",
            "life &lt;h&gt;",
            "a note",
        ] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg, small.to_svg().unwrap());
        let large = map(90, 40, |r, c| Some((r * c) as f64));
        let svg = large.to_svg().unwrap();
        assert!(!svg.contains("NaN") && svg.matches("<rect").count() > 3600);
    }

    #[test]
    fn cells_without_a_value_stay_white() {
        let holes = map(2, 2, |r, c| (r != c).then_some(f64::NAN));
        assert!(matches!(
            holes.to_svg(),
            Err(ReportError::EmptyChart { skipped: 4, .. })
        ));
        let one = map(2, 1, |_, c| Some(if c == 0 { 5.0 } else { f64::INFINITY }));
        let svg = one.to_svg().unwrap();
        assert!(
            svg.contains('–') && !svg.contains("NaN") && !svg.contains("inf"),
            "{svg}"
        );
    }

    #[test]
    fn colours_follow_the_logarithm_over_decades() {
        let ramp = |values: [f64; 2]| Ramp::of(&map(2, 1, |_, c| Some(values[c])).maps).unwrap();
        assert!((ramp([1.0, 100.0]).share(10.0) - 0.5).abs() < 1e-12);
        assert!((ramp([1.0, 100.0]).value(0.5) - 10.0).abs() < 1e-12);
        assert!((ramp([-1.0, 100.0]).share(49.5) - 0.5).abs() < 1e-12);
        assert_eq!(ramp([3.0, 3.0]).share(3.0), 0.0);
    }
}
