//! Revolutions of the machine with a crop of grains, beside the same with the strip.

use super::bar_load::BarLoad;
use super::cycle::{Measure, PARTS, Threshing, grains_fill, new_tooth};
use super::flow::Flow;
use super::life::{Kept, ThreshingOutcome, run_threshing};
use super::machine::Setup;
use super::parameters::Thresher;
use super::part_wear::{BarWear, ConcaveWear, PartLoads};
use super::power::PowerBudget;
use super::spin::SpinBudget;
use super::world::{Outlines, ThreshingWorld};
use crate::checkpoint::{Reader, Writer};
use crate::dynamics::record::StepRecord;
use crate::experiment::{RunError, Totals, student_quantile};
use crate::report::{Checkpoint, Progress};
use crate::scene::Scene;
use std::f64::consts::TAU;
use std::panic::resume_unwind;

/// Of the interval of the wear.
const LEVEL: f64 = 0.95;

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
    /// Half of the 95 % interval of the depth of the deepest cell, over the depth: Student's, from the means
    /// of half revolutions as of independent ones. What the seed moves is in it as far as the flow forgets
    /// it within half a revolution; the length of the step and all inputs are not.
    pub interval: f64,
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

/// Watches the first measured revolution with grains.
pub trait CropWatch {
    /// Before the first step, or to go on from what [`CropWatch::save`] saved.
    ///
    /// # Errors
    /// [`RunError`].
    fn begin(&mut self, saved: Option<&mut Reader>) -> Result<(), RunError>;

    /// After every step.
    ///
    /// # Errors
    /// [`RunError`].
    fn step(&mut self, record: &StepRecord, world: &ThreshingWorld) -> Result<(), RunError>;

    /// Saves all that it needs to go on.
    ///
    /// # Errors
    /// [`RunError`].
    fn save(&mut self, to: &mut Writer) -> Result<(), RunError>;
}

/// Sees nothing.
struct Blind;

impl CropWatch for Blind {
    fn begin(&mut self, _: Option<&mut Reader>) -> Result<(), RunError> {
        Ok(())
    }

    fn step(&mut self, _: &StepRecord, _: &ThreshingWorld) -> Result<(), RunError> {
        Ok(())
    }

    fn save(&mut self, _: &mut Writer) -> Result<(), RunError> {
        Ok(())
    }
}

/// Fills the machine of a scene with grains and measures its revolutions, and on a second thread the
/// same machine with the strip, whose stiffness is scaled to the operating torque. Nothing of the grains
/// is calibrated. With limits of wear in the scene it then computes the life of the teeth with grains.
///
/// # Arguments
/// - `watch`: sees every step of the first measured revolution with grains.
/// - `kept`: the checkpoints by their names, `grains` and that of the life. The strip begins anew.
///
/// # Errors
/// [`RunError`]; [`RunError::Unfit`] for a machine without grains.
pub fn run_crops(
    scene: &Scene,
    setup: &Setup<Thresher>,
    progress: impl Fn(&str, u64) -> Progress,
    watch: &mut dyn CropWatch,
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
            measured(scene, &second, &hidden, &mut Blind, None)
        });
        let revolutions = grains_fill(&setup.parameters) + f64::from(setup.wear.revolutions);
        let total = revolutions * TAU / setup.parameters.speed / scene.step.dt;
        let bar = progress("grains through the machine", total as u64);
        let grains = measured(scene, setup, &bar, watch, kept("grains"));
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

/// A machine with grains on its way through a run.
struct OnTheWay {
    /// Steps that filled it.
    filled: usize,
    /// Once it is filled.
    measure: Option<Measure>,
    loads: PartLoads,
}

impl OnTheWay {
    fn save(&self, machine: &Threshing, watch: &mut dyn CropWatch) -> Result<Writer, RunError> {
        let mut to = Writer::default();
        to.put(&(self.filled, &self.measure, &self.loads))?;
        machine.save(&mut to)?;
        watch.save(&mut to)?;
        Ok(to)
    }

    fn load(machine: &mut Threshing, from: &mut Reader) -> Result<OnTheWay, RunError> {
        let (filled, measure, loads) = from.take()?;
        machine.load(from)?;
        Ok(OnTheWay {
            filled,
            measure,
            loads,
        })
    }
}

/// Fills and measures one machine. With grains it goes on from its checkpoint, if it has one.
fn measured(
    scene: &Scene,
    setup: &Setup<Thresher>,
    progress: &Progress,
    watch: &mut dyn CropWatch,
    mut checkpoint: Option<Checkpoint>,
) -> Result<CropRun, RunError> {
    let (p, revolutions) = (&setup.parameters, setup.wear.revolutions);
    let mut state = new_tooth(&setup.tooth, &setup.wear, p)?;
    let profile = state.profile().clone();
    let mut machine = Threshing::new(scene, p, &setup.tooth, &profile)?;
    let saved = checkpoint.as_ref().map(Checkpoint::load).transpose()?;
    let mut way = match saved.flatten() {
        Some(mut saved) => {
            let way = OnTheWay::load(&mut machine, &mut saved)?;
            watch.begin(Some(&mut saved))?;
            way
        }
        None => {
            watch.begin(None)?;
            OnTheWay {
                filled: 0,
                measure: None,
                loads: PartLoads::new(p, &profile, &machine.world),
            }
        }
    };
    let fill = match p.grains {
        Some(_) => machine.steps(grains_fill(p)),
        None => 0,
    };
    let first = machine.steps(1.0);
    loop {
        let steps = way.filled + way.measure.as_ref().map_or(0, Measure::steps_taken);
        if let Some(checkpoint) = checkpoint.as_mut().filter(|_| steps > 0)
            && checkpoint.is_due(steps)
        {
            progress.set(steps as u64);
            checkpoint.save(&way.save(&machine, watch)?)?;
        }
        if way.filled < fill {
            machine.step()?;
            progress.advance();
            way.filled += 1;
            continue;
        }
        let Some(measure) = &mut way.measure else {
            if p.grains.is_none() {
                machine.fill(&profile, true, progress)?;
            }
            machine.totals = Totals::default();
            way.measure = Some(Measure::start(&mut machine, &profile, revolutions));
            continue;
        };
        let seen = measure.steps_taken() < first;
        let loads = &mut way.loads;
        let mut each = |record: &StepRecord, world: &ThreshingWorld| {
            loads.add(record, world, &profile)?;
            match seen {
                true => watch.step(record, world),
                false => Ok(()),
            }
        };
        if !measure.step(&mut machine, &profile, progress, &mut each)? {
            break;
        }
    }
    let loads = way.loads;
    let Some(measure) = way.measure else {
        // the loop ends with a measurement alone
        return Err(RunError::Unfit(format!(
            "scene {}: no revolution",
            scene.name
        )));
    };
    let cycle = measure.close(&mut machine)?;
    let sums = cycle.load.sums();
    state.advance(sums, 1.0, cycle.sampling)?;
    let law = state.law().coefficient;
    Ok(CropRun {
        torque: cycle.operation.torque,
        speed: cycle.operation.speed,
        power: cycle.power,
        spin: cycle.spin,
        flow: cycle.flow,
        places: profile.nodes().iter().map(|node| node.x).collect(),
        depths: state.depth().to_vec(),
        worn: law * sums.iter().sum::<f64>(),
        bar_load: cycle.bar_load,
        bars: loads.bars(p, &setup.wear, &profile, f64::from(revolutions))?,
        concave: loads.concave(&setup.wear, &machine.world, f64::from(revolutions))?,
        interval: cycle.sampling * student_quantile(LEVEL, PARTS * revolutions as usize - 1),
        totals: machine.totals,
        picture: machine.world.outlines()?,
    })
}
