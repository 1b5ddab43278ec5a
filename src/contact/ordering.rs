//! The order in which nodes of a sparse matrix are eliminated.

/// The neighbours of every node, ascending: those of v are `neighbour[first\[v\]..first[v + 1]]`.
pub fn neighbours(n: usize, pairs: &[(u32, u32)]) -> (Vec<isize>, Vec<isize>) {
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
    // sorted pairs: those that a node ends come before those that it begins
    for &(a, b) in pairs {
        for (v, other) in [(a, b), (b, a)] {
            let place = &mut next[v as usize];
            neighbour[*place as usize] = other as isize;
            *place += 1;
        }
    }
    (first, neighbour)
}

/// Approximate minimum degree ordering; the natural order should the ordering refuse the graph.
pub fn minimum_degree(first: &[isize], neighbour: &[isize]) -> Vec<usize> {
    let n = first.len() - 1;
    if neighbour.len() == n * n.saturating_sub(1) {
        // all are coupled: any order has the same fill
        return (0..n).collect();
    }
    match amd::order(n as isize, first, neighbour, &amd::Control::default()) {
        Ok((order, _, _)) => order.into_iter().map(|v| v as usize).collect(),
        Err(_) => (0..n).collect(),
    }
}
