use super::super::baseline::Baseline;
use super::super::reference::{Measure, Samples, measures};
use super::super::setting::step_count;
use super::super::simulate::{Engine, RunError, Totals, advance};
use super::super::verdict::{Judge, Verdict};
use super::forces::Forces;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::Pose64;
use crate::scene::{Built, Scene};

/// Most body states that a trace stores; a longer run stores every k-th step and the last one.
const MOST_STATES: usize = 1_000_000;

/// Pose and velocity of each body at one time.
#[derive(Debug, Clone)]
pub(super) struct Moment {
    /// \[s\]
    pub time: f64,
    pub states: Vec<(Pose64, Vec3)>,
}

/// The run of one rung by one engine, as input of the checks.
pub(super) struct Trace {
    pub scene: Scene,
    pub engine: Engine,
    /// The start first and the end last; all steps in between, or every k-th.
    pub history: Vec<Moment>,
    pub totals: Totals,
    /// Whether the scene held, as a run says it.
    pub verdict: Verdict,
    /// Errors against the scene's closed form.
    pub measures: Vec<Measure>,
    /// What contacts reported.
    pub forces: Forces,
}

impl Trace {
    /// Runs `scene` to its end with the engine's preset.
    ///
    /// # Errors
    /// Those of [`Trace::with`].
    #[cfg(test)]
    pub fn of(scene: &Scene, engine: Engine) -> Result<Trace, RunError> {
        Trace::with(scene, engine, engine.baseline().as_ref())
    }

    /// Runs `scene` to its end with the settings `peer` of an engine that is not ours.
    ///
    /// # Errors
    /// Those of [`advance`]; [`RunError::Unfit`] for an engine that cannot step the scene.
    pub fn with(scene: &Scene, engine: Engine, peer: Option<&Baseline>) -> Result<Trace, RunError> {
        engine.has_model(scene)?;
        let mut built = scene.build()?;
        let steps = step_count(&scene.step);
        let every = (steps * built.bodies()).div_ceil(MOST_STATES).max(1);
        let mut samples = Samples::start(&built, engine);
        let mut history = vec![moment(&built, engine, 0.0)];
        let numbers: Vec<Option<u32>> = (0..built.bodies()).map(|k| built.number(k)).collect();
        let mut forces = Forces::new(numbers);
        let mut judge = Judge::new(scene, &built);
        let (mut step, from) = (0, steps - steps.div_ceil(10));
        if let Some(settings) = peer {
            engine.prepare_with(settings, &mut built)?;
        }
        let totals = advance(&mut built, engine, steps, |record, built| {
            step += 1;
            if step % every == 0 || step == steps {
                history.push(moment(built, engine, record.time));
            }
            if scene.reference.is_some() {
                samples.add(record, built, engine);
            }
            forces.add(record, step > from);
            judge.add(record, built, engine);
            Ok(())
        })?;
        Ok(Trace {
            verdict: judge.verdict(&totals, &built),
            forces,
            measures: measures(scene, &samples),
            scene: scene.clone(),
            engine,
            history,
            totals,
        })
    }

    /// Whether the engine says that something is wrong with the run: ours by its verdict. Other
    /// engines say nothing by themselves.
    pub fn said(&self) -> bool {
        self.engine == Engine::Moreau && !self.verdict.held
    }

    /// Index of the body `name`; the last body if there is none.
    pub fn body(&self, name: &str) -> usize {
        let found = self.scene.bodies.iter().position(|b| b.name == name);
        found.unwrap_or(self.scene.bodies.len().saturating_sub(1))
    }

    /// Indices of the bodies that impulses move.
    pub fn moving(&self) -> Vec<usize> {
        let bodies = self.scene.bodies.iter().enumerate();
        bodies
            .filter(|(_, b)| b.mass.is_some())
            .map(|(k, _)| k)
            .collect()
    }

    /// Mass \[kg\] of the boxes and discs that impulses move.
    pub fn mass(&self) -> f64 {
        let moving = self.moving().into_iter();
        let masses = moving.filter_map(|k| self.scene.bodies[k].mass_and_inertia());
        masses.map(|(mass, _)| mass).sum()
    }

    /// Pose of body `k` at the start and at the end.
    pub fn ends(&self, k: usize) -> [Pose64; 2] {
        [0, self.history.len() - 1].map(|m| self.history[m].states[k].0)
    }

    /// Largest value of `what` of any body of `of` at any time; NaN if it ever is.
    pub fn most(&self, of: &[usize], what: impl Fn(usize, &(Pose64, Vec3)) -> f64) -> f64 {
        let each = |m: &Moment| of.iter().map(|&k| what(k, &m.states[k])).fold(0.0, larger);
        self.history.iter().map(each).fold(0.0, larger)
    }

    /// Farthest \[m\] that any body that impulses move has been from its start.
    pub fn moved(&self) -> f64 {
        let start = |k: usize| self.history[0].states[k].0.translation;
        self.most(&self.moving(), |k, s| (s.0.translation - start(k)).norm())
    }

    /// Error of the closed form's measure `name`; NaN if it was not measured.
    pub fn error(&self, name: &str) -> f64 {
        let found = self.measures.iter().find(|m| m.name == name);
        found.map_or(f64::NAN, |m| m.error)
    }

    /// For joints that hold two points together: largest gap \[m\] of one joint at any time, and largest
    /// sum of all gaps at one time. Computed from the poses alone, in the same way for every engine.
    pub fn joint_gaps(&self) -> [f64; 2] {
        let joints = self
            .scene
            .joints
            .iter()
            .filter(|j| !j.kind.is_distance() && !j.kind.has_axis());
        let start = |k: usize| {
            let b = &self.scene.bodies[k];
            Pose64::new(Vec2::from(b.position), b.angle)
        };
        let arms: Vec<_> = joints
            .map(|j| {
                [0, 1].map(|side| {
                    let at = Vec2::from(j.at[side]);
                    (
                        j.bodies[side],
                        j.bodies[side].map_or(at, |k| start(k).apply_inverse(at)),
                    )
                })
            })
            .collect();
        let mut worst = [0.0, 0.0];
        for moment in &self.history {
            let gaps = arms.iter().map(|ends| {
                let [a, b] = ends.map(|(k, arm)| k.map_or(arm, |k| moment.states[k].0.apply(arm)));
                (b - a).norm()
            });
            let (widest, sum) = gaps.fold((0.0, 0.0), |(w, s), g| (larger(w, g), s + g));
            worst = [larger(worst[0], widest), larger(worst[1], sum)];
        }
        worst
    }
}

/// The larger of two, NaN if any of them is.
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        a.max(b)
    }
}

fn moment(built: &Built, engine: Engine, time: f64) -> Moment {
    let unknown = (
        Pose64::new(Vec2::repeat(f64::NAN), 0.0),
        Vec3::repeat(f64::NAN),
    );
    let states = (0..built.bodies()).map(|k| engine.state(built, k).unwrap_or(unknown));
    Moment {
        time,
        states: states.collect(),
    }
}
