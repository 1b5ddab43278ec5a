//! The threshing machine: its scene blocks, its cycle, the published study, its life, its pictures.
//!
//! A scene file has one of two machines. `[thresher]` is a cylinder of toothed bars that drags a
//! strip of crop through a concave, as rapier bodies ([`ThreshingWorld`]). `[study]` is the rotor
//! of a published study with one degree of freedom ([`run_study`]). Both use `[tooth]` and
//! `[wear]`. [`load`] reads a scene with its machine.
//!
//! # A life
//! [`run_threshing`] simulates a few revolutions, sums load times slip in the cell of each contact,
//! wears the tooth by the wear of many revolutions, and starts again with the worn tooth.
//! [`WearHistory`] makes its rows and pictures.
//!
//! # A crop of grains
//! With `[thresher.grains]` the crop is rigid discs of a stated size, fed at the same mass flow
//! ([`Grains`]); [`run_crops`] measures torque, power, mass and wear of bars and concave beside the same
//! machine with the strip. `[[thresher.bar]]` has bars of their own ([`Bar`]), `[wear]
//! concave_coefficient` the K of the concave, whose outline does not change. With limits of wear the run
//! computes the life of the teeth with grains as well. `thresher.governor` has the torque of the drive over
//! its speed in place of the ideal motor.
//!
//! `run thresher-grains` holds 1065 grains at once in the mean: every contact problem is certified. New teeth
//! take 18 N m, an eighth of the measured 146 N m to which the strip is calibrated;
//! [`crate::guide::study_findings`] says why. Grains predict no torque of this machine.
//!
//! # What the hours depend on
//! The catalogue's machine with one assumed input changed, one revolution a jump (`run thresher --set
//! thresher.crop_strength=10 --set wear.revolutions=1`). K belongs to the published depth, so that each
//! input has a K of its own; hours go with 1/K, and those in brackets are with that K. "Stalls": the drive
//! is at its torque limit before the teeth are unfit. The bold row is the scene as it is, with two
//! revolutions a jump.
//!
//! | strength of the crop, assumed \[N/m\] | friction on the concave, assumed | K of the published depth [m²/N] | torque held: unfit \[h\] | feed held \[h\] |
//! |---|---|---|---|---|
//! | 10 | 0.271 | 6.7e-13 | 172 ± 6 (153) | stalls 129 ± 8 (115) |
//! | **20** | **0.271** | 5.9e-13 | 152 ± 5 | stalls 107 ± 6 |
//! | 40 | 0.271 | 7.0e-13 | 162 ± 7 (137) | stalls 127 ± 9 (108) |
//! | 1e6, never parts | 0.271 | 2.5e-13 | 86 ± 2 (205) | unfit 67 ± 1 (160) |
//! | 20 | 0.2 | 12.7e-13 | 428 ± 39 (199) | unfit 413 ± 40 (193) |
//! | 20 | 0.35 | 2.8e-13 | 102 ± 8 (213) | stalls 23 ± 3 (49) |
//!
//! The printed error is that of the computation. It says too little of the last stall: there the drive is so near
//! its limit that small changes of the detection moved it from 47 ± 9 to 23 ± 3 h. These two inputs move the
//! hours by more: at a given K by a factor of up to 18, and with K fitted again by up to 4. They take part of
//! the torque away from the teeth: of 10.4 kW new teeth take 1.4 kW with the default, 4.6 kW where the strip
//! never parts.
//!
//! # The chart of a machine
//! [`WearChart`] plots one quantity: the wear depth per cell of one load cycle. `wear-per-cell` is
//! `Σ|h − h'|/Σ h'` over the cells; `wear-deepest` and `wear-total` are the relative errors of the
//! deepest cell and of the sum. The reference of the study is algebra, that of the thresher its own
//! run converged over three step lengths. No peer has their contact law or reports slip.

mod bar_load;
mod blocks;
mod calibrate;
mod check;
mod contact_time;
mod crop;
mod crop_run;
mod crop_text;
mod cycle;
mod explained;
mod flow;
mod governor;
mod grain_parameters;
mod grains;
mod life;
mod life_error;
mod life_text;
mod lives;
mod machine;
mod machine_pictures;
mod machine_stage;
mod operation;
mod parameters;
mod part_wear;
mod pictures;
mod power;
mod rotor_rungs;
mod rows;
mod shapes;
mod spin;
mod stall;
mod strip;
mod study;
mod study_friction;
mod study_life;
mod study_pictures;
mod study_rotor;
mod study_text;
mod wear_chart;
mod wear_history;
mod world;
mod worn_course;

pub use bar_load::BarLoad;
pub use blocks::{Calibration, LifeErrors, Limit, Reading, Shares, Study, Tooth, Update, Wear};
pub use calibrate::Calibrated;
pub use crop_run::{CropComparison, CropRun, CropWatch, run_crops};
pub use explained::explain_threshing;
pub use flow::Flow;
pub use grain_parameters::{Bar, Grains};
pub use life::{Kept, Observer, ThreshingOutcome, run_threshing};
pub use life_error::{LimitError, Size, SourceError};
pub use lives::{Lives, run_lives};
pub use machine::{Blocks, Machine, Setup, load, parse};
pub use machine_pictures::{load_over_angle, power_over_hours, torque_over_hours};
pub use machine_stage::machine_stage;
pub use parameters::{ConcaveSetting, Hold, Thresher};
pub use part_wear::{BarWear, ConcaveWear};
pub use pictures::{HeightLimit, HeightPoint, depth_per_cell, heights, tooth_height, worn_profile};
pub use power::PowerBudget;
pub use rotor_rungs::read_rung;
pub use rows::{
    BarLoadRow, BarRow, ComparisonRow, ConcaveRow, CropRow, CropWearRow, ErrorRow,
    FrictionDepthRow, FrictionRow, LifeRow, OperationRow, ProfileRow, VolumeRow, WearRow,
};
pub use spin::SpinBudget;
pub use stall::Stall;
pub use study::{PUBLISHED, PublishedPoint, StudyOutcome, run_study};
pub use study_pictures::{depth_over_friction, depth_over_speed, life_over_friction};
pub use study_rotor::oracle_load_slip;
pub use wear_chart::WearChart;
pub use wear_history::WearHistory;
pub use world::{Outlines, Part, ThreshingError, ThreshingWorld};
pub use worn_course::{WornCourse, WornPoint, distance, worn_course, worn_part};
