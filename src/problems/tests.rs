//! Tests: formats written and read back, refused files and their messages, malformed input.

use super::*;
use crate::contact::{BodyOperator, Law, NO_BODY, Rows, Vec3};
use proptest::prelude::*;

pub(super) fn contact_of(loaded: &Loaded) -> &ContactProblem {
    match &loaded.problem {
        StoredProblem::Contact { problem, .. } => problem,
        StoredProblem::Lcp { .. } => panic!("an LCP"),
    }
}

pub(super) fn dense_of(loaded: &Loaded) -> DMatrix<f64> {
    match &contact_of(loaded).operator {
        operator @ Delassus::Blocks(_) => operator.explicit(),
        Delassus::Bodies(_) => panic!("from bodies"),
    }
}

pub(super) fn coulomb(friction: f64) -> Law {
    Law::Contact {
        friction,
        compliance: 0.0,
    }
}

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

/// The example of the docs is a valid problem file.
#[test]
fn the_example_of_the_docs_is_read() {
    let docs: String = (include_str!("mod.rs").lines())
        .filter_map(|line| line.strip_prefix("//! "))
        .flat_map(|line| [line, "\n"])
        .collect();
    let json = docs.split("```json\n").nth(1).unwrap();
    let loaded = read(json.split("```").next().unwrap().as_bytes()).unwrap();
    assert_eq!(contact_of(&loaded).laws, [coulomb(2.0)]);
    assert!(matches!(
        loaded.problem,
        StoredProblem::Contact { solution: Some(p), .. } if p == [Vec2::zeros()]
    ));
}

/// Column-major: [1 3; 2 4] is written 1 2 3 4, in any line layout.
#[test]
fn storages_hold_their_numbers_column_by_column() {
    let listing = "CSparse Version 3.1.4, Oct 10, 2014.  Copyright (c) T. Davis, 2006-2014\n";
    let dense = "2\n0 2 2\n2 2\n1 2\n3 4\n";
    // one block; and four, of which the upper right is the third number
    let block = "2\n1 2 2\n1\n1 1\n2\n2\n2 1\n0 1\n0\n0\n1 2 3 4\n";
    let four = "2\n1 2 2\n4\n2 2\n1 2\n1 2\n3 4\n0 2 4\n0 1 0 1\n0 1\n1 3\n2 2\n3 4\n";
    let columns = format!(
        "2\n2 2 2\n2\n{listing}2-by-2, nzmax: 4 nnz: 4, 1-norm: 7\n    col 0 : locations 0 to 1\n\
         0 : 1\n 1 : 2\n    col 1 : locations 2 to 3\n 0 : 3\n 1 : 4\n"
    );
    let triplets = format!(
        "2\n2 2 2\n1\n{listing}triplet: 2-by-2, nzmax: 9 nnz: 5\n 1 1 : 1\n 0 0 : 1\n 1 0 : 2\n \
         0 1 : 3\n 1 1 : 3\n"
    );
    for text in [dense, block, four, &columns, &triplets] {
        let loaded = read(format!("{text}-1 -2 trailing words").as_bytes()).unwrap();
        let expected = StoredProblem::Lcp {
            matrix: DMatrix::from_row_slice(2, 2, &[1.0, 3.0, 2.0, 4.0]),
            q: DVector::from_vec(vec![-1.0, -2.0]),
            solution: None,
        };
        assert_eq!(loaded.problem, expected, "{text}");
    }
}

/// An empty column is printed as ending before it begins.
#[test]
fn empty_columns_of_a_listing() {
    let text = "2\n2 2 2\n2\nCSparse\n2-by-2, nzmax: 1 nnz: 1, 1-norm: 7\ncol 0 : locations 0 to -1\n\
                col 1 : locations 0 to 0\n0 : 3\n-1 -2\n";
    let StoredProblem::Lcp { matrix, .. } = read(text.as_bytes()).unwrap().problem else {
        panic!("an LCP")
    };
    assert_eq!(matrix, DMatrix::from_row_slice(2, 2, &[0.0, 3.0, 0.0, 0.0]));
}

/// `2 1 2 2 2 ...` is an LCP of one block or a contact problem with a listing.
#[test]
fn the_one_ambiguous_beginning_is_told_apart() {
    let lcp = "2\n1 2 2\n2\n2 1\n1 2\n2\n3 2\n0 1 2\n0 0\n0\n1 2\n1\n3 4\n-1 -1\n";
    assert!(matches!(
        read(lcp.as_bytes()).unwrap().problem,
        StoredProblem::Lcp { .. }
    ));
    let contact = "2\n1\n2 2 2\n1\nCSparse\ntriplet: 2-by-2, nzmax: 2 nnz: 2\n0 0 : 3\n1 1 : 4\n\
                   -1 0\n0.5\n";
    let loaded = read(contact.as_bytes()).unwrap();
    assert_eq!(dense_of(&loaded).diagonal().as_slice(), [3.0, 4.0]);
}

#[test]
fn contact_problems_have_their_friction_and_free_term() {
    let text = "2 2\n0 4 4\n4 4\n2 0 0 0\n0 3 0 0\n0 0 4 1\n0 0 1 5\n-1 2 -3 4\n0.5 0\nend";
    let loaded = read(text.as_bytes()).unwrap();
    let problem = contact_of(&loaded);
    assert_eq!(problem.free, [Vec2::new(-1.0, 2.0), Vec2::new(-3.0, 4.0)]);
    assert_eq!(problem.laws, [coulomb(0.5), coulomb(0.0)]);
    assert_eq!(problem.operator.diagonal(1)[(0, 1)], 1.0);
}

/// One disc of mass 2 kg (inertia 4 kg m²) with q = M v, v = (1, 2, 3), and a contact at an arm of
/// 1 m: rows n = (0, 1, 0), t = (−1, 0, 1), so W = diag(1/2, 3/4) and Hᵀ v + b = (2, 2) + (10, 20).
/// Also with as many coordinates as rows, which could be read as a local problem.
#[test]
fn global_problems_are_reduced() {
    let mass = "0 3 3\n3 3\n2 0 0 0 2 0 0 0 4\n";
    let text = format!("2 1\n{mass}0 3 2\n3 2\n0 1 0 -1 0 1\n2 4 12\n10 20\n0.4\n");
    let loaded = read(text.as_bytes()).unwrap();
    let problem = contact_of(&loaded);
    // round-off of unit numbers
    let wanted = DMatrix::from_row_slice(2, 2, &[0.5, 0.0, 0.0, 0.75]);
    assert!((dense_of(&loaded) - wanted).amax() < 1e-15);
    assert!((problem.free[0] - Vec2::new(12.0, 22.0)).amax() < 1e-14);
    assert_eq!(problem.laws, [coulomb(0.4)]);
    // a point mass: H is 2 x 2 as W would be
    let text = "2 1\n0 2 2\n2 2\n2 0 0 2\n0 2 2\n2 2\n0 1 -1 0\n2 4\n10 20\n0.4\n";
    let loaded = read(text.as_bytes()).unwrap();
    assert_eq!(contact_of(&loaded).free, [Vec2::new(12.0, 19.0)]);
    // two of them, with H as a listing
    let diagonal = "2 0 0 0  0 2 0 0  0 0 2 0  0 0 0 2";
    let text = format!(
        "2 2\n0 4 4\n4 4\n{diagonal}\n2 4 4\n1\nCSparse\nnnz: 4\n0 0 : 1\n1 1 : 1\n2 2 : 1\n\
         3 3 : 1\n2 4 6 8\n0 0 0 0\n0.4 0.4\n"
    );
    let loaded = read(text.as_bytes()).unwrap();
    assert!((contact_of(&loaded).free[1] - Vec2::new(3.0, 4.0)).amax() < 1e-14);
    // the same length of head in a local problem, whose q looks like `storage 2 2`
    let text = "2 1\n0 2 2\n2 2\n2 0 0 2\n0 2\n2\n";
    let loaded = read(text.as_bytes()).unwrap();
    assert_eq!(contact_of(&loaded).free, [Vec2::new(0.0, 2.0)]);
}

/// Six digits leave an asymmetry of 1e-6: symmetrised, with a warning. A hundred times that is
/// refused.
#[test]
fn asymmetry_is_told_or_refused() {
    let with = |a: f64| read(format!("2 1\n0 2 2\n2 2\n2 1 {a:e} 2\n-1 0\n0.5").as_bytes());
    let loaded = with(1.0 + 4e-6).unwrap();
    let w = dense_of(&loaded);
    assert_eq!(w[(0, 1)], w[(1, 0)]);
    assert!((w[(0, 1)] - (1.0 + 2e-6)).abs() < 1e-15);
    let as_read = loaded.as_read.as_ref().unwrap().block(0, 0);
    assert_eq!((as_read[(1, 0)], as_read[(0, 1)]), (1.0, 1.0 + 4e-6));
    assert_eq!(loaded.warnings.len(), 1);
    assert!(
        loaded.warnings[0].contains("2.0e-6"),
        "{:?}",
        loaded.warnings
    );
    let plain = with(1.0).unwrap();
    assert!(plain.warnings.is_empty() && plain.as_read.is_none());
    let error = with(1.0 + 4e-4).unwrap_err();
    assert!(matches!(error, FileError::Asymmetric { .. }), "{error}");
    let message = error.to_string();
    assert!(
        message.starts_with("W[0, 1] = 1.0004e0") && message.contains("2.0e-4"),
        "{message}"
    );
    // the same at a contact a million times heavier than the other
    let heavy = "2 2\n0 4 4\n4 4\n2 0 0 0  0 2 0 0  0 0 2e-6 1e-6  0 0 1.0004e-6 2e-6\n";
    let error = read(format!("{heavy}-1 0 -1 0\n0.5 0.5").as_bytes()).unwrap_err();
    assert!(
        matches!(error, FileError::Asymmetric { row: 2, .. }),
        "{error}"
    );
    let indefinite = heavy.replace("1e-6", "3e-6").replace("1.0004e-6", "3e-6");
    let error = read(format!("{indefinite}-1 0 -1 0\n0.5 0.5").as_bytes()).unwrap_err();
    assert!(matches!(error, FileError::Indefinite { .. }), "{error}");
    // an LCP may have any matrix
    assert!(read(b"2\n0 2 2\n2 2\n2 1 -1 -2\n-1 0").is_ok());
}

const JSON: &str = r#"{
  "kind": "contact",
  "operator": {"dense": [[1.6, -1.2], [-1.2, 3.4]]},
  "free": [[0.05, -3]],
  "laws": [{"contact": {"friction": 2}}]
}"#;

/// Files, and the words of their errors.
#[test]
fn bad_files_are_refused_in_words() {
    let w = "2 1\n0 2 2\n2 2\n2 1\n1 2\n";
    let cases: Vec<(String, &[&str])> = vec![
        (String::new(), &["the file is empty"]),
        ("hello world".into(), &["line 1", "`hello world`"]),
        ("\n\n7 9 9".into(), &["line 3", "neither", "`7 9 9`"]),
        ("3 1\n0 3 3\n3 3\n".into(), &["line 1", "three-dimensional"]),
        (
            "2 1\n0 2 2\n".into(),
            &["line 2", "the rows of W", "end of the file"],
        ),
        (
            "2 1\n0 2 2\n2 3\n".into(),
            &["line 3", "again, 2", "found 3"],
        ),
        (
            "2 1\n0 2 2\n2 2\n2 1\n1".into(),
            &["line 5", "W (or M)[1, 1]", "end of the file"],
        ),
        (
            "2 1\n0 2 2\n2 2\n2 x\n1 2".into(),
            &["line 4", "[1, 0]", "`x`"],
        ),
        (
            "2 1\n0 2 2\n2 2\n2 nan\n1 2".into(),
            &["line 4", "finite", "`nan`"],
        ),
        (
            "2 1\n0 2 2\n2 2\n2 1e999\n1 2".into(),
            &["finite", "`1e999`"],
        ),
        (
            "2 2\n0 2 2\n2 2\n1 0 0 1\n".into(),
            &["line 2", "W of 4 x 4", "found 2 x 2"],
        ),
        (
            "2 1\n0 2 3\n2 3\n1 0 0 1 1 1\n".into(),
            &["line 2", "W of 2 x 2", "2 x 3"],
        ),
        (
            format!("{w}-1"),
            &["line 6", "q[1], one of 2", "end of the file"],
        ),
        (
            format!("{w}-1 0\n"),
            &["mu[0], one of 1", "end of the file"],
        ),
        (
            format!("{w}-1 0\n-0.5"),
            &["line 7", "mu[0] is -0.5", "at least 0"],
        ),
        (format!("{w}-1 0\ninf"), &["line 7", "mu[0]", "finite"]),
        (
            "2 1\n0 2 2\n2 2\n1 2 2 1\n-1 0\n0.5".into(),
            &["W is not positive semidefinite"],
        ),
        (
            "2 1\n0 2 2\n2 2\n0 0 0 0\n-1 0\n0.5".into(),
            &["block 0", "infinite mass"],
        ),
        (
            "2 1\n0 2 2\n2 2\n-1 0 0 -1\n0 2 2\n2 2\n1 0 0 1\n0 0\n0 0\n0.5".into(),
            &["M is not positive definite"],
        ),
        (
            "2 1\n0 3 3\n3 3\n1 0 0 0 1 0 0 0 1\n0 3 4\n".into(),
            &["line 5", "H of 3 x 2", "found 3 x 4"],
        ),
        ("2\n0 2 3\n2 3\n".into(), &["line 2", "M of 2 x 2", "2 x 3"]),
        (
            "2\n7 2 2\n".into(),
            &["the columns of W", "end of the file"],
        ),
        ("4 9 7 8 8".into(), &["neither"]),
        ("5\n2 5 5\n3\n".into(), &["line 3", "origin of M is 3"]),
        (
            "5\n2 5 5\n1\nCSpxrse".into(),
            &["line 4", "`CSparse`", "`CSpxrse`"],
        ),
        (
            "5\n2 5 5\n1\nCSparse\n5-by-5".into(),
            &["line 5", "`nnz:`", "end of the file"],
        ),
        (
            "5\n2 5 5\n1\nCSparse\nnnz: 1\n5 0 : 1".into(),
            &["line 6", "row", "below 5", "found 5"],
        ),
        (
            "5\n2 5 5\n2\nCSparse\nnnz: 1\ncol 1".into(),
            &["line 6", "the column of M, 0", "found 1"],
        ),
        (
            "5\n2 5 5\n2\nCSparse\nnnz: 1\ncol 0 : locations 0 to 7".into(),
            &["line 6", "ends at entry 7", "-1 to 0"],
        ),
        ("2\n1 2 2\n4\n2 2\n1 3\n".into(), &["line 5", "rise to 2"]),
        ("2\n1 2 2\n4\n2 2\n1 1\n".into(), &["line 5", "rise to 2"]),
        (
            "2\n1 2 2\n1\n1 1\n2\n2\n3 1\n".into(),
            &["line 7", "row pointer, 2", "found 3"],
        ),
        (
            "2\n1 2 2\n1\n1 1\n2\n2\n2 1\n0 0\n".into(),
            &["line 8", "row pointer", "rise from 0 to 1"],
        ),
        (
            "2\n1 2 2\n1\n1 1\n2\n2\n2 1\n0 1\n1\n".into(),
            &["line 9", "block column", "below 1"],
        ),
        (
            "2\n1 2 2\n1\n1 1\n2\n2\n2 1\n0 1\n0\n9\n".into(),
            &["line 10", "next block, 0", "found 9"],
        ),
        ("2\n0 0 0\n".into(), &["line 2", "M of 2 x 2", "0 x 0"]),
        (
            JSON.replace("\"free\"", "\"fre\""),
            &["line 4", "unknown field `fre`", "`free`"],
        ),
        (
            JSON.replace("friction", "fricton"),
            &["line 5", "unknown field `fricton`"],
        ),
        (
            JSON.replace("dense", "dence"),
            &["line 3", "unknown variant `dence`"],
        ),
        (
            JSON.replace("contact\",", "contcat\","),
            &["line 2", "`contcat`", "`contact` or `lcp`"],
        ),
        (
            JSON.replace(": 2}", ": -2}"),
            &["line 5", "friction is -2, must be at least 0"],
        ),
        (JSON.replace("0.05", "NaN"), &["line 4"]),
        (
            JSON.replace("0.05", "1e999"),
            &["line 4", "number out of range"],
        ),
        (
            JSON.replace("0.05, -3", "0.05"),
            &["line 4", "array of length 2"],
        ),
        (
            JSON.replace("[[0.05, -3]]", "[]"),
            &["1 blocks", "0 free terms"],
        ),
        (
            JSON.replace(", 3.4", ""),
            &["operator.dense[1] has 1 numbers", "must have 2"],
        ),
        (
            JSON.replace("[[1.6, -1.2], [-1.2, 3.4]]", "[[1]]"),
            &["1 rows", "two a block"],
        ),
        (
            JSON.replace("3.4", "0.4"),
            &["W is not positive semidefinite"],
        ),
        (JSON.replace("[-1.2, 3", "[-1.1, 3"), &["asymmetric"]),
        (JSON.replace("\n}", "\n} x"), &["line 6", "trailing"]),
        (
            JSON.replace("\n}", ",\"solution\": []}"),
            &["solution has 0 entries, must have 1"],
        ),
        (
            JSON.replace("\n}", ",\"free\": []}"),
            &["duplicate field `free`"],
        ),
        (JSON[..60].into(), &["line 3", "EOF"]),
        (
            JSON.replace("\"kind\": \"contact\",", ""),
            &["missing field `kind`"],
        ),
        (
            JSON.replace(
                "{\"contact\": {\"friction\": 2}}",
                "{\"bounded\": {\"lower\": 2, \"upper\": 1}}",
            ),
            &["block 0", "lower bound is 2"],
        ),
        (
            JSON.replace(
                "\"operator\"",
                "\"units\": {\"operator\": \"1/g\", \"free\": \"m/s\", \
            \"compliance\": \"1/kg\", \"impulse\": \"N s\"}, \"operator\"",
            ),
            &["line 3", "units must be", "1/kg"],
        ),
        (
            JSON.replace(
                "\"operator\"",
                "\"units\": {\"free\": \"mm/s\"}, \"operator\"",
            ),
            &["line 3", "units must be", "m/s"],
        ),
        (
            JSON.replace(
                "{\"dense\": [[1.6, -1.2], [-1.2, 3.4]]}",
                "{\"bodies\": {\"inverse_mass\": \
            [[1, 1, -1]], \"rows\": []}}",
            ),
            &["line 3", "inverse mass is -1"],
        ),
        (
            JSON.replace(
                "{\"dense\": [[1.6, -1.2], [-1.2, 3.4]]}",
                "{\"bodies\": {\"inverse_mass\": \
            [[1, 1, 1]], \"rows\": [{\"bodies\": [null, 1], \"jacobian\": [[[0,0,0],[0,0,0]],\
            [[0,1,0],[1,0,0]]]}]}}",
            ),
            &["rows[0].bodies names body 1 of 1"],
        ),
        (
            "{\"kind\": \"lcp\", \"matrix\": [[1, 2]], \"q\": [1]}".into(),
            &["matrix[0] has 2"],
        ),
        (
            "{\"kind\": \"lcp\", \"matrix\": [[1]], \"q\": [1, 2]}".into(),
            &["q has 2", "1 x 1"],
        ),
    ];
    let mut wrong = Vec::new();
    for (text, words) in cases {
        let message = read(text.as_bytes()).map_or_else(|e| e.to_string(), |p| format!("{p:?}"));
        if words.iter().any(|word| !message.contains(word)) {
            wrong.push(format!("{text:?}: lacks one of {words:?}: {message}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(read(b"2 1\n\xff"), Err(FileError::NotText { line: 2 }));
    assert_eq!(read(b"\x89HDF\r\n\x1a\nrest"), Err(FileError::Hdf5));
}

/// The numbers are missing, so reading allocates no memory for them and takes no time.
#[test]
fn huge_counts_are_no_allocation() {
    const HUGE: &str = "4611686018427387904";
    for text in [
        format!("{HUGE}\n0 {HUGE} {HUGE}\n{HUGE} {HUGE}\n1 2"),
        format!("{HUGE}\n1 {HUGE} {HUGE}\n{HUGE}\n{HUGE} {HUGE}\n1 2"),
        format!("{HUGE}\n2 {HUGE} {HUGE}\n1\nCSparse\nnnz: {HUGE}\n0 0 : 1"),
        format!("{HUGE}\n2 {HUGE} {HUGE}\n2\nCSparse\nnnz: 0\ncol 0 : locations 0 to -1"),
        format!("2 {HUGE}\n2 {HUGE} {HUGE}\n1\nCSparse\nnnz: 0\n1 2"),
        format!("2 {HUGE}\n0 0 {HUGE}\n0 {HUGE}\n"),
        format!("2 18446744073709551615\n0 1 1\n1 1\n1 0 1 {HUGE}\n1 {HUGE}\n1"),
    ] {
        assert!(read(text.as_bytes()).is_err(), "{text}");
    }
    // complete and sparse, but an LCP is made dense
    let n = MOST_ROWS + 1;
    let q = "-1 ".repeat(n);
    let text = format!("{n}\n2 {n} {n}\n1\nCSparse\nnnz: 1\n0 0 : 1\n{q}");
    let message = read(text.as_bytes()).unwrap_err().to_string();
    assert!(
        message.contains("10001 x 10001, at most 10000"),
        "{message}"
    );
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

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    /// Cuts out, doubles or replaces bytes of a valid file: read or refused, never a panic.
    #[test]
    fn mangled_files_never_panic(
        which in 0usize..9,
        at in any::<prop::sample::Index>(),
        cut in 0usize..8,
        insert in prop_oneof![
            "[0-9 .eE+-]{0,6}",
            "[ -~]{0,4}",
            Just("99999999999999999999 ".to_owned()),
            Just("-1 ".to_owned()),
            Just("nan ".to_owned()),
            Just("1e308 ".to_owned()),
            Just("]}".to_owned()),
        ],
    ) {
        let good = [
            JSON,
            "2\n0 2 2\n2 2\n1 2\n3 4\n-1 -2\n",
            "2\n1 2 2\n4\n2 2\n1 2\n1 2\n3 4\n0 2 4\n0 1 0 1\n0 1\n1 3\n2 2\n3 4\n-1 -1\n",
            "2\n2 2 2\n2\nCSparse\nnnz: 2, 1-norm: 7\ncol 0 : locations 0 to 0\n0 : 1\n\
             col 1 : locations 1 to 1\n1 : 4\n-1 -1\n",
            "2 1\n0 3 3\n3 3\n2 0 0 0 2 0 0 0 4\n0 3 2\n3 2\n0 1 0 -1 0 1\n2 4 12\n10 20\n0.4\n",
            "2 2\n0 4 4\n4 4\n2 0 0 0\n0 3 0 0\n0 0 4 1\n0 0 1 5\n-1 2 -3 4\n0.5 0\n",
            "{\"kind\": \"contact\", \"operator\": {\"bodies\": {\"inverse_mass\": [[1, 1, 1]], \
             \"rows\": [{\"bodies\": [null, 0], \"jacobian\": [[[0,0,0],[0,0,0]],[[0,1,0],[1,0,0]]]\
             }]}}, \"free\": [[-1, 0]], \"laws\": [\"pin\"], \"solution\": [[1, 0]]}",
            "{\"kind\": \"contact\", \"operator\": {\"blocks\": [[0, 0, [[2, 1], [1, 2]]], [1, 1, \
             [[2, 0], [0, 2]]], [0, 1, [[1, 0], [0, 0]]], [1, 0, [[1, 0], [0, 0]]]]}, \"free\": \
             [[-1, 0], [-1, 0]], \"laws\": [\"pin\", \"pin\"]}",
            "2 1\n2 3 3\n1\nCSparse\nnnz: 3\n0 0 : 2\n1 1 : 2\n2 2 : 4\n2 3 2\n1\nCSparse\nnnz: 3\n\
             1 0 : 1\n0 1 : -1\n2 1 : 1\n2 4 12\n10 20\n0.4\n",
        ][which];
        prop_assert!(read(good.as_bytes()).is_ok());
        let mut bytes = good.as_bytes().to_vec();
        let start = at.index(bytes.len());
        let end = (start + cut).min(bytes.len());
        bytes.splice(start..end, insert.bytes());
        let _ = read(&bytes);
        let _ = read(&bytes[..start]);
    }

    #[test]
    fn any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = read(&bytes);
    }
}
