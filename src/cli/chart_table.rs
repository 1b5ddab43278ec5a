//! Who is dominated where, as a person reads it.

use crate::report::{Align, Cause, Domination, DominationRow, Table, number};

/// One line a scene and measure, the sum below, and the causes of what is left.
pub(super) fn table(domination: &Domination) -> String {
    let mut table = Table::new([
        ("scene", Align::Left),
        ("measure", Align::Left),
        ("peers' points", Align::Right),
        ("dominated", Align::Right),
        ("strictly", Align::Right),
        ("failed", Align::Right),
        ("ours failed", Align::Right),
    ]);
    for pair in &domination.pairs {
        table.push(line(pair));
    }
    let (peers, dominated, strictly) = domination.counts();
    let percent = |part: usize| number(100.0 * part as f64 / peers.max(1) as f64, 3);
    let mut text = table.to_string();
    if peers == 0 {
        text.push_str("no point of a peer\n");
        return text;
    }
    text.push_str(&format!(
        "of {peers} points of peers {dominated} are dominated: {} % ({} % without the spread of \
         times)\n",
        percent(dominated),
        percent(strictly)
    ));
    for (cause, words) in Cause::ALL.into_iter().zip([
        "more accurate than any point of ours",
        "as accurate as one of ours, and faster than every one",
        "at its accuracy faster than ours, where others of ours are as fast",
        "no point of ours was solved",
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
