use crate::contact::{
    BlockMatrix, BodyOperator, ContactProblem, Delassus, Mat2, NO_BODY, Rows, Vec2, Vec3,
};
use crate::linalg::{BlockLdu, Place};
use nalgebra::Matrix3;

/// Solves for the velocities of a contact problem whose impulses respond linearly to them, block by
/// block.
///
/// With impulses `r`, gains `A_i` (2 × 2, need not be symmetric) and offsets `g`, one Newton step
/// of the status method, and one of the interior point, is
///
/// ```text
/// dr = g − A h,   h = J dv,   M (v + dv) = Jᵀ (r + dr)                        (1)
/// ```
///
/// where `v` is the velocity that the impulses add to the free velocity. For bodies it is solved in
/// velocity space, `K dv = Jᵀ (r + g) − M v` with `K = M + Jᵀ A J`: sparse, and linear in a chain.
/// Velocities are scaled by `M^½`, so that `M` is the identity and a locked coordinate a zero
/// column. For an explicit operator it is `(I + G A) h = G (r + g) − ν`, `ν = J v`: sparse as well,
/// over the contacts that share a body. Neither form pivots between blocks: with symmetric gains
/// `G + A⁻¹` needs no pivoting.
#[derive(Debug, Clone, Default)]
pub(super) struct Response {
    /// Whether the symbolic factorisation is done for this problem.
    ready: bool,
    fits: bool,
    /// Rows of the problem and the last factors.
    factored: Factored,
    /// Factorisations so far.
    count: usize,
    /// `M^−½` of every body.
    roots: Vec<Vec3>,
    pairs: Vec<(u32, u32)>,
    /// Position of each block's coupling in the factor.
    places: Vec<Option<Place>>,
    velocity: Vec<Vec3>,
    change: Vec<Vec3>,
    stored: Vec<Vec3>,
    explicit: Explicit,
}

/// A factorised system over bodies.
#[derive(Debug, Clone, Default)]
pub(super) struct Factored {
    pub bodies: usize,
    /// Scaled by `M^−½`.
    pub rows: Vec<Rows>,
    /// `A` \[kg\], one per block, if the user of the factors stores them.
    pub gains: Vec<Mat2>,
    factor: BlockLdu<3>,
}

impl Factored {
    /// Solves (1) of a similar problem approximately, with the factors of this one.
    ///
    /// `velocities` is the `v` of that problem, `change` becomes its `dv`; both unscaled.
    pub fn solve(
        &mut self,
        op: &BodyOperator,
        velocities: &[Vec3],
        targets: &[Vec2],
        change: &mut Vec<Vec3>,
    ) {
        change.clear();
        change.resize(velocities.len(), Vec3::zeros());
        for (rows, &p) in op.rows.iter().zip(targets) {
            if p != Vec2::zeros() {
                push(rows, p, change);
            }
        }
        for ((x, v), w) in change.iter_mut().zip(velocities).zip(&op.inverse_mass) {
            let scaled = |k: usize| match w[k].sqrt() {
                0.0 => 0.0,
                root => root * x[k] - v[k] / root,
            };
            *x = Vec3::new(scaled(0), scaled(1), scaled(2));
        }
        self.factor.solve(change);
        for (x, w) in change.iter_mut().zip(&op.inverse_mass) {
            *x = x.zip_map(w, |x, w| w.sqrt() * x);
        }
    }
}

/// The system of an explicit operator.
#[derive(Debug, Clone, Default)]
struct Explicit {
    factor: BlockLdu<2>,
    /// Positions of the off-diagonal blocks in the factor, in the operator's order.
    places: Vec<Place>,
    velocity: Vec<Vec2>,
    change: Vec<Vec2>,
    stored: Vec<Vec2>,
}

impl Response {
    /// Switches to another problem.
    pub fn prepare(&mut self, problem: &ContactProblem) {
        let own = &mut self.factored;
        own.rows.clear();
        own.bodies = 0;
        self.ready = false;
        if let Delassus::Bodies(op) = &problem.operator {
            own.bodies = op.inverse_mass.len();
            self.roots.clear();
            let roots = op.inverse_mass.iter().map(|w| w.map(f64::sqrt));
            self.roots.extend(roots);
            own.rows
                .extend(op.rows.iter().map(|r| scaled(r, &self.roots)));
        }
    }

    /// Does the symbolic factorisation if it is not done yet. It is reused while the same bodies
    /// are coupled. Blocks for which `has_gain` returns false never get a gain and are left out.
    fn make_ready(&mut self, has_gain: impl Fn(usize) -> bool) {
        if self.ready {
            return;
        }
        self.ready = true;
        let own = &mut self.factored;
        let couples = |(i, rows): (usize, &Rows)| coupled(rows).filter(|_| has_gain(i));
        self.pairs.clear();
        self.pairs
            .extend(own.rows.iter().enumerate().filter_map(couples));
        self.pairs.sort_unstable();
        self.pairs.dedup();
        self.fits = own.factor.prepare(own.bodies, &self.pairs).is_ok();
        self.places.clear();
        if self.fits {
            let factor = &own.factor;
            let place = |[a, b]: [u32; 2]| factor.place(a as usize, b as usize);
            let rows = own.rows.iter().enumerate();
            self.places
                .extend(rows.map(|(i, r)| couples((i, r)).map(|_| place(r.bodies))));
        }
    }

    /// Factorises the system of the given rows and gains; `None` if it is singular or too large.
    /// With `closed_only` it leaves out pairs of bodies that no gain couples; these can then never
    /// be coupled.
    pub fn factored(
        bodies: usize,
        rows: Vec<Rows>,
        gains: Vec<Mat2>,
        closed_only: bool,
    ) -> Option<Factored> {
        let mut response = Response::default();
        (response.factored.bodies, response.factored.rows) = (bodies, rows);
        response.make_ready(|i| !closed_only || gains[i] != Mat2::zeros());
        let made = response.factorise_bodies(&gains);
        response.factored.gains = gains;
        made.then_some(response.factored)
    }

    /// Exchanges the factors and their rows. Another problem must be prepared next.
    pub fn exchange(&mut self, other: &mut Factored) {
        std::mem::swap(&mut self.factored, other);
        self.ready = false;
    }

    /// Number of factorisations so far. It shows whether the factors have changed since.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Sets `M v = Jᵀ r`.
    pub fn start(&mut self, problem: &ContactProblem, impulses: &[Vec2]) {
        match &problem.operator {
            Delassus::Bodies(_) => {
                self.velocity.clear();
                self.velocity.resize(self.factored.bodies, Vec3::zeros());
                for (rows, &p) in self.factored.rows.iter().zip(impulses) {
                    if p != Vec2::zeros() {
                        push(rows, p, &mut self.velocity);
                    }
                }
            }
            Delassus::Blocks(matrix) => matrix.apply(impulses, &mut self.explicit.velocity),
        }
    }

    /// Stores the present velocities for [`Response::restore`].
    pub fn store(&mut self) {
        self.stored.clone_from(&self.velocity);
        self.explicit.stored.clone_from(&self.explicit.velocity);
    }

    /// Restores the velocities stored last.
    pub fn restore(&mut self) {
        self.velocity.clone_from(&self.stored);
        self.explicit.velocity.clone_from(&self.explicit.stored);
    }

    /// `(J v)_i` \[m/s\].
    pub fn velocity(&self, i: usize) -> Vec2 {
        match self.factored.rows.get(i) {
            Some(rows) => rows.velocity(&self.velocity),
            None => self.explicit.velocity[i],
        }
    }

    /// Factorises for the gains `A` \[kg\], one per block. Returns `false` if the system is
    /// singular or its factors are too large.
    pub fn factorise(&mut self, problem: &ContactProblem, gains: &[Mat2]) -> bool {
        self.count += 1;
        match &problem.operator {
            Delassus::Blocks(matrix) => self.factorise_explicit(matrix, gains),
            Delassus::Bodies(_) => self.factorise_bodies(gains),
        }
    }

    fn factorise_explicit(&mut self, matrix: &BlockMatrix, gains: &[Mat2]) -> bool {
        if !self.ready {
            self.fits = self.explicit.prepare(matrix);
            self.ready = true;
        }
        self.fits && self.explicit.factorise(matrix, gains)
    }

    fn factorise_bodies(&mut self, gains: &[Mat2]) -> bool {
        self.make_ready(|_| true);
        if !self.fits {
            return false;
        }
        let symmetric = gains.iter().all(|a| a[(0, 1)] == a[(1, 0)]);
        let Factored {
            bodies,
            rows,
            factor,
            ..
        } = &mut self.factored;
        factor.clear(symmetric);
        for body in 0..*bodies {
            factor.add_diagonal(body, &Matrix3::identity());
        }
        for ((rows, gain), place) in rows.iter().zip(gains).zip(&self.places) {
            if *gain == Mat2::zeros() {
                continue;
            }
            let weighted = [0, 1].map(|side| {
                let j = &rows.jacobian[side];
                [0, 1].map(|k| j[0] * gain[(0, k)] + j[1] * gain[(1, k)])
            });
            let block = |a: usize, b: usize| {
                let j = &rows.jacobian[b];
                weighted[a][0] * j[0].transpose() + weighted[a][1] * j[1].transpose()
            };
            for side in 0..2 {
                if rows.bodies[side] != NO_BODY {
                    factor.add_diagonal(rows.bodies[side] as usize, &block(side, side));
                }
            }
            if let Some(place) = place {
                let ab = block(0, 1);
                let ba = if symmetric {
                    ab.transpose()
                } else {
                    block(1, 0)
                };
                factor.add_coupling(*place, &ab, &ba);
            } else if rows.bodies[0] == rows.bodies[1] && rows.bodies[0] != NO_BODY {
                let both = block(0, 1) + block(1, 0);
                factor.add_diagonal(rows.bodies[0] as usize, &both);
            }
        }
        factor.factorise()
    }

    /// Solves (1) for `targets = r + g` [N s].
    pub fn solve(&mut self, problem: &ContactProblem, targets: &[Vec2]) {
        match &problem.operator {
            Delassus::Bodies(_) => {
                self.change.clear();
                self.change.extend(self.velocity.iter().map(|v| -v));
                for (rows, &p) in self.factored.rows.iter().zip(targets) {
                    push(rows, p, &mut self.change);
                }
                self.factored.factor.solve(&mut self.change);
            }
            Delassus::Blocks(matrix) => {
                let explicit = &mut self.explicit;
                matrix.apply(targets, &mut explicit.change);
                for (h, v) in explicit.change.iter_mut().zip(&explicit.velocity) {
                    *h -= v;
                }
                explicit.factor.solve(&mut explicit.change);
            }
        }
    }

    /// `h_i` \[m/s\] of the last solve.
    pub fn change(&self, i: usize) -> Vec2 {
        match self.factored.rows.get(i) {
            Some(rows) => rows.velocity(&self.change),
            None => self.explicit.change[i],
        }
    }

    /// `v ← v + step dv`.
    pub fn advance(&mut self, step: f64) {
        for (v, dv) in self.velocity.iter_mut().zip(&self.change) {
            *v += dv * step;
        }
        if self.factored.rows.is_empty() {
            let explicit = &mut self.explicit;
            for (v, dv) in explicit.velocity.iter_mut().zip(&explicit.change) {
                *v += dv * step;
            }
        }
    }
}

impl Explicit {
    /// Does the symbolic factorisation. Returns whether the factors fit in memory.
    fn prepare(&mut self, matrix: &BlockMatrix) -> bool {
        self.places.clear();
        if (self.factor.prepare(matrix.size(), &matrix.pairs())).is_err() {
            return false;
        }
        for j in 0..matrix.size() {
            let others = matrix.column(j).filter(|(i, _)| *i != j);
            self.places
                .extend(others.map(|(i, _)| self.factor.place(i, j)));
        }
        true
    }

    /// Factorises `I + G A`.
    fn factorise(&mut self, matrix: &BlockMatrix, gains: &[Mat2]) -> bool {
        self.factor.clear(false);
        let mut places = self.places.iter();
        for (j, gain) in gains.iter().enumerate() {
            self.factor.add_diagonal(j, &Mat2::identity());
            for (i, block) in matrix.column(j) {
                if i == j {
                    self.factor.add_diagonal(j, &(block * gain));
                } else if let Some(place) = places.next() {
                    self.factor.add(*place, &(block * gain));
                }
            }
        }
        self.factor.factorise()
    }
}

/// The two different bodies that a block couples, in ascending order.
fn coupled(rows: &Rows) -> Option<(u32, u32)> {
    let [a, b] = rows.bodies;
    (a != NO_BODY && b != NO_BODY && a != b).then_some((a.min(b), a.max(b)))
}

fn scaled(rows: &Rows, roots: &[Vec3]) -> Rows {
    let mut rows = *rows;
    for (side, &body) in rows.jacobian.iter_mut().zip(&rows.bodies) {
        if body != NO_BODY {
            *side = side.map(|row| row.component_mul(&roots[body as usize]));
        }
    }
    rows
}

fn push(rows: &Rows, p: Vec2, velocity: &mut [Vec3]) {
    for (j, &body) in rows.jacobian.iter().zip(&rows.bodies) {
        if body != NO_BODY {
            velocity[body as usize] += j[0] * p.x + j[1] * p.y;
        }
    }
}
