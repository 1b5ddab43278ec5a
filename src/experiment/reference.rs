//! Closed forms, and how far a run is from them. Their parameters come from the scene.

mod arcs;
mod event_driven;
mod motion;
mod pivots;
mod rods;
mod woodpecker;

use super::simulate::Engine;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::Pose64;
use crate::dynamics::record::{ContactStatus, StepRecord};
use crate::scene::{Built, ClosedForm, Mass, Scene, Shape};

/// One figure of a run against what it should be.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    pub name: &'static str,
    /// Of `error`: "1" for a relative one.
    pub unit: &'static str,
    pub computed: f64,
    pub exact: f64,
    /// `|computed/exact − 1|`, or `|computed − exact|` where the unit is not "1".
    pub error: f64,
}

impl Measure {
    fn relative(name: &'static str, computed: f64, exact: f64) -> Measure {
        Measure {
            name,
            unit: "1",
            computed,
            exact,
            error: (computed / exact - 1.0).abs(),
        }
    }

    fn absolute(name: &'static str, unit: &'static str, computed: f64, exact: f64) -> Measure {
        Measure {
            name,
            unit,
            computed,
            exact,
            error: (computed - exact).abs(),
        }
    }
}

/// What the closed forms need of a run, step by step.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    /// Time at the end of each step \[s\]; states of all bodies, the start first.
    time: Vec<f64>,
    states: Vec<Vec<(Pose64, Vec3)>>,
    /// Of each step: the sums of |P_T| and P_N, and whether anything sticks or slides.
    tangent: Vec<f64>,
    normal: Vec<f64>,
    sticks: Vec<bool>,
    /// Of each step: P_N by the surface's x position \[m, N s\].
    supports: Vec<Vec<(f64, f64)>>,
}

impl Samples {
    /// Takes in the start.
    pub fn start(built: &Built, engine: Engine) -> Samples {
        let mut samples = Samples::default();
        samples.time.push(0.0);
        samples.states.push(states(built, engine));
        samples
    }

    /// Takes in one step.
    pub fn add(&mut self, record: &StepRecord, built: &Built, engine: Engine) {
        self.time.push(record.time);
        self.states.push(states(built, engine));
        let loaded = record.contacts.iter().filter(|c| c.impulse_n > 0.0);
        self.tangent
            .push(loaded.clone().map(|c| c.impulse_t.abs()).sum());
        self.normal.push(loaded.clone().map(|c| c.impulse_n).sum());
        self.sticks
            .push(loaded.clone().any(|c| c.status == ContactStatus::Stick));
        self.supports
            .push(loaded.map(|c| (c.position.x, c.impulse_n)).collect());
    }

    fn last(&self) -> &[(Pose64, Vec3)] {
        self.states.last().map_or(&[], Vec::as_slice)
    }

    fn step_length(&self, k: usize) -> f64 {
        self.time[k + 1] - self.time[k]
    }

    /// When sliding ends: inside the first step that sticks, after the share `|P_T| / μ P_N` of it.
    fn first_stick(&self, friction: f64) -> Option<f64> {
        let k = self.sticks.iter().position(|s| *s)?;
        let share = self.tangent[k] / (friction * self.normal[k]);
        Some(self.time[k] + self.step_length(k) * share)
    }
}

fn states(built: &Built, engine: Engine) -> Vec<(Pose64, Vec3)> {
    let unknown = (Pose64::new(Vec2::zeros(), 0.0), Vec3::repeat(f64::NAN));
    (0..built.bodies())
        .map(|k| engine.state(built, k).unwrap_or(unknown))
        .collect()
}

/// Errors of a run against the scene's closed form; empty where the scene names none or the run
/// is too short to show it.
///
/// # Source
/// Elementary mechanics; the friction cases as in any text, e.g. Meriam & Kraige, *Dynamics*.
pub fn measures(scene: &Scene, samples: &Samples) -> Vec<Measure> {
    match scene.reference {
        None => Vec::new(),
        Some(ClosedForm::SlidingBlock) => sliding_block(scene, samples),
        Some(ClosedForm::Incline) => incline(scene, samples),
        Some(ClosedForm::BouncingBall) => bouncing_ball(scene, samples),
        Some(ClosedForm::SpinningDisc) => spinning_disc(scene, samples),
        Some(ClosedForm::TwoBalls) => two_balls(scene, samples),
        Some(ClosedForm::Cradle) => cradle(scene, samples),
        Some(ClosedForm::Beam) => beam(scene, samples),
        Some(ClosedForm::Bowl) => arcs::bowl(scene, samples),
        Some(ClosedForm::RidingDisc) => arcs::riding_disc(scene, samples),
        Some(ClosedForm::StuckRod) => rods::stuck_rod(scene, samples),
        Some(ClosedForm::FallingRod) => rods::falling_rod(scene, samples),
        Some(ClosedForm::Painleve) => rods::painleve(scene, samples),
        Some(ClosedForm::Pendulum) => pivots::pendulum(scene, samples),
        Some(ClosedForm::DoublePendulum) => pivots::double_pendulum(scene, samples),
        Some(ClosedForm::Woodpecker) => woodpecker::woodpecker(scene, samples),
    }
}

fn find(scene: &Scene, name: &str) -> Option<usize> {
    scene.bodies.iter().position(|b| b.name == name)
}

/// Mean friction of a body with the floor, rapier's rule.
fn friction(scene: &Scene, a: usize, b: usize) -> f64 {
    let of = |k: usize| scene.materials[scene.bodies[k].material].friction;
    0.5 * (of(a) + of(b))
}

fn restitution(scene: &Scene, a: usize, b: usize) -> f64 {
    let of = |k: usize| scene.materials[scene.bodies[k].material].restitution;
    0.5 * (of(a) + of(b))
}

fn down(scene: &Scene) -> f64 {
    -scene.gravity[1]
}

/// `d = v²/(2 μ g)`, `t = v/(μ g)`.
fn sliding_block(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(block)) = (find(scene, "floor"), find(scene, "block")) else {
        return Vec::new();
    };
    let mu = friction(scene, floor, block);
    let v = scene.bodies[block].velocity[0];
    let g = down(scene);
    let moved = s.last()[block].0.translation.x - scene.bodies[block].position[0];
    let mut out = vec![Measure::relative("distance", moved, v * v / (2.0 * mu * g))];
    if let Some(time) = s.first_stick(mu) {
        out.push(Measure::relative("stop-time", time, v / (mu * g)));
    }
    out
}

/// Slides with `a = g (sin φ − μ cos φ)`, or holds.
fn incline(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(block)) = (find(scene, "floor"), find(scene, "block")) else {
        return Vec::new();
    };
    let mu = friction(scene, floor, block);
    let (along, across) = (scene.gravity[0], down(scene));
    let time = s.time[s.time.len() - 1];
    let (pose, u) = s.last()[block];
    let exact = along - mu * across;
    if exact > 0.0 {
        vec![Measure::relative("acceleration", u.x / time, exact)]
    } else {
        let creep = pose.translation.x - scene.bodies[block].position[0];
        vec![Measure::absolute("creep", "m", creep, 0.0)]
    }
}

/// Apex 3 at `e⁶ h`, rest at `√(2h/g) (1+e)/(1−e)`.
fn bouncing_ball(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(ball)) = (find(scene, "floor"), find(scene, "ball")) else {
        return Vec::new();
    };
    let (Shape::Disc { radius }, Shape::Box { height, .. }) =
        (&scene.bodies[ball].shape, &scene.bodies[floor].shape)
    else {
        return Vec::new();
    };
    let e = restitution(scene, floor, ball);
    let g = down(scene);
    let top = scene.bodies[floor].position[1] + 0.5 * height + radius;
    let h = scene.bodies[ball].position[1] - top;
    let mut out = Vec::new();
    let energy_height =
        |(pose, u): &(Pose64, Vec3)| pose.translation.y - top + u.y * u.y / (2.0 * g);
    let mut bounces = 0;
    for k in 1..s.states.len() {
        let (before, after) = (s.states[k - 1][ball].1.y, s.states[k][ball].1.y);
        bounces += usize::from(before < 0.0 && after > 0.0);
        if bounces == 3 {
            let apex = energy_height(&s.states[k][ball]);
            out.push(Measure::relative("apex-3", apex, e.powi(6) * h));
            break;
        }
    }
    // at rest from the first step after which the ball never has the millionth of its energy
    let moving = s
        .states
        .iter()
        .rposition(|state| energy_height(&state[ball]).abs() > 1e-6 * h);
    if let Some(k) = moving
        && k + 1 < s.time.len()
        && e < 1.0
    {
        let exact = (2.0 * h / g).sqrt() * (1.0 + e) / (1.0 - e);
        out.push(Measure::relative("rest-time", s.time[k + 1], exact));
    }
    out
}

/// Rolls from `t = (v + ω R)/(3 μ g)` with `(2 v − ω R)/3`; place at the end.
fn spinning_disc(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(disc)) = (find(scene, "floor"), find(scene, "disc")) else {
        return Vec::new();
    };
    let Shape::Disc { radius: r } = scene.bodies[disc].shape else {
        return Vec::new();
    };
    let body = &scene.bodies[disc];
    let (mu, g) = (friction(scene, floor, disc), down(scene));
    let (v, w) = (body.velocity[0], body.spin);
    let rolling = (v + w * r) / (3.0 * mu * g);
    let end = s.time[s.time.len() - 1];
    let speed = (2.0 * v - w * r) / 3.0;
    let (pose, u) = s.last()[disc];
    let place =
        body.position[0] + v * rolling - 0.5 * mu * g * rolling * rolling + speed * (end - rolling);
    let mut out = Vec::new();
    if let Some(time) = s.first_stick(mu) {
        out.push(Measure::relative("rolling-time", time, rolling));
    }
    if end > rolling {
        out.push(Measure::relative("rolling-speed", u.x, speed));
        out.push(Measure::relative(
            "distance",
            pose.translation.x - body.position[0],
            place - body.position[0],
        ));
    }
    out
}

fn mass(scene: &Scene, k: usize) -> Option<f64> {
    match (scene.bodies[k].mass?, &scene.bodies[k].shape) {
        (Mass::Given { mass, .. }, _) => Some(mass),
        (Mass::Density(d), Shape::Disc { radius }) => {
            Some(d * std::f64::consts::PI * radius * radius)
        }
        (Mass::Density(d), Shape::Box { width, height }) => Some(d * width * height),
        _ => None,
    }
}

/// `v₁' = (m₁ − e m₂) v/(m₁ + m₂)`, `v₂' = (1 + e) m₁ v/(m₁ + m₂)`.
fn two_balls(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(a), Some(b)) = (find(scene, "striker"), find(scene, "target")) else {
        return Vec::new();
    };
    let (Some(m1), Some(m2)) = (mass(scene, a), mass(scene, b)) else {
        return Vec::new();
    };
    let (v, e) = (scene.bodies[a].velocity[0], restitution(scene, a, b));
    let speed = |k: usize, exact: f64, name| Measure {
        name,
        unit: "1",
        computed: s.last()[k].1.x,
        exact,
        // against the striker's speed: one of the two may come to rest
        error: (s.last()[k].1.x - exact).abs() / v.abs(),
    };
    vec![
        speed(a, (m1 - e * m2) * v / (m1 + m2), "striker-speed"),
        speed(b, (1.0 + e) * m1 * v / (m1 + m2), "target-speed"),
    ]
}

/// The last ball leaves with the striker's speed, the others rest.
fn cradle(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let Some(striker) = find(scene, "striker") else {
        return Vec::new();
    };
    let v = scene.bodies[striker].velocity[0];
    let order = {
        let mut order: Vec<usize> = (0..scene.bodies.len()).collect();
        let x = |k: &usize| scene.bodies[*k].position[0];
        order.sort_by(|a, b| x(a).total_cmp(&x(b)));
        order
    };
    let last = order[order.len() - 1];
    let others = order[..order.len() - 1]
        .iter()
        .map(|&k| s.last()[k].1.x.abs())
        .fold(0.0, f64::max);
    vec![
        Measure::relative("last-speed", s.last()[last].1.x, v),
        Measure {
            name: "others-at-rest",
            unit: "1",
            computed: others,
            exact: 0.0,
            error: others / v.abs(),
        },
    ]
}

/// `N₁ = W b/(a+b)`, `N₂ = W a/(a+b)`, each with half of the beam's own weight; the mean of the
/// last tenth of the run.
fn beam(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let names = ["left", "right", "beam", "load"].map(|n| find(scene, n));
    let [Some(left), Some(right), Some(beam), Some(load)] = names else {
        return Vec::new();
    };
    let (Some(own), Some(weight)) = (mass(scene, beam), mass(scene, load)) else {
        return Vec::new();
    };
    let g = down(scene);
    let x = |k: usize| scene.bodies[k].position[0];
    let (a, b) = (x(load) - x(left), x(right) - x(load));
    let from = s.supports.len() * 9 / 10;
    let span: f64 = (from..s.supports.len()).map(|k| s.step_length(k)).sum();
    let force = |post: usize| {
        let near = |place: f64| (place - x(post)).abs() < 0.1 * (a + b);
        s.supports[from..]
            .iter()
            .flatten()
            .filter(|(place, _)| near(*place))
            .map(|(_, impulse)| impulse)
            .sum::<f64>()
            / span
    };
    let half = 0.5 * own * g;
    vec![
        Measure::relative("left-force", force(left), half + weight * g * b / (a + b)),
        Measure::relative("right-force", force(right), half + weight * g * a / (a + b)),
    ]
}
