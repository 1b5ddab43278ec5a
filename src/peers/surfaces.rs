//! Belts and one-way surfaces through rapier's hooks, for its own solver and for ours.

use crate::contact::Vec2;
use crate::rapier::engine::prelude::*;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

/// Largest angle \[rad\] from its direction at which a one-way surface pushes: as in rapier's
/// example.
const ONE_WAY_ANGLE: Real = 0.1;

/// Belts and one-way surfaces by collider.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct SurfaceHooks {
    /// Belt speeds [m/s], positive counter-clockwise round the collider.
    pub speeds: FxHashMap<ColliderHandle, f64>,
    /// Directions in the collider's frame.
    pub one_way: FxHashMap<ColliderHandle, Vec2>,
    /// Whether the hook applies belts: our pipeline reads them from [`crate::rapier::SurfaceLaw`].
    pub belts: bool,
}

impl SurfaceHooks {
    pub fn forget(&mut self, collider: ColliderHandle) {
        self.speeds.remove(&collider);
        self.one_way.remove(&collider);
    }

    /// Direction in which the surface of `of` may push, in the frame of `seen_from`.
    fn allowed(
        &self,
        context: &ContactModificationContext<'_>,
        of: ColliderHandle,
        seen_from: ColliderHandle,
    ) -> Option<Vector> {
        let direction = self.one_way.get(&of)?;
        let turn = |handle: ColliderHandle| context.colliders[handle].position().rotation;
        let world = turn(of) * Vector::new(direction.x as Real, direction.y as Real);
        Some(turn(seen_from).inverse() * world)
    }
}

impl PhysicsHooks for SurfaceHooks {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        let (c1, c2) = (context.collider1, context.collider2);
        // the contact's normal points out of collider 1
        let one = self.allowed(context, c1, c1);
        let other = self.allowed(context, c2, c1).map(|direction| -direction);
        for direction in [one, other].into_iter().flatten() {
            context.update_as_oneway_platform(direction, ONE_WAY_ANGLE);
        }
        let speed = |handle| self.speeds.get(&handle).copied().unwrap_or(0.0);
        let belt = (speed(c1) + speed(c2)) as Real;
        if self.belts
            && belt != 0.0
            && let Some(rigid) = context.rigid_mut()
        {
            let normal = *rigid.normal;
            for contact in rigid.solver_contacts.iter_mut() {
                contact.tangent_velocity += Vector::new(-normal.y, normal.x) * belt;
            }
        }
    }
}
