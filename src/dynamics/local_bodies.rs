//! The bodies of an island by numbers of its own.

use crate::contact::{BodyOperator, NO_BODY, Rows, Vec3};

/// Numbers of bodies in an island, filled for one after the other.
#[derive(Default)]
pub(super) struct LocalBodies {
    number: Vec<u32>,
    /// The bodies by their numbers.
    pub bodies: Vec<u32>,
}

impl LocalBodies {
    /// Writes the rows of some blocks over their own bodies, which come in the order in which they
    /// are met.
    pub fn operator(
        &mut self,
        members: &[u32],
        rows: impl Fn(usize) -> Rows,
        inverse_mass: &[Vec3],
        op: &mut BodyOperator,
    ) {
        let LocalBodies { number, bodies } = self;
        number.resize(inverse_mass.len(), NO_BODY);
        op.inverse_mass.clear();
        op.rows.clear();
        bodies.clear();
        for &i in members {
            let mut rows = rows(i as usize);
            for body in rows.bodies.iter_mut().filter(|b| **b != NO_BODY) {
                let own = &mut number[*body as usize];
                if *own == NO_BODY {
                    *own = bodies.len() as u32;
                    op.inverse_mass.push(inverse_mass[*body as usize]);
                    bodies.push(*body);
                }
                *body = *own;
            }
            op.rows.push(rows);
        }
        for &body in &*bodies {
            number[body as usize] = NO_BODY;
        }
    }
}
