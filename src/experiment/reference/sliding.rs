//! Blocks and discs that slide, stop, roll or ride on a belt, and their wear.
//!
//! `wear` is the sum of `load_slip` over the run: load N times slip s in Archard's law. It is `m g s`
//! for a body on level ground, and 0 if nothing slides.
//!
//! # Source
//! Elementary mechanics with Coulomb's law, as in any text, e.g. Meriam & Kraige, *Dynamics*.

use super::{Measure, Samples, down, find, friction, mass};
use crate::scene::{Scene, Shape};

/// `d = v²/(2 μ g)`, `t = v/(μ g)`.
pub(super) fn sliding_block(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(block)) = (find(scene, "floor"), find(scene, "block")) else {
        return Vec::new();
    };
    let mu = friction(scene, floor, block);
    let v = scene.bodies[block].velocity[0];
    let g = down(scene);
    let moved = s.last()[block].0.translation.x - scene.bodies[block].position[0];
    let mut out = vec![Measure::relative("distance", moved, v * v / (2.0 * mu * g))];
    if let Some(time) = s.first_stick(mu) {
        out.push(Measure::relative("stop-time", time, v / (mu * g)));
    }
    if let Some(m) = mass(scene, block) {
        out.push(Measure::relative(
            "wear",
            s.load_slip,
            m * v * v / (2.0 * mu),
        ));
    }
    out
}

/// The block slides with `a = g (sin φ − μ cos φ)`, or stays in place if this is not positive.
pub(super) fn incline(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(block)) = (find(scene, "floor"), find(scene, "block")) else {
        return Vec::new();
    };
    let mu = friction(scene, floor, block);
    let (along, across) = (scene.gravity[0], down(scene));
    let time = s.end();
    let (pose, u) = s.last()[block];
    let exact = along - mu * across;
    let wear = mass(scene, block).map(|m| m * across * 0.5 * exact.max(0.0) * time * time);
    if exact > 0.0 {
        let mut out = vec![Measure::relative("acceleration", u.x / time, exact)];
        out.extend(wear.map(|wear| Measure::relative("wear", s.load_slip, wear)));
        out
    } else {
        let creep = pose.translation.x - scene.bodies[block].position[0];
        vec![
            Measure::absolute("creep", "m", creep, 0.0),
            Measure::absolute("wear", "N m", s.load_slip, 0.0),
        ]
    }
}

/// The disc rolls from the time `t = (v + ω R)/(3 μ g)` on, with the speed `(2 v − ω R)/3`. Its
/// place at the end follows from both.
pub(super) fn spinning_disc(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(disc)) = (find(scene, "floor"), find(scene, "disc")) else {
        return Vec::new();
    };
    let Shape::Disc { radius: r } = scene.bodies[disc].shape else {
        return Vec::new();
    };
    let body = &scene.bodies[disc];
    let (mu, g) = (friction(scene, floor, disc), down(scene));
    let (v, w) = (body.velocity[0], body.spin);
    let rolling = (v + w * r) / (3.0 * mu * g);
    let end = s.end();
    let speed = (2.0 * v - w * r) / 3.0;
    let (pose, u) = s.last()[disc];
    let place =
        body.position[0] + v * rolling - 0.5 * mu * g * rolling * rolling + speed * (end - rolling);
    let mut out = Vec::new();
    if let Some(time) = s.first_stick(mu) {
        out.push(Measure::relative("rolling-time", time, rolling));
    }
    if end > rolling {
        out.push(Measure::relative("rolling-speed", u.x, speed));
        out.push(Measure::relative(
            "distance",
            pose.translation.x - body.position[0],
            place - body.position[0],
        ));
        if let Some(m) = mass(scene, disc) {
            let wear = m * (v + w * r).powi(2) / (6.0 * mu);
            out.push(Measure::relative("wear", s.load_slip, wear));
        }
    }
    out
}

/// A block dropped on a belt of speed v reaches the speed of the belt after `t = v/(μ g)`.
pub(super) fn conveyor(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(belt), Some(block)) = (find(scene, "belt"), find(scene, "block")) else {
        return Vec::new();
    };
    let mu = friction(scene, belt, block);
    // the top of the belt runs towards −x where its speed is positive
    let v = -scene.bodies[belt].surface_velocity;
    let catch = v.abs() / (mu * down(scene));
    let mut out = Vec::new();
    if let Some(time) = s.first_stick(mu) {
        out.push(Measure::relative("catch-time", time, catch));
    }
    if s.end() > catch {
        out.push(Measure::relative("speed", s.last()[block].1.x, v));
        if let Some(m) = mass(scene, block) {
            out.push(Measure::relative(
                "wear",
                s.load_slip,
                m * v * v / (2.0 * mu),
            ));
        }
    }
    out
}
