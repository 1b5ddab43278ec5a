//! How far each input moves a result: a bar for each, the longest on top.

use plotters::style::text_anchor::{HPos, VPos};
use plotters::style::{FontTransform, RGBColor};

use super::axis::{Scale, padded, ticks};
use super::canvas::{Canvas, Drawn, Point, picture, stroke};
use super::layout::{MARGIN, NOTE_ROW, SMALL, TEXT, TITLE, width_of, wrapped};
use super::{ReportError, palette};

/// Lengths in px: of the plot, of a row, of its bar.
const WIDE: f64 = 480.0;
const ROW: f64 = 44.0;
const BAR: f64 = 14.0;

/// A result and the values that it has where inputs are others.
#[derive(Debug, Clone, PartialEq)]
pub struct Tornado {
    pub title: String,
    pub subtitle: String,
    /// What the result is, with its unit.
    pub axis: String,
    /// With all inputs at their nominal values; above 0.
    pub nominal: f64,
    /// From above.
    pub rows: Vec<TornadoRow>,
    /// Sentences beneath the picture.
    pub notes: Vec<String>,
}

/// One input, or a band.
#[derive(Debug, Clone, PartialEq)]
pub struct TornadoRow {
    pub name: String,
    /// Values of the result, above 0, and what each belongs to; may be empty.
    pub ends: Vec<(f64, String)>,
    /// Drawn in grey: a band of several inputs.
    pub band: bool,
}

impl Tornado {
    /// The picture, on a logarithmic axis, as an SVG document: the same bytes for the same values.
    ///
    /// # Errors
    /// [`ReportError::EmptyChart`] where no result is above 0; [`ReportError::Chart`] with plotters' own word.
    pub fn to_svg(&self) -> Result<String, ReportError> {
        let values = self.rows.iter().flat_map(|row| &row.ends).map(|end| end.0);
        let places = values.chain([self.nominal]).filter_map(place);
        let low = places.clone().fold(f64::INFINITY, f64::min);
        let high = places.fold(f64::NEG_INFINITY, f64::max);
        // a log axis of `padded` has a decade at least: too long for bars of some per cent
        let range = padded(low, high, Scale::Linear).filter(|_| low <= high);
        let range = range.ok_or_else(|| ReportError::EmptyChart {
            title: self.title.clone(),
            skipped: self.rows.len(),
        })?;
        self.drawn(range).map_err(|reason| ReportError::Chart {
            title: self.title.clone(),
            reason,
        })
    }

    fn drawn(&self, range: (f64, f64)) -> Result<String, String> {
        let names = self.rows.iter().map(|row| width_of(&row.name, TEXT));
        let left = MARGIN + names.fold(60.0, f64::max) + 10.0;
        // labels stand at the ends of the bars, within the plot where they have room
        let width = left + WIDE + MARGIN + 30.0;
        let lines = |text: &str, size| wrapped(text, size, width - 2.0 * MARGIN);
        let title = lines(&self.title, 1.1 * TITLE);
        let subtitle = lines(&self.subtitle, TEXT);
        let notes: Vec<String> = (self.notes.iter())
            .flat_map(|note| lines(note, SMALL))
            .collect();
        let words = 1.35 * TITLE * title.len() as f64 + 1.4 * TEXT * subtitle.len() as f64;
        let top = MARGIN + words + 10.0;
        let bottom = top + ROW * self.rows.len() as f64;
        let height = bottom + 3.6 * TEXT + NOTE_ROW * notes.len() as f64 + MARGIN;
        let plot = Plot {
            range,
            left,
            top,
            bottom,
        };
        picture((width, height), |canvas| {
            let mut y = MARGIN + 0.5 * TITLE;
            for line in &title {
                plain(canvas, line, (MARGIN, y), (TITLE, palette::INK), HPos::Left)?;
                y += 1.35 * TITLE;
            }
            for line in &subtitle {
                let faint = (TEXT, palette::FAINT_INK);
                plain(canvas, line, (MARGIN, y), faint, HPos::Left)?;
                y += 1.4 * TEXT;
            }
            plot.axis(canvas, &self.axis)?;
            for (k, row) in self.rows.iter().enumerate() {
                plot.row(canvas, row, self.nominal, k)?;
            }
            if let Some(x) = plot.pixel(self.nominal) {
                canvas.path(&[(x, top), (x, bottom)], stroke(palette::INK, 1.4))?;
            }
            for (k, note) in notes.iter().enumerate() {
                let at = (MARGIN, bottom + 3.6 * TEXT + NOTE_ROW * (k as f64 + 0.5));
                plain(canvas, note, at, (SMALL, palette::FAINT_INK), HPos::Left)?;
            }
            Ok(())
        })
    }
}

/// The part of the picture with the bars.
struct Plot {
    range: (f64, f64),
    left: f64,
    top: f64,
    bottom: f64,
}

impl Plot {
    fn pixel(&self, value: f64) -> Option<f64> {
        let share = (place(value)? - self.range.0) / (self.range.1 - self.range.0);
        Some(self.left + WIDE * share)
    }

    fn axis(&self, canvas: &Canvas, label: &str) -> Drawn {
        let ends = [(self.left, self.bottom), (self.left + WIDE, self.bottom)];
        for (at, text) in ticks(self.range, Scale::Log, 6).major {
            let share = (at - self.range.0) / (self.range.1 - self.range.0);
            let x = self.left + WIDE * share;
            canvas.path(
                &[(x, self.top), (x, self.bottom)],
                stroke(palette::GRID, 0.8),
            )?;
            let ink = (TEXT, palette::INK);
            plain(
                canvas,
                &text,
                (x, self.bottom + 0.9 * TEXT),
                ink,
                HPos::Center,
            )?;
        }
        canvas.path(&ends, stroke(palette::AXIS, 0.8))?;
        let at = (self.left + 0.5 * WIDE, self.bottom + 2.4 * TEXT);
        plain(canvas, label, at, (TEXT, palette::INK), HPos::Center)
    }

    fn row(&self, canvas: &Canvas, row: &TornadoRow, nominal: f64, number: usize) -> Drawn {
        let middle = self.top + ROW * (number as f64 + 0.62);
        let at = (self.left - 10.0, middle);
        plain(canvas, &row.name, at, (TEXT, palette::INK), HPos::Right)?;
        let Some(from) = self.pixel(nominal) else {
            return Ok(());
        };
        let mut drawn: Vec<(f64, f64, &str)> = (row.ends.iter())
            .filter_map(|(value, text)| Some((self.pixel(*value)?, *value, text.as_str())))
            .collect();
        drawn.sort_by(|a, b| a.0.total_cmp(&b.0));
        for &(x, value, _) in &drawn {
            let colour = match (row.band, value < nominal) {
                (true, _) => palette::AXIS,
                (_, true) => palette::QUALITATIVE[1],
                (_, false) => palette::QUALITATIVE[0],
            };
            let (a, b) = (from.min(x), from.max(x));
            canvas.rectangle(
                (a, middle - 0.5 * BAR),
                (b.max(a + 1.0), middle + 0.5 * BAR),
                colour,
            )?;
        }
        self.labels(canvas, &drawn, from, middle)
    }

    /// What the ends belong to, above the bar: the outermost ones, inside the plot.
    fn labels(&self, canvas: &Canvas, drawn: &[(f64, f64, &str)], from: f64, y: f64) -> Drawn {
        let y = y - 0.5 * BAR - 0.65 * SMALL;
        let ink = (SMALL, palette::FAINT_INK);
        let below = drawn.first().filter(|end| end.0 <= from);
        let above = drawn.last().filter(|end| end.0 > from);
        // each on its side of the nominal value, or from the edge of the plot where it is too long
        if let Some((_, _, text)) = below {
            let room = from - 4.0 - self.left;
            match width_of(text, SMALL) < room || above.is_some() {
                true => plain(canvas, text, (from - 4.0, y), ink, HPos::Right)?,
                false => plain(canvas, text, (from + 4.0, y), ink, HPos::Left)?,
            }
        }
        if let Some((_, _, text)) = above {
            let room = self.left + WIDE + 30.0 - from - 4.0;
            match width_of(text, SMALL) < room || below.is_some() {
                true => plain(canvas, text, (from + 4.0, y), ink, HPos::Left)?,
                false => plain(canvas, text, (from - 4.0, y), ink, HPos::Right)?,
            }
        }
        Ok(())
    }
}

fn place(value: f64) -> Option<f64> {
    (value > 0.0 && value.is_finite()).then(|| value.log10())
}

fn plain(canvas: &Canvas, text: &str, at: Point, look: (f64, RGBColor), to: HPos) -> Drawn {
    canvas.text(text, at, look, (to, VPos::Center), FontTransform::None)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tornado(values: &[f64]) -> Tornado {
        let ends = values.iter().map(|v| (*v, format!("<{v}>"))).collect();
        Tornado {
            title: "life <h>".to_owned(),
            subtitle: String::new(),
            axis: "h".to_owned(),
            nominal: 100.0,
            rows: vec![TornadoRow {
                name: "K".to_owned(),
                ends,
                band: false,
            }],
            notes: vec!["a note".to_owned()],
        }
    }

    #[test]
    fn a_bar_for_each_end_on_its_side() {
        let svg = tornado(&[50.0, 200.0]).to_svg().unwrap();
        for words in ["&lt;50&gt;", "&lt;200&gt;", "life &lt;h&gt;", "a note"] {
            assert!(svg.contains(words), "{words}");
        }
        // twice and half are as long on a logarithmic axis
        let widths: Vec<i32> = (svg.lines())
            .filter(|line| line.contains("<rect") && !line.contains("#FFFFFF"))
            .filter_map(|line| {
                let rest = line.split(" width=\"").nth(1)?;
                rest.split('"').next()?.parse().ok()
            })
            .collect();
        assert_eq!(widths.len(), 2, "{svg}");
        assert!((widths[0] - widths[1]).abs() <= 1, "{widths:?}");
    }

    #[test]
    fn what_has_no_place_is_left_out_and_nothing_is_an_error() {
        assert!(tornado(&[f64::NAN, 0.0, f64::INFINITY]).to_svg().is_ok());
        let mut nothing = tornado(&[]);
        nothing.nominal = f64::NAN;
        assert!(matches!(
            nothing.to_svg(),
            Err(ReportError::EmptyChart { .. })
        ));
    }
}
