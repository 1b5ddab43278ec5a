//! The threshing machine: what it is, its cycle, the published study of it, its life, its pictures.
//!
//! A scene file holds one of two machines. `[thresher]` is a cylinder of toothed bars that drags a
//! strip of crop through a concave, as rapier bodies ([`ThreshingWorld`]). `[study]` is the rotor of
//! a published study with one degree of freedom ([`run_study`]). `[tooth]` and `[wear]` go with
//! both. [`load`] reads a scene with its machine.
//!
//! # A life
//! [`run_threshing`] simulates a few revolutions, sums the load times slip in the cell of each
//! contact, wears the tooth by what many revolutions would wear, and starts again with the worn
//! tooth. Its rows and pictures are made from a [`WearHistory`].
//!
//! # The chart of a machine
//! [`WearChart`] is about one number: the wear depth per cell of one load cycle.
//! `wear-per-cell` is `Σ|h − h'|/Σ h'` over the cells, `wear-deepest` and `wear-total` the relative
//! errors of the deepest cell and of the sum. The study has an algebra to compare with, the thresher
//! its own run converged over three steps. No peer has their contact law or a slip.

mod blocks;
mod check;
mod contact_time;
mod life;
mod life_text;
mod machine;
mod parameters;
mod pictures;
mod rotor_rungs;
mod rows;
mod shapes;
mod stall;
mod study;
mod study_life;
mod study_rotor;
mod study_text;
mod wear_chart;
mod wear_history;
mod world;

pub use blocks::{Calibration, Limit, Reading, Shares, Study, Tooth, Update, Wear};
pub use life::{Observer, PowerBudget, ThreshingOutcome, run_threshing};
pub use machine::{Blocks, Machine, Setup, load, parse};
pub use parameters::{ConcaveSetting, Thresher};
pub use pictures::{HeightLimit, HeightPoint, depth_per_cell, heights, tooth_height, worn_profile};
pub use rotor_rungs::read_rung;
pub use rows::{ComparisonRow, LifeRow, ProfileRow, VolumeRow, WearRow};
pub use stall::Stall;
pub use study::{PublishedPoint, StudyOutcome, run_study};
pub use study_rotor::oracle_load_slip;
pub use wear_chart::WearChart;
pub use wear_history::WearHistory;
pub use world::{Outlines, Part, ThreshingError, ThreshingWorld};
