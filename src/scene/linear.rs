//! The `[linear]` block: a mechanism with constant matrices, in place of bodies.

use crate::contact::Vec3;
use crate::dynamics::ModelError;
use crate::models::{Linear, LinearContact, LinearSystem};
use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};

/// `[linear]`: `M q̈ + K q = f` in one to three coordinates, with contacts of constant levers.
///
/// Matrices are arrays of rows. Units follow from those of the coordinates (m or rad). Gravity is
/// part of `load`. `bodies.csv` shows each coordinate as a body that moves along x.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LinearBlock {
    /// Names of the coordinates.
    pub coordinates: Vec<String>,
    /// `M`, symmetric and positive definite.
    pub mass: Vec<Vec<f64>>,
    /// `K`, symmetric, default 0.
    pub stiffness: Option<Vec<Vec<f64>>>,
    /// `f`, default 0.
    pub load: Option<Vec<f64>>,
    /// `q` and `q̇` at the start, default 0.
    pub position: Option<Vec<f64>>,
    pub velocity: Option<Vec<f64>>,
    #[serde(default)]
    pub contact: Vec<LinearContactEntry>,
}

/// `[[linear.contact]]`
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LinearContactEntry {
    pub name: String,
    /// Gap \[m\] where all coordinates are 0.
    pub gap: f64,
    /// Derivatives of the gap and of the sliding distance (default 0) by each coordinate.
    pub normal: Vec<f64>,
    pub tangent: Option<Vec<f64>>,
    /// Coulomb's coefficient, default 0.
    #[serde(default)]
    pub friction: f64,
    /// Newton's coefficient, default 0.
    #[serde(default)]
    pub restitution: f64,
}

impl LinearBlock {
    /// The model that the block describes.
    ///
    /// # Errors
    /// Those of [`Linear::new`]; they do not occur for a block that passed its checks.
    pub fn model(&self) -> Result<Linear, ModelError> {
        let [position, velocity] = self.start();
        Linear::new(self.system(), self.contacts(), position, velocity)
    }

    /// Mass, stiffness and load.
    pub fn system(&self) -> LinearSystem {
        LinearSystem {
            coordinates: self.coordinates.len(),
            mass: matrix(&self.mass),
            stiffness: self.stiffness.as_deref().map_or(Matrix3::zeros(), matrix),
            load: optional(&self.load),
        }
    }

    /// The contacts in the block's order.
    pub fn contacts(&self) -> Vec<LinearContact> {
        let contact = |c: &LinearContactEntry| LinearContact {
            normal: vector(&c.normal),
            tangent: optional(&c.tangent),
            gap: c.gap,
            friction: c.friction,
            restitution: c.restitution,
        };
        self.contact.iter().map(contact).collect()
    }

    /// `q` and `q̇` at the start; zeros beyond the coordinates.
    pub fn start(&self) -> [Vec3; 2] {
        [optional(&self.position), optional(&self.velocity)]
    }
}

fn vector(v: &[f64]) -> Vec3 {
    Vec3::from_fn(|i, _| v.get(i).copied().unwrap_or(0.0))
}

fn optional(v: &Option<Vec<f64>>) -> Vec3 {
    v.as_deref().map_or(Vec3::zeros(), vector)
}

fn matrix(rows: &[Vec<f64>]) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| {
        let row = rows.get(i).and_then(|row| row.get(j));
        row.copied().unwrap_or(0.0)
    })
}
