//! Scenes: the scene file, its checks, and the catalogue.
//!
//! A scene file is TOML, in SI units and radians (degrees in keys of a machine that end in
//! `_deg`). It needs only the keys that differ from the defaults. All keys are listed below; [`crate::thresher`] lists the
//! keys of the four blocks of a machine, which it reads. `[[wear]]`, of which there may be several, lets
//! bodies wear ([`crate::guide::pin_on_disc`]); `[wear]` is a machine's. `[uncertain]` says within which bounds
//! keys are known ([`crate::guide::uncertain_lives`]).
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

pub mod atlas;
mod build;
mod catalogue;
mod check;
mod convex;
mod crossing;
mod document;
mod error;
mod expand;
mod file;
mod generate;
mod hash;
mod issues;
mod joint;
pub mod keys;
mod lasting;
mod linear;
mod machine;
mod outline;
mod overlap;
mod overrides;
mod passing;
pub mod plan;
mod planar;
pub(crate) mod random;
mod reader;
mod sides;
mod slabs;
mod starts;
mod time_scales;
mod uncertain;
mod wear;
mod world;
mod written;

pub use lasting::Deepest;
pub(crate) use lasting::SlidingLeast;

pub use crate::dynamics::{ImpactLaw, LASTING, Scheme};
pub use atlas::{AtlasEntry, atlas_entries};
pub use catalogue::{Listing, load, load_machine, scenes};
pub use check::{At, Range, distinct, range};
pub use error::{Hint, Origin, Place, SceneError};
pub use file::{BodyKind, ClosedForm, Limits, Material, Oscillation, Step};
pub use hash::fnv1a;
pub use issues::{Issue, issue_entries};
pub use joint::{Joint, JointKind, Motor};
pub use linear::LinearBlock;
pub use overlap::Measured;
pub use time_scales::Motion;
pub use uncertain::{Uncertain, Variant};
pub use wear::{Life, Wear};
pub use world::Built;
pub use written::Written;

use document::Document;
use file::{BodyEntry, DEFAULT_DENSITY, SceneFile};
use machine::NoMachine;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A scene that was read, checked and expanded. Every number is finite and in its range, and every
/// name is resolved.
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
    /// All bodies, repeats expanded, in a fixed order. Empty if a machine makes its own.
    pub bodies: Vec<Body>,
    pub joints: Vec<Joint>,
    /// Bodies that wear, and for how long; either both or none.
    pub wear: Vec<Wear>,
    pub life: Option<Life>,
    /// Keys whose values are known within bounds only.
    pub uncertain: Vec<Uncertain>,
    /// A mechanism in place of bodies.
    pub linear: Option<LinearBlock>,
    /// The closed form that the result is compared with.
    pub reference: Option<ClosedForm>,
    /// Up to where the scene held.
    pub limits: Limits,
    /// FNV-1a (64 bits) of the resolved file without title and notes, see [`Scene::parse`].
    pub hash: u64,
    /// The keys that the file and the flags set, without those of bodies, joints and mechanisms.
    pub written: Vec<Written>,
    /// Each flag of [`Scene::parse`] with the full path of the key that it sets.
    pub changes: Vec<(String, String)>,
}

/// A body and its initial state.
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
    /// The only direction in its frame in which its surface pushes; `None` for all directions.
    pub one_way: Option<[f64; 2]>,
    /// Whether its polyline touches from both sides.
    pub two_sided: bool,
    /// Whether the times of all its impacts are located, as rapier's `ccd_enabled` asks.
    pub ccd: bool,
    /// Factor on its weight.
    pub gravity_scale: f64,
    /// Drag on velocity and spin [1/s].
    pub damping: [f64; 2],
    pub oscillation: Option<Oscillation>,
    /// Indices of the bodies it may touch; `None` is all.
    pub touches: Option<Vec<usize>>,
}

/// The model on which a scene is built: the simplest that represents it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// A rapier world: all shapes except rods, lines and bowls.
    Rapier,
    /// [`crate::models::Planar`]: closed-form geometry in `f64`.
    Planar,
    /// [`crate::models::Linear`]: constant matrices and levers.
    Linear,
}

impl Model {
    /// The name in `summary.json`.
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
    /// A circle of this radius \[m\], touched from inside.
    Bowl { radius: f64 },
    /// Several shapes, none of them a compound, rod, line or bowl.
    Compound(Vec<Part>),
}

/// A shape at a position and angle in the body's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    pub shape: Shape,
    /// \[m\] and \[rad\].
    pub position: [f64; 2],
    pub angle: f64,
}

impl Shape {
    /// Whether rapier lacks the shape, so that its scene is built on [`Model::Planar`].
    pub fn planar_only(&self) -> bool {
        matches!(self, Shape::Rod { .. } | Shape::Line | Shape::Bowl { .. })
    }
}

/// How mass and inertia of a body are given.
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
    /// - `file`: the file name for errors.
    /// - `flags`: `key=value` changes, applied in order before the checks. The key is a
    ///   dotted path (`step.dt`, `body.ball.position.0`, `material.0.friction`: elements of
    ///   arrays of tables by name or by number from 0), or a bare key that only one block has
    ///   (`reading`). The value is TOML; what is not TOML is taken as a string.
    ///
    /// # Returns
    /// The scene. Its `hash` is FNV-1a (Fowler, Noll & Vo; 64 bits) over the JSON of the file
    /// with flags applied and defaults filled in, title and notes left out: the same for files
    /// that differ in comments, order of keys or stated defaults only. It distinguishes runs. It is
    /// not cryptographic, and it changes when a release adds a key.
    ///
    /// # Errors
    /// Every variant of [`SceneError`] but `UnknownScene` and `Read`. A file with the blocks of a
    /// machine is refused: read it with [`Scene::parse_machine`].
    pub fn parse(file: &str, text: &str, flags: &[String]) -> Result<Scene, SceneError> {
        Scene::of(Document::parse(file, text)?, flags)
    }

    /// See [`Scene::parse`].
    fn of(document: Document, flags: &[String]) -> Result<Scene, SceneError> {
        let (scene, NoMachine { .. }) = Scene::with_machine(document, flags, machine::refuse)?;
        Ok(scene)
    }

    /// Reads a scene that may hold a machine. The caller defines the blocks `[tooth]`, `[wear]`,
    /// `[study]` and `[thresher]`; this module only knows their names.
    ///
    /// # Arguments
    /// - `file`, `text`, `flags`: those of [`Scene::parse`].
    /// - `check`: checks the ranges of the machine's values. It is called after all other checks,
    ///   with the top of the file.
    /// - `M`: a struct of the four blocks in this order, each an `Option`.
    ///
    /// # Returns
    /// The scene, its hash that of the whole file, and the machine's blocks.
    ///
    /// # Errors
    /// Those of [`Scene::parse`], and those of `check`.
    pub fn parse_machine<M: DeserializeOwned + Serialize>(
        file: &str,
        text: &str,
        flags: &[String],
        check: impl Fn(&M, &At<'_>) -> Result<(), SceneError>,
    ) -> Result<(Scene, M), SceneError> {
        Scene::with_machine(Document::parse(file, text)?, flags, check)
    }

    /// See [`Scene::parse_machine`].
    fn with_machine<M: DeserializeOwned + Serialize>(
        mut document: Document,
        flags: &[String],
        check: impl Fn(&M, &At<'_>) -> Result<(), SceneError>,
    ) -> Result<(Scene, M), SceneError> {
        let changes = overrides::apply::<M>(&mut document, flags)?;
        let (mut read, machine) = machine::read(&document)?;
        check::check(&read, &document)?;
        check(&machine, &At::top(&document))?;
        let hash = hash::of(&mut read, &machine);
        let uncertain = uncertain::read(&document, || machine::Whole::new(&read, &machine).tree())?;
        let mut scene = resolve(read, &document, hash)?;
        scene.changes = changes;
        scene.uncertain = uncertain;
        Ok((scene, machine))
    }
}

impl Scene {
    /// The model on which the scene is built.
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
    let wear = wear::resolve(&file.wear, &bodies, &At::top(document))?;
    let scene = Scene {
        name: file.scene.name,
        title: file.scene.title,
        notes: file.scene.notes,
        gravity: file.gravity.vector(),
        step: file.step,
        materials,
        bodies,
        joints,
        wear,
        life: file.life,
        uncertain: Vec::new(),
        linear: file.linear,
        reference: file
            .reference
            .map(|reference| reference.closed_form)
            .filter(|form| *form != ClosedForm::None),
        limits: file.verdict,
        hash,
        written: written::keys(document),
        changes: Vec::new(),
    };
    check::starts(&scene, document)?;
    check::closed_form(&scene, document)?;
    Ok(scene)
}

fn resolve_body(
    entry: BodyEntry,
    materials: &[Material],
    document: &Document,
) -> Result<Body, SceneError> {
    // the checks ensure that there is a shape and that the material is known
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
        two_sided: entry.two_sided.unwrap_or(false),
        ccd: entry.ccd.unwrap_or(false),
        gravity_scale: entry.gravity_scale.unwrap_or(1.0),
        damping: [entry.linear_damping, entry.angular_damping].map(|d| d.unwrap_or(0.0)),
        oscillation: entry.oscillation,
        touches: None,
    })
}

#[cfg(test)]
mod tests;
