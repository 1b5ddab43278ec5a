//! A run that was stopped, by Ctrl-C, a time limit of a cluster or a power cut, goes on:
//!
//! ```sh
//! moreau2d run thresher --out life      # and it is killed
//! moreau2d run --resume life            # all that was typed holds
//! ```
//!
//! The results are those of a run that was not stopped, byte for byte, however often and whenever it was
//! killed. `tests/program/resume.rs` kills runs of all kinds, by signal 9, and compares their files.
//!
//! # What is where
//! While a run goes on, its files grow in the folder `moreau2d-checkpoint` within the folder of the results:
//!
//! | file | what it holds |
//! |---|---|
//! | `run.json` | what was typed, the hash of the resolved scene, the version of the program |
//! | `run.state`, of a machine one for each of its lives | all that the next step depends on, and what the run has summed up so far; written whole, with a checksum |
//! | `files/` | the CSV files so far |
//!
//! At its end the files are moved into place, and the folder goes. `--resume` of a run that is finished says so
//! and changes nothing. A run that was stopped while its files were being moved is finished by `--resume`.
//! A new `run` into the folder is refused, so that nothing is lost by mistake: remove `moreau2d-checkpoint` to
//! give the stopped one up.
//!
//! # What is lost
//! | run | a checkpoint | so that at most is lost |
//! |---|---|---|
//! | scene of bodies, with or without `[[wear]]` | once a second, or 50 times as rarely as it takes to write; `--checkpoint-every N`: every N-th step | what was computed since |
//! | `[thresher]` | before each jump of each of its lives | a jump, or the filling of the machine before the first one |
//! | `[thresher.grains]` | once a second, or 50 times as rarely as it takes to write; then as `[thresher]` for a life | what was computed since, and what the strip beside it took, half a minute at most in the catalogue |
//! | `sweep` | each case that is done, see [`super::sweeps`] | a case for each job |
//!
//! When a checkpoint is written has no effect on the results.
//!
//! # What is refused
//! The scene must still be the one that was started: `--resume` reads its file again and compares the hash of
//! what it means, so that comments, title and notes may change. It refuses another version of the program, other
//! flags, a damaged checkpoint, and a folder in which the run is still at work. Scene files are found from the
//! folder in which the run was started.
//!
//! Peers, `thresher-study`, which takes seconds, and runs with `--dump-problems` write no checkpoint. Nor does
//! a run into a folder in which another one is at work.
//!
//! # In a program
//! [`MoreauPipeline::state`](crate::rapier::MoreauPipeline::state) and its world are plain data for serde.
//! [`Built::save`](crate::scene::Built::save) and `load` do it for the world of a scene:
//!
//! ```
//! use moreau2d::checkpoint::{Reader, Writer};
//!
//! let scene = moreau2d::scene::load("pyramid", &[])?;
//! let mut built = scene.build()?;
//! built.step()?;
//! let mut saved = Writer::default();
//! built.save(&mut saved)?;
//! let bytes: Vec<u8> = saved.bytes().to_vec();
//!
//! let mut resumed = scene.build()?;
//! resumed.load(&mut Reader::new(bytes))?;
//! built.step()?;
//! resumed.step()?;
//! assert_eq!(built.state(7), resumed.state(7));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
