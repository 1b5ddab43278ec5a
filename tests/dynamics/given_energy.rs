//! Contacts and joints give no energy that they did not take before.

use crate::common::{Random, parse};
use moreau2d::dynamics::record::{ContactRecord, ContactStatus};
use moreau2d::experiment::{Engine, simulate};
use moreau2d::scene::Built;
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

/// A polygon and a box that tumble over a smooth slope without gravity, and meet there.
fn sliding(random: &mut Random) -> (String, [f64; 2]) {
    let angle = random.between(-0.5, 0.5);
    let (sin, cos) = angle.sin_cos();
    let mut text = format!(
        "[scene]\nname = \"slide\"\ntitle = \"slide\"\n[gravity]\ny = 0\n\
         [step]\ntime = 1\ndt = 0.0166\nevents = true\n[[material]]\nname = \"ice\"\n\
         friction = 0\nrestitution = 0.5\n[[body]]\nname = \"floor\"\nkind = \"fixed\"\n\
         box = [60, 2]\nangle = {angle:?}\nposition = [{sin:?}, {:?}]\n",
        -cos
    );
    for (k, shape) in [
        "box = [0.4, 0.2]",
        "polygon = [[-0.2, -0.2], [0.16, -0.18], [0.22, 0.06], [0, 0.2], [-0.18, 0.12]]",
    ]
    .iter()
    .enumerate()
    {
        let along = random.between(-0.05, 0.05);
        let over = 0.4 + 0.6 * k as f64;
        let [speed, fall] = [random.between(0.4, 2.0), random.between(0.5, 9.0)];
        write!(
            text,
            "[[body]]\nname = \"b{k}\"\n{shape}\nmass = 1\nposition = [{:?}, {:?}]\n\
             velocity = [{:?}, {:?}]\nspin = {:?}\nangle = {:?}\n",
            cos * along - sin * over,
            sin * along + cos * over,
            cos * speed + sin * fall,
            sin * speed - cos * fall,
            random.between(-25.0, 25.0),
            random.between(-3.0, 3.0),
        )
        .unwrap();
    }
    (text, [cos, sin])
}

/// Bug: an island with a support paid with all its velocities, those along a smooth floor too. In some of these
/// scenes their momentum changed by up to 6e-3 of itself.
#[test]
fn what_pays_on_a_smooth_slope_keeps_its_momentum_along_it() {
    let mut paid = 0;
    for seed in 0..1000 {
        let (text, along) = sliding(&mut Random(seed));
        let scene = parse(&text);
        let mut built = scene.build().unwrap();
        let momentum = |built: &Built| {
            let all = (0..3).map_while(|k| built.state(k));
            all.map(|(_, u)| u.x * along[0] + u.y * along[1])
                .sum::<f64>()
        };
        let first = momentum(&built);
        let run = simulate(&mut built, Engine::Moreau, 60, |_, built| {
            let now = momentum(built);
            assert!(
                (now - first).abs() < 1e-6 * first,
                "{seed}: {now} for {first}"
            );
            Ok(())
        });
        paid += usize::from(run.unwrap().work_returned < -1e-9);
    }
    println!("{paid} of 1000 paid");
    assert!(paid > 0, "none paid");
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

/// A double rotor on a heavy free base, beside an arm that falls on a post `gap` below it, without gravity.
fn rotor([one, two]: [f64; 2], gap: f64) -> String {
    // the second rod begins where the first one ends
    let (s, c) = 0.7f64.sin_cos();
    let place = [1.0 + 0.5 * c, 0.5 * s];
    let velocity = [-0.5 * s * two, one + 0.5 * c * two];
    format!(
        "[scene]\nname = \"rotor\"\ntitle = \"rotor\"\n[gravity]\nx = 0\ny = 0\n\
         [step]\ntime = 0.1\ndt = 0.01\n\
         [[material]]\nname = \"m\"\nfriction = 0\nrestitution = 0.5\n\
         [[body]]\nname = \"post\"\nkind = \"fixed\"\ndisc = 0.1\nposition = [-1.3, {:?}]\n\
         [[body]]\nname = \"base\"\nbox = [0.2, 0.2]\nmass = 1000\ninertia = 1000\n\
         position = [0, 0]\n\
         [[body]]\nname = \"one\"\nbox = [0.8, 0.1]\nmass = 10\ninertia = 1\nposition = [0.5, 0]\n\
         velocity = [0, {:?}]\nspin = {one:?}\n\
         [[body]]\nname = \"two\"\nbox = [0.8, 0.1]\nmass = 10\ninertia = 1\n\
         position = {place:?}\nangle = 0.7\nvelocity = {velocity:?}\nspin = {two:?}\n\
         [[body]]\nname = \"arm\"\nbox = [1, 0.1]\nmass = 1\ninertia = 0.1\n\
         position = [-0.9, 0]\nvelocity = [0, -0.06]\nspin = 0.1\n\
         [[joint]]\nkind = \"revolute\"\nbodies = [\"base\", \"one\"]\nat = [0, 0]\n\
         [[joint]]\nkind = \"revolute\"\nbodies = [\"one\", \"two\"]\nat = [1, 0]\n\
         [[joint]]\nkind = \"revolute\"\nbodies = [\"base\", \"arm\"]\nat = [-0.3, 0]\n",
        -0.15 - gap,
        0.5 * one
    )
}

/// Bug: where the pins of a fast island gave energy in the step of an impact, the bound of the impact took
/// up to a third of its rebound, though it had no part in that. Debts may take some, here 0.002.
#[test]
fn a_small_impact_in_a_fast_island_keeps_its_rebound() {
    for spins in [[10.0, -20.0], [20.0, -40.0], [20.0, -20.0], [30.0, -30.0]] {
        for steps in 3..8 {
            let text = rotor(spins, 1e-3 * (steps as f64 + 0.5));
            let mut built = parse(&text).build().unwrap();
            let mut met = 0;
            let run = simulate(&mut built, Engine::Moreau, steps + 1, |record, _| {
                for hit in &record.impacts {
                    let mean = -hit.energy_lost / hit.impulse_n;
                    let rebound = 2.0 * mean / hit.approach_speed + 1.0;
                    let what = format!("{spins:?}, step {steps}: {rebound}");
                    assert!((0.495..0.5 + 1e-9).contains(&rebound), "{what}");
                    met += 1;
                }
                Ok(())
            });
            run.unwrap();
            assert_eq!(met, 1, "{spins:?}, step {steps}");
            let [given, _] = given(&text);
            assert!(given < GIVEN, "{spins:?}, step {steps}: {given}");
        }
    }
}

/// Bug: what happened around impacts located in time was in no account. Where neither friction nor impacts
/// take energy, pins gave up to 4e-3 in these of 5000 scenes. (Two more scenes give 5e-4 and 4e-5 still.)
#[test]
fn bodies_around_located_impacts_keep_the_account() {
    for seed in [1194, 3570, 4280] {
        let text = scene(&mut Random(seed)).replace("[step]", "[step]\nevents = true");
        let lossless = |line| match line {
            _ if str::starts_with(line, "friction") => "friction = 0",
            _ if line.starts_with("restitution") => "restitution = 1",
            _ => line,
        };
        let lines: Vec<&str> = text.lines().map(lossless).collect();
        let [given, _] = given(&lines.join("\n"));
        assert!(given < GIVEN, "seed {seed}: {given:.1e}");
    }
}
