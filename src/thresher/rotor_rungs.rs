//! The study's rotor on the failure atlas.

use super::check::check;
use super::machine::{Blocks, Machine};
use super::study::run_study;
use crate::experiment::{MachineFigures, MachineRun};
use crate::report::Progress;
use crate::scene::atlas::AtlasRung;
use crate::scene::{AtlasEntry, Scene, SceneError};

/// Reads the scene of a rung of the atlas; for one with a `[study]`, also how to run its rotor and
/// what to measure. A rung with a `[thresher]` measures nothing.
///
/// # Errors
/// Those of [`AtlasEntry::scene`].
pub fn read_rung(
    entry: &AtlasEntry,
    rung: &AtlasRung,
) -> Result<(Scene, Option<MachineRun>), SceneError> {
    let (scene, blocks): (Scene, Blocks) = entry.scene(rung, &[], check)?;
    let own = scene.clone();
    let run: Option<MachineRun> = match blocks.machine() {
        Some(Machine::Study(setup)) => Some(Box::new(move || {
            let outcome = run_study(&own, &setup, &Progress::new("", 1, true))?;
            let silent = f64::from(u8::from(outcome.totals.redundant_steps == 0));
            let stall = |of: fn(&super::Stall) -> f64| outcome.stall.as_ref().map_or(f64::NAN, of);
            let refused = stall(|s| (s.single_cell.1 - s.single_cell.0) as f64);
            Ok(MachineFigures {
                values: vec![
                    ("speed-left", stall(|s| s.speed_after.abs())),
                    ("single-cells-refused", refused),
                    ("stall-not-flagged", silent),
                    ("shares", outcome.oracle_difference.unwrap_or(f64::NAN)),
                ],
                unsolved: outcome.totals.unsolved_islands,
            })
        })),
        Some(Machine::Thresher(_)) => Some(Box::new(|| {
            Ok(MachineFigures {
                values: Vec::new(),
                unsolved: 0,
            })
        })),
        None => None,
    };
    Ok((scene, run))
}
