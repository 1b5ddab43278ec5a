//! The rows that joints are made of: how far apart two frames are, and what changes it.

use super::model::{ContactKey, JointKind, JointPart, JointRow};
use crate::contact::{NO_BODY, Rows, Vec2, Vec3};

/// Two points and an axis, each fixed to a body, at one configuration.
///
/// With the arms `r₁`, `r₂` from the centres of mass to the points, `d = p₂ − p₁` and the unit
/// axis `a` of the first body, the coordinates of a joint and their rates are
///
/// ```text
/// point      d            ḋ = v₂ + ω₂ × r₂ − v₁ − ω₁ × r₁                       (1)
/// along a    a·d          a·ḋ + ω₁ (a × d)                                      (2)
/// distance   |d|          ḋ·d/|d|                                               (3)
/// angle      θ₂ − θ₁      ω₂ − ω₁                                               (4)
/// ```
///
/// all of the second body relative to the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointFrames {
    /// The model's numbers of both bodies; [`NO_BODY`] for the world.
    pub bodies: [u32; 2],
    /// `r₁`, `r₂` \[m\].
    pub arms: [Vec2; 2],
    /// `d` \[m\].
    pub offset: Vec2,
}

/// Coordinate of a joint: the gap it has, the rows that change it and how it bends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate {
    /// The coordinate [m, m] or \[rad\]; the second number is 0 for one row.
    pub value: Vec2,
    pub rows: Rows,
    pub bend: Bend,
}

/// What a coordinate does beyond its rate times time, when bodies turn far in a step.
///
/// With turns `φ = ω t` and `R` the rotation by them, the motion from the midpoint on is exact:
/// `d(t) = d + t (v₂ − v₁) + (R₂ − 1) r₂ − (R₁ − 1) r₁`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bend {
    /// Its rate is constant.
    Straight,
    /// (1) of [`JointFrames`].
    Point { arms: [Vec2; 2] },
    /// (2) along the axis, times the sign of the row.
    Along {
        frames: JointFrames,
        axis: Vec2,
        sign: f64,
    },
    /// (3), times the sign of the row.
    Distance { frames: JointFrames, sign: f64 },
}

/// `R(φ) v − v`, without loss of digits at small angles.
fn turned(v: Vec2, angle: f64) -> Vec2 {
    let half = (0.5 * angle).sin();
    let (less, sin) = (2.0 * half * half, angle.sin());
    Vec2::new(-less * v.x - sin * v.y, sin * v.x - less * v.y)
}

fn across(v: Vec2) -> Vec2 {
    Vec2::new(-v.y, v.x)
}

impl Bend {
    /// `g(q ⊕ t u) − g(q) − t W u` \[m\], with the velocities of both sides.
    pub fn after(&self, velocities: [Vec3; 2], time: f64) -> Vec2 {
        let angles = velocities.map(|u| u.z * time);
        match self {
            Bend::Straight => Vec2::zeros(),
            Bend::Point { arms } => point_bend(arms, angles),
            Bend::Along { frames, axis, sign } => {
                let d = frames.offset;
                let moved = frames.moved(velocities, time);
                let now = (axis + turned(*axis, angles[0])).dot(&moved);
                let rate = axis.dot(&(moved - d - point_bend(&frames.arms, angles)))
                    + angles[0] * axis.perp(&d);
                Vec2::new(sign * (now - axis.dot(&d) - rate), 0.0)
            }
            Bend::Distance { frames, sign } => {
                let d = frames.offset;
                let moved = frames.moved(velocities, time);
                let straight = moved - point_bend(&frames.arms, angles);
                let along = direction(d);
                let rate = along.dot(&(straight - d));
                Vec2::new(sign * (moved.norm() - d.norm() - rate), 0.0)
            }
        }
    }

    /// Largest arm \[m\] on which a turn acts: what its error is held against.
    pub fn reach(&self) -> f64 {
        let of = |arms: &[Vec2; 2]| arms[0].norm().max(arms[1].norm());
        match self {
            Bend::Straight => 0.0,
            Bend::Point { arms } => of(arms),
            Bend::Along { frames, .. } | Bend::Distance { frames, .. } => {
                of(&frames.arms).max(frames.offset.norm())
            }
        }
    }

    /// The same coordinate with the other sign.
    fn turned_round(self) -> Bend {
        match self {
            Bend::Along { frames, axis, sign } => Bend::Along {
                frames,
                axis,
                sign: -sign,
            },
            Bend::Distance { frames, sign } => Bend::Distance {
                frames,
                sign: -sign,
            },
            other => other,
        }
    }
}

/// What (1) does beyond its rate: `(R₂ − 1 − φ₂ ×) r₂ − (R₁ − 1 − φ₁ ×) r₁`.
fn point_bend(arms: &[Vec2; 2], angles: [f64; 2]) -> Vec2 {
    let of = |k: usize| turned(arms[k], angles[k]) - angles[k] * across(arms[k]);
    of(1) - of(0)
}

/// Unit vector along `d`, or x where the points coincide.
fn direction(d: Vec2) -> Vec2 {
    d.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vec2::x)
}

impl JointFrames {
    /// `d` after `time`.
    fn moved(&self, velocities: [Vec3; 2], time: f64) -> Vec2 {
        let turn = |k: usize| turned(self.arms[k], velocities[k].z * time);
        self.offset + (velocities[1].xy() - velocities[0].xy()) * time + turn(1) - turn(0)
    }

    fn rows(&self, first: [Vec3; 2], second: [Vec3; 2]) -> Rows {
        let mut rows = Rows {
            bodies: self.bodies,
            jacobian: [first, second],
        };
        for side in 0..2 {
            if rows.bodies[side] == NO_BODY {
                rows.jacobian[side] = [Vec3::zeros(); 2];
            }
        }
        rows
    }

    /// (1): two rows, along x and y of the world.
    pub fn point(&self) -> Coordinate {
        let side = |r: Vec2, sign: f64| {
            [
                Vec3::new(sign, 0.0, -sign * r.y),
                Vec3::new(0.0, sign, sign * r.x),
            ]
        };
        Coordinate {
            value: self.offset,
            rows: self.rows(side(self.arms[0], -1.0), side(self.arms[1], 1.0)),
            bend: Bend::Point { arms: self.arms },
        }
    }

    /// (2), along a unit axis that turns with the first body.
    pub fn along(&self, axis: Vec2) -> Coordinate {
        // the arm of the first body reaches to the second point
        let far = self.arms[0] + self.offset;
        self.one_row(
            self.offset.dot(&axis),
            -Vec3::new(axis.x, axis.y, far.perp(&axis)),
            Vec3::new(axis.x, axis.y, self.arms[1].perp(&axis)),
            Bend::Along {
                frames: *self,
                axis,
                sign: 1.0,
            },
        )
    }

    /// (3).
    pub fn distance(&self) -> Coordinate {
        let along = direction(self.offset);
        let side = |k: usize| Vec3::new(along.x, along.y, self.arms[k].perp(&along));
        self.one_row(
            self.offset.norm(),
            -side(0),
            side(1),
            Bend::Distance {
                frames: *self,
                sign: 1.0,
            },
        )
    }

    /// (4), of the given value \[rad\].
    pub fn angle(&self, value: f64) -> Coordinate {
        self.one_row(value, -Vec3::z(), Vec3::z(), Bend::Straight)
    }

    fn one_row(&self, value: f64, first: Vec3, second: Vec3, bend: Bend) -> Coordinate {
        Coordinate {
            value: Vec2::new(value, 0.0),
            rows: self.rows([first, Vec3::zeros()], [second, Vec3::zeros()]),
            bend,
        }
    }
}

/// Which row of which joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowName {
    pub key: ContactKey,
    /// The model's number of the joint.
    pub joint: u32,
    pub part: JointPart,
}

impl Coordinate {
    /// The row that keeps the coordinate at `target`, both ways; both rows of a point.
    pub fn lock(self, name: RowName, target: f64) -> JointRow {
        let gap = self.value - Vec2::new(target, 0.0);
        let kind = match self.bend {
            Bend::Point { .. } => JointKind::Pin { gap },
            _ => JointKind::Lock { gap: gap.x },
        };
        self.row(name, kind)
    }

    /// The row that keeps it at or above `least`.
    pub fn above(self, name: RowName, least: f64) -> JointRow {
        let gap = self.value.x - least;
        self.row(name, JointKind::Limit { gap })
    }

    /// The row that keeps it at or below `most`.
    pub fn below(mut self, name: RowName, most: f64) -> JointRow {
        let gap = most - self.value.x;
        for side in &mut self.rows.jacobian {
            side[0] = -side[0];
        }
        self.bend = self.bend.turned_round();
        self.row(name, JointKind::Limit { gap })
    }

    /// The row that a motor or spring drives; it pushes along the coordinate as it is now.
    pub fn driven(mut self, name: RowName, kind: JointKind) -> JointRow {
        self.bend = Bend::Straight;
        self.row(name, kind)
    }

    fn row(self, name: RowName, kind: JointKind) -> JointRow {
        JointRow {
            key: name.key,
            joint: name.joint,
            part: name.part,
            rows: self.rows,
            kind,
            bend: self.bend,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Rows are the derivative of the value, and the bend is what is left, of second order.
        #[test]
        fn value_rows_and_bend_are_one_motion(
            arms in prop::array::uniform4(-1.0f64..1.0),
            offset in prop::array::uniform2(0.2f64..1.0),
            u in prop::array::uniform6(-2.0f64..2.0),
            angle in -3.0f64..3.0,
        ) {
            let frames = JointFrames {
                bodies: [0, 1],
                arms: [Vec2::new(arms[0], arms[1]), Vec2::new(arms[2], arms[3])],
                offset: Vec2::from(offset),
            };
            let velocities = [Vec3::new(u[0], u[1], u[2]), Vec3::new(u[3], u[4], u[5])];
            let axis = Vec2::new(angle.cos(), angle.sin());
            let name = RowName {
                key: ContactKey { pair: 0, feature: 0 },
                joint: 0,
                part: JointPart::Pin,
            };
            for time in [1e-3, 0.7] {
                let moved = JointFrames {
                    offset: frames.moved(velocities, time),
                    ..frames
                };
                let later = turned(axis, time * u[2]) + axis;
                for (now, then) in [
                    (frames.point(), moved.point()),
                    (frames.along(axis), moved.along(later)),
                    (frames.distance(), moved.distance()),
                ] {
                    let change = now.rows.velocity(&velocities) * time;
                    let bend = now.bend.after(velocities, time);
                    let left = then.value - now.value - change - bend;
                    prop_assert!(left.norm() < 1e-13, "{left}");
                    // rates up to 4 m/s turned by 4 rad/s, over 0.2 m
                    prop_assert!(bend.norm() <= 150.0 * time * time, "{bend}");
                    let below = now.below(name, 1.0);
                    let other = below.bend.after(velocities, time);
                    prop_assert_eq!(other.x, if let Bend::Point { .. } = now.bend { bend.x } else { -bend.x });
                }
            }
        }
    }
}
