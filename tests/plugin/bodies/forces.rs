//! Forces, impulses, gravity, damping and locked axes.

use super::*;
use moreau2d::contact::Vec3;
use moreau2d::rapier::widen;

#[test]
fn forces_and_torques_act_until_they_are_reset() {
    let (mut world, body, _) = floating(free());
    let mut p = pipeline();
    world.bodies[body].add_force(Vector::new(3.0, 0.0), true);
    world.bodies[body].add_torque(0.5, true);
    steps(&mut p, &mut world, 60);
    let u = p.velocity(body).unwrap();
    // m = 2 kg, J = m/6
    near(u.x, 1.5 * 60.0 * DT, 1e-12, "v");
    near(u.z, 0.5 * 3.0 * 60.0 * DT, ROUNDING, "ω");
    // the midpoint rule is exact for a constant acceleration
    let t = 60.0 * DT;
    near(
        p.pose(body).unwrap().translation.x,
        0.75 * t * t,
        1e-12,
        "x",
    );
    world.bodies[body].reset_forces(true);
    world.bodies[body].reset_torques(true);
    steps(&mut p, &mut world, 10);
    assert_eq!(p.velocity(body).unwrap(), u);
}

#[test]
fn a_force_at_a_point_turns() {
    let (mut world, body, _) = floating(free());
    let mut p = pipeline();
    let point = Vector::new(0.0, 0.25);
    world.bodies[body].add_force_at_point(Vector::new(4.0, 0.0), point, true);
    steps(&mut p, &mut world, 1);
    let u = p.velocity(body).unwrap();
    near(u.x, 2.0 * DT, 1e-14, "v");
    near(u.z, -0.25 * 4.0 * 3.0 * DT, ROUNDING, "ω");
}

#[test]
fn impulses_change_the_velocity_at_once() {
    let (mut world, body, _) = floating(free());
    let mut p = pipeline();
    steps(&mut p, &mut world, 1);
    let b = &mut world.bodies[body];
    b.apply_impulse(Vector::new(1.0, -2.0), true);
    b.apply_torque_impulse(0.5, true);
    b.apply_impulse_at_point(Vector::new(0.0, 1.0), Vector::new(0.5, 0.0), true);
    steps(&mut p, &mut world, 1);
    let u = p.velocity(body).unwrap();
    // (1, −2 + 1)/2, (0.5 + 0.5) 3; rapier adds them up in its own precision
    assert!((u - Vec3::new(0.5, -0.5, 3.0)).norm() < 1e-6, "{u}");
}

#[test]
fn gravity_scales() {
    for scale in [1.0, -0.5, 0.0] {
        let mut world = world(-9.81);
        let shape = ColliderBuilder::ball(0.5);
        let (body, _) = world.insert(free().gravity_scale(scale), shape);
        let mut p = pipeline();
        steps(&mut p, &mut world, 12);
        let expected = -G * f64::from(scale) * 12.0 * DT;
        near(p.velocity(body).unwrap().y, expected, 1e-13, "v");
    }
}

/// `v̇ = g − d v`: exact at any step, from a nudge to what explicit damping would blow up.
#[test]
fn damping_is_exact_in_free_motion() {
    for d in [1e-9, 0.5, 20.0, 1000.0] {
        let mut world = world(-9.81);
        let start = Vector::new(3.0, 0.0);
        let damped = free().linear_damping(d).angular_damping(d);
        let (body, _) = world.insert(damped.linvel(start).angvel(5.0), ColliderBuilder::ball(0.5));
        let mut p = pipeline();
        steps(&mut p, &mut world, 30);
        let (d, t) = (widen(d), 30.0 * DT);
        let u = p.velocity(body).unwrap();
        near(u.x, 3.0 * (-d * t).exp(), 1e-13, "v_x");
        near(u.z, 5.0 * (-d * t).exp(), 1e-13, "ω");
        near(u.y, G / d * (-d * t).exp_m1(), 1e-12, "v_y");
    }
}

/// Drag does not carry weight.
#[test]
fn a_damped_body_at_rest_presses_with_its_weight() {
    let mut world = world(-9.81);
    world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(5.0, 0.5));
    let damped = free().linear_damping(30.0).angular_damping(30.0);
    world.insert(
        damped.translation(Vector::new(0.0, 1.0)).can_sleep(false),
        ColliderBuilder::cuboid(0.5, 0.5).density(2.0),
    );
    let record = steps(&mut pipeline(), &mut world, 120);
    let load: f64 = record.contacts.iter().map(|c| c.impulse_n).sum();
    near(load, 2.0 * G * DT, 1e-10, "load");
}

#[test]
fn locked_axes_do_not_move() {
    let pushed = |body: RigidBodyBuilder| {
        let (mut world, body, _) = floating(body);
        let mut p = pipeline();
        let point = Vector::new(0.0, 0.25);
        world.bodies[body].add_force_at_point(Vector::new(4.0, 2.0), point, true);
        steps(&mut p, &mut world, 1);
        let u = p.velocity(body).unwrap();
        [u.x != 0.0, u.y != 0.0, u.z != 0.0]
    };
    assert_eq!(pushed(free()), [true, true, true]);
    assert_eq!(pushed(free().lock_rotations()), [true, true, false]);
    assert_eq!(pushed(free().lock_translations()), [false, false, true]);
    let only_x = free().enabled_translations(true, false);
    assert_eq!(pushed(only_x), [true, false, true]);
    let mut axes = LockedAxes::TRANSLATION_LOCKED_X;
    axes |= LockedAxes::ROTATION_LOCKED;
    assert_eq!(pushed(free().locked_axes(axes)), [false, true, false]);
}

/// Locked between two steps, and let go again.
#[test]
fn axes_locked_by_the_user_count_in_the_next_step() {
    let (mut world, body, _) = floating(free());
    let mut p = pipeline();
    world.bodies[body].add_force(Vector::new(2.0, 2.0), true);
    for (locked, expected) in [(false, 1.0), (true, 1.0), (false, 2.0)] {
        world.bodies[body].set_enabled_translations(true, !locked, true);
        let before = p.velocity(body).map_or(0.0, |u| u.x);
        steps(&mut p, &mut world, 1);
        let u = p.velocity(body).unwrap();
        near(u.x - before, DT, 1e-15, "x");
        near(u.y, expected * DT, 1e-15, "y");
    }
}
