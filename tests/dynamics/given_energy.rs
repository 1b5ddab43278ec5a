//! Contacts and joints give no energy that they did not take before.

use crate::common::{Random, parse};
use moreau2d::dynamics::record::{ContactRecord, ContactStatus};
use moreau2d::experiment::{Engine, simulate};
use std::fmt::Write;

/// Energy that contacts and joints may give, as a share of the largest kinetic energy.
const GIVEN: f64 = 1e-9;

/// One to eight bodies of all convex shapes with spin over a floor or a slope, half of them in chains,
/// some of which hang from the world.
fn scene(random: &mut Random) -> String {
    let dt = [1.0 / 30.0, 1.0 / 60.0, 1.0 / 240.0][random.below(3)];
    let (friction, restitution) = (random.between(0.0, 1.0), random.between(-0.5, 0.8).max(0.0));
    let slope = random.between(-0.3, 0.6).max(0.0);
    let mut text = format!(
        "[scene]\nname = \"fuzz\"\ntitle = \"fuzz\"\n\n[gravity]\nslope = {slope:?}\n\n\
         [step]\ntime = 2\ndt = {dt:?}\n\n[[material]]\nname = \"m\"\nfriction = {friction:?}\n\
         restitution = {restitution:?}\n\n\
         [[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [400, 2]\nposition = [0, -1]\n"
    );
    let height = random.between(0.5, 3.0);
    for k in 0..1 + random.below(8) {
        let shape = match random.below(4) {
            0 => "disc = 0.2".to_owned(),
            1 => format!("box = [{:?}, 0.3]", random.between(0.1, 0.6)),
            2 => "capsule = [0.3, 0.1]".to_owned(),
            _ => "polygon = [[-0.2, -0.15], [0.25, -0.1], [0.1, 0.25]]".to_owned(),
        };
        let x = 0.7 * k as f64;
        write!(
            text,
            "\n[[body]]\nname = \"b{k}\"\n{shape}\nposition = [{x:?}, {height:?}]\n\
             angle = {:?}\nvelocity = [{:?}, {:?}]\nspin = {:?}\n",
            random.between(-3.0, 3.0),
            random.between(-3.0, 3.0),
            random.between(-3.0, 3.0),
            random.between(-20.0, 20.0),
        )
        .unwrap();
        if random.below(2) == 0 {
            let other = match k {
                0 => "world".to_owned(),
                _ => format!("b{}", k - 1),
            };
            write!(
                text,
                "\n[[joint]]\nkind = \"revolute\"\nbodies = [\"{other}\", \"b{k}\"]\n\
                 at = [{:?}, {height:?}]\n",
                x - 0.35
            )
            .unwrap();
        }
    }
    text
}

/// Energy given in a run over the largest kinetic energy, and energy returned over the same.
fn given(text: &str) -> [f64; 2] {
    let scene = parse(text);
    let mut built = scene.build().unwrap();
    let steps = (scene.step.time / scene.step.dt).round() as usize;
    let mut largest = 0.0;
    let totals = simulate(&mut built, Engine::Moreau, steps, |record, _| {
        largest = f64::max(largest, record.energy.kinetic_end);
        Ok(())
    });
    let totals = totals.unwrap_or_else(|e| panic!("{e}\n{text}"));
    let given = totals.constraint_gain + totals.impact_gain;
    [given, -totals.work_returned].map(|energy| energy / largest)
}

fn fuzz(seeds: std::ops::Range<u64>) {
    let (mut worst, mut returned, mut bad) = ((0.0, 0), 0, 0);
    let count = seeds.end - seeds.start;
    for seed in seeds {
        let text = scene(&mut Random(seed));
        let [given, back] = given(&text);
        if given > worst.0 {
            worst = (given, seed);
        }
        returned += usize::from(back > GIVEN);
        if given > GIVEN {
            println!("seed {seed}: {given:.2e}");
            bad += 1;
        }
    }
    println!(
        "worst {:.1e} of seed {}, {returned} of {count} returned energy",
        worst.0, worst.1
    );
    assert_eq!(bad, 0, "scenes in which contacts and joints gave energy");
    assert!(
        10 * returned as u64 > count,
        "{returned} of {count} show something"
    );
}

/// Pins of a pendulum gave 1.5e-5 of its energy in a swing at 1/60 s, those of two 3.8e-5, and a corner
/// that began to slip 1e-6.
#[test]
fn contacts_and_joints_of_fuzzed_scenes_give_none() {
    fuzz(0..1000);
}

#[test]
#[ignore = "a minute"]
fn nor_do_those_of_ten_thousand() {
    fuzz(1000..11_000);
}

/// Bug: a contact that stuck on a row that turns was recorded as slipping where its island paid a debt.
/// Seeds that showed it; steps whose solutions are blended may slip inside the cone.
#[test]
fn contacts_inside_their_cone_stick_where_energy_is_returned() {
    let mut stuck = 0;
    for seed in [12, 56, 128, 149] {
        let scene = parse(&scene(&mut Random(seed)));
        let friction = scene.materials[0].friction;
        let mut built = scene.build().unwrap();
        let steps = (scene.step.time / scene.step.dt).round() as usize;
        let run = simulate(&mut built, Engine::Moreau, steps, |record, _| {
            let blended = record.capped + record.joints_capped + record.relaxed > 0;
            if record.drag.is_empty() || blended || record.unsolved > 0 {
                return Ok(());
            }
            let inside = |c: &&ContactRecord| {
                let rests = c.impulse_t.abs() < 0.9 * friction * c.impulse_n;
                rests && c.status != ContactStatus::Impact
            };
            for c in record.contacts.iter().filter(inside) {
                assert_eq!(c.status, ContactStatus::Stick, "seed {seed}: {c:?}");
                stuck += 1;
            }
            Ok(())
        });
        run.unwrap();
    }
    assert!(stuck > 20, "{stuck}");
}
