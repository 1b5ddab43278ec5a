//! Bodies that overlap where a scene puts them.

use super::overlap::Overlaps;
use super::passing::Via;
use super::{Model, Scene};
use crate::contact::Vec2;
use crate::dynamics::{LARGE_OVERLAP, Pose64};
use std::collections::BTreeMap;

impl Scene {
    /// A sentence if bodies overlap at the start by more than [`LARGE_OVERLAP`] of the smaller one. What they overlap
    /// by then is no error of a step, and no check of a run counts it.
    pub fn start_warnings(&self) -> Vec<String> {
        // models with closed forms start where they are
        if self.model() != Model::Rapier {
            return Vec::new();
        }
        let mut overlaps = Overlaps::new(&self.bodies, &self.joints, self.step.dt);
        let place = |k: usize| {
            let body = &self.bodies[k];
            Some(Pose64::new(Vec2::from(body.position), body.angle))
        };
        overlaps.measure(place, &Via::default());
        let mut pairs: BTreeMap<[u32; 2], f64> = BTreeMap::new();
        for (bodies, depth) in overlaps.at_start() {
            let sizes = bodies.map(|body| overlaps.size(body as usize));
            if depth > LARGE_OVERLAP * sizes[0].min(sizes[1]) {
                let deepest = pairs.entry(bodies).or_default();
                *deepest = deepest.max(depth);
            }
        }
        // of equals the first
        let deepest = pairs.iter().rev().max_by(|a, b| a.1.total_cmp(b.1));
        let words = |(bodies, depth): (&[u32; 2], &f64)| {
            let [a, b] = bodies.map(|body| &self.bodies[body as usize].name);
            let all = match pairs.len() {
                1 => "a pair of bodies overlaps at the start:".to_owned(),
                count => format!("{count} pairs of bodies overlap at the start, deepest"),
            };
            let then = match self.step.recovery {
                true => "is moved apart, which may give energy, and",
                false => "stays (step.recovery = false), and",
            };
            format!(
                "{all} {a} and {b} by {depth:.2e} m; such an overlap {then} is not counted where a run is judged"
            )
        };
        deepest.map(words).into_iter().collect()
    }
}
