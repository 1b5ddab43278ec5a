use super::super::crowd::tests::{FailsLarge, row};
use super::super::overlapping::find_overlaps;
use super::*;
use std::sync::atomic::Ordering;

/// If (1) has no solution for a large island, a solve takes seconds. It must not be tried again
/// until no pair overlaps any more.
#[test]
fn large_islands_without_a_solution_are_tried_once() {
    let fails = FailsLarge::default();
    let tried = fails.tried.clone();
    let mut solver = IslandSolver::new(Box::new(fails), 1e-8);
    for (balls, times) in [(600, [1, 1, 1, 2]), (300, [0; 4])] {
        tried.store(0, Ordering::Relaxed);
        let masses = vec![Vec3::new(1.0, 1.0, 0.0); balls as usize];
        let mut interval = row(0, balls, -0.1);
        let mut still = Solution::default();
        still.end.clone_from(&interval.start);
        // the left wall overlaps by more: the regularised solution moves to the right
        interval.detection.contacts[0].gap = -0.2;
        let mut overlaps = Overlaps::default();
        solver.cache.wedged = false;
        // looks for overlaps in `seen`, then parts those of `interval`
        let mut part = |seen: &Interval| {
            overlaps =
                find_overlaps(&overlaps, seen, &masses, false, |_, _| unreachable!()).unwrap();
            let asked = overlaps.open.len();
            let moves = part_overlaps(
                &mut overlaps,
                &interval,
                &still,
                &Ends::default(),
                &masses,
                (&[], &[]),
                &mut solver,
            );
            (asked, moves)
        };
        let mut counts = Vec::new();
        let mut moves = Vec::new();
        for _ in 0..3 {
            let (asked, moved) = part(&interval);
            assert_eq!(asked, interval.blocks.len());
            moves.push(moved);
            counts.push(tried.load(Ordering::Relaxed));
        }
        assert!(moves[0].iter().any(|(_, d)| d.x > 1e-6), "{balls}");
        assert!(moves[1] == moves[0] && moves[2] == moves[0], "{balls}");
        part(&Interval::default());
        part(&interval);
        counts.push(tried.load(Ordering::Relaxed));
        assert_eq!(counts, times, "{balls}");
    }
}
