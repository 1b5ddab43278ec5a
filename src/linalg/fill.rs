//! Positions of the blocks of a factor, and their largest number.

/// Most blocks of a factor below its diagonal: as many as in a full matrix of 7071 block rows. With
/// the blocks above the diagonal, blocks of 2 × 2 take 1.6 GB.
pub const MOST_FILL: usize = 25_000_000;

/// The factors of a matrix would have more than [`MOST_FILL`] blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooMuchFill;

/// Position of a block in a [`super::sparse::BlockLdu`].
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub(super) entry: usize,
    pub(super) stride: usize,
    /// Whether its row is eliminated after its column.
    pub(super) below: bool,
}
