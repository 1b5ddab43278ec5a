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
            let trace = Trace::of(&of(dt), engine, |_| {}).unwrap();
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

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
#[ignore = "minutes"]
fn converged_dominoes() {
    let mut off = Vec::new();
    for (apart, exact) in WAVES {
        let dts = [1.0 / 240.0, 1.0 / 480.0, 1.0 / 960.0];
        let found = levels(
            &format!("{apart} m"),
            &dts,
            |dt| domino_row(apart, dt).unwrap(),
            wave,
        );
        off.push((0.5 * (found[2] + found[5]) / exact - 1.0).abs());
    }
    assert!(off.iter().all(|off| *off < 1e-3), "{off:?}");
}

#[test]
#[ignore = "minutes"]
fn converged_drum() {
    let dts = [2e-3, 1e-3, 5e-4];
    let found = levels("drum", &dts, |dt| drum(dt).unwrap(), heap_angle);
    for finest in [found[2], found[5]] {
        assert!((finest - HEAP_ANGLE).abs() < 1e-3, "{found:?}");
    }
}

#[test]
#[ignore = "minutes"]
fn converged_hopper() {
    let mut off = Vec::new();
    for (wide, exact) in RATES {
        let dts = [1.0 / 240.0, 1.0 / 480.0, 1.0 / 960.0];
        let found = levels(
            &format!("{wide} m"),
            &dts,
            |dt| funnel(wide, dt).unwrap(),
            discharge,
        );
        off.push((mean(&found) / exact - 1.0).abs());
    }
    assert!(off.iter().all(|off| *off < 0.01), "{off:?}");
}

#[test]
#[ignore = "minutes"]
fn converged_spinner() {
    let mut off = Vec::new();
    for (spin, exact) in AGITATIONS {
        let Some(exact) = exact else { continue };
        let dts = [1.0 / 120.0, 1.0 / 240.0, 1.0 / 480.0];
        let found = levels(
            &format!("{spin} rad/s"),
            &dts,
            |dt| ring(spin, dt).unwrap(),
            agitation,
        );
        off.push((mean(&found) / exact - 1.0).abs());
    }
    assert!(off.iter().all(|off| *off < 0.03), "{off:?}");
}
