//! Where a contact lies on either surface, [`SurfacePoint`], against hand geometry.

use crate::common::at;
use moreau2d::contact::Vec2;
use moreau2d::dynamics::{ContactPoint, Detection, SurfacePoint};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};

fn contacts(world: &mut PhysicsWorld) -> Vec<ContactPoint> {
    let settings = MoreauSettings {
        dt: Some(1.0 / 60.0),
        ..MoreauSettings::default()
    };
    let mut out = Detection::default();
    let mut pipeline = MoreauPipeline::new(settings).unwrap();
    pipeline.find_contacts(world, &mut out).unwrap();
    out.contacts
}

/// A floor through the origin that rises by 3 in 4, solid below, of segments from x = 5 down to −5:
/// the corners are `x = 5, 3, 0, −5`.
fn slope() -> ColliderBuilder {
    let points = [5.0, 3.0, 0.0, -5.0].map(|x| at(x, 0.75 * x));
    ColliderBuilder::oriented_polyline(points.to_vec(), None)
}

const UP: Vec2 = Vec2::new(-0.6, 0.8);

/// The place of a point at a height over the slope, whose foot has this x.
fn over(x: f64, height: f64) -> Vector {
    at(x + height * UP.x, 0.75 * x + height * UP.y)
}

/// Both bodies move, so that the contact acts half way across the gap: its places lie on the surfaces
/// all the same.
#[test]
fn a_place_lies_on_the_surface_and_not_in_the_gap() {
    const GAP: f64 = 0.25;
    let square = || {
        let half = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        let corners = half.map(|(x, y)| at(x, y)).to_vec();
        let ring = vec![[0, 1], [1, 2], [2, 3], [3, 0]];
        ColliderBuilder::oriented_polyline(corners, Some(ring))
    };
    let diagonal = 0.5 * 2f64.sqrt();
    let upright = 0.25 * std::f64::consts::PI;
    // the corner of the box and of the outline that points at the slope: (−0.5, −0.5) turned by
    // 45 degrees more than the slope
    let turn = upright + 0.75f64.atan();
    let cases = [
        ("disc", ColliderBuilder::ball(0.5), 0.5, 0.0),
        ("box", ColliderBuilder::cuboid(0.5, 0.5), diagonal, turn),
        ("outline", square(), diagonal, turn),
    ];
    for (name, collider, reach, turn) in cases {
        for (x, edge, fraction) in [(4.5, 0, 0.25), (1.5, 1, 0.5), (-1.0, 2, 0.2)] {
            let mut world = PhysicsWorld::new();
            let floor = RigidBodyBuilder::dynamic();
            let (floor, _) = world.insert(floor, slope().mass(1.0));
            let body = RigidBodyBuilder::dynamic()
                .translation(over(x, reach + GAP))
                .rotation(turn as Real)
                .linvel(at(60.0 * 0.6, -60.0 * 0.8));
            world.insert(body, collider.clone().mass(1.0));
            let found = contacts(&mut world);
            let floor = world.bodies[floor].colliders()[0].into_raw_parts().0;
            let least = found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap)).unwrap();
            let side = least.surfaces.iter().position(|s| *s == floor).unwrap();
            assert!((least.gap - GAP).abs() < 1e-6, "{name}: {least:?}");
            // poses are rounded to single precision
            let near = |place: SurfacePoint, at: f64| (place.at - at).abs() < 1e-6;
            let [on_floor, on_body] = [least.places[side], least.places[1 - side]];
            assert_eq!(on_floor.edge, edge, "{name} at {x}");
            assert!(near(on_floor, fraction), "{name} at {x}: {on_floor:?}");
            let expected = match (name, on_body.edge) {
                // the corner is the start of edge 0 and the end of edge 3
                ("outline", 0) => 0.0,
                ("outline", 3) => 1.0,
                (_, 0) => 0.0,
                other => panic!("{other:?}"),
            };
            assert!(near(on_body, expected), "{name} at {x}: {on_body:?}");
        }
    }
}

/// Corners of an outline that stand on another's faces: the place of each is an end of an edge, and
/// on the other outline where it stands.
#[test]
fn two_outlines_name_both_their_edges() {
    let outline = |points: &[(f64, f64)]| {
        let n = points.len() as u32;
        let points = points.iter().map(|&(x, y)| at(x, y)).collect();
        let ring = (0..n).map(|i| [i, (i + 1) % n]).collect();
        ColliderBuilder::oriented_polyline(points, Some(ring))
    };
    let mut world = PhysicsWorld::new();
    // its top is edge 2, from x = 4 to x = −4
    let floor = outline(&[(-4.0, -1.0), (4.0, -1.0), (4.0, 0.0), (-4.0, 0.0)]);
    world.insert(RigidBodyBuilder::fixed(), floor);
    // its lowest corner, (0, 0), is the start of edge 1
    let wedge = outline(&[(-1.0, 2.0), (0.0, 0.0), (2.0, 2.0)]);
    let body = RigidBodyBuilder::dynamic().translation(at(-2.0, 0.0));
    world.insert(body, wedge.mass(1.0));
    let found = contacts(&mut world);
    let touching: Vec<_> = found.iter().filter(|c| c.gap.abs() < 1e-9).collect();
    assert_eq!(touching.len(), 1, "{found:?}");
    let [on_floor, on_wedge] = touching[0].places;
    assert_eq!(on_floor, SurfacePoint { edge: 2, at: 0.75 });
    let ends = [
        SurfacePoint { edge: 0, at: 1.0 },
        SurfacePoint { edge: 1, at: 0.0 },
    ];
    assert!(ends.contains(&on_wedge), "{on_wedge:?}");
}

/// A disc in front of a convex and of a concave corner of an outline, at points whose nearest segment
/// is certain: the load lies on that segment, and at a corner on its end.
#[test]
fn a_disc_is_met_by_the_nearest_segment() {
    const RADIUS: f64 = 0.3;
    // a tooth: floor, flank, tip, flank, floor, solid below; from right to left
    let points = [
        (3.0, 0.0),
        (1.0, 0.0),
        (0.5, 1.0),
        (-0.5, 1.0),
        (-1.0, 0.0),
        (-3.0, 0.0),
    ];
    let tooth: Vec<Vec2> = points.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
    let nearest = |p: Vec2| {
        let of = |i: usize| {
            let (a, along) = (tooth[i], tooth[i + 1] - tooth[i]);
            let t = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            ((p - a - t * along).norm(), t)
        };
        (0..5)
            .map(|i| (i as u32, of(i)))
            .min_by(|a, b| a.1.0.total_cmp(&b.1.0))
            .unwrap()
    };
    let (mut corners, mut faces) = (0, 0);
    for k in 0..200 {
        // round the tooth at a constant distance, and into its feet
        let x = -2.0 + 0.02 * f64::from(k);
        let mut y = (2.0 * (1.0 - x.abs())).clamp(0.0, 1.0);
        while nearest(Vec2::new(x, y)).1.0 < RADIUS - 1e-3 {
            y += 1e-4;
        }
        let mut world = PhysicsWorld::new();
        let line = points.map(|(x, y)| at(x, y)).to_vec();
        let outline = ColliderBuilder::oriented_polyline(line, None);
        world.insert(RigidBodyBuilder::fixed(), outline);
        let body = RigidBodyBuilder::dynamic().translation(at(x, y));
        world.insert(body, ColliderBuilder::ball(RADIUS as Real));
        let found = contacts(&mut world);
        let least = found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap));
        let least = least.unwrap_or_else(|| panic!("no contact at {x}, {y}"));
        let (edge, (distance, fraction)) = nearest(Vec2::new(x, y));
        let place = least.places[0];
        assert!((least.gap - (distance - RADIUS)).abs() < 1e-6, "{x}");
        let shared = fraction == 0.0 || fraction == 1.0;
        if shared {
            // the end of one segment is the start of the next
            let corner = f64::from(place.edge) + place.at;
            assert!((corner - (f64::from(edge) + fraction)).abs() < 1e-6, "{x}");
            corners += 1;
        } else {
            assert_eq!(place.edge, edge, "at {x}, {y}");
            assert!((place.at - fraction).abs() < 1e-5, "{x}: {place:?}");
            faces += 1;
        }
    }
    assert!(corners > 10 && faces > 50, "{corners} {faces}");
}
