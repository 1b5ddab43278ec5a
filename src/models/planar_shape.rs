use crate::contact::Vec2;

/// A shape with gaps in closed form, in the body's frame \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PlanarShape {
    Disc {
        radius: f64,
    },
    /// Along x; its two ends are its contact points.
    Rod {
        length: f64,
    },
    /// Half width and height; its four corners are its contact points.
    Box {
        half: Vec2,
    },
    /// The infinite x axis, the solid below it.
    Line,
    /// A circle around the origin with contacts on its inside.
    Bowl {
        radius: f64,
    },
}

/// A contact point of a body, with the radius around it \[m\].
pub(super) type Tip = (Vec2, f64);

impl PlanarShape {
    /// Whether the two have a gap in closed form: discs with each other; discs, rods and boxes with
    /// lines and bowls.
    pub fn meets(&self, other: &PlanarShape) -> bool {
        match (self, other) {
            (PlanarShape::Disc { .. }, PlanarShape::Disc { .. }) => true,
            (surface, tips) => surface.is_surface() != tips.is_surface(),
        }
    }

    /// Lines and bowls. Other shapes touch them, and only a prescribed motion moves them.
    pub fn is_surface(&self) -> bool {
        matches!(self, PlanarShape::Line | PlanarShape::Bowl { .. })
    }

    /// Radius of the surface \[m\], negative inside a bowl; 0 where it is flat or sharp.
    pub(super) fn surface_radius(&self) -> f64 {
        match *self {
            PlanarShape::Disc { radius } => radius,
            PlanarShape::Bowl { radius } => -radius,
            _ => 0.0,
        }
    }

    /// The contact points, in the order of the contact's feature number.
    pub(super) fn tips(&self) -> Vec<Tip> {
        let point = |x, y| (Vec2::new(x, y), 0.0);
        match *self {
            PlanarShape::Disc { radius } => vec![(Vec2::zeros(), radius)],
            PlanarShape::Rod { length } => {
                vec![point(-0.5 * length, 0.0), point(0.5 * length, 0.0)]
            }
            PlanarShape::Box { half } => vec![
                point(-half.x, -half.y),
                point(half.x, -half.y),
                point(half.x, half.y),
                point(-half.x, half.y),
            ],
            PlanarShape::Line | PlanarShape::Bowl { .. } => Vec::new(),
        }
    }

    /// Extent \[m\]; infinite for a line.
    pub fn size(&self) -> f64 {
        match *self {
            PlanarShape::Disc { radius } | PlanarShape::Bowl { radius } => 2.0 * radius,
            PlanarShape::Rod { length } => length,
            PlanarShape::Box { half } => 2.0 * half.norm(),
            PlanarShape::Line => f64::INFINITY,
        }
    }

    /// Gap \[m\] of a tip of radius `r` at `d` from the surface's frame, and the unit normal from
    /// the surface to the tip; `up` is the frame's y axis.
    ///
    /// ```text
    /// line  g = n·d − r,   n = up        bowl  g = R − r − |d|,   n = −d/|d|
    /// disc  g = |d| − R − r,   n = d/|d|
    /// ```
    pub(super) fn gap(&self, d: Vec2, r: f64, up: Vec2) -> (f64, Vec2) {
        let distance = d.norm();
        // at the centre any direction will do
        let away = if distance > 0.0 { d / distance } else { up };
        match *self {
            PlanarShape::Disc { radius } => (distance - radius - r, away),
            PlanarShape::Bowl { radius } => (radius - r - distance, -away),
            _ => (up.dot(&d) - r, up),
        }
    }

    /// From the surface's frame to a contact that lies `below` \[m\] the tip at `d`: exactly along
    /// the normal where the surface is round.
    pub(super) fn arm(&self, d: Vec2, below: f64, n: Vec2) -> Vec2 {
        match self {
            PlanarShape::Disc { .. } | PlanarShape::Bowl { .. } => n * (d.dot(&n) - below),
            _ => d - n * below,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No contact depends on the normal at the very centre: the gap is known and any normal will
    /// do.
    #[test]
    fn concentric_circles_have_a_gap_and_a_unit_normal() {
        for (shape, gap) in [
            (PlanarShape::Bowl { radius: 3.0 }, 2.0),
            (PlanarShape::Disc { radius: 3.0 }, -4.0),
        ] {
            let (found, normal) = shape.gap(Vec2::zeros(), 1.0, Vec2::y());
            assert_eq!((found, normal.norm()), (gap, 1.0));
        }
    }

    #[test]
    fn gaps_are_those_of_circles_and_lines() {
        let d = Vec2::new(3.0, 4.0);
        let cases = [
            (PlanarShape::Line, 3.5, Vec2::y()),
            (PlanarShape::Bowl { radius: 8.0 }, 2.5, -d / 5.0),
            (PlanarShape::Disc { radius: 1.0 }, 3.5, d / 5.0),
        ];
        for (shape, gap, normal) in cases {
            assert_eq!(shape.gap(d, 0.5, Vec2::y()), (gap, normal));
        }
    }
}
