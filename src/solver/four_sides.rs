//! What the two sweeps over four blocks at a time share: bodies and directions of four contacts, and
//! blocks that must be solved alone.

use crate::contact::{
    BodyOperator, ContactProblem, Four, Law, Mat2, NO_BODY, Rows, Vec2, Vec3, load_four,
    solve_local,
};
use fearless_simd::{Select, Simd, SimdBase, f64x4};

/// (v_x, v_y, ω) and the inverse of the mass.
pub(super) type Body = [f64; 4];

/// Bodies and rows of four contacts that share no body.
#[derive(Debug, Clone, Default)]
pub(super) struct FourSides {
    bodies: [[u32; 4]; 2],
    /// `n` on side 2; `t` is `n` turned by 90 degrees. Side 1 has the opposite sign.
    pub normal: [Four; 2],
    /// Angular parts of the rows (n, t), for each side.
    pub arms: [[Four; 2]; 2],
    inverse_inertia: [Four; 2],
}

impl FourSides {
    /// Four open contacts of the body that does not move, the last of all bodies.
    pub fn of(still: u32) -> Self {
        FourSides {
            bodies: [[still; 4]; 2],
            ..FourSides::default()
        }
    }

    /// Puts a contact in place of one of the four.
    pub fn put(&mut self, lane: usize, rows: &Rows, inverse_mass: &[Vec3]) {
        for (side, &body) in rows.bodies.iter().enumerate() {
            if body == NO_BODY {
                continue;
            }
            self.bodies[side][lane] = body;
            let [n, t] = &rows.jacobian[side];
            let sign = if side == 0 { -1.0 } else { 1.0 };
            self.normal[0][lane] = sign * n.x;
            self.normal[1][lane] = sign * n.y;
            self.arms[side][0][lane] = n.z;
            self.arms[side][1][lane] = t.z;
            self.inverse_inertia[side][lane] = inverse_mass[body as usize].z;
        }
    }

    /// The bodies of each side, component by component.
    #[inline(always)]
    pub fn velocities<S: Simd>(&self, simd: S, bodies: &[Body]) -> [[f64x4<S>; 4]; 2] {
        let [first, second] = &self.bodies;
        [read(simd, bodies, first), read(simd, bodies, second)]
    }

    /// Changes the velocities of the bodies from `[u1, u2]` by impulses `delta` \[N s\].
    #[inline(always)]
    pub fn push<S: Simd>(
        &self,
        simd: S,
        bodies: &mut [Body],
        [u1, u2]: [[f64x4<S>; 4]; 2],
        delta: [f64x4<S>; 2],
    ) {
        let n = load_pair(simd, &self.normal);
        let t = [-n[1], n[0]];
        // velocity changes of side 2; side 1 gets the opposite sign
        let linear = [
            n[0] * delta[0] + t[0] * delta[1],
            n[1] * delta[0] + t[1] * delta[1],
        ];
        let [a1, a2] = [
            load_pair(simd, &self.arms[0]),
            load_pair(simd, &self.arms[1]),
        ];
        let inertia = load_pair(simd, &self.inverse_inertia);
        let spins = [
            u1[2] + (a1[0] * delta[0] + a1[1] * delta[1]) * inertia[0],
            u2[2] + (a2[0] * delta[0] + a2[1] * delta[1]) * inertia[1],
        ];
        let after = [
            u1[0] - linear[0] * u1[3],
            u1[1] - linear[1] * u1[3],
            spins[0],
            u1[3],
        ];
        write(bodies, &self.bodies[0], after);
        let after = [
            u2[0] + linear[0] * u2[3],
            u2[1] + linear[1] * u2[3],
            spins[1],
            u2[3],
        ];
        write(bodies, &self.bodies[1], after);
        // the body that does not move stays at zero, whatever overflows
        if let Some(still) = bodies.last_mut() {
            *still = [0.0; 4];
        }
    }
}

/// Loads four bodies, component by component.
#[inline(always)]
fn read<S: Simd>(simd: S, bodies: &[Body], own: &[u32; 4]) -> [f64x4<S>; 4] {
    let a = load_four(simd, &bodies[own[0] as usize]);
    let b = load_four(simd, &bodies[own[1] as usize]);
    let c = load_four(simd, &bodies[own[2] as usize]);
    let d = load_four(simd, &bodies[own[3] as usize]);
    transposed([a, b, c, d])
}

/// Stores four bodies.
#[inline(always)]
fn write<S: Simd>(bodies: &mut [Body], own: &[u32; 4], numbers: [f64x4<S>; 4]) {
    let [a, b, c, d] = transposed(numbers);
    a.store_slice(&mut bodies[own[0] as usize]);
    b.store_slice(&mut bodies[own[1] as usize]);
    c.store_slice(&mut bodies[own[2] as usize]);
    d.store_slice(&mut bodies[own[3] as usize]);
}

/// The transpose of a matrix of 4 × 4.
#[inline(always)]
fn transposed<S: Simd>([a, b, c, d]: [f64x4<S>; 4]) -> [f64x4<S>; 4] {
    let (low, high) = ((a.zip_low(c), b.zip_low(d)), (a.zip_high(c), b.zip_high(d)));
    [
        low.0.zip_low(low.1),
        low.0.zip_high(low.1),
        high.0.zip_low(high.1),
        high.0.zip_high(high.1),
    ]
}

/// The larger of two numbers; the second if either is NaN. Gives the same result on every machine.
#[inline(always)]
pub(super) fn larger<S: Simd>(a: f64x4<S>, b: f64x4<S>) -> f64x4<S> {
    a.simd_gt(b).select(a, b)
}

/// Two rows of four numbers, as vectors.
#[inline(always)]
pub(super) fn load_pair<S: Simd>(simd: S, [n, t]: &[Four; 2]) -> [f64x4<S>; 2] {
    [load_four(simd, n), load_four(simd, t)]
}

/// Whether a block is not a contact between points in the plane, or one of its bodies has different
/// masses along x and y.
pub(super) fn is_alone(problem: &ContactProblem, op: &BodyOperator, i: usize) -> bool {
    let rows = &op.rows[i];
    let [[n1, t1], [n2, t2]] = &rows.jacobian;
    let [a, b] = rows.bodies;
    let (n, t) = if b == NO_BODY { (-n1, -t1) } else { (*n2, *t2) };
    let opposite = a == NO_BODY || (n1.xy(), t1.xy()) == (-n.xy(), -t.xy());
    let heavy = |&body: &u32| {
        op.inverse_mass
            .get(body as usize)
            .is_none_or(|m| m.x == m.y)
    };
    let between_points = a != b && opposite && (t.x, t.y) == (-n.y, n.x);
    !(matches!(problem.laws[i], Law::Contact { .. })
        && between_points
        && rows.bodies.iter().all(heavy))
}

/// Solves a block, with its `old` impulse and `b_i`, by the general rule. Returns its new impulse, and
/// change and scale of its velocity \[m/s\].
pub(super) fn solve_alone(
    (old, free): (Vec2, Vec2),
    (rows, block, law): (&Rows, &Mat2, &Law),
    inverse_mass: &[Vec3],
    bodies: &mut [Body],
) -> (Vec2, [f64; 2]) {
    // a system of its own bodies, of one if both sides are the same
    let [a, b] = rows.bodies;
    let number = |body: u32, own: u32| if body == NO_BODY { body } else { own };
    let own = Rows {
        bodies: [number(a, 0), number(b, u32::from(a != b))],
        ..*rows
    };
    let mut u = [Vec3::zeros(); 2];
    let mut m = [Vec3::zeros(); 2];
    for (from, to) in rows.bodies.into_iter().zip(own.bodies) {
        if from != NO_BODY {
            let [x, y, spin, _] = bodies[from as usize];
            u[to as usize] = Vec3::new(x, y, spin);
            m[to as usize] = inverse_mass[from as usize];
        }
    }
    let new = solve_local(block, own.velocity(&u) + free - block * old, law);
    let delta = new - old;
    let scale = new.amax() * block.trace();
    if delta == Vec2::zeros() {
        return (old, [0.0, scale]);
    }
    own.push(delta, &m, &mut u);
    for (to, from) in rows.bodies.into_iter().zip(own.bodies) {
        if to != NO_BODY {
            let (u, body) = (u[from as usize], &mut bodies[to as usize]);
            (body[0], body[1], body[2]) = (u.x, u.y, u.z);
        }
    }
    (new, [delta.amax() * block.trace(), scale])
}
