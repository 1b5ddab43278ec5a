//! Bodies that others push into a third one within the same step, measured on their corners alone.

use super::meetings::{corners, depth};
use crate::common::{Random, parse};
use moreau2d::contact::Vec2;
use moreau2d::experiment::{Engine, simulate};
use moreau2d::scene::Built;
use std::f64::consts::FRAC_PI_4;

/// Half the side of all boxes \[m\].
const HALF: f64 = 0.125;

/// A box at rest is hit by a fast one, and pushed past a corner of a third: both corners are 5 to 40 mm apart.
fn pushed(seed: u64) -> String {
    let mut random = Random(seed);
    let mut text =
        "[scene]\nname = \"pushed\"\ntitle = \"One box pushes another\"\n[gravity]\ny = 0\n\
                    [step]\ntime = 0.2\n[[material]]\nname = \"m\"\nfriction = 0.3\n"
            .to_owned();
    let turns = [(); 3].map(|()| random.between(-0.3, 0.3));
    let corner = |turn: f64| {
        let (sin, cos) = (turn + FRAC_PI_4).sin_cos();
        HALF * 2f64.sqrt() * Vec2::new(cos, sin)
    };
    let toward = random.between(0.5, 1.07);
    let gap = random.between(0.005, 0.04) * Vec2::new(toward.cos(), toward.sin());
    // the third box turns its lower left corner to the upper right one of the first
    let third = corner(turns[0]) + gap + corner(turns[2]);
    let from = random.between(0.4, 1.17);
    let back = Vec2::new(from.cos(), from.sin());
    let speed = random.between(3.0, 9.0);
    let second = -(0.36 + random.between(0.0, 0.1)) * back;
    let places = [Vec2::zeros(), second, third];
    let velocities = [Vec2::zeros(), speed * back, Vec2::zeros()];
    for k in 0..3 {
        let (x, u) = (places[k], velocities[k]);
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nbox = [{size}, {size}]\ndensity = 16\nposition = [{:?}, {:?}]\n\
             angle = {:?}\nvelocity = [{:?}, {:?}]\n",
            x.x,
            x.y,
            turns[k],
            u.x,
            u.y,
            size = 2.0 * HALF,
        );
    }
    text
}

/// Of boxes of 1 kg.
fn momentum(built: &Built) -> [f64; 2] {
    let all = (0..3).map_while(|k| built.state(k));
    all.fold([0.0; 2], |[x, y], (_, u)| [x + u.x, y + u.y])
}

/// Bug: corner to corner, two boxes have no contact unless they are about to meet by their own velocities.
/// One that was hit in the same step ended it up to 82 mm deep in the other in a tumbler.
#[test]
fn who_is_pushed_past_a_corner_meets_it() {
    let mut over = [0; 2];
    for seed in 0..300 {
        let mut built = parse(&pushed(seed)).build().unwrap();
        let before = momentum(&built);
        let mut deepest = 0.0f64;
        simulate(&mut built, Engine::Moreau, 12, |record, built| {
            assert_eq!(record.unsolved, 0, "{seed}");
            let own = [0, 2].map(|k| corners(built, k, [HALF; 2]));
            deepest = deepest.max(depth(&own[0], &own[1]));
            Ok(())
        })
        .unwrap();
        for (now, before) in momentum(&built).iter().zip(before) {
            assert!((now - before).abs() < 1e-9, "{seed}: {now} {before}");
        }
        over[0] += usize::from(deepest > 1e-5);
        over[1] += usize::from(deepest > 6e-3);
    }
    println!("{over:?} of 300");
    assert!(over[0] > 100 && over[1] == 0, "{over:?}");
}

/// What passes a corner is not stopped by it: a box that is pushed beside another one keeps its velocity.
#[test]
fn who_is_pushed_past_no_corner_goes_on() {
    let scene = |with: bool| {
        let third = "[[body]]\nname = \"c\"\nbox = [0.25, 0.25]\nposition = [0.28, 0.255]\n";
        let text = format!(
            "[scene]\nname = \"past\"\ntitle = \"A box passes\"\n[gravity]\ny = 0\n[step]\ntime = 0.2\n\
             [[body]]\nname = \"a\"\nbox = [0.25, 0.25]\nposition = [0, 0]\n\
             [[body]]\nname = \"b\"\nbox = [0.25, 0.25]\nposition = [-0.33, 0]\nvelocity = [6, 0]\n{}",
            if with { third } else { "" }
        );
        let mut built = parse(&text).build().unwrap();
        simulate(&mut built, Engine::Moreau, 12, |_, _| Ok(())).unwrap();
        built.state(0).unwrap().1
    };
    assert!(scene(true) == scene(false) && scene(true).x > 2.9);
}

/// The states of `bodies` of a scene over twelve steps.
fn path(text: &str, bodies: std::ops::Range<usize>) -> Vec<[f64; 6]> {
    let mut built = parse(text).build().unwrap();
    let mut path = Vec::new();
    simulate(&mut built, Engine::Moreau, 12, |_, built| {
        for (pose, u) in bodies.clone().map(|k| built.state(k).unwrap()) {
            let x = pose.translation;
            path.push([x.x, x.y, pose.sin, u.x, u.y, u.z]);
        }
        Ok(())
    })
    .unwrap();
    path
}

/// Bug: a lone landing that was to be located was forgotten where the step was solved again for others: the disc
/// went on into the plate.
#[test]
fn a_lone_landing_elsewhere_is_located_as_ever() {
    // in the second step, in which boxes are driven most often, they land too slowly to be deferred at once
    let (radius, step, gravity) = (5e-4, 1.0 / 60.0, 10.0);
    let mut far = "[[material]]\nname = \"bouncy\"\nrestitution = 0.05\n[[body]]\nname = \"plate\"\nkind = \"fixed\"\n\
                   box = [4, 1]\nposition = [50, -0.5]\nmaterial = \"bouncy\"\n"
        .to_owned();
    for k in 0..4 {
        let speed = gravity * step - (0.02 + 0.0015 * f64::from(k));
        far += &format!(
            "[[body]]\nname = \"d{k}\"\ndisc = {radius}\nmaterial = \"bouncy\"\nposition = [{:?}, {:?}]\n\
             velocity = [0, {speed:?}]\n",
            50.0 + 0.1 * f64::from(k),
            radius + 1e-5 - step * (speed - 0.5 * gravity * step),
        );
    }
    for seed in 0..20 {
        let boxes = pushed(seed).replace("y = 0\n", &format!("y = -{gravity}\n"));
        let (head, _) = boxes.split_once("[[body]]").unwrap();
        let alone = path(&format!("{head}{far}"), 1..5);
        assert_eq!(path(&format!("{boxes}{far}"), 4..8), alone, "{seed}");
    }
}

/// Bug: where a scene has joints, the contacts that a solution drives bodies into were taken for free ones.
#[test]
fn joints_elsewhere_change_nothing() {
    let far = "[[body]]\nname = \"post\"\nkind = \"fixed\"\ndisc = 0.1\nposition = [50, 0]\n\
               [[body]]\nname = \"arm\"\nbox = [1, 0.1]\nposition = [50.5, 0]\n\
               [[joint]]\nkind = \"revolute\"\nbodies = [\"post\", \"arm\"]\nat = [50, 0]\n";
    for seed in 0..300 {
        let boxes = pushed(seed);
        assert_eq!(
            path(&format!("{boxes}{far}"), 0..3),
            path(&boxes, 0..3),
            "{seed}"
        );
    }
}
