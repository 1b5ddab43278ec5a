//! The schema of a scene file: one struct for each block. [`super::keys::KEYS`] has the meaning,
//! unit, range and default of each key. Unknown keys are refused.

use super::joint::JointEntry;
use super::linear::LinearBlock;
use super::machine::Kept;
use super::outline::signed_area;
use super::wear::{Life, WearEntry};
use super::{Part, Shape};
use crate::dynamics::Effort;
use crate::dynamics::{ImpactLaw, LARGE_OVERLAP, Scheme};
use crate::oracles::SOLVERS;
use crate::solver::Shares;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

/// A whole file as written, with its defaults filled in, but not yet checked.
///
/// The blocks of a machine are only stored here; [`super::machine`] reads them.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SceneFile {
    pub scene: Header,
    #[serde(default)]
    pub gravity: Gravity,
    #[serde(default)]
    pub step: Step,
    #[serde(default)]
    pub material: Vec<Material>,
    #[serde(default)]
    pub body: Vec<BodyEntry>,
    #[serde(default)]
    pub joint: Vec<JointEntry>,
    #[serde(default)]
    pub repeat: Vec<RepeatEntry>,
    pub linear: Option<LinearBlock>,
    #[serde(skip_serializing)]
    pub tooth: Option<Kept>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wear: Vec<WearEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub life: Option<Life>,
    #[serde(skip_serializing)]
    pub study: Option<Kept>,
    #[serde(skip_serializing)]
    pub thresher: Option<Kept>,
    #[serde(skip_serializing)]
    pub reference: Option<Reference>,
    /// Read by [`super::uncertain`]: it says nothing about the scene itself.
    #[serde(default, skip_serializing)]
    pub uncertain: Option<IgnoredAny>,
    #[serde(default)]
    pub verdict: Limits,
}

/// `[scene]`: the scene's name, title and notes.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    pub name: String,
    pub title: String,
    #[serde(default)]
    pub notes: String,
}

/// `[gravity]`: either `x`, `y`, or `magnitude` with `angle` or `slope`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Gravity {
    pub x: Option<f64>,
    pub y: Option<f64>,
    pub magnitude: Option<f64>,
    pub angle: Option<f64>,
    pub slope: Option<f64>,
}

impl Gravity {
    /// Standard magnitude [m/s²].
    pub const STANDARD: f64 = 9.81;

    /// The vector [m/s²]: `(x, y)`, or `g (sin φ, −cos φ)`.
    pub fn vector(&self) -> [f64; 2] {
        let g = self.magnitude.unwrap_or(Self::STANDARD);
        if let Some(slope) = self.slope {
            let scale = g / slope.hypot(1.0);
            return [scale * slope, -scale];
        }
        if let Some(angle) = self.angle {
            return [g * angle.sin(), -g * angle.cos()];
        }
        [self.x.unwrap_or(0.0), self.y.unwrap_or(-g)]
    }
}

/// `[step]`: simulated time, step length and method.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Step {
    /// Step length \[s\], default 1/60.
    pub dt: f64,
    /// Simulated time \[s\], default 10.
    pub time: f64,
    /// Default `staggered`.
    pub scheme: Scheme,
    /// Whether impacts are located in time inside the step, default no; `staggered` only.
    pub events: bool,
    /// Law of impacts, default `capped`: Newton's law with an energy bound, so that it never adds
    /// energy.
    pub impact_law: ImpactLaw,
    /// Whether bodies that start overlapped are moved apart, default yes; `staggered` only.
    pub recovery: bool,
    /// Whether islands at rest keep their impulses until something about them changes, default yes;
    /// otherwise every step solves them.
    pub keep_rest: bool,
    /// Whether islands are solved by themselves, default yes; otherwise all of them in one problem.
    pub split_islands: bool,
    /// Whether contacts that the impulses of the others do not close are left out of the solve, default
    /// yes.
    pub skip_distant: bool,
    /// Whether contacts without friction have one row, default yes.
    pub skip_tangents: bool,
    /// Impulse distribution among redundant contacts, default `found`: the one that the solver finds.
    pub shares: Shares,
    /// How hard the impulses of large islands in motion are looked for.
    pub effort: Effort,
    /// A name of [`crate::oracles::SOLVERS`]; default the first, `auto`.
    pub solver: String,
    /// Relative natural-map residual asked of every solve, default 1e-8.
    pub tolerance: f64,
    /// Number of threads that solve islands. An option of a run, not a key of the file.
    #[serde(skip)]
    pub threads: usize,
}

impl Default for Step {
    fn default() -> Self {
        Step {
            dt: 1.0 / 60.0,
            time: 10.0,
            scheme: Scheme::default(),
            events: false,
            impact_law: ImpactLaw::default(),
            recovery: true,
            keep_rest: true,
            split_islands: true,
            skip_distant: true,
            skip_tangents: true,
            shares: Shares::default(),
            effort: Effort::default(),
            solver: SOLVERS[0].to_owned(),
            tolerance: 1e-8,
            threads: 1,
        }
    }
}

/// `[verdict]`: limits of the measures that tell whether a scene held, see
/// [`crate::experiment::Verdict`].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Largest overlap that lasts, over the size of the smaller body; default 1e-3.
    pub overlap: f64,
    /// Largest overlap at the end of any step, over the width of the thinner body; default 0.5. Beyond that
    /// the middle of the one is inside the other, and may come out on another side than it went in.
    pub deepest: f64,
    /// Largest gap of a pin or weld that lasts, over the size of the smaller body; default 1e-3.
    pub joint_gap: f64,
    /// Largest total energy that rigid contacts and joints add, over the energy of the scene;
    /// default 1e-3.
    pub energy: f64,
    /// Largest error of the energy balance of a step, over the energy of the scene; default 1e-9.
    pub imbalance: f64,
    /// Largest overlap that islands which are not certified may have added in a second, on average, over
    /// the size of the smallest moving body; default 1.
    pub bounded: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            overlap: LARGE_OVERLAP,
            deepest: 0.5,
            joint_gap: 1e-3,
            energy: 1e-3,
            imbalance: 1e-9,
            bounded: 1.0,
        }
    }
}

/// `[[material]]`: properties of the surface of a body.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    pub name: String,
    /// Coulomb's coefficient, default 0.5. Two materials combine by the mean, rapier's default.
    #[serde(default = "Material::default_friction")]
    pub friction: f64,
    /// Newton's coefficient in [0, 1], default 0.
    #[serde(default)]
    pub restitution: f64,
    /// Makes the contact visco-elastic: stiffness [N/m] of each contact. Default: rigid.
    pub stiffness: Option<f64>,
    /// Damping [N s/m] of each contact, default 0; needs `stiffness`.
    pub damping: Option<f64>,
    /// In place of `damping`: a restitution coefficient in (0, 1], to which the damping is fitted.
    pub damping_restitution: Option<f64>,
}

impl Material {
    fn default_friction() -> f64 {
        0.5
    }
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: "default".to_owned(),
            friction: Self::default_friction(),
            restitution: 0.0,
            stiffness: None,
            damping: None,
            damping_restitution: None,
        }
    }
}

/// How a body moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodyKind {
    /// Forces and impulses move it.
    #[default]
    Dynamic,
    /// It does not move.
    Fixed,
    /// It moves with its own constant `velocity` and `spin`; contacts do not change them.
    Kinematic,
}

impl BodyKind {
    /// The value of `kind` in the file.
    pub fn word(self) -> &'static str {
        match self {
            BodyKind::Dynamic => "dynamic",
            BodyKind::Fixed => "fixed",
            BodyKind::Kinematic => "kinematic",
        }
    }
}

/// `[[body]]`: exactly one of `disc`, `box`, `capsule`, `polygon`, `sector`, `polyline`, `rod`, `line`,
/// `bowl`, `parts` gives its shape.
///
/// A scene with a rod, a line or a bowl runs on closed-form geometry in `f64`, without rapier.
/// There, discs touch each other, and discs, rods and boxes touch lines and bowls. Any other pair of
/// shapes is refused, unless `touches` excludes that the two touch.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BodyEntry {
    pub name: String,
    #[serde(default)]
    pub kind: BodyKind,
    pub disc: Option<f64>,
    #[serde(rename = "box")]
    pub rectangle: Option<[f64; 2]>,
    pub capsule: Option<[f64; 2]>,
    pub polygon: Option<Vec<[f64; 2]>>,
    pub sector: Option<[f64; 3]>,
    pub polyline: Option<Vec<[f64; 2]>>,
    pub closed: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hollow: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub two_sided: Option<bool>,
    pub rod: Option<f64>,
    pub line: Option<bool>,
    pub bowl: Option<f64>,
    pub parts: Option<Vec<PartEntry>>,
    pub density: Option<f64>,
    pub mass: Option<f64>,
    pub inertia: Option<f64>,
    #[serde(default)]
    pub position: [f64; 2],
    #[serde(default)]
    pub angle: f64,
    #[serde(default)]
    pub velocity: [f64; 2],
    #[serde(default)]
    pub spin: f64,
    pub material: Option<String>,
    #[serde(default)]
    pub surface_velocity: f64,
    pub one_way: Option<[f64; 2]>,
    pub ccd: Option<bool>,
    pub gravity_scale: Option<f64>,
    pub linear_damping: Option<f64>,
    pub angular_damping: Option<f64>,
    pub oscillation: Option<Oscillation>,
    pub touches: Option<Vec<String>>,
}

/// `oscillation = { amplitude, angular_frequency }`: displaces the body by `A sin(ω t)`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Oscillation {
    /// `A` \[m\].
    pub amplitude: [f64; 2],
    /// `ω` [rad/s].
    pub angular_frequency: f64,
}

impl BodyEntry {
    /// The shape of the body: the first one if the entry has several, `None` if it has none.
    pub fn shape(&self) -> Option<Shape> {
        let polyline = |points: &Vec<_>| {
            let (mut points, closed) = (points.clone(), self.closed == Some(true));
            // whichever way it is written
            let clockwise = signed_area(&points) < 0.0;
            if closed
                && clockwise != (self.hollow == Some(true))
                && let Some(others) = points.get_mut(1..)
            {
                others.reverse();
            }
            Shape::Polyline { points, closed }
        };
        convex(
            self.disc,
            self.rectangle,
            self.capsule,
            self.polygon.as_ref(),
        )
        .or_else(|| self.sector.map(sector))
        .or_else(|| self.polyline.as_ref().map(polyline))
        .or_else(|| self.rod.map(|length| Shape::Rod { length }))
        .or_else(|| self.line.map(|_| Shape::Line))
        .or_else(|| self.bowl.map(|radius| Shape::Bowl { radius }))
        .or_else(|| self.compound())
    }

    fn compound(&self) -> Option<Shape> {
        let part = |part: &PartEntry| {
            Some(Part {
                shape: part.shape()?,
                position: part.position,
                angle: part.angle,
            })
        };
        let parts = self.parts.as_ref()?.iter().map(part);
        parts.collect::<Option<_>>().map(Shape::Compound)
    }
}

/// An element of `parts`: one of `disc`, `box`, `capsule`, `polygon` as in `[[body]]`, with its
/// position and angle in the body's frame.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PartEntry {
    pub disc: Option<f64>,
    #[serde(rename = "box")]
    pub rectangle: Option<[f64; 2]>,
    pub capsule: Option<[f64; 2]>,
    pub polygon: Option<Vec<[f64; 2]>>,
    #[serde(default)]
    pub position: [f64; 2],
    #[serde(default)]
    pub angle: f64,
}

impl PartEntry {
    fn shape(&self) -> Option<Shape> {
        convex(
            self.disc,
            self.rectangle,
            self.capsule,
            self.polygon.as_ref(),
        )
    }
}

/// The first shape given of those that a body and a part of it can have.
fn convex(
    disc: Option<f64>,
    rectangle: Option<[f64; 2]>,
    capsule: Option<[f64; 2]>,
    polygon: Option<&Vec<[f64; 2]>>,
) -> Option<Shape> {
    let rectangle = rectangle.map(|[width, height]| Shape::Box { width, height });
    let capsule = capsule.map(|[length, radius]| Shape::Capsule { length, radius });
    let polygon = polygon.map(|points| Shape::Polygon {
        points: points.clone(),
    });
    let disc = disc.map(|radius| Shape::Disc { radius });
    disc.or(rectangle).or(capsule).or(polygon)
}

/// The four corners of a voussoir, counter-clockwise. Its joint faces lie on radii; its inner and
/// outer faces are straight.
fn sector([radius, thickness, angle]: [f64; 3]) -> Shape {
    let (sin, cos) = (0.5 * angle).sin_cos();
    let (inner, outer) = (radius - 0.5 * thickness, radius + 0.5 * thickness);
    Shape::Polygon {
        points: vec![
            [inner * cos, -inner * sin],
            [outer * cos, -outer * sin],
            [outer * cos, outer * sin],
            [inner * cos, inner * sin],
        ],
    }
}

/// Mass per area [kg/m²] of a body that states neither density nor mass.
pub const DEFAULT_DENSITY: f64 = 1000.0;

/// `[[repeat]]`: copies of a body in a grid (`count`, `step`) or on a `ring`.
///
/// The body `of` is only a template and is not placed itself. The first copy of a grid is at the
/// template's position.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RepeatEntry {
    pub of: String,
    pub name: Option<String>,
    pub count: Option<Vec<u32>>,
    pub step: Option<Vec<[f64; 2]>>,
    pub shrink: Option<u32>,
    pub ring: Option<Ring>,
    pub pin: Option<[f64; 2]>,
    pub pins: Option<Vec<[f64; 2]>>,
    pub fixed: Option<Vec<Vec<u32>>>,
    #[serde(default)]
    pub jitter: f64,
    #[serde(default)]
    pub radius_spread: f64,
    pub seed: Option<u32>,
}

/// Copies evenly spaced on a circle, each rotated by its angle on the circle. On a whole circle the
/// first copy is at angle 0. An arc is divided into equal parts, with a copy in the middle of each.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    pub centre: [f64; 2],
    pub radius: f64,
    pub count: u32,
    pub arc: Option<[f64; 2]>,
}

impl Ring {
    /// Angle \[rad\] of copy `k`.
    pub fn angle(&self, k: u32) -> f64 {
        let share = |k: f64| k / f64::from(self.count);
        match self.arc {
            None => std::f64::consts::TAU * share(f64::from(k)),
            Some([from, to]) => from + (to - from) * share(f64::from(k) + 0.5),
        }
    }
}

/// `[reference]`: the closed form that the result is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    pub closed_form: ClosedForm,
}

/// The closed forms known to the code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClosedForm {
    /// The result is compared with nothing.
    None,
    // sliding
    SlidingBlock,
    Incline,
    SpinningDisc,
    Conveyor,
    // impacts
    BouncingBall,
    TwoBalls,
    Cradle,
    TouchingBalls,
    ElasticGas,
    // statics
    Beam,
    ThreeDiscs,
    Ladder,
    BlockOnSlope,
    Wedge,
    Arch,
    Capstan,
    // motion about a pivot
    RockingBlock,
    Pendulum,
    StuckRod,
    FallingRod,
    Painleve,
    // on curves and moving surfaces
    Bowl,
    RidingDisc,
    // mechanisms
    Woodpecker,
}
