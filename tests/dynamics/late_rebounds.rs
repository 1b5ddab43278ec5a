//! Rebounds that would leave bodies overlapped are located in time, without events too.

use crate::common::{Run, parse, run};
use moreau2d::contact::Vec2;
use moreau2d::experiment::{Engine, simulate};
use moreau2d::scene::Scene;

/// Restitution, radius \[m\], place and speed of the first disc, mass, place and speed of the second, place and
/// speed of the third: found by chance.
const CHATTERS: [[f64; 9]; 4] = [
    [
        0.8, 0.02, -0.028262, 2.75021, 0.3, -0.073336, 1.375105, -0.113773, 4.681443,
    ],
    [
        0.8, 0.05, -0.21482, 18.6924, 0.3, -0.41950, 9.3462, -0.58438, 39.8109,
    ],
    [
        0.5, 0.05, -0.08343, 20.2953, 3.0, -0.19847, 10.1477, -0.45053, 46.7814,
    ],
    [
        0.8, 0.02, -0.0520298, 2.280808, 0.3, -0.0970876, 1.140404, -0.1382462, 5.3282,
    ],
];

/// A light disc in front of a wall, hit by a heavy one, all along x.
fn hit(speed: f64, restitution: f64, dt: f64, events: bool) -> Run {
    run(&parse(&format!(
        "[scene]\nname = \"hit\"\ntitle = \"A disc is hit towards a wall\"\n\
         [gravity]\ny = 0\n[step]\ntime = 0.3\ndt = {dt:?}\nevents = {events}\n\
         [[material]]\nname = \"m\"\nfriction = 0\nrestitution = {restitution}\n\
         [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [1, 4]\nposition = [1.5, 0]\nmaterial = \"m\"\n\
         [[body]]\nname = \"light\"\ndisc = 0.25\nmass = 1\nposition = [0.749, 0]\nmaterial = \"m\"\n\
         [[body]]\nname = \"heavy\"\ndisc = 0.25\nmass = 4\nposition = [-1, 0]\nvelocity = [{speed}, 0]\n\
         material = \"m\"\n"
    )))
}

/// Bug: the wall was met a step late, 0.14 m deep at 24 m/s. What is located now is the same as with events.
#[test]
fn a_disc_hit_towards_a_wall_is_where_events_find_it() {
    for (speed, restitution) in [(24.0, 0.8), (24.0, 0.3), (9.0, 0.5), (24.0, 1.0)] {
        for parts in [60.0, 240.0] {
            let [plain, exact] =
                [false, true].map(|events| hit(speed, restitution, 1.0 / parts, events));
            assert!(plain.totals.events > 0, "{speed}, {restitution}, {parts}");
            for body in [1, 2] {
                let [(one, u), (two, v)] = [&plain, &exact].map(|run| run.state(body));
                let off = (one.translation - two.translation).norm() + (u - v).norm();
                assert!(off < 1e-9, "{speed}, {restitution}, {parts}: {off}");
            }
        }
    }
}

/// Bug: a fast disc that a wall throws back met the one behind it a step late, 27 mm off at the end.
#[test]
fn what_a_wall_throws_back_is_where_events_find_it() {
    for (speed, restitution) in [(24.0, 0.8), (32.0, 0.5), (40.0, 1.0)] {
        let [plain, exact] = [false, true].map(|events| {
            run(&parse(&format!(
                "[scene]\nname = \"swept\"\ntitle = \"A fast disc is thrown back\"\n\
                 [gravity]\ny = 0\n[step]\ntime = 0.2\nevents = {events}\n\
                 [[material]]\nname = \"m\"\nfriction = 0\nrestitution = {restitution}\n\
                 [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [1, 4]\nposition = [0.7, 0]\n\
                 [[body]]\nname = \"fast\"\ndisc = 0.1\nmass = 1\nvelocity = [{speed}, 0]\n\
                 [[body]]\nname = \"other\"\ndisc = 0.1\nmass = 1\nposition = [-0.25, 0]\n"
            )))
        });
        for body in [1, 2] {
            let [(one, u), (two, v)] = [&plain, &exact].map(|run| run.state(body));
            let off = (one.translation - two.translation).norm() + (u - v).norm();
            assert!(off < 1e-9, "{speed}, {restitution}, body {body}: {off}");
        }
    }
}

/// Bug: a light disc between a heavy one and a wall hits both ever faster. After the last rebound that was located
/// the discs passed each other, or the wall.
#[test]
fn rebounds_that_never_end_become_plastic() {
    for [e, r, x1, v1, m2, x2, v2, x3, v3] in CHATTERS {
        let run = run(&parse(&format!(
            "[scene]\nname = \"chatter\"\ntitle = \"Three discs before a wall\"\n\
             [gravity]\ny = 0\n[step]\ntime = 0.08\n\
             [[material]]\nname = \"m\"\nfriction = 0\nrestitution = {e}\n\
             [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [0.01, 4]\n\
             [[body]]\nname = \"b\"\ndisc = {r}\nmass = 1\nposition = [{x1}, 0]\nvelocity = [{v1}, 0]\n\
             [[body]]\nname = \"l\"\ndisc = {r}\nmass = {m2}\nposition = [{x2}, 0]\nvelocity = [{v2}, 0]\n\
             [[body]]\nname = \"h\"\ndisc = {r}\nmass = 10\nposition = [{x3}, 0]\nvelocity = [{v3}, 0]\n"
        )));
        let x = [1, 2, 3].map(|body| run.state(body).0.translation.x);
        let apart = (-0.005 - r - x[0])
            .min(x[0] - x[1] - 2.0 * r)
            .min(x[1] - x[2] - 2.0 * r);
        assert!(apart > -0.2 * r, "{x1}: {apart} m, {x:?}");
        // impact by impact, there are 44 to 539 and leave 0.033 of the speed of the third disc at most
        let speeds = [1, 2, 3].map(|body| run.state(body).1.x);
        let most = speeds.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        assert!(most < 0.035 * v3, "{x1}: {speeds:?} m/s");
    }
}

/// Bug of a first form of that: six discs without loss have more impacts in a step than are located at first, and
/// half of their energy went.
#[test]
fn many_rebounds_without_loss_lose_none() {
    let disc = |k: usize| {
        let (x, y) = (0.15 + 0.3 * (k % 3) as f64, 0.15 + 0.3 * (k / 3) as f64);
        let v = [[9.0, 3.0], [-4.0, 8.0], [6.0, -7.0]][k % 3];
        format!(
            "[[body]]\nname = \"b{k}\"\ndisc = 0.1\nmass = 1\nposition = [{x}, {y}]\nvelocity = {v:?}\n"
        )
    };
    let wall = |k: usize, size: [f64; 2], at: [f64; 2]| {
        format!("[[body]]\nname = \"w{k}\"\nkind = \"fixed\"\nbox = {size:?}\nposition = {at:?}\n")
    };
    let (wide, high) = ([3.0, 1.0], [1.0, 3.0]);
    let run = run(&parse(&format!(
        "[scene]\nname = \"gas\"\ntitle = \"Six discs in a box\"\n[gravity]\ny = 0\n\
         [step]\ntime = 2\n[[material]]\nname = \"m\"\nfriction = 0\nrestitution = 1\n{}{}{}{}{}",
        (0..6).map(disc).collect::<String>(),
        wall(0, wide, [0.45, -0.5]),
        wall(1, wide, [0.45, 1.1]),
        wall(2, high, [-0.5, 0.3]),
        wall(3, high, [1.4, 0.3]),
    )));
    let energy: f64 = (0..6)
        .map(|k| 0.5 * run.state(k).1.xy().norm_squared())
        .sum();
    let before = 90.0 + 80.0 + 85.0;
    assert!(
        (energy / before - 1.0).abs() < 1e-6,
        "{energy} J of {before} J"
    );
    assert!(run.totals.events > 1000, "{}", run.totals.events);
}

/// What is shallow is left to the position pass, and costs nothing.
#[test]
fn slow_rebounds_are_not_located() {
    let slow = hit(4.5, 0.5, 1.0 / 1000.0, false);
    assert_eq!(slow.totals.events, 0);
    assert!(slow.records.iter().any(|record| !record.impacts.is_empty()));
}

/// An impact with restitution `e` at speed `v` left an overlap of up to `(1 − e) v Δt/2`: 3 cm here. The ball
/// rises as high as with events; before, the height was off by a tenth.
#[test]
fn a_fast_impact_leaves_no_overlap() {
    for step in 0..20 {
        let height = 3.0 + 0.03 * f64::from(step);
        let drop = |events: bool| {
            run(&parse(&format!(
                "[scene]\nname = \"drop\"\ntitle = \"A ball drops\"\n[step]\ntime = 1.1\n\
                 events = {events}\n[[material]]\nname = \"m\"\nrestitution = 0.4\n\
                 [[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [4, 1]\nposition = [0, -0.5]\n\
                 material = \"m\"\n[[body]]\nname = \"ball\"\ndisc = 0.1\nposition = [0, {height}]\n\
                 material = \"m\"\n"
            )))
        };
        let [plain, exact] = [false, true].map(drop);
        let deepest = plain.totals.penetration;
        // a twentieth of the radius is left to the position pass
        assert!(deepest <= 0.005, "from {height} m: {deepest}");
        let [one, two] = [&plain, &exact].map(|run| run.state(1).0.translation.y);
        assert!((one - two).abs() < 0.02, "from {height} m: {one} for {two}");
    }
}

/// A row of balls `apart` from each other in front of a wall, hit by a heavy one.
fn row(count: usize, apart: f64) -> Scene {
    let mut text = String::from(
        "[scene]\nname = \"row\"\ntitle = \"A row of balls is hit\"\n[gravity]\ny = 0\n[step]\n\
         time = 0.05\nrecovery = false\n[[material]]\nname = \"m\"\nfriction = 0\nrestitution = 0.5\n\
         [[body]]\nname = \"hammer\"\ndisc = 0.1\nmass = 5\nposition = [-0.5, 0]\n\
         velocity = [20, 0]\nmaterial = \"m\"\n",
    );
    let pitch = 0.2 + apart;
    for k in 0..count {
        text += &format!(
            "[[body]]\nname = \"b{k}\"\ndisc = 0.1\nmass = 1\nposition = [{}, 0]\nmaterial = \"m\"\n",
            pitch * k as f64
        );
    }
    text += "[[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [1, 1]\nmaterial = \"m\"\n";
    text += &format!("position = [{}, 0]\n", pitch * count as f64 + 0.41);
    parse(&text)
}

/// In the step of the hit, the impacts of twenty balls and a wall are located. Those of sixty are too many.
#[test]
fn crowds_are_not_located() {
    let located = |count: usize| {
        let records = run(&row(count, 0.0)).records;
        let hit = records.iter().find(|record| !record.impacts.is_empty());
        hit.unwrap().events
    };
    assert!(located(20) > 0);
    assert_eq!(located(60), 0);
}

/// Bug: in the step after the break of a rack, which had more bodies than were looked at, balls overlapped by half
/// of their width and passed through each other, in one of four breaks at 2 to 15 m/s and up to 1/60 s.
#[test]
fn a_rack_of_balls_breaks() {
    const RADIUS: f64 = 0.0286;
    for k in 0..24 {
        let (speed, apart) = (2.0 + 0.5 * f64::from(k), [0.0, 1e-4, 1e-3][k as usize % 3]);
        let mut text = format!(
            "[scene]\nname = \"rack\"\ntitle = \"A rack is broken\"\n[gravity]\ny = 0\n[step]\ntime = 0.5\n\
             [[material]]\nname = \"m\"\nfriction = 0.05\nrestitution = 0.95\n\
             [[body]]\nname = \"cue\"\ndisc = {RADIUS}\nmass = 0.16\nposition = [-0.3, 0.004]\n\
             velocity = [{speed}, 0]\n"
        );
        for (row, column) in (0..5).flat_map(|row| (0..=row).map(move |column| (row, column))) {
            let (row, column) = (f64::from(row), f64::from(column));
            let pitch = 2.0 * RADIUS + apart;
            let (x, y) = (0.866_025_5 * pitch * row, pitch * (column - 0.5 * row));
            text += &format!(
                "[[body]]\nname = \"b{row}-{column}\"\ndisc = {RADIUS}\nmass = 0.16\nposition = [{x}, {y}]\n"
            );
        }
        let mut built = parse(&text).build().unwrap();
        simulate(&mut built, Engine::Moreau, 30, |record, built| {
            let places: Vec<Vec2> = (0..16)
                .map(|k| built.state(k).unwrap().0.translation)
                .collect();
            for (i, a) in places.iter().enumerate() {
                for b in &places[..i] {
                    let share = (a - b).norm() / (2.0 * RADIUS);
                    assert!(share > 0.95, "{speed} m/s, {} s: {share}", record.time);
                }
            }
            Ok(())
        })
        .unwrap();
    }
}

/// Where each impact of a row drives the next ball, the cluster grows until it is too large. Its balls then move as
/// all others do, by the mean of the velocities at the start and at the end.
#[test]
fn a_cluster_that_grows_too_large_is_left_as_it_was() {
    let scene = row(60, 1e-3);
    let mut built = scene.build().unwrap();
    let mut before: Vec<_> = (0..61).map(|k| built.state(k).unwrap()).collect();
    let mut struck = 0;
    simulate(&mut built, Engine::Moreau, 3, |record, built| {
        let after: Vec<_> = (0..61).map(|k| built.state(k).unwrap()).collect();
        struck += record.impacts.len();
        if record.events == 0 {
            for (k, ((from, u), (to, v))) in before.iter().zip(&after).enumerate() {
                let way = 0.5 * record.dt * (u.x + v.x);
                let off = to.translation.x - from.translation.x - way;
                assert!(off.abs() < 1e-12, "ball {k} at {} s: {off} m", record.time);
            }
        }
        before = after;
        Ok(())
    })
    .unwrap();
    assert!(struck > 1);
}

/// A slider with restitution is met at its side by a real step, at any speed and phase of the time step.
///
/// Bug: a cluster with a late rebound looked for its contacts anew, without following fast parts to where they first
/// touch. At 3 to 6 m/s boxes and polygons slid on over a step of 0.1 to 10 mm, with exit code 0.
#[test]
fn a_real_step_stops_what_rebounds() {
    let shapes = [
        "box = [0.4, 0.4]",
        "polygon = [[-0.3, -0.2], [0.3, -0.2], [0.3, 0.1], [0.2, 0.2], [-0.3, 0.2]]",
    ];
    let mut located = 0;
    for (shape, restitution) in shapes.into_iter().flat_map(|s| [0.1, 0.3].map(|e| (s, e))) {
        for (speed, height) in [3.0, 5.0, 6.0, 8.0]
            .into_iter()
            .flat_map(|v| [1e-4, 1e-2].map(|h| (v, h)))
        {
            for phase in 0..5 {
                let x = -1.0 - speed / 60.0 * f64::from(phase) / 5.0;
                let slid = run(&parse(&format!(
                    "[scene]\nname = \"step\"\ntitle = \"A slider meets a step\"\n\
                     [step]\ntime = {}\n[[material]]\nname = \"m\"\nfriction = 0\n\
                     restitution = {restitution}\n[[body]]\nname = \"low\"\nkind = \"fixed\"\n\
                     box = [20, 1]\nposition = [-10, -0.5]\n[[body]]\nname = \"high\"\n\
                     kind = \"fixed\"\nbox = [20, 1]\nposition = [10, {}]\n[[body]]\n\
                     name = \"slider\"\n{shape}\nposition = [{x}, 0.2]\nvelocity = [{speed}, 0]\n",
                    1.6 / speed,
                    height - 0.5
                )));
                located += slid.totals.events;
                let (_, velocity) = slid.state(2);
                assert!(
                    velocity.x < 0.6 * speed,
                    "{shape}, {restitution}, {speed} m/s, {height} m, phase {phase}: {velocity:?}"
                );
            }
        }
    }
    assert!(located > 0);
}

/// Bug: a box that is thrown at a peg of a thirtieth of its size was in it a step later, since detection had looked as
/// far as half of the box for it.
#[test]
fn a_large_body_that_is_thrown_meets_a_small_one() {
    let run = run(&parse(
        "[scene]\nname = \"peg\"\ntitle = \"A box is thrown at a peg\"\n[gravity]\ny = 0\n\
         [step]\ntime = 0.1\nevents = true\n\
         [[material]]\nname = \"m\"\nfriction = 0\nrestitution = 1\n\
         [[body]]\nname = \"peg\"\nkind = \"fixed\"\ndisc = 0.03\nposition = [0.66, 0]\n\
         [[body]]\nname = \"big\"\nbox = [1, 1]\n\
         [[body]]\nname = \"bullet\"\nbox = [1, 1]\nposition = [-1.02, 0]\nvelocity = [12, 0]\n",
    ));
    let deepest = run.records.iter().map(|record| record.penetration);
    let deepest = deepest.fold(0.0, f64::max);
    assert!(deepest < 1e-6, "{deepest} m");
    // the peg throws the box back, which hands all of it on
    let u = run.state(2).1;
    assert!((u.x + 12.0).abs() < 1e-6, "{u}");
}
