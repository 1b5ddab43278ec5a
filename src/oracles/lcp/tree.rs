use super::infeasible::{Optimum, expression, solve};
use super::restart::Balanced;
use crate::solver::lemke::Search;
use microlp::{ComparisonOp, OptimizationDirection, Problem, Variable};

/// Largest problem for the search of complementary bases. Planted solutions of random real `M` took
/// at most 900 nodes for n = 30 and 1800 for n = 40; with `M_ij` in −1, 0, 1 it was 5400 for n =
/// 40.
const MAX_ROWS: usize = 40;

/// Most nodes of the tree: some two seconds for n = 40.
const MAX_NODES: usize = 2000;

/// The variable of a pair that is set to 0.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Side {
    Either,
    Z,
    W,
}

/// The fourth of the fallbacks of `solve_lcp`: depth first through the complementary bases.
///
/// A node has some `z_i` and some `w_i` set to 0, and is left if no `z, w ≥ 0` remains. Otherwise
/// the least sum of the others gives a candidate solution: it is offered, and the pair that is
/// farthest from complementary is set next, its smaller part first.
///
/// # Returns
/// Whether the tree was searched to its end and every linear programme solved: if no solution was
/// found, there is none except by round-off.
pub(super) fn enumerate(search: &mut Search, balanced: &Balanced) -> bool {
    let n = balanced.free.len();
    if n > MAX_ROWS || !balanced.finite() {
        return false;
    }
    let mut open = vec![vec![Side::Either; n]];
    let mut sure = true;
    for _ in 0..MAX_NODES {
        let Some(sides) = open.pop() else { return sure };
        search.programmes += 1;
        let mut undecided = (0..n).filter(|&i| sides[i] == Side::Either);
        let next = match relaxed(balanced, &sides) {
            Optimum::Empty => continue,
            Optimum::Unknown => undecided.next().map(|next| (next, [Side::W, Side::Z])),
            Optimum::At(z) => {
                let w = &balanced.matrix * &z + &balanced.free;
                let basis: Vec<usize> = (0..n).filter(|&i| z[i] > w[i]).collect();
                search.offer(balanced.unscaled(&z));
                search.offer_basis(&basis);
                if search.solved() {
                    return sure;
                }
                let gap = |i: &usize| z[*i].min(w[*i]);
                let next = undecided.max_by(|i, j| gap(i).total_cmp(&gap(j)));
                // the last is visited first
                next.map(|next| match z[next] > w[next] {
                    true => (next, [Side::Z, Side::W]),
                    false => (next, [Side::W, Side::Z]),
                })
            }
        };
        let Some((next, order)) = next else {
            sure = false;
            continue;
        };
        for side in order {
            let mut child = sides.clone();
            child[next] = side;
            open.push(child);
        }
    }
    sure && open.is_empty()
}

/// `z` with the least sum of the undecided `z_i + w_i`.
fn relaxed(balanced: &Balanced, sides: &[Side]) -> Optimum {
    let n = sides.len();
    let mut programme = Problem::new(OptimizationDirection::Minimize);
    let undecided = |i: &usize| sides[*i] == Side::Either;
    let variables: Vec<Variable> = (0..n)
        .map(|j| {
            let sum = (0..n).filter(undecided).map(|i| balanced.matrix[(i, j)]);
            let own = if undecided(&j) { 1.0 } else { 0.0 };
            let most = if sides[j] == Side::Z {
                0.0
            } else {
                f64::INFINITY
            };
            programme.add_var(own + sum.sum::<f64>(), (0.0, most))
        })
        .collect();
    for (i, row) in balanced.matrix.row_iter().enumerate() {
        let sum = expression(&variables, row.iter().copied());
        let how = if sides[i] == Side::W {
            ComparisonOp::Eq
        } else {
            ComparisonOp::Ge
        };
        programme.add_constraint(sum, how, -balanced.free[i]);
    }
    solve(&programme, &variables)
}
