//! The block `[thresher]`: a cylinder of toothed bars, its concave and the crop between them.
//!
//! Machine totals (inertia, torques, feed) are given as on the machine. A 2D scene is a slice one
//! metre deep, so the builder divides them by `machine_width` and outputs multiply back.
//!
//! Sources: the study named in [`super::blocks`] for feed, torque, clearances and the tooth;
//! straw on steel: Agriculture 15:1686 (2025); the rest assumed or from combine manuals.

use super::blocks::Calibration;
use super::grain_parameters::{Bar, Grains};
use serde::{Deserialize, Serialize};

/// `[thresher]`
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(default, deny_unknown_fields)]
pub struct Thresher {
    /// Radius of the tooth tips \[m\], default 0.25 (assumed).
    pub tip_radius: f64,
    /// Toothed bars, evenly spaced, default 8.
    pub bars: u32,
    /// Moment of inertia of the cylinder about its axle [kg m²], machine total, default 2
    /// (assumed).
    pub inertia: f64,
    /// Width of the machine \[m\], default 1.3 (assumed).
    pub machine_width: f64,
    /// Wanted speed of the cylinder [rad/s], default 70.
    pub speed: f64,
    /// Operating torque [N m], machine total, default 146.39: the crop's stiffness is scaled until
    /// the mean torque of new teeth has this value.
    pub operating_torque: f64,
    /// Torque limit of the drive over the operating torque, default 2 (assumed).
    pub drive_torque_factor: f64,
    /// Torque of the drive over the speed of the cylinder: pairs \[speed in rad/s, torque in N m\] with rising
    /// speed and torque that does not rise, the torque a machine total. Straight between the points, constant
    /// beyond them. In place of the ideal motor, which keeps `speed` up to its torque limit; default none.
    pub governor: Option<Vec<[f64; 2]>>,
    /// What is held as the teeth wear, default `feed`.
    pub hold: Hold,
    /// Crop fed [kg/s], machine total, default 5.2.
    pub feed_rate: f64,
    /// Speed of the crop at the inlet [m/s], default 4 (assumed).
    pub entry_speed: f64,
    /// Thickness of the crop strip \[m\], default 0.016: it fills the inlet.
    pub crop_thickness: f64,
    /// Length of one segment of the strip \[m\], default 0.02.
    pub segment_length: f64,
    /// How far the first segment of the strip has come when the cylinder starts, in lengths of a
    /// segment, default 0: shifts the phase of the feed against the bars.
    pub feed_phase: f64,
    /// Segments leave this far behind the outlet, along the arc \[m\]; default 0.2.
    pub exit_distance: f64,
    /// Winkler modulus of the crop [Pa/m], before scaling to the operating torque; default 1e7.
    pub crop_stiffness: f64,
    /// Restitution that the crop's damping is fitted to, default 0.482.
    pub crop_restitution: f64,
    /// Bending stiffness of the strip at every pin [N m/rad] per metre of width, default 15
    /// (assumed): a mat of stalks is a beam, and a strip without stiffness folds between the bars.
    pub crop_bending_stiffness: f64,
    /// Strength of the mat \[N\] per metre of width: the force along the strip above which it parts,
    /// or slides into itself; default 20 (assumed: of the order of straw on straw, 0.227, on both
    /// faces of one segment length, under the mean pressure of 2 kPa between teeth and concave).
    pub crop_strength: f64,
    /// Crop on teeth, default 0.271.
    pub friction_steel: f64,
    /// Crop on concave, default 0.271 (assumed): steel, as the teeth. A concave that holds the crop back more
    /// than worn teeth draw it plugs the machine.
    pub friction_concave: f64,
    /// Start of the concave arc at the inlet \[degrees\], counter-clockwise from +x; default 215.
    pub concave_start_deg: f64,
    /// Its end at the outlet \[degrees\], default 325: an arc of 110 degrees, bottom centred.
    pub concave_end_deg: f64,
    /// Clearance between tips and concave at the inlet \[m\], default 0.016.
    pub clearance_inlet: f64,
    /// At the outlet \[m\], default 0.008; linear in the angle between.
    pub clearance_outlet: f64,
    /// Whether the concave follows the worn teeth, default `follows`.
    pub concave: ConcaveSetting,
    /// A crop of grains in place of the strip; default none.
    pub grains: Option<Grains>,
    /// Bars of their own, with grains; default none: all are equal.
    pub bar: Vec<Bar>,
    /// The published depth to which `K` is fitted; without it, `[wear]` applies unchanged.
    pub calibrate: Option<Calibration>,
}

/// What is held as the teeth wear; the governor holds the speed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hold {
    /// The operator holds the throughput of the same crop, and the torque follows from the teeth:
    /// for planning.
    #[default]
    Feed,
    /// The torque is held at the operating torque by rescaling the crop's stiffness with every new
    /// profile, the protocol of the published depths: for calibration and comparison.
    Torque,
}

impl Hold {
    /// The name in a scene file.
    pub fn word(self) -> &'static str {
        match self {
            Hold::Feed => "feed",
            Hold::Torque => "torque",
        }
    }

    pub fn other(self) -> Hold {
        match self {
            Hold::Feed => Hold::Torque,
            Hold::Torque => Hold::Feed,
        }
    }
}

/// What happens to the clearance as the teeth wear.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ConcaveSetting {
    /// The concave is reset to its clearance with every new profile, as an operator does.
    #[default]
    Follows,
    /// The concave stays: the clearance grows, the load falls, and the wear limits itself.
    Fixed,
}

impl Default for Thresher {
    fn default() -> Self {
        Thresher {
            tip_radius: 0.25,
            bars: 8,
            inertia: 2.0,
            machine_width: 1.3,
            speed: 70.0,
            operating_torque: 146.39,
            drive_torque_factor: 2.0,
            governor: None,
            hold: Hold::Feed,
            feed_rate: 5.2,
            entry_speed: 4.0,
            crop_thickness: 0.016,
            segment_length: 0.02,
            feed_phase: 0.0,
            exit_distance: 0.2,
            crop_stiffness: 1e7,
            crop_restitution: 0.482,
            crop_bending_stiffness: 15.0,
            crop_strength: 20.0,
            friction_steel: 0.271,
            friction_concave: 0.271,
            concave_start_deg: 215.0,
            concave_end_deg: 325.0,
            clearance_inlet: 0.016,
            clearance_outlet: 0.008,
            concave: ConcaveSetting::Follows,
            grains: None,
            bar: Vec::new(),
            calibrate: None,
        }
    }
}

impl Thresher {
    /// Bulk density of the strip [kg/m³] that gives the feed rate at the entry speed, `ρ = feed /
    /// (width · speed · thickness)`. The defaults give 62.5.
    pub fn crop_density(&self) -> f64 {
        self.feed_rate / (self.machine_width * self.entry_speed * self.crop_thickness)
    }

    /// A machine total (torque, inertia, feed) per metre of width.
    pub fn per_metre(&self, total: f64) -> f64 {
        total / self.machine_width
    }
}
