//! Whatever can be read: no solver panics or returns what is not finite.

use moreau2d::contact::Vec2;
use moreau2d::oracles::{SOLVERS, solver_by_name};
use moreau2d::problems::{StoredProblem, read};
use proptest::strategy::Strategy;

const DENSE: &str = "2 2\n0 4 4\n4 4\n2 0.5 1 0\n0.5 3 0 1\n1 0 4 1\n0 1 1 5\n-1 2 -3 4\n0.5 0.1\n";

/// Two bodies with every law between them.
const BODIES: &str = r#"{"kind": "contact", "operator": {"bodies": {
  "inverse_mass": [[1, 1, 6], [0.5, 0.5, 3]],
  "rows": [
    {"bodies": [null, 0], "jacobian": [[[0,0,0],[0,0,0]], [[0,1,0.5],[-1,0,0.5]]]},
    {"bodies": [0, 1], "jacobian": [[[0,-1,-0.5],[1,0,0.5]], [[0,1,0.5],[-1,0,0.5]]]},
    {"bodies": [0, 1], "jacobian": [[[0,-1,0.5],[1,0,0.5]], [[0,1,-0.5],[-1,0,0.5]]]},
    {"bodies": [1, null], "jacobian": [[[0,0,1],[0,0,0]], [[0,0,0],[0,0,0]]]},
    {"bodies": [0, 1], "jacobian": [[[1,0,0],[0,1,0]], [[-1,0,0],[0,-1,0]]]}
  ]}},
  "free": [[-1, 0.2], [-2, 0.1], [-3, -1], [1, 0], [0.5, -0.5]],
  "laws": [{"contact": {"friction": 0.4}}, {"contact": {"friction": 0, "compliance": 0.1}},
    {"contact": {"friction": 1.5}}, {"bounded": {"lower": -0.1, "upper": 0.2}}, "pin"]}"#;

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(1500))]

    /// A number of a good file becomes any other: what is read is solved or not, but no solver
    /// panics, and what it returns is finite.
    #[test]
    fn no_solver_panics_on_what_can_be_read(
        from_bodies in proptest::bool::ANY,
        at in proptest::prelude::any::<proptest::sample::Index>(),
        number in proptest::prop_oneof![
            proptest::strategy::Just(0.0),
            -10.0f64..10.0,
            (-1.0f64..1.0, -320i32..310).prop_map(|(x, e)| x * 10f64.powi(e)),
        ],
    ) {
        let good = if from_bodies { BODIES } else { DENSE };
        // numbers that start a word
        let digit = |k: usize| good.as_bytes()[k].is_ascii_digit() || good.as_bytes()[k] == b'-';
        let in_word = |k: usize| digit(k) || good.as_bytes()[k] == b'.';
        let starts: Vec<usize> = (1..good.len()).filter(|&k| digit(k) && !in_word(k - 1)).collect();
        let start = starts[at.index(starts.len())];
        let end = (start..good.len()).find(|&k| !in_word(k)).unwrap();
        let text = format!("{}{number:e}{}", &good[..start], &good[end..]);
        if let Some(trouble) = not_finite(&text) {
            proptest::prop_assert!(false, "{}", trouble);
        }
    }
}

/// Bug: where velocities were so small that their squares are 0, Newton's method went on for ever.
#[test]
fn numbers_without_a_square_come_to_an_end() {
    for good in [BODIES, DENSE] {
        let bytes = good.as_bytes();
        let digit = |k: usize| bytes[k].is_ascii_digit() || bytes[k] == b'-';
        let in_word = |k: usize| digit(k) || bytes[k] == b'.';
        for start in (1..good.len()).filter(|&k| digit(k) && !in_word(k - 1)) {
            let end = (start..good.len()).find(|&k| !in_word(k)).unwrap();
            for number in [5e-324, 1e-300, -1e-170, 3e-161, 1e-155, 1e-80, 1e80, 1e155] {
                let text = format!("{}{number:e}{}", &good[..start], &good[end..]);
                assert_eq!(not_finite(&text), None);
            }
        }
    }
}

/// Solves the contact problem of `text`, if it is one, with every solver; tells of impulses that are
/// not finite.
fn not_finite(text: &str) -> Option<String> {
    let StoredProblem::Contact { problem, .. } = read(text.as_bytes()).ok()?.problem else {
        return None;
    };
    SOLVERS.iter().find_map(|name| {
        let mut impulses = vec![Vec2::zeros(); problem.len()];
        let mut solver = solver_by_name(name).unwrap();
        let report = solver.solve(&problem, &mut impulses, 1e-8);
        let finite = impulses.iter().all(|p| p.x.is_finite() && p.y.is_finite());
        (!finite).then(|| format!("{name}: {report:?} {impulses:?}\n{text}"))
    })
}

/// Bug: an arm of 1e153 m makes `G` 1e306; a sweep overflowed and Gauss-Seidel returned NaN.
#[test]
fn masses_near_overflow_leave_finite_impulses() {
    let text = BODIES.replace("[1,0,0],[0,1,0]]", "[1,0,9.634369041246736e152],[0,1,0]]");
    assert!(read(text.as_bytes()).is_ok() && text != BODIES);
    assert_eq!(not_finite(&text), None);
}
