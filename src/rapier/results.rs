//! Results of a step, by rapier's handles.

use super::engine::prelude::*;
use super::pipeline::MoreauPipeline;
use crate::contact::Vec2;
use crate::dynamics::record::{ContactRecord, StepRecord};

/// A contact of a step with the handles of its bodies and colliders.
#[derive(Debug, Clone, Copy)]
pub struct HandledContact<'a> {
    /// `None` for a collider without a body.
    pub bodies: [Option<RigidBodyHandle>; 2],
    pub colliders: [Option<ColliderHandle>; 2],
    pub record: &'a ContactRecord,
}

impl HandledContact<'_> {
    /// Impulse [N s] on the second side in world axes, `P_N n + P_T t`; the first takes its opposite.
    pub fn impulse(&self) -> Vec2 {
        let n = self.record.normal;
        n * self.record.impulse_n + Vec2::new(-n.y, n.x) * self.record.impulse_t
    }
}

/// Sums over contacts of a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Totals {
    pub contacts: usize,
    /// `Σ P` [N s] in world axes.
    pub impulse: Vec2,
    /// `Σ P_N` [N s]: the sum of normal impulses, which does not cancel between opposite contacts.
    pub pressure: f64,
    /// `Σ r × P` [N m s] about the centre of mass, `r` at the time of each contact. The moment of a
    /// pair is on the body of the second collider.
    pub moment: f64,
    pub friction_work: f64,
    /// Impulse [N s] in world axes and moment [N m s] that took back energy in the step. They are no
    /// contact's, but part of the body's balance: `m Δu = F Δt + Σ P + drag`, with the impulses of its
    /// joints. Only [`StepResults::on_body`] has them, see [`StepRecord::drag`].
    pub drag: Vec2,
    pub drag_moment: f64,
}

impl Totals {
    fn add(&mut self, contact: &HandledContact, side: usize) {
        let sign = if side == 0 { -1.0 } else { 1.0 };
        self.contacts += 1;
        self.impulse += sign * contact.impulse();
        self.pressure += contact.record.impulse_n;
        self.moment += contact.record.moments[side].unwrap_or(0.0);
        self.friction_work += contact.record.friction_work;
    }
}

/// The contacts of a step, by handle: see [`MoreauPipeline::results`].
#[derive(Clone, Copy)]
pub struct StepResults<'a> {
    pipeline: &'a MoreauPipeline,
    record: &'a StepRecord,
}

impl MoreauPipeline {
    /// The contacts of a step by rapier's handles, until the next step.
    ///
    /// ```
    /// use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
    /// use rapier2d::prelude::*;
    ///
    /// let mut world = PhysicsWorld::new();
    /// world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(10.0, 0.5));
    /// let (crate_, side) = world.insert(
    ///     RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0)),
    ///     ColliderBuilder::cuboid(0.5, 0.5).density(2.0),
    /// );
    /// let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
    /// let record = pipeline.step(&mut world)?;
    /// let results = pipeline.results(&record);
    /// for contact in results.contacts() {
    ///     assert_eq!(contact.colliders[1], Some(side));
    /// }
    /// // the floor bears its weight: 2 kg for a 60th of a second
    /// let load = results.on_body(crate_).impulse;
    /// assert!((load.y - 2.0 * 9.81 / 60.0).abs() < 1e-7);
    /// # Ok::<(), moreau2d::dynamics::StepError>(())
    /// ```
    pub fn results<'a>(&'a self, record: &'a StepRecord) -> StepResults<'a> {
        StepResults {
            pipeline: self,
            record,
        }
    }
}

impl<'a> StepResults<'a> {
    /// All contacts, in the record's order.
    pub fn contacts(&self) -> impl Iterator<Item = HandledContact<'a>> + use<'a> {
        let pipeline = self.pipeline;
        self.record
            .contacts
            .iter()
            .map(move |record| HandledContact {
                bodies: record.bodies.map(|k| pipeline.body(k)),
                colliders: record.surfaces.map(|k| pipeline.collider(k)),
                record,
            })
    }

    /// Contacts of one collider.
    pub fn of_collider(
        &self,
        collider: ColliderHandle,
    ) -> impl Iterator<Item = HandledContact<'a>> + use<'a> {
        self.contacts()
            .filter(move |c| c.colliders.contains(&Some(collider)))
    }

    /// Sum of the contacts on a body, and its drag. It leaves out contacts with bodies that this body
    /// dominates, and is zero for a kinematic body.
    pub fn on_body(&self, body: RigidBodyHandle) -> Totals {
        let mut totals = Totals::default();
        for contact in self.contacts() {
            for side in 0..2 {
                let takes = contact.record.moments[side].is_some();
                if takes && contact.bodies[side] == Some(body) {
                    totals.add(&contact, side);
                }
            }
        }
        for (number, drag) in &self.record.drag {
            if self.pipeline.body(*number) == Some(body) {
                totals.drag += drag.xy();
                totals.drag_moment += drag.z;
            }
        }
        totals
    }

    /// Sum of the impulses from the first collider on the second, also where dominance keeps them
    /// off that body.
    pub fn between(&self, first: ColliderHandle, second: ColliderHandle) -> Totals {
        let mut totals = Totals::default();
        for contact in self.contacts() {
            if contact.colliders == [Some(first), Some(second)] {
                totals.add(&contact, 1);
            } else if contact.colliders == [Some(second), Some(first)] {
                totals.add(&contact, 0);
            }
        }
        totals
    }
}
