//! Factorisation by fronts, for matrices with many entries per column.

use super::fill::{MOST_FILL, Place};
use super::fronts::{Front, Fronts, PANEL};
use super::ordering::Graph;
use super::panel::{ALIGN, subtract_columns, subtract_product, subtract_products};
use super::pivot::Pivot;
use fearless_simd::{Level, Simd, dispatch};
use nalgebra::{SMatrix, SVector};

/// Factors of a [`BlockLdu`](super::sparse::BlockLdu) as dense panels (multifrontal).
///
/// Nodes that are coupled to the same other nodes form a front, which is eliminated as one dense
/// matrix. Its update waits on a stack for its parent. `U` is stored as its transpose, so that both
/// factors are panels of the same shape and are computed alike. A symmetric matrix needs only one
/// of them.
///
/// # Source
/// Duff, Erisman & Reid, *Direct Methods for Sparse Matrices* (2017), ch. 11 and 12.
#[derive(Debug, Clone, Default)]
pub(super) struct Frontal<const N: usize> {
    symmetric: bool,
    fronts: Fronts,
    /// Position of the diagonal block of each node, and its stride.
    diagonal: Vec<(usize, usize)>,
    pivots: Vec<Pivot<N>>,
    /// L and Uᵀ without their diagonal blocks.
    lower: Half,
    upper: Half,
    work: Vec<f64>,
    front: Vec<f64>,
}

/// A lower triangle: the panels of its fronts, and their updates by even and odd level.
#[derive(Debug, Clone, Default)]
struct Half {
    values: Vec<f64>,
    stacks: [Vec<f64>; 2],
}

impl<const N: usize> Frontal<N> {
    /// Symbolic factorisation of a graph, with its nodes eliminated approximately in the given
    /// order.
    ///
    /// Returns `false` if a factor would have more than [`MOST_FILL`] blocks; the factorisation by
    /// columns needs fewer.
    pub fn analyse(&mut self, graph: &Graph, order: &[usize]) -> bool {
        let Some(fronts) = Fronts::new::<N>(graph, order, MOST_FILL) else {
            return false;
        };
        let [even, odd] = fronts.stacks;
        if fronts.values + even + odd > N * N * MOST_FILL {
            return false;
        }
        self.diagonal.clear();
        for front in &fronts.fronts {
            for k in 0..front.width {
                self.diagonal.push(front.entry::<N>(k, k));
            }
        }
        for half in [&mut self.lower, &mut self.upper] {
            // tiles of the last column read a little past its end
            zeros(&mut half.values, fronts.values + ALIGN);
            for (stack, size) in half.stacks.iter_mut().zip(fronts.stacks) {
                zeros(stack, size);
            }
        }
        self.pivots.clear();
        self.pivots.resize(fronts.node.len(), Pivot::default());
        zeros(&mut self.work, N * fronts.node.len());
        zeros(
            &mut self.front,
            (N * fronts.tallest).next_multiple_of(ALIGN),
        );
        self.fronts = fronts;
        self.symmetric = false;
        true
    }

    /// Sets every entry to zero. A `symmetric` matrix needs only one block per coupling.
    pub fn clear(&mut self, symmetric: bool) {
        self.symmetric = symmetric;
        self.lower.values.fill(0.0);
        if !symmetric {
            self.upper.values.fill(0.0);
        }
    }

    /// `K_aa += m` for node `a`.
    pub fn add_diagonal(&mut self, a: usize, m: &SMatrix<f64, N, N>) {
        let (entry, stride) = self.diagonal[self.fronts.position[a]];
        add(&mut self.lower.values[entry..], stride, m);
    }

    /// Position of `K_ab`, for two different nodes of a declared pair.
    pub fn place(&self, a: usize, b: usize) -> Place {
        let (i, j) = (self.fronts.position[a], self.fronts.position[b]);
        let (column, row) = (i.min(j), i.max(j));
        let front = &self.fronts.fronts[self.fronts.of[column] as usize];
        let row = if row < front.first + front.width {
            row - front.first
        } else {
            let rows = self.fronts.rows(front);
            front.width + rows.partition_point(|&r| (r as usize) < row)
        };
        let (entry, stride) = front.entry::<N>(row, column - front.first);
        Place {
            entry,
            stride,
            below: i > j,
        }
    }

    /// `K_ab += m` at the position of (a, b).
    pub fn add(&mut self, place: Place, m: &SMatrix<f64, N, N>) {
        if place.below {
            add(&mut self.lower.values[place.entry..], place.stride, m);
        } else if !self.symmetric {
            let m = m.transpose();
            add(&mut self.upper.values[place.entry..], place.stride, &m);
        }
    }

    /// Factorises in place, front by front. Returns `false` if a pivot block is singular.
    pub fn factorise(&mut self) -> bool {
        let level = Level::new();
        for front in &self.fronts.fronts {
            self.lower.gather::<N>(&self.fronts, front);
            if !self.symmetric {
                self.upper.gather::<N>(&self.fronts, front);
            }
            let pivots = &mut self.pivots[front.first..front.first + front.width];
            let halves = (&mut self.lower, &mut self.upper);
            if !eliminate(level, front, pivots, halves, self.symmetric) {
                return false;
            }
        }
        true
    }

    /// Whether the matrix is positive definite, if it is symmetric and was factorised as symmetric.
    pub fn is_positive(&self) -> bool {
        self.symmetric && self.pivots.iter().all(Pivot::is_positive)
    }

    /// Solves `K x = rhs` in place, with one vector per node.
    pub fn solve(&mut self, rhs: &mut [SVector<f64, N>]) {
        let (x, _) = self.work.as_chunks_mut::<N>();
        for (x, &v) in x.iter_mut().zip(&self.fronts.node) {
            *x = rhs[v].into();
        }
        let half = if self.symmetric {
            &self.lower
        } else {
            &self.upper
        };
        let (l, u) = (&self.lower.values[..], &half.values[..]);
        let (fronts, pivots, t) = (&self.fronts, &self.pivots[..], &mut self.front[..]);
        let symmetric = self.symmetric;
        dispatch!(Level::new(), simd => {
            for front in &fronts.fronts {
                forward(simd, fronts, front, pivots, l, x, t);
            }
            for front in fronts.fronts.iter().rev() {
                backward(simd, fronts, front, pivots, (u, symmetric), x, t);
            }
        });
        for (x, &v) in x.iter().zip(&self.fronts.node) {
            rhs[v] = (*x).into();
        }
    }
}

/// `x ← L⁻¹ x` for the columns of one front.
#[inline(always)]
fn forward<S: Simd, const N: usize>(
    simd: S,
    fronts: &Fronts,
    front: &Front,
    pivots: &[Pivot<N>],
    values: &[f64],
    x: &mut [[f64; N]],
    t: &mut [f64],
) {
    let t = &mut t[..front.stride::<N>()];
    let (blocks, _) = t.as_chunks_mut::<N>();
    let (x, later) = x[front.first..].split_at_mut(front.width);
    for (t, x) in blocks.iter_mut().zip(&*x) {
        *t = *x;
    }
    for t in &mut t[N * front.width..] {
        *t = 0.0;
    }
    for k in 0..front.width {
        let Some(y) = t[N * k..].first_chunk_mut::<N>() else {
            return;
        };
        pivots[front.first + k].forward(y);
        let y = *y;
        x[k] = y;
        let panel = front.panel::<N>(k);
        let row = N * (k + 1) / ALIGN * ALIGN;
        let column = panel.begin + N * (k - panel.from) * panel.stride + row - N * panel.from;
        subtract_columns(simd, &mut t[row..], (&values[column..], panel.stride), y);
    }
    let (blocks, _) = t.as_chunks::<N>();
    for (&row, t) in fronts.rows(front).iter().zip(&blocks[front.width..]) {
        let x = &mut later[row as usize - front.first - front.width];
        for (x, t) in x.iter_mut().zip(t) {
            *x += *t;
        }
    }
}

/// `x ← U⁻¹ x` for the columns of one front; with L of a symmetric matrix `x ← L⁻ᵀ Δ⁻¹ x`.
#[inline(always)]
fn backward<S: Simd, const N: usize>(
    simd: S,
    fronts: &Fronts,
    front: &Front,
    pivots: &[Pivot<N>],
    (values, symmetric): (&[f64], bool),
    x: &mut [[f64; N]],
    t: &mut [f64],
) {
    let t = &mut t[..front.stride::<N>()];
    let (x, later) = x[front.first..].split_at_mut(front.width);
    let (blocks, _) = t.as_chunks_mut::<N>();
    for (&row, t) in fronts.rows(front).iter().zip(&mut blocks[front.width..]) {
        *t = later[row as usize - front.first - front.width];
    }
    for t in &mut t[N * front.height()..] {
        *t = 0.0;
    }
    for k in (0..front.width).rev() {
        let pivot = &pivots[front.first + k];
        let mut y = x[k];
        if symmetric {
            pivot.divide(&mut y);
        }
        let panel = front.panel::<N>(k);
        let row = N * (k + 1) / ALIGN * ALIGN;
        let column = panel.begin + N * (k - panel.from) * panel.stride + row - N * panel.from;
        // the panel has zeros in between
        for t in &mut t[row..N * (k + 1)] {
            *t = 0.0;
        }
        subtract_products(simd, &mut y, (&values[column..], panel.stride), &t[row..]);
        if symmetric {
            pivot.backward_unit(&mut y);
        } else {
            pivot.backward(&mut y);
        }
        x[k] = y;
        t[N * k..][..N].copy_from_slice(&y);
    }
}

impl Half {
    /// Adds the updates of a front's children to its panels and to its own, empty update.
    fn gather<const N: usize>(&mut self, fronts: &Fronts, front: &Front) {
        let [even, odd] = &mut self.stacks;
        let (own, other) = if front.odd { (odd, even) } else { (even, odd) };
        let own_stride = front.update_stride::<N>();
        let update = &mut own[front.update..][..N * front.below * own_stride];
        for (j, column) in update.chunks_exact_mut(own_stride.max(1)).enumerate() {
            // from the diagonal block on
            column[j / N * N / ALIGN * ALIGN..].fill(0.0);
        }
        for &child in &fronts.children[front.children.0..front.children.1] {
            let child = &fronts.fronts[child as usize];
            let local = &fronts.local[child.start..child.start + child.below];
            let passed_stride = child.update_stride::<N>();
            let passed = &other[child.update..][..N * child.below * passed_stride];
            for (j, &column) in local.iter().enumerate() {
                let column = column as usize;
                let (values, stride) = if column < front.width {
                    let (begin, stride) = front.entry::<N>(column, column);
                    (&mut self.values[begin..], stride)
                } else {
                    let k = N * (column - front.width);
                    (&mut update[k * own_stride + k..], own_stride)
                };
                for q in 0..N {
                    let values = &mut values[q * stride..];
                    let passed = &passed[(N * j + q) * passed_stride + N * j..];
                    let (passed, _) = passed.as_chunks::<N>();
                    for (&row, passed) in local[j..].iter().zip(passed) {
                        let values = &mut values[N * (row as usize - column)..][..N];
                        for (value, passed) in values.iter_mut().zip(passed) {
                            *value += passed;
                        }
                    }
                }
            }
        }
    }
}

/// Factorises the columns of a front and computes its update.
fn eliminate<const N: usize>(
    level: Level,
    front: &Front,
    pivots: &mut [Pivot<N>],
    (lower, upper): (&mut Half, &mut Half),
    symmetric: bool,
) -> bool {
    for from in (0..front.width).step_by(PANEL) {
        let panel = front.panel::<N>(from);
        let (begin, stride) = (panel.begin, panel.stride);
        for earlier in (0..from).step_by(PANEL) {
            let other = front.panel::<N>(earlier);
            let place = other.begin + N * (from - earlier);
            let shape = [N * panel.width, N * other.width];
            let (l, lower) = lower.values.split_at_mut(begin);
            let (u, upper) = upper.values.split_at_mut(begin);
            let (l, u) = ((&l[place..], other.stride), (&u[place..], other.stride));
            subtract_product::<N>(level, (lower, stride), 0, shape, l, u);
            if !symmetric {
                subtract_product::<N>(level, (upper, stride), 0, shape, u, l);
            }
        }
        for k in 0..panel.width {
            let column = begin + N * k * stride;
            let (l, lower) = lower.values.split_at_mut(column);
            let (u, upper) = upper.values.split_at_mut(column);
            if k > 0 {
                let (l, u) = (&l[begin..], &u[begin..]);
                let (l, u) = ((l, stride), (u, stride));
                let shape = [N, N * k];
                subtract_product::<N>(level, (lower, stride), N * k, shape, l, u);
                if !symmetric {
                    subtract_product::<N>(level, (upper, stride), N * k, shape, u, l);
                }
            }
            let pivot = &mut pivots[from + k];
            if !pivot.set(&lower[N * k..], stride, symmetric) {
                return false;
            }
            // the diagonal block is no longer needed
            let rows = N * (k + 1) / ALIGN * ALIGN..stride;
            let (lower, upper) = (&mut lower[..N * stride], &mut upper[..N * stride]);
            if symmetric {
                pivot.divide_columns(lower, upper, stride, rows.clone());
            } else {
                pivot.divide_lower(lower, stride, rows.clone());
                pivot.divide_upper(upper, stride, rows.clone());
            }
            for j in 0..N {
                for values in [&mut *lower, &mut *upper] {
                    for value in &mut values[j * stride..][rows.start..N * (k + 1)] {
                        *value = 0.0;
                    }
                }
            }
        }
    }
    if front.below == 0 {
        return true;
    }
    let own = usize::from(front.odd);
    let update_stride = front.update_stride::<N>();
    for from in (0..front.width).step_by(PANEL) {
        let panel = front.panel::<N>(from);
        let begin = panel.begin + N * (front.width - from);
        let l = (&lower.values[begin..], panel.stride);
        let u = (&upper.values[begin..], panel.stride);
        let shape = [N * front.below, N * panel.width];
        let update = &mut lower.stacks[own][front.update..];
        subtract_product::<N>(level, (update, update_stride), 0, shape, l, u);
        if !symmetric {
            let update = &mut upper.stacks[own][front.update..];
            subtract_product::<N>(level, (update, update_stride), 0, shape, u, l);
        }
    }
    true
}

/// Adds `m` to the block at the start of `values`.
#[inline(always)]
fn add<const N: usize>(values: &mut [f64], stride: usize, m: &SMatrix<f64, N, N>) {
    for j in 0..N {
        let column = &mut values[j * stride..][..N];
        for (i, value) in column.iter_mut().enumerate() {
            *value += m[(i, j)];
        }
    }
}

/// Resizes to zeros; reuses memory.
fn zeros(values: &mut Vec<f64>, size: usize) {
    values.clear();
    values.resize(size, 0.0);
}
