//! Impacts: bounces without end, bodies that cross a wall in a step, bodies that start in each other.

use super::trace::{Moment, Trace};
use super::verdict::{Check, RELATIVE};
use super::{FLOOR, Rung, catalogue, drafted, material, step};
use crate::experiment::RunError;

const WEIGHTLESS: &str = "[gravity]\ny = 0\n";

/// Speed at which the ball counts as at rest [m/s]: from there on it would bounce for another
/// `2 v/(g (1 − e))`, below 3e-3 of all.
const REST: f64 = 1e-2;

/// When the ball has last been faster than that \[s\]; NaN if it still is.
fn rest(t: &Trace) -> f64 {
    let ball = t.body("ball");
    let moves = |m: &Moment| m.states[ball].1.y.abs() > REST;
    let last = t.history.iter().rposition(moves);
    last.and_then(|k| t.history.get(k + 1))
        .map_or(f64::NAN, |m| m.time)
}

/// A ball bounces ever lower, at rest at `√(2h/g) (1+e)/(1−e)`, 4 % being what a step that bounces
/// no sooner than at its end can do.
pub(super) fn zeno_ball() -> Result<Vec<Rung>, RunError> {
    let rung = |e: f64| {
        let exact = (2.0 / 9.81_f64).sqrt() * (1.0 + e) / (1.0 - e);
        let flags = [
            format!("material.bouncy.restitution={e:?}"),
            format!("step.time={:?}", 1.2 * exact + 2.0),
        ];
        let judge = move |t: &Trace| {
            let off = (rest(t) / exact - 1.0).abs();
            let mode = if off.is_nan() { "never" } else { "wrong-time" };
            vec![Check::new("rest-time", off, RELATIVE, 0.04, mode)]
        };
        Ok(Rung::new(
            format!("e {e}"),
            catalogue("bouncing-ball", &flags)?,
            "rests",
            judge,
        )
        .quick())
    };
    [0.5, 0.7, 0.9, 0.95, 0.99].map(rung).into_iter().collect()
}

/// Of no limit: only stated.
const STATED: f64 = f64::INFINITY;

/// Bullets at a wall of 1 cm, bars that spin over a floor.
pub(super) fn bullet() -> Result<Vec<Rung>, RunError> {
    let mut rungs = Vec::new();
    for (shape, name) in [("disc = 0.05", "disc"), ("box = [0.1, 0.1]", "box")] {
        for speed in [20.0, 100.0, 300.0] {
            let text = format!(
                "{}{}{WEIGHTLESS}[[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [0.01, 8]\n\
                 position = [10, 0]\n[[body]]\nname = \"bullet\"\n{shape}\nvelocity = [{speed:?}, 0]\n",
                step(1.0 / 60.0, 1.0),
                material(0.5, 0.0)
            );
            let judge = |t: &Trace| {
                let bullet = t.body("bullet");
                let farthest = t.most(&[bullet], |_, s| s.0.translation.x);
                let [_, end] = t.ends(bullet);
                vec![
                    Check::new("beyond", farthest - 10.0, "m", 0.0, "tunnels"),
                    // it came to the wall
                    Check::new("short", 9.9 - end.translation.x, "m", 0.0, "stops-short"),
                    Check::new("penetration", t.totals.penetration, "m", STATED, ""),
                ]
            };
            let scene = drafted("bullet", &text)?;
            rungs.push(Rung::new(format!("{name}, {speed} m/s"), scene, "stops", judge).quick());
        }
    }
    for spin in [30.0, 300.0] {
        let text = format!(
            "{}{}{FLOOR}[[body]]\nname = \"bar\"\nbox = [1, 0.05]\nposition = [0, 0.7]\n\
             spin = {spin:?}\n",
            step(1.0 / 60.0, 3.0),
            material(0.5, 0.0)
        );
        let judge = |t: &Trace| {
            let bar = t.body("bar");
            let below = t.most(&[bar], |_, s| -s.0.translation.y);
            let rise = t.totals.energy_rise / t.totals.energy_start;
            vec![
                Check::new("below", below, "m", 0.0, "tunnels"),
                Check::new("energy-rise", rise, "of the start", 1e-3, "gains-energy"),
                Check::new("penetration", t.totals.penetration, "m", STATED, ""),
            ]
        };
        let scene = drafted("fast-spin", &text)?;
        rungs.push(Rung::new(format!("spin {spin} rad/s"), scene, "stays above", judge).quick());
    }
    Ok(rungs)
}

/// The most kinetic energy that a push-out may give, over that of a fall through the body's size.
const LAUNCH: f64 = 1e-3;

/// How far apart at rest counts as apart \[m\].
const APART: f64 = 1e-3;

/// Recovers, or says that it cannot, and is not launched.
pub(super) fn initial_overlap() -> Result<Vec<Rung>, RunError> {
    // a box of 1 m and 1000 kg
    let quiet = |t: &Trace| {
        let energy = t.totals.kinetic_most / (1000.0 * 9.81);
        Check::new("kinetic-energy", energy, "of m g 1 m", LAUNCH, "launches")
    };
    let mut rungs = Vec::new();
    for (depth, name) in [(1e-3, "1 mm"), (1e-2, "10 mm"), (0.5, "half a body")] {
        let text = format!(
            "{}{FLOOR}[[body]]\nname = \"box\"\nbox = [1, 1]\nposition = [0, {:?}]\n",
            step(1.0 / 60.0, 10.0),
            0.5 - depth
        );
        let judge = move |t: &Trace| {
            let k = t.body("box");
            let off = (t.ends(k)[1].translation.y - 0.5).abs();
            let high = t.most(&[k], |_, s| s.0.translation.y - 0.5);
            let left = if t.totals.recovering > 0 { 0.0 } else { off };
            vec![
                quiet(t),
                Check::new("jump", high, "m", APART, "launches"),
                Check::new("overlap-left", left, "m", APART, "stuck"),
            ]
        };
        rungs.push(Rung::new(name, drafted("initial-overlap", &text)?, "recovers", judge).quick());
    }
    let text = format!(
        "{}{WEIGHTLESS}[[body]]\nname = \"a\"\nbox = [1, 1]\n[[body]]\nname = \"b\"\nbox = [1, 1]\n\
         position = [0.5, 0]\n",
        step(1.0 / 60.0, 10.0)
    );
    let judge = move |t: &Trace| {
        let [a, b] = ["a", "b"].map(|n| t.ends(t.body(n))[1].translation);
        let left = if t.totals.recovering > 0 {
            0.0
        } else {
            1.0 - (b - a).x
        };
        vec![
            quiet(t),
            Check::new("overlap-left", left, "m", APART, "stuck"),
        ]
    };
    let scene = drafted("initial-overlap", &text)?;
    rungs.push(Rung::new("two, half a body", scene, "recovers", judge).quick());
    let text = format!(
        "{}{FLOOR}[[body]]\nname = \"left\"\nkind = \"fixed\"\nbox = [1, 4]\nposition = [-0.95, 1]\n\
         [[body]]\nname = \"right\"\nkind = \"fixed\"\nbox = [1, 4]\nposition = [0.95, 1]\n\
         [[body]]\nname = \"box\"\nbox = [1, 1]\nposition = [0, 1.5]\n",
        step(1.0 / 60.0, 5.0)
    );
    let judge = move |t: &Trace| {
        // 0.1 m too wide for the slot: it stays, and that is said
        let silent = f64::from(u8::from(t.totals.recovering == 0));
        let high = t.most(&[t.body("box")], |_, s| s.0.translation.y - 1.5);
        vec![
            Check::new("jump", high, "m", APART, "launches"),
            Check::new("silent", silent, "yes or no", 0.0, "silent"),
        ]
    };
    let scene = drafted("initial-overlap", &text)?;
    rungs.push(Rung::new("in a slot", scene, "says so", judge).quick());
    Ok(rungs)
}
