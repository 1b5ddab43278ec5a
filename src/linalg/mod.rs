//! Sparse linear algebra: the block LDU factorisation behind every direct solve.
//!
//! The pattern is ordered by minimum degree; small systems are factorised column by column, large ones
//! in fronts of dense panels.

mod columns;
mod fill;
mod frontal;
mod fronts;
mod ordering;
mod panel;
mod pivot;
mod sparse;

#[allow(unused_imports)] // MOST_FILL is for readers of stored problems
pub(crate) use fill::{MOST_FILL, Place};
pub(crate) use sparse::BlockLdu;
