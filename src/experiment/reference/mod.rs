//! Closed forms, and the errors of a run against them. Their parameters come from the scene.
//!
//! Each file covers one kind of mechanics. Each function finds the bodies that it needs by their
//! names in the scene. A *verdict* (does the structure hold?) is a measure too: the distance moved by
//! a body that must stay in place, or the distance still missing for a body that must move.

mod arcs;
mod event_driven;
mod impact;
mod joints;
mod motion;
mod rocking;
mod rods;
mod samples;
mod sliding;
mod statics;
mod woodpecker;

pub use samples::Samples;

use crate::scene::{ClosedForm, Scene};

/// What the difference of two runs in a measure is divided by. It never depends on the closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// The value itself.
    Value,
    /// A value that the scene gives, in the unit of `computed`, such as the speed of a striker.
    Given(f64),
    /// A length, an energy or 1 rad, by the unit of the measure.
    Unit,
    /// The measure is a distance from the exact motion: two runs are compared by their trajectories.
    Motion,
}

/// One value of a run compared with the exact one.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Measure {
    pub name: &'static str,
    /// Unit of `error`; "1" for a relative error.
    pub unit: &'static str,
    pub computed: f64,
    pub exact: f64,
    /// `|computed/exact − 1|` of a relative error, else `|computed − exact|`.
    pub error: f64,
    #[serde(skip)]
    pub size: Size,
}

impl Measure {
    pub(super) fn relative(name: &'static str, computed: f64, exact: f64) -> Measure {
        Measure {
            name,
            unit: "1",
            computed,
            exact,
            error: (computed / exact - 1.0).abs(),
            size: Size::Value,
        }
    }

    /// An error relative to `size`, which is not the exact value: that may be 0.
    pub(super) fn over(name: &'static str, computed: f64, exact: f64, size: f64) -> Measure {
        Measure {
            name,
            unit: "1",
            computed,
            exact,
            error: (computed - exact).abs() / size,
            size: Size::Given(size),
        }
    }

    /// The same error where `computed` is found with the help of the exact motion.
    pub(super) fn of_motion(self) -> Measure {
        Measure {
            size: Size::Motion,
            ..self
        }
    }

    pub(super) fn absolute(
        name: &'static str,
        unit: &'static str,
        computed: f64,
        exact: f64,
    ) -> Measure {
        Measure {
            name,
            unit,
            computed,
            exact,
            error: (computed - exact).abs(),
            size: Size::Unit,
        }
    }

    /// Measures whether a body stays in place as it must. `motion` \[m\] is the distance that it
    /// moved.
    ///
    /// If the body must `hold`, the measure is `creep` and its error is `motion`. If it must move, the
    /// measure is `standing` and its error is the part of the distance `least` \[m\] that is still
    /// missing at the end.
    pub(super) fn verdict(hold: bool, motion: f64, least: f64) -> Measure {
        let (name, exact) = if hold {
            ("creep", 0.0)
        } else {
            ("standing", least)
        };
        Measure {
            name,
            unit: "m",
            computed: motion,
            exact,
            error: if hold {
                motion
            } else {
                (least - motion).max(0.0)
            },
            size: Size::Unit,
        }
    }
}

/// Errors of a run against the scene's closed form. Empty if the scene names no closed form, or if
/// the run ends before the measured event.
pub fn measures(scene: &Scene, samples: &Samples) -> Vec<Measure> {
    let Some(form) = scene.reference else {
        return Vec::new();
    };
    let measures = match form {
        ClosedForm::None => return Vec::new(),
        ClosedForm::SlidingBlock => sliding::sliding_block,
        ClosedForm::Incline => sliding::incline,
        ClosedForm::SpinningDisc => sliding::spinning_disc,
        ClosedForm::Conveyor => sliding::conveyor,
        ClosedForm::BouncingBall => impact::bouncing_ball,
        ClosedForm::TwoBalls => impact::two_balls,
        ClosedForm::Cradle => impact::cradle,
        ClosedForm::TouchingBalls => impact::touching_balls,
        ClosedForm::ElasticGas => impact::elastic_gas,
        ClosedForm::Beam => statics::beam,
        ClosedForm::ThreeDiscs => statics::three_discs,
        ClosedForm::Ladder => statics::ladder,
        ClosedForm::BlockOnSlope => statics::block_on_slope,
        ClosedForm::Wedge => statics::wedge,
        ClosedForm::Arch => statics::arch,
        ClosedForm::Capstan => statics::capstan,
        ClosedForm::RockingBlock => rocking::rocking_block,
        ClosedForm::Pendulum => joints::pendulum,
        ClosedForm::StuckRod => rods::stuck_rod,
        ClosedForm::FallingRod => rods::falling_rod,
        ClosedForm::Painleve => rods::painleve,
        ClosedForm::Bowl => arcs::bowl,
        ClosedForm::RidingDisc => arcs::riding_disc,
        ClosedForm::Woodpecker => woodpecker::woodpecker,
    };
    measures(scene, samples)
}

fn find(scene: &Scene, name: &str) -> Option<usize> {
    scene.bodies.iter().position(|b| b.name == name)
}

/// Friction coefficient of two bodies: the mean of both, rapier's rule.
fn friction(scene: &Scene, a: usize, b: usize) -> f64 {
    let of = |k: usize| scene.materials[scene.bodies[k].material].friction;
    0.5 * (of(a) + of(b))
}

fn restitution(scene: &Scene, a: usize, b: usize) -> f64 {
    let of = |k: usize| scene.materials[scene.bodies[k].material].restitution;
    0.5 * (of(a) + of(b))
}

fn down(scene: &Scene) -> f64 {
    -scene.gravity[1]
}

/// Mass \[kg\] of a dynamic body.
fn mass(scene: &Scene, k: usize) -> Option<f64> {
    Some(scene.bodies[k].mass_and_inertia()?.0)
}

/// Moment of inertia about the centre of mass [kg m²] of a dynamic body.
fn inertia(scene: &Scene, k: usize) -> Option<f64> {
    Some(scene.bodies[k].mass_and_inertia()?.1)
}
