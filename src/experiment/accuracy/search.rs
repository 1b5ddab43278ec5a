//! The cost of a chosen setting against that of the best fixed setting, found with the closed form.

use super::super::reference::measures;
use super::super::{Engine, RunError, Samples, simulate};
use super::choice::{Choice, MODES, choose, coarsest_steps};
use super::held::{Ended, Held};
use super::trial::{INSTANTS, Trial};
use crate::report::{AccuracyRow, Progress};
use crate::scene::{Scene, Step};

/// Settings of the grid are apart by this factor in step length.
const APART: f64 = std::f64::consts::SQRT_2;
/// Points of the grid: the finest step is 1/128 of the scene's.
const POINTS: i32 = 19;
/// A setting counts as held if this many finer ones of its kind hold too: one alone may be luck.
const FINER: usize = 2;

/// The best fixed setting.
struct Best {
    step: Step,
    work: usize,
}

/// What a search found.
#[derive(Default)]
struct Found {
    best: Option<Best>,
    /// Least work of any setting that holds, be it by luck.
    least: Option<usize>,
}

/// Chooses a setting, runs it, judges it by the closed form of `scene`, and searches for the fixed setting
/// that would have been cheapest.
///
/// The search runs every scheme, with and without events, at step lengths that are apart by √2, from four
/// steps of the scene to 1/128 of one, with the scene's tolerance and with that of the choice. The best is
/// the one of least work whose error, and that of the next two finer ones of its kind, is at most `asked`.
///
/// # Errors
/// Those of [`choose`]; [`RunError::Strayed`] never.
pub fn against_search(
    scene: &Scene,
    asked: f64,
    progress: &Progress,
) -> Result<AccuracyRow, RunError> {
    let mut choice = choose(scene, asked, progress)?;
    let ended = choice.hold(scene, |scene, choice| run_held(scene, choice, progress))?;
    let Found { best, least } = search(scene, asked, choice.step.tolerance, progress)?;
    let (judge, error) = ended.judged;
    Ok(AccuracyRow {
        scene: scene.name.clone(),
        accuracy: asked,
        scheme: choice.step.scheme.name().to_owned(),
        events: choice.step.events,
        dt_s: choice.step.dt,
        tolerance: choice.step.tolerance,
        tightened: choice.tightened.len(),
        bound: ended.error,
        error,
        measure: judge.to_owned(),
        work: ended.work,
        choice_work: choice.work,
        best_scheme: (best.as_ref()).map_or(String::new(), |b| b.step.scheme.name().to_owned()),
        best_events: best.as_ref().is_some_and(|b| b.step.events),
        best_dt_s: best.as_ref().map_or(f64::NAN, |b| b.step.dt),
        best_work: best.as_ref().map_or(0, |b| b.work),
        lucky_work: least.unwrap_or(0),
        ratio: (best.as_ref()).map_or(f64::NAN, |b| ended.work as f64 / b.work as f64),
    })
}

/// A run of the chosen setting under watch.
fn run_held(scene: &Scene, choice: &Choice, progress: &Progress) -> Result<Ended, RunError> {
    let mut built = scene.build()?;
    let mut held = Held::start(choice, scene, &built);
    let mut samples = Samples::start(&built, Engine::Moreau);
    let totals = simulate(&mut built, Engine::Moreau, choice.steps, |record, built| {
        if scene.reference.is_some() {
            samples.add(record, built, Engine::Moreau);
        }
        progress.advance();
        held.add(record, built)
    })?;
    held.end(scene, &measures(scene, &samples), &totals)
}

fn search(
    scene: &Scene,
    asked: f64,
    tolerance: f64,
    progress: &Progress,
) -> Result<Found, RunError> {
    let first = coarsest_steps(&scene.step) as f64;
    let (mut best, mut least): (Option<Best>, Option<usize>) = (None, None);
    let mut tolerances = vec![scene.step.tolerance, tolerance];
    tolerances.dedup();
    for (scheme, events) in MODES {
        for &tolerance in &tolerances {
            // held so far without a gap, the coarsest first
            let mut held: Vec<Best> = Vec::new();
            for point in 0..POINTS {
                let steps =
                    (first * APART.powi(point) / INSTANTS as f64).round() as usize * INSTANTS;
                let step = Step {
                    scheme,
                    events,
                    tolerance,
                    dt: scene.step.time / steps as f64,
                    ..scene.step.clone()
                };
                let scene = Scene {
                    step: step.clone(),
                    ..scene.clone()
                };
                let trial = Trial::run(&scene, steps, progress)?;
                let ok = |trial: &Trial| !trial.found.is_empty() && trial.error().1 <= asked;
                match trial.filter(ok) {
                    Some(trial) => {
                        let work = trial.seen.work;
                        least = Some(least.map_or(work, |least| least.min(work)));
                        held.push(Best { step, work });
                    }
                    None => held.clear(),
                }
                let dear = |w: usize| best.as_ref().is_some_and(|b| w >= b.work);
                if held.len() > FINER
                    || held.last().is_some_and(|b| dear(b.work)) && held.len() == 1
                {
                    break;
                }
            }
            if held.len() > FINER {
                let found = held.swap_remove(0);
                if best.as_ref().is_none_or(|b| found.work < b.work) {
                    best = Some(found);
                }
            }
        }
    }
    Ok(Found { best, least })
}
