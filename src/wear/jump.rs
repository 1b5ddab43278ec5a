use super::update::deepest;
use super::{WearError, all_finite, in_range, same_length};
use serde::{Deserialize, Serialize};

/// Most jumps of a life that a run computes. The error of so many is 5e-5 of the wear; more take longer and
/// show nothing.
pub const MOST_JUMPS: usize = 20_000;

/// How many cycles one simulated cycle may stand for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JumpRule {
    /// The requested length \[cycles\].
    pub cycles: f64,
    /// Largest depth of one jump \[m\]. It belongs to the part, not to its mesh, so that runs on
    /// two meshes have the same error of the jumps.
    pub depth: f64,
    /// Bound on `K k S` of one jump, below 2; at most 1 keeps the approach monotone.
    pub stability: f64,
}

impl Default for JumpRule {
    /// 1e6 cycles, 0.2 mm, `K k S ≤ 1`.
    fn default() -> Self {
        JumpRule {
            cycles: 1e6,
            depth: 2e-4,
            stability: 1.0,
        }
    }
}

/// The bound that determined the length of a jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JumpBound {
    /// The requested length.
    Requested,
    /// The depth at this node, by the rule or by the mesh.
    Depth { node: usize },
    /// The stability bound.
    Stability,
}

impl JumpBound {
    /// The name in tables.
    pub fn word(self) -> &'static str {
        match self {
            JumpBound::Requested => "requested",
            JumpBound::Depth { .. } => "depth",
            JumpBound::Stability => "stability",
        }
    }
}

/// A cycle jump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump {
    /// Number of cycles, above 0; need not be whole.
    pub cycles: f64,
    pub bound: JumpBound,
}

impl JumpRule {
    /// The next jump.
    ///
    /// ```text
    /// N = min( N_requested,  min(depth, limit) / max_i r_i,  stability / (K k s) )            (1)
    /// ```
    ///
    /// The last bound is that of explicit wear on a Winkler foundation of stiffness `k` [Pa/m]
    /// over a sliding distance `S = N s`: a deviation is multiplied by `1 − K k S` in every jump,
    /// so it decays for `K k S < 2`, without changing sign below 1.
    ///
    /// # Arguments
    /// - `rates`: `r_i ≥ 0`, depth per cycle \[m\], one per node.
    /// - `limit`: largest depth that the mesh can follow \[m\]; infinite for none.
    /// - `feedback`: `K k s` of one cycle, by how much a node's rate falls when it is worn by 1 m
    ///   [1/cycle], measured by [`Archard::feedback`](super::Archard::feedback); 0 if the rate does
    ///   not depend on the depth.
    ///
    /// # Errors
    /// [`WearError::NonFinite`]; [`WearError::Range`] for a negative rate, a length, depth or limit
    /// not above 0, a stability bound outside (0, 2), or a `feedback` that is negative or infinite:
    /// rigid contacts have no elastic penetration that a jump could stay below.
    ///
    /// # Source
    /// Põdra & Andersson (1999) for explicit wear steps; the bound is the linear one of the
    /// explicit Euler rule.
    pub fn next(&self, rates: &[f64], limit: f64, feedback: f64) -> Result<Jump, WearError> {
        all_finite("rate of node", rates)?;
        for &r in rates {
            in_range("depth per cycle [m]", r, r >= 0.0, "at least 0")?;
        }
        let above =
            |what, v: f64| in_range(what, v, v > 0.0 && v.is_finite(), "finite and above 0");
        above("jump length [cycles]", self.cycles)?;
        above("jump depth [m]", self.depth)?;
        in_range("jump limit of the mesh [m]", limit, limit > 0.0, "above 0")?;
        let inside = self.stability > 0.0 && self.stability < 2.0;
        in_range("jump stability K k S", self.stability, inside, "in (0, 2)")?;
        let inside = feedback >= 0.0 && feedback.is_finite();
        in_range(
            "feedback K k s",
            feedback,
            inside,
            "finite and at least 0: rigid contacts need a compliance",
        )?;

        let mut jump = Jump {
            cycles: self.cycles,
            bound: JumpBound::Requested,
        };
        let node = deepest(rates);
        // a rate or feedback of 0 gives infinity, which never bounds the jump
        let by_depth = rates
            .get(node)
            .map_or(f64::INFINITY, |r| self.depth.min(limit) / r);
        for (cycles, bound) in [
            (by_depth, JumpBound::Depth { node }),
            (self.stability / feedback, JumpBound::Stability),
        ] {
            if cycles < jump.cycles {
                jump = Jump { cycles, bound };
            }
        }
        Ok(jump)
    }
}

/// Signed error of an Euler jump, from the rate at its end.
///
/// `e_i = ½ N (r_i,end − r_i,start)`                                                  (1)
///
/// the trapezoidal rule minus Euler's: second order in `N`, so that the sum over a life is first
/// order.
///
/// # Arguments
/// - `start`, `end`: depth per cycle \[m\] before and after; `cycles`: `N`.
///
/// # Errors
/// [`WearError::Length`], [`WearError::NonFinite`].
pub fn trapezoid_error(start: &[f64], end: &[f64], cycles: f64) -> Result<Vec<f64>, WearError> {
    same_length("rates at the end", end.len(), start.len())?;
    let errors: Vec<f64> = start
        .iter()
        .zip(end)
        .map(|(a, b)| 0.5 * cycles * (b - a))
        .collect();
    all_finite("jump error of cell", &errors)?;
    Ok(errors)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tightest_bound_wins() {
        let rule = JumpRule {
            cycles: 100.0,
            depth: 5e-4,
            stability: 1.0,
        };
        let next = |rates: &[f64], limit, feedback| rule.next(rates, limit, feedback).unwrap();
        let far = f64::INFINITY;
        let free = next(&[0.0, 0.0], far, 0.0);
        assert_eq!((free.cycles, free.bound), (100.0, JumpBound::Requested));
        let deep = next(&[1e-6, 1e-4], far, 0.0);
        assert_eq!(deep.bound, JumpBound::Depth { node: 1 });
        // a rounding
        assert!((deep.cycles - 5.0).abs() < 1e-14);
        let fine = next(&[1e-6, 1e-4], 1e-4, 0.0);
        assert_eq!(
            (fine.cycles, fine.bound),
            (1.0, JumpBound::Depth { node: 1 })
        );
        let stiff = next(&[1e-6, 1e-4], far, 0.5);
        assert_eq!((stiff.cycles, stiff.bound), (2.0, JumpBound::Stability));
    }

    #[test]
    fn bounds_outside_their_range_are_refused() {
        let refused = |rule: JumpRule, rates: &[f64], limit, feedback| {
            assert!(rule.next(rates, limit, feedback).is_err());
        };
        let rule = JumpRule::default();
        let deep = JumpRule { depth: 0.0, ..rule };
        let unstable = JumpRule {
            stability: 2.0,
            ..rule
        };
        let endless = JumpRule {
            cycles: f64::INFINITY,
            ..rule
        };
        for bad in [deep, unstable, endless] {
            refused(bad, &[1.0], 1.0, 0.0);
        }
        refused(rule, &[f64::NAN], 1.0, 0.0);
        refused(rule, &[-1.0], 1.0, 0.0);
        refused(rule, &[1.0], 0.0, 0.0);
        refused(rule, &[1.0], 1.0, f64::NAN);
        // a rigid contact
        refused(rule, &[1.0], 1.0, f64::INFINITY);
    }

    #[test]
    fn the_estimate_is_exact_for_a_linear_rate() {
        // r = 3 − 2 c: Euler over 0.5 cycles gives 1.5, the truth is 1.25
        assert_eq!(trapezoid_error(&[3.0], &[2.0], 0.5), Ok(vec![-0.25]));
        assert!(trapezoid_error(&[3.0], &[], 0.5).is_err());
    }
}
