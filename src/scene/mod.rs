//! Scenes: the file, its checks, the catalogue.
//!
//! A scene file is TOML, in SI units and radians (degrees where a key ends in `_deg`). Short files
//! are wanted: only what differs from the defaults. All keys are listed below, those of the
//! threshing machine at [`Tooth`], [`Wear`], [`Study`] and [`Thresher`].
//!
//! ```
//! let scene = moreau2d::scene::Scene::parse(
//!     "ball.toml",
//!     r#"
//!     [scene]
//!     name = "ball"
//!     title = "A ball above a floor"
//!     [[body]]
//!     name = "floor"
//!     kind = "fixed"
//!     box = [10, 1]
//!     position = [0, -0.5]
//!     [[body]]
//!     name = "ball"
//!     disc = 0.5
//!     position = [0, 1.5]
//!     "#,
//!     &["body.ball.disc=0.25".to_owned()],
//! )?;
//! assert_eq!(scene.bodies[1].shape, moreau2d::scene::Shape::Disc { radius: 0.25 });
//! # Ok::<(), moreau2d::scene::SceneError>(())
//! ```
//!
//! # Keys
#![doc = include_str!("keys.md")]

mod build;
mod catalogue;
mod check;
mod document;
mod error;
mod expand;
mod file;
mod hash;
mod joint;
pub mod keys;
mod linear;
mod outline;
mod overlap;
mod overrides;
mod planar;
mod reader;
pub mod study;
pub mod thresher;
pub mod threshing;
mod threshing_shapes;
mod time_scales;
mod world;
mod written;

pub use crate::dynamics::{ImpactLaw, Scheme};
pub use catalogue::{Listing, load, scenes};
pub use error::{Hint, Origin, Place, SceneError};
pub use file::{BodyKind, ClosedForm, Material, Oscillation, Step};
pub use joint::{Joint, JointKind, Motor};
pub use linear::LinearBlock;
pub use study::{Calibration, Limit, Reading, Shares, Study, Tooth, Update, Wear};
pub use thresher::{ConcaveSetting, Thresher};
pub use world::Built;
pub use written::Written;

use document::Document;
use file::{BodyEntry, DEFAULT_DENSITY, SceneFile};

/// A scene that was read, checked and expanded: every number is finite and in its range, every
/// name resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    pub name: String,
    /// One line: what the scene shows.
    pub title: String,
    pub notes: String,
    /// [m/s²]
    pub gravity: [f64; 2],
    pub step: Step,
    /// At least one.
    pub materials: Vec<Material>,
    /// Every body placed, repeats expanded, in a fixed order. Empty with a study or thresher.
    pub bodies: Vec<Body>,
    pub joints: Vec<Joint>,
    /// A mechanism in place of bodies.
    pub linear: Option<LinearBlock>,
    /// The closed form that the result is compared with.
    pub reference: Option<ClosedForm>,
    /// There whenever a study or thresher is.
    pub tooth: Option<Tooth>,
    /// There whenever a study is, and where the file has the block.
    pub wear: Option<Wear>,
    pub study: Option<Study>,
    pub thresher: Option<Thresher>,
    /// FNV-1a (64 bits) of the resolved file without title and notes, see [`Scene::parse`].
    pub hash: u64,
    /// What the file and its flags set, save of bodies, joints and mechanisms.
    pub written: Vec<Written>,
    /// Each flag of [`Scene::parse`] with the whole path of the key that it sets.
    pub changes: Vec<(String, String)>,
}

/// A body and where it starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Unique: the file's, or `name[column,row]` and `name[k]` of a copy.
    pub name: String,
    pub kind: BodyKind,
    pub shape: Shape,
    /// `None` unless the body is dynamic.
    pub mass: Option<Mass>,
    /// Of the body's origin \[m\], and its angle \[rad\].
    pub position: [f64; 2],
    pub angle: f64,
    /// [m/s] and [rad/s]; constant for a kinematic body.
    pub velocity: [f64; 2],
    pub spin: f64,
    /// Index into [`Scene::materials`].
    pub material: usize,
    /// [m/s], positive counter-clockwise round the body.
    pub surface_velocity: f64,
    /// Direction in its frame in which its surface pushes; `None` all round.
    pub one_way: Option<[f64; 2]>,
    /// Share of the weight it feels.
    pub gravity_scale: f64,
    /// Drag on velocity and spin [1/s].
    pub damping: [f64; 2],
    pub oscillation: Option<Oscillation>,
    /// Indices of the bodies it may touch; `None` is all.
    pub touches: Option<Vec<usize>>,
}

/// What the bodies of a scene are built on: no more than it needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// A rapier world: any shape of the file but rods, lines and bowls.
    Rapier,
    /// [`crate::dynamics::Planar`]: closed-form geometry in `f64`.
    Planar,
    /// [`crate::dynamics::Linear`]: constant matrices and levers.
    Linear,
}

impl Model {
    /// The word of the summary.
    pub fn word(self) -> &'static str {
        match self {
            Model::Rapier => "rapier",
            Model::Planar => "planar",
            Model::Linear => "linear",
        }
    }
}

/// A shape in the body's frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Radius \[m\].
    Disc { radius: f64 },
    /// Full width and height \[m\].
    Box { width: f64, height: f64 },
    /// Length \[m\] between the centres of the round ends, along x.
    Capsule { length: f64, radius: f64 },
    /// Convex, counter-clockwise \[m\].
    Polygon { points: Vec<[f64; 2]> },
    /// One-sided, the solid on the left of its direction \[m\].
    Polyline { points: Vec<[f64; 2]>, closed: bool },
    /// Along x, without width \[m\].
    Rod { length: f64 },
    /// The x axis without end, the solid below it.
    Line,
    /// A circle \[m\] that is touched from inside.
    Bowl { radius: f64 },
    /// Several at once, none of them a compound or planar only.
    Compound(Vec<Part>),
}

/// A shape at its place in the body's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    pub shape: Shape,
    /// \[m\] and \[rad\].
    pub position: [f64; 2],
    pub angle: f64,
}

impl Shape {
    /// Whether rapier has not the shape: its scene runs on [`Model::Planar`].
    pub fn planar_only(&self) -> bool {
        matches!(self, Shape::Rod { .. } | Shape::Line | Shape::Bowl { .. })
    }
}

/// Where a body's inertia comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mass {
    /// Mass per area [kg/m²].
    Density(f64),
    /// Mass \[kg\] and moment of inertia about the centre of mass [kg m²]; without the latter the
    /// mass is spread evenly.
    Given { mass: f64, inertia: Option<f64> },
}

impl Scene {
    /// Reads a scene from its text.
    ///
    /// # Arguments
    /// - `file`: what errors call the text.
    /// - `flags`: `key=value` changes, made in order before anything is checked. The key is a
    ///   dotted path (`step.dt`, `body.ball.position.0`, `material.0.friction`: elements of
    ///   arrays of tables by name or by number from 0), or a bare key that only one block has
    ///   (`reading`). The value is TOML; what is not TOML is taken as a string.
    ///
    /// # Returns
    /// The scene. Its `hash` is FNV-1a (Fowler, Noll & Vo; 64 bits) over the JSON of the file
    /// with flags applied and defaults filled in, title and notes left out: the same for files
    /// that differ in comments, order of keys or stated defaults only. It tells runs apart; it is
    /// not cryptographic, and it changes when a release adds a key.
    ///
    /// # Errors
    /// Every variant of [`SceneError`] but `UnknownScene` and `Read`.
    pub fn parse(file: &str, text: &str, flags: &[String]) -> Result<Scene, SceneError> {
        let mut document = Document::parse(file, text)?;
        let changes = overrides::apply(&mut document, flags)?;
        let read: SceneFile = reader::read(&document)?;
        check::check(&read, &document)?;
        let hash = hash::of(&read);
        let mut scene = resolve(read, &document, hash)?;
        scene.changes = changes;
        Ok(scene)
    }
}

impl Scene {
    /// What the scene is built on.
    pub fn model(&self) -> Model {
        if self.linear.is_some() {
            Model::Linear
        } else if self.bodies.iter().any(|b| b.shape.planar_only()) {
            Model::Planar
        } else {
            Model::Rapier
        }
    }
}

fn resolve(file: SceneFile, document: &Document, hash: u64) -> Result<Scene, SceneError> {
    let placed = expand::expand(&file.body, &file.repeat);
    let mut tied = file.joint;
    tied.extend(expand::pins(&file.body, &file.repeat));
    let joints = check::joints(&tied, &placed, document)?;
    let touches = check::touches(&placed, document)?;
    let mut materials = file.material;
    if materials.is_empty() {
        materials.push(Material::default());
    }
    let mut bodies = placed
        .into_iter()
        .map(|body| resolve_body(body, &materials, document))
        .collect::<Result<Vec<_>, _>>()?;
    for (body, touches) in bodies.iter_mut().zip(touches) {
        body.touches = touches;
    }
    check::planar(&bodies, &joints, document)?;
    let model = file.study.is_some() || file.thresher.is_some();
    let scene = Scene {
        name: file.scene.name,
        title: file.scene.title,
        notes: file.scene.notes,
        gravity: file.gravity.vector(),
        step: file.step,
        materials,
        bodies,
        joints,
        linear: file.linear,
        reference: file.reference.map(|reference| reference.closed_form),
        tooth: file.tooth.or(model.then(Tooth::default)),
        wear: file.wear.or(file.study.is_some().then(Wear::default)),
        study: file.study,
        thresher: file.thresher,
        hash,
        written: written::keys(document),
        changes: Vec::new(),
    };
    check::starts(&scene, document)?;
    Ok(scene)
}

fn resolve_body(
    entry: BodyEntry,
    materials: &[Material],
    document: &Document,
) -> Result<Body, SceneError> {
    // The checks have seen to it that there is a shape and that the material's name is known.
    let shape = entry.shape().ok_or_else(|| SceneError::Missing {
        at: document.place(&[]),
        key: format!("a shape of body {}", entry.name),
    })?;
    let named = |name: &String| materials.iter().position(|m| m.name == *name);
    Ok(Body {
        shape,
        mass: (entry.kind == BodyKind::Dynamic).then(|| match entry.mass {
            Some(mass) => Mass::Given {
                mass,
                inertia: entry.inertia,
            },
            None => Mass::Density(entry.density.unwrap_or(DEFAULT_DENSITY)),
        }),
        material: entry.material.as_ref().and_then(named).unwrap_or(0),
        name: entry.name,
        kind: entry.kind,
        position: entry.position,
        angle: entry.angle,
        velocity: entry.velocity,
        spin: entry.spin,
        surface_velocity: entry.surface_velocity,
        one_way: entry.one_way,
        gravity_scale: entry.gravity_scale.unwrap_or(1.0),
        damping: [entry.linear_damping, entry.angular_damping].map(|d| d.unwrap_or(0.0)),
        oscillation: entry.oscillation,
        touches: None,
    })
}

#[cfg(test)]
mod tests;
