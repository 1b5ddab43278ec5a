//! Which step, scheme and tolerance a scene needs, if an accuracy is all that is known.
//!
//! ```sh
//! moreau2d run rocking-block --accuracy 1e-3
//! ```
//! chooses them from trials, and keeps the run to the accuracy:
//! ```text
//! accuracy 0.001: scheme staggered with events, dt 1/60 s, tolerance 1e-8: the cheapest setting that holds it by
//! 12 trials; expected error 3.4e-4 (landing-time)
//! the run was started anew: landing-time is off by 0.0011: tolerance 1e-8
//! the run was started anew: landing-time is off by 0.0011: dt 1/60 s
//! held: estimated error 4.9e-4 (landing-time); work 158 (...), the trials took 14 times as much
//! ```
//! The accuracy is relative, 1e-6 to 0.1. For a scene with a closed form it is that of the values that `compare`
//! compares, each over its own size; for another it is that of the trajectories, over the way of the bodies and
//! their size. [`crate::experiment::choose`] has all sizes and the method. The closed form itself has no part in
//! the choice: the same figures come out of a scene that nobody has solved.
//!
//! The trials run over the whole time of the scene, so that the choice costs 4 to 155 times the run.
//! It pays where many runs follow. `settings` in `summary.json` has what was chosen; with it a run without trials
//! gives the same bodies:
//! ```sh
//! moreau2d run rocking-block --dt 0.016666666666666666 --events --tolerance 1e-8
//! ```
//! Such a command is printed before the run starts: a run with `--accuracy` writes no checkpoint, and the command
//! makes the same run, which does.
//!
//! `accuracy` in `summary.json` lists every trial with its work and expected error, and why a run was started
//! anew, if it was.
//!
//! Flags and `--set` changes of what is chosen are refused, and so are peers, machines and scenes with
//! `[[wear]]`, whose cycles have an error of their own (`wear.error`). An accuracy that no trial reaches is an
//! error, with the measure and how near it came. That is so for heaps that tumble: their trajectories depend on
//! the smallest change, and no step makes them accurate.
//!
//! In a program:
//! ```
//! use moreau2d::experiment::choose;
//! use moreau2d::report::Progress;
//!
//! let scene = moreau2d::scene::load("falling-rod", &[])?;
//! let choice = choose(&scene, 1e-3, &Progress::new("trials", 0, true))?;
//! assert!(choice.expected < 1e-3);
//! assert!(choice.step.dt > scene.step.dt / 4.0 && !choice.step.events);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! `moreau2d chart --accuracy` shows for twelve scenes with a closed form what is reached, and what it costs
//! against the best fixed setting found by search.
