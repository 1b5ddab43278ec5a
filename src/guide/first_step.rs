//! From `world.step()` to [`MoreauPipeline::step`]: what changes, and how to read what it returns.
//!
//! # The first step
//! You build bodies, colliders and joints with rapier, as before. One line changes:
//!
//! ```
//! use moreau2d::rapier::engine::prelude::*;
//! use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//!
//! let mut world = PhysicsWorld::new();
//! world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(10.0, 0.5));
//! let (crate_, side) = world.insert(
//!     RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0)),
//!     ColliderBuilder::cuboid(0.5, 0.5).density(2.0),
//! );
//! let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
//!
//! let record = pipeline.step(&mut world)?; // in place of world.step()
//!
//! // poses and velocities are in the world, as after rapier's own step
//! assert!((world.bodies[crate_].translation().y - 1.0).abs() < 1e-7);
//! // what the contacts did is in the record: two corners carry 2 kg for a 60th of a second
//! assert_eq!((record.contacts.len(), record.unsolved), (2, 0));
//! let carried: f64 = record.contacts.iter().map(|c| c.impulse_n).sum();
//! assert!((carried - 2.0 * 9.81 * record.dt).abs() < 1e-12);
//! // and by handle
//! let results = pipeline.results(&record);
//! assert!(results.contacts().all(|c| c.colliders[1] == Some(side)));
//! assert!((results.on_body(crate_).impulse.y - carried).abs() < 1e-12);
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! [`engine`](crate::rapier::engine) is rapier2d itself, or rapier2d-f64 with the feature `f64`. A
//! program with its own `rapier2d` dependency of the same version can use that name just as well.
//! Use one pipeline per world for as long as the world lives: it stores the `f64` poses, the last
//! step's impulses and the sleeping bodies ([`MoreauPipeline::state`] saves it). Events and hooks go to
//! [`MoreauPipeline::step_with_events`].
//!
//! # Reading the record
//! Everything is SI. A contact joins side 1 to side 2; its normal points from 1 to 2, its tangent
//! is the normal turned by +90 degrees. `impulse_n` (0 or more) and `impulse_t` \[N s\] act on side
//! 2, the opposite on side 1. `gap` \[m\] is positive where open. `slip` \[m\] is how far side 2
//! slid along the tangent in this step. A mean force is the sum of impulses over a span of time,
//! divided by that span.
//!
//! ```
//! use moreau2d::dynamics::record::ContactStatus;
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! # let mut world = PhysicsWorld::new();
//! # let floor = ColliderBuilder::cuboid(10.0, 0.5).friction(0.2);
//! # world.insert(RigidBodyBuilder::fixed(), floor);
//! // a box of 1 kg slides to the right on a floor, both with friction 0.2
//! let (slider, _) = world.insert(
//!     RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.75)).linvel(Vector::new(2.0, 0.0)),
//!     ColliderBuilder::cuboid(0.5, 0.25).density(2.0).friction(0.2),
//! );
//! let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
//! let record = pipeline.step(&mut world)?;
//! let (dt, weight) = (1.0 / 60.0, 9.81);
//! for contact in &record.contacts {
//!     // the floor is side 1, the normal points up, so the tangent points to the left
//!     assert_eq!((contact.normal.x, contact.normal.y), (0.0, 1.0));
//!     assert_eq!(contact.status, ContactStatus::SlipMinus);
//!     assert!(contact.slip < 0.0 && contact.impulse_t > 0.0);
//!     // Coulomb's law holds as it stands
//!     assert!((contact.impulse_t - 0.2 * contact.impulse_n).abs() < 1e-9);
//! }
//! // energy: what friction took is what the box lost, to round-off
//! let v = 2.0 - 0.2 * weight * dt;
//! assert!((record.energy.kinetic_end - 0.5 * v * v).abs() < 1e-7);
//! assert!(record.energy.imbalance().abs() < 1e-12);
//! assert!((record.friction_work() - (2.0 - 0.5 * v * v)).abs() < 1e-7);
//! assert!((pipeline.velocity(slider).unwrap().x - v).abs() < 1e-8);
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! [`MoreauPipeline::results`] gives the contacts of a step by rapier's handles, and sums over a body
//! or a pair; [`StepRecord::joint_force`](crate::dynamics::record::StepRecord::joint_force) what a
//! joint carried. All fields: [`StepRecord`](crate::dynamics::record::StepRecord) and
//! [`ContactRecord`](crate::dynamics::record::ContactRecord).
//!
//! # What "certified" means
//! Bodies that touch form islands; the impulses of an island solve one contact problem,
//! [`crate::contact`]. For every solver, one function judges them from the problem and the impulses
//! alone: the natural map, [`natural_map`](crate::contact::natural_map), is zero exactly where they
//! solve it. `record.residual` is the worst island's, without unit, `record.residual_velocity` in
//! m/s. An island counts as solved where the first is at most `StepperSettings::tolerance` (1e-8) and
//! the second that share of the island's own velocities, or round-off. An island at rest is not solved
//! again until something about it changes: the same bounds hold for the impulses that it keeps, and
//! `record.resting` counts it. `record.unsolved` counts
//! the others. **Check it**: an unsolved island is not an error, the step uses its best impulses, and
//! only this number shows it. `record.redundant` counts islands whose impulse distribution is not
//! unique (a box on more than one point): the motion is the same for all distributions;
//! [`Shares::MinimumNorm`](crate::solver::Shares) chooses the one of least norm.
//!
//! # Where it differs from rapier, and why
//! rapier's contacts are damped springs, solved in a fixed number of sweeps: stacks sink, and how
//! much depends on mass ratios, height and settings. Here a contact is rigid, and solving ends once
//! the impulses are certified.
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! /// Ten boxes of 1 m, one on the other, and a ball in free fall far away.
//! fn tower() -> (PhysicsWorld, RigidBodyHandle, RigidBodyHandle) {
//!     let mut world = PhysicsWorld::new();
//!     world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(10.0, 0.5));
//!     let mut top = RigidBodyHandle::invalid();
//!     for k in 0..10 {
//!         let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0 + k as Real));
//!         (top, _) = world.insert(body, ColliderBuilder::cuboid(0.5, 0.5));
//!     }
//!     let ball = RigidBodyBuilder::dynamic().translation(Vector::new(50.0, 0.0));
//!     let (ball, _) = world.insert(ball, ColliderBuilder::ball(0.5));
//!     (world, top, ball)
//! }
//!
//! let (mut ours, top, ball) = tower();
//! let (mut theirs, ..) = tower();
//! let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
//! for _ in 0..60 {
//!     assert_eq!(pipeline.step(&mut ours)?.unsolved, 0);
//!     theirs.step();
//! }
//! let sunk = |world: &PhysicsWorld| 10.0 - world.bodies[top].translation().y;
//! assert!(sunk(&ours).abs() < 1e-6); // what f32 shows of 2e-11 m
//! assert!(sunk(&theirs) > 1e-3);
//! // a ballistic path is exact at any step length; rapier's runs ahead by g t h / 2, 2 cm here,
//! // h being its substep of dt / 4
//! let fallen = |world: &PhysicsWorld| -world.bodies[ball].translation().y;
//! assert!((fallen(&ours) - 0.5 * 9.81).abs() < 1e-5);
//! assert!(fallen(&theirs) > 0.5 * 9.81 + 0.02);
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! What to expect:
//! - **Stacks, arches, wedges** stand where they were built, at mass ratios to 1e6.
//! - **Friction** is Coulomb's cone exactly: a box on a slope of less than its friction angle does
//!   not creep, `slip` is exactly 0.
//! - **Restitution** is Newton's law per contact, bounded per island where several impacts together
//!   would add energy ([`ImpactLaw`](crate::dynamics::ImpactLaw)). An impact is detected up to a step
//!   late; with `events` at its instant, as are without it the impacts that would leave a few bodies overlapped.
//! - **Joints** hold rigidly, at order 2 in the step length.
//! - **Damping** is exact in free motion.
//! - **Overlaps** at the start are moved apart by position alone, without a launch.
//! - **Cost**: structures that stand or hold together cost one to five times rapier's default step (a
//!   pyramid of 5050 boxes 1.25). A pile while it is hit costs ten times and more, and now and then an
//!   island stays unsolved. An island of more than 500 contacts is then answered by sweeps, at some
//!   five times rapier's cost, until it rests: it counts as unsolved but *bounded*, and the record
//!   states the worst closing velocity left ([`Effort`](crate::dynamics::Effort) asks for more). An
//!   island that leaves more than a tenth of the velocities at stake counts as *failed*.
//! - Chaotic scenes (a heap that falls) part ways after a few impacts, as two runs of rapier with
//!   different step lengths do.
//!
//! # Step length, scheme, events, solver
//! The step length is the world's `integration_parameters.dt`, [`MoreauSettings::dt`] where that
//! must be exact in `f64` (of 1/60 as `f32` the sixtieth is taken, of others six digits), or the argument of
//! [`MoreauPipeline::step_by`]. rapier's substeps, softness and iterations do nothing here. What
//! there is to set is [`StepperSettings`](crate::dynamics::StepperSettings):
//!
//! ```
//! use moreau2d::dynamics::{Scheme, StepperSettings};
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! /// Highest point after the first bounce of a ball dropped from 1 m with restitution 0.8.
//! fn rebound(stepper: StepperSettings) -> f64 {
//!     let mut world = PhysicsWorld::new();
//!     let rule = CoefficientCombineRule::Max;
//!     world.insert(
//!         RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5)),
//!         ColliderBuilder::cuboid(10.0, 0.5).restitution(0.8).restitution_combine_rule(rule),
//!     );
//!     let ball = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.5));
//!     let (ball, _) = world.insert(ball, ColliderBuilder::ball(0.5));
//!     let settings = MoreauSettings { stepper, dt: Some(0.01), ..MoreauSettings::default() };
//!     let mut pipeline = MoreauPipeline::new(settings).unwrap();
//!     let (mut peak, mut hit) = (0.0, false);
//!     while pipeline.time() < 1.1 {
//!         let record = pipeline.step(&mut world).unwrap();
//!         hit |= record.contacts.iter().any(|c| c.impulse_n > 0.0);
//!         if hit {
//!             peak = f64::max(peak, pipeline.pose(ball).unwrap().translation.y - 0.5);
//!         }
//!     }
//!     peak
//! }
//!
//! // the peak of exact physics, e^2 h, is met up to what lies between two steps: g dt^2 / 8
//! let exact = 0.8 * 0.8;
//! let located = rebound(StepperSettings { events: true, ..StepperSettings::default() });
//! assert!((located - exact).abs() < 1.3e-4);
//! // without events an impact is up to a step late, and with it the height
//! let plain = rebound(StepperSettings::default());
//! assert!((plain - exact).abs() < 0.05);
//! // a tolerance that no figure can meet, or events with a scheme that ignores gaps, is refused
//! let both = StepperSettings { events: true, scheme: Scheme::Moreau, ..StepperSettings::default() };
//! assert!(MoreauPipeline::new(MoreauSettings { stepper: both, ..Default::default() }).is_err());
//! ```
//!
//! - `scheme`: [`Staggered`](crate::dynamics::Scheme) unless you want Moreau's published rule.
//! - `events`: impacts located in time. For billiards, rocking blocks, bouncing balls; a switch
//!   because piles pay for it.
//! - `solver`: `auto` unless you compare; a solver of your own: [`super::own_solver`].
//! - `tolerance`: of impulses and of velocities, each relative to the island's own; 1e-8.
//! - `impact_law`, `recovery`, `shares`: see the type.
//!
//! Halve `dt` and look again: in persistent contact and on joints the error falls by four, where
//! impacts are not located by two. `moreau2d compare SCENE --ladder` draws it.
//!
//! # Sleeping
//! Islands sleep by rapier's own activation settings. Asleep they cost nothing, stand still to the
//! last bit, and **are in no record**: a wear law or a load sensor that must see every step sets
//! [`MoreauSettings::stay_awake`].
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! # let scene = || {
//! #     let mut world = PhysicsWorld::new();
//! #     world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(10.0, 0.5));
//! #     let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0));
//! #     let (body, _) = world.insert(body, ColliderBuilder::cuboid(0.5, 0.5));
//! #     (world, body)
//! # };
//! for stay_awake in [false, true] {
//!     let (mut world, body) = scene(); // a box on a floor
//!     let settings = MoreauSettings { stay_awake, ..MoreauSettings::default() };
//!     let mut pipeline = MoreauPipeline::new(settings)?;
//!     let mut contacts = 0;
//!     for _ in 0..180 {
//!         contacts = pipeline.step(&mut world)?.contacts.len();
//!     }
//!     assert_eq!(world.bodies[body].is_sleeping(), !stay_awake);
//!     assert_eq!(contacts, if stay_awake { 2 } else { 0 });
//! }
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! # Errors
//! A step returns [`StepError`](crate::dynamics::StepError) for what cannot be stepped: a number
//! that is not finite, a body without mass, a feature that is not there. It names the body,
//! collider or joint, and leaves the world as it was before the step. Nothing is skipped silently.
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! # let mut world = PhysicsWorld::new();
//! # let (ball, _) = world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
//! # let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
//! world.bodies[ball].set_linvel(Vector::new(Real::NAN, 0.0), true);
//! let error = pipeline.step(&mut world).unwrap_err();
//! assert!(error.to_string().contains("velocity [m/s] is NaN"));
//! world.bodies[ball].set_linvel(Vector::ZERO, true);
//! assert!(pipeline.step(&mut world).is_ok());
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! # rapier's queries
//! Our steps do not keep rapier's query tree and contact graph up to date. Before `world.cast_ray`
//! or `world.contact_pairs()` call [`MoreauPipeline::refresh_queries`]. Call it also before you move a
//! body with rapier's `KinematicCharacterController`, which uses that tree and walks through bodies
//! that are missing in it.
//!
//! [`MoreauPipeline::step`]: crate::rapier::MoreauPipeline::step
//! [`MoreauPipeline::step_by`]: crate::rapier::MoreauPipeline::step_by
//! [`MoreauPipeline::step_with_events`]: crate::rapier::MoreauPipeline::step_with_events
//! [`MoreauPipeline::results`]: crate::rapier::MoreauPipeline::results
//! [`MoreauPipeline::state`]: crate::rapier::MoreauPipeline::state
//! [`MoreauPipeline::refresh_queries`]: crate::rapier::MoreauPipeline::refresh_queries
//! [`MoreauSettings::dt`]: crate::rapier::MoreauSettings::dt
//! [`MoreauSettings::stay_awake`]: crate::rapier::MoreauSettings::stay_awake
