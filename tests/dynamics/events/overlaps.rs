//! What starts overlapped.

use super::G;
use crate::common::{parse, run, run_steps};
use moreau2d::contact::Vec2;

fn overlapped(depth: f64, restitution: f64) -> String {
    format!(
        "[scene]\nname = \"o\"\ntitle = \"Overlapped\"\n[step]\ntime = 5\n[[material]]\n\
         name = \"m\"\nrestitution = {restitution:?}\n[[body]]\nname = \"floor\"\n\
         kind = \"fixed\"\nbox = [10, 2]\nposition = [0, -1]\n[[body]]\nname = \"low\"\n\
         box = [1, 1]\nposition = [0, {:?}]\n[[body]]\nname = \"high\"\nbox = [1, 1]\n\
         position = [0, {:?}]\n",
        0.5 - depth,
        1.5 - 2.0 * depth
    )
}

/// Bodies that start overlapped come apart by position alone: nothing is launched.
#[test]
fn overlaps_at_the_start_recover_without_a_launch() {
    for depth in [0.001, 0.01, 0.5] {
        for restitution in [0.0, 0.5] {
            let run = run(&parse(&overlapped(depth, restitution)));
            let fastest = run
                .records
                .iter()
                .map(|r| r.energy.kinetic_end)
                .fold(0.0, f64::max);
            // of bodies of 1000 kg that rise by up to a metre
            assert!(fastest <= 1e-9, "{depth} m: {fastest} J");
            for (k, exact) in [(1, 0.5), (2, 1.5)] {
                let y = run.state(k).0.translation.y;
                assert!(y > exact - 4e-5 && y <= exact, "{depth} m: {y}");
            }
            assert_eq!(run.totals.recovering, 0, "{depth} m");
            // what is left counts from then on
            assert!(run.totals.penetration <= 2e-5);
        }
    }
    let kept = run_steps(
        &parse(&overlapped(0.01, 0.0).replace("time = 5", "time = 5\nrecovery = false")),
        60,
    );
    let (low, _) = kept.state(1);
    assert!((low.translation - Vec2::new(0.0, 0.49)).norm() < 1e-9);
}

/// A box in a slot narrower than itself cannot get free: it stays, is not launched, and is told.
#[test]
fn an_overlap_without_a_way_out_is_told() {
    let scene = parse(
        "[scene]\nname = \"slot\"\ntitle = \"A slot\"\n[step]\ntime = 1\n\
         [[body]]\nname = \"left\"\nkind = \"fixed\"\nbox = [2, 90]\nposition = [-1.49, 0]\n\
         [[body]]\nname = \"right\"\nkind = \"fixed\"\nbox = [2, 90]\nposition = [1.49, 0]\n\
         [[body]]\nname = \"box\"\nbox = [1, 1]\nvelocity = [1, 0]\n",
    );
    let run = run(&scene);
    assert_eq!(run.totals.recovering, 2);
    let (pose, u) = run.state(2);
    assert!(u.x.abs() <= 1e-9 && u.z.abs() <= 1e-9, "{u:?}");
    let x = pose.translation.x;
    assert!(x.abs() <= 0.011, "{x}");
    assert!(run.totals.energy_rise <= 1e-9);
}

/// In such a slot no displacement frees the box of both sides: it is moved to where it overlaps both
/// alike. Once it stayed deep in one of them.
#[test]
fn an_overlap_without_a_way_out_is_shared_out() {
    let scene = parse(
        "[scene]\nname = \"slot\"\ntitle = \"A slot\"\n[gravity]\ny = 0\n[step]\ntime = 1\n\
         [[body]]\nname = \"left\"\nkind = \"fixed\"\nbox = [2, 90]\nposition = [-1.49, 0]\n\
         [[body]]\nname = \"right\"\nkind = \"fixed\"\nbox = [2, 90]\nposition = [1.49, 0]\n\
         [[body]]\nname = \"box\"\nbox = [1, 1]\nposition = [0.008, 0]\n",
    );
    let run = run(&scene);
    assert_eq!(run.totals.recovering, 2);
    let (pose, u) = run.state(2);
    assert!(pose.translation.x.abs() < 2e-4, "{}", pose.translation.x);
    assert!(u.norm() <= 1e-12, "{u:?}");
    assert!(run.totals.energy_rise <= 1e-9);
}

/// Bug: with events, a pair that started overlapped and opened ended the program in its first step:
/// the search from the start asked for accelerations that were not known yet.
#[test]
fn what_starts_overlapped_may_open_in_the_first_step() {
    let scene = parse(
        "[scene]\nname = \"up\"\ntitle = \"A box leaves the floor\"\n[step]\ntime = 1\n\
         events = true\n[[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [9, 1]\n\
         position = [0, -0.5]\n[[body]]\nname = \"box\"\nbox = [1, 1]\n\
         position = [0, 0.499]\nvelocity = [0, 1]\n",
    );
    let (pose, _) = run_steps(&scene, 3).state(1);
    // 0.05 s of free flight
    let exact = 0.499 + 0.05 - 0.5 * G * 0.05f64.powi(2);
    assert!((pose.translation.y - exact).abs() <= 1e-9, "{pose:?}");
}
