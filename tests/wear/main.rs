//! Wear of machine and study.

mod study_life;
mod threshing;
mod wear_containment;
