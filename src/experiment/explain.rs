//! What a scene models and how well its step resolves it, measured on a short trial.

use super::freedoms::{coordinates_taken, rows};
use super::setting::step_count;
use super::simulate::RunError;
use super::trial::{Trial, Tried, is_free, tried};
use crate::scene::{BodyKind, JointKind, Scene};
use serde::Serialize;
use std::f64::consts::TAU;

/// Part of the run's steps that all trials together take. Less than a tenth: each trial builds its world and
/// solves a first step without impulses of a step before, which later steps of a run have; the first steps
/// of a scene that settles cost more than most.
const SHARE: f64 = 0.05;
/// The same for a run of so few steps that the coarsest trial has only one.
const MOST_SHARE: f64 = 0.07;
/// Steps of the three trials for one step of the coarsest: 1 + 2 + 4.
const TRIALS: f64 = 7.0;
/// Why no accuracy is stated.
const AT_REST: &str = "the scene is at rest at the end of the trial, and nothing moves any more";
const SHORT: &str = "the run has too few steps for trials with shorter ones in a tenth of it";
const NO_ORDER: &str =
    "three trials with shorter and shorter steps do not converge: impacts or chaos";
const FREE: &str = "no contact in the trial, and no joint: free flight is exact, what follows a landing is not \
                    known";
const UNSOLVED: &str =
    "the trial leaves contact problems unsolved: their error is not one of the step";
/// Most steps of the coarsest trial.
const MOST_STEPS: usize = 500;
/// Accuracies for which a step is stated.
const ACCURACIES: [f64; 3] = [1e-2, 1e-3, 1e-4];
/// Steps from which a time scale says nothing any more.
const LONG: f64 = 1e5;
/// A step that could be longer by this factor is said to be finer than it need be.
const FINE: f64 = 10.0;
/// Tolerance over the error of the step, below which digits are solved for that the step does not have; not
/// said of the default.
const DIGITS: f64 = 1e-5;
const DEFAULT_TOLERANCE: f64 = 1e-8;
/// Angle \[rad\] that a body may turn in a step for the second order of joints and faces.
const TURN: f64 = 0.3;

/// What the program makes of a scene. All figures of the trial are those of its first part alone: what
/// happens later, such as a landing, is not in them.
#[derive(Debug, Clone, Serialize)]
pub struct Explanation {
    pub scene: String,
    /// The model on which it is built: `rapier`, `planar` or `linear`.
    pub model: &'static str,
    /// Free coordinates: three for each dynamic body, or those of a mechanism, less those that the joints
    /// take.
    pub degrees_of_freedom: usize,
    pub dynamic_bodies: usize,
    /// Bodies without unknowns.
    pub fixed_bodies: usize,
    pub kinematic_bodies: usize,
    pub joints: usize,
    pub joint_rows: usize,
    /// Fewer than rows where joints repeat each other.
    pub coordinates_taken: usize,
    pub scheme: &'static str,
    pub solver: String,
    pub trial: Trial,
    pub left_out: Vec<LeftOut>,
    pub time_scales: Vec<TimeScale>,
    /// Empty where it is not known, for the reason that follows.
    pub accuracy: Vec<Expected>,
    pub accuracy_unknown: Option<&'static str>,
    /// Steps that would hold an accuracy over the trial; empty where it is not known or where any step does.
    pub steps_for: Vec<StepFor>,
    /// How to have an accuracy held.
    pub to_choose: String,
    pub warnings: Vec<String>,
}

/// What is not computed, and why it may be left out.
#[derive(Debug, Clone, Serialize)]
pub struct LeftOut {
    pub what: String,
    pub why: &'static str,
    /// The key that brings it back, if there is one.
    pub key: Option<&'static str>,
}

/// A time of the scene against its step.
#[derive(Debug, Clone, Serialize)]
pub struct TimeScale {
    pub what: String,
    pub period_s: f64,
    pub steps: f64,
}

/// Expected error at the end of the trial, by doubling the steps twice.
#[derive(Debug, Clone, Serialize)]
pub struct Expected {
    pub measure: &'static str,
    pub unit: &'static str,
    /// With the scene's step, and with half of it.
    pub error: f64,
    pub error_of_half: f64,
    /// Observed order of convergence.
    pub order: f64,
    /// Sweeps and factorisations with half the step, over those with the step; NaN without any.
    pub cost_of_half: f64,
}

/// The step that would hold an accuracy over the trial, of the scene's scheme.
#[derive(Debug, Clone, Serialize)]
pub struct StepFor {
    /// Error of position over the largest way of a body in the trial and its size.
    pub accuracy: f64,
    /// \[s\], at most that of the scene.
    pub dt_s: f64,
}

/// Explains `scene` by trials of its start, with its step, half and a quarter of it, less than a tenth of the
/// steps of a run in all. A trial that has come to rest ends there. A run of too few steps has one trial, and so has one
/// whose contact problems are not all solved: what is left of them hides the error of the step.
///
/// # Errors
/// [`RunError`] if the scene cannot be built or a step fails.
pub fn explain(scene: &Scene) -> Result<Explanation, RunError> {
    let run_steps = step_count(&scene.step);
    let most = (SHARE * run_steps as f64 / TRIALS) as usize;
    let most = most.clamp(1, MOST_STEPS).min(run_steps.max(1));
    let first = tried(scene, 1, most, run_steps)?;
    let steps = first.trial.steps;
    let (accuracy, unknown) = if first.at_rest {
        (Vec::new(), Some(AT_REST))
    } else if is_free(scene, &first) {
        (Vec::new(), Some(FREE))
    } else if TRIALS > MOST_SHARE * run_steps as f64 {
        (Vec::new(), Some(SHORT))
    } else if first.trial.unsolved_islands > 0 {
        (Vec::new(), Some(UNSOLVED))
    } else {
        let half = tried(scene, 2, steps, run_steps)?;
        let quarter = tried(scene, 4, steps, run_steps)?;
        let found = accuracy(&first, &half, &quarter);
        let none = found.is_empty().then_some(NO_ORDER);
        (found, none)
    };
    let count = |kind| scene.bodies.iter().filter(|b| b.kind == kind).count();
    let dynamic = count(BodyKind::Dynamic);
    let rows: usize = scene.joints.iter().map(|joint| rows(joint.kind)).sum();
    let taken = coordinates_taken(&scene.bodies, &scene.joints);
    let coordinates = match &scene.linear {
        Some(linear) => linear.coordinates.len(),
        None => 3 * dynamic,
    };
    Ok(Explanation {
        scene: scene.name.clone(),
        model: scene.model().word(),
        degrees_of_freedom: coordinates.saturating_sub(taken),
        dynamic_bodies: dynamic,
        fixed_bodies: count(BodyKind::Fixed),
        kinematic_bodies: count(BodyKind::Kinematic),
        joints: scene.joints.len(),
        joint_rows: rows,
        coordinates_taken: taken,
        scheme: scene.step.scheme.name(),
        solver: scene.step.solver.clone(),
        left_out: left_out(scene, &first),
        time_scales: time_scales(scene, &first),
        steps_for: steps_for(scene.step.dt, first.way, &accuracy),
        warnings: warnings(scene, &first, &accuracy),
        accuracy,
        accuracy_unknown: unknown,
        to_choose: to_choose(&scene.name),
        trial: first.trial,
    })
}

/// The longest step up to `dt` with `2 e (Δt/dt)^p ≤ R L` for the error e and order p of position and the way L, the rule
/// of [`choose`](super::choose) over the trial alone.
fn steps_for(dt: f64, way: f64, accuracy: &[Expected]) -> Vec<StepFor> {
    let position = accuracy.iter().find(|a| a.measure == "position");
    let of = |found: &Expected| {
        ACCURACIES.map(|accuracy| {
            let share = (accuracy * way / (2.0 * found.error)).powf(1.0 / found.order);
            // longer steps were not tried
            let dt_s = dt * share.min(1.0);
            StepFor { accuracy, dt_s }
        })
    };
    let found = position.filter(|a| a.error > 0.0);
    found.map_or(Vec::new(), |found| of(found).into())
}

/// The command that chooses a setting for an accuracy.
fn to_choose(scene: &str) -> String {
    format!(
        "`moreau2d run {scene} --accuracy 1e-3` chooses scheme, events and step over the whole run and holds the \
         run to them; its trials take at least some five times the steps of a run, too many for a tenth"
    )
}

fn left_out(scene: &Scene, tried: &Tried) -> Vec<LeftOut> {
    let mut out = Vec::new();
    let mut add = |what: String, why, key| out.push(LeftOut { what, why, key });
    let still = |b: &&crate::scene::Body| b.kind != BodyKind::Dynamic;
    let given = scene.bodies.iter().filter(still).count();
    if given > 0 {
        add(
            format!("velocities of {given} fixed or kinematic bodies"),
            "their motion is given: they have no unknowns",
            Some("body.kind"),
        );
    }
    if tried.totals.resting > 0 {
        add(
            format!(
                "{} of {} solves of islands",
                tried.totals.resting, tried.islands
            ),
            "at rest with nothing changed since their last solve: they keep its impulses",
            Some("step.keep_rest"),
        );
    }
    if tried.trial.most_islands > 1 {
        add(
            format!("the coupling of {} islands", tried.trial.most_islands),
            "no contact or joint connects them: each is solved by itself",
            Some("step.split_islands"),
        );
    }
    if tried.solved < tried.rows {
        add(
            format!("{} of {} rows", tried.rows - tried.solved, tried.rows),
            "contacts that the others do not close have no impulse, nor has a row without friction",
            Some("step.skip_distant, step.skip_tangents"),
        );
    }
    let kept = scene.bodies.iter().filter(|b| b.touches.is_some()).count();
    if kept > 0 {
        add(
            format!("contacts of {kept} bodies with some others"),
            "the scene excludes them",
            Some("body.touches"),
        );
    }
    let tied = scene.joints.iter().filter(|j| !j.contacts).count();
    if tied > 0 {
        add(
            match tied {
                1 => "contacts between the bodies of a joint".to_owned(),
                _ => format!("contacts between the bodies of {tied} joints"),
            },
            "bodies that a joint connects do not touch unless they are told to",
            Some("joint.contacts"),
        );
    }
    if !scene.step.events {
        add(
            "instants of impacts within their steps".to_owned(),
            "an impact counts from the step that notices it, up to a step late, but for impacts that would leave \
             a few bodies overlapped",
            Some("step.events"),
        );
    }
    out
}

fn time_scales(scene: &Scene, tried: &Tried) -> Vec<TimeScale> {
    let mut scales = Vec::new();
    let dt = scene.step.dt;
    let mut add = |what: String, period_s: f64| {
        if period_s < LONG * dt {
            scales.push(TimeScale {
                what,
                period_s,
                steps: period_s / dt,
            });
        }
    };
    if let Some(body) = scene
        .bodies
        .get(tried.turning)
        .filter(|_| tried.fastest_turn > 0.0)
    {
        add(
            format!("a turn of {}, the fastest in the trial", body.name),
            TAU / tried.fastest_turn,
        );
    }
    for spring in scene.joints.iter().filter(|j| j.kind == JointKind::Spring) {
        let mass = |k: usize| scene.bodies[k].mass_and_inertia().map(|m| m.0);
        let inverse: f64 = (spring.bodies.iter().flatten())
            .filter_map(|k| mass(*k))
            .map(|m| 1.0 / m)
            .sum();
        add(
            "a period of a spring".to_owned(),
            TAU / (spring.spring[0] * inverse).sqrt(),
        );
    }
    if let Some(gap) = tried.trial.least_gap_m.filter(|_| tried.fastest > 0.0) {
        add(
            format!("to cross the smallest gap, {gap:.1e} m, at the largest speed"),
            gap / tried.fastest,
        );
    }
    if tried.trial.impacts > 0 {
        let moving = scene.bodies.iter().filter(|b| b.kind == BodyKind::Dynamic);
        // two bodies meet in an impact
        let each = 2.0 * tried.trial.impacts as f64 / moving.count().max(1) as f64;
        add(
            "the mean time between two impacts of a body".to_owned(),
            tried.trial.time_s / each,
        );
    }
    scales.sort_by(|a, b| a.period_s.total_cmp(&b.period_s));
    scales.truncate(5);
    scales
}

/// Errors by the differences of three trials: `e ≈ d₁/(1 − 2^−p)` with `p = log₂(d₁/d₂)` between 0.5
/// and 4. Differences below round-off have no order; they are an error of 0.
fn accuracy(first: &Tried, half: &Tried, quarter: &Tried) -> Vec<Expected> {
    let far = |a: &Tried, b: &Tried| {
        let pairs = a.places.iter().zip(&b.places);
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let size = (first.places.iter()).map(|p| p.norm()).fold(1e-3, f64::max);
    let energy = |a: &Tried, b: &Tried| (a.totals.energy_end - b.totals.energy_end).abs();
    let work = |t: &Tried| (t.trial.sweeps + t.trial.factorisations) as f64;
    let measures = [
        ("position", "m", far(first, half), far(half, quarter), size),
        (
            "energy",
            "J",
            energy(first, half),
            energy(half, quarter),
            first.totals.kinetic_most.abs() + first.totals.energy_end.abs(),
        ),
    ];
    let cost = work(half) / work(first);
    let one = |(measure, unit, d1, d2, size)| expected([measure, unit], [d1, d2], size, cost);
    measures.into_iter().filter_map(one).collect()
}

/// The error of a measure of this `size` from the differences of three trials; `None` where they do not
/// shrink.
fn expected(
    [measure, unit]: [&'static str; 2],
    [d1, d2]: [f64; 2],
    size: f64,
    cost_of_half: f64,
) -> Option<Expected> {
    let (error, order) = match d1 <= 1e-12 * size {
        true => (0.0, f64::NAN),
        // impacts, or chaos
        false if d2 >= 0.8 * d1 => return None,
        false => {
            let order = (d1 / d2).log2().clamp(0.5, 4.0);
            (d1 / (1.0 - (-order).exp2()), order)
        }
    };
    Some(Expected {
        measure,
        unit,
        error,
        error_of_half: match error > 0.0 {
            true => error * (-order).exp2(),
            false => 0.0,
        },
        order,
        cost_of_half,
    })
}

fn warnings(scene: &Scene, tried: &Tried, accuracy: &[Expected]) -> Vec<String> {
    let mut out = scene.step_warnings();
    out.extend(scene.side_warnings());
    out.extend(scene.start_warnings());
    let dt = scene.step.dt;
    let position = accuracy.iter().find(|a| a.measure == "position");
    if let Some(found) = position.filter(|a| a.error > 0.0 && tried.way > 0.0) {
        let finest = ACCURACIES[ACCURACIES.len() - 1];
        let longer = (finest * tried.way / (2.0 * found.error)).powf(1.0 / found.order);
        if longer > FINE {
            out.push(format!(
                "the step is finer than an accuracy of {finest:e} needs: by this trial step.dt = {:.1e} would do",
                longer * dt
            ));
        }
        let share = found.error / tried.way;
        if scene.step.tolerance < DIGITS * share.min(DEFAULT_TOLERANCE / DIGITS) {
            out.push(format!(
                "step.tolerance = {:e} asks for digits that the step does not have: its error is {share:.0e} of \
                 the way; {DEFAULT_TOLERANCE:e} would do",
                scene.step.tolerance
            ));
        }
    }
    let turn = tried.fastest_turn * dt;
    if turn > TURN && !scene.joints.is_empty() {
        out.push(format!(
            "{} turns {turn:.2} rad in a step: joints keep their order below {TURN} rad; step.dt = {:.2e} \
             would do",
            scene.bodies[tried.turning].name,
            TURN / tried.fastest_turn
        ));
    }
    if tried.trial.impacts > 0 && !scene.step.events {
        let restitution = scene.materials.iter().any(|m| m.restitution > 0.0);
        if restitution {
            out.push(
                "bodies rebound, and each impact is noticed up to a step late: step.events = true locates it"
                    .to_owned(),
            );
        }
    }
    if tried.trial.unsolved_islands > 0 {
        let other = match scene.step.solver.as_str() {
            "auto" => "",
            _ => "step.solver = \"auto\", ",
        };
        out.push(format!(
            "{} islands of the trial are unsolved: {other}a looser step.tolerance or a shorter step.dt",
            tried.trial.unsolved_islands
        ));
    }
    if is_free(scene, tried) {
        out.push(format!(
            "no contact in the trial, the first {:.3} s: what is said here holds before the first landing \
             (fastest body {:.3} m/s)",
            tried.trial.time_s, tried.fastest
        ));
    }
    out
}
