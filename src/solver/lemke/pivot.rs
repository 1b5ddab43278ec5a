use nalgebra::{DMatrix, DVector};

/// How a path of pivots ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PathEnd {
    /// z₀ left: the basis is complementary.
    Complementary,
    Ray,
    Limit,
}

/// The place of a variable in the tableau.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Row(usize),
    Column(usize),
}

/// Two ratios closer than this, relative to the larger of themselves and 1, tie. Far above the
/// round-off of a few hundred pivots, far below the tolerance of the residual.
const TIE: f64 = 1e-12;

/// Dictionary of `w − M z − d z₀ = q`: only columns of nonbasic variables are stored.
///
/// Variables are numbered w: 0..n, z: n..2n, z₀: 2n. `B⁻¹` needs no columns of its own: column j
/// of it is the column of `w_j`, a unit vector while `w_j` is basic. A start from another
/// complementary basis exchanges the names of the pairs it has swapped, see [`Tableau::swap`].
#[derive(Clone)]
pub(crate) struct Tableau {
    n: usize,
    /// n rows of n + 2 numbers: the nonbasic columns, then the right-hand side.
    cells: Vec<f64>,
    basis: Vec<usize>,
    nonbasic: Vec<usize>,
    place: Vec<Place>,
    /// Whether `w_i` and `z_i` have exchanged their names.
    swapped: Vec<bool>,
    pivot_tolerance: f64,
    pub(crate) pivots: usize,
}

impl Tableau {
    pub(crate) fn new(matrix: &DMatrix<f64>, free: &DVector<f64>, pivot_tolerance: f64) -> Self {
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
            swapped: vec![false; n],
            pivot_tolerance,
            pivots: 0,
        }
    }

    /// Takes another covering vector `d ≥ 0`; to be called before [`Tableau::run`].
    pub(crate) fn cover(&mut self, covering: impl Fn(usize) -> f64) {
        for i in 0..self.n {
            self.cells[i * (self.n + 2) + self.n] = -covering(i);
        }
    }

    /// Takes the column of nonbasic `z_k` (after a swap: of what was `w_k`) as covering vector,
    /// if it is one: `≥ 0`, and positive where the right-hand side is negative.
    pub(crate) fn cover_by(&mut self, k: usize) -> bool {
        let Place::Column(column) = self.place[self.n + k] else {
            return false;
        };
        let fits = (0..self.n).all(|i| {
            let rise = -self.at(i, column);
            rise > self.pivot_tolerance || (rise >= 0.0 && self.at(i, self.n + 1) >= 0.0)
        });
        if fits {
            let rises: Vec<f64> = (0..self.n).map(|i| -self.at(i, column)).collect();
            self.cover(|i| rises[i]);
        }
        fits
    }

    /// Principal pivot on the rows and columns of `block`, of one or two numbers, which then count
    /// as the start: what became basic there is called w, what left z. `false`, and no longer to be
    /// used, where the block is singular.
    pub(crate) fn swap(&mut self, block: &[usize]) -> bool {
        let n = self.n;
        for &z in block {
            // the row of a w of the block that is still basic, with the largest pivot
            let rows = block.iter().filter_map(|&w| match self.place[w] {
                Place::Row(row) => Some(row),
                Place::Column(_) => None,
            });
            let Place::Column(column) = self.place[n + z] else {
                return false;
            };
            let size = |row: usize| self.at(row, column).abs();
            let Some(row) = rows.max_by(|a, b| size(*a).total_cmp(&size(*b))) else {
                return false;
            };
            if size(row).is_nan() || size(row) <= self.pivot_tolerance {
                return false;
            }
            self.exchange(row, column);
        }
        for &i in block {
            let (w, z) = (self.place[i], self.place[n + i]);
            (self.place[i], self.place[n + i]) = (z, w);
            for (place, name) in [(z, i), (w, n + i)] {
                match place {
                    Place::Row(row) => self.basis[row] = name,
                    Place::Column(column) => self.nonbasic[column] = name,
                }
            }
            self.swapped[i] = true;
        }
        true
    }

    /// Whether the present basis solves the problem: no right-hand side below 0 but by round-off.
    pub(crate) fn feasible(&self) -> bool {
        (0..self.n).all(|i| self.at(i, self.n + 1) >= -TIE)
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.cells[row * (self.n + 2) + column]
    }

    fn artificial(&self) -> usize {
        2 * self.n
    }

    /// Pivots until z₀ leaves, a ray, or the limit on all pivots of this tableau.
    pub(crate) fn run(&mut self, max_pivots: usize) -> PathEnd {
        let n = self.n;
        let covered = (0..n).filter(|&i| self.at(i, n) != 0.0).collect();
        let mut row = self.least_row(n, covered);
        let mut column = n;
        loop {
            if self.pivots >= max_pivots {
                return PathEnd::Limit;
            }
            let left = self.exchange(row, column);
            if left == self.artificial() {
                return PathEnd::Complementary;
            }
            // the complement of the variable that left is always nonbasic
            let entering = if left < n { left + n } else { left - n };
            let Place::Column(next) = self.place[entering] else {
                return PathEnd::Ray;
            };
            column = next;
            let candidates = self.ratio_candidates(column);
            if candidates.is_empty() {
                return PathEnd::Ray;
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
        // before z₀ has entered, the divisor is the covering vector
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

    /// Swaps the basic variable of `row` with the nonbasic one of `column`; returns the former
    /// basic one.
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

    /// The place of `z_i` of the problem.
    fn place_of_z(&self, i: usize) -> Place {
        self.place[if self.swapped[i] { i } else { self.n + i }]
    }

    /// Indices of the basic z.
    pub(crate) fn support(&self) -> Vec<usize> {
        (0..self.n)
            .filter(|&i| matches!(self.place_of_z(i), Place::Row(_)))
            .collect()
    }

    pub(crate) fn z(&self) -> DVector<f64> {
        DVector::from_fn(self.n, |i, _| match self.place_of_z(i) {
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
        assert_eq!((t.run(100), t.pivots), (PathEnd::Complementary, 3));
    }
}
