//! Sparse linear algebra: the block LDU factorisation of every direct solve.
//!
//! The nodes are ordered by approximate minimum degree. Small systems are factorised by columns,
//! large ones by fronts of dense panels.

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
