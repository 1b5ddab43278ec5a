//! The life of the teeth under both protocols: with the feed held, and with the torque held.

use super::blocks::{LifeErrors, Tooth};
use super::life::{Kept, Observer, ThreshingOutcome, run_threshing};
use super::machine::Setup;
use super::parameters::{Hold, Thresher};
use crate::dynamics::record::StepRecord;
use crate::experiment::{RunError, Totals};
use crate::report::{Align, Progress, Table, number, plus_minus};
use crate::scene::Scene;
use crate::thresher::ThreshingWorld;
use crate::wear::LimitLife;
use serde_json::{Value, json};
use std::panic::resume_unwind;

/// The run of a scene, and the same machine with the other quantity held.
#[derive(Debug, Clone)]
pub struct Lives {
    pub held: Hold,
    pub run: ThreshingOutcome,
    pub other: ThreshingOutcome,
}

/// Runs the thresher over its life as the scene says, and on a second thread with the other
/// quantity held.
///
/// # Arguments
/// - `kept`: the checkpoint of a life by its name, [`Kept`].
///
/// # Errors
/// Those of [`run_threshing`].
pub fn run_lives(
    scene: &Scene,
    setup: &Setup<Thresher>,
    progress: impl Fn(&str, u64) -> Progress,
    observe: Observer,
    kept: Kept,
) -> Result<Lives, RunError> {
    let held = setup.parameters.hold;
    let mut second = setup.clone();
    second.parameters.hold = held.other();
    // three more lives for the error of the scene's own life are enough
    second.wear.error = LifeErrors::Run;
    let (run, other) = std::thread::scope(|scope| {
        let other = scope.spawn(|| {
            let hidden = |label: &str, total| Progress::new(label, total, true);
            let mut ignore = |_: &StepRecord, _: &ThreshingWorld| Ok(());
            let kept = |name: &str| kept(&format!("other-{name}"));
            run_threshing(scene, &second, hidden, &mut ignore, &kept)
        });
        let run = run_threshing(scene, setup, progress, observe, kept);
        (
            run,
            other.join().unwrap_or_else(|panic| resume_unwind(panic)),
        )
    });
    Ok(Lives {
        held,
        run: run?,
        other: other?,
    })
}

impl Lives {
    /// Each outcome with what it holds, that of the scene first.
    fn both(&self) -> [(Hold, &ThreshingOutcome); 2] {
        [(self.held, &self.run), (self.held.other(), &self.other)]
    }

    /// Totals of the scene's run, with what no solve of either run certified.
    pub fn totals(&self) -> Totals {
        let (mut all, other) = (self.run.totals, &self.other.totals);
        all.unsolved_islands += other.unsolved_islands;
        all.unsolved_steps += other.unsolved_steps;
        all.failed_islands += other.failed_islands;
        all.residual = all.residual.max(other.residual);
        all.residual_velocity = all.residual_velocity.max(other.residual_velocity);
        all
    }

    /// Results for `summary.json`: those of the scene's run, and the lives under both protocols.
    pub fn json(&self, p: &Thresher) -> Value {
        let mut found = self.run.json(p);
        for (hold, outcome) in self.both() {
            let (least, most) = outcome.torque_band();
            found["holds"][hold.word()] = json!({
                "torque_least_nm": least,
                "torque_most_nm": most,
                "life": outcome.history.life_json(),
                "calibration": outcome.calibration.map(|c| c.json()),
                "sampling_error": outcome.sampling,
                "life_error": outcome.errors.iter().flat_map(|e| e.rows()).collect::<Vec<_>>(),
            });
        }
        found
    }

    /// Results as text.
    pub fn describe(&self, p: &Thresher, tooth: &Tooth) -> String {
        let [(_, run), (_, other)] = self.both();
        let mut table = Table::new([
            ("life by what is held", Align::Left),
            (self.held.word(), Align::Right),
            (self.held.other().word(), Align::Right),
        ]);
        let band = |outcome: &ThreshingOutcome| {
            let (least, most) = outcome.torque_band();
            format!("{} to {}", number(least, 4), number(most, 4))
        };
        table.push(["torque [N m]".to_owned(), band(run), band(other)]);
        let hours = |limit: &LimitLife| match limit.hours {
            Some(hours) => plus_minus(hours, limit.error_hours.unwrap_or(f64::NAN)),
            None => "not reached".to_owned(),
        };
        for (a, b) in run.history.lives().zip(other.history.lives()) {
            table.push([format!("{} [h]", a.limit), hours(a), hours(b)]);
        }
        let calibrated = self.both().into_iter().find_map(|(_, o)| o.calibration);
        let calibration = calibrated.map_or_else(String::new, |of| {
            format!("with the torque held, {}\n", of.describe())
        });
        let errors = other
            .errors
            .iter()
            .map(|e| e.describe())
            .collect::<String>();
        let of_other = match errors.is_empty() {
            true => errors,
            false => format!("with the {} held, {errors}", self.held.other().word()),
        };
        format!("{table}{calibration}{of_other}\n{}", run.describe(p, tooth))
    }
}
