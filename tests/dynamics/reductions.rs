//! What the model leaves out changes no motion and adds no unknown.

use crate::common::load;
use moreau2d::experiment::{Engine, REDUCTIONS, against_full, simulate};
use moreau2d::report::Progress;
use std::collections::HashSet;

/// Scene, steps, and which reductions leave unknowns out of it: islands at rest, islands, distant
/// contacts, friction rows. Solving islands by themselves leaves out no unknown, but the coupling of up to 100
/// of them. `hit-heap` ends with its first impacts: those after them have several solutions and part chaotic
/// ways.
const SCENES: [(&str, usize, [bool; 4]); 8] = [
    ("tower", 60, [true, false, false, false]),
    ("wall", 30, [true, false, false, false]),
    ("bowl", 120, [false, false, false, true]),
    ("chain", 60, [false; 4]),
    ("double-pendulum", 120, [false; 4]),
    ("drum", 30, [false, false, true, false]),
    ("hit-heap", 15, [false, false, true, false]),
    ("many-pyramids", 3, [true, false, false, false]),
];

#[test]
fn reductions_change_nothing() {
    for (name, steps, fewer) in SCENES {
        // solved as well as round-off allows, so that differences are not those of the tolerance
        let mut scene = load(name, &["step.tolerance=1e-12"]);
        scene.step.time = steps as f64 * scene.step.dt;
        for (reduction, fewer) in REDUCTIONS.iter().zip(fewer) {
            let hidden = Progress::new("", 0, true);
            let row = against_full(&scene, reduction, 1, &hidden).unwrap();
            println!(
                "{name} {}: {} of {} unknowns, work {} of {}, {:e}",
                row.reduction,
                row.unknowns,
                row.unknowns_full,
                row.work,
                row.work_full,
                row.difference
            );
            // bodies of some metres: 1e-9 relative
            assert!(
                row.difference <= 1e-9,
                "{name} {}: {:e}",
                row.reduction,
                row.difference
            );
            assert!(
                row.unknowns <= row.unknowns_full,
                "{name} {}",
                row.reduction
            );
            assert_eq!(
                row.unknowns < row.unknowns_full,
                fewer,
                "{name} {}",
                row.reduction
            );
        }
    }
}

/// Where a reduced step ends elsewhere than the full one, both are solutions of the same problem.
#[test]
fn steps_apart_are_two_solutions_of_one_problem() {
    let mut scene = load("hit-heap", &[]);
    scene.step.time = 60.0 * scene.step.dt;
    let hidden = Progress::new("", 0, true);
    let row = against_full(&scene, &REDUCTIONS[2], 1, &hidden).unwrap();
    assert!(row.steps_apart > 0, "{row:?}");
    assert_eq!(row.steps_another_solution, row.steps_apart, "{row:?}");
    assert_eq!(row.verdict.split(',').next(), Some("another solution"));
}

/// A stored problem names each of its blocks once: in contacts and joints, with located impacts, in a crowd.
#[test]
fn stored_problems_name_each_block_once() {
    for (name, flags, steps) in [
        ("chain", &[][..], 40),
        ("hit-heap", &[][..], 40),
        ("elastic-gas", &["step.events=true"][..], 40),
        ("tower", &[][..], 5),
        ("drum-of-boxes", &[][..], 60),
    ] {
        let mut built = load(name, flags).build().unwrap();
        built.keep_problems(true);
        let mut blocks = 0;
        simulate(&mut built, Engine::Moreau, steps, |_, built| {
            for stored in built.problems() {
                assert_eq!(stored.keys.len(), stored.problem.len(), "{name}");
                assert_eq!(stored.keys.len(), stored.impulses.len(), "{name}");
                let different: HashSet<_> = stored.keys.iter().collect();
                assert_eq!(different.len(), stored.keys.len(), "{name}");
                blocks += stored.keys.len();
            }
            Ok(())
        })
        .unwrap();
        assert!(blocks > 0, "{name}");
    }
}
