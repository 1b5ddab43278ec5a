//! A life one can sign: what it rests on, and the wear coefficient from measured wear.
//!
//! The error that a run prints is that of its computation. Its inputs are known within bounds only, and they
//! move a life by far more. `[uncertain]` in a scene with wear says within which bounds:
//!
//! ```toml
//! [uncertain]
//! wear.coefficient = { percent = 50 }                        # from -50 % to +50 %
//! study.friction = { from = 0.14, to = 0.40 }                # the scene's own value lies between
//! study.shares = { among = ["winkler", "equal", "lever"] }   # the scene's own value is one of them
//! ```
//!
//! or for one run `--set uncertain.study.friction.from=0.14 --set uncertain.study.friction.to=0.4`. Keys are
//! those of `--set`, as whole paths or by a name that one block alone has. `run` then prints the life with two
//! bands. This is `thresher-study` with the block above, in a few seconds:
//!
//! ```text
//! life, until unfit: 182.2 h, with two bands
//!   numerics  181.1 h to 183.2 h
//!   inputs    96.28 h to 406.8 h
//! the largest cause is wear.coefficient: alone it gives 121.4 h to 364.3 h, a factor of 3.00
//! ```
//!
//! with a table of every value, `uncertain.csv`, `uncertain` in `summary.json` and `tornado.svg`, a bar for
//! each input, the longest on top. Of bodies that wear (`[[wear]]`) the bands are those of the depth after
//! `life.duration`. A sweep has them for each of its cases.
//!
//! The whole machine, `thresher`, takes 10 minutes on two cores for three inputs (six runs).
//!
//! | input | from, to | hours until the machine no longer conveys |
//! |---|---|---|
//! | the scene | | 105 (numerics: 99 to 111) |
//! | `thresher.friction_concave`, 0.271 | 0.2, 0.35 | 420, 21 |
//! | `wear.coefficient`, 5.9e-13 m2/N | -50 %, +50 % | 210, 70 |
//! | `thresher.clearance_outlet`, 8 mm | 7.5, 8.5 | 113, 94 |
//! | all together | | 20 to 495; at the ends at once 18 and 860 |
//!
//! What decides most is the friction of the crop on the concave, which is an assumption of the scene. Its
//! short end, where the drive is near its limit from the start, scatters by a factor of two: 47 hours with one
//! measured revolution a jump, 21 with two.
//!
//! # How
//! - One input at a time has its other values, each in a run of its own; all are checked before the first run
//!   begins. A life of `thresher` takes a minute, so five inputs take some twelve. What is done is kept where
//!   the run can be resumed ([`super::stopped_runs`]).
//! - Values of a machine's `wear.coefficient` need no run: time enters the wear only as K t, and jumps are
//!   bounded by depth, so that hours go with 1/K. On the thresher that holds to 1e-15, on the study to a fifth
//!   of the numerical error, as one of its jumps ends at the published depth: `tests/wear/calibration.rs`,
//!   `tests/program/uncertain.rs`.
//! - Effects are ratios to the life as it is. The band of all inputs adds their logarithms in quadrature, the
//!   shortening ones and the lengthening ones apart.
//! - Two more runs have all inputs at once at the ends that shorten and that lengthen the life, beside the
//!   product of the single effects: where they differ, inputs act on each other.
//!
//! # What it does not see
//! - Inputs that move together: a straw that is damper is both tougher and more slippery. A sample of a plan
//!   ([`super::sweeps`]) sees them if it draws them so.
//! - What lies between the ends of a range. A life that has its least in the middle is not found.
//! - How likely a value is: the bands are bounds combined as if they were deviations, no probabilities.
//! - Constants that were fitted. In the study the contact time is held at that of the run: fitted anew with
//!   every value it would take up all that an input does, and K would seem to do nothing. In the thresher K is
//!   held, and the crop's stiffness is calibrated to the operating torque in each run. An input whose change
//!   asks for another K moves the life with the fitted K less than is told here; the table of
//!   [`crate::thresher`] has both.
//!
//! # The coefficient from measured wear
//! ```sh
//! moreau2d calibrate thresher-study --mass-loss 61.5,58.9,63.2 --hours 60 --width 0.05
//! moreau2d calibrate pin-on-disc --depth 5.3e-4 --hours 500 --uncertainty 2e-5
//! moreau2d calibrate thresher-study --profile traced.csv --hours 62 --against study.friction
//! ```
//!
//! One run of the scene gives the wear for every K, as hours are K t. The coefficient is that of least squares,
//! with an interval (`--level`, 95 %) from errors that are independent, normal and of one size: `--uncertainty`
//! is their standard deviation, in grams or metres, and without it the scatter of several measurements tells it
//! (Student's). [`crate::experiment::Fit`] has the equations. Of 100 noisy sets of data the interval held a
//! planted K in 90 or more, of weighed bars, of depths and of traced profiles: `tests/wear/calibration.rs`.
//!
//! A traced profile is a CSV file with the columns `x_m` and `y_m` in the frame of the part, as `profile.csv`
//! of a run has them for one time. Its points must lie on the surface of the scene: not outside of the new
//! surface, not deeper than the run wears. Density and width are
//! those of the scene, or 7850 kg/m³ and 1 m; the text says which.
//!
//! What the data cannot tell: K and the hours, or a factor on all loads, never; they act as a product. For
//! other parameters `--against KEY` compares what K and the key do to the data, by two more runs. One number,
//! or the same number of many parts, tells K from nothing else; a profile does where the key changes its shape.
//! The interval has the error of the measurements alone. That of the run and of its inputs is what the first
//! half of this page is for.
