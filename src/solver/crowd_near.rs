//! Sweeps over a neighbourhood of a crowd that is solved but for a few contacts.

use super::crowd::MUCH;
use super::{Crowd, ImpulseSolver, SolveReport};
use crate::contact::{BodyOperator, ContactProblem, Delassus, LocalBodies, NO_BODY, Vec2, Vec3};

/// The blocks that are swept are those that share a body with a new contact, those that share one with these,
/// and so on.
const RINGS: usize = 3;

/// A body with more blocks, as a drum, passes no ring on: it connects what is far apart.
const HUB: usize = 24;

/// Sweeps over all blocks that follow. The neighbourhood alone leaves six times as much where it ends.
const ALL: usize = 12;

impl Crowd {
    /// Solves a problem again that was solved without the blocks from number `from` on: by sweeps over
    /// those near them, then over all. Without any the impulses stay as they are.
    pub fn solve_more(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        from: usize,
        tolerance: f64,
    ) -> SolveReport {
        let found = match &problem.operator {
            Delassus::Bodies(op) if from < problem.len() => {
                let near = neighbourhood(op, from);
                let mut part = Part::of(problem, op, impulses, &near);
                let sweeps = self
                    .solve(&part.problem, &mut part.impulses, tolerance)
                    .sweeps;
                for (&i, &p) in near.iter().zip(&part.impulses) {
                    impulses[i as usize] = p;
                }
                let found = self.sweep_all(problem, impulses, tolerance, ALL);
                SolveReport {
                    sweeps: sweeps + found.sweeps,
                    ..found
                }
            }
            _ => SolveReport::judged(problem, impulses, tolerance),
        };
        match from < problem.len() && found.residual.velocity > MUCH * found.residual.velocity_scale
        {
            true => self.solve(problem, impulses, tolerance).after(&found),
            false => found,
        }
    }
}

/// The blocks within [`RINGS`] of those from number `from` on, ascending.
fn neighbourhood(op: &BodyOperator, from: usize) -> Vec<u32> {
    let sides = |i: usize| (op.rows[i].bodies.into_iter()).filter(|body| *body != NO_BODY);
    let mut blocks = vec![0; op.inverse_mass.len()];
    (0..op.rows.len())
        .flat_map(sides)
        .for_each(|body| blocks[body as usize] += 1);
    let mut inside: Vec<bool> = (0..op.rows.len()).map(|i| i >= from).collect();
    let mut reached = vec![false; op.inverse_mass.len()];
    for _ in 0..RINGS {
        for body in (0..op.rows.len()).filter(|i| inside[*i]).flat_map(sides) {
            reached[body as usize] = blocks[body as usize] <= HUB;
        }
        for (i, inside) in inside.iter_mut().enumerate() {
            *inside |= sides(i).any(|body| reached[body as usize]);
        }
    }
    let all = 0..op.rows.len() as u32;
    all.filter(|i| inside[*i as usize]).collect()
}

/// The problem of some blocks, with the velocities that the impulses of all others give their bodies.
struct Part {
    problem: ContactProblem,
    impulses: Vec<Vec2>,
}

impl Part {
    fn of(problem: &ContactProblem, op: &BodyOperator, impulses: &[Vec2], blocks: &[u32]) -> Part {
        let mut given = vec![Vec3::zeros(); op.inverse_mass.len()];
        let mut next = blocks.iter().peekable();
        for (i, rows) in op.rows.iter().enumerate() {
            if next.next_if_eq(&&(i as u32)).is_none() && impulses[i] != Vec2::zeros() {
                rows.push(impulses[i], &op.inverse_mass, &mut given);
            }
        }
        let mut own = BodyOperator::default();
        LocalBodies::default().operator(blocks, |i| op.rows[i], &op.inverse_mass, &mut own);
        let free = |i: &u32| problem.free[*i as usize] + op.rows[*i as usize].velocity(&given);
        Part {
            problem: ContactProblem {
                operator: Delassus::Bodies(own),
                free: blocks.iter().map(free).collect(),
                laws: blocks.iter().map(|i| problem.laws[*i as usize]).collect(),
            },
            impulses: blocks.iter().map(|i| impulses[*i as usize]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::examples::heap;
    use crate::contact::natural_map;

    /// Sweeps near five contacts that come last, and a few over all, leave little more than a hundred over all
    /// did before.
    #[test]
    fn few_new_contacts_are_solved_by_few_sweeps() {
        for seed in 1..6 {
            let problem = heap(60, 60, 0.5, 0.0, seed).problem();
            let Delassus::Bodies(op) = &problem.operator else {
                panic!("bodies");
            };
            let from = problem.len() - 5;
            let before = ContactProblem {
                operator: Delassus::Bodies(BodyOperator {
                    rows: op.rows[..from].to_vec(),
                    inverse_mass: op.inverse_mass.clone(),
                }),
                free: problem.free[..from].to_vec(),
                laws: problem.laws[..from].to_vec(),
            };
            let mut crowd = Crowd::default();
            let mut impulses = vec![Vec2::zeros(); from];
            let first = crowd.solve(&before, &mut impulses, 1e-8);
            impulses.resize(problem.len(), Vec2::zeros());
            let without = natural_map(&problem, &impulses).velocity;
            let near = neighbourhood(op, from);
            assert!(near.len() < problem.len() / 5, "{}", near.len());
            let more = crowd.solve_more(&problem, &mut impulses, from, 1e-8);
            let (left, with) = (first.residual.velocity, more.residual.velocity);
            assert!(
                with < without && with < 1.5 * left,
                "{seed}: {left}, {without}, {with}"
            );
            let done = impulses.clone();
            let again = crowd.solve_more(&problem, &mut impulses, problem.len(), 1e-8);
            assert!(done == impulses && again.sweeps == 0);
        }
    }
}
