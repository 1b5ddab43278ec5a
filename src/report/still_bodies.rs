//! Bodies and joints of a picture of a scene.

use super::stage::{Actor, Link, Piece, Pose, Stage, View, moved};
use plotters::style::RGBColor;
use std::fmt::Write;

/// Kinds of bodies, those in front last.
pub(super) const KINDS: [&str; 5] = ["fixed", "kinematic", "dynamic", "coordinate", "driven"];

pub(super) fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Fill and line of a body.
pub(super) fn colours(kind: &str) -> (&'static str, &'static str) {
    match kind {
        "fixed" => ("#e2e2e2", "#7a7a7a"),
        "kinematic" | "driven" => ("#f5e3c3", "#8a6d2f"),
        _ => ("#d3e5f3", "#33596f"),
    }
}

/// Pixels from the top left of the drawing for a point of the plane.
pub(super) struct Map {
    pub view: View,
    /// Pixels per metre.
    pub scale: f64,
}

impl Map {
    pub(super) fn px(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [
            self.scale * (x - self.view.x[0]),
            self.scale * (self.view.y[1] - y),
        ]
    }
}

/// Appends a body at its pose.
pub(super) fn draw_body(svg: &mut String, map: &Map, body: &Actor, pose: Pose) {
    let (fill, line) = colours(body.kind);
    for piece in &body.pieces {
        let _ = match piece {
            Piece::Disc([x, y, r, spoke]) => {
                let centre = moved(pose, [*x, *y]);
                let rim = moved([centre[0], centre[1], pose[2] + spoke], [*r, 0.0]);
                let ([cx, cy], [rx, ry]) = (map.px(centre), map.px(rim));
                writeln!(
                    svg,
                    "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"{:.2}\" fill=\"{fill}\" stroke=\"{line}\"/>\
                     <path d=\"M{cx:.1} {cy:.1}L{rx:.1} {ry:.1}\" stroke=\"{line}\"/>",
                    r * map.scale
                )
            }
            Piece::Area(points) | Piece::Line(points) => {
                let points: Vec<_> = points.iter().map(|p| map.px(moved(pose, *p))).collect();
                let line = format!("stroke=\"{line}\" stroke-linejoin=\"round\"");
                match piece {
                    Piece::Area(_) => writeln!(
                        svg,
                        "<path d=\"{}Z\" fill=\"{fill}\" {line}/>",
                        path(&points)
                    ),
                    _ => writeln!(
                        svg,
                        "<path d=\"{}\" fill=\"none\" {line} stroke-width=\"2\"/>",
                        path(&points)
                    ),
                }
            }
        };
    }
}

/// A line through pixels as the data of a path.
pub(super) fn path(points: &[[f64; 2]]) -> String {
    let mut d = String::new();
    for (i, [x, y]) in points.iter().enumerate() {
        let _ = write!(d, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' });
    }
    d
}

/// What is drawn of a joint, in pixels.
#[derive(Default)]
pub(super) struct Drawn {
    /// From the origins of its bodies.
    pub arms: Vec<Vec<[f64; 2]>>,
    /// A spring, a rope, or the way of a slider.
    pub lines: Vec<Vec<[f64; 2]>>,
    /// Its two points.
    pub marks: Vec<[f64; 2]>,
}

/// Radius of the mark of a joint \[pixels\]: many lie too close for large ones.
pub(super) fn mark_radius(stage: &Stage) -> f64 {
    if stage.links.len() > 500 { 0.7 } else { 2.6 }
}

/// A joint between bodies at `poses`; nothing where a pose is missing.
///
/// # Arguments
/// - `turns`: corners of a spring; as many as its length has room for if `None`.
pub(super) fn drawn(link: &Link, map: &Map, poses: &[Pose], turns: Option<usize>) -> Drawn {
    let pose = |side: usize| link.bodies[side].and_then(|k| poses.get(k));
    let end = |side: usize| match (link.bodies[side], pose(side)) {
        (Some(_), None) => None,
        (_, pose) => Some(map.px(moved(*pose.unwrap_or(&[0.0; 3]), link.at[side]))),
    };
    let origin = |side: usize| pose(side).map(|pose| map.px([pose[0], pose[1]]));
    let mut drawn = Drawn::default();
    let (Some(a), Some(b)) = (end(0), end(1)) else {
        return drawn;
    };
    if link.slides() {
        // the way of the slider, through it
        let (sin, cos) = (link.axis + pose(0).map_or(0.0, |pose| pose[2])).sin_cos();
        if let Some([x, y]) = origin(1).or_else(|| origin(0)) {
            let (dx, dy) = (24.0 * cos, -24.0 * sin);
            drawn.lines.push(vec![[x - dx, y - dy], [x + dx, y + dy]]);
        }
        return drawn;
    }
    match link.kind {
        "spring" => drawn.lines.push(zigzag(a, b, turns)),
        "rope" => drawn.lines.push(vec![a, b]),
        _ => {
            let arms = [(0, a), (1, b)].into_iter();
            drawn.arms = arms
                .filter_map(|(side, at)| Some(vec![origin(side)?, at]))
                .collect();
        }
    }
    drawn.marks = vec![a, b];
    drawn
}

/// A spring from `a` to `b` in pixels.
fn zigzag(a: [f64; 2], b: [f64; 2], turns: Option<usize>) -> Vec<[f64; 2]> {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length = dx.hypot(dy).max(1e-9);
    let (nx, ny) = (-dy / length * 5.0, dx / length * 5.0);
    let turns = turns.unwrap_or(((length / 8.0) as usize).clamp(4, 40));
    let mut points = vec![a];
    for i in 0..turns {
        let t = (i as f64 + 0.5) / turns as f64;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        points.push([a[0] + t * dx + side * nx, a[1] + t * dy + side * ny]);
    }
    points.push(b);
    points
}
