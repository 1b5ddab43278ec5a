//! Sparse linear algebra: the block LDLᵀ factorisation behind every direct solve.
//!
//! The pattern is ordered by minimum degree; columns of small systems are factorised one by one, large
//! ones in fronts of dense panels.

mod columns;
mod frontal;
mod fronts;
mod ordering;
mod panel;
mod pivot;
pub(crate) mod sparse;
