//! Where the torque of the machine comes from and goes to.

use super::world::{Part, ThreshingWorld};
use crate::contact::Vec2;
use crate::dynamics::record::{ContactRecord, StepRecord};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Balance of the angular momentum about the axle over a measured time [N m], machine totals:
///
/// ```text
/// drive = concave + crop + stored − gravity + rest                                   (1)
/// ```
///
/// With grains the rest is what the gaps of contacts do to their lever arms. With the strip it is the moment of
/// the feeder, which holds the strip back, as well.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SpinBudget {
    /// Of the drive on the cylinder.
    pub drive: f64,
    /// With which the concave and its table hold the crop back.
    pub concave: f64,
    /// Of gravity on the crop, in the sense of rotation.
    pub gravity: f64,
    /// Angular momentum that the crop carries away beyond what it brought.
    pub crop: f64,
    /// Gained by the cylinder and the crop in the machine.
    pub stored: f64,
}

impl SpinBudget {
    /// Adds the angular impulses of a step [N m s], of the slice.
    pub(super) fn add(&mut self, record: &StepRecord, world: &ThreshingWorld) {
        self.drive += world.drive_moment(record);
        self.gravity += world.gravity_moment() * record.dt;
        let on_concave = (record.contacts.iter())
            .filter(|contact| world.part(contact) == Some(Part::Concave))
            .map(|contact| moment_on(contact, world.concave_side(contact)));
        self.concave += on_concave.sum::<f64>();
    }

    /// Multiplies all sums.
    pub(super) fn scaled(self, scale: f64) -> SpinBudget {
        SpinBudget {
            drive: scale * self.drive,
            concave: scale * self.concave,
            gravity: scale * self.gravity,
            crop: scale * self.crop,
            stored: scale * self.stored,
        }
    }

    /// What the other terms leave of the torque of the drive [N m].
    pub fn rest(&self) -> f64 {
        self.drive + self.gravity - self.concave - self.crop - self.stored
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "drive_nm": self.drive,
            "held_by_the_concave_nm": self.concave,
            "carried_away_by_the_crop_nm": self.crop,
            "gravity_nm": self.gravity,
            "stored_nm": self.stored,
            "rest_nm": self.rest(),
        })
    }
}

/// Angular impulse of a contact about the origin [N m s] on its side `side`.
fn moment_on(contact: &ContactRecord, side: usize) -> f64 {
    let n = contact.normal;
    let impulse = n * contact.impulse_n + Vec2::new(-n.y, n.x) * contact.impulse_t;
    let on_second = contact.position.perp(&impulse);
    if side == 0 { -on_second } else { on_second }
}
