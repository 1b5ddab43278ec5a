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
    match amd::order(n as isize, first, neighbour, &amd::Control::default()) {
        Ok((order, _, info)) => {
            let order = order.into_iter().map(|v| v as usize).collect();
            (order, info.n_mult_subs_ldl)
        }
        Err(_) => ((0..n).collect(), usize::MAX),
    }
}
