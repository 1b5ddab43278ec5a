//! All parts of all colliders, numbered, and how far each has gone.

use super::super::bodies::Bodies;
use super::super::joints::OUTSIDE;
use super::super::kernels::Part;
use super::colliders::{Colliders, Surface};
use super::shapes;
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// One part of a collider: what every look at a pair asks, and no more, to be close in memory.
pub(super) struct Leaf {
    /// Where it is.
    pub pose: Pose64,
    pub part: Part,
    /// Of its collider.
    pub surface: Surface,
    /// Index of the collider, and of the part in it.
    pub slot: u32,
    pub sub: u32,
    /// Whether it is the only part of its collider.
    pub lone: bool,
    /// Number of the body in this step.
    pub body: u32,
}

/// What a part is called, close together in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Name {
    /// See [`Leaf`].
    pub slot: u32,
    pub sub: u32,
    pub body: u32,
}

/// How a part is fixed to its body.
struct Seat {
    /// In the body's frame, or the world's where it has no body.
    local: Pose64,
    /// Farthest point from the origin of that frame \[m\].
    radius: f64,
    /// A circle round the part \[m\], in the same frame.
    circle: (Vec2, f64),
    /// Where the body was when the part was last moved.
    old: Pose64,
}

/// What tells most pairs apart, close together in memory.
#[derive(Clone, Copy)]
pub(super) struct Near {
    /// Centre and radius of a circle round the part, as far as it reaches in this step \[m\].
    center: Vec2,
    radius: f64,
    /// The way it has gone and its share of the reach \[m\].
    pub reached: f64,
}

impl Near {
    fn at(center: Vec2) -> Near {
        Near {
            center,
            radius: f64::INFINITY,
            reached: f64::INFINITY,
        }
    }

    /// Whether two parts cannot reach each other.
    pub fn apart(&self, other: &Near) -> bool {
        let (d, radii) = (self.center - other.center, self.radius + other.radius);
        d.norm_squared() > radii * radii
    }
}

/// The parts, under numbers that last as long as their colliders.
#[derive(Default)]
pub(super) struct Leaves {
    pub list: Vec<Option<Leaf>>,
    /// Of each leaf.
    pub names: Vec<Name>,
    /// Of each leaf, a bound of the way \[m\] that any of its points has gone so far.
    pub way: Vec<f64>,
    /// Of each leaf, once [`Leaves::reach`] was called for it.
    pub near: Vec<Near>,
    seats: Vec<Seat>,
    free: Vec<u32>,
    /// Of each collider, its leaves.
    of_slot: Vec<Vec<u32>>,
}

impl Leaves {
    pub fn get(&self, leaf: u32) -> &Leaf {
        match &self.list[leaf as usize] {
            Some(leaf) => leaf,
            None => unreachable!("a pair of parts outlived one of them"),
        }
    }

    /// Drops the leaves of a collider and says which they were.
    pub fn remove(&mut self, slot: u32) -> Vec<u32> {
        let gone = match self.of_slot.get_mut(slot as usize) {
            Some(leaves) => std::mem::take(leaves),
            None => Vec::new(),
        };
        for &leaf in &gone {
            self.list[leaf as usize] = None;
            self.free.push(leaf);
        }
        gone
    }

    /// Adds the parts of a collider.
    pub fn insert(&mut self, slot: u32, colliders: &Colliders, bodies: &Bodies) {
        let Some(known) = colliders.get(slot) else {
            return;
        };
        if self.of_slot.len() <= slot as usize {
            self.of_slot.resize_with(slot as usize + 1, Vec::new);
        }
        for piece in &known.pieces {
            let local = known.local.compose(&piece.local);
            let body = colliders.body(slot, bodies);
            let old = self.body_pose(body, bodies);
            let seat = Seat {
                radius: shapes::radius(&piece.part, &local),
                circle: shapes::circle(&piece.part, &local),
                local,
                old,
            };
            let leaf = Leaf {
                pose: old.compose(&local),
                part: piece.part.clone(),
                surface: known.surface,
                slot,
                sub: piece.sub,
                lone: known.pieces.len() == 1,
                body,
            };
            let name = Name {
                slot,
                sub: piece.sub,
                body,
            };
            let near = Near::at(old.apply(seat.circle.0));
            let id = match self.free.pop() {
                Some(id) => {
                    let k = id as usize;
                    (self.list[k], self.way[k], self.seats[k]) = (Some(leaf), 0.0, seat);
                    (self.names[k], self.near[k]) = (name, near);
                    id
                }
                None => {
                    self.list.push(Some(leaf));
                    self.way.push(0.0);
                    self.names.push(name);
                    self.near.push(near);
                    self.seats.push(seat);
                    self.list.len() as u32 - 1
                }
            };
            self.of_slot[slot as usize].push(id);
        }
    }

    fn body_pose(&self, body: u32, bodies: &Bodies) -> Pose64 {
        match body {
            OUTSIDE => Pose64::new(Vec2::zeros(), 0.0),
            body => bodies.list[body as usize].pose,
        }
    }

    /// Takes over a law that the user gave a collider.
    pub fn resurface(&mut self, slot: u32, colliders: &Colliders) {
        let (Some(known), Some(own)) = (colliders.get(slot), self.of_slot.get(slot as usize))
        else {
            return;
        };
        for &leaf in own {
            if let Some(leaf) = &mut self.list[leaf as usize] {
                leaf.surface = known.surface;
            }
        }
    }

    /// Takes over the numbers of the bodies after some came or went.
    pub fn renumber(&mut self, colliders: &Colliders, bodies: &Bodies) {
        for (leaf, name) in self.list.iter_mut().zip(&mut self.names) {
            if let Some(leaf) = leaf {
                leaf.body = colliders.body(leaf.slot, bodies);
                name.body = leaf.body;
            }
        }
    }

    /// Moves every leaf to where its body is.
    pub fn follow(&mut self, bodies: &Bodies) {
        for k in 0..self.list.len() {
            self.follow_one(k, bodies);
        }
    }

    /// Notes how far \[m\] a leaf reaches in this step.
    pub fn reach(&mut self, k: usize, share: f64) {
        let near = &mut self.near[k];
        near.reached = self.way[k] + share;
        // with room for the rounding of circles and gaps
        let rounding = 1e-9 * share + 1e-12 * near.center.amax();
        near.radius = (1.0 + 1e-12) * self.seats[k].circle.1 + share + rounding;
    }

    /// Moves a leaf to where its body is, if there is such a leaf.
    ///
    /// No point of a part can have gone farther than `|Δp| + R |Δ(cos, sin)|`, its chord.
    #[inline]
    pub fn follow_one(&mut self, k: usize, bodies: &Bodies) -> Option<&Leaf> {
        let leaf = self.list[k].as_mut()?;
        if leaf.body != OUTSIDE {
            let now = &bodies.list[leaf.body as usize].pose;
            let seat = &mut self.seats[k];
            let old = &seat.old;
            if now != old {
                let turned = Vec2::new(now.cos - old.cos, now.sin - old.sin).norm();
                let gone = (now.translation - old.translation).norm() + seat.radius * turned;
                // a rounding of it, so that sums of roundings stay a bound
                self.way[k] += gone * (1.0 + 1e-12);
                leaf.pose = now.compose(&seat.local);
                self.near[k].center = now.apply(seat.circle.0);
                seat.old = *now;
            }
        }
        Some(leaf)
    }
}
