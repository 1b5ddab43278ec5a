use super::results::{interleave, median_and_spread};
use crate::contact::{ContactProblem, Vec2, natural_map};
use crate::oracles::{SOLVERS, solver_by_name};
use crate::report::{Progress, ResultRow};
use crate::solver::ImpulseSolver;
use std::time::Instant;

/// Least duration of a timing \[s\]; shorter solves are repeated until they fill it. A clock resolves
/// some 1e-8 s, and the shortest solves take 1e-7 s.
const SHORTEST: f64 = 1e-3;

/// A contact problem and its name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedProblem {
    pub name: String,
    pub problem: ContactProblem,
}

/// One solver on one problem.
struct Point<'a> {
    problem: &'a NamedProblem,
    solver: &'static str,
    ended: Option<Ended>,
}

/// Result of the first solve, and the time of a solve in each repeat \[s\].
struct Ended {
    solved: bool,
    residual: f64,
    sweeps: usize,
    factorisations: usize,
    pivots: usize,
    times: Vec<f64>,
}

/// Solves every problem with every solver of [`SOLVERS`], from zero impulses, and times it.
///
/// Repeats are interleaved: every solver solves every problem once before any solves it again, so
/// that a slowdown of the computer affects all of them. Each repeat uses a new solver object. If its
/// first solve takes 1 ms or more, that is the time. If it takes less, the object, whose buffers and
/// caches are now warm, repeats the solve from zero until 1 ms is filled; the first solve does not
/// count. A solver that fails on a problem would fail again, so its first solve is its only timing.
/// All but the times is deterministic.
///
/// # Arguments
/// - `tolerance`: relative, see [`crate::contact::Residual::certified`].
/// - `repeats`: timings of each point, 1 at least.
/// - `progress`: advanced once for each timing.
///
/// # Returns
/// For every problem (`scene`) and solver a row each of `solve-time` \[s\], the median of the
/// repeats, with half their range over it in `spread`; `residual`, the smallest tolerance at which
/// [`natural_map`] certifies the impulses
/// ([`Residual::merit`](crate::contact::Residual::merit)); `sweeps`, `factorisations`, `pivots` of
/// one solve; and `blocks`, the size of the problem. The verdict is `pass` if [`natural_map`]
/// certifies the impulses, else `unsolved`, with mode `untried` if the solver does not accept
/// problems of this size. Nothing is stepped: `dt_s` is 0 and there is no simulated time.
pub fn bench_solvers(
    problems: &[NamedProblem],
    tolerance: f64,
    repeats: usize,
    progress: &Progress,
) -> Vec<ResultRow> {
    let mut points = Vec::new();
    for problem in problems {
        points.extend(SOLVERS.map(|solver| Point {
            problem,
            solver,
            ended: None,
        }));
    }
    let visited = interleave(&mut points, repeats, |_, point| {
        point.visit(tolerance);
        progress.advance();
        Ok::<_, std::convert::Infallible>(())
    });
    match visited {
        Ok(()) => points.iter_mut().flat_map(|p| p.rows(tolerance)).collect(),
    }
}

impl Point<'_> {
    /// Solves and times once more, unless it failed before.
    fn visit(&mut self, tolerance: f64) {
        if self.ended.as_ref().is_some_and(|e| !e.solved) {
            return;
        }
        // the name is one of the table
        let Some(mut solver) = solver_by_name(self.solver) else {
            return;
        };
        let problem = &self.problem.problem;
        let mut impulses = vec![Vec2::zeros(); problem.len()];
        let start = Instant::now();
        let report = solver.solve(problem, &mut impulses, tolerance);
        let first = start.elapsed().as_secs_f64();
        let residual = natural_map(problem, &impulses);
        let ended = self.ended.get_or_insert_with(|| Ended {
            solved: residual.certified(tolerance),
            residual: residual.merit(),
            sweeps: report.sweeps,
            factorisations: report.factorisations,
            pivots: report.pivots,
            times: Vec::new(),
        });
        ended.times.push(if ended.solved && first < SHORTEST {
            warm_time(solver.as_mut(), problem, &mut impulses, tolerance)
        } else {
            first
        });
    }

    fn rows(&mut self, tolerance: f64) -> Vec<ResultRow> {
        let Some(ended) = &mut self.ended else {
            return Vec::new();
        };
        let (time, spread) = median_and_spread(&mut ended.times);
        let untried = ended.sweeps + ended.factorisations + ended.pivots == 0;
        let figures = [
            ("solve-time", time.unwrap_or(f64::NAN), "s"),
            ("residual", ended.residual, "1"),
            ("sweeps", ended.sweeps as f64, "1"),
            ("factorisations", ended.factorisations as f64, "1"),
            ("pivots", ended.pivots as f64, "1"),
            ("blocks", self.problem.problem.len() as f64, "1"),
        ];
        let row = |(measure, value, unit): (&str, f64, &str)| ResultRow {
            scene: self.problem.name.clone(),
            rung: String::new(),
            engine: "moreau".to_owned(),
            scheme: String::new(),
            solver: self.solver.to_owned(),
            setting: format!("tolerance {tolerance:e}"),
            dt_s: 0.0,
            threads: 1,
            precision: "f64".to_owned(),
            measure: measure.to_owned(),
            value,
            unit: unit.to_owned(),
            reference: String::new(),
            seconds_per_simulated_second: None,
            spread: spread.filter(|_| measure == "solve-time"),
            verdict: if ended.solved { "pass" } else { "unsolved" }.to_owned(),
            mode: if !ended.solved && untried {
                "untried"
            } else {
                ""
            }
            .to_owned(),
        };
        figures.map(row).into()
    }
}

/// Mean time of a solve \[s\] over as many solves as fill [`SHORTEST`].
fn warm_time(
    solver: &mut dyn ImpulseSolver,
    problem: &ContactProblem,
    impulses: &mut [Vec2],
    tolerance: f64,
) -> f64 {
    let mut count = 1_u32;
    loop {
        let start = Instant::now();
        for _ in 0..count {
            impulses.fill(Vec2::zeros());
            solver.solve(problem, impulses, tolerance);
        }
        let elapsed = start.elapsed().as_secs_f64();
        // the bound on the count ends the loop even if the clock does not advance
        if elapsed >= SHORTEST || count > 1 << 20 {
            return elapsed / f64::from(count);
        }
        count *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Delassus, Law};
    use nalgebra::DMatrix;

    /// `contacts` unit masses that fall on the floor side by side.
    fn row_of_masses(contacts: usize) -> NamedProblem {
        NamedProblem {
            name: format!("row-{contacts}"),
            problem: ContactProblem {
                operator: Delassus::dense(DMatrix::identity(2 * contacts, 2 * contacts)),
                free: vec![Vec2::new(-1.0, 0.1); contacts],
                laws: vec![
                    Law::Contact {
                        friction: 0.5,
                        compliance: 0.0
                    };
                    contacts
                ],
            },
        }
    }

    /// Six rows for every solver on every problem, in order. Enumeration does not accept 40
    /// contacts. The residual, not the solver's report, decides the verdict.
    #[test]
    fn every_solver_has_its_rows_on_every_problem() {
        let problems = [row_of_masses(1), row_of_masses(40)];
        let progress = Progress::new("", 0, true);
        let rows = bench_solvers(&problems, 1e-8, 2, &progress);
        assert_eq!(rows.len(), problems.len() * SOLVERS.len() * 6);
        let mut at = rows.chunks(6);
        for problem in &problems {
            for solver in SOLVERS {
                let rows = at.next().unwrap();
                let measures = [
                    "solve-time",
                    "residual",
                    "sweeps",
                    "factorisations",
                    "pivots",
                    "blocks",
                ];
                for (row, measure) in rows.iter().zip(measures) {
                    assert_eq!((&row.scene, &*row.solver), (&problem.name, solver));
                    assert_eq!(row.measure, measure);
                    let fails = solver == "enumeration" && problem.name == "row-40";
                    let expected = match fails {
                        true => ("unsolved", "untried"),
                        false => ("pass", ""),
                    };
                    assert_eq!((&*row.verdict, &*row.mode), expected, "{row:?}");
                    // one that fails is timed once
                    assert_eq!(row.spread.is_some(), measure == "solve-time" && !fails);
                }
                assert!(rows[0].value > 0.0);
                assert_eq!(rows[5].value, problem.problem.len() as f64);
                assert_eq!(rows[1].value <= 1e-8, rows[1].verdict == "pass");
            }
        }
    }
}
