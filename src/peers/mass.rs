//! Area moments of shapes in `f64`.

use super::simulation::ShapeSpec;
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use std::f64::consts::PI;

/// Area \[m²\], centroid \[m\] and polar moment of area about the centroid \[m⁴\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AreaMoments {
    pub area: f64,
    pub centroid: Vec2,
    pub polar: f64,
}

/// Moments of a solid shape; `None` for a chain that encloses no solid.
///
/// The moments of a polygon are sums over the triangles from its first corner, by Green's theorem.
pub(super) fn area_moments(shape: &ShapeSpec) -> Option<AreaMoments> {
    let centered = |area: f64, polar: f64| AreaMoments {
        area,
        centroid: Vec2::zeros(),
        polar,
    };
    match shape {
        ShapeSpec::Ball { radius: r } => {
            let area = PI * r * r;
            Some(centered(area, 0.5 * area * r * r))
        }
        ShapeSpec::Box { half } => {
            let area = 4.0 * half.x * half.y;
            Some(centered(area, area * half.norm_squared() / 3.0))
        }
        ShapeSpec::Capsule {
            half_length: l,
            radius: r,
        } => {
            let (disc, slab) = (PI * r * r, 4.0 * l * r);
            // two half discs, each with its centroid 4 r / 3π beyond the end of the slab
            let c = 4.0 * r / (3.0 * PI);
            let ends = disc * (0.5 * r * r - c * c + (l + c) * (l + c));
            Some(centered(disc + slab, slab * (l * l + r * r) / 3.0 + ends))
        }
        ShapeSpec::Polygon { points } => polygon(points),
        ShapeSpec::Chain { points, closed } if *closed => polygon(points),
        ShapeSpec::Chain { .. } => None,
        ShapeSpec::Compound(parts) => compound(parts),
    }
}

/// Sums over the parts, where overlaps count twice; polar moments by Steiner's theorem.
fn compound(parts: &[(Pose64, ShapeSpec)]) -> Option<AreaMoments> {
    let moved = |(place, shape): &(Pose64, ShapeSpec)| {
        let moments = area_moments(shape)?;
        Some((moments, place.apply(moments.centroid)))
    };
    let moments: Vec<_> = parts.iter().map(moved).collect::<Option<_>>()?;
    let area: f64 = moments.iter().map(|(m, _)| m.area).sum();
    let first: Vec2 = moments.iter().map(|(m, at)| at * m.area).sum();
    let centroid = first / area;
    let about = |(m, at): &(AreaMoments, Vec2)| m.polar + m.area * (at - centroid).norm_squared();
    (area > 0.0).then(|| AreaMoments {
        area,
        centroid,
        polar: moments.iter().map(about).sum(),
    })
}

fn polygon(points: &[Vec2]) -> Option<AreaMoments> {
    let origin = *points.first()?;
    let (mut area, mut first, mut second) = (0.0, Vec2::zeros(), 0.0);
    for pair in points[1..].windows(2) {
        let (a, b) = (pair[0] - origin, pair[1] - origin);
        let twice = a.perp(&b);
        area += 0.5 * twice;
        first += (a + b) * (twice / 6.0);
        second += twice * (a.norm_squared() + a.dot(&b) + b.norm_squared()) / 12.0;
    }
    if area <= 0.0 {
        return None;
    }
    let c = first / area;
    Some(AreaMoments {
        area,
        centroid: origin + c,
        polar: second - area * c.norm_squared(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square as a polygon away from its own centre, and a capsule without length.
    #[test]
    fn agree_where_shapes_coincide() {
        let points: Vec<Vec2> = [[1.0, 2.0], [4.0, 2.0], [4.0, 6.0], [1.0, 6.0]]
            .map(Vec2::from)
            .to_vec();
        let p = area_moments(&ShapeSpec::Polygon { points }).unwrap();
        let half = Vec2::new(1.5, 2.0);
        let b = area_moments(&ShapeSpec::Box { half }).unwrap();
        assert!((p.centroid - Vec2::new(2.5, 4.0)).norm() < 1e-14);
        assert!((p.area - b.area).abs() < 1e-13 && (p.polar - b.polar).abs() < 1e-12);
        let ball = area_moments(&ShapeSpec::Ball { radius: 0.7 }).unwrap();
        let stub = area_moments(&ShapeSpec::Capsule {
            half_length: 0.0,
            radius: 0.7,
        })
        .unwrap();
        assert!((ball.polar - stub.polar).abs() < 1e-14);
    }

    /// A box cut in two, one half rotated, away from its own centre.
    #[test]
    fn parts_add_up() {
        let half = Vec2::new(0.5, 1.0);
        let at = |x: f64, y: f64, angle: f64| Pose64::new(Vec2::new(x, y), angle);
        let turned = ShapeSpec::Box {
            half: Vec2::new(1.0, 0.5),
        };
        let parts = vec![
            (at(3.5, 5.0, 0.0), ShapeSpec::Box { half }),
            (at(4.5, 5.0, 0.5 * PI), turned),
        ];
        let parts = area_moments(&ShapeSpec::Compound(parts)).unwrap();
        let half = Vec2::new(1.0, 1.0);
        let whole = area_moments(&ShapeSpec::Box { half }).unwrap();
        assert!((parts.centroid - Vec2::new(4.0, 5.0)).norm() < 1e-14);
        assert!((parts.area - whole.area).abs() < 1e-14);
        assert!((parts.polar - whole.polar).abs() < 1e-14);
        assert_eq!(area_moments(&ShapeSpec::Compound(Vec::new())), None);
    }

    #[test]
    fn clockwise_chain_encloses_nothing() {
        let points = vec![Vec2::zeros(), Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.0)];
        let shape = ShapeSpec::Chain {
            points,
            closed: true,
        };
        assert_eq!(area_moments(&shape), None);
    }
}
