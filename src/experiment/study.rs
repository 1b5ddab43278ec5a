//! The published study, rebuilt: one rotor, 26 cells, a wear law.

use super::simulate::{RunError, Totals};
use super::stall::{Stall, exponent, single_cells};
use super::wear_chart::WornCycle;
use super::wear_history::WearHistory;
use crate::contact::Vec2;
use crate::dynamics::{MoreauStepper, NormalLaw, Rotor, RotorContact, RotorMotor};
use crate::report::{ComparisonRow, Progress};
use crate::scene::{Reading, Scene, Shares, Study, Tooth, Update, Wear};
use crate::wear::{Archard, CellArea, LoadSlip, Profile, WearError, WearState};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Standard gravity \[m/s²\], for the weight of the bar.
const GRAVITY: f64 = 9.81;

/// One published depth after 4e6 cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishedPoint {
    /// \[N m\], \[rad/s\], \[m\].
    pub torque: f64,
    pub speed: f64,
    pub depth: f64,
}

/// The twelve published depths: Ibrahim, Shash & Abboud (2025), doi 10.30493/das.2024.485466.
pub const PUBLISHED: [PublishedPoint; 12] = {
    const fn p(torque: f64, speed: f64, depth: f64) -> PublishedPoint {
        PublishedPoint {
            torque,
            speed,
            depth,
        }
    }
    [
        p(146.39, 70.0, 7.62e-3),
        p(146.39, 80.0, 8.28e-3),
        p(146.39, 90.0, 9.02e-3),
        p(146.39, 100.0, 9.94e-3),
        p(146.39, 110.0, 13.40e-3),
        p(146.39, 120.0, 17.07e-3),
        p(20.87, 70.0, 1.13e-3),
        p(20.87, 80.0, 1.41e-3),
        p(20.87, 90.0, 1.64e-3),
        p(20.87, 100.0, 2.05e-3),
        p(20.87, 110.0, 2.50e-3),
        p(20.87, 120.0, 2.67e-3),
    ]
};

/// What a run of the study found.
#[derive(Debug, Clone)]
pub struct StudyOutcome {
    /// Published beside computed, in the order of torques and speeds.
    pub comparison: Vec<ComparisonRow>,
    /// Contact time of one cycle \[s\]; calibrated in the torque-balanced reading.
    pub contact_time: f64,
    pub calibrated: bool,
    /// Largest relative difference of a depth between the stepper and the algebra; `None` where
    /// the reading has no algebra.
    pub oracle_difference: Option<f64>,
    /// The operating point whose life is followed.
    pub torque: f64,
    pub speed: f64,
    pub history: WearHistory,
    pub totals: Totals,
    pub stall: Option<Stall>,
}

/// Levers of every node of a profile on the rotor: closing `a` and sliding `b` \[m\], and radius.
///
/// ```text
/// a = (−(l+y) y' − x)/q,   b = ((l+y) − x y')/q,   q = √(1 + y'²)            (1)
/// ```
///
/// the ramp leading. A refitted profile is a quadratic, whose slope is exact.
pub(super) struct Levers {
    pub closing: Vec<f64>,
    pub sliding: Vec<f64>,
    radius: Vec<f64>,
}

impl Levers {
    pub fn of(profile: &Profile, l: f64, quadratic: bool) -> Result<Levers, WearError> {
        let fit = profile.fit_quadratic()?;
        let normals = profile.normals();
        let mut levers = Levers {
            closing: Vec::new(),
            sliding: Vec::new(),
            radius: Vec::new(),
        };
        for (p, n) in profile.nodes().iter().zip(&normals) {
            let n = if quadratic {
                let slope = 2.0 * fit[0] * p.x + fit[1];
                Vec2::new(-slope, 1.0) / slope.hypot(1.0)
            } else {
                *n
            };
            let r = Vec2::new(p.x, l + p.y);
            levers.closing.push(r.y * n.x - r.x * n.y);
            levers.sliding.push(r.dot(&n));
            levers.radius.push(r.norm());
        }
        Ok(levers)
    }
}

/// Normal force of every cell \[N\] that balances `torque` while the rotor slides:
/// `Σ F_i (max(a_i, 0) + μ b_i) = T`.
fn balanced_forces(study: &Study, levers: &Levers, torque: f64) -> Vec<f64> {
    let most = levers.radius.iter().copied().fold(0.0, f64::max);
    let resisting =
        |i: usize| levers.closing[i].max(0.0) + study.friction * levers.sliding[i].abs();
    let weights: Vec<f64> = (0..levers.closing.len())
        .map(|i| match study.shares {
            Shares::Winkler => (study.tape_thickness - (most - levers.radius[i])).max(0.0),
            Shares::Equal => f64::from(levers.closing[i] > 0.0),
            Shares::Lever => {
                1.0 / (levers.closing[i].abs() + study.friction * levers.sliding[i].abs())
            }
        })
        .collect();
    let total: f64 = (0..weights.len()).map(|i| weights[i] * resisting(i)).sum();
    weights.iter().map(|w| torque * w / total).collect()
}

/// The algebra of the torque-balanced reading: `F_i |b_i| ω t` of every node \[N m\] per cycle.
///
/// # Errors
/// [`WearError`] for a profile that no quadratic fits.
pub fn oracle_load_slip(
    study: &Study,
    profile: &Profile,
    quadratic: bool,
    torque: f64,
    speed: f64,
    contact_time: f64,
) -> Result<Vec<f64>, WearError> {
    let levers = Levers::of(profile, study.axis_distance, quadratic)?;
    let forces = balanced_forces(study, &levers, torque);
    Ok(forces
        .iter()
        .zip(&levers.sliding)
        .map(|(f, b)| f * b.abs() * speed * contact_time)
        .collect())
}

/// One operating point's rotor for the profile it has now.
fn rotor(
    study: &Study,
    profile: &Profile,
    quadratic: bool,
    torque: f64,
    speed: f64,
) -> Result<Rotor, RunError> {
    let levers = Levers::of(profile, study.axis_distance, quadratic)?;
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

/// What one simulated load cycle gave.
struct Cycle {
    load_slip: Vec<f64>,
    wearing_steps: usize,
    speed_after: f64,
}

/// Steps the rotor for `window` \[s\], the last step shortened, and sums `load_slip` a node.
fn load_cycle(
    scene: &Scene,
    mut rotor: Rotor,
    window: f64,
    totals: &mut Totals,
) -> Result<Cycle, RunError> {
    let mut stepper = MoreauStepper::new(scene.step.stepper())?;
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
        sums.add(&record.contacts, |c| Some(c.cell as usize))?;
        let worn: f64 = record.contacts.iter().map(|c| c.load_slip).sum();
        most_worn = most_worn.max(worn);
        // round-off of a rotor that stands still is no wear
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

/// Wear of a new tooth in one load cycle at the calibration point, and the algebra's.
///
/// # Errors
/// [`RunError`].
pub(super) fn study_cycle(scene: &Scene) -> Result<WornCycle, RunError> {
    let (study, tooth, wear) = blocks(scene)?;
    let quadratic = wear.update == Update::Quadratic;
    let (torque, speed) = (study.calibrate.torque, study.calibrate.speed);
    let worn = |load_slip: &[f64]| -> Result<Vec<f64>, RunError> {
        let mut state = new_tooth(tooth, wear, speed)?;
        advance(&mut state, load_slip, 1.0)?;
        Ok(state.depth().to_vec())
    };
    let state = new_tooth(tooth, wear, speed)?;
    let balanced = study.reading == Reading::TorqueBalanced;
    let window = match balanced {
        true => calibrate(study, tooth, wear, quadratic)?,
        false => scene.step.time,
    };
    let mut totals = Totals::default();
    let rotor = rotor(study, state.profile(), quadratic, torque, speed)?;
    let cycle = load_cycle(scene, rotor, window, &mut totals)?;
    let exact = match balanced {
        true => {
            let profile = state.profile();
            let exact = oracle_load_slip(study, profile, quadratic, torque, speed, window)?;
            Some(worn(&exact)?)
        }
        false => None,
    };
    Ok(WornCycle {
        depth: worn(&cycle.load_slip)?,
        exact,
        totals,
    })
}

/// A new tooth under the study's wear law.
fn new_tooth(tooth: &Tooth, wear: &Wear, speed: f64) -> Result<WearState, WearError> {
    // only the quotient K/dΩ acts on the depth
    let law = Archard {
        coefficient: wear.coefficient_over_area,
        area: CellArea::Fixed(1.0),
    };
    WearState::new(tooth.profile()?, wear.settings(law, TAU / speed))
}

fn blocks(scene: &Scene) -> Result<(&Study, &Tooth, &Wear), RunError> {
    match (&scene.study, &scene.tooth, &scene.wear) {
        (Some(study), Some(tooth), Some(wear)) => Ok((study, tooth, wear)),
        _ => Err(RunError::Unfit(format!(
            "scene {}: has no [study] block",
            scene.name
        ))),
    }
}

/// Runs the study's reading over all its torques and speeds.
///
/// In the torque-balanced reading the contact time of a cycle is one constant, fitted to one
/// published depth with the algebra and then used by the stepper everywhere.
///
/// # Errors
/// [`RunError`].
pub fn run_study(scene: &Scene, progress: &Progress) -> Result<StudyOutcome, RunError> {
    let (study, tooth, wear) = blocks(scene)?;
    let quadratic = wear.update == Update::Quadratic;
    let calibrated = study.reading == Reading::TorqueBalanced;
    let contact_time = if calibrated {
        calibrate(study, tooth, wear, quadratic)?
    } else {
        scene.step.time
    };
    let cycles = study.cycles / f64::from(study.batches);
    let mut totals = Totals::default();
    let mut comparison = Vec::new();
    let mut oracle_difference: f64 = 0.0;
    let (mut wearing_steps, mut speed_after) = (0, 0.0f64);
    let mut per_cycle = Vec::new();
    for &torque in &study.torques {
        for &speed in &study.speeds {
            let mut state = new_tooth(tooth, wear, speed)?;
            let mut algebra = new_tooth(tooth, wear, speed)?;
            for batch in 0..study.batches {
                let rotor = rotor(study, state.profile(), quadratic, torque, speed)?;
                let cycle = load_cycle(scene, rotor, contact_time, &mut totals)?;
                if batch == 0 {
                    per_cycle.push((torque, speed, cycle.load_slip.iter().sum::<f64>()));
                    wearing_steps = wearing_steps.max(cycle.wearing_steps);
                    speed_after = speed_after.max(cycle.speed_after.abs());
                }
                advance(&mut state, &cycle.load_slip, cycles)?;
                if calibrated {
                    let exact = oracle_load_slip(
                        study,
                        algebra.profile(),
                        quadratic,
                        torque,
                        speed,
                        contact_time,
                    )?;
                    advance(&mut algebra, &exact, cycles)?;
                }
            }
            if calibrated {
                for (ours, exact) in state.depth().iter().zip(algebra.depth()) {
                    let scale = deepest(&algebra);
                    oracle_difference = oracle_difference.max((ours - exact).abs() / scale);
                }
            }
            comparison.push(compare_point(
                study,
                torque,
                speed,
                deepest(&state),
                calibrated,
            ));
            progress.advance();
        }
    }
    let history = follow_life(
        scene,
        study,
        tooth,
        wear,
        quadratic,
        contact_time,
        &mut totals,
    )?;
    let (torque, speed) = (study.calibrate.torque, study.calibrate.speed);
    let stall = match study.reading {
        Reading::TorqueBalanced => None,
        Reading::Literal => Some(Stall {
            wearing_steps,
            speed_after,
            torque_exponent: exponent(&per_cycle, |p| p.0, |p| p.1),
            speed_exponent: exponent(&per_cycle, |p| p.1, |p| p.0),
            single_cell: single_cells(study, tooth, torque, speed, scene.step.dt)?,
        }),
    };
    Ok(StudyOutcome {
        comparison,
        contact_time,
        calibrated,
        oracle_difference: calibrated.then_some(oracle_difference),
        torque,
        speed,
        history,
        totals,
        stall,
    })
}

/// One batch of cycles; says what to do where it is too long for the profile.
fn advance(state: &mut WearState, load_slip: &[f64], cycles: f64) -> Result<(), RunError> {
    match state.advance(load_slip, cycles, 0.0) {
        Ok(_) => Ok(()),
        Err(error @ WearError::JumpTooLong { .. }) => Err(RunError::Unfit(format!(
            "{error}: take more study.batches, or wear.update = \"quadratic\""
        ))),
        Err(error) => Err(error.into()),
    }
}

fn deepest(state: &WearState) -> f64 {
    state.depth().iter().copied().fold(0.0, f64::max)
}

fn compare_point(
    study: &Study,
    torque: f64,
    speed: f64,
    depth: f64,
    calibrated: bool,
) -> ComparisonRow {
    let published = PUBLISHED
        .iter()
        .find(|p| p.torque == torque && p.speed == speed && study.cycles == 4e6)
        .map_or(f64::NAN, |p| p.depth);
    ComparisonRow {
        torque_nm: torque,
        omega_rad_s: speed,
        published_um: published * 1e6,
        computed_um: depth * 1e6,
        relative_error: depth / published - 1.0,
        calibrated: calibrated
            && torque == study.calibrate.torque
            && speed == study.calibrate.speed,
    }
}

/// The contact time with which the algebra reaches the calibration depth, to 1e-13.
fn calibrate(study: &Study, tooth: &Tooth, wear: &Wear, quadratic: bool) -> Result<f64, RunError> {
    let target = &study.calibrate;
    let batches = f64::from(study.batches);
    let depth = |time: f64| -> Result<f64, RunError> {
        let mut state = new_tooth(tooth, wear, target.speed)?;
        for _ in 0..study.batches {
            let rates = oracle_load_slip(
                study,
                state.profile(),
                quadratic,
                target.torque,
                target.speed,
                time,
            )?;
            advance(&mut state, &rates, target.cycles / batches)?;
        }
        Ok(deepest(&state))
    };
    // nearly linear through the origin: regula falsi from a depth of a hundredth of the target
    let probe = 1e-6;
    let first = depth(probe)?;
    if first <= 0.0 || !first.is_finite() {
        return Err(RunError::Unfit(
            "study.calibrate: no contact time reaches the depth; nothing wears at this point"
                .to_owned(),
        ));
    }
    let mut time = probe * target.depth / first;
    for _ in 0..60 {
        let reached = depth(time)?;
        if (reached / target.depth - 1.0).abs() < 1e-14 {
            break;
        }
        time *= target.depth / reached;
    }
    Ok(time)
}

/// Wears the tooth at the calibration point until the last limit or the longest time is reached.
fn follow_life(
    scene: &Scene,
    study: &Study,
    tooth: &Tooth,
    wear: &Wear,
    quadratic: bool,
    contact_time: f64,
    totals: &mut Totals,
) -> Result<WearHistory, RunError> {
    let (torque, speed) = (study.calibrate.torque, study.calibrate.speed);
    let mut state = new_tooth(tooth, wear, speed)?;
    let mut history = WearHistory::default();
    history.add_profile(1, &state);
    let cycles = study.cycles / f64::from(study.batches);
    let lowest = wear
        .limits
        .iter()
        .map(|l| l.height)
        .fold(f64::INFINITY, f64::min);
    while state.life().last().hours < wear.max_hours {
        let now = state.life().last();
        let done = now.cycles >= study.cycles * (1.0 - 1e-9);
        if done && (now.height <= lowest || lowest == f64::INFINITY) {
            break;
        }
        let rotor = rotor(study, state.profile(), quadratic, torque, speed)?;
        let cycle = load_cycle(scene, rotor, contact_time, totals)?;
        if cycle.load_slip.iter().all(|s| *s == 0.0) {
            break;
        }
        advance(&mut state, &cycle.load_slip, cycles)?;
        history.add_profile(1, &state);
    }
    history.close(1, &state, &wear.limits)?;
    Ok(history)
}
