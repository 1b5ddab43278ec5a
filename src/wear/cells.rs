use super::{Profile, WearError, same_length};
use serde::{Deserialize, Serialize};

/// Maps the nodes of the current mesh to the cells of the first one, conservatively.
///
/// Every node keeps the reference coordinate ξ of the steel that it stands on: its `x` in the first
/// mesh, and after a re-mesh, for a node that is new, what lies between its neighbours along the
/// surface. A node covers ξ up to the middle between it and its neighbours, and a cell up to the
/// middle between its station and the next. What belongs to a node is distributed to the cells in the
/// proportion of the overlaps:
///
/// ```text
/// V_c = Σ_i V_i |I_i ∩ C_c| / |I_i|                                                    (1)
/// ```
///
/// The intervals of the nodes cover the same length as the cells, so that nothing is lost and no cell
/// is left out, however often the mesh changes. On a ring ξ is the way along the first mesh from its
/// first node, the intervals go round, and so does ξ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellMap {
    stations: Vec<f64>,
    /// ξ of every node \[m\], ascending.
    reference: Vec<f64>,
    /// Length of the first mesh, if it is a ring \[m\].
    round: Option<f64>,
}

impl CellMap {
    /// The map of a first mesh onto itself; the `x` of its nodes are the stations, ascending, on a ring
    /// their way from the first node.
    pub fn new(first: &Profile) -> Self {
        let mut stations: Vec<f64> = first.nodes().iter().map(|p| p.x).collect();
        let mut round = None;
        if first.is_ring() {
            let mut way = 0.0;
            for (station, length) in stations.iter_mut().zip(first.edges()) {
                *station = way;
                way += length;
            }
            round = Some(way);
        } else {
            stations.sort_by(f64::total_cmp);
        }
        CellMap {
            reference: stations.clone(),
            stations,
            round,
        }
    }

    /// Maps the nodes of a new mesh of the same surface.
    ///
    /// # Arguments
    /// - `before`: the surface with the nodes of the present map, in their present place.
    /// - `after`: its new mesh: nodes that both share keep their ξ, the two ends among them.
    ///
    /// # Errors
    /// [`WearError::Length`] if `before` has other nodes than the map, or shares none with a ring.
    pub fn renew(&mut self, before: &Profile, after: &Profile) -> Result<(), WearError> {
        let (old, new) = (before.nodes(), after.nodes());
        same_length("nodes", old.len(), self.reference.len())?;
        let mut known: Vec<(usize, f64)> = Vec::with_capacity(new.len());
        let mut next = 0;
        for (i, p) in new.iter().enumerate() {
            let found = match i {
                0 if self.round.is_none() => Some(0),
                i if i + 1 == new.len() && self.round.is_none() => Some(old.len() - 1),
                _ => old[next..].iter().position(|q| q == p).map(|k| next + k),
            };
            if let Some(k) = found {
                known.push((i, self.reference[k]));
                next = k + 1;
            }
        }
        let n = new.len();
        if let Some(round) = self.round {
            same_length("nodes kept on a ring", known.len().min(1), 1)?;
            let (first, at) = known[0];
            known.push((first + n, at + round));
        }
        let mut reference = Vec::with_capacity(n);
        for pair in known.windows(2) {
            let [(a, from), (b, to)] = [pair[0], pair[1]];
            let length = |k: usize| (new[(k + 1) % n] - new[k % n]).norm();
            let whole: f64 = (a..b).map(length).sum();
            let mut along = 0.0;
            for k in a..b {
                reference.push(from + along / whole * (to - from));
                along += length(k);
            }
        }
        match self.round {
            None => reference.extend(known.last().map(|(_, last)| *last)),
            Some(round) => {
                // those before the first known node came last
                let first = known[0].0;
                reference.rotate_right(first);
                reference[..first].iter_mut().for_each(|at| *at -= round);
            }
        }
        self.reference = reference;
        Ok(())
    }

    /// Stations `x` \[m\], one per cell.
    pub fn stations(&self) -> &[f64] {
        &self.stations
    }

    /// The cell that a node stands on: the nearest station by its ξ, the first of two.
    pub fn of_node(&self, node: usize) -> usize {
        let at = self.reference[node];
        let above = self.stations.partition_point(|s| *s < at);
        match above {
            0 => 0,
            n if n == self.stations.len() => n - 1,
            n if at - self.stations[n - 1] <= self.stations[n] - at => n - 1,
            n => n,
        }
    }

    /// Sum over every cell of an additive quantity of the nodes (`load_slip`), equation (1).
    ///
    /// # Errors
    /// [`WearError::Length`].
    pub fn sum(&self, values: &[f64]) -> Result<Vec<f64>, WearError> {
        same_length("node values", values.len(), self.reference.len())?;
        if let Some(round) = self.round {
            return Ok(self.sum_round(values, round));
        }
        let (nodes, cells) = (borders(&self.reference), borders(&self.stations));
        let mut sums = vec![0.0; self.stations.len()];
        for (node, (value, own)) in values.iter().zip(nodes.windows(2)).enumerate() {
            let width = own[1] - own[0];
            if width <= 0.0 {
                sums[self.of_node(node)] += value;
                continue;
            }
            let first = cells.partition_point(|c| *c <= own[0]).saturating_sub(1);
            for (sum, cell) in sums[first..].iter_mut().zip(cells[first..].windows(2)) {
                if cell[0] >= own[1] {
                    break;
                }
                let overlap = own[1].min(cell[1]) - own[0].max(cell[0]);
                *sum += value * (overlap.max(0.0) / width);
            }
        }
        Ok(sums)
    }

    /// [`CellMap::sum`] on a ring of this length \[m\].
    fn sum_round(&self, values: &[f64], round: f64) -> Vec<f64> {
        let (nodes, cells) = (
            borders_round(&self.reference, round),
            borders_round(&self.stations, round),
        );
        let mut sums = vec![0.0; self.stations.len()];
        for (value, own) in values.iter().zip(nodes.windows(2)) {
            for turn in [-round, 0.0, round] {
                let (from, to) = (own[0] + turn, own[1] + turn);
                let first = cells.partition_point(|c| *c <= from).saturating_sub(1);
                for (sum, cell) in sums.iter_mut().zip(cells.windows(2)).skip(first) {
                    if cell[0] >= to {
                        break;
                    }
                    let overlap = (to.min(cell[1]) - from.max(cell[0])).max(0.0);
                    *sum += value * (overlap / (to - from));
                }
            }
        }
        sums
    }

    /// Mean depth of every cell \[m\], `Σ h_i w_i / Σ w_i` over its parts of the nodes.
    ///
    /// # Errors
    /// [`WearError::Length`].
    pub fn mean(&self, depths: &[f64], widths: &[f64]) -> Result<Vec<f64>, WearError> {
        same_length("depths", depths.len(), widths.len())?;
        let areas: Vec<f64> = depths.iter().zip(widths).map(|(h, w)| h * w).collect();
        let (area, width) = (self.sum(&areas)?, self.sum(widths)?);
        let mean = |(a, w): (&f64, &f64)| if *w > 0.0 { a / w } else { 0.0 };
        Ok(area.iter().zip(&width).map(mean).collect())
    }
}

/// The ends and the middles between ascending numbers.
fn borders(at: &[f64]) -> Vec<f64> {
    let middles = at.windows(2).map(|p| 0.5 * (p[0] + p[1]));
    let ends = |k: usize| at.get(k).copied();
    ends(0)
        .into_iter()
        .chain(middles)
        .chain(ends(at.len().wrapping_sub(1)))
        .collect()
}

/// The middles between ascending numbers that go round, from that before the first on.
fn borders_round(at: &[f64], round: f64) -> Vec<f64> {
    let next = |k: usize| at.get(k + 1).copied().unwrap_or(at[0] + round);
    let last = at.len() - 1;
    let first = 0.5 * (at[last] + next(last)) - round;
    let middles = (0..at.len()).map(|k| 0.5 * (at[k] + next(k)));
    std::iter::once(first).chain(middles).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Vec2;
    use proptest::prelude::*;

    /// A ring whose first node is merged away and whose edges are split: nothing is lost, and what is
    /// even stays even.
    #[test]
    fn a_ring_keeps_its_columns_round_its_first_node() {
        let ring = |xy: &[(f64, f64)]| {
            Profile::ring(xy.iter().map(|&(x, y)| Vec2::new(x, y)).collect()).unwrap()
        };
        let first = ring(&[(0.0, 0.0), (0.0, 2.0), (2.0, 2.0), (2.0, 0.0), (1.0, 0.0)]);
        let mut map = CellMap::new(&first);
        assert_eq!(map.stations(), [0.0, 2.0, 4.0, 6.0, 7.0]);
        let after = ring(&[(0.5, 0.0), (0.0, 2.0), (1.0, 2.0), (2.0, 2.0), (2.0, 0.0)]);
        map.renew(&first, &after).unwrap();
        let widths = [1.0, 2.0, 1.5, 0.5, 3.0];
        let cells = map.sum(&widths).unwrap();
        // a few roundings
        assert!((cells.iter().sum::<f64>() - 8.0).abs() < 1e-14, "{cells:?}");
        for h in map.mean(&[3.0; 5], &widths).unwrap() {
            assert!((h - 3.0).abs() < 1e-14);
        }
        // a mesh onto itself
        let own = CellMap::new(&first);
        for (sum, width) in own.sum(&widths).unwrap().iter().zip(widths) {
            assert!((sum - width).abs() < 1e-15, "{sum} {width}");
        }
        let other = ring(&[(9.0, 0.0), (9.0, 2.0), (11.0, 2.0), (11.0, 0.0)]);
        assert!(map.renew(&after, &other).is_err());
    }

    fn flat(x: &[f64]) -> Profile {
        Profile::new(x.iter().map(|&x| Vec2::new(x, 0.0)).collect()).unwrap()
    }

    proptest! {
        /// Even wear over forty meshes: every cell has its own area in its column, and nothing is lost.
        #[test]
        fn even_wear_stays_even_over_many_meshes(
            meshes in prop::collection::vec(
                prop::collection::vec(-0.4f64..0.4, 20..30), 40..41,
            ),
        ) {
            let first = flat(&(0..=25).map(f64::from).collect::<Vec<_>>());
            let mut map = CellMap::new(&first);
            let mut before = first.clone();
            let mut columns = [0.0; 26];
            for shifts in &meshes {
                let n = shifts.len();
                let at = |(i, s): (usize, &f64)| match i {
                    0 => 0.0,
                    i if i + 1 == n => 25.0,
                    i => 25.0 * (i as f64 + s) / (n - 1) as f64,
                };
                let after = flat(&shifts.iter().enumerate().map(at).collect::<Vec<_>>());
                map.renew(&before, &after).unwrap();
                for (sum, v) in columns.iter_mut().zip(map.sum(&after.widths()).unwrap()) {
                    *sum += v;
                }
                for h in map.mean(&vec![3.0; n], &after.widths()).unwrap() {
                    prop_assert!((h - 3.0).abs() < 1e-13);
                }
                before = after;
            }
            for (c, sum) in columns.into_iter().enumerate() {
                let expected = if c == 0 || c == 25 { 20.0 } else { 40.0 };
                // forty sums of a few roundings of numbers up to 25
                prop_assert!((sum / expected - 1.0).abs() < 1e-12, "cell {}: {}", c, sum);
            }
        }
    }

    #[test]
    fn cells_keep_their_columns_when_the_mesh_changes() {
        let first = flat(&[0.0, 1.0, 2.0, 3.0]);
        let mut map = CellMap::new(&first);
        let depth = [1.0, 2.0, 4.0, 7.0];
        assert_eq!(map.sum(&depth), Ok(depth.to_vec()));
        assert_eq!(map.mean(&depth, &first.widths()), Ok(depth.to_vec()));
        // two nodes merged into one at 1.5, which covers half of what both did and more
        map.renew(&first, &flat(&[0.0, 1.5, 3.0])).unwrap();
        assert_eq!(map.of_node(1), 1);
        assert_eq!(map.sum(&[3.0, 6.0, 3.0]), Ok(vec![2.0, 4.0, 4.0, 2.0]));
        // an edge split: the new node stands in its middle
        map.renew(&flat(&[0.0, 1.5, 3.0]), &flat(&[0.0, 0.75, 1.5, 3.0]))
            .unwrap();
        let shares = map.sum(&[3.0, 6.0, 9.0, 6.0]).unwrap();
        let expected = [4.0, 8.0, 8.0, 4.0];
        for (found, expected) in shares.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-13, "{shares:?}");
        }
        assert!(map.renew(&first, &first).is_ok());
        assert!(map.renew(&flat(&[0.0, 1.0, 3.0]), &first).is_err());
    }
}
