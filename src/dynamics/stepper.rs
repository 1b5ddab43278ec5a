use super::cap::{CapBlock, cap, is_rigid};
use super::islands::Islands;
use super::model::{ContactKey, Detection, JointKind, ModelError, MultibodyModel, NormalLaw};
use super::record::{ContactRecord, ContactStatus, StepRecord};
use super::rules::{Rule, Scheme, Situation, reference_acceleration, rule};
use crate::contact::{BodyOperator, ContactProblem, Delassus, Law, NO_BODY, Rows, Vec2, Vec3};
use crate::solver::{ImpulseSolver, SolveReport, SolveStatus, solver_by_name};
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

/// What is kept of a contact from one step to the next.
#[derive(Debug, Clone, Copy)]
struct Memory {
    /// [N s], of a step of length `dt`.
    impulse: Vec2,
    dt: f64,
    /// Tangential velocity at the end of the step, if it stuck.
    stuck: Option<f64>,
}

/// One block of rows that takes part in the step.
#[derive(Debug, Clone, Copy)]
struct Block {
    source: Source,
    /// All rows, those of bodies that move on their own included.
    rows: Rows,
    law: Law,
    free: Vec2,
    gamma_a: Vec2,
    impact: bool,
    stuck_before: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Source {
    Contact(usize),
    Joint(usize),
}

#[derive(Default)]
struct Scratch {
    start: Vec<Vec3>,
    forces: Vec<Vec3>,
    accelerations: Vec<Vec3>,
    free: Vec<Vec3>,
    end: Vec<Vec3>,
    blocks: Vec<Block>,
    /// Of each block, the rows of movable sides only.
    rows: Vec<Rows>,
    impulses: Vec<Vec2>,
    resolution: Vec<f64>,
    local_of: Vec<u32>,
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
        model.advance(0.5 * dt);
        self.detection.clear();
        if let Err(error) = model.detect(dt, &mut self.detection) {
            model.advance(-0.5 * dt);
            return Err(error.into());
        }
        free_velocities(model, &self.detection, self.time, dt, s);
        self.collect_blocks(model.inverse_mass(), dt);
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
            model.advance(-0.5 * dt);
            return Err(error);
        }
        self.fill_record(model.inverse_mass(), dt, &mut record);
        model.set_velocities(&self.scratch.end);
        model.advance(0.5 * dt);
        model.end_step();
        record.energy.potential_start = potential_start;
        record.energy.potential_end = model.potential_energy();
        self.time += dt;
        Ok(record)
    }

    /// Chooses the rule of every contact and joint of the detection.
    fn collect_blocks(&mut self, inverse_mass: &[Vec3], dt: f64) {
        let s = &mut self.scratch;
        s.blocks.clear();
        s.rows.clear();
        s.impulses.clear();
        let staggered = self.settings.scheme == Scheme::Staggered;
        for (index, contact) in self.detection.contacts.iter().enumerate() {
            if movable(&contact.rows, inverse_mass).bodies == [NO_BODY, NO_BODY] {
                continue;
            }
            let surface = Vec2::new(0.0, contact.surface_velocity);
            let memory = self.memory.get(&contact.key);
            let now = Situation {
                dt,
                gamma_a: contact.rows.velocity(&s.start) + surface,
                gamma_f: contact.rows.velocity(&s.free) + surface,
                acceleration: reference_acceleration(contact, &s.start, &s.accelerations),
                carried: memory.is_some_and(|m| m.impulse.x > 0.0),
                stuck: memory.and_then(|m| m.stuck),
            };
            let Some(Rule { free, law, impact }) = rule(self.settings.scheme, contact, &now) else {
                continue;
            };
            let mut rows = contact.rows;
            let mut warm = memory.map_or(Vec2::zeros(), |m| m.impulse * (dt / m.dt));
            let (mut gamma_f, mut gamma_a) = (now.gamma_f, now.gamma_a);
            if let NormalLaw::Load { .. } = contact.law {
                // the friction row takes the place of the normal one
                for side in &mut rows.jacobian {
                    *side = [side[1], Vec3::zeros()];
                }
                (warm, gamma_f, gamma_a) = (
                    Vec2::new(warm.y, 0.0),
                    Vec2::new(gamma_f.y, 0.0),
                    Vec2::new(gamma_a.y, 0.0),
                );
            }
            s.blocks.push(Block {
                source: Source::Contact(index),
                rows,
                law,
                free: gamma_f + free,
                gamma_a,
                impact,
                stuck_before: now.stuck.is_some(),
            });
            s.impulses.push(warm);
        }
        for (index, joint) in self.detection.joints.iter().enumerate() {
            if movable(&joint.rows, inverse_mass).bodies == [NO_BODY, NO_BODY] {
                continue;
            }
            let mut rows = joint.rows;
            let (law, free) = match joint.kind {
                // gap/Δt keeps the drift at second order; the published rule corrects no gap
                JointKind::Pin { gap } => {
                    (Law::Pin, if staggered { gap / dt } else { Vec2::zeros() })
                }
                JointKind::Motor { speed, max_force } => {
                    rows.jacobian
                        .iter_mut()
                        .for_each(|side| side[1] = Vec3::zeros());
                    let bound = max_force * dt;
                    let law = Law::Bounded {
                        lower: -bound,
                        upper: bound,
                    };
                    (law, Vec2::new(-speed, 0.0))
                }
            };
            let warm = self
                .memory
                .get(&joint.key)
                .map_or(Vec2::zeros(), |m| m.impulse * (dt / m.dt));
            s.blocks.push(Block {
                source: Source::Joint(index),
                rows,
                law,
                free: rows.velocity(&s.free) + free,
                gamma_a: rows.velocity(&s.start),
                impact: false,
                stuck_before: false,
            });
            s.impulses.push(warm);
        }
        s.rows
            .extend(s.blocks.iter().map(|b| movable(&b.rows, inverse_mass)));
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

    /// Energy, contacts and memory from the impulses and both velocities.
    fn fill_record(&mut self, inverse_mass: &[Vec3], dt: f64, record: &mut StepRecord) {
        let s = &self.scratch;
        let energy = &mut record.energy;
        energy.kinetic_start = kinetic(&s.start, inverse_mass);
        energy.kinetic_end = kinetic(&s.end, inverse_mass);
        let mean: Vec<Vec3> = s
            .start
            .iter()
            .zip(&s.end)
            .map(|(a, e)| 0.5 * (a + e))
            .collect();
        energy.forces = forces_work(&s.forces, &mean, inverse_mass, dt);
        self.memory_next.clear();
        for (i, (block, &p)) in s.blocks.iter().zip(&s.impulses).enumerate() {
            let own = mobile_velocity(&block.rows, &mean, inverse_mass);
            match block.source {
                Source::Joint(index) => {
                    let joint = &self.detection.joints[index];
                    match joint.kind {
                        JointKind::Pin { .. } => energy.joints += p.dot(&own),
                        JointKind::Motor { .. } => energy.motors += p.x * own.x,
                    }
                    self.memory_next.insert(
                        joint.key,
                        Memory {
                            impulse: p,
                            dt,
                            stuck: None,
                        },
                    );
                }
                Source::Contact(index) => {
                    let contact = &self.detection.contacts[index];
                    // the whole impulse, with the given load where friction alone was solved
                    let (impulse, mu) = match contact.law {
                        NormalLaw::Load { force } => (Vec2::new(force * dt, p.x), contact.friction),
                        _ => (p, contact.friction),
                    };
                    let work = mobile_velocity(&contact.rows, &mean, inverse_mass);
                    energy.contact_n += impulse.x * work.x;
                    energy.contact_t += impulse.y * work.y;
                    let surface = Vec2::new(0.0, contact.surface_velocity);
                    let gamma_e = contact.rows.velocity(&s.end) + surface;
                    let gamma_mean = contact.rows.velocity(&mean) + surface;
                    // the velocity that the friction law sees, within what the solve resolves:
                    // on the border of the cone a contact may stick, inside it it must
                    let added = block.free - s.gamma_free(i, &self.detection);
                    let added = match contact.law {
                        NormalLaw::Load { .. } => added.x,
                        _ => added.y,
                    };
                    let sticks =
                        mu > 0.0 && impulse.x > 0.0 && (gamma_e.y + added).abs() <= s.resolution[i];
                    let memory = Memory {
                        impulse,
                        dt,
                        stuck: sticks.then_some(gamma_e.y),
                    };
                    self.memory_next.insert(contact.key, memory);
                    if impulse.x > 0.0 || contact.gap <= 0.0 {
                        let slip = if sticks && block.stuck_before {
                            0.0
                        } else {
                            dt * gamma_mean.y
                        };
                        let slip_velocity = slip / dt;
                        record.contacts.push(ContactRecord {
                            bodies: contact.bodies,
                            surfaces: contact.surfaces,
                            cell: contact.cell,
                            position: contact.position,
                            normal: contact.normal,
                            gap: contact.gap,
                            impulse_n: impulse.x,
                            impulse_t: impulse.y,
                            slip,
                            load_slip: impulse.x * slip_velocity.abs(),
                            friction_work: -impulse.y * slip_velocity,
                            normal_work: impulse.x * gamma_mean.x,
                            status: status(impulse.x, block.impact, sticks, gamma_e.y),
                        });
                    }
                    if !block.impact {
                        let end_gap = contact.gap + 0.5 * dt * gamma_e.x;
                        record.penetration = record.penetration.max(-end_gap);
                    } else {
                        record.penetration_impact = record.penetration_impact.max(-contact.gap);
                    }
                }
            }
        }
        std::mem::swap(&mut self.memory, &mut self.memory_next);
    }
}

impl Scratch {
    /// `γ_F` of block `i`, without what its rule added.
    fn gamma_free(&self, i: usize, detection: &Detection) -> Vec2 {
        let block = &self.blocks[i];
        let gamma = block.rows.velocity(&self.free);
        match block.source {
            Source::Contact(c) => match detection.contacts[c].law {
                NormalLaw::Load { .. } => {
                    gamma + Vec2::new(detection.contacts[c].surface_velocity, 0.0)
                }
                _ => gamma + Vec2::new(0.0, detection.contacts[c].surface_velocity),
            },
            Source::Joint(_) => gamma,
        }
    }
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

/// `u_F = u_A + M⁻¹ (h Δt + W_N P_N)` with the normal impulses that are given.
fn free_velocities<M: MultibodyModel + ?Sized>(
    model: &M,
    detection: &Detection,
    time: f64,
    dt: f64,
    s: &mut Scratch,
) {
    let inverse_mass = model.inverse_mass();
    s.forces.clear();
    s.forces.resize(s.start.len(), Vec3::zeros());
    model.forces(time + 0.5 * dt, &mut s.forces);
    s.accelerations.clear();
    s.accelerations.extend(
        s.forces
            .iter()
            .zip(inverse_mass)
            .map(|(f, w)| f.component_mul(w)),
    );
    s.free.clear();
    s.free.extend(
        s.start
            .iter()
            .zip(&s.accelerations)
            .map(|(u, a)| u + a * dt),
    );
    for contact in &detection.contacts {
        if let NormalLaw::Load { force } = contact.law {
            let impulse = Vec2::new(force * dt, 0.0);
            contact.rows.push(impulse, inverse_mass, &mut s.free);
        }
    }
}

/// `rows` without the sides that move on their own: they join no islands and take no impulse.
fn movable(rows: &Rows, inverse_mass: &[Vec3]) -> Rows {
    let mut rows = *rows;
    for body in &mut rows.bodies {
        if *body != NO_BODY && inverse_mass[*body as usize] == Vec3::zeros() {
            *body = NO_BODY;
        }
    }
    rows
}

/// The contact problem of one island, over its own bodies.
fn island_problem(members: &[u32], s: &mut Scratch, inverse_mass: &[Vec3]) -> ContactProblem {
    let mut operator = BodyOperator::default();
    let mut problem_free = Vec::with_capacity(members.len());
    let mut laws = Vec::with_capacity(members.len());
    let mut touched = Vec::new();
    for &i in members {
        let block = &s.blocks[i as usize];
        let mut rows = s.rows[i as usize];
        for body in &mut rows.bodies {
            if *body == NO_BODY {
                continue;
            }
            let global = *body as usize;
            if s.local_of[global] == NO_BODY {
                s.local_of[global] = operator.inverse_mass.len() as u32;
                operator.inverse_mass.push(inverse_mass[global]);
                touched.push(global);
            }
            *body = s.local_of[global];
        }
        operator.rows.push(rows);
        problem_free.push(block.free);
        laws.push(block.law);
    }
    for global in touched {
        s.local_of[global] = NO_BODY;
    }
    ContactProblem {
        operator: Delassus::Bodies(operator),
        free: problem_free,
        laws,
    }
}

/// Whether certified impulses are self-stress without bound.
///
/// Where friction and restitution wedge bodies, impulses can grow until any residual is small
/// beside them. What then stays open as a velocity is large beside the velocities that the bodies
/// have, by a thousandth and more; a true solution misses them by the tolerance.
fn ran_away(report: &SolveReport, members: &[u32], s: &Scratch) -> bool {
    let open = report.residual.velocity;
    // [m/s], far below any motion that matters and far above round-off
    if open <= 1e-9 {
        return false;
    }
    let own = members
        .iter()
        .map(|&i| &s.blocks[i as usize])
        .fold(0.0f64, |v, b| v.max(b.gamma_a.amax()).max(b.free.amax()));
    open > 1e-3 * own
}

/// Whether the closed rigid rows outnumber the coordinates: their shares are then not unique.
///
/// Closed is what the velocity says, `|ξ| ≤ resolution`, not which rows a solver chose to load.
fn redundant(problem: &ContactProblem, impulses: &[Vec2], resolution: f64) -> bool {
    let Delassus::Bodies(op) = &problem.operator else {
        return false;
    };
    let coordinates: usize = op
        .inverse_mass
        .iter()
        .map(|w| w.iter().filter(|x| **x > 0.0).count())
        .sum();
    let rows: usize = problem
        .laws
        .iter()
        .zip(impulses)
        .zip(problem.local_velocity(impulses))
        .map(|((law, p), xi)| match *law {
            Law::Contact {
                compliance,
                friction,
            } => {
                let closed = compliance == 0.0 && xi.x <= resolution;
                let sticks = friction > 0.0 && p.x > 0.0 && xi.y.abs() <= resolution;
                usize::from(closed) + usize::from(sticks)
            }
            Law::Pin => 2,
            Law::Bounded { lower, upper } => usize::from(p.x > lower && p.x < upper),
        })
        .sum();
    rows > coordinates
}

fn count(record: &mut StepRecord, report: &SolveReport) {
    record.sweeps += report.sweeps;
    record.factorisations += report.factorisations;
    record.pivots += report.pivots;
    record.unsolved += usize::from(!report.solved());
    record.residual = record.residual.max(report.residual.relative);
    record.residual_velocity = record.residual_velocity.max(report.residual.velocity);
}

fn kinetic(velocities: &[Vec3], inverse_mass: &[Vec3]) -> f64 {
    velocities
        .iter()
        .zip(inverse_mass)
        .map(|(u, w)| {
            (0..3)
                .filter(|&i| w[i] > 0.0)
                .map(|i| 0.5 * u[i] * u[i] / w[i])
                .sum::<f64>()
        })
        .sum()
}

fn forces_work(forces: &[Vec3], mean: &[Vec3], inverse_mass: &[Vec3], dt: f64) -> f64 {
    (0..forces.len())
        .map(|k| {
            (0..3)
                .filter(|&i| inverse_mass[k][i] > 0.0)
                .map(|i| dt * forces[k][i] * mean[k][i])
                .sum::<f64>()
        })
        .sum()
}

/// `W ū` over the coordinates that can move: impulses do no work on what moves on its own.
fn mobile_velocity(rows: &Rows, mean: &[Vec3], inverse_mass: &[Vec3]) -> Vec2 {
    let mut gamma = Vec2::zeros();
    for side in 0..2 {
        if rows.bodies[side] == NO_BODY {
            continue;
        }
        let body = rows.bodies[side] as usize;
        let u = mean[body].zip_map(&inverse_mass[body], |v, w| if w > 0.0 { v } else { 0.0 });
        gamma.x += rows.jacobian[side][0].dot(&u);
        gamma.y += rows.jacobian[side][1].dot(&u);
    }
    gamma
}

fn status(impulse_n: f64, impact: bool, sticks: bool, end_velocity: f64) -> ContactStatus {
    if impulse_n <= 0.0 {
        ContactStatus::Open
    } else if impact {
        ContactStatus::Impact
    } else if sticks {
        ContactStatus::Stick
    } else if end_velocity < 0.0 {
        ContactStatus::SlipMinus
    } else {
        ContactStatus::SlipPlus
    }
}
