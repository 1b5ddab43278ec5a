//! What a user changes about joints between two steps counts from the next step on, as if the
//! pipeline had met the world for the first time.

use moreau2d::dynamics::Detection;
use moreau2d::rapier::engine::dynamics::SpringCoefficients;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};

/// A world with joints of all kinds, and what a change needs to name.
struct Machine {
    world: PhysicsWorld,
    pipeline: MoreauPipeline,
    ground: RigidBodyHandle,
    arm: RigidBodyHandle,
    slider: RigidBodyHandle,
    weight: RigidBodyHandle,
    pin: ImpulseJointHandle,
    rail: ImpulseJointHandle,
    rope: ImpulseJointHandle,
    weld: ImpulseJointHandle,
    off: ImpulseJointHandle,
}

fn body(x: Real, y: Real) -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic()
        .translation(Vector::new(x, y))
        .can_sleep(false)
}

/// An arm on a driven pin carries a slider on a driven rail, from which a weight hangs by a rope; a
/// flag is welded to the arm, softly, and a second pin between the two is switched off.
fn machine() -> Machine {
    let mut world = PhysicsWorld::new();
    let ground = world.bodies.insert(RigidBodyBuilder::fixed());
    let mut add = |at: RigidBodyBuilder, w: Real, h: Real| {
        let shape = ColliderBuilder::cuboid(w, h);
        world.insert(at.linvel(Vector::new(0.1, 0.0)), shape).0
    };
    let arm = add(body(1.0, 0.0), 1.0, 0.1);
    let slider = add(body(1.5, 0.15), 0.2, 0.1);
    let weight = add(body(1.6, -1.0), 0.2, 0.2);
    let flag = add(body(2.3, 0.0), 0.2, 0.1);
    let at = Vector::new;
    let pin = RevoluteJointBuilder::new()
        .local_anchor2(at(-1.0, 0.0))
        .limits([-0.4, 0.4])
        .motor(0.1, 0.2, 30.0, 4.0)
        .motor_max_force(60.0);
    let pin = world.insert_impulse_joint(ground, arm, pin);
    let rail = PrismaticJointBuilder::new(Vector::X)
        .local_anchor1(at(0.5, 0.15))
        .motor_velocity(0.4, 3.0)
        .contacts_enabled(false);
    let rail = world.insert_impulse_joint(arm, slider, rail);
    let rope = RopeJointBuilder::new(1.0).local_anchor2(at(0.0, 0.2));
    let rope = world.insert_impulse_joint(slider, weight, rope);
    let soft = SpringCoefficients {
        natural_frequency: 6.0,
        damping_ratio: 0.5,
    };
    let weld = FixedJointBuilder::new()
        .local_anchor1(at(1.3, 0.0))
        .softness(soft)
        .contacts_enabled(false);
    let weld = world.insert_impulse_joint(arm, flag, weld);
    let off = RevoluteJointBuilder::new()
        .local_anchor1(at(1.0, 0.0))
        .local_anchor2(at(-0.3, 0.0));
    let off = world.insert_impulse_joint(arm, flag, off);
    world
        .impulse_joints
        .get_mut(off, true)
        .unwrap()
        .data
        .enabled = JointEnabled::Disabled;
    Machine {
        world,
        pipeline: MoreauPipeline::new(MoreauSettings::default()).unwrap(),
        ground,
        arm,
        slider,
        weight,
        pin,
        rail,
        rope,
        weld,
        off,
    }
}

impl Machine {
    fn data(&mut self, joint: ImpulseJointHandle) -> &mut GenericJoint {
        &mut self.world.impulse_joints.get_mut(joint, true).unwrap().data
    }

    /// A copy in other memory with a pipeline that has yet to read the joints.
    fn fresh(&self) -> Machine {
        let mut world = PhysicsWorld::new();
        world.gravity = self.world.gravity;
        world.integration_parameters = self.world.integration_parameters;
        world.islands = self.world.islands.clone();
        world.bodies = self.world.bodies.clone();
        world.colliders = self.world.colliders.clone();
        world.impulse_joints = self.world.impulse_joints.clone();
        let pipeline = MoreauPipeline::resume(&self.pipeline.state(), &mut world).unwrap();
        Machine {
            world,
            pipeline,
            ..*self
        }
    }

    /// Rows of joints and three steps to the last bit.
    fn told(&mut self) -> Vec<String> {
        let mut found = Detection::default();
        let (world, pipeline) = (&mut self.world, &mut self.pipeline);
        pipeline.find_contacts(world, &mut found).unwrap();
        let mut told = vec![format!("{:?}", found.joints)];
        for _ in 0..3 {
            let record = pipeline.step(world).unwrap();
            let states = world.bodies.iter().map(|(handle, _)| {
                let pose = pipeline.pose(handle);
                format!("{pose:?} {:?}", pipeline.velocity(handle))
            });
            told.push(format!("{record:?} {:?}", states.collect::<Vec<_>>()));
        }
        told
    }
}

type Change = (&'static str, fn(&mut Machine));

const CHANGES: [Change; 29] = [
    ("speed of a motor", |m| {
        m.data(m.pin).motors[2].target_vel = -0.3
    }),
    ("target of a motor", |m| {
        m.data(m.pin).motors[2].target_pos = 0.3
    }),
    ("stiffness of a motor", |m| {
        m.data(m.pin).motors[2].stiffness = 25.0
    }),
    ("damping of a motor", |m| {
        m.data(m.pin).motors[2].damping = 5.0
    }),
    ("largest force of a motor", |m| {
        m.data(m.rail).motors[0].max_force = 1e-3
    }),
    ("model of a motor", |m| {
        m.data(m.rail).motors[0].model = MotorModel::ForceBased
    }),
    ("a motor is switched off", |m| {
        m.data(m.rail).motor_axes = JointAxesMask::empty()
    }),
    ("lower limit", |m| m.data(m.pin).limits[2].min = -0.001),
    ("upper limit", |m| m.data(m.pin).limits[2].max = -0.05),
    ("limits of a pin are switched off", |m| {
        m.data(m.pin).limit_axes = JointAxesMask::empty()
    }),
    ("length of a rope", |m| m.data(m.rope).limits[0].max = 0.8),
    ("anchor on the first body", |m| {
        m.data(m.pin).local_frame1.translation.y = 0.01
    }),
    ("anchor on the second body", |m| {
        m.data(m.pin).local_frame2.translation.x = -0.99
    }),
    ("a zero of the other sign", |m| {
        m.data(m.pin).local_frame1.translation = Vector::new(-0.0, -0.0)
    }),
    ("axis on the first body", |m| {
        m.data(m.rail).local_frame1.rotation = Rotation::new(0.02)
    }),
    ("axis on the second body", |m| {
        m.data(m.rail).local_frame2.rotation = Rotation::new(0.02)
    }),
    ("an axis is set free", |m| {
        m.data(m.rail).locked_axes = JointAxesMask::LIN_Y
    }),
    ("axes are coupled no more", |m| {
        m.data(m.rope).coupled_axes = JointAxesMask::empty()
    }),
    ("frequency of a softness", |m| {
        m.data(m.weld).softness.natural_frequency = 3.0
    }),
    ("damping of a softness", |m| {
        m.data(m.weld).softness.damping_ratio = 1.0
    }),
    ("a joint is switched off", |m| {
        m.data(m.rail).set_enabled(false)
    }),
    ("a joint is switched on", |m| {
        m.data(m.off).set_enabled(true)
    }),
    ("bodies may touch", |m| {
        m.data(m.rail).set_contacts_enabled(true);
    }),
    ("a joint comes", |m| {
        let lock = FixedJointBuilder::new()
            .local_anchor1(Vector::new(1.6, -1.0))
            .local_anchor2(Vector::ZERO);
        m.world.insert_impulse_joint(m.ground, m.weight, lock);
    }),
    ("the first joint goes", |m| {
        m.world.remove_impulse_joint(m.pin);
    }),
    ("another joint takes the number of one", |m| {
        m.world.remove_impulse_joint(m.rail);
        let new = FixedJointBuilder::new().local_anchor1(Vector::new(0.6, 0.15));
        let new = m.world.insert_impulse_joint(m.arm, m.slider, new);
        assert_eq!(new.into_raw_parts().0, m.rail.into_raw_parts().0);
    }),
    ("a joint holds another body", |m| {
        let joints = &mut m.world.impulse_joints;
        joints.set_bodies(m.rope, m.arm, m.weight, true);
    }),
    ("a body goes with its joints", |m| {
        m.world.remove_body(m.slider);
    }),
    ("a body is switched off", |m| {
        m.world.bodies[m.slider].set_enabled(false)
    }),
];

#[test]
fn every_change_counts_from_the_next_step_on() {
    for (what, change) in CHANGES {
        let mut m = machine();
        for _ in 0..4 {
            m.pipeline.step(&mut m.world).unwrap();
        }
        let before = m.fresh().told();
        let mut fresh = m.fresh();
        change(&mut m);
        change(&mut fresh);
        let (met, expected) = (m.told(), fresh.told());
        for (k, (met, expected)) in met.iter().zip(&expected).enumerate() {
            assert!(met == expected, "{what}, {k}:\n{met}\n{expected}");
        }
        if what != "a zero of the other sign" {
            assert!(met[1..] != before[1..], "{what} changes nothing");
        }
    }
}

/// Bodies get other numbers and another centre of mass without any change of a joint.
#[test]
fn joints_follow_their_bodies() {
    let changes: [Change; 3] = [
        ("a body without joints goes", |m| {
            let first = m.world.bodies.iter().next().unwrap().0;
            m.world.remove_body(first);
        }),
        ("a body comes back", |m| {
            m.world.bodies[m.slider].set_enabled(true)
        }),
        ("a centre of mass moves", |m| {
            let more = MassProperties::new(Vector::new(0.2, 0.0), 1.0, 0.1);
            m.world.bodies[m.arm].set_additional_mass_properties(more, true);
        }),
    ];
    for (what, change) in changes {
        let mut m = machine();
        if what == "a body comes back" {
            m.world.bodies[m.slider].set_enabled(false);
        }
        if what == "a body without joints goes" {
            // the ground comes first: its joints go with it
            let other = m.world.bodies.insert(RigidBodyBuilder::fixed());
            let joints = &mut m.world.impulse_joints;
            joints.set_bodies(m.pin, other, m.arm, true);
        }
        for _ in 0..4 {
            m.pipeline.step(&mut m.world).unwrap();
        }
        let mut fresh = m.fresh();
        change(&mut m);
        change(&mut fresh);
        let (met, expected) = (m.told(), fresh.told());
        assert!(met == expected, "{what}:\n{met:?}\n{expected:?}");
    }
}

/// What is refused is refused in every step, and leaves nothing behind once it is mended.
#[test]
fn a_bad_joint_is_refused_until_it_is_mended() {
    let bad: [Change; 4] = [
        ("limits", |m| m.data(m.rail).limits[0].min = Real::NAN),
        ("anchor", |m| {
            m.data(m.rope).local_frame2.translation.x = Real::INFINITY
        }),
        ("target velocity", |m| {
            m.data(m.pin).motors[2].target_vel = Real::NAN
        }),
        ("itself", |m| {
            let joints = &mut m.world.impulse_joints;
            joints.set_bodies(m.weld, m.arm, m.arm, true);
        }),
    ];
    for (what, spoil) in bad {
        let mut m = machine();
        m.data(m.rail).set_limits(JointAxis::LinX, [-1.0, 1.0]);
        for _ in 0..4 {
            m.pipeline.step(&mut m.world).unwrap();
        }
        let good = m.world.impulse_joints.clone();
        let expected = m.fresh().told();
        // joints that come before and after the bad one change and change back
        m.data(m.pin).motors[2].target_pos = -0.2;
        m.data(m.weld).softness.damping_ratio = 2.0;
        spoil(&mut m);
        for _ in 0..2 {
            let error = m.pipeline.step(&mut m.world).unwrap_err().to_string();
            assert!(error.contains(what), "{what}: {error}");
        }
        m.world.impulse_joints = good;
        let met = m.told();
        assert!(met == expected, "{what}:\n{met:?}\n{expected:?}");
    }
}

/// Bodies change without their joints, and a joint that is switched off ties nobody.
#[test]
fn dominance_is_looked_at_in_every_step() {
    let mut m = machine();
    m.pipeline.step(&mut m.world).unwrap();
    m.world.bodies[m.slider].set_dominance_group(3);
    let number = m.rail.into_raw_parts().0;
    let refused = format!("joint {number}: it ties bodies of dominance 0 and 3");
    for _ in 0..2 {
        let error = m.pipeline.step(&mut m.world).unwrap_err().to_string();
        assert!(error.contains(&refused), "{error}");
    }
    for joint in [m.rail, m.rope] {
        m.data(joint).set_enabled(false);
    }
    m.pipeline.step(&mut m.world).unwrap();
    m.data(m.rope).set_enabled(true);
    assert!(m.pipeline.step(&mut m.world).is_err());
    m.world.bodies[m.slider].set_dominance_group(0);
    m.pipeline.step(&mut m.world).unwrap();
}

/// A body that went without its joints, as into another set, and one that never was.
#[test]
fn a_joint_of_a_body_that_is_gone_is_refused() {
    let mut m = machine();
    m.pipeline.step(&mut m.world).unwrap();
    let joints = m.world.impulse_joints.clone();
    let slider = m.slider;
    m.world.remove_body(slider);
    m.pipeline.step(&mut m.world).unwrap();
    m.world.impulse_joints = joints;
    for _ in 0..2 {
        let error = m.pipeline.step(&mut m.world).unwrap_err().to_string();
        assert!(error.contains("is not in the world"), "{error}");
    }
    for joint in [m.rail, m.rope] {
        m.world.remove_impulse_joint(joint);
    }
    m.pipeline.step(&mut m.world).unwrap();
}
