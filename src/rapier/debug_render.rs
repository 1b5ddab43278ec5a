//! Draws contact impulses and statuses through rapier's debug renderer.

use super::engine::prelude::*;
use super::pipeline::MoreauPipeline;
use crate::contact::Vec2;
use crate::dynamics::record::{ContactStatus, StepRecord};

/// How contacts are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactStyle {
    /// Length of an impulse's line per mean force in the step \[m/N\].
    pub scale: f64,
    /// Half the width of the cross at the contact point \[m\].
    pub cross: f64,
    /// Colours (hue in degrees, saturation, lightness, alpha) of open, sticking and slipping contacts
    /// and of impacts.
    pub open: DebugColor,
    pub stick: DebugColor,
    pub slip: DebugColor,
    pub impact: DebugColor,
}

impl Default for ContactStyle {
    /// 1 mm per newton; grey, green, orange and red.
    fn default() -> Self {
        ContactStyle {
            scale: 1e-3,
            cross: 0.02,
            open: [0.0, 0.0, 0.6, 1.0],
            stick: [120.0, 0.8, 0.4, 1.0],
            slip: [40.0, 1.0, 0.5, 1.0],
            impact: [0.0, 1.0, 0.5, 1.0],
        }
    }
}

impl ContactStyle {
    /// Colour of a contact of that status.
    pub fn color(&self, status: ContactStatus) -> DebugColor {
        match status {
            ContactStatus::Open => self.open,
            ContactStatus::Stick => self.stick,
            ContactStatus::SlipPlus | ContactStatus::SlipMinus => self.slip,
            ContactStatus::Impact => self.impact,
        }
    }
}

impl MoreauPipeline {
    /// Draws every contact of `record`: a cross at its point, and from there a line for the mean
    /// force on the second body, `scale (P_N n + P_T t) / Δt`, in the colour of the contact's
    /// status.
    ///
    /// rapier's own `DebugRenderPipeline` draws shapes, bodies and joints; its contacts are those
    /// of its narrow phase, which this crate's steps do not use. A line belongs to the second
    /// collider, or to the first if the second was removed. A contact of two removed colliders is
    /// left out.
    ///
    /// # Arguments
    /// - `world`: the one that was stepped.
    /// - `record`: of the last step, whose length is Δt.
    pub fn render_contacts(
        &self,
        world: &PhysicsWorld,
        record: &StepRecord,
        style: &ContactStyle,
        backend: &mut impl DebugRenderBackend,
    ) {
        let real = |v: Vec2| Vector::new(v.x as Real, v.y as Real);
        for contact in self.results(record).contacts() {
            let handles = contact.colliders.into_iter().rev().flatten();
            let mut found = handles.filter_map(|h| Some((h, world.colliders.get(h)?)));
            let Some((handle, collider)) = found.next() else {
                continue;
            };
            let object = DebugRenderObject::Collider(handle, collider);
            if !backend.filter_object(object) {
                continue;
            }
            let (at, color) = (contact.record.position, style.color(contact.record.status));
            for diagonal in [Vec2::new(1.0, 1.0), Vec2::new(1.0, -1.0)] {
                let arm = style.cross * diagonal;
                backend.draw_line(object, real(at - arm), real(at + arm), color);
            }
            let force = contact.impulse() / record.dt;
            if force != Vec2::zeros() {
                backend.draw_line(object, real(at), real(at + style.scale * force), color);
            }
        }
    }
}
