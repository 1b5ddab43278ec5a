//! Changes of mass between two steps.

use super::*;
use moreau2d::contact::Vec2;

/// Whatever changes the mass between two steps is felt in the next.
#[test]
fn every_change_of_mass_counts_in_the_next_step() {
    let cases: [(&str, Change, f64); 10] = [
        ("nothing", |_, _, _| {}, 2.0),
        (
            "additional mass",
            |w, b, _| w.bodies[b].set_additional_mass(3.0, true),
            5.0,
        ),
        (
            "additional mass properties",
            |w, b, _| {
                let more = MassProperties::new(Vector::ZERO, 6.0, 1.0);
                w.bodies[b].set_additional_mass_properties(more, true);
            },
            8.0,
        ),
        ("density", |w, _, c| w.colliders[c].set_density(7.0), 7.0),
        ("mass", |w, _, c| w.colliders[c].set_mass(0.5), 0.5),
        (
            "mass properties",
            |w, _, c| {
                let all = MassProperties::new(Vector::ZERO, 1.5, 1.0);
                w.colliders[c].set_mass_properties(all);
            },
            1.5,
        ),
        (
            "shape",
            |w, _, c| w.colliders[c].set_shape(SharedShape::cuboid(1.0, 1.0)),
            8.0,
        ),
        (
            "a collider more",
            |w, b, _| {
                let more = ColliderBuilder::cuboid(0.5, 0.5).density(1.0);
                w.insert_collider(more.translation(Vector::new(1.0, 0.0)), Some(b));
            },
            3.0,
        ),
        (
            "one collider for another",
            |w, b, c| {
                w.insert_collider(ColliderBuilder::cuboid(1.0, 0.5).density(2.0), Some(b));
                w.remove_collider(c);
            },
            4.0,
        ),
        (
            "a collider switched off",
            |w, b, c| {
                w.insert_collider(ColliderBuilder::cuboid(1.0, 0.5).density(2.0), Some(b));
                w.colliders[c].set_enabled(false);
            },
            4.0,
        ),
    ];
    for (name, change, mass) in cases {
        let (mut world, body, collider) = floating(free());
        let mut p = pipeline();
        world.bodies[body].add_force(Vector::new(1.0, 0.0), true);
        steps(&mut p, &mut world, 1);
        let before = p.velocity(body).unwrap().x;
        change(&mut world, body, collider);
        steps(&mut p, &mut world, 1);
        let after = p.velocity(body).unwrap().x;
        near(DT / (after - before), mass, 1e-6 * mass, name);
    }
}

/// A collider moved on its body moves the centre of mass, about which the body then turns.
#[test]
fn a_collider_moved_on_its_body_takes_the_centre_of_mass_along() {
    let (mut world, body, collider) = floating(free().angvel(1.0));
    let mut p = pipeline();
    steps(&mut p, &mut world, 1);
    world.colliders[collider].set_translation_wrt_parent(Vector::new(3.0, 0.0));
    let before = p.pose(body).unwrap();
    let quarter = (std::f64::consts::FRAC_PI_2 / DT).round() as usize;
    steps(&mut p, &mut world, quarter);
    let after = p.pose(body).unwrap();
    let centre = Vec2::new(3.0, 0.0);
    assert!((after.apply(centre) - before.apply(centre)).norm() < 1e-12);
    assert!((after.translation - before.translation).norm() > 4.0);
}

#[test]
fn a_collider_moved_on_its_body_touches_where_it_is() {
    let mut world = world(-9.81);
    world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(5.0, 0.5));
    let (ball, collider) = world.insert(
        free().translation(Vector::new(0.0, 1.0)),
        ColliderBuilder::ball(0.5),
    );
    let mut p = pipeline();
    steps(&mut p, &mut world, 10);
    world.colliders[collider].set_translation_wrt_parent(Vector::new(0.0, 0.5));
    steps(&mut p, &mut world, 240);
    near(p.pose(ball).unwrap().translation.y, 0.5, 1e-6, "height");
}
