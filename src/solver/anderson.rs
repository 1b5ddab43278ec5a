use crate::contact::Vec2;
use nalgebra::{DMatrix, DVector};

/// Anderson acceleration of a fixed-point iteration `P ← g(P)`.
///
/// With the residuals `f = g(P) − P` of the last points, `ΔP` and `ΔF` the differences of neighbours,
///
/// ```text
/// P ← g(P) − (ΔP + ΔF) γ,   γ = argmin |f − ΔF γ|                             (1)
/// ```
///
/// For a linear `g` this is as fast as GMRES: it needs one point more than `g` has slow modes.
///
/// # Source
/// Walker & Ni (2011), SIAM Journal on Numerical Analysis 49(4).
#[derive(Debug, Clone, Default)]
pub(super) struct Anderson {
    /// The last points and their images under `g` [N s], the oldest first.
    points: Vec<Vec<Vec2>>,
    images: Vec<Vec<Vec2>>,
}

/// Points that are remembered.
const MEMORY: usize = 5;

impl Anderson {
    /// Forgets all points.
    pub fn clear(&mut self) {
        self.points.clear();
        self.images.clear();
    }

    /// Whether no point is remembered.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Remembers that `g(point)` is `image`, and turns `image` into the next point by (1).
    pub fn next(&mut self, point: &[Vec2], image: &mut [Vec2]) {
        if self.points.len() == MEMORY {
            self.points.remove(0);
            self.images.remove(0);
        }
        self.points.push(point.to_vec());
        self.images.push(image.to_vec());
        let columns = self.points.len() - 1;
        if columns == 0 {
            return;
        }
        let rows = 2 * point.len();
        let residual = |k: usize, i: usize| (self.images[k][i / 2] - self.points[k][i / 2])[i % 2];
        let last = DVector::from_fn(rows, |i, _| residual(columns, i));
        let differences =
            DMatrix::from_fn(rows, columns, |i, k| residual(k + 1, i) - residual(k, i));
        // a difference that depends on the others up to round-off gets no weight
        let svd = differences.svd(true, true);
        let cut = f64::EPSILON * svd.singular_values.max();
        let Ok(weights) = svd.solve(&last, cut) else {
            return;
        };
        for k in 0..columns {
            let step = self.images[k + 1].iter().zip(&self.images[k]);
            for (x, (after, before)) in image.iter_mut().zip(step) {
                *x -= weights[k] * (after - before);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two slow modes of a linear iteration need three points, whatever the number of fast ones.
    #[test]
    fn slow_modes_of_a_linear_iteration_are_solved_for() {
        let factors = [1.0 - 1e-6, 1.0 - 1e-4, 0.0, 1e-9, 0.0, 0.0];
        let g = |p: &[Vec2]| -> Vec<Vec2> {
            let row = |i: usize, x: f64| factors[i] * (x - 1.0) + 1.0;
            let each = p.iter().enumerate();
            each.map(|(i, p)| Vec2::new(row(2 * i, p.x), row(2 * i + 1, p.y)))
                .collect()
        };
        let mut anderson = Anderson::default();
        let mut point = vec![Vec2::new(3.0, -2.0), Vec2::new(0.5, 7.0), Vec2::zeros()];
        for _ in 0..6 {
            let mut image = g(&point);
            anderson.next(&point, &mut image);
            point = image;
        }
        let off = point.iter().map(|p| (p - Vec2::new(1.0, 1.0)).amax());
        let worst = off.fold(0.0, f64::max);
        assert!(worst < 1e-8, "{worst}");
    }
}
