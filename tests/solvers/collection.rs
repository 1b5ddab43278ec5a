//! The frozen contact problems of `tests/data/problems` against every solver, judged by the residual
//! alone.
//!
//! `contact-index.csv` says where each problem comes from and what is expected of it: `solvable`;
//! `unsolvable`, where no impulses can be right; `open`, where nobody has found any yet, nor a proof.
//! `contact-work.csv` holds what each solver did with it. After a solver was changed on purpose,
//!
//! ```text
//! cargo test --release --test solvers collection -- --ignored
//! ```
//!
//! writes that file anew; its difference belongs into the change.

use moreau2d::contact::{ContactProblem, Vec2, natural_map};
use moreau2d::oracles::{SOLVERS, solver_by_name};
use moreau2d::problems::{StoredProblem, read};
use moreau2d::solver::SolveReport;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

const TOLERANCE: f64 = 1e-9;

#[derive(Deserialize)]
struct Entry {
    file: String,
    expected: String,
    origin: String,
}

#[derive(Serialize, Deserialize)]
struct Work {
    file: String,
    solver: String,
    solved: bool,
    sweeps: usize,
    factorisations: usize,
    pivots: usize,
}

/// Of one solver: problems it solved before, those it no longer solves, work before and now.
#[derive(Default)]
struct Total {
    solved: usize,
    lost: Vec<String>,
    was: [usize; 3],
    is: [usize; 3],
}

fn folder() -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests", "data", "problems"]
        .iter()
        .collect()
}

fn rows<T: for<'a> Deserialize<'a>>(name: &str) -> Vec<T> {
    let mut reader = csv::Reader::from_path(folder().join(name)).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

fn load(file: &str) -> (ContactProblem, Option<Vec<Vec2>>) {
    let loaded = read(&fs::read(folder().join(file)).unwrap()).unwrap();
    assert!(loaded.warnings.is_empty(), "{file}: {:?}", loaded.warnings);
    match loaded.problem {
        StoredProblem::Contact { problem, solution } => (problem, solution),
        StoredProblem::Lcp { .. } => panic!("{file} is an LCP"),
    }
}

/// Solves from nothing; the solver's word is the judge's, and nothing is NaN.
fn solve(solver: &str, file: &str, problem: &ContactProblem) -> SolveReport {
    let mut impulses = vec![Vec2::zeros(); problem.len()];
    let mut method = solver_by_name(solver).unwrap();
    let report = method.solve(problem, &mut impulses, TOLERANCE);
    assert!(
        impulses.iter().all(|p| p.x.is_finite() && p.y.is_finite()),
        "{file}, {solver}"
    );
    let residual = natural_map(problem, &impulses);
    assert_eq!(residual, report.residual, "{file}, {solver}");
    assert_eq!(
        report.solved(),
        residual.certified(TOLERANCE),
        "{file}, {solver}"
    );
    report
}

fn work(file: &str, solver: &str, report: &SolveReport) -> Work {
    Work {
        file: file.to_owned(),
        solver: solver.to_owned(),
        solved: report.solved(),
        sweeps: report.sweeps,
        factorisations: report.factorisations,
        pivots: report.pivots,
    }
}

#[test]
fn every_file_is_listed_once_and_says_where_it_comes_from() {
    let index: Vec<Entry> = rows("contact-index.csv");
    assert!(index.len() >= 100, "{}", index.len());
    let mut listed: Vec<&str> = index.iter().map(|e| e.file.as_str()).collect();
    listed.sort_unstable();
    let mut found: Vec<String> = fs::read_dir(folder())
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| !name.starts_with("lcp-") && !name.ends_with(".csv"))
        .collect();
    found.sort();
    assert_eq!(listed, found);
    for entry in &index {
        assert!(entry.origin.len() > 10, "{}", entry.file);
        let known = ["solvable", "unsolvable", "open"];
        assert!(known.contains(&entry.expected.as_str()), "{}", entry.file);
        let (problem, solution) = load(&entry.file);
        problem.validate().unwrap();
        match solution {
            // what the files call a solution is one
            Some(stored) => {
                let residual = natural_map(&problem, &stored);
                assert!(
                    residual.certified(TOLERANCE),
                    "{}: {residual:?}",
                    entry.file
                );
                assert_eq!(entry.expected, "solvable", "{}", entry.file);
            }
            // the text format has no place for one
            None => assert!(
                entry.expected != "solvable" || entry.file.ends_with(".dat"),
                "{}",
                entry.file
            ),
        }
    }
}

/// `auto` solves whatever is solvable. Every solver solves what it solved before, but for one in
/// fifty that round-off of another processor may cost; none takes more than a quarter more work for
/// it than before, or a tenth over all.
#[test]
fn every_solver_does_what_it_did() {
    let index: Vec<Entry> = rows("contact-index.csv");
    let pinned: Vec<Work> = rows("contact-work.csv");
    let mut before: BTreeMap<(&str, &str), &Work> = BTreeMap::new();
    for row in &pinned {
        before.insert((&row.file, &row.solver), row);
    }
    assert_eq!(before.len(), index.len() * SOLVERS.len());
    let mut totals: BTreeMap<&str, Total> = BTreeMap::new();
    for entry in &index {
        let file = entry.file.as_str();
        let (problem, _) = load(file);
        for solver in SOLVERS {
            let report = solve(solver, file, &problem);
            if solver == "auto" && entry.expected == "solvable" {
                assert!(report.solved(), "{file}: {report:?}");
            }
            assert!(
                !report.solved() || entry.expected != "unsolvable",
                "{file}, {solver}"
            );
            let old = before[&(file, solver)];
            let total = totals.entry(solver).or_default();
            if !old.solved {
                continue;
            }
            total.solved += 1;
            if !report.solved() {
                total.lost.push(file.to_owned());
                continue;
            }
            let was = [old.sweeps, old.factorisations, old.pivots];
            let is = [report.sweeps, report.factorisations, report.pivots];
            for (kind, (was, is)) in was.iter().zip(is).enumerate() {
                assert!(4 * is <= 5 * was + 40, "{file}, {solver}: {is}, was {was}");
                total.was[kind] += was;
                total.is[kind] += is;
            }
        }
    }
    for (solver, total) in totals {
        let Total {
            solved,
            lost,
            was,
            is,
        } = total;
        assert!(50 * lost.len() <= solved, "{solver} of {solved}: {lost:?}");
        for (was, is) in was.iter().zip(is) {
            assert!(10 * is <= 11 * was + 100, "{solver}: {is}, was {was}");
        }
    }
}

/// Not a test: writes `contact-work.csv` anew.
#[test]
#[ignore = "writes the pinned work"]
fn write_the_work_anew() {
    let mut writer = csv::Writer::from_path(folder().join("contact-work.csv")).unwrap();
    for entry in &rows::<Entry>("contact-index.csv") {
        let (problem, _) = load(&entry.file);
        for solver in SOLVERS {
            let report = solve(solver, &entry.file, &problem);
            writer
                .serialize(work(&entry.file, solver, &report))
                .unwrap();
        }
    }
    writer.flush().unwrap();
}
