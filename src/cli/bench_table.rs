//! The tables of `bench --solvers` for the terminal.

use crate::report::{Align, Performance, Score, Table, number};

/// Size classes of problems: least and largest number of blocks.
pub(super) const CLASSES: [(usize, usize); 5] =
    [(0, 1), (2, 4), (5, 20), (21, 100), (101, usize::MAX)];

/// `1`, `2-4`, ... `over 100`.
pub(super) fn class_name(class: &(usize, usize)) -> String {
    match *class {
        (_, 1) => "1".to_owned(),
        (least, usize::MAX) => format!("over {}", least - 1),
        (least, most) => format!("{least}-{most}"),
    }
}

/// A table of all solvers on all problems, then one by size with the cheapest solver of each size:
/// the choice of `auto` is made by it.
pub(super) fn tables(performance: &Performance) -> String {
    let count = performance.problems();
    let mut table = Table::new([
        ("solver", Align::Left),
        (&format!("solved of {count}"), Align::Right),
        ("fastest", Align::Right),
        ("median ratio", Align::Right),
        ("sweeps", Align::Right),
        ("factorisations", Align::Right),
        ("pivots", Align::Right),
    ]);
    let scores = performance.scores();
    for s in &scores {
        table.push([
            s.solver.clone(),
            s.solved.to_string(),
            s.wins.to_string(),
            ratio(s),
            s.work.sweeps.to_string(),
            s.work.factorisations.to_string(),
            s.work.pivots.to_string(),
        ]);
    }
    let mut head = vec![
        ("blocks".to_owned(), Align::Left),
        ("problems".to_owned(), Align::Right),
        ("cheapest".to_owned(), Align::Left),
    ];
    head.extend(scores.iter().map(|s| (s.solver.clone(), Align::Right)));
    let mut sizes = Table::new(head);
    for class in &CLASSES {
        let own = performance.sized(class.0, class.1);
        if own.problems() == 0 {
            continue;
        }
        let scores = own.scores();
        let mut cells = vec![
            class_name(class),
            own.problems().to_string(),
            cheapest(&scores).map_or("-", |s| &s.solver).to_owned(),
        ];
        cells.extend(scores.iter().map(|s| match s.solved {
            0 => "-".to_owned(),
            solved => format!("{solved} at {}", ratio(s)),
        }));
        sizes.push(cells);
    }
    let none = match performance.unsolved() {
        0 => String::new(),
        n => format!("no solver solves {n} of {count} problems\n"),
    };
    let spread = performance.spread().map_or(String::new(), |spread| {
        format!(
            "; half of the times repeat to ± {} %",
            number(100.0 * spread, 2)
        )
    });
    format!(
        "{table}ratio: time divided by that of the fastest solver on the same problem, infinite if \
         not solved;\nsweeps, factorisations and pivots: sums over the solved problems{spread}\n\
         {none}\nproblems solved, and median ratio, by size; cheapest: the solver of least median \
         ratio, without auto\n{sizes}"
    )
}

fn ratio(score: &Score) -> String {
    let ratio = score.median_ratio;
    ratio.map_or("-".to_owned(), |ratio| number(ratio, 3))
}

/// The solver of least median ratio among those that `auto` can choose from.
fn cheapest(scores: &[Score]) -> Option<&Score> {
    let own = scores.iter().filter(|s| s.solver != "auto");
    let ranked = own.filter_map(|s| Some((s.median_ratio?, s)));
    let first = ranked.min_by(|(a, s), (b, t)| a.total_cmp(b).then(t.wins.cmp(&s.wins)));
    first.map(|(_, score)| score)
}
