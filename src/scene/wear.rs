//! `[[wear]]` and `[life]`: bodies of a scene that wear, and for how long.

use super::check::At;
use super::{Body, Mass, Shape};
use super::{SceneError, error::Hint};
use crate::rapier::MOST_CELLS;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

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
/// does not have, a cell out of range, a surface that moves along itself.
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
        let Edges { lengths, closed } = edges;
        let count = lengths.len();
        if let Some([first, last]) = entry.edges {
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
        if let Some(cell) = entry.cell {
            let [least, most] = cells(body, &lengths, entry.edges);
            if !(least..=most).contains(&cell) {
                return Err(SceneError::OutOfRange {
                    at: at.key("cell").place(),
                    value: format!("{cell:?}"),
                    allowed: format!(
                        "{least:.4e} to {most:.4e} m, from {MOST_CELLS} cells to twice the shortest edge of \
                         body `{name}` that wears"
                    ),
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

/// The surface of a body: the lengths of its edges \[m\], and whether it is closed.
struct Edges {
    lengths: Vec<f64>,
    closed: bool,
}

fn edges(body: &Body) -> Result<Edges, &'static str> {
    let of = |points: &[[f64; 2]], closed: bool| {
        let next = points.iter().cycle().skip(1);
        let lengths = points
            .iter()
            .zip(next)
            .map(|([x, y], [u, v])| (u - x).hypot(v - y));
        let count = points.len() - usize::from(!closed);
        Edges {
            lengths: lengths.take(count).collect(),
            closed,
        }
    };
    match &body.shape {
        Shape::Disc { radius } => Ok(Edges {
            lengths: vec![TAU * radius],
            closed: true,
        }),
        &Shape::Box { width, height } => Ok(Edges {
            lengths: vec![width, height, width, height],
            closed: true,
        }),
        Shape::Polygon { points } => Ok(of(points, true)),
        Shape::Polyline { .. } if body.two_sided => {
            Err("a two-sided polyline has no solid behind it")
        }
        Shape::Polyline { points, closed } => Ok(of(points, *closed)),
        Shape::Capsule { .. } => Err("a capsule has no edges; use a polyline or a disc"),
        Shape::Compound(_) => Err("it has several parts; use a polyline"),
        Shape::Rod { .. } | Shape::Line | Shape::Bowl { .. } => {
            Err("it has no cells; rods, lines and bowls are closed-form geometry")
        }
    }
}

/// Shortest and longest cell \[m\] of the edges that wear.
fn cells(body: &Body, lengths: &[f64], edges: Option<[u32; 2]>) -> [f64; 2] {
    let n = lengths.len();
    let [first, last] = edges.map_or([0, n - 1], |edges| edges.map(|edge| edge as usize));
    let worn = (lengths.iter().cycle().skip(first)).take((last + n - first) % n + 1);
    let (shortest, whole) = match body.shape {
        // a square inside it at least
        Shape::Disc { radius } => (2.0f64.sqrt() * radius, TAU * radius),
        _ => worn.fold((f64::INFINITY, 0.0), |(a, b), l| (l.min(a), b + l)),
    };
    [whole / MOST_CELLS as f64, 2.0 * shortest]
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
