//! Models of our own behind scenes: true circles, rods, moving planes, pivots, constant matrices.
//!
//! Gates are for dt = 1/60 s and the staggered scheme, orders over 1/30 to 1/1000 s.

use crate::common::{LADDER, Run, load, order, parse, rms, run, run_steps};
use moreau2d::contact::Vec2;
use moreau2d::dynamics::record::ContactStatus;
use moreau2d::scene::Scene;

const DT: f64 = 1.0 / 60.0;

/// Order of the measure `name` over the ladder, rms over what `flags` makes of each case.
fn observed_order(
    scene: &str,
    name: &str,
    cases: usize,
    flags: impl Fn(usize) -> Vec<String>,
) -> f64 {
    let errors = LADDER.map(|dt| {
        rms((0..cases).map(|case| {
            let mut all = flags(case);
            all.push(format!("step.dt={dt:?}"));
            let all: Vec<&str> = all.iter().map(String::as_str).collect();
            run(&load(scene, &all)).error(name)
        }))
    });
    order(&errors)
}

fn unchanged(_: usize) -> Vec<String> {
    Vec::new()
}

/// Asserts order two. A single smooth case has no scatter; what is left is the next term of the
/// error, a tenth of the order at the coarse end of the ladder.
#[track_caller]
fn assert_order_two(scene: &str, name: &str) {
    let p = observed_order(scene, name, 1, unchanged);
    assert!((p - 2.0).abs() < 0.1, "{scene}, {name}: order {p}");
}

/// For an error whose terms of third order are as large as those of second order on the ladder.
#[track_caller]
fn assert_order_two_or_more(scene: &str, name: &str) {
    let p = observed_order(scene, name, 1, unchanged);
    assert!(p > 1.9, "{scene}, {name}: order {p}");
}

#[test]
fn a_disc_in_a_frictionless_bowl_is_a_pendulum() {
    let run = run(&load("bowl", &[]));
    assert!(run.error("angle") <= 3e-3, "{}", run.error("angle"));
    assert!(run.error("energy") <= 3e-3, "{}", run.error("energy"));
    // without friction nothing turns it
    assert_eq!(run.state(1).1.z, 0.0);
    // sinks to the depth at which |γ_A| Δt = −g: (u Δt)²/(2 l), at the bottom
    let u_squared = 2.0 * 9.81 * 4.5 * (1.0 - 0.5f64.sqrt());
    let depth = u_squared * DT * DT / 9.0;
    assert!(
        run.totals.penetration <= depth,
        "{}",
        run.totals.penetration
    );
    for name in ["angle", "energy"] {
        assert_order_two("bowl", name);
    }
}

#[test]
fn a_disc_rolls_in_a_bowl_as_a_slower_pendulum() {
    let run = run(&load("rolling-bowl", &[]));
    assert!(run.error("angle") <= 1e-4, "{}", run.error("angle"));
    assert!(run.error("energy") <= 1e-3, "{}", run.error("energy"));
    let rolls = |c: &moreau2d::dynamics::record::ContactRecord| c.status == ContactStatus::Stick;
    assert!(run.records.iter().all(|r| r.contacts.iter().all(rolls)));
    assert_order_two("rolling-bowl", "angle");
    assert_order_two_or_more("rolling-bowl", "energy");
}

/// A bowl of 1 m and a disc of 0.1 m let go at 1 rad: the normal turns twice as far in a
/// step, the case that the gates were measured on.
#[test]
fn a_small_bowl_meets_the_gates_as_well() {
    let place = format!(
        "body.disc.position=[{:?}, {:?}]",
        0.9 * 1f64.sin(),
        -0.9 * 1f64.cos()
    );
    let small = ["body.bowl.bowl=1", "body.disc.disc=0.1", place.as_str()];
    let slides = run(&load("bowl", &small));
    assert!(slides.error("angle") <= 3e-3, "{}", slides.error("angle"));
    let rough = "material=[{ name = \"rubber\", friction = 1 }]";
    let rolls = run(&load("rolling-bowl", &[&small[..], &[rough]].concat()));
    // bug: on so tight a curve the scheme holds the disc deeper than the trigger of late overlap;
    // moved out again and again it ended at 7.5e-4
    // its error at 1/120 and 1/240 is 6e-5 and 1.7e-5
    assert!(rolls.error("angle") <= 3e-4, "{}", rolls.error("angle"));
}

/// At speed the disc first sinks to the depth at which the scheme holds a curve, which costs the
/// share (u Δt/l)² of the energy: 3.5e-3 here. The angle then lags by half of that, turn by turn.
#[test]
fn a_disc_rolls_through_a_loop() {
    let run = run(&load("loop", &[]));
    let lost = (16.0 * DT / 4.5f64).powi(2);
    assert!(run.error("energy") <= lost, "{}", run.error("energy"));
    let turned = run.measures.iter().find(|m| m.name == "angle").unwrap();
    assert!(
        turned.exact > 4.0 * std::f64::consts::PI,
        "two loops and more"
    );
    assert!(turned.error <= lost * turned.exact, "{}", turned.error);
    // never off the ring
    assert!(run.records.iter().all(|r| r.contacts.len() == 1));
    for name in ["angle", "energy"] {
        assert_order_two("loop", name);
    }
}

#[test]
fn a_rod_falls_about_its_stuck_tip() {
    let run = run(&load("stuck-rod", &[]));
    // 4.0e-4 each while the turning of the rows lagged by a step
    assert!(run.error("angle") <= 1.3e-4, "{}", run.error("angle"));
    assert!(run.error("tip-drift") <= 7e-5, "{}", run.error("tip-drift"));
    assert_order_two_or_more("stuck-rod", "angle");
    // two parts of the drift cancel at 1/30 s: the order from 1/250 to 1/1000 s
    let drift = ["step.dt=0.004", "step.dt=0.001"]
        .map(|dt| crate::common::run(&load("stuck-rod", &[dt])).error("tip-drift"));
    let p = (drift[0] / drift[1]).ln() / 4f64.ln();
    assert!(p > 1.85, "tip-drift: order {p}");
}

#[test]
fn a_rod_falls_on_a_frictionless_floor() {
    let run = run(&load("falling-rod", &[]));
    // 3.0e-4 while the tip floated by c dt²/2 at the midpoints: a part of the error cancelled another
    // at coarse steps, where the order was 1.6
    assert!(run.error("angle") <= 4.2e-4, "{}", run.error("angle"));
    assert_eq!(run.error("centre-drift"), 0.0);
    assert_order_two("falling-rod", "angle");
}

#[test]
fn a_disc_rides_a_swinging_plate() {
    let run = run(&load("riding-disc", &[]));
    // A ω² Δt²/8, the arrow of the arc within a step
    let arrow = 0.1 * 36.0 * DT * DT / 8.0;
    assert!((run.error("height") / arrow - 1.0).abs() < 0.01);
    assert!(run.records.iter().all(|r| r.contacts.len() == 1));
    assert_order_two("riding-disc", "height");
    // a restitution changes nothing for a disc that never leaves
    let bouncy = crate::common::run(&load("riding-disc", &["material.smooth.restitution=0.5"]));
    assert!((bouncy.error("height") / arrow - 1.0).abs() < 0.01);
}

/// Above the threshold the tip jams at once, whatever the step; below it slides on. A step must
/// be short beside the time in which the slide ends anyway.
#[test]
fn a_painleve_rod_jams_above_its_threshold_only() {
    for degrees in [45.0f64, 60.0, 75.0] {
        let angle = degrees.to_radians();
        let (sin, cos) = angle.sin_cos();
        let threshold = (1.0 + 3.0 * cos * cos) / (3.0 * sin * cos);
        for (share, dt) in [(0.99, 1e-3), (1.01, 1e-3), (0.99, 1e-4), (1.01, 1e-4)] {
            let flags = [
                format!("body.rod.angle={angle:?}"),
                format!("body.rod.position=[0, {:?}]", 0.5 * sin),
                format!("material.rough.friction={:?}", share * threshold),
                format!("step.dt={dt:?}"),
            ];
            let run = run_steps(
                &load("painleve", &flags.each_ref().map(String::as_str)),
                100,
            );
            let what = format!("{degrees} degrees, {share} of the threshold, dt {dt}");
            assert_eq!(run.error("jams"), 0.0, "{what}");
            assert_eq!(run.measures[0].exact, f64::from(share > 1.0), "{what}");
            assert_eq!(run.totals.unsolved_islands, 0, "{what}");
            // J, of 12.5 J: round-off
            assert!(
                run.totals.energy_rise <= 1e-12,
                "{what}: {}",
                run.totals.energy_rise
            );
        }
    }
}

/// Rods of 1 m on pivots of the planar model, let go 1 rad and 0.5 rad from straight down.
fn rods(count: usize, dt: f64) -> Scene {
    let mut text = format!(
        "[scene]\nname = \"rods\"\ntitle = \"Rods on pivots\"\n[step]\ntime = 5\ndt = {dt:?}\n\
         [reference]\nclosed_form = \"pendulum\"\n"
    );
    let mut pin = Vec2::zeros();
    for (k, angle) in [1.0f64, 0.5].into_iter().take(count).enumerate() {
        let down = Vec2::new(angle.sin(), -angle.cos());
        let centre = pin + 0.5 * down;
        let above = match k {
            0 => "world",
            _ => "rod0",
        };
        text.push_str(&format!(
            "[[body]]\nname = \"rod{k}\"\nrod = 1\nmass = 1\nposition = [{:?}, {:?}]\n\
             angle = {:?}\n[[joint]]\nkind = \"revolute\"\nbodies = [\"{above}\", \"rod{k}\"]\n\
             at = [{:?}, {:?}]\n",
            centre.x,
            centre.y,
            angle - std::f64::consts::FRAC_PI_2,
            pin.x,
            pin.y
        ));
        pin += down;
    }
    parse(&text)
}

#[test]
fn rods_swing_on_pivots() {
    for (count, fine) in [(1, 0.1), (2, 0.2)] {
        let errors = LADDER.map(|dt| {
            // whole steps fill five seconds
            let scene = rods(count, 5.0 / (5.0 / dt).round());
            crate::common::run(&scene).error("position")
        });
        assert!(errors[1] <= 8e-3, "{count} rods: {errors:?}");
        // the second mode of two rods turns 0.3 rad in the coarsest step: the order is reached at
        // the fine end
        let p = (errors[4] / errors[5]).log2();
        assert!(
            (p - 2.0).abs() < fine,
            "{count} rods, order {p}: {errors:?}"
        );
    }
}

/// Impacts come at instants that no step length meets: below 1e-5 s the crank's angle scatters
/// instead of converging, by 2e-4 rad after one turn and 1e-3 rad after two. Compared are 1e-5 s,
/// the published step, and two finer ones.
#[test]
fn a_slider_crank_with_play_keeps_its_budget_and_repeats_itself() {
    let at = |dt: f64, time: f64| {
        let flags = [format!("step.dt={dt:?}"), format!("step.time={time:?}")];
        run(&load("slider-crank", &flags.each_ref().map(String::as_str)))
    };
    let crank = |run: &Run| run.state(2).0.angle();
    for (time, scatter) in [(0.05, 2e-4), (0.2, 1e-3)] {
        let runs = [1e-5, 5e-6, 2.5e-6].map(|dt| at(dt, time));
        for finer in &runs[1..] {
            let difference = (crank(&runs[0]) - crank(finer)).abs();
            assert!(difference <= scatter, "after {time} s: {difference} rad");
        }
        for run in &runs {
            let t = &run.totals;
            assert_eq!(t.unsolved_islands, 0);
            // J, of 7.5 J
            assert!(t.energy_rise <= 1e-12 && t.imbalance <= 1e-12);
            assert!(t.work_contact_n < 0.0 && t.friction_work > 0.0);
            // what is lost is lost at the guides: friction, impacts. Pins do work only while
            // they settle, in proportion to dt²: 8e-5 J at 1e-5 s
            let lost = t.energy_start - t.energy_end;
            let at_guides = t.friction_work - t.work_contact_n;
            assert!((lost - at_guides).abs() <= 2e-4, "{lost} J, {at_guides} J");
            // pins hold: the slider is where crank and rod put it, to the order of the settling
            let arm = |k: usize, length: f64| run.state(k).0.rotate(Vec2::x()) * length;
            let closure = run.state(4).0.translation - arm(2, 0.153) - arm(3, 0.306);
            assert!(closure.norm() <= 2e-6, "{}", closure.norm());
            // the guides hold: an impact is noticed within a step, at 3 m/s across and less
            let step = t.time / t.steps as f64;
            assert!(t.penetration <= 3.0 * step + 1e-9, "{}", t.penetration);
        }
    }
}

/// The numbers kept for this toy, from a run of the published rule at the same step: they tell
/// the model, contact by contact, but are no converged motion (0.1 % and 0.7 % off, see below).
#[test]
fn the_woodpecker_repeats_the_run_of_record() {
    let run = run(&load("woodpecker", &[]));
    for (name, value) in [
        ("crossing-1", 0.07349),
        ("crossing-2", 0.21956),
        ("height-0.1s", -0.007080),
        ("height-0.2s", -0.023884),
    ] {
        let found = run.measures.iter().find(|m| m.name == name).unwrap();
        let error = (found.computed / value - 1.0).abs();
        assert!(error <= 1e-4, "{name}: {}", found.computed);
    }
    assert_eq!(run.totals.unsolved_islands, 0);
    // J, of 5e-5 J: nothing but gravity and the spring feeds it
    assert!(
        run.totals.energy_rise <= 1e-12,
        "{}",
        run.totals.energy_rise
    );
}

/// Against the motion followed from event to event. Impacts are noticed up to a step late: order
/// one, and scattered, so rms over eight steps near each other. (Started with a closed gap: the
/// 9e-7 m of overlap in the numbers of record leave 1e-5 of the fall.)
#[test]
fn the_woodpecker_converges_to_its_exact_motion() {
    let closed = "linear.position=[0, -0.10344827586206896, -0.2788]";
    let at = |dt: f64, scheme: &str| {
        let flags = [
            closed.to_owned(),
            format!("step.dt={dt:?}"),
            format!("step.scheme={scheme}"),
            "step.time=0.22".to_owned(),
        ];
        run(&load("woodpecker", &flags.each_ref().map(String::as_str)))
    };
    let names = ["crossing-2", "height-0.1s", "height-0.2s"];
    let errors = [3.2e-5, 8e-6, 2e-6].map(|dt| {
        rms((0..8).flat_map(|k| {
            let run = at(dt * (1.0 + 0.03 * f64::from(k)), "moreau");
            names.map(|name| run.error(name))
        }))
    });
    let p = (errors[0] / errors[2]).ln() / 16f64.ln();
    // an rms over eight phases of an error that jumps scatters by a fifth
    assert!((p - 1.0).abs() < 0.2, "order {p}: {errors:?}");
    for scheme in ["moreau", "staggered"] {
        let run = at(5e-7, scheme);
        // before the first impact: a few steps late at most
        assert!(run.error("crossing-1") <= 1e-5, "{scheme}");
        for name in names {
            let error = run.error(name);
            // a step of 5e-7 s is 7e-6 of the time between two impacts, and four go by
            assert!(error <= 2e-4, "{scheme}, {name}: {error}");
        }
    }
}

/// The same scene on rapier's box and on our line: the model is smaller, the answer the same.
/// (Not while a gap is closing: there rapier's contact point lies half way across it.)
#[test]
fn a_line_and_a_box_of_rapier_are_the_same_floor() {
    let scene = |floor: &str, body: &str| {
        parse(&format!(
            "[scene]\nname = \"s\"\ntitle = \"A floor\"\n[step]\ntime = 1.5\n\
             [[body]]\nname = \"floor\"\nkind = \"fixed\"\n{floor}\nsurface_velocity = -0.5\n\
             [[body]]\nname = \"body\"\n{body}\nvelocity = [4, 0]\n"
        ))
    };
    for body in [
        "disc = 0.5\nposition = [0, 0.5]\nspin = 3",
        "box = [1, 1]\nposition = [0, 0.5]",
    ] {
        let [ours, rapier] = ["line = true", "box = [40, 2]\nposition = [0, -1]"]
            .map(|floor| run(&scene(floor, body)));
        assert!(ours.built.simulation().is_none() && rapier.built.simulation().is_some());
        let ((p, u), (q, v)) = (ours.state(1), rapier.state(1));
        // round-off over 90 steps; gaps far below rapier's dead band count as none
        let gap = (p.translation - q.translation).norm();
        assert!(gap <= 1e-12 && (u - v).norm() <= 1e-11, "{body}: {gap} m");
    }
}

#[test]
fn discs_hit_each_other_by_newtons_law() {
    let run = run(&parse(
        "[scene]\nname = \"s\"\ntitle = \"Two balls\"\n[gravity]\ny = 0\n[step]\ntime = 1\n\
         [[material]]\nname = \"ball\"\nfriction = 0\nrestitution = 0.8\n\
         [[body]]\nname = \"floor\"\nkind = \"fixed\"\nline = true\nposition = [0, -3]\n\
         [[body]]\nname = \"striker\"\ndisc = 0.5\nmass = 1\nposition = [-2, 0]\n\
         velocity = [5, 0]\n[[body]]\nname = \"target\"\ndisc = 0.5\nmass = 2\n\
         [reference]\nclosed_form = \"two-balls\"\n",
    ));
    assert!(run.built.simulation().is_none());
    for name in ["striker-speed", "target-speed"] {
        assert!(run.error(name) <= 1e-12, "{name}: {}", run.error(name));
    }
}

/// A motor holds the speed it is given, of the second body relative to the first.
#[test]
fn a_motor_on_a_pivot_holds_its_speed() {
    for (bodies, sign) in [("\"world\", \"arm\"", 1.0), ("\"arm\", \"world\"", -1.0)] {
        let run = run(&parse(&format!(
            "[scene]\nname = \"s\"\ntitle = \"A driven arm\"\n[step]\ntime = 1\n\
             [[body]]\nname = \"arm\"\nrod = 1\nmass = 1\nposition = [0.5, 0]\n\
             [[joint]]\nkind = \"revolute\"\nat = [0, 0]\nbodies = [{bodies}]\n\
             motor = {{ speed = 3, max_torque = 1e3 }}\n"
        )));
        let (pose, u) = run.state(0);
        // certified to 1e-8 of 3 rad/s
        assert!((u.z - 3.0 * sign).abs() < 3e-8, "{}", u.z);
        // the first half step is still at rest
        let turned = sign * (3.0 - 1.5 * DT);
        assert!((pose.angle() - turned).abs() < 3e-8, "{}", pose.angle());
        assert!(run.totals.work_motors > 0.0);
    }
}
