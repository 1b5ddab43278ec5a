//! The study's rotor on the failure atlas.

use super::machine::{Machine, load};
use super::study::run_study;
use crate::experiment::{Check, ENTRIES, Engine, Entry, Finding, RELATIVE, RunError, Rung};
use crate::report::Progress;

/// The rotor's entry of the atlas.
static ROTOR: Entry = Entry {
    name: "rotor",
    shows: "26 contacts on one coordinate",
    passes: "rigid: stalls, and says that shares are not unique; compliant: shares within 1e-6",
    rungs,
    ours: &[],
};

/// Every entry of the atlas, the rotor's beside the other redundant contacts.
pub fn atlas_entries() -> Vec<&'static Entry> {
    let mut all: Vec<&'static Entry> = ENTRIES.iter().collect();
    let place = all.iter().position(|e| e.name == "redundant-contacts");
    all.insert(place.map_or(all.len(), |k| k + 1), &ROTOR);
    all
}

/// The study's rotor, 26 contacts on one coordinate: rigid it stalls in a step under shares that
/// mean nothing, which is said; under a compliant crop they are those of the algebra.
fn rungs() -> Result<Vec<Rung>, RunError> {
    let rung = |name: &str, reading: &str| {
        let flags = [
            format!("reading={reading}"),
            "study.speeds=[70]".to_owned(),
            "study.torques=[146.39]".to_owned(),
            "study.batches=1".to_owned(),
        ];
        let (scene, Some(Machine::Study(setup))) = load("thresher-study", &flags)? else {
            return Err(RunError::Unfit(
                "scene thresher-study: has no study".to_owned(),
            ));
        };
        let own = scene.clone();
        let work = move |_: Engine| {
            let outcome = run_study(&own, &setup, &Progress::new("", 1, true))?;
            let (checks, passes) = match (outcome.stall, outcome.oracle_difference) {
                (Some(stall), _) => {
                    let (certified, cells) = stall.single_cell;
                    let silent = f64::from(u8::from(outcome.totals.redundant_steps == 0));
                    let found = vec![
                        Check::new(
                            "speed-left",
                            stall.speed_after.abs(),
                            "rad/s",
                            1e-9,
                            "turns",
                        ),
                        Check::new(
                            "single-cells-refused",
                            (cells - certified) as f64,
                            "cells",
                            0.0,
                            "unique",
                        ),
                        Check::new("silent", silent, "yes or no", 0.0, "silent"),
                    ];
                    (found, "stalls")
                }
                (None, difference) => {
                    let off = difference.unwrap_or(f64::NAN);
                    (
                        vec![Check::new("shares", off, RELATIVE, 1e-6, "wrong-load")],
                        "shares",
                    )
                }
            };
            let unsolved = Some(outcome.totals.unsolved_islands);
            Ok(Finding::judged(checks, passes, true, unsolved))
        };
        let rung = Rung::own(name, scene, work).quick();
        Ok(rung.ours_alone("it has no body of one coordinate with levers for contacts"))
    };
    [
        rung("rigid", "literal"),
        rung("compliant", "torque-balanced"),
    ]
    .into_iter()
    .collect()
}
