use super::blocks::{Memory, Scratch, free_velocities, island_problem};
use super::cap::{CapBlock, cap, is_rigid};
use super::islands::Islands;
use super::model::{ContactKey, Detection, ModelError, MultibodyModel};
use super::outcome::{count, fill_record, ran_away, redundant};
use super::record::StepRecord;
use super::rules::Scheme;
use crate::contact::{NO_BODY, Vec2, Vec3};
use crate::solver::{ImpulseSolver, SolveStatus, solver_by_name};
use std::collections::HashMap;
use thiserror::Error;

/// How a [`MoreauStepper`] steps.
#[derive(Debug, Clone, PartialEq)]
pub struct StepperSettings {
    pub scheme: Scheme,
    /// A name of [`crate::solver::SOLVERS`].
    pub solver: String,
    /// Relative natural-map residual at which an island counts as solved.
    pub tolerance: f64,
}

impl Default for StepperSettings {
    fn default() -> Self {
        StepperSettings {
            scheme: Scheme::Staggered,
            solver: "auto".to_owned(),
            tolerance: 1e-8,
        }
    }
}

/// Why a step could not be taken.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StepError {
    /// The step length is not a positive finite number.
    #[error("step length is {0} s, must be finite and above 0")]
    Dt(f64),
    /// Settings name a solver that does not exist.
    #[error("unknown solver '{0}'")]
    Solver(String),
    /// The tolerance is not a positive finite number.
    #[error("solver tolerance is {0}, must be finite and above 0")]
    Tolerance(f64),
    /// A velocity or position is NaN or infinite; the model stands as it did before.
    #[error("body {body} has a velocity that is not finite at t = {time} s")]
    NonFinite { body: usize, time: f64 },
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// Moreau's midpoint step with certified impulses: equations (1) to (6) of [`crate::dynamics`].
pub struct MoreauStepper {
    settings: StepperSettings,
    solver: Box<dyn ImpulseSolver>,
    time: f64,
    memory: HashMap<ContactKey, Memory>,
    memory_next: HashMap<ContactKey, Memory>,
    detection: Detection,
    islands: Islands,
    scratch: Scratch,
}

impl MoreauStepper {
    /// A stepper at t = 0 with no memory.
    ///
    /// # Errors
    /// [`StepError::Solver`], [`StepError::Tolerance`].
    pub fn new(settings: StepperSettings) -> Result<Self, StepError> {
        let solver = solver_by_name(&settings.solver)
            .ok_or_else(|| StepError::Solver(settings.solver.clone()))?;
        if !(settings.tolerance > 0.0 && settings.tolerance.is_finite()) {
            return Err(StepError::Tolerance(settings.tolerance));
        }
        Ok(MoreauStepper {
            settings,
            solver,
            time: 0.0,
            memory: HashMap::new(),
            memory_next: HashMap::new(),
            detection: Detection::default(),
            islands: Islands::default(),
            scratch: Scratch::default(),
        })
    }

    /// Time at the end of the last step \[s\].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The settings in force.
    pub fn settings(&self) -> &StepperSettings {
        &self.settings
    }

    /// Forgets all contacts, as if none had touched before: after a re-meshed collider, say.
    pub fn forget_contacts(&mut self) {
        self.memory.clear();
    }

    /// Advances `model` by `dt` \[s\].
    ///
    /// # Errors
    /// [`StepError::Dt`], [`StepError::NonFinite`], [`StepError::Model`].
    pub fn step<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        dt: f64,
    ) -> Result<StepRecord, StepError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(StepError::Dt(dt));
        }
        model.begin_step(dt)?;
        let s = &mut self.scratch;
        s.start.clear();
        s.start.extend_from_slice(model.velocities());
        check_finite(&s.start, self.time)?;

        let potential_start = model.potential_energy();
        model.mark();
        model.advance(0.5 * dt);
        self.detection.clear();
        if let Err(error) = model.detect(dt, &mut self.detection) {
            put_back(model);
            return Err(error.into());
        }
        free_velocities(model, &self.detection, self.time, dt, s);
        let scheme = self.settings.scheme;
        self.scratch.collect(
            &self.detection,
            &self.memory,
            scheme,
            model.inverse_mass(),
            dt,
        );
        let mut record = StepRecord {
            time: self.time + dt,
            dt,
            ..StepRecord::default()
        };
        self.solve_islands(model.inverse_mass(), &mut record);

        let s = &mut self.scratch;
        // u_E from the impulses alone, so that the energy balance closes to round-off
        s.end.clear();
        s.end.extend_from_slice(&s.free);
        for (block, &impulse) in s.blocks.iter().zip(&s.impulses) {
            block.rows.push(impulse, model.inverse_mass(), &mut s.end);
        }
        if let Err(error) = check_finite(&s.end, self.time) {
            put_back(model);
            return Err(error);
        }
        fill_record(
            &self.scratch,
            &self.detection,
            model.inverse_mass(),
            dt,
            &mut record,
            &mut self.memory_next,
        );
        std::mem::swap(&mut self.memory, &mut self.memory_next);
        model.set_velocities(&self.scratch.end);
        model.advance(0.5 * dt);
        model.end_step();
        record.energy.potential_start = potential_start;
        record.energy.potential_end = model.potential_energy();
        self.time += dt;
        Ok(record)
    }

    /// Solves island after island and gathers the impulses.
    fn solve_islands(&mut self, inverse_mass: &[Vec3], record: &mut StepRecord) {
        let s = &mut self.scratch;
        let tolerance = self.settings.tolerance;
        self.islands.build(inverse_mass.len(), &s.rows);
        s.local_of.clear();
        s.local_of.resize(inverse_mass.len(), NO_BODY);
        s.resolution.clear();
        s.resolution.resize(s.blocks.len(), 0.0);
        record.islands = self.islands.len();
        for k in 0..self.islands.len() {
            let members = self.islands.blocks(k);
            let mut problem = island_problem(members, s, inverse_mass);
            let warm: Vec<Vec2> = members.iter().map(|&i| s.impulses[i as usize]).collect();
            let mut impulses = warm.clone();
            let mut report = self.solver.solve(&problem, &mut impulses, tolerance);
            if ran_away(&report, members, s) {
                report.status = SolveStatus::Unsolved;
            }
            let cap_blocks: Vec<CapBlock> = members
                .iter()
                .map(|&i| {
                    let block = &s.blocks[i as usize];
                    CapBlock {
                        gamma_a: block.gamma_a,
                        free: block.free - s.gamma_free(i as usize, &self.detection),
                        rigid: is_rigid(&block.law),
                        impact: block.impact,
                    }
                })
                .collect();
            if self.settings.scheme == Scheme::Staggered {
                let pushes = cap_blocks.iter().any(|b| b.rigid && b.free.x < 0.0);
                if !report.solved() && pushes {
                    // push-outs that contradict each other are dropped
                    for (b, c) in problem.free.iter_mut().zip(&cap_blocks) {
                        if c.rigid {
                            b.x -= c.free.x.min(0.0);
                        }
                    }
                    let mut relaxed = warm;
                    let again = self.solver.solve(&problem, &mut relaxed, tolerance);
                    if again.residual.velocity < report.residual.velocity {
                        impulses = relaxed;
                        report = again.after(&report);
                        record.relaxed += 1;
                    }
                } else {
                    let capped = cap(
                        self.solver.as_mut(),
                        &problem,
                        &cap_blocks,
                        &mut impulses,
                        report,
                        tolerance,
                    );
                    report = capped.report;
                    record.capped += usize::from(capped.capped);
                }
            }
            count(record, &report);
            let resolution = 10.0 * tolerance * report.residual.velocity_scale;
            record.redundant += usize::from(redundant(&problem, &impulses, resolution));
            for (&i, &p) in members.iter().zip(&impulses) {
                s.impulses[i as usize] = p;
                s.resolution[i as usize] = resolution;
            }
        }
    }
}

fn put_back<M: MultibodyModel + ?Sized>(model: &mut M) {
    (0..model.velocities().len()).for_each(|body| model.reset(body));
}

fn check_finite(velocities: &[Vec3], time: f64) -> Result<(), StepError> {
    match velocities
        .iter()
        .position(|u| u.iter().any(|x| !x.is_finite()))
    {
        Some(body) => Err(StepError::NonFinite { body, time }),
        None => Ok(()),
    }
}
