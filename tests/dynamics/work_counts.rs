//! What a step costs, counted: a change that makes steps dearer shows here, on any machine.

use crate::common::{load, run_steps};

/// Scene, changes, steps, then the counts of today: islands at rest, unsolved islands, sweeps,
/// factorisations, pivots.
/// Lower a count where a step has become cheaper; never raise one without a reason in the commit.
type Row = (&'static str, &'static [&'static str], usize, [usize; 5]);

const COUNTS: [Row; 6] = [
    ("wall", &[], 60, [59, 0, 0, 11, 0]),
    ("wall", &["step.keep_rest=false"], 60, [0, 0, 0, 11, 0]),
    ("drum", &[], 150, [0, 0, 1370, 1339, 0]),
    ("card-house", &[], 240, [177, 0, 25520, 3293, 3493]),
    ("hit-heap", &[], 120, [0, 0, 11685, 6115, 0]),
    ("chain", &[], 120, [0, 0, 1819, 119, 0]),
];

#[test]
fn no_step_has_grown_dearer() {
    for (name, changes, steps, [resting, unsolved, sweeps, factorisations, pivots]) in COUNTS {
        let totals = run_steps(&load(name, changes), steps).totals;
        println!(
            "{name} {changes:?}: {:?}",
            [
                totals.resting,
                totals.unsolved_islands,
                totals.sweeps,
                totals.factorisations,
                totals.pivots
            ]
        );
        assert!(
            totals.resting >= resting,
            "{name}: {} at rest",
            totals.resting
        );
        for (what, now, before) in [
            ("unsolved islands", totals.unsolved_islands, unsolved),
            ("sweeps", totals.sweeps, sweeps),
            ("factorisations", totals.factorisations, factorisations),
            ("pivots", totals.pivots, pivots),
        ] {
            assert!(
                now <= before,
                "{name} {changes:?}: {now} {what}, {before} before"
            );
        }
    }
}
