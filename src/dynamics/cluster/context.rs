//! What the clusters of a step share, and what one of them results in.

use crate::contact::Vec3;
use crate::dynamics::contact_cache::{CachedContacts, Landing, PulledLink};
use crate::dynamics::cut_links::CutLink;
use crate::dynamics::interval::Interval;
use crate::dynamics::model::Configuration;
use crate::dynamics::outcome::SolvedProblem;
use crate::dynamics::record::StepRecord;
use crate::dynamics::rules::Rules;
use crate::dynamics::solution::Solution;

/// Equal parts in which a cluster of many bodies is stepped that would be left overlapped. Impacts leave overlaps of the
/// way of the bodies in a part: more parts leave less, at as many solves of the cluster.
pub(super) const PARTS: f64 = 4.0;

/// Data that all clusters of a step share.
#[derive(Clone, Copy)]
pub(in crate::dynamics) struct Context<'a> {
    /// The whole step, and its solution without located impacts.
    pub main: &'a Interval,
    pub trial: &'a Solution,
    pub cache: &'a CachedContacts,
    /// Links because of which their islands are stepped in parts.
    pub cuts: &'a [CutLink],
    /// Movable bodies of the rebounds and contacts that leave them overlapped, see
    /// [`late_rebounds`](crate::dynamics::late_rebounds) and [`deep_impacts`](crate::dynamics::deep_impacts).
    pub late: &'a [[u32; 2]],
    /// Whether all impacts of the cluster are located although the step is one without events: the trial of the
    /// whole step is then no start for it.
    pub anew: bool,
    /// Number of equal parts in which a cluster is stepped at least.
    pub parts: f64,
    pub rules: Rules,
    pub inverse_mass: &'a [Vec3],
    /// Configurations of all bodies at the start of the step.
    pub origin: &'a [Configuration],
    /// Start and length of the step \[s\].
    pub time: f64,
    pub dt: f64,
}

impl Context<'_> {
    /// For a small cluster with a swept or late rebound, a contact left deep, or bodies that came into each other from
    /// two clusters: all of its impacts are located.
    pub fn with_events(&self) -> Self {
        let mut own = *self;
        own.rules.events = true;
        own.anew = true;
        own
    }

    /// For a large one: it is stepped in parts, and no impact is located.
    pub fn in_parts(&self) -> Self {
        let mut own = *self;
        own.rules.sweeps = false;
        own.parts = PARTS;
        own
    }
}

/// The result of a cluster in a step.
pub(in crate::dynamics) struct Cluster {
    /// Movable bodies, ascending.
    pub bodies: Vec<u32>,
    /// One per body: velocity and configuration at the end, and `∫ u dt`.
    pub end: Vec<Vec3>,
    pub configuration: Vec<Configuration>,
    pub displacement: Vec<Vec3>,
    /// Ends \[s\] of its intervals, from the start of the step, and the displacements until then.
    pub path: Vec<(f64, Vec<Vec3>)>,
    /// Their shares of the reserves of their islands \[J\]; empty where none are kept.
    pub reserves: Vec<f64>,
    pub record: StepRecord,
    pub contacts: CachedContacts,
    /// Whether all its impacts were located.
    pub located: bool,
    /// Whether it was stepped in parts, see [`Context::in_parts`].
    pub in_parts: bool,
    /// Landings that take another step.
    pub landings: Vec<Landing>,
    /// Joints of the detection whose gaps the last interval left to be closed by position.
    pub unclosed: Vec<usize>,
    /// Links under tension, if it was stepped in parts because of some.
    pub links: Vec<PulledLink>,
    /// Problems, if they are stored.
    pub problems: Vec<SolvedProblem>,
}

/// The rest of a step.
#[derive(Clone, Copy)]
pub(super) struct Rest {
    /// Its start and length \[s\].
    pub at: f64,
    pub length: f64,
}

impl Rest {
    pub fn of(context: &Context, elapsed: f64) -> Rest {
        Rest {
            at: context.time + elapsed,
            length: context.dt - elapsed,
        }
    }
}

impl Cluster {
    /// Whether its path has bends within the step.
    pub fn is_bent(&self) -> bool {
        self.located || self.in_parts
    }

    /// A cluster of these bodies, before it is stepped.
    pub fn of(bodies: Vec<u32>) -> Cluster {
        Cluster {
            end: Vec::new(),
            configuration: Vec::new(),
            displacement: vec![Vec3::zeros(); bodies.len()],
            path: Vec::new(),
            bodies,
            reserves: Vec::new(),
            record: StepRecord::default(),
            contacts: CachedContacts::default(),
            located: false,
            in_parts: false,
            landings: Vec::new(),
            unclosed: Vec::new(),
            links: Vec::new(),
            problems: Vec::new(),
        }
    }
}
