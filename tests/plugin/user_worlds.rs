//! Worlds as users bring them: what rapier's own colliders allow and its examples do.

use crate::common::at;
use moreau2d::rapier::engine::control::KinematicCharacterController;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, SurfaceLaw};

fn floor(world: &mut PhysicsWorld) -> ColliderHandle {
    let body = RigidBodyBuilder::fixed().translation(at(0.0, -0.5));
    world.insert(body, ColliderBuilder::cuboid(50.0, 0.5)).1
}

/// A bar of two triangles with an arm of two on part of its upper side, hit at all angles.
#[test]
fn a_mesh_whose_triangles_share_part_of_a_side_is_met_at_its_border_only() {
    let points = [
        (-1.0, -0.2),
        (1.0, -0.2),
        (1.0, 0.2),
        (-1.0, 0.2),
        (1.0, 1.0),
        (0.7, 0.2),
        (0.7, 1.0),
    ];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [5, 2, 4], [5, 4, 6]];
    for k in 0..20 {
        let mut world = PhysicsWorld::new();
        floor(&mut world);
        let points = points.iter().map(|p| at(p.0, p.1)).collect();
        let mesh = ColliderBuilder::trimesh(points, triangles.clone()).unwrap();
        let body = RigidBodyBuilder::dynamic().translation(at(0.0, 1.6));
        let body = body.rotation((0.3 * f64::from(k)) as Real);
        world.insert(body, mesh);
        let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
        for step in 0..240 {
            let record = pipeline.step(&mut world).unwrap();
            let deepest = record.contacts.iter().map(|c| c.gap).fold(0.0, f64::min);
            // it falls less than 2 m: an impact is noticed at most a step late
            assert!(deepest > -0.1, "tilt {k}, step {step}: {deepest}");
        }
    }
}

#[test]
fn a_triangle_given_twice_still_bears() {
    let mut world = PhysicsWorld::new();
    let points = vec![at(-5.0, 0.0), at(0.0, -5.0), at(5.0, 0.0)];
    let mesh = ColliderBuilder::trimesh(points, vec![[0, 1, 2], [0, 1, 2]]).unwrap();
    world.insert_collider(mesh, None);
    let ball = RigidBodyBuilder::dynamic().translation(at(0.0, 0.5));
    let (ball, _) = world.insert(ball, ColliderBuilder::ball(0.5));
    let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    for _ in 0..60 {
        assert_eq!(pipeline.step(&mut world).unwrap().unsolved, 0);
    }
    let height = pipeline.pose(ball).unwrap().translation.y;
    assert!((height - 0.5).abs() < 1e-6, "{height}");
}

#[test]
fn a_surface_law_that_is_no_law_is_refused_until_it_is_mended() {
    let mut world = PhysicsWorld::new();
    let floor = floor(&mut world);
    let body = RigidBodyBuilder::dynamic().translation(at(0.0, 0.5));
    world.insert(body, ColliderBuilder::cuboid(0.5, 0.5));
    let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    let law = |speed, compliance| SurfaceLaw {
        speed,
        compliance,
        ..SurfaceLaw::default()
    };
    for bad in [
        law(f64::NAN, None),
        law(f64::INFINITY, None),
        law(0.0, Some((-1.0, 0.0))),
        law(0.0, Some((0.0, 0.0))),
        law(0.0, Some((f64::NAN, 1.0))),
        law(0.0, Some((1e4, f64::INFINITY))),
    ] {
        pipeline.set_surface(floor, bad);
        for _ in 0..2 {
            let error = pipeline.step(&mut world).unwrap_err().to_string();
            assert!(error.contains("collider 0: surface "), "{bad:?}: {error}");
        }
        pipeline.set_surface(floor, law(1.0, Some((0.0, 10.0))));
        assert!(pipeline.step(&mut world).is_ok());
    }
    // of a collider that is gone it is forgotten
    pipeline.set_surface(floor, law(f64::NAN, None));
    world.remove_collider(floor);
    assert!(pipeline.step(&mut world).is_ok());
}

#[test]
fn a_polyline_without_points_is_refused_by_name() {
    let mut world = PhysicsWorld::new();
    floor(&mut world);
    let empty = world.insert_collider(ColliderBuilder::polyline(vec![], None), None);
    let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    let error = pipeline.step(&mut world).unwrap_err().to_string();
    assert!(error.contains("its shape has no points"), "{error}");
    world.remove_collider(empty);
    assert!(pipeline.step(&mut world).is_ok());
}

/// Where the controller of rapier's documentation has brought a character after three seconds: it
/// asks the query tree where it may go.
fn walk(mut step: impl FnMut(&mut PhysicsWorld)) -> Vector {
    let mut world = PhysicsWorld::new();
    floor(&mut world);
    let wall = ColliderBuilder::cuboid(0.5, 2.0).translation(at(3.0, 2.0));
    world.insert_collider(wall, None);
    let body = RigidBodyBuilder::kinematic_position_based().translation(at(0.0, 0.7));
    let (hero, side) = world.insert(body, ColliderBuilder::capsule_y(0.3, 0.3));
    MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
    let controller = KinematicCharacterController::default();
    for _ in 0..180 {
        let pose = *world.bodies[hero].position();
        let shape = world.colliders[side].shared_shape().clone();
        let others = QueryFilter::default().exclude_rigid_body(hero);
        let queries = world.query_pipeline_with_filter(others);
        let wanted = at(0.03, -0.05);
        let dt = (1.0 / 60.0) as Real;
        let moved = controller.move_shape(dt, &queries, &*shape, &pose, wanted, |_| {});
        let next = pose.translation + moved.translation;
        world.bodies[hero].set_next_kinematic_translation(next);
        step(&mut world);
    }
    world.bodies[hero].translation()
}

#[test]
fn a_character_stops_at_a_wall_once_queries_are_refreshed() {
    let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    let ours = walk(|world| {
        pipeline.step(world).unwrap();
        MoreauPipeline::refresh_queries(world, &()).unwrap();
    });
    // its own offset from walls is 1 % of its height
    assert!((ours.x - 2.188).abs() < 1e-3, "{ours}");
    let theirs = walk(|world| world.step());
    assert!((ours - theirs).length() < 1e-5, "{ours} {theirs}");
}
