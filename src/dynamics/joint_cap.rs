//! Joints that give no energy, however far bodies turn in a step.

use super::cap::{is_rigid, largest_share};
use super::contact_cache::JointEnergy;
use super::island::hopeless;
use super::outcome::kinetic_of;
use super::stage::{Source, Stage};
use crate::contact::{ContactProblem, NO_BODY, Vec2, Vec3};
use crate::solver::{ImpulseSolver, SolveReport};

/// Share of the energy of an island that its joints may have put in.
const SHARE: f64 = 0.01;

/// Share of the account, and of the energy it is held against, that is forgotten in a step.
const FORGOTTEN: f64 = 1.0 / 256.0;

/// What became of an island's joints.
pub(super) struct JointCap {
    pub report: SolveReport,
    /// Whether gaps were closed by less than asked: what the blocks ask for is in the problem then.
    pub capped: bool,
    /// Blocks of pins and locked axes, each with its new account.
    pub accounts: Vec<(u32, JointEnergy)>,
    /// Their joints, where gaps were closed by less than asked.
    pub loose: Vec<usize>,
}

/// Bounds the energy that pins and locked axes add,
///
/// ```text
/// W(P) = Σ Pᵀ (γ_A + γ_E)/2,   A + W ≤ X = 0.01 max (T + T_h)                      (1)
/// ```
///
/// with the account `A` of what they added before, held within ±X, the kinetic energy `T` of their
/// bodies at the start and `T_h` of the velocities that forces alone give them in the step. The
/// largest of these and the account fade with a time of 256 steps. Closing gaps adds and takes energy by turns, and far less than X where
/// bodies turn by a small part of a radian in a step; a whip, or a joint that was built apart,
/// would be blown up by it. Where (1) fails the island is solved again with
///
/// ```text
/// γ_E = 0   of its pins and locks, and no contact is pushed out,                (2)
/// ```
///
/// which takes energy, and the two answers are blended with the largest share of the first that
/// keeps (1). What is left of the gaps is closed by position, see [`super::joint_recovery`].
///
/// # Source
/// Own construction, after the cap on restitution.
#[allow(clippy::too_many_arguments)] // the state of one island
pub(super) fn cap_joints(
    solver: &mut dyn ImpulseSolver,
    problem: &mut ContactProblem,
    stage: &Stage,
    members: &[u32],
    inverse_mass: &[Vec3],
    impulses: &mut [Vec2],
    report: SolveReport,
    tolerance: f64,
) -> JointCap {
    let mut result = JointCap {
        report,
        capped: false,
        accounts: Vec::new(),
        loose: Vec::new(),
    };
    if stage.detection.joints.is_empty() {
        return result;
    }
    let held: Vec<usize> = (0..members.len())
        .filter(|&k| stage.blocks[members[k] as usize].held)
        .collect();
    if held.is_empty() {
        return result;
    }
    let gamma_a: Vec<Vec2> = held
        .iter()
        .map(|&k| stage.blocks[members[k] as usize].gamma_a)
        .collect();
    // γ_E of a bilateral row is what was added to γ_F, the other way
    let asked: Vec<Vec2> = held
        .iter()
        .map(|&k| problem.free[k] - stage.blocks[members[k] as usize].gamma_f)
        .collect();
    let work = |p: &[Vec2], added: &[Vec2]| -> f64 {
        let of = |(j, &k): (usize, &usize)| 0.5 * p[k].dot(&(gamma_a[j] - added[j]));
        held.iter().enumerate().map(of).sum()
    };
    let (mut account, mut most) = (0.0, 0.0);
    for &k in &held {
        let before = match stage.blocks[members[k] as usize].source {
            Source::Joint(index) => stage.accounts[index],
            Source::Contact(_) => JointEnergy::default(),
        };
        account += (1.0 - FORGOTTEN) * before.added;
        most += (1.0 - FORGOTTEN) * before.scale;
    }
    let scale = scale(stage, members, inverse_mass).max(most);
    let limit = SHARE * scale;
    let account = account.clamp(-limit, limit);
    let mut added = work(impulses, &asked);
    let room = limit - account;
    if added > room || hopeless(&report) {
        let first_free = problem.free.clone();
        for (k, &i) in members.iter().enumerate() {
            let gamma = stage.blocks[i as usize].gamma_f;
            if is_rigid(&stage.laws[i as usize]) {
                let push = stage.asked[i as usize] - gamma;
                problem.free[k] = gamma + Vec2::new(push.x.max(0.0), 0.0);
            }
        }
        for &k in &held {
            problem.free[k] = stage.blocks[members[k] as usize].gamma_f;
        }
        let calm_free = problem.free.clone();
        let mut calm = impulses.to_vec();
        let second = solver.solve(problem, &mut calm, tolerance);
        let first = impulses.to_vec();
        let blend = |s: f64| {
            let p: Vec<Vec2> = calm.iter().zip(&first).map(|(a, b)| a.lerp(b, s)).collect();
            let b: Vec<Vec2> = asked.iter().map(|b| b * s).collect();
            (p, b)
        };
        let excess = |s: f64| {
            let (p, b) = blend(s);
            work(&p, &b) - room
        };
        // an answer that is none has no share
        let share = if !hopeless(&report) || !second.solved() {
            largest_share([excess(0.0), excess(0.5), excess(1.0)])
        } else {
            0.0
        };
        let (p, b) = blend(share);
        for (k, b) in problem.free.iter_mut().enumerate() {
            *b = calm_free[k].lerp(&first_free[k], share);
        }
        added = work(&p, &b);
        impulses.copy_from_slice(&p);
        for &k in &held {
            if let Source::Joint(index) = stage.blocks[members[k] as usize].source {
                result.loose.push(index);
            }
        }
        // as good as the worse of the two
        result.report = report.after(&second);
        if share == 0.0 || !second.solved() {
            result.report.status = second.status;
            result.report.residual = second.residual;
        }
        result.capped = true;
    }
    let share = 1.0 / held.len() as f64;
    let account = JointEnergy {
        added: share * (account + added).clamp(-limit, limit),
        scale: share * scale,
    };
    result.accounts = held.iter().map(|&k| (members[k], account)).collect();
    result
}

/// Kinetic energy \[J\] of an island's bodies at the start, and what forces alone would give them.
fn scale(stage: &Stage, members: &[u32], inverse_mass: &[Vec3]) -> f64 {
    let mut bodies: Vec<u32> = members
        .iter()
        .flat_map(|&i| stage.sides[i as usize])
        .filter(|b| *b != NO_BODY)
        .collect();
    bodies.sort_unstable();
    bodies.dedup();
    let of = |&b: &u32| {
        let (b, dt) = (b as usize, stage.length);
        kinetic_of(&stage.start[b], &inverse_mass[b])
            + kinetic_of(&(stage.accelerations[b] * dt), &inverse_mass[b])
    };
    bodies.iter().map(of).sum()
}
