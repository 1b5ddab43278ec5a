//! How a contact becomes an impulse, and an impulse becomes wear: every type on the way, in the order
//! of the calls. A test checks that each file and each name exists.
//!
//! | step | file | name | what it does |
//! |---|---|---|---|
//! | read | `src/rapier/pipeline.rs` | `MoreauPipeline` | reads what the user changed in the rapier world, then calls the stepper |
//! | | `src/dynamics/step.rs` | `step` | one step of `MoreauStepper`: it calls everything down to the record, in this order |
//! | find | `src/dynamics/model.rs` | `MultibodyModel` | seam 1: bodies and their contacts, by rapier or by a small exact model |
//! | | `src/rapier/detection/mod.rs` | `Detector` | broad phase, narrow phase; adds a `ContactPoint` for each contact to `Detection` |
//! | | `src/dynamics/contact_cache.rs` | `ContactCache` | data of each contact and joint from the last step, by `ContactKey` |
//! | set up | `src/dynamics/rules.rs` | `Rules` | decides which contacts take part, and the velocity that each must reach |
//! | | `src/dynamics/interval.rs` | `Interval` | the result for one step: blocks with bias `b`, law and warm start; only `driven` adds to it |
//! | | `src/dynamics/working_set.rs` | `WorkingSet` | leaves out contacts that are too far away to matter |
//! | | `src/dynamics/islands.rs` | `Islands` | groups blocks that share moving bodies |
//! | | `src/dynamics/island_problem.rs` | `IslandProblem` | one island as a contact problem |
//! | | `src/contact/problem.rs` | `ContactProblem` | the problem as a plain value: Delassus operator `G`, free term `b`, one `Law` per block |
//! | solve | `src/dynamics/solve.rs` | `IslandSolver` | solves all islands, on one thread or several |
//! | | `src/dynamics/island.rs` | `solve_island` | **here a contact becomes an impulse**: sets up, solves, bounds and judges an island |
//! | | `src/solver/impulse_solver.rs` | `ImpulseSolver` | seam 2: finds impulses; the other files of `src/solver` have the methods |
//! | | `src/dynamics/island_cache.rs` | `IslandCache` | factors of each island, and the crowds, for the next step |
//! | | `src/dynamics/driven.rs` | `solve_driven` | adds contacts where the solution makes bodies overlap, and solves again |
//! | bound | `src/dynamics/energy_bound.rs` | `bound_contacts` | blends two solutions so that impacts add no energy; `bound_joints` does the same for joints |
//! | | `src/dynamics/crowd.rs` | `part_crowd` | answers large islands in motion by sweeps; the step reports how far they are from the rigid law |
//! | judge | `src/contact/residual.rs` | `natural_map` | the residual that judges all impulses, of every solver |
//! | move | `src/dynamics/solution.rs` | `Solution` | impulses of all islands and velocities at the end |
//! | | `src/dynamics/late_rebounds.rs` | `late_rebounds` | without event location: finds the rebounds that leave bodies overlapped |
//! | | `src/dynamics/deep_impacts.rs` | `deep_impacts` | without event location: finds the contacts that the step leaves deep |
//! | | `src/dynamics/cluster/all.rs` | `locate_impacts` | with event location, and for late rebounds and deep contacts: locates impacts in time, one cluster of bodies after the other |
//! | | `src/dynamics/recovery.rs` | `part_overlaps` | moves overlapping bodies apart by position |
//! | record | `src/dynamics/record.rs` | `StepRecord` | the result: one `ContactRecord` per contact, energies, residual, unsolved islands |
//! | wear | `src/wear/archard.rs` | `LoadSlip` | sums `ContactRecord::load_slip` on the nodes of the cell that detection found |
//! | | `src/wear/archard.rs` | `Archard` | **here an impulse becomes wear**: depth = K load slip / width; `feedback` bounds the jump |
//! | | `src/wear/jump.rs` | `JumpRule` | number of load cycles that one simulated cycle stands for |
//! | | `src/wear/state.rs` | `WearState` | wears the `Profile`, re-meshes it, and stores the `Life` |
//! | | `src/worn/colliders.rs` | `WornColliders` | wears the colliders of any rapier world: measures, jumps, gives them their new shapes |
//! | | `src/rapier/outline.rs` | `Outline` | the surface of a collider in `f64`, to read and to replace |
//! | | `src/experiment/wear.rs` | `go_on` | the loop for the bodies of a scene with `[[wear]]` |
//! | | `src/thresher/life.rs` | `run_threshing` | the loop for the thresher, whose bars share one profile: simulate, wear, replace the colliders, repeat |
//!
//! # Where to add
//! | what | where |
//! |---|---|
//! | a solver | implement `ImpulseSolver` ([`own_solver`](super::own_solver)). In your program: pass it to `with_solvers`. In the crate: add it to `src/solver/table.rs` (the core) or `src/oracles/mod.rs` (the lab); both lists of names are in these files |
//! | a scene | a file in `scenes/` and a line of `EMBEDDED` in `src/scene/catalogue.rs`; or run any TOML file by its path |
//! | a rung of the atlas | a line of `rungs` in a file of `scenes/atlas/`, see [`crate::scene::atlas`] |
//! | an entry of the atlas | a file in `scenes/atlas/` and its name in `EMBEDDED` of `src/scene/atlas.rs`; its measures are in `src/experiment/atlas/measures.rs`, verdicts of quick rungs in `tests/data/atlas-quick.txt` |
//! | a wear law | beside `src/wear/archard.rs`: a type with `depths` as `Archard` has; `WearSettings::law` in `src/wear/state.rs` holds it, `[wear]` in `src/thresher/blocks.rs` chooses it |
//! | a contact kernel for a shape | `src/rapier/kernels/` |
//! | a measure or a chart | a function in `src/experiment/reference/`; charts only read the results table |
