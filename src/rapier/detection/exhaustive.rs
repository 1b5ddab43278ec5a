//! The reference drive: every part against every other.

use super::{Detector, shapes};

impl Detector {
    /// Adds all pairs of parts whose boxes are within reach of each other.
    pub(super) fn try_all(&mut self) {
        self.pairs.rows.clear();
        // no two parts reach farther, see `Span::reach`
        let reach = 1.1 * self.span.prediction;
        let leaves = &self.leaves;
        let boxes = leaves.list.iter().enumerate();
        let boxes: Vec<(u32, [f64; 4])> = boxes
            .filter_map(|(k, leaf)| {
                let leaf = leaf.as_ref()?;
                Some((k as u32, shapes::extent(&leaf.part, &leaf.pose)))
            })
            .collect();
        for (i, &(a, one)) in boxes.iter().enumerate() {
            for &(b, two) in &boxes[..i] {
                let near = |k: usize| one[k] <= two[k + 2] + reach && two[k] <= one[k + 2] + reach;
                if near(0) && near(1) {
                    self.pairs.rows.add(a, b, &leaves.names);
                }
            }
        }
        self.pairs.rows.sort(&leaves.names);
    }
}
