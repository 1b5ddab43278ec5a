use super::{Mat2, Vec2};
use nalgebra::DMatrix;

/// A square matrix of 2 × 2 blocks (n, t), compressed by block columns, with a symmetric pattern.
///
/// Zero blocks are left out, except on the diagonal and where the transposed position holds a
/// nonzero block. Storage is by columns, because a sweep adds a column: an impulse `P_j` changes
/// the local velocities by `G_ij P_j`. The values need not be symmetric.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BlockMatrix {
    /// Column j holds entries `start\[j\]..start[j + 1]`, their rows `row` ascending.
    start: Vec<usize>,
    row: Vec<u32>,
    values: Vec<Mat2>,
}

impl BlockMatrix {
    /// Sums `blocks`, each (block row, block column, values), to a matrix of `size` × `size`
    /// blocks. Blocks at the same position are added in the given order.
    ///
    /// # Panics
    /// If a row or column is `size` or more, or `size` does not fit 32 bits.
    pub fn from_blocks(size: usize, mut blocks: Vec<(u32, u32, Mat2)>) -> Self {
        assert!(u32::try_from(size).is_ok());
        let size = size as u32;
        assert!(blocks.iter().all(|&(i, j, _)| i < size && j < size));
        let place = |&(i, j, _): &(u32, u32, Mat2)| (j, i);
        blocks.sort_by_key(place);
        blocks.dedup_by(|next, sum| {
            let same = place(next) == place(sum);
            if same {
                sum.2 += next.2;
            }
            same
        });
        blocks.retain(|(_, _, m)| !is_zero(m));
        let stored = |i, j| blocks.binary_search_by_key(&(j, i), place).is_ok();
        let mut missing: Vec<_> = (0..size)
            .filter(|&k| !stored(k, k))
            .map(|k| (k, k))
            .collect();
        let mirrored = blocks.iter().map(|&(i, j, _)| (j, i));
        missing.extend(mirrored.filter(|&(i, j)| !stored(i, j)));
        blocks.extend(missing.into_iter().map(|(i, j)| (i, j, Mat2::zeros())));
        blocks.sort_unstable_by_key(place);

        let mut matrix = BlockMatrix::default();
        let mut blocks = blocks.into_iter().peekable();
        for column in 0..size {
            matrix.start.push(matrix.row.len());
            while let Some((i, _, m)) = blocks.next_if(|&(_, j, _)| j == column) {
                matrix.row.push(i);
                matrix.values.push(m);
            }
        }
        matrix.start.push(matrix.row.len());
        matrix
    }

    /// The blocks of a full matrix.
    ///
    /// # Panics
    /// If it is not square with an even number of rows.
    pub fn from_dense(dense: &DMatrix<f64>) -> Self {
        assert!(dense.is_square() && dense.nrows().is_multiple_of(2));
        let size = dense.nrows() / 2;
        let at = |i: usize, j: usize| dense.fixed_view::<2, 2>(2 * i, 2 * j).into_owned();
        let mut matrix = BlockMatrix::default();
        for j in 0..size {
            matrix.start.push(matrix.row.len());
            for i in 0..size {
                let block = at(i, j);
                if i == j || !is_zero(&block) || !is_zero(&at(j, i)) {
                    matrix.row.push(i as u32);
                    matrix.values.push(block);
                }
            }
        }
        matrix.start.push(matrix.row.len());
        matrix
    }

    /// Number of block rows, equal to the number of block columns.
    pub fn size(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Number of stored blocks.
    pub fn held(&self) -> usize {
        self.values.len()
    }

    /// The blocks of column `j` with their rows, ascending.
    #[inline]
    pub fn column(&self, j: usize) -> impl Iterator<Item = (usize, &Mat2)> {
        let range = self.start[j]..self.start[j + 1];
        let rows = self.row[range.clone()].iter().map(|&i| i as usize);
        rows.zip(&self.values[range])
    }

    /// The blocks of row `i` with their columns, ascending.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, Mat2)> {
        // the pattern is symmetric
        self.column(i).map(move |(j, _)| (j, self.block(i, j)))
    }

    /// Block (i, j); zeros if it is not stored.
    pub fn block(&self, i: usize, j: usize) -> Mat2 {
        self.entry(i, j)
            .map_or_else(Mat2::zeros, |entry| self.values[entry])
    }

    fn entry(&self, i: usize, j: usize) -> Option<usize> {
        let from = self.start[j];
        let rows = &self.row[from..self.start[j + 1]];
        Some(from + rows.binary_search(&(i as u32)).ok()?)
    }

    /// The pairs of different blocks that are coupled, each (a, b) with a < b, ascending.
    pub fn pairs(&self) -> Vec<(u32, u32)> {
        let below = |j: usize| self.column(j).filter(move |(i, _)| *i > j);
        (0..self.size())
            .flat_map(|j| below(j).map(move |(i, _)| (j as u32, i as u32)))
            .collect()
    }

    /// `out = G P` \[m/s\].
    pub fn apply(&self, impulses: &[Vec2], out: &mut Vec<Vec2>) {
        out.clear();
        out.resize(self.size(), Vec2::zeros());
        for (j, &p) in impulses.iter().enumerate() {
            if p != Vec2::zeros() {
                self.add_column(j, p, out);
            }
        }
    }

    /// `out ← out + G e_j p`.
    #[inline]
    pub fn add_column(&self, j: usize, p: Vec2, out: &mut [Vec2]) {
        for (i, block) in self.column(j) {
            out[i] += block * p;
        }
    }

    /// Replaces the matrix by its symmetric part.
    pub fn symmetrise(&mut self) {
        for j in 0..self.size() {
            for entry in self.start[j]..self.start[j + 1] {
                let i = self.row[entry] as usize;
                // the pattern is symmetric: the transposed block is stored
                let Some(mirror) = self.entry(j, i).filter(|_| i <= j) else {
                    continue;
                };
                let (upper, lower) = (self.values[entry], self.values[mirror]);
                let mean = 0.5 * upper + 0.5 * lower.transpose();
                self.values[entry] = mean;
                self.values[mirror] = mean.transpose();
            }
        }
    }
}

fn is_zero(block: &Mat2) -> bool {
    block.iter().all(|x| *x == 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_add_up_and_the_pattern_is_symmetric() {
        let (a, b) = (
            Mat2::new(1.0, 2.0, 3.0, 4.0),
            Mat2::new(0.0, 0.5, -0.0, 0.0),
        );
        let blocks = vec![(2, 0, a), (1, 1, b), (2, 0, b), (0, 1, a), (0, 1, -a)];
        let matrix = BlockMatrix::from_blocks(3, blocks);
        // two that cancel are left out; three on the diagonal and one pair remain
        assert_eq!((matrix.size(), matrix.held()), (3, 5));
        assert_eq!(matrix.pairs(), [(0, 2)]);
        assert_eq!(matrix.block(2, 0), a + b);
        for (i, j) in [(0, 0), (0, 1), (0, 2), (2, 2)] {
            assert_eq!(matrix.block(i, j), Mat2::zeros());
        }
        // the sign of a zero is preserved
        assert!(matrix.block(1, 1)[(1, 0)].is_sign_negative());
        let mut full = DMatrix::zeros(6, 6);
        for j in 0..3 {
            for (i, block) in matrix.column(j) {
                full.fixed_view_mut::<2, 2>(2 * i, 2 * j).copy_from(block);
            }
        }
        assert_eq!(BlockMatrix::from_dense(&full), matrix);
        let mut symmetric = matrix.clone();
        symmetric.symmetrise();
        assert_eq!(symmetric.block(0, 2), 0.5 * (a + b).transpose());
        assert_eq!(symmetric.block(2, 0), 0.5 * (a + b));
        assert_eq!(BlockMatrix::default().size(), 0);
    }
}
