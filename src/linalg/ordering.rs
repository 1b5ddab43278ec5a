//! The elimination order of the nodes of a sparse matrix.

/// The neighbours of every node, ascending.
pub struct Graph {
    first: Vec<isize>,
    neighbour: Vec<isize>,
}

impl Graph {
    /// Graph of `n` nodes coupled by `pairs` (each `a < b`, sorted, unique).
    pub fn new(n: usize, pairs: &[(u32, u32)]) -> Graph {
        let mut first = vec![0isize; n + 1];
        for &(a, b) in pairs {
            first[a as usize + 1] += 1;
            first[b as usize + 1] += 1;
        }
        for v in 0..n {
            first[v + 1] += first[v];
        }
        let mut next = first.clone();
        let mut neighbour = vec![0; 2 * pairs.len()];
        // sorted pairs: a node's smaller neighbours come before its larger ones
        for &(a, b) in pairs {
            for (v, other) in [(a, b), (b, a)] {
                let place = &mut next[v as usize];
                neighbour[*place as usize] = other as isize;
                *place += 1;
            }
        }
        Graph { first, neighbour }
    }

    /// The same graph with every node its own neighbour, which no ordering depends on.
    fn with_diagonal(&self) -> Graph {
        let n = self.first.len() - 1;
        let mut all = Graph {
            first: vec![0],
            neighbour: Vec::with_capacity(self.neighbour.len() + n),
        };
        for v in 0..n {
            let own = self.of(v);
            let below = own.partition_point(|&other| other < v as isize);
            all.neighbour.extend_from_slice(&own[..below]);
            all.neighbour.push(v as isize);
            all.neighbour.extend_from_slice(&own[below..]);
            all.first.push(all.neighbour.len() as isize);
        }
        all
    }

    /// The neighbours of a node.
    pub fn of(&self, v: usize) -> &[isize] {
        &self.neighbour[self.first[v] as usize..self.first[v + 1] as usize]
    }
}

/// Approximate minimum degree ordering; the natural order if the algorithm rejects the graph.
///
/// Also returns the approximate number of block products of a symmetric factorisation.
pub fn minimum_degree(graph: &Graph) -> (Vec<usize>, usize) {
    let (first, neighbour) = (&graph.first, &graph.neighbour);
    let n = first.len() - 1;
    if neighbour.len() == n * n.saturating_sub(1) {
        // all pairs are coupled: any order has the same fill
        return ((0..n).collect(), n.saturating_pow(3) / 6);
    }
    // the crate asserts, in debug builds, that there are at least as many entries as nodes
    let padded = (neighbour.len() < n).then(|| graph.with_diagonal());
    let Graph { first, neighbour } = padded.as_ref().unwrap_or(graph);
    match amd::order(n as isize, first, neighbour, &amd::Control::default()) {
        Ok((order, _, info)) => {
            let order = order.into_iter().map(|v| v as usize).collect();
            (order, info.n_mult_subs_ldl)
        }
        Err(_) => ((0..n).collect(), usize::MAX),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bug: in debug builds a graph with fewer entries than nodes was a panic within the crate `amd`.
    #[test]
    fn nodes_without_neighbours_are_ordered_too() {
        let graph = Graph::new(9, &[(0, 1), (1, 5), (5, 8)]);
        assert_eq!(graph.with_diagonal().of(5), [1, 5, 8]);
        let (mut order, _) = minimum_degree(&graph);
        order.sort_unstable();
        assert_eq!(order, (0..9).collect::<Vec<usize>>());
    }
}
