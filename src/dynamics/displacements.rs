//! Solves the problems that move bodies by position: see [`super::recovery`] and [`super::joint_recovery`].

use super::asked::Asked;
use super::island_problem::LARGE;
use super::islands::Islands;
use super::solve::IslandSolver;
use crate::contact::{
    BodyOperator, ContactProblem, Delassus, Law, LocalBodies, NO_BODY, Rows, Vec2, Vec3,
};

/// Largest displacement of a body, as a multiple of the sum of what an island has to correct: in a row of bodies
/// the last one may have to make room for all overlaps. Between walls that are off parallel by less than half a
/// degree the problem has solutions that are farther away: a box that a piston presses into a wall would go up by a
/// tenth of its size in each step, as its sides are off by 1e-4 rad.
pub(super) const FARTHEST: f64 = 100.0;

/// Compliance of the rows if the problem has no solution, or none is found, as a share of their own inverse mass.
/// The first is for rows that ask for a displacement, which may get only a part of it. The second is for all
/// other rows, which must hardly be violated.
const ASKED_COMPLIANCE: f64 = 1.0;
const OTHER_COMPLIANCE: f64 = 1e-4;

/// How often the problems are solved without the contacts that are far away. After that all take part.
const ROUNDS: usize = 3;

/// The displacements `d` of minimum kinetic norm that fulfil all rows of `asked` to `tolerance`, on every island
/// that has something to correct. See [`within`] for `stride`. If `wedged` is set, the problems of large islands are
/// regularised at once.
///
/// A contact whose gap is wider than the sum of what its island has to correct hardly ever takes part: it is left out,
/// and comes in where the displacements would close it. So islands are solved small, and the solution is the same.
pub(super) fn displacements(
    asked: &Asked,
    inverse_mass: &[Vec3],
    solver: &mut IslandSolver,
    tolerance: f64,
    (stride, wedged): (f64, &mut bool),
) -> Vec<(u32, Vec3)> {
    let rows = &asked.rows;
    let sides: Vec<[u32; 2]> = rows.iter().map(|r| r.bodies).collect();
    let sizes = sizes(rows, inverse_mass.len());
    let mut islands = Islands::default();
    islands.build(inverse_mass.len(), sides.iter().copied());
    let mut takes_part = near_rows(asked, &islands);
    let at_once = *wedged;
    let mut rounds = 0;
    loop {
        let part = (0..rows.len() as u32).filter(|i| takes_part[*i as usize]);
        let part: Vec<u32> = part.collect();
        islands.build_of(inverse_mass.len(), &part, &sides);
        let mut moved = vec![Vec3::zeros(); inverse_mass.len()];
        let mut solved = moved.clone();
        let mut local = LocalBodies::default();
        for k in 0..islands.len() {
            let members = islands.blocks(k);
            if !members.iter().any(|&i| asked.moves(i as usize)) {
                continue;
            }
            let mut op = BodyOperator::default();
            local.operator(members, |i| rows[i], inverse_mass, &mut op);
            let Some(d) = solve_island(asked, members, op, solver, tolerance, (at_once, wedged))
            else {
                continue;
            };
            let size = |body: &u32| sizes[*body as usize];
            let share = within(stride, local.bodies.iter().map(size), &d);
            for (body, d) in local.bodies.iter().zip(&d) {
                moved[*body as usize] = d * share;
                solved[*body as usize] = *d;
            }
        }
        let reached = |i: &usize| asked.free[*i].x + rows[*i].velocity(&solved).x < 0.0;
        let out = (0..rows.len()).filter(|i| !takes_part[*i]);
        let reached: Vec<usize> = out.filter(reached).collect();
        if reached.is_empty() {
            let some = |(_, d): &(u32, Vec3)| *d != Vec3::zeros();
            return (0..).zip(moved).filter(some).collect();
        }
        rounds += 1;
        match rounds < ROUNDS {
            true => reached.into_iter().for_each(|i| takes_part[i] = true),
            false => takes_part.fill(true),
        }
    }
}

/// Whether each row takes part from the beginning: all but contacts whose gap is wider than the sum of what their
/// island has to correct.
fn near_rows(asked: &Asked, islands: &Islands) -> Vec<bool> {
    let mut near = vec![true; asked.rows.len()];
    for k in 0..islands.len() {
        let members = islands.blocks(k).iter().map(|&i| i as usize);
        let moving = members.clone().filter(|&i| asked.moves(i));
        let sum: f64 = moving.map(|i| asked.free[i].norm()).sum();
        for i in members {
            near[i] = !matches!(asked.laws[i], Law::Contact { .. }) || asked.free[i].x <= sum;
        }
    }
    near
}

/// The displacements of the bodies of one island, whose operator is `op`; `None` if none are found. A problem that is
/// contradictory, or whose solution is too far away, is regularised.
fn solve_island(
    asked: &Asked,
    members: &[u32],
    op: BodyOperator,
    solver: &mut IslandSolver,
    tolerance: f64,
    (at_once, wedged): (bool, &mut bool),
) -> Option<Vec<Vec3>> {
    let members = members.iter().map(|&i| i as usize);
    let mut problem = ContactProblem {
        operator: Delassus::Bodies(op),
        free: members.clone().map(|i| asked.free[i]).collect(),
        laws: members.clone().map(|i| asked.laws[i]).collect(),
    };
    let mut push = vec![Vec2::zeros(); problem.len()];
    let own = solver.worker.solver.as_mut();
    let large = problem.len() > LARGE;
    let mut solved = !(large && at_once) && own.solve(&problem, &mut push, tolerance).solved();
    let pushed: Vec<bool> = (problem.free.iter().zip(&problem.laws))
        .map(|(b, law)| matches!(law, Law::Contact { .. }) && b.x < 0.0)
        .collect();
    let moving = members.filter(|&i| asked.moves(i));
    let sum: f64 = moving.map(|i| asked.free[i].norm()).sum();
    let mut d = displaced(&problem, &push);
    let far = farthest(&d) > FARTHEST * sum;
    // contradictory walls have no solution, or none near by
    if (!solved || far) && pushed.contains(&true) {
        *wedged |= large;
        regularise(&mut problem, |i| {
            if pushed[i] {
                ASKED_COMPLIANCE
            } else {
                OTHER_COMPLIANCE
            }
        });
        push.fill(Vec2::zeros());
        solved = own.solve(&problem, &mut push, tolerance).solved();
        d = displaced(&problem, &push);
    }
    solved.then_some(d)
}

/// Displacements of the bodies of a problem by its impulses.
fn displaced(problem: &ContactProblem, push: &[Vec2]) -> Vec<Vec3> {
    let Delassus::Bodies(op) = &problem.operator else {
        return Vec::new();
    };
    let mut d = vec![Vec3::zeros(); op.inverse_mass.len()];
    for (rows, p) in op.rows.iter().zip(push) {
        rows.push(*p, &op.inverse_mass, &mut d);
    }
    d
}

/// The largest distance that a body goes \[m\].
fn farthest(displacements: &[Vec3]) -> f64 {
    let ways = displacements.iter().map(|d| d.xy().norm());
    ways.fold(0.0, f64::max)
}

/// Gives the rigid contacts of a problem `ξ_N + R P_N` in place of `ξ_N`, with
/// `R = compliance_of(i) · G_NN`. Every problem then has a solution, and it is bounded.
fn regularise(problem: &mut ContactProblem, compliance_of: impl Fn(usize) -> f64) {
    for i in 0..problem.len() {
        let block = problem.operator.diagonal(i);
        if let Law::Contact { compliance, .. } = &mut problem.laws[i]
            && *compliance == 0.0
        {
            *compliance = compliance_of(i) * block[(0, 0)];
        }
    }
}

/// Size of every body \[m\]: the distance of its farthest contact from its centre.
fn sizes(rows: &[Rows], bodies: usize) -> Vec<f64> {
    let mut sizes = vec![0.0f64; bodies];
    for Rows { bodies, jacobian } in rows {
        for (body, [n, t]) in bodies.iter().zip(jacobian).filter(|(b, _)| **b != NO_BODY) {
            let size = &mut sizes[*body as usize];
            *size = size.max(n.z.hypot(t.z));
        }
    }
    sizes
}

/// Largest factor, up to 1, of the displacements `moved` of an island's bodies with which none moves farther than
/// `stride` times its size.
fn within(stride: f64, sizes: impl Iterator<Item = f64>, moved: &[Vec3]) -> f64 {
    let share = |(size, d): (f64, &Vec3)| {
        let way = d.xy().norm() + d.z.abs() * size;
        // a body without a lever, such as a coordinate, has no size
        if size * way > 0.0 {
            stride * size / way
        } else {
            1.0
        }
    };
    sizes.zip(moved).map(share).fold(1.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::Auto;

    /// A body between a lid and a heavy one beside it is to go 1 mm along (0.995, 0.1): 9.1 mm upwards if the lid, which
    /// is farther away than 1 mm, is forgotten.
    #[test]
    fn a_contact_that_the_displacements_reach_takes_part() {
        let inverse_mass = [Vec3::new(1.0, 1.0, 0.0), Vec3::new(1e-3, 1e-3, 0.0)];
        let mut asked = Asked::default();
        let mut add = |body: u32, x: f64, y: f64, other: Vec3, gap: f64| {
            let jacobian = [
                [Vec3::new(x, y, 0.0), Vec3::zeros()],
                [other, Vec3::zeros()],
            ];
            let bodies = [0, body];
            asked.contact(Rows { bodies, jacobian }, gap, 0.0);
        };
        add(NO_BODY, 0.995, 0.1, Vec3::zeros(), -1e-3);
        add(1, -1.0, 0.0, Vec3::x(), 0.0);
        add(NO_BODY, 0.0, -1.0, Vec3::zeros(), 5e-3);
        let mut solver = IslandSolver::new(Box::new(Auto::default()), 1e-10);
        let way = (f64::INFINITY, &mut false);
        let moves = displacements(&asked, &inverse_mass, &mut solver, 1e-10, way);
        let right = 5e-4 / 0.995;
        let exact = [Vec3::new(right, 5e-3, 0.0), Vec3::new(right, 0.0, 0.0)];
        for ((body, d), exact) in moves.iter().zip(exact) {
            assert!((d - exact).norm() < 1e-9, "body {body}: {d}, not {exact}");
        }
        assert_eq!(moves.len(), 2);
    }
}
