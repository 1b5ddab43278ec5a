//! The block `[thresher.grains]`: a crop of discs.

use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Largest share of the inlet that grains fill. Discs at random places that stay clear of each other fill at
/// most 0.547 of a plane (Hinrichsen, Feder & Jossang 1986).
pub(super) const FULLEST: f64 = 0.5;

/// `[thresher.grains]`: discs in place of the strip, fed at the same mass flow.
///
/// The block alone makes the crop one of grains; an empty one has the defaults. Grains are rigid and
/// meet everything by Moreau's law. On steel they have the `friction_steel`, `friction_concave` and
/// `crop_restitution` of `[thresher]`.
///
/// Source of friction and restitution: straw on straw, Agriculture 15:1686 (2025).
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Grains {
    /// Mean radius \[m\], default 0.0012.
    pub radius: f64,
    /// Radii are spread evenly over the mean times 1 ± this; default 0.2.
    pub spread: f64,
    /// Seed of radii and places at the inlet, default 1.
    pub seed: u32,
    /// Density [kg/m³], default 150 (assumed: of the order of a stalk). With the feed, the entry speed and
    /// the thickness of the crop it gives the share of the inlet that grains fill, 0.42 by default.
    pub density: f64,
    /// Of grains on grains, default 0.227.
    pub friction: f64,
    /// Of grains on grains, default 0.479.
    pub restitution: f64,
}

/// `[[thresher.bar]]`: a bar of its own. All bars are listed, bar 0 first; what a bar does not say is that of
/// the machine.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bar {
    /// Height of its tooth \[m\]: the profile of `[tooth]`, scaled to it. A lower one is a worn one.
    pub height: Option<f64>,
    /// Of the crop on it; default `friction_steel`.
    pub friction: Option<f64>,
    /// Its `K` [m²/N]; default that of `[wear]`.
    pub coefficient: Option<f64>,
}

impl Default for Grains {
    fn default() -> Self {
        Grains {
            radius: 1.2e-3,
            spread: 0.2,
            seed: 1,
            density: 150.0,
            friction: 0.227,
            restitution: 0.479,
        }
    }
}

impl Grains {
    /// Mass \[kg\] and inertia \[kg m²\] of a disc of this radius \[m\], one metre deep.
    pub(super) fn mass(&self, radius: f64) -> (f64, f64) {
        let mass = self.density * PI * radius * radius;
        (mass, 0.5 * mass * radius * radius)
    }
}
