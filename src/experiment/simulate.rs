use super::baseline::Baseline;
use crate::checkpoint::{CheckpointError, Reader, Writer};
use crate::contact::Vec3;
use crate::dynamics::record::StepRecord;
use crate::dynamics::{Pose64, StepError};
use crate::peers::{BOX2D_MISSING, BaselineSettings, Box2dSettings};
use crate::problems::FileError;
use crate::report::ReportError;
use crate::scene::{Built, Model, Scene, SceneError};
use crate::wear::WearError;
use std::path::PathBuf;
use std::time::Instant;
use thiserror::Error;

/// The engine that steps the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Engine {
    Moreau,
    /// rapier's own solver with its default settings.
    Rapier,
    /// rapier's own solver with stiff contacts, see [`BaselineSettings::STIFF`].
    RapierStiff,
    /// Box2D v3 with its default settings; needs the feature `box2d`.
    Box2d,
}

impl Engine {
    /// All engines of this build by the name a user types.
    pub const ALL: [(&'static str, Engine); 3 + cfg!(feature = "box2d") as usize] = [
        ("moreau", Engine::Moreau),
        ("rapier", Engine::Rapier),
        ("rapier-stiff", Engine::RapierStiff),
        #[cfg(feature = "box2d")]
        ("box2d", Engine::Box2d),
    ];

    /// The engine called `name`.
    ///
    /// # Errors
    /// A sentence that names the feature of an engine that is not built in, or all known names with
    /// the nearest.
    pub fn named(name: &str) -> Result<Engine, String> {
        if let Some((_, engine)) = Engine::ALL.iter().find(|(known, _)| *known == name) {
            return Ok(*engine);
        }
        if name == Engine::Box2d.name() {
            return Err(BOX2D_MISSING.to_owned());
        }
        let known = Engine::ALL.map(|(name, _)| name);
        let nearest = known
            .iter()
            .max_by(|a, b| strsim::jaro(a, name).total_cmp(&strsim::jaro(b, name)));
        Err(format!(
            "known: {}; did you mean {}?",
            known.join(", "),
            nearest.unwrap_or(&"moreau")
        ))
    }

    /// The name a user types.
    pub fn name(self) -> &'static str {
        match self {
            Engine::Moreau => "moreau",
            Engine::Rapier => "rapier",
            Engine::RapierStiff => "rapier-stiff",
            Engine::Box2d => "box2d",
        }
    }

    /// The peer's name without its preset; `None` for our engine.
    pub fn peer(self) -> Option<&'static str> {
        match self {
            Engine::Moreau => None,
            Engine::Rapier | Engine::RapierStiff => Some("rapier"),
            Engine::Box2d => Some("Box2D"),
        }
    }

    /// The solver settings of a peer; `None` for our engine.
    pub fn baseline(self) -> Option<Baseline> {
        match self {
            Engine::Moreau => None,
            Engine::Rapier => Some(Baseline::Rapier(BaselineSettings::DEFAULT)),
            Engine::RapierStiff => Some(Baseline::Rapier(BaselineSettings::STIFF)),
            Engine::Box2d => Some(Baseline::Box2d(Box2dSettings::DEFAULT)),
        }
    }

    /// Checks that the engine can step the scene. A peer steps only scenes built on a rapier world,
    /// and Box2D only what it can copy of one: the check builds the scene for Box2D. A run that
    /// builds the scene anyway can call [`Engine::has_model`] and [`Engine::prepare`] instead.
    ///
    /// # Errors
    /// [`RunError::Unfit`] with the feature that the peer lacks; [`RunError::Step`] if the scene
    /// cannot be built.
    pub fn fits(self, scene: &Scene) -> Result<(), RunError> {
        self.has_model(scene)?;
        match self {
            Engine::Box2d => self.prepare(&mut scene.build()?),
            _ => Ok(()),
        }
    }

    /// Checks that the engine can step the model of the scene.
    ///
    /// # Errors
    /// [`RunError::Unfit`] with the feature that the peer lacks.
    pub fn has_model(self, scene: &Scene) -> Result<(), RunError> {
        let Some(peer) = self.peer() else {
            return Ok(());
        };
        let lacks = match scene.model() {
            Model::Rapier => return Ok(()),
            Model::Planar => "rods, lines or bowls in closed form",
            Model::Linear => "a [linear] mechanism",
        };
        Err(RunError::Unfit(format!(
            "--engine {}: scene {} is made of {lacks}, which {peer} has not; only moreau steps it",
            self.name(),
            scene.name
        )))
    }

    /// Applies the engine's preset to a world that has not been stepped.
    ///
    /// # Errors
    /// [`RunError::Unfit`] if the engine cannot step the world, see [`Engine::fits`].
    pub fn prepare(self, built: &mut Built) -> Result<(), RunError> {
        match self.baseline() {
            Some(settings) => self.prepare_with(&settings, built),
            None => Ok(()),
        }
    }

    /// Applies `settings` in place of the engine's preset.
    ///
    /// # Errors
    /// Those of [`Engine::prepare`].
    pub fn prepare_with(self, settings: &Baseline, built: &mut Built) -> Result<(), RunError> {
        let name = self.name();
        let unfit = |why| RunError::Unfit(format!("--engine {name}: {why}"));
        settings.prepare(built).map_err(unfit)
    }

    /// One step.
    ///
    /// # Errors
    /// [`StepError`]; rapier returns none in its own step, Box2D those of its start and step.
    pub fn step(self, built: &mut Built) -> Result<StepRecord, StepError> {
        match self {
            Engine::Moreau => built.step(),
            Engine::Rapier | Engine::RapierStiff => Ok(built.peer()?.step_with_rapier()),
            Engine::Box2d => built.step_with_box2d(),
        }
    }

    /// One step and its wall time \[s\]; for a peer without the time to make the record.
    ///
    /// # Errors
    /// Those of [`Engine::step`].
    pub fn timed_step(self, built: &mut Built) -> Result<(StepRecord, f64), StepError> {
        let start = Instant::now();
        let record = self.step(built)?;
        let seconds = match self {
            Engine::Moreau => start.elapsed().as_secs_f64(),
            _ => built.peer()?.peer_seconds(),
        };
        Ok((record, seconds))
    }

    /// Pose and velocity of body `k` at the engine's precision.
    pub fn state(self, built: &Built, k: usize) -> Option<(Pose64, Vec3)> {
        match self {
            Engine::Moreau => built.state(k),
            _ => {
                let (simulation, bodies) = built.simulation()?;
                let body = *bodies.get(k)?;
                Some((
                    simulation.rapier_pose(body)?,
                    simulation.rapier_velocity(body)?,
                ))
            }
        }
    }
}

/// An error that ends a run.
#[derive(Debug, Error)]
pub enum RunError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Step(#[from] StepError),
    #[error(transparent)]
    Wear(#[from] WearError),
    #[error(transparent)]
    Report(#[from] ReportError),
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A problem file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Problem { path: PathBuf, source: FileError },
    /// A run under [`super::Held`] is not as accurate as asked, after this work.
    #[error("{why}: the accuracy is not held")]
    Strayed { why: String, work: usize },
    /// The scene or the arguments do not fit the command.
    #[error("{0}")]
    Unfit(String),
}

/// Sums and worst values over a run; as JSON under the names of `summary.json`.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Totals {
    /// Whether every step recorded all these figures, see [`StepRecord::accounted`].
    #[serde(skip)]
    pub accounted: bool,
    pub steps: usize,
    /// Simulated time \[s\].
    #[serde(rename = "time_s")]
    pub time: f64,
    pub contacts: usize,
    pub most_contacts: usize,
    /// Bodies, summed over steps, whose contacts could not be read from a peer.
    #[serde(rename = "bodies_with_unread_contacts")]
    pub unread: usize,
    /// Islands at rest that kept their impulses, summed over steps.
    #[serde(rename = "resting_islands")]
    pub resting: usize,
    /// Unknown impulses of all problems that were solved, see [`StepRecord::unknowns`].
    pub unknowns: usize,
    pub sweeps: usize,
    pub factorisations: usize,
    pub pivots: usize,
    /// Islands that no solve certified, and steps in which there was one.
    pub unsolved_islands: usize,
    pub unsolved_steps: usize,
    /// Islands among them that failed, see [`StepRecord::failed`].
    pub failed_islands: usize,
    /// Largest overlap \[m\] that all others may have added in all: the sum of residual velocity times `dt`.
    #[serde(rename = "bounded_way_m")]
    pub bounded_way: f64,
    /// Steps with an impulse distribution that is not unique.
    pub redundant_steps: usize,
    #[serde(rename = "capped_islands")]
    pub capped: usize,
    /// Islands of more than 500 contacts in motion, answered by sweeps.
    #[serde(rename = "crowd_islands")]
    pub crowds: usize,
    #[serde(rename = "relaxed_islands")]
    pub relaxed: usize,
    #[serde(rename = "joint_capped_islands")]
    pub joints_capped: usize,
    /// Islands stepped in parts, summed over steps, see [`StepRecord::cut`].
    #[serde(rename = "cut_islands")]
    pub cut: usize,
    /// Impacts located in time.
    pub events: usize,
    /// Pairs of bodies that overlapped at the start and still do after the last step.
    #[serde(rename = "still_recovering_pairs")]
    pub recovering: usize,
    /// Energy that impacts added \[J\].
    #[serde(rename = "impact_gain_j")]
    pub impact_gain: f64,
    /// Worst of all steps.
    #[serde(rename = "worst_residual")]
    pub residual: f64,
    #[serde(rename = "worst_residual_velocity_m_s")]
    pub residual_velocity: f64,
    #[serde(rename = "worst_penetration_m")]
    pub penetration: f64,
    #[serde(rename = "worst_penetration_impact_m")]
    pub penetration_impact: f64,
    #[serde(rename = "worst_joint_gap_m")]
    pub joint_gap: f64,
    /// Work of rigid contacts and joints so far \[J\], see [`StepRecord::constraint_work`], and its
    /// largest value: energy that they gave.
    #[serde(rename = "constraint_work_j")]
    pub constraint_work: f64,
    #[serde(rename = "constraint_gain_j")]
    pub constraint_gain: f64,
    /// Range of the potential energy \[J\].
    #[serde(skip)]
    pub potential: [f64; 2],
    /// Steps in which a body passed through another.
    #[serde(rename = "steps_with_passages")]
    pub passages: usize,
    /// Largest `|ΔT − Σ work|` of a step \[J\], and the largest kinetic energy for comparison.
    #[serde(rename = "worst_imbalance_j")]
    pub imbalance: f64,
    #[serde(skip)]
    pub kinetic_most: f64,
    /// Largest rise of the total energy above its start \[J\].
    #[serde(rename = "energy_rise_j")]
    pub energy_rise: f64,
    #[serde(rename = "energy_start_j")]
    pub energy_start: f64,
    #[serde(rename = "energy_end_j")]
    pub energy_end: f64,
    /// Work of each kind of impulse \[J\].
    #[serde(rename = "work_forces_j")]
    pub work_forces: f64,
    #[serde(rename = "work_contact_n_j")]
    pub work_contact_n: f64,
    #[serde(rename = "work_contact_t_j")]
    pub work_contact_t: f64,
    #[serde(rename = "work_joints_j")]
    pub work_joints: f64,
    #[serde(rename = "work_motors_j")]
    pub work_motors: f64,
    /// Energy that contacts and joints gave and that was taken back \[J\].
    #[serde(rename = "work_returned_j")]
    pub work_returned: f64,
    /// Energy from position corrections \[J\], see [`crate::dynamics::record::StepEnergy`].
    #[serde(rename = "work_recovery_j")]
    pub work_recovery: f64,
    #[serde(rename = "friction_work_j")]
    pub friction_work: f64,
    /// Wall-clock time of the steps alone \[s\].
    #[serde(skip)]
    pub wall: f64,
}

impl Totals {
    /// Before the first step of a world, whose overlaps are noted: they are no errors of a step.
    pub fn start(built: &mut Built, engine: Engine) -> Totals {
        built.measure(|built, k| engine.state(built, k));
        Totals::default()
    }

    /// Saves all of them, also those that `summary.json` does not have.
    ///
    /// # Errors
    /// [`CheckpointError::Write`].
    pub fn save(&self, to: &mut Writer) -> Result<(), CheckpointError> {
        to.put(self)?;
        let skipped = (self.potential, self.kinetic_most, self.wall);
        to.put(&(self.accounted, skipped))
    }

    /// What [`Totals::save`] saved.
    ///
    /// # Errors
    /// [`CheckpointError::Read`].
    pub fn load(from: &mut Reader) -> Result<Totals, CheckpointError> {
        let mut totals: Totals = from.take()?;
        let skipped;
        (totals.accounted, skipped) = from.take()?;
        (totals.potential, totals.kinetic_most, totals.wall) = skipped;
        Ok(totals)
    }

    /// Adds one step.
    pub fn add(&mut self, record: &StepRecord) {
        let energy = &record.energy;
        let total = energy.kinetic_end + energy.potential_end;
        if self.steps == 0 {
            self.energy_start = energy.kinetic_start + energy.potential_start;
            self.accounted = true;
            self.potential = [energy.potential_start; 2];
            self.kinetic_most = energy.kinetic_start;
        }
        self.accounted &= record.accounted;
        self.steps += 1;
        self.time = record.time;
        let contacts = record.contacts_at_end();
        self.contacts += contacts;
        self.most_contacts = self.most_contacts.max(contacts);
        self.unread += record.unread;
        self.resting += record.resting;
        self.unknowns += record.unknowns;
        self.sweeps += record.sweeps;
        self.factorisations += record.factorisations;
        self.pivots += record.pivots;
        self.unsolved_islands += record.unsolved;
        self.unsolved_steps += usize::from(record.unsolved > 0);
        self.failed_islands += record.failed;
        if record.unsolved > record.failed {
            self.bounded_way += record.residual_velocity * record.dt;
        }
        self.redundant_steps += usize::from(record.redundant > 0);
        self.capped += record.capped;
        self.crowds += record.crowds;
        self.relaxed += record.relaxed;
        self.joints_capped += record.joints_capped;
        self.cut += record.cut;
        self.events += record.events;
        self.recovering = record.recovering;
        self.impact_gain += record.impact_gain;
        self.residual = larger(self.residual, record.residual);
        self.residual_velocity = larger(self.residual_velocity, record.residual_velocity);
        self.penetration = self.penetration.max(record.penetration);
        self.penetration_impact = larger(self.penetration_impact, record.penetration_impact);
        self.joint_gap = larger(self.joint_gap, record.joint_gap);
        self.imbalance = larger(self.imbalance, energy.imbalance().abs());
        self.kinetic_most = self.kinetic_most.max(energy.kinetic_end);
        self.potential[0] = self.potential[0].min(energy.potential_end);
        self.potential[1] = self.potential[1].max(energy.potential_end);
        self.constraint_work += record.constraint_work;
        self.constraint_gain = self.constraint_gain.max(self.constraint_work);
        self.passages += usize::from(!record.passed.is_empty());
        self.energy_end = total;
        self.energy_rise = self.energy_rise.max(total - self.energy_start);
        self.work_forces += energy.forces;
        self.work_contact_n += energy.contact_n;
        self.work_contact_t += energy.contact_t;
        self.work_joints += energy.joints;
        self.work_motors += energy.motors;
        self.work_returned += energy.returned;
        self.work_recovery += energy.recovery;
        self.friction_work += record.friction_work();
    }
}

/// The larger of two; NaN once any value is NaN, because it is then unknown for the run.
pub(super) fn larger(worst: f64, value: f64) -> f64 {
    if worst.is_nan() || worst > value {
        worst
    } else {
        value
    }
}

/// Prepares `built` for `engine`, steps it `steps` times, and passes every record to `observe`.
///
/// # Errors
/// [`StepError`] of a step, or the error of `observe`; `built` keeps the steps before it.
pub fn simulate(
    built: &mut Built,
    engine: Engine,
    steps: usize,
    observe: impl FnMut(&StepRecord, &Built) -> Result<(), RunError>,
) -> Result<Totals, RunError> {
    engine.prepare(built)?;
    advance(built, engine, steps, observe)
}

/// As [`simulate`], for a world that already has its engine's settings.
///
/// # Errors
/// Those of [`simulate`].
pub fn advance(
    built: &mut Built,
    engine: Engine,
    steps: usize,
    mut observe: impl FnMut(&StepRecord, &Built) -> Result<(), RunError>,
) -> Result<Totals, RunError> {
    let start = Totals::start(built, engine);
    go_on(built, engine, start, steps, |record, built, _| {
        observe(record, built)
    })
}

/// Steps a world that has done the steps of `totals` until it has done `steps`, and passes every record
/// to `observe` with the totals so far.
///
/// # Errors
/// Those of [`simulate`].
pub fn go_on(
    built: &mut Built,
    engine: Engine,
    mut totals: Totals,
    steps: usize,
    mut observe: impl FnMut(&StepRecord, &Built, &Totals) -> Result<(), RunError>,
) -> Result<Totals, RunError> {
    let state = |built: &Built, k: usize| engine.state(built, k);
    while totals.steps < steps {
        let (mut record, seconds) = engine.timed_step(built)?;
        totals.wall += seconds;
        built.measure_into(&mut record, state);
        totals.add(&record);
        observe(&record, built, &totals)?;
    }
    Ok(totals)
}
