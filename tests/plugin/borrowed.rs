//! Steps over sets that a program keeps apart.

use moreau2d::dynamics::StepError;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};

/// The sets of a classic rapier program.
#[derive(Default)]
struct Sets {
    islands: IslandManager,
    broad_phase: BroadPhaseBvh,
    narrow_phase: NarrowPhase,
    bodies: RigidBodySet,
    colliders: ColliderSet,
    impulse_joints: ImpulseJointSet,
    multibody_joints: MultibodyJointSet,
    soft_bodies: SoftBodySet,
    ccd_solver: CCDSolver,
}

impl Sets {
    fn step(
        &mut self,
        pipeline: &mut MoreauPipeline,
        parameters: &IntegrationParameters,
        events: &dyn EventHandler,
    ) -> Result<moreau2d::dynamics::record::StepRecord, StepError> {
        pipeline.step_sets(
            Vector::new(0.0, -9.81),
            parameters,
            &mut self.islands,
            &mut self.broad_phase,
            &mut self.narrow_phase,
            &mut self.bodies,
            &mut self.colliders,
            &mut self.impulse_joints,
            &mut self.multibody_joints,
            &mut self.soft_bodies,
            &mut self.ccd_solver,
            &(),
            events,
        )
    }
}

/// A pinned bar and a pile of boxes on a floor.
fn fill(
    bodies: &mut RigidBodySet,
    colliders: &mut ColliderSet,
    joints: &mut ImpulseJointSet,
) -> Vec<RigidBodyHandle> {
    let ground = bodies.insert(RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5)));
    colliders.insert_with_parent(ColliderBuilder::cuboid(10.0, 0.5), ground, bodies);
    let mut insert = |x: Real, y: Real| {
        let body = bodies.insert(RigidBodyBuilder::dynamic().translation(Vector::new(x, y)));
        let square =
            ColliderBuilder::cuboid(0.25, 0.25).active_events(ActiveEvents::COLLISION_EVENTS);
        colliders.insert_with_parent(square, body, bodies);
        body
    };
    let mut all: Vec<_> = (0..6)
        .map(|k| insert(0.1 * (k % 2) as Real, 0.3 + 0.6 * k as Real))
        .collect();
    let bar = insert(3.0, 3.0);
    all.push(bar);
    let pin = RevoluteJointBuilder::new()
        .local_anchor1(Vector::new(3.0, 4.5))
        .local_anchor2(Vector::new(-0.25, 0.25));
    joints.insert(ground, bar, pin, true);
    all
}

fn pipeline() -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings::default()).unwrap()
}

/// The same bits as in a world that owns its sets, the sleeping at the end included.
#[test]
fn borrowed_sets_are_stepped_as_those_of_a_world() {
    let mut sets = Sets::default();
    let all = fill(
        &mut sets.bodies,
        &mut sets.colliders,
        &mut sets.impulse_joints,
    );
    let mut world = PhysicsWorld::new();
    let same = fill(
        &mut world.bodies,
        &mut world.colliders,
        &mut world.impulse_joints,
    );
    let (mut ours, mut owning) = (pipeline(), pipeline());
    let parameters = IntegrationParameters::default();
    for _ in 0..240 {
        let record = sets.step(&mut ours, &parameters, &()).unwrap();
        assert_eq!(record, owning.step(&mut world).unwrap());
        for (a, b) in all.iter().zip(&same) {
            let (a, b) = (&sets.bodies[*a], &world.bodies[*b]);
            assert_eq!(a.position(), b.position());
            assert_eq!(a.is_sleeping(), b.is_sleeping());
        }
    }
    assert!(sets.bodies[all[0]].is_sleeping());
}

/// An error leaves the sets with the caller, as they were.
#[test]
fn an_error_gives_the_sets_back() {
    let mut sets = Sets::default();
    let all = fill(
        &mut sets.bodies,
        &mut sets.colliders,
        &mut sets.impulse_joints,
    );
    let mut ours = pipeline();
    let bad = IntegrationParameters {
        dt: -1.0,
        ..Default::default()
    };
    let before = *sets.bodies[all[0]].position();
    assert!(matches!(
        sets.step(&mut ours, &bad, &()),
        Err(StepError::Dt(_))
    ));
    assert_eq!((sets.bodies.len(), sets.colliders.len()), (8, 8));
    assert_eq!(*sets.bodies[all[0]].position(), before);
    sets.step(&mut ours, &IntegrationParameters::default(), &())
        .unwrap();
}

/// An engine around rapier. It stands for bevy_rapier, whose bevy asks for a newer Rust than this crate: sets in components of their own, a step of fixed
/// length as often as the time that passed asks for, hooks and events through channels, and poses
/// written back to the entities.
mod wrapped {
    use super::*;
    use std::sync::mpsc::channel;

    struct Entity {
        body: RigidBodyHandle,
        transform: Pose,
    }

    struct Context {
        sets: Sets,
        pipeline: MoreauPipeline,
        parameters: IntegrationParameters,
        /// Time that has passed and is not simulated yet \[s\].
        behind: Real,
    }

    impl Context {
        /// The step system of a frame.
        fn advance(&mut self, passed: Real, events: &dyn EventHandler) -> usize {
            self.behind += passed;
            let mut steps = 0;
            while self.behind >= self.parameters.dt {
                self.behind -= self.parameters.dt;
                self.sets
                    .step(&mut self.pipeline, &self.parameters, events)
                    .unwrap();
                steps += 1;
            }
            steps
        }

        fn write_back(&self, entities: &mut [Entity]) {
            for entity in entities {
                entity.transform = *self.sets.bodies[entity.body].position();
            }
        }
    }

    #[test]
    fn an_engine_around_rapier_steps_its_sets() {
        let mut sets = Sets::default();
        let all = fill(
            &mut sets.bodies,
            &mut sets.colliders,
            &mut sets.impulse_joints,
        );
        let mut entities: Vec<Entity> = all
            .iter()
            .map(|&body| Entity {
                body,
                transform: Pose::IDENTITY,
            })
            .collect();
        let mut context = Context {
            sets,
            pipeline: pipeline(),
            parameters: IntegrationParameters {
                dt: 1.0 / 120.0,
                ..Default::default()
            },
            behind: 0.0,
        };
        let (collisions, collision_events) = channel();
        let (forces, _force_events) = channel();
        let (tears, _tear_events) = channel();
        let events = ChannelEventCollector::new(collisions, forces, tears);
        let mut steps = 0;
        for _ in 0..60 {
            steps += context.advance(1.0 / 50.0, &events);
            context.write_back(&mut entities);
        }
        // 1.2 s, up to the rounding of their sum
        assert!((143..=144).contains(&steps), "{steps}");
        let started = collision_events.try_iter().filter(|e| e.started()).count();
        assert!(started >= 6, "{started}");
        // the lowest box lies on the floor, and its entity with it
        assert!((entities[0].transform.translation.y - 0.25).abs() < 1e-4);
        // a body that the engine removes is gone for the pipeline too
        let gone = entities.remove(0).body;
        let s = &mut context.sets;
        s.bodies.remove(
            gone,
            &mut s.islands,
            &mut s.colliders,
            &mut s.impulse_joints,
            &mut s.multibody_joints,
            &mut s.soft_bodies,
            true,
        );
        context.advance(0.5, &events);
        context.write_back(&mut entities);
        assert!(entities[0].transform.translation.y < 0.5);
    }
}
