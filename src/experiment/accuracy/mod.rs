//! The cheapest setting that holds an accuracy: `run --accuracy`.
//!
//! # What is held
//! An accuracy R is relative. Each measure has a size, which does not depend on the closed form:
//! - a value that the closed form of the scene is compared with, such as a stopping time or a force: itself,
//!   or what the scene names in place of it, such as the speed of a striker; a length: that of the scene
//!   below; an angle: 1 rad;
//! - the trajectory, of a scene without such a value: the largest way of a body and its own size, L. It is the
//!   largest distance of a body from where it should be at ten instants, or half its size times the angle;
//! - overlap and joint gap: L. Energy that nothing supplied: the energy of the scene, that is the largest
//!   kinetic energy, the range of the potential energy and the weight of the bodies times L.
//!
//! The last three should be 0 and are known from one run. A body that passes through another and an island that
//! failed hold no accuracy. Of the others only the computed values are used, never the exact ones (where two
//! sides of `three-discs` differ, the worse one is computed with their help).
//!
//! # How it is chosen
//! Trials run over the whole time, with 4, 2, 1, 1/2, ... times the scene's step, in the scheme `staggered`, in
//! the same with events, and in `moreau`. Let `d_k` be the difference of a measure between the trials k and
//! k + 1, and p the observed order `log₂(d_{k−1}/d_k)` within 1/2 to 2. The expected error of trial k is
//!
//! ```text
//! e_k = max( d_k/(1 − 2^−p),  max_{j<k} min(d_j, 1)/8^{k−j} )                (1)
//! 2 e_k ≤ R, and what is known from one run ≤ R                              (2)
//! ```
//!
//! The second part of (1): no error of these methods falls faster than by 8 when the step is halved, so a
//! difference that does is chance. Two wrong runs that agree are met in two more ways. Three trials at least
//! are run of each scheme. And where two schemes are farther apart than twice the sum of their expected errors,
//! neither is believed until further trials say which is wrong; if the scheme of the scene holds (2) at three
//! levels and the others still contradict it, they converge to another motion and are dropped. A scheme
//! that another beats in error and work at two levels is dropped, and so is one whose error does not halve in
//! three halvings of the step.
//!
//! Between the coarsest trial k that fulfils (2) and the one before, the step is the longest with
//!
//! ```text
//! 2 e_k (Δt/Δt_k)^q ≤ R,   q = log₂(e_{k−1}/e_k) within 1 to 4                (3)
//! ```
//!
//! The scheme of least work is taken. Work is the number of steps, located events, sweeps, factorisations and
//! pivots: it depends on no clock. The solver's tolerance is R/100, or the scene's if that is larger: an impulse
//! needs no digit that its step does not have.
//!
//! # How it is held
//! The run is compared with the trial k + 1, [`Held`]: their distance and the expected error of that trial,
//! at most `e_k/2`, must stay below R. Where it does not, the run starts anew, first with the scene's
//! tolerance, then with the step of trial k.
//!
//! # What it cannot see
//! An event that all trials of all schemes miss. A motion that depends on the smallest change, as that of many
//! bodies that tumble: trials never agree there, and the accuracy is refused with how near it came.
//!
//! # Source
//! Step doubling: Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, section II.4.

mod choice;
mod held;
mod judge;
mod search;
mod trial;

pub use choice::{ACCURACIES, Choice, TrialRow, choose};
pub use held::{Ended, Held};
pub use search::against_search;
