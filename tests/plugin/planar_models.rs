//! The planar model: rows against gaps, states put back, and short cuts that change nothing.

use crate::common::Random;
use moreau2d::contact::{Vec2, Vec3};
use moreau2d::dynamics::{
    Configuration, Detection, JointKind, ModelError, MoreauStepper, MultibodyModel, Pose64,
    StepperSettings,
};
use moreau2d::models::{Oscillation, Pivot, Planar, PlanarBody, PlanarShape, RotorMotor};

/// Bodies of every shape that meet in every way, and two pivots with a motor.
fn menagerie(random: &mut Random) -> Planar {
    let body = |random: &mut Random, shape, mass| PlanarBody {
        shape,
        mass,
        pose: Pose64::new(
            Vec2::new(random.between(-0.3, 0.3), random.between(-0.3, 0.3)),
            random.between(-3.0, 3.0),
        ),
        velocity: Vec3::from_fn(|_, _| random.between(-1.0, 1.0)),
        oscillation: None,
        friction: 0.5,
        restitution: 0.0,
        surface_velocity: 0.0,
    };
    let mass = Some((2.0, 0.3));
    let half = Vec2::new(0.2, 0.1);
    let mut bodies = vec![
        body(random, PlanarShape::Line, None),
        body(random, PlanarShape::Bowl { radius: 2.0 }, None),
        body(random, PlanarShape::Disc { radius: 0.2 }, mass),
        body(random, PlanarShape::Disc { radius: 0.3 }, mass),
        body(random, PlanarShape::Rod { length: 0.5 }, mass),
        body(random, PlanarShape::Box { half }, mass),
    ];
    bodies[0].oscillation = Some(Oscillation {
        amplitude: Vec2::new(0.1, 0.2),
        angular_frequency: 7.0,
    });
    let pivot = |bodies| Pivot {
        bodies,
        anchors: [Vec2::new(0.1, -0.2), Vec2::new(0.3, 0.1)],
        motor: Some(RotorMotor {
            speed: 1.0,
            max_torque: 1.0,
        }),
    };
    let apart = [[2, 4], [2, 5], [3, 4], [3, 5], [4, 5]];
    let pivots = vec![pivot([None, Some(2)]), pivot([Some(4), Some(5)])];
    Planar::new(Vec2::new(0.0, -9.81), bodies, pivots, &apart).unwrap()
}

fn detected(model: &mut Planar) -> Detection {
    let mut out = Detection::default();
    // a step so long that nothing is out of reach
    model.detect(10.0, &mut out).unwrap();
    out
}

/// A model that says no more than it must: no short cut of its own.
struct Plain(Planar);

impl MultibodyModel for Plain {
    fn begin_step(&mut self, dt: f64) -> Result<(), ModelError> {
        self.0.begin_step(dt)
    }
    fn velocities(&self) -> &[Vec3] {
        self.0.velocities()
    }
    fn set_velocities(&mut self, velocities: &[Vec3]) {
        self.0.set_velocities(velocities);
    }
    fn inverse_mass(&self) -> &[Vec3] {
        self.0.inverse_mass()
    }
    fn forces(&self, time: f64, out: &mut [Vec3]) {
        self.0.forces(time, out);
    }
    fn shift(&mut self, body: usize, velocity: &Vec3, dt: f64) {
        self.0.shift(body, velocity, dt);
    }
    fn configuration(&self, body: usize) -> Configuration {
        self.0.configuration(body)
    }
    fn centre(&self, body: usize) -> Option<Vec2> {
        self.0.centre(body)
    }
    fn set_configuration(&mut self, body: usize, configuration: &Configuration) {
        self.0.set_configuration(body, configuration);
    }
    fn detect(&mut self, dt: f64, out: &mut Detection) -> Result<(), ModelError> {
        self.0.detect(dt, out)
    }
    fn potential_energy(&self) -> f64 {
        self.0.potential_energy()
    }
    fn end_step(&mut self) {
        self.0.end_step();
    }
}

/// Impacts are located, and pivots that start apart are closed: both look at parts of a detection.
#[test]
fn short_cuts_of_a_model_change_nothing() {
    let settings = StepperSettings {
        events: true,
        ..StepperSettings::default()
    };
    let mut random = Random(11);
    let mut events = 0;
    for _ in 0..10 {
        let short = menagerie(&mut random);
        let (mut plain, mut short) = (Plain(short.clone()), short);
        let mut steppers = [0, 1].map(|_| MoreauStepper::new(settings.clone()).unwrap());
        for step in 0..40 {
            let own = steppers[0].step(&mut short, 0.01).unwrap();
            let full = steppers[1].step(&mut plain, 0.01).unwrap();
            assert_eq!(format!("{own:?}"), format!("{full:?}"), "step {step}");
            assert!(own.joints.len() >= 4);
            events += own.events;
        }
        assert_eq!(short.velocities(), plain.velocities());
    }
    assert!(events > 0);
}

/// Normals, levers and pivots in one: the rows are the derivative of the gap.
#[test]
fn rows_are_the_rate_of_the_gap() {
    let mut random = Random(7);
    for _ in 0..50 {
        let mut model = menagerie(&mut random);
        let here = detected(&mut model);
        // line: 2 discs, 2 ends, 4 corners; the same in the bowl; disc on disc
        assert_eq!((here.contacts.len(), here.joints.len()), (17, 4));
        for body in 0..6 {
            let velocity = Vec3::from_fn(|_, _| random.between(-1.0, 1.0));
            let mut moved = vec![Vec3::zeros(); 6];
            moved[body] = velocity;
            let h = 1e-6;
            let place = model.configuration(body);
            let [before, after] = [-h, h].map(|dt| {
                model.shift(body, &velocity, dt);
                let found = detected(&mut model);
                model.set_configuration(body, &place);
                found
            });
            // central differences: h² times a third derivative of order 10, and 1e-16/h
            for ((a, b), c) in before
                .contacts
                .iter()
                .zip(&after.contacts)
                .zip(&here.contacts)
            {
                assert_eq!((a.key, b.key), (c.key, c.key));
                let rate = (b.gap - a.gap) / (2.0 * h);
                let row = c.rows.velocity(&moved).x;
                assert!((rate - row).abs() < 1e-8, "{:?}: {rate} {row}", c.key);
                assert!((c.normal.norm() - 1.0).abs() < 1e-15);
            }
            for ((a, b), c) in before.joints.iter().zip(&after.joints).zip(&here.joints) {
                let (JointKind::Pin { gap: a }, JointKind::Pin { gap: b }) = (a.kind, b.kind)
                else {
                    continue;
                };
                let rate = (b - a) / (2.0 * h);
                assert!((rate - c.rows.velocity(&moved)).norm() < 1e-8);
            }
        }
    }
}

#[test]
fn bodies_are_put_back_bit_for_bit() {
    let mut random = Random(3);
    let mut model = menagerie(&mut random);
    for _ in 0..20 {
        model.begin_step(0.01).unwrap();
        model.advance(0.01);
        let places: Vec<_> = (0..6).map(|body| model.configuration(body)).collect();
        let marked = detected(&mut model);
        model.advance(0.003);
        for (body, place) in places.iter().enumerate() {
            model.shift(body, &Vec3::new(0.1, -0.3, 2.0), 0.7);
            model.set_configuration(body, place);
        }
        assert_eq!(detected(&mut model).contacts, marked.contacts);
        // time goes back as well: the plate is again where it was a moment later
        model.advance(0.002);
        let later = model.pose(0).unwrap();
        (0..6).for_each(|body| model.set_configuration(body, &places[body]));
        model.advance(0.002);
        assert_eq!(model.pose(0).unwrap(), later);
    }
}

/// Moved by hand, a body without mass that swings by itself moves as told; with its own velocity
/// it follows its path whatever the pieces of time.
#[test]
fn a_swinging_plate_follows_its_path() {
    let mut model = menagerie(&mut Random(1));
    let start = model.pose(0).unwrap().translation;
    let drift = model.velocity(0).unwrap().xy() - Vec2::new(0.1, 0.2) * 7.0;
    model.begin_step(0.1).unwrap();
    for piece in [0.03, 0.05, 0.02] {
        model.advance(piece);
    }
    let exact = start + drift * 0.1 + Vec2::new(0.1, 0.2) * 0.7f64.sin();
    assert!((model.pose(0).unwrap().translation - exact).norm() < 1e-15);
    model.shift(0, &Vec3::zeros(), 1.0);
    assert!((model.pose(0).unwrap().translation - exact).norm() < 1e-15);
}
