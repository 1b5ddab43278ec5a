//! Motion about a corner or a pin.

use crate::common::{LADDER, load, order, rms, run};

/// Errors of `measure` at every step length, rms over twelve `flags`: where in its step something
/// happens makes single runs scatter.
pub fn ladder(scene: &str, measure: &str, flags: impl Fn(usize) -> Vec<String>) -> [f64; 6] {
    LADDER.map(|dt| {
        rms((0..12).map(|k| {
            let mut all = flags(k);
            all.push(format!("step.dt={dt}"));
            let all: Vec<&str> = all.iter().map(String::as_str).collect();
            run(&load(scene, &all)).error(measure)
        }))
    })
}

#[test]
fn pendulums_keep_time_and_energy() {
    for scene in ["pendulum", "double-pendulum"] {
        let run = run(&load(scene, &[]));
        let error = run.error("position");
        assert!(error <= 8e-3, "{scene}: {error}");
        let drift = run.error("energy-drift");
        assert!(drift <= 8e-3, "{scene}: {drift}");
    }
    assert!(run(&load("pendulum", &[])).error("period") <= 8e-3);
}

/// Pins that foresee half of the turn of a step do work of third order only.
///
/// Anchors are `f32` in rapier: 6e-8 of the arm, below what the finest step leaves (3e-6).
#[test]
fn pendulums_converge_at_order_two_and_keep_energy_at_order_three() {
    for (scene, measures) in [
        (
            "pendulum",
            &[("position", 2.0), ("energy-drift", 3.0), ("period", 2.0)][..],
        ),
        (
            "double-pendulum",
            &[("position", 2.0), ("energy-drift", 3.0)],
        ),
    ] {
        for &(measure, expected) in measures {
            let errors = LADDER.map(|dt| {
                // whole steps fill five seconds: the last one is not cut
                let steps = (5.0 / dt).round();
                let dt = format!("step.dt={:?}", 5.0 / steps);
                run(&load(scene, &[&dt])).error(measure)
            });
            let p = order(&errors);
            assert!(
                (p - expected).abs() < 0.2,
                "{scene} {measure}, order {p}: {errors:?}"
            );
        }
    }
}

/// A block tilted by `angle` about its left foot.
pub fn tilted(angle: f64) -> Vec<String> {
    let (sin, cos) = angle.sin_cos();
    let [x, y] = [-0.1 + 0.1 * cos - 0.5 * sin, 0.1 * sin + 0.5 * cos];
    vec![
        format!("body.block.angle={angle:?}"),
        format!("body.block.position=[{x:?}, {y:?}]"),
    ]
}

/// Without events a landing is noticed up to a step late and spreads over two: first order, and a
/// third off at 1/60 s. The landing's time is better, as its error is a part of a step only where
/// the block slows down.
#[test]
fn a_rocking_block_converges_at_order_one() {
    for (measure, most) in [
        ("landing-time", 2.0),
        ("rate-kept", 1.3),
        ("first-peak", 1.3),
    ] {
        let errors = ladder("rocking-block", measure, |k| {
            tilted(0.08 + 0.003 * k as f64)
        });
        let p = order(&errors);
        assert!(p > 0.8 && p < most, "{measure}, order {p}: {errors:?}");
    }
}
