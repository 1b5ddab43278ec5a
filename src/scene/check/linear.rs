//! The block of a mechanism with constant matrices.

use super::*;
use crate::scene::linear::LinearBlock;

const NUMBER: Range = range(-1e12, 1e12, "-1e12 to 1e12");

pub(super) fn check(at: &At<'_>, block: &LinearBlock) -> Result<(), SceneError> {
    let n = block.coordinates.len();
    if !(1..=3).contains(&n) {
        return Err(SceneError::OutOfRange {
            at: at.key("coordinates").place(),
            value: format!("{n} coordinates"),
            allowed: "1 to 3 coordinates".to_owned(),
        });
    }
    for (index, name) in block.coordinates.iter().enumerate() {
        if block.coordinates[..index].contains(name) {
            return Err(SceneError::Duplicate {
                at: at.key("coordinates").index(index).place(),
                what: "coordinate",
                name: name.clone(),
            });
        }
    }
    at.matrix("mass", &block.mass, n)?;
    if let Some(stiffness) = &block.stiffness {
        at.matrix("stiffness", stiffness, n)?;
    }
    for (key, vector) in [
        ("load", &block.load),
        ("position", &block.position),
        ("velocity", &block.velocity),
    ] {
        if let Some(vector) = vector {
            at.vector(key, vector, n)?;
        }
    }
    let contacts = at.key("contact");
    distinct(
        &contacts,
        "contact",
        block.contact.iter().map(|c| c.name.as_str()),
    )?;
    for (index, contact) in block.contact.iter().enumerate() {
        let at = contacts.index(index);
        at.name("name", &contact.name)?;
        at.within("gap", contact.gap, NUMBER)?;
        at.vector("normal", &contact.normal, n)?;
        if let Some(tangent) = &contact.tangent {
            at.vector("tangent", tangent, n)?;
        }
        at.within("friction", contact.friction, FRICTION)?;
        at.within("restitution", contact.restitution, RESTITUTION)?;
        if contact.normal.iter().all(|w| *w == 0.0) {
            return Err(at.key("normal").conflict("no coordinate moves the gap"));
        }
        if contact.friction > 0.0 && contact.tangent.is_none() {
            return Err(SceneError::Missing {
                at: at.place(),
                key: "tangent (friction needs it)".to_owned(),
            });
        }
    }
    // what is left to the model: only whether the mass is positive definite
    block.model().map(|_| ()).map_err(|_| {
        at.key("mass")
            .conflict("the mass matrix must be positive definite")
    })
}

impl At<'_> {
    fn vector(&self, key: &str, vector: &[f64], n: usize) -> Result<(), SceneError> {
        self.key(key).numbers(vector, n)
    }

    fn numbers(&self, vector: &[f64], n: usize) -> Result<(), SceneError> {
        let at = self;
        if vector.len() != n {
            return Err(SceneError::WrongType {
                at: at.place(),
                expected: format!("{n} numbers, one a coordinate"),
                found: format!("{} of them", vector.len()),
            });
        }
        match vector
            .iter()
            .position(|x| !(NUMBER.least..=NUMBER.most).contains(x))
        {
            None => Ok(()),
            Some(index) => Err(SceneError::OutOfRange {
                at: at.index(index).place(),
                value: format!("{:?}", vector[index]),
                allowed: NUMBER.text.to_owned(),
            }),
        }
    }

    /// A symmetric matrix as an array of rows.
    fn matrix(&self, key: &str, rows: &[Vec<f64>], n: usize) -> Result<(), SceneError> {
        let at = self.key(key);
        if rows.len() != n {
            return Err(SceneError::WrongType {
                at: at.place(),
                expected: format!("{n} rows, one a coordinate"),
                found: format!("{} of them", rows.len()),
            });
        }
        for (i, row) in rows.iter().enumerate() {
            at.index(i).numbers(row, n)?;
            if let Some(j) = (0..i).find(|&j| rows[j][i] != row[j]) {
                let problem = format!("the matrix is not symmetric: row {i}, column {j}");
                return Err(at.index(i).index(j).conflict(problem));
            }
        }
        Ok(())
    }
}
