//! Outlines that close.

use super::super::rig::part;
use moreau2d::contact::Vec2;
use moreau2d::wear::{Profile, WearError, WearState};

fn ring(points: Vec<Vec2>) -> WearState {
    part(Profile::ring(points).unwrap(), 1.0)
}

/// A disc that wears evenly down to a quarter of its radius, its mesh with it: what is gone is what the
/// law says and what merged nodes gave, in all columns together, and no column gets more than another.
#[test]
fn a_disc_wears_evenly_over_many_meshes() {
    let clockwise = |k: i32| {
        let (sin, cos) = (-std::f64::consts::TAU * f64::from(k) / 40.0).sin_cos();
        Vec2::new(cos, sin)
    };
    let mut disc = ring((0..40).map(clockwise).collect());
    let new = disc.profile().clone();
    let (mut asked, mut clipped, mut meshes) = (0.0, 0.0, 0);
    for _ in 0..50 {
        let load: Vec<f64> = disc.profile().widths().iter().map(|w| 0.015 * w).collect();
        let step = disc.advance(&load, 1.0, 0.0).unwrap();
        asked += step.requested_area;
        clipped += step.clipped_area;
        meshes += u32::from(step.remeshed);
    }
    assert!(meshes > 1 && disc.profile().node_count() < 20, "{meshes}");
    let gone = new.area_over(disc.profile());
    // round-off of an area of 3 over 50 jumps
    assert!(
        (gone - (asked - clipped)).abs() < 1e-12,
        "{gone} {asked} {clipped}"
    );
    let volume = &disc.life().last().volume;
    assert!((volume.iter().sum::<f64>() - gone).abs() < 1e-12);
    for h in disc.depth() {
        assert!((h - 0.75).abs() < 1e-12, "{h}");
    }
    let radius = disc.profile().nodes().iter().map(|p| p.norm());
    for r in radius {
        assert!((0.2..0.26).contains(&r), "{r}");
    }
}

/// A neck that wears from both sides crosses itself: refused, and nothing has changed.
#[test]
fn a_ring_that_wears_through_itself_is_refused() {
    // clockwise round two heads and a neck 0.5 thick
    let outline = [
        (-3.0, 1.0),
        (-2.0, 1.0),
        (-1.0, 1.0),
        (-0.5, 0.25),
        (0.5, 0.25),
        (1.0, 1.0),
        (2.0, 1.0),
        (3.0, 1.0),
        (3.0, -1.0),
        (2.0, -1.0),
        (1.0, -1.0),
        (0.5, -0.25),
        (-0.5, -0.25),
        (-1.0, -1.0),
        (-2.0, -1.0),
        (-3.0, -1.0),
    ];
    let mut bone = ring(outline.map(|(x, y)| Vec2::new(x, y)).to_vec());
    let load = |bone: &WearState| -> Vec<f64> {
        let neck = |p: &Vec2| f64::from(p.x.abs() < 0.75);
        let nodes = bone.profile().nodes().iter();
        let widths = bone.profile().widths();
        nodes.zip(widths).map(|(p, w)| 0.1 * w * neck(p)).collect()
    };
    let mut jumps = 0;
    let error = loop {
        let before = bone.clone();
        match bone.advance(&load(&bone), 1.0, 0.0) {
            Ok(_) => jumps += 1,
            Err(error) => {
                assert_eq!(bone, before);
                break error;
            }
        }
        assert!(jumps < 5);
    };
    assert!(matches!(error, WearError::Crossing { .. }), "{error}");
    assert_eq!(jumps, 2);
}
