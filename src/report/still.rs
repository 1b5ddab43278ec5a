//! One picture of a scene: its bodies as they lie, its joints, and the impulses of its contacts.

use super::arrows::{Arrow, AtEnd, Paths, STATUSES, crowd, keys, longest, paths, widths};
use super::layout::width_of;
use super::markup::{escaped, six_digits};
use super::palette::{FAINT_INK, INK};
use super::sheet::Sheet;
use super::stage::{LANES, Link, Piece, Pose, Stage, View};
use super::still_bodies::{Drawn, KINDS, Map, draw_body, drawn, hex, mark_radius, path};
use super::table::number;
use crate::dynamics::record::ContactRecord;
use std::fmt::Write;

/// What is drawn: a scene at one instant.
pub struct Still<'a> {
    pub stage: &'a Stage,
    /// Of each body of the stage.
    pub poses: &'a [Pose],
    /// Velocity and spin of each body at that time [m/s, rad/s].
    pub velocities: &'a [[f64; 3]],
    /// Length of the last step \[s\], at whose middle its contacts were found.
    pub dt: f64,
    /// Of the last step.
    pub contacts: &'a [ContactRecord],
    /// One line.
    pub title: &'a str,
    /// \[s\]
    pub time: f64,
    /// More to know about the picture.
    pub note: Option<&'a str>,
}

impl Still<'_> {
    /// The picture as an SVG document, the same bytes for the same scene.
    ///
    /// A fixed or kinematic body that is far larger than all that moves is cut off at the edge. An
    /// arrow is the impulse on the body that it can move, on the second of the record if it can move
    /// both; its length is proportional to the impulse.
    pub fn to_svg(&self) -> String {
        let sheet = Sheet::of(View::of(self.stage, [self.poses]));
        let map = &sheet.map;
        let at_end = AtEnd {
            stage: self.stage,
            poses: self.poses,
            velocities: self.velocities,
            time: self.time,
            dt: self.dt,
        };
        let arrow = |c: &ContactRecord| {
            let instant = (c.time < self.time).then_some(c.time);
            at_end.carried(Arrow::of(self.stage, c), c.bodies, instant)
        };
        let arrows: Vec<Arrow> = self.contacts.iter().map(arrow).collect();
        let most = arrows.iter().map(Arrow::size).fold(0.0, f64::max);
        // a mechanism shows no arrows
        let most = if most.is_finite() && self.stage.lane == 0.0 {
            most
        } else {
            0.0
        };
        let mut legend = self.legend(&arrows, most);
        legend.extend(self.note.map(escaped));
        let at = format!("at {} s, the end of the run", six_digits(self.time));
        let mut svg = sheet.open(self.title, &at, legend.len());
        for kind in KINDS {
            for (k, body) in self.stage.bodies.iter().enumerate() {
                if let Some(pose) = self.poses.get(k).filter(|_| body.kind == kind) {
                    draw_body(&mut svg, map, body, self.stage.place(k, *pose));
                }
            }
        }
        for link in &self.stage.links {
            self.draw_link(&mut svg, map, link);
        }
        self.draw_names(&mut svg, map);
        if most > 0.0 {
            let crowd = crowd(arrows.len().min(MOST));
            let px_per_ns = longest(sheet.wide, sheet.high, crowd) / most;
            let least = least_drawn(&arrows);
            draw_arrows(&mut svg, map, &arrows, crowd, |size| match size < least {
                true => 0.0,
                false => px_per_ns * size,
            });
        }
        sheet.close(&mut svg, self.stage.unit(), &legend);
        svg
    }

    /// Lines of the legend, of SVG text.
    fn legend(&self, arrows: &[Arrow], most: f64) -> Vec<String> {
        if self.stage.lane > 0.0 {
            return vec![LANES.to_owned()];
        }
        if most == 0.0 {
            return vec!["no contact carries an impulse in the last step".to_owned()];
        }
        let longest = format!(
            "arrows: {}impulses of the last step on the bodies that they move, the longest {} N s",
            match least_drawn(arrows) > 0.0 {
                true => format!("the {MOST} largest "),
                false => String::new(),
            },
            number(most, 3)
        );
        vec![longest, keys(arrows)]
    }

    fn draw_link(&self, svg: &mut String, map: &Map, link: &Link) {
        let ink = hex(INK);
        let Drawn { arms, lines, marks } = drawn(link, map, self.poses, None);
        for arm in arms {
            let _ = writeln!(svg, "<path d=\"{}\" stroke=\"#8a9aa5\"/>", path(&arm));
        }
        for line in lines {
            let _ = writeln!(
                svg,
                "<path d=\"{}\" fill=\"none\" stroke=\"{ink}\" stroke-width=\"1.2\"/>",
                path(&line)
            );
        }
        let r = mark_radius(self.stage);
        for [x, y] in marks {
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
        let mut taken: Vec<[f64; 3]> = Vec::new();
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
            // of names that would cover each other the first stays
            let half = 0.5 * width_of(&body.name, 11.0);
            let covered =
                |[ox, oy, other]: &[f64; 3]| (x - ox).abs() < half + other && (y - oy).abs() < 12.0;
            if !beside && taken.iter().any(covered) {
                continue;
            }
            taken.push([x, y, half]);
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
}

/// Arrows of a picture, the largest: more lie on each other.
const MOST: usize = 60;

/// The least impulse [N s] that is drawn as an arrow and not as a dot alone; 0 for all.
fn least_drawn(arrows: &[Arrow]) -> f64 {
    let mut sizes: Vec<f64> = arrows.iter().map(Arrow::size).collect();
    sizes.retain(|size| *size > 0.0);
    match sizes.len() > MOST {
        true => {
            *sizes
                .select_nth_unstable_by(MOST - 1, |a, b| b.total_cmp(a))
                .1
        }
        false => 0.0,
    }
}

fn draw_arrows(
    svg: &mut String,
    map: &Map,
    arrows: &[Arrow],
    crowd: f64,
    length: impl Fn(f64) -> f64,
) {
    let [dot, shaft] = widths(crowd);
    let paths = paths(map, arrows, length);
    for (
        Paths {
            dots,
            shafts,
            heads,
        },
        (colour, _),
    ) in paths.iter().zip(STATUSES)
    {
        if dots.is_empty() {
            continue;
        }
        let colour = hex(colour);
        let _ = writeln!(
            svg,
            "<path d=\"{dots}\" stroke=\"{colour}\" stroke-width=\"{dot:.1}\" stroke-linecap=\"round\"/>\n\
             <path d=\"{shafts}\" stroke=\"{colour}\" stroke-width=\"{shaft:.1}\"/>\n\
             <path d=\"{heads}\" fill=\"{colour}\"/>"
        );
    }
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
            velocities: &[],
            dt: 0.0,
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
