//! Revolutions of the machine with a crop of grains, beside the same with the strip.

use super::bar_load::BarLoad;
use super::cycle::{Cycle, Threshing, grains_fill, new_tooth};
use super::flow::Flow;
use super::life::{Kept, Observer, ThreshingOutcome, run_threshing};
use super::machine::Setup;
use super::parameters::Thresher;
use super::part_wear::{BarWear, ConcaveWear, PartLoads};
use super::power::PowerBudget;
use super::spin::SpinBudget;
use super::world::{Outlines, ThreshingWorld};
use crate::dynamics::record::StepRecord;
use crate::experiment::{RunError, Totals};
use crate::report::Progress;
use crate::scene::Scene;
use std::f64::consts::TAU;
use std::panic::resume_unwind;

/// A crop in the machine with new teeth, once it is filled: means over the measured revolutions.
#[derive(Debug, Clone)]
pub struct CropRun {
    /// Torque of the drive \[N m\], and speed of the cylinder [rad/s].
    pub torque: f64,
    pub speed: f64,
    pub power: PowerBudget,
    pub spin: SpinBudget,
    pub flow: Flow,
    pub bar_load: BarLoad,
    /// Place of every cell along the tooth \[m\], and its depth of a revolution \[m\], mean over the bars.
    pub places: Vec<f64>,
    pub depths: Vec<f64>,
    /// Worn volume of a bar in a revolution \[m³\] per metre of width.
    pub worn: f64,
    /// The same of each bar, and of the concave from the table to the outlet.
    pub bars: Vec<BarWear>,
    pub concave: Vec<ConcaveWear>,
    /// Relative standard error of the depth of the deepest cell, from the halves of the revolutions.
    pub sampling: f64,
    /// Of the measured revolutions alone.
    pub totals: Totals,
    pub picture: Outlines,
}

/// Both crops in one machine.
#[derive(Debug, Clone)]
pub struct CropComparison {
    pub grains: CropRun,
    pub strip: CropRun,
    /// Of the teeth with grains, if the scene has limits of wear.
    pub life: Option<ThreshingOutcome>,
}

/// Fills the machine of a scene with grains and measures its revolutions, and on a second thread the
/// same machine with the strip, whose stiffness is scaled to the operating torque. Nothing of the grains
/// is calibrated. With limits of wear in the scene it then computes the life of the teeth with grains.
///
/// # Arguments
/// - `observe`: called after every step of the first measured revolution with grains.
/// - `kept`: the checkpoint of the life by its name.
///
/// # Errors
/// [`RunError`]; [`RunError::Unfit`] for a machine without grains.
pub fn run_crops(
    scene: &Scene,
    setup: &Setup<Thresher>,
    progress: impl Fn(&str, u64) -> Progress,
    observe: Observer,
    kept: Kept,
) -> Result<CropComparison, RunError> {
    if setup.parameters.grains.is_none() {
        let why = format!("scene {}: its crop is a strip", scene.name);
        return Err(RunError::Unfit(why));
    }
    let mut second = setup.clone();
    second.parameters.grains = None;
    let (grains, strip) = std::thread::scope(|scope| {
        let strip = scope.spawn(|| {
            let hidden = Progress::new("", 1, true);
            measured(
                scene,
                &second,
                &hidden,
                &mut |_: &StepRecord, _: &ThreshingWorld| Ok(()),
            )
        });
        let revolutions = grains_fill(&setup.parameters) + f64::from(setup.wear.revolutions);
        let total = revolutions * TAU / setup.parameters.speed / scene.step.dt;
        let bar = progress("grains through the machine", total as u64);
        let grains = measured(scene, setup, &bar, observe);
        (
            grains,
            strip.join().unwrap_or_else(|panic| resume_unwind(panic)),
        )
    });
    let (grains, strip) = (grains?, strip?);
    let life = match setup.wear.limits.is_empty() {
        true => None,
        false => {
            let mut ignore = |_: &StepRecord, _: &ThreshingWorld| Ok(());
            Some(run_threshing(scene, setup, progress, &mut ignore, kept)?)
        }
    };
    Ok(CropComparison {
        grains,
        strip,
        life,
    })
}

fn measured(
    scene: &Scene,
    setup: &Setup<Thresher>,
    progress: &Progress,
    observe: Observer,
) -> Result<CropRun, RunError> {
    let (p, revolutions) = (&setup.parameters, setup.wear.revolutions);
    let mut state = new_tooth(&setup.tooth, &setup.wear, p)?;
    let profile = state.profile().clone();
    let mut machine = Threshing::new(scene, p, &setup.tooth, &profile)?;
    machine.fill(&profile, true, progress)?;
    machine.totals = Totals::default();
    let first = machine.steps(1.0);
    let mut loads = PartLoads::new(p, &profile, &machine.world);
    let mut steps = 0;
    let mut each = |record: &StepRecord, world: &ThreshingWorld| {
        loads.add(record, world, &profile)?;
        steps += 1;
        match steps <= first {
            true => observe(record, world),
            false => Ok(()),
        }
    };
    let cycle = machine.measure(&profile, revolutions, progress, &mut each)?;
    let Cycle {
        load,
        sampling,
        operation,
        power,
        spin,
        flow,
        bar_load,
    } = cycle;
    state.advance(load.sums(), 1.0, sampling)?;
    let law = state.law().coefficient;
    Ok(CropRun {
        torque: operation.torque,
        speed: operation.speed,
        power,
        spin,
        flow,
        bar_load,
        places: profile.nodes().iter().map(|node| node.x).collect(),
        depths: state.depth().to_vec(),
        worn: law * load.sums().iter().sum::<f64>(),
        bars: loads.bars(p, &setup.wear, &profile, f64::from(revolutions))?,
        concave: loads.concave(&setup.wear, &machine.world, f64::from(revolutions))?,
        sampling,
        totals: machine.totals,
        picture: machine.world.outlines()?,
    })
}
