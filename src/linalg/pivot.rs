//! A diagonal block, its factors and their effect on the blocks beside it.

// indices show the elimination best
#![allow(clippy::needless_range_loop)]

use super::panel::ALIGN;
use nalgebra::SMatrix;
use std::ops::Range;

/// Factors of a diagonal block.
///
/// ```text
/// P D = L U, L unit lower, U upper; of a symmetric matrix D = L Δ Lᵀ, Δ diagonal, U = Δ Lᵀ   (1)
/// ```
///
/// The inverse is not formed. A stiff row adds 1e8 times a rank-one matrix, and products with the
/// inverse of such a block lose digits (gains of 1e6 gave a backward error of 1e-12 instead of
/// 1e-16). P swaps rows. A symmetric block is positive definite if the gains are, and needs no
/// swaps.
///
/// # Source
/// Higham, *Accuracy and Stability of Numerical Algorithms* (2002), ch. 9, 10 and 13.
#[derive(Debug, Clone, Copy)]
pub struct Pivot<const N: usize> {
    /// L below the diagonal, U above it, by columns.
    factors: [[f64; N]; N],
    /// Inverses of the diagonal of U.
    inverse: [f64; N],
    /// Row of D that becomes row k of P D.
    order: [usize; N],
}

impl<const N: usize> Default for Pivot<N> {
    fn default() -> Self {
        Pivot {
            factors: [[0.0; N]; N],
            inverse: [0.0; N],
            order: [0; N],
        }
    }
}

impl<const N: usize> Pivot<N> {
    /// Factorises the block at the start of `values`. Returns `false` if it is singular.
    pub fn set(&mut self, values: &[f64], stride: usize, symmetric: bool) -> bool {
        let mut m = [[0.0; N]; N];
        for (j, column) in m.iter_mut().enumerate() {
            column.copy_from_slice(&values[j * stride..][..N]);
        }
        for (k, order) in self.order.iter_mut().enumerate() {
            *order = k;
        }
        for k in 0..N {
            if !symmetric {
                let mut pivot = k;
                for i in k + 1..N {
                    if m[k][i].abs() > m[k][pivot].abs() {
                        pivot = i;
                    }
                }
                if pivot != k {
                    self.order.swap(k, pivot);
                    for column in &mut m {
                        column.swap(k, pivot);
                    }
                }
            }
            let d = m[k][k];
            if d == 0.0 || d.is_nan() {
                return false;
            }
            let inverse = 1.0 / d;
            self.inverse[k] = inverse;
            for i in k + 1..N {
                let f = m[k][i] * inverse;
                m[k][i] = f;
                for j in k + 1..N {
                    m[j][i] -= f * m[j][k];
                }
            }
        }
        self.factors = m;
        true
    }

    /// Whether the block is positive definite, if it was factorised as symmetric.
    pub fn is_positive(&self) -> bool {
        self.inverse.iter().all(|x| *x > 0.0)
    }

    /// `y ← L⁻¹ P y`.
    #[inline(always)]
    pub fn forward(&self, y: &mut [f64; N]) {
        let old = *y;
        for i in 0..N {
            let mut sum = old[self.order[i] % N];
            for j in 0..i {
                sum -= self.factors[j][i] * y[j];
            }
            y[i] = sum;
        }
    }

    /// `y ← U⁻¹ y`.
    #[inline(always)]
    pub fn backward(&self, y: &mut [f64; N]) {
        for i in (0..N).rev() {
            for j in i + 1..N {
                y[i] -= self.factors[j][i] * y[j];
            }
            y[i] *= self.inverse[i];
        }
    }

    /// `y ← Δ⁻¹ y`.
    #[inline(always)]
    pub fn divide(&self, y: &mut [f64; N]) {
        for (y, inverse) in y.iter_mut().zip(&self.inverse) {
            *y *= inverse;
        }
    }

    /// `y ← L⁻ᵀ y`.
    #[inline(always)]
    pub fn backward_unit(&self, y: &mut [f64; N]) {
        for i in (0..N).rev() {
            for j in i + 1..N {
                y[i] -= self.factors[i][j] * y[j];
            }
        }
    }

    /// `A ← A U⁻¹` and `B ← L⁻¹ P B`.
    #[inline(always)]
    pub fn divide_blocks(&self, a: &mut SMatrix<f64, N, N>, b: &mut SMatrix<f64, N, N>) {
        let a = &mut a.data.0;
        for j in 0..N {
            for k in 0..j {
                let f = self.factors[j][k];
                for r in 0..N {
                    a[j][r] -= a[k][r] * f;
                }
            }
            for r in 0..N {
                a[j][r] *= self.inverse[j];
            }
        }
        for column in &mut b.data.0 {
            self.forward(column);
        }
    }

    /// `A ← A U⁻¹` in some rows of N columns.
    pub fn divide_lower(&self, a: &mut [f64], stride: usize, rows: Range<usize>) {
        for i in rows.step_by(ALIGN) {
            let mut y = [[0.0; ALIGN]; N];
            for j in 0..N {
                let a = &mut a[j * stride + i..][..ALIGN];
                for r in 0..ALIGN {
                    let mut sum = a[r];
                    for k in 0..j {
                        sum -= y[k][r] * self.factors[j][k];
                    }
                    y[j][r] = sum * self.inverse[j];
                }
                a.copy_from_slice(&y[j]);
            }
        }
    }

    /// `A ← A Pᵀ L⁻ᵀ` in some rows of N columns.
    pub fn divide_upper(&self, a: &mut [f64], stride: usize, rows: Range<usize>) {
        for i in rows.step_by(ALIGN) {
            let mut y = [[0.0; ALIGN]; N];
            for j in 0..N {
                let a = &a[self.order[j] * stride + i..][..ALIGN];
                for r in 0..ALIGN {
                    let mut sum = a[r];
                    for k in 0..j {
                        sum -= y[k][r] * self.factors[k][j];
                    }
                    y[j][r] = sum;
                }
            }
            for j in 0..N {
                a[j * stride + i..][..ALIGN].copy_from_slice(&y[j]);
            }
        }
    }

    /// `B ← A L⁻ᵀ`, `A ← B Δ⁻¹` in some rows of N columns.
    pub fn divide_columns(&self, a: &mut [f64], b: &mut [f64], stride: usize, rows: Range<usize>) {
        for i in rows.step_by(ALIGN) {
            let mut y = [[0.0; ALIGN]; N];
            for j in 0..N {
                let a = &mut a[j * stride + i..][..ALIGN];
                let b = &mut b[j * stride + i..][..ALIGN];
                for r in 0..ALIGN {
                    let mut sum = a[r];
                    for k in 0..j {
                        sum -= y[k][r] * self.factors[k][j];
                    }
                    y[j][r] = sum;
                    b[r] = sum;
                    a[r] = sum * self.inverse[j];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    /// An inverse by cofactors loses every digit of this block. Newton steps in a drum diverged
    /// because of it.
    #[test]
    fn a_stiff_rank_one_block_keeps_its_digits() {
        let v = Vector3::new(0.6, -0.3, 0.7);
        let m = Matrix3::identity() + v * v.transpose() * 1e8;
        // Sherman & Morrison
        let exact =
            Matrix3::identity() - v * v.transpose() * (1e8 / (1.0 + 1e8 * v.norm_squared()));
        for symmetric in [false, true] {
            let mut pivot = Pivot::<3>::default();
            assert!(pivot.set(m.as_slice(), 3, symmetric));
            for b in [Vector3::x(), Vector3::y(), Vector3::new(1.0, -2.0, 0.5)] {
                let mut x = b.data.0[0];
                pivot.forward(&mut x);
                pivot.backward(&mut x);
                let x = Vector3::from(x);
                // 1e8 cancels against 1 once: 1e8 ulp
                assert!((x - exact * b).amax() < 1e-7);
                // the residual of the equations is still a few ulp of the summed terms
                assert!((m * x - b).amax() < 1e-15 * m.amax() * x.amax());
            }
            assert!(!pivot.set(Matrix3::<f64>::zeros().as_slice(), 3, symmetric));
        }
    }
}
