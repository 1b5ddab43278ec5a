//! Slides that end within a step, with event location.

use crate::common::{LADDER, load, parse, run};

/// Constant forces are integrated exactly, up to the search for the end of the slide.
const EXACT: f64 = 1e-9;

#[test]
fn a_slide_ends_at_its_time_and_place() {
    let scenes = [
        ("sliding-block", ["distance", "stop-time", "wear"]),
        ("spinning-disc", ["distance", "rolling-time", "wear"]),
        ("conveyor", ["speed", "catch-time", "wear"]),
    ];
    for (scene, measures) in scenes {
        for dt in LADDER {
            let run = run(&load(
                scene,
                &["step.events=true", &format!("step.dt={dt}")],
            ));
            for measure in measures {
                let error = run.error(measure);
                assert!(error <= EXACT, "{scene}, dt {dt}: {measure} {error}");
            }
            assert_eq!(run.totals.unsolved_islands, 0);
        }
    }
}

/// A block on a slope: gravity `(along, -across)` [m/s²], its speed at the start along the slope.
fn on_slope(along: f64, across: f64, friction: f64, speed: f64, time: f64) -> String {
    format!(
        "[scene]\nname = \"slope\"\ntitle = \"A slope\"\n[gravity]\nx = {along:?}\n\
         y = {:?}\n[step]\ntime = {time:?}\nevents = true\n[[material]]\nname = \"m\"\n\
         friction = {friction:?}\n[[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [40, 2]\n\
         position = [0, -1]\n[[body]]\nname = \"block\"\nbox = [1, 0.4]\nposition = [0, 0.2]\n\
         velocity = [{speed:?}, 0]\n",
        -across
    )
}

/// With friction steeper than the slope it stops and stays; with less it turns back.
#[test]
fn a_block_on_a_slope_stops_and_stays_or_turns_back() {
    let (along, across, time) = (3.0, 9.0, 1.5);
    for (friction, speed) in [(0.5, 1.3), (0.4, 0.7), (0.5, -2.1), (0.36, -1.7)] {
        let run = run(&parse(&on_slope(along, across, friction, speed, time)));
        let held = along - speed.signum() * friction * across;
        let stop = -speed / held;
        let (pose, u) = run.state(1);
        let x = 0.5 * speed * stop;
        assert!(stop < time, "{stop}");
        let error = (pose.translation.x - x).abs();
        assert!(error <= EXACT, "mu {friction}, {speed} m/s: {error} m");
        assert!(u.norm() <= EXACT, "{u:?}");
    }
    for (friction, speed) in [(0.2, -1.1), (0.3, -2.3)] {
        let run = run(&parse(&on_slope(along, across, friction, speed, time)));
        let (up, down) = (along + friction * across, along - friction * across);
        let left = time + speed / up;
        let x = -0.5 * speed * speed / up + 0.5 * down * left * left;
        let (pose, u) = run.state(1);
        let error = (pose.translation.x - x).abs();
        assert!(error <= EXACT, "mu {friction}, {speed} m/s: {error} m");
        assert!((u.x - down * left).abs() <= EXACT, "{u:?}");
    }
}

/// Each of several blocks stops at its own time, also two that stop in the same step.
#[test]
fn blocks_stop_each_at_its_own_time() {
    let speeds = [1.0, 1.003, 1.9, 2.7, 0.31, 1.007];
    let mut text = "[scene]\nname = \"blocks\"\ntitle = \"Blocks\"\n[step]\ntime = 1\n\
                    events = true\n[[material]]\nname = \"m\"\nfriction = 0.4\n[[body]]\n\
                    name = \"floor\"\nkind = \"fixed\"\nbox = [100, 2]\nposition = [0, -1]\n"
        .to_owned();
    for (k, speed) in speeds.iter().enumerate() {
        text.push_str(&format!(
            "[[body]]\nname = \"b{k}\"\nbox = [1, 0.4]\nposition = [{}, 0.2]\n\
             velocity = [{speed:?}, 0]\n",
            5 * k
        ));
    }
    let run = run(&parse(&text));
    for (k, speed) in speeds.into_iter().enumerate() {
        let x = run.state(k + 1).0.translation.x - 5.0 * k as f64;
        let exact = speed * speed / (2.0 * 0.4 * 9.81);
        assert!((x - exact).abs() <= EXACT, "block {k}: {x} {exact}");
    }
}

/// Three boxes that slide on each other stop one after the other: few intervals a step, and the
/// whole momentum goes into the floor.
#[test]
fn a_sliding_stack_does_not_chatter() {
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let mut text = format!(
            "[scene]\nname = \"stack\"\ntitle = \"A stack\"\n[step]\ntime = 1.5\ndt = {dt:?}\n\
             events = true\n[[material]]\nname = \"m\"\nfriction = 0.3\n[[body]]\n\
             name = \"floor\"\nkind = \"fixed\"\nbox = [40, 2]\nposition = [0, -1]\n"
        );
        for (k, speed) in [1.0, -0.7, 1.9].into_iter().enumerate() {
            text.push_str(&format!(
                "[[body]]\nname = \"b{k}\"\nbox = [3, 0.2]\nposition = [0, {:?}]\n\
                 velocity = [{speed:?}, 0]\n",
                0.1 + 0.2 * k as f64
            ));
        }
        let run = run(&parse(&text));
        let mut cut = 0;
        for record in &run.records {
            let mut times: Vec<f64> = record.contacts.iter().map(|c| c.time).collect();
            times.sort_by(f64::total_cmp);
            times.dedup();
            assert!(times.len() <= 4, "{times:?}");
            cut += usize::from(times.len() > 1);
        }
        // one end of a slide for each pair, perhaps two where one stops and is dragged on
        assert!((2..=8).contains(&cut), "{cut}");
        for k in 1..=3 {
            assert!(run.state(k).1.norm() <= EXACT, "{:?}", run.state(k).1);
        }
        assert!(run.totals.energy_rise <= 1e-9 && run.totals.imbalance <= 1e-9);
        assert_eq!(run.totals.unsolved_islands, 0);
    }
}
