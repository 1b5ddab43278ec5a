use super::life::{JumpTaken, NextPoint};
use super::update::deepest;
use super::{
    Archard, CellMap, Jump, JumpRule, Life, LoadSlip, Profile, Update, WearError, clip_loops,
    in_range, refit_quadratic, remesh, smooth_depths, wear_normal,
};
use serde::{Deserialize, Serialize};

/// Largest ratio of the depth of one jump to the shortest edge.
const JUMP_LIMIT: f64 = 0.3;

/// Settings of the wear of a part.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct WearSettings {
    pub law: Archard,
    pub update: Update,
    /// Length σ \[m\] over which [`smooth_depths`] spreads the wear; 0 for none. A property of the
    /// medium, the same on every mesh: a rough medium loads a surface over its grain size, not at
    /// points.
    pub smoothing_length: f64,
    /// Duration of one load cycle \[s\]: `2π / ω` of a rotor.
    pub cycle_seconds: f64,
}

/// Result of one jump.
#[derive(Debug, Clone, PartialEq)]
pub struct WearStep {
    /// Depth worn in this jump \[m\], one per cell.
    pub depth: Vec<f64>,
    /// Area to remove, `Σ h_i w_i` \[m²\], and area removed, measured on the profiles before and
    /// after. With [`Update::Normal`] they differ by round-off and by `clipped_area`.
    pub requested_area: f64,
    pub removed_area: f64,
    /// Relative imbalance before the correction, see [`wear_normal`]; 0 for a refit.
    pub correction: f64,
    /// Area that cutting off loops added, minus the area that re-meshing removed to stay within the
    /// new profile \[m²\]; exactly 0 if nothing crossed and no merged node lay outside.
    pub clipped_area: f64,
    /// Whether nodes were merged, split or cut off, so that moving the collider's vertices is not
    /// enough.
    pub remeshed: bool,
}

/// A surface that wears: its profile, its depth per cell, and its history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WearState {
    settings: WearSettings,
    /// What the nodes of later meshes must stay within.
    bound: Option<Profile>,
    profile: Profile,
    cells: CellMap,
    cell_size: f64,
    life: Life,
}

/// A jump of a surface that is not yet taken.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedStep {
    profile: Profile,
    cells: CellMap,
    next: NextPoint,
    step: WearStep,
}

impl PlannedStep {
    /// The profile after the jump.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }
}

/// A surface after a jump, with the numbers of [`WearStep`].
struct Worn {
    profile: Profile,
    cells: CellMap,
    correction: f64,
    clipped_area: f64,
    remeshed: bool,
}

impl WearState {
    /// A new part. Its mesh defines the cells; the cell size is its mean edge.
    ///
    /// # Errors
    /// [`WearError::Range`] for a smoothing length below 0 m or a cycle not above 0 s.
    pub fn new(profile: Profile, settings: WearSettings) -> Result<Self, WearError> {
        let length = settings.smoothing_length;
        let inside = length >= 0.0 && length.is_finite();
        in_range(
            "smoothing length [m]",
            length,
            inside,
            "finite and at least 0",
        )?;
        let t = settings.cycle_seconds;
        in_range(
            "cycle [s]",
            t,
            t > 0.0 && t.is_finite(),
            "finite and above 0",
        )?;
        let cells = CellMap::new(&profile);
        let edges = profile.edges();
        let cell_size = edges.iter().sum::<f64>() / edges.len() as f64;
        let (node, height) = profile.highest();
        let life = Life::new(cells.stations().len(), height, cells.of_node(node));
        Ok(WearState {
            settings,
            bound: bound(&profile)?,
            profile,
            cells,
            cell_size,
            life,
        })
    }

    /// The same part with another cell size \[m\] for its later meshes.
    ///
    /// # Errors
    /// [`WearError::Range`] unless it is finite and above 0.
    pub fn with_cell_size(mut self, size: f64) -> Result<Self, WearError> {
        let inside = size > 0.0 && size.is_finite();
        in_range("cell size [m]", size, inside, "finite and above 0")?;
        self.cell_size = size;
        Ok(self)
    }

    /// Sums of zero on the nodes of the present profile.
    pub fn no_load(&self) -> LoadSlip {
        let nodes = self.profile.node_count();
        match self.profile.is_ring() {
            true => LoadSlip::ring(nodes),
            false => LoadSlip::new(nodes),
        }
    }

    /// The present profile; `load_slip` refers to its nodes.
    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// The map from nodes to cells, and the stations of the cells.
    pub fn cells(&self) -> &CellMap {
        &self.cells
    }

    /// The wear law.
    pub fn law(&self) -> &Archard {
        &self.settings.law
    }

    /// Mean edge of the first mesh \[m\].
    pub fn cell_size(&self) -> f64 {
        self.cell_size
    }

    /// Worn depth of every cell \[m\]: the sum of the depths by the wear law, whatever the update
    /// made of them.
    pub fn depth(&self) -> &[f64] {
        &self.life.last().depth
    }

    /// The wear history.
    pub fn life(&self) -> &Life {
        &self.life
    }

    /// Depth per cycle of every node \[m\], after smoothing, by [`Archard::depths`] and
    /// [`smooth_depths`]. With [`Update::Quadratic`] all nodes have the same width, as in the fit.
    ///
    /// # Errors
    /// Those of both functions.
    pub fn rates(&self, load_slip: &[f64]) -> Result<Vec<f64>, WearError> {
        let widths = self.widths();
        let mut rates = self.settings.law.depths(load_slip, &widths)?;
        let length = self.settings.smoothing_length;
        smooth_depths(&mut rates, &widths, &self.profile.edges(), length)?;
        Ok(rates)
    }

    /// `K k s` of one cycle by [`Archard::feedback`], from the `A_i` \[N\] of one cycle,
    /// [`LoadSlip::stiffness`](super::LoadSlip::stiffness).
    ///
    /// # Errors
    /// Those of [`Archard::feedback`].
    pub fn feedback(&self, stiffness: &[f64]) -> Result<f64, WearError> {
        self.settings.law.feedback(stiffness, &self.widths())
    }

    /// The next jump by a rule, from the `load_slip` of one cycle [N m], one per node.
    ///
    /// With [`Update::Normal`] no node wears by more than 0.3 of the shortest edge, so that
    /// [`WearState::advance`] accepts this jump.
    ///
    /// # Arguments
    /// - `feedback`: [`WearState::feedback`] of the same cycle.
    ///
    /// # Errors
    /// Those of [`WearState::rates`] and [`JumpRule::next`].
    pub fn next_jump(
        &self,
        rule: &JumpRule,
        load_slip: &[f64],
        feedback: f64,
    ) -> Result<Jump, WearError> {
        let limit = match self.settings.update {
            Update::Normal => JUMP_LIMIT * self.profile.shortest_edge(),
            Update::Quadratic | Update::QuadraticByWidth => f64::INFINITY,
        };
        rule.next(&self.rates(load_slip)?, limit, feedback)
    }

    /// Wears the part by one jump. On an error nothing has changed.
    ///
    /// ```text
    /// h_i = N K S_i / w_i  →  smoothing  →  update  →  loops cut off  →  re-mesh
    /// ```
    ///
    /// With [`Update::Normal`] the worn profile stays within the new one; the quadratic refit can
    /// add steel.
    ///
    /// # Arguments
    /// - `load_slip`: `S_i` of one cycle [N m], one per node of the present profile.
    /// - `cycles`: `N`, above 0.
    /// - `rate_error`: relative standard error of the rates from sampling few cycles; 0 for none.
    ///
    /// # Errors
    /// Those of [`WearState::rates`] and of the update; [`WearError::Range`];
    /// [`WearError::JumpTooLong`] if, with [`Update::Normal`], a node wears by more than 0.3 of the
    /// shortest edge. The quadratic refit keeps its stations, cannot fold, and has no such limit.
    pub fn advance(
        &mut self,
        load_slip: &[f64],
        cycles: f64,
        rate_error: f64,
    ) -> Result<WearStep, WearError> {
        let planned = self.plan(load_slip, cycles, rate_error)?;
        Ok(self.take(planned))
    }

    /// A jump without the jump.
    ///
    /// # Arguments
    /// Those of [`WearState::advance`].
    ///
    /// # Errors
    /// Those of [`WearState::advance`].
    pub fn plan(
        &self,
        load_slip: &[f64],
        cycles: f64,
        rate_error: f64,
    ) -> Result<PlannedStep, WearError> {
        let inside = cycles > 0.0 && cycles.is_finite();
        in_range("jump length [cycles]", cycles, inside, "finite and above 0")?;
        let inside = rate_error >= 0.0 && rate_error.is_finite();
        in_range("rate error", rate_error, inside, "finite and at least 0")?;
        let rates = self.rates(load_slip)?;
        let widths = self.widths();
        let depths: Vec<f64> = rates.iter().map(|r| r * cycles).collect();

        let Worn {
            profile,
            cells,
            correction,
            clipped_area,
            remeshed,
        } = self.worn(&depths)?;
        let (node, height) = profile.highest();
        let rate = self.cells.mean(&rates, &widths)?;
        let requested: Vec<f64> = depths.iter().zip(&widths).map(|(h, w)| h * w).collect();
        let requested_area: f64 = requested.iter().sum();
        let removed_area = self.profile.area_over(&profile);
        // distributes the removed area to the cells, loops included
        let share = match requested_area > 0.0 {
            true => removed_area / requested_area,
            false => 0.0,
        };
        let removed: Vec<f64> = requested.iter().map(|a| a * share).collect();
        let next = self.life.next(JumpTaken {
            cycles,
            cycle_seconds: self.settings.cycle_seconds,
            rate: &rate,
            rate_error,
            load_slip: &self.cells.sum(load_slip)?,
            area: &self.cells.sum(&removed)?,
            height,
            highest: cells.of_node(node),
        })?;
        let step = WearStep {
            depth: rate.iter().map(|r| r * cycles).collect(),
            requested_area,
            removed_area,
            correction,
            clipped_area,
            remeshed,
        };
        Ok(PlannedStep {
            profile,
            cells,
            next,
            step,
        })
    }

    /// Wears the part by a planned jump.
    ///
    /// # Arguments
    /// - `planned`: of this state as it is, [`WearState::plan`].
    pub fn take(&mut self, planned: PlannedStep) -> WearStep {
        self.life.add(planned.next);
        self.profile = planned.profile;
        self.cells = planned.cells;
        planned.step
    }

    /// The surface after these depths \[m\].
    fn worn(&self, depths: &[f64]) -> Result<Worn, WearError> {
        let (mut correction, mut clipped_area, mut remeshed) = (0.0, 0.0, false);
        let mut cells = self.cells.clone();
        let profile = match self.settings.update {
            Update::Quadratic | Update::QuadraticByWidth => {
                refit_quadratic(&self.profile, depths, &self.widths())?
            }
            Update::Normal => {
                self.check_jump(depths)?;
                let (worn, imbalance) = wear_normal(&self.profile, depths)?;
                correction = imbalance;
                let (simple, area) = clip_loops(&worn)?;
                clipped_area = area;
                let meshed = remesh(&simple, self.cell_size, self.bound.as_ref())?;
                remeshed = meshed.is_some() || simple != worn;
                let (meshed, taken) = meshed.unwrap_or((simple, 0.0));
                clipped_area -= taken;
                if remeshed {
                    cells.renew(&worn, &meshed)?;
                }
                meshed
            }
        };
        Ok(Worn {
            profile,
            cells,
            correction,
            clipped_area,
            remeshed,
        })
    }

    /// Supplies the rate at the end of the last jump, for the error of that jump; nothing wears.
    ///
    /// # Errors
    /// Those of [`WearState::rates`].
    pub fn close(&mut self, load_slip: &[f64]) -> Result<(), WearError> {
        let rates = self.rates(load_slip)?;
        self.life.close(&self.cells.mean(&rates, &self.widths())?)
    }

    /// Tributary widths perpendicular to the depths of the update \[m\].
    fn widths(&self) -> Vec<f64> {
        match self.settings.update {
            Update::Normal => self.profile.widths(),
            Update::QuadraticByWidth => self.profile.spans(),
            // the fit gives every node the same weight, and so must the load
            Update::Quadratic => {
                let nodes = self.profile.nodes();
                let last = nodes.len() - 1;
                let width = (nodes[last].x - nodes[0].x) / last as f64;
                vec![width; nodes.len()]
            }
        }
    }

    fn check_jump(&self, depths: &[f64]) -> Result<(), WearError> {
        let limit = JUMP_LIMIT * self.profile.shortest_edge();
        let node = deepest(depths);
        // rounding may put a jump of exactly the limit above it
        if depths[node] > limit * (1.0 + 1e-12) {
            return Err(WearError::JumpTooLong {
                node,
                depth: depths[node],
                limit,
            });
        }
        Ok(())
    }
}

/// The profile within which all later ones lie, with the faces beside it; `None` for a ring, whose
/// nodes never move out.
fn bound(profile: &Profile) -> Result<Option<Profile>, WearError> {
    let Some([first, last]) = profile.faces() else {
        return Ok(None);
    };
    let mut nodes = profile.nodes().to_vec();
    // wear that reaches farther down the faces has no part left to wear
    let far = 2.0 * profile.edges().iter().sum::<f64>();
    if first.x > 0.0 {
        nodes.insert(0, nodes[0] - far * first);
    }
    if last.x < 0.0 {
        nodes.push(nodes[nodes.len() - 1] - far * last);
    }
    profile.moved(nodes).map(Some)
}
