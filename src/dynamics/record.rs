//! The record of a step: the input of every report, chart and wear law.

use super::model::{Configuration, JointPart};
pub use super::surface_point::SurfacePoint;
use crate::contact::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// Status of a contact in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ContactStatus {
    Open,
    Stick,
    /// Sliding with positive tangential velocity.
    SlipPlus,
    /// Sliding with negative tangential velocity.
    SlipMinus,
    /// A rebounding impact.
    Impact,
}

impl ContactStatus {
    /// The name in the `status` column.
    pub fn word(self) -> &'static str {
        match self {
            ContactStatus::Open => "open",
            ContactStatus::Stick => "stick",
            ContactStatus::SlipPlus => "slip+",
            ContactStatus::SlipMinus => "slip-",
            ContactStatus::Impact => "impact",
        }
    }
}

/// One contact in one step. Signs as in [`crate::contact`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContactRecord {
    /// Time \[s\] of the contact: the end of the step; for an impact located in time its instant.
    /// For the last of a series of ever smaller bounces, the instant at which the series ends.
    pub time: f64,
    /// The model's number of each body; [`crate::contact::NO_BODY`] for the outside world.
    pub bodies: [u32; 2],
    /// The model's number of each surface: a body may have several.
    pub surfaces: [u32; 2],
    /// Where the contact lies on each surface, by detection.
    pub places: [SurfacePoint; 2],
    /// Contact point \[m\] and unit normal, at the configuration where it was detected. If both
    /// bodies move, the point is half way across the gap; [`ContactRecord::places`] are not.
    #[serde(with = "super::saved::pair")]
    pub position: Vec2,
    #[serde(with = "super::saved::pair")]
    pub normal: Vec2,
    /// `g_N` \[m\] there; positive is open. Of a contact that the solution of the step made necessary the one of
    /// [`MultibodyModel::detect_driven`](super::MultibodyModel::detect_driven).
    pub gap: f64,
    /// `P_N`, `P_T` [N s].
    pub impulse_n: f64,
    pub impulse_t: f64,
    /// Angular impulse [N m s] on each body about its centre of mass. `None` for a side that
    /// receives no impulse, because its motion is prescribed or it dominates the other.
    pub moments: [Option<f64>; 2],
    /// `Δt γ̄_T` \[m\], `γ̄ = (γ_A + γ_E)/2`; exactly 0 for a contact that sticks now and stuck before.
    pub slip: f64,
    /// `P_N |γ̄_T|` [N m], the input of Archard's law.
    pub load_slip: f64,
    /// `−P_T γ̄_T` \[J\], energy dissipated by friction.
    pub friction_work: f64,
    /// `P_N γ̄_N` \[J\], work of the normal impulse on the bodies; negative for a loss.
    pub normal_work: f64,
    /// Stiffness `k` [N/m] of the contact: infinite for a rigid one, 0 where the load is given.
    #[serde(with = "super::saved::endless")]
    pub stiffness: f64,
    pub status: ContactStatus,
}

impl ContactRecord {
    /// Where the contact lies on `surface`; `None` if it is on other surfaces.
    pub fn place_on(&self, surface: u32) -> Option<SurfacePoint> {
        let side = self.surfaces.iter().position(|s| *s == surface)?;
        Some(self.places[side])
    }

    /// Whether nothing rubs: a contact that slips has all the friction that its normal impulse allows, so
    /// that one without any has no friction.
    pub fn is_frictionless(&self) -> bool {
        let slips = matches!(
            self.status,
            ContactStatus::SlipPlus | ContactStatus::SlipMinus
        );
        slips && self.impulse_t == 0.0
    }

    /// The cell on each surface.
    pub fn cells(&self) -> [u32; 2] {
        self.places.map(|place| place.edge)
    }
}

/// One impact: two surfaces that met, once, and what it did to their motion.
///
/// Contact points of the same two surfaces with one normal share a record. The impulse is that of
/// the impact alone: `m v` for a body of mass `m` that lands with speed `v` on a fixed floor,
/// `(1 + e) m v` if it rebounds. The share of the applied forces in the same step is taken off: the
/// force that would hold the pair at rest, times the time from the impact to the end of the step.
/// That force is the one of the two bodies alone; loads that other contacts pass on stay in.
///
/// An impact located in time, and every landing without rebound, has the speed of the instant of
/// touching. A landing that takes two steps is in the record of the second one. A rebound without
/// event location reverses the velocity at the start of its step, and has that as its speed.
///
/// A contact that closes more slowly than forces move it over the resolution of the gap is no
/// impact.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ImpactRecord {
    /// Instant of touching \[s\]; for the last of a series of ever smaller bounces, the end of the
    /// series.
    pub time: f64,
    /// The model's number of each body and of each surface, as in [`ContactRecord`].
    pub bodies: [u32; 2],
    pub surfaces: [u32; 2],
    /// Point \[m\], the mean over the contact points weighted by their impulse, and unit normal.
    #[serde(with = "super::saved::pair")]
    pub position: Vec2,
    #[serde(with = "super::saved::pair")]
    pub normal: Vec2,
    /// Normal speed at which the surfaces close \[m/s\], 0 or more: 0 where an impact elsewhere
    /// passes through.
    pub approach_speed: f64,
    /// [N s], signs as in [`crate::contact`].
    pub impulse_n: f64,
    pub impulse_t: f64,
    /// Energy that the impulse takes from the two bodies \[J\], `−P·(γ⁻ + γ⁺)/2` with the relative
    /// velocities before and after; of a landing that takes two steps the sum of both. Below 0 where impulses
    /// of other contacts push the two apart while this one acts.
    pub energy_lost: f64,
}

/// One part of a joint in one step.
///
/// Its mean force in the step is `impulse / Δt`, [`StepRecord::joint_force`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRecord {
    /// When it acted \[s\]: as [`ContactRecord::time`].
    pub time: f64,
    /// The model's number of the joint: in a rapier world the index of its handle.
    pub joint: u32,
    pub part: JointPart,
    /// The model's number of each body; [`crate::contact::NO_BODY`] for the outside world.
    pub bodies: [u32; 2],
    /// Impulse on the second body; the first gets the opposite. For a pin (x, y) in the world
    /// [N s]. For any other part the first number is along its coordinate [N s or N m s]. A limit
    /// pushes with 0 or more; the upper one acts against its coordinate.
    pub impulse: Vec2,
    /// Work on both bodies \[J\].
    pub work: f64,
}

/// Work of the impulses of a step on the bodies, by source \[J\].
///
/// Each is `Σ Pᵀ W ū` with `ū = (u_A + u_E)/2`, so that their sum with `returned` is exactly the change
/// of kinetic energy (see [`StepEnergy::imbalance`]). Only `recovery` is not part of that sum.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepEnergy {
    /// Kinetic energy at the start and at the end of the step.
    pub kinetic_start: f64,
    pub kinetic_end: f64,
    /// Potential energy at the start and at the end, if the model has one.
    pub potential_start: f64,
    pub potential_end: f64,
    /// Gravity and applied forces.
    pub forces: f64,
    /// Normal and tangential contact impulses.
    pub contact_n: f64,
    pub contact_t: f64,
    /// Pins, locked axes and limits; they do no work on a fixed support.
    pub joints: f64,
    /// Motors, springs and dampers of joints.
    pub motors: f64,
    /// What was taken back of the energy that contacts and joints gave, 0 or less: the end velocities of
    /// their island were scaled down for it. The work of [`StepRecord::drag`].
    pub returned: f64,
    /// Potential energy from position corrections, for example from lifting bodies off each other
    /// that overlap at the start. No impulse does this work, and none of it is kinetic.
    pub recovery: f64,
}

impl StepEnergy {
    /// `ΔT − Σ work` \[J\]: round-off in every scene.
    pub fn imbalance(&self) -> f64 {
        (self.kinetic_end - self.kinetic_start)
            - (self.forces
                + self.contact_n
                + self.contact_t
                + self.joints
                + self.motors
                + self.returned)
    }

    /// Work of forces, normal impulses, friction, joints and motors, what was returned, and work of
    /// position corrections \[J\].
    pub fn work(&self) -> [f64; 7] {
        [
            self.forces,
            self.contact_n,
            self.contact_t,
            self.joints,
            self.motors,
            self.returned,
            self.recovery,
        ]
    }
}

/// A place of a body inside a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waypoint {
    /// The model's number.
    pub body: u32,
    /// \[s\].
    pub time: f64,
    /// In the model's own numbers.
    pub place: Configuration,
}

/// One step of a simulation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StepRecord {
    /// Time at the end of the step \[s\] and its length \[s\].
    pub time: f64,
    pub dt: f64,
    /// Whether the whole record is known. A peer engine reports only contacts, kinetic and
    /// potential energy, and penetration. All other fields are then NaN, and the counts have no
    /// meaning.
    pub accounted: bool,
    /// Every active contact, in the model's order. A contact in several intervals around located
    /// impacts appears once for each.
    pub contacts: Vec<ContactRecord>,
    /// Impacts that ended in this step, by time. A peer engine reports none.
    pub impacts: Vec<ImpactRecord>,
    /// Where bodies were when impacts located in the step turned them; those of a body by time.
    pub waypoints: Vec<Waypoint>,
    /// Bodies whose contacts a peer engine found but could not report: some contacts are missing
    /// above.
    pub unread: usize,
    /// Impulses that took back energy, see [`StepEnergy::returned`]: bodies, and for each x and y [N s]
    /// and the moment [N m s].
    pub drag: Vec<(u32, Vec3)>,
    /// Every part of every joint that took part, in the model's order, repeated like contacts.
    pub joints: Vec<JointRecord>,
    pub islands: usize,
    /// Islands at rest among them. They were not solved: nothing about them has changed since their
    /// last solve, so their impulses are those. Their relative residual is that of the solve, their
    /// residual velocity a bound from it and the speed that it left. Their contacts come first in
    /// the record.
    pub resting: usize,
    /// Unknown impulses of the problems that were solved: two for each contact with friction and each
    /// pin, one for every other row. Islands at rest and contacts that stay open without a solve have
    /// none.
    pub unknowns: usize,
    pub sweeps: usize,
    pub factorisations: usize,
    pub pivots: usize,
    /// Largest residual over the islands: relative (no unit) and velocity (m/s) natural map.
    pub residual: f64,
    pub residual_velocity: f64,
    /// Islands that the judge did not certify. Except for the failed ones they are *bounded*: their
    /// impulses obey friction and the rigid law within the closing velocity
    /// `residual_velocity`, so that a step adds an overlap of at most that velocity times `dt`.
    pub unsolved: usize,
    /// Islands among them whose velocity residual is above a tenth of their velocity scale, as if the
    /// problem had no solution.
    pub failed: usize,
    /// Islands whose active contacts outnumber the coordinates, so that the impulse distribution is
    /// not unique.
    pub redundant: usize,
    /// Islands of at most [`SMALL`](crate::solver::SMALL) contacts and joint rows, and how many of these
    /// the largest island has that was solved.
    pub small_islands: usize,
    pub largest_island: usize,
    /// Islands whose contacts would have added energy: by restitution, or in a crowd by what the
    /// sweeps left. Their impulses were reduced.
    pub capped: usize,
    /// Islands of more than 500 contacts in motion, answered by sweeps: see [`Effort`](super::Effort).
    pub crowds: usize,
    /// Islands whose push-outs were dropped, because the problem with them was not solved. Those of more
    /// than 500 contacts and joints do not count here: see `crowds`.
    pub relaxed: usize,
    /// Islands whose joint gaps were not closed fully because that would have added energy: the
    /// step is too long for the spin of the bodies, or a joint was built with a gap.
    pub joints_capped: usize,
    /// Islands stepped in parts, because links under tension would have opened their pins or pressed into
    /// what they turn about, or because impacts of more than 32 bodies would have left them overlapped.
    pub cut: usize,
    /// Smallest gap \[m\] of two surfaces apart that may touch within the step.
    pub least_gap: Option<f64>,
    /// Largest gap \[m\] of a pin or slot at the midpoint. What turning opens is closed where the end of the
    /// step is shown: see [`MultibodyModel::show`](super::MultibodyModel::show).
    pub joint_gap: f64,
    /// Impacts located in time inside the step.
    pub events: usize,
    /// Pairs that overlapped at the start and are still being moved apart.
    pub recovering: usize,
    /// Energy that rigid contacts added in impacts, beyond what pins took \[J\]: round-off under the
    /// capped law.
    pub impact_gain: f64,
    pub energy: StepEnergy,
    /// Largest penetration \[m\] at the end of the step, extrapolated from the midpoint with the
    /// end velocity, without contacts in an impact. Experiments on a rapier world replace it by the
    /// penetration measured on the poses at the end, for every engine alike.
    pub penetration: f64,
    /// Largest penetration \[m\] at which an impact was noticed: a rebound, or the landing of a contact that had no
    /// impulse before.
    pub penetration_impact: f64,
    /// Work \[J\] of rigid contacts and of pins, locks and limits, `Σ P · (γ_A + γ_E)/2` with the
    /// velocity of one side relative to the other: what they take out is negative, and what moving
    /// supports and belts bring in is not part of it.
    ///
    /// The error of the scheme is in it: pins of turning bodies exchange energy with the motion, to
    /// third order in the step. At 1/60 s those of a pendulum of 2 s take and give 3e-5 of its energy in
    /// every swing. What they give beyond what they took is returned, see [`StepEnergy::returned`], and
    /// is part of this sum. Over a run it is therefore not above 0, up to round-off. Exceptions: islands
    /// that a belt, a motor or a moving support drives, and large debts of bodies around impacts located
    /// in time, which pay once a step.
    pub constraint_work: f64,
    /// Pairs of bodies of which one passed through the other. Experiments find them from the poses
    /// before and after the step, for every engine alike; a step alone leaves it empty.
    pub passed: Vec<[u32; 2]>,
}

impl StepRecord {
    /// Adds the solver's work on bodies that were stepped separately, also if their result is not used.
    pub(super) fn add_work(&mut self, part: &StepRecord) {
        self.sweeps += part.sweeps;
        self.factorisations += part.factorisations;
        self.pivots += part.pivots;
    }

    /// Adds the record of bodies that were stepped separately in the same step.
    pub(super) fn add(&mut self, part: &StepRecord) {
        self.contacts.extend_from_slice(&part.contacts);
        self.impacts.extend_from_slice(&part.impacts);
        self.waypoints.extend_from_slice(&part.waypoints);
        self.joints.extend_from_slice(&part.joints);
        self.drag.extend_from_slice(&part.drag);
        self.islands += part.islands;
        self.resting += part.resting;
        self.add_work(part);
        self.residual = self.residual.max(part.residual);
        self.residual_velocity = self.residual_velocity.max(part.residual_velocity);
        self.unsolved += part.unsolved;
        self.failed += part.failed;
        self.redundant += part.redundant;
        self.capped += part.capped;
        self.small_islands += part.small_islands;
        self.largest_island = self.largest_island.max(part.largest_island);
        let least = [self.least_gap, part.least_gap].into_iter().flatten();
        self.least_gap = least.min_by(f64::total_cmp);
        self.crowds += part.crowds;
        self.relaxed += part.relaxed;
        self.joints_capped += part.joints_capped;
        self.cut += part.cut;
        self.joint_gap = self.joint_gap.max(part.joint_gap);
        self.events += part.events;
        self.impact_gain += part.impact_gain;
        self.energy.forces += part.energy.forces;
        self.energy.contact_n += part.energy.contact_n;
        self.energy.contact_t += part.energy.contact_t;
        self.energy.joints += part.energy.joints;
        self.energy.motors += part.energy.motors;
        self.energy.returned += part.energy.returned;
        self.penetration = self.penetration.max(part.penetration);
        self.penetration_impact = self.penetration_impact.max(part.penetration_impact);
        self.constraint_work += part.constraint_work;
    }

    /// Number of contacts at the end of the step, without impacts located in it and the intervals
    /// before them.
    pub fn contacts_at_end(&self) -> usize {
        self.contacts.iter().filter(|c| c.time == self.time).count()
    }

    /// Mean force of a part of a joint over the step [N, or N m in the first number], with the
    /// signs of [`JointRecord::impulse`]; 0 if it took no part.
    pub fn joint_force(&self, joint: u32, part: JointPart) -> Vec2 {
        let of = |r: &&JointRecord| r.joint == joint && r.part == part;
        self.joints
            .iter()
            .filter(of)
            .map(|r| r.impulse)
            .sum::<Vec2>()
            / self.dt
    }

    /// Sum of `friction_work` over the contacts \[J\].
    pub fn friction_work(&self) -> f64 {
        self.contacts.iter().map(|c| c.friction_work).sum()
    }
}
