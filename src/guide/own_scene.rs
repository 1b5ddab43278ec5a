//! Your own scene: a small threshing machine, built step by step.
//!
//! A drum with teeth turns above a concave and drags grains through the gap; a belt feeds it; the
//! teeth wear. Every step of this guide is compiled, run and checked against mechanics. The machine is
//! a slice one metre deep: masses, loads and torques are per metre of width. The full-size machine,
//! with its crop, its calibration and its life, is the scene `thresher` and
//! [`crate::thresher`].
//!
//! # 1. A drum with teeth
//! An oriented polyline is one-sided: the solid lies on the left of its direction.
//! Counter-clockwise and closed it is a solid outline, concave corners included. Each of its
//! segments has a number; the segments are later the cells that wear.
//!
//! ```
//! use moreau2d::rapier::engine::prelude::*;
//! use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//!
#![doc = include_str!("machine/drum.rs")]
//!
//! let mut world = PhysicsWorld::new();
//! let drum = outline(drum_outline());
//! world.insert(RigidBodyBuilder::kinematic_velocity_based(), drum);
//! let grain = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.3));
//! let (grain, _) = world.insert(grain, ColliderBuilder::ball(0.02));
//! let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
//! for _ in 0..60 {
//!     assert_eq!(pipeline.step(&mut world)?.unsolved, 0);
//! }
//! // it lies on the flat tip of the upper tooth
//! let tip = 0.22 * 0.05_f64.cos();
//! let height = pipeline.pose(grain).unwrap().translation.y;
//! assert!((height - (tip + 0.02)).abs() < 1e-6, "{height}");
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! # 2. A concave
//! The same kind of collider, but open and clockwise: the steel is now outside, and grains lie in the
//! hollow.
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
#![doc = include_str!("machine/concave.rs")]
//!
//! let mut world = PhysicsWorld::new();
//! world.insert(RigidBodyBuilder::fixed(), concave());
//! let grain = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, -0.2));
//! let (grain, _) = world.insert(grain, ColliderBuilder::ball(0.01));
//! // sleeping bodies are in no record
//! let settings = MoreauSettings { stay_awake: true, ..MoreauSettings::default() };
//! let mut pipeline = MoreauPipeline::new(settings)?;
//! let mut touched = 0;
//! for _ in 0..60 {
//!     touched = pipeline.step(&mut world)?.contacts.len();
//! }
//! // at the lowest corner it lies on two segments, each 2.5 degrees from the horizontal
//! assert_eq!(touched, 2);
//! let height = pipeline.pose(grain).unwrap().translation.y;
//! let expected = -0.23 + 0.01 / 2.5_f64.to_radians().cos();
//! assert!((height - expected).abs() < 1e-6, "{height}");
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! # 3. Crop
//! Grains move through the gap, and a first balance: the impulses of the steel and of gravity on the
//! grains are equal to the change of their momentum.
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! use moreau2d::contact::Vec2;
//! # use machine::{concave, drum_outline, outline};
//! # mod machine {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/guide/machine/all.rs"));
//! # }
#![doc = include_str!("machine/grains.rs")]
//!
//! let (mut world, mut pipeline, _, grains) = machine();
//! let mass = 100.0 * std::f64::consts::PI * 0.008 * 0.008;
//! let mut given = Vec2::zeros();
//! for _ in 0..400 {
//!     let record = pipeline.step(&mut world)?;
//!     assert_eq!(record.unsolved, 0);
//!     let results = pipeline.results(&record);
//!     given += grains.iter().map(|g| results.on_body(*g).impulse).sum::<Vec2>();
//! }
//! let momentum: Vec2 = grains.iter().map(|g| mass * pipeline.velocity(*g).unwrap().xy()).sum();
//! let gravity = Vec2::new(0.0, -9.81) * 10.0 * mass * 0.2;
//! assert!((momentum - gravity - given).norm() < 1e-6 * given.norm());
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! # 4. The drum turns
//! Contacts do not change the motion of a kinematic body. The torque that drives it is the sum of the
//! moments of its contacts. The work of this torque is the energy that the grains gain plus the energy
//! that friction and impacts dissipate.
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! # use moreau2d::contact::Vec2;
//! # mod machine {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/guide/machine/all.rs"));
//! # }
//! # use machine::*;
//! let (mut world, mut pipeline, drum, grains) = machine();
//! let spin = 10.0;
//! let steel = world.bodies[drum].colliders()[0];
//! world.bodies[drum].set_angvel(spin as Real, true); // counter-clockwise: to the right below
//! let mut work = 0.0; // of the drum [J]
//! let (mut taken, mut lost) = (0.0, 0.0); // by the grains, by friction and impacts [J]
//! let mut thrown = 0;
//! for _ in 0..1000 {
//!     let record = pipeline.step(&mut world)?;
//!     assert_eq!(record.unsolved, 0);
//!     taken += record.energy.contact_n + record.energy.contact_t;
//!     lost += record.contacts.iter().map(|c| c.friction_work - c.normal_work).sum::<f64>();
//!     for contact in pipeline.results(&record).of_collider(steel) {
//!         // `impulse` acts on the second side
//!         let on_second = contact.colliders[1] == Some(steel);
//!         let on_drum = if on_second { contact.impulse() } else { -contact.impulse() };
//!         // the drum's centre is the origin
//!         work -= contact.record.position.perp(&on_drum) * spin;
//!     }
//!     // what has left the machine goes
//!     for grain in &grains {
//!         let gone = |body: &RigidBody| body.translation().length() > 0.4;
//!         if world.bodies.get(*grain).is_some_and(gone) {
//!             world.remove_body(*grain);
//!             thrown += 1;
//!         }
//!     }
//! }
//! // equal, up to what sticking contacts moved about their place: their slip is recorded as 0
//! assert!((work - taken - lost).abs() < 1e-4 * work, "{work} = {taken} + {lost} J");
//! assert_eq!(thrown, 10);
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! # 5. A motor instead
//! A drum that is driven with a limited torque is a dynamic body on a revolute joint with a
//! velocity motor. A polyline has no area, so mass and inertia are given. What every part of a
//! joint carries is in the record.
//!
//! ```
//! use moreau2d::dynamics::{JointCoordinate, JointPart};
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! let mut world = PhysicsWorld::new();
//! world.gravity = Vector::ZERO;
//! let axle = world.insert_body(RigidBodyBuilder::fixed());
//! let inertia = 0.5_f64; // [kg m2]
//! let drum = RigidBodyBuilder::dynamic()
//!     .additional_mass_properties(MassProperties::new(Vector::ZERO, 20.0, inertia as Real));
//! let drum = world.insert_body(drum);
//! // without gains it holds its speed, up to the torque given; with them it is a spring and damper
//! let motor = RevoluteJointBuilder::new().motor_velocity(4.0, 0.0).motor_max_force(2.0);
//! let motor = world.insert_impulse_joint(axle, drum, motor);
//! let mut pipeline = MoreauPipeline::new(MoreauSettings { dt: Some(0.005), ..Default::default() })?;
//! let mut work = 0.0;
//! for step in 1..=300 {
//!     let record = pipeline.step(&mut world)?;
//!     work += record.energy.motors;
//!     let spin = pipeline.velocity(drum).unwrap().z;
//!     // torque over inertia, until the speed is reached
//!     let expected = f64::min(2.0 / inertia * 0.005 * step as f64, 4.0);
//!     assert!((spin - expected).abs() < 1e-9, "step {step}: {spin}");
//!     let drive = JointPart::Drive(JointCoordinate::Angle);
//!     let torque = record.joint_force(motor.into_raw_parts().0, drive).x;
//!     let expected = if step <= 200 { 2.0 } else { 0.0 };
//!     assert!((torque - expected).abs() < 1e-9, "step {step}: {torque}");
//! }
//! assert!((work - 0.5 * inertia * 16.0).abs() < 1e-9, "{work}");
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! # 6. A belt
//! A [`SurfaceLaw`] adds surface properties that a rapier collider does not have. Its `speed` is that
//! of a belt round the collider, counter-clockwise: it is negative if the top of the belt runs to the
//! right.
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! use moreau2d::rapier::{MoreauPipeline, MoreauSettings, SurfaceLaw};
//! let mut world = PhysicsWorld::new();
//! let (_, belt) = world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(2.0, 0.1));
//! let crop = RigidBodyBuilder::dynamic().translation(Vector::new(-1.0, 0.15));
//! let (crop, _) = world.insert(crop, ColliderBuilder::cuboid(0.05, 0.05).density(100.0));
//! let mut pipeline = MoreauPipeline::new(MoreauSettings { dt: Some(0.005), ..Default::default() })?;
//! pipeline.set_surface(belt, SurfaceLaw { speed: -0.5, ..SurfaceLaw::default() });
//! for step in 1..=60 {
//!     pipeline.step(&mut world)?;
//!     // friction 0.5 accelerates it until it rides
//!     let expected = f64::min(0.5 * 9.81 * 0.005 * step as f64, 0.5);
//!     let v = pipeline.velocity(crop).unwrap().x;
//!     assert!((v - expected).abs() < 1e-6, "step {step}: {v}");
//! }
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! # 7. A surface that gives way
//! Straw is soft: `compliance` makes a contact a spring and a damper, \[N/m\] and \[N s/m\] a
//! contact point (per metre of covered segment with `cells`). It is implicit, so any
//! stiffness is stable.
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings, SurfaceLaw};
//! let mut world = PhysicsWorld::new();
//! let (_, mat) = world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(2.0, 0.1));
//! let weight = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.15));
//! let (weight, _) = world.insert(weight, ColliderBuilder::cuboid(0.05, 0.05).density(100.0));
//! let mut pipeline = MoreauPipeline::new(MoreauSettings { dt: Some(0.002), ..Default::default() })?;
//! pipeline.set_surface(mat, SurfaceLaw { compliance: Some((1e4, 100.0)), ..Default::default() });
//! for _ in 0..500 {
//!     pipeline.step(&mut world)?;
//! }
//! // 1 kg on two corners of 10 kN/m
//! let sunk = 0.15 - pipeline.pose(weight).unwrap().translation.y;
//! assert!((sunk - 9.81 / 2e4).abs() < 1e-8, "{sunk}");
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! # 8. Load and slip of every cell
//! With `cells` the segments of a polyline are cells, numbered from 0 in the order of its points.
//! Detection says on which cell of either surface a contact lies, and where on it. Archard's law uses
//! `load_slip`, the impulse times the slip velocity \[N m\], shared between the two nodes of the cell.
//! It needs no force, so an impact counts like sustained contact. The `load_slip` of a node whose
//! cells stick is 0.
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! # use moreau2d::rapier::{MoreauPipeline, MoreauSettings, SurfaceLaw};
//! # use moreau2d::contact::Vec2;
//! use moreau2d::wear::{Archard, LoadSlip};
//! # mod machine {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/guide/machine/all.rs"));
//! # }
//! # use machine::*;
//! let (mut world, mut pipeline, drum, _) = machine();
//! world.bodies[drum].set_angvel(10.0, true);
//! let steel = world.bodies[drum].colliders()[0];
//! let cells = SurfaceLaw { cells: true, ..SurfaceLaw::default() };
//! pipeline.set_surface(steel, cells);
//!
//! let mut sum = LoadSlip::ring(40);
//! for _ in 0..400 {
//!     let record = pipeline.step(&mut world)?;
//!     sum.add(&record.contacts, |contact| contact.place_on(steel.into_raw_parts().0))?;
//! }
//!
//! // depth = K S / w over half of the two segments beside each node, one metre deep
//! let points = drum_outline();
//! let length = |i: usize| f64::from((points[(i + 1) % 40] - points[i % 40]).length());
//! let widths: Vec<f64> = (0..40).map(|i| 0.5 * (length(i + 39) + length(i))).collect();
//! let law = Archard { coefficient: 1e-13 };
//! let depths = law.depths(sum.sums(), &widths)?;
//!
//! // the worn volume is K times all load and slip
//! let volume: f64 = depths.iter().zip(&widths).map(|(h, w)| h * w).sum();
//! let load_slip: f64 = sum.sums().iter().sum();
//! assert!((volume / (1e-13 * load_slip) - 1.0).abs() < 1e-12);
//! // of a tooth's five segments, trailing flank, tip, leading flank and twice the drum between, the
//! // leading flank, between the nodes 2 and 3, meets the grains: their spin holds them to the
//! // concave, clear of the drum
//! let share = |node: usize| (0..8).map(|k| sum.sums()[5 * k + node]).sum::<f64>() / load_slip;
//! assert!(share(2) + share(3) > 0.99);
//! assert_eq!(depths[1], 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What comes next, [`WornColliders`](crate::worn::WornColliders) does in your world: the outline worn
//! along its normals, re-meshed, with jumps bounded by their feedback, and the collider with its new
//! shape. The guide [`pin_on_disc`](super::pin_on_disc) shows it, in 25 lines.
//!
//! # 9. The same as a scene file
//! A scene file needs no program: `moreau2d run mine.toml` steps it, `moreau2d compare mine.toml`
//! holds it against rapier, `--set` changes any key. [`crate::scene`] lists the keys. Points
//! are written out; here they are printed into the text.
//!
//! ```
//! # use moreau2d::rapier::engine::prelude::*;
//! use moreau2d::scene::Scene;
//! # mod machine {
//! #     include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/guide/machine/all.rs"));
//! # }
//! # use machine::*;
//! let points: Vec<[Real; 2]> = drum_outline().iter().map(|p| [p.x, p.y]).collect();
//! let hollow: Vec<[f64; 2]> = (0..=28)
//!     .map(|i| {
//!         let (sin, cos) = (340.0 - 5.0 * i as f64).to_radians().sin_cos();
//!         [0.23 * cos, 0.23 * sin]
//!     })
//!     .collect();
//! let text = format!(
//!     r#"
//! [scene]
//! name = "small-thresher"
//! title = "A toothed drum drags grains through a concave"
//!
//! [step]
//! dt = 5e-4
//! time = 0.2
//!
//! [[material]]
//! name = "steel"
//! friction = 0.5
//!
//! [[body]]
//! name = "drum"
//! kind = "kinematic"
//! spin = 10
//! closed = true
//! polyline = {points:?}
//!
//! [[body]]
//! name = "concave"
//! kind = "fixed"
//! polyline = {hollow:?}
//!
//! [[body]]
//! name = "grain"
//! disc = 0.008
//! density = 100
//!
//! [[repeat]] # five grains from 236.25 to 258.75 degrees
//! of = "grain"
//! name = "left"
//! ring = {{ centre = [0, 0], radius = 0.2215, count = 5, arc = [4.123340, 4.516039] }}
//!
//! [[repeat]]
//! of = "grain"
//! name = "right"
//! ring = {{ centre = [0, 0], radius = 0.2215, count = 5, arc = [4.908739, 5.301438] }}
//!
//! [[body]]
//! name = "belt"
//! kind = "fixed"
//! box = [0.4, 0.02]
//! position = [-0.5, -0.1]
//! surface_velocity = -0.5
//!
//! [[body]]
//! name = "crop"
//! box = [0.05, 0.05]
//! density = 100
//! position = [-0.6, -0.065]
//! "#
//! );
//! let scene = Scene::parse("small-thresher.toml", &text, &[])?;
//! let mut built = scene.build()?;
//! let crop = scene.bodies.iter().position(|b| b.name == "crop").unwrap();
//! let drum = scene.bodies.iter().position(|b| b.name == "drum").unwrap();
//! let mut load_slip = 0.0;
//! for _ in 0..400 {
//!     let record = built.step()?;
//!     assert_eq!(record.unsolved, 0);
//!     let on_drum = |bodies: [u32; 2]| bodies.contains(&built.number(drum).unwrap());
//!     let drums = record.contacts.iter().filter(|c| on_drum(c.bodies));
//!     load_slip += drums.map(|c| c.load_slip).sum::<f64>();
//! }
//! // the crop rides on the belt, the drum is worn
//! let (_, velocity) = built.state(crop).unwrap();
//! assert!((velocity.x - 0.5).abs() < 1e-6, "{velocity}");
//! assert!(load_slip > 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A motor is `motor = { speed = 4, max_torque = 2 }` in a `[[joint]]`, a compliant surface
//! `stiffness` and `damping` in a `[[material]]`. Cells and wear of an outline of one's own are the
//! library's (step 8); a body of a file wears with `[[wear]]` ([`pin_on_disc`](super::pin_on_disc)), a machine with
//! `[tooth]`, `[wear]` and `[thresher]`.
//!
//! [`SurfaceLaw`]: crate::rapier::SurfaceLaw
