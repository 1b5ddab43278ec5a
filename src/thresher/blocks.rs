//! The blocks of the published study: `[tooth]`, `[wear]` and `[study]`.
//!
//! Source: Ibrahim, Shash & Abboud, *Dynamic simulation of abrasive wear in grain threshing
//! units*, DYSONA - Applied Science 6(1), 2025, doi 10.30493/das.2024.485466. Defaults are the
//! study's numbers unless said otherwise.

use crate::wear::{self, Archard, Profile, WearError, WearSettings};
use serde::{Deserialize, Serialize};

/// `[tooth]`: the profile `y = α x² + β x + γ` over `x` in [0, width], on a base.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tooth {
    /// `α` [1/m], default -5.539.
    pub alpha: f64,
    /// `β`, default -0.1014.
    pub beta: f64,
    /// `γ` \[m\], the height of the new tooth, default 0.0188.
    pub gamma: f64,
    /// Width \[m\], default 0.05.
    pub width: f64,
    /// Number of surface points, evenly spaced, cell 1 at the tall end; default 26.
    pub cells: u32,
    /// Thickness of the base under the tooth \[m\], default 0.008.
    pub base: f64,
}

impl Default for Tooth {
    fn default() -> Self {
        Tooth {
            alpha: -5.539,
            beta: -0.1014,
            gamma: 0.0188,
            width: 0.05,
            cells: 26,
            base: 0.008,
        }
    }
}

impl Tooth {
    /// The new tooth's profile, its nodes the cells.
    ///
    /// # Errors
    /// Those of [`Profile::quadratic`].
    pub fn profile(&self) -> Result<Profile, WearError> {
        Profile::quadratic(
            self.alpha,
            self.beta,
            self.gamma,
            self.width,
            self.cells as usize,
        )
    }
}

/// `[wear]`: Archard's law, worn volume `K Σ load_slip`, and how a life is computed with it.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wear {
    /// `K` [m²/N] of the material, the same on every mesh: worn volume per load and slip. Default
    /// 3.33e-12: the study's 5e-17 m²/N over 3e-8 m², on its cells of 2 mm by 1 m. Depth data
    /// cannot separate the two numbers of the study.
    pub coefficient: f64,
    /// `K` of the concave, with grains; default `coefficient`.
    pub concave_coefficient: Option<f64>,
    /// Heights whose crossing is reported; default none.
    pub limits: Vec<Limit>,
    /// Largest depth of one cycle jump \[m\], default 2e-4. A jump is shortened further where the
    /// mesh cannot follow it, and where a node would wear by more than its elastic penetration.
    pub jump: f64,
    /// Simulated revolutions per jump, default 1.
    pub revolutions: u32,
    /// Length of the medium over which wear is smoothed along the surface \[m\], the standard
    /// deviation of a diffusion, the same on every mesh; default 0, none.
    pub smoothing_length: f64,
    /// Longest life that is computed \[h\], default 1000.
    pub max_hours: f64,
    /// How the error of a life is told, default `run`.
    pub error: LifeErrors,
}

/// How the error of a life is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LifeErrors {
    /// By the run itself: a bound for the jumps, and the noise of sampled cycles.
    #[default]
    Run,
    /// Also by three more lives, which take some three times as long: with steps twice as long, and with
    /// them jumps half as deep, and edges half as long.
    Measured,
}

impl Default for Wear {
    fn default() -> Self {
        Wear {
            coefficient: 5e-17 / 3e-8 * 2e-3,
            concave_coefficient: None,
            limits: Vec::new(),
            jump: 2e-4,
            revolutions: 1,
            smoothing_length: 0.0,
            max_hours: 1000.0,
            error: LifeErrors::Run,
        }
    }
}

impl Wear {
    /// Wear settings of a part under `law`, one load cycle of `cycle_seconds` \[s\]; wear is along
    /// the normals.
    pub fn settings(&self, law: Archard, cycle_seconds: f64) -> WearSettings {
        WearSettings {
            law,
            update: wear::Update::Normal,
            smoothing_length: self.smoothing_length,
            cycle_seconds,
        }
    }
}

/// How the worn depth changes the profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Update {
    /// Along the local normal, node by node, with area balance: the load of a node is proportional
    /// to its width along the surface, and its depth independent of it.
    Normal,
    /// The method of the study: vertically, then refitted to a quadratic by least squares, every
    /// cell with the same weight. It flattens a local scar and adds steel elsewhere.
    #[default]
    Quadratic,
    /// As `quadratic`, every cell weighted by its width along the base, half a cell at both ends:
    /// the same depths on every mesh.
    QuadraticByWidth,
}

/// A tooth height whose crossing is reported.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Limit {
    pub name: String,
    /// Height above the base line \[m\]; below zero the base itself is worn.
    pub height: f64,
}

/// `[study]`: the study's rotor with one degree of freedom, with a named reading of its text.
///
/// The step is `[step] dt`, the contact time of one load cycle `[step] time`.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Study {
    /// Default `torque-balanced`.
    pub reading: Reading,
    /// How the load is distributed over the cells in the torque-balanced reading, default
    /// `winkler`.
    pub shares: Shares,
    /// `l` \[m\] from the axis to the tooth's base line, default 0.25 (assumed).
    pub axis_distance: f64,
    /// Default 0.3 (assumed: the speed study does not state it).
    pub friction: f64,
    /// Moment of inertia about the axis [kg m²], default 5.186444e-4.
    pub inertia: f64,
    /// Lever of the weight `l_m` \[m\], default 0.0387, from `J = m l_m²`.
    pub lever: f64,
    /// Mass of the bar \[kg\], default 0.346.
    pub mass: f64,
    /// Start angle `ψ` \[degrees\], default 15.
    pub start_angle_deg: f64,
    /// Thickness \[m\] of the layer of crop with which the tooth overlaps, default 0.008.
    pub tape_thickness: f64,
    /// Cylinder speeds [rad/s], default 70 to 120 by 10.
    pub speeds: Vec<f64>,
    /// Operating torques [N m], default 146.39 and 20.87: those with published depths.
    pub torques: Vec<f64>,
    /// Load cycles, default 4e6; one is one revolution.
    pub cycles: f64,
    /// Profile updates over those cycles, default 4.
    pub batches: u32,
    /// How depth changes the profile between the updates of the comparison with the published
    /// depths, default `quadratic`. The life of the tooth always wears along the normals.
    pub update: Update,
    /// Contact time of one load cycle \[s\] in the torque-balanced reading, held at every torque,
    /// speed and friction, in the comparison and in the life. Default: fitted to the published point
    /// `calibrate` at the friction and the mesh of this run, for the comparison and for the life.
    pub contact_time: Option<f64>,
    /// Frictions for which depth and life are told at the torque and speed of `calibrate`, with the
    /// contact time of this run; default those of the study.
    pub frictions: Vec<f64>,
    /// The published point to which the contact time of the torque-balanced reading is fitted.
    pub calibrate: Calibration,
}

impl Default for Study {
    fn default() -> Self {
        Study {
            reading: Reading::default(),
            shares: Shares::default(),
            axis_distance: 0.25,
            friction: 0.3,
            inertia: 5.186444e-4,
            lever: 0.0387,
            mass: 0.346,
            start_angle_deg: 15.0,
            tape_thickness: 0.008,
            speeds: vec![70.0, 80.0, 90.0, 100.0, 110.0, 120.0],
            torques: vec![146.39, 20.87],
            cycles: 4e6,
            batches: 4,
            update: Update::default(),
            contact_time: None,
            frictions: vec![0.14, 0.18, 0.25, 0.30, 0.35, 0.40],
            calibrate: Calibration::default(),
        }
    }
}

/// How the text of the study is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reading {
    /// The free rotor against a rigid crop, as printed: it stalls in one step.
    Literal,
    /// The rotor kept at speed, sliding through a compliant layer that resists with the torque.
    #[default]
    TorqueBalanced,
}

/// How the load is distributed over the cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shares {
    /// Proportional to the overlap with the layer of crop.
    #[default]
    Winkler,
    /// The same normal load on each cell.
    Equal,
    /// The same torque on each cell.
    Lever,
}

/// A published depth to which one constant is fitted; tables mark it as calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Calibration {
    /// Operating torque [N m] of the machine, default 146.39.
    pub torque: f64,
    /// Cylinder speed [rad/s], default 70.
    pub speed: f64,
    /// Largest depth \[m\], default 7.62e-3.
    pub depth: f64,
    /// Load cycles after which it was reached, default 4e6.
    pub cycles: f64,
}

impl Default for Calibration {
    fn default() -> Self {
        Calibration {
            torque: 146.39,
            speed: 70.0,
            depth: 7.62e-3,
            cycles: 4e6,
        }
    }
}
