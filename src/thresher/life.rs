//! The thresher's life: simulates revolutions, measures wear, jumps cycles.

use super::bar_load::BarLoad;
use super::blocks::{LifeErrors, Wear};
use super::calibrate::Calibrated;
use super::cycle::{Cycle, Threshing, new_tooth};
use super::life_error::{self, LimitError};
use super::machine::Setup;
use super::operation;
use super::parameters::Thresher;
use super::power::PowerBudget;
use super::wear_history::WearHistory;
use super::world::{Outlines, ThreshingError, ThreshingWorld};
use crate::checkpoint::{CheckpointError, Reader, Writer};
use crate::dynamics::record::StepRecord;
use crate::experiment::{RunError, Totals};
use crate::report::{Checkpoint, Progress};
use crate::scene::Scene;
use crate::wear::{JumpRule, LifePoint, WearState};
use serde::{Deserialize, Serialize};

/// What is known of a machine with new teeth, once it is filled.
#[derive(Serialize, Deserialize)]
struct New {
    cycle: Cycle,
    /// Winkler modulus of the crop \[Pa/m\].
    stiffness: f64,
    picture: Outlines,
}

/// Result of wearing the teeth.
#[derive(Serialize, Deserialize)]
struct Worn {
    /// The cycle of the last profile.
    last: Cycle,
    jumps: usize,
    /// Sum of the squares of [`Cycle::sampling`].
    sampling: f64,
    /// Largest `K k S` of a jump.
    feedback: f64,
}

/// Results of a run of the thresher.
#[derive(Debug, Clone)]
pub struct ThreshingOutcome {
    pub history: WearHistory,
    pub totals: Totals,
    /// Winkler modulus of the crop \[Pa/m\], scaled to the operating torque of a new tooth.
    pub stiffness: f64,
    /// Mean torque of a new tooth and of the last cycle \[N m\], machine totals, and mean speeds.
    pub torque_new: f64,
    pub torque_worn: f64,
    pub speed_new: f64,
    /// Power with a new tooth and with the last profile.
    pub power_new: PowerBudget,
    pub power_worn: PowerBudget,
    /// Simulated revolutions and cycle jumps.
    pub revolutions: f64,
    pub jumps: usize,
    /// How far the concave moved in to follow the teeth \[m\].
    pub concave_moved: f64,
    /// Steel lost by all bars \[kg\], machine total.
    pub steel_lost: f64,
    /// Wear coefficient of the steel [m²/N].
    pub coefficient: f64,
    /// What the run gives at the published point, if it is at that point's torque and speed.
    pub calibration: Option<Calibrated>,
    /// Relative standard error of the most loaded cell's wear in a cycle, root mean square over the
    /// cycles.
    pub sampling: f64,
    /// Largest `K k S` of a jump, measured: see [`crate::wear::Archard::feedback`].
    pub feedback: f64,
    /// Mean over the jumps of the largest depth of a jump \[m\].
    pub mean_jump: f64,
    /// Error of the hours to each limit that was reached, by source.
    pub errors: Vec<LimitError>,
    /// Load on a bar with new and with the last teeth.
    pub bar_load_new: BarLoad,
    pub bar_load_worn: BarLoad,
    /// The machine with new teeth, after its first measured revolution, and with the last teeth.
    pub picture_new: Outlines,
    pub picture_worn: Outlines,
}

/// Called after every step of the first measured revolution, with new teeth at the operating
/// torque.
pub type Observer<'a> = &'a mut dyn FnMut(&StepRecord, &ThreshingWorld) -> Result<(), RunError>;

/// The checkpoint of a life by its name: `life`, or what differs in a life that measures its error. `None`
/// for lives that are not resumed.
pub type Kept<'a> = &'a (dyn Fn(&str) -> Option<Checkpoint> + Sync);

/// Density of steel \[kg/m³\].
const STEEL: f64 = 7850.0;

impl Threshing<'_> {
    /// Wears the teeth jump by jump on from `life`, until the last limit or the longest time, or until
    /// the machine no longer conveys or the base, `base` \[m\] thick, is worn through. Before each
    /// jump it calls `save`.
    fn wear_out(
        &mut self,
        wear: &Wear,
        base: f64,
        life: &mut Living,
        progress: &Progress,
        mut save: impl FnMut(&Self, &Living) -> Result<(), RunError>,
    ) -> Result<(), RunError> {
        let hidden = Progress::new("", 1, true);
        let rule = JumpRule {
            cycles: 1e12,
            depth: wear.jump,
            stability: 1.0,
        };
        let heights = wear.limits.iter().map(|l| l.height);
        let lowest = heights.fold(f64::INFINITY, f64::min);
        let start = life.start;
        loop {
            save(self, life)?;
            let Living {
                state,
                history,
                worn,
                ..
            } = &mut *life;
            let now = state.life().last();
            let share = if lowest.is_finite() {
                (start - now.height) / (start - lowest)
            } else {
                now.hours / wear.max_hours
            };
            progress.set((1000.0 * share) as u64);
            progress.message(format!("{:.0} h, {:.1} mm", now.hours, 1e3 * now.height));
            let conveys = worn.last.operation.conveys;
            if now.height <= lowest || now.hours >= wear.max_hours || !conveys {
                break;
            }
            let load_slip = worn.last.load.sums();
            worn.sampling += worn.last.sampling.powi(2);
            // grains are rigid and meet every place by chance: no depth acts on its own load
            let feedback = match self.parameters.grains {
                Some(_) => 0.0,
                None => state.feedback(worn.last.load.stiffness())?,
            };
            let jump = state.next_jump(&rule, load_slip, feedback)?;
            let left = (wear.max_hours - now.hours) * 3600.0 / self.revolution;
            let cycles = jump.cycles.min(left);
            if !cycles.is_finite() || load_slip.iter().all(|s| *s == 0.0) {
                break;
            }
            state.advance(load_slip, cycles, worn.last.sampling)?;
            worn.feedback = worn.feedback.max(feedback * cycles);
            worn.jumps += 1;
            history.add_profile(1, state);
            if state.profile().nodes().iter().any(|p| p.y <= -base) {
                // no machine has these teeth: the rate at the end of the last jump is unknown
                return Ok(());
            }
            worn.last = self.next_cycle(&worn.last, state.profile(), wear.revolutions, &hidden)?;
            history.operation.push(worn.last.operation.row(state));
        }
        life.state.close(life.worn.last.load.sums())?;
        Ok(())
    }
}

/// A life on its way.
struct Living {
    new: New,
    /// Height of a new tooth \[m\].
    start: f64,
    state: WearState,
    history: WearHistory,
    worn: Worn,
}

impl Living {
    /// Fills the machine and measures it with new teeth.
    fn begin(
        machine: &mut Threshing,
        setup: &Setup<Thresher>,
        state: WearState,
        calibrates: bool,
        progress: &Progress,
        observe: Observer,
    ) -> Result<Living, RunError> {
        let revolutions = setup.wear.revolutions;
        machine.fill(state.profile(), calibrates, progress)?;
        let new = machine.measure(state.profile(), revolutions, progress, observe)?;
        let cycle = match calibrates {
            true => machine.hold_torque(new, state.profile(), revolutions, progress)?,
            false => new,
        };
        let mut history = WearHistory::default();
        history.add_profile(1, &state);
        history.operation.push(cycle.operation.row(&state));
        let worn = Worn {
            last: cycle.clone(),
            jumps: 0,
            sampling: 0.0,
            feedback: 0.0,
        };
        Ok(Living {
            new: New {
                cycle,
                stiffness: machine.world.stiffness(),
                picture: machine.world.outlines()?,
            },
            start: state.profile().height(),
            state,
            history,
            worn,
        })
    }

    fn save(&self, machine: &Threshing) -> Result<Writer, CheckpointError> {
        let mut to = Writer::default();
        to.put(&(&self.new, self.start, &self.state))?;
        to.put(&(&self.history, &self.worn))?;
        machine.save(&mut to)?;
        Ok(to)
    }

    fn load(machine: &mut Threshing, from: &mut Reader) -> Result<Living, CheckpointError> {
        let (new, start, state) = from.take()?;
        let (history, worn) = from.take()?;
        machine.load(from)?;
        Ok(Living {
            new,
            start,
            state,
            history,
            worn,
        })
    }
}

/// Runs the thresher over its life.
///
/// 1. The strip fills the machine. The crop's stiffness is scaled until the mean torque of a new
///    tooth is the operating torque.
/// 2. A few revolutions are simulated. `load_slip` per node, mean over the equal bars, wears the
///    one profile that stands for all bars, over as many cycles as the depth of a jump, the mesh and
///    the elastic penetration of the crop allow.
/// 3. All bars get the worn profile; back to 2, until the last limit or the longest time.
/// 4. If the scene asks for it, three more lives measure the error of the hours: see
///    [`super::LimitError`].
///
/// Each life goes on from its checkpoint, if it has one, and saves one before each jump.
///
/// # Errors
/// [`RunError`].
pub fn run_threshing(
    scene: &Scene,
    setup: &Setup<Thresher>,
    progress: impl Fn(&str, u64) -> Progress,
    observe: Observer,
    kept: Kept,
) -> Result<ThreshingOutcome, RunError> {
    let mut outcome = live(scene, setup, true, &progress, observe, kept("life"))?;
    if setup.wear.error == LifeErrors::Measured && !outcome.errors.is_empty() {
        let bar = progress("measuring the error of the life", 1);
        life_error::measure(scene, setup, &mut outcome, |scene, setup, name| {
            let hidden = |_: &str, _: u64| Progress::new("", 1, true);
            let mut ignore = |_: &StepRecord, _: &ThreshingWorld| Ok(());
            live(scene, setup, false, &hidden, &mut ignore, kept(name))
        })?;
        bar.advance();
    }
    outcome.history.set_errors(&outcome.errors);
    Ok(outcome)
}

/// One life, [`run_threshing`] without the lives that measure its error.
fn live(
    scene: &Scene,
    setup: &Setup<Thresher>,
    calibrates: bool,
    progress: &impl Fn(&str, u64) -> Progress,
    observe: Observer,
    mut checkpoint: Option<Checkpoint>,
) -> Result<ThreshingOutcome, RunError> {
    let (parameters, tooth, wear) = (&setup.parameters, &setup.tooth, &setup.wear);
    let state = new_tooth(tooth, wear, parameters)?;
    let area_new = state.profile().area_above(-tooth.base);
    let mut machine = Threshing::new(scene, parameters, tooth, state.profile())?;
    let saved = checkpoint.as_ref().map(Checkpoint::load).transpose()?;
    let mut life = match saved.flatten() {
        Some(mut saved) => Living::load(&mut machine, &mut saved)?,
        None => {
            let bar = progress("filling the machine", 4 * machine.steps(1.0) as u64);
            Living::begin(&mut machine, setup, state, calibrates, &bar, observe)?
        }
    };
    let bar = progress("wearing the teeth", 1000);
    machine.wear_out(wear, tooth.base, &mut life, &bar, |machine, life| {
        if let Some(checkpoint) = &mut checkpoint {
            checkpoint.save(&life.save(machine)?)?;
        }
        Ok(())
    })?;
    drop(bar);
    let Living {
        new,
        state,
        mut history,
        worn,
        ..
    } = life;
    history.close(1, &state, &wear.limits)?;
    let (limits, fit) = operation::limits(&history, &state, parameters, tooth.base)?;
    let errors = life_error::of_run(state.life(), &history.crossings, (&limits[0], fit));
    history.add_limits(1, limits);
    let lost = area_new - state.profile().area_above(-tooth.base);
    Ok(ThreshingOutcome {
        coefficient: wear.coefficient,
        calibration: Calibrated::of(parameters, &state),
        errors,
        mean_jump: mean_jump(&state),
        history,
        stiffness: new.stiffness,
        torque_new: new.cycle.operation.torque,
        torque_worn: worn.last.operation.torque,
        bar_load_new: new.cycle.bar_load,
        bar_load_worn: worn.last.bar_load,
        speed_new: new.cycle.operation.speed,
        power_new: new.cycle.power,
        power_worn: worn.last.power,
        revolutions: machine.totals.time / machine.revolution,
        jumps: worn.jumps,
        steel_lost: lost * STEEL * parameters.machine_width * f64::from(parameters.bars),
        sampling: (worn.sampling / worn.jumps.max(1) as f64).sqrt(),
        feedback: worn.feedback,
        concave_moved: machine.world.concave_moved(),
        picture_new: new.picture,
        picture_worn: machine.world.outlines()?,
        totals: machine.totals,
    })
}

/// Mean over the jumps of the largest depth of a jump \[m\]; 0 without jumps.
fn mean_jump(state: &WearState) -> f64 {
    let points = state.life().points();
    let deepest = |pair: &[LifePoint]| {
        let depths = pair[1].depth.iter().zip(&pair[0].depth);
        depths.map(|(b, a)| b - a).fold(0.0, f64::max)
    };
    let sum: f64 = points.windows(2).map(deepest).sum();
    sum / (points.len() - 1).max(1) as f64
}

impl From<ThreshingError> for RunError {
    fn from(error: ThreshingError) -> Self {
        match error {
            ThreshingError::Step(error) => error.into(),
            ThreshingError::Wear(error) => error.into(),
        }
    }
}
