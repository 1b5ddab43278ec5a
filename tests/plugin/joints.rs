//! Joints of a rapier world: what they carry against statics, how well they hold, and what is
//! refused.

use approx::assert_relative_eq;
use moreau2d::contact::Vec2;
use moreau2d::dynamics::record::StepRecord;
use moreau2d::dynamics::{JointCoordinate as Axis, JointPart as Part, StepError, StepperSettings};
use moreau2d::rapier::engine::dynamics::SpringCoefficients;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const G: f64 = 10.0;
const DT: f64 = 1.0 / 120.0;

/// A world that is stepped by one pipeline.
struct Bench {
    world: PhysicsWorld,
    pipeline: MoreauPipeline,
    dt: f64,
}

impl Bench {
    fn new(gravity: [f64; 2], dt: f64, events: bool) -> Bench {
        let settings = MoreauSettings {
            stepper: StepperSettings {
                events,
                ..StepperSettings::default()
            },
            gravity: Some(Vec2::from(gravity)),
            dt: Some(dt),
            ..MoreauSettings::default()
        };
        Bench {
            world: PhysicsWorld::new(),
            pipeline: MoreauPipeline::new(settings).unwrap(),
            dt,
        }
    }

    fn down(dt: f64) -> Bench {
        Bench::new([0.0, -G], dt, false)
    }

    fn ground(&mut self) -> RigidBodyHandle {
        self.world.bodies.insert(RigidBodyBuilder::fixed())
    }

    /// A body without a shape: mass 2 kg, moment of inertia 0.25 kg m².
    fn body(&mut self, x: f64, y: f64) -> RigidBodyHandle {
        let properties = MassProperties::new(Vector::ZERO, 2.0, 0.25);
        let body = RigidBodyBuilder::dynamic()
            .translation(vector([x, y]))
            .can_sleep(false)
            .additional_mass_properties(properties);
        self.world.bodies.insert(body)
    }

    fn join(
        &mut self,
        a: RigidBodyHandle,
        b: RigidBodyHandle,
        joint: impl Into<GenericJoint>,
    ) -> u32 {
        let handle = self.world.impulse_joints.insert(a, b, joint.into(), true);
        handle.into_raw_parts().0
    }

    fn step(&mut self) -> StepRecord {
        let record = self.pipeline.step(&mut self.world).unwrap();
        assert_eq!(record.unsolved, 0, "t = {}", record.time);
        assert!(
            record.energy.imbalance().abs() <= 1e-10 * (1.0 + record.energy.kinetic_end),
            "{:?}",
            record.energy
        );
        record
    }

    fn run(&mut self, time: f64) -> StepRecord {
        let steps = (time / self.dt).round() as usize;
        let mut last = None;
        for _ in 0..steps {
            last = Some(self.step());
        }
        last.unwrap()
    }

    fn place(&self, body: RigidBodyHandle) -> [f64; 3] {
        let pose = self.pipeline.pose(body).unwrap();
        [pose.translation.x, pose.translation.y, pose.angle()]
    }
}

fn vector(v: [f64; 2]) -> Vector {
    Vector::new(v[0] as Real, v[1] as Real)
}

fn at(joint: &mut GenericJoint, first: [f64; 2], second: [f64; 2]) -> GenericJoint {
    joint.set_local_anchor1(vector(first));
    joint.set_local_anchor2(vector(second));
    *joint
}

/// The joint seen from the other side: bodies, anchors and axes change places.
fn swapped(joint: &GenericJoint) -> GenericJoint {
    let mut other = *joint;
    (other.local_frame1, other.local_frame2) = (joint.local_frame2, joint.local_frame1);
    other
}

// --- statics ----------------------------------------------------------------------------------

/// A lever of arm 0.5 m held level: m g l = 10 N m, and its weight on the pin.
#[test]
fn a_motor_holds_a_lever_and_gives_way_beyond_its_torque() {
    for (model, gain) in [
        (MotorModel::AccelerationBased, 1e12),
        (MotorModel::ForceBased, 1e12),
        (MotorModel::ForceBased, 0.0),
    ] {
        for swap in [false, true] {
            let mut bench = Bench::down(DT);
            let (ground, lever) = (bench.ground(), bench.body(0.75, 1.0));
            let mut joint = RevoluteJointBuilder::new()
                .motor_model(model)
                .motor_velocity(0.0, gain as Real)
                .motor_max_force(30.0)
                .build()
                .into();
            let joint = at(&mut joint, [0.25, 1.0], [-0.5, 0.0]);
            let id = if swap {
                bench.join(lever, ground, swapped(&joint))
            } else {
                bench.join(ground, lever, joint)
            };
            let sign = if swap { -1.0 } else { 1.0 };
            let record = bench.run(0.5);
            let torque = record.joint_force(id, Part::Drive(Axis::Angle)).x;
            assert_relative_eq!(torque, sign * 10.0, max_relative = 1e-6);
            let pin = record.joint_force(id, Part::Pin);
            assert!(pin.x.abs() < 1e-5, "{pin}");
            assert_relative_eq!(pin.y, sign * 20.0, max_relative = 1e-6);
            assert!(bench.place(lever)[2].abs() < 1e-6);
            // too weak: it carries all it can, and the lever falls
            let joint = bench.world.impulse_joints.iter().next().unwrap().0;
            let joint = bench.world.impulse_joints.get_mut(joint, true).unwrap();
            joint.data.set_motor_max_force(JointAxis::AngX, 4.0);
            let record = bench.run(0.2);
            let torque = record.joint_force(id, Part::Drive(Axis::Angle)).x;
            assert_relative_eq!(torque, sign * 4.0, max_relative = 1e-12);
            // J + m l² = 0.75: (10 - 4)/0.75 rad/s² for 0.2 s, from level
            let turned = bench.place(lever)[2];
            assert!((turned + 0.16).abs() < 2e-3, "{turned}");
        }
    }
}

#[test]
fn limits_of_a_pin_carry_a_lever_on_both_sides() {
    for events in [false, true] {
        for (limits, part, swap) in [
            ([0.0, 1.0], Part::Lower(Axis::Angle), false),
            ([-1.0, 0.0], Part::Upper(Axis::Angle), true),
            // both at once: locked
            ([0.0, 0.0], Part::Lock(Axis::Angle), false),
        ] {
            let mut bench = Bench::new([0.0, -G], DT, events);
            let (ground, lever) = (bench.ground(), bench.body(0.5, 0.0));
            let mut joint = RevoluteJointBuilder::new()
                .limits(limits.map(|x| x as Real))
                .build()
                .into();
            let joint = at(&mut joint, [0.0, 0.0], [-0.5, 0.0]);
            let id = if swap {
                bench.join(lever, ground, swapped(&joint))
            } else {
                bench.join(ground, lever, joint)
            };
            let record = bench.run(0.5);
            // it keeps the lever from turning clockwise, in the sense in which a limit pushes
            let carried = record.joint_force(id, part).x;
            assert_relative_eq!(carried, 10.0, max_relative = 1e-6);
            assert!(bench.place(lever)[2].abs() < 1e-7);
        }
    }
}

/// Falls onto its limit at 45 degrees below level, and stays there.
#[test]
fn a_lever_lands_on_its_limit_and_rests() {
    for events in [false, true] {
        let mut bench = Bench::new([0.0, -G], DT, events);
        let (ground, lever) = (bench.ground(), bench.body(0.5, 0.0));
        let mut joint = RevoluteJointBuilder::new()
            .limits([-PI as Real / 4.0, 1.0])
            .build()
            .into();
        let joint = at(&mut joint, [0.0, 0.0], [-0.5, 0.0]);
        let id = bench.join(ground, lever, joint);
        let mut lowest = 0.0f64;
        for _ in 0..240 {
            bench.step();
            lowest = lowest.min(bench.place(lever)[2]);
        }
        let record = bench.step();
        // an angle does not bend: the limit is met exactly, but for its own f32
        assert!(lowest > -PI / 4.0 - 1e-7, "{lowest}");
        assert!((bench.place(lever)[2] + PI / 4.0).abs() < 1e-7);
        let carried = record.joint_force(id, Part::Lower(Axis::Angle)).x;
        assert_relative_eq!(carried, 10.0 * (PI / 4.0).cos(), max_relative = 1e-6);
    }
}

/// A slider on an incline of 3 : 4, so that sin = 0.6 and cos = 0.8 of 20 N.
#[test]
fn a_slider_on_an_incline_stands_on_its_limit_or_its_motor() {
    let axis = vector([0.8, 0.6]);
    for (motor, swap) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut bench = Bench::down(DT);
        let (ground, slider) = (bench.ground(), bench.body(0.0, 0.0));
        let mut joint = PrismaticJointBuilder::new(axis);
        joint = if motor {
            joint.motor_velocity(0.0, 1e12).motor_max_force(50.0)
        } else {
            joint.limits([0.0, 2.0])
        };
        let mut joint: GenericJoint = joint.build().into();
        // both frames along the incline: the slider itself stays level
        let joint = if swap {
            // seen from the slider the ground moves the other way
            if !motor {
                joint.set_limits(JointAxis::LinX, [-2.0, 0.0]);
            }
            let id = bench.join(slider, ground, swapped(&joint));
            (id, -1.0)
        } else {
            (bench.join(ground, slider, joint), 1.0)
        };
        let (id, sign) = joint;
        let record = bench.run(0.5);
        let part = match (motor, swap) {
            (true, _) => Part::Drive(Axis::X),
            (false, false) => Part::Lower(Axis::X),
            (false, true) => Part::Upper(Axis::X),
        };
        let along = record.joint_force(id, part).x;
        let expected = if motor { sign * 12.0 } else { 12.0 };
        assert_relative_eq!(along, expected, max_relative = 1e-6);
        let across = record.joint_force(id, Part::Lock(Axis::Y)).x;
        assert_relative_eq!(across, sign * 16.0, max_relative = 1e-6);
        let moment = record.joint_force(id, Part::Lock(Axis::Angle)).x;
        assert!(moment.abs() < 1e-5, "{moment}");
        let [x, y, angle] = bench.place(slider);
        assert!(x.hypot(y) < 1e-7 && angle.abs() < 1e-7, "{x} {y} {angle}");
    }
}

/// A cantilever of two bodies: the root carries both weights and their moment, the joint between
/// them one. On the ground, and on a body that stands still but could move by itself.
#[test]
fn a_fixed_joint_carries_force_and_moment() {
    for driven in [false, true] {
        for swap in [false, true] {
            let mut bench = Bench::down(DT);
            let root = if driven {
                let body = RigidBodyBuilder::kinematic_velocity_based();
                bench.world.bodies.insert(body)
            } else {
                bench.ground()
            };
            let (near, far) = (bench.body(0.5, 0.0), bench.body(1.5, 0.0));
            let mut ids = [0; 2];
            for (k, (a, b)) in [(root, near), (near, far)].into_iter().enumerate() {
                let first = if k == 0 { [0.0, 0.0] } else { [0.5, 0.0] };
                let mut joint = FixedJointBuilder::new().build().into();
                let joint = at(&mut joint, first, [-0.5, 0.0]);
                ids[k] = if swap {
                    bench.join(b, a, swapped(&joint))
                } else {
                    bench.join(a, b, joint)
                };
            }
            let record = bench.run(0.5);
            let sign = if swap { -1.0 } else { 1.0 };
            for (id, force, moment) in [(ids[0], 40.0, 40.0), (ids[1], 20.0, 10.0)] {
                let pin = record.joint_force(id, Part::Pin);
                assert_relative_eq!(pin.y, sign * force, max_relative = 1e-6);
                let carried = record.joint_force(id, Part::Lock(Axis::Angle)).x;
                assert_relative_eq!(carried, sign * moment, max_relative = 1e-6);
            }
            assert!(record.joint_gap < 1e-9, "{}", record.joint_gap);
        }
    }
}

#[test]
fn a_rope_carries_the_weight_when_taut_and_nothing_when_slack() {
    for swap in [false, true] {
        let mut bench = Bench::down(DT);
        let (ground, load) = (bench.ground(), bench.body(0.0, -1.0));
        let mut joint = RopeJointBuilder::new(1.5).build().into();
        // held above the centre of mass, so that the load hangs still
        let joint = at(&mut joint, [0.0, 0.25], [0.0, 0.25]);
        let id = if swap {
            bench.join(load, ground, swapped(&joint))
        } else {
            bench.join(ground, load, joint)
        };
        // 0.5 m to fall take 0.316 s
        let record = bench.run(0.3);
        let part = Part::Upper(Axis::Distance);
        assert_eq!(record.joint_force(id, part).x, 0.0);
        assert_relative_eq!(
            bench.pipeline.velocity(load).unwrap().y,
            -3.0,
            epsilon = 1e-9
        );
        let record = bench.run(0.2);
        assert_relative_eq!(record.joint_force(id, part).x, 20.0, max_relative = 1e-6);
        assert!((bench.place(load)[1] + 1.5).abs() < 1e-9);
    }
}

/// A pin that slides across a level slot of the ground: the slot carries the weight, and a spring
/// on it the load along it.
#[test]
fn a_pin_in_a_slot_carries_across_it_only() {
    for swap in [false, true] {
        let mut bench = Bench::new([3.0, -G], DT, false);
        let (ground, body) = (bench.ground(), bench.body(0.0, -0.5));
        let mut joint: GenericJoint = PinSlotJointBuilder::new(Vector::X)
            .local_anchor2(vector([0.0, 0.5]))
            .build()
            .into();
        joint.set_motor_position(JointAxis::LinX, 0.0, 600.0, 40.0);
        joint.set_motor_model(JointAxis::LinX, MotorModel::ForceBased);
        let id = if swap {
            // the slot is now on the body, which hangs askew: hold it level
            joint.lock_axes(JointAxesMask::ANG_X);
            bench.join(body, ground, swapped(&joint))
        } else {
            bench.join(ground, body, joint)
        };
        let sign = if swap { -1.0 } else { 1.0 };
        let mut mean = [0.0; 2];
        bench.run(60.0);
        let last = 4 * 120;
        for _ in 0..last {
            let record = bench.step();
            mean[0] += record.joint_force(id, Part::Drive(Axis::X)).x / f64::from(last);
            mean[1] += record.joint_force(id, Part::Lock(Axis::Y)).x / f64::from(last);
            assert!(record.joint_gap < 1e-3, "{}", record.joint_gap);
        }
        // the body still swings a little where nothing holds it level
        let slack = if swap { 1e-6 } else { 1e-2 };
        assert_relative_eq!(mean[0], -sign * 6.0, max_relative = slack);
        assert_relative_eq!(mean[1], sign * 20.0, max_relative = slack);
    }
}

// --- springs, dampers, motors in motion --------------------------------------------------------

/// m g / k below its rest length, and no lower.
#[test]
fn a_spring_at_rest_is_stretched_by_the_weight() {
    for model in [MotorModel::ForceBased, MotorModel::AccelerationBased] {
        let mut bench = Bench::down(DT);
        let (ground, load) = (bench.ground(), bench.body(0.0, -1.0));
        let joint = SpringJointBuilder::new(0.5, 400.0, 60.0)
            .spring_model(model)
            .build();
        let id = bench.join(ground, load, joint);
        let record = bench.run(20.0);
        // per mass k is 400 1/s²
        let stretch = match model {
            MotorModel::ForceBased => 20.0 / 400.0,
            MotorModel::AccelerationBased => 10.0 / 400.0,
        };
        let y = bench.place(load)[1];
        assert_relative_eq!(-y - 0.5, stretch, max_relative = 1e-6);
        let force = record.joint_force(id, Part::Drive(Axis::Distance)).x;
        assert_relative_eq!(force, -20.0, max_relative = 1e-6);
    }
}

fn order(errors: &[f64]) -> f64 {
    let (first, last) = (errors[0], errors[errors.len() - 1]);
    (first / last).log2() / (errors.len() - 1) as f64
}

/// Two bodies on a spring: `x = x₀ cos ω t`, `ω² = 2 k/m`, and damped by `c` as `e^{−δt}`.
#[test]
fn springs_and_dampers_converge_at_order_two_and_gain_nothing() {
    for damping in [0.0, 8.0] {
        let errors: Vec<f64> = [60.0, 120.0, 240.0, 480.0]
            .into_iter()
            .map(|rate| {
                let mut bench = Bench::new([0.0, 0.0], 1.0 / rate, false);
                let (a, b) = (bench.body(0.0, 0.0), bench.body(1.25, 0.0));
                let joint = SpringJointBuilder::new(1.0, 100.0, damping as Real);
                bench.join(a, b, joint.build());
                bench.run(2.0);
                let (k, m, c) = (100.0f64, 2.0, damping);
                let (delta, omega0) = (c / m, (2.0 * k / m).sqrt());
                let omega = (omega0 * omega0 - delta * delta).sqrt();
                let (sin, cos) = (2.0 * omega).sin_cos();
                let x = 0.25 * (-2.0 * delta).exp() * (cos + delta / omega * sin);
                let found = bench.place(b)[0] - bench.place(a)[0] - 1.0;
                (found - x).abs()
            })
            .collect();
        let p = order(&errors);
        assert!((p - 2.0).abs() < 0.2, "damping {damping}: {p}, {errors:?}");
    }
    // however stiff: no energy is made
    for stiffness in [1e2, 1e6, 1e10] {
        let mut bench = Bench::new([0.0, 0.0], 1.0 / 60.0, false);
        let (a, b) = (bench.body(0.0, 0.0), bench.body(1.001, 0.0));
        bench.join(
            a,
            b,
            SpringJointBuilder::new(1.0, stiffness as Real, 0.0).build(),
        );
        let stored = 0.5 * stiffness * 1e-6;
        for _ in 0..600 {
            let record = bench.step();
            // f32 places the second body to 1e-7 m
            assert!(record.energy.kinetic_end <= 1.01 * stored, "{stiffness}");
        }
    }
}

/// Alone a damper decays as it should at any step, and a strong one holds its speed.
#[test]
fn a_damper_decays_exactly() {
    for (damping, dt) in [(0.01, 0.1), (3.0, 0.1), (200.0, 0.1), (1e9, 0.1)] {
        let mut bench = Bench::new([0.0, 0.0], dt, false);
        let (ground, wheel) = (bench.ground(), bench.body(0.0, 0.0));
        // per mass: the rate is 1/s
        let joint = RevoluteJointBuilder::new().motor_velocity(2.0, damping as Real);
        bench.join(ground, wheel, joint.build());
        for k in 1..=5 {
            bench.step();
            let expected = 2.0 * (1.0 - (-damping * dt * f64::from(k)).exp());
            let spin = bench.pipeline.velocity(wheel).unwrap().z;
            assert_relative_eq!(spin, expected, max_relative = 1e-7);
        }
    }
}

/// What rapier itself does with a motor without gain: it drives, as hard as it may.
#[test]
fn a_motor_without_gain_holds_its_speed_as_in_rapier() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (ground, wheel) = (bench.ground(), bench.body(0.0, 0.0));
    let joint = RevoluteJointBuilder::new().motor_velocity(3.0, 0.0);
    bench.join(ground, wheel, joint.build());
    bench.world.gravity = Vector::ZERO;
    let mut rapier = PhysicsWorld::new();
    rapier.gravity = Vector::ZERO;
    let ground = rapier.bodies.insert(RigidBodyBuilder::fixed());
    let properties = MassProperties::new(Vector::ZERO, 2.0, 0.25);
    let same = rapier
        .bodies
        .insert(RigidBodyBuilder::dynamic().additional_mass_properties(properties));
    rapier
        .impulse_joints
        .insert(ground, same, joint.build(), true);
    bench.run(0.2);
    for _ in 0..12 {
        rapier.step();
    }
    let spin = bench.pipeline.velocity(wheel).unwrap().z;
    assert_relative_eq!(spin, 3.0, max_relative = 1e-12);
    assert!((f64::from(rapier.bodies[same].angvel()) - 3.0).abs() < 1e-3);
}

/// A servo turns to its angle by the shorter way, and holds it against a load of k Δθ.
#[test]
fn a_position_motor_takes_the_shorter_way() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (ground, wheel) = (bench.ground(), bench.body(0.0, 0.0));
    let target = 3.0;
    let joint = RevoluteJointBuilder::new()
        .motor_model(MotorModel::ForceBased)
        .motor_position(target as Real, 10.0, 3.0);
    bench.join(ground, wheel, joint.build());
    let turned = RigidBodyBuilder::dynamic().rotation(-3.0).build();
    let pose = *turned.position();
    bench.world.bodies[wheel].set_position(pose, true);
    let mut least = 0.0f64;
    for _ in 0..1200 {
        bench.step();
        let spin = bench.pipeline.velocity(wheel).unwrap().z;
        least = least.min(spin);
    }
    // 2π − 6 rad backwards, not 6 rad forwards
    assert!(least < -0.1, "{least}");
    let angle = bench.place(wheel)[2].rem_euclid(TAU);
    assert!((angle - target).abs() < 1e-6, "{angle}");
}

/// A motor that is not bounded does not fight the limit it runs into.
#[test]
fn a_motor_stops_at_its_limit() {
    let mut bench = Bench::down(DT);
    let (ground, slider) = (bench.ground(), bench.body(0.0, 0.0));
    let joint = PrismaticJointBuilder::new(Vector::X)
        .limits([-1.0, 0.7])
        .motor_velocity(2.0, 1e12);
    let id = bench.join(ground, slider, joint.build());
    let record = bench.run(1.0);
    assert_relative_eq!(bench.place(slider)[0], 0.7, epsilon = 1e-7);
    assert!(record.joint_force(id, Part::Upper(Axis::X)).x.abs() < 1e-6);
}

/// A motor between two free bodies: equal and opposite, its work the energy they have.
#[test]
fn a_motor_between_free_bodies_gives_its_work_and_no_momentum() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (a, b) = (bench.body(-0.3, 0.0), bench.body(0.3, 0.1));
    let mut joint = RevoluteJointBuilder::new()
        .motor_velocity(4.0, 1e12)
        .motor_max_force(1.5)
        .build()
        .into();
    let joint = at(&mut joint, [0.3, 0.0], [-0.3, -0.1]);
    bench.join(a, b, joint);
    let (mut motors, mut pins) = (0.0, 0.0);
    for _ in 0..240 {
        let record = bench.step();
        motors += record.energy.motors;
        pins += record.energy.joints;
        let told: f64 = record.joints.iter().map(|j| j.work).sum();
        assert_relative_eq!(
            told,
            record.energy.joints + record.energy.motors,
            epsilon = 1e-14
        );
    }
    let [u, v] = [a, b].map(|k| bench.pipeline.velocity(k).unwrap());
    assert!((u.xy() + v.xy()).norm() < 1e-12);
    assert_relative_eq!(v.z - u.z, 4.0, max_relative = 1e-9);
    let kinetic = |u: moreau2d::contact::Vec3| u.xy().norm_squared() + 0.125 * u.z * u.z;
    assert_relative_eq!(motors + pins, kinetic(u) + kinetic(v), max_relative = 1e-12);
    assert!(pins.abs() < 1e-3 * motors, "{pins} of {motors}");
}

// --- drift -------------------------------------------------------------------------------------

/// Two rods, let go level; a worst gap, at midpoints and at the ends of steps.
fn swing(dt: f64, time: f64, events: bool) -> ([f64; 2], [f64; 2], f64) {
    let mut bench = Bench::new([0.0, -G], dt, events);
    let (ground, upper, lower) = (bench.ground(), bench.body(0.5, 0.0), bench.body(1.5, 0.0));
    let mut joint = RevoluteJointBuilder::new().build().into();
    bench.join(ground, upper, at(&mut joint, [0.0, 0.0], [-0.5, 0.0]));
    bench.join(upper, lower, at(&mut joint, [0.5, 0.0], [-0.5, 0.0]));
    let (mut middle, mut end, mut rise) = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..(time / dt).round() as usize {
        let record = bench.step();
        assert_eq!(record.joints_capped, 0);
        middle = middle.max(record.joint_gap);
        let energy = record.energy.kinetic_end + record.energy.potential_end;
        rise = rise.max(energy.abs());
        let [p, q] = [upper, lower].map(|k| bench.pipeline.pose(k).unwrap());
        let half = Vec2::new(0.5, 0.0);
        end = end.max(p.apply(-half).norm());
        end = end.max((q.apply(-half) - p.apply(half)).norm());
    }
    let [x, y, _] = bench.place(lower);
    ([middle, end], [x, y], rise)
}

#[test]
fn pins_of_a_double_pendulum_hold_at_order_two() {
    let rates = [240.0, 480.0, 960.0, 1920.0];
    let runs = rates.map(|rate| swing(1.0 / rate, 1.5, false));
    for which in 0..2 {
        let gaps = runs.map(|(gap, _, _)| gap[which]);
        let p = order(&gaps);
        assert!((p - 2.0).abs() < 0.2, "gap {which}, order {p}: {gaps:?}");
    }
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let steps: Vec<f64> = (0..3).map(|k| apart(runs[k].1, runs[k + 1].1)).collect();
    let p = order(&steps);
    assert!((p - 2.0).abs() < 0.25, "trajectory, order {p}: {steps:?}");
    // its error is of third order, its rise in the first second of second
    let energy = runs.map(|(_, _, rise)| rise);
    assert!(order(&energy) > 1.8, "{energy:?}");
}

/// A minute at 1/240 s: all the energy, m g (1 + 3) = 40 J and J ω²/2, could turn a body by 18 rad/s, and
/// a gap of `(ω Δt)² r/2` is 1.4 mm.
#[test]
fn pins_of_a_double_pendulum_do_not_drift_in_a_minute() {
    for events in [false, true] {
        let ([middle, end], _, rise) = swing(1.0 / 240.0, 60.0, events);
        assert!(middle < 1.4e-3 && end < 1.4e-3, "{middle} {end}");
        assert!(rise < 0.02 * 40.0, "{rise}");
    }
}

#[test]
fn pins_at_rest_hold_to_a_nanometre() {
    let mut bench = Bench::down(1.0 / 240.0);
    let (ground, upper, lower) = (bench.ground(), bench.body(0.0, -0.5), bench.body(0.0, -1.5));
    let mut joint = RevoluteJointBuilder::new().build().into();
    bench.join(ground, upper, at(&mut joint, [0.0, 0.0], [0.0, 0.5]));
    bench.join(upper, lower, at(&mut joint, [0.0, -0.5], [0.0, 0.5]));
    for _ in 0..2400 {
        let record = bench.step();
        assert!(record.joint_gap < 1e-9);
    }
}

/// Bug: pins whose bodies turned by a radian in a step fed energy without end.
#[test]
fn a_pin_that_turns_a_radian_in_a_step_feeds_no_energy() {
    for (dt, spin) in [(1.0 / 60.0, 60.0), (1.0 / 30.0, 60.0), (1.0 / 30.0, 300.0)] {
        let mut bench = Bench::new([0.0, 0.0], dt, false);
        let ground = bench.ground();
        let bodies = [0.5, 1.5, 2.5].map(|x| bench.body(x, 0.0));
        let mut joint = RevoluteJointBuilder::new().build().into();
        let mut before = ground;
        for (k, &body) in bodies.iter().enumerate() {
            let first = if k == 0 { [0.0, 0.0] } else { [0.5, 0.0] };
            bench.join(before, body, at(&mut joint, first, [-0.5, 0.0]));
            before = body;
        }
        bench.world.bodies[bodies[2]].set_angvel(spin as Real, true);
        let start = 0.125 * spin * spin;
        for _ in 0..(20.0 / dt) as usize {
            let record = bench.step();
            let kinetic = record.energy.kinetic_end;
            assert!(kinetic <= 1.25 * start, "{dt} {spin}: {kinetic} of {start}");
        }
    }
}

/// A joint that is built half a metre apart is drawn together without a bang.
#[test]
fn a_joint_built_apart_is_closed_without_energy() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (a, b) = (bench.body(0.0, 0.0), bench.body(1.5, 0.3));
    let mut joint = RevoluteJointBuilder::new().build().into();
    bench.join(a, b, at(&mut joint, [0.5, 0.0], [-0.5, 0.0]));
    let record = bench.run(0.1);
    assert!(record.joint_gap < 1e-9, "{}", record.joint_gap);
    assert!(record.energy.kinetic_end < 1e-12, "{:?}", record.energy);
}

/// A pendulum on a pin that moves by itself keeps the pin's way.
#[test]
fn joints_follow_a_body_that_moves_by_itself() {
    let mut bench = Bench::down(DT);
    let rail = RigidBodyBuilder::kinematic_velocity_based().linvel(vector([0.5, 0.0]));
    let rail = bench.world.bodies.insert(rail);
    let load = bench.body(0.0, -0.5);
    let mut joint = FixedJointBuilder::new().build().into();
    bench.join(rail, load, at(&mut joint, [0.0, 0.0], [0.0, 0.5]));
    bench.run(2.0);
    let [x, y, _] = bench.place(load);
    // half a step of the first one is spent to take up the speed
    assert_relative_eq!(x, 1.0, epsilon = 1e-9);
    assert_relative_eq!(y, -0.5, epsilon = 1e-9);
}

#[test]
fn a_softness_of_its_own_makes_springs_of_locked_axes() {
    let mut bench = Bench::down(DT);
    let (ground, load) = (bench.ground(), bench.body(0.0, 0.0));
    let softness = SpringCoefficients {
        natural_frequency: 2.0,
        damping_ratio: 1.0,
    };
    let joint = FixedJointBuilder::new().softness(softness).build();
    let id = bench.join(ground, load, joint);
    let record = bench.run(10.0);
    // g / ω², ω = 4π
    let sag = 10.0 / (4.0 * PI * 4.0 * PI);
    assert_relative_eq!(-bench.place(load)[1], sag, max_relative = 1e-5);
    let force = record.joint_force(id, Part::Lock(Axis::Y)).x;
    assert_relative_eq!(force, 20.0, max_relative = 1e-6);
}

// --- refusals ----------------------------------------------------------------------------------

#[test]
fn what_is_no_joint_is_refused_by_number_and_name() {
    let refused = |joint: GenericJoint, what: &[&str]| {
        let mut bench = Bench::down(DT);
        let (ground, body) = (bench.ground(), bench.body(0.5, 0.0));
        bench.join(ground, body, joint);
        let error = bench.pipeline.step(&mut bench.world).unwrap_err();
        assert!(matches!(error, StepError::Model(_)), "{error:?}");
        let text = error.to_string();
        for part in what.iter().chain(&["joint 0"]) {
            assert!(text.contains(part), "{part}: {text}");
        }
    };
    let revolute = RevoluteJointBuilder::new;
    let pin: GenericJoint = revolute().build().into();
    let free = || GenericJointBuilder::new(JointAxesMask::empty());
    refused(
        free().coupled_axes(JointAxesMask::LIN_X).build(),
        &["generic", "coupling", "not supported"],
    );
    refused(
        GenericJointBuilder::new(JointAxesMask::LIN_Y)
            .coupled_axes(JointAxesMask::LIN_AXES)
            .build(),
        &["locked and coupled"],
    );
    let mut rope: GenericJoint = RopeJointBuilder::new(1.0).build().into();
    rope.set_limits(JointAxis::LinY, [0.0, 1.0]);
    refused(rope, &["rope", "second"]);
    let mut askew = pin;
    askew.local_frame2.translation.x = Real::NAN;
    refused(askew, &["revolute", "body 2", "not finite"]);
    let mut askew = pin;
    askew.local_frame1.rotation = Rotation::from_cos_sin_unchecked(0.0, 0.0);
    refused(askew, &["body 1", "not finite"]);
    refused(
        revolute().limits([1.0, -1.0]).build().into(),
        &["limits of Angle", "1 and -1"],
    );
    refused(
        revolute().limits([Real::NAN, 1.0]).build().into(),
        &["limits of Angle", "NaN"],
    );
    refused(
        PrismaticJointBuilder::new(Vector::X)
            .motor_position(0.0, -5.0, 0.0)
            .build()
            .into(),
        &["prismatic", "motor of X", "stiffness is -5"],
    );
    refused(
        SpringJointBuilder::new(1.0, 1.0, -1.0).build().into(),
        &["spring", "damping is -1"],
    );
    refused(
        revolute()
            .motor_velocity(Real::INFINITY, 1.0)
            .build()
            .into(),
        &["target velocity is inf"],
    );
    refused(
        revolute()
            .motor_velocity(1.0, 1.0)
            .motor_max_force(-1.0)
            .build()
            .into(),
        &["largest force is -1"],
    );
    let softness = SpringCoefficients {
        natural_frequency: 5.0,
        damping_ratio: 1.0,
    };
    refused(
        revolute()
            .softness(softness)
            .limits([-1.0, 1.0])
            .build()
            .into(),
        &["softness of its own"],
    );
    let negative = SpringCoefficients {
        damping_ratio: -1.0,
        ..softness
    };
    refused(
        revolute().softness(negative).build().into(),
        &["damping ratio -1"],
    );
}

/// A whole turn is no limit, and a joint that is switched off holds nothing.
#[test]
fn what_holds_nothing_is_no_row() {
    let mut bench = Bench::down(DT);
    let (ground, body) = (bench.ground(), bench.body(0.0, 0.0));
    let joint = RevoluteJointBuilder::new().limits([-4.0, 4.0]).build();
    bench.join(ground, body, joint);
    let handle = bench.world.impulse_joints.iter().next().unwrap().0;
    assert_eq!(bench.step().joints.len(), 1);
    let joint = bench.world.impulse_joints.get_mut(handle, true).unwrap();
    joint.data.set_enabled(false);
    let record = bench.run(0.1);
    assert!(record.joints.is_empty());
    assert!(bench.place(body)[1] < -0.04);
    // rows that nothing can move are none either: a weld of a body that cannot turn
    let body = bench.body(0.0, 3.0);
    bench.world.bodies[body].set_locked_axes(LockedAxes::ROTATION_LOCKED, true);
    let mut weld = FixedJointBuilder::new().build().into();
    bench.join(ground, body, at(&mut weld, [0.0, 3.0], [0.0, 0.0]));
    let record = bench.run(0.1);
    assert_eq!(record.joints.len(), 1);
    assert_relative_eq!(bench.place(body)[1], 3.0, epsilon = 1e-9);
    assert_eq!(bench.place(body)[2].rem_euclid(FRAC_PI_2), 0.0);
}

/// A limit that is passed from the start is closed by position, without a launch.
#[test]
fn a_limit_passed_at_the_start_is_closed_without_energy() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (ground, slider) = (bench.ground(), bench.body(0.5, 0.0));
    let joint = PrismaticJointBuilder::new(Vector::X).limits([-0.2, 0.2]);
    bench.join(ground, slider, joint.build());
    let (a, b) = (bench.body(0.0, 3.0), bench.body(1.5, 3.0));
    bench.join(a, b, RopeJointBuilder::new(1.0).build());
    let record = bench.run(0.1);
    assert_relative_eq!(bench.place(slider)[0], 0.2, epsilon = 1e-7);
    let apart = bench.place(b)[0] - bench.place(a)[0];
    assert_relative_eq!(apart, 1.0, epsilon = 1e-9);
    assert!(record.energy.kinetic_end < 1e-20, "{:?}", record.energy);
}

// --- mechanisms --------------------------------------------------------------------------------

fn scene(text: &str) -> moreau2d::scene::Built {
    let text = format!("[scene]\nname = \"odd\"\ntitle = \"odd\"\n{text}");
    moreau2d::scene::Scene::parse("t.toml", &text, &[])
        .unwrap()
        .build()
        .unwrap()
}

/// A parallelogram of three links is driven through its dead points: the coupler never turns,
/// although a linkage that closes on itself has a row more than it needs there.
#[test]
fn a_parallelogram_keeps_its_coupler_level() {
    let mut built = scene(
        r#"
[step]
dt = 0.005
[[body]]
name = "crank"
box = [0.5, 0.05]
angle = 1.5707963267948966
position = [0, 0.25]
[[body]]
name = "coupler"
box = [1, 0.05]
position = [0.5, 0.5]
[[body]]
name = "rocker"
box = [0.5, 0.05]
angle = 1.5707963267948966
position = [1, 0.25]
[[joint]]
kind = "revolute"
bodies = ["world", "crank"]
at = [0, 0]
motor = { speed = 3, max_torque = 1e4 }
[[joint]]
kind = "revolute"
bodies = ["crank", "coupler"]
at = [0, 0.5]
[[joint]]
kind = "revolute"
bodies = ["coupler", "rocker"]
at = [1, 0.5]
[[joint]]
kind = "revolute"
bodies = ["world", "rocker"]
at = [1, 0]
"#,
    );
    for _ in 0..90 {
        let record = built.step().unwrap();
        assert_eq!((record.unsolved, record.joints_capped), (0, 0));
        // (ω Δt)² r/4 of an arm of 0.25 m
        assert!(record.joint_gap < 1e-4, "{}", record.joint_gap);
        let (coupler, _) = built.state(1).unwrap();
        assert!(coupler.angle().abs() < 1e-3, "{}", coupler.angle());
    }
}

/// Two wheels on sprung hubs drive over a bump and go on at the speed of their motors.
#[test]
fn a_car_with_springs_and_motors_drives() {
    let mut text = r#"
[step]
dt = 0.016666666666666666
[[body]]
name = "road"
kind = "fixed"
polyline = [[60, 0], [4, 0], [3, 0.1], [2, 0], [-10, 0]]
[[body]]
name = "chassis"
box = [2, 0.4]
position = [-6, 1]
"#
    .to_owned();
    for (name, x) in [("rear", -6.7), ("front", -5.3)] {
        text += &format!(
            r#"
[[body]]
name = "hub-{name}"
disc = 0.05
mass = 20
position = [{x}, 0.36]
[[body]]
name = "wheel-{name}"
disc = 0.35
mass = 30
position = [{x}, 0.36]
[[joint]]
kind = "prismatic"
bodies = ["chassis", "hub-{name}"]
at = [{x}, 0.36]
axis = [0, 1]
limits = [-0.2, 0.25]
motor = {{ stiffness = 30000, damping = 2500 }}
[[joint]]
kind = "revolute"
bodies = ["hub-{name}", "wheel-{name}"]
at = [{x}, 0.36]
motor = {{ speed = -8, max_torque = 300 }}
"#
        );
    }
    let mut built = scene(&text);
    for _ in 0..600 {
        let record = built.step().unwrap();
        assert_eq!((record.unsolved, record.joints_capped), (0, 0));
        assert!(record.joint_gap < 2e-3, "{}", record.joint_gap);
        assert!(record.energy.imbalance().abs() < 1e-9 * record.energy.kinetic_end.max(1.0));
    }
    let (pose, velocity) = built.state(1).unwrap();
    assert!(pose.translation.x > 15.0, "{pose:?}");
    // rolling: speed 8 rad/s of wheels of 0.35 m, and the chassis may pitch a little still
    assert_relative_eq!(velocity.x, 2.8, max_relative = 1e-3);
    assert_relative_eq!(velocity.y, 0.0, epsilon = 1e-3);
}
