//! `[[wear]]` and `[life]`: bodies of a scene that wear, and for how long.

use super::check::At;
use super::{Body, Mass, Shape};
use super::{SceneError, error::Hint};
use serde::{Deserialize, Serialize};

/// `[[wear]]`: a body that wears by Archard's law.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WearEntry {
    pub body: String,
    pub coefficient: f64,
    pub edges: Option<[u32; 2]>,
    pub cell: Option<f64>,
    #[serde(default)]
    pub mass: bool,
}

/// `[life]`: how long the bodies of `[[wear]]` wear.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Life {
    /// Wear to reach \[s\].
    pub duration: f64,
    /// Largest depth of a jump \[m\].
    #[serde(default = "Life::default_jump")]
    pub jump: f64,
    /// Time before each measured cycle of `[step] time` \[s\]; default as long as that.
    pub settle: Option<f64>,
}

impl Life {
    fn default_jump() -> f64 {
        2e-4
    }
}

/// A wearing body of a resolved scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wear {
    /// Index into [`Scene::bodies`](super::Scene::bodies).
    pub body: usize,
    /// `K` [m²/N].
    pub coefficient: f64,
    /// First and last edge that wear; all without.
    pub edges: Option<[usize; 2]>,
    /// Length of a cell \[m\]; that of the shortest edge without.
    pub cell: Option<f64>,
    /// Density [kg/m²] of the mass that goes with the material.
    pub density: Option<f64>,
}

/// Resolves the wearing bodies of a scene.
///
/// # Errors
/// [`SceneError`]: an unknown body, one that wears twice, a shape that cannot wear, an edge that it
/// does not have, a surface that moves along itself.
pub(super) fn resolve(
    entries: &[WearEntry],
    placed: &[Body],
    top: &At<'_>,
) -> Result<Vec<Wear>, SceneError> {
    let mut found: Vec<Wear> = Vec::new();
    for (index, entry) in entries.iter().enumerate() {
        let at = top.key("wear").index(index);
        let Some(k) = placed.iter().position(|body| body.name == entry.body) else {
            return Err(SceneError::UnknownName {
                at: at.key("body").place(),
                what: "body".to_owned(),
                name: entry.body.clone(),
                hint: Hint::new(&entry.body, placed.iter().map(|body| &body.name)),
            });
        };
        let (body, name) = (&placed[k], &entry.body);
        if found.iter().any(|wear| wear.body == k) {
            let problem = format!("body `{name}` has a [[wear]] already");
            return Err(at.key("body").conflict(problem));
        }
        if body.surface_velocity != 0.0 {
            let problem = format!(
                "the surface of body `{name}` moves along itself, and its material does not stay in \
                 its cells: leave out surface_velocity, or move the body"
            );
            return Err(at.key("body").conflict(problem));
        }
        let edges = edges(body).map_err(|why| {
            at.key("body")
                .conflict(format!("body `{name}` cannot wear: {why}"))
        })?;
        if let Some([first, last]) = entry.edges {
            let (count, closed) = edges;
            if matches!(body.shape, Shape::Disc { .. }) {
                let problem = "a disc has no edges of its own; it wears where it is touched";
                return Err(at.key("edges").conflict(problem));
            }
            if first.max(last) as usize >= count || (!closed && last < first) {
                let order = if closed {
                    ""
                } else {
                    ", the first not above the last"
                };
                return Err(SceneError::OutOfRange {
                    at: at.key("edges").place(),
                    value: format!("{:?}", [first, last]),
                    allowed: format!("0 to {}, the edges of body `{name}`{order}", count - 1),
                });
            }
        }
        let density = density(body, entry.mass).map_err(|why| at.key("mass").conflict(why))?;
        found.push(Wear {
            body: k,
            coefficient: entry.coefficient,
            edges: entry.edges.map(|edges| edges.map(|edge| edge as usize)),
            cell: entry.cell,
            density,
        });
    }
    Ok(found)
}

/// Number of edges of a body's surface, and whether it is closed.
fn edges(body: &Body) -> Result<(usize, bool), &'static str> {
    match &body.shape {
        Shape::Disc { .. } => Ok((usize::MAX, true)),
        Shape::Box { .. } => Ok((4, true)),
        Shape::Polygon { points } => Ok((points.len(), true)),
        Shape::Polyline { .. } if body.two_sided => {
            Err("a two-sided polyline has no solid behind it")
        }
        Shape::Polyline {
            points,
            closed: true,
        } => Ok((points.len(), true)),
        Shape::Polyline { points, .. } => Ok((points.len() - 1, false)),
        Shape::Capsule { .. } => Err("a capsule has no edges; use a polyline or a disc"),
        Shape::Compound(_) => Err("it has several parts; use a polyline"),
        Shape::Rod { .. } | Shape::Line | Shape::Bowl { .. } => {
            Err("it has no cells; rods, lines and bowls are closed-form geometry")
        }
    }
}

/// The density with which a body loses mass.
fn density(body: &Body, asked: bool) -> Result<Option<f64>, String> {
    match body.mass {
        _ if !asked => Ok(None),
        Some(Mass::Density(density)) => Ok(Some(density)),
        Some(Mass::Given { .. }) => {
            let why =
                "the mass that goes with the material needs the density of the body, not its mass";
            Err(why.to_owned())
        }
        None => Err("only a dynamic body has a mass to lose".to_owned()),
    }
}
