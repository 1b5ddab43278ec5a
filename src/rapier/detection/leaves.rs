//! All parts of all colliders, numbered, and the distance that each has travelled.

use super::super::bodies::Bodies;
use super::super::joints::OUTSIDE;
use super::super::kernels::{Core, Part};
use super::colliders::{Colliders, Surface};
use super::shapes;
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use std::sync::Arc;

/// One part of a collider, with only what the narrow phase reads of every pair, to be close in
/// memory.
pub(super) struct Leaf {
    /// Present pose.
    pub pose: Pose64,
    pub part: Part,
    /// See [`shapes::Piece`].
    pub solid: Option<Arc<[Part; 2]>>,
    /// Surface of its collider.
    pub surface: Surface,
    /// Index of the collider, and number of the part in it.
    pub slot: u32,
    pub sub: u32,
    /// Whether this is the only part of its collider.
    pub lone: bool,
    /// Number of the body in this step.
    pub body: u32,
}

impl Leaf {
    /// Its share of the depth \[m\] of the overlap of a cell of a foundation and another segment, see
    /// [`SurfaceLaw::cells`](super::SurfaceLaw::cells). 0 for other parts.
    pub fn depth(&self) -> f64 {
        match &self.part.core {
            Core::Edge(edge) if edge.one_sided => edge.depth_share(),
            Core::Edge(edge) if self.surface.foundation => edge.length(),
            _ => 0.0,
        }
    }
}

/// Index of the collider and number of the part, close together in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Name {
    /// See [`Leaf`].
    pub slot: u32,
    pub sub: u32,
    pub body: u32,
}

/// How a part is attached to its body.
struct Attachment {
    /// Pose in the body's frame, or the world's for a collider without a body.
    local: Pose64,
    /// Farthest point from the origin of that frame \[m\].
    radius: f64,
    /// A bounding circle of the part \[m\], in the same frame.
    circle: (Vec2, f64),
    /// Pose of the body when the part was last moved.
    old: Pose64,
}

/// The data that rejects most pairs, close together in memory.
#[derive(Clone, Copy)]
pub(super) struct Near {
    /// Centre and radius of a circle around the part and its reach in this step \[m\].
    center: Vec2,
    radius: f64,
    /// Travelled distance plus the part's share of the reach \[m\].
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

    /// Whether a point is in the circle.
    pub fn holds(&self, point: Vec2) -> bool {
        (self.center - point).norm_squared() <= self.radius * self.radius
    }

    /// Whether two parts cannot reach each other.
    pub fn apart(&self, other: &Near) -> bool {
        let (d, radii) = (self.center - other.center, self.radius + other.radius);
        d.norm_squared() > radii * radii
    }
}

/// All parts. A number stays valid as long as its collider exists.
#[derive(Default)]
pub(super) struct Leaves {
    pub list: Vec<Option<Leaf>>,
    /// Per leaf.
    pub names: Vec<Name>,
    /// Per leaf, a bound of the distance \[m\] that any of its points has travelled so far.
    pub travel: Vec<f64>,
    /// Per leaf; valid after [`Leaves::reach`].
    pub near: Vec<Near>,
    /// Size \[m\] of the smallest sharp polygon there has been; `None` if there was none.
    pub least_sharp: Option<f64>,
    attachments: Vec<Attachment>,
    free: Vec<u32>,
    /// Per collider, its leaves.
    of_slot: Vec<Vec<u32>>,
}

impl Leaves {
    pub fn get(&self, leaf: u32) -> &Leaf {
        match &self.list[leaf as usize] {
            Some(leaf) => leaf,
            None => unreachable!("a pair of parts outlived one of them"),
        }
    }

    /// The leaf of a collider with this number.
    pub fn of(&self, slot: u32, sub: u32) -> Option<&Leaf> {
        let own = self.of_slot.get(slot as usize)?;
        let number = |leaf: &u32| self.names[*leaf as usize].sub;
        let place = own.binary_search_by_key(&sub, number).ok()?;
        Some(self.get(own[place]))
    }

    /// All leaves and their numbers.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &Leaf)> {
        let all = self.list.iter().enumerate();
        all.filter_map(|(k, leaf)| Some((k as u32, leaf.as_ref()?)))
    }

    /// Pose of a leaf in the frame of its body, or the world's.
    pub fn local(&self, leaf: u32) -> &Pose64 {
        &self.attachments[leaf as usize].local
    }

    /// Replaces a part by one of the same shape.
    pub fn set_part(&mut self, leaf: u32, part: Part) {
        if let Some(leaf) = &mut self.list[leaf as usize] {
            leaf.part = part;
        }
    }

    /// Removes the leaves of a collider and returns their numbers.
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
            if piece.part.is_sharp_polygon() {
                let size = known.surface.size;
                self.least_sharp = Some(self.least_sharp.map_or(size, |least| least.min(size)));
            }
            let local = known.local.compose(&piece.local);
            let body = colliders.body(slot, bodies);
            let old = self.body_pose(body, bodies);
            let attachment = Attachment {
                radius: shapes::radius(&piece.part, &local),
                circle: shapes::circle(&piece.part, &local),
                local,
                old,
            };
            let leaf = Leaf {
                pose: old.compose(&local),
                part: piece.part.clone(),
                solid: piece.solid.clone(),
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
            let near = Near::at(old.apply(attachment.circle.0));
            let id = match self.free.pop() {
                Some(id) => {
                    let k = id as usize;
                    (self.list[k], self.travel[k], self.attachments[k]) =
                        (Some(leaf), 0.0, attachment);
                    (self.names[k], self.near[k]) = (name, near);
                    id
                }
                None => {
                    self.list.push(Some(leaf));
                    self.travel.push(0.0);
                    self.names.push(name);
                    self.near.push(near);
                    self.attachments.push(attachment);
                    self.list.len() as u32 - 1
                }
            };
            self.of_slot[slot as usize].push(id);
        }
    }

    pub fn body_pose(&self, body: u32, bodies: &Bodies) -> Pose64 {
        match body {
            OUTSIDE => Pose64::new(Vec2::zeros(), 0.0),
            body => bodies.list[body as usize].pose,
        }
    }

    /// Copies a new surface law of a collider to its leaves.
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

    /// Updates the body numbers after bodies came or went.
    pub fn renumber(&mut self, colliders: &Colliders, bodies: &Bodies) {
        for (leaf, name) in self.list.iter_mut().zip(&mut self.names) {
            if let Some(leaf) = leaf {
                leaf.body = colliders.body(leaf.slot, bodies);
                name.body = leaf.body;
            }
        }
    }

    /// Moves every leaf to the pose of its body.
    pub fn follow(&mut self, bodies: &Bodies) {
        for k in 0..self.list.len() {
            self.follow_one(k, bodies);
        }
    }

    /// Moves the leaves of a collider to the pose of its body.
    pub fn follow_collider(&mut self, slot: u32, bodies: &Bodies) {
        let own = std::mem::take(&mut self.of_slot[slot as usize]);
        for &leaf in &own {
            self.follow_one(leaf as usize, bodies);
        }
        self.of_slot[slot as usize] = own;
    }

    /// Stores how far \[m\] a leaf reaches in this step.
    pub fn reach(&mut self, k: usize, share: f64) {
        let near = &mut self.near[k];
        near.reached = self.travel[k] + share;
        // with a margin for the rounding of circles and gaps
        let rounding = 1e-9 * share + 1e-12 * near.center.amax();
        near.radius = (1.0 + 1e-12) * self.attachments[k].circle.1 + share + rounding;
    }

    /// Moves a leaf, if it exists, to the pose of its body.
    ///
    /// A point of the part travels at most `|Δp| + R |Δ(cos, sin)|`, its chord.
    #[inline]
    pub fn follow_one(&mut self, k: usize, bodies: &Bodies) -> Option<&Leaf> {
        let leaf = self.list[k].as_mut()?;
        if leaf.body != OUTSIDE {
            let now = &bodies.list[leaf.body as usize].pose;
            let attachment = &mut self.attachments[k];
            let old = &attachment.old;
            if now != old {
                let turned = Vec2::new(now.cos - old.cos, now.sin - old.sin).norm();
                let gone = (now.translation - old.translation).norm() + attachment.radius * turned;
                // a margin, so that the rounded sum stays a bound
                self.travel[k] += gone * (1.0 + 1e-12);
                leaf.pose = now.compose(&attachment.local);
                self.near[k].center = now.apply(attachment.circle.0);
                attachment.old = *now;
            }
        }
        Some(leaf)
    }
}
