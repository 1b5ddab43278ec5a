use super::four_sides::{Body, FourSides, is_alone, larger, load_pair, solve_alone};
use super::groups::{Groups, NOTHING};
use crate::contact::{
    BodyOperator, ContactProblem, Four, FourContacts, Law, Mat2, Rows, Vec2, Vec3, load_four,
    solve_four,
};
use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, dispatch, f64x4};

/// Gauss-Seidel sweeps over four contacts at a time. The results equal those of one block at a time
/// to the last bit.
///
/// The data of the contacts of a group is stored side by side, 150 B per contact. Joints, motors
/// and rows other than those of a contact between points form groups of one block.
#[derive(Debug, Clone, Default)]
pub(super) struct FourSweep {
    groups: Groups,
    fours: Vec<FourRows>,
    /// All bodies, then one that does not move, for sides without a body.
    bodies: Vec<Body>,
    /// `max_i |b_i|` \[m/s\].
    free: f64,
}

/// Impulses and velocities of a [`FourSweep`].
#[derive(Debug, Clone, Default)]
pub(super) struct FourState {
    impulses: Vec<[Four; 2]>,
    bodies: Vec<Body>,
}

/// Four blocks that share no body. Groups with fewer blocks are filled up with open contacts of the
/// body that does not move.
#[derive(Debug, Clone, Default)]
struct FourRows {
    /// Whether the group has only its first block, which is not a contact between points.
    alone: bool,
    sides: FourSides,
    contacts: FourContacts,
    free: [Four; 2],
    impulses: [Four; 2],
}

impl FourSweep {
    /// Arranges the blocks of a problem. Returns `false` if few blocks can be solved at the same
    /// time, as in a tower. One block at a time is faster then.
    pub fn arrange(&mut self, problem: &ContactProblem, op: &BodyOperator) -> bool {
        let all = 0..problem.len();
        self.groups.arrange(op, all, |i| is_alone(problem, op, i));
        2 * self.groups.members().len() <= problem.len()
    }

    /// Gathers the data of the groups that were arranged last.
    ///
    /// # Arguments
    /// - `diagonal`: the blocks `G_ii` [1/kg].
    /// - `velocities`: `M⁻¹ Jᵀ P` of the bodies at `impulses`.
    pub fn gather(
        &mut self,
        problem: &ContactProblem,
        op: &BodyOperator,
        diagonal: &[Mat2],
        impulses: &[Vec2],
        velocities: &[Vec3],
    ) {
        let groups = self.groups.members();
        let still = op.inverse_mass.len() as u32;
        self.fours.clear();
        self.fours.extend(groups.iter().map(|&blocks| {
            let mut four = FourRows {
                alone: is_alone(problem, op, blocks[0] as usize),
                sides: FourSides::of(still),
                ..FourRows::default()
            };
            for (lane, &block) in blocks.iter().enumerate() {
                if block == NOTHING {
                    four.contacts.nn[lane] = 1.0;
                    four.contacts.tt[lane] = 1.0;
                } else {
                    let i = block as usize;
                    four.sides.put(lane, &op.rows[i], &op.inverse_mass);
                    four.set(lane, &diagonal[i], &problem.laws[i], problem.free[i]);
                    four.impulses[0][lane] = impulses[i].x;
                    four.impulses[1][lane] = impulses[i].y;
                }
            }
            four
        }));
        let bodies = velocities.iter().zip(&op.inverse_mass);
        self.bodies.clear();
        (self.bodies).extend(bodies.map(|(u, m)| [u.x, u.y, u.z, m.x]));
        self.bodies.push([0.0; 4]);
        self.free = problem.free.iter().map(|b| b.amax()).fold(0.0, f64::max);
    }

    /// One sweep. Returns the largest change of a local velocity, and the largest velocity to
    /// compare it with \[m/s\].
    pub fn sweep(
        &mut self,
        level: Level,
        problem: &ContactProblem,
        op: &BodyOperator,
        diagonal: &[Mat2],
        backwards: bool,
    ) -> [f64; 2] {
        let of = (problem, op, diagonal);
        let fours = self.fours.iter_mut().zip(self.groups.members());
        let bodies = &mut self.bodies[..];
        let [change, scale] = dispatch!(level, simd => if backwards {
            pass(simd, fours.rev(), bodies, of)
        } else {
            pass(simd, fours, bodies, of)
        });
        [change, scale.max(self.free)]
    }

    /// Stores the impulses of all groups and the velocities of all bodies.
    pub fn store(&self, state: &mut FourState) {
        state.impulses.clear();
        (state.impulses).extend(self.fours.iter().map(|four| four.impulses));
        state.bodies.clone_from(&self.bodies);
    }

    /// Moves impulses and velocities on by `β` times their change since `state`, which becomes the
    /// present one.
    pub fn extrapolate(&mut self, factor: f64, state: &mut FourState) {
        let on = |now: &mut f64, before: &mut f64| {
            let next = *now + factor * (*now - *before);
            *before = std::mem::replace(now, next);
        };
        for (four, before) in self.fours.iter_mut().zip(&mut state.impulses) {
            let own = four.impulses.iter_mut().flatten();
            own.zip(before.iter_mut().flatten())
                .for_each(|(a, b)| on(a, b));
        }
        for (body, before) in self.bodies.iter_mut().zip(&mut state.bodies) {
            body.iter_mut()
                .zip(before)
                .take(3)
                .for_each(|(a, b)| on(a, b));
        }
    }

    /// `(u₀ − u)ᵀ M (u − u₁)` of all bodies \[J\], with the present velocities `u` and those of two
    /// states.
    pub fn turn(&self, op: &BodyOperator, [first, second]: [&FourState; 2]) -> f64 {
        let mass = |w: f64| if w > 0.0 { 1.0 / w } else { 0.0 };
        let bodies = self.bodies.iter().zip(&op.inverse_mass);
        let states = first.bodies.iter().zip(&second.bodies);
        let of = |((u, w), (u0, u1)): ((&Body, &Vec3), (&Body, &Body))| -> f64 {
            let one = |k: usize| mass(w[k]) * (u0[k] - u[k]) * (u[k] - u1[k]);
            one(0) + one(1) + one(2)
        };
        bodies.zip(states).map(of).sum()
    }

    /// Present velocities of the bodies.
    #[cfg(test)]
    pub fn velocities(&self) -> impl Iterator<Item = Vec3> {
        let moving = &self.bodies[..self.bodies.len() - 1];
        moving
            .iter()
            .map(|[x, y, spin, _]| Vec3::new(*x, *y, *spin))
    }

    /// Writes the impulses back to their blocks.
    pub fn write(&self, impulses: &mut [Vec2]) {
        for (four, blocks) in self.fours.iter().zip(self.groups.members()) {
            for (lane, &block) in blocks.iter().enumerate() {
                if block != NOTHING {
                    impulses[block as usize] =
                        Vec2::new(four.impulses[0][lane], four.impulses[1][lane]);
                }
            }
        }
    }
}

impl FourRows {
    fn set(&mut self, lane: usize, block: &Mat2, law: &Law, free: Vec2) {
        let contacts = &mut self.contacts;
        contacts.nn[lane] = block[(0, 0)];
        contacts.nt[lane] = block[(0, 1)];
        contacts.tt[lane] = block[(1, 1)];
        contacts.compliance[lane] = law.compliance();
        if let Law::Contact { friction, .. } = law {
            contacts.friction[lane] = *friction;
        }
        self.free[0][lane] = free.x;
        self.free[1][lane] = free.y;
    }
}

/// One sweep over the groups in the order given.
#[inline(always)]
fn pass<'a, S: Simd>(
    simd: S,
    fours: impl Iterator<Item = (&'a mut FourRows, &'a [u32; 4])>,
    bodies: &mut [Body],
    (problem, op, diagonal): (&ContactProblem, &BodyOperator, &[Mat2]),
) -> [f64; 2] {
    let mut largest = [f64x4::splat(simd, 0.0); 2];
    let mut apart = [0.0f64; 2];
    for (four, blocks) in fours {
        if four.alone {
            let i = blocks[0] as usize;
            let block = (&op.rows[i], &diagonal[i], &problem.laws[i]);
            let [change, scale] = four.step_alone(block, &op.inverse_mass, bodies);
            apart = [apart[0].max(change), apart[1].max(scale)];
        } else {
            step(simd, four, bodies, &mut largest);
        }
    }
    let of = |four: f64x4<S>, apart: f64| four.as_slice().iter().copied().fold(apart, f64::max);
    [of(largest[0], apart[0]), of(largest[1], apart[1])]
}

/// Solves four contacts: reads velocities, solves, writes velocities.
#[inline(always)]
fn step<S: Simd>(simd: S, four: &mut FourRows, bodies: &mut [Body], largest: &mut [f64x4<S>; 2]) {
    let zero = f64x4::splat(simd, 0.0);
    let [u1, u2] = four.sides.velocities(simd, bodies);
    let contacts = &four.contacts;
    let n = load_pair(simd, &four.sides.normal);
    let t = [-n[1], n[0]];
    let [a1, a2] = [
        load_pair(simd, &four.sides.arms[0]),
        load_pair(simd, &four.sides.arms[1]),
    ];

    // sums in the order of `Rows::velocity`, starting from 0, not −0
    let xi = [
        (zero + (a1[0] * u1[2] - (n[0] * u1[0] + n[1] * u1[1])))
            + (n[0] * u2[0] + n[1] * u2[1] + a2[0] * u2[2]),
        (zero + (a1[1] * u1[2] - (t[0] * u1[0] + t[1] * u1[1])))
            + (t[0] * u2[0] + t[1] * u2[1] + a2[1] * u2[2]),
    ];
    let old = load_pair(simd, &four.impulses);
    let (nn, nt, tt) = (
        load_four(simd, &contacts.nn),
        load_four(simd, &contacts.nt),
        load_four(simd, &contacts.tt),
    );
    let free = [
        xi[0] + load_four(simd, &four.free[0]) - (nn * old[0] + nt * old[1]),
        xi[1] + load_four(simd, &four.free[1]) - (nt * old[0] + tt * old[1]),
    ];
    let new = solve_four(simd, contacts, free);
    let delta = [new[0] - old[0], new[1] - old[1]];
    let trace = nn + tt;
    largest[1] = larger(larger(new[0].abs(), new[1].abs()) * trace, largest[1]);
    let moved = !(delta[0].simd_eq(zero) & delta[1].simd_eq(zero));
    if !moved.any_true() {
        return;
    }
    largest[0] = larger(larger(delta[0].abs(), delta[1].abs()) * trace, largest[0]);
    moved
        .select(new[0], old[0])
        .store_slice(&mut four.impulses[0]);
    moved
        .select(new[1], old[1])
        .store_slice(&mut four.impulses[1]);
    four.sides.push(simd, bodies, [u1, u2], delta);
}

impl FourRows {
    /// Solves a group of one block. Returns change and scale of its velocity \[m/s\].
    fn step_alone(
        &mut self,
        block: (&Rows, &Mat2, &Law),
        inverse_mass: &[Vec3],
        bodies: &mut [Body],
    ) -> [f64; 2] {
        let [old, free] = [&self.impulses, &self.free].map(|p| Vec2::new(p[0][0], p[1][0]));
        let (new, found) = solve_alone((old, free), block, inverse_mass, bodies);
        (self.impulses[0][0], self.impulses[1][0]) = (new.x, new.y);
        found
    }
}
