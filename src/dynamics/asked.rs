//! The rows of the problems that move bodies by position: overlaps, crowds, joints.

use super::interval::diagonal;
use super::joint_rules::{BILATERAL, joint_impact_rule};
use super::model::JointRow;
use crate::contact::{Law, NO_BODY, Rows, Vec2, Vec3};

/// Rows `J` of a problem of displacements `d`, the `b` \[m\] of `J d + b` in its law, and the law.
#[derive(Default)]
pub(super) struct Asked {
    pub rows: Vec<Rows>,
    pub free: Vec<Vec2>,
    pub laws: Vec<Law>,
}

impl Asked {
    /// Adds a contact without friction, `J d + gap ≥ 0`.
    pub fn contact(&mut self, rows: Rows, gap: f64, compliance: f64) {
        self.rows.push(rows);
        self.free.push(Vec2::new(gap, 0.0));
        self.laws.push(Law::Contact {
            friction: 0.0,
            compliance,
        });
    }

    /// Whether row `i` asks for a displacement.
    pub fn moves(&self, i: usize) -> bool {
        match self.laws[i] {
            Law::Contact { .. } => self.free[i].x < 0.0,
            _ => self.free[i] != Vec2::zeros(),
        }
    }

    /// Removes all rows.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.free.clear();
        self.laws.clear();
    }

    /// Adds a row of a joint with finite forces that must not move, `J d = 0`.
    pub fn held(&mut self, joint: &JointRow, bodies: [u32; 2], inverse_mass: &[Vec3]) {
        self.push(joint, bodies, Vec2::zeros(), BILATERAL, inverse_mass);
    }

    /// Adds a row of a joint, `J d + free = 0`, or `≥ 0` of a limit; none where no body can move, or where
    /// the joint's forces are finite.
    pub fn joint(&mut self, joint: &JointRow, bodies: [u32; 2], free: Vec2, inverse_mass: &[Vec3]) {
        if let Some((_, law)) = joint_impact_rule(joint, true) {
            self.push(joint, bodies, free, law, inverse_mass);
        }
    }

    fn push(
        &mut self,
        joint: &JointRow,
        bodies: [u32; 2],
        free: Vec2,
        law: Law,
        inverse_mass: &[Vec3],
    ) {
        if bodies != [NO_BODY; 2] && diagonal(joint, inverse_mass) > 0.0 {
            self.rows.push(Rows {
                bodies,
                ..joint.rows
            });
            self.free.push(free);
            self.laws.push(law);
        }
    }
}
