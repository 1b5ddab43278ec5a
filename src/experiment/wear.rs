//! Wear of the bodies of a scene: measured cycles of its run, and jumps between them.

use super::simulate::{Engine, RunError, Totals};
use crate::checkpoint::{CheckpointError, Reader, Writer};
use crate::dynamics::record::StepRecord;
use crate::peers::Simulation;
use crate::report::{Progress, number, row};
use crate::scene::{Built, Life, Scene};
use crate::wear::{JumpRule, MOST_JUMPS, WearState};
use crate::worn::{WearingSurface, WornColliders, WornError};

row! {
    /// Wear of one cell of a body after so much wear. Places are in the body's frame.
    CellRow in "wear.csv" {
        seconds: f64,
        hours: f64,
        body: String,
        /// Counted from 1 in the order of the edges of the body.
        cell: u32,
        /// Place of the cell on the new surface.
        x_m: f64,
        y_m: f64,
        depth_m: f64,
        /// Per metre of width, the part of the worn area that is the cell's.
        volume_m3_per_m: f64,
        /// Of the jump that ends here.
        load_slip_nm_per_s: f64,
        /// Estimate of the error of the depth by the jumps.
        jump_error_m: f64,
    }
}

row! {
    /// One node of a worn surface after so much wear, in the body's frame.
    NodeRow in "profile.csv" {
        seconds: f64,
        hours: f64,
        body: String,
        node: u32,
        x_m: f64,
        y_m: f64,
    }
}

row! {
    /// One jump.
    JumpRow in "jumps.csv" {
        seconds: f64,
        hours: f64,
        jump_s: f64,
        /// `K k S` of the jump.
        feedback: f64,
        /// What bounded it: `requested` or `depth`.
        bound: String,
    }
}

/// Most rows of `profile.csv` and of `wear.csv`: about a gigabyte of memory.
const MOST_ROWS: usize = 5_000_000;

/// The wear of a scene's bodies.
#[derive(Debug, Clone)]
pub struct WearOutcome {
    pub worn: WornColliders,
    /// Names of the wearing bodies, in the order of the surfaces.
    pub names: Vec<String>,
    pub cells: Vec<CellRow>,
    pub nodes: Vec<NodeRow>,
    pub jumps: Vec<JumpRow>,
    /// Whether surfaces yielded by wear compliance: contacts are rigid, or stiff for the jumps.
    pub compliance: bool,
    /// Largest [`Jumped::open_load`](crate::worn::Jumped) of a jump.
    pub open_load: f64,
    /// Why the wear ended before its duration.
    pub ended: Option<String>,
    pub totals: Totals,
    /// Cycles that were measured, steps of the present one, and steps of each.
    cycles: usize,
    step: usize,
    cycle_steps: usize,
}

impl WearOutcome {
    /// Lets the bodies of `[[wear]]` wear from now on.
    ///
    /// # Errors
    /// [`RunError`].
    pub fn start(scene: &Scene, built: &mut Built) -> Result<WearOutcome, RunError> {
        let life = scene.life.ok_or_else(|| unfit("the scene has no [life]"))?;
        start(scene, built, &life)
    }

    /// Goes on until the bodies have worn for as long as `[life]` says.
    ///
    /// The scene settles, one cycle of `steps` steps is measured, all surfaces wear by a jump, and it goes
    /// on with the worn bodies from where it stands: its motion must last, as that of a belt, a roller or a
    /// mechanism does.
    ///
    /// # Arguments
    /// - `steps`: of a measured cycle.
    /// - `observe`: is called after every step.
    ///
    /// # Errors
    /// [`RunError`]. A body that wears through itself ends the run with what it has found:
    /// [`WearOutcome::ended`].
    pub fn go_on(
        mut self,
        scene: &Scene,
        built: &mut Built,
        steps: usize,
        progress: &Progress,
        mut observe: impl FnMut(&StepRecord, &Built, &WearOutcome) -> Result<(), RunError>,
    ) -> Result<WearOutcome, RunError> {
        let run = &mut self;
        let life = scene.life.ok_or_else(|| unfit("the scene has no [life]"))?;
        let settle = life
            .settle
            .map_or(steps, |time| (time / scene.step.dt).round() as usize);
        run.cycle_steps = settle + steps;
        let state = |built: &Built, k: usize| Engine::Moreau.state(built, k);
        if run.totals.steps == 0 {
            // records overlaps of the start, which are not errors of a step
            built.measure(state);
        }
        loop {
            progress.set((1000.0 * run.worn.seconds() / life.duration) as u64);
            while run.step < run.cycle_steps {
                let (mut record, seconds) = Engine::Moreau.timed_step(built)?;
                run.totals.wall += seconds;
                if run.is_new() {
                    built.measure_into(&mut record, state);
                }
                run.totals.add(&record);
                run.step += 1;
                if run.step > settle {
                    let measured = run.worn.measure(&record);
                    measured.map_err(|e| failed(&run.names, e))?;
                }
                observe(&record, built, run)?;
            }
            if run.worn.seconds() >= life.duration || !run.jump(built, &life)? {
                break;
            }
            run.step = 0;
            run.cycles += 1;
        }
        if run.ended.is_none() && run.worn.worn_through().is_none() {
            let closed = run.worn.close(&mut simulation(built)?.pipeline);
            closed.map_err(|e| failed(&run.names, e))?;
        }
        run.add_cells();
        Ok(self)
    }

    /// Whether no jump was tried yet: the bodies are as the scene says.
    pub fn is_new(&self) -> bool {
        self.cycles == 0
    }

    /// Whether the step observed last ends a cycle.
    pub fn ends_cycle(&self) -> bool {
        self.step == self.cycle_steps
    }

    /// Saves the state after a step, without that of the world.
    ///
    /// # Errors
    /// [`CheckpointError::Write`].
    pub fn save(&self, to: &mut Writer) -> Result<(), CheckpointError> {
        to.put(&(&self.worn, &self.nodes, &self.jumps))?;
        to.put(&(self.compliance, self.open_load, self.cycles, self.step))?;
        self.totals.save(to)
    }

    /// Goes on from what [`WearOutcome::save`] saved in a run of the same scene.
    ///
    /// # Errors
    /// [`CheckpointError::Read`].
    pub fn load(&mut self, from: &mut Reader) -> Result<(), CheckpointError> {
        (self.worn, self.nodes, self.jumps) = from.take()?;
        (self.compliance, self.open_load, self.cycles, self.step) = from.take()?;
        self.totals = Totals::load(from)?;
        Ok(())
    }

    /// Wears all bodies by a jump. Returns whether it goes on.
    fn jump(&mut self, built: &mut Built, life: &Life) -> Result<bool, RunError> {
        let simulation = simulation(built)?;
        let (world, pipeline) = (&mut simulation.world, &mut simulation.pipeline);
        let jumped = match self.worn.jump(world, pipeline, life.duration) {
            Ok(jumped) => jumped,
            Err(error @ WornError::WornThrough { .. }) => {
                self.ended = Some(failed(&self.names, error).to_string());
                return Ok(false);
            }
            Err(error) => return Err(failed(&self.names, error)),
        };
        self.add(&jumped);
        let lasts = self.worn.seconds() < life.duration;
        if let Some(error) = self.worn.worn_through() {
            let why = failed(&self.names, error.clone()).to_string();
            self.ended = lasts.then_some(why);
            return Ok(false);
        }
        self.ended = lasts.then(|| self.too_many_jumps(life)).flatten();
        Ok(self.ended.is_none())
    }
}

fn simulation(built: &mut Built) -> Result<&mut Simulation, RunError> {
    let none = || unfit("the scene is not built on a rapier world");
    built.simulation_mut().ok_or_else(none)
}

fn unfit(why: &str) -> RunError {
    RunError::Unfit(why.to_owned())
}

/// An error with the name of its body.
fn failed(names: &[String], error: WornError) -> RunError {
    let name = error.surface().and_then(|k| names.get(k));
    RunError::Unfit(match name {
        Some(name) => format!("[[wear]] of body {name}: {error}"),
        None => format!("[[wear]]: {error}"),
    })
}

fn start(scene: &Scene, built: &mut Built, life: &Life) -> Result<WearOutcome, RunError> {
    let rule = JumpRule {
        cycles: life.duration,
        depth: life.jump,
        stability: 1.0,
    };
    let mut run = WearOutcome {
        worn: WornColliders::new(rule),
        names: Vec::new(),
        cells: Vec::new(),
        nodes: Vec::new(),
        jumps: Vec::new(),
        compliance: false,
        open_load: 0.0,
        ended: None,
        totals: Totals::default(),
        cycles: 0,
        step: 0,
        cycle_steps: 0,
    };
    for wear in &scene.wear {
        run.names.push(scene.bodies[wear.body].name.clone());
        let collider = built
            .simulation()
            .and_then(|(simulation, bodies)| simulation.collider(*bodies.get(wear.body)?));
        let parts = built.simulation_mut().zip(collider);
        let Some((simulation, collider)) = parts else {
            return Err(unfit("the scene is not built on a rapier world"));
        };
        let surface = WearingSurface {
            coefficient: wear.coefficient,
            edges: wear.edges,
            cell: wear.cell,
            density: wear.density,
        };
        let (world, pipeline) = (&mut simulation.world, &mut simulation.pipeline);
        let added = run.worn.add(world, pipeline, collider, surface);
        if let Err(error) = added {
            let name = run.names.last().map_or("", String::as_str);
            return Err(RunError::Unfit(format!("[[wear]] of body {name}: {error}")));
        }
    }
    run.add_nodes();
    Ok(run)
}

impl WearOutcome {
    fn add(&mut self, jumped: &crate::worn::Jumped) {
        self.compliance |= jumped.compliance;
        if jumped.seconds == 0.0 {
            return;
        }
        self.open_load = self.open_load.max(jumped.open_load);
        let seconds = self.worn.seconds();
        self.jumps.push(JumpRow {
            seconds,
            hours: seconds / 3600.0,
            jump_s: jumped.seconds,
            feedback: jumped.feedback,
            bound: jumped.bound.word().to_owned(),
        });
        self.add_nodes();
    }

    /// Why there can be no further jump: there are as many as a life may have.
    fn too_many_jumps(&self, life: &Life) -> Option<String> {
        let jumps = self.jumps.len();
        if jumps < MOST_JUMPS && self.nodes.len() < MOST_ROWS {
            return None;
        }
        let worn = self.worn.seconds();
        let states = (0..self.worn.surfaces()).map(|surface| self.state(surface));
        let depths = states.flat_map(|state| state.depth().iter().copied());
        let mean = depths.fold(0.0, f64::max) / jumps as f64;
        Some(format!(
            "life.jump = {:?}: {jumps} jumps of {} m on average wear for {} of the {:?} s of life.duration, \
             more are not computed; allowed is about {} to 1 m{}",
            life.jump,
            number(mean, 3),
            number(worn, 4),
            life.duration,
            number(mean * life.duration / worn, 2),
            match mean < 0.5 * life.jump {
                true => ", with cells that are more than three times as long (wear.cell)",
                false => "",
            }
        ))
    }

    /// Adds the present nodes of all surfaces.
    fn add_nodes(&mut self) {
        let seconds = self.worn.seconds();
        for (surface, name) in self.names.iter().enumerate() {
            let profile = self.worn.state(surface).profile();
            // in the order of the edges of the body
            for (node, point) in profile.nodes().iter().rev().enumerate() {
                let place = self.worn.in_collider(surface, *point);
                self.nodes.push(NodeRow {
                    seconds,
                    hours: seconds / 3600.0,
                    body: name.clone(),
                    node: node as u32 + 1,
                    x_m: place.x,
                    y_m: place.y,
                });
            }
        }
    }

    /// Adds the history of all cells.
    fn add_cells(&mut self) {
        for (surface, name) in self.names.iter().enumerate() {
            let state = self.worn.state(surface);
            let new: Vec<(f64, f64)> = (self.nodes.iter())
                .filter(|row| row.seconds == 0.0 && row.body == *name)
                .map(|row| (row.x_m, row.y_m))
                .collect();
            for point in state.life().points() {
                for (k, (x_m, y_m)) in new.iter().enumerate() {
                    // the profile runs the other way
                    let cell = new.len() - 1 - k;
                    self.cells.push(CellRow {
                        seconds: point.cycles,
                        hours: point.hours,
                        body: name.clone(),
                        cell: k as u32 + 1,
                        x_m: *x_m,
                        y_m: *y_m,
                        depth_m: point.depth[cell],
                        volume_m3_per_m: point.volume[cell],
                        load_slip_nm_per_s: point.load_slip[cell],
                        jump_error_m: point.jump_error.as_ref().map_or(f64::NAN, |e| e[cell]),
                    });
                }
            }
        }
    }

    /// The last state of a surface.
    pub fn state(&self, surface: usize) -> &WearState {
        self.worn.state(surface)
    }
}
