//! Tests: what is written is read back bit for bit, and what cannot be is not written.

use super::tests::coulomb;
use super::*;
use crate::contact::{BodyOperator, Law, NO_BODY, Rows, Vec3};
use proptest::prelude::*;

/// A number of any size whose square is finite.
fn real() -> impl Strategy<Value = f64> {
    (-1.0f64..1.0, -60i32..60).prop_map(|(x, e)| x * 10f64.powi(e))
}

fn pair() -> impl Strategy<Value = Vec2> {
    (real(), real()).prop_map(|(x, y)| Vec2::new(x, y))
}

fn law() -> impl Strategy<Value = Law> {
    prop_oneof![
        (0.0f64..2.0, 0.0f64..1.0).prop_map(|(friction, compliance)| Law::Contact {
            friction,
            compliance
        }),
        Just(Law::Pin),
        (real(), 0.0f64..1.0, 0.0f64..1.0).prop_map(|(lower, width, compliance)| Law::Bounded {
            lower,
            upper: lower + width,
            compliance,
        }),
        Just(Law::Bounded {
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            compliance: 0.0,
        }),
    ]
}

/// Blocks on up to four bodies; each block is on one body and perhaps another.
fn stored() -> impl Strategy<Value = StoredProblem> {
    let rows = (
        0u32..4,
        prop::option::of(0u32..4),
        prop::array::uniform12(real()),
    );
    let block = (rows, pair(), law(), pair());
    let inverse_mass = prop::collection::vec(prop::array::uniform3(1e-3f64..1e3), 4);
    (
        inverse_mass,
        prop::collection::vec(block, 1..6),
        any::<bool>(),
    )
        .prop_map(|(inverse_mass, blocks, solved)| {
            let side = |x: &[f64]| [Vec3::new(x[0], x[1], x[2]), Vec3::new(x[3], x[4], x[5])];
            let rows = blocks.iter().map(|((a, b, j), ..)| Rows {
                bodies: [*a, b.unwrap_or(NO_BODY)],
                jacobian: [side(&j[..6]), side(&j[6..])],
            });
            let problem = ContactProblem {
                operator: Delassus::Bodies(BodyOperator {
                    inverse_mass: inverse_mass.into_iter().map(Vec3::from).collect(),
                    rows: rows.collect(),
                }),
                free: blocks.iter().map(|b| b.1).collect(),
                laws: blocks.iter().map(|b| b.2).collect(),
            };
            let impulses = blocks.iter().map(|b| b.3).collect();
            StoredProblem::Contact {
                problem,
                solution: solved.then_some(impulses),
            }
        })
}

fn lcp() -> impl Strategy<Value = StoredProblem> {
    (1usize..6).prop_flat_map(|n| {
        let numbers = prop::collection::vec(real(), n * n);
        (numbers, prop::collection::vec(real(), n), any::<bool>()).prop_map(
            move |(matrix, q, solved)| StoredProblem::Lcp {
                matrix: DMatrix::from_vec(n, n, matrix),
                solution: solved.then(|| DVector::from_vec(q.clone())),
                q: DVector::from_vec(q),
            },
        )
    })
}

/// `problem` with an explicit operator, Coulomb friction alone and no solution.
fn as_dat_has_it(problem: &StoredProblem) -> StoredProblem {
    match problem.clone() {
        StoredProblem::Contact { problem, .. } => StoredProblem::Contact {
            problem: ContactProblem {
                operator: Delassus::dense(problem.operator.explicit()),
                free: problem.free,
                laws: (0..problem.laws.len())
                    .map(|k| coulomb(0.3 * k as f64))
                    .collect(),
            },
            solution: None,
        },
        StoredProblem::Lcp { matrix, q, .. } => StoredProblem::Lcp {
            matrix,
            q,
            solution: None,
        },
    }
}

proptest! {
    #[test]
    fn json_reads_back_bit_for_bit(problem in prop_oneof![stored(), lcp()]) {
        let text = to_json(&problem).unwrap();
        let loaded = read(text.as_bytes()).unwrap();
        prop_assert_eq!(&loaded.problem, &problem);
        prop_assert!(loaded.warnings.is_empty());
        // == takes -0 for 0; the text does not
        prop_assert_eq!(to_json(&loaded.problem).unwrap(), text);
    }

    #[test]
    fn dat_reads_back_bit_for_bit(
        problem in prop_oneof![stored(), lcp()],
        storage in prop_oneof![Just(DatStorage::Dense), Just(DatStorage::Blocks)],
    ) {
        let problem = as_dat_has_it(&problem);
        let text = to_dat(&problem, storage).unwrap() + "% a comment: 1 2 3\n";
        let loaded = read(text.as_bytes()).unwrap();
        prop_assert_eq!(&loaded.problem, &problem);
        // an explicit operator as JSON
        let loaded = read(to_json(&problem).unwrap().as_bytes()).unwrap();
        prop_assert_eq!(&loaded.problem, &problem);
    }
}

/// Laws that the text format has no place for are refused, not dropped.
#[test]
fn dat_refuses_what_it_cannot_hold() {
    for (law, what) in [
        (Law::Pin, "a pin"),
        (
            Law::Bounded {
                lower: 0.0,
                upper: 1.0,
                compliance: 0.0,
            },
            "a bounded row",
        ),
        (
            Law::Contact {
                friction: 0.1,
                compliance: 0.2,
            },
            "compliance",
        ),
    ] {
        let problem = ContactProblem {
            operator: Delassus::dense(DMatrix::identity(2, 2)),
            free: vec![Vec2::zeros()],
            laws: vec![law],
        };
        let stored = StoredProblem::Contact {
            problem,
            solution: None,
        };
        let error = to_dat(&stored, DatStorage::Dense);
        assert_eq!(error, Err(FileError::NoPlace { block: 0, what }));
    }
}

/// A problem that cannot be read back is not written.
#[test]
fn nan_is_not_written() {
    let mut matrix = DMatrix::identity(4, 4);
    matrix[(0, 3)] = f64::NAN;
    let stored = StoredProblem::Contact {
        problem: ContactProblem {
            operator: Delassus::dense(matrix.clone()),
            free: vec![Vec2::zeros(); 2],
            laws: vec![coulomb(0.5); 2],
        },
        solution: None,
    };
    let lcp = StoredProblem::Lcp {
        matrix,
        q: DVector::zeros(4),
        solution: None,
    };
    for stored in [stored, lcp] {
        assert!(to_json(&stored).is_err());
        assert!(to_dat(&stored, DatStorage::Blocks).is_err());
    }
}
