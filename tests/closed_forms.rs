//! Answers that mechanics knows in closed form, and the order at which the scheme reaches them.

mod common;

use common::{LADDER, load, order, parse, rms, run, run_steps};
use moreau2d::dynamics::record::ContactStatus;
use moreau2d::experiment::{StudyOutcome, run_study};
use moreau2d::report::Progress;

/// Friction of the catalogue's scenes and gravity.
const MU: f64 = 0.5;
const G: f64 = 9.81;
/// Step of the gates.
const DT: f64 = 1.0 / 60.0;
/// Constant accelerations are integrated exactly: what is left is one rounding of 1.1e-16 a step
/// over some hundred steps, and the few of the closed form.
const ROUND_OFF: f64 = 1e-12;

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

#[test]
fn a_bouncing_ball_reaches_its_third_apex_and_rests() {
    // an impact is noticed up to a step late: first order, so the gates are wide
    for (e, gate) in [(0.9, 0.02), (0.5, 0.45)] {
        let runs: Vec<_> = (0..120)
            .map(|k| {
                let h = 0.9 + 0.2 * f64::from(k) / 119.0;
                let flags = [
                    format!("material.bouncy.restitution={e}"),
                    // both surfaces have the same material
                    format!("body.ball.position=[0, {}]", 0.5 + h),
                ];
                run(&load("bouncing-ball", &[&flags[0], &flags[1]]))
            })
            .collect();
        let apex = rms(runs.iter().map(|r| r.error("apex-3")));
        assert!(apex <= gate, "e = {e}: apex {apex}");
        let rest = rms(runs.iter().map(|r| r.error("rest-time")));
        // 4 %, and the end of the step in which it is seen
        let seen = DT / ((2.0 / G).sqrt() * (1.0 + e) / (1.0 - e));
        assert!(rest <= 0.04 + seen, "e = {e}: rest {rest}");
        assert!(runs.iter().all(|r| r.totals.energy_rise <= 1e-9), "e = {e}");
    }
}

#[test]
fn two_balls_leave_with_newtons_speeds() {
    for e in ["0", "0.5", "0.8", "1"] {
        for mass in ["0.5", "1", "2", "1000"] {
            let flags = [
                format!("restitution={e}"),
                format!("body.target.mass={mass}"),
            ];
            let run = run(&load("two-balls", &[&flags[0], &flags[1]]));
            for name in ["striker-speed", "target-speed"] {
                let error = run.error(name);
                assert!(error <= 1e-12, "e {e}, mass {mass}, {name}: {error}");
            }
        }
    }
}

#[test]
fn the_last_ball_of_a_cradle_with_gaps_leaves() {
    for scheme in ["staggered", "moreau"] {
        let run = run(&load("cradle", &[&format!("step.scheme={scheme}")]));
        assert!(run.error("last-speed") <= 1e-12, "{scheme}");
        assert!(run.error("others-at-rest") <= 1e-12, "{scheme}");
    }
}

/// Newton's law for many impacts at once, not a sequence of pairs.
#[test]
fn touching_balls_share_an_impact_by_newtons_law() {
    let cases: [(usize, f64, &[f64]); 4] = [
        (3, 1.0, &[-1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]),
        (5, 1.0, &[-0.6, 0.4, 0.4, 0.4, 0.4]),
        (3, 0.0, &[1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0]),
        (5, 0.0, &[0.2; 5]),
    ];
    for (n, e, expected) in cases {
        // the first one touches at the first midpoint: half a step of its 1 m/s away
        let mut text = format!(
            "[scene]\nname = \"row\"\ntitle = \"Touching balls\"\n[gravity]\ny = 0\n[step]\n\
             dt = 0.01\n[[material]]\nname = \"m\"\nfriction = 0\nrestitution = {e}\n"
        );
        for k in 0..n {
            let (x, v) = if k == 0 { (-0.005, 1) } else { (k as f64, 0) };
            text.push_str(&format!(
                "[[body]]\nname = \"b{k}\"\ndisc = 0.5\nmass = 1\nposition = [{x:?}, 0]\n\
                 velocity = [{v}, 0]\n"
            ));
        }
        let run = run_steps(&parse(&text), 1);
        for (k, v) in expected.iter().enumerate() {
            let (_, u) = run.state(k);
            // the solver's tolerance is 1e-8; exact solvers of so few contacts reach round-off
            assert!((u.x - v).abs() < 1e-12, "n {n}, e {e}: {} for {v}", u.x);
        }
    }
}

#[test]
fn a_beam_loads_its_supports_by_the_lever_rule() {
    for x in [-1.2, -0.3, 0.0, 0.7] {
        let run = run(&load("beam", &[&format!("body.load.position=[{x}, 0.55]")]));
        for name in ["left-force", "right-force"] {
            let error = run.error(name);
            assert!(error <= 1e-9, "load at {x}, {name}: {error}");
        }
    }
}

/// Three discs, two on the floor 2 cm apart and one on top, sin α = 0.51: the contact between top
/// and base carries n = W/2 and t = n tan(α/2), the floor 3 W/2, and it holds iff μ ≥ tan(α/2).
/// (Base discs that touch share a load between them that statics does not settle.)
#[test]
fn a_pyramid_of_three_discs_stands_by_friction_alone() {
    let alpha = 0.51f64.asin();
    let (height, limit) = (0.5 + alpha.cos(), (0.5 * alpha).tan());
    let pyramid = |mu: f64| {
        run(&parse(&format!(
            "[scene]\nname = \"p\"\ntitle = \"Three discs\"\n[step]\ntime = 2\ntolerance = 1e-12\n\
             [[material]]\nname = \"m\"\nfriction = {mu:?}\n\
             [[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [40, 2]\nposition = [0, -1]\n\
             [[body]]\nname = \"left\"\ndisc = 0.5\nmass = 1\nposition = [-0.51, 0.5]\n\
             [[body]]\nname = \"right\"\ndisc = 0.5\nmass = 1\nposition = [0.51, 0.5]\n\
             [[body]]\nname = \"top\"\ndisc = 0.5\nmass = 1\nposition = [0, {height:?}]\n"
        )))
    };
    let place = |run: &common::Run, k: usize| run.state(k).0.translation;
    let falls = pyramid(0.98 * limit);
    assert!(height - place(&falls, 3).y > 1e-2);
    let stands = pyramid(1.02 * limit);
    assert!((height - place(&stands, 3).y).abs() < 1e-9);

    let last = stands.records.last().unwrap();
    let weight = G * last.dt;
    let number = |k: usize| stands.built.number(k).unwrap();
    let find = |a: usize, b: usize| {
        let pair = [number(a), number(b)];
        let on = |c: &&moreau2d::dynamics::record::ContactRecord| {
            c.bodies == pair || c.bodies == [pair[1], pair[0]]
        };
        last.contacts.iter().find(on).unwrap()
    };
    for base in [1, 2] {
        let top = find(base, 3);
        assert!(
            (top.impulse_n / weight - 0.5).abs() < 1e-9,
            "{}",
            top.impulse_n / weight
        );
        assert!((top.impulse_t.abs() / weight - 0.5 * limit).abs() < 1e-9);
        assert!((find(0, base).impulse_n / weight - 1.5).abs() < 1e-9);
    }
}

#[test]
fn a_block_dropped_on_a_belt_catches_up_and_rides_at_its_speed() {
    let scene = parse(
        "[scene]\nname = \"belt\"\ntitle = \"A belt\"\n[step]\ntime = 1\n\
         [[body]]\nname = \"belt\"\nkind = \"fixed\"\nbox = [40, 2]\nposition = [0, -1]\n\
         surface_velocity = -2\n\
         [[body]]\nname = \"block\"\nbox = [1, 1]\nposition = [0, 0.5]\n",
    );
    let run = run(&scene);
    let catch = run
        .records
        .iter()
        .position(|r| r.contacts.iter().any(|c| c.status == ContactStatus::Stick))
        .unwrap();
    let sum = |f: fn(&moreau2d::dynamics::record::ContactRecord) -> f64| -> f64 {
        run.records[catch].contacts.iter().map(f).sum()
    };
    // inside the step: the share of it during which friction was at its bound
    let share = sum(|c| c.impulse_t.abs()) / (MU * sum(|c| c.impulse_n));
    let time = run.records[catch].time - DT + share * DT;
    assert!((time / (2.0 / (MU * G)) - 1.0).abs() < 1e-9, "{time}");
    let (_, speed) = run.state(1);
    assert!((speed.x - 2.0).abs() < 1e-12, "{}", speed.x);
}

fn study(flags: &[&str]) -> StudyOutcome {
    let scene = load("thresher-study", flags);
    run_study(&scene, &Progress::new("test", 1, true)).unwrap()
}

/// Gate of the study: the row "torque-balanced Winkler share quadratic refit" of the rebuilt data,
/// printed to 1 µm there.
#[test]
fn the_study_reproduces_the_winkler_row_of_the_rebuilt_data() {
    let row = [
        7620.0, 8526.0, 9408.0, 10270.0, 11123.0, 11967.0, 1274.0, 1450.0, 1624.0, 1796.0, 1968.0,
        2138.0,
    ];
    let outcome = study(&[]);
    assert_eq!(outcome.comparison.len(), 12);
    for (point, um) in outcome.comparison.iter().zip(row) {
        assert!((point.computed_um - um).abs() <= 1.0, "{point:?}: {um}");
        assert!(point.published_um.is_finite());
        let error = point.computed_um / point.published_um - 1.0;
        assert!((point.relative_error - error).abs() < 1e-12);
    }
    assert_eq!(
        outcome.comparison.iter().filter(|p| p.calibrated).count(),
        1
    );
    assert!(outcome.comparison[0].calibrated && outcome.calibrated);
    // 0.6953 ms in the rebuilt data
    assert!(
        (outcome.contact_time - 0.6953e-3).abs() < 5e-8,
        "{}",
        outcome.contact_time
    );
    let difference = outcome.oracle_difference.unwrap();
    assert!(difference <= 1e-6, "{difference}");
    assert_eq!(outcome.totals.unsolved_islands, 0);
    let others: Vec<f64> = outcome
        .comparison
        .iter()
        .filter(|p| !p.calibrated)
        .map(|p| p.relative_error.abs())
        .collect();
    let mean = others.iter().sum::<f64>() / others.len() as f64;
    let worst = others.iter().copied().fold(0.0, f64::max);
    // as the rebuilt data print them, to their last digit
    assert!(
        (mean - 0.116).abs() < 5e-4 && (worst - 0.299).abs() < 5e-4,
        "{mean} {worst}"
    );
}

/// Life at the calibrated point: 4e6 cycles of one revolution at 70 rad/s.
#[test]
fn a_cycle_of_the_study_is_one_revolution() {
    let outcome = study(&[]);
    let hours = 4e6 * std::f64::consts::TAU / 70.0 / 3600.0;
    let at_4e6: Vec<_> = outcome
        .history
        .wear
        .iter()
        .filter(|w| w.cycles == 4e6)
        .collect();
    assert_eq!(at_4e6.len(), 26);
    assert!((at_4e6[0].hours / hours - 1.0).abs() < 1e-12);
    let deepest = at_4e6.iter().map(|w| w.depth_m).fold(0.0, f64::max);
    assert!((deepest - 7.62e-3).abs() < 1e-6, "{deepest}");
}

/// The study's own means: Moreau's rule and an LCP by Lemke's method. 50 steps in place of 20 000
/// a cycle: after a stall nothing happens any more.
const LITERAL: [&str; 4] = [
    "reading=literal",
    "step.scheme=moreau",
    "step.solver=lemke",
    "step.time=5e-5",
];

#[test]
fn the_literal_reading_stalls_in_one_step() {
    let outcome = study(&LITERAL);
    let stall = outcome.stall.unwrap();
    assert_eq!(stall.wearing_steps, 1);
    // relative to 120 rad/s at the solver's tolerance of 1e-8
    assert!(stall.speed_after <= 1.2e-6, "{}", stall.speed_after);
    // T^0 ω²: the torque acts for one step of 1e-6 s before the stall, 0.28 of 70 rad/s
    assert!(
        stall.torque_exponent.abs() <= 0.01,
        "{}",
        stall.torque_exponent
    );
    assert!(
        (stall.speed_exponent - 2.0).abs() <= 0.01,
        "{}",
        stall.speed_exponent
    );
    assert_eq!(outcome.totals.unsolved_islands, 0);
    assert!(outcome.oracle_difference.is_none() && !outcome.calibrated);
}

#[test]
fn wear_of_the_literal_reading_goes_as_speed_squared_whatever_the_torque() {
    let mut flags = LITERAL.to_vec();
    // one batch: the same new profile everywhere
    flags.push("study.batches=1");
    let rows = study(&flags).comparison;
    let at = |t: f64, w: f64| {
        let row = rows.iter().find(|r| r.torque_nm == t && r.omega_rad_s == w);
        row.unwrap().computed_um
    };
    for w in [70.0, 80.0, 90.0, 100.0, 110.0, 120.0] {
        let torque = at(146.39, w) / at(20.87, w);
        assert!((torque - 1.0).abs() <= 0.01, "at {w} rad/s: {torque}");
        let speed = at(146.39, w) / at(146.39, 70.0) / (w / 70.0f64).powi(2);
        assert!((speed - 1.0).abs() <= 0.01, "at {w} rad/s: {speed}");
    }
}

#[test]
fn every_loading_by_a_single_cell_passes_the_judge() {
    let outcome = study(&LITERAL);
    assert_eq!(outcome.stall.unwrap().single_cell, (26, 26));
}

// --- found, not yet mended --------------------------------------------------------------------

/// Bug: the scene leaves scheme and solver at the product's defaults, which are not the study's.
/// Under `staggered` the rotor rebounds with half its speed (see `stepper.rs`); with `direct` the
/// shares, and so the wear of a cycle, hang on where its iteration stopped.
#[test]
fn the_literal_reading_stalls_as_the_scene_stands() {
    let outcome = study(&["reading=literal", "step.time=5e-5"]);
    let stall = outcome.stall.unwrap();
    assert_eq!(stall.wearing_steps, 1);
    assert!(stall.speed_after <= 1.2e-6, "{}", stall.speed_after);
    assert!(
        stall.torque_exponent.abs() <= 0.01,
        "{}",
        stall.torque_exponent
    );
    assert!(
        (stall.speed_exponent - 2.0).abs() <= 0.01,
        "{}",
        stall.speed_exponent
    );
}

/// Bug: with Lemke's method sliding cells count as sticking for a round-off (see `stepper.rs`) and
/// lose 0.4 % of their wear, without a warning.
#[test]
fn the_study_agrees_with_its_algebra_whatever_the_solver() {
    for solver in ["auto", "nsgs", "direct", "lemke"] {
        let outcome = study(&[&format!("step.solver={solver}"), "study.speeds=[70]"]);
        let difference = outcome.oracle_difference.unwrap();
        assert!(difference <= 1e-6, "{solver}: {difference}");
        assert_eq!(outcome.totals.unsolved_islands, 0, "{solver}");
    }
}
