//! Statistics of converged runs: three levels of the step, ours and rapier's stiff preset.

use super::*;
use crate::experiment::Engine;

/// The statistic over step lengths and engines; prints them.
fn levels(
    what: &str,
    dts: &[f64],
    of: impl Fn(f64) -> Scene,
    value: impl Fn(&Trace) -> f64,
) -> Vec<f64> {
    let mut found = Vec::new();
    for engine in [Engine::Moreau, Engine::RapierStiff] {
        for &dt in dts {
            let trace = Trace::of(&of(dt), engine).unwrap();
            let v = value(&trace);
            let unsolved = trace.totals.unsolved_islands;
            println!(
                "{what}, {}, dt {dt}: {v}, {unsolved} unsolved",
                engine.name()
            );
            found.push(v);
        }
    }
    found
}

#[test]
#[ignore = "minutes"]
fn converged_dominoes() {
    for (apart, exact) in WAVES {
        let dts = [1.0 / 240.0, 1.0 / 480.0, 1.0 / 960.0];
        let found = levels(
            &format!("{apart} m"),
            &dts,
            |dt| domino_row(apart, dt).unwrap(),
            wave,
        );
        assert!((found[2] / exact - 1.0).abs() < 0.02, "{found:?}");
    }
}

#[test]
#[ignore = "minutes"]
fn converged_drum() {
    let dts = [2e-3, 1e-3, 5e-4];
    let found = levels("drum", &dts, |dt| drum(dt).unwrap(), heap_angle);
    assert!((found[2] - HEAP_ANGLE).abs() < 0.05, "{found:?}");
}

#[test]
#[ignore = "minutes"]
fn converged_hopper() {
    for (wide, exact) in RATES {
        let dts = [1.0 / 240.0, 1.0 / 480.0, 1.0 / 960.0];
        let found = levels(
            &format!("{wide} m"),
            &dts,
            |dt| funnel(wide, dt).unwrap(),
            discharge,
        );
        assert!((found[2] / exact - 1.0).abs() < 0.1, "{found:?}");
    }
}
