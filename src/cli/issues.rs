//! `atlas --issues`: the atlas of complaints.

use super::atlas_table::table;
use crate::experiment::{Atlas, RunError};
use crate::report::{Reply, ResultRow, complaints, engines, parse_rows, rows_of};

/// Results of engines that are not linked into this program, by `benches/peers/issues.py`.
const OTHERS: &str = include_str!("../../benches/peers/issues.csv");

pub(super) const PICTURE: &str = "issues.svg";

/// The rows of each scene, and after them those of engines that are not in this program.
pub(super) fn beside_others(
    atlas: &Atlas,
    rows: Vec<ResultRow>,
) -> Result<Vec<ResultRow>, RunError> {
    let others: Vec<ResultRow> = parse_rows(OTHERS, "benches/peers/issues.csv")?;
    let all: Vec<ResultRow> = rows.into_iter().chain(others).collect();
    let own = |name: &str| -> Vec<ResultRow> {
        let rows = all.iter().filter(|r| r.scene == name);
        rows.cloned().collect()
    };
    Ok(atlas.entries().iter().flat_map(|e| own(&e.name)).collect())
}

pub(super) fn picture(atlas: &Atlas, rows: &[ResultRow]) -> Result<String, RunError> {
    let scene = |e: &crate::scene::AtlasEntry| {
        let threads = e.block.issue.iter().flat_map(|issue| &issue.threads);
        // without the owner of the repository
        let short = |t: &String| t.rsplit('/').next().unwrap_or(t).replace('#', " ");
        let names: Vec<String> = threads.take(2).map(short).collect();
        (e.name.clone(), names.join(", "))
    };
    let scenes: Vec<(String, String)> = atlas.entries().iter().map(scene).collect();
    Ok(complaints(rows, &scenes)?)
}

/// A line for each scene with a column for each engine, then how each engine did.
pub(super) fn text(atlas: &Atlas, rows: &[ResultRow]) -> String {
    let mut out = table(atlas, rows);
    for engine in engines(rows) {
        let entries = atlas.entries().iter();
        let replies: Vec<Reply> = entries
            .map(|e| Reply::of(&rows_of(rows, &e.name, engine)))
            .collect();
        let count = |reply| replies.iter().filter(|r| **r == reply).count();
        out += &format!(
            "{engine}: {} passed, {} failed and said so, {} failed in silence, {} not run\n",
            count(Reply::Pass),
            count(Reply::Said),
            count(Reply::Silent),
            count(Reply::None)
        );
    }
    out
}
