//! `explain`: counts by hand, errors as they turn out, at a tenth of the run.

use crate::common::program::Place;
use moreau2d::contact::Vec2;
use moreau2d::experiment::{Engine, explain, simulate};
use moreau2d::scene;
use serde_json::Value;
use std::time::Instant;

fn told(args: &[&str]) -> Value {
    let place = Place::new();
    let all = [&["explain"], args, &["--json", "--quiet"]].concat();
    let (code, out, err) = place.run(&all);
    assert_eq!(code, 0, "{args:?}: {err}");
    assert!(place.everything().is_empty(), "explain writes no file");
    serde_json::from_str(&out).unwrap()
}

#[test]
fn degrees_of_freedom_are_those_of_the_mechanism() {
    for (scene, free, rows) in [
        ("pendulum", 1, 2),
        ("double-pendulum", 2, 4),
        ("tower", 30, 0),
        ("bouncing-ball", 3, 0),
        ("woodpecker", 3, 0),
        ("card-house", 120, 0),
    ] {
        let told = told(&[scene]);
        assert_eq!(told["degrees_of_freedom"], free, "{scene}");
        assert_eq!(told["joint_rows"], rows, "{scene}");
        let [one, all] = ["steps", "run_steps"].map(|key| told["trial"][key].as_u64().unwrap());
        // three trials, of steps, half and quarter steps; the first steps cost more than most of a run
        assert!(one <= (all / 100).max(1), "{scene}: {one} of {all}");
    }
    assert_eq!(told(&["thresher-study"])["degrees_of_freedom"], 1);
}

#[test]
fn what_is_left_out_was_seen_in_the_trial() {
    let tower = told(&["tower"]);
    assert_eq!(tower["trial"]["most_contacts"], 20);
    assert_eq!(tower["trial"]["most_unknowns"], 40);
    let left: Vec<&str> = (tower["left_out"].as_array().unwrap().iter())
        .filter_map(|left| left["key"].as_str())
        .collect();
    assert!(left.contains(&"step.keep_rest"), "{left:?}");
    let solved = told(&["tower", "--set", "step.keep_rest=false"]);
    assert!(!solved["left_out"].to_string().contains("keep_rest"));
}

/// A contact without friction neither sticks nor slides: it was counted as one that slides.
#[test]
fn contacts_without_friction_are_counted_by_themselves() {
    let place = Place::new();
    place.write(
        "ice.toml",
        "[scene]\nname = \"ice\"\ntitle = \"t\"\n[step]\ntime = 1\n[[material]]\nname = \"ice\"\nfriction = 0\n\
         [[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [9, 1]\nposition = [0, -0.5]\nmaterial = \"ice\"\n\
         [[body]]\nname = \"box\"\nbox = [1, 1]\nposition = [0, 0.5]\nvelocity = [1, 0]\nmaterial = \"ice\"\n",
    );
    let (code, out, err) = place.run(&["explain", "ice.toml"]);
    assert_eq!(code, 0, "{err}");
    let closed = "0 times a contact sticks, 0 slides, 2 is closed without friction";
    assert!(out.contains(closed), "{out}");
}

/// How each kind of island is solved, and which steps ask for more than they can use.
#[test]
fn kinds_of_islands_and_needless_digits_are_named() {
    let place = Place::new();
    let text = |args: &[&str]| place.run(&[&["explain"], args].concat()).1;
    let tower = text(&["tower"]);
    assert!(tower.contains("  1 at rest, which keep"), "{tower}");
    assert!(
        tower.contains("  1 larger, of up to 20, by Newton"),
        "{tower}"
    );
    let cards = &told(&["card-house"])["trial"];
    let counts = ["small_islands", "other_islands", "swept_islands"];
    let [small, other, swept] = counts.map(|key| cards[key].as_u64().unwrap());
    assert!(small > other && other > 0 && swept == 0, "{cards}");
    // no contact: nothing is known of what follows
    let ball = text(&["bouncing-ball"]);
    assert!(
        ball.contains("accuracy: not known: no contact in the trial"),
        "{ball}"
    );
    let gap = told(&["drum"])["trial"]["least_gap_m"].as_f64().unwrap();
    assert!((1e-4..1e-2).contains(&gap), "{gap}");
    let fine = text(&["pendulum", "--dt", "1e-3"]);
    assert!(
        fine.contains("finer than an accuracy of 1e-4 needs"),
        "{fine}"
    );
    let digits = text(&["pendulum", "--tolerance", "1e-14"]);
    assert!(
        digits.contains("asks for digits that the step does not have"),
        "{digits}"
    );
}

#[test]
fn a_machine_is_tried_over_its_first_cycle() {
    let told = told(&["thresher", "--set", "step.dt=3.2e-4"]);
    // a cylinder on its axle, and two for each free segment in a slot
    let [free, bodies] =
        ["degrees_of_freedom", "dynamic_bodies"].map(|k| told[k].as_u64().unwrap());
    assert_eq!(free, 1 + 2 * (bodies - 1), "{told}");
    assert!(
        told["trial"]["most_contacts"].as_u64().unwrap() > 8,
        "{told}"
    );
    assert!(told["left_out"].to_string().contains("wear.revolutions"));
    assert!(
        told["warnings"].to_string().contains("step.dt"),
        "the step is too long"
    );
}

/// Largest distance of a body's two places \[m\].
fn apart(a: &[Vec2], b: &[Vec2]) -> f64 {
    let each = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    each.fold(0.0, f64::max)
}

/// The error at the end of the trial against a run with a step 64 times shorter.
#[test]
fn the_expected_error_is_the_one_that_turns_out() {
    for name in ["pendulum", "double-pendulum", "sliding-block"] {
        let scene = scene::load(name, &[]).unwrap();
        let explained = explain(&scene).unwrap();
        let expected = (explained.accuracy.iter())
            .find(|a| a.measure == "position")
            .unwrap_or_else(|| panic!("{name}: no accuracy"));
        let ends = |dt: f64, steps: usize| {
            let mut scene = scene.clone();
            scene.step.dt = dt;
            let mut built = scene.build().unwrap();
            simulate(&mut built, Engine::Moreau, steps, |_, _| Ok(())).unwrap();
            let place = |k| built.state(k).map(|(pose, _)| pose.translation);
            (0..built.bodies()).filter_map(place).collect::<Vec<_>>()
        };
        let (dt, steps) = (scene.step.dt, explained.trial.steps);
        let error = apart(&ends(dt, steps), &ends(dt / 64.0, 64 * steps));
        assert!(
            error <= 2.0 * expected.error + 1e-9 && expected.error <= 2.0 * error + 1e-9,
            "{name}: {error} for {expected:?}"
        );
        // the stated step holds its accuracy, against one 64 times shorter
        for step in &explained.steps_for {
            assert!(step.dt_s <= scene.step.dt, "{name}: {step:?}");
            let time = explained.trial.steps as f64 * scene.step.dt;
            let steps = (time / step.dt_s).ceil() as usize;
            let [coarse, fine] = [1, 64].map(|finer| ends(step.dt_s / finer as f64, finer * steps));
            let built = scene.build().unwrap();
            let place = |k| built.state(k).map(|(pose, _)| pose.translation);
            let starts = (0..built.bodies()).filter_map(place);
            let sizes = (0..built.bodies()).filter_map(|k| built.size(k));
            let ways = starts.zip(&coarse).zip(sizes);
            let way = ways.map(|((a, b), size)| (a - b).norm() + size);
            let most = step.accuracy * way.fold(0.0, f64::max);
            let error = apart(&coarse, &fine);
            assert!(error <= most, "{name}: {error} m for {step:?}, {most} m");
        }
    }
}

#[test]
fn what_has_no_trial_is_refused() {
    let place = Place::new();
    place.refused(&["explain", "thresher", "--steps", "9"], &["--steps"]);
    place.refused(&["explain", "tower", "--out", "x"], &["--out"]);
    place.refused(&["explain", "towr"], &["tower"]);
}

/// The time of `explain` over that of `run`, for every scene of the catalogue: prints a table, to be read on a
/// quiet machine. A tenth is wanted.
///
/// The start of the process is the same in both, some 2 ms, and is taken off; what is left of a run of fewer
/// than 2 ms is not told apart from it, nor from the half a millisecond in which the code of a trial is first
/// read. The first step of `large-pyramid`, which nothing can shorten, takes a seventh by itself, that of `arch` a
/// twentieth, and three trials have one each.
#[test]
#[ignore = "runs the whole catalogue: some minutes; prints times and asserts none"]
fn time_over_that_of_the_run() {
    let least = |args: &[&str], often: usize| {
        let one = |_| {
            let place = Place::new();
            let start = Instant::now();
            let (code, _, err) = place.run(args);
            assert!(matches!(code, 0 | 2), "{args:?}: {err}");
            start.elapsed().as_secs_f64()
        };
        (0..often).map(one).fold(f64::INFINITY, f64::min)
    };
    let start = least(&["--version"], 50);
    println!("start of the process {:.1} ms, taken off", 1e3 * start);
    println!(
        "{:18} {:>9} {:>9} {:>6}",
        "scene", "run s", "explain s", "ratio"
    );
    for listing in scene::scenes().unwrap() {
        let name = listing.name;
        let (mut run, mut explain) = (f64::INFINITY, f64::INFINITY);
        let began = Instant::now();
        // in turns, so that a busy machine is busy for both
        while run.is_infinite() || (began.elapsed().as_secs_f64() < 1.0) {
            run = run.min(least(&["run", name, "--quiet"], 1) - start);
            explain = explain.min(least(&["explain", name, "--quiet"], 3) - start);
        }
        let ratio = explain / run;
        println!("{name:18} {run:9.4} {explain:9.4} {ratio:6.3}");
    }
}
