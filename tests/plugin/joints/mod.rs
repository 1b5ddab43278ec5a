//! Joints of a rapier world: what they carry against statics, how well they hold, and what is
//! refused.

mod drift;
mod drives;
mod mechanisms;
mod refusals;
mod shown;
mod statics;

use moreau2d::contact::Vec2;
use moreau2d::dynamics::StepperSettings;
use moreau2d::dynamics::record::StepRecord;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};

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

fn order(errors: &[f64]) -> f64 {
    let (first, last) = (errors[0], errors[errors.len() - 1]);
    (first / last).log2() / (errors.len() - 1) as f64
}
