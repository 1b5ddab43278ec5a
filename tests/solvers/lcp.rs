//! Plain LCPs from the literature and from formulas: every one ends as its index says, at a work that
//! is pinned.

use moreau2d::oracles::{complementarity_residual, proves_infeasible, solve_lcp};
use moreau2d::problems::{StoredProblem, read};
use moreau2d::solver::{LcpOptions, LcpStatus};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

/// File, pivots, paths and linear programmes, as measured.
const WORK: [(&str, usize, usize, usize); 39] = [
    ("lcp-copositive-plus.dat", 2, 1, 0),
    ("lcp-cps-447.dat", 5, 1, 0),
    ("lcp-degenerate-grid-16.json", 9, 1, 0),
    ("lcp-degenerate-ties.dat", 3, 1, 0),
    ("lcp-fathi-10.json", 1024, 1, 0),
    ("lcp-fathi-8.dat", 256, 1, 0),
    ("lcp-fathi-within-40.dat", 510, 1, 0),
    ("lcp-game-30.dat", 60, 6, 1),
    ("lcp-game-cps.dat", 7, 5, 1),
    ("lcp-game-degenerate-10.dat", 10, 6, 1),
    ("lcp-game-pennies.json", 10, 6, 1),
    ("lcp-hilbert-8.json", 19, 1, 0),
    ("lcp-huge-spread.dat", 7, 2, 1),
    ("lcp-lp-dual.dat", 7, 1, 0),
    ("lcp-murty-12.dat", 4096, 1, 0),
    ("lcp-murty-short-40.json", 2, 1, 0),
    ("lcp-murty-upper-16.dat", 65536, 1, 0),
    ("lcp-murty-within-40.dat", 4096, 1, 0),
    ("lcp-not-q0-6.json", 23, 11, 4),
    ("lcp-not-q0.dat", 8, 7, 4),
    ("lcp-not-unique.dat", 2, 1, 0),
    ("lcp-p-cyclic.dat", 4, 1, 0),
    ("lcp-p-nonsymmetric-20.json", 14, 1, 0),
    ("lcp-pang-isolated.dat", 3, 1, 0),
    ("lcp-pang-perturbed-transposed.json", 1, 1, 1),
    ("lcp-pang-perturbed.dat", 4, 1, 1),
    ("lcp-psd-infeasible.dat", 2, 1, 1),
    ("lcp-psd-range.json", 2, 1, 0),
    ("lcp-psd-rank-one.dat", 2, 1, 0),
    ("lcp-psd-rank-two-6.dat", 7, 1, 0),
    ("lcp-qp-convex.dat", 4, 1, 0),
    ("lcp-qp-indefinite.dat", 19, 4, 1),
    ("lcp-qp-infeasible.json", 4, 1, 1),
    ("lcp-qp-portfolio-12.dat", 13, 1, 0),
    ("lcp-scaled-rows.dat", 9, 1, 0),
    ("lcp-single-infeasible.json", 1, 1, 1),
    ("lcp-single.dat", 2, 1, 0),
    ("lcp-trivial.dat", 0, 0, 0),
    ("lcp-zero-diagonal.dat", 333, 27, 4),
];

fn folder() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests", "data", "problems"]
        .iter()
        .collect()
}

/// File and what is expected of it.
fn index() -> Vec<(String, String)> {
    let mut reader = csv::Reader::from_path(folder().join("lcp-index.csv")).unwrap();
    assert_eq!(
        reader.headers().unwrap(),
        &["file", "expected", "origin"][..]
    );
    let row = |row: csv::StringRecord| {
        assert!(row[2].len() > 5, "{} has no origin", &row[0]);
        (row[0].to_owned(), row[1].to_owned())
    };
    reader.records().map(|r| row(r.unwrap())).collect()
}

/// Every file is in the index and has its work, and nothing else is and has.
#[test]
fn the_index_is_complete() {
    let names = fs::read_dir(folder()).unwrap();
    let names = names.map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
    let files: BTreeSet<String> = names
        .filter(|name| name.starts_with("lcp-") && !name.ends_with(".csv"))
        .collect();
    let listed = index();
    assert_eq!(listed.len(), files.len());
    assert_eq!(
        listed
            .into_iter()
            .map(|(file, _)| file)
            .collect::<BTreeSet<_>>(),
        files
    );
    let worked = WORK.iter().map(|(file, ..)| (*file).to_owned());
    assert_eq!(worked.collect::<BTreeSet<_>>(), files);
}

#[test]
fn every_problem_ends_as_expected_at_its_work() {
    // the exponential paths are to be walked to their end
    let options = LcpOptions {
        max_pivots: 100_000,
        ..LcpOptions::default()
    };
    for (file, expected) in index() {
        let loaded = read(&fs::read(folder().join(&file)).unwrap()).unwrap();
        let StoredProblem::Lcp { matrix, q, .. } = loaded.problem else {
            panic!("{file} is no LCP");
        };
        let s = solve_lcp(&matrix, &q, &options).unwrap();
        let what = format!("{file}: {:?}, {} pivots", s.status, s.pivots);
        match expected.as_str() {
            "solvable" => {
                assert_eq!(s.status, LcpStatus::Solved, "{what}");
                let residual = complementarity_residual(&matrix, &q, &s.z);
                assert!(residual < 1e-9, "{what}: {residual}");
            }
            "infeasible" => {
                assert_eq!(s.status, LcpStatus::Infeasible, "{what}");
                let y = s.certificate.as_ref().expect("a proof");
                assert!(proves_infeasible(&matrix, &q, y), "{what}");
            }
            "unsolvable" => {
                assert_eq!(s.status, LcpStatus::Ray, "{what}");
                assert!(s.exhausted, "{what}");
            }
            other => panic!("{file}: `{other}`"),
        }
        let (_, pivots, paths, programmes) = WORK.iter().find(|w| w.0 == file).unwrap();
        // a tenth and two for the round-off of another processor
        for (work, recorded) in [
            (s.pivots, pivots),
            (s.paths, paths),
            (s.programmes, programmes),
        ] {
            assert!(
                work <= recorded + recorded / 10 + 2,
                "{what}: {work} > {recorded}"
            );
        }
    }
}
