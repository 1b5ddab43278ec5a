//! Closes gaps of joints and passed limits by position, where velocities would add energy or come
//! too late.

use super::asked::Asked;
use super::displacements::displacements;
use super::interval::{Interval, movable, side_velocities};
use super::model::{JointKind, JointRow, ModelError, MultibodyModel, NormalLaw};
use super::solution::Solution;
use super::solve::IslandSolver;
use crate::contact::{NO_BODY, Rows, Vec2, Vec3};

/// Most Newton steps; from a gap of half an arm three or four reach round-off.
const STEPS: usize = 8;

/// Gap \[m\] that counts as closed.
const CLOSED: f64 = 1e-12;

/// Gaps that [`close_rounded`] closes, over the coordinate: two units of the last place in single precision.
const ROUNDED: f64 = 2.0 / (1 << 23) as f64;

/// Largest turn of a body in one Newton step \[rad\].
const TURN: f64 = 0.5;

/// Excess above which [`take_up_excess`] acts, as a share of the longest arm of the joint. It is
/// reached where the turn of a body per step times its change is above 4e-3 rad². Without a limit
/// every swing would be closed by position, which costs the order of the scheme.
const EXCESS: f64 = 2e-3;

/// What a correction of positions did.
pub(super) struct Closed {
    /// Displacement of the centre of mass of each body \[m\].
    pub moved: Vec<Vec2>,
    /// The movable bodies of each row.
    pub sides: Vec<[u32; 2]>,
}

impl Closed {
    /// Adds a further displacement.
    fn add(&mut self, more: Closed) {
        let moved = self.moved.iter_mut().zip(more.moved);
        moved.for_each(|(d, more)| *d += more);
        self.sides = more.sides;
    }
}

/// Closes the joint gaps that a step left open, at its end, by Newton's method. The displacements
/// `d` have minimum kinetic norm under
///
/// ```text
/// J d = −g   of these joints      J d = 0   of all others
/// J d ≥ −g   of these limits      J d ≥ −max(g, 0)   of contacts and other limits   (1)
/// ```
///
/// Velocities stay as they are, which changes the angular momentum: see
/// [`super::angular_momentum`]. Returns the displacement of every body, and the rows that coupled
/// them.
///
/// # Errors
/// Those of the model.
pub(super) fn close_joints(
    model: &mut dyn MultibodyModel,
    interval: &Interval,
    solution: &Solution,
    path: Option<&[Vec3]>,
    inverse_mass: &[Vec3],
    solver: &mut IslandSolver,
) -> Result<Closed, ModelError> {
    let mut contacts = contacts_at_end(interval, solution, path, inverse_mass);
    let mut found = Vec::new();
    let mut closed = Closed {
        moved: vec![Vec2::zeros(); inverse_mass.len()],
        sides: Vec::new(),
    };
    for _ in 0..STEPS {
        found.clear();
        model.detect_joints(interval.length, &mut found)?;
        let open = |k: usize| solution.unclosed.binary_search(&k).is_ok();
        let joints = found.iter().enumerate();
        let worst = joints
            .filter(|(k, _)| open(*k))
            .map(|(_, joint)| match joint.kind {
                JointKind::Limit { gap } => (-gap).max(0.0),
                _ => gap(joint).norm(),
            })
            .fold(0.0, f64::max);
        if worst <= CLOSED {
            break;
        }
        let wanted = |k: usize, joint: &JointRow| match joint.kind {
            JointKind::Limit { gap } if open(k) => Vec2::new(gap, 0.0),
            JointKind::Limit { gap } => Vec2::new(gap.max(0.0), 0.0),
            _ if open(k) => gap(joint),
            _ => Vec2::zeros(),
        };
        let (moved, all) = displace(model, &contacts, &found, wanted, inverse_mass, solver, TURN);
        closed.add(moved);
        for (own, left) in &mut contacts {
            *left += own.velocity(&all).x;
        }
        if all.iter().all(|d| *d == Vec3::zeros()) {
            break;
        }
    }
    Ok(closed)
}

/// Moves the bodies by the `d` of (1), with `wanted` on the left-hand sides of the joints. Scales `d`
/// down so that no body turns by more than `turn` \[rad\]. Returns what moved, and `d`.
fn displace(
    model: &mut dyn MultibodyModel,
    contacts: &[(Rows, f64)],
    joints: &[JointRow],
    wanted: impl Fn(usize, &JointRow) -> Vec2,
    inverse_mass: &[Vec3],
    solver: &mut IslandSolver,
    turn: f64,
) -> (Closed, Vec<Vec3>) {
    let mut asked = Asked::default();
    for (own, left) in contacts {
        asked.contact(*own, left.max(0.0), 0.0);
    }
    for (k, joint) in joints.iter().enumerate() {
        let bodies = movable(joint.rows.bodies, inverse_mass);
        asked.joint(joint, bodies, wanted(k, joint), inverse_mass);
    }
    let (tolerance, far) = (solver.tolerance, f64::INFINITY);
    let way = (far, &mut false);
    let moves = displacements(&asked, inverse_mass, solver, tolerance, way);
    let most = moves.iter().map(|(_, d)| d.z.abs()).fold(0.0, f64::max);
    let share = (turn / most).min(1.0);
    let mut all = vec![Vec3::zeros(); inverse_mass.len()];
    for &(body, d) in &moves {
        model.shift(body as usize, &(d * share), 1.0);
        all[body as usize] = d * share;
    }
    let closed = Closed {
        moved: all.iter().map(|d| d.xy()).collect(),
        sides: asked.rows.iter().map(|r| r.bodies).collect(),
    };
    (closed, all)
}

/// Closes the gaps that single precision leaves of closed pins, before the first step: those within the
/// resolution of their bodies' coordinates. The velocities that would close them in a step contradict
/// each other in a rope that lies on a drum, which then slips.
///
/// # Errors
/// Those of the model.
pub(super) fn close_rounded(
    model: &mut dyn MultibodyModel,
    dt: f64,
    inverse_mass: &[Vec3],
    solver: &mut IslandSolver,
) -> Result<(), ModelError> {
    let mut found = Vec::new();
    model.detect_joints(dt, &mut found)?;
    let rounded = |joint: &JointRow| {
        let JointKind::Pin { gap } = joint.kind else {
            return false;
        };
        let centres = joint.rows.bodies.map(|body| {
            let known = (body as usize) < inverse_mass.len();
            known.then(|| model.centre(body as usize)).flatten()
        });
        let far = centres.iter().flatten().map(Vec2::amax).fold(0.0, f64::max);
        let resolution = ROUNDED * (far + joint.bend.reach());
        CLOSED < gap.norm() && gap.norm() <= resolution
    };
    let closes: Vec<bool> = found.iter().map(rounded).collect();
    if !closes.contains(&true) {
        return Ok(());
    }
    let wanted = |k: usize, joint: &JointRow| match joint.kind {
        JointKind::Limit { gap } => Vec2::new(gap.max(0.0), 0.0),
        _ if closes[k] => gap(joint),
        _ => Vec2::zeros(),
    };
    displace(model, &[], &found, wanted, inverse_mass, solver, TURN);
    Ok(())
}

/// Excess gap `e` \[m\] of pins and locks at the next midpoint, by joint number,
///
/// ```text
/// e = g + h γ_E + n(u_E)/2                                                     (2)
/// ```
///
/// beyond the gap `n(u_E)/2` of a steady turn, see [`super::joint_rules`]. Joints that are closed
/// anyway, those without arms, and those without an excess above [`EXCESS`] are left out.
pub(super) fn excess_gaps(
    interval: &Interval,
    solution: &Solution,
    in_cluster: &[bool],
) -> Vec<(usize, Vec2)> {
    let mut all = Vec::new();
    for (k, joint) in interval.detection.joints.iter().enumerate() {
        let gap = match joint.kind {
            JointKind::Pin { gap } => gap,
            JointKind::Lock { gap } => Vec2::new(gap, 0.0),
            _ => continue,
        };
        let located = |b: &u32| in_cluster.get(*b as usize).is_some_and(|c| *c);
        if solution.unclosed.binary_search(&k).is_ok() || joint.rows.bodies.iter().any(located) {
            continue;
        }
        let sides = side_velocities(&joint.rows, &solution.end);
        let mut rate = joint.rows.velocity(&solution.end);
        if let JointKind::Lock { .. } = joint.kind {
            rate.y = 0.0;
        }
        let (straight, reach) = (gap + rate * interval.length, joint.bend.reach());
        // in most steps no joint bends that far, which is seen without its angles; with room for round-off
        let limit = EXCESS * reach;
        let most = straight.norm() + 0.5 * joint.bend.most(sides, interval.length);
        if reach == 0.0 || most < 0.99 * limit {
            continue;
        }
        let excess = straight + 0.5 * joint.bend.after(sides, interval.length);
        if excess.norm() > limit {
            all.push((k, excess));
        }
    }
    all
}

/// Takes up the excess gaps (2) by position at the end of a step: `J d = −e` of these joints, and all
/// other rows as in (1). If the turn of a body changes fast, for example in an impact, the velocities
/// of the next step would close them with a jerk.
///
/// # Errors
/// Those of the model.
pub(super) fn take_up_excess(
    model: &mut dyn MultibodyModel,
    interval: &Interval,
    solution: &Solution,
    path: Option<&[Vec3]>,
    excess: &[(usize, Vec2)],
    inverse_mass: &[Vec3],
    solver: &mut IslandSolver,
) -> Result<Closed, ModelError> {
    let mut found = Vec::new();
    model.detect_joints(interval.length, &mut found)?;
    let contacts = contacts_at_end(interval, solution, path, inverse_mass);
    let wanted = |k: usize, joint: &JointRow| match joint.kind {
        JointKind::Limit { gap } => Vec2::new(gap.max(0.0), 0.0),
        _ => match excess.binary_search_by_key(&k, |(joint, _)| *joint) {
            Ok(at) => excess[at].1,
            Err(_) => Vec2::zeros(),
        },
    };
    Ok(displace(model, &contacts, &found, wanted, inverse_mass, solver, 1.0).0)
}

/// Rows of rigid contacts, and their gaps \[m\] at the end of the interval. `path` has the mean
/// velocities of all bodies to the next midpoint, where they are not those at the end.
pub(super) fn contacts_at_end(
    interval: &Interval,
    solution: &Solution,
    path: Option<&[Vec3]>,
    inverse_mass: &[Vec3],
) -> Vec<(Rows, f64)> {
    let half = 0.5 * interval.length;
    let contacts = interval.detection.contacts.iter();
    let rigid = contacts.filter(|c| matches!(c.law, NormalLaw::Rigid { .. }));
    let of = rigid.map(|c| {
        let own = Rows {
            bodies: movable(c.rows.bodies, inverse_mass),
            ..c.rows
        };
        let end = c.rows.velocity(&solution.end).x;
        let mean = path.map_or(end, |path| c.rows.velocity(path).x);
        (own, c.gap + half * (2.0 * mean - end))
    });
    of.filter(|(rows, _)| rows.bodies != [NO_BODY; 2]).collect()
}

/// The gap of a pin or locked axis.
pub(super) fn gap(joint: &JointRow) -> Vec2 {
    match joint.kind {
        JointKind::Pin { gap } => gap,
        JointKind::Lock { gap } => Vec2::new(gap, 0.0),
        _ => Vec2::zeros(),
    }
}
