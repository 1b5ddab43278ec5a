//! Gates with event location.

use super::pivots::{ladder, tilted};
use crate::common::{load, run};

/// Twelve tilts from 0.08 to 0.113 rad, as the landing falls anywhere in its step.
#[test]
fn a_rocking_block_lands_and_rises_as_housner_says() {
    let events = |k: usize| {
        let mut flags = tilted(0.08 + 0.003 * k as f64);
        flags.push("step.events=true".to_owned());
        flags
    };
    for measure in ["landing-time", "rate-kept", "first-peak"] {
        let errors = ladder("rocking-block", measure, events);
        // 1/60 s is the second of the ladder
        assert!(errors[1] <= 2e-3, "{measure}: {errors:?}");
        // two parts of opposite sign cancel at coarse steps: the order from 1/250 to 1/1000 s
        let p = (errors[3] / errors[5]).ln() / 4f64.ln();
        assert!(p > 0.8, "{measure}, order {p}: {errors:?}");
    }
}

/// What stands without events stands with them, to the same gates.
#[test]
fn events_leave_what_holds_alone() {
    for (scene, gate) in [
        ("three-discs", 1e-9),
        ("ladder", 1.2e-6),
        ("wedge", 3e-7),
        ("arch", 3e-7),
    ] {
        let run = run(&load(scene, &["step.events=true"]));
        let creep = run.error("creep");
        assert!(creep <= gate, "{scene}: {creep} m");
    }
}
