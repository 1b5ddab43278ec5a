//! Every scene of the catalogue steps, stays finite, and makes no energy.

mod common;

use common::load;
use moreau2d::contact::{NO_BODY, Vec2};
use moreau2d::dynamics::record::StepRecord;
use moreau2d::experiment::Engine;
use moreau2d::scene::{self, BodyKind, Built, Scene};

/// Scenes of bodies, and how many steps show what they are about: 50, and for the drum 200, after
/// which its grains lie on it.
fn scenes_of_bodies() -> Vec<(Scene, usize)> {
    scene::scenes()
        .unwrap()
        .iter()
        .map(|listing| load(listing.name, &[]))
        .filter(|scene| !scene.bodies.is_empty())
        .map(|scene| {
            let steps = if scene.name == "drum" { 200 } else { 50 };
            (scene, steps)
        })
        .collect()
}

/// Where every body is and how fast, by the numbers of the record.
fn kinematic(scene: &Scene, built: &Built) -> Vec<(u32, Vec2, Vec2, f64)> {
    scene
        .bodies
        .iter()
        .zip(&built.bodies)
        .filter(|(body, _)| body.kind == BodyKind::Kinematic)
        .map(|(_, &id)| {
            let s = &built.simulation;
            let u = s.velocity(id).unwrap();
            (
                s.number(id).unwrap(),
                s.pose(id).unwrap().translation,
                u.xy(),
                u.z,
            )
        })
        .collect()
}

/// What bodies that move on their own and belts gave to the others \[J\]: impulse times the
/// velocity of their surface at the contact point of the midpoint.
fn driven(record: &StepRecord, movers: &[(u32, Vec2, Vec2, f64)]) -> f64 {
    let mut work = 0.0;
    for contact in &record.contacts {
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            assert!(contact.bodies[side] != NO_BODY || side == 0);
            let mover = movers.iter().find(|m| m.0 == contact.bodies[side]);
            if let Some((_, place, velocity, spin)) = mover {
                let arm = contact.position - (place + velocity * (0.5 * record.dt));
                let v = velocity + Vec2::new(-arm.y, arm.x) * *spin;
                let tangent = Vec2::new(-contact.normal.y, contact.normal.x);
                let p = contact.normal * contact.impulse_n + tangent * contact.impulse_t;
                work += sign * p.dot(&v);
            }
        }
    }
    work
}

#[test]
fn every_scene_steps_stays_finite_and_makes_no_energy() {
    for (scene, steps) in scenes_of_bodies() {
        let mut built = scene.build().unwrap();
        let mut total: Option<f64> = None;
        let mut met = 0;
        let mut worst: f64 = 0.0;
        for step in 0..steps {
            let movers = kinematic(&scene, &built);
            let record = Engine::Moreau.step(&mut built).unwrap();
            let what = format!("{} step {step}", scene.name);
            met += record.contacts.len();
            assert_finite(&what, &built, &record);
            assert_eq!(record.unsolved, 0, "{what}: {}", record.residual);

            let energy = record.energy;
            let now = energy.kinetic_end + energy.potential_end;
            // the potential at the start of the first step: forces are constant here
            let start = energy.kinetic_start + energy.potential_end + energy.forces;
            let rise = now - total.unwrap_or(start) - energy.motors - driven(&record, &movers);
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
            let slack = 10.0 * worst * pushed + 1e-12 * scale + 1e-15;
            assert!(rise <= slack, "{what}: {rise} J, slack {slack}");
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
    for &body in &built.bodies {
        let pose = built.simulation.pose(body).unwrap();
        let u = built.simulation.velocity(body).unwrap();
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
    for (name, steps) in [("pyramid", 50), ("tower", 50), ("beam", 50)] {
        let scene = load(name, &[]);
        let run = common::run_steps(&scene, steps);
        for (body, &id) in scene.bodies.iter().zip(&run.built.bodies) {
            let place = run.built.simulation.pose(id).unwrap().translation;
            let moved = (place - Vec2::from(body.position)).norm();
            // certified to 1e-8 of the velocities, g Δt of 0.16 m/s in each of 50 steps of 1/60 s
            assert!(moved < 1e-7, "{name}: {} moved {moved} m", body.name);
        }
    }
}
