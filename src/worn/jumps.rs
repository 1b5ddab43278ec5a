//! Jumps: wear over a long time by the rates of the measured steps, as far as they hold.

use super::WornError;
use super::colliders::{Part, WornColliders};
use super::face::Face;
use crate::rapier::engine::prelude::{ColliderHandle, PhysicsWorld};
use crate::rapier::{MoreauPipeline, SurfaceLaw};
use crate::wear::{Jump, JumpBound, JumpRule, LoadSlip, WearError};

/// How far a body that comes down on its new surface sinks in at most, over what it does at rest: 1.15 is
/// seen with the damping that yielding surfaces get. A larger number ends a life of a thin body earlier.
const LANDING: f64 = 1.5;

/// What [`WornColliders::jump`] did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jumped {
    /// How many seconds of wear it added; 0 if it only planned, for surfaces that must yield.
    pub seconds: f64,
    /// What bounded it.
    pub bound: JumpBound,
    /// `K k S` of the jump, measured; infinite for rigid contacts, below 1 for surfaces that yield.
    pub feedback: f64,
    /// Whether surfaces yield by wear compliance in the next steps.
    pub compliance: bool,
    /// Share of the load of yielding contacts that was measured where they are open. A cell that
    /// slopes by α meets a body that moves by it at v with `v sin α`: much more than 0 says that this
    /// is far in a step, against the depth of a jump.
    pub open_load: f64,
}

impl WornColliders {
    /// Wears all surfaces for as long as their rates hold, and gives the colliders their new shapes.
    ///
    /// The depth of the rule or the mesh bounds the jump. If its feedback `K k S` is above the rule's
    /// stability, nothing wears yet: the surfaces yield by wear compliance from now on, and the next jump
    /// wears by what is measured then.
    ///
    /// # Arguments
    /// - `until`: wear to reach at most \[s\], see [`WornColliders::seconds`], which then is `until`.
    ///
    /// # Errors
    /// [`WornError::Unmeasured`], [`WornError::Sleeps`], [`WornError::Past`],
    /// [`WornError::WornThrough`], [`WornError::Model`] and [`WornError::Wear`]. All leave everything as
    /// before the jump.
    pub fn jump(
        &mut self,
        world: &mut PhysicsWorld,
        pipeline: &mut MoreauPipeline,
        until: f64,
    ) -> Result<Jumped, WornError> {
        if !pipeline.is_awake() {
            return Err(WornError::Sleeps);
        }
        let worn = self.seconds;
        let most = until - worn;
        if !(most > 0.0 && most.is_finite()) {
            return Err(WornError::Past { until, worn });
        }
        if let Some(why) = &self.through {
            return Err(why.clone());
        }
        let rates = self.rates()?;
        let planned = self.planned;
        let rule = JumpRule {
            cycles: planned.unwrap_or(self.rule.cycles).min(most),
            // a planned jump has the depth of the rule, but for what changed since
            depth: self.rule.depth * if planned.is_some() { 2.0 } else { 1.0 },
            ..self.rule
        };
        let jump = self.longest(&rule, &rates)?;
        let feedback = self.feedback(&rates)? * jump.cycles;
        // NaN if an infinite feedback meets a coefficient of 0
        let stable = feedback <= rule.stability || feedback.is_nan();
        let wears = planned.is_some() || stable;
        let seconds = if wears { jump.cycles } else { 0.0 };
        let compliance = planned.is_some() || !stable;
        let yielding = match compliance {
            true => Some(self.plan(world, pipeline, &rates, most - seconds)?),
            false => None,
        };
        let next = yielding.as_ref().map(|(next, _)| *next);
        let through = self.thin(&rates, seconds, next)?;
        if wears {
            self.wear(world, pipeline, &rates, seconds)?;
            if seconds == most {
                self.seconds = until;
            }
        }
        if let Some((_, laws)) = yielding {
            for (collider, law) in laws {
                pipeline.set_surface(collider, law);
            }
        }
        (self.planned, self.through) = (next, through);
        let [open, all] = self.yielded;
        self.clear();
        Ok(Jumped {
            seconds,
            bound: jump.bound,
            feedback,
            compliance,
            open_load: if all > 0.0 { open / all } else { 0.0 },
        })
    }

    /// Supplies the rates at the end of the last jump, for the error of that jump, and gives the surfaces
    /// their laws without wear compliance; nothing wears.
    ///
    /// # Errors
    /// [`WornError::Unmeasured`], [`WornError::Wear`].
    pub fn close(&mut self, pipeline: &mut MoreauPipeline) -> Result<(), WornError> {
        let rates = self.rates()?;
        for (surface, (part, load)) in self.parts.iter_mut().zip(&rates).enumerate() {
            let closed = part.state.close(load.sums());
            closed.map_err(|source| WornError::Wear { surface, source })?;
        }
        for part in &self.parts {
            let law = SurfaceLaw {
                cells: true,
                ..part.law
            };
            pipeline.set_surface(part.collider, law);
        }
        self.planned = None;
        self.clear();
        Ok(())
    }

    /// Load and slip of one second.
    fn rates(&self) -> Result<Vec<LoadSlip>, WornError> {
        if self.measured <= 0.0 {
            return Err(WornError::Unmeasured);
        }
        let of = |(surface, part): (usize, &Part)| {
            let mut rate = part.state.no_load();
            let added = rate.add_share(&part.load, 1.0 / self.measured);
            added.map_err(|source| WornError::Wear { surface, source })?;
            Ok(rate)
        };
        self.parts.iter().enumerate().map(of).collect()
    }

    /// `K k s` of one second: of two surfaces that wear each other the sum.
    fn feedback(&self, rates: &[LoadSlip]) -> Result<f64, WornError> {
        let mut each = Vec::with_capacity(rates.len());
        for (surface, (part, load)) in self.parts.iter().zip(rates).enumerate() {
            let found = part.state.feedback(load.stiffness());
            each.push(found.map_err(|source| WornError::Wear { surface, source })?);
        }
        let pairs = self.pairs.iter().map(|[a, b]| each[*a] + each[*b]);
        Ok(each.iter().copied().chain(pairs).fold(0.0, f64::max))
    }

    /// Wears all surfaces, or on an error none.
    fn wear(
        &mut self,
        world: &mut PhysicsWorld,
        pipeline: &mut MoreauPipeline,
        rates: &[LoadSlip],
        seconds: f64,
    ) -> Result<(), WornError> {
        let mut worn = Vec::with_capacity(self.parts.len());
        let mut gone = Vec::new();
        for (surface, (part, load)) in self.parts.iter().zip(rates).enumerate() {
            let after = self.seconds + seconds;
            let failed = |source| match source {
                WearError::Crossing { .. } | WearError::Winding { .. } => WornError::WornThrough {
                    surface,
                    seconds: after,
                    source,
                },
                source => WornError::Wear { surface, source },
            };
            let step = part.state.plan(load.sums(), seconds, 0.0);
            let step = step.map_err(failed)?;
            let outline = part.face.outline(step.profile());
            Face::check(&outline, part.hollow).map_err(failed)?;
            if let Some(density) = part.density {
                let piece = (part.face).piece(part.state.profile(), step.profile(), density);
                gone.push((part.collider, piece));
            }
            // a collider that is gone has no outline to change
            pipeline.outline(world, part.collider, None)?;
            worn.push((step, outline));
        }
        pipeline.take_material(world, &gone)?;
        for (part, (step, outline)) in self.parts.iter_mut().zip(worn) {
            part.state.take(step);
            pipeline.set_outline(world, part.collider, &outline)?;
        }
        self.seconds += seconds;
        Ok(())
    }

    /// Why nothing can be measured after a jump of so many seconds, if surfaces then yield by what they
    /// wear in `next` seconds, or by their own compliance: one is left thinner than it sinks in.
    fn thin(
        &self,
        rates: &[LoadSlip],
        seconds: f64,
        next: Option<f64>,
    ) -> Result<Option<WornError>, WornError> {
        for (surface, (part, load)) in self.parts.iter().zip(rates).enumerate() {
            let wear = |source| WornError::Wear { surface, source };
            let depths = part.state.rates(load.sums()).map_err(wear)?;
            let yields = depths.iter().map(|rate| rate * next.unwrap_or(0.0));
            // elastic: S = Σ k δ |s| and A = Σ k |s|
            let elastic = load.sums().iter().zip(load.stiffness());
            let elastic = elastic.map(|(s, a)| if *a > 0.0 { s / a } else { 0.0 });
            let sinks: Vec<f64> = yields.zip(elastic).map(|(a, b)| a.max(b)).collect();
            let loaded = |node: usize| sinks[node] > 0.0;
            for (node, thick) in part.face.thickness(part.state.profile(), loaded) {
                let left = thick - seconds * depths[node];
                if left <= LANDING * sinks[node] {
                    return Ok(Some(WornError::WornThrough {
                        surface,
                        seconds: self.seconds + seconds,
                        source: WearError::Thin {
                            node,
                            left,
                            sinks: sinks[node],
                        },
                    }));
                }
            }
        }
        Ok(None)
    }

    /// The longest jump that the depth of a rule and the meshes allow, whatever its feedback.
    fn longest(&self, rule: &JumpRule, rates: &[LoadSlip]) -> Result<Jump, WornError> {
        let mut longest = Jump {
            cycles: rule.cycles,
            bound: JumpBound::Requested,
        };
        for (surface, (part, load)) in self.parts.iter().zip(rates).enumerate() {
            let jump = part.state.next_jump(rule, load.sums(), 0.0);
            let jump = jump.map_err(|source| WornError::Wear { surface, source })?;
            if jump.cycles < longest.cycles {
                longest = jump;
            }
        }
        Ok(longest)
    }

    /// The next jump of `left` seconds at most, 0 for as long as the rule says, and the laws with which
    /// the surfaces yield by what it will wear.
    ///
    /// A body of mass m that lies on a surface which yields by the depth h of a jump under its load F
    /// would swing with `ω² = F/(m h)` after each jump; a damping of `2 k/ω` stops it at once.
    fn plan(
        &self,
        world: &PhysicsWorld,
        pipeline: &MoreauPipeline,
        rates: &[LoadSlip],
        left: f64,
    ) -> Result<(f64, Vec<(ColliderHandle, SurfaceLaw)>), WornError> {
        let most = if left > 0.0 { left } else { f64::INFINITY };
        let rule = JumpRule {
            cycles: self.rule.cycles.min(most),
            ..self.rule
        };
        let seconds = self.longest(&rule, rates)?.cycles;
        let mut laws = Vec::with_capacity(self.parts.len());
        for (surface, part) in self.parts.iter().enumerate() {
            let (speed, law) = (part.sliding(self.measured), part.state.law());
            // what does not slide does not wear, and what has no coefficient neither
            if speed <= 0.0 || law.coefficient == 0.0 {
                continue;
            }
            let (modulus, damping) = part.law.compliance.unwrap_or((f64::INFINITY, 0.0));
            let yielding = law.worn_modulus(modulus, speed * seconds);
            let yielding = yielding.map_err(|source| WornError::Wear { surface, source })?;
            let mass = pipeline.least_mass(world, |slot| part.met.contains(&slot));
            let inverse = mass.unwrap_or(0.0) * self.rule.depth * self.measured / part.pressed;
            let critical = 2.0 * yielding * inverse.sqrt();
            let law = SurfaceLaw {
                compliance: Some((yielding, damping.max(critical))),
                cells: true,
                ..part.law
            };
            laws.push((part.collider, law));
        }
        Ok((seconds, laws))
    }
}
