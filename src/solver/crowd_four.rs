//! Four blocks of a crowd at a time.

use super::four_sides::{Body, FourSides, larger, load_pair, solve_alone};
use crate::contact::{Four, Law, Mat2, Rows, Slip, Vec2, Vec3, load_four};
use fearless_simd::{Select, Simd, SimdBase, SimdMask, f64x4};

/// Four blocks that share no body. Groups with fewer blocks are filled up with open contacts of the
/// body that does not move.
#[derive(Debug, Clone, Default)]
pub(super) struct FourRows {
    /// Of a group with only its first block, which is not a contact between points: the place of its rows.
    pub alone: Option<u32>,
    /// Whether all impulses are 0, now and before the last step of momentum.
    pub idle: bool,
    pub sides: FourSides,
    pub free: [Four; 2],
    pub impulses: [Four; 2],
    before: [Four; 2],
    /// `G_ii`: nn, nt, tt [1/kg].
    block: [Four; 3],
    friction: Four,
    /// tt, nt, nn of `G_ii`, with the compliance, over its determinant \[kg\]; NaN without friction.
    stick: [Four; 3],
    /// `1 / (G_nn + R ± μ G_nt)` \[kg\] for a contact that slips with `P_T = ± μ P_N`; 0 if it cannot.
    slip: [Four; 2],
}

impl FourRows {
    /// Four open contacts of the body that does not move.
    pub fn of(still: u32) -> Self {
        FourRows {
            sides: FourSides::of(still),
            ..FourRows::default()
        }
    }

    pub fn set(&mut self, lane: usize, block: &Mat2, law: &Law) {
        let Law::Contact {
            friction,
            compliance,
        } = *law
        else {
            return;
        };
        let [nn, nt, tt] = [block[(0, 0)], block[(0, 1)], block[(1, 1)]];
        for (to, from) in self.block.iter_mut().zip([nn, nt, tt]) {
            to[lane] = from;
        }
        self.friction[lane] = friction;
        let soft = nn + compliance;
        let det = soft * tt - nt * nt;
        let stick = if friction == 0.0 { f64::NAN } else { 1.0 / det };
        for (to, from) in self.stick.iter_mut().zip([tt, nt, soft]) {
            to[lane] = from * stick;
        }
        for (to, side) in self.slip.iter_mut().zip([1.0, -1.0]) {
            let along = soft + side * friction * nt;
            to[lane] = if along > 0.0 { 1.0 / along } else { 0.0 };
        }
    }

    /// Solves a group of one block. Returns change and scale of its velocity \[m/s\].
    fn step_alone(
        &mut self,
        block: (&Rows, &Mat2, &Law),
        inverse_mass: &[Vec3],
        bodies: &mut [Body],
        momentum: Option<f64>,
    ) -> [f64; 2] {
        if let Some(factor) = momentum {
            let impulses = self.impulses.iter_mut().flatten();
            for (now, before) in impulses.zip(self.before.iter_mut().flatten()) {
                let next = *now + factor * (*now - *before);
                *before = std::mem::replace(now, next);
            }
        }
        let [old, free] = [&self.impulses, &self.free].map(|p| Vec2::new(p[0][0], p[1][0]));
        let (new, found) = solve_alone((old, free), block, inverse_mass, bodies);
        (self.impulses[0][0], self.impulses[1][0]) = (new.x, new.y);
        found
    }
}

/// One sweep over the groups in the order given.
#[inline(always)]
pub(super) fn pass<'a, S: Simd>(
    simd: S,
    fours: impl Iterator<Item = &'a mut FourRows>,
    bodies: &mut [Body],
    (alone, masses): (&[(Rows, Mat2, Law)], &[Vec3]),
    momentum: Option<f64>,
) -> [f64; 2] {
    let mut largest = [f64x4::splat(simd, 0.0); 2];
    let mut apart = [0.0f64; 2];
    for four in fours {
        if let Some(k) = four.alone {
            let (rows, block, law) = &alone[k as usize];
            let block = (rows, block, law);
            let [change, scale] = four.step_alone(block, masses, bodies, momentum);
            apart = [apart[0].max(change), apart[1].max(scale)];
        } else {
            step(simd, four, bodies, momentum, &mut largest);
        }
    }
    let of = |four: f64x4<S>, apart: f64| four.as_slice().iter().copied().fold(apart, f64::max);
    [of(largest[0], apart[0]), of(largest[1], apart[1])]
}

/// Solves four contacts: reads velocities, solves, writes velocities.
#[inline(always)]
fn step<S: Simd>(
    simd: S,
    four: &mut FourRows,
    bodies: &mut [Body],
    momentum: Option<f64>,
    largest: &mut [f64x4<S>; 2],
) {
    let zero = f64x4::splat(simd, 0.0);
    let [u1, u2] = four.sides.velocities(simd, bodies);
    let n = load_pair(simd, &four.sides.normal);
    let [a1, a2] = [&four.sides.arms[0], &four.sides.arms[1]];
    let free_n = load_four(simd, &four.free[0]);
    let normal = n[0] * (u2[0] - u1[0])
        + n[1] * (u2[1] - u1[1])
        + (load_four(simd, &a1[0]) * u1[2] + load_four(simd, &a2[0]) * u2[2])
        + free_n;
    if four.idle && normal.simd_ge(zero).all_true() {
        return;
    }
    let t = [-n[1], n[0]];
    let tangential = t[0] * (u2[0] - u1[0])
        + t[1] * (u2[1] - u1[1])
        + (load_four(simd, &a1[1]) * u1[2] + load_four(simd, &a2[1]) * u2[2])
        + load_four(simd, &four.free[1]);
    let now = load_pair(simd, &four.impulses);
    let mut before = load_pair(simd, &four.before);
    let mut old = now;
    if let Some(factor) = momentum {
        let factor = f64x4::splat(simd, factor);
        old = [
            now[0] + factor * (now[0] - before[0]),
            now[1] + factor * (now[1] - before[1]),
        ];
        before = now;
        before[0].store_slice(&mut four.before[0]);
        before[1].store_slice(&mut four.before[1]);
    }
    let block = load_triple(simd, &four.block);
    let free = [
        normal - (block[0] * old[0] + block[1] * old[1]),
        tangential - (block[1] * old[0] + block[2] * old[1]),
    ];
    let new = solve(simd, four, block, free);
    new[0].store_slice(&mut four.impulses[0]);
    new[1].store_slice(&mut four.impulses[1]);
    let none = new[0].simd_eq(zero) & before[0].simd_eq(zero);
    four.idle = none.all_true() && (new[1].simd_eq(zero) & before[1].simd_eq(zero)).all_true();

    let delta = [new[0] - old[0], new[1] - old[1]];
    let trace = block[0] + block[2];
    largest[1] = larger(larger(new[0].abs(), new[1].abs()) * trace, largest[1]);
    largest[0] = larger(larger(delta[0].abs(), delta[1].abs()) * trace, largest[0]);
    four.sides.push(simd, bodies, [u1, u2], delta);
}

/// [`solve_local`](crate::contact::solve_local) of four contacts with `b_i` in `free`, by the stored
/// inverses.
#[inline(always)]
fn solve<S: Simd>(
    simd: S,
    four: &FourRows,
    [_, nt, tt]: [f64x4<S>; 3],
    [x, y]: [f64x4<S>; 2],
) -> [f64x4<S>; 2] {
    let zero = f64x4::splat(simd, 0.0);
    let friction = load_four(simd, &four.friction);
    let [by_tt, by_nt, by_nn] = load_triple(simd, &four.stick);
    let open = x.simd_ge(zero);
    let stick = [y * by_nt - x * by_tt, x * by_nt - y * by_nn];
    // false without friction, where both are NaN
    let sticks = stick[0].simd_ge(zero) & stick[1].abs().simd_le(friction * stick[0]);
    if (open | sticks).all_true() {
        return [open.select(zero, stick[0]), open.select(zero, stick[1])];
    }
    let rough = !friction.simd_eq(zero);
    let [plus, minus] = load_pair(simd, &four.slip);
    let up = stick[1].simd_gt(zero);
    let one = f64x4::splat(simd, 1.0);
    let side = up.select(one, -one);
    let inverse = up.select(plus, minus);
    let first = slide([x, y], [nt, tt, friction], side, inverse);
    let first_solves = (first.valid & first.violation.simd_le(zero)) | !rough;
    let mut slip = first.impulse;
    if !(open | sticks | first_solves).all_true() {
        let inverse = up.select(minus, plus);
        let second = slide([x, y], [nt, tt, friction], -side, inverse);
        slip = first.or(second, first_solves, zero);
    }
    let slip = [slip[0], rough.select(slip[1], zero)];
    [
        open.select(zero, sticks.select(stick[0], slip[0])),
        open.select(zero, sticks.select(stick[1], slip[1])),
    ]
}

/// The slip of contacts to one side, with the stored inverse of the rows that slip.
#[inline(always)]
fn slide<S: Simd>(
    [x, y]: [f64x4<S>; 2],
    [nt, tt, friction]: [f64x4<S>; 3],
    side: f64x4<S>,
    inverse: f64x4<S>,
) -> Slip<S> {
    let share = side * friction;
    let normal = -x * inverse;
    Slip {
        impulse: [normal, share * normal],
        valid: inverse.simd_gt(f64x4::splat(x.simd, 0.0)),
        violation: side * (y + (nt + share * tt) * normal),
    }
}

#[inline(always)]
fn load_triple<S: Simd>(simd: S, [a, b, c]: &[Four; 3]) -> [f64x4<S>; 3] {
    [load_four(simd, a), load_four(simd, b), load_four(simd, c)]
}
