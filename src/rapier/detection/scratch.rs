//! What the narrow phase finds besides the contacts, and its buffers.

use super::super::engine::prelude::*;
use super::super::kernels::Touch;
use super::marks::Marks;
use super::ties::Tie;
use std::ops::Range;

/// A contact that only makes events: its groups or a hook forbid it to push, or neither body can
/// move.
#[derive(Debug, Clone, Copy)]
pub(in crate::rapier) struct EventContact {
    pub colliders: [ColliderHandle; 2],
    /// Gap \[m\].
    pub gap: f64,
}

/// Two parts whose contacts, those of the output with these numbers, may be at a face that others cover.
pub(super) struct Suspect {
    pub leaves: [u32; 2],
    pub contacts: Range<usize>,
}

/// Output of the narrow phase besides the contacts.
#[derive(Default)]
pub(super) struct Scratch {
    pub event_contacts: Vec<EventContact>,
    pub touches: Vec<Touch>,
    pub marks: Marks,
    pub ties: Vec<Tie>,
    pub suspects: Vec<Suspect>,
    /// Sides of two-sided segments on which pairs touch.
    pub faces: Marks,
}

impl Scratch {
    /// Empties the buffers, for a part of a `pass` that has begun.
    pub fn begin_part(&mut self, pass: &Scratch) {
        self.event_contacts.clear();
        self.ties.clear();
        self.suspects.clear();
        self.marks.begin_part(&pass.marks);
        self.faces.begin_part(&pass.faces);
    }

    /// Takes over what a part of the pass has found, whose first contact is `first`.
    pub fn end_part(&mut self, part: &mut Scratch, first: usize) {
        self.event_contacts.append(&mut part.event_contacts);
        self.ties.extend(part.ties.drain(..).map(|mut tie| {
            tie.contact += first;
            tie
        }));
        self.suspects.extend(part.suspects.drain(..).map(|mut own| {
            own.contacts = own.contacts.start + first..own.contacts.end + first;
            own
        }));
        self.marks.end_part(&mut part.marks);
        self.faces.end_part(&mut part.faces);
    }
}
