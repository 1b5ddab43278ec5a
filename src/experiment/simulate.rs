use super::baseline::Baseline;
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

/// Who steps the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Engine {
    Moreau,
    /// rapier's own solver as it comes.
    Rapier,
    /// rapier's own solver with stiff contacts, see [`BaselineSettings::STIFF`].
    RapierStiff,
    /// Box2D v3 as it comes, with the feature `box2d`.
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
    /// A sentence: which feature brings an engine that is not built in, or all names and the
    /// nearest.
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

    /// A peer's name, whatever its preset; ours has none.
    pub fn peer(self) -> Option<&'static str> {
        match self {
            Engine::Moreau => None,
            Engine::Rapier | Engine::RapierStiff => Some("rapier"),
            Engine::Box2d => Some("Box2D"),
        }
    }

    /// A peer's solver settings where a peer steps.
    pub fn baseline(self) -> Option<Baseline> {
        match self {
            Engine::Moreau => None,
            Engine::Rapier => Some(Baseline::Rapier(BaselineSettings::DEFAULT)),
            Engine::RapierStiff => Some(Baseline::Rapier(BaselineSettings::STIFF)),
            Engine::Box2d => Some(Baseline::Box2d(Box2dSettings::DEFAULT)),
        }
    }

    /// Whether it can step the scene at all: a peer only what is built on a rapier world, Box2D
    /// what it can copy of one, for which the scene is built; before a run that builds it anyway
    /// [`Engine::has_model`] and [`Engine::prepare`] tell the same.
    ///
    /// # Errors
    /// [`RunError::Unfit`] with what the peer has not; [`RunError::Step`] if the scene cannot be
    /// built.
    pub fn fits(self, scene: &Scene) -> Result<(), RunError> {
        self.has_model(scene)?;
        match self {
            Engine::Box2d => self.prepare(&mut scene.build()?),
            _ => Ok(()),
        }
    }

    /// Whether it steps what the scene is built on.
    ///
    /// # Errors
    /// [`RunError::Unfit`] with what a peer has not.
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

    /// Takes its settings in a world that has not been stepped.
    ///
    /// # Errors
    /// [`RunError::Unfit`] where the engine does not fit the world, see [`Engine::fits`].
    pub fn prepare(self, built: &mut Built) -> Result<(), RunError> {
        match self.baseline() {
            Some(settings) => self.prepare_with(&settings, built),
            None => Ok(()),
        }
    }

    /// The same with other settings than its own.
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
    /// [`StepError`]; rapier has none of its own, Box2D those of its start and step.
    pub fn step(self, built: &mut Built) -> Result<StepRecord, StepError> {
        match self {
            Engine::Moreau => built.step(),
            Engine::Rapier | Engine::RapierStiff => Ok(built.peer()?.step_with_rapier()),
            Engine::Box2d => built.step_with_box2d(),
        }
    }

    /// One step, and its wall time \[s\]: of a peer without the record that is made of it here.
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

    /// Pose and velocity of body `k` at the precision the engine has.
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

/// What can stop a run.
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
    /// A problem file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Problem { path: PathBuf, source: FileError },
    /// The scene does not hold what the command needs.
    #[error("{0}")]
    Unfit(String),
}

/// Sums and worst values over a run; as JSON under the names of `summary.json`.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Totals {
    /// Whether every step kept account of all that is told here, see [`StepRecord::accounted`].
    #[serde(skip)]
    pub accounted: bool,
    pub steps: usize,
    /// Simulated time \[s\].
    #[serde(rename = "time_s")]
    pub time: f64,
    pub contacts: usize,
    pub most_contacts: usize,
    /// Bodies, summed over steps, whose contacts a peer could not tell.
    #[serde(rename = "bodies_with_unread_contacts")]
    pub unread: usize,
    pub sweeps: usize,
    pub factorisations: usize,
    pub pivots: usize,
    /// Islands that no solve certified, and steps in which there was one.
    pub unsolved_islands: usize,
    pub unsolved_steps: usize,
    /// Steps with loads whose shares are not unique.
    pub redundant_steps: usize,
    #[serde(rename = "capped_islands")]
    pub capped: usize,
    #[serde(rename = "relaxed_islands")]
    pub relaxed: usize,
    #[serde(rename = "joint_capped_islands")]
    pub joints_capped: usize,
    /// Impacts located in time.
    pub events: usize,
    /// Pairs still overlapped from the start, after the last step.
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
    /// Largest `|ΔT − Σ work|` of a step \[J\], and the largest kinetic energy it compares with.
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
    /// What moves of positions alone gave \[J\], see [`crate::dynamics::record::StepEnergy`].
    #[serde(rename = "work_recovery_j")]
    pub work_recovery: f64,
    #[serde(rename = "friction_work_j")]
    pub friction_work: f64,
    /// Wall-clock time of the steps alone \[s\].
    #[serde(skip)]
    pub wall: f64,
}

impl Totals {
    /// Takes in one step.
    pub fn add(&mut self, record: &StepRecord) {
        let energy = &record.energy;
        let total = energy.kinetic_end + energy.potential_end;
        if self.steps == 0 {
            self.energy_start = energy.kinetic_start + energy.potential_start;
            self.accounted = true;
        }
        self.accounted &= record.accounted;
        self.steps += 1;
        self.time = record.time;
        let contacts = record.contacts_at_end();
        self.contacts += contacts;
        self.most_contacts = self.most_contacts.max(contacts);
        self.unread += record.unread;
        self.sweeps += record.sweeps;
        self.factorisations += record.factorisations;
        self.pivots += record.pivots;
        self.unsolved_islands += record.unsolved;
        self.unsolved_steps += usize::from(record.unsolved > 0);
        self.redundant_steps += usize::from(record.redundant > 0);
        self.capped += record.capped;
        self.relaxed += record.relaxed;
        self.joints_capped += record.joints_capped;
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
        self.energy_end = total;
        self.energy_rise = self.energy_rise.max(total - self.energy_start);
        self.work_forces += energy.forces;
        self.work_contact_n += energy.contact_n;
        self.work_contact_t += energy.contact_t;
        self.work_joints += energy.joints;
        self.work_motors += energy.motors;
        self.work_recovery += energy.recovery;
        self.friction_work += record.friction_work();
    }
}

/// The larger of two; what is not known in one step is not known of the run.
fn larger(worst: f64, value: f64) -> f64 {
    if worst.is_nan() || worst > value {
        worst
    } else {
        value
    }
}

/// Prepares `built` for `engine`, steps it `steps` times, and shows every record to `observe`.
///
/// # Errors
/// [`StepError`] of a step, or whatever `observe` returns; the steps before it stand.
pub fn simulate(
    built: &mut Built,
    engine: Engine,
    steps: usize,
    observe: impl FnMut(&StepRecord, &Built) -> Result<(), RunError>,
) -> Result<Totals, RunError> {
    engine.prepare(built)?;
    advance(built, engine, steps, observe)
}

/// As [`simulate`], of a world with its engine's settings already in it.
///
/// # Errors
/// Those of [`simulate`].
pub fn advance(
    built: &mut Built,
    engine: Engine,
    steps: usize,
    mut observe: impl FnMut(&StepRecord, &Built) -> Result<(), RunError>,
) -> Result<Totals, RunError> {
    let mut totals = Totals::default();
    let state = |built: &Built, k: usize| engine.state(built, k);
    // what overlaps before the first step is no fault of a step
    built.penetration(state);
    for _ in 0..steps {
        let (mut record, seconds) = engine.timed_step(built)?;
        totals.wall += seconds;
        if let Some(depth) = built.penetration(state) {
            record.penetration = depth;
        }
        totals.add(&record);
        observe(&record, built)?;
    }
    Ok(totals)
}
