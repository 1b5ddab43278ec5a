//! The rows that joints are made of.

use super::joint_frames::{Bend, Coordinate};
use super::model::{ContactKey, JointKind, JointPart, JointRow};
use crate::contact::Vec2;

/// Which row of which joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowName {
    pub key: ContactKey,
    /// The model's number of the joint.
    pub joint: u32,
    pub part: JointPart,
}

impl Coordinate {
    /// The row that holds the coordinate at `target`, in both directions; both rows of a point.
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

    /// The row of a motor or spring; it acts along the coordinate at the present configuration.
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
    use super::super::joint_frames::{JointFrames, turned};
    use super::*;
    use crate::contact::Vec3;
    use proptest::prelude::*;

    proptest! {
        /// Rows are the derivative of the value; the bend is the remainder, of second order.
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
