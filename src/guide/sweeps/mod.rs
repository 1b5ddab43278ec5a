//! A sweep: many operating points of a scene, on one machine or on a cluster, and nothing lost.
//!
//! A plan is a TOML file: a scene, and which of its keys take which values. This one is all torques,
//! speeds and frictions of the published study, 144 lives of a tooth:
//!
//! ```toml
#![doc = include_str!("../../../scenes/sweeps/thresher-study.toml")]
//! ```
//!
//! ```sh
//! moreau2d sweep scenes/sweeps/thresher-study.toml --out cases   # a folder for each case
//! moreau2d merge cases --out table                               # one table, and its pictures
//! ```
//!
//! `sweep.csv` has a row for each case: the keys that vary, whether the scene held, and every result of
//! `summary.json`, so `life.unfit.hours` of a machine, `wear.pin.deepest_m` of a body that wears,
//! `measures.distance.computed` of a scene with a closed form, and the totals of any. `merge` draws lives,
//! depths and measures that vary; `--draw COLUMN` draws others. One key gives a line, two a map, more a
//! map for each value of the others, a sample points over each key.
//!
//! # A plan
//! | block | what it holds |
//! |---|---|
//! | `scene` | a name of `moreau2d scenes`, or a file beside the plan |
//! | `[set]` | keys that are the same in every case, as `run --set` takes them; `{key}` in a string stands for the value of a key that varies |
//! | `[grid]` | lists of values: every value with every other |
//! | `[[case]]` | tables of keys and values, one for each case |
//! | `[sample]` | `count` draws with a `seed`; in `[sample.keys]` a distribution for each key |
//!
//! `moreau2d scenes --keys` lists the keys. A plan may have several of `[grid]`, `[[case]]` and `[sample]`:
//! every case of one is taken with every case of the others. Distributions:
//!
//! | distribution | numbers | values |
//! |---|---|---|
//! | `uniform` | `from`, `to` | evenly between both |
//! | `loguniform` | `from`, `to` | their logarithm evenly |
//! | `normal` | `mean`, `deviation`, if wanted `from`, `to` | Gauss's, cut off at `from` and `to` |
//! | `lognormal` | `median`, `factor` | two thirds lie between median / factor and median x factor |
//! | `triangular` | `from`, `mode`, `to` | most often near `mode` |
//! | `whole` | `from`, `to` | whole numbers |
//!
//! ```
//! use moreau2d::scene::plan::Plan;
//!
//! let plan = Plan::parse(
//!     "wear.toml",
//!     r#"
//!     scene = "pin-on-disc"
//!     [sample]
//!     count = 200
//!     seed = 1
//!     [sample.keys]
//!     "wear.pin.coefficient" = { distribution = "lognormal", median = 1e-12, factor = 1.5 }
//!     "#,
//! )?;
//! assert_eq!(plan.len(), 200);
//! // the n-th draw of a key depends on the seed, the key and n: a longer sample goes on from this one
//! let case = plan.case(7)?;
//! let scene = moreau2d::scene::load(&plan.scene, &[case.changes[0].flag.clone()])?;
//! assert_eq!(scene.wear[0].coefficient, case.values[0].as_deref().unwrap_or("").parse::<f64>()?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Nothing lost
//! - All cases are checked before the first runs.
//! - A case is a folder called by a hash of its resolved scene and of the program's version. It appears whole,
//!   in one rename, with a record `case.json` that holds sizes and hashes of its files.
//! - A case that is there is not run again: a sweep that was killed goes on with the same command, and loses
//!   what each of its `--jobs` was at. A longer plan runs what is new. A damaged folder is named and run again.
//! - The bytes do not depend on `--jobs`, on the parts, or on how often it was killed.
//! - A case whose scene does not hold, or whose run ends with an error, stops no other. It is listed with the
//!   reason, has its row in the table, and the sweep ends with 2.
//! - `merge` names what is missing and refuses results of several versions.
//!
//! By default a case keeps `summary.json` alone; `--files` keeps all that `run` writes.
//!
//! # On a cluster
//! `--shard K/N` runs part K of N. Parts may share a folder, or have one each that `merge` takes together.
//! In a job array the part is known from the environment, and `--jobs` is 1 unless it is given:
//!
//! | scheduler | says | numbers | to type |
//! |---|---|---|---|
//! | Slurm | `SLURM_ARRAY_TASK_ID`, `_COUNT`, `_MIN`, `_STEP` | from any | nothing; `--shard /N` where only some tasks of `--array=1-N` run again |
//! | HyperQueue | `HQ_TASK_ID` | from 0 | `--shard /N`: it does not tell how many tasks there are |
//!
//! Slurm (Debian's `slurm-wlm`), by `sbatch slurm_job.sh`:
//!
//! ```sh
#![doc = include_str!("slurm_job.sh")]
//! ```
//!
//! HyperQueue (`pip install hyperqueue`), by `python3 hq_job.py`; with the program `hq` it is
//! `hq submit --array 0-5 moreau2d sweep plan.toml --shard /6 --out cases`:
//!
//! ```python
#![doc = include_str!("hq_job.py")]
//! ```
//!
//! then `moreau2d merge cases --out table` in both. `tests/job_arrays.sh` runs these two files on one machine
//! with a scheduler of their own, and compares the bytes with those of `sweep --jobs 2`. A part in which a
//! case does not hold ends with 2, which schedulers call failed, though all is written.
