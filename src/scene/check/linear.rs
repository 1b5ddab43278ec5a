//! Checks the block `[linear]`, a mechanism with constant matrices.

use super::*;
use crate::scene::linear::LinearBlock;

pub(super) fn check(at: &At<'_>, block: &LinearBlock) -> Result<(), SceneError> {
    let n = block.coordinates.len();
    if !(1..=3).contains(&n) {
        let value = format!("{n} coordinates");
        return Err(at
            .key("coordinates")
            .out_of_range(value, "1 to 3 coordinates"));
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
        at.vector("normal", &contact.normal, n)?;
        if let Some(tangent) = &contact.tangent {
            at.vector("tangent", tangent, n)?;
        }
        if contact.normal.iter().all(|w| *w == 0.0) {
            return Err(at.key("normal").conflict("no coordinate moves the gap"));
        }
        if contact.friction > 0.0 && contact.tangent.is_none() {
            return Err(at.missing("tangent (friction needs it)"));
        }
    }
    // the only check left to the model: whether the mass matrix is positive definite
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
        if vector.len() != n {
            let expected = format!("{n} numbers, one a coordinate");
            return Err(self.wrong_length(expected, vector.len()));
        }
        Ok(())
    }

    /// Checks a symmetric matrix, given as an array of rows.
    fn matrix(&self, key: &str, rows: &[Vec<f64>], n: usize) -> Result<(), SceneError> {
        let at = self.key(key);
        if rows.len() != n {
            return Err(at.wrong_length(format!("{n} rows, one a coordinate"), rows.len()));
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
