use super::joint_frames::Bend;
use super::roles::BodyRoles;
use super::surface_point::SurfacePoint;
use crate::contact::{Rows, Vec2, Vec3};
use thiserror::Error;

/// Identifies a contact from step to step, so that impulses can be matched.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
pub struct ContactKey {
    /// The two surfaces, as the model numbers them.
    pub pair: u64,
    /// The features of the two surfaces that touch.
    pub feature: u64,
}

/// How a contact carries its normal load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NormalLaw {
    /// Rigid, with Newton's coefficient of restitution in [0, 1].
    Rigid { restitution: f64 },
    /// Kelvin-Voigt: stiffness `k` \[N/m\] and damping `c` [N s/m], implicit, of order 2 with damping.
    ViscoElastic { stiffness: f64, damping: f64 },
    /// The normal force \[N\] is given; only friction is solved.
    Load { force: f64 },
}

impl NormalLaw {
    /// Newton's coefficient of restitution; 0 for laws that have none.
    pub fn restitution(&self) -> f64 {
        match *self {
            NormalLaw::Rigid { restitution } => restitution,
            NormalLaw::ViscoElastic { .. } | NormalLaw::Load { .. } => 0.0,
        }
    }

    /// How fast the normal force grows with the overlap [N/m]: infinite for a rigid contact, 0 for a
    /// given load.
    pub fn stiffness(&self) -> f64 {
        match self {
            NormalLaw::Rigid { .. } => f64::INFINITY,
            NormalLaw::ViscoElastic { stiffness, .. } => *stiffness,
            NormalLaw::Load { .. } => 0.0,
        }
    }
}

/// One contact at the configuration where it was detected. Signs as in [`crate::contact`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPoint {
    pub key: ContactKey,
    /// Rows (n, t) over the model's velocity blocks.
    pub rows: Rows,
    /// The model's numbers of both bodies, for the record.
    pub bodies: [u32; 2],
    /// The model's numbers of both surfaces: a body may have several.
    pub surfaces: [u32; 2],
    /// Where the contact lies on each surface.
    pub places: [SurfacePoint; 2],
    /// Point \[m\], unit normal, gap \[m\].
    pub position: Vec2,
    pub normal: Vec2,
    pub gap: f64,
    /// Resolution of the gap \[m\]: smaller gaps count as zero.
    pub gap_noise: f64,
    /// Radius of each surface where it is round \[m\]: of a disc, a capsule, a rounded corner. 0 at
    /// a sharp corner and on a flat face.
    pub radii: [f64; 2],
    /// Where a surface lies flat on a disc, the radius of the disc \[m\]: its contact moves along it as it
    /// turns. 0 elsewhere.
    pub rolls_on: [f64; 2],
    pub friction: f64,
    pub law: NormalLaw,
    /// Tangential velocity that a moving surface adds to the relative velocity \[m/s\].
    pub surface_velocity: f64,
}

/// The law of a joint row. Units are those of its coordinate: m and N, or rad and N m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointKind {
    /// Two rows that close `gap` \[m\].
    Pin { gap: Vec2 },
    /// One row that closes `gap`.
    Lock { gap: f64 },
    /// One row that keeps `gap` at or above 0, and only pushes.
    Limit { gap: f64 },
    /// One row driven to `speed` by at most `max_force`.
    Motor { speed: f64, max_force: f64 },
    /// One row with the force `−k stretch − c (γ − speed)` of at most `max_force`.
    Spring(Spring),
}

/// A spring and damper along one coordinate of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// The coordinate minus its rest value [m or rad].
    pub stretch: f64,
    /// Target rate [m/s or rad/s].
    pub speed: f64,
    /// `k` [N/m or N m/rad]; [1/s²] with `per_mass`.
    pub stiffness: f64,
    /// `c` [N s/m or N m s/rad]; [1/s] with `per_mass`.
    pub damping: f64,
    /// Whether `k` and `c` are per unit of the row's effective mass, `1/G_ii`.
    pub per_mass: bool,
    pub max_force: f64,
}

/// The part of a joint that a row belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum JointPart {
    /// Both axes of a pin; its impulse is (x, y) in the world.
    Pin,
    /// A locked axis: along x or y of the joint's frame on the first body, or the angle.
    Lock(JointCoordinate),
    /// The lower and the upper limit of an axis.
    Lower(JointCoordinate),
    Upper(JointCoordinate),
    /// A motor, spring or damper on an axis.
    Drive(JointCoordinate),
}

/// The coordinates of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum JointCoordinate {
    /// Along the joint's own x and y axis, fixed to the first body.
    X,
    Y,
    Angle,
    /// The distance between the two points.
    Distance,
}

/// Rows of a joint or motor; all but a pin use the first row only.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRow {
    pub key: ContactKey,
    /// The model's number of the joint.
    pub joint: u32,
    pub part: JointPart,
    pub rows: Rows,
    pub kind: JointKind,
    /// Change of the gap beyond its rate.
    pub bend: Bend,
}

impl JointRow {
    /// [`JointRow::distance`] after a displacement along its rows.
    pub(super) fn distance_after(&self, moved: Vec2) -> f64 {
        let kind = match self.kind {
            JointKind::Pin { gap } => JointKind::Pin { gap: gap + moved },
            JointKind::Lock { gap } => JointKind::Lock { gap: gap + moved.x },
            kind => kind,
        };
        JointRow { kind, ..*self }.distance()
    }

    /// Gap of a pin or slot \[m\]; 0 for angles.
    pub fn distance(&self) -> f64 {
        match (self.kind, self.part) {
            (JointKind::Pin { gap }, _) => gap.norm(),
            (_, JointPart::Lock(JointCoordinate::Angle)) => 0.0,
            (JointKind::Lock { gap }, _) => gap.abs(),
            _ => 0.0,
        }
    }
}

/// Two surfaces with a rigid law that may meet within a step, whether they have a contact or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearPair {
    pub surfaces: [u32; 2],
    /// As in the rows of a contact.
    pub bodies: [u32; 2],
    /// Lower bound of the distance of the surfaces \[m\]; not above 0 if they overlap.
    pub bound: f64,
    /// Distance of the farthest point of each body from its centre of mass \[m\].
    pub radii: [f64; 2],
    pub restitution: f64,
}

/// Which pairs of surfaces are wanted in [`Detection::near`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NearWanted {
    #[default]
    None,
    /// Those with restitution.
    Rebounding,
    All,
}

/// All contacts and joints that a model finds at one configuration, in a fixed order.
#[derive(Debug, Clone, Default)]
pub struct Detection {
    pub contacts: Vec<ContactPoint>,
    pub joints: Vec<JointRow>,
    /// Pairs of surfaces, each once; a model may leave it empty. Event location then misses pairs that
    /// show no contact at the midpoint of a step, as corners that pass each other do not.
    pub near: Vec<NearPair>,
    /// Which pairs `near` is to hold. Set by the caller.
    pub wants_near: NearWanted,
    /// Displacements [m, m, rad] of all bodies that impacts of the step are known to make, to which the model
    /// looks at least; empty if none are known. Set by the caller.
    pub moved: Vec<Vec3>,
}

impl Detection {
    pub(super) fn clear(&mut self) {
        self.contacts.clear();
        self.joints.clear();
        self.near.clear();
    }

    /// Takes over all that another detection has found of other pairs.
    pub(crate) fn append(&mut self, other: &mut Detection) {
        self.contacts.append(&mut other.contacts);
        self.joints.append(&mut other.joints);
        self.near.append(&mut other.near);
    }

    /// Adds a part of a pair of surfaces to `near`. Parts of a pair follow each other.
    pub(crate) fn add_near(&mut self, part: NearPair) {
        match self.near.last_mut() {
            Some(pair) if pair.surfaces == part.surfaces => {
                pair.bound = pair.bound.min(part.bound);
            }
            _ => self.near.push(part),
        }
    }
}

/// Position of a body, in the model's own numbers.
pub type Configuration = [f64; 5];

/// A body at the end of a step as it is to be shown, with its joints closed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    pub body: u32,
    /// From the configuration to the one shown [m, m, rad].
    pub displacement: Vec3,
    /// What is added to the velocity [m/s, m/s, rad/s], so that free bodies keep their angular momentum.
    pub velocity: Vec3,
}

/// Why a model cannot continue.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ModelError {
    /// An unsupported object in the user's world, with its name.
    #[error("{0}")]
    Unsupported(String),
    /// An object in the user's world that cannot be simulated, with its name.
    #[error("{0}")]
    Invalid(String),
}

/// Bodies, their motion and their contacts: the interface between the stepper and any engine.
///
/// Velocities come in blocks of three, one per body. A model with fewer coordinates gives the
/// missing ones an inverse mass of zero. A kinematic body has inverse mass zero and its prescribed
/// velocity.
pub trait MultibodyModel {
    /// Called once at the start of a step of length `dt` \[s\]. The model reads changes by the user
    /// here.
    ///
    /// # Errors
    /// [`ModelError`], before anything has moved.
    fn begin_step(&mut self, _dt: f64) -> Result<(), ModelError> {
        Ok(())
    }

    /// `u`, one block per body [m/s, m/s, rad/s].
    fn velocities(&self) -> &[Vec3];

    /// Sets `u`.
    fn set_velocities(&mut self, velocities: &[Vec3]);

    /// Diagonal of `M⁻¹`, one block per body.
    fn inverse_mass(&self) -> &[Vec3];

    /// Dominance and sweeps of bodies; `None` if no body has any.
    fn roles(&self) -> Option<&BodyRoles> {
        None
    }

    /// A number that changes whenever anything changes that decides about contacts, besides places,
    /// velocities, masses and forces: surfaces, their properties, the numbering of bodies.
    ///
    /// `None`, the default, if contacts may change without: every island is then solved in every
    /// step, see [`StepperSettings::keep_rest`](super::StepperSettings::keep_rest).
    fn revision(&self) -> Option<u64> {
        None
    }

    /// Which bodies are at rest in this step, one flag for each; none if no body is.
    /// [`MultibodyModel::detect`] need not find their contacts with each other, or with bodies that
    /// neither move nor can be pushed.
    fn set_resting(&mut self, _resting: &[bool]) {}

    /// Generalised forces `h` [N, N, N m] at the present configuration and the velocities of the
    /// start of the step; `out` holds zeros on entry.
    fn forces(&self, time: f64, out: &mut [Vec3]);

    /// `q ← q + u dt` of one body, with any velocity.
    fn shift(&mut self, body: usize, velocity: &Vec3, dt: f64);

    /// Position of one body, in up to five numbers of the model's own.
    fn configuration(&self, body: usize) -> Configuration;

    /// Centre of mass \[m\] of a body that moves in the plane, where `u` is its velocity and spin.
    /// `None` for other coordinates; corrections of positions then do not keep their angular
    /// momentum.
    fn centre(&self, _body: usize) -> Option<Vec2> {
        None
    }

    /// Half of the least width \[m\] of what has a surface, by its number in [`ContactPoint::surfaces`].
    /// Infinite, the default, if it is not known, or if there is none, as of a segment or of terrain.
    fn half_width(&self, _surface: u32) -> f64 {
        f64::INFINITY
    }

    /// Restores a position from [`MultibodyModel::configuration`], bit for bit.
    fn set_configuration(&mut self, body: usize, configuration: &Configuration);

    /// `q ← q + u dt` of all bodies.
    fn advance(&mut self, dt: f64) {
        for body in 0..self.velocities().len() {
            let velocity = self.velocities()[body];
            self.shift(body, &velocity, dt);
        }
    }

    /// Contacts and joint rows at the present configuration. Includes every contact that may close
    /// within `dt`. The order depends only on the state.
    ///
    /// # Errors
    /// [`ModelError`].
    fn detect(&mut self, dt: f64, out: &mut Detection) -> Result<(), ModelError>;

    /// Whether the last [`MultibodyModel::detect`] has found all that a body may meet if it moves by `moved`
    /// [m, m, rad] from there. Impacts may take it farther than its velocity at the start of the step.
    fn reaches(&self, _body: usize, _moved: &Vec3) -> bool {
        true
    }

    /// Contacts between these pairs of surfaces, numbered and ordered as in
    /// [`MultibodyModel::detect`], without joints. Event location calls this often: provide a
    /// faster version if there is one.
    ///
    /// # Errors
    /// [`ModelError`].
    fn detect_pairs(
        &mut self,
        pairs: &[[u32; 2]],
        dt: f64,
        out: &mut Detection,
    ) -> Result<(), ModelError> {
        self.detect(dt, out)?;
        out.contacts.retain(|c| pairs.contains(&c.surfaces));
        out.near.retain(|n| pairs.contains(&n.surfaces));
        out.joints.clear();
        Ok(())
    }

    /// Adds contacts of bodies that are apart at the present midpoint and overlap at the next one, `dt` \[s\]
    /// later, with the velocities `ends` \[m/s, rad/s\]. Their gap is the one with which the rows of the
    /// present midpoint tell that overlap: `g = g(q + Δt u) − Δt J u`. `known` are the contacts that
    /// [`MultibodyModel::detect`] has found at this midpoint.
    ///
    /// Not needed by models whose gaps are nearly linear within a step.
    fn detect_driven(
        &mut self,
        _ends: &[Vec3],
        _dt: f64,
        _known: &[ContactPoint],
        _out: &mut Detection,
    ) {
    }

    /// Adds all joint rows at the present configuration, in the order of
    /// [`MultibodyModel::detect`]. Position correction calls this often: provide a faster version
    /// if there is one.
    ///
    /// # Errors
    /// [`ModelError`].
    fn detect_joints(&mut self, dt: f64, out: &mut Vec<JointRow>) -> Result<(), ModelError> {
        let mut found = Detection::default();
        self.detect(dt, &mut found)?;
        out.append(&mut found.joints);
        Ok(())
    }

    /// Kinetic energy \[J\] at `velocities`, if [`MultibodyModel::inverse_mass`] contains more than
    /// mass. The difference then counts as work of the forces.
    fn kinetic_energy(&self, _velocities: &[Vec3]) -> Option<f64> {
        None
    }

    /// Potential energy \[J\] of the present configuration; 0 if the model has none.
    fn potential_energy(&self) -> f64 {
        0.0
    }

    /// Called once at the end of a step, before [`MultibodyModel::end_step`], with what to show of bodies
    /// whose joints are open there. All other bodies are shown as they are. The configuration and the
    /// velocities, from which the next step goes on, must not change.
    ///
    /// Not needed by models without joints, or if open joints may be seen.
    fn show(&mut self, _shown: &[Shown]) {}

    /// Called once at the end of a step.
    fn end_step(&mut self) {}
}
