//! The linear model: energy, independence of coordinates, and mass matrices that are refused.

use crate::common::{LADDER, load, order};
use moreau2d::contact::Vec3;
use moreau2d::dynamics::{MoreauStepper, Scheme, StepperSettings};
use moreau2d::models::{Linear, LinearContact, LinearSystem};
use nalgebra::Matrix3;

fn spring_pair() -> (LinearSystem, Vec3, Vec3) {
    let system = LinearSystem {
        coordinates: 2,
        mass: Matrix3::new(2.0, 0.5, 9.0, 0.5, 1.0, 9.0, 9.0, 9.0, 9.0),
        stiffness: Matrix3::new(30.0, -10.0, 9.0, -10.0, 20.0, 9.0, 9.0, 9.0, 9.0),
        load: Vec3::new(1.0, -2.0, 9.0),
    };
    (system, Vec3::new(0.3, -0.1, 9.0), Vec3::new(0.0, 0.4, 9.0))
}

/// A smooth system with a full mass matrix conserves its energy at second order, and its third
/// coordinate, which it has not, stays out of it.
#[test]
fn a_linear_model_swings_with_its_full_mass_matrix() {
    let (system, position, velocity) = spring_pair();
    let energy = |m: &Linear| {
        let (q, u) = (m.position(), m.velocity());
        let kinetic = u[0] * u[0] + 0.5 * u[0] * u[1] + 0.5 * u[1] * u[1];
        let spring = 15.0 * q[0] * q[0] - 10.0 * q[0] * q[1] + 10.0 * q[1] * q[1];
        kinetic + spring - q[0] + 2.0 * q[1]
    };
    // the exact acceleration at the start, by Cramer's rule
    let f = [1.0 - 30.0 * 0.3 - 1.0, -2.0 + 3.0 + 2.0];
    let exact = [(f[0] - 0.5 * f[1]) / 1.75, (2.0 * f[1] - 0.5 * f[0]) / 1.75];
    let errors = LADDER.map(|dt| {
        let mut model = Linear::new(system, Vec::new(), position, velocity).unwrap();
        let mut stepper = MoreauStepper::new(StepperSettings::default()).unwrap();
        assert_eq!(model.velocity().xy(), velocity.xy());
        let before = energy(&model);
        let record = stepper.step(&mut model, dt).unwrap();
        for k in 0..2 {
            let a = (model.velocity()[k] - velocity[k]) / dt;
            // the force is taken half a step later, at the velocity of the start
            assert!((a - exact[k]).abs() <= 20.0 * dt, "{a} {}", exact[k]);
        }
        let sum = record.energy.kinetic_end + record.energy.potential_end;
        assert!((sum - energy(&model)).abs() < 1e-13);
        let steps = (2.0 / dt).round() as usize;
        let mut worst: f64 = 0.0;
        for _ in 1..steps {
            stepper.step(&mut model, dt).unwrap();
            worst = worst.max((energy(&model) - before).abs());
        }
        assert_eq!((model.position().z, model.velocity().z), (0.0, 0.0));
        worst
    });
    let p = order(&errors);
    assert!((p - 2.0).abs() < 0.1, "order {p}: {errors:?}");
}

/// Other coordinates for the same mechanism, q = S r: the same gaps, impulses and energy.
#[test]
fn a_linear_model_does_not_depend_on_its_coordinates() {
    let block = load("woodpecker", &[]).linear.unwrap();
    let matrix = |rows: &[Vec<f64>]| Matrix3::from_fn(|i, j| rows[i][j]);
    let vector = |v: &Option<Vec<f64>>| Vec3::from_column_slice(v.as_ref().unwrap());
    let mirror = |m: Matrix3<f64>| Matrix3::from_fn(|i, j| m[(i.min(j), i.max(j))]);
    let toy = |s: Matrix3<f64>| {
        let back = s.try_inverse().unwrap();
        let system = LinearSystem {
            coordinates: 3,
            // symmetric to the last bit
            mass: mirror(s.transpose() * matrix(&block.mass) * s),
            stiffness: mirror(s.transpose() * matrix(block.stiffness.as_ref().unwrap()) * s),
            load: s.transpose() * vector(&block.load),
        };
        let contacts = block.contact.iter().map(|c| LinearContact {
            normal: s.transpose() * Vec3::from_column_slice(&c.normal),
            tangent: s.transpose() * vector(&c.tangent),
            gap: c.gap,
            friction: c.friction,
            restitution: c.restitution,
        });
        let (position, velocity) = (vector(&block.position), vector(&block.velocity));
        let (contacts, q, u) = (contacts.collect(), back * position, back * velocity);
        let mut model = Linear::new(system, contacts, q, u).unwrap();
        let mut stepper = MoreauStepper::new(StepperSettings {
            scheme: Scheme::Moreau,
            ..StepperSettings::default()
        })
        .unwrap();
        let records: Vec<_> = (0..2000)
            .map(|_| stepper.step(&mut model, 2e-5).unwrap())
            .collect();
        (s * model.position(), records)
    };
    let (q, records) = toy(Matrix3::identity());
    let (r, others) = toy(Matrix3::new(1.0, 0.3, 0.0, 0.0, 2.0, 0.0, -0.5, 0.0, 1.0));
    // rounding of a mass matrix of condition 1e4, over 2000 steps
    assert!((q - r).norm() < 1e-9, "{q} {r}");
    let contacts = |records: &[moreau2d::dynamics::record::StepRecord]| -> usize {
        records.iter().map(|r| r.contacts.len()).sum()
    };
    assert!(contacts(&records) > 100);
    assert_eq!(contacts(&records), contacts(&others));
}

#[test]
fn a_mass_matrix_must_be_positive_definite_and_symmetric() {
    let (system, q, u) = spring_pair();
    let with = |mass: Matrix3<f64>| Linear::new(LinearSystem { mass, ..system }, Vec::new(), q, u);
    let mut bad = system.mass;
    (bad[(0, 1)], bad[(1, 0)]) = (1.5, 1.5);
    assert!(
        with(bad)
            .unwrap_err()
            .to_string()
            .contains("positive definite")
    );
    bad[(1, 0)] = 1.4;
    assert!(with(bad).unwrap_err().to_string().contains("symmetric"));
}
