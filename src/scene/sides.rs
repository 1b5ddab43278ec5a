//! One-sided chains that everything starts behind.

use super::{Body, BodyKind, Scene, Shape};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

impl Scene {
    /// A sentence for each open one-sided polyline whose solid side all moving bodies beside it start on: nothing
    /// stops them, since an edge touches what comes from its outer side. Such a chain was most likely drawn in the
    /// other direction.
    pub fn side_warnings(&self) -> Vec<String> {
        let moving = || self.bodies.iter().filter(|b| b.kind == BodyKind::Dynamic);
        let mut out = Vec::new();
        for body in self.bodies.iter().filter(|b| !b.two_sided) {
            let Shape::Polyline {
                points,
                closed: false,
            } = &body.shape
            else {
                continue;
            };
            let others = moving().filter(|other| other.name != body.name);
            let mut sides = others
                .filter_map(|other| side_of(body, points, other))
                .peekable();
            if sides.peek().is_some() && sides.all(|side| side > 0.0) {
                out.push(format!(
                    "all moving bodies beside `{}` start behind it: an open polyline stops what comes from the \
                     right of its direction, and its solid is on the left; give its points in the other order, \
                     or set two_sided = true",
                    body.name
                ));
            }
        }
        out
    }
}

/// Distance \[m\] of a body from the nearest edge of a chain, positive on its left; `None` past the ends of the chain.
fn side_of(chain: &Body, points: &[[f64; 2]], body: &Body) -> Option<f64> {
    let pose = Pose64::new(Vec2::from(chain.position), chain.angle);
    let at = pose.apply_inverse(Vec2::from(body.position));
    let last = points.len().saturating_sub(2);
    let edges = points.windows(2).enumerate().map(|(k, ends)| {
        let [a, b] = [ends[0], ends[1]].map(Vec2::from);
        let (along, way) = (b - a, at - a);
        let share = way.dot(&along) / along.norm_squared();
        let away = (way - along * share.clamp(0.0, 1.0)).norm();
        let beside = along.perp(&way) / along.norm();
        let past = k == 0 && share < 0.0 || k == last && share > 1.0;
        (away, beside, past)
    });
    // at a corner the edge that the body lies farther beside
    let nearest = edges.min_by(|a, b| {
        let far = b.1.abs().total_cmp(&a.1.abs());
        a.0.total_cmp(&b.0).then(far)
    });
    let (_, beside, past) = nearest?;
    (!past).then_some(beside)
}
