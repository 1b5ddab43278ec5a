//! Blocks and discs that slide, stop, roll or are carried along.

use super::{DT, G, MU, ROUND_OFF};
use crate::common::{LADDER, load, order, rms, run};

#[test]
fn a_sliding_block_stops_where_and_when_coulomb_says() {
    let run = run(&load("sliding-block", &[]));
    // the step in which it stops is a straight line where the truth is a parabola
    let gate = (MU * G * DT / (2.0 * 5.0)).powi(2);
    assert!(run.error("distance") <= gate, "{}", run.error("distance"));
    assert!(run.error("stop-time") <= ROUND_OFF);
    assert_eq!(run.totals.unsolved_islands, 0);
    // at rest means at rest: nothing is left to solve for but the solver's tolerance
    assert!(run.state(1).1.norm() < 1e-12);
}

/// Load times slip, all that Archard's law asks of a step. In the step in which sliding ends it is
/// off as the distance is, `4 φ (1 − φ) (a Δt/2v)²` of the whole, φ the share of it that is slid and
/// a the deceleration of the slip; where nothing slides, nothing wears.
#[test]
fn wear_is_load_times_slip() {
    for (scene, slip, deceleration) in [
        ("sliding-block", 5.0, MU * G),
        ("conveyor", 2.0, MU * G),
        ("spinning-disc", 5.0 + 10.0 * 0.5, 3.0 * MU * G),
    ] {
        let scene_run = run(&load(scene, &[]));
        let gate = (deceleration * DT / (2.0 * slip)).powi(2);
        let error = scene_run.error("wear");
        assert!(error <= gate, "{scene}: {error} against {gate}");
    }
    assert!(run(&load("incline", &[])).error("wear") <= 1e-9);
    let held = run(&load("incline", &["slope=0.4995"]));
    assert!(held.error("wear") <= 1e-9, "{} N m", held.error("wear"));
}

#[test]
fn sliding_distance_converges_at_order_two() {
    let errors = LADDER.map(|dt| {
        // the error depends on where in its step the block stops: rms over twelve starts
        rms((0..12).map(|k| {
            let v = 4.5 + k as f64 / 11.0;
            let flags = [
                format!("body.block.velocity=[{v}, 0]"),
                format!("step.dt={dt}"),
            ];
            run(&load("sliding-block", &[&flags[0], &flags[1]])).error("distance")
        }))
    });
    let p = order(&errors);
    // an rms over twelve phases scatters by a tenth
    assert!((p - 2.0).abs() < 0.1, "order {p}: {errors:?}");
}

#[test]
fn friction_work_is_the_kinetic_energy_lost() {
    let run = run(&load("sliding-block", &[]));
    let lost = 0.5 * 1000.0 * 25.0;
    assert!((run.totals.friction_work / lost - 1.0).abs() < ROUND_OFF);
}

#[test]
fn a_block_slides_down_an_incline_a_thousandth_too_steep() {
    let run = run(&load("incline", &[]));
    let error = run.error("acceleration");
    assert!(error <= 1e-9, "{error}");
}

#[test]
fn a_block_holds_ten_seconds_on_an_incline_a_thousandth_too_flat() {
    let run = run(&load("incline", &["slope=0.4995"]));
    assert!((run.totals.time - 10.0).abs() < 1e-9);
    let creep = run.error("creep");
    assert!(creep <= 1e-9, "{creep} m");
}

#[test]
fn a_disc_with_back_spin_rolls_when_and_as_fast_as_it_must() {
    let run = run(&load("spinning-disc", &[]));
    assert!(run.error("rolling-time") <= 1e-9);
    assert!(run.error("rolling-speed") <= 1e-9);
    // the step in which it catches ends at most μ g Δt²/8 off, relative to the 4.466 m it went
    let bound = MU * G * DT * DT / 8.0 / 4.4659;
    let error = run.error("distance");
    assert!(error <= bound, "{error} against {bound}");
}

#[test]
fn distance_of_the_disc_converges_at_order_two() {
    let errors = LADDER.map(|dt| {
        rms((0..12).map(|k| {
            let v = 4.5 + k as f64 / 11.0;
            let flags = [
                format!("body.disc.velocity=[{v}, 0]"),
                format!("step.dt={dt}"),
            ];
            run(&load("spinning-disc", &[&flags[0], &flags[1]])).error("distance")
        }))
    });
    let p = order(&errors);
    assert!((p - 2.0).abs() < 0.1, "order {p}: {errors:?}");
}

/// The catch ends inside a step; what comes before and after is a parabola and a straight line.
#[test]
fn a_block_dropped_on_a_belt_catches_up_and_rides_at_its_speed() {
    let run = run(&load("conveyor", &[]));
    let catch = run.error("catch-time");
    assert!(catch <= 1e-9, "{catch}");
    assert!(run.error("speed") <= 1e-12, "{}", run.error("speed"));
}

/// A minute: what each step adds, however little, would add up.
#[test]
fn a_block_holds_a_minute_on_an_incline_a_thousandth_too_flat() {
    let run = run(&load("incline", &["slope=0.4995", "step.time=60"]));
    assert_eq!(run.totals.steps, 3600);
    let creep = run.error("creep");
    assert!(creep <= 1e-9, "{creep} m");
}

/// The floor's impulses have no moment about the point of contact: a disc that lands without spin
/// ends with two thirds of its speed, wherever in a step it lands.
#[test]
fn a_disc_that_lands_rolls_with_two_thirds_of_its_speed() {
    for events in [false, true] {
        for k in 0..8 {
            let run = run(&load(
                "spinning-disc",
                &[
                    &format!("body.disc.position=[0, {:?}]", 0.9 + 0.01 * f64::from(k)),
                    "body.disc.spin=0",
                    &format!("step.events={events}"),
                ],
            ));
            let (_, u) = run.state(1);
            assert!((u.x / 5.0 - 2.0 / 3.0).abs() < 1e-12, "{}", u.x / 5.0);
        }
    }
}
