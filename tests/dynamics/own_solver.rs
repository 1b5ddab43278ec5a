//! A solver of the user's own in the stepper: used, judged, and harmless when it is wrong.

use moreau2d::contact::{ContactProblem, Residual, Vec2};
use moreau2d::dynamics::{Pose64, StepError};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
use moreau2d::solver::{Auto, ImpulseSolver, SolveReport, SolveStatus};

/// Says it has solved everything, whatever it does to the impulses.
struct Liar(fn(&mut Vec2));

impl ImpulseSolver for Liar {
    fn name(&self) -> &'static str {
        "liar"
    }

    fn solve(&mut self, _: &ContactProblem, impulses: &mut [Vec2], _: f64) -> SolveReport {
        impulses.iter_mut().for_each(self.0);
        SolveReport {
            status: SolveStatus::Solved,
            sweeps: 3,
            factorisations: 0,
            pivots: 0,
            residual: Residual::default(),
        }
    }
}

/// A tower of three boxes on a floor.
fn tower() -> (PhysicsWorld, MoreauPipeline, Vec<RigidBodyHandle>) {
    let mut world = PhysicsWorld::new();
    world.insert(
        RigidBodyBuilder::fixed(),
        ColliderBuilder::cuboid(10.0, 0.5),
    );
    let boxes = (0..3).map(|k| {
        let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0 + k as Real));
        world.insert(body, ColliderBuilder::cuboid(0.5, 0.5)).0
    });
    let boxes = boxes.collect();
    let pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    (world, pipeline, boxes)
}

fn poses(pipeline: &MoreauPipeline, boxes: &[RigidBodyHandle]) -> Vec<Option<Pose64>> {
    boxes.iter().map(|h| pipeline.pose(*h)).collect()
}

#[test]
fn a_solver_of_ones_own_takes_the_place_of_the_named_one() {
    let run = |own: bool| {
        let (mut world, mut pipeline, boxes) = tower();
        if own {
            pipeline.set_solver(Box::new(Auto::default()));
        }
        for _ in 0..20 {
            assert_eq!(pipeline.step(&mut world).unwrap().unsolved, 0);
        }
        poses(&pipeline, &boxes)
    };
    assert_eq!(run(true), run(false));
}

/// Nothing but the judge's figure is in the record, though the solver claims a residual of 0.
#[test]
fn a_solvers_word_does_not_count() {
    let (mut world, mut pipeline, _) = tower();
    pipeline.set_solver(Box::new(Liar(|p| *p = Vec2::zeros())));
    let record = pipeline.step(&mut world).unwrap();
    assert_eq!((record.islands, record.unsolved), (1, 1));
    assert!(record.residual > 0.1, "{}", record.residual);
    // its work does
    assert!(record.sweeps >= 3);
}

#[test]
fn impulses_that_are_not_finite_leave_the_world_as_it_was() {
    let (mut world, mut pipeline, boxes) = tower();
    pipeline.step(&mut world).unwrap();
    let before = poses(&pipeline, &boxes);
    pipeline.set_solver(Box::new(Liar(|p| p.x = f64::NAN)));
    let error = pipeline.step(&mut world).unwrap_err();
    assert!(matches!(error, StepError::NonFinite { .. }), "{error}");
    assert_eq!(poses(&pipeline, &boxes), before);
    pipeline.set_solver(Box::new(Auto::default()));
    assert_eq!(pipeline.step(&mut world).unwrap().unsolved, 0);
}
