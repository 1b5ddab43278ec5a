//! Whether a scene that could be read also makes sense: ranges, references, contradictions.

mod blocks;
mod bodies;
mod joints;
mod linear;
mod machine;
mod planar;
mod repeats;

pub(super) use joints::joints;
pub(super) use planar::{planar, starts, touches};

use super::document::{Document, Segment};
use super::error::{Hint, Place, SceneError};
use super::file::{Gravity, Header, Material, SceneFile, Step};
use crate::dynamics::Scheme;
use crate::solver::SOLVERS;

/// Checks everything that can be checked without placing the bodies.
///
/// # Errors
/// The first fault found, see [`SceneError`].
pub(super) fn check(file: &SceneFile, document: &Document) -> Result<(), SceneError> {
    let top = At::top(document);
    header(&top.key("scene"), &file.scene)?;
    gravity(&top.key("gravity"), &file.gravity)?;
    step(&top.key("step"), &file.step)?;
    distinct(
        &top.key("material"),
        "material",
        file.material.iter().map(|m| m.name.as_str()),
    )?;
    let closed_form = planar::is_planar(&file.body);
    for (index, material) in file.material.iter().enumerate() {
        let at = top.key("material").index(index);
        check_material(&at, material)?;
        if closed_form {
            planar::check_material(&at, material)?;
        }
    }
    bodies::check(&top, file)?;
    repeats::check(&top, file)?;
    blocks::check(&top, file)
}

/// A place in the document under which values are checked.
#[derive(Clone)]
pub(super) struct At<'a> {
    document: &'a Document,
    path: Vec<Segment>,
}

/// A closed range of numbers and how it is told to the user.
#[derive(Clone, Copy)]
struct Range {
    least: f64,
    most: f64,
    text: &'static str,
}

const fn range(least: f64, most: f64, text: &'static str) -> Range {
    Range { least, most, text }
}

// Wide enough for scenes from a millimetre to a hundred metres, on bodies far from the origin;
// narrow enough that no product of a few of them leaves f64 or drowns in round-off.
const SIZE: Range = range(1e-6, 1e6, "1e-6 to 1e6 m");
const PLACE: Range = range(-1e9, 1e9, "-1e9 to 1e9 m");
const ANGLE: Range = range(-1e6, 1e6, "-1e6 to 1e6 rad");
const SPEED: Range = range(-1e6, 1e6, "-1e6 to 1e6 m/s");
const SPIN: Range = range(-1e6, 1e6, "-1e6 to 1e6 rad/s");
const MASS: Range = range(1e-12, 1e12, "1e-12 to 1e12 kg");
const DENSITY: Range = range(1e-9, 1e9, "1e-9 to 1e9 kg/m²");
const INERTIA: Range = range(1e-18, 1e18, "1e-18 to 1e18 kg m²");
const TORQUE: Range = range(0.0, 1e12, "0 to 1e12 N m");
const FRICTION: Range = range(0.0, 1000.0, "0 to 1000");
const RESTITUTION: Range = range(0.0, 1.0, "0 to 1");
const DAMPING_RESTITUTION: Range = range(1e-3, 1.0, "0.001 to 1");
const STIFFNESS: Range = range(1e-3, 1e15, "1e-3 to 1e15 N/m");
const DAMPING: Range = range(0.0, 1e12, "0 to 1e12 N s/m");
const SCALE: Range = range(-1e3, 1e3, "-1000 to 1000");
const ACCELERATION: Range = range(-1e6, 1e6, "-1e6 to 1e6 m/s²");
const MAGNITUDE: Range = range(0.0, 1e6, "0 to 1e6 m/s²");
const SLOPE: Range = range(-1e6, 1e6, "-1e6 to 1e6");
const DT: Range = range(1e-9, 1.0, "1e-9 to 1 s");
const TIME: Range = range(0.0, 1e9, "0 to 1e9 s");
const TOLERANCE: Range = range(1e-15, 1e-2, "1e-15 to 1e-2");

impl<'a> At<'a> {
    fn top(document: &'a Document) -> Self {
        At {
            document,
            path: Vec::new(),
        }
    }

    fn key(&self, key: &str) -> Self {
        self.then(Segment::Key(key.to_owned()))
    }

    fn index(&self, index: usize) -> Self {
        self.then(Segment::Index(index))
    }

    fn then(&self, segment: Segment) -> Self {
        let mut at = self.clone();
        at.path.push(segment);
        at
    }

    fn place(&self) -> Box<Place> {
        self.document.place(&self.path)
    }

    fn within(&self, key: &str, value: f64, range: Range) -> Result<(), SceneError> {
        if (range.least..=range.most).contains(&value) {
            return Ok(());
        }
        Err(SceneError::OutOfRange {
            at: self.key(key).place(),
            value: format!("{value:?}"),
            allowed: range.text.to_owned(),
        })
    }

    fn within_if(&self, key: &str, value: Option<f64>, range: Range) -> Result<(), SceneError> {
        value.map_or(Ok(()), |value| self.within(key, value, range))
    }

    fn pair(&self, key: &str, pair: [f64; 2], range: Range) -> Result<(), SceneError> {
        for (index, value) in pair.into_iter().enumerate() {
            if !(range.least..=range.most).contains(&value) {
                return Err(SceneError::OutOfRange {
                    at: self.key(key).index(index).place(),
                    value: format!("{value:?}"),
                    allowed: range.text.to_owned(),
                });
            }
        }
        Ok(())
    }

    /// Checks point `index` of a list.
    fn at_point(&self, index: usize, point: [f64; 2]) -> Result<(), SceneError> {
        const CORNER: Range = range(-1e6, 1e6, "-1e6 to 1e6 m");
        for (axis, value) in point.into_iter().enumerate() {
            if !(CORNER.least..=CORNER.most).contains(&value) {
                return Err(SceneError::OutOfRange {
                    at: self.index(index).index(axis).place(),
                    value: format!("{value:?}"),
                    allowed: CORNER.text.to_owned(),
                });
            }
        }
        Ok(())
    }

    fn count(&self, key: &str, value: u32, least: u32, most: u32) -> Result<(), SceneError> {
        if (least..=most).contains(&value) {
            return Ok(());
        }
        Err(SceneError::OutOfRange {
            at: self.key(key).place(),
            value: value.to_string(),
            allowed: format!("{least} to {most}"),
        })
    }

    /// A name that can stand in a path of keys, a file name and a CSV column.
    fn name(&self, key: &str, name: &str) -> Result<(), SceneError> {
        let good = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if (1..=64).contains(&name.len()) && name.chars().all(good) {
            return Ok(());
        }
        Err(SceneError::OutOfRange {
            at: self.key(key).place(),
            value: format!("{name:?}"),
            allowed: "1 to 64 letters, digits, `-` and `_`".to_owned(),
        })
    }

    fn conflict(&self, problem: impl Into<String>) -> SceneError {
        SceneError::Conflict {
            at: self.place(),
            problem: problem.into(),
        }
    }

    fn unknown<S: AsRef<str>>(
        &self,
        what: &str,
        name: &str,
        known: impl IntoIterator<Item = S>,
    ) -> SceneError {
        SceneError::UnknownName {
            at: self.place(),
            what: what.to_owned(),
            name: name.to_owned(),
            hint: Hint::new(name, known),
        }
    }
}

/// Refuses two elements of one array with the same name.
fn distinct<'n>(
    array: &At<'_>,
    what: &'static str,
    names: impl Iterator<Item = &'n str>,
) -> Result<(), SceneError> {
    let mut seen = std::collections::HashSet::new();
    for (index, name) in names.enumerate() {
        if !seen.insert(name) {
            return Err(SceneError::Duplicate {
                at: array.index(index).key("name").place(),
                what,
                name: name.to_owned(),
            });
        }
    }
    Ok(())
}

fn header(at: &At<'_>, header: &Header) -> Result<(), SceneError> {
    at.name("name", &header.name)?;
    let title = &header.title;
    if title.trim().is_empty() || title.chars().any(char::is_control) || title.len() > 120 {
        return Err(SceneError::OutOfRange {
            at: at.key("title").place(),
            value: format!("{title:?}"),
            allowed: "one line of 1 to 120 bytes".to_owned(),
        });
    }
    Ok(())
}

fn gravity(at: &At<'_>, gravity: &Gravity) -> Result<(), SceneError> {
    let polar = [
        ("magnitude", gravity.magnitude),
        ("angle", gravity.angle),
        ("slope", gravity.slope),
    ];
    let components = gravity.x.is_some() || gravity.y.is_some();
    let given = polar.iter().find(|(_, value)| value.is_some());
    if let (true, Some((key, _))) = (components, given) {
        let problem = "give either x, y or magnitude with angle or slope, not both";
        return Err(at.key(key).conflict(problem));
    }
    if gravity.angle.is_some() && gravity.slope.is_some() {
        return Err(at.key("slope").conflict("give angle or slope, not both"));
    }
    at.within_if("x", gravity.x, ACCELERATION)?;
    at.within_if("y", gravity.y, ACCELERATION)?;
    at.within_if("magnitude", gravity.magnitude, MAGNITUDE)?;
    at.within_if("angle", gravity.angle, ANGLE)?;
    at.within_if("slope", gravity.slope, SLOPE)
}

fn step(at: &At<'_>, step: &Step) -> Result<(), SceneError> {
    at.within("dt", step.dt, DT)?;
    at.within("time", step.time, TIME)?;
    at.within("tolerance", step.tolerance, TOLERANCE)?;
    if !SOLVERS.contains(&step.solver.as_str()) {
        return Err(at.key("solver").unknown("solver", &step.solver, SOLVERS));
    }
    if step.events && step.scheme == Scheme::Moreau {
        let problem = "event location needs the scheme staggered; moreau ignores gaps";
        return Err(at.key("events").conflict(problem));
    }
    Ok(())
}

fn check_material(at: &At<'_>, material: &Material) -> Result<(), SceneError> {
    at.name("name", &material.name)?;
    at.within("friction", material.friction, FRICTION)?;
    at.within("restitution", material.restitution, RESTITUTION)?;
    at.within_if("stiffness", material.stiffness, STIFFNESS)?;
    at.within_if("damping", material.damping, DAMPING)?;
    at.within_if(
        "damping_restitution",
        material.damping_restitution,
        DAMPING_RESTITUTION,
    )?;
    if material.damping.is_some() && material.damping_restitution.is_some() {
        return Err(at
            .key("damping_restitution")
            .conflict("give damping or damping_restitution, not both"));
    }
    if material.stiffness.is_none() {
        for (key, given) in [
            ("damping", material.damping),
            ("damping_restitution", material.damping_restitution),
        ] {
            if given.is_some() {
                return Err(at.key(key).conflict("damping needs a stiffness"));
            }
        }
    } else if material.restitution != 0.0 {
        return Err(at.key("restitution").conflict(
            "restitution has no effect on a compliant contact; use damping_restitution",
        ));
    }
    Ok(())
}
