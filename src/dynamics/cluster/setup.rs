//! What a cluster takes over from the step that it is part of.

use super::context::Context;
use super::runner::Runner;
use super::watched::kept;
use crate::contact::NO_BODY;
use crate::dynamics::interval::belongs;

impl Runner {
    /// Finds the bodies of the cluster, the adjacent ones with prescribed motion, and the surface
    /// pairs that may touch.
    pub fn gather(&mut self, context: &Context, bodies: &[u32]) {
        self.members.clear();
        self.members.resize(context.inverse_mass.len(), false);
        for &b in bodies {
            self.members[b as usize] = true;
        }
        self.pairs.clear();
        self.moved.clear();
        self.place.clear();
        self.place.resize(context.inverse_mass.len(), NO_BODY);
        for &b in bodies {
            self.place[b as usize] = self.moved.len() as u32;
            self.moved.push(b);
        }
        let found = &context.main.detection;
        let contacts = found.contacts.iter();
        let contacts = contacts.map(|c| (c.rows.bodies, Some(c.surfaces)));
        let near = match context.rules.events {
            true => found.near.as_slice(),
            false => &[],
        };
        let near = near.iter().map(|n| (n.bodies, Some(n.surfaces)));
        let joints = found.joints.iter().map(|j| (j.rows.bodies, None));
        for (sides, surfaces) in contacts.chain(near).chain(joints) {
            if !belongs(sides, Some(&self.members), context.inverse_mass) {
                continue;
            }
            self.pairs.extend(surfaces);
            for b in sides {
                if b != NO_BODY && self.place[b as usize] == NO_BODY {
                    self.place[b as usize] = self.moved.len() as u32;
                    self.moved.push(b);
                }
            }
        }
        self.pairs.sort_unstable();
        self.pairs.dedup();
    }

    /// Takes the path and the deferred contacts from the trial of the whole step.
    pub fn take_trial(&mut self, context: &Context) {
        let (main, trial) = (context.main, context.trial);
        let (interval, solution) = (&mut self.interval, &mut self.solution);
        interval.length = main.length;
        interval.forces.clone_from(&main.forces);
        interval.accelerations.clone_from(&main.accelerations);
        interval.detection.clear();
        interval.blocks.clear();
        interval.laws.clear();
        solution.clear();
        solution.end.clone_from(&trial.end);
        for &i in &trial.deferred {
            let contact = main.detection.contacts[i];
            if self.pairs.binary_search(&contact.surfaces).is_ok() {
                solution.deferred.push(interval.detection.contacts.len());
                interval.detection.contacts.push(contact);
            }
        }
        let members = Some(self.members.as_slice());
        let near = match context.rules.events {
            true => main.detection.near.as_slice(),
            false => &[],
        };
        let near = near
            .iter()
            .filter(|n| belongs(n.bodies, members, context.inverse_mass));
        interval.detection.near.extend(near);
        self.kept.clear();
        for (i, block) in main.blocks.iter().enumerate() {
            if belongs(main.sides[i], members, context.inverse_mass) {
                interval.blocks.push(*block);
                interval.laws.push(main.laws[i]);
                solution.impulses.push(trial.impulses[i]);
                self.kept.extend(kept(main, trial, i, context.dt));
            }
        }
    }
}
