//! The table of dominated points for the terminal.

use crate::report::{Align, Cause, Domination, DominationRow, Table, number};

/// One line for each scene and measure, then the totals, then the causes of undominated points.
pub(super) fn table(domination: &Domination) -> String {
    let mut table = Table::new([
        ("scene", Align::Left),
        ("measure", Align::Left),
        ("peers' points", Align::Right),
        ("dominated", Align::Right),
        ("strictly", Align::Right),
        ("failed", Align::Right),
        ("moreau failed", Align::Right),
    ]);
    for pair in &domination.pairs {
        table.push(line(pair));
    }
    let (peers, dominated, strictly) = domination.counts();
    let percent = |part: usize| number(100.0 * part as f64 / peers.max(1) as f64, 3);
    let mut text = table.to_string();
    if peers == 0 {
        text.push_str("no points of peers\n");
        return text;
    }
    text.push_str(&format!(
        "{dominated} of {peers} points of peers are dominated: {} % ({} % without counting the \
         spread of times)\n",
        percent(dominated),
        percent(strictly)
    ));
    for (cause, words) in Cause::ALL.into_iter().zip([
        "more accurate than every point of moreau",
        "faster than every point of moreau, one of which is as accurate",
        "faster than points of moreau of the same accuracy; less accurate points are as fast",
        "where no point of moreau was solved",
    ]) {
        let of = domination.undominated.iter();
        let count = of.filter(|u| u.cause == cause.word()).count();
        if count > 0 {
            text.push_str(&format!("{count:6} {words}\n"));
        }
    }
    text
}

fn line(pair: &DominationRow) -> Vec<String> {
    let scene = [pair.scene.as_str(), pair.rung.as_str()];
    vec![
        scene.join(" ").trim_end().to_owned(),
        pair.measure.clone(),
        pair.peers.to_string(),
        pair.dominated.to_string(),
        pair.dominated_strictly.to_string(),
        pair.peers_failed.to_string(),
        pair.ours_failed.to_string(),
    ]
}
