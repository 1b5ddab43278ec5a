//! Exact motion of a linear mechanism with contacts, integrated from event to event.

use crate::contact::Vec3;
use crate::models::LinearContact;
use crate::scene::LinearBlock;
use nalgebra::{DMatrix, DVector, Matrix3};

/// Step length between events \[s\]. The motion there is smooth, and an integration of order 4 is
/// exact to round-off for time constants above 1e-3 s.
const STEP: f64 = 1e-5;

/// Largest violation of a contact law, relative to the largest free velocity or acceleration: of new
/// modes (round-off), and of present modes before an event ends them. The second is larger, so that
/// new modes do not end at once.
const TOLERANCE: f64 = 1e-12;
const LEAVE_TOLERANCE: f64 = 1e-10;

/// State of a contact between two events.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Open,
    Stick,
    /// Slides, with this sign of the sliding velocity.
    Slip(f64),
}

/// The mechanism in one mode of each contact.
struct Mechanism {
    inverse: Matrix3<f64>,
    stiffness: Matrix3<f64>,
    load: Vec3,
    contacts: Vec<LinearContact>,
    modes: Vec<Mode>,
}

/// Motion and multipliers of the closed contacts at one position.
struct ClosedContacts {
    /// `q̈`.
    acceleration: Vec3,
    closed: Vec<usize>,
    /// `λ` of the closed contacts, and `w·q̈` without `λ`: normal and tangential values in turn.
    multipliers: DVector<f64>,
    free: DVector<f64>,
}

/// `q` and `q̇`.
type State = [Vec3; 2];

/// Times \[s\] and positions of the exact motion up to `end` \[s\]. `None` after more than 10 000
/// events, or if a contact problem has no solution.
///
/// ```text
/// M q̈ + K q = f + Σ (w_N λ_N + w_T λ_T)                                      (1)
/// closed:  0 ≤ λ_N ⟂ w_N·q̈ ≥ 0,  sticks with |λ_T| ≤ μ λ_N or slides with λ_T = ∓ μ λ_N
/// impact:  M Δq̇ = Σ (w_N P_N + w_T P_T),  γ_N⁺ = −e γ_N⁻ where P_N > 0        (2)
/// ```
///
/// Between events every contact keeps its mode, and (1) is an ordinary differential equation
/// (Runge-Kutta, order 4). Bisection locates the events: a gap closes, `λ_N` or the sliding velocity
/// changes its sign, or `λ_T` reaches the friction cone. After an event the first combination of
/// modes that satisfies (1) or (2) is used.
///
/// This function shares no method and no code with the stepper and its solvers.
///
/// # Source
/// Pfeiffer & Glocker, *Multibody Dynamics with Unilateral Contacts* (1996).
pub(super) fn event_driven(block: &LinearBlock, end: f64) -> Option<Vec<(f64, Vec3)>> {
    let system = block.system();
    let rest = Matrix3::from_fn(|i, j| f64::from(u8::from(i == j && i >= system.coordinates)));
    let contacts = block.contacts();
    let mut mechanism = Mechanism {
        inverse: (system.mass + rest).try_inverse()?,
        stiffness: system.stiffness,
        load: system.load,
        modes: vec![Mode::Open; contacts.len()],
        contacts,
    };
    let mut state = mechanism.after_event(block.start())?;
    let (mut time, mut events) = (0.0, 0);
    let mut path = vec![(time, state[0])];
    while time < end {
        let step = STEP.min(end - time);
        let next = mechanism.smooth(&state, step)?;
        if !mechanism.breaks(&next)? {
            (state, time) = (next, time + step);
        } else {
            let (mut low, mut high) = (0.0, step);
            // to the last bit of the time
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let there = mechanism.smooth(&state, middle)?;
                *(if mechanism.breaks(&there)? {
                    &mut high
                } else {
                    &mut low
                }) = middle;
            }
            let there = mechanism.smooth(&state, high)?;
            state = mechanism.after_event(there)?;
            time += high;
            events += 1;
            if events > 10_000 {
                return None;
            }
        }
        path.push((time, state[0]));
    }
    Some(path)
}

impl Mechanism {
    /// Levers of the contacts in `members`, normal and tangential in turn.
    fn levers(&self, members: &[usize]) -> Vec<Vec3> {
        let levers = |&k: &usize| [self.contacts[k].normal, self.contacts[k].tangent];
        members.iter().flat_map(levers).collect()
    }

    /// `λ` or `P` of the contacts in `members` in these modes, with `ξ = G λ + b`.
    fn multipliers(
        &self,
        members: &[usize],
        modes: &[Mode],
        b: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let levers = self.levers(members);
        let n = levers.len();
        if n == 0 {
            return Some(DVector::zeros(0));
        }
        let mut a = DMatrix::from_fn(n, n, |i, j| levers[i].dot(&(self.inverse * levers[j])));
        let mut right = -b;
        for (i, (&k, mode)) in members.iter().zip(modes).enumerate() {
            let (normal, tangent) = (2 * i, 2 * i + 1);
            // replaces the row ξ = 0 by a prescribed multiplier
            let mut prescribe = |row: usize, on_normal: f64| {
                a.row_mut(row).fill(0.0);
                a[(row, normal)] = on_normal;
                a[(row, row)] = 1.0;
                right[row] = 0.0;
            };
            match mode {
                Mode::Open => {
                    prescribe(tangent, 0.0);
                    prescribe(normal, 1.0);
                }
                Mode::Slip(sign) => prescribe(tangent, sign * self.contacts[k].friction),
                Mode::Stick => {}
            }
        }
        a.lu().solve(&right)
    }

    /// Modes and multipliers of the contacts in `members` that satisfy the contact laws. `sliding` has
    /// the sign of the sliding velocity of each contact, or 0. A contact that slides continues to
    /// slide or opens.
    fn consistent(
        &self,
        members: &[usize],
        sliding: &[f64],
        b: &DVector<f64>,
    ) -> Option<(Vec<Mode>, DVector<f64>)> {
        let choices: Vec<Vec<Mode>> = sliding
            .iter()
            .map(|&s| {
                if s != 0.0 {
                    vec![Mode::Open, Mode::Slip(s)]
                } else {
                    vec![Mode::Open, Mode::Stick, Mode::Slip(1.0), Mode::Slip(-1.0)]
                }
            })
            .collect();
        let levers = self.levers(members);
        let g = DMatrix::from_fn(b.len(), b.len(), |i, j| {
            levers[i].dot(&(self.inverse * levers[j]))
        });
        let slack = TOLERANCE * b.amax();
        let count: usize = choices.iter().map(Vec::len).product();
        (0..count).find_map(|mut number| {
            let modes: Vec<Mode> = choices
                .iter()
                .map(|of| {
                    let mode = of[number % of.len()];
                    number /= of.len();
                    mode
                })
                .collect();
            let p = self.multipliers(members, &modes, b)?;
            let xi = &g * &p + b;
            let good = modes.iter().enumerate().all(|(i, mode)| {
                let (n, t) = (2 * i, 2 * i + 1);
                let bound = self.contacts[members[i]].friction * p[n];
                // multiplied with its own row, a multiplier has the unit of the slack [m/s or m/s²]
                let presses = p[n] * g[(n, n)] >= -slack;
                match mode {
                    Mode::Open => xi[n] >= -slack,
                    Mode::Stick => presses && (p[t].abs() - bound) * g[(t, t)] <= slack,
                    Mode::Slip(s) => presses && (sliding[i] != 0.0 || s * xi[t] >= -slack),
                }
            });
            good.then_some((modes, p))
        })
    }

    /// The closed contacts in the present modes.
    fn closed_contacts(&self, q: &Vec3) -> Option<ClosedContacts> {
        let free_acceleration = self.free_acceleration(q);
        let closed: Vec<usize> = (0..self.modes.len())
            .filter(|&k| self.modes[k] != Mode::Open)
            .collect();
        let modes: Vec<Mode> = closed.iter().map(|&k| self.modes[k]).collect();
        let free = self.along(&closed, &free_acceleration);
        let multipliers = self.multipliers(&closed, &modes, &free)?;
        Some(ClosedContacts {
            acceleration: free_acceleration + self.pushed(&closed, &multipliers),
            closed,
            multipliers,
            free,
        })
    }

    /// `M⁻¹ (f − K q)`.
    fn free_acceleration(&self, q: &Vec3) -> Vec3 {
        self.inverse * (self.load - self.stiffness * q)
    }

    /// `w·x` of every lever of the contacts in `members`.
    fn along(&self, members: &[usize], x: &Vec3) -> DVector<f64> {
        let levers = self.levers(members);
        DVector::from_iterator(levers.len(), levers.iter().map(|w| w.dot(x)))
    }

    /// `M⁻¹ Σ w p`.
    fn pushed(&self, members: &[usize], p: &DVector<f64>) -> Vec3 {
        let levers = self.levers(members);
        let sum: Vec3 = levers.iter().zip(p.iter()).map(|(w, p)| w * *p).sum();
        self.inverse * sum
    }

    /// One Runge-Kutta step of order 4 in the present modes.
    fn smooth(&self, [q, v]: &State, h: f64) -> Option<State> {
        let rate = |q: Vec3, v: Vec3| Some((v, self.closed_contacts(&q)?.acceleration));
        let (a, ka) = rate(*q, *v)?;
        let (b, kb) = rate(q + 0.5 * h * a, v + 0.5 * h * ka)?;
        let (c, kc) = rate(q + 0.5 * h * b, v + 0.5 * h * kb)?;
        let (d, kd) = rate(q + h * c, v + h * kc)?;
        Some([
            q + h / 6.0 * (a + 2.0 * b + 2.0 * c + d),
            v + h / 6.0 * (ka + 2.0 * kb + 2.0 * kc + kd),
        ])
    }

    /// Whether the present modes no longer hold.
    fn breaks(&self, [q, v]: &State) -> Option<bool> {
        let opens = self.modes.iter().zip(&self.contacts).any(|(mode, c)| {
            *mode == Mode::Open && c.gap + c.normal.dot(q) < 0.0 && c.normal.dot(v) < 0.0
        });
        let found = self.closed_contacts(q)?;
        let slack = LEAVE_TOLERANCE * found.free.amax();
        let missed = |by: f64, lever: &Vec3| by * lever.dot(&(self.inverse * lever)) > slack;
        let fails = found.closed.iter().enumerate().any(|(i, &k)| {
            let c = &self.contacts[k];
            let (n, t) = (found.multipliers[2 * i], found.multipliers[2 * i + 1]);
            let tangential = match self.modes[k] {
                Mode::Slip(s) => s * c.tangent.dot(v) < 0.0,
                _ => missed(t.abs() - c.friction * n, &c.tangent),
            };
            missed(-n, &c.normal) || tangential
        });
        Some(opens || fails)
    }

    /// The state after an event: applies an impact if a gap closes, then finds the new modes.
    fn after_event(&mut self, [q, mut v]: State) -> Option<State> {
        // speed [m/s] below which a contact neither closes nor slides: far above round-off
        let rest = 1e-11 * v.amax().max(1e-3);
        let reached = |c: &LinearContact, v: &Vec3| {
            c.gap + c.normal.dot(&q) <= 0.0 && c.normal.dot(v) < -rest
        };
        let touching: Vec<usize> = (0..self.modes.len())
            .filter(|&k| {
                let c = &self.contacts[k];
                let still = c.gap + c.normal.dot(&q) <= 0.0 && c.normal.dot(&v).abs() <= rest;
                self.modes[k] != Mode::Open || reached(c, &v) || still
            })
            .collect();
        if touching.iter().any(|&k| reached(&self.contacts[k], &v)) {
            let mut b = self.along(&touching, &v);
            for (i, &k) in touching.iter().enumerate() {
                b[2 * i] *= 1.0 + self.contacts[k].restitution;
            }
            let free = vec![0.0; touching.len()];
            let (_, p) = self.consistent(&touching, &free, &b)?;
            v += self.pushed(&touching, &p);
        }
        self.modes.fill(Mode::Open);
        let closed: Vec<usize> = touching
            .into_iter()
            .filter(|&k| self.contacts[k].normal.dot(&v).abs() <= rest)
            .collect();
        let sliding: Vec<f64> = closed
            .iter()
            .map(|&k| self.contacts[k].tangent.dot(&v))
            .map(|speed| {
                if speed.abs() <= rest {
                    0.0
                } else {
                    speed.signum()
                }
            })
            .collect();
        let b = self.along(&closed, &self.free_acceleration(&q));
        let (modes, _) = self.consistent(&closed, &sliding, &b)?;
        for (&k, mode) in closed.iter().zip(modes) {
            self.modes[k] = mode;
        }
        Some([q, v])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(text: &str) -> LinearBlock {
        let head = "[scene]\nname = \"t\"\ntitle = \"t\"\n[linear]\n";
        let scene = crate::scene::Scene::parse("t.toml", &format!("{head}{text}"), &[]);
        scene.unwrap().linear.unwrap()
    }

    /// A ball falls 1 m in √(2/g) and with e = 0.5 rises again to a quarter of it.
    #[test]
    fn a_ball_bounces_by_newtons_law() {
        let ball = block(
            "coordinates = [\"y\"]\nmass = [[2]]\nload = [-19.62]\nposition = [1]\n\
             [[linear.contact]]\nname = \"floor\"\ngap = 0\nnormal = [1]\nrestitution = 0.5\n",
        );
        let fall = (2.0f64 / 9.81).sqrt();
        // the apex is half a fall after the impact
        let path = event_driven(&ball, 1.5 * fall).unwrap();
        let (_, q) = path[path.len() - 1];
        assert!((q.x - 0.25).abs() < 1e-12, "{}", q.x);
    }

    /// A sliding load on a spring: friction brakes it, it stops at each turn, and stays when the
    /// spring no longer overcomes friction.
    #[test]
    fn a_load_slides_and_sticks_by_coulombs_law() {
        let load = block(
            "coordinates = [\"x\", \"y\"]\nmass = [[1, 0], [0, 1]]\n\
             stiffness = [[100, 0], [0, 0]]\nload = [0, -10]\nposition = [0.35, 0]\n\
             [[linear.contact]]\nname = \"floor\"\ngap = 0\nnormal = [0, 1]\n\
             tangent = [-1, 0]\nfriction = 0.5\n",
        );
        // half periods of π/10 s about ±0.05 m: 0.35, -0.25, 0.15, -0.05, and there it sticks
        let half = 0.1 * std::f64::consts::PI;
        for (turns, place) in [(1.0, -0.25), (2.0, 0.15), (3.0, -0.05), (5.5, -0.05)] {
            let path = event_driven(&load, turns * half).unwrap();
            let (_, q) = path[path.len() - 1];
            assert!((q.x - place).abs() < 1e-10, "{turns}: {}", q.x);
            assert!(q.y.abs() < 1e-15);
        }
    }
}
