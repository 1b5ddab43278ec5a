//! The frame of a picture of a scene: its title, the plane in pixels, a bar for lengths, and lines below.

use super::layout::width_of;
use super::markup::{escaped, six_digits};
use super::palette::{FAINT_INK, INK};
use super::stage::View;
use super::still_bodies::{Map, hex};
use std::fmt::Write;

/// Lengths in pixels: of the picture, of the margin, of a line of text and of its letters.
const WIDTH: f64 = 760.0;
const MOST_HIGH: f64 = 560.0;
const LEAST_HIGH: f64 = 120.0;
const MARGIN: f64 = 16.0;
pub(super) const ROW: f64 = 19.0;
const TEXT: f64 = 12.5;

/// Where the plane lies in the picture.
pub(super) struct Sheet {
    pub map: Map,
    /// Size of the part that shows the plane, and its distance from the top.
    pub wide: f64,
    pub high: f64,
    top: f64,
}

impl Sheet {
    /// The plane of `view` as large as there is room, in the middle where it is narrower or lower.
    pub fn of(view: View) -> Sheet {
        let (w, h) = (view.x[1] - view.x[0], view.y[1] - view.y[0]);
        let wide = WIDTH - 2.0 * MARGIN;
        let scale = (wide / w).min(MOST_HIGH / h);
        let high = (scale * h).max(LEAST_HIGH);
        let (dx, dy) = (0.5 * (wide / scale - w), 0.5 * (high / scale - h));
        let view = View {
            x: [view.x[0] - dx, view.x[1] + dx],
            y: [view.y[0] - dy, view.y[1] + dy],
        };
        Sheet {
            map: Map { view, scale },
            wide,
            high,
            top: MARGIN + 2.0 * ROW + 6.0,
        }
    }

    /// The start of the document, up to the plane.
    ///
    /// # Arguments
    /// - `rows`: lines below the plane, without that of the bar.
    /// - `below`: the line below the title, as SVG text.
    pub fn open(&self, title: &str, below: &str, rows: usize) -> String {
        let total = self.top + self.high + 10.0 + ROW * (rows as f64 + 1.0) + MARGIN - 6.0;
        let mut title = title.to_owned();
        let most = WIDTH - 2.0 * MARGIN;
        while width_of(&title, 15.0) > most {
            title.pop();
            if width_of(&title, 15.0) <= most {
                title.pop();
                title.push('…');
            }
        }
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{total:.0}\" \
             viewBox=\"0 0 {WIDTH} {total:.0}\" font-family=\"sans-serif\" font-size=\"{TEXT}\">\n\
             <rect width=\"{WIDTH}\" height=\"{total:.0}\" fill=\"#ffffff\"/>\n\
             <text x=\"{MARGIN}\" y=\"{}\" font-size=\"15\" font-weight=\"bold\" fill=\"{}\">{}</text>\n\
             <text x=\"{MARGIN}\" y=\"{}\" fill=\"{}\">{below}</text>\n\
             <svg x=\"{MARGIN}\" y=\"{}\" width=\"{:.1}\" height=\"{:.1}\">\n",
            MARGIN + 0.7 * ROW,
            hex(INK),
            escaped(&title),
            MARGIN + 1.75 * ROW,
            hex(FAINT_INK),
            self.top,
            self.wide,
            self.high,
        )
    }

    /// The end of the document: the edge of the plane, a bar for lengths of `unit`, and lines of SVG text.
    pub fn close(&self, svg: &mut String, unit: &str, lines: &[String]) {
        svg.push_str("</svg>\n");
        let _ = writeln!(
            svg,
            "<rect x=\"{MARGIN}\" y=\"{}\" width=\"{:.1}\" height=\"{:.1}\" \
             fill=\"none\" stroke=\"#cfcfcf\"/>",
            self.top, self.wide, self.high
        );
        let mut y = self.top + self.high + 10.0 + 0.75 * ROW;
        self.scale_bar(svg, y, unit);
        for line in lines {
            y += ROW;
            let ink = hex(INK);
            let _ = writeln!(
                svg,
                "<text x=\"{MARGIN}\" y=\"{y:.1}\" fill=\"{ink}\">{line}</text>"
            );
        }
        svg.push_str("</svg>\n");
    }

    /// A bar of a round length, about a sixth of the picture.
    fn scale_bar(&self, svg: &mut String, y: f64, unit: &str) {
        let scale = self.map.scale;
        let wanted = WIDTH / 6.0 / scale;
        let decade = 10f64.powf(wanted.log10().floor());
        let length = [5.0, 2.0, 1.0].map(|k| k * decade);
        let length = length.into_iter().find(|l| *l <= wanted);
        let length = length.unwrap_or(decade);
        let right = MARGIN + scale * length;
        let ink = hex(INK);
        let middle = y - 4.0;
        let _ = writeln!(
            svg,
            "<path d=\"M{MARGIN} {:.1}V{:.1}M{MARGIN} {middle:.1}H{right:.1}M{right:.1} {:.1}V{:.1}\" \
             fill=\"none\" stroke=\"{ink}\" stroke-width=\"1.4\"/>\
             <text x=\"{:.1}\" y=\"{y:.1}\" fill=\"{ink}\">{}{unit}</text>",
            middle - 4.0,
            middle + 4.0,
            middle - 4.0,
            middle + 4.0,
            right + 8.0,
            six_digits(length),
        );
    }
}
