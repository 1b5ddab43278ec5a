//! Closed forms, and the errors of a run against them. Their parameters come from the scene.
//!
//! One file per kind of mechanics. Each function finds the bodies it needs by their names in the
//! scene. A *verdict* (does it hold?) is a measure too: the distance moved by a body that must hold,
//! or the distance missing for a body that must move.

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

/// One value of a run compared with the exact one.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Measure {
    pub name: &'static str,
    /// Of `error`: "1" for a relative one.
    pub unit: &'static str,
    pub computed: f64,
    pub exact: f64,
    /// `|computed/exact − 1|`, or `|computed − exact|` where the unit is not "1".
    pub error: f64,
}

impl Measure {
    pub(super) fn relative(name: &'static str, computed: f64, exact: f64) -> Measure {
        Measure {
            name,
            unit: "1",
            computed,
            exact,
            error: (computed / exact - 1.0).abs(),
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
        }
    }

    /// Whether something holds: `creep` \[m\], how far it moved, if it must `hold`; else `standing`
    /// \[m\], what is missing of the way `least` that it must have gone by the end.
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
        }
    }
}

/// Errors of a run against the scene's closed form; empty where the scene names none or the run
/// is too short to show it.
pub fn measures(scene: &Scene, samples: &Samples) -> Vec<Measure> {
    let Some(form) = scene.reference else {
        return Vec::new();
    };
    let measures = match form {
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

/// Mean friction of a body with the floor, rapier's rule.
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
