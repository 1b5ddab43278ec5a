//! A stored problem with states of rest and states of slip.

use moreau2d::contact::{Delassus, Vec2, Vec3};
use moreau2d::problems::{StoredProblem, read};
use moreau2d::solver::solver_by_name;

/// Bug: the rope of `scenes/issues/rope-on-drum.toml` can rest, and slipped, as the solver found another
/// solution. Its first problem in double precision (feature `f64`, step length 1/60 s): 64 links, 65 pins.
#[test]
fn a_rope_that_can_rest_does() {
    let loaded = read(include_bytes!("../data/rope-on-drum.json")).unwrap();
    let StoredProblem::Contact { problem, .. } = loaded.problem else {
        panic!("a contact problem");
    };
    let Delassus::Bodies(op) = &problem.operator else {
        panic!("from bodies");
    };
    for name in ["direct", "auto"] {
        let mut impulses = vec![Vec2::zeros(); problem.len()];
        let report = solver_by_name(name)
            .unwrap()
            .solve(&problem, &mut impulses, 1e-8);
        assert!(report.solved(), "{name}: {report:?}");
        let mut change = vec![Vec3::zeros(); op.inverse_mass.len()];
        for (rows, &p) in op.rows.iter().zip(&impulses) {
            rows.push(p, &op.inverse_mass, &mut change);
        }
        let speeds = op.rows.iter().zip(&problem.free);
        let most = speeds.map(|(rows, free)| (rows.velocity(&change) + free).norm());
        let most = most.fold(0.0, f64::max);
        // it slipped at some 1e-4 m/s
        assert!(most < 1e-8, "{name}: {most} m/s");
    }
}
