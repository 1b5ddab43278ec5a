//! Bounces: what the last one of two bodies left, and how contacts lose theirs.

use crate::contact::Vec3;
use crate::dynamics::model::{ContactKey, ContactPoint, NormalLaw};
use crate::dynamics::rules::centripetal;

/// What a bounce of two bodies that touch nothing else left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounce {
    pub key: ContactKey,
    /// Its normal velocity \[m/s\], and its time \[s\].
    pub velocity: f64,
    pub time: f64,
}

impl Bounce {
    /// The mean acceleration \[m/s²\] at which the same contact has closed since; `None` for another
    /// contact, and if no surface turns, where the applied forces alone accelerate it.
    pub fn acceleration(&self, contact: &ContactPoint, now: &[Vec3], time: f64) -> Option<f64> {
        let turns = centripetal(contact, now) > 0.0;
        let change = self.velocity - contact.rows.velocity(now).x;
        (turns && self.key == contact.key && self.time < time).then(|| change / (time - self.time))
    }
}

/// Makes all contacts plastic, those that open too.
pub(super) fn forget_restitution(contacts: &mut [ContactPoint]) {
    for contact in contacts {
        if let NormalLaw::Rigid { restitution } = &mut contact.law {
            *restitution = 0.0;
        }
    }
}
