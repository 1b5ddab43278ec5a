//! Reductions of the model: what a step leaves out, and what the full model costs and changes.
//!
//! Each leaves out unknowns whose values follow from the others, and has a key that brings them back.
//!
//! | reduction | why the result is the same | what may differ |
//! |---|---|---|
//! | islands at rest | they pose the problem of the last step again, see [`StepperSettings::keep_rest`](crate::dynamics::StepperSettings::keep_rest) | motion slower than 1e-8 of what forces give in a step is stopped |
//! | islands | no contact or joint couples them: `G` is block diagonal | the tolerance is relative to the velocities of the island, or of all; Newton's law is bounded by island |
//! | distant contacts | `P = 0` obeys the law of a contact that the others leave open | nothing but which of several solutions is found |
//! | friction rows | without friction the cone is a half-line: `P_T = 0` | the full model has a friction of 1e-12 |
//!
//! # The comparison
//! Every step of both models begins at the same state, that of the reduced one with all its caches, so that
//! a difference is one of this step alone and does not grow in a motion that forgets its start. Steps end
//! *equal* below 1e-9 m and rad. Where they do not, the verdict says whether the impulses of both are certified:
//! *unsolved* if not. If they are, the impulses of the reduced model are put into the problems of the full
//! one, and zero where it leaves a contact out. Where these certify them, both have solved the same problem:
//! *another solution*, as friction and impacts do not make the motion unique. Otherwise the step is *apart*.
//!
//! On hard problems the time is luck: four contacts more or less decide whether
//! [`Direct`](crate::solver::Direct) finds the solution or sweeps and pivots must. Five such steps of 120 make
//! the card house 3.9 times slower without its distant contacts; over 14 step lengths it takes 0.43 to 2.98
//! times as long.
//!
//! Bodies that are fixed or move as prescribed have no columns in `G`: with or without them, the operator is
//! the same, so that there is no time to compare. They end where bodies of 1e12 times the mass do, which a test
//! asserts, with `body.kind` as the switch. Joint rows that move no body have no columns either.
//! `body.touches`, `joint.contacts` and `step.events` are choices of another model, not reductions.
//! The jumps of a wear life have an error of their own, which the run states; where the rates are constant, a jump
//! wears what its seconds wear, each measured by itself, which a test asserts. The bars of a machine, of which one
//! profile stands for all, are worn alike to 1.5 % over 64 revolutions, which a test asserts as well; over four,
//! single bars are up to 35 % off their mean. That is no lasting difference but a slow drift: what a bar has too much in eight
//! revolutions it has too little in the next.

use super::setting::step_count;
use super::simulate::{Engine, RunError, Totals};
use crate::checkpoint::{Reader, Writer};
use crate::contact::{Vec2, natural_map};
use crate::dynamics::{ContactKey, SolvedProblem};
use crate::report::{ModelRow, Progress};
use crate::scene::{Built, Scene, Step};
use std::collections::HashMap;

/// A reduction of the model.
pub struct Reduction {
    pub name: &'static str,
    /// Its switch in a scene file.
    pub key: &'static str,
    pub is_on: fn(&Step) -> bool,
    set: fn(&mut Step, bool),
}

/// All reductions of a step.
pub const REDUCTIONS: [Reduction; 4] = [
    Reduction {
        name: "islands at rest",
        key: "step.keep_rest",
        is_on: |step| step.keep_rest,
        set: |step, on| step.keep_rest = on,
    },
    Reduction {
        name: "islands",
        key: "step.split_islands",
        is_on: |step| step.split_islands,
        set: |step, on| step.split_islands = on,
    },
    Reduction {
        name: "distant contacts",
        key: "step.skip_distant",
        is_on: |step| step.skip_distant,
        set: |step, on| step.skip_distant = on,
    },
    Reduction {
        name: "friction rows",
        key: "step.skip_tangents",
        is_on: |step| step.skip_tangents,
        set: |step, on| step.skip_tangents = on,
    },
];

/// Largest difference \[m, rad\] of two steps that are equal.
const EQUAL: f64 = 1e-9;
/// A reduction may cost as much more than the full model, over which no clock tells more.
const SLOWER: f64 = 1.02;
/// What a clock tells of a step \[s\].
const CLOCK: f64 = 1e-6;
/// A model that seems slower is stepped so many times as often: the least times of few runs scatter.
const AGAIN: usize = 4;

/// One of the two models of a scene.
struct Side {
    built: Built,
    totals: Totals,
    /// Least time of each step \[s\].
    times: Vec<f64>,
}

impl Side {
    fn new(scene: &Scene, reduction: &Reduction, on: bool) -> Result<Side, RunError> {
        let mut scene = scene.clone();
        (reduction.set)(&mut scene.step, on);
        Ok(Side {
            built: scene.build()?,
            totals: Totals::default(),
            times: Vec::new(),
        })
    }

    /// A step from the saved state; whether it is certified.
    fn step(&mut self, from: &[u8]) -> Result<bool, RunError> {
        self.built.load(&mut Reader::new(from.to_vec()))?;
        let (record, seconds) = Engine::Moreau.timed_step(&mut self.built)?;
        self.totals.add(&record);
        self.times.push(seconds);
        Ok(record.unsolved == 0)
    }

    /// The contact problems of a step from the saved state, which is not counted.
    fn problems(&mut self, from: &[u8]) -> Result<Vec<SolvedProblem>, RunError> {
        self.built.load(&mut Reader::new(from.to_vec()))?;
        self.built.keep_problems(true);
        Engine::Moreau.timed_step(&mut self.built)?;
        let problems = self.built.problems().to_vec();
        self.built.keep_problems(false);
        Ok(problems)
    }

    /// Whether the impulses of the `other` model certify all problems of a step from the saved state. What
    /// the other model leaves out has none.
    fn solved_by(
        &mut self,
        other: &[SolvedProblem],
        from: &[u8],
        tolerance: f64,
    ) -> Result<bool, RunError> {
        let impulses = other.iter().flat_map(|p| p.keys.iter().zip(&p.impulses));
        let known: HashMap<&ContactKey, &Vec2> = impulses.collect();
        let own = self.problems(from)?;
        Ok(own.iter().all(|p| {
            let of = |key: &ContactKey| known.get(key).map_or(Vec2::zeros(), |p| **p);
            let impulses: Vec<Vec2> = p.keys.iter().map(of).collect();
            natural_map(&p.problem, &impulses).certified(tolerance)
        }))
    }
}

/// What the two models of a scene have shown.
#[derive(Default)]
struct Shown {
    difference: f64,
    /// Steps that end apart, those that both models certify, and those with another solution.
    apart: [usize; 3],
    /// Of the full model and the reduced one.
    totals: [Totals; 2],
    /// Least time of each step of all runs \[s\].
    least: [Vec<f64>; 2],
}

impl Shown {
    /// One more run of both models, in turns.
    fn run(
        &mut self,
        scene: &Scene,
        reduction: &Reduction,
        run: usize,
        progress: Option<&Progress>,
    ) -> Result<(), RunError> {
        let mut full = Side::new(scene, reduction, false)?;
        let mut reduced = Side::new(scene, reduction, true)?;
        for step in 0..step_count(&scene.step) {
            let mut start = Writer::default();
            reduced.built.save(&mut start)?;
            let start = start.bytes();
            // neither is always the first
            let certified = if (step + run).is_multiple_of(2) {
                [full.step(start)?, reduced.step(start)?]
            } else {
                [reduced.step(start)?, full.step(start)?]
            };
            let found = apart(&full.built, &reduced.built);
            self.difference = self.difference.max(found);
            if run == 0 && found > EQUAL {
                let solved = certified == [true; 2] && {
                    let problems = reduced.problems(start)?;
                    full.solved_by(&problems, start, scene.step.tolerance)?
                };
                let counted = [true, certified == [true; 2], solved];
                self.apart
                    .iter_mut()
                    .zip(counted)
                    .for_each(|(n, is)| *n += usize::from(is));
            }
            progress.into_iter().for_each(Progress::advance);
        }
        for (least, side) in self.least.iter_mut().zip([&full, &reduced]) {
            least.resize(side.times.len(), f64::INFINITY);
            let times = least.iter_mut().zip(&side.times);
            times.for_each(|(least, time)| *least = least.min(*time));
        }
        self.totals = [full.totals, reduced.totals];
        Ok(())
    }

    /// Times of all steps \[s\].
    fn times(&self) -> [f64; 2] {
        self.least.each_ref().map(|times| times.iter().sum())
    }

    fn is_slower(&self) -> bool {
        let [full, reduced] = self.times();
        reduced > SLOWER * full && reduced - full > CLOCK * self.least[0].len() as f64
    }

    fn verdict(&self) -> String {
        let equality = match self.apart {
            [0, ..] => "equal",
            [_, 0, _] => "unsolved",
            [_, certified, another] if certified == another => "another solution",
            _ => "apart",
        };
        match self.is_slower() {
            true => format!("{equality}, slower"),
            false => equality.to_owned(),
        }
    }
}

/// Steps `scene` with `reduction` and without it, in turns, `repeats` times; four times as often where the
/// reduced model seems slower then.
///
/// # Returns
/// Unknowns, work and largest difference, which are deterministic, and times.
///
/// # Errors
/// [`RunError`] if the scene cannot be built or a step fails.
pub fn against_full(
    scene: &Scene,
    reduction: &Reduction,
    repeats: usize,
    progress: &Progress,
) -> Result<ModelRow, RunError> {
    let repeats = repeats.max(1);
    let mut shown = Shown::default();
    for run in 0..repeats {
        shown.run(scene, reduction, run, Some(progress))?;
    }
    if shown.is_slower() {
        for run in repeats..AGAIN * repeats {
            shown.run(scene, reduction, run, None)?;
        }
    }
    let [full, reduced] = &shown.totals;
    let work = |t: &Totals| t.sweeps + t.factorisations + t.pivots;
    let [time_full_s, time_s] = shown.times();
    let [steps_apart, steps_apart_certified, steps_another_solution] = shown.apart;
    Ok(ModelRow {
        reduction: reduction.name.to_owned(),
        key: reduction.key.to_owned(),
        scene: scene.name.clone(),
        steps: step_count(&scene.step),
        unknowns_full: full.unknowns,
        unknowns: reduced.unknowns,
        work_full: work(full),
        work: work(reduced),
        time_full_s,
        time_s,
        time_ratio: time_s / time_full_s,
        difference: shown.difference,
        steps_apart,
        steps_apart_certified,
        steps_another_solution,
        verdict: shown.verdict(),
    })
}

/// Largest distance of the same body in two worlds \[m\], and of its direction \[rad\].
fn apart(a: &Built, b: &Built) -> f64 {
    let of = |k: usize| {
        let ((a, _), (b, _)) = (a.state(k)?, b.state(k)?);
        let turned = (a.cos - b.cos).hypot(a.sin - b.sin);
        Some((a.translation - b.translation).norm().max(turned))
    };
    (0..a.bodies()).filter_map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene;

    /// Another solution is one of the same problem: impulses that a lighter gravity asks for do not solve
    /// that of the scene.
    #[test]
    fn impulses_of_another_problem_do_not_solve_the_full_one() {
        let [mut full, mut same, mut lighter] = ["-9.81", "-9.81", "-9"].map(|y| {
            let scene = scene::load("tower", &[format!("gravity.y={y}")]).unwrap();
            Side::new(&scene, &REDUCTIONS[2], false).unwrap()
        });
        let mut start = Writer::default();
        full.built.save(&mut start).unwrap();
        for (other, solves) in [(&mut same, true), (&mut lighter, false)] {
            let problems = other.problems(start.bytes()).unwrap();
            assert!(!problems.is_empty());
            let found = full.solved_by(&problems, start.bytes(), 1e-8).unwrap();
            assert_eq!(found, solves);
        }
    }
}
