//! A pin on a disc: wear of your own bodies, from a scene file and from a program.
//!
//! The oldest test of wear: a pin of face `A` is pressed with `F` on a disc that slides past it. By
//! Archard's law its face recedes by
//!
//! ```text
//! h = K F s / A                                                                            (1)
//! ```
//!
//! after the sliding distance `s`, whatever the mesh, the step and the number of jumps. Scene and
//! program below are the same pin, and give the same wear; both run as tests, and both are compared
//! with (1).
//!
//! # From a scene file
//! `[[wear]]` names a body and the wear coefficient `K` of its material; `[life]` says for how long it
//! wears. Any body of a scene can wear, on both sides of a contact, each with a `[[wear]]` of its own.
//!
//! ```toml
#![doc = include_str!("../../../scenes/pin-on-disc.toml")]
//! ```
//!
//! `moreau2d run pin-on-disc` settles for a second, measures a cycle of a second, wears the pin by a jump, and
//! so on until 1000 hours. It writes
//! - `wear.csv`: depth, volume and load times slip of each cell after each jump, and the error of the jumps;
//! - `profile.csv`: the worn surface after each jump, in the frame of the body;
//! - `jumps.csv`: length of each jump, its feedback `K k S`, and what bounded it;
//! - two pictures of each body, of the depth of its cells and of its surface, and the files of any other run
//!   for the time until the first jump, of which overlaps, joint gaps and passages are judged.
//!
//! # From a program
//! [`WornColliders`](crate::worn::WornColliders) does the same in a world of your own. You step the
//! world; it reads the records, and changes the shape of the collider when you let it jump.
//!
//! ```
#![doc = include_str!("program.rs")]
//!
//! let duration = 3.6e6;
//! let worn = pin_on_disc(duration)?;
//! let (force, distance, face) = (1000.0 * 0.01 * 0.04 * 9.81, 0.5 * duration, 0.01);
//! let expected = 1e-12 * force * distance / face;
//! for depth in worn.state(0).depth() {
//!     assert!((depth / expected - 1.0).abs() < 1e-4, "{depth} {expected}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What to choose
//! - **Cells.** `cell` is a length of your own choice; the depth does not depend on it. Without, cells are
//!   as long as the shortest edge that wears. Wear that is not even needs cells short against the shape that it makes.
//! - **Jumps.** `jump` is the largest depth of one. The error of a life falls with it; `wear.csv` has
//!   its estimate. A pin under a constant load has none.
//! - **Stiffness.** Bodies are rigid if their material states no stiffness. How a load is shared along
//!   a rigid face is not unique, so a rigid surface yields by what it will wear in a jump (wear
//!   compliance); the summary says so. A stiffness \[N/m per metre of surface\] is used as it is while no
//!   jump wears a cell by more than its elastic penetration, `K k S ≤ 1`, and with wear compliance beyond.
//! - **Motion.** What is measured stands for the whole jump: a belt, a spinning body, a mechanism that
//!   turns. A surface that moves along itself (`surface_velocity`) cannot wear, as its material does not
//!   stay where it is; let the body move instead.
//! - **Mass.** `mass = true` takes the mass of what is worn off the body, and moves its centre of mass.
//! - **Sleep.** Bodies stay awake as soon as something wears. A body that sleeps would wear by nothing.
//!
//! A body that wears through itself ends the run: what was found is written, and the summary says when.
