//! Impulses of contacts as arrows, coloured by status.

use super::palette::QUALITATIVE;
use super::stage::{Pose, Stage, moved};
use super::still_bodies::{Map, hex};
use crate::dynamics::record::{ContactRecord, ContactStatus};
use plotters::style::RGBColor;
use std::fmt::Write;

/// Length of the largest impulse's arrow, of the shorter side of the picture.
const LENGTH: f64 = 0.2;
/// Arrows shorter than this many pixels are left out: they are dots.
const SHORTEST: f64 = 2.0;

/// Colour of a contact by its status, and the words in the legend.
pub(super) const STATUSES: [(RGBColor, &str); 5] = [
    (QUALITATIVE[0], "contact sticks"),
    (QUALITATIVE[1], "contact slips"),
    (QUALITATIVE[3], "impact"),
    (RGBColor(150, 150, 150), "open contact, no impulse"),
    (RGBColor(0, 128, 90), "closed, without friction"),
];

/// An impulse at a contact, as it acts on the body that it can move.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrow {
    /// \[m\]
    pub at: [f64; 2],
    /// \[N s\]
    pub impulse: [f64; 2],
    /// Its place in [`STATUSES`].
    pub status: usize,
}

impl Arrow {
    /// The impulse `(n, t)` of a contact with a normal: on its second body if that can move, on the first
    /// otherwise.
    pub fn new(
        stage: &Stage,
        second: u32,
        at: [f64; 2],
        normal: [f64; 2],
        impulse: [f64; 2],
        status: ContactStatus,
    ) -> Arrow {
        let sign = if stage.moves(second) { 1.0 } else { -1.0 };
        let [nx, ny] = normal;
        let [n, t] = impulse;
        Arrow {
            at,
            impulse: [sign * (n * nx - t * ny), sign * (n * ny + t * nx)],
            status: match status {
                ContactStatus::Stick => 0,
                // one that slips has all of the friction that there is
                ContactStatus::SlipPlus | ContactStatus::SlipMinus if t == 0.0 => 4,
                ContactStatus::SlipPlus | ContactStatus::SlipMinus => 1,
                ContactStatus::Impact => 2,
                ContactStatus::Open => 3,
            },
        }
    }

    pub fn of(stage: &Stage, contact: &ContactRecord) -> Arrow {
        let (at, n) = (contact.position, contact.normal);
        let impulse = [contact.impulse_n, contact.impulse_t];
        let status = contact.status;
        Arrow::new(
            stage,
            contact.bodies[1],
            [at.x, at.y],
            [n.x, n.y],
            impulse,
            status,
        )
    }

    /// \[N s\]
    pub fn size(&self) -> f64 {
        self.impulse[0].hypot(self.impulse[1])
    }
}

/// The bodies at the end of a step.
pub(super) struct AtEnd<'a> {
    pub stage: &'a Stage,
    pub poses: &'a [Pose],
    /// Velocity and spin of each body [m/s, rad/s].
    pub velocities: &'a [[f64; 3]],
    /// \[s\]
    pub time: f64,
    /// Length of the step \[s\].
    pub dt: f64,
}

impl AtEnd<'_> {
    /// An arrow between these bodies where the one that it moves has carried its point since the contact was
    /// found: in the middle of the step, or at its instant.
    pub fn carried(&self, arrow: Arrow, bodies: [u32; 2], instant: Option<f64>) -> Arrow {
        let late = instant.map_or(0.5 * self.dt, |instant| self.time - instant);
        let moves = |number: &&u32| self.stage.moves(**number);
        let body = bodies.iter().rev().find(moves).map(|k| *k as usize);
        let known = body.and_then(|k| self.poses.get(k).zip(self.velocities.get(k)));
        match known.filter(|_| (0.0..=self.dt).contains(&late)) {
            Some(([x, y, _], velocity)) => {
                let then = [x - late * velocity[0], y - late * velocity[1]];
                let own = [arrow.at[0] - then[0], arrow.at[1] - then[1]];
                let at = moved([*x, *y, late * velocity[2]], own);
                Arrow { at, ..arrow }
            }
            None => arrow,
        }
    }
}

/// How much thinner and shorter the arrows of `count` contacts are, so that they stay apart.
pub(super) fn crowd(count: usize) -> f64 {
    ((count as f64).sqrt() / 5.0).max(1.0)
}

/// Length of a large impulse's arrow in a picture of this size \[pixels\].
pub(super) fn longest(wide: f64, high: f64, crowd: f64) -> f64 {
    LENGTH * wide.min(high).max(200.0) / crowd
}

/// Data of three paths: dots, shafts and heads.
#[derive(Default)]
pub(super) struct Paths {
    pub dots: String,
    pub shafts: String,
    pub heads: String,
}

/// The paths of each status of [`STATUSES`], so that thousands of contacts make a small file.
///
/// # Arguments
/// - `length`: pixels of an impulse.
pub(super) fn paths(map: &Map, arrows: &[Arrow], length: impl Fn(f64) -> f64) -> [Paths; 5] {
    let mut all: [Paths; 5] = Default::default();
    for arrow in arrows {
        let [x, y] = map.px(arrow.at);
        let size = arrow.size();
        let pixels = if size > 0.0 { length(size) } else { 0.0 };
        if !(x.is_finite() && y.is_finite() && pixels.is_finite()) {
            continue;
        }
        let Paths {
            dots,
            shafts,
            heads,
        } = &mut all[arrow.status];
        let _ = write!(dots, "M{x:.1} {y:.1}h0");
        if pixels < SHORTEST {
            continue;
        }
        // the picture's y points down
        let (ux, uy) = (arrow.impulse[0] / size, -arrow.impulse[1] / size);
        let (dx, dy) = (pixels * ux, pixels * uy);
        let head = (0.35 * pixels).clamp(2.5, 8.0);
        let (bx, by) = (x + dx - head * ux, y + dy - head * uy);
        let half = 0.45 * head;
        let _ = write!(shafts, "M{x:.1} {y:.1}l{:.1} {:.1}", bx - x, by - y);
        let _ = write!(
            heads,
            "M{:.1} {:.1}l{:.1} {:.1}l{:.1} {:.1}z",
            x + dx,
            y + dy,
            -head * ux - half * uy,
            -head * uy + half * ux,
            2.0 * half * uy,
            -2.0 * half * ux,
        );
    }
    all
}

/// Widths of a dot and of a shaft \[pixels\].
pub(super) fn widths(crowd: f64) -> [f64; 2] {
    [(4.4 / crowd).max(1.6), (1.8 / crowd).max(0.6)]
}

/// The statuses that occur, for a legend.
pub(super) fn keys(arrows: &[Arrow]) -> String {
    let mut keys = String::new();
    for (k, (colour, meaning)) in STATUSES.iter().enumerate() {
        if arrows.iter().any(|arrow| arrow.status == k) {
            let _ = write!(
                keys,
                "<tspan fill=\"{}\">● {meaning}</tspan>  ",
                hex(*colour)
            );
        }
    }
    keys
}
