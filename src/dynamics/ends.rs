//! Contacts at the end of a step, of bodies that turn far in it.

use super::interval::Interval;
use super::midpoint_gaps::STRIDE;
use super::model::{ContactPoint, Detection, ModelError, MultibodyModel};
use super::solution::Solution;
use crate::contact::{NO_BODY, Vec3};
use std::collections::BTreeMap;

/// Bodies without joints that are stepped from impact to impact and turn by more than [`STRIDE`] \[rad\], and their
/// contacts where they end. The rows of the midpoint of the whole step say nothing of another path that turns so far:
/// boxes that landed in flight kept the overlap of their turn, twice as much as with these contacts.
#[derive(Default)]
pub(super) struct Ends<'a> {
    /// Mean velocities of all bodies from the midpoint of the step to the next one, see
    /// [`opening`](super::midpoint_gaps::opening).
    pub path: Option<&'a [Vec3]>,
    pub turned: Vec<bool>,
    /// Those of them that have joints, which are not seen anew: their overlaps are left to the next steps.
    pub waits: Vec<bool>,
    /// Each with the index of the same contact in the detection of the step, if it is there.
    pub contacts: Vec<(Option<usize>, ContactPoint)>,
}

impl<'a> Ends<'a> {
    /// Finds them, with the bodies at the end of the step.
    ///
    /// # Errors
    /// Those of the detection.
    pub fn find(
        model: &mut dyn MultibodyModel,
        interval: &Interval,
        solution: &Solution,
        in_cluster: &[bool],
        path: Option<&'a [Vec3]>,
    ) -> Result<Ends<'a>, ModelError> {
        let h = interval.length;
        let turns = |body: usize| {
            let [a, e] = [&interval.start, &solution.end].map(|u| u[body].z);
            let whole = path.map_or(0.0, |path| path[body].z - 0.5 * (e - a));
            h * a.abs().max(e.abs()).max(whole.abs()) > STRIDE
        };
        let own = in_cluster.iter().enumerate();
        let mut turned: Vec<bool> = own.map(|(body, own)| *own && turns(body)).collect();
        let mut waits = vec![false; turned.len()];
        let joined = interval.detection.joints.iter().flat_map(|j| j.rows.bodies);
        for body in joined.filter(|b| *b != NO_BODY).map(|b| b as usize) {
            waits[body] |= std::mem::take(&mut turned[body]);
        }
        if !turned.contains(&true) {
            return Ok(Ends {
                path,
                waits,
                ..Ends::default()
            });
        }
        let main = interval.detection.contacts.iter().enumerate();
        let main: Vec<_> = main.filter(|(_, c)| is_exempt(c, &turned)).collect();
        let mut pairs: Vec<[u32; 2]> = main.iter().map(|(_, c)| c.surfaces).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut found = Detection::default();
        model.detect_pairs(&pairs, interval.length, &mut found)?;
        let mut known: BTreeMap<_, usize> = BTreeMap::new();
        for (i, contact) in main {
            known.entry(contact.key).or_insert(i);
        }
        let contacts = found.contacts.into_iter();
        let contacts = contacts.map(|c| (known.get(&c.key).copied(), c)).collect();
        Ok(Ends {
            path,
            turned,
            waits,
            contacts,
        })
    }
}

/// Whether a body of a contact is among these.
pub(super) fn is_exempt(contact: &ContactPoint, exempt: &[bool]) -> bool {
    let known = |b: &u32| exempt.get(*b as usize).copied().unwrap_or(false);
    contact.rows.bodies.iter().any(known)
}
