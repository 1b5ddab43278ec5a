//! Guides: how to step your own world, build a scene and write a solver, and which features of rapier2d
//! are supported. Documentation only; every example is compiled and run.
//!
//! | guide | for |
//! |---|---|
//! | [`first_step`] | users who have a rapier2d world and call `world.step()` |
//! | [`own_scene`] | users who build a machine: outlines, motors, belts, soft surfaces, wear |
//! | [`pin_on_disc`] | users whose bodies wear: from a scene file, from a program |
//! | [`sweeps`] | users who need a scene over many values of its keys, on one machine or on a cluster |
//! | [`uncertain_lives`] | users who sign a life: what the inputs do to it, and K from measured wear |
//! | [`study_findings`] | readers of the published study: what agrees here, what cannot, and why |
//! | [`accuracy`] | users who know the accuracy they need, not the step and scheme for it |
//! | [`stopped_runs`] | users whose runs take hours: what is kept of one that was stopped |
//! | [`own_solver`] | users who compare impulse solvers or write one |
//! | [`data_flow`] | those who change the code: how a contact becomes an impulse, and an impulse wear |
//! | [`features`] | which features of rapier2d are supported, with the test of each |
//!
//! Scene files are described in [`crate::scene`], the comparison with rapier in
//! [`crate::experiment`].
//!
//! # Commands
//! ```sh
//! moreau2d scenes                     # the catalogue
//! moreau2d run thresher-study         # the published study of a worn tooth, rebuilt
//! moreau2d run thresher --set wear.error=measured  # the error of the life, by source
//! moreau2d run thresher-grains        # a crop of grains beside the strip; `thresher`
//! moreau2d run pin-on-disc            # any body of a scene can wear; `guide::pin_on_disc`
//! moreau2d run tower --set 'repeat.box.count=[1,50]' --dt 0.01
//! moreau2d run bouncing-ball --events # impacts located in time inside the steps
//! moreau2d run pendulum --accuracy 1e-3  # step, scheme and tolerance from trials; `guide::accuracy`
//! moreau2d run drum --report          # report.html: a replay with impulses, and charts
//! moreau2d run hit-heap --animate     # scene-moving.svg: the motion as a picture for any page
//! moreau2d run - < my-scene.toml      # a scene from standard input
//! moreau2d run --resume out/drum      # a run that was stopped goes on; `guide::stopped_runs`
//! moreau2d sweep scenes/sweeps/thresher-study.toml   # 144 lives, over torque, speed and friction
//! moreau2d merge out/sweep-thresher-study  # one table of them, and maps; `guide::sweeps`
//! moreau2d calibrate pin-on-disc --mass-loss 41.2,40.1,43.5 --hours 500  # K from weighed parts
//! moreau2d explain chain              # what is modelled, and which accuracy to expect
//! moreau2d compare sliding-block --ladder  # accuracy against speed, orders, pictures
//! moreau2d chart --quick              # accuracy against speed over many scenes
//! moreau2d atlas --quick              # where each engine breaks, rung by rung
//! moreau2d run atlas/tower:50         # one rung; `scenes --atlas` lists them
//! moreau2d atlas --issues             # what users of engines complain of, as scenes
//! moreau2d run issues/heavy-on-cube   # one of them
//! moreau2d atlas tower --report       # report.html of it, as of compare and chart
//! moreau2d completions bash           # for the shell; also zsh, fish, powershell, elvish
//! moreau2d bench --quick              # what a step costs, by phase
//! moreau2d run wedge --dump-problems out/problems --steps 2
//! moreau2d solve out/problems/step-000001-island-0001.json
//! ```
//! Every `run` of a scene writes its steps, bodies, contacts and impacts as CSV, `summary.json`, and
//! `scene.svg`, the bodies at the end with the impulses of the last step. `--report` adds `report.html`, one
//! file that a browser opens without network: what came out, whether it can be trusted and what to do; a
//! replay with contacts and impulses, in which a click shows the figures of a body or contact and failed
//! steps are red on the time bar; charts, checks and settings. The page of a thresher replays its first measured
//! revolution; those of `compare`, `chart` and `atlas` hold their pictures and tables. `--animate` adds
//! `scene-moving.svg`, which plays wherever a browser shows an image: at most 480 kB, with as many frames and
//! arrows as fit, and the picture says how many. A scene of some 700 bodies or more is refused.
//!
//! A scene `-` is read from standard input, of at most 8 MiB like every scene file. A run of such a scene that was
//! stopped is resumed with the same scene on standard input; another one is refused by its hash.
//!
//! # Features of the crate
//! | feature | what it adds |
//! |---|---|
//! | `lab` (default) | scenes, experiments, peers, charts and the command line |
//! | `parallel` (in `lab`) | several threads share detection, islands and the sweeps of heaps, with the same bytes; without it one thread |
//! | `serde-serialize` (in `lab`) | rapier's own types can be saved with serde |
//! | `debug-render` | contact impulses and statuses through rapier's debug renderer |
//! | `f64` | rapier2d-f64 in place of rapier2d |
//! | `box2d` | Box2D v3 as a peer in comparisons; needs Rust 1.95 and a C compiler |

pub mod accuracy;
pub mod data_flow;
pub mod features;
pub mod first_step;
pub mod own_scene;
pub mod own_solver;
pub mod pin_on_disc;
pub mod stopped_runs;
pub mod study_findings;
pub mod sweeps;
pub mod uncertain_lives;
