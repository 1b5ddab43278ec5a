//! What a picture of a scene shows, without poses: the outlines of its bodies, and its joints.

use super::markup::six_digits;
use crate::scene::{BodyKind, Scene, Shape};
use serde::Serialize;
use std::f64::consts::PI;

/// Corners in a half circle of a round end.
const HALF_CIRCLE: usize = 12;
/// Corners in the circle of a bowl.
const CIRCLE: usize = 120;
/// Half the length \[m\] at which a line without end is drawn.
const HALF_LINE: f64 = 1e4;

/// What a picture of a mechanism says of itself.
pub(super) const LANES: &str =
    "a mechanism of coordinates: each has a row, and its mark lies at its value";

/// Bodies and joints of a scene, in the scene's order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stage {
    pub bodies: Vec<Actor>,
    pub links: Vec<Link>,
    /// [m/s²]
    pub gravity: [f64; 2],
    /// Distance \[m\] of the rows in which coordinates of a mechanism are drawn; 0 for bodies.
    pub lane: f64,
}

/// A body.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Actor {
    pub name: String,
    /// `dynamic`, `fixed`, `kinematic`, `coordinate`, or `driven`: turned by a machine's drive.
    pub kind: &'static str,
    pub pieces: Vec<Piece>,
    /// Velocity of its surface as a belt [m/s], counter-clockwise round it.
    #[serde(skip_serializing_if = "is_zero")]
    pub belt: f64,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

/// A part of a body in the body's frame \[m\].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Piece {
    /// Centre, radius, and the angle of a spoke \[rad\].
    Disc([f64; 4]),
    /// A closed outline with the solid inside.
    Area(Vec<[f64; 2]>),
    Line(Vec<[f64; 2]>),
}

impl Link {
    /// Whether its second body slides along an axis, far from its point as it may be.
    pub(super) fn slides(&self) -> bool {
        self.kind == "prismatic" || self.kind == "pin-slot"
    }
}

impl Piece {
    /// Distance \[m\] of its farthest point from the origin of the body.
    pub(super) fn reach(&self) -> f64 {
        match self {
            Piece::Disc([x, y, r, _]) => x.hypot(*y) + r,
            Piece::Area(points) | Piece::Line(points) => {
                let far = points.iter().map(|[x, y]| x.hypot(*y));
                far.fold(0.0, f64::max)
            }
        }
    }
}

/// A joint: its points in the frames of its bodies, in the world for `None`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Link {
    pub kind: &'static str,
    pub bodies: [Option<usize>; 2],
    pub at: [[f64; 2]; 2],
    /// Of the axis in the frame of the first body \[rad\].
    pub axis: f64,
}

/// Position \[m\] and angle \[rad\] of a body.
pub type Pose = [f64; 3];

impl Stage {
    /// The bodies and joints of `scene`. A mechanism has a mark for each coordinate, one below the
    /// other.
    pub fn of(scene: &Scene) -> Stage {
        if let Some(linear) = &scene.linear {
            let sizes = linear.position.iter().flatten().map(|q| q.abs());
            let gaps = linear.contact.iter().map(|c| c.gap.abs());
            let lane = 0.4 * sizes.chain(gaps).fold(0.0, f64::max).max(1e-3);
            let mark = |name: &String| Actor {
                name: name.clone(),
                kind: "coordinate",
                pieces: vec![Piece::Disc([0.0, 0.0, 0.15 * lane, 0.0])],
                belt: 0.0,
            };
            return Stage {
                bodies: linear.coordinates.iter().map(mark).collect(),
                links: Vec::new(),
                gravity: [0.0; 2],
                lane,
            };
        }
        let bodies = scene.bodies.iter().map(|body| {
            let mut pieces = Vec::new();
            add(&body.shape, [0.0; 3], &mut pieces);
            Actor {
                name: body.name.clone(),
                kind: match body.kind {
                    BodyKind::Dynamic => "dynamic",
                    BodyKind::Fixed => "fixed",
                    BodyKind::Kinematic => "kinematic",
                },
                pieces,
                // a line or bowl without end has no sense round it
                belt: match body.shape {
                    Shape::Line | Shape::Bowl { .. } => 0.0,
                    _ => body.surface_velocity,
                },
            }
        });
        let links = scene.joints.iter().map(|joint| Link {
            kind: joint.kind.word(),
            bodies: joint.bodies,
            at: scene.anchors(joint).map(|p| [p.x, p.y].map(six_digits)),
            axis: six_digits(joint.axis - joint.bodies[0].map_or(0.0, |k| scene.bodies[k].angle)),
        });
        Stage {
            bodies: bodies.collect(),
            links: links.collect(),
            gravity: scene.gravity,
            lane: 0.0,
        }
    }

    /// Where body `k` is drawn.
    pub fn place(&self, k: usize, [x, y, angle]: Pose) -> Pose {
        [x, y - self.lane * k as f64, angle]
    }

    /// Unit of lengths in its pictures, after the number.
    pub(super) fn unit(&self) -> &'static str {
        if self.lane > 0.0 { "" } else { " m" }
    }

    /// Diameter \[m\] of the smallest body that moves, twice the distance of its farthest point from
    /// its origin; infinite without such a body.
    pub fn smallest(&self) -> f64 {
        let moving = self.bodies.iter().filter(|b| b.kind == "dynamic");
        let size = |body: &Actor| 2.0 * body.pieces.iter().map(Piece::reach).fold(0.0, f64::max);
        moving.map(size).fold(f64::INFINITY, f64::min)
    }

    /// Whether an impulse can move body `number` of a record.
    pub(super) fn moves(&self, number: u32) -> bool {
        let body = self.bodies.get(number as usize);
        body.is_some_and(|body| body.kind == "dynamic" || body.kind == "coordinate")
    }
}

/// The point `p` of a body in the world.
pub(super) fn moved([x, y, angle]: Pose, p: [f64; 2]) -> [f64; 2] {
    let (sin, cos) = angle.sin_cos();
    [x + cos * p[0] - sin * p[1], y + sin * p[0] + cos * p[1]]
}

/// Adds the pieces of `shape`, whose frame has the pose `at` in the body.
fn add(shape: &Shape, at: Pose, out: &mut Vec<Piece>) {
    let all = |points: &[[f64; 2]]| -> Vec<[f64; 2]> {
        let place = |p: &[f64; 2]| moved(at, *p).map(six_digits);
        points.iter().map(place).collect()
    };
    out.push(match shape {
        Shape::Disc { radius } => Piece::Disc([at[0], at[1], *radius, at[2]].map(six_digits)),
        Shape::Box { width, height } => {
            let (w, h) = (0.5 * width, 0.5 * height);
            Piece::Area(all(&[[-w, -h], [w, -h], [w, h], [-w, h]]))
        }
        Shape::Capsule { length, radius } => {
            let end = |x: f64, from: f64| {
                (0..=HALF_CIRCLE).map(move |i| {
                    let (sin, cos) = (from + PI * i as f64 / HALF_CIRCLE as f64).sin_cos();
                    [x + radius * cos, radius * sin]
                })
            };
            let right = end(0.5 * length, -0.5 * PI);
            let points: Vec<_> = right.chain(end(-0.5 * length, 0.5 * PI)).collect();
            Piece::Area(all(&points))
        }
        Shape::Polygon { points } => Piece::Area(all(points)),
        Shape::Polyline { points, closed } => {
            let turned = points.windows(2).fold(0.0, |sum, edge| {
                let [[ax, ay], [bx, by]] = [edge[0], edge[1]];
                sum + (ax - points[0][0]) * (by - points[0][1])
                    - (bx - points[0][0]) * (ay - points[0][1])
            });
            let mut outline = all(points);
            match closed {
                // the solid is inside
                true if turned > 0.0 => Piece::Area(outline),
                true => {
                    outline.extend(outline.first().copied());
                    Piece::Line(outline)
                }
                false => Piece::Line(outline),
            }
        }
        Shape::Rod { length } => {
            let half = 0.5 * length;
            Piece::Line(all(&[[-half, 0.0], [half, 0.0]]))
        }
        Shape::Line => Piece::Line(all(&[[-HALF_LINE, 0.0], [HALF_LINE, 0.0]])),
        Shape::Bowl { radius } => {
            let corner = |i: usize| {
                let (sin, cos) = (2.0 * PI * i as f64 / CIRCLE as f64).sin_cos();
                [radius * cos, radius * sin]
            };
            Piece::Line(all(&(0..=CIRCLE).map(corner).collect::<Vec<_>>()))
        }
        Shape::Compound(parts) => {
            for part in parts {
                let [x, y] = moved(at, part.position);
                add(&part.shape, [x, y, at[2] + part.angle], out);
            }
            return;
        }
    });
}

/// The part of the plane that a picture shows \[m\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct View {
    pub x: [f64; 2],
    pub y: [f64; 2],
}

impl View {
    const EMPTY: View = View {
        x: [f64::INFINITY, f64::NEG_INFINITY],
        y: [f64::INFINITY, f64::NEG_INFINITY],
    };

    /// All that moves in any of `frames`, a pose for each body, and of what stands still all that is
    /// not far larger: a long floor is cut off.
    pub fn of<'a>(stage: &Stage, frames: impl IntoIterator<Item = &'a [Pose]> + Clone) -> View {
        let box_of = |wanted: &dyn Fn(&Actor) -> bool| {
            let mut view = View::EMPTY;
            for frame in frames.clone() {
                for (k, (body, pose)) in stage.bodies.iter().zip(frame).enumerate() {
                    if wanted(body) {
                        view.add_body(body, stage.place(k, *pose));
                    }
                }
            }
            view
        };
        let mut moving = box_of(&|body| body.kind == "dynamic" || body.kind == "coordinate");
        // where joints hang, and the joints of bodies that have no shape
        for frame in frames.clone() {
            for link in stage.links.iter().filter(|link| !link.slides()) {
                for (body, at) in link.bodies.iter().zip(link.at) {
                    let pose = body.map_or(Some([0.0; 3]), |k| frame.get(k).copied());
                    pose.iter().for_each(|pose| moving.add(moved(*pose, at)));
                }
            }
        }
        let mut view = match moving.size() > 0.0 {
            true => moving,
            false => box_of(&|_| true),
        };
        let size = view.size();
        let first = frames.into_iter().next().unwrap_or(&[]);
        for (k, (body, pose)) in stage.bodies.iter().zip(first).enumerate() {
            let mut other = View::EMPTY;
            other.add_body(body, stage.place(k, *pose));
            if other.size() > 1.8 * size {
                other = other.within(view.grown(0.25 * size));
            }
            view.add([other.x[0], other.y[0]]);
            view.add([other.x[1], other.y[1]]);
        }
        let size = view.size();
        match size > 0.0 && size.is_finite() {
            true => view.grown(0.06 * size),
            false => View {
                x: [-1.0, 1.0],
                y: [-1.0, 1.0],
            },
        }
    }

    /// The longer of width and height; negative without a point.
    pub fn size(&self) -> f64 {
        (self.x[1] - self.x[0]).max(self.y[1] - self.y[0])
    }

    fn add(&mut self, [x, y]: [f64; 2]) {
        if x.is_finite() && y.is_finite() {
            self.x = [self.x[0].min(x), self.x[1].max(x)];
            self.y = [self.y[0].min(y), self.y[1].max(y)];
        }
    }

    fn add_body(&mut self, body: &Actor, pose: Pose) {
        for piece in &body.pieces {
            match piece {
                Piece::Disc([x, y, r, _]) => {
                    let [x, y] = moved(pose, [*x, *y]);
                    self.add([x - r, y - r]);
                    self.add([x + r, y + r]);
                }
                Piece::Area(points) | Piece::Line(points) => {
                    points.iter().for_each(|p| self.add(moved(pose, *p)));
                }
            }
        }
    }

    fn grown(self, by: f64) -> View {
        View {
            x: [self.x[0] - by, self.x[1] + by],
            y: [self.y[0] - by, self.y[1] + by],
        }
    }

    fn within(self, outer: View) -> View {
        let cut = |a: [f64; 2], b: [f64; 2]| [a[0].clamp(b[0], b[1]), a[1].clamp(b[0], b[1])];
        View {
            x: cut(self.x, outer.x),
            y: cut(self.y, outer.y),
        }
    }
}
