use super::reference::{Samples, measures};
use super::simulate::{Engine, RunError, Totals, simulate};
use crate::report::{Progress, ResultRow};
use crate::scene::{Scene, Scheme};

/// Engines side by side on one scene.
#[derive(Debug, Clone)]
pub struct Comparison {
    pub rows: Vec<ResultRow>,
    /// Per engine: its name, totals of the last repeat, and wall time per simulated second.
    pub engines: Vec<(&'static str, Totals, f64, f64)>,
}

/// Runs every engine on `scene`, interleaved, `repeats` times, and measures.
///
/// Errors against the scene's closed form, worst penetration, rise of energy and, for ours, the
/// residual; wall time is the median of the repeats, spread half of their range over it.
///
/// # Errors
/// [`RunError`]; an engine that fails in a step is a row with NaN, not an error.
pub fn compare(
    scene: &Scene,
    engines: &[Engine],
    steps: usize,
    repeats: usize,
    progress: &Progress,
) -> Result<Comparison, RunError> {
    let mut times: Vec<Vec<f64>> = vec![Vec::new(); engines.len()];
    let mut results = vec![None; engines.len()];
    for _ in 0..repeats.max(1) {
        for (k, &engine) in engines.iter().enumerate() {
            let mut built = scene.build()?;
            let mut samples = Samples::start(&built, engine);
            let outcome = simulate(&mut built, engine, steps, |record, built| {
                if scene.reference.is_some() {
                    samples.add(record, built, engine);
                }
                progress.advance();
                Ok(())
            });
            match outcome {
                Ok(totals) => {
                    times[k].push(totals.wall / totals.time);
                    results[k] = Some((totals, measures(scene, &samples)));
                }
                Err(RunError::Step(error)) => {
                    progress.message(format!("{}: {error}", engine.name()));
                }
                Err(error) => return Err(error),
            }
        }
    }
    let mut comparison = Comparison {
        rows: Vec::new(),
        engines: Vec::new(),
    };
    for (k, &engine) in engines.iter().enumerate() {
        let (time, spread) = median_and_spread(&mut times[k]);
        let mut row = |measure: &str, value: f64, unit: &str, reference: &str| {
            comparison.rows.push(ResultRow {
                scene: scene.name.clone(),
                rung: String::new(),
                engine: engine.name().to_owned(),
                scheme: match (engine, scene.step.scheme) {
                    (Engine::Moreau, Scheme::Staggered) => "staggered",
                    (Engine::Moreau, Scheme::Moreau) => "moreau",
                    _ => "",
                }
                .to_owned(),
                solver: match engine {
                    Engine::Moreau => scene.step.solver.clone(),
                    _ => "soft".to_owned(),
                },
                setting: setting(engine, scene),
                dt_s: scene.step.dt,
                threads: 1,
                precision: match engine {
                    Engine::Moreau => "f64",
                    _ => "f32",
                }
                .to_owned(),
                measure: measure.to_owned(),
                value,
                unit: unit.to_owned(),
                reference: reference.to_owned(),
                seconds_per_simulated_second: Some(time),
                spread: Some(spread),
                verdict: String::new(),
                mode: String::new(),
            });
        };
        match &results[k] {
            None => row("failed", f64::NAN, "", ""),
            Some((totals, found)) => {
                for m in found {
                    row(m.name, m.error, m.unit, "closed form");
                }
                row("penetration", totals.penetration, "m", "0");
                row("energy-rise", totals.energy_rise.max(0.0), "J", "0");
                if engine == Engine::Moreau {
                    row("residual", totals.residual, "1", "0");
                    row("unsolved-islands", totals.unsolved_islands as f64, "1", "0");
                }
                comparison
                    .engines
                    .push((engine.name(), *totals, time, spread));
            }
        }
    }
    Ok(comparison)
}

fn setting(engine: Engine, scene: &Scene) -> String {
    match engine {
        Engine::Moreau => format!("tolerance {:e}", scene.step.tolerance),
        Engine::Rapier => "default, recycling off".to_owned(),
        Engine::RapierStiff => "500 Hz, 40 iterations, recycling off".to_owned(),
    }
}

fn median_and_spread(times: &mut [f64]) -> (f64, f64) {
    if times.is_empty() {
        return (f64::NAN, f64::NAN);
    }
    times.sort_by(f64::total_cmp);
    let median = times[times.len() / 2];
    let range = times[times.len() - 1] - times[0];
    (median, 0.5 * range / median)
}
