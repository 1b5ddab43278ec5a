//! The instant of an impact, and what moves up to it.

use super::ROUND_OFF;
use crate::common::{load, parse, run, run_steps};
use moreau2d::contact::Vec2;
use moreau2d::dynamics::record::ContactStatus;

/// Bug: bodies that move on their own went along with a cluster only if it touched them. A cart on
/// which a bob hangs stood half a step ahead in every interval of an event, and the pin pulled the
/// bob there.
#[test]
fn a_cart_moves_along_with_the_events_of_what_hangs_on_it() {
    let scene = parse(
        "[scene]\nname = \"cart\"\ntitle = \"A cart\"\n[gravity]\ny = 0\n[step]\ntime = 1\n\
         dt = 0.01\nevents = true\n[[material]]\nname = \"m\"\nrestitution = 0.5\nfriction = 0\n\
         [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [1, 1]\nposition = [1.2537, 0]\n\
         [[body]]\nname = \"cart\"\nkind = \"kinematic\"\ndisc = 0.1\nposition = [0, 2]\n\
         velocity = [1, 0]\n[[body]]\nname = \"bob\"\ndisc = 0.25\nposition = [0, 0]\n\
         velocity = [1, 0]\n[[joint]]\nkind = \"revolute\"\nbodies = [\"cart\", \"bob\"]\n\
         at = [0, 2]\n",
    );
    let run = run(&scene);
    // from 1 to -0.5 m/s, 2 m below the pin that goes on at 1 m/s; then nothing turns it any more
    let (pose, u) = run.state(2);
    let (spin, hit) = (-0.75, 1.2537 - 0.5 - 0.25);
    // the pin is of second order: (ω dt)²/2 in relative terms is 2.8e-5
    assert!((u.z - spin).abs() <= 5e-5, "{} rad/s", u.z);
    let angle = spin * (1.0 - hit);
    assert!((pose.angle() - angle).abs() <= 5e-5, "{}", pose.angle());
}

/// Bug: a contact that closed at the very end of a step left an interval of length 0, on which all
/// that was on its way seemed to close at once: the disc bounced 0.3 m above the floor.
#[test]
fn an_impact_at_the_very_end_of_a_step_leaves_the_others_alone() {
    let scene = parse(
        "[scene]\nname = \"corner\"\ntitle = \"A corner\"\n[gravity]\ny = 0\n[step]\ntime = 0.5\n\
         dt = 0.25\nevents = true\n[[material]]\nname = \"m\"\nrestitution = 0.5\nfriction = 0\n\
         [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [1, 9]\nposition = [2, 0]\n\
         [[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [9, 1]\nposition = [0, -2.3]\n\
         [[body]]\nname = \"disc\"\ndisc = 0.5\nvelocity = [4, -4]\n",
    );
    let first = run_steps(&scene, 1);
    let (pose, u) = first.state(2);
    assert_eq!(u.y, -4.0);
    assert_eq!(pose.translation, Vec2::new(1.0, -1.0));
    // wall at 0.25 s, floor at 0.325 s, half the speed after each
    let second = run(&scene);
    let (pose, u) = second.state(2);
    assert!((u.xy() - Vec2::new(-2.0, 2.0)).norm() <= ROUND_OFF, "{u:?}");
    let place = Vec2::new(0.5, -1.3 + 0.175 * 2.0);
    assert!((pose.translation - place).norm() <= ROUND_OFF, "{pose:?}");
}

/// Bug: where the straight path of the normal started closed, an impact was taken at the start
/// without a look at the gap. What turns fast bounced off a wall up to 5 cm before it came there.
#[test]
fn a_bar_that_turns_fast_touches_what_it_hits() {
    let mut impacts = 0;
    for (spin, dt) in [(10.0, 1.0 / 30.0), (10.0, 1.0 / 120.0), (30.0, 1.0 / 30.0)] {
        for k in 0..40 {
            let scene = parse(&format!(
                "[scene]\nname = \"bar\"\ntitle = \"A bar\"\n[gravity]\ny = 0\n[step]\n\
                 time = 1\ndt = {dt:?}\nevents = true\n[[material]]\nname = \"m\"\n\
                 restitution = 0.5\nfriction = 0.3\n[[body]]\nname = \"wall\"\n\
                 kind = \"fixed\"\nbox = [20, 1]\nposition = [0, -0.5]\n[[body]]\n\
                 name = \"bar\"\nbox = [0.8, 0.1]\nposition = [0, {:?}]\n\
                 velocity = [0, -0.5]\nspin = {spin:?}\nangle = 0.2\n",
                0.7 + 0.013 * f64::from(k)
            ));
            let run = run(&scene);
            let mut contacts = run.records.iter().flat_map(|r| &r.contacts);
            if let Some(first) = contacts.find(|c| c.impulse_n > 0.0) {
                // what counts as touching: 1e-4 of ω² r dt²/2, of 1 m at most
                assert!(
                    first.gap.abs() <= 1e-4,
                    "{spin} rad/s, {k}: {} m",
                    first.gap
                );
                impacts += 1;
            }
        }
    }
    assert!(impacts > 20, "{impacts}");
}

/// Bug: a wheel rests on one segment of the ground and meets the corner of another. The search for
/// the instant took the nearest contact of the pair, which rests, and closes by round-off.
#[test]
fn a_wheel_meets_a_kerb_of_the_ground_it_rolls_on() {
    let scene = parse(
        "[scene]\nname = \"kerb\"\ntitle = \"A kerb\"\n[step]\ntime = 1\nevents = true\n\
         [[material]]\nname = \"m\"\nfriction = 0.9\n[[body]]\nname = \"ground\"\n\
         kind = \"fixed\"\npolyline = [[10, 0.05], [0, 0.05], [0, 0], [-10, 0]]\n\
         [[body]]\nname = \"wheel\"\ndisc = 0.3\nposition = [-1, 0.3]\nvelocity = [1.8, 0]\n\
         spin = -6\n",
    );
    let run = run(&scene);
    // parry's gaps are f32: 2e-6 of the wheel
    assert!(run.totals.penetration <= 2e-6, "{}", run.totals.penetration);
    // the centre is 0.3 m from the corner, 0.25 m above it: 0.1658 m before it
    let hit = run.records.iter().flat_map(|r| &r.contacts);
    let hit = hit.filter(|c| c.status == ContactStatus::Impact && c.normal.x.abs() > 0.1);
    let first = hit.map(|c| c.time).next().unwrap();
    let exact = (1.0 - (0.3f64.powi(2) - 0.25f64.powi(2)).sqrt()) / 1.8;
    assert!((first - exact).abs() <= 1e-5, "{first} {exact}");
}

/// Bug: an impact that no impulses solve was tried until the step's budget was spent: 16 impacts at
/// one instant, each of which lost energy.
#[test]
fn an_impact_without_a_solution_is_tried_once() {
    let scene = parse(
        "[scene]\nname = \"press\"\ntitle = \"A press\"\n[step]\ntime = 0.5\nevents = true\n\
         [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [1, 4]\nposition = [1.5, 0]\n\
         [[body]]\nname = \"press\"\nkind = \"kinematic\"\nbox = [1, 1]\nposition = [-1.3, 0]\n\
         velocity = [2, 0]\n[[body]]\nname = \"box\"\nbox = [1, 1]\n[gravity]\ny = 0\n",
    );
    let run = run(&scene);
    assert!(run.totals.unsolved_islands > 0, "the box was not pressed");
    let most = run.records.iter().map(|r| r.events).max();
    assert!(most <= Some(2), "{most:?} impacts in a step");
}

/// Bug: the instant of an impact was sought on the path of the whole step, and the shorter interval
/// up to it has another one: a foot that fell from one corner to the other was 1.3e-6 m too deep when
/// it hit the floor.
#[test]
fn what_tips_over_hits_the_floor_where_it_touches() {
    let scene = parse(
        "[scene]\nname = \"foot\"\ntitle = \"A foot\"\n[step]\ntime = 0.3\nevents = true\n\
         [[material]]\nname = \"m\"\nfriction = 0.5\n[[body]]\nname = \"floor\"\n\
         kind = \"fixed\"\nbox = [4, 2]\nposition = [0, -1]\n[[body]]\nname = \"foot\"\n\
         box = [0.094, 0.03]\nposition = [0, 0.04986021928075429]\nangle = 1.4007963267948966\n",
    );
    let run = run(&scene);
    let contacts = run.records.iter().flat_map(|r| &r.contacts);
    let hits = contacts.filter(|c| c.status == ContactStatus::Impact && c.time > 0.05);
    let deepest = hits.map(|c| -c.gap).reduce(f64::max);
    // what counts as touching: 1e-4 of the way that gravity falls in a step
    assert!(deepest.unwrap() <= 1.4e-7, "{deepest:?} m");
}

/// Bug: a slider of little inertia chatters between two corners: ever shorter intervals, up to the
/// impact of both at once. After four of them the plain rule let it 9e-6 m into its guide.
#[test]
fn chatter_between_two_corners_is_followed_to_its_end() {
    let run = run(&load(
        "slider-crank",
        &["step.events=true", "step.time=0.003"],
    ));
    let most = run.records.iter().map(|r| r.events).max();
    assert!(most > Some(10), "{most:?} impacts in a step");
    let deepest = run.totals.penetration.max(run.totals.penetration_impact);
    assert!(deepest <= 1e-9, "{deepest} m");
}

/// An impact is recorded when it is over, at most two steps after it; and at the latest at the next
/// midpoint, where its contact touches.
#[test]
fn impacts_lie_near_the_step_that_records_them() {
    for (name, steps) in [("drum", 150), ("card-house", 120), ("hit-heap", 60)] {
        let scene = load(name, &[]);
        let run = run_steps(&scene, steps);
        let dt = scene.step.dt;
        let mut found = 0;
        for (k, record) in run.records.iter().enumerate() {
            for impact in &record.impacts {
                let [earliest, latest] = [-2.0, 1.5].map(|share| (k as f64 + share) * dt);
                let inside = (earliest - 1e-9..=latest + 1e-9).contains(&impact.time);
                assert!(inside, "{name}, step {k}: {}", impact.time);
                found += 1;
            }
        }
        assert!(found > 10, "{name}: {found}");
    }
}
