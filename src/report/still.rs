//! One picture of a scene: its bodies as they lie, its joints, and the impulses of its contacts.

use super::layout::width_of;
use super::markup::{escaped, six_digits};
use super::palette::{FAINT_INK, INK, QUALITATIVE};
use super::stage::{Link, Piece, Pose, Stage, View, moved};
use super::still_bodies::{Map, draw_body, path, zigzag};
use super::table::number;
use crate::dynamics::record::{ContactRecord, ContactStatus};
use plotters::style::RGBColor;
use std::fmt::Write;

/// Lengths in pixels: of the picture, of the margin, of a line of text and of its letters.
const WIDTH: f64 = 760.0;
const MOST_HIGH: f64 = 560.0;
const LEAST_HIGH: f64 = 120.0;
const MARGIN: f64 = 16.0;
const ROW: f64 = 19.0;
const TEXT: f64 = 12.5;
/// Length of the largest impulse's arrow, of the shorter side of the picture.
const ARROW: f64 = 0.2;
/// Arrows shorter than this many pixels are left out: they are dots.
const LEAST_ARROW: f64 = 2.0;

/// What is drawn: a scene at one instant.
pub struct Still<'a> {
    pub stage: &'a Stage,
    /// Of each body of the stage.
    pub poses: &'a [Pose],
    /// Of the last step.
    pub contacts: &'a [ContactRecord],
    /// One line.
    pub title: &'a str,
    /// \[s\]
    pub time: f64,
    /// More to know about the picture.
    pub note: Option<&'a str>,
}

/// Colour of a contact by its status, and the words in the legend.
const STATUSES: [(RGBColor, &str); 4] = [
    (QUALITATIVE[0], "contact sticks"),
    (QUALITATIVE[1], "contact slips"),
    (QUALITATIVE[3], "impact"),
    (RGBColor(150, 150, 150), "open contact, no impulse"),
];

fn status(contact: &ContactRecord) -> usize {
    match contact.status {
        ContactStatus::Stick => 0,
        ContactStatus::SlipPlus | ContactStatus::SlipMinus => 1,
        ContactStatus::Impact => 2,
        ContactStatus::Open => 3,
    }
}

fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

impl Still<'_> {
    /// The picture as an SVG document, the same bytes for the same scene.
    ///
    /// A fixed or kinematic body that is far larger than all that moves is cut off at the edge. An
    /// arrow is the impulse on the body that it can move, on the second of the record if it can move
    /// both; its length is proportional to the impulse.
    pub fn to_svg(&self) -> String {
        let view = View::of(self.stage, [self.poses]);
        let (w, h) = (view.x[1] - view.x[0], view.y[1] - view.y[0]);
        let inner = WIDTH - 2.0 * MARGIN;
        let scale = (inner / w).min(MOST_HIGH / h);
        let (wide, high) = (inner, (scale * h).max(LEAST_HIGH));
        // centred where the scene is narrower or lower than the picture
        let (dx, dy) = (0.5 * (wide / scale - w), 0.5 * (high / scale - h));
        let view = View {
            x: [view.x[0] - dx, view.x[1] + dx],
            y: [view.y[0] - dy, view.y[1] + dy],
        };
        let map = Map { view, scale };
        let (mut legend, most) = self.legend();
        legend.extend(self.note.map(|note| legend_line(&escaped(note))));
        let top = MARGIN + 2.0 * ROW + 6.0;
        let total = top + high + 10.0 + ROW * (legend.len() as f64 + 1.0) + MARGIN - 6.0;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{total:.0}\" \
             viewBox=\"0 0 {WIDTH} {total:.0}\" font-family=\"sans-serif\" font-size=\"{TEXT}\">\n\
             <rect width=\"{WIDTH}\" height=\"{total:.0}\" fill=\"#ffffff\"/>\n"
        );
        self.head(&mut svg);
        let _ = writeln!(
            svg,
            "<svg x=\"{MARGIN}\" y=\"{top}\" width=\"{wide:.1}\" height=\"{high:.1}\">"
        );
        for kind in ["fixed", "kinematic", "dynamic", "coordinate"] {
            for (k, body) in self.stage.bodies.iter().enumerate() {
                if let Some(pose) = self.poses.get(k).filter(|_| body.kind == kind) {
                    draw_body(&mut svg, &map, body, self.stage.place(k, *pose));
                }
            }
        }
        for link in &self.stage.links {
            self.draw_link(&mut svg, &map, link);
        }
        self.draw_names(&mut svg, &map);
        if most > 0.0 {
            // the more contacts, the shorter their arrows, so that they stay apart
            let crowd = ((self.contacts.len() as f64).sqrt() / 5.0).max(1.0);
            let longest = ARROW * wide.min(high).max(200.0) / crowd;
            self.draw_contacts(&mut svg, &map, longest / most, crowd);
        }
        svg.push_str("</svg>\n");
        let _ = writeln!(
            svg,
            "<rect x=\"{MARGIN}\" y=\"{top}\" width=\"{wide:.1}\" height=\"{high:.1}\" \
             fill=\"none\" stroke=\"#cfcfcf\"/>"
        );
        let mut y = top + high + 10.0 + 0.75 * ROW;
        self.scale_bar(&mut svg, &map, y);
        for line in legend {
            y += ROW;
            svg.push_str(&line.replace("{y}", &format!("{y:.1}")));
        }
        svg.push_str("</svg>\n");
        svg
    }

    fn head(&self, svg: &mut String) {
        let mut title = self.title.to_owned();
        let most = WIDTH - 2.0 * MARGIN;
        while width_of(&title, 15.0) > most {
            title.pop();
            if width_of(&title, 15.0) <= most {
                title.pop();
                title.push('…');
            }
        }
        let _ = writeln!(
            svg,
            "<text x=\"{MARGIN}\" y=\"{}\" font-size=\"15\" font-weight=\"bold\" fill=\"{}\">{}</text>\n\
             <text x=\"{MARGIN}\" y=\"{}\" fill=\"{}\">at {} s, the end of the run</text>",
            MARGIN + 0.7 * ROW,
            hex(INK),
            escaped(&title),
            MARGIN + 1.75 * ROW,
            hex(FAINT_INK),
            six_digits(self.time),
        );
    }

    /// Lines of the legend with `{y}` for their place, and the largest impulse \[N s\].
    fn legend(&self) -> (Vec<String>, f64) {
        let size = |c: &ContactRecord| c.impulse_n.hypot(c.impulse_t);
        let most = self.contacts.iter().map(size).fold(0.0, f64::max);
        let most = if most.is_finite() { most } else { 0.0 };
        if self.stage.lane > 0.0 {
            let words =
                "a mechanism of coordinates: each has a row, and its mark lies at its value";
            return (vec![legend_line(words)], 0.0);
        }
        if most == 0.0 {
            let words = "no contact carries an impulse in the last step";
            return (vec![legend_line(words)], 0.0);
        }
        let arrows = format!(
            "arrows: impulses of the last step on the bodies that they move, the longest {} N s",
            number(most, 3)
        );
        let mut keys = String::new();
        for (k, (colour, meaning)) in STATUSES.iter().enumerate() {
            if self.contacts.iter().any(|c| status(c) == k) {
                let _ = write!(
                    keys,
                    "<tspan fill=\"{}\">● {meaning}</tspan>  ",
                    hex(*colour)
                );
            }
        }
        (vec![legend_line(&arrows), legend_line(&keys)], most)
    }

    fn draw_link(&self, svg: &mut String, map: &Map, link: &Link) {
        let end = |side: usize| {
            let pose = match link.bodies[side] {
                Some(k) => *self.poses.get(k)?,
                None => [0.0; 3],
            };
            Some(map.px(moved(pose, link.at[side])))
        };
        let (Some(a), Some(b)) = (end(0), end(1)) else {
            return;
        };
        let ink = hex(INK);
        let origin = |side: usize| {
            let pose = link.bodies[side].and_then(|k| self.poses.get(k))?;
            Some(map.px([pose[0], pose[1]]))
        };
        if link.slides() {
            // the way of the slider, through it
            let angle = link.bodies[0].and_then(|k| self.poses.get(k));
            let (sin, cos) = (link.axis + angle.map_or(0.0, |pose| pose[2])).sin_cos();
            if let Some([x, y]) = origin(1).or_else(|| origin(0)) {
                let (dx, dy) = (24.0 * cos, -24.0 * sin);
                let way = path(&[[x - dx, y - dy], [x + dx, y + dy]]);
                let _ = writeln!(
                    svg,
                    "<path d=\"{way}\" stroke=\"{ink}\" stroke-width=\"1.2\"/>"
                );
            }
            return;
        }
        let points = match link.kind {
            "spring" => zigzag(a, b),
            "rope" => vec![a, b],
            _ => Vec::new(),
        };
        if points.is_empty() {
            // an arm from each body to its joint
            for (side, at) in [(0, a), (1, b)] {
                if let Some(origin) = origin(side) {
                    let arm = path(&[origin, at]);
                    let _ = writeln!(svg, "<path d=\"{arm}\" stroke=\"#8a9aa5\"/>");
                }
            }
        }
        if !points.is_empty() {
            let _ = writeln!(
                svg,
                "<path d=\"{}\" fill=\"none\" stroke=\"{ink}\" stroke-width=\"1.2\"/>",
                path(&points)
            );
        }
        // many joints lie too close for marks
        let r = if self.stage.links.len() > 500 {
            0.7
        } else {
            2.6
        };
        for [x, y] in [a, b] {
            let _ = match link.kind {
                "fixed" => writeln!(
                    svg,
                    "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{}\" height=\"{}\" fill=\"#ffffff\" stroke=\"{ink}\"/>",
                    x - r,
                    y - r,
                    2.0 * r,
                    2.0 * r
                ),
                _ => writeln!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r}\" fill=\"#ffffff\" stroke=\"{ink}\"/>"
                ),
            };
        }
    }

    /// Names of the bodies that have room for them, if they are few.
    fn draw_names(&self, svg: &mut String, map: &Map) {
        if self.stage.bodies.len() > 40 {
            return;
        }
        for (k, (body, pose)) in self.stage.bodies.iter().zip(self.poses).enumerate() {
            let pose = self.stage.place(k, *pose);
            let room = 1.6 * map.scale * body.pieces.iter().map(Piece::reach).fold(0.0, f64::max);
            let [x, y] = map.px([pose[0], pose[1]]);
            let beside = body.kind == "coordinate";
            if body.kind == "fixed" || (!beside && width_of(&body.name, 11.0) > room) {
                continue;
            }
            let (x, anchor) = match beside {
                true => (x + 0.2 * map.scale * self.stage.lane, "start"),
                false => (x, "middle"),
            };
            let _ = writeln!(
                svg,
                "<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"11\" text-anchor=\"{anchor}\" fill=\"{}\" \
                 stroke=\"#ffffff\" stroke-width=\"3\" paint-order=\"stroke\">{}</text>",
                y + 4.0,
                hex(FAINT_INK),
                escaped(&body.name)
            );
        }
    }

    /// Dots, shafts and heads of the arrows: three paths for each status, so that thousands of contacts
    /// make a small file.
    fn draw_contacts(&self, svg: &mut String, map: &Map, px_per_ns: f64, crowd: f64) {
        for (k, (colour, _)) in STATUSES.iter().enumerate() {
            let [mut dots, mut shafts, mut heads] = [const { String::new() }; 3];
            for contact in self.contacts.iter().filter(|c| status(c) == k) {
                let [x, y] = map.px([contact.position.x, contact.position.y]);
                let (n, p) = (contact.normal, [contact.impulse_n, contact.impulse_t]);
                let sign = match self.stage.moves(contact.bodies[1]) {
                    true => px_per_ns,
                    false => -px_per_ns,
                };
                // the picture's y points down
                let dx = sign * (p[0] * n.x - p[1] * n.y);
                let dy = -sign * (p[0] * n.y + p[1] * n.x);
                let length = dx.hypot(dy);
                if !(x.is_finite() && y.is_finite() && length.is_finite()) {
                    continue;
                }
                let _ = write!(dots, "M{x:.1} {y:.1}h0");
                if length < LEAST_ARROW {
                    continue;
                }
                let head = (0.35 * length).clamp(2.5, 8.0);
                let (ux, uy) = (dx / length, dy / length);
                let (bx, by) = (x + dx - head * ux, y + dy - head * uy);
                let half = 0.45 * head;
                let _ = write!(shafts, "M{x:.1} {y:.1}L{bx:.1} {by:.1}");
                let _ = write!(
                    heads,
                    "M{:.1} {:.1}L{:.1} {:.1}L{:.1} {:.1}Z",
                    x + dx,
                    y + dy,
                    bx - half * uy,
                    by + half * ux,
                    bx + half * uy,
                    by - half * ux,
                );
            }
            if dots.is_empty() {
                continue;
            }
            let colour = hex(*colour);
            let (dot, shaft) = ((4.4 / crowd).max(1.6), (1.8 / crowd).max(0.6));
            let _ = writeln!(
                svg,
                "<path d=\"{dots}\" stroke=\"{colour}\" stroke-width=\"{dot:.1}\" stroke-linecap=\"round\"/>\n\
                 <path d=\"{shafts}\" stroke=\"{colour}\" stroke-width=\"{shaft:.1}\"/>\n\
                 <path d=\"{heads}\" fill=\"{colour}\"/>"
            );
        }
    }

    /// A bar of a round length, about a sixth of the picture.
    fn scale_bar(&self, svg: &mut String, map: &Map, y: f64) {
        let wanted = WIDTH / 6.0 / map.scale;
        let decade = 10f64.powf(wanted.log10().floor());
        let length = [5.0, 2.0, 1.0].map(|k| k * decade);
        let length = length.into_iter().find(|l| *l <= wanted);
        let length = length.unwrap_or(decade);
        let right = MARGIN + map.scale * length;
        let ink = hex(INK);
        let middle = y - 4.0;
        let unit = match self.stage.lane > 0.0 {
            true => "",
            false => " m",
        };
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

/// A line of the legend, of SVG.
fn legend_line(words: &str) -> String {
    let ink = hex(INK);
    format!("<text x=\"{MARGIN}\" y=\"{{y}}\" fill=\"{ink}\">{words}</text>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    fn still(name: &str) -> String {
        let scene = scene::load(name, &[]).unwrap();
        let stage = Stage::of(&scene);
        let poses: Vec<Pose> = match &scene.linear {
            Some(linear) => linear.coordinates.iter().map(|_| [0.0; 3]).collect(),
            None => (scene.bodies.iter())
                .map(|b| [b.position[0], b.position[1], b.angle])
                .collect(),
        };
        let still = Still {
            stage: &stage,
            poses: &poses,
            contacts: &[],
            title: "a < b & \"c\"",
            time: 0.0,
            note: None,
        };
        still.to_svg()
    }

    /// Every body and joint of every scene has its mark, and no number is missing.
    #[test]
    fn every_scene_of_the_catalogue_can_be_drawn() {
        for listing in scene::scenes().unwrap() {
            let Ok(scene) = scene::load(listing.name, &[]) else {
                continue; // a machine
            };
            let svg = still(listing.name);
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            assert!(svg.contains("a &lt; b &amp; &quot;c&quot;"));
            let shapes = svg.matches("<circle").count() + svg.matches("<path").count();
            assert!(
                shapes > scene.bodies.len() + scene.joints.len(),
                "{}: {shapes}",
                listing.name
            );
        }
    }
}
