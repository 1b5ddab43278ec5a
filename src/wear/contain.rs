use super::{Profile, WearError};
use crate::contact::Vec2;

/// Tolerance for a merged point outside of the new part, relative to the cell size: round-off.
const ROUND_OFF: f64 = 1e-12;
const DOUBLINGS: usize = 60;
const HALVINGS: usize = 60;

impl Profile {
    /// How far this profile rises above another \[m\]. Wear removes steel and adds none, so that
    /// over the new profile this is at most round-off.
    ///
    /// ```text
    /// rise = max_x (Y_self(x) − Y_other(x)),   Y(x) = highest point at x                  (1)
    /// ```
    ///
    /// over the stations of both profiles, which for straight edges covers all `x`. Past an end of
    /// the other profile there is no steel at all, and the distance past that end counts.
    ///
    /// # Returns
    /// A number ≥ 0.
    pub fn rise_over(&self, other: &Profile) -> f64 {
        rise(self.nodes(), other.nodes())
    }
}

/// Equation (1) of [`Profile::rise_over`] for two polylines that run to the right.
fn rise(nodes: &[Vec2], other: &[Vec2]) -> f64 {
    let mut most: f64 = 0.0;
    for p in nodes {
        most = most.max(match highest_at(other, p.x) {
            Some(y) => p.y - y,
            None => beyond(other, p.x),
        });
    }
    for q in other {
        if let (Some(y), Some(limit)) = (highest_at(nodes, q.x), highest_at(other, q.x)) {
            most = most.max(y - limit);
        }
    }
    most
}

/// Highest point at `x` \[m\]; `None` past the ends.
fn highest_at(nodes: &[Vec2], x: f64) -> Option<f64> {
    let mut best: Option<f64> = None;
    for e in nodes.windows(2) {
        let (left, right) = if e[0].x <= e[1].x {
            (e[0], e[1])
        } else {
            (e[1], e[0])
        };
        if x < left.x || x > right.x {
            continue;
        }
        // at a node its own height to the last digit
        let y = if x == left.x && x == right.x {
            left.y.max(right.y)
        } else if x == left.x {
            left.y
        } else if x == right.x {
            right.y
        } else {
            left.y + (x - left.x) / (right.x - left.x) * (right.y - left.y)
        };
        best = Some(best.map_or(y, |b| b.max(y)));
    }
    best
}

/// How far `x` is past the ends of a polyline \[m\].
fn beyond(nodes: &[Vec2], x: f64) -> f64 {
    let low = nodes.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
    let high = nodes.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
    (low - x).max(x - high).max(0.0)
}

/// The highest position for a merged node between its neighbours at which both its edges stay
/// within the new part: its own, or straight below.
///
/// # Errors
/// [`WearError::Unbalanced`], naming the node by `index`, if there is none.
pub(super) fn lowered(
    before: Vec2,
    node: Vec2,
    after: Vec2,
    new: &Profile,
    cell_size: f64,
    index: usize,
) -> Result<Vec2, WearError> {
    let at = |down: f64| node - Vec2::new(0.0, down);
    let within = |down: f64| {
        let edges = [before, at(down), after];
        rise(&edges, new.nodes()) <= ROUND_OFF * cell_size
    };
    if within(0.0) {
        return Ok(node);
    }
    let mut low = ROUND_OFF * cell_size;
    let mut doublings = 0;
    while !within(low) {
        low *= 2.0;
        doublings += 1;
        if doublings == DOUBLINGS {
            return Err(WearError::Unbalanced { node: index });
        }
    }
    let mut high = 0.0;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if within(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(at(low))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(xy: &[(f64, f64)]) -> Profile {
        Profile::new(xy.iter().map(|&(x, y)| Vec2::new(x, y)).collect()).unwrap()
    }

    #[test]
    fn the_rise_is_found_at_nodes_of_either_profile() {
        let roof = profile(&[(0.0, 0.0), (2.0, 2.0), (4.0, 0.0)]);
        assert_eq!(roof.rise_over(&roof), 0.0);
        // a node of the worn one stands out by a half
        let peak = profile(&[(0.0, 0.0), (1.0, 1.5), (4.0, 0.0)]);
        assert_eq!(peak.rise_over(&roof), 0.5);
        // its nodes are all on the other, which has a valley between them
        let valley = profile(&[(0.0, 0.0), (1.0, -1.0), (3.0, -1.0), (4.0, 0.0)]);
        let chord = profile(&[(0.0, 0.0), (3.0, -1.0), (4.0, 0.0)]);
        assert!((chord.rise_over(&valley) - 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(valley.rise_over(&chord), 0.0);
        // deeper everywhere, and past an end all the same
        let past = profile(&[(-0.25, -1.0), (2.0, -1.0), (4.0, -1.0)]);
        assert_eq!(past.rise_over(&roof), 0.25);
    }

    #[test]
    fn a_merged_node_goes_down_as_far_as_it_must() {
        let valley = profile(&[(0.0, 1.0), (1.0, 0.0), (2.0, 0.0), (3.0, 1.0)]);
        let [p, m, q] = [(0.0, 1.0), (1.5, -1.0 / 3.0), (3.0, 1.0)].map(|(x, y)| Vec2::new(x, y));
        // the edges through both corners of the floor meet at −1/2
        let node = lowered(p, m, q, &valley, 1.0, 0).unwrap();
        assert!((node - Vec2::new(1.5, -0.5)).norm() < 1e-8, "{node}");
        let deep = Vec2::new(1.5, -0.7);
        assert_eq!(lowered(p, deep, q, &valley, 1.0, 0), Ok(deep));
        // a neighbour that stands out itself
        let high = Vec2::new(0.0, 2.0);
        let refused = lowered(high, m, q, &valley, 1.0, 7);
        assert_eq!(refused, Err(WearError::Unbalanced { node: 7 }));
    }
}
