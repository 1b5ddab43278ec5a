//! The coordinates of a joint between two frames, their rates and their bend.

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

/// Coordinate of a joint: its value, its rows and its bend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate {
    /// The coordinate [m, m] or \[rad\]; the second number is 0 if there is one row.
    pub value: Vec2,
    pub rows: Rows,
    pub bend: Bend,
}

/// The change of a coordinate beyond its rate times time, if bodies turn far in a step.
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
pub(super) fn turned(v: Vec2, angle: f64) -> Vec2 {
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

    /// No less than the length of [`Bend::after`] \[m\], and fast for pins: `|R(φ) r − r − φ × r| ≤ φ² r/2`.
    pub(super) fn most(&self, velocities: [Vec3; 2], time: f64) -> f64 {
        match self {
            Bend::Straight => 0.0,
            Bend::Point { arms } => {
                let of = |k: usize| arms[k].norm() * (velocities[k].z * time).powi(2);
                0.5 * (of(0) + of(1))
            }
            Bend::Along { .. } | Bend::Distance { .. } => f64::INFINITY,
        }
    }

    /// Largest arm \[m\] that a turn acts on; the scale of its error.
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

    /// The same coordinate with the opposite sign.
    pub(super) fn turned_round(self) -> Bend {
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

/// Change of (1) beyond its rate: `(R₂ − 1 − φ₂ ×) r₂ − (R₁ − 1 − φ₁ ×) r₁`.
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
    pub(super) fn moved(&self, velocities: [Vec3; 2], time: f64) -> Vec2 {
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

    /// (1) between two bodies that both move, in axes that turn with their mean spin:
    /// `ḋ − (ω₁ + ω₂)/2 × d`. It vanishes with `d` as (1) does.
    ///
    /// Both impulses then act half way across the gap. With (1) they act at both ends of it, and
    /// the couple `d × P` changes the angular momentum of the two.
    pub fn shared_point(&self) -> Coordinate {
        let half = 0.5 * self.offset;
        let arms = [self.arms[0] + half, self.arms[1] - half];
        Coordinate {
            rows: JointFrames { arms, ..*self }.point().rows,
            ..self.point()
        }
    }

    /// (2), along a unit axis that turns with the first body.
    pub fn along(&self, axis: Vec2) -> Coordinate {
        // the arm of the first body ends at the second point
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
