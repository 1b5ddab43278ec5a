//! Trials of `explain`: the start of a scene, and what its records tell.

use super::freedoms::rows;
use super::simulate::{Engine, RunError, Totals, go_on};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::record::{ContactStatus, StepRecord};
use crate::scene::{BodyKind, Built, Scene};
use serde::Serialize;

/// Steps of a run from which one more than the trial's is no more than a few in a hundred.
const LOOKS: usize = 40;

/// The trial at the scene's step.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Trial {
    pub steps: usize,
    pub time_s: f64,
    /// Of all steps that a run takes; 0 for a machine, whose wear decides.
    pub run_steps: usize,
    pub most_contacts: usize,
    /// Unknown impulses that a step solved at most.
    pub most_unknowns: usize,
    pub most_islands: usize,
    /// Islands, summed over the steps: at rest, of at most [`SMALL`](crate::solver::SMALL) contacts and
    /// joint rows, larger ones in motion that were swept, and all others; and the contacts and joint rows of
    /// the largest that was solved.
    pub resting_islands: usize,
    pub small_islands: usize,
    pub swept_islands: usize,
    pub other_islands: usize,
    pub largest_island: usize,
    /// Smallest gap of two surfaces apart that may close within a step \[m\].
    pub least_gap_m: Option<f64>,
    /// Contacts, summed over the steps, by what they did.
    pub sticking: usize,
    pub sliding: usize,
    /// Closed without friction: they neither stick nor slide.
    pub frictionless: usize,
    pub impacts: usize,
    pub sweeps: usize,
    pub factorisations: usize,
    pub unsolved_islands: usize,
}

impl Trial {
    /// Adds what a step tells.
    pub(crate) fn add(&mut self, record: &StepRecord) {
        self.most_islands = self.most_islands.max(record.islands);
        self.most_unknowns = self.most_unknowns.max(record.unknowns);
        self.impacts += record.impacts.len();
        self.resting_islands += record.resting;
        self.small_islands += record.small_islands;
        self.swept_islands += record.crowds;
        let known = record.resting + record.small_islands + record.crowds;
        self.other_islands += record.islands.saturating_sub(known);
        self.largest_island = self.largest_island.max(record.largest_island);
        let least = [self.least_gap_m, record.least_gap].into_iter().flatten();
        self.least_gap_m = least.min_by(f64::total_cmp);
        for contact in &record.contacts {
            match contact.status {
                ContactStatus::Stick => self.sticking += 1,
                _ if contact.is_frictionless() => self.frictionless += 1,
                ContactStatus::SlipPlus | ContactStatus::SlipMinus => self.sliding += 1,
                ContactStatus::Open | ContactStatus::Impact => {}
            }
        }
    }
}

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

/// Whether nothing but gravity moved the bodies in a trial, though they may meet later.
pub(super) fn is_free(scene: &Scene, tried: &Tried) -> bool {
    let met = tried.trial.most_contacts + tried.trial.impacts;
    met == 0 && scene.joints.is_empty() && scene.bodies.len() > 1
}

/// Runs the first `steps` steps of a scene, each divided by `finer`.
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
                trial.add(record);
                // contacts at rest are in the record too
                if record.resting == 0 {
                    rows += 2 * record.contacts.len() + joint_rows;
                    solved += record.unknowns;
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
    let places: Vec<Vec2> = dynamic.iter().filter_map(|k| place(&built, *k)).collect();
    // a single step never finds that it has come to rest: the next one does, at little cost where it has
    if finer == 1 && steps == 1 && run_steps >= LOOKS {
        let (record, _) = Engine::Moreau.timed_step(&mut built)?;
        let still = |k: &usize| built.state(*k).is_none_or(|(_, u)| u == Vec3::zeros());
        at_rest =
            record.resting > 0 && record.resting == record.islands && dynamic.iter().all(still);
    }
    trial.steps = totals.steps / finer;
    trial.time_s = totals.time;
    trial.most_contacts = totals.most_contacts;
    trial.sweeps = totals.sweeps;
    trial.factorisations = totals.factorisations;
    trial.unsolved_islands = totals.unsolved_islands;
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
