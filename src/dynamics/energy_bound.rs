//! Bounds on the energy that contacts and joints add. Newton's restitution, push-outs and the
//! closing of gaps can create energy.
//!
//! Both bounds work alike. If the work of a solution exceeds the bound, the island is solved a
//! second time, as a *plastic* problem: the same problem without restitution, without push-outs and
//! without closing of gaps. Its `b` cannot add energy. The result is a blend of both solutions, with
//! the largest share of the first one that satisfies the bound. Both solutions lie in the friction
//! cone and do not penetrate; by convexity this also holds for their blend.

use super::constraint_work::{joint_work, work, work_of};
use super::contact_cache::JointEnergy;
use super::island_problem::{IslandProblem, Terms};
use super::reserve::given_without_impacts;
use crate::contact::{ContactProblem, Residual, Vec2, feasibility};
use crate::solver::{ImpulseSolver, SolveReport, SolveStatus};

/// Largest energy that joints may add, as a share of the energy of their island.
const SHARE: f64 = 0.01;

/// Share of the added energy, and of its scale, that decays in a step.
const DECAY: f64 = 1.0 / 256.0;

/// Residual, as a share of the island's velocity scale, above which the problem may have no
/// solution. The residual of a problem without a solution is about as large as the velocity scale.
const HOPELESS: f64 = 0.01;

/// Whether an island may have no solution at all.
pub(super) fn hopeless(report: &SolveReport) -> bool {
    let left = &report.residual;
    !report.solved() && left.velocity > HOPELESS * left.velocity_scale
}

/// A blend of two solutions.
struct Blend {
    impulses: Vec<Vec2>,
    /// Share of the first solution.
    share: f64,
    /// Report of the solution of the plastic problem.
    plastic: SolveReport,
    /// Violation of the constraints by the blended impulses; `None` if they are one of the two
    /// solutions.
    applied: Option<Residual>,
}

impl Blend {
    /// The report of the blend, which solves neither problem exactly. Its residual is the larger of
    /// two: the residual of the first solution, or of the plastic one if `worse` is set; and the
    /// violation of the constraints by the blended impulses, see [`feasibility`].
    fn report(&self, first: &SolveReport, worse: bool, tolerance: f64) -> SolveReport {
        let mut report = first.after(&self.plastic);
        if worse {
            report.status = self.plastic.status;
            report.residual = self.plastic.residual;
        }
        if let Some(mut applied) = self.applied {
            // by convexity the blend violates nothing by more than the worse of both solutions,
            // each of which was judged by its own scale
            for own in [&first.residual, &self.plastic.residual] {
                applied.velocity_scale = applied.velocity_scale.max(own.velocity_scale);
                applied.round_off = applied.round_off.max(own.round_off);
            }
            if !applied.certified(tolerance) {
                report.status = SolveStatus::Unsolved;
            }
            let better = applied.merit() <= report.residual.merit();
            if !better {
                report.residual = applied;
            }
        }
        report
    }
}

/// Energy \[J\] by which a blend exceeds a bound. Arguments: the share of the first solution, the
/// blended impulses, and `G P + b` of the plastic solution. Several bounds may hold together.
type Excess<'a> = &'a dyn Fn(f64, &[Vec2], &[Vec2]) -> f64;

/// Solves `plastic` from `start` and blends its solution with `first`, the solution of `problem`. The
/// two problems differ only in `b`. The blend has the largest share of `first` at which no `excess`
/// is above 0.
fn blend(
    solver: &mut dyn ImpulseSolver,
    [problem, plastic]: [&ContactProblem; 2],
    start: Vec<Vec2>,
    (first, report): (&[Vec2], &SolveReport),
    tolerance: f64,
    excess: &[Excess],
) -> Blend {
    let mut second = start;
    let plastic_report = solver.solve(plastic, &mut second, tolerance);
    let mut velocities = Vec::new();
    plastic.velocities(&second, &mut velocities);
    let at = |share: f64| lerp(&second, first, share);
    // a hopeless solution gets no share
    let share = if hopeless(report) && plastic_report.solved() {
        0.0
    } else {
        let shares = excess.iter().map(|excess| {
            let of = |s| excess(s, &at(s), &velocities);
            largest_share([0.0, 0.5, 1.0].map(of))
        });
        shares.fold(1.0, f64::min)
    };
    let impulses = at(share);
    let applied = (share > 0.0 && share < 1.0).then(|| {
        let blended = ContactProblem {
            free: lerp(&plastic.free, &problem.free, share),
            ..problem.clone()
        };
        feasibility(&blended, &impulses)
    });
    Blend {
        impulses,
        share,
        plastic: plastic_report,
        applied,
    }
}

fn lerp(from: &[Vec2], to: &[Vec2], share: f64) -> Vec<Vec2> {
    from.iter().zip(to).map(|(a, b)| a.lerp(b, share)).collect()
}

/// Largest `s` in [0, 1] with `w(s) ≤ 0`, `w` the parabola through (0, ½, 1).
fn largest_share([w0, wh, w1]: [f64; 3]) -> f64 {
    let curvature = 2.0 * (w0 + w1) - 4.0 * wh;
    let slope = w1 - w0 - curvature;
    if w1 <= 0.0 {
        return 1.0;
    }
    if w0 >= 0.0 {
        return 0.0;
    }
    // exactly one root in (0, 1): w0 < 0 < w1
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let s = 0.5 * (low + high);
        if w0 + s * (slope + s * curvature) <= 0.0 {
            low = s;
        } else {
            high = s;
        }
    }
    low
}

/// Bounds the energy that rigid contacts add,
///
/// ```text
/// W(P) = Σ Pᵀ (γ_A + γ_E)/2 ≤ 0                                              (1)
/// ```
///
/// An island exceeds the bound if `W > 0` in a step with an impact, or if `W` is above 2 % of
/// `Σ P² G/2` in any other step. `velocities` is `G P + b` \[m/s\] of the solution. Returns the report of
/// the bounded solution; `None` if the bound already holds.
///
/// In a step with an impact the sum with the work `W_J` of pins and locks is bounded too,
///
/// ```text
/// W(P) + W_J(P) ≤ max(R, W(P⁰) + W_J(P⁰), 0)                                 (1a)
/// ```
///
/// with the reserve `R` of the island, see [`super::reserve`]. `P⁰` solves the same step without its
/// impacts, see [`given_without_impacts`]. Pins have `γ_E = −b_J` whatever the impulses are, up to what
/// the solve leaves, `b_J` their added velocity, so that their work is linear in their impulses:
///
/// ```text
/// W_J(P) = P_J · d,   d = (γ_A − b_J)/2,   W_J(P) − W_J(P⁰) = (P_J − P⁰_J) · d
/// ```
///
/// The difference is the work of the reactions to the impact, which ideal pins do not do, and must not
/// exceed what the impact loses. `W_J(P⁰)` is the scheme's error of turning bodies. Without an impact it is
/// bounded by [`bound_joints`] and paid as a debt, and so it is with one: it is no reason to take the
/// rebound of a small impact in a large island. The plastic solution is no such reference: an impact
/// without rebound drives pins as well: `1/(1 + e)` of the difference, while no contact opens or slips.
///
/// # Source
/// Own construction; see Glocker, *Energetic consistency conditions for standard impacts* (2013)
/// for why Newton's law needs it.
pub(super) fn bound_contacts(
    solver: &mut dyn ImpulseSolver,
    island: &IslandProblem,
    (impulses, velocities): (&mut [Vec2], &[Vec2]),
    report: SolveReport,
    tolerance: f64,
) -> Option<SolveReport> {
    let IslandProblem {
        problem,
        terms,
        added,
        ..
    } = island;
    let impact = island.impact();
    // without an impact or a push-out no contact can add energy
    if !impact && added.iter().all(|a| a.x >= 0.0 && a.y == 0.0) {
        return None;
    }
    let gamma_1 = |i: usize| velocities[i] - added[i];
    let work = work_of(terms, impulses, gamma_1);
    // an impact may drive the pins of its bodies
    let with_joints = match impact {
        true => work + joint_work(island, impulses, velocities),
        false => work,
    };
    let mut room = island.reserve.max(0.0);
    if work <= 0.0 && with_joints <= room {
        return None;
    }
    let rigid = (0..impulses.len()).filter(|&i| terms[i].rigid);
    // impulses in a wedge can be huge relative to the velocities that they change: the round-off of
    // the work scales with the products of both
    let allowed: f64 = if impact {
        let product = |i: usize| impulses[i].norm() * (terms[i].gamma_a.norm() + gamma_1(i).norm());
        1e-13 * rigid.map(product).sum::<f64>()
    } else {
        let change = |i: usize| impulses[i].norm_squared() * problem.operator.diagonal(i).trace();
        0.02 * rigid.map(|i| 0.5 * change(i)).sum::<f64>()
    };
    if impact && with_joints > allowed + room {
        room = room.max(given_without_impacts(solver, island, tolerance));
    }
    if work <= allowed && with_joints <= allowed + room {
        return None;
    }
    let plastic_added = |i: usize| {
        if terms[i].rigid {
            Vec2::new(added[i].x.max(0.0), 0.0)
        } else if terms[i].bilateral {
            Vec2::zeros()
        } else {
            added[i]
        }
    };
    let mut plastic = problem.clone();
    for (i, b) in plastic.free.iter_mut().enumerate() {
        *b += plastic_added(i) - added[i];
    }
    let excess = |share: f64, p: &[Vec2], plastic_velocities: &[Vec2]| {
        let gamma_0 = |i: usize| plastic_velocities[i] - plastic_added(i);
        work_of(terms, p, |i| gamma_0(i).lerp(&gamma_1(i), share))
    };
    let excess_with_joints = |share: f64, p: &[Vec2], plastic_velocities: &[Vec2]| {
        let gamma = |i: usize| plastic_velocities[i].lerp(&gamma_1(i), share);
        let of = |k: usize| 0.5 * p[k].dot(&(terms[k].gamma_a + gamma(k)));
        let joints: f64 = island.bilateral.iter().map(|own| of(own.block)).sum();
        excess(share, p, plastic_velocities) + joints - room
    };
    let all: &[Excess] = match impact && !island.bilateral.is_empty() {
        true => &[&excess, &excess_with_joints],
        false => &[&excess],
    };
    let start = vec![Vec2::zeros(); impulses.len()];
    let (first, problems) = ((&*impulses, &report), [problem, &plastic]);
    let found = blend(solver, problems, start, first, tolerance, all);
    impulses.copy_from_slice(&found.impulses);
    Some(found.report(&report, !found.plastic.solved(), tolerance))
}

/// Energy \[J\] that the rigid contacts of a problem add, if all its impulses act and give these velocities.
fn contact_work(
    problem: &ContactProblem,
    terms: &[Terms],
    (impulses, velocities): (&[Vec2], &[Vec2]),
) -> f64 {
    let gamma_end = |i: usize| velocities[i] - (problem.free[i] - terms[i].gamma_f);
    work_of(terms, impulses, gamma_end)
}

/// Energy account of the pins and locked axes of an island at the start of a step \[J\]. See
/// [`bound_joints`].
struct Account {
    /// `A` and `A_c`.
    added: f64,
    total: f64,
    /// The maximum in X, and X.
    scale: f64,
    limit: f64,
    /// Whether the work of contacts is bounded with that of joints.
    counts: bool,
}

impl Account {
    fn of(island: &IslandProblem) -> Account {
        let (mut added, mut total, mut most) = (0.0, 0.0, 0.0);
        for own in &island.bilateral {
            added += (1.0 - DECAY) * own.energy.added;
            total += (1.0 - DECAY) * own.energy.total;
            most += (1.0 - DECAY) * own.energy.scale;
        }
        let scale = (island.kinetic + island.forced).max(most);
        let limit = SHARE * scale;
        Account {
            added: added.clamp(-limit, limit),
            total: total.clamp(0.0, limit),
            scale,
            limit,
            counts: !island.impact() && island.terms.iter().any(|t| t.rigid),
        }
    }
}

/// Joint numbers of the detection, each with its share of the account of [`bound_joints`] after the
/// step, in which `impulses` act and give the velocities `G P + b`.
pub(super) fn joint_energies(
    island: &IslandProblem,
    impulses: &[Vec2],
    velocities: &[Vec2],
) -> Vec<(usize, JointEnergy)> {
    let bilateral = &island.bilateral;
    if bilateral.is_empty() {
        return Vec::new();
    }
    let account = Account::of(island);
    let joints = joint_work(island, impulses, velocities);
    let contacts = match account.counts {
        true => work(island, impulses, velocities),
        false => 0.0,
    };
    let (limit, share) = (account.limit, 1.0 / bilateral.len() as f64);
    let energy = JointEnergy {
        added: share * (account.added + joints).clamp(-limit, limit),
        total: share * (account.total + joints + contacts).clamp(0.0, limit),
        scale: share * account.scale,
    };
    bilateral.iter().map(|h| (h.joint, energy)).collect()
}

/// Bounds the energy that pins and locked axes add,
///
/// ```text
/// W(P) = Σ Pᵀ (γ_A + γ_E)/2,   A + W ≤ X = 0.01 max (T + T_h)                      (1)
/// ```
///
/// An island that exceeds it may give as much as its reserve, see [`super::reserve`].
///
/// `A` is the energy that they added before, limited to ±X. `T` is the kinetic energy of their
/// bodies at the start, and `T_h` that of the velocities that forces alone give them in the step.
/// The maximum in X, and `A`, decay with a time constant of 256 steps. Closing gaps adds and takes
/// energy in turn. The amounts are far below X if bodies turn by a small part of a radian in a step.
///
/// In steps without an impact the work `W_c` of rigid contacts is bounded together with `W`.
/// Otherwise an island could gain in contacts what its pins take. Impacts have a bound of their own.
///
/// ```text
/// A_c + W + W_c ≤ X,   A_c ← min(max(A_c + W + W_c, 0), X)                         (1b)
/// ```
///
/// `A_c` is not below 0, so that the island cannot regain energy that friction took.
///
/// Without the bound a whip, or a joint that was built with a gap, would blow up. The plastic
/// problem has
///
/// ```text
/// γ_E = 0   of its pins and locked axes, and no push-outs,                      (2)
/// ```
///
/// which can only take energy. The rest of the gaps is closed by position, see
/// [`super::joint_recovery`]. `impulses` solves `problem`, the island's, and gives `velocities`, `G P + b`;
/// if they are `doubtful`, the plastic problem is solved in any case. Returns the report of the bounded
/// solution and its `b`; `None` if the bound already holds.
///
/// # Source
/// Own construction, after the bound on restitution.
pub(super) fn bound_joints(
    solver: &mut dyn ImpulseSolver,
    problem: &ContactProblem,
    island: &IslandProblem,
    (impulses, velocities): (&mut [Vec2], &[Vec2]),
    (report, doubtful): (SolveReport, bool),
    tolerance: f64,
) -> Option<(SolveReport, Vec<Vec2>)> {
    let (terms, bilateral) = (&island.terms, &island.bilateral);
    if bilateral.is_empty() {
        return None;
    }
    // γ_E = −b of a bilateral row but for the residual of the solve, which large impulses turn into work
    let gamma_1 = |k: usize| velocities[k] - (problem.free[k] - terms[k].gamma_f);
    let work = |p: &[Vec2], gamma_end: &dyn Fn(usize) -> Vec2| -> f64 {
        let of = |k: usize| 0.5 * p[k].dot(&(terms[k].gamma_a + gamma_end(k)));
        bilateral.iter().map(|own| of(own.block)).sum()
    };
    let Account {
        added: before,
        total,
        limit,
        counts,
        ..
    } = Account::of(island);
    let room = limit - before;
    let by_contacts = |p: &[Vec2], velocities: &[Vec2]| match counts {
        true => contact_work(problem, terms, (p, velocities)),
        false => 0.0,
    };
    let (now, contacts) = (work(impulses, &gamma_1), by_contacts(impulses, velocities));
    let gains = now > room || counts && total + now + contacts > limit;
    if !gains && !doubtful {
        return None;
    }
    let mut plastic = problem.clone();
    for (b, terms) in plastic.free.iter_mut().zip(terms) {
        if terms.rigid {
            let push = terms.bias - terms.gamma_f;
            *b = terms.gamma_f + Vec2::new(push.x.max(0.0), 0.0);
        } else if terms.bilateral {
            *b = terms.gamma_f;
        }
    }
    // what exceeds the bound gives no more than the reserve
    let room = room.min(island.reserve.max(0.0));
    // the plastic problem adds no velocity: its γ_E is G P + b
    let blended = |share: f64, p: &[Vec2], plastic_velocities: &[Vec2]| {
        work(p, &|k| plastic_velocities[k].lerp(&gamma_1(k), share))
    };
    let of_joints = |share: f64, p: &[Vec2], plastic_velocities: &[Vec2]| {
        blended(share, p, plastic_velocities) - room
    };
    let of_all = |share: f64, p: &[Vec2], plastic_velocities: &[Vec2]| {
        let mut velocities = Vec::new();
        problem.velocities(p, &mut velocities);
        total + blended(share, p, plastic_velocities) + by_contacts(p, &velocities) - limit
    };
    let excess: &[Excess] = match counts {
        true => &[&of_joints, &of_all],
        false => &[&of_joints],
    };
    let (start, first) = (impulses.to_vec(), (&*impulses, &report));
    let problems = [problem, &plastic];
    let found = blend(solver, problems, start, first, tolerance, excess);
    impulses.copy_from_slice(&found.impulses);
    let worse = found.share == 0.0 || !found.plastic.solved();
    let report = found.report(&report, worse, tolerance);
    let bias = lerp(&plastic.free, &problem.free, found.share);
    Some((report, bias))
}
