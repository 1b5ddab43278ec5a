//! Where the power of the machine comes from and goes to.

use super::world::{Part, ThreshingWorld};
use crate::dynamics::record::StepRecord;
use crate::report::{Align, Table, number};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Power balance over a measured time \[W\], machine totals.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PowerBudget {
    /// Supplied by the drive, and by the feeder that keeps the strip at its speed.
    pub drive: f64,
    pub feeder: f64,
    pub gravity: f64,
    /// Dissipated by friction on the teeth and on the concave.
    pub friction_teeth: f64,
    pub friction_concave: f64,
    /// Dissipated by the damping of the crop, and stored in its compression.
    pub normal_teeth: f64,
    pub normal_concave: f64,
    /// The same on the core of the cylinder, and of grains on grains.
    pub friction_hub: f64,
    pub normal_hub: f64,
    pub friction_crop: f64,
    pub normal_crop: f64,
    /// Taken by friction in contacts that stick: their slip counts as 0 in the friction above and in the wear,
    /// while the point of contact of a body that rolls changes its velocity within a step.
    pub sticking: f64,
    /// Taken from the motion of islands whose contacts had given back more than they took, see
    /// [`StepEnergy::returned`](crate::dynamics::record::StepEnergy::returned).
    pub returned: f64,
    /// Kinetic energy that the crop carries away beyond what it brought.
    pub crop: f64,
    /// Bending of the crop: dissipated and stored.
    pub bending: f64,
    /// Dissipated where the mat of crop parts, or slides into itself.
    pub parting: f64,
    /// Gained by the cylinder and the crop in the machine.
    pub stored: f64,
}

impl PowerBudget {
    /// Imbalance of the sum \[W\].
    pub fn imbalance(&self) -> f64 {
        self.terms().iter().map(|(_, value)| value).sum()
    }

    /// Adds the work of a step \[J\], of the slice.
    pub(super) fn add(&mut self, record: &StepRecord, world: &ThreshingWorld) {
        self.drive += world.drive_work(record);
        self.gravity += record.energy.forces;
        let strip = world.strip_work(record);
        self.feeder += strip.feeder;
        self.bending += strip.bending;
        self.parting += strip.parting;
        self.sticking -= record.energy.contact_t;
        self.returned -= record.energy.returned;
        for contact in &record.contacts {
            let (friction, normal) = match world.part(contact) {
                Some(Part::Tooth(_)) => (&mut self.friction_teeth, &mut self.normal_teeth),
                Some(Part::Concave) => (&mut self.friction_concave, &mut self.normal_concave),
                Some(Part::Hub) => (&mut self.friction_hub, &mut self.normal_hub),
                None => (&mut self.friction_crop, &mut self.normal_crop),
            };
            *friction += contact.friction_work;
            self.sticking -= contact.friction_work;
            *normal -= contact.normal_work;
        }
    }

    /// Divides all sums by a time, and multiplies them by the machine's width.
    pub(super) fn scaled(self, scale: f64) -> PowerBudget {
        PowerBudget {
            drive: scale * self.drive,
            feeder: scale * self.feeder,
            gravity: scale * self.gravity,
            friction_teeth: scale * self.friction_teeth,
            friction_concave: scale * self.friction_concave,
            normal_teeth: scale * self.normal_teeth,
            normal_concave: scale * self.normal_concave,
            friction_hub: scale * self.friction_hub,
            normal_hub: scale * self.normal_hub,
            friction_crop: scale * self.friction_crop,
            normal_crop: scale * self.normal_crop,
            sticking: scale * self.sticking,
            returned: scale * self.returned,
            crop: scale * self.crop,
            bending: scale * self.bending,
            parting: scale * self.parting,
            stored: scale * self.stored,
        }
    }

    /// Every term with its name and the sign it has in the sum.
    pub(super) fn terms(&self) -> [(&'static str, f64); 17] {
        [
            ("drive", self.drive),
            ("feeder", self.feeder),
            ("gravity", self.gravity),
            ("friction on the teeth", -self.friction_teeth),
            ("friction on the concave", -self.friction_concave),
            ("normal losses on the teeth", -self.normal_teeth),
            ("normal losses on the concave", -self.normal_concave),
            ("friction on the core", -self.friction_hub),
            ("normal losses on the core", -self.normal_hub),
            ("friction of grains on grains", -self.friction_crop),
            ("normal losses of grains on grains", -self.normal_crop),
            ("contacts that stick", -self.sticking),
            ("given back by contacts", -self.returned),
            ("carried away by the crop", -self.crop),
            ("bending of the crop", -self.bending),
            ("parting of the crop", -self.parting),
            ("stored in the machine", -self.stored),
        ]
    }

    /// The terms for `summary.json`.
    pub(super) fn json(&self) -> Value {
        let mut map = serde_json::Map::new();
        for (name, value) in self.terms() {
            map.insert(name.replace(' ', "_"), json!(value));
        }
        map.insert("sum".to_owned(), json!(self.imbalance()));
        Value::Object(map)
    }
}

/// Table of the power with new and with worn teeth.
pub(super) fn table(new: &PowerBudget, worn: &PowerBudget) -> String {
    let mut table = Table::new([
        ("power, whole machine", Align::Left),
        ("new teeth [W]", Align::Right),
        ("worn teeth [W]", Align::Right),
    ]);
    for ((name, a), (_, b)) in new.terms().into_iter().zip(worn.terms()) {
        // what this crop does not have
        if a == 0.0 && b == 0.0 {
            continue;
        }
        table.push([name.to_owned(), format!("{a:.0}"), format!("{b:.0}")]);
    }
    table.push([
        "sum".to_owned(),
        number(new.imbalance(), 2),
        number(worn.imbalance(), 2),
    ]);
    format!("{table}")
}
