//! A taut bridge: planks pinned in a straight line between two supports. Whatever the load, its pins hold it
//! by their tension alone, which grows beyond all bounds as the sag goes to zero.

use crate::common::parse;
use moreau2d::dynamics::record::StepRecord;
use moreau2d::experiment::Engine;
use std::fmt::Write;

/// A bridge of planks of half a metre, and what else is in the scene.
fn bridge(planks: usize, dt: f64, more: &str) -> String {
    let length = 0.5 * planks as f64;
    let mut text = format!(
        "[scene]\nname = \"bridge\"\ntitle = \"A taut bridge under a load\"\n\n[step]\ndt = {dt}\n\n\
         [[material]]\nname = \"wood\"\nfriction = 0.8\n"
    );
    for (name, x) in [("left", -2.0), ("right", length + 2.0)] {
        let body = "kind = \"fixed\"\nbox = [4, 1]\n";
        write!(
            text,
            "\n[[body]]\nname = \"{name}\"\n{body}position = [{x}, -0.5]\n"
        )
        .unwrap();
    }
    let mut before = "left".to_owned();
    for k in 0..=planks {
        let next = match k == planks {
            true => "right".to_owned(),
            false => format!("plank{k}"),
        };
        if k < planks {
            let x = 0.25 + 0.5 * k as f64;
            let body = "box = [0.5, 0.1]\ndensity = 400\n";
            write!(
                text,
                "\n[[body]]\nname = \"{next}\"\n{body}position = [{x}, -0.05]\n"
            )
            .unwrap();
        }
        let at = 0.5 * k as f64;
        write!(
            text,
            "\n[[joint]]\nkind = \"revolute\"\nbodies = [\"{before}\", \"{next}\"]\nat = [{at}, -0.05]\n"
        )
        .unwrap();
        before = next;
    }
    text + more
}

fn steps(text: &str, flags: &[&str], steps: usize) -> Vec<StepRecord> {
    let mut scene = parse(text);
    scene.step.events = flags.contains(&"events");
    let mut built = scene.build().unwrap();
    let step = |_| Engine::Moreau.step(&mut built).unwrap();
    (0..steps).map(step).collect()
}

/// Bug: the tension of a bridge that sags by a micrometre is 1e5 times its load. Newton's steps with a
/// proximal term approached it by a part in a hundred each, and gave up: a bridge of two planks was
/// uncertified in 208 of 240 steps, with 630 factorisations each.
#[test]
fn a_disc_rolls_over_a_taut_bridge() {
    for (planks, most) in [(2, 4.0), (3, 4.0), (6, 8.0), (16, 15.0)] {
        let disc = "\n[[body]]\nname = \"disc\"\ndisc = 0.2\ndensity = 1000\nposition = [-0.3, 0.2]\n\
                    velocity = [1, 0]\nspin = -5\n";
        let records = steps(&bridge(planks, 1.0 / 60.0, disc), &[], 120);
        let unsolved: usize = records.iter().map(|r| r.unsolved).sum();
        let work: usize = records.iter().map(|r| r.factorisations).sum();
        let gap = records.iter().map(|r| r.joint_gap).fold(0.0, f64::max);
        println!("{planks} planks: {unsolved} unsolved, {work} factorisations, gap {gap:.1e} m");
        // steps in which the bridge is straight within round-off
        assert!(unsolved <= 3, "{planks}: {unsolved}");
        assert!(work as f64 <= most * 120.0, "{planks}: {work}");
        assert!(gap < 5e-4, "{planks}: {gap}");
    }
}

/// Bug: where the bridge is straight within 1e-8 m, tensions of 1e9 N s were certified, as round-off of such
/// impulses is. It did 1e10 J of work on a truck of a tonne. The bound on what pins give took their velocity
/// for exact, and did not see it.
#[test]
fn a_truck_drives_over_a_taut_bridge_and_no_pin_gives_energy() {
    let mut truck =
        "\n[[body]]\nname = \"truck\"\nbox = [1.6, 0.4]\nposition = [-2, 0.7]\ndensity = 300\n"
            .to_owned();
    for (name, x) in [("front", -1.4), ("rear", -2.6)] {
        write!(
            truck,
            "\n[[body]]\nname = \"{name}\"\ndisc = 0.3\nposition = [{x}, 0.301]\ndensity = 200\n\n\
             [[joint]]\nkind = \"revolute\"\nbodies = [\"truck\", \"{name}\"]\nat = [{x}, 0.301]\n\
             motor = {{ speed = -6, max_torque = 200 }}\n"
        )
        .unwrap();
    }
    let records = steps(&bridge(16, 0.004, &truck), &["events"], 1500);
    let failed: usize = records.iter().map(|r| r.failed).sum();
    let given = |r: &StepRecord| r.energy.joints.max(0.0);
    let most = records.iter().map(given).fold(0.0, f64::max);
    let net: f64 = records.iter().map(|r| r.energy.joints).sum();
    let kinetic = records
        .iter()
        .map(|r| r.energy.kinetic_end)
        .fold(0.0, f64::max);
    println!("pins: {most} J at most in a step, {net} J in all, of {kinetic} J");
    assert_eq!(failed, 0);
    assert!(net < 0.0 && most < 0.01 * kinetic, "{net} and {most} J");
    assert!(kinetic < 600.0, "{kinetic}");
}
