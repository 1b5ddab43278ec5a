use super::{Delassus, Law, Vec2};
use thiserror::Error;

/// One frictional contact problem: find `P` with equations (1) and (2) of [`crate::contact`].
///
/// A plain value: it does not depend on an engine, can be stored, and any solver accepts it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContactProblem {
    /// Delassus operator `G` [1/kg], n blocks by n blocks.
    pub operator: Delassus,
    /// Free term `b` \[m/s\], one pair per block; the second number of a one-row block is ignored.
    pub free: Vec<Vec2>,
    /// One law per block.
    pub laws: Vec<Law>,
}

/// Why a contact problem is invalid.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ContactError {
    /// The operator, free term and laws have different numbers of blocks.
    #[error("contact problem: {blocks} blocks in the operator, {free} free terms, {laws} laws")]
    Shape {
        blocks: usize,
        free: usize,
        laws: usize,
    },
    /// A number is NaN or infinite where it must be finite.
    #[error("contact problem: block {contact} holds a number that is not finite")]
    NonFinite { contact: usize },
    /// Friction, compliance or bounds are outside their range.
    #[error("contact problem: block {contact}: {what} is {value}, must be {allowed}")]
    Range {
        contact: usize,
        what: &'static str,
        value: f64,
        allowed: &'static str,
    },
    /// A block joins two sides that cannot move, or `G` is not a Delassus operator:
    /// `tr G_ii + R ≤ 0`, for one row `G_nn + R ≤ 0`.
    #[error(
        "contact problem: block {contact} joins two sides of infinite mass: the diagonal of its \
         operator must be above 0"
    )]
    Immovable { contact: usize },
}

impl ContactProblem {
    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.laws.len()
    }

    /// Whether the problem has no blocks.
    pub fn is_empty(&self) -> bool {
        self.laws.is_empty()
    }

    /// Checks the whole problem.
    ///
    /// # Errors
    /// [`ContactError::Shape`], [`ContactError::NonFinite`], [`ContactError::Range`] (μ ≥ 0,
    /// R ≥ 0, lower ≤ upper), [`ContactError::Immovable`].
    pub fn validate(&self) -> Result<(), ContactError> {
        if self.operator.blocks() != self.len() || self.free.len() != self.len() {
            return Err(ContactError::Shape {
                blocks: self.operator.blocks(),
                free: self.free.len(),
                laws: self.len(),
            });
        }
        for (contact, law) in self.laws.iter().enumerate() {
            let range = |what, value, allowed| ContactError::Range {
                contact,
                what,
                value,
                allowed,
            };
            let block = self.operator.diagonal(contact);
            let rows = law.rows();
            let coupled = match &self.operator {
                Delassus::Blocks(matrix) => {
                    (matrix.column(contact)).all(|(_, block)| block.iter().all(|x| x.is_finite()))
                }
                // all blocks are finite if the diagonal blocks are
                Delassus::Bodies(_) => true,
            };
            if !self.free[contact].x.is_finite()
                || (rows == 2 && !self.free[contact].y.is_finite())
                || block.iter().any(|x| !x.is_finite())
                || !coupled
            {
                return Err(ContactError::NonFinite { contact });
            }
            match *law {
                Law::Contact {
                    friction,
                    compliance,
                } => {
                    if !(friction >= 0.0 && friction.is_finite()) {
                        return Err(range("friction", friction, "finite and at least 0"));
                    }
                    if !(compliance >= 0.0 && compliance.is_finite()) {
                        return Err(range("compliance", compliance, "finite and at least 0"));
                    }
                }
                Law::Bounded {
                    lower,
                    upper,
                    compliance,
                } => {
                    if lower.is_nan() || upper.is_nan() || lower > upper {
                        return Err(range("lower bound", lower, "at most the upper bound"));
                    }
                    if !(compliance >= 0.0 && compliance.is_finite()) {
                        return Err(range("compliance", compliance, "finite and at least 0"));
                    }
                }
                Law::Pin => {}
            }
            let trace = if rows == 2 {
                block.trace()
            } else {
                block[(0, 0)]
            };
            if trace + law.compliance() <= 0.0 {
                return Err(ContactError::Immovable { contact });
            }
        }
        Ok(())
    }

    /// `G P + b` \[m/s\] of every block, into `out`.
    pub(crate) fn velocities(&self, impulses: &[Vec2], out: &mut Vec<Vec2>) {
        let state = self.operator.start(impulses);
        let read = |(i, b): (usize, &Vec2)| self.operator.read(i, &state) + b;
        out.clear();
        out.extend(self.free.iter().enumerate().map(read));
    }

    /// `ξ = G P + b + (R P_N, 0)` \[m/s\] of every block; the tangential component of a one-row
    /// block is 0.
    pub fn local_velocity(&self, impulses: &[Vec2]) -> Vec<Vec2> {
        let mut xi = Vec::new();
        self.velocities(impulses, &mut xi);
        for (i, x) in xi.iter_mut().enumerate() {
            x.x += self.laws[i].compliance() * impulses[i].x;
            if self.laws[i].rows() == 1 {
                x.y = 0.0;
            }
        }
        xi
    }
}
