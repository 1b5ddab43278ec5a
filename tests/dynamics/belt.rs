//! A belt of pinned links on two pulleys, and one that slips round a drum.

use crate::common::{load, order, parse};
use moreau2d::checkpoint::{Reader, Writer};
use moreau2d::experiment::Engine;
use std::f64::consts::PI;
use std::fmt::Write;

/// Links on each half circle and on each straight part.
const BENT: usize = 9;
const STRAIGHT: usize = 15;
/// Half thickness of a link, distance of its pins from the axis of a pulley, slack \[m\].
const THICK: f64 = 0.02;
const RADIUS: f64 = 0.42;
const SLACK: f64 = 5e-3;

/// Pins of the belt in order, and the distance of the axes from the middle \[m\].
fn pins() -> (Vec<[f64; 2]>, f64) {
    let link = 2.0 * RADIUS * (PI / (2 * BENT) as f64).sin();
    let half = 0.5 * STRAIGHT as f64 * link;
    let mut pins = Vec::new();
    for side in [1.0, -1.0] {
        for k in 0..STRAIGHT {
            pins.push([side * (k as f64 * link - half), side * RADIUS]);
        }
        for k in 0..BENT {
            let angle = side * 0.5 * PI - PI * k as f64 / BENT as f64;
            pins.push([side * half + RADIUS * angle.cos(), RADIUS * angle.sin()]);
        }
    }
    (pins, half)
}

/// `mass` of a link \[kg\].
fn belt(mass: f64) -> String {
    let (pins, half) = pins();
    // links touch a pulley with their middle
    let disc = RADIUS * (PI / (2 * BENT) as f64).cos() - THICK;
    let mut text = "[scene]\nname = \"belt\"\ntitle = \"A belt drives a pulley\"\n\n\
                    [[material]]\nname = \"rubber\"\nfriction = 0.8\n"
        .to_owned();
    for (name, side) in [("driver", -1.0), ("driven", 1.0)] {
        let at = side * (half - SLACK);
        let motor = match name {
            "driver" => "motor = { speed = -5, max_torque = 200 }\n",
            _ => "",
        };
        write!(
            text,
            "\n[[body]]\nname = \"{name}\"\ndisc = {disc}\nmass = 5\nposition = [{at}, 0]\n\n\
             [[joint]]\nkind = \"revolute\"\nbodies = [\"world\", \"{name}\"]\nat = [{at}, 0]\n{motor}"
        )
        .unwrap();
    }
    for (k, a) in pins.iter().enumerate() {
        let b = pins[(k + 1) % pins.len()];
        let (x, y) = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]));
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let (length, angle, next) = (dx.hypot(dy), dy.atan2(dx), (k + 1) % pins.len());
        write!(
            text,
            "\n[[body]]\nname = \"link{k}\"\ncapsule = [{length}, {THICK}]\nmass = {mass}\n\
             position = [{x}, {y}]\nangle = {angle}\n\n[[joint]]\nkind = \"revolute\"\n\
             bodies = [\"link{k}\", \"link{next}\"]\nat = [{}, {}]\n",
            b[0], b[1]
        )
        .unwrap();
    }
    text
}

/// Bug: the turning of links under tension is explicit, and was unstable at 1/60 s: the pins opened
/// by decimetres, the pulley ran 20 % too fast, or the belt was lost. With an added inertia alone they
/// opened by 8 mm and links pressed 42 mm into the pulleys while the belt came under tension.
#[test]
fn a_belt_drives_a_pulley_at_a_sixtieth() {
    let mut built = parse(&belt(0.05)).build().unwrap();
    let (mut gap, mut overlap, mut motor, mut turned, mut cut) = (0f64, 0f64, 0.0, 0.0, 0);
    for step in 0..300 {
        let record = Engine::Moreau.step(&mut built).unwrap();
        assert_eq!(record.unsolved, 0, "step {step}");
        let energy = &record.energy;
        assert!(energy.imbalance().abs() < 1e-10, "step {step}: {energy:?}");
        motor += energy.motors;
        cut += record.cut;
        gap = gap.max(record.joint_gap);
        overlap = overlap.max(record.penetration);
        if step >= 60 {
            turned += built.state(1).unwrap().1.z / 240.0;
        }
    }
    assert!(gap < 1e-3, "{gap} m");
    assert!(overlap < 1e-3, "{overlap} m");
    assert!((turned + 5.0).abs() < 0.05, "{turned} rad/s");
    // 27.6 J at 1/960 s
    assert!((26.0..29.0).contains(&motor), "{motor} J");
    assert!((280..300).contains(&cut), "{cut}");
}

/// A saved state knows which links are stepped in parts.
#[test]
fn a_belt_in_parts_goes_on_bit_for_bit() {
    let scene = parse(&belt(0.05));
    let mut one = scene.build().unwrap();
    for _ in 0..40 {
        Engine::Moreau.step(&mut one).unwrap();
    }
    let mut saved = Writer::default();
    one.save(&mut saved).unwrap();
    let mut two = scene.build().unwrap();
    two.load(&mut Reader::new(saved.bytes().to_vec())).unwrap();
    for step in 0..20 {
        let [a, b] = [&mut one, &mut two].map(|built| Engine::Moreau.step(built).unwrap());
        assert_eq!(a.cut, 1, "step {step}");
        assert!(a == b, "step {step}");
    }
}

/// Bodies that land on a belt in parts are held as on any other floor, with events and without.
#[test]
fn boxes_land_on_a_belt_in_parts() {
    for events in [false, true] {
        let mut text = belt(0.05).replace(
            "title = \"A belt drives a pulley\"\n",
            &format!("title = \"t\"\n\n[step]\nevents = {events}\n"),
        );
        for k in 0..2 {
            let x = 0.5 * f64::from(k) - 0.4;
            text += &format!(
                "\n[[body]]\nname = \"box{k}\"\nbox = [0.2, 0.2]\nmass = 0.5\n\
                 position = [{x}, 1]\nvelocity = [0, -5]\nangle = 0.3\n"
            );
        }
        let scene = parse(&text);
        let mut built = scene.build().unwrap();
        let (mut last, mut gap, mut cut) = (f64::INFINITY, 0f64, 0);
        for step in 0..90 {
            let record = Engine::Moreau.step(&mut built).unwrap();
            assert_eq!(record.unsolved, 0, "step {step}, events {events}");
            let energy = &record.energy;
            assert!(energy.imbalance().abs() < 1e-9, "step {step}: {energy:?}");
            cut += record.cut;
            gap = gap.max(record.joint_gap);
            last = if step < 60 {
                0.0
            } else {
                f64::max(last, record.penetration)
            };
        }
        assert!(cut > 60, "{cut}");
        assert!(gap < 1e-3, "events {events}: {gap} m");
        assert!(last < 1e-3, "events {events}: {last} m");
    }
}

/// Bug: the contact of a flat link rolls along it as it turns on the drum, which makes it twice as stiff as
/// its pins do. That was not known to the added inertia: links pressed 12 mm deep into the drum at 1/60 s and
/// pins opened by five links at 1/500 s.
#[test]
fn a_belt_slips_round_a_drum_at_any_step() {
    let mut overlaps = Vec::new();
    for hz in [60, 120, 240, 480] {
        let scene = load("capstan", &[&format!("step.dt={}", 1.0 / f64::from(hz))]);
        let mut built = scene.build().unwrap();
        let (mut gap, mut overlap, mut sweeps) = (0f64, 0f64, 0);
        for step in 0..hz {
            let record = Engine::Moreau.step(&mut built).unwrap();
            assert_eq!(record.unsolved + record.cut, 0, "1/{hz}, step {step}");
            let energy = &record.energy;
            assert!(energy.imbalance().abs() < 1e-10, "1/{hz}: {energy:?}");
            gap = gap.max(record.joint_gap);
            overlap = overlap.max(record.penetration);
            sweeps += record.sweeps;
        }
        assert!(gap < 3e-4, "1/{hz}: {gap} m");
        overlaps.push(overlap);
        println!("1/{hz}: {overlap:e} m, pins {gap:e} m, {sweeps} sweeps");
    }
    assert!(overlaps[0] < 5e-4, "{overlaps:?}");
    assert!(order(&overlaps) > 1.4, "{overlaps:?}");
}

/// The load of a bar on one pin is no tension: once it has rolled off, the bar swings as it is.
#[test]
fn a_hinged_bar_swings_freely_once_a_disc_has_left_it() {
    let angle = |hz: u32| {
        let scene = parse(&format!(
            "[scene]\nname = \"bar\"\ntitle = \"t\"\n[step]\ndt = {}\n\
             [[body]]\nname = \"post\"\nkind = \"fixed\"\nbox = [0.1, 0.1]\nposition = [0.45, -0.075]\n\
             [[body]]\nname = \"disc\"\nmass = 200\ndisc = 1\nposition = [0.3, 1.025]\nvelocity = [1, 0]\n\
             [[body]]\nname = \"bar\"\nmass = 0.1\nbox = [1.2, 0.05]\nposition = [-0.1, 0]\n\
             [[joint]]\nkind = \"revolute\"\nbodies = [\"world\", \"bar\"]\nat = [0, 0]\n\
             [[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [10, 0.1]\nposition = [5.52, -0.025]\n",
            1.0 / f64::from(hz)
        ));
        let mut built = scene.build().unwrap();
        for _ in 0..hz {
            Engine::Moreau.step(&mut built).unwrap();
        }
        built.state(2).unwrap().0.angle()
    };
    let fine = angle(1920);
    assert!(fine > 0.2, "{fine}");
    assert!(
        (angle(60) / fine - 1.0).abs() < 0.02,
        "{} {fine}",
        angle(60)
    );
}
