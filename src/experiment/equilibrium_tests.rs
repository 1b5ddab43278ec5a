//! The programme against what statics knows in closed form, on both sides of each limit.

use super::*;
use std::f64::consts::PI;

fn ground(body: usize, position: [f64; 2], normal: Vec2, friction: f64) -> Joint {
    Joint {
        bodies: [None, Some(body)],
        position: Vec2::from(position),
        normal,
        friction,
    }
}

fn weight(at: [f64; 2], w: f64) -> Load {
    Load {
        force: Vec2::new(0.0, -w),
        at: Vec2::from(at),
    }
}

/// Stands just above `limit` and falls just below. The margin is ten times what the programme's
/// feasibility (1e-9 of the largest load) moves a limit of size one.
#[track_caller]
fn assert_limit(limit: f64, stands_at: impl Fn(f64) -> bool) {
    assert!(stands_at(limit * (1.0 + 1e-7)), "falls above {limit}");
    assert!(!stands_at(limit * (1.0 - 1e-7)), "stands below {limit}");
}

/// A block, 2 b wide and 2 h high, on a slope: the smaller of μ and b/h.
#[test]
fn a_block_on_a_slope_slides_or_tips() {
    let block = |slope: f64, mu: f64| {
        let load = Load {
            force: Vec2::new(slope, -1.0),
            at: Vec2::new(0.0, 2.0),
        };
        let feet = [-0.8, 0.8].map(|x| ground(0, [x, 0.0], Vec2::y(), mu));
        stands(&[load], &feet).unwrap()
    };
    // b/h = 0.4: tips first with rough feet, slides first with smoother ones
    assert_limit(1.0 / 0.4, |x| block(1.0 / x, 0.6));
    assert_limit(0.3, |mu| block(0.3, mu));
}

#[test]
fn a_ladder_at_a_smooth_wall() {
    let (l, r, sin, cos) = (2.0, 0.1, 0.6, 0.8);
    let limit = l * sin / (2.0 * l * cos + r);
    assert_limit(limit, |mu| {
        let top = [2.0 * l * sin + r, r + 2.0 * l * cos];
        let joints = [
            ground(0, [0.0, 0.0], Vec2::y(), mu),
            ground(0, top, -Vec2::x(), 0.0),
        ];
        stands(&[weight([l * sin, r + l * cos], 7.0)], &joints).unwrap()
    });
}

#[test]
fn three_discs() {
    let alpha = 0.51f64.asin();
    let place = [[-0.51, 0.5], [0.51, 0.5], [0.0, 0.5 + alpha.cos()]];
    assert_limit((0.5 * alpha).tan(), |mu| {
        let mut joints = vec![];
        for base in [0, 1] {
            let [x, y] = place[base];
            joints.push(ground(base, [x, 0.0], Vec2::y(), mu));
            let normal = Vec2::new(place[2][0] - x, place[2][1] - y);
            joints.push(Joint {
                bodies: [Some(base), Some(2)],
                position: Vec2::new(x, y) + 0.5 * normal,
                normal,
                friction: mu,
            });
        }
        stands(&place.map(|p| weight(p, 3.0)), &joints).unwrap()
    });
}

/// A wedge that a hinged lid presses, 1e-8 of the lid's weight: tan of its half angle.
#[test]
fn a_squeezed_wedge() {
    let beta: f64 = 0.25f64.atan();
    let up = Vec2::new((2.0 * beta).cos(), (2.0 * beta).sin());
    let face = Vec2::new(-up.y, up.x);
    assert_limit(beta.tan(), |mu| {
        let mut joints = vec![];
        for r in [1.0, 2.0] {
            joints.push(ground(0, [r, 0.0], Vec2::y(), mu));
            joints.push(Joint {
                bodies: [Some(0), Some(1)],
                position: up * r,
                normal: face,
                friction: mu,
            });
        }
        // a hinge pushes any way: four frictionless joints
        for normal in [Vec2::x(), -Vec2::x(), Vec2::y(), -Vec2::y()] {
            joints.push(ground(1, [0.0, 0.0], normal, 0.0));
        }
        let loads = [weight([1.4, 0.3], 1e-8), weight([1.3, 0.8], 1.0)];
        stands(&loads, &joints).unwrap()
    });
}

/// Sides of the harmonic stack: n equal blocks overhang by `Σ b/k`, b half a block.
#[test]
fn a_harmonic_stack_overhangs_by_the_harmonic_sum() {
    let n = 6;
    assert_limit(1.0, |inverse| {
        // block k from the top, each 1/(2 k) short of the one below, stretched by 1/inverse
        let mut x = 0.0;
        let mut loads = vec![];
        let mut joints = vec![];
        for k in 1..=n {
            loads.push(weight([x, 0.0], 1.0));
            let shift = 0.5 / f64::from(k) / inverse;
            for edge in [x - 0.5, x - shift + 0.5] {
                joints.push(Joint {
                    bodies: [(k < n).then_some(k as usize), Some(k as usize - 1)],
                    position: Vec2::new(edge, 0.0),
                    normal: Vec2::y(),
                    friction: 0.5,
                });
            }
            x -= shift;
        }
        stands(&loads, &joints).unwrap()
    });
}

/// Thinnest semicircular arch of n voussoirs, t/R, by bisection.
fn thinnest(n: usize) -> f64 {
    let stands_with = |t: f64| {
        let (inner, outer) = (1.0 - 0.5 * t, 1.0 + 0.5 * t);
        let ray = |k: usize| {
            let angle = PI * k as f64 / n as f64;
            Vec2::new(angle.cos(), angle.sin())
        };
        // of a true ring sector: area and centroid per radian
        let half = 0.5 * PI / n as f64;
        let centre = half.sin() / half * 2.0 / 3.0 * (outer.powi(3) - inner.powi(3))
            / (outer * outer - inner * inner);
        let loads: Vec<Load> = (0..n)
            .map(|k| {
                let middle = PI * (k as f64 + 0.5) / n as f64;
                weight([centre * middle.cos(), centre * middle.sin()], 1.0)
            })
            .collect();
        let mut joints = vec![];
        for k in 0..=n {
            for r in [inner, outer] {
                joints.push(Joint {
                    bodies: [k.checked_sub(1), (k < n).then_some(k)],
                    position: ray(k) * r,
                    normal: Vec2::new(-ray(k).y, ray(k).x),
                    friction: 1.0,
                });
            }
        }
        stands(&loads, &joints).unwrap()
    };
    let (mut falls, mut holds) = (0.05, 0.2);
    while holds - falls > 1e-6 {
        let middle = 0.5 * (falls + holds);
        if stands_with(middle) {
            holds = middle;
        } else {
            falls = middle;
        }
    }
    holds
}

/// Milankovitch (1907): t/R = 0.1075 of a semicircular arch with radial joints everywhere, which
/// arches of more and more voussoirs approach from below, as they can open fewer places.
#[test]
fn a_fine_arch_reaches_the_continuous_limit() {
    let limits = [11, 27, 101].map(thinnest);
    assert!(limits[0] < limits[1] && limits[1] < limits[2], "{limits:?}");
    // printed to four digits; n = 101 places its hinges to half a voussoir, of second order
    assert!((limits[2] - 0.1075).abs() < 1e-4, "{limits:?}");
}

#[test]
fn a_joint_of_an_unknown_block_is_an_error() {
    let error = stands(
        &[weight([0.0; 2], 1.0)],
        &[ground(1, [0.0; 2], Vec2::y(), 0.5)],
    );
    let expected = EquilibriumError::Body {
        joint: 0,
        body: 1,
        blocks: 1,
    };
    assert_eq!(error, Err(expected));
}
