//! The contact kernel and the judge: what holds for every cone, block and problem.

use crate::common::Random;
use crate::common::problems::{Change, Known, assert_laws};
use moreau2d::contact::{
    ContactProblem, Delassus, Law, Mat2, Vec2, natural_map, project_onto_cone, solve_local,
};
use nalgebra::DMatrix;
use proptest::prelude::*;

/// Friction from none to far beyond any material.
fn any_friction() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 0.0f64..2.0, 2.0f64..100.0]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    /// Moreau's decomposition, which no other map fulfils: `x = Π x + y` with `Π x` in the cone, `y`
    /// in its polar, both at right angles.
    #[test]
    fn projection_leaves_a_part_in_the_polar_cone_at_right_angles(
        x in prop::array::uniform2(-10.0f64..10.0),
        friction in any_friction(),
        scale in -12i32..12,
    ) {
        let x = Vec2::from(x) * 10f64.powi(scale);
        let inside = project_onto_cone(x, friction);
        let rest = x - inside;
        // a few ulp of x; the cone's equations multiply them by μ
        let ulp = 4.0 * f64::EPSILON * x.norm();
        prop_assert!(inside.x >= 0.0);
        prop_assert!(inside.y.abs() <= friction * inside.x + ulp);
        prop_assert!(friction * rest.y.abs() <= -rest.x + (1.0 + friction) * ulp, "{rest}");
        prop_assert!(inside.dot(&rest).abs() <= ulp * (inside.norm() + rest.norm()), "{rest}");
    }

    /// Whatever the friction, Painlevé's blocks included, some solution exists, and one is found.
    #[test]
    fn a_block_is_solved_whatever_its_friction(
        l in prop::array::uniform3(-1.0f64..1.0),
        free in prop::array::uniform2(-5.0f64..5.0),
        friction in any_friction(),
        compliance in prop_oneof![Just(0.0), 0.0f64..2.0],
    ) {
        let (a, b, c) = (l[0], l[1], l[2]);
        let block = Mat2::new(a * a + 0.05, a * b, a * b, b * b + c * c + 0.05);
        let law = Law::Contact { friction, compliance };
        let problem = ContactProblem {
            operator: Delassus::dense(DMatrix::from_fn(2, 2, |i, j| block[(i, j)])),
            free: vec![Vec2::from(free)],
            laws: vec![law],
        };
        let p = [solve_local(&block, Vec2::from(free), &law)];
        let residual = natural_map(&problem, &p);
        // where nn + s μ nt nearly vanishes the impulse is large, and so is its round-off
        prop_assert!(residual.certified(1e-10), "{p:?} {residual:?}");
        assert_laws(&problem, &p);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    /// What was chosen to solve a problem is certified, and obeys the laws.
    #[test]
    fn a_chosen_solution_is_certified(seed: u64) {
        let random = &mut Random(seed);
        for known in [
            Known::redundant(random),
            Known::unique(random),
            Known::unique_explicit(random),
        ] {
            prop_assert!(known.problem.validate().is_ok());
            let residual = natural_map(&known.problem, &known.impulses);
            prop_assert!(residual.certified(1e-13), "{residual:?}");
            assert_laws(&known.problem, &known.impulses);
        }
    }

    /// The figures of any impulses, solution or not, know no labels, axes, hands or units.
    #[test]
    fn residuals_do_not_depend_on_how_a_problem_is_written(seed: u64, off in 0.0f64..2.0) {
        let random = &mut Random(seed);
        let known = Known::redundant(random);
        let impulses: Vec<Vec2> = known
            .impulses
            .iter()
            .map(|p| p + off * Vec2::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0)))
            .collect();
        let old = natural_map(&known.problem, &impulses);
        for change in Change::all(random, &known.problem) {
            let new = natural_map(&change.problem(&known.problem), &change.impulses(&impulses));
            let (mass, velocity) = change.growth();
            // round-off of sums of a dozen terms, against the scale of each figure
            let near = |a: f64, b: f64, scale: f64| (a - b).abs() <= 1e-12 * (b.abs() + scale);
            let impulse_scale = if old.relative > 0.0 { old.absolute / old.relative } else { 1.0 };
            prop_assert!(near(new.relative, old.relative, 1.0), "{change:?}");
            prop_assert!(
                near(new.absolute, mass * old.absolute, mass * impulse_scale), "{change:?}"
            );
            prop_assert!(
                near(new.velocity, velocity * old.velocity, velocity * old.velocity_scale),
                "{change:?}"
            );
            prop_assert!(
                near(new.velocity_scale, velocity * old.velocity_scale, 0.0), "{change:?}"
            );
        }
    }
}
