//! One table of all keys of a scene file: allowed values, unit and meaning.
//!
//! The ranges are wide enough for scenes from a millimetre to a hundred metres, with bodies far from
//! the origin. They are narrow enough that no product of a few numbers overflows `f64` or is lost in
//! round-off. `scene::check` checks what concerns several keys at once.

use super::document::{Document, Node, Segment, Value};
use super::error::{Hint, SceneError};
use crate::oracles::SOLVERS;
use Allowed::{Flag, Line, Name, Real, Text, Whole, Word};
use std::fmt;

/// A key of a scene file.
#[derive(Debug, Clone, Copy)]
pub struct Key {
    /// Path of blocks and name, without numbers or names of array elements: `body.parts.disc`.
    pub path: &'static str,
    pub allowed: Allowed,
    /// Unit of the number, or of each number of an array; empty for none.
    pub unit: &'static str,
    /// Meaning and default.
    pub meaning: &'static str,
}

/// Allowed values of a key; for an array, of each element.
#[derive(Debug, Clone, Copy)]
pub enum Allowed {
    /// Real numbers from the first to the second.
    Real(f64, f64),
    /// Whole numbers from the first to the second.
    Whole(u32, u32),
    /// A name that fits in a path of keys, a file name and a CSV column.
    Name,
    /// One line of text.
    Line,
    /// Any text; names of bodies and the like are checked against the whole file elsewhere.
    Text,
    /// One of these words.
    Word(&'static [&'static str]),
    /// `true` or `false`.
    Flag,
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Real(least, most) => write!(f, "{} to {}", shown(*least), shown(*most)),
            Whole(least, most) => write!(f, "{least} to {most}"),
            Name => write!(f, "1 to 64 letters, digits, `-` and `_`"),
            Line => write!(f, "one line of 1 to 120 bytes"),
            Text => write!(f, "text"),
            Word(words) => write!(f, "{}", words.join(", ")),
            Flag => write!(f, "true, false"),
        }
    }
}

fn shown(x: f64) -> String {
    match x.abs() {
        size if size != 0.0 && !(0.1..1e4).contains(&size) => format!("{x:e}"),
        _ => x.to_string(),
    }
}

/// Wear coefficients that can be given \[m²/N\].
pub const COEFFICIENTS: [f64; 2] = [1e-30, 1.0];

const fn key(
    path: &'static str,
    allowed: Allowed,
    unit: &'static str,
    meaning: &'static str,
) -> Key {
    Key {
        path,
        allowed,
        unit,
        meaning,
    }
}

const SIZE: Allowed = Real(1e-6, 1e6);
const PLACE: Allowed = Real(-1e9, 1e9);
const POINT: Allowed = Real(-1e6, 1e6);
const ANGLE: Allowed = Real(-1e6, 1e6);
const SPEED: Allowed = Real(-1e6, 1e6);
const GAIN: Allowed = Real(0.0, 1e15);
const TORQUE: Allowed = Real(0.0, 1e12);
const FRICTION: Allowed = Real(0.0, 1000.0);
const MATRIX: Allowed = Real(-1e12, 1e12);
/// Most bodies that a scene may place: an extra zero in `count` must not fill the memory.
pub(super) const MOST_BODIES: u32 = 100_000;

/// All keys but those of the threshing machine and its study. Their `[wear]` has a `coefficient` of the
/// same range.
#[rustfmt::skip]
pub const KEYS: &[Key] = &[
    key("scene.name", Name, "", "Name of the scene and of its output folder"),
    key("scene.title", Line, "", "What the scene shows"),
    key("scene.notes", Text, "", "Remarks for readers of the results; default none"),

    key("gravity.x", Real(-1e6, 1e6), "m/s²", "Component of gravity; default 0"),
    key("gravity.y", Real(-1e6, 1e6), "m/s²", "Component of gravity; default -9.81"),
    key("gravity.magnitude", Real(0.0, 1e6), "m/s²", "In place of x and y; default 9.81"),
    key("gravity.angle", ANGLE, "rad", "Angle of gravity from straight down, positive towards +x: tilts the scene without inclined bodies; default 0"),
    key("gravity.slope", Real(-1e6, 1e6), "", "Tangent of the angle of gravity, in place of `angle`"),

    key("step.dt", Real(1e-9, 1.0), "s", "Step length; default 1/60"),
    key("step.time", Real(0.0, 1e9), "s", "Simulated time; default 10"),
    key("step.scheme", Word(&["staggered", "moreau"]), "", "Time-stepping scheme; default staggered"),
    key("step.events", Flag, "", "Whether the time of all impacts is located within the step; staggered only; default false: only that of fast bodies, and of impacts that would leave a few bodies overlapped"),
    key("step.impact_law", Word(&["capped", "newton", "uniform"]), "", "Impact law; default capped: Newton's law, bounded so that it never adds energy"),
    key("step.recovery", Flag, "", "Whether bodies that overlap at the start are moved apart; staggered only; default true"),
    key("step.keep_rest", Flag, "", "Whether islands at rest keep their impulses until something about them changes, instead of being solved in every step; default true"),
    key("step.split_islands", Flag, "", "Whether bodies that contacts and joints connect are solved by themselves, instead of all in one problem; with events and swept bodies they always are; default true"),
    key("step.skip_distant", Flag, "", "Whether contacts that the impulses of the others do not close are left out of the solve; default true"),
    key("step.skip_tangents", Flag, "", "Whether contacts without friction have one row, instead of two with a friction of 1e-12; default true"),
    key("step.effort", Word(&["fast", "exact"]), "", "How hard the impulses of islands of more than 500 contacts in motion are looked for: fast, by a hundred sweeps with momentum, default; exact, if they are not certified also by the solver, in some 50 to 150 factorisations"),
    key("step.shares", Word(&["found", "minimum-norm"]), "", "Impulse distribution over redundant contacts; default found: that of the solver; minimum-norm: that of least norm"),
    key("step.solver", Word(&SOLVERS), "", "Impulse solver; default auto"),
    key("step.tolerance", Real(1e-15, 1e-2), "", "Relative natural-map residual at which a solve counts as solved; default 1e-8"),

    key("material.name", Name, "", "Name by which bodies refer to the material"),
    key("material.friction", FRICTION, "", "Coulomb's coefficient; two materials combine by the mean; default 0.5"),
    key("material.restitution", Real(0.0, 1.0), "", "Newton's coefficient; default 0"),
    key("material.stiffness", Real(1e-3, 1e15), "N/m", "Kelvin-Voigt stiffness of a contact point, which makes contacts compliant; default rigid"),
    key("material.damping", Real(0.0, 1e12), "N s/m", "Damping of a compliant contact point; default 0"),
    key("material.damping_restitution", Real(1e-3, 1.0), "", "In place of damping: the restitution of a body's impact on a fixed compliant surface"),

    key("body.name", Name, "", "Unique name; not `world`"),
    key("body.kind", Word(&["dynamic", "fixed", "kinematic"]), "", "dynamic: moved by forces; fixed: at rest; kinematic: moves at its own constant velocity; default dynamic"),
    key("body.disc", SIZE, "m", "Shape: radius"),
    key("body.box", SIZE, "m", "Shape: [width, height]"),
    key("body.capsule", SIZE, "m", "Shape: [length between the centres of the round ends along the body's x axis, radius]"),
    key("body.polygon", POINT, "m", "Shape: corners [x, y], convex, counter-clockwise"),
    key("body.sector", Real(1e-6, 1e6), "m, m, rad", "Shape: a voussoir, [mean radius, thickness, angle] of a straight-sided sector of a ring round the body's origin, its axis along x"),
    key("body.polyline", POINT, "m", "Shape: points [x, y] of a one-sided chain, the solid on the left of its direction"),
    key("body.closed", Flag, "", "Whether a polyline's last point is joined to its first: the outline of a solid, whichever way it is wound; default false"),
    key("body.hollow", Flag, "", "Whether the solid is outside of a closed polyline; default false"),
    key("body.two_sided", Flag, "", "Whether a polyline touches from both sides, as rapier's plain polylines do; default false"),
    key("body.rod", SIZE, "m", "Shape: length of a thin rod along the body's x axis that touches with its two ends; makes the scene planar"),
    key("body.line", Flag, "", "Shape: true for the body's x axis without end, the solid below it; fixed or kinematic; makes the scene planar"),
    key("body.bowl", SIZE, "m", "Shape: radius of a circle touched from inside; fixed or kinematic; makes the scene planar"),
    key("body.parts.disc", SIZE, "m", "Part of a body of several shapes, which may overlap: as `body.disc`"),
    key("body.parts.box", SIZE, "m", "Part: as `body.box`"),
    key("body.parts.capsule", SIZE, "m", "Part: as `body.capsule`"),
    key("body.parts.polygon", POINT, "m", "Part: as `body.polygon`"),
    key("body.parts.position", PLACE, "m", "Position of the part in the body's frame; default [0, 0]"),
    key("body.parts.angle", ANGLE, "rad", "Angle of the part in the body's frame; default 0"),
    key("body.density", Real(1e-9, 1e9), "kg/m²", "Mass per area of a slice one metre deep; default 1000 if no mass is given"),
    key("body.mass", Real(1e-12, 1e12), "kg", "Mass, in place of density"),
    key("body.inertia", Real(1e-18, 1e18), "kg m²", "Moment of inertia about the centre of mass; default: that of evenly spread mass"),
    key("body.position", PLACE, "m", "Position of the body's origin; default [0, 0]"),
    key("body.angle", ANGLE, "rad", "Angle of the body; default 0"),
    key("body.velocity", SPEED, "m/s", "Velocity at the start, constant for a kinematic body; default [0, 0]"),
    key("body.spin", SPEED, "rad/s", "Angular velocity at the start, constant for a kinematic body; default 0"),
    key("body.material", Text, "", "Name of a `[[material]]`; default the first one"),
    key("body.surface_velocity", SPEED, "m/s", "Tangential velocity of the surface, as of a belt, positive counter-clockwise round the body; default 0"),
    key("body.one_way", PLACE, "", "Unit vector in the body's frame: the surface pushes only in this direction, within 0.1 rad, and bodies from other sides pass through; default: it pushes in all directions"),
    key("body.ccd", Flag, "", "Whether the times of all impacts of a dynamic body are located, as with rapier's `ccd_enabled` and Box2D's bullets; staggered only; default false"),
    key("body.gravity_scale", Real(-1e3, 1e3), "", "Factor on the weight of a dynamic body; default 1"),
    key("body.linear_damping", Real(0.0, 1e9), "1/s", "Drag of a dynamic body, at most 1/dt; default 0"),
    key("body.angular_damping", Real(0.0, 1e9), "1/s", "The same for the angular velocity"),
    key("body.oscillation.amplitude", PLACE, "m", "Kinematic body of a planar scene: amplitude A of a motion A sin(ω t), added to its velocity"),
    key("body.oscillation.angular_frequency", Real(1e-6, 1e6), "rad/s", "Angular frequency ω of the oscillation"),
    key("body.touches", Text, "", "Names of the bodies that the body may touch in a planar scene; default all"),

    key("joint.kind", Word(&["revolute", "prismatic", "fixed", "rope", "spring", "pin-slot"]), "", "revolute: turns about `at`; prismatic: slides along `axis`; fixed: no relative motion; rope: distance of at most `length`; spring: spring between two points; pin-slot: turns and slides"),
    key("joint.bodies", Text, "", "Names of two bodies; one may be `world`"),
    key("joint.at", PLACE, "m", "Position in the world at the start; for all kinds but rope and spring"),
    key("joint.anchors", POINT, "m", "Rope or spring: a point of each body, in the world at the start"),
    key("joint.axis", PLACE, "", "Direction in which a prismatic or pin-slot joint slides, in the world at the start; any length; default [1, 0]"),
    key("joint.limits", PLACE, "m or rad", "Lower and upper limit of the free coordinate; default none"),
    key("joint.length", Real(0.0, 1e9), "m", "Length of a rope, or rest length of a spring; default: the distance at the start"),
    key("joint.stiffness", GAIN, "N/m", "Stiffness of a spring"),
    key("joint.damping", GAIN, "N s/m", "Damping of a spring; default 0"),
    key("joint.contacts", Flag, "", "Whether the two bodies can be in contact; default false"),
    key("joint.motor.speed", SPEED, "rad/s or m/s", "Target rate of the free coordinate"),
    key("joint.motor.target", PLACE, "rad or m", "Target value of the free coordinate, for a motor with a stiffness; default 0"),
    key("joint.motor.stiffness", GAIN, "N m/rad or N/m", "Stiffness towards the target, in place of a speed"),
    key("joint.motor.damping", GAIN, "N m s/rad or N s/m", "Damping of a motor with a stiffness; default 0"),
    key("joint.motor.max_torque", TORQUE, "N m", "Largest torque at a revolute joint; required with a speed, else default none"),
    key("joint.motor.max_force", TORQUE, "N", "Largest force at a prismatic or pin-slot joint; required with a speed, else default none"),

    key("wear.body", Text, "", "Name of a body that wears by Archard's law where it is touched: a disc, box, polygon, sector or one-sided polyline, without surface_velocity; the stiffness of its contacts counts per metre of its surface"),
    key("wear.coefficient", Real(COEFFICIENTS[0], COEFFICIENTS[1]), "m²/N", "Wear coefficient K of its material: worn volume per load and slip"),
    key("wear.edges", Whole(0, 1_000_000), "", "[first, last] of the edges that wear, from 0: of a box the lower one is 0, of a polygon or polyline the one from its first point, counter-clockwise round a solid; may go round a closed outline; default all"),
    key("wear.cell", Real(1e-9, 1e3), "m", "Length of a cell, at most twice the shortest edge that wears, and at least a 10 000th of all that wear; default that edge; a disc becomes a polygon of such edges, default 64"),
    key("wear.mass", Flag, "", "Whether the body loses the mass and inertia of what is worn; default false"),
    key("life.duration", Real(1e-6, 1e12), "s", "Wear to reach; measured cycles of `step.time` alternate with jumps"),
    key("life.jump", Real(1e-9, 1.0), "m", "Largest depth of a jump; bounded further by the mesh and by the feedback of depth on load; default 2e-4"),
    key("life.settle", Real(0.0, 1e9), "s", "Simulated time before each measured cycle; default as long as the cycle"),

    key("repeat.of", Text, "", "Name of the body to copy; the body itself is not placed"),
    key("repeat.name", Name, "", "Name of the copies: `box[3,2]` is column 3 of row 2, counted from 0; default the body's name"),
    key("repeat.count", Whole(1, u32::MAX), "", "Number of copies along each step, one to four numbers: [columns, rows, ...]"),
    key("repeat.step", POINT, "m", "One displacement for each number in count"),
    key("repeat.shrink", Whole(0, u32::MAX), "", "Each row has this many copies fewer and starts half as many columns later: 1 makes a pyramid; default 0"),
    key("repeat.ring.centre", PLACE, "m", "Centre of a circle of copies, in place of a grid; each copy is turned by its angle on the circle"),
    key("repeat.ring.radius", Real(0.0, 1e6), "m", "Radius of the circle"),
    key("repeat.ring.count", Whole(1, MOST_BODIES), "", "Number of copies on the circle"),
    key("repeat.ring.arc", ANGLE, "rad", "Start and end angle of the copies; default the whole circle"),
    key("repeat.pin", PLACE, "m", "Joins each copy of a row or ring to the next by a revolute joint at this point of its own frame"),
    key("repeat.pins", POINT, "m", "The same for a grid: one point for each number in count"),
    key("repeat.fixed", Whole(0, u32::MAX), "", "Copies that are fixed bodies, by their numbers in the grid: [[0, 3], [9, 3]]"),
    key("repeat.jitter", Real(0.0, 1e6), "m", "Largest random displacement along x and y; default 0"),
    key("repeat.radius_spread", Real(0.0, 0.9), "", "For discs: radii are drawn evenly from r (1 ± radius_spread); default 0"),
    key("repeat.seed", Whole(0, u32::MAX), "", "Seed of the random numbers; required with jitter or radius_spread"),

    key("linear.coordinates", Text, "", "Names of one to three coordinates of M q'' + K q = f"),
    key("linear.mass", MATRIX, "", "M in rows, symmetric and positive definite"),
    key("linear.stiffness", MATRIX, "", "K in rows, symmetric; default 0"),
    key("linear.load", MATRIX, "", "f, gravity included; default 0"),
    key("linear.position", MATRIX, "", "q at the start; default 0"),
    key("linear.velocity", MATRIX, "", "q' at the start; default 0"),
    key("linear.contact.name", Name, "", "Unique name"),
    key("linear.contact.gap", MATRIX, "m", "Gap at coordinates 0"),
    key("linear.contact.normal", MATRIX, "", "Derivative of the gap by each coordinate"),
    key("linear.contact.tangent", MATRIX, "", "Derivative of the sliding distance by each coordinate; default 0"),
    key("linear.contact.friction", FRICTION, "", "Coulomb's coefficient; default 0"),
    key("linear.contact.restitution", Real(0.0, 1.0), "", "Newton's coefficient; default 0"),

    key("verdict.overlap", Real(0.0, 1.0), "", "Up to which overlap that lasts 0.25 s a run counts as held, over the size of the smaller body; default 1e-3"),
    key("verdict.deepest", Real(0.0, 1e6), "", "Up to which overlap at the end of any step a run counts as held, over the width of the thinner body; default 0.5"),
    key("verdict.joint_gap", Real(0.0, 1.0), "", "Up to which gap of a pin or weld that lasts 0.25 s a run counts as held, over the size of the smaller body; default 1e-3"),
    key("verdict.energy", Real(0.0, 1e6), "", "Up to which energy given by rigid contacts and joints in all a run counts as held, over the energy of the scene; default 1e-3"),
    key("verdict.imbalance", Real(0.0, 1e6), "", "Up to which error of the energy balance of a step a run counts as held, over the energy of the scene; default 1e-9"),
    key("verdict.bounded", Real(0.0, 1e6), "", "Up to which overlap in a second a run counts as held that islands which are not certified may have added, on average, over the size of the smallest moving body; default 1"),
    key("reference.closed_form", Text, "", "The closed form that the result is compared with; none: no comparison. It must fit the scene"),
];

/// All keys as a table in Markdown.
pub fn listing() -> String {
    let head = "| key | allowed | meaning |\n|---|---|---|\n";
    let rows = KEYS.iter().map(|key| {
        let allowed = format!("{} {}", key.allowed, key.unit);
        let (path, meaning) = (key.path, key.meaning);
        format!("| `{path}` | {} | {meaning} |\n", allowed.trim_end())
    });
    std::iter::once(head.to_owned()).chain(rows).collect()
}

/// Checks every value of the document against its row.
///
/// # Errors
/// [`SceneError::OutOfRange`]; [`SceneError::UnknownName`] for a word that is none of those allowed.
pub(super) fn check(document: &Document) -> Result<(), SceneError> {
    let mut walk = Walk {
        document,
        path: String::new(),
        segments: Vec::new(),
    };
    walk.node(&document.root)
}

struct Walk<'d> {
    document: &'d Document,
    path: String,
    segments: Vec<Segment>,
}

impl Walk<'_> {
    fn node(&mut self, node: &Node) -> Result<(), SceneError> {
        match &node.value {
            Value::Table(entries) => {
                for entry in entries {
                    let length = self.path.len();
                    if length > 0 {
                        self.path.push('.');
                    }
                    self.path.push_str(&entry.key);
                    self.segments.push(Segment::Key(entry.key.clone()));
                    self.node(&entry.node)?;
                    self.segments.pop();
                    self.path.truncate(length);
                }
                Ok(())
            }
            Value::Array(items) => {
                for (index, item) in items.iter().enumerate() {
                    self.segments.push(Segment::Index(index));
                    self.node(item)?;
                    self.segments.pop();
                }
                Ok(())
            }
            value => match KEYS.iter().find(|key| key.path == self.path) {
                Some(key) => self.value(key, value),
                // a key of a block that is checked elsewhere: the reader has refused unknown keys
                None => Ok(()),
            },
        }
    }

    fn value(&self, key: &Key, value: &Value) -> Result<(), SceneError> {
        let good = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        let (fits, shown) = match (key.allowed, value) {
            (Real(least, most), Value::Float(x)) => ((least..=most).contains(x), format!("{x:?}")),
            (Real(least, most), Value::Integer(n)) => {
                let x = *n as f64;
                ((least..=most).contains(&x), format!("{x:?}"))
            }
            (Whole(least, most), Value::Integer(n)) => {
                let range = i64::from(least)..=i64::from(most);
                (range.contains(n), n.to_string())
            }
            (Name, Value::String(text)) => {
                let fits = (1..=64).contains(&text.len()) && text.chars().all(good);
                (fits, format!("{text:?}"))
            }
            (Line, Value::String(text)) => {
                let fits = !text.trim().is_empty() && text.len() <= 120;
                (
                    fits && !text.chars().any(char::is_control),
                    format!("{text:?}"),
                )
            }
            (Word(words), Value::String(text)) if !words.contains(&text.as_str()) => {
                return Err(SceneError::UnknownName {
                    at: self.document.place(&self.segments),
                    what: key.path.rsplit('.').next().unwrap_or_default().to_owned(),
                    name: text.clone(),
                    hint: Hint::new(text, words),
                });
            }
            _ => return Ok(()),
        };
        if fits {
            return Ok(());
        }
        Err(SceneError::OutOfRange {
            at: self.document.place(&self.segments),
            value: shown,
            allowed: format!("{} {}", key.allowed, key.unit)
                .trim_end()
                .to_owned(),
        })
    }
}
