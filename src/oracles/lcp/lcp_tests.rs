use super::*;
use crate::solver::lemke::{Search, solve_basis};

fn solve(matrix: &DMatrix<f64>, q: &[f64]) -> LcpSolution {
    solve_lcp(matrix, &DVector::from_row_slice(q), &LcpOptions::default()).unwrap()
}

/// Two unit loads on `M = [2 1; 1 2]`: by symmetry z = (1, 1)/3, 2 z₁ + z₂ = 1.
#[test]
fn textbook_problem() {
    let m = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
    let s = solve(&m, &[-1.0, -1.0]);
    assert_eq!(s.status, LcpStatus::Solved);
    // round-off of a 2 x 2 solve
    assert!((s.z[0] - 1.0 / 3.0).abs() < 1e-15 && (s.z[1] - 1.0 / 3.0).abs() < 1e-15);
    // q ≥ 0 is its own answer
    assert_eq!(solve(&m, &[0.0, 3.0]).pivots, 0);
}

/// The residual of good and bad points, some of which the solver never returns.
#[test]
fn residual_of_any_point() {
    let m = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
    let q = DVector::from_row_slice(&[-1.0, -1.0]);
    let at = |z: [f64; 2]| complementarity_residual(&m, &q, &DVector::from_row_slice(&z));
    // round-off of 1/3
    assert!(at([1.0 / 3.0; 2]) < 1e-15);
    // w = −1 of a depth of 1; w = (1, 0), m z = (2, 0) with m = 2; z₂ < 0
    assert_eq!((at([0.0; 2]), at([1.0, 0.0])), (1.0, 0.5));
    assert_eq!(at([1.0, -1.0]), 1.0);
    assert!(at([f64::NAN, 0.0]).is_nan());
    // q ≥ 0: the solution is zero
    let free = DVector::from_row_slice(&[1.0, 0.0]);
    assert_eq!(complementarity_residual(&m, &free, &DVector::zeros(2)), 0.0);
}

/// `w₁ = −z₂ − z₃ − 1e-4 < 0`, or `w₂ = −z₁ − 1 < 0` of the transpose, whatever `z ≥ 0`.
#[test]
fn infeasible_problems_are_proved_so() {
    let m = DMatrix::from_row_slice(3, 3, &[0.0, -1.0, -1.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0]);
    let q = [-1e-4, -1.0, 1.0];
    for (m, proof) in [(m.transpose(), [0.0, 1.0, 0.0]), (m, [1.0, 0.0, 0.0])] {
        let s = solve(&m, &q);
        assert_eq!((s.status, s.programmes), (LcpStatus::Infeasible, 1));
        // several y prove it; the simplest one suffices
        let q = DVector::from_row_slice(&q);
        assert!(proves_infeasible(&m, &q, &s.certificate.unwrap()));
        assert!(proves_infeasible(&m, &q, &DVector::from_row_slice(&proof)));
        assert!(s.residual > 1e-5 && s.z.iter().all(|x| x.is_finite()));
    }
}

#[test]
fn only_a_proof_is_a_proof() {
    // rows y = (1, 1) add up to 0 z − 1
    let m = DMatrix::from_row_slice(2, 2, &[1.0, -2.0, -1.0, 2.0]);
    let proves = |q: [f64; 2], y: &[f64]| {
        proves_infeasible(
            &m,
            &DVector::from_row_slice(&q),
            &DVector::from_row_slice(y),
        )
    };
    assert!(proves([1.0, -2.0], &[1.0, 1.0]));
    for y in [
        &[1.0, 1.0 + 1e-12][..],
        &[1.0, 1.0 - 1e-12],
        &[1.0, 0.0],
        &[0.0, 0.0],
        &[-1.0, -1.0],
        &[f64::NAN, 1.0],
        &[f64::INFINITY; 2],
        &[1.0; 3],
    ] {
        assert!(!proves([1.0, -2.0], y), "{y:?}");
    }
    // solvable, with no margin
    for q in [[2.0, -1.0], [1.0, -1.0], [1.0, -1.0 - 1e-15]] {
        assert!(!proves(q, &[1.0, 1.0]), "{q:?}");
        assert_ne!(solve(&m, &q).status, LcpStatus::Infeasible, "{q:?}");
    }
}

/// `z₂ ≥ 1` for `w₁ ≥ 0`, and then `w₂ = z₂ > 0`: feasible, and not complementary.
#[test]
fn a_feasible_problem_without_a_solution_stays_a_ray() {
    let m = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 0.0, 1.0]);
    let s = solve(&m, &[-1.0, 0.0]);
    assert_eq!((s.status, s.exhausted), (LcpStatus::Ray, true));
    assert_eq!(s.certificate, None);
    assert!(s.residual > 0.1 && s.z.iter().all(|x| x.is_finite()));
}

/// Without fallbacks a ray is the end, at no further cost.
#[test]
fn fallbacks_can_be_left_out() {
    let (m, q) = cottle_pang_stone_game();
    let options = LcpOptions {
        fallbacks: false,
        ..LcpOptions::default()
    };
    let s = solve_lcp(&m, &q, &options).unwrap();
    assert_eq!(s.status, LcpStatus::Ray);
    assert_eq!((s.pivots, s.paths, s.programmes), (1, 1, 0));
}

/// Cottle, Pang & Stone (1992), example 4.4.23.
fn cottle_pang_stone_game() -> (DMatrix<f64>, DVector<f64>) {
    let rows = [
        [0.0, 0.0, 10.0, 20.0],
        [0.0, 0.0, 30.0, 15.0],
        [10.0, 20.0, 0.0, 0.0],
        [30.0, 15.0, 0.0, 0.0],
    ];
    let m = DMatrix::from_row_slice(4, 4, rows.as_flattened());
    (m, DVector::from_element(4, -1.0))
}

/// `M ≥ 0` with a zero diagonal: every positive covering vector ends on a ray at once.
#[test]
fn the_bimatrix_game_is_solved_from_another_basis() {
    let (m, q) = cottle_pang_stone_game();
    let s = solve_lcp(&m, &q, &LcpOptions::default()).unwrap();
    assert_eq!(s.status, LcpStatus::Solved);
    // two pure solutions and the mixed one, (1, 4, 1, 4)/90; round-off
    assert!(complementarity_residual(&m, &q, &s.z) < 1e-15);
    assert!(s.paths > 1 && s.programmes == 1);
}

/// Every game with positive costs has an equilibrium, and Lemke & Howson's path finds one; whole
/// numbers of 1 to 4 tie.
#[test]
fn bimatrix_games_are_solved_without_the_tree() {
    let mut random = crate::solver::lemke::tests::Random(3);
    for case in 0..120 {
        let n = 2 + case % 29;
        let first = 1 + random.below(n - 1);
        let m = DMatrix::from_fn(n, n, |i, j| match (i < first) != (j < first) {
            true if case % 2 == 0 => 1.0 + random.below(4) as f64,
            true => random.between(0.1, 1.0),
            false => 0.0,
        });
        let s = solve_lcp(&m, &DVector::from_element(n, -1.0), &LcpOptions::default()).unwrap();
        assert_eq!(s.status, LcpStatus::Solved, "{m}");
        // measured: at most 1000 pivots for n = 30
        assert!(s.programmes == 1 && s.pivots < 2000, "{n}: {}", s.pivots);
    }
}

/// A solution is planted, `M` is of no class, half of the time sparse whole numbers: all are solved,
/// some by each of the fallbacks.
#[test]
fn planted_solutions_are_found_by_every_fallback() {
    let mut random = crate::solver::lemke::tests::Random(11);
    let mut by = [0; 4];
    for case in 0..200 {
        let n = 4 + case % 9;
        let whole = case % 2 == 0;
        let mut number = |share: f64| match (random.between(0.0, 1.0) < share, whole) {
            (false, _) => 0.0,
            (true, true) => random.below(5) as f64 - 2.0,
            (true, false) => random.between(-1.0, 1.0),
        };
        let m = DMatrix::from_fn(n, n, |_, _| number(if whole { 0.4 } else { 1.0 }));
        let z = DVector::from_fn(n, |_, _| number(1.0));
        let q = z.map(|x| (-x).max(0.0)) - &m * z.map(|x| x.max(0.0));
        let s = solve_lcp(&m, &q, &LcpOptions::default()).unwrap();
        assert_eq!(s.status, LcpStatus::Solved, "{m} {q}");
        assert!(complementarity_residual(&m, &q, &s.z) <= 1e-9);
        by[match (s.paths, s.programmes) {
            (0 | 1, _) => 0,
            (_, 2..) => 3,
            (2..=5, _) => 1,
            _ => 2,
        }] += 1;
    }
    assert!(by.iter().all(|count| *count > 5), "{by:?}");
}

/// Against all 2ⁿ bases, one by one: a problem with a solution among them is solved, and one
/// without is proved infeasible or searched to the end.
#[test]
fn no_solution_is_missed() {
    let mut random = crate::solver::lemke::tests::Random(5);
    let mut ends = [0; 3];
    for case in 0..1200 {
        let n = 1 + case % 7;
        let mut number = || match (case % 2, case % 3) {
            (0, _) if random.between(0.0, 1.0) < 0.5 => 0.0,
            (_, 0) => random.below(5) as f64 - 2.0,
            _ => random.between(-1.0, 1.0),
        };
        let m = DMatrix::from_fn(n, n, |_, _| number());
        let q = DVector::from_fn(n, |_, _| number());
        let s = solve_lcp(&m, &q, &LcpOptions::default()).unwrap();
        let exists = (0..1usize << n).any(|bits| {
            let support: Vec<usize> = (0..n).filter(|i| bits >> i & 1 == 1).collect();
            // negative parts of z are cut off, which the residual detects
            let z = solve_basis(&m, &q, &support);
            z.is_some_and(|z| complementarity_residual(&m, &q, &z) <= 1e-9)
        });
        match s.status {
            LcpStatus::Solved => ends[0] += 1,
            LcpStatus::Infeasible => ends[1] += 1,
            LcpStatus::Ray if s.exhausted => ends[2] += 1,
            end => panic!("{end:?} {m} {q}"),
        }
        assert!(!exists || s.status == LcpStatus::Solved, "{m} {q}");
    }
    assert!(ends.iter().all(|count| *count > 100), "{ends:?}");
}

/// Rows and columns of very different size: the first path takes small numbers for zero.
#[test]
fn badly_scaled_problems_are_solved_after_balancing() {
    let m = DMatrix::from_diagonal(&DVector::from_row_slice(&[1.0, 4e-9]));
    let s = solve(&m, &[-1.0, -4e-9]);
    assert_eq!(s.status, LcpStatus::Solved);
    // round-off
    assert!((s.z - DVector::from_row_slice(&[1.0, 1.0])).amax() < 1e-15);
    assert!(s.paths == 2 && s.programmes == 1);
}

/// Numbers from the least to the largest: any status, but finite, and a valid certificate.
#[test]
fn wild_numbers_stay_finite() {
    let mut random = crate::solver::lemke::tests::Random(9);
    let mut proofs = 0;
    for case in 0..2000 {
        let n = 1 + case % 5;
        let digits = [3.0, 30.0, 300.0][case % 3];
        let mut number = || match random.between(0.0, 1.0) < 0.3 {
            true => 0.0,
            false => random.between(-1.0, 1.0) * 10f64.powf(random.between(-digits, digits)),
        };
        let m = DMatrix::from_fn(n, n, |_, _| number());
        let q = DVector::from_fn(n, |_, _| number());
        let s = solve_lcp(&m, &q, &LcpOptions::default()).unwrap();
        let mut numbers = s.z.iter().chain(s.w.iter());
        assert!(numbers.all(|x| x.is_finite()) && s.residual.is_finite());
        assert!(s.z.iter().all(|x| *x >= 0.0));
        assert_eq!(s.certificate.is_some(), s.status == LcpStatus::Infeasible);
        if let Some(y) = &s.certificate {
            assert!(proves_infeasible(&m, &q, y) && y.amax() == 1.0);
            proofs += 1;
        }
    }
    assert!(proofs > 100, "{proofs}");
}

/// Murty's family: 1 on the diagonal, 2 below it, q = −1 takes 2ⁿ pivots.
#[test]
fn murty_family_is_exponential_and_the_limit_stops_it() {
    let family = |n| {
        DMatrix::from_fn(n, n, |i: usize, j: usize| match i.cmp(&j) {
            std::cmp::Ordering::Equal => 1.0,
            std::cmp::Ordering::Greater => 2.0,
            std::cmp::Ordering::Less => 0.0,
        })
    };
    for n in 1..=8 {
        let s = solve(&family(n), &vec![-1.0; n]);
        assert_eq!((s.status, s.pivots), (LcpStatus::Solved, 1 << n));
        assert_eq!(s.z[0], 1.0);
    }
    let options = LcpOptions {
        max_pivots: 100,
        ..LcpOptions::default()
    };
    let q = DVector::from_element(8, -1.0);
    let s = solve_lcp(&family(8), &q, &options).unwrap();
    assert_eq!((s.status, s.pivots), (LcpStatus::PivotLimit, 100));
}

/// A positive definite plus a skew matrix is a P-matrix: the solution is unique and known.
#[test]
fn random_p_matrices_return_the_known_solution() {
    let mut random = crate::solver::lemke::tests::Random(7);
    for case in 0..60 {
        let n = 1 + case;
        let a = DMatrix::from_fn(n, n, |_, _| random.between(-1.0, 1.0));
        let s = DMatrix::from_fn(n, n, |_, _| random.between(-1.0, 1.0));
        let m = &a * a.transpose() / n as f64 + DMatrix::identity(n, n) * 0.1 + &s - s.transpose();
        let z = DVector::from_fn(n, |_, _| random.between(-1.0, 1.0));
        let w = z.map(|x| (-x).max(0.0));
        let z = z.map(|x| x.max(0.0));
        let q = &w - &m * &z;
        let found = solve_lcp(&m, &q, &LcpOptions::default()).unwrap();
        assert_eq!(found.status, LcpStatus::Solved, "n = {n}");
        // condition number below 1e4 here, times round-off
        assert!((found.z - z).amax() < 1e-11, "n = {n}");
    }
}

#[test]
fn answer_scales_with_the_data() {
    let m = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]) * 1e12;
    let s = solve(&m, &[-1e-6, -1e-6]);
    assert_eq!(s.status, LcpStatus::Solved);
    // relative round-off
    assert!((s.z[0] * 3e18 - 1.0).abs() < 1e-14);
}

#[test]
fn wrong_shapes_and_nan_are_refused() {
    let options = LcpOptions::default();
    let q = DVector::from_element(2, -1.0);
    assert_eq!(
        solve_lcp(&DMatrix::zeros(2, 3), &q, &options),
        Err(LcpError::Shape {
            rows: 2,
            columns: 3,
            free: 2
        })
    );
    let mut m = DMatrix::identity(2, 2);
    m[(1, 0)] = f64::NAN;
    assert_eq!(
        solve_lcp(&m, &q, &options),
        Err(LcpError::NonFinite { row: 1 })
    );
}

/// A matrix of zeros has no block to pivot on, and the n²/2 attempts must not copy the tableau
/// each.
#[test]
fn singular_starts_count_as_work() {
    let n = 60;
    let options = LcpOptions {
        max_pivots: 100,
        ..LcpOptions::default()
    };
    let free = DVector::from_element(n, -1.0);
    let mut search = Search::new(DMatrix::zeros(n, n), free, options);
    let balanced = restart::Balanced::new(&search);
    restart::other_paths(&mut search, &balanced);
    // a ray at once from each of the four covering vectors
    assert_eq!((search.pivots, search.refused), (4, 96));
}

/// The solution (30025, 30024) depends on the last digits of M, too small for a pivot, so a ray
/// comes first. The ray starts from a point with a residual of 1.5e-10, for which no proof of
/// infeasibility may be found.
#[test]
fn a_ray_from_a_point_within_the_tolerance_is_solved() {
    let m = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0 + 1e-14]);
    let s = solve(&m, &[-1.0, 1.0 - 3e-10]);
    assert!(s.residual < 2e-10, "{s:?}");
    assert_eq!((s.status, s.certificate), (LcpStatus::Solved, None));
}
