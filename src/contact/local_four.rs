//! [`solve_local`](super::solve_local) for four contacts at once, bit for bit.

use fearless_simd::{Select, Simd, SimdBase, SimdMask, f64x4, mask64x4};

/// One number for each of four contacts.
pub(crate) type Four = [f64; 4];

/// `G_ii` [1/kg], friction and compliance [1/kg] of four contacts.
#[derive(Debug, Clone, Default)]
pub(crate) struct FourContacts {
    pub nn: Four,
    pub nt: Four,
    pub tt: Four,
    pub friction: Four,
    pub compliance: Four,
}

/// The four numbers as a vector.
#[inline(always)]
pub(crate) fn load_four<S: Simd>(simd: S, four: &Four) -> f64x4<S> {
    f64x4::from_slice(simd, four)
}

/// The result of [`solve_local`](super::solve_local) for each of four contacts with `b_i` in
/// `free`. Does the same operations without branches, so that every number is equal to the last
/// bit.
#[inline(always)]
pub(crate) fn solve_four<S: Simd>(
    simd: S,
    contacts: &FourContacts,
    free: [f64x4<S>; 2],
) -> [f64x4<S>; 2] {
    let zero = f64x4::splat(simd, 0.0);
    let [x, y] = free;
    let (nt, tt) = (load_four(simd, &contacts.nt), load_four(simd, &contacts.tt));
    let nn = load_four(simd, &contacts.nn) + load_four(simd, &contacts.compliance);
    let friction = load_four(simd, &contacts.friction);
    let open = x.simd_ge(zero);
    let rough = !friction.simd_eq(zero);
    let det = nn * tt - nt * nt;
    let regular = det.simd_gt(f64x4::splat(simd, 1e-14) * nn * tt);
    let stick = [(y * nt - x * tt) / det, (x * nt - y * nn) / det];
    let in_cone = stick[1].abs().simd_le(friction * stick[0]);
    let sticks = regular & rough & stick[0].simd_ge(zero) & in_cone;
    // in a heap at rest hardly any contact slips
    if (open | sticks).all_true() {
        return [open.select(zero, stick[0]), open.select(zero, stick[1])];
    }
    let up = (regular & stick[1].simd_gt(zero)) | (!regular & y.simd_lt(zero));
    let one = f64x4::splat(simd, 1.0);
    let side = up.select(one, -one);
    let system = [nn, nt, tt, friction];
    let first = Slip::of(system, free, side, zero);
    // a block without friction neither sticks nor has a second side
    let first_solves = (first.valid & first.violation.simd_le(zero)) | !rough;
    let mut slip = first.impulse;
    if !(open | sticks | first_solves).all_true() {
        let second = Slip::of(system, free, -side, zero);
        slip = first.or(second, first_solves, zero);
    }
    let slip = [slip[0], rough.select(slip[1], zero)];
    [
        open.select(zero, sticks.select(stick[0], slip[0])),
        open.select(zero, sticks.select(stick[1], slip[1])),
    ]
}

/// Slip towards one side of the cone, for each contact.
pub(crate) struct Slip<S: Simd> {
    pub impulse: [f64x4<S>; 2],
    /// Whether the impulse exists.
    pub valid: mask64x4<S>,
    /// `s ξ_T`, at most 0 if it obeys the law.
    pub violation: f64x4<S>,
}

impl<S: Simd> Slip<S> {
    #[inline(always)]
    fn of(
        [nn, nt, tt, friction]: [f64x4<S>; 4],
        [x, y]: [f64x4<S>; 2],
        side: f64x4<S>,
        zero: f64x4<S>,
    ) -> Self {
        let share = side * friction;
        let denominator = nn + share * nt;
        let normal = -x / denominator;
        let slip = y + (nt + share * tt) * normal;
        Slip {
            impulse: [normal, share * normal],
            valid: denominator.simd_gt(zero),
            violation: side * slip,
        }
    }

    /// The impulse of this slip where `solves`, else that of the side with the smaller violation, which
    /// wins against round-off; 0 where neither exists.
    #[inline(always)]
    pub fn or(self, second: Self, solves: mask64x4<S>, zero: f64x4<S>) -> [f64x4<S>; 2] {
        let never = f64x4::splat(zero.simd, f64::INFINITY);
        let counts = self.valid & self.violation.simd_lt(never);
        let least = counts.select(self.violation, never);
        let less = second.violation.simd_le(zero) | second.violation.simd_lt(least);
        let takes_second = second.valid & less & !solves;
        let takes_first = solves | counts;
        let [p, q] = [self.impulse, second.impulse];
        [
            takes_second.select(q[0], takes_first.select(p[0], zero)),
            takes_second.select(q[1], takes_first.select(p[1], zero)),
        ]
    }
}

/// Every instruction set that this machine has and the crate was built for.
#[cfg(test)]
pub(crate) fn levels() -> Vec<fearless_simd::Level> {
    use fearless_simd::Level;
    let mut levels = vec![Level::baseline(), Level::new()];
    #[cfg(target_arch = "x86_64")]
    levels.extend(Level::new().as_avx2().map(Level::Avx2));
    levels
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Law, Mat2, Vec2, solve_local};
    use fearless_simd::{Level, dispatch};
    use proptest::prelude::*;

    fn four(level: Level, contacts: &FourContacts, free: [Four; 2]) -> [Four; 2] {
        dispatch!(level, simd => {
            let free = [load_four(simd, &free[0]), load_four(simd, &free[1])];
            let p = solve_four(simd, contacts, free);
            let mut out = [[0.0; 4]; 2];
            p[0].store_slice(&mut out[0]);
            p[1].store_slice(&mut out[1]);
            out
        })
    }

    /// Compares four contacts with each contact alone, at every level.
    fn check(blocks: [Mat2; 4], free: [Vec2; 4], law: [(f64, f64); 4]) {
        let contacts = FourContacts {
            nn: blocks.map(|g| g[(0, 0)]),
            nt: blocks.map(|g| g[(0, 1)]),
            tt: blocks.map(|g| g[(1, 1)]),
            friction: law.map(|l| l.0),
            compliance: law.map(|l| l.1),
        };
        for level in levels() {
            let found = four(level, &contacts, [free.map(|b| b.x), free.map(|b| b.y)]);
            for k in 0..4 {
                let (friction, compliance) = law[k];
                let law = Law::Contact {
                    friction,
                    compliance,
                };
                let alone = solve_local(&blocks[k], free[k], &law);
                let bits = [found[0][k].to_bits(), found[1][k].to_bits()];
                assert_eq!(
                    bits,
                    [alone.x.to_bits(), alone.y.to_bits()],
                    "{level:?}: {} {} {law:?}: {alone} against {} {}",
                    blocks[k],
                    free[k],
                    found[0][k],
                    found[1][k]
                );
            }
        }
    }

    proptest! {
        /// Far beyond Painlevé's limit, and with blocks of rank one.
        #[test]
        fn four_contacts_are_solved_as_each_alone(
            l in prop::array::uniform4(prop::array::uniform3(-1.0f64..1.0)),
            rank_one in prop::array::uniform4(prop::bool::weighted(0.2)),
            free in prop::array::uniform4(prop::array::uniform2(
                prop_oneof![4 => -5.0f64..5.0, 1 => Just(0.0), 1 => Just(-0.0)])),
            friction in prop::array::uniform4(prop_oneof![Just(0.0), 0.0f64..1.5, 0.0f64..20.0]),
            compliance in prop::array::uniform4(prop_oneof![Just(0.0), 0.0f64..2.0]),
        ) {
            let block = |k: usize| {
                let ([a, b, c], d) = (l[k], if rank_one[k] { 0.0 } else { 0.2 });
                let c = if rank_one[k] { 0.0 } else { c };
                Mat2::new(a * a + d, a * b, a * b, b * b + c * c + d)
            };
            let laws = [0, 1, 2, 3].map(|k| (friction[k], compliance[k]));
            check([0, 1, 2, 3].map(block), free.map(Vec2::from), laws);
        }
    }

    /// A block without coupling, whose sticking impulse is −0 along the tangent; Painlevé's three
    /// solutions; a NaN velocity; no contacts.
    #[test]
    fn corner_cases_are_solved_as_each_alone() {
        let painleve = Mat2::new(1.6, -1.2, -1.2, 3.4);
        check(
            [Mat2::identity(), painleve, painleve, Mat2::identity()],
            [
                Vec2::new(-1.0, 0.0),
                Vec2::new(0.05, -3.0),
                Vec2::new(-0.05, -3.0),
                Vec2::zeros(),
            ],
            [(0.5, 0.0), (2.0, 0.0), (2.0, 0.0), (0.0, 0.0)],
        );
        check(
            [painleve; 4],
            [
                Vec2::new(f64::NAN, 1.0),
                Vec2::new(-1.0, f64::NAN),
                Vec2::new(-1.0, 1e300),
                Vec2::new(f64::NEG_INFINITY, 0.0),
            ],
            [(2.0, 0.0), (0.7, 0.0), (0.7, 0.0), (0.1, 0.5)],
        );
    }
}
