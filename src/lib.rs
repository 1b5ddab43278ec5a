//! Exact nonsmooth contact, and the wear that follows from it, for rapier2d worlds.
//!
//! [`rapier::MoreauPipeline`] steps a rapier2d world in place of rapier's own solver. The folders of the
//! core build on each other in this order: [`contact`], [`solver`], [`dynamics`], [`rapier`]; [`wear`]
//! reads the record of a step, and [`worn`] brings both together. The rest is the lab (feature `lab`, on by default): scenes, peers, experiments, charts and
//! the command line. How a contact becomes an impulse, and an impulse becomes wear, is told on one
//! screen in the guide `data_flow`.
//!
//! # Glossary
//! | term | meaning |
//! |---|---|
//! | gap | signed distance of two surfaces at a contact \[m\]; negative is penetration |
//! | normal, tangent | unit vectors of a contact; the normal points from side 1 to side 2, pairs are ordered (n, t) |
//! | local velocity | relative velocity of the two surfaces at a contact, in (n, t) \[m/s\] |
//! | free velocity | velocity at the end of the step if no impulse acted |
//! | impulse | force integrated over the step \[N s\]; never called a force |
//! | slip | tangential way of a contact in a step \[m\] |
//! | load slip | normal impulse times slip velocity \[N m\]: what Archard's law reads |
//! | restitution | share of the approach velocity that an impact returns |
//! | friction cone | admissible impulses, tangential part at most μ times the normal part |
//! | block | the rows of one contact or joint part: two (n, t), or one |
//! | law | what a block obeys: contact with friction, pin, bounded row |
//! | bias | `b`, the velocity that a block has without impulses, with restitution and gap terms folded in |
//! | Delassus operator | `G = Wᵀ M⁻¹ W` \[1/kg\]: local velocities per impulse |
//! | contact problem | find impulses such that every block obeys its law |
//! | natural map | fixed-point residual of a contact problem; zero exactly at a solution |
//! | certified | the natural-map residual is below the tolerance, as judged by one function |
//! | unsolved | not certified: reported in the record, never hidden |
//! | warm start | impulses of the last step as the start of this one |
//! | island | bodies connected by contacts or joints: a contact problem of its own |
//! | working set | the contacts near enough to matter in a step |
//! | factor cache | factors of an island's last Newton system, reused while they serve |
//! | contact cache | what a contact or joint hands on to the next step |
//! | impulse distribution | how redundant contacts share one load; not unique |
//! | energy bound | impacts and joints add no energy to an island |
//! | regularisation | contacts yield a little, so that a problem without rigid solution has one |
//! | crowd | a large island in motion, answered by sweeps |
//! | recovery | bodies that start overlapped are moved apart by position alone |
//! | scheme | which contacts take part in a step: `staggered` (second order) or `moreau` (as published) |
//! | event | an impact located in time inside a step |
//! | sweep | one pass of Gauss-Seidel over all blocks; also a fast body followed in time |
//! | cell | a segment of a worn surface, named by detection |
//! | profile | the worn surface as a polyline |
//! | load cycle, jump | one simulated cycle, and how many cycles it stands for |
//! | peer | another engine on the same scene: rapier's own solver, Box2D |
//! | preset | an engine's settings, the same for every scene |
//! | rung | one difficulty of an entry of the failure atlas |
//! | closed form | an exact solution that a scene is compared with |
//! | dominated | a point of a peer that one of ours beats in accuracy at no more time |
#![forbid(unsafe_code)]

pub mod contact;
pub mod dynamics;
mod linalg;
pub mod rapier;
pub mod solver;
mod threads;
pub mod wear;
pub mod worn;

#[cfg(feature = "lab")]
pub mod checkpoint;
#[cfg(feature = "lab")]
pub mod cli;
#[cfg(feature = "lab")]
pub mod experiment;
#[cfg(feature = "lab")]
pub mod guide;
#[cfg(feature = "lab")]
pub mod models;
#[cfg(feature = "lab")]
pub mod oracles;
#[cfg(feature = "lab")]
pub mod peers;
#[cfg(feature = "lab")]
pub mod problems;
#[cfg(feature = "lab")]
pub mod report;
#[cfg(feature = "lab")]
pub mod scene;
#[cfg(feature = "lab")]
pub mod thresher;

/// The README, whose code must run.
#[cfg(all(doctest, feature = "lab"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
