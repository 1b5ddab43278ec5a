use super::WornError;
use super::face::Face;
use crate::contact::Vec2;
use crate::dynamics::record::StepRecord;
use crate::rapier::engine::prelude::{ColliderHandle, PhysicsWorld};
use crate::rapier::{MoreauPipeline, Outline, SurfaceLaw};
use crate::wear::{Archard, JumpRule, LoadSlip, Update, WearError, WearSettings, WearState};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// How a collider wears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WearingSurface {
    /// `K` [m²/N] of its material, worn volume per load and slip.
    pub coefficient: f64,
    /// First and last of the edges of its [`Outline`] that wear, from 0; `None` for all. On a closed
    /// outline they may go past the last edge: `[3, 0]`.
    pub edges: Option<[usize; 2]>,
    /// Length of a cell \[m\], at most twice the shortest edge that wears; `None` for that edge.
    pub cell: Option<f64>,
    /// Density [kg/m²] with which wear takes mass off its body, and moves its centre of mass; `None`
    /// leaves mass and inertia as they are.
    pub density: Option<f64>,
}

impl WearingSurface {
    /// All edges, cells as long as the shortest, mass unchanged.
    pub fn new(coefficient: f64) -> Self {
        WearingSurface {
            coefficient,
            edges: None,
            cell: None,
            density: None,
        }
    }
}

/// The wearing colliders of a rapier world, see [`crate::worn`]. As plain data for serde, between a
/// measured cycle and the next, they go on with the world and the
/// [`PipelineState`](crate::rapier::PipelineState) of the same time.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct WornColliders {
    pub(super) rule: JumpRule,
    pub(super) parts: Vec<Part>,
    /// Pairs of surfaces that wear each other.
    pub(super) pairs: BTreeSet<[usize; 2]>,
    /// Time since the last jump \[s\].
    pub(super) measured: f64,
    /// Wear so far \[s\].
    pub(super) seconds: f64,
    /// Length of the next jump \[s\], for which the surfaces yield.
    pub(super) planned: Option<f64>,
    /// Normal impulses [N s] of yielding contacts since the last jump: of open ones, and of all.
    pub(super) yielded: [f64; 2],
    /// Why the next jump fails, where that is known: nothing goes on from there.
    #[serde(skip)]
    pub(super) through: Option<WornError>,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Part {
    #[serde(with = "crate::rapier::raw_handle")]
    pub collider: ColliderHandle,
    pub face: Face,
    pub hollow: bool,
    pub state: WearState,
    pub density: Option<f64>,
    /// Its law without wear compliance.
    pub law: SurfaceLaw,
    /// Sums since the last jump.
    pub load: LoadSlip,
    /// Sum of load times slip [N m], and of the normal impulses [N s], since the last jump.
    pub slid: f64,
    pub pressed: f64,
    /// Time for which each node was loaded since the last jump \[s\].
    pub loaded: Vec<f64>,
    /// Numbers of the surfaces in its contacts, its own among them.
    pub met: BTreeSet<u32>,
}

impl WornColliders {
    /// Nothing wears yet.
    ///
    /// # Arguments
    /// - `rule`: its cycles are seconds.
    pub fn new(rule: JumpRule) -> Self {
        WornColliders {
            rule,
            parts: Vec::new(),
            pairs: BTreeSet::new(),
            measured: 0.0,
            seconds: 0.0,
            planned: None,
            yielded: [0.0; 2],
            through: None,
        }
    }

    /// Lets a collider wear. It gets the shape of its outline with the cells that wear, its surface law
    /// gets `cells`, so that a compliance counts per metre of surface, and all bodies stay awake.
    ///
    /// # Returns
    /// The number of the surface, from 0.
    ///
    /// # Errors
    /// [`WornError`]; nothing is changed then.
    pub fn add(
        &mut self,
        world: &mut PhysicsWorld,
        pipeline: &mut MoreauPipeline,
        collider: ColliderHandle,
        surface: WearingSurface,
    ) -> Result<usize, WornError> {
        let number = self.parts.len();
        let wear = |source| WornError::Wear {
            surface: number,
            source,
        };
        if let Some(surface) = self.parts.iter().position(|p| p.collider == collider) {
            return Err(WornError::Twice { surface });
        }
        let law = pipeline.surface(collider);
        if law.speed != 0.0 {
            return Err(WornError::SurfaceSpeed { speed: law.speed });
        }
        for (what, value) in [
            ("K [m²/N]", surface.coefficient),
            ("density [kg/m²]", surface.density.unwrap_or(0.0)),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                let allowed = "finite and at least 0";
                return Err(wear(WearError::Range {
                    what,
                    value,
                    allowed,
                }));
            }
        }
        let outline = pipeline.outline(world, collider, surface.cell)?;
        let hollow = outline.closed && crate::wear::signed_area(&outline.points) < 0.0;
        // the edges of a ball come from the length of its cells
        let (face, profile, cell) = Face::cut(&outline, surface.edges, surface.cell, number)?;
        let settings = WearSettings {
            law: Archard {
                coefficient: surface.coefficient,
            },
            update: Update::Normal,
            smoothing_length: 0.0,
            cycle_seconds: 1.0,
        };
        let state = WearState::new(profile, settings).and_then(|s| s.with_cell_size(cell));
        let state = state.map_err(wear)?;
        let whole = face.outline(state.profile());
        Face::check(&whole, hollow).map_err(wear)?;
        pipeline.set_outline(world, collider, &whole)?;
        pipeline.set_surface(collider, SurfaceLaw { cells: true, ..law });
        pipeline.stay_awake();
        self.parts.push(Part {
            collider,
            face,
            hollow,
            load: state.no_load(),
            loaded: vec![0.0; state.profile().node_count()],
            state,
            density: surface.density,
            law,
            slid: 0.0,
            pressed: 0.0,
            met: BTreeSet::new(),
        });
        Ok(number)
    }

    /// Adds load and slip of a step.
    ///
    /// # Errors
    /// [`WornError::Wear`] for a record that is not finite.
    pub fn measure(&mut self, record: &StepRecord) -> Result<(), WornError> {
        for (surface, part) in self.parts.iter_mut().enumerate() {
            let number = part.number();
            let (face, profile) = (&part.face, part.state.profile());
            part.load
                .add(&record.contacts, |contact| {
                    face.place(profile, contact.place_on(number)?)
                })
                .map_err(|source| WornError::Wear { surface, source })?;
            let mut touched = BTreeSet::new();
            for contact in record.contacts.iter().filter(|c| c.impulse_n > 0.0) {
                let place = contact
                    .place_on(number)
                    .and_then(|p| face.place(profile, p));
                let nodes = part.loaded.len();
                touched.extend(place.into_iter().flat_map(|place| {
                    let start = place.edge as usize;
                    [start % nodes, (start + 1) % nodes]
                }));
            }
            for node in touched {
                part.loaded[node] += record.dt;
            }
        }
        for contact in &record.contacts {
            let on = contact.surfaces.map(|slot| self.on(slot));
            if on.iter().any(Option::is_some) && contact.stiffness.is_finite() {
                let open = if contact.gap > 0.0 { 1.0 } else { 0.0 };
                self.yielded[0] += open * contact.impulse_n;
                self.yielded[1] += contact.impulse_n;
            }
            for part in on.into_iter().flatten() {
                self.parts[part].slid += contact.load_slip;
                self.parts[part].pressed += contact.impulse_n;
                self.parts[part].met.extend(contact.surfaces);
            }
            if let [Some(a), Some(b)] = on {
                self.pairs.insert([a.min(b), a.max(b)]);
            }
        }
        self.measured += record.dt;
        Ok(())
    }

    /// Number of wearing surfaces.
    pub fn surfaces(&self) -> usize {
        self.parts.len()
    }

    /// Profile, depth and history of a surface; its cycles are seconds.
    ///
    /// # Panics
    /// If there is no such surface.
    pub fn state(&self, surface: usize) -> &WearState {
        &self.parts[surface].state
    }

    /// The present outline of the collider of a surface, in its own frame.
    ///
    /// # Panics
    /// If there is no such surface.
    pub fn outline(&self, surface: usize) -> Outline {
        let part = &self.parts[surface];
        part.face.outline(part.state.profile())
    }

    /// A point of the profile of a surface in the frame of its collider.
    ///
    /// # Panics
    /// If there is no such surface.
    pub fn in_collider(&self, surface: usize, point: Vec2) -> Vec2 {
        self.parts[surface].face.in_collider(point)
    }

    /// Wear so far \[s\].
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Why no further jump is possible: a surface is worn so thin that what presses on it reaches through
    /// it. What is measured from then on means nothing, and the next jump is this error.
    pub fn worn_through(&self) -> Option<&WornError> {
        self.through.as_ref()
    }

    fn on(&self, slot: u32) -> Option<usize> {
        self.parts.iter().position(|part| part.number() == slot)
    }

    /// Starts the sums of the next jump.
    pub(super) fn clear(&mut self) {
        for part in &mut self.parts {
            part.load = part.state.no_load();
            part.loaded = vec![0.0; part.state.profile().node_count()];
            (part.slid, part.pressed) = (0.0, 0.0);
            part.met.clear();
        }
        self.pairs.clear();
        self.yielded = [0.0; 2];
        self.measured = 0.0;
    }
}

impl Part {
    /// The number of its surface in records.
    fn number(&self) -> u32 {
        self.collider.into_raw_parts().0
    }

    /// Sliding distance of a loaded node in a second \[m/s\]: the speed of the contacts by their
    /// impulses, times the share of `time` \[s\] for which a node was loaded, by the loads of the nodes.
    pub fn sliding(&self, time: f64) -> f64 {
        let all: f64 = self.load.sums().iter().sum();
        if all <= 0.0 || self.pressed <= 0.0 {
            return 0.0;
        }
        let shares = self.load.sums().iter().zip(&self.loaded);
        let share: f64 = shares.map(|(load, loaded)| load * loaded / time).sum();
        self.slid / self.pressed * (share / all)
    }
}
