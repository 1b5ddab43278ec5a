use super::Vec2;

/// Orthogonal projection onto the planar friction cone `K_μ = { (n, t) : |t| ≤ μ n }`.
///
/// ```text
/// 0                        if μ |t| ≤ −n          (polar cone)
/// (n, t)                   if |t| ≤ μ n           (inside)
/// (p, μ p sgn t)           else, p = (μ |t| + n)/(1 + μ²)
/// ```
///
/// # Arguments
/// - `point`: (n, t), any unit.
/// - `friction`: μ ≥ 0; with μ = 0 the cone is the ray `t = 0, n ≥ 0`.
pub fn project_onto_cone(point: Vec2, friction: f64) -> Vec2 {
    let (n, t) = (point.x, point.y);
    if friction * t.abs() <= -n {
        Vec2::zeros()
    } else if t.abs() <= friction * n {
        point
    } else {
        let p = (friction * t.abs() + n) / (1.0 + friction * friction);
        Vec2::new(p, friction * p * t.signum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn projection_is_idempotent_and_nonexpansive(
            a in prop::array::uniform2(-10.0f64..10.0),
            b in prop::array::uniform2(-10.0f64..10.0),
            friction in 0.0f64..3.0,
        ) {
            let (a, b) = (Vec2::from(a), Vec2::from(b));
            let (pa, pb) = (project_onto_cone(a, friction), project_onto_cone(b, friction));
            // round-off of the two formulas: a few ulp of 10
            prop_assert!((project_onto_cone(pa, friction) - pa).norm() < 1e-14);
            prop_assert!((pa - pb).norm() <= (a - b).norm() * (1.0 + 1e-14) + 1e-14);
        }
    }
}
