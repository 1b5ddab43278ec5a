//! The factors that an island stores for its next contact problem.

use super::block_status::Status;
use super::response::{Factored, Response};
use crate::contact::{ContactProblem, Delassus, Mat2, NO_BODY, Rows, Vec3};
use serde::{Deserialize, Serialize};

/// The factors of an island's last Newton step, for [`ImpulseSolver::solve_next`].
///
/// If little has moved since, a chord step of Newton's method solves the next problem with the
/// stored factors and statuses: two triangular solves and no factorisation. At rest an island
/// needs one every few steps: a pile is unstable under constant impulses, and under a hundred rows
/// errors grow 2.5 times a step.
///
/// Empty at first. The results of a run depend on the cache, so a saved state must contain it.
///
/// [`ImpulseSolver::solve_next`]: super::ImpulseSolver::solve_next
#[derive(Debug, Clone, Default)]
pub struct FactorCache(pub(super) Option<Box<Newton>>);

/// A factorised system of Newton's method.
#[derive(Debug, Clone, Default)]
pub(super) struct Newton {
    pub factored: Factored,
    /// The bodies of each row.
    pub bodies: Vec<[u32; 2]>,
    pub statuses: Vec<Status>,
    /// Weight of the proximal term, and whether a light one has failed.
    pub proximal: f64,
    pub light_failed: bool,
    /// Whether the factors leave out pairs of bodies that only open contacts couple.
    pub closed_only: bool,
}

/// First weight of the proximal term. A smaller one loses digits in the stiff system.
pub(super) const PROXIMAL: f64 = 1e-6;

/// Least share of open contacts at which the stored factors leave them out.
const OPEN: f64 = 0.1;

impl Newton {
    /// Leaves out open contacts if they are many. This makes later triangular solves cheaper.
    pub fn drop_open_contacts(&mut self) {
        let open = self.statuses.iter().filter(|s| **s == Status::Open).count();
        if self.closed_only || (open as f64) < OPEN * self.statuses.len() as f64 {
            return;
        }
        let own = &mut self.factored;
        let (rows, gains) = (
            std::mem::take(&mut own.rows),
            std::mem::take(&mut own.gains),
        );
        let reduced = Response::factored(own.bodies, rows.clone(), gains.clone(), true);
        self.closed_only = true;
        match reduced {
            Some(factored) => self.factored = factored,
            None => (own.rows, own.gains) = (rows, gains),
        }
    }
}

impl FactorCache {
    /// Whether the cache holds no factors.
    pub fn is_empty(&self) -> bool {
        self.0.is_none()
    }

    /// Whether the factors have a light proximal term: the island was at rest.
    pub(super) fn is_light(&self) -> bool {
        self.0.as_deref().is_some_and(|n| n.proximal < PROXIMAL)
    }

    /// Whether factors with a light proximal term have failed before.
    pub(super) fn light_failed(&self) -> bool {
        self.0.as_deref().is_some_and(|n| n.light_failed)
    }

    /// The stored system, if its blocks have the same bodies as those of `problem`.
    pub(super) fn of(&mut self, problem: &ContactProblem) -> Option<&mut Newton> {
        let Delassus::Bodies(op) = &problem.operator else {
            return None;
        };
        self.0.as_deref_mut().filter(|n| {
            n.factored.bodies == op.inverse_mass.len()
                && n.bodies.len() == op.rows.len()
                && (n.bodies.iter().zip(&op.rows)).all(|(own, rows)| *own == rows.bodies)
        })
    }

    /// All numbers of the cache, to be saved.
    pub(crate) fn state(&self) -> Option<FactorState> {
        let newton = self.0.as_deref()?;
        Some(FactorState {
            bodies: newton.bodies.clone(),
            rows: newton.factored.rows.iter().map(numbers).collect(),
            gains: newton.factored.gains.iter().map(|a| (*a).into()).collect(),
            statuses: newton.statuses.clone(),
            proximal: newton.proximal,
            light_failed: newton.light_failed,
            closed_only: newton.closed_only,
        })
    }

    /// Restores what [`FactorCache::state`] returned. Empty if `state` is inconsistent.
    pub(crate) fn restored(state: &FactorState) -> FactorCache {
        let rows = state.bodies.iter().zip(&state.rows).map(|(&bodies, n)| {
            let row = |k: usize| Vec3::new(n[k], n[k + 1], n[k + 2]);
            Rows {
                bodies,
                jacobian: [[row(0), row(3)], [row(6), row(9)]],
            }
        });
        let rows: Vec<Rows> = rows.collect();
        let gains: Vec<Mat2> = state.gains.iter().map(|a| Mat2::from(*a)).collect();
        let bodies = rows.iter().flat_map(|r| r.bodies);
        let last = bodies.filter(|b| *b != NO_BODY).max();
        let bodies = last.map_or(0, |b| b as usize + 1);
        let alike = [state.bodies.len(), gains.len(), state.statuses.len()] == [rows.len(); 3];
        let factored = (alike && bodies <= 2 * rows.len())
            .then(|| Response::factored(bodies, rows, gains, state.closed_only))
            .flatten();
        FactorCache(factored.map(|factored| {
            Box::new(Newton {
                bodies: state.bodies.clone(),
                factored,
                statuses: state.statuses.clone(),
                proximal: state.proximal,
                light_failed: state.light_failed,
                closed_only: state.closed_only,
            })
        }))
    }
}

/// [`FactorCache`] in a saved state: the input of its factorisation.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct FactorState {
    bodies: Vec<[u32; 2]>,
    rows: Vec<[f64; 12]>,
    gains: Vec<[[f64; 2]; 2]>,
    statuses: Vec<Status>,
    #[serde(default = "proximal")]
    proximal: f64,
    #[serde(default)]
    light_failed: bool,
    #[serde(rename = "lean")]
    closed_only: bool,
}

/// The weight of states that were saved without one.
fn proximal() -> f64 {
    PROXIMAL
}

fn numbers(rows: &Rows) -> [f64; 12] {
    let [[an, at], [bn, bt]] = rows.jacobian;
    let all = [an, at, bn, bt];
    std::array::from_fn(|k| all[k / 3][k % 3])
}
