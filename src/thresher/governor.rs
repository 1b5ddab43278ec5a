//! The drive of the cylinder: an ideal motor, or a governor.

use super::parameters::Thresher;
use crate::peers::JointDrive;

/// The drive of the slice at a speed of the cylinder \[rad/s\].
///
/// The ideal motor keeps its speed up to its torque limit. A governor has the torque
///
/// ```text
/// T(ω) = T_a + (T_b − T_a) (ω − ω_a) / (ω_b − ω_a)                                  (1)
/// ```
///
/// between two points of its line, taken at the end of the step: the line is chosen by the speed at the start,
/// and its slope acts implicitly, so that a steep line is as stable as the ideal motor.
pub(super) fn drive(p: &Thresher, speed: f64) -> JointDrive {
    let Some(points) = p.governor.as_deref() else {
        return JointDrive::Motor {
            speed: p.speed,
            max_force: p.drive_torque_factor * p.per_metre(p.operating_torque),
        };
    };
    let after = points.iter().position(|[at, _]| *at > speed);
    let [a, b] = match after {
        Some(0) => [points[0]; 2],
        Some(k) => [points[k - 1], points[k]],
        None => [points[points.len() - 1]; 2],
    };
    let slope = (a[1] - b[1]) / (b[0] - a[0]);
    if a[1] <= b[1] {
        // a constant torque: that of a motor that never gets to its speed
        return JointDrive::Motor {
            speed: speed.abs() + 1e3 * p.speed,
            max_force: p.per_metre(a[1]),
        };
    }
    JointDrive::Droop {
        speed: a[0] + a[1] / slope,
        damping: p.per_metre(slope),
        max_force: p.per_metre(a[1]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_of_a_governor_is_followed() {
        let p = Thresher {
            governor: Some(vec![[60.0, 260.0], [70.0, 130.0], [72.0, 0.0]]),
            ..Thresher::default()
        };
        // the torque of the whole machine that the drive gives at a speed which it keeps
        let torque = |speed: f64| {
            p.machine_width
                * match drive(&p, speed) {
                    JointDrive::Motor { max_force, .. } => max_force,
                    JointDrive::Droop {
                        speed: none,
                        damping,
                        max_force,
                    } => (damping * (none - speed)).min(max_force),
                    JointDrive::Spring { .. } => f64::NAN,
                }
        };
        for (speed, expected) in [
            (-5.0, 260.0),
            (60.0, 260.0),
            (65.0, 195.0),
            (70.0, 130.0),
            (71.0, 65.0),
        ] {
            let found = torque(speed);
            // a few roundings of numbers of the order of 100
            assert!((found - expected).abs() < 1e-11, "{speed}: {found}");
        }
        assert_eq!(torque(80.0), 0.0);
        let ideal = drive(&Thresher::default(), 3.0);
        assert!(matches!(ideal, JointDrive::Motor { speed: 70.0, .. }));
    }
}
