//! The study's rotor: levers of the cells, their loads, one load cycle, and its wear.

use super::blocks::{Reading, Shares, Study, Tooth, Update, Wear};
use crate::contact::Vec2;
use crate::dynamics::{MoreauStepper, NormalLaw};
use crate::experiment::{RunError, Totals};
use crate::models::{Rotor, RotorContact, RotorMotor};
use crate::oracles::solver_by_name;
use crate::scene::Scene;
use crate::wear::{self, Archard, LoadSlip, Profile, WearError, WearSettings, WearState};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Standard gravity \[m/s²\], for the weight of the bar.
const GRAVITY: f64 = 9.81;

/// Levers of every node of a profile on the rotor: closing `a` and sliding `b` \[m\], and radius.
///
/// ```text
/// a = (−(l+y) y' − x)/q,   b = ((l+y) − x y')/q,   q = √(1 + y'²)            (1)
/// ```
///
/// the ramp leading. A refitted profile is a quadratic with an exact slope; its cells have the same
/// weight, or their width along the base. Any other profile is a polyline, whose nodes have their
/// width along the surface as weight.
pub(super) struct Levers {
    pub closing: Vec<f64>,
    pub sliding: Vec<f64>,
    radius: Vec<f64>,
    width: Vec<f64>,
}

impl Levers {
    pub fn of(profile: &Profile, l: f64, update: Update) -> Result<Levers, WearError> {
        let nodes = profile.nodes();
        let (normals, width) = match update {
            Update::Normal => (profile.normals(), profile.widths()),
            Update::Quadratic | Update::QuadraticByWidth => {
                let weights = match update {
                    Update::QuadraticByWidth => profile.spans(),
                    _ => vec![1.0; nodes.len()],
                };
                let fit = profile.fit_quadratic(&weights)?;
                let slope = |p: &Vec2| 2.0 * fit[0] * p.x + fit[1];
                let normal = |s: f64| Vec2::new(-s, 1.0) / s.hypot(1.0);
                let normals = nodes.iter().map(|p| normal(slope(p))).collect();
                (normals, weights)
            }
        };
        let mut levers = Levers {
            closing: Vec::new(),
            sliding: Vec::new(),
            radius: Vec::new(),
            width,
        };
        for (p, n) in nodes.iter().zip(&normals) {
            let r = Vec2::new(p.x, l + p.y);
            levers.closing.push(r.y * n.x - r.x * n.y);
            levers.sliding.push(r.dot(n));
            levers.radius.push(r.norm());
        }
        Ok(levers)
    }
}

/// Normal force of every node \[N\] that balances `torque` while the rotor slides:
/// `Σ F_i (max(a_i, 0) + μ b_i) = T`; zeros where no node can resist.
fn balanced_forces(study: &Study, levers: &Levers, torque: f64) -> Vec<f64> {
    let most = levers.radius.iter().copied().fold(0.0, f64::max);
    let resisting =
        |i: usize| levers.closing[i].max(0.0) + study.friction * levers.sliding[i].abs();
    let weights: Vec<f64> = (0..levers.closing.len())
        .map(|i| {
            let share = match study.shares {
                Shares::Winkler => (study.tape_thickness - (most - levers.radius[i])).max(0.0),
                Shares::Equal => f64::from(levers.closing[i] > 0.0),
                Shares::Lever => {
                    1.0 / (levers.closing[i].abs() + study.friction * levers.sliding[i].abs())
                }
            };
            share * levers.width[i]
        })
        .collect();
    let total: f64 = (0..weights.len()).map(|i| weights[i] * resisting(i)).sum();
    if total <= 0.0 {
        return vec![0.0; weights.len()];
    }
    weights.iter().map(|w| torque * w / total).collect()
}

/// The algebra of the torque-balanced reading: `F_i |b_i| ω t` of every node \[N m\] per cycle.
///
/// # Errors
/// [`WearError`] for a profile that no quadratic fits, where `update` asks for one.
pub fn oracle_load_slip(
    study: &Study,
    profile: &Profile,
    update: Update,
    torque: f64,
    speed: f64,
    contact_time: f64,
) -> Result<Vec<f64>, WearError> {
    let levers = Levers::of(profile, study.axis_distance, update)?;
    let forces = balanced_forces(study, &levers, torque);
    Ok(forces
        .iter()
        .zip(&levers.sliding)
        .map(|(f, b)| f * b.abs() * speed * contact_time)
        .collect())
}

/// The rotor of one operating point with its present profile.
pub(super) fn rotor(
    study: &Study,
    profile: &Profile,
    update: Update,
    torque: f64,
    speed: f64,
) -> Result<Rotor, RunError> {
    let levers = Levers::of(profile, study.axis_distance, update)?;
    let angle = study.start_angle_deg.to_radians() + FRAC_PI_2;
    let mut rotor =
        Rotor::new(study.inertia, angle, speed).map_err(crate::dynamics::StepError::from)?;
    rotor.weight_moment = study.mass * GRAVITY * study.lever;
    let forces = balanced_forces(study, &levers, torque);
    for (i, p) in profile.nodes().iter().enumerate() {
        let (a, b) = (levers.closing[i], levers.sliding[i]);
        let (lever, law) = match study.reading {
            Reading::Literal => (Vec2::new(-a, b), NormalLaw::Rigid { restitution: 0.0 }),
            Reading::TorqueBalanced => (
                Vec2::new(-a.max(0.0), b),
                NormalLaw::Load { force: forces[i] },
            ),
        };
        rotor.contacts.push(RotorContact {
            lever,
            gap: 0.0,
            friction: study.friction,
            law,
            position: *p,
        });
    }
    match study.reading {
        Reading::Literal => rotor.torque = torque,
        Reading::TorqueBalanced => {
            rotor.motor = Some(RotorMotor {
                speed,
                max_torque: 2.0 * torque,
            });
        }
    }
    Ok(rotor)
}

/// Results of one simulated load cycle.
#[derive(Default)]
pub(super) struct Cycle {
    pub load_slip: Vec<f64>,
    pub wearing_steps: usize,
    pub speed_after: f64,
}

/// Steps the rotor for `window` \[s\], the last step shortened, and sums `load_slip` per node.
pub(super) fn load_cycle(
    scene: &Scene,
    mut rotor: Rotor,
    window: f64,
    totals: &mut Totals,
) -> Result<Cycle, RunError> {
    let mut stepper = MoreauStepper::with_solvers(scene.step.stepper(), solver_by_name)?;
    let dt = scene.step.dt;
    let mut sums = LoadSlip::new(rotor.contacts.len());
    let (mut wearing_steps, mut speed_after) = (0, f64::NAN);
    let mut most_worn: f64 = 0.0;
    let whole = (window / dt * (1.0 + 1e-12)).floor() as usize;
    let rest = window - whole as f64 * dt;
    for k in 0..=whole {
        let h = if k < whole { dt } else { rest };
        if h <= 1e-9 * dt {
            break;
        }
        let start = std::time::Instant::now();
        let record = stepper.step(&mut rotor, h)?;
        totals.wall += start.elapsed().as_secs_f64();
        totals.add(&record);
        sums.add(&record.contacts, |c| Some(c.places[1]))?;
        let worn: f64 = record.contacts.iter().map(|c| c.load_slip).sum();
        most_worn = most_worn.max(worn);
        // round-off of a rotor at rest is no wear
        wearing_steps += usize::from(worn > 1e-9 * most_worn);
        if speed_after.is_nan() && !record.contacts.is_empty() {
            speed_after = rotor.speed();
        }
    }
    Ok(Cycle {
        load_slip: sums.sums().to_vec(),
        wearing_steps,
        speed_after,
    })
}

/// A new tooth under the study's wear law, worn by `update`: every node has the width that is its
/// weight in it.
pub(super) fn new_tooth(
    tooth: &Tooth,
    wear: &Wear,
    speed: f64,
    update: Update,
) -> Result<WearState, WearError> {
    let law = Archard {
        coefficient: wear.coefficient,
    };
    let update = match update {
        Update::Quadratic => wear::Update::Quadratic,
        Update::QuadraticByWidth => wear::Update::QuadraticByWidth,
        Update::Normal => wear::Update::Normal,
    };
    let settings = WearSettings {
        update,
        ..wear.settings(law, TAU / speed)
    };
    WearState::new(tooth.profile()?, settings)
}

/// Depth of the deepest cell \[m\].
pub(super) fn deepest(state: &WearState) -> f64 {
    state.depth().iter().copied().fold(0.0, f64::max)
}
