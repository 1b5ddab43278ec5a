//! Wear of machine and study, and closed forms through rapier bodies.

mod closed_forms;
mod machine_life;
mod operation;
mod rig;
mod study_life;
mod threshing;
mod wear_containment;
mod worn;
