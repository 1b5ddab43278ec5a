//! Bodies and springs of a still picture as SVG.

use super::stage::{Actor, Piece, Pose, View, moved};
use std::fmt::Write;

/// Fill and line of a body.
fn colours(kind: &str) -> (&'static str, &'static str) {
    match kind {
        "fixed" => ("#e2e2e2", "#7a7a7a"),
        "kinematic" => ("#f5e3c3", "#8a6d2f"),
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

/// A spring from `a` to `b` in pixels.
pub(super) fn zigzag(a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let length = dx.hypot(dy).max(1e-9);
    let (nx, ny) = (-dy / length * 5.0, dx / length * 5.0);
    let turns = ((length / 8.0) as usize).clamp(4, 40);
    let mut points = vec![a];
    for i in 0..turns {
        let t = (i as f64 + 0.5) / turns as f64;
        let side = if i % 2 == 0 { 1.0 } else { -1.0 };
        points.push([a[0] + t * dx + side * nx, a[1] + t * dy + side * ny]);
    }
    points.push(b);
    points
}
