//! Overlap that comes after the start is undone by position.

use crate::common::{Random, Run, load, parse, run};
use moreau2d::contact::Vec2;
use moreau2d::dynamics::LARGE_OVERLAP;

/// Two fixed boxes whose upper faces rise from the origin to both sides.
fn valley(slope: f64) -> String {
    let mut text = String::new();
    for (name, sign) in [("left", -1.0), ("right", 1.0)] {
        let along = Vec2::new(sign, slope).normalize();
        let outward = sign * Vec2::new(along.y, -along.x);
        let at = 10.0 * along + 3.0 * outward;
        let angle = along.y.atan2(along.x);
        text += &format!(
            "\n[[body]]\nname = \"{name}\"\nkind = \"fixed\"\nbox = [20, 6]\n\
             position = [{}, {}]\nangle = {angle}\n",
            at.x, at.y
        );
    }
    text
}

/// A body thrown into a groove of two fixed boxes at 45 degrees, after 3 s.
fn thrown(shape: &str, speed: f64, events: bool) -> Run {
    let mut text = format!(
        "[scene]\nname = \"groove\"\ntitle = \"A body is thrown into a groove\"\n\n\
         [step]\ntime = 3\nevents = {events}\n"
    );
    text += &valley(1.0);
    text += &format!(
        "\n[[body]]\nname = \"body\"\n{shape}\nposition = [0.1, 4]\nvelocity = [0, {}]\n\
         angle = 0.2\nspin = 1\n",
        -speed
    );
    run(&parse(&text))
}

/// Bug: of a box that a piston presses into a wall the overlaps contradict each other but for 1e-4 rad by which
/// its sides are off: it was moved up by a tenth of its size in each step, to half a metre and more: with events
/// at 1/60 s, without them at 1/240 s.
/// No motion exists. All that can be asked is that the box stays, and that no overlap exceeds the lack of room.
#[test]
fn a_box_between_closing_walls_does_not_go_up() {
    let each = |parts| ["false", "true"].map(|events| (parts, events));
    for (parts, events) in [60, 120, 240, 480].into_iter().flat_map(each) {
        let dt = format!("step.dt={:?}", 1.0 / f64::from(parts));
        let flag = format!("step.events={events}");
        let run = run(&load("issues/pressed-into-wall", &[&dt, &flag]));
        let (pose, _) = run.state(3);
        let height = pose.translation.y - 0.5;
        assert!(
            height.abs() < 0.1,
            "1/{parts} s, events {events}: {height} m"
        );
        let deepest = (run.totals.penetration).max(run.totals.penetration_impact);
        assert!(deepest < 0.2, "1/{parts} s, events {events}: {deepest} m");
    }
}

/// Bug: the rules of contacts push nothing out faster than it came in, so that overlap left by an
/// impact stayed for ever: 7.7 mm at 2 m/s, 33 mm at 50 m/s. Measured on the corners alone.
#[test]
fn a_groove_holds_what_is_thrown_into_it() {
    let square = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let triangle = [[-0.5, -0.5], [0.5, -0.5], [0.0, 0.5]];
    let mut booked = 0.0;
    for corners in [&square[..], &triangle[..]] {
        let shape = format!("polygon = {corners:?}");
        for speed in [2.0, 5.0, 10.0, 20.0, 50.0] {
            for events in [false, true] {
                let run = thrown(&shape, speed, events);
                let (pose, _) = run.state(2);
                // polygons are given about their centre of mass by the scene's own origin
                let depth = |c: &[f64; 2]| {
                    let p = pose.apply(Vec2::from(*c));
                    (p.x.abs() - p.y) / 2f64.sqrt()
                };
                let deepest = corners.iter().map(depth).fold(f64::NEG_INFINITY, f64::max);
                let what = format!("{shape} at {speed} m/s, events {events}: {deepest:e} m");
                assert!(deepest < 1e-5, "{what}");
                for record in &run.records {
                    let scale = record.energy.kinetic_start.max(1.0);
                    assert!(record.energy.imbalance().abs() < 1e-10 * scale, "{what}");
                    booked += record.energy.recovery;
                }
            }
        }
    }
    assert!(
        booked > 1.0,
        "bodies were lifted without any work: {booked} J"
    );
}

/// A box in a frictionless valley at 1/30 s; the worst overlap that lasted, as a share of its size,
/// and its last speed.
fn slide(size: f64, slope: f64, speed: f64, spin: f64) -> (f64, f64) {
    let mut text = "[scene]\nname = \"valley\"\ntitle = \"A box in a valley\"\n\n[step]\n\
                    dt = 0.03333333333333333\ntime = 3\n\n[[material]]\nname = \"ice\"\n\
                    friction = 0\n"
        .to_owned();
    text += &valley(slope);
    let h = 0.5 * size;
    text += &format!(
        "\n[[body]]\nname = \"body\"\npolygon = [[-{h}, -{h}], [{h}, -{h}], [{h}, {h}], \
         [-{h}, {h}]]\nposition = [1, 2]\nvelocity = [0, -{speed}]\nangle = 0.2\n\
         spin = {spin}\n"
    );
    let run = run(&parse(&text));
    let (lasting, _) = run.built.lasting_overlap().unwrap();
    (lasting, run.state(2).1.norm())
}

/// Bug: the overlap from which a moving pair is moved apart grew with `a Δt²`, and at long steps was
/// above what a scene may have to count as held. It was so in 25 of these 96 scenes, as far as windows of 0.25 s
/// that follow each other told, and then in five. A window that slides finds three more. Four of the eight are small
/// boxes that a step carries deep into the bottom of the valley.
#[test]
fn what_moves_at_long_steps_overlaps_hardly_more_than_a_scene_may() {
    let (mut over, mut slid) = (Vec::new(), 0);
    for size in [0.1, 0.2, 0.4, 1.0] {
        for slope in [0.2, 0.5, 1.0] {
            for speed in [2.0, 5.0, 10.0, 20.0] {
                for spin in [0.0, 10.0] {
                    let (lasting, last) = slide(size, slope, speed, spin);
                    if lasting >= LARGE_OVERLAP {
                        over.push((size, slope, speed, spin, lasting));
                    }
                    slid += usize::from(last > 0.1);
                }
            }
        }
    }
    assert!(over.len() <= 8, "{over:?}");
    assert!(slid > 32, "{slid} are still moving");
}

/// At 0.9 of the limit of friction nothing creeps in a minute, whether it was dropped or laid down.
#[test]
fn nothing_creeps_down_a_slope() {
    let run = |time: f64| {
        run(&parse(&format!(
            "[scene]\nname = \"slope\"\ntitle = \"Boxes on a slope\"\n\n[gravity]\nslope = 0.45\n\n\
             [step]\ntime = {time}\n\n[[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [60, 2]\n\
             position = [0, -1]\n\n[[body]]\nname = \"laid\"\nbox = [1, 1]\nposition = [-3, 0.5]\n\n\
             [[body]]\nname = \"sunk\"\nbox = [1, 1]\nposition = [0, 0.4995]\n\n\
             [[body]]\nname = \"dropped\"\nbox = [1, 1]\nposition = [3, 1.5]\nvelocity = [0, -10]\n\
             angle = 0.1\n"
        )))
    };
    let (early, late) = (run(6.0), run(66.0));
    for body in 1..4 {
        let creep = late.state(body).0.translation - early.state(body).0.translation;
        assert!(creep.norm() < 1e-12, "{body}: {creep}");
    }
}

/// Deepest overlap \[m\] at the end of a run, measured on the poses, and the largest speed \[m/s\].
fn at_the_end(text: &str) -> (f64, f64) {
    let run = run(&parse(text));
    let states = (0..run.built.bodies()).filter_map(|k| run.built.state(k));
    let speed = states.map(|(_, u)| u.norm()).fold(0.0, f64::max);
    (run.records.last().unwrap().penetration, speed)
}

/// Fourteen sticks 50 mm thick fall on each other, the last from 17 m.
#[track_caller]
fn assert_sticks_part(shape: &str) {
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let mut random = Random(5);
        let mut text = format!(
            "[scene]\nname = \"sticks\"\ntitle = \"t\"\n\n[step]\ndt = {dt:?}\ntime = 6\n\n\
             [[material]]\nname = \"wood\"\nfriction = 0.4\n\n\
             [[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [40, 2]\nposition = [0, -1]\n"
        );
        for k in 0..14 {
            let (x, y) = (random.between(-0.4, 0.4), 0.8 + 1.25 * f64::from(k));
            let angle = random.between(-1.5, 1.5);
            text += &format!(
                "\n[[body]]\nname = \"s{k}\"\n{shape}\nposition = [{x:?}, {y:?}]\n\
                 angle = {angle:?}\nspin = {:?}\n",
                random.between(-5.0, 5.0)
            );
        }
        let (overlap, speed) = at_the_end(&text);
        assert!(speed < 1e-3, "{dt} s: {speed} m/s");
        assert!(overlap < 1e-5 * 0.05, "{dt} s: {overlap} m");
    }
}

#[test]
fn a_heap_of_sticks_overlaps_by_nothing_that_lasts() {
    assert_sticks_part("box = [1.2, 0.05]");
}

/// Bug: the middles of two capsules told on which side of each other they lie, also where one had slid
/// beyond the line of the other: they came to cross and stayed so, 40 mm deep.
#[test]
fn nor_does_one_of_round_sticks() {
    assert_sticks_part("capsule = [1.15, 0.025]");
}

/// Discs and boxes in a bin under a piston of a hundred times their weight, which falls on them.
#[test]
fn a_packing_under_a_piston_overlaps_by_nothing_that_lasts() {
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let mut random = Random(6);
        let mut text = format!(
            "[scene]\nname = \"bin\"\ntitle = \"t\"\n\n[step]\ndt = {dt:?}\ntime = 5\n\n\
             [[material]]\nname = \"m\"\nfriction = 0.3\n\n\
             [[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [40, 2]\nposition = [0, -1]\n\n\
             [[body]]\nname = \"left\"\nkind = \"fixed\"\nbox = [2, 20]\nposition = [-2, 10]\n\n\
             [[body]]\nname = \"right\"\nkind = \"fixed\"\nbox = [2, 20]\nposition = [2, 10]\n\n\
             [[body]]\nname = \"piston\"\nbox = [1.99, 0.5]\nposition = [0, 5]\nmass = 4000\n"
        );
        for k in 0..24 {
            let (x, y) = (-0.6 + 0.4 * f64::from(k % 4), 0.3 + 0.6 * f64::from(k / 4));
            let size = random.between(0.15, 0.3);
            let shape = match random.below(2) {
                0 => format!("disc = {:?}", 0.5 * size),
                _ => format!("box = [{size:?}, {size:?}]"),
            };
            text += &format!(
                "\n[[body]]\nname = \"b{k}\"\n{shape}\nposition = [{x:?}, {y:?}]\nangle = {:?}\n",
                random.between(0.0, 1.5)
            );
        }
        let (overlap, speed) = at_the_end(&text);
        assert!(speed < 1e-3, "{dt} s: {speed} m/s");
        assert!(overlap < 1e-5 * 0.15, "{dt} s: {overlap} m");
    }
}
