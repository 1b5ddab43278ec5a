//! Comparison of solvers on a collection of problems, from the rows of `results.csv` alone.

use super::axis::Axis;
use super::chart::{Chart, Dash, HLine, Series, Style};
use super::csv_rows::{PerformanceRow, ResultRow};
use std::collections::HashMap;

/// Solvers on a collection of problems.
///
/// With `t_ps` the time of solver s on problem p,
///
/// ```text
/// r_ps = t_ps / min_s t_ps,   ∞ where s does not solve p                     (1)
/// ρ_s(τ) = |{p : r_ps ≤ τ}| / n                                              (2)
/// ```
///
/// `n` counts every problem, including those that no solver solves. `ρ_s(1)` is the share of problems
/// on which s is the fastest. At the right end, `ρ_s` is the share of problems that s solves.
///
/// # Source
/// Dolan & Moré, Math. Program. 91 (2002), eqs. 1 and 2.
#[derive(Debug, Clone, PartialEq)]
pub struct Performance {
    solvers: Vec<String>,
    /// The setting in the rows, if it is the same in all of them.
    setting: String,
    /// Of every time that was repeated, rising.
    spreads: Vec<f64>,
    problems: Vec<Problem>,
}

/// A problem, and for each solver its time \[s\] and work where it solves it.
#[derive(Debug, Clone, PartialEq)]
struct Problem {
    blocks: f64,
    times: Vec<Option<f64>>,
    works: Vec<Work>,
}

/// Work of solves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
pub struct Work {
    pub sweeps: usize,
    pub factorisations: usize,
    pub pivots: usize,
}

/// One solver over all problems.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Score {
    pub solver: String,
    /// Problems it solves.
    pub solved: usize,
    /// Problems that no other solver solves faster; in a tie all count.
    pub wins: usize,
    /// The least τ with `ρ(τ) ≥ 1/2`: half of the problems are solved within it. `None` where it
    /// does not solve half of them.
    pub median_ratio: Option<f64>,
    /// Sum over the problems it solves.
    #[serde(flatten)]
    pub work: Work,
}

impl Performance {
    /// Reads `solve-time`, `blocks`, `sweeps`, `factorisations` and `pivots` of every problem
    /// (`scene`) and solver, in their order. Solved is what has the verdict `pass` and a time above 0.
    pub fn new(rows: &[ResultRow]) -> Performance {
        let mut solvers: Vec<String> = Vec::new();
        for row in rows {
            if !solvers.contains(&row.solver) {
                solvers.push(row.solver.clone());
            }
        }
        let mut places: HashMap<&str, usize> = HashMap::new();
        let mut problems: Vec<Problem> = Vec::new();
        for row in rows {
            let place = *places.entry(&row.scene).or_insert_with(|| {
                problems.push(Problem {
                    blocks: f64::NAN,
                    times: vec![None; solvers.len()],
                    works: vec![Work::default(); solvers.len()],
                });
                problems.len() - 1
            });
            let problem = &mut problems[place];
            if row.measure == "blocks" {
                problem.blocks = row.value;
            }
            let solver = solvers.iter().position(|s| *s == row.solver);
            if let Some(k) = solver.filter(|_| row.verdict == "pass") {
                problem.take(k, row);
            }
        }
        let mut spreads: Vec<f64> = rows.iter().filter_map(|r| r.spread).collect();
        spreads.sort_by(f64::total_cmp);
        let setting = rows.first().map_or("", |r| &r.setting);
        let same = rows.iter().all(|r| r.setting == setting);
        Performance {
            solvers,
            setting: if same { setting } else { "" }.to_owned(),
            spreads,
            problems,
        }
    }

    /// Spread of the times: half the range of the repeats over their median, and of this the median
    /// over all times. Differences of ratios below it mean nothing. `None` without repeats.
    pub fn spread(&self) -> Option<f64> {
        self.spreads.get(self.spreads.len() / 2).copied()
    }

    /// The problems of `least` to `most` blocks.
    pub fn sized(&self, least: usize, most: usize) -> Performance {
        let within = |p: &&Problem| p.blocks >= least as f64 && p.blocks <= most as f64;
        Performance {
            problems: self.problems.iter().filter(within).cloned().collect(),
            ..self.clone()
        }
    }

    /// Number of problems.
    pub fn problems(&self) -> usize {
        self.problems.len()
    }

    /// Problems that no solver solves.
    pub fn unsolved(&self) -> usize {
        let none = |p: &&Problem| p.times.iter().all(Option::is_none);
        self.problems.iter().filter(none).count()
    }

    /// Every solver, in the order of the rows.
    pub fn scores(&self) -> Vec<Score> {
        let score = |(k, solver): (usize, &String)| {
            let ratios = self.ratios(k);
            let half = self.problems.len().div_ceil(2);
            let mut work = Work::default();
            for problem in self.problems.iter().filter(|p| p.times[k].is_some()) {
                work.sweeps += problem.works[k].sweeps;
                work.factorisations += problem.works[k].factorisations;
                work.pivots += problem.works[k].pivots;
            }
            Score {
                solver: solver.clone(),
                solved: ratios.len(),
                wins: ratios.iter().filter(|r| **r == 1.0).count(),
                median_ratio: half.checked_sub(1).and_then(|k| ratios.get(k)).copied(),
                work,
            }
        };
        self.solvers.iter().enumerate().map(score).collect()
    }

    /// The steps of (2): for every solver its share at τ = 1, and at each ratio at which it rises.
    pub fn profile(&self) -> Vec<PerformanceRow> {
        let mut rows = Vec::new();
        if self.problems.is_empty() {
            return rows;
        }
        let count = self.problems.len() as f64;
        for (k, solver) in self.solvers.iter().enumerate() {
            let ratios = self.ratios(k);
            let mut steps = ratios.clone();
            steps.insert(0, 1.0);
            steps.dedup();
            rows.extend(steps.into_iter().map(|ratio| PerformanceRow {
                solver: solver.clone(),
                ratio,
                share: ratios.partition_point(|r| *r <= ratio) as f64 / count,
            }));
        }
        rows
    }

    /// The profile as a picture: τ on a logarithmic axis, a curve a solver. It has no series, and
    /// so cannot be drawn, where there are no problems.
    pub fn chart(&self) -> Chart {
        let mut chart = Chart::new(
            "Performance profile of the impulse solvers",
            Axis::log("τ: time over that of the fastest solver [-]"),
            Axis::linear("share of problems solved within τ [-]"),
        );
        let setting = match self.setting.as_str() {
            "" => String::new(),
            setting => format!(", {setting}"),
        };
        let none = match self.unsolved() {
            0 => "Every problem is solved by some solver".to_owned(),
            n => format!("{n} that no solver solves count too"),
        };
        chart.subtitle = format!(
            "{} contact problems from zero impulses{setting}. Left end: share on which a solver is \
             the fastest; right end: share that it solves. {none}. After Dolan & Moré (2002).",
            self.problems()
        );
        let profile = self.profile();
        let most = profile.iter().map(|r| r.ratio).fold(1.0, f64::max);
        for (k, score) in self.scores().into_iter().enumerate() {
            let of = profile.iter().filter(|r| r.solver == score.solver);
            let mut points: Vec<(f64, f64)> = of.map(|r| (r.ratio, r.share)).collect();
            // the last value holds for ever
            points.extend(points.last().map(|p| (1.2 * most, p.1)));
            let name = format!("{}: {} solved", score.solver, score.solved);
            let mut series = Series::new(name, Style::Step, points);
            series.dash = [Dash::Solid, Dash::Dashed][k % 2];
            chart.series.push(series);
        }
        chart.lines.push(HLine {
            value: 1.0,
            label: "all".to_owned(),
        });
        chart
    }

    /// The ratios (1) that are finite, rising.
    fn ratios(&self, k: usize) -> Vec<f64> {
        let ratio = |p: &Problem| {
            let fastest = p.times.iter().flatten().copied().fold(f64::NAN, f64::min);
            p.times[k].map(|time| time / fastest)
        };
        let mut ratios: Vec<f64> = self.problems.iter().filter_map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        ratios
    }
}

impl Problem {
    /// Takes in a row of solver `k`, which solves this problem.
    fn take(&mut self, k: usize, row: &ResultRow) {
        let work = &mut self.works[k];
        match row.measure.as_str() {
            "solve-time" => {
                self.times[k] = Some(row.value).filter(|t| *t > 0.0 && t.is_finite());
            }
            "sweeps" => work.sweeps = row.value as usize,
            "factorisations" => work.factorisations = row.value as usize,
            "pivots" => work.pivots = row.value as usize,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(problem: &str, solver: &str, measure: &str, value: f64, verdict: &str) -> ResultRow {
        ResultRow {
            scene: problem.to_owned(),
            rung: String::new(),
            engine: "moreau".to_owned(),
            scheme: String::new(),
            solver: solver.to_owned(),
            setting: "tolerance 1e-8".to_owned(),
            dt_s: 0.0,
            threads: 1,
            precision: "f64".to_owned(),
            measure: measure.to_owned(),
            value,
            unit: String::new(),
            reference: String::new(),
            seconds_per_simulated_second: None,
            spread: None,
            verdict: verdict.to_owned(),
            mode: String::new(),
        }
    }

    /// Times of solvers a, b, c and d on problems of 1, 2, 3, ... blocks; NaN does not solve.
    fn performance(times: &[[f64; 4]]) -> Performance {
        let mut rows = Vec::new();
        for (p, times) in times.iter().enumerate() {
            let name = format!("p{p}");
            for (solver, &time) in ["a", "b", "c", "d"].iter().zip(times) {
                // what fails takes no time at all and must not be the fastest for it
                let (verdict, time) = match time.is_nan() {
                    true => ("unsolved", 1e-9),
                    false => ("pass", time),
                };
                for (measure, value) in [
                    ("solve-time", time),
                    ("sweeps", 10.0),
                    ("factorisations", 2.0),
                    ("pivots", (p + 1) as f64),
                    ("blocks", (p + 1) as f64),
                ] {
                    rows.push(row(&name, solver, measure, value, verdict));
                }
            }
        }
        Performance::new(&rows)
    }

    const NO: f64 = f64::NAN;

    /// a wins twice, once in a tie with b; c solves one at a ratio of 4; d fails everywhere, and the
    /// last problem is solved by none.
    fn sample() -> Performance {
        performance(&[
            [1.0, 2.0, NO, NO],
            [3.0, 3.0, 12.0, NO],
            [5.0, 2.0, NO, NO],
            [NO, NO, NO, NO],
        ])
    }

    #[test]
    fn known_ratios_give_known_shares() {
        let steps = |solver: &str| -> Vec<(f64, f64)> {
            let profile = sample().profile();
            let of = profile.iter().filter(|r| r.solver == solver);
            of.map(|r| (r.ratio, r.share)).collect()
        };
        assert_eq!(steps("a"), [(1.0, 0.5), (2.5, 0.75)]);
        assert_eq!(steps("b"), [(1.0, 0.5), (2.0, 0.75)]);
        assert_eq!(steps("c"), [(1.0, 0.0), (4.0, 0.25)]);
        assert_eq!(steps("d"), [(1.0, 0.0)]);
        assert_eq!(sample().profile().len(), 7);
    }

    #[test]
    fn scores_count_ties_failures_and_what_none_solves() {
        let performance = sample();
        assert_eq!((performance.problems(), performance.unsolved()), (4, 1));
        let scores = performance.scores();
        let found: Vec<_> = scores
            .iter()
            .map(|s| (s.solver.as_str(), s.solved, s.wins, s.median_ratio))
            .collect();
        assert_eq!(
            found,
            [
                ("a", 3, 2, Some(1.0)),
                ("b", 3, 2, Some(1.0)),
                ("c", 1, 0, None),
                ("d", 0, 0, None),
            ]
        );
        // of what it solves alone
        let work = |sweeps, factorisations, pivots| Work {
            sweeps,
            factorisations,
            pivots,
        };
        assert_eq!(scores[0].work, work(30, 6, 6));
        assert_eq!(scores[2].work, work(10, 2, 2));
        assert_eq!(scores[3].work, Work::default());
    }

    #[test]
    fn a_class_of_size_is_scored_by_itself() {
        let scores = sample().sized(3, 3).scores();
        assert_eq!(scores[0].median_ratio, Some(2.5));
        assert_eq!((scores[1].wins, scores[1].solved), (1, 1));
        let none = sample().sized(5, 9);
        assert_eq!(none.problems(), 0);
        assert_eq!(none.scores()[0].median_ratio, None);
        assert!(none.profile().is_empty() && none.chart().to_svg().is_err());
    }

    /// A solver alone is always the fastest; where none solves anything, the curves lie on 0.
    #[test]
    fn lone_solvers_and_hopeless_collections_are_drawn() {
        for (times, share) in [([7.0, NO, NO, NO], 1.0), ([NO; 4], 0.0)] {
            let performance = performance(&[times, times]);
            let first = &performance.profile()[0];
            assert_eq!((first.ratio, first.share), (1.0, share));
            let svg = performance.chart().to_svg().unwrap();
            assert!(!svg.contains("NaN") && !svg.contains("inf"));
        }
    }

    #[test]
    fn a_time_that_is_none_is_not_solved() {
        for time in [0.0, -1.0, f64::INFINITY, f64::NAN] {
            let rows = [
                row("p", "a", "solve-time", time, "pass"),
                row("p", "b", "solve-time", 1.0, "pass"),
            ];
            let scores = Performance::new(&rows).scores();
            assert_eq!((scores[0].solved, scores[1].wins), (0, 1), "{time}");
        }
    }

    #[test]
    fn the_spread_is_the_middle_one() {
        let mut rows: Vec<ResultRow> = ["p", "q", "r"]
            .map(|p| row(p, "a", "solve-time", 1.0, "pass"))
            .into();
        assert_eq!(Performance::new(&rows).spread(), None);
        for (row, spread) in rows.iter_mut().zip([0.3, 0.01, 0.02]) {
            row.spread = Some(spread);
        }
        assert_eq!(Performance::new(&rows).spread(), Some(0.02));
    }

    #[test]
    fn the_chart_shows_every_solver_from_one_to_the_right_end() {
        let chart = sample().chart();
        assert!(chart.subtitle.contains("4 contact problems"));
        assert!(chart.subtitle.contains("1 that no solver solves"));
        let names: Vec<&str> = chart.series.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(
            names,
            ["a: 3 solved", "b: 3 solved", "c: 1 solved", "d: 0 solved"]
        );
        for series in &chart.series {
            assert_eq!(series.points[0].0, 1.0);
            assert_eq!(series.points[series.points.len() - 1].0, 1.2 * 4.0);
        }
        assert_eq!(
            chart.series[0].points,
            [(1.0, 0.5), (2.5, 0.75), (4.8, 0.75)]
        );
    }
}
