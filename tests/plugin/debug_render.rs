//! Contacts drawn through rapier's debug renderer.

use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{ContactStyle, MoreauPipeline, MoreauSettings};

#[derive(Default)]
struct Lines {
    all: Vec<([f64; 4], DebugColor)>,
    only: Option<ColliderHandle>,
}

impl DebugRenderBackend for Lines {
    fn filter_object(&self, object: DebugRenderObject) -> bool {
        let DebugRenderObject::Collider(handle, _) = object else {
            return false;
        };
        self.only.is_none_or(|only| only == handle)
    }

    fn draw_line(&mut self, _: DebugRenderObject, a: Vector, b: Vector, color: DebugColor) {
        let ends = [a.x, a.y, b.x, b.y].map(f64::from);
        self.all.push((ends, color));
    }
}

/// A box at rest on a floor: two contacts, each with a cross and half its weight, in the colour of
/// sticking.
#[test]
fn the_weight_of_a_box_is_drawn_at_its_contacts() {
    let mut world = PhysicsWorld::new();
    world.insert(
        RigidBodyBuilder::fixed(),
        ColliderBuilder::cuboid(10.0, 0.5),
    );
    let (_, collider) = world.insert(
        RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0)),
        ColliderBuilder::cuboid(0.5, 0.5).density(2.0),
    );
    let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    let record = pipeline.step(&mut world).unwrap();
    let style = ContactStyle {
        scale: 0.1,
        ..ContactStyle::default()
    };
    let mut lines = Lines {
        only: Some(collider),
        ..Lines::default()
    };
    pipeline.render_contacts(&world, &record, &style, &mut lines);
    assert_eq!(lines.all.len(), 6);
    assert!(lines.all.iter().all(|(_, color)| *color == style.stick));
    // the third line of each contact: half of 2 kg times 9.81 m/s2, upwards, at 0.1 m/N
    for (ends, _) in lines.all.chunks(3).map(|lines| lines[2]) {
        assert!((ends[2] - ends[0]).abs() < 1e-6, "{ends:?}");
        assert!((ends[3] - ends[1] - 0.1 * 9.81).abs() < 1e-5, "{ends:?}");
    }
    // an object that the backend filters out is not drawn
    let mut none = Lines {
        only: Some(ColliderHandle::invalid()),
        ..Lines::default()
    };
    pipeline.render_contacts(&world, &record, &style, &mut none);
    assert!(none.all.is_empty());
}
