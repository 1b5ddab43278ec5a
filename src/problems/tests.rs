//! Tests: the formats as they are read.

use super::*;
use crate::contact::Law;

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
