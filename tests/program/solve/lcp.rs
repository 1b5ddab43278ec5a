//! Linear complementarity problems.

use super::{LCP, numbers};
use crate::common::program::Place;
use moreau2d::problems::{DatStorage, StoredProblem, to_dat};
use nalgebra::{DMatrix, DVector};

#[test]
fn an_lcp_is_solved_by_lemke() {
    let place = Place::new();
    place.write("lcp", LCP);
    for solver in ["auto", "lemke"] {
        let (code, out, err) = place.run(&["solve", "lcp", "--solver", solver, "--out", "r.json"]);
        assert_eq!((code, err.as_str()), (0, ""), "{out}");
        assert!(
            out.contains("lcp: LCP of size 2\nsolver lemke: solved"),
            "{out}"
        );
        assert!(
            out.contains("complementarity residual max |min(m z, w)|"),
            "{out}"
        );
        let result = place.json("r.json");
        assert_eq!(
            (&result["kind"], &result["solver"]),
            (&"lcp".into(), &"lemke".into())
        );
        for (z, w) in numbers(&result["z"]).iter().zip(numbers(&result["w"])) {
            // round-off of a 2 x 2 solve
            assert!((z - 1.0 / 3.0).abs() < 1e-15 && w.abs() < 1e-15);
        }
        assert!(result["residual"].as_f64().unwrap() < 1e-15);
    }
}

/// Murty's family: 1 on the diagonal, 2 below, q = −1 takes 2ⁿ pivots, a million for n = 20.
#[test]
fn an_exponential_path_is_walked_to_its_end() {
    let place = Place::new();
    for n in [10usize, 20] {
        let stored = StoredProblem::Lcp {
            matrix: DMatrix::from_fn(n, n, |i, j| match i.cmp(&j) {
                std::cmp::Ordering::Equal => 1.0,
                std::cmp::Ordering::Greater => 2.0,
                std::cmp::Ordering::Less => 0.0,
            }),
            q: DVector::from_element(n, -1.0),
            solution: None,
        };
        place.write("murty.dat", to_dat(&stored, DatStorage::Blocks).unwrap());
        let (code, out, err) = place.run(&["solve", "murty.dat", "--out", "r.json"]);
        assert_eq!((code, err.as_str()), (0, ""), "{out}");
        let result = place.json("r.json");
        assert_eq!(result["iterations"]["pivots"], 1u64 << n);
        // whole numbers all the way: exact
        let mut z = vec![0.0; n];
        z[0] = 1.0;
        assert_eq!(numbers(&result["z"]), z);
        assert_eq!(result["residual"], 0.0);
    }
}

/// `w₁ = −z₂ − 1 < 0` whatever z: y = (1, 0).
#[test]
fn an_lcp_without_a_solution_is_proved_so() {
    let place = Place::new();
    place.write(
        "none.json",
        r#"{"kind": "lcp", "matrix": [[0, -1], [1, 0]], "q": [-1, 0]}"#,
    );
    let (code, out, err) = place.run(&["solve", "none.json", "--out", "r.json"]);
    assert_eq!((code, err.as_str()), (2, ""));
    assert!(out.contains("solver lemke: infeasible"), "{out}");
    assert!(out.contains("no solution: "), "{out}");
    let result = place.json("r.json");
    assert_eq!(result["status"], "infeasible");
    assert_eq!(result["iterations"]["programmes"], 1);
    let y = numbers(&result["certificate"]);
    // y ≥ 0, Mᵀ y = (y₂, −y₁) ≤ 0, qᵀ y = −y₁ < 0
    assert!(y[0] > 0.0 && y[1] == 0.0, "{y:?}");
    assert!(result["residual"].as_f64().unwrap() > 0.1);
}

/// `z₂ ≥ 1` for `w₁ ≥ 0`, and then `w₂ = z₂ > 0`.
#[test]
fn a_feasible_lcp_without_a_solution_ends_on_a_ray() {
    let place = Place::new();
    place.write(
        "ray.json",
        r#"{"kind": "lcp", "matrix": [[0, 1], [0, 1]], "q": [-1, 0]}"#,
    );
    let (code, out, err) = place.run(&["solve", "ray.json", "--out", "r.json"]);
    assert_eq!((code, err.as_str()), (2, ""));
    assert!(out.contains("solver lemke: ray"), "{out}");
    assert!(out.contains("apart from round-off there is none"), "{out}");
    let result = place.json("r.json");
    assert_eq!(result["status"], "ray");
    assert!(result["certificate"].is_null());
    assert!(result["residual"].as_f64().unwrap() > 0.1);
}
