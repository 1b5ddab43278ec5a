use super::{Law, Mat2, Vec2};

/// Exact solution of a single block: the kernel of Gauss-Seidel and of single contacts.
///
/// Finds `p` with `ξ = G p + b` obeying `law`. For a contact, with `R` already added to `G_NN`:
///
/// ```text
/// open   b_N ≥ 0                        p = 0
/// stick  p = −G⁻¹ b                     if p_N ≥ 0 and |p_T| ≤ μ p_N
/// slip   p_N = −b_N / (G_NN + s μ G_NT), p_T = s μ p_N, s ξ_T ≤ 0             (1)
/// ```
///
/// # Which solution
/// If `μ ≥ G_NN / |G_NT|` (Painlevé) up to three solutions exist. The first one in the order above
/// is returned: open before stick before slip.
///
/// # Arguments
/// - `block`: `G_ii` [1/kg], symmetric; only `G_NN` is read for a one-row law.
/// - `free`: `b_i` \[m/s\].
///
/// # Source
/// Jean & Moreau (1992); Acary & Brogliato (2008), §13.7.
#[inline]
pub fn solve_local(block: &Mat2, free: Vec2, law: &Law) -> Vec2 {
    match *law {
        Law::Contact {
            friction,
            compliance,
        } => solve_contact(block, free, friction, compliance),
        Law::Pin => {
            let det = block[(0, 0)] * block[(1, 1)] - block[(0, 1)] * block[(0, 1)];
            if det > 1e-14 * block[(0, 0)] * block[(1, 1)] {
                solve2(block[(0, 0)], block[(0, 1)], block[(1, 1)], det, free)
            } else {
                // rank one, G = λ v vᵀ: the pseudo-inverse is G / tr(G)²
                -(block * free) / (block.trace() * block.trace())
            }
        }
        Law::Bounded {
            lower,
            upper,
            compliance,
        } => Vec2::new(
            (-free.x / (block[(0, 0)] + compliance)).clamp(lower, upper),
            0.0,
        ),
    }
}

#[inline]
fn solve2(nn: f64, nt: f64, tt: f64, det: f64, b: Vec2) -> Vec2 {
    Vec2::new((b.y * nt - b.x * tt) / det, (b.x * nt - b.y * nn) / det)
}

#[inline]
fn solve_contact(block: &Mat2, free: Vec2, friction: f64, compliance: f64) -> Vec2 {
    if free.x >= 0.0 {
        return Vec2::zeros();
    }
    let nn = block[(0, 0)] + compliance;
    if friction == 0.0 {
        return Vec2::new(-free.x / nn, 0.0);
    }
    let (nt, tt) = (block[(0, 1)], block[(1, 1)]);
    let det = nn * tt - nt * nt;
    // the sign of the sticking impulse shows which side of the cone to try first
    let mut side = -1.0;
    if det > 1e-14 * nn * tt {
        let stick = solve2(nn, nt, tt, det, free);
        if stick.x >= 0.0 && stick.y.abs() <= friction * stick.x {
            return stick;
        }
        if stick.y > 0.0 {
            side = 1.0;
        }
    } else if free.y < 0.0 {
        side = 1.0;
    }
    let mut best = Vec2::zeros();
    let mut best_violation = f64::INFINITY;
    for s in [side, -side] {
        let denominator = nn + s * friction * nt;
        if denominator <= 0.0 {
            continue;
        }
        let p = -free.x / denominator;
        let slip = free.y + (nt + s * friction * tt) * p;
        // s ξ_T ≤ 0 in exact arithmetic; the smaller violation wins against round-off
        let violation = s * slip;
        if violation <= 0.0 {
            return Vec2::new(p, s * friction * p);
        }
        if violation < best_violation {
            best_violation = violation;
            best = Vec2::new(p, s * friction * p);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{ContactProblem, Delassus, natural_map};
    use nalgebra::DMatrix;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn local_solution_passes_the_judge(
            l in prop::array::uniform3(-1.0f64..1.0),
            free in prop::array::uniform2(-5.0f64..5.0),
            friction in prop_oneof![Just(0.0), 0.0f64..1.5],
            compliance in prop_oneof![Just(0.0), 0.0f64..2.0],
        ) {
            // G = L Lᵀ + 0.2 I: no Painlevé case in most draws
            let (a, b, c) = (l[0], l[1], l[2]);
            let block = Mat2::new(a * a + 0.2, a * b, a * b, b * b + c * c + 0.2);
            prop_assume!(friction * block[(0, 1)].abs() < 0.95 * block[(0, 0)]);
            let law = Law::Contact { friction, compliance };
            let p = solve_local(&block, Vec2::from(free), &law);
            let problem = ContactProblem {
                operator: Delassus::dense(DMatrix::from_fn(2, 2, |i, j| block[(i, j)])),
                free: vec![Vec2::from(free)],
                laws: vec![law],
            };
            prop_assert!(natural_map(&problem, &[p]).certified(1e-12));
        }
    }

    #[test]
    fn painleve_takes_the_open_solution_by_rule() {
        let block = Mat2::new(1.6, -1.2, -1.2, 3.4);
        let law = Law::Contact {
            friction: 2.0,
            compliance: 0.0,
        };
        assert_eq!(
            solve_local(&block, Vec2::new(0.05, -3.0), &law),
            Vec2::zeros()
        );
    }

    #[test]
    fn motor_row_saturates_at_its_bound() {
        let law = Law::Bounded {
            lower: -0.5,
            upper: 0.5,
            compliance: 0.0,
        };
        let p = solve_local(&Mat2::identity(), Vec2::new(-3.0, 7.0), &law);
        assert_eq!(p, Vec2::new(0.5, 0.0));
    }
}
