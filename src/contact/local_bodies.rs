//! Local numbers for the bodies of some blocks.

use super::{BodyOperator, NO_BODY, Rows, Vec3};

/// Local body numbers of one island, or another part of a problem, after the other.
#[derive(Default)]
pub(crate) struct LocalBodies {
    number: Vec<u32>,
    /// The bodies, by local number.
    pub bodies: Vec<u32>,
}

impl LocalBodies {
    /// Writes the rows of some blocks with local body numbers, assigned in the order of first use.
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
