use super::{BlockMatrix, Law, Mat2, Vec2, Vec3};
use nalgebra::DMatrix;
use std::borrow::Cow;

/// Marks a side of a contact that belongs to no body of finite mass.
pub const NO_BODY: u32 = u32::MAX;

/// Jacobian rows of one block: local velocity `γ = J₁ u₁ + J₂ u₂`.
///
/// The rows include the sign of the side: for a contact side 1 holds `−(n, r₁ × n)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rows {
    /// Index of the body of each side, or [`NO_BODY`].
    pub bodies: [u32; 2],
    /// `jacobian\[side\]\[row\]`, rows (n, t).
    pub jacobian: [[Vec3; 2]; 2],
}

impl Rows {
    /// `γ` \[m/s\] at the given generalised velocities.
    #[inline]
    pub fn velocity(&self, velocities: &[Vec3]) -> Vec2 {
        let mut gamma = Vec2::zeros();
        for side in 0..2 {
            let body = self.bodies[side];
            if body != NO_BODY {
                let u = &velocities[body as usize];
                gamma.x += self.jacobian[side][0].dot(u);
                gamma.y += self.jacobian[side][1].dot(u);
            }
        }
        gamma
    }

    /// `u ← u + M⁻¹ Wᵀ P`.
    #[inline]
    pub fn push(&self, impulse: Vec2, inverse_mass: &[Vec3], velocities: &mut [Vec3]) {
        for side in 0..2 {
            let body = self.bodies[side];
            if body != NO_BODY {
                let j = &self.jacobian[side];
                let generalised = j[0] * impulse.x + j[1] * impulse.y;
                velocities[body as usize] +=
                    generalised.component_mul(&inverse_mass[body as usize]);
            }
        }
    }

    /// `J_a M⁻¹ J_bᵀ` summed over the bodies that the two blocks share [1/kg].
    pub fn coupling(&self, other: &Rows, inverse_mass: &[Vec3]) -> Mat2 {
        let mut block = Mat2::zeros();
        for a in 0..2 {
            for b in 0..2 {
                let body = self.bodies[a];
                if body == NO_BODY || body != other.bodies[b] {
                    continue;
                }
                let m = &inverse_mass[body as usize];
                for i in 0..2 {
                    for k in 0..2 {
                        block[(i, k)] += self.jacobian[a][i]
                            .component_mul(m)
                            .dot(&other.jacobian[b][k]);
                    }
                }
            }
        }
        block
    }

    /// The coupling of the block with itself [1/kg].
    #[inline]
    pub fn diagonal(&self, inverse_mass: &[Vec3]) -> Mat2 {
        if self.bodies[0] == self.bodies[1] {
            return self.coupling(self, inverse_mass);
        }
        let [mut nn, mut nt, mut tt] = [0.0; 3];
        for (&body, [n, t]) in self.bodies.iter().zip(&self.jacobian) {
            if body != NO_BODY {
                let weighted = n.component_mul(&inverse_mass[body as usize]);
                nn += weighted.dot(n);
                nt += weighted.dot(t);
                tt += t.component_mul(&inverse_mass[body as usize]).dot(t);
            }
        }
        Mat2::new(nn, nt, nt, tt)
    }
}

/// `G = J M⁻¹ Jᵀ` stored as bodies and rows. The cost of a sweep is linear in the number of
/// contacts.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BodyOperator {
    /// Inverse of the diagonal mass matrix, (1/m, 1/m, 1/J) per body; 0 locks a coordinate.
    pub inverse_mass: Vec<Vec3>,
    /// One entry per block.
    pub rows: Vec<Rows>,
}

impl BodyOperator {
    /// The explicit blocks `G_ij` of all pairs of blocks that share a body.
    pub fn blocks(&self) -> BlockMatrix {
        let mut on_body = vec![Vec::new(); self.inverse_mass.len()];
        for (i, rows) in self.rows.iter().enumerate() {
            let [a, b] = rows.bodies;
            for body in [Some(a), Some(b).filter(|b| *b != a)].into_iter().flatten() {
                if body != NO_BODY {
                    on_body[body as usize].push(i as u32);
                }
            }
        }
        let mut blocks = Vec::new();
        let mut coupled = Vec::new();
        for (j, rows) in self.rows.iter().enumerate() {
            coupled.clear();
            for body in rows.bodies.into_iter().filter(|b| *b != NO_BODY) {
                coupled.extend_from_slice(&on_body[body as usize]);
            }
            coupled.sort_unstable();
            coupled.dedup();
            for &i in &coupled {
                let block = self.rows[i as usize].coupling(rows, &self.inverse_mass);
                blocks.push((i, j as u32, block));
            }
        }
        BlockMatrix::from_blocks(self.rows.len(), blocks)
    }
}

/// The Delassus operator `G` [1/kg] of a contact problem.
#[derive(Debug, Clone, PartialEq)]
pub enum Delassus {
    /// From bodies and Jacobian rows.
    Bodies(BodyOperator),
    /// Explicit, n × n blocks, symmetric, rows (n, t) per block.
    Blocks(BlockMatrix),
}

/// The state of a sweep: body velocities `M⁻¹ Jᵀ P` or local velocities `G P`.
#[derive(Debug, Clone, Default)]
pub struct SweepState {
    bodies: Vec<Vec3>,
    local: Vec<Vec2>,
}

impl SweepState {
    /// `M⁻¹ Jᵀ P` of every body; empty for an explicit operator.
    pub(crate) fn bodies(&self) -> &[Vec3] {
        &self.bodies
    }

    /// Restarts from the impulses that `impulse` returns for each block.
    pub(super) fn restart(
        &mut self,
        op: &BodyOperator,
        mut impulse: impl FnMut(usize, &Rows) -> Vec2,
    ) {
        self.bodies.clear();
        self.bodies.resize(op.inverse_mass.len(), Vec3::zeros());
        for (i, rows) in op.rows.iter().enumerate() {
            let p = impulse(i, rows);
            if p != Vec2::zeros() {
                rows.push(p, &op.inverse_mass, &mut self.bodies);
            }
        }
    }
}

impl Default for Delassus {
    /// No bodies and no blocks.
    fn default() -> Self {
        Delassus::Bodies(BodyOperator::default())
    }
}

impl Delassus {
    /// An explicit operator from a full matrix, 2n × 2n.
    ///
    /// # Panics
    /// If the matrix is not square with an even number of rows.
    pub fn dense(matrix: DMatrix<f64>) -> Self {
        Delassus::Blocks(BlockMatrix::from_dense(&matrix))
    }

    /// Number of blocks.
    pub fn blocks(&self) -> usize {
        match self {
            Delassus::Bodies(op) => op.rows.len(),
            Delassus::Blocks(m) => m.size(),
        }
    }

    /// `G_ii`.
    pub fn diagonal(&self, i: usize) -> Mat2 {
        match self {
            Delassus::Bodies(op) => op.rows[i].diagonal(&op.inverse_mass),
            Delassus::Blocks(m) => m.block(i, i),
        }
    }

    /// `G_ij`.
    pub fn block(&self, i: usize, j: usize) -> Mat2 {
        match self {
            Delassus::Bodies(op) => op.rows[i].coupling(&op.rows[j], &op.inverse_mass),
            Delassus::Blocks(m) => m.block(i, j),
        }
    }

    /// `G P` \[m/s\].
    pub fn apply(&self, impulses: &[Vec2]) -> Vec<Vec2> {
        let state = self.start(impulses);
        (0..self.blocks()).map(|i| self.read(i, &state)).collect()
    }

    /// State of a sweep that starts from `impulses`.
    pub fn start(&self, impulses: &[Vec2]) -> SweepState {
        let mut state = SweepState::default();
        self.restart(impulses, &mut state);
        state
    }

    /// As [`Delassus::start`], in existing buffers.
    pub fn restart(&self, impulses: &[Vec2], state: &mut SweepState) {
        match self {
            Delassus::Bodies(op) => state.restart(op, |i, _| impulses[i]),
            Delassus::Blocks(m) => m.apply(impulses, &mut state.local),
        }
    }

    /// `(G P)_i` in the current state.
    #[inline]
    pub fn read(&self, i: usize, state: &SweepState) -> Vec2 {
        match self {
            Delassus::Bodies(op) => op.rows[i].velocity(&state.bodies),
            Delassus::Blocks(_) => state.local[i],
        }
    }

    /// Adds `change` to impulse `i`.
    #[inline]
    pub fn push(&self, i: usize, change: Vec2, state: &mut SweepState) {
        match self {
            Delassus::Bodies(op) => {
                op.rows[i].push(change, &op.inverse_mass, &mut state.bodies);
            }
            Delassus::Blocks(m) => m.add_column(i, change, &mut state.local),
        }
    }

    /// The explicit form.
    pub fn to_blocks(&self) -> Cow<'_, BlockMatrix> {
        match self {
            Delassus::Bodies(op) => Cow::Owned(op.blocks()),
            Delassus::Blocks(m) => Cow::Borrowed(m),
        }
    }

    /// Explicit full matrix, 2n × 2n, rows (n, t) per block.
    pub fn explicit(&self) -> DMatrix<f64> {
        self.assemble(&vec![Law::Pin; self.blocks()]).0
    }

    /// Explicit matrix of the rows that `laws` use, and the position of each block's first row.
    pub fn assemble(&self, laws: &[Law]) -> (DMatrix<f64>, Vec<usize>) {
        let mut first = Vec::with_capacity(laws.len());
        let mut size = 0;
        for law in laws {
            first.push(size);
            size += law.rows();
        }
        let mut matrix = DMatrix::zeros(size, size);
        for (j, b) in laws.iter().enumerate() {
            let mut put = |i: usize, block: &Mat2| {
                for c in 0..b.rows() {
                    for r in 0..laws[i].rows() {
                        matrix[(first[i] + r, first[j] + c)] = block[(r, c)];
                    }
                }
            };
            match self {
                // small problems: a list of blocks that share a body does not pay
                Delassus::Bodies(_) => (0..laws.len()).for_each(|i| put(i, &self.block(i, j))),
                Delassus::Blocks(m) => m.column(j).for_each(|(i, block)| put(i, block)),
            }
        }
        (matrix, first)
    }
}
