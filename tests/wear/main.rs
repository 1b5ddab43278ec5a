//! Wear of machine and study, and closed forms through rapier bodies.

mod calibration;
mod closed_forms;
mod equal_bars;
mod grains;
mod machine_life;
mod operation;
mod rig;
mod study_findings;
mod study_life;
mod threshing;
mod wear_containment;
mod worn;
