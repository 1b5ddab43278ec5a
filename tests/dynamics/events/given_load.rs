//! A load without friction ties the bodies of an event together.

use super::ROUND_OFF;
use moreau2d::contact::{NO_BODY, Rows, Vec2, Vec3};
use moreau2d::dynamics::{
    Configuration, ContactKey, ContactPoint, Detection, ModelError, MoreauStepper, MultibodyModel,
    NormalLaw, StepperSettings,
};

/// A carriage and a slider on a line: a given force between them, no friction, and a wall ahead of
/// the slider.
struct Press {
    places: [f64; 2],
    velocities: [Vec3; 2],
}

impl MultibodyModel for Press {
    fn velocities(&self) -> &[Vec3] {
        &self.velocities
    }
    fn set_velocities(&mut self, velocities: &[Vec3]) {
        self.velocities.copy_from_slice(velocities);
    }
    fn inverse_mass(&self) -> &[Vec3] {
        const ONE_COORDINATE: Vec3 = Vec3::new(1.0, 0.0, 0.0);
        &[ONE_COORDINATE; 2]
    }
    fn forces(&self, _time: f64, _out: &mut [Vec3]) {}
    fn shift(&mut self, body: usize, velocity: &Vec3, dt: f64) {
        self.places[body] += velocity.x * dt;
    }
    fn configuration(&self, body: usize) -> Configuration {
        [self.places[body], 0.0, 0.0, 0.0, 0.0]
    }
    fn set_configuration(&mut self, body: usize, configuration: &Configuration) {
        self.places[body] = configuration[0];
    }
    fn detect(&mut self, _dt: f64, out: &mut Detection) -> Result<(), ModelError> {
        let wall = NormalLaw::Rigid { restitution: 0.5 };
        let all = [
            ([0, 1], [-1.0, 1.0], 0.0, NormalLaw::Load { force: 3.0 }),
            ([NO_BODY, 1], [0.0, -1.0], 1.0 - self.places[1], wall),
        ];
        for (k, (bodies, signs, gap, law)) in all.into_iter().enumerate() {
            out.contacts.push(ContactPoint {
                key: ContactKey {
                    pair: k as u64,
                    feature: 0,
                },
                rows: Rows {
                    bodies,
                    jacobian: signs.map(|s| [Vec3::new(s, 0.0, 0.0), Vec3::zeros()]),
                },
                bodies,
                surfaces: [0, k as u32],
                places: Default::default(),
                position: Vec2::zeros(),
                normal: Vec2::x(),
                gap,
                gap_noise: 0.0,
                radii: [0.0; 2],
                rolls_on: [0.0; 2],
                friction: 0.0,
                law,
                surface_velocity: 0.0,
            });
        }
        Ok(())
    }
}

/// Bug: a given load without friction has no impulse of its own to be solved for, and did not tie
/// its bodies together: one of them lost it when an event was located at the other.
#[test]
fn a_given_load_acts_on_both_sides_of_an_event() {
    let mut press = Press {
        places: [0.0, 0.9],
        velocities: [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)],
    };
    let mut stepper = MoreauStepper::new(StepperSettings {
        events: true,
        ..StepperSettings::default()
    })
    .unwrap();
    let dt = 0.1;
    let record = stepper.step(&mut press, dt).unwrap();
    assert_eq!(record.events, 1);
    // the wall is reached when 2 t + 3 t²/2 = 0.1
    let hit = (4.6f64.sqrt() - 2.0) / 3.0;
    let speed = -0.5 * (2.0 + 3.0 * hit) + 3.0 * (dt - hit);
    let [carriage, slider] = press.velocities;
    assert!((carriage.x + 3.0 * dt).abs() <= ROUND_OFF, "{carriage:?}");
    assert!((slider.x - speed).abs() <= ROUND_OFF, "{slider:?} {speed}");
    assert!(record.energy.imbalance().abs() <= ROUND_OFF);
}
