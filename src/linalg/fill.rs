//! Where the blocks of a factor lie, and how many there may be.

/// Most blocks that a factor may have below its diagonal: as many as a full matrix of 7071 block
/// rows has. Blocks of 2 × 2 take 1.6 GB with those above.
pub const MOST_FILL: usize = 25_000_000;

/// The factors of a matrix would have more than [`MOST_FILL`] blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooMuchFill;

/// Place of a block in a [`super::sparse::BlockLdu`].
#[derive(Debug, Clone, Copy)]
pub struct Place {
    pub(super) entry: usize,
    pub(super) stride: usize,
    /// Whether its row is eliminated after its column.
    pub(super) below: bool,
}
