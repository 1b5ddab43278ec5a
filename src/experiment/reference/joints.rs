//! Pendulums on pins.

use super::{Measure, Samples, down, inertia, mass};
use crate::contact::Vec2;
use crate::scene::Scene;
use nalgebra::{DMatrix, DVector};

/// A chain of pendulums: the first body hangs on a pin from the world, each other body from the one
/// above. Each pin lies on the line through the pin above it and the centre of mass between them.
///
/// - `position`: largest distance of a centre of mass at the end from [`Chain::swing`], relative to
///   the chain's reach;
/// - `energy-drift`: relative to the energy above the hanging state;
/// - `period`, of a single pendulum released at rest: relative to
///   `T = 2π/(p agm(1, cos(θ₀/2)))`, `p² = m c g/(I + m c²)`.
pub(super) fn pendulum(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let Some((chain, start)) = Chain::of(scene) else {
        return Vec::new();
    };
    let end = chain.swing(&start, s.end());
    let exact = chain.places(&end);
    let off = chain.bodies.iter().zip(&exact).map(|(&k, place)| {
        let computed = chain.pivot + *place - s.last()[k].0.translation;
        computed.norm()
    });
    let worst = off.fold(0.0, f64::max);
    let mut out = vec![
        Measure::absolute("position", "1", worst / chain.reach(), 0.0).of_motion(),
        Measure::absolute(
            "energy-drift",
            "1",
            s.energy_drift(chain.energy(&start)),
            0.0,
        ),
    ];
    let one = chain.bodies.len() == 1 && start.rates[0] == 0.0;
    if one && let Some(period) = period(&chain, s) {
        let p2 = chain.gravity * chain.lever[0] / chain.coupling[(0, 0)];
        let exact = std::f64::consts::TAU / (p2.sqrt() * agm(1.0, (0.5 * start.angles[0]).cos()));
        out.push(Measure::relative("period", period, exact));
    }
    out
}

/// Mean time \[s\] between passages through the lowest point in the same direction.
fn period(chain: &Chain, s: &Samples) -> Option<f64> {
    let x = |k: usize| s.states[k][chain.bodies[0]].0.translation.x - chain.pivot.x;
    let passages: Vec<f64> = (0..s.steps())
        .filter(|&k| x(k) < 0.0 && x(k + 1) >= 0.0)
        .map(|k| s.time[k] + s.step_length(k) * x(k) / (x(k) - x(k + 1)))
        .collect();
    let (first, last) = (passages.first()?, passages.last()?);
    (passages.len() > 1).then(|| (last - first) / (passages.len() - 1) as f64)
}

/// Gauss's arithmetic-geometric mean.
fn agm(mut a: f64, mut b: f64) -> f64 {
    // quadratic convergence: 20 steps are more than enough for any angle below 179 degrees
    for _ in 0..20 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

/// A chain of n pendulums in its angles from straight down, `θ_i`:
///
/// ```text
/// Σ_j A_ij (cos(θ_i − θ_j) θ̈_j + sin(θ_i − θ_j) θ̇_j²) + g a_i sin θ_i = 0         (1)
/// A_ii = I_i + m_i c_i² + L_i² M_i,  A_ij = L_i (m_j c_j + L_j M_j) for i < j
/// a_i = m_i c_i + L_i M_i,           M_i = Σ_{k>i} m_k
/// ```
///
/// with the centre of mass at `c_i` and the next pin at `L_i` from its own pin (Lagrange).
struct Chain {
    bodies: Vec<usize>,
    pivot: Vec2,
    gravity: f64,
    centre: Vec<f64>,
    next: Vec<f64>,
    /// `A` [kg m²] and `a` [kg m].
    coupling: DMatrix<f64>,
    lever: Vec<f64>,
}

/// Angles \[rad\] and rates [rad/s].
#[derive(Clone)]
struct Swing {
    angles: DVector<f64>,
    rates: DVector<f64>,
}

impl Chain {
    fn of(scene: &Scene) -> Option<(Chain, Swing)> {
        let n = scene.joints.len();
        let mut bodies = Vec::with_capacity(n);
        for joint in &scene.joints {
            let above = bodies.last().copied();
            bodies.push(joint.bodies.into_iter().find(|b| *b != above)??);
        }
        let pins: Vec<Vec2> = scene.joints.iter().map(|j| Vec2::from(j.at[0])).collect();
        let hang: Vec<Vec2> = (0..n)
            .map(|i| Vec2::from(scene.bodies[bodies[i]].position) - pins[i])
            .collect();
        let centre: Vec<f64> = hang.iter().map(|d| d.norm()).collect();
        let next: Vec<f64> = (0..n)
            .map(|i| pins.get(i + 1).map_or(0.0, |p| (p - pins[i]).norm()))
            .collect();
        let m: Vec<f64> = bodies
            .iter()
            .map(|&k| mass(scene, k))
            .collect::<Option<_>>()?;
        let below: Vec<f64> = (0..n).map(|i| m[i + 1..].iter().sum()).collect();
        let lever: Vec<f64> = (0..n)
            .map(|i| m[i] * centre[i] + next[i] * below[i])
            .collect();
        let mut coupling = DMatrix::zeros(n, n);
        for i in 0..n {
            let own = inertia(scene, bodies[i])? + m[i] * centre[i] * centre[i];
            coupling[(i, i)] = own + next[i] * next[i] * below[i];
            for j in i + 1..n {
                coupling[(i, j)] = next[i] * lever[j];
                coupling[(j, i)] = coupling[(i, j)];
            }
        }
        let start = Swing {
            angles: DVector::from_iterator(n, hang.iter().map(|d| d.x.atan2(-d.y))),
            rates: DVector::from_iterator(n, bodies.iter().map(|&k| scene.bodies[k].spin)),
        };
        let chain = Chain {
            pivot: *pins.first()?,
            gravity: down(scene),
            bodies,
            centre,
            next,
            coupling,
            lever,
        };
        Some((chain, start))
    }

    /// Length \[m\] of the chain from its pivot to the last centre of mass.
    fn reach(&self) -> f64 {
        let n = self.bodies.len();
        self.next[..n - 1].iter().sum::<f64>() + self.centre[n - 1]
    }

    /// Centres of mass from the pivot \[m\].
    fn places(&self, at: &Swing) -> Vec<Vec2> {
        let mut pin = Vec2::zeros();
        let place = |i: usize| {
            let down = Vec2::new(at.angles[i].sin(), -at.angles[i].cos());
            let centre = pin + down * self.centre[i];
            pin += down * self.next[i];
            centre
        };
        (0..self.bodies.len()).map(place).collect()
    }

    /// Energy \[J\] relative to the chain that hangs at rest.
    fn energy(&self, at: &Swing) -> f64 {
        let n = self.bodies.len();
        let mut energy = 0.0;
        for i in 0..n {
            energy += self.gravity * self.lever[i] * (1.0 - at.angles[i].cos());
            for j in 0..n {
                let turn = (at.angles[i] - at.angles[j]).cos();
                energy += 0.5 * self.coupling[(i, j)] * turn * at.rates[i] * at.rates[j];
            }
        }
        energy
    }

    /// `θ̈` of equation (1).
    fn acceleration(&self, at: &Swing) -> DVector<f64> {
        let n = self.bodies.len();
        let turn = |i: usize, j: usize| at.angles[i] - at.angles[j];
        let matrix = DMatrix::from_fn(n, n, |i, j| self.coupling[(i, j)] * turn(i, j).cos());
        let load = DVector::from_fn(n, |i, _| {
            let spin = |j: usize| self.coupling[(i, j)] * turn(i, j).sin() * at.rates[j].powi(2);
            -(0..n).map(spin).sum::<f64>() - self.gravity * self.lever[i] * at.angles[i].sin()
        });
        // the mass matrix of bodies with inertia is positive definite
        matrix
            .cholesky()
            .map_or_else(|| DVector::repeat(n, f64::NAN), |c| c.solve(&load))
    }

    /// The state after `time` \[s\], by the classical Runge-Kutta method with steps of at most
    /// 0.5 ms. Its error is 1e-12 for pendulums of a metre; a test compares it with half the step.
    fn swing(&self, start: &Swing, time: f64) -> Swing {
        self.swing_by(start, time, 5e-4)
    }

    fn swing_by(&self, start: &Swing, time: f64, step: f64) -> Swing {
        let count = (time / step).ceil().max(1.0) as usize;
        let h = time / count as f64;
        let mut at = start.clone();
        for _ in 0..count {
            let ahead = |slope: &Swing, h: f64| Swing {
                angles: &at.angles + &slope.angles * h,
                rates: &at.rates + &slope.rates * h,
            };
            let slope = |at: &Swing| Swing {
                angles: at.rates.clone(),
                rates: self.acceleration(at),
            };
            let k1 = slope(&at);
            let k2 = slope(&ahead(&k1, 0.5 * h));
            let k3 = slope(&ahead(&k2, 0.5 * h));
            let k4 = slope(&ahead(&k3, h));
            at.angles += (k1.angles + (k2.angles + k3.angles) * 2.0 + k4.angles) * (h / 6.0);
            at.rates += (k1.rates + (k2.rates + k3.rates) * 2.0 + k4.rates) * (h / 6.0);
        }
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(name: &str) -> (Chain, Swing) {
        Chain::of(&crate::scene::load(name, &[]).unwrap()).unwrap()
    }

    #[test]
    fn the_equations_of_motion_are_integrated_to_round_off() {
        for name in ["pendulum", "double-pendulum"] {
            let (chain, start) = chain(name);
            let coarse = chain.swing(&start, 5.0);
            let fine = chain.swing_by(&start, 5.0, 2.5e-4);
            let apart = (&coarse.angles - &fine.angles).amax();
            assert!(apart < 1e-11, "{name}: {apart}");
            // the integration does not use the energy, so its drift is an independent check
            let drift = chain.energy(&fine) / chain.energy(&start) - 1.0;
            assert!(drift.abs() < 1e-11, "{name}: {drift}");
        }
    }

    /// After one period the pendulum is back: the integration agrees with the formula of the period.
    #[test]
    fn a_pendulum_is_back_after_its_period() {
        let (chain, start) = chain("pendulum");
        let p2 = chain.gravity * chain.lever[0] / chain.coupling[(0, 0)];
        let period = std::f64::consts::TAU / (p2.sqrt() * agm(1.0, (0.5 * start.angles[0]).cos()));
        let back = chain.swing(&start, period);
        assert!((back.angles[0] - start.angles[0]).abs() < 1e-11);
        assert!(back.rates[0].abs() < 1e-10);
    }
}
