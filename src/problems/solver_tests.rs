//! Tests of solvers on stored problems that need their internals.

use super::{StoredProblem, read};
use crate::contact::{ContactProblem, Delassus};
use crate::solver::Nsgs;
use crate::solver::nsgs_tests::{check_solve_by_four, check_sweeps_by_four, check_turns_after_ten};

fn stored(name: &str) -> ContactProblem {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/problems");
    let bytes = std::fs::read(folder.join(name)).expect("a problem file");
    match read(&bytes).expect("a problem").problem {
        StoredProblem::Contact { problem, .. } => problem,
        StoredProblem::Lcp { .. } => panic!("an LCP"),
    }
}

/// Sweeps by four are sweeps block after block, with all laws, in a drum and in a heap that is hit.
#[test]
fn four_at_a_time_is_block_after_block() {
    for (name, alone) in [
        ("heap-all-laws.json", 47),
        ("drum-mu0.5-step400.json", 0),
        ("left-hit-heap-804.json", 0),
    ] {
        check_sweeps_by_four(name, &stored(name), alone);
    }
    check_solve_by_four(&mut Nsgs::with_budget(120), &stored("heap-all-laws.json"));
}

/// A turn after every tenth sweep takes fewer of them than a turn after each, whichever end the
/// blocks are numbered from.
#[test]
fn ten_sweeps_in_one_direction_need_fewer() {
    for name in ["pyramid-scene-step60.json", "drum-mu0.5-step400.json"] {
        let problem = stored(name);
        check_turns_after_ten(name, &problem);
        let mut reversed = problem;
        reversed.free.reverse();
        reversed.laws.reverse();
        if let Delassus::Bodies(op) = &mut reversed.operator {
            op.rows.reverse();
        }
        check_turns_after_ten(name, &reversed);
    }
}
