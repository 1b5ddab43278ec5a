use plotters::coord::Shift;
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text};
use plotters::prelude::{DrawingArea, IntoDrawingArea, SVGBackend};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontDesc, FontFamily, FontStyle, FontTransform, RGBColor, ShapeStyle, TextStyle, WHITE,
};

use super::chart::Dash;
use super::layout::TITLE;
use super::palette;

/// Units in a pixel. plotters places everything on whole units; tenths of a pixel keep curves
/// smooth.
pub(super) const U: f64 = 10.0;

/// From the top left of the picture, in pixels.
pub(super) type Point = (f64, f64);

/// The picture under way.
pub(super) struct Canvas<'a> {
    pub area: DrawingArea<SVGBackend<'a>, Shift>,
}

pub(super) type Drawn = Result<(), String>;

pub(super) fn units((x, y): Point) -> (i32, i32) {
    ((x * U).round() as i32, (y * U).round() as i32)
}

pub(super) fn stroke(colour: RGBColor, width: f64) -> ShapeStyle {
    colour.stroke_width((width * U).round() as u32)
}

/// The SVG of a picture of `size` in pixels, which `draw` fills.
pub(super) fn picture(size: Point, draw: impl FnOnce(&Canvas) -> Drawn) -> Result<String, String> {
    let (w, h) = units(size);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (w as u32, h as u32)).into_drawing_area();
        area.fill(&WHITE).map_err(|e| e.to_string())?;
        let canvas = Canvas { area };
        draw(&canvas)?;
        canvas.area.present().map_err(|e| e.to_string())?;
    }
    let pixels = |units: i32| f64::from(units) / U;
    Ok(svg.replacen(
        &format!("width=\"{w}\" height=\"{h}\""),
        &format!("width=\"{}\" height=\"{}\"", pixels(w), pixels(h)),
        1,
    ))
}

impl Canvas<'_> {
    pub(super) fn text(
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
        // Control characters have no place in XML.
        let clean: String = text.chars().filter(|c| !c.is_control()).collect();
        self.area
            .draw(&Text::new(clean, units(at), style))
            .map_err(|e| e.to_string())
    }

    pub(super) fn path(&self, points: &[Point], style: ShapeStyle) -> Drawn {
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

    pub(super) fn dashed(&self, points: &[Point], dash: Dash, style: ShapeStyle) -> Drawn {
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

    pub(super) fn polygon(&self, points: &[Point], fill: RGBColor) -> Drawn {
        let corners: Vec<(i32, i32)> = points.iter().map(|&p| units(p)).collect();
        self.area
            .draw(&Polygon::new(corners, fill.filled()))
            .map_err(|e| e.to_string())
    }

    pub(super) fn rectangle(&self, a: Point, b: Point, fill: RGBColor) -> Drawn {
        self.area
            .draw(&Rectangle::new([units(a), units(b)], fill.filled()))
            .map_err(|e| e.to_string())
    }

    /// One of five shapes, so that series differ without colour too.
    pub(super) fn marker(&self, (x, y): Point, shape: usize, colour: RGBColor) -> Drawn {
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

    pub(super) fn note_of_crossing(&self, at: Point, ends: Option<[f64; 2]>) -> Drawn {
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

/// Cuts a path into dashes, lengths in px.
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

#[cfg(test)]
mod tests {
    use super::*;

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
