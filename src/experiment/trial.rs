//! One trial of a scene for what is said of it, and what there is before the first step.

use super::explain::Trial;
use super::simulate::{Engine, RunError, Totals, go_on};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::Detection;
use crate::dynamics::record::ContactStatus;
use crate::scene::{BodyKind, Built, JointKind, Scene};

/// An island of more contacts is not solved if the run has few steps. Its first solve, without impulses of a
/// step before, takes as long as [`COLD`] steps at rest: 70 to 110 in pyramids of 5000 to 60000 contacts.
const LARGE: usize = 20_000;
const COLD: usize = 100;
/// Most contacts of a body in large heaps, on average.
const PER_BODY: usize = 8;

/// One trial: totals, final positions, and what its records tell.
pub(super) struct Tried {
    pub totals: Totals,
    pub places: Vec<Vec2>,
    /// Largest way of a body and its size \[m\].
    pub way: f64,
    pub trial: Trial,
    pub islands: usize,
    /// Rows of all contacts and joints, and those that were solved, of the steps without an island at rest.
    pub rows: usize,
    pub solved: usize,
    /// Whether all islands rest at its end and no body moves.
    pub at_rest: bool,
    pub fastest_turn: f64,
    pub turning: usize,
    pub fastest: f64,
}

/// What there is at the start of a scene.
pub(super) struct AtStart {
    contacts: usize,
    islands: usize,
    unknowns: usize,
}

/// What there is at the start, if it has an island too large for a trial: a tenth of the run's steps is less than
/// [`COLD`], and the island has more than [`LARGE`] contacts.
///
/// # Errors
/// [`RunError`] if the scene cannot be built or its contacts cannot be found.
pub(super) fn dear_start(scene: &Scene, run_steps: usize) -> Result<Option<AtStart>, RunError> {
    if run_steps >= 10 * COLD || PER_BODY * scene.bodies.len() <= LARGE {
        return Ok(None);
    }
    let mut built = scene.build()?;
    let moves = |k: &usize| scene.bodies[*k].kind == BodyKind::Dynamic;
    let numbers = (0..scene.bodies.len())
        .filter(moves)
        .filter_map(|k| built.number(k));
    let moving: Vec<u32> = numbers.collect();
    let Some(simulation) = built.simulation_mut() else {
        return Ok(None);
    };
    let mut found = Detection::default();
    (simulation.pipeline).find_contacts(&mut simulation.world, &mut found)?;
    let contacts = found.contacts.len();
    let friction = found.contacts.iter().filter(|c| c.friction > 0.0).count();
    let pairs: Vec<[u32; 2]> = found.contacts.iter().map(|c| c.bodies).collect();
    let (islands, largest) = islands(&moving, &pairs);
    Ok((largest > LARGE).then_some(AtStart {
        contacts,
        islands,
        unknowns: contacts + friction,
    }))
}

/// Number of groups of bodies that `pairs` of contacts connect, and the contacts of the largest. Bodies that do
/// not move connect nothing, and a body without a contact is no group.
fn islands(moving: &[u32], pairs: &[[u32; 2]]) -> (usize, usize) {
    let most = pairs.iter().flatten().max().map_or(0, |k| *k as usize + 1);
    let mut moves = vec![false; most];
    for k in moving.iter().filter(|k| (**k as usize) < most) {
        moves[*k as usize] = true;
    }
    // each body points to another of its group, the first of it to itself
    let mut parent: Vec<usize> = (0..most).collect();
    let root = |parent: &mut Vec<usize>, mut k: usize| {
        while parent[k] != k {
            parent[k] = parent[parent[k]];
            k = parent[k];
        }
        k
    };
    let of_pair = |pair: &[u32; 2]| pair.map(|k| k as usize);
    for [a, b] in pairs.iter().map(of_pair) {
        if moves[a] && moves[b] {
            let [a, b] = [a, b].map(|k| root(&mut parent, k));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut counts = vec![0; most];
    for [a, b] in pairs.iter().map(of_pair) {
        if let Some(k) = [a, b].into_iter().find(|k| moves[*k]) {
            counts[root(&mut parent, k)] += 1;
        }
    }
    let groups = counts.iter().filter(|count| **count > 0).count();
    (groups, counts.iter().max().copied().unwrap_or(0))
}

impl Tried {
    /// In place of a trial.
    pub fn none(found: AtStart, run_steps: usize) -> Tried {
        Tried {
            totals: Totals::default(),
            places: Vec::new(),
            way: 0.0,
            trial: Trial {
                run_steps,
                most_contacts: found.contacts,
                most_islands: found.islands,
                most_unknowns: found.unknowns,
                ..Trial::default()
            },
            islands: 0,
            rows: 0,
            solved: 0,
            at_rest: false,
            fastest_turn: 0.0,
            turning: 0,
            fastest: 0.0,
        }
    }
}

/// Coordinates that a joint takes.
pub(super) fn rows(kind: JointKind) -> usize {
    match kind {
        JointKind::Revolute | JointKind::Prismatic => 2,
        JointKind::Fixed => 3,
        JointKind::PinSlot => 1,
        JointKind::Rope | JointKind::Spring => 0,
    }
}

/// Tries `steps` steps of the scene, each parted into `finer` steps, or less if all comes to rest.
///
/// # Errors
/// [`RunError`] if the scene cannot be built or a step fails.
pub(super) fn tried(
    scene: &Scene,
    finer: usize,
    steps: usize,
    run_steps: usize,
) -> Result<Tried, RunError> {
    let mut scene = scene.clone();
    scene.step.dt /= finer as f64;
    let mut built = scene.build()?;
    let joint_rows: usize = scene.joints.iter().map(|joint| rows(joint.kind)).sum();
    let mut trial = Trial {
        steps,
        run_steps,
        ..Trial::default()
    };
    let (mut islands, mut turning) = (0, 0);
    let (mut fastest_turn, mut fastest) = (0.0, 0.0);
    let dynamic: Vec<usize> = (0..built.bodies())
        .filter(|k| {
            scene
                .bodies
                .get(*k)
                .is_none_or(|b| b.kind == BodyKind::Dynamic)
        })
        .collect();
    let place = |built: &Built, k: usize| Some(built.state(k)?.0.translation);
    let starts: Vec<Vec2> = dynamic.iter().filter_map(|k| place(&built, *k)).collect();
    Engine::Moreau.prepare(&mut built)?;
    let mut totals = Totals::start(&mut built, Engine::Moreau);
    let (mut rows, mut solved, mut at_rest) = (0, 0, false);
    for step in 1..=finer * steps {
        totals = go_on(
            &mut built,
            Engine::Moreau,
            totals,
            step,
            |record, built, _| {
                islands += record.islands;
                trial.most_islands = trial.most_islands.max(record.islands);
                trial.most_unknowns = trial.most_unknowns.max(record.unknowns);
                trial.impacts += record.impacts.len();
                // contacts at rest are in the record too
                if record.resting == 0 {
                    rows += 2 * record.contacts.len() + joint_rows;
                    solved += record.unknowns;
                }
                for contact in &record.contacts {
                    match contact.status {
                        ContactStatus::Stick => trial.sticking += 1,
                        ContactStatus::SlipPlus | ContactStatus::SlipMinus => trial.sliding += 1,
                        ContactStatus::Open | ContactStatus::Impact => {}
                    }
                }
                let mut moves = false;
                for k in &dynamic {
                    if let Some((_, u)) = built.state(*k) {
                        if u.z.abs() > fastest_turn && scene.linear.is_none() {
                            (fastest_turn, turning) = (u.z.abs(), *k);
                        }
                        fastest = u.x.hypot(u.y).max(fastest);
                        moves |= u != Vec3::zeros();
                    }
                }
                at_rest = record.resting > 0 && record.resting == record.islands && !moves;
                Ok(())
            },
        )?;
        // what a trial finds at rest, it finds in all later steps
        if finer == 1 && at_rest {
            break;
        }
    }
    trial.steps = totals.steps / finer;
    trial.time_s = totals.time;
    trial.most_contacts = totals.most_contacts;
    trial.sweeps = totals.sweeps;
    trial.factorisations = totals.factorisations;
    trial.unsolved_islands = totals.unsolved_islands;
    let places: Vec<Vec2> = dynamic.iter().filter_map(|k| place(&built, *k)).collect();
    let sizes = dynamic.iter().map(|k| built.size(*k).unwrap_or(0.0));
    let ways = starts.iter().zip(&places).map(|(a, b)| (b - a).norm());
    Ok(Tried {
        way: ways
            .zip(sizes)
            .map(|(way, size)| way + size)
            .fold(0.0, f64::max),
        places,
        totals,
        trial,
        islands,
        rows,
        solved,
        at_rest,
        fastest_turn,
        turning,
        fastest,
    })
}

#[cfg(test)]
mod tests {
    use super::islands;

    /// Two bodies on the floor 0 that touch, one beside them, and one in the air.
    #[test]
    fn what_does_not_move_connects_no_islands() {
        let pairs = [[0, 1], [1, 2], [2, 0], [0, 3], [0, 3]];
        assert_eq!(islands(&[1, 2, 3, 4], &pairs), (2, 3));
        assert_eq!(islands(&[0, 1, 2, 3, 4], &pairs), (1, 5));
        assert_eq!(islands(&[4], &[]), (0, 0));
    }
}
