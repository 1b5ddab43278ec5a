//! Contact problems for tests of solvers: towers, pyramids and heaps of any size, built from
//! bodies.
//!
//! ```
//! use moreau2d::contact::{Vec2, examples};
//! use moreau2d::solver::{Direct, ImpulseSolver};
//!
//! // ten boxes of 1 kg, the top one of 100 t
//! let mass = |k| if k == 9 { 1e5 } else { 1.0 };
//! let problem = examples::tower(10, 0.5, mass).problem();
//! let mut impulses = vec![Vec2::zeros(); problem.len()];
//! assert!(Direct::default().solve(&problem, &mut impulses, 1e-9).solved());
//! ```

use super::{BodyOperator, ContactProblem, Delassus, Law, NO_BODY, Rows, Vec2, Vec3};

/// Numbers in [0, 1) from a linear congruential generator: the same on every machine.
#[derive(Debug, Clone)]
pub struct Lcg(pub u64);

impl Lcg {
    /// The next number.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }
}

/// Bodies and contacts of a problem under construction.
#[derive(Debug, Clone, Default)]
pub struct Bodies {
    inverse_mass: Vec<Vec3>,
    centres: Vec<Vec2>,
    /// (v_x, v_y, ω) [m/s, rad/s] of each body at the end of the step without contacts.
    pub velocities: Vec<Vec3>,
    rows: Vec<Rows>,
    friction: Vec<f64>,
}

impl Bodies {
    /// Adds a body of `mass` \[kg\] and `inertia` [kg m²] at `centre` \[m\]; returns its number.
    pub fn add(&mut self, mass: f64, inertia: f64, centre: Vec2, velocity: Vec3) -> u32 {
        self.inverse_mass
            .push(Vec3::new(1.0 / mass, 1.0 / mass, 1.0 / inertia));
        self.centres.push(centre);
        self.velocities.push(velocity);
        self.centres.len() as u32 - 1
    }

    /// Adds a contact of (side 1, side 2) at `point` \[m\] with the unit normal from 1 to 2. A side
    /// is a body's number or [`NO_BODY`].
    pub fn touch(&mut self, bodies: [u32; 2], point: Vec2, normal: Vec2, friction: f64) {
        let tangent = Vec2::new(-normal.y, normal.x);
        let side = |body: u32, sign: f64| {
            if body == NO_BODY {
                return [Vec3::zeros(); 2];
            }
            let arm = point - self.centres[body as usize];
            [normal, tangent].map(|d| sign * Vec3::new(d.x, d.y, arm.perp(&d)))
        };
        self.rows.push(Rows {
            bodies,
            jacobian: [side(bodies[0], -1.0), side(bodies[1], 1.0)],
        });
        self.friction.push(friction);
    }

    /// The contact problem without restitution: `b` is the free velocity.
    pub fn problem(&self) -> ContactProblem {
        ContactProblem {
            free: self
                .rows
                .iter()
                .map(|r| r.velocity(&self.velocities))
                .collect(),
            laws: self
                .friction
                .iter()
                .map(|&friction| Law::Contact {
                    friction,
                    compliance: 0.0,
                })
                .collect(),
            operator: Delassus::Bodies(BodyOperator {
                inverse_mass: self.inverse_mass.clone(),
                rows: self.rows.clone(),
            }),
        }
    }
}

/// One step of gravity at 60 Hz \[m/s\].
const FALL: f64 = 9.81 / 60.0;

/// Unit boxes stacked at rest, one step of gravity at 60 Hz, two contacts per box. `mass(k)` \[kg\]
/// is that of the k-th box from below.
pub fn tower(boxes: usize, friction: f64, mass: impl Fn(usize) -> f64) -> Bodies {
    let mut bodies = Bodies::default();
    for k in 0..boxes {
        let (m, height) = (mass(k), k as f64);
        let centre = Vec2::new(0.0, height + 0.5);
        let upper = bodies.add(m, m / 6.0, centre, Vec3::new(0.0, -FALL, 0.0));
        let lower = if k == 0 { NO_BODY } else { upper - 1 };
        for x in [-0.5, 0.5] {
            bodies.touch([lower, upper], Vec2::new(x, height), Vec2::y(), friction);
        }
    }
    bodies
}

/// A triangle of unit boxes of 1 kg at rest, `base` boxes in the lowest row, each box half over its
/// neighbours below.
pub fn pyramid(base: usize, friction: f64) -> Bodies {
    let mut bodies = Bodies::default();
    let mut below: Vec<u32> = Vec::new();
    for row in 0..base {
        let mut here = Vec::new();
        for k in 0..base - row {
            let x = 1.02 * (k as f64 + 0.5 * row as f64);
            let centre = Vec2::new(x, row as f64 + 0.5);
            let id = bodies.add(1.0, 1.0 / 6.0, centre, Vec3::new(0.0, -FALL, 0.0));
            let y = row as f64;
            let mut foot = |other: u32, x: f64| {
                bodies.touch([other, id], Vec2::new(x, y), Vec2::y(), friction);
            };
            if row == 0 {
                foot(NO_BODY, x - 0.5);
                foot(NO_BODY, x + 0.5);
            } else {
                // the overlap with each neighbour below reaches from the centre line outwards
                for (other, from, to) in [
                    (below[k], x - 0.5, x - 0.01),
                    (below[k + 1], x + 0.01, x + 0.5),
                ] {
                    foot(other, from);
                    foot(other, to);
                }
            }
            here.push(id);
        }
        below = here;
    }
    bodies
}

/// Discs on a jittered triangular lattice in a bin. Each velocity coordinate is random up to
/// `speed` \[m/s, rad/s\], so that most contacts slide.
pub fn heap(columns: usize, rows: usize, friction: f64, speed: f64, seed: u64) -> Bodies {
    let mut random = Lcg(seed);
    let mut bodies = Bodies::default();
    let radius = 0.5;
    let pitch = 3f64.sqrt() * radius;
    for row in 0..rows {
        for column in 0..columns {
            let jitter = Vec2::new(random.next() - 0.5, random.next() - 0.5) * 0.05;
            let x = 2.0 * radius * column as f64 + radius * (row % 2) as f64;
            let mass = 0.5 + random.next();
            let velocity = Vec3::from_fn(|_, _| speed * (2.0 * random.next() - 1.0));
            bodies.add(
                mass,
                0.5 * mass * radius * radius,
                Vec2::new(x, pitch * row as f64 + radius) + jitter,
                velocity - Vec3::new(0.0, FALL, 0.0),
            );
        }
    }
    for a in 0..bodies.centres.len() {
        let centre = bodies.centres[a];
        if centre.y < radius + 0.03 {
            let point = Vec2::new(centre.x, 0.0);
            bodies.touch([NO_BODY, a as u32], point, Vec2::y(), friction);
        }
        for (wall, normal) in [
            (-radius, Vec2::x()),
            (2.0 * radius * columns as f64, -Vec2::x()),
        ] {
            if (centre.x - wall).abs() < radius + 0.03 {
                let point = Vec2::new(wall, centre.y);
                bodies.touch([NO_BODY, a as u32], point, normal, friction);
            }
        }
        for b in a + 1..bodies.centres.len() {
            let between = bodies.centres[b] - centre;
            if between.norm() < 2.0 * radius + 0.03 {
                let point = centre + 0.5 * between;
                let pair = [a as u32, b as u32];
                bodies.touch(pair, point, between.normalize(), friction);
            }
        }
    }
    bodies
}
