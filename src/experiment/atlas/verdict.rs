use super::super::simulate::{Engine, RunError};
use super::trace::Trace;
use crate::report::SAID;

/// The check that every rung has for our engine.
const UNSOLVED: &str = "unsolved-islands";

/// One figure of a run and the most that it may be.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Check {
    pub measure: String,
    pub value: f64,
    /// SI unit, or in words what the value is relative to or counts.
    pub unit: String,
    /// The rung passes if `value ≤ limit`; NaN does not.
    pub limit: f64,
    /// Mode of the failure if the value exceeds the limit.
    pub mode: String,
}

impl Check {
    /// Whether the engine itself says that something is wrong with the run. It limits nothing.
    pub fn said(said: bool) -> Check {
        Check {
            measure: SAID.to_owned(),
            value: f64::from(u8::from(said)),
            unit: "yes or no".to_owned(),
            limit: f64::INFINITY,
            mode: String::new(),
        }
    }

    pub fn holds(&self) -> bool {
        self.value <= self.limit
    }
}

/// Verdict on a rung.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Verdict {
    Pass,
    Fail,
    /// All measures hold, but some island of some step was not certified.
    Unsolved,
    /// The engine cannot represent the rung, or a feature is not built in.
    Unavailable,
}

impl Verdict {
    /// The word of the `verdict` column.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Pass => "pass",
            Verdict::Fail => "fail",
            Verdict::Unsolved => "unsolved",
            Verdict::Unavailable => "",
        }
    }
}

/// A verdict with its mode and its checks.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Finding {
    pub verdict: Verdict,
    pub mode: String,
    pub checks: Vec<Check>,
    /// Wall time per simulated second, of the steps alone.
    pub cost: Option<f64>,
    /// Why there is no run, or why it ended early.
    pub reason: Option<String>,
}

impl Finding {
    /// An engine that cannot run the rung.
    pub fn unavailable(mode: &str, reason: String) -> Finding {
        Finding {
            verdict: Verdict::Unavailable,
            mode: mode.to_owned(),
            checks: Vec::new(),
            cost: None,
            reason: Some(reason),
        }
    }

    /// Judges every engine in the same way. A rung passes if all checks hold, else it fails with the
    /// mode of the first broken one. An energy that is not finite is an explosion. A rung with islands
    /// that no solve certified does not pass.
    ///
    /// # Arguments
    /// - `checks`: those of the rung.
    /// - `passes`: the mode of a pass.
    /// - `finite`: whether the energy at the end is a number.
    /// - `unsolved`: number of islands that were not certified; `None` for an engine that certifies
    ///   nothing.
    pub fn judged(
        mut checks: Vec<Check>,
        passes: &str,
        finite: bool,
        unsolved: Option<usize>,
    ) -> Finding {
        if let Some(count) = unsolved {
            checks.push(Check {
                measure: UNSOLVED.to_owned(),
                value: count as f64,
                unit: "islands".to_owned(),
                limit: 0.0,
                mode: "uncertified".to_owned(),
            });
        }
        let broken = checks.iter().find(|c| !c.holds());
        let (verdict, mode) = match broken {
            _ if !finite => (Verdict::Fail, "explodes"),
            None => (Verdict::Pass, passes),
            // the check of unsolved islands comes last
            Some(c) if c.measure == UNSOLVED => (Verdict::Unsolved, c.mode.as_str()),
            Some(c) => (Verdict::Fail, c.mode.as_str()),
        };
        Finding {
            verdict,
            mode: mode.to_owned(),
            checks,
            cost: None,
            reason: None,
        }
    }

    /// The finding for a run that ended early or could not start.
    ///
    /// # Errors
    /// Errors that are not the result of a run.
    pub fn stopped(error: RunError) -> Result<Finding, RunError> {
        match error {
            RunError::Unfit(reason) => Ok(Finding::unavailable("cannot", reason)),
            RunError::Step(error) => {
                let mut finding = Finding::judged(Vec::new(), "", true, None);
                (finding.verdict, finding.mode) = (Verdict::Fail, "stops".to_owned());
                finding.reason = Some(error.to_string());
                Ok(finding)
            }
            error => Err(error),
        }
    }

    /// The finding for a complete run.
    pub fn of(trace: &Trace, checks: Vec<Check>, passes: &str) -> Finding {
        let totals = &trace.totals;
        let certifies = trace.engine == Engine::Moreau;
        let mut finding = Finding::judged(
            checks,
            passes,
            totals.energy_end.is_finite(),
            certifies.then_some(totals.unsolved_islands),
        );
        finding.cost = Some(totals.wall / totals.time);
        finding
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(value: f64, mode: &str) -> Check {
        Check {
            measure: "m".to_owned(),
            value,
            unit: "1".to_owned(),
            limit: 1.0,
            mode: mode.to_owned(),
        }
    }

    fn verdict(checks: Vec<Check>, finite: bool, unsolved: Option<usize>) -> (Verdict, String) {
        let found = Finding::judged(checks, "stands", finite, unsolved);
        (found.verdict, found.mode)
    }

    #[test]
    fn the_first_broken_check_names_the_failure() {
        let one = |v: Verdict, mode: &str| (v, mode.to_owned());
        let good = || check(1.0, "leans");
        assert_eq!(
            verdict(vec![good()], true, Some(0)),
            one(Verdict::Pass, "stands")
        );
        assert_eq!(
            verdict(
                vec![good(), check(1.1, "sinks"), check(2.0, "falls")],
                true,
                None
            ),
            one(Verdict::Fail, "sinks")
        );
        assert_eq!(
            verdict(vec![check(f64::NAN, "never")], true, None),
            one(Verdict::Fail, "never")
        );
    }

    /// What is not certified is no pass, and what failed is not excused by it.
    #[test]
    fn nothing_uncertified_passes() {
        let uncertified = verdict(vec![check(0.0, "leans")], true, Some(1));
        assert_eq!(uncertified, (Verdict::Unsolved, "uncertified".to_owned()));
        let both = verdict(vec![check(2.0, "leans")], true, Some(1));
        assert_eq!(both, (Verdict::Fail, "leans".to_owned()));
        // an engine that certifies nothing is judged by what it does
        assert_eq!(
            verdict(vec![check(0.0, "leans")], true, None).0,
            Verdict::Pass
        );
    }

    #[test]
    fn infinite_energy_is_an_explosion() {
        let found = verdict(vec![check(0.0, "leans")], false, None);
        assert_eq!(found, (Verdict::Fail, "explodes".to_owned()));
    }
}
