//! Measures a run that is saved as text after half of its steps and resumed.

use super::trace::{Trace, larger};
use crate::experiment::setting::step_count;
use crate::experiment::simulate::{Engine, RunError};
use crate::rapier::MoreauPipeline;
use crate::scene::Built;

/// Largest difference of the end position \[m\] or end angle \[rad\] of a body from the run without
/// interruption. NaN if the run cannot be saved, resumed or stepped.
pub(super) fn distance(t: &Trace) -> f64 {
    again(t).unwrap_or(f64::NAN)
}

fn again(t: &Trace) -> Result<f64, RunError> {
    let mut built = t.scene.build()?;
    let steps = step_count(&t.scene.step);
    for step in 0..steps {
        if step == steps / 2 && !resume(&mut built) {
            return Ok(f64::NAN);
        }
        Engine::Moreau.step(&mut built)?;
    }
    let ends = (0..built.bodies()).map(|k| {
        let end = built.state(k).map(|(pose, _)| pose);
        let other = t.ends(k)[1];
        end.map_or(f64::NAN, |end| {
            let turn = (end.angle() - other.angle()).abs();
            larger((end.translation - other.translation).norm(), turn)
        })
    });
    Ok(ends.fold(0.0, larger))
}

/// Saves the pipeline as text and replaces it by the one that is read from the text.
fn resume(built: &mut Built) -> bool {
    let Some(simulation) = built.simulation_mut() else {
        return false;
    };
    let saved = serde_json::to_string(&simulation.pipeline.state());
    let state = saved.and_then(|text| serde_json::from_str(&text));
    let world = &mut simulation.world;
    let resumed = state
        .ok()
        .and_then(|s| MoreauPipeline::resume(&s, world).ok());
    let Some(pipeline) = resumed else {
        return false;
    };
    simulation.pipeline = pipeline;
    true
}
