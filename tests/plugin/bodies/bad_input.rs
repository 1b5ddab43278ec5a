//! What bodies may not hold: refused by name, and the world stays as it was.

use super::*;
use moreau2d::contact::{Vec2, Vec3};
use moreau2d::dynamics::StepError;
use moreau2d::rapier::{ExactBody, Pose64};

/// A world at rest with a floor, a body and a box; what breaks it, what mends it, and what the
/// error says. The world must stand as it was, twice, and go on once it is mended.
fn refused(name: &str, breaks: Change, mends: Change, says: &[&str]) {
    let mut world = world(-9.81);
    world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(9.0, 0.5));
    let (other, _) = world.insert(
        free().translation(Vector::new(3.0, 2.0)),
        ColliderBuilder::ball(0.5),
    );
    let (body, collider) = world.insert(
        free().translation(Vector::new(0.0, 2.0)),
        ColliderBuilder::cuboid(0.5, 0.5),
    );
    let mut p = pipeline();
    steps(&mut p, &mut world, 3);
    let whole = |world: &PhysicsWorld, p: &MoreauPipeline| {
        let of = |h: RigidBodyHandle| (*world.bodies[h].position(), p.pose(h), p.velocity(h));
        (of(other), p.pose(body), p.velocity(body), p.time())
    };
    let before = whole(&world, &p);
    breaks(&mut world, body, collider);
    for _ in 0..2 {
        let error = p.step(&mut world).expect_err(name).to_string();
        for word in says {
            assert!(error.contains(word), "{name}: '{error}' says no '{word}'");
        }
        assert_eq!(whole(&world, &p), before, "{name}");
    }
    mends(&mut world, body, collider);
    world.bodies[body].set_translation(Vector::new(0.0, 2.0), true);
    world.bodies[body].set_linvel(Vector::ZERO, true);
    world.bodies[body].set_angvel(0.0, true);
    steps(&mut p, &mut world, 240);
    near(p.pose(body).unwrap().translation.y, 1.0, 1e-5, name);
    near(p.pose(other).unwrap().translation.y, 1.0, 1e-5, name);
}

const NONE: Change = |_, _, _| {};

#[test]
fn states_that_are_not_finite_are_refused() {
    let named = "body 2 (handle (2, 0))";
    refused(
        "position",
        |w, b, _| w.bodies[b].set_translation(Vector::new(Real::NAN, 0.0), true),
        |w, b, _| w.bodies[b].set_position(Pose::IDENTITY, true),
        &[named, "position", "NaN", "not finite"],
    );
    refused(
        "rotation",
        |w, b, _| w.bodies[b].set_rotation(Rotation::from_angle(Real::INFINITY), true),
        |w, b, _| w.bodies[b].set_position(Pose::IDENTITY, true),
        &[named, "rotation", "not finite"],
    );
    refused(
        "velocity",
        |w, b, _| w.bodies[b].set_linvel(Vector::new(0.0, Real::INFINITY), true),
        NONE,
        &[named, "velocity", "inf"],
    );
    refused(
        "spin",
        |w, b, _| w.bodies[b].set_angvel(Real::NAN, true),
        NONE,
        &[named, "spin", "NaN"],
    );
    refused(
        "target",
        |w, b, _| {
            w.bodies[b].set_body_type(RigidBodyType::KinematicPositionBased, true);
            w.bodies[b].set_next_kinematic_translation(Vector::new(Real::NAN, 0.0));
        },
        |w, b, _| {
            w.bodies[b].set_body_type(RigidBodyType::Dynamic, true);
            w.bodies[b].set_position(Pose::IDENTITY, true);
        },
        &[named, "target position"],
    );
}

#[test]
fn forces_and_settings_that_are_not_finite_are_refused() {
    let named = "body 2 (handle (2, 0))";
    refused(
        "force",
        |w, b, _| w.bodies[b].add_force(Vector::new(Real::NAN, 0.0), true),
        |w, b, _| w.bodies[b].reset_forces(true),
        &[named, "force"],
    );
    refused(
        "torque",
        |w, b, _| w.bodies[b].add_torque(Real::INFINITY, true),
        |w, b, _| w.bodies[b].reset_torques(true),
        &[named, "torque"],
    );
    refused(
        "gravity scale",
        |w, b, _| w.bodies[b].set_gravity_scale(Real::NAN, true),
        |w, b, _| w.bodies[b].set_gravity_scale(1.0, true),
        &[named, "gravity scale"],
    );
    refused(
        "damping",
        |w, b, _| w.bodies[b].set_angular_damping(Real::NAN),
        |w, b, _| w.bodies[b].set_angular_damping(0.0),
        &[named, "angular damping"],
    );
    refused(
        "gravity",
        |w, _, _| w.gravity.x = Real::NAN,
        |w, _, _| w.gravity.x = 0.0,
        &["gravity", "NaN"],
    );
}

/// Found out before anything was searched for: rapier's tree forgets no box without end.
#[test]
fn an_endless_acceleration_leaves_no_mark() {
    let (mut world, body, _) = floating(free());
    let mut p = pipeline();
    let exact = |mass| ExactBody { mass, inertia: 1.0 };
    p.set_exact_mass(body, exact(1e-300)).unwrap();
    world.bodies[body].add_force(Vector::new(1e30, 0.0), true);
    let error = p.step(&mut world).unwrap_err();
    assert!(error.to_string().contains("acceleration"), "{error}");
    world.bodies[body].reset_forces(true);
    p.set_exact_mass(body, exact(1.0)).unwrap();
    world.insert(
        free().translation(Vector::new(0.99, 0.0)),
        ColliderBuilder::cuboid(0.5, 0.5),
    );
    assert_eq!(p.step(&mut world).unwrap().recovering, 1);
}

#[test]
fn masses_that_cannot_be_are_refused() {
    let named = "body 2 (handle (2, 0))";
    let whole: Change = |w, _, c| w.colliders[c].set_density(1.0);
    refused(
        "negative density",
        |w, _, c| w.colliders[c].set_density(-2.0),
        whole,
        &[named, "mass", "-2", "above 0"],
    );
    refused(
        "negative additional mass",
        |w, b, _| {
            let less = MassProperties::new(Vector::ZERO, -5.0, 1.0);
            w.bodies[b].set_additional_mass_properties(less, true);
        },
        |w, b, _| {
            let none = MassProperties::default();
            w.bodies[b].set_additional_mass_properties(none, true);
        },
        &[named, "mass", "-4"],
    );
    refused(
        "mass not finite",
        |w, _, c| w.colliders[c].set_mass(Real::NAN),
        whole,
        &["collider 2", "mass"],
    );
}

#[test]
fn colliders_that_cannot_be_are_refused() {
    let square: Change = |w, _, c| w.colliders[c].set_shape(SharedShape::cuboid(0.5, 0.5));
    refused(
        "shape",
        |w, _, c| w.colliders[c].set_shape(SharedShape::ball(Real::NAN)),
        square,
        &["collider 2", "shape"],
    );
    refused(
        "endless shape",
        |w, _, c| w.colliders[c].set_shape(SharedShape::cuboid(Real::INFINITY, 1.0)),
        square,
        &["collider 2", "shape", "inf"],
    );
    refused(
        "negative size",
        |w, _, c| w.colliders[c].set_shape(SharedShape::ball(-1.0)),
        square,
        &["collider 2", "shape", "ordered"],
    );
    refused(
        "place",
        |w, _, c| w.colliders[c].set_translation_wrt_parent(Vector::new(Real::NAN, 0.0)),
        |w, _, c| w.colliders[c].set_translation_wrt_parent(Vector::ZERO),
        &["collider 2", "position"],
    );
    refused(
        "friction",
        |w, _, c| w.colliders[c].set_friction(Real::NAN),
        |w, _, c| w.colliders[c].set_friction(0.5),
        &["collider 2", "friction"],
    );
    refused(
        "restitution",
        |w, _, c| w.colliders[c].set_restitution(Real::INFINITY),
        |w, _, c| w.colliders[c].set_restitution(0.0),
        &["collider 2", "restitution"],
    );
}

#[test]
fn handles_of_removed_bodies_are_refused() {
    let mut world = world(-9.81);
    let (kept, _) = world.insert(free(), ColliderBuilder::ball(0.5));
    let (gone, _) = world.insert(
        free().translation(Vector::new(5.0, 0.0)),
        ColliderBuilder::ball(0.5),
    );
    let mut p = pipeline();
    steps(&mut p, &mut world, 1);
    world.remove_body(gone);
    let at = Pose64::new(Vec2::zeros(), 0.0);
    let error = p.place(&mut world, gone, at, Vec3::zeros()).unwrap_err();
    assert!(error.to_string().contains("(1, 0)"), "{error}");
    let exact = ExactBody {
        mass: 1.0,
        inertia: 1.0,
    };
    p.set_exact_mass(gone, exact).unwrap();
    let error = p.step(&mut world).unwrap_err();
    assert!(error.to_string().contains("(1, 0)"), "{error}");
    steps(&mut p, &mut world, 1);
    let joint = RevoluteJointBuilder::new();
    let joint = world.impulse_joints.insert(kept, gone, joint, true);
    let error = p.step(&mut world).unwrap_err();
    assert!(error.to_string().contains("joint 0"), "{error}");
    assert!(error.to_string().contains("(1, 0)"), "{error}");
    world.impulse_joints.remove(joint, true);
    steps(&mut p, &mut world, 1);
    near(p.velocity(kept).unwrap().y, -3.0 * G * DT, 1e-13, "falls");
    for state in [
        (Pose64::new(Vec2::new(f64::NAN, 0.0), 0.0), Vec3::zeros()),
        (at, Vec3::new(0.0, f64::INFINITY, 0.0)),
        (Pose64 { cos: 0.0, ..at }, Vec3::zeros()),
    ] {
        assert!(p.place(&mut world, kept, state.0, state.1).is_err());
    }
    near(
        p.velocity(kept).unwrap().y,
        -3.0 * G * DT,
        1e-13,
        "as it was",
    );
}

#[test]
fn bad_step_lengths_are_refused() {
    let mut world = world(-9.81);
    let (body, _) = world.insert(free(), ColliderBuilder::ball(0.5));
    let mut p = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    let good = world.integration_parameters.dt;
    for bad in [0.0, -1.0, Real::NAN, Real::INFINITY] {
        world.integration_parameters.dt = bad;
        let error = p.step(&mut world).unwrap_err();
        assert!(matches!(error, StepError::Dt(_)), "{error:?}");
    }
    world.integration_parameters.dt = good;
    steps(&mut p, &mut world, 1);
    // rapier's default is a sixtieth of a second
    near(p.velocity(body).unwrap().y, -G / 60.0, 1e-14, "v");
}
