//! Warns if the step is too long for the fastest motion of a scene.

use super::{Body, BodyKind, Mass, Scene, Shape};
use std::f64::consts::{PI, TAU};

/// Number of steps that a period needs to be resolved.
const STEPS: f64 = 20.0;

/// A motion of the scene and its period \[s\].
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    pub what: String,
    pub period: f64,
}

impl Motion {
    /// A warning with the step that would do, if steps of `dt` \[s\] are longer than T/20.
    pub fn warning(&self, dt: f64) -> Option<String> {
        (dt > self.period / STEPS * (1.0 + 1e-9)).then(|| {
            format!(
                "step.dt = {dt} s is too long for {}: its period of {:.3e} s needs {STEPS} steps; \
                 step.dt = {:.2e} would do",
                self.what,
                self.period,
                // rounded down to what is printed
                round_down(self.period / STEPS)
            )
        })
    }
}

impl Scene {
    /// Warnings about motions that are too fast for `step.dt`, with a sufficient step: at most one each
    /// for compliant contacts and spinning bodies, about the fastest of them.
    ///
    /// A motion of period T asks for `Δt ≤ T/20`:
    ///
    /// ```text
    /// compliant contact    T = π √(m_eff/k)          the time of an impact without damping
    /// body that spins      T = 2 π/|ω|               a disc without a joint looks always the same
    /// ```
    ///
    /// with `1/m_eff = Σ (1/m + r²/I)` of the two bodies, r the longest arm along a face. It is an
    /// estimate from the scene as it starts; rigid contacts have no period, and bodies that wear are left
    /// out.
    pub fn step_warnings(&self) -> Vec<String> {
        let fastest = [self.fastest_contact(), self.fastest_spin()];
        let found = fastest.into_iter().flatten();
        found.filter_map(|m| m.warning(self.step.dt)).collect()
    }

    fn fastest_contact(&self) -> Option<Motion> {
        // the two most easily moved bodies of each material: they may touch each other
        let mut light: Vec<Vec<(f64, &Body)>> = vec![Vec::new(); self.materials.len()];
        // the stiffness of a surface that wears is per metre of what is covered, which is not known here
        let worn = |k: &usize| self.wear.iter().any(|wear| wear.body == *k);
        let bodies = self.bodies.iter().enumerate();
        for (_, body) in bodies.filter(|(k, _)| !worn(k)) {
            let one = &mut light[body.material];
            one.push((mobility(body), body));
            one.sort_by(|a, b| b.0.total_cmp(&a.0));
            one.truncate(2);
        }
        let mut fastest: Option<Motion> = None;
        for a in 0..light.len() {
            for b in a..light.len() {
                let stiffness = match (self.materials[a].stiffness, self.materials[b].stiffness) {
                    (Some(k), Some(l)) => k * l / (k + l),
                    (Some(k), None) | (None, Some(k)) => k,
                    (None, None) => continue,
                };
                let other = if a == b {
                    light[a].get(1)
                } else {
                    light[b].first()
                };
                let (Some(&(w1, body)), Some(&(w2, with))) = (light[a].first(), other) else {
                    continue;
                };
                if w1 + w2 == 0.0 {
                    continue;
                }
                let period = PI / ((w1 + w2) * stiffness).sqrt();
                if fastest.as_ref().is_none_or(|f| period < f.period) {
                    let what = format!("the contact of {} with {}", body.name, with.name);
                    fastest = Some(Motion { what, period });
                }
            }
        }
        fastest
    }

    fn fastest_spin(&self) -> Option<Motion> {
        let mut turns: Vec<bool> = self
            .bodies
            .iter()
            .map(|body| !matches!(body.shape, Shape::Disc { .. }))
            .collect();
        for body in self.joints.iter().flat_map(|joint| joint.bodies) {
            body.into_iter().for_each(|k| turns[k] = true);
        }
        let fastest = self.bodies.iter().zip(turns);
        fastest
            .filter(|(body, turns)| *turns && body.spin != 0.0)
            .max_by(|(a, _), (b, _)| a.spin.abs().total_cmp(&b.spin.abs()))
            .map(|(body, _)| Motion {
                what: format!("the spin of {}", body.name),
                period: TAU / body.spin.abs(),
            })
    }
}

/// Largest `1/m + r²/I` of a push on a face [1/kg]; 0 for what no push moves.
fn mobility(body: &Body) -> f64 {
    if body.kind != BodyKind::Dynamic {
        return 0.0;
    }
    let mass = super::build::body_mass(body);
    // r² m/I
    let lever = match (&body.shape, body.mass) {
        (Shape::Disc { .. }, _) => 0.0,
        (
            Shape::Box { width, height },
            Some(Mass::Given {
                inertia: Some(i), ..
            }),
        ) => 0.25 * width.max(*height).powi(2) * mass / i,
        (Shape::Box { width, height }, _) => {
            3.0 * width.max(*height).powi(2) / (width * width + height * height)
        }
        // a slender rod pushed at its end
        _ => 3.0,
    };
    (1.0 + lever) / mass
}

/// To three significant digits, downwards.
fn round_down(x: f64) -> f64 {
    let digit = 10f64.powf(x.log10().floor() - 2.0);
    (x / digit).floor() * digit
}
