//! Wear of each part of the machine: bar by bar, and the concave.

use super::blocks::Wear;
use super::parameters::Thresher;
use super::world::{Part, ThreshingWorld};
use crate::dynamics::record::StepRecord;
use crate::wear::{Archard, LoadSlip, Profile, WearError};
use serde::{Deserialize, Serialize};

/// Load and slip of all parts over measured steps, of the slice.
#[derive(Serialize, Deserialize)]
pub(super) struct PartLoads {
    bars: Vec<LoadSlip>,
    /// Angular impulse of the crop on each bar [N m s].
    moments: Vec<f64>,
    concave: LoadSlip,
    time: f64,
}

/// What a revolution does to one bar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BarWear {
    /// Height of the tooth \[m\].
    pub height: f64,
    /// Torque of the crop on it \[N m\], machine total.
    pub torque: f64,
    /// Worn volume \[m³\] per metre of width.
    pub worn: f64,
    /// Depth of its deepest cell \[m\], and that cell, from 1.
    pub deepest: f64,
    pub cell: usize,
}

/// What a revolution does to one node of the concave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConcaveWear {
    /// Place about the axle \[degrees\], in the sense of rotation.
    pub angle_deg: f64,
    /// Width that the node stands for \[m\], and its depth \[m\].
    pub width: f64,
    pub depth: f64,
}

impl PartLoads {
    pub fn new(p: &Thresher, profile: &Profile, world: &ThreshingWorld) -> PartLoads {
        let bars = p.bars as usize;
        PartLoads {
            bars: vec![LoadSlip::new(profile.node_count()); bars],
            moments: vec![0.0; bars],
            concave: LoadSlip::new(world.concave_nodes().len()),
            time: 0.0,
        }
    }

    /// Adds a step.
    pub fn add(
        &mut self,
        record: &StepRecord,
        world: &ThreshingWorld,
        profile: &Profile,
    ) -> Result<(), WearError> {
        self.time += record.dt;
        for contact in &record.contacts {
            if let Some(Part::Tooth(bar)) = world.part(contact) {
                self.moments[bar] += world.moment(contact);
            }
            if let Some((bar, place)) = world.worn_place(contact, profile) {
                self.bars[bar].add(std::slice::from_ref(contact), |_| Some(place))?;
            }
        }
        self.concave
            .add(&record.contacts, |contact| world.concave_place(contact))
    }

    /// The bars in a mean revolution of `revolutions`.
    pub fn bars(
        &self,
        p: &Thresher,
        wear: &Wear,
        profile: &Profile,
        revolutions: f64,
    ) -> Result<Vec<BarWear>, WearError> {
        let mut found = Vec::new();
        for (bar, load) in self.bars.iter().enumerate() {
            let own = p.bar.get(bar).copied().unwrap_or_default();
            let law = Archard {
                coefficient: own.coefficient.unwrap_or(wear.coefficient),
            };
            let share: f64 = own.height.map_or(1.0, |height| height / profile.height());
            let nodes = profile.nodes().iter().map(|q| [q.x, q.y * share]);
            let depths = law.depths(load.sums(), &widths(&nodes.collect::<Vec<_>>()))?;
            let (cell, deepest) = most(&depths);
            found.push(BarWear {
                height: profile.height() * share,
                torque: -self.moments[bar] / self.time * p.machine_width,
                worn: law.coefficient * load.sums().iter().sum::<f64>() / revolutions,
                deepest: deepest / revolutions,
                cell: cell + 1,
            });
        }
        Ok(found)
    }

    /// The concave in a mean revolution, from its table to the outlet.
    pub fn concave(
        &self,
        wear: &Wear,
        world: &ThreshingWorld,
        revolutions: f64,
    ) -> Result<Vec<ConcaveWear>, WearError> {
        let law = Archard {
            coefficient: wear.concave_coefficient.unwrap_or(wear.coefficient),
        };
        let nodes: Vec<[f64; 2]> = world.concave_nodes().iter().map(|q| [q.x, q.y]).collect();
        let widths = widths(&nodes);
        let depths = law.depths(self.concave.sums(), &widths)?;
        let all = nodes.iter().zip(&widths).zip(&depths).rev();
        Ok(all
            .map(|(([x, y], width), depth)| ConcaveWear {
                angle_deg: y.atan2(*x).to_degrees().rem_euclid(360.0),
                width: *width,
                depth: depth / revolutions,
            })
            .collect())
    }
}

/// The first of the largest values, and its index; (0, 0) of none above 0.
pub(super) fn most(values: &[f64]) -> (usize, f64) {
    let all = values.iter().copied().enumerate();
    all.fold(
        (0, 0.0),
        |most, one| if one.1 > most.1 { one } else { most },
    )
}

/// Half of the edges on both sides of every node of an open outline.
fn widths(nodes: &[[f64; 2]]) -> Vec<f64> {
    let mut widths = vec![0.0; nodes.len()];
    for (k, pair) in nodes.windows(2).enumerate() {
        let half = 0.5 * (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
        widths[k] += half;
        widths[k + 1] += half;
    }
    widths
}
