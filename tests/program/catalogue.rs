//! Every scene of the catalogue steps, stays finite, and makes no energy.

use crate::common::movers::{between, driven, movers};
use crate::common::{load, small};
use moreau2d::contact::Vec2;
use moreau2d::dynamics::record::{ContactRecord, StepRecord};
use moreau2d::experiment::Engine;
use moreau2d::scene::{self, Body, Built, Model, Scene, Shape};
use moreau2d::thresher;
use std::collections::HashMap;

/// Scenes of bodies, and how many steps show what they are about: 50 or all there are, and for the
/// drum 200, the platforms and the drum of boxes 120, after which grains and boxes lie on them.
fn scenes_of_bodies() -> Vec<(Scene, usize)> {
    scene::scenes()
        .unwrap()
        .iter()
        .filter(|listing| thresher::load(listing.name, &[]).unwrap().1.is_none())
        .map(|listing| load(listing.name, small(listing.name)))
        .map(|scene| {
            let whole = (scene.step.time / scene.step.dt).round() as usize;
            let steps = match scene.name.as_str() {
                "drum" => 200,
                "one-way-platforms" | "drum-of-boxes" => 120,
                _ => 50.min(whole),
            };
            (scene, steps)
        })
        .collect()
}

/// Scenes with steps that no solver here certifies, how many, and the relative residual they stay below.
/// Islands of box-drum and tumbler hold thousands of contacts that contradict each other, that of
/// drum-of-boxes hundreds where its square of boxes lands; in card-house and high-mass-ratio-1 the
/// velocity misses its bound by a factor of two. The drum of boxes is chaos: over 160 step lengths it has two such
/// steps in the mean and 17 at most, with residuals up to 1.3e-2. Here is one draw, bounded by what draws give;
/// `chaotic_scenes_cost_no_more_in_the_mean` bounds the mean, and
/// `the_exact_effort_certifies_a_drum_that_the_fast_one_does_not` each draw of the exact effort.
const HARD: [(&str, usize, f64); 5] = [
    ("box-drum", 40, 2e-2),
    ("card-house", 5, 1e-9),
    ("drum-of-boxes", 24, 1.2e-2),
    ("high-mass-ratio-1", 5, 1e-9),
    ("tumbler", 5, 1e-5),
];

/// Place \[m\] and spin [rad/s] of every body with corners, by the numbers of the record.
fn spins(scene: &Scene, built: &Built) -> HashMap<u32, (Vec2, f64)> {
    let cornered = |body: &Body| !matches!(body.shape, Shape::Disc { .. });
    let bodies = scene.bodies.iter().enumerate();
    bodies
        .filter(|(_, body)| cornered(body))
        .map(|(k, _)| {
            let (pose, u) = built.state(k).unwrap();
            (built.number(k).unwrap(), (pose.translation, u.z))
        })
        .collect()
}

/// What a turn about a corner may exchange \[J\]. From the middle of one step to that of the next the
/// corner of a body that turns at ω leaves its pivot by r ω² Δt²/2 towards the arm r, and the
/// contact takes it back a step later: the mean of both velocities is off by up to r ω Δω Δt,
/// which the impulse works on. It is the scheme's error of second order. (A disc has no corner.)
fn turning(
    record: &StepRecord,
    before: &HashMap<u32, (Vec2, f64)>,
    after: &HashMap<u32, (Vec2, f64)>,
) -> f64 {
    let one = |c: &ContactRecord| -> f64 {
        let tangent = Vec2::new(-c.normal.y, c.normal.x);
        let side = |body: &u32| {
            let (Some((_, start)), Some((place, end))) = (before.get(body), after.get(body)) else {
                return 0.0;
            };
            let arm = c.position - place;
            let moment = c.impulse_n * arm.dot(&c.normal).abs()
                + c.impulse_t.abs() * arm.dot(&tangent).abs();
            moment * start.abs().max(end.abs()) * (end - start).abs()
        };
        record.dt * c.bodies.iter().map(side).sum::<f64>()
    };
    record.contacts.iter().map(one).sum()
}

#[test]
fn every_scene_steps_stays_finite_and_makes_no_energy() {
    for (scene, steps) in scenes_of_bodies() {
        let mut built = scene.build().unwrap();
        let mut total: Option<f64> = None;
        let (mut met, mut uncertified) = (0, 0);
        let mut worst: f64 = 0.0;
        let (mut gained, mut most): (f64, f64) = (0.0, 0.0);
        for step in 0..steps {
            let moved = movers(&scene, &built, Engine::Moreau);
            let before = spins(&scene, &built);
            let record = Engine::Moreau.step(&mut built).unwrap();
            let movers = between(moved, movers(&scene, &built, Engine::Moreau));
            let what = format!("{} step {step}", scene.name);
            met += record.contacts.len();
            assert_finite(&what, &built, &record);
            uncertified += usize::from(record.unsolved > 0);
            let hard = HARD.iter().find(|(name, ..)| *name == scene.name);
            let (allowed, left) = hard.map_or((0, 0.0), |(_, steps, left)| (*steps, *left));
            assert!(
                record.unsolved == 0 || uncertified <= allowed && record.residual < left,
                "{what}: {}, {uncertified} such steps",
                record.residual
            );

            let energy = record.energy;
            let now = energy.kinetic_end + energy.potential_end;
            // the potential at the start of the first step: forces are constant here
            let start =
                energy.kinetic_start + energy.potential_end + energy.forces - energy.recovery;
            // pins turn at the end of their arms too: their exchange has closed forms of its own
            let given = energy.motors + energy.joints + energy.returned + driven(&record, &movers);
            let recovering = record.recovering > 0;
            let rise = now - total.unwrap_or(start) - given - energy.recovery;
            // what the solves left open: the judge's velocity on all impulses, a few rows a block.
            // The worst so far, not this step's: an opening that one solve leaves is closed by a
            // later one (the rise of a tower of ten falls with the tolerance, a hundredfold each
            // two decades, but comes a step or more after the larger residual)
            worst = worst.max(record.residual_velocity);
            let pushed: f64 = record
                .contacts
                .iter()
                .map(|c| c.impulse_n + c.impulse_t.abs())
                .sum();
            let scale = energy.kinetic_start + energy.kinetic_end + energy.forces.abs();
            let turned = turning(&record, &before, &spins(&scene, &built));
            // moving apart turns bodies, and with them the rows, by overlap over size: 17 mm of 4 m
            let moved = if recovering { 5e-3 * scale } else { 0.0 };
            // a rounding of the potentials of a few hundred bodies, which differ by little
            let rounded = 1e-14 * energy.potential_end.abs();
            let slack = 10.0 * worst * pushed + turned + moved + rounded + 1e-12 * scale + 1e-15;
            if scene.model() == Model::Planar {
                // a contact or pin that turns within the step closes its gap at g/dt, which does
                // work of second order, bounded over the run: (ω dt)², with ω dt up to 0.05 here
                gained += rise;
                most = most.max(scale);
                assert!(gained <= 2.5e-3 * most, "{what}: {gained} J of {most} J");
            } else {
                assert!(rise <= slack, "{what}: {rise} J, slack {slack}");
            }
            // one rounding of each impulse's work, a few hundred of them
            let imbalance = energy.imbalance().abs();
            assert!(imbalance <= 1e-11 * scale + 1e-15, "{what}: {imbalance}");
            total = Some(now);
        }
        // pendulums meet nothing: they hang on their pins
        let idle = met == 0 && scene.joints.is_empty();
        assert!(!idle, "{}: nothing touched in {steps} steps", scene.name);
    }
}

fn assert_finite(what: &str, built: &Built, record: &StepRecord) {
    assert!(record.penetration.is_finite(), "{what}");
    for k in 0..built.bodies() {
        let (pose, u) = built.state(k).unwrap();
        let finite = pose
            .translation
            .iter()
            .chain(u.iter())
            .all(|x| x.is_finite());
        assert!(
            finite && (pose.cos.hypot(pose.sin) - 1.0).abs() < 1e-12,
            "{what}"
        );
    }
    for c in &record.contacts {
        let good = c.impulse_n >= 0.0 && c.slip.is_finite() && c.load_slip >= 0.0;
        // a normal from parry is a unit in f32
        assert!(
            good && (c.normal.norm() - 1.0).abs() < 1e-6,
            "{what}: {c:?}"
        );
    }
}

#[test]
fn what_should_stand_stands() {
    // certified to 1e-8 of the velocities, g Δt of 0.16 m/s in each of 50 steps of 1/60 s
    let certified = 1e-7;
    // beside a heavy body a thousandth of g Δt may stay open, at ten contacts one on the other
    let heavy = 10.0 * 1e-3 * 9.81 / 60.0 * 50.0 / 60.0;
    for (name, steps, most) in [
        ("pyramid", 50, certified),
        ("tower", 50, certified),
        ("wall", 50, certified),
        ("beam", 50, certified),
        ("heavy-top", 50, heavy),
    ] {
        let scene = load(name, &[]);
        let run = crate::common::run_steps(&scene, steps);
        for (k, body) in scene.bodies.iter().enumerate() {
            let place = run.state(k).0.translation;
            let moved = (place - Vec2::from(body.position)).norm();
            assert!(moved < most, "{name}: {} moved {moved} m", body.name);
        }
    }
}
