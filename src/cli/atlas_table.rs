//! The table of the atlas for the terminal, made from the rows of `results.csv` alone.

use crate::experiment::{Atlas, Engine};
use crate::report::{Align, ResultRow, Table, number};

/// Number of rungs that an engine passed, failed, left unsolved and could not run.
pub(super) struct Share {
    pub engine: String,
    pub counts: [usize; 4],
}

/// A rung that our engine did not pass, with the known cause.
#[derive(serde::Serialize)]
pub(super) struct Broken<'a> {
    pub entry: String,
    pub rung: String,
    pub verdict: String,
    pub mode: String,
    pub why: &'a str,
}

/// The first row of each rung and engine.
fn verdicts(rows: &[ResultRow]) -> Vec<&ResultRow> {
    let same = |a: &ResultRow, b: &ResultRow| {
        a.scene == b.scene && a.rung == b.rung && a.engine == b.engine
    };
    let mut firsts: Vec<&ResultRow> = Vec::new();
    for row in rows {
        if firsts.last().is_none_or(|last| !same(last, row)) {
            firsts.push(row);
        }
    }
    firsts
}

/// The counts of every engine, in the order of the rows.
pub(super) fn shares(rows: &[ResultRow]) -> Vec<Share> {
    let mut shares: Vec<Share> = Vec::new();
    for row in verdicts(rows) {
        let at = match shares.iter().position(|s| s.engine == row.engine) {
            Some(at) => at,
            None => {
                let engine = row.engine.clone();
                shares.push(Share {
                    engine,
                    counts: [0; 4],
                });
                shares.len() - 1
            }
        };
        let kind = ["pass", "fail", "unsolved"]
            .iter()
            .position(|v| *v == row.verdict);
        shares[at].counts[kind.unwrap_or(3)] += 1;
    }
    shares
}

/// Rungs that our engine failed or left unsolved.
pub(super) fn explanations<'a>(atlas: &'a Atlas, rows: &[ResultRow]) -> Vec<Broken<'a>> {
    let ours = Engine::Moreau.name();
    let broken = verdicts(rows)
        .into_iter()
        .filter(|r| r.engine == ours && matches!(r.verdict.as_str(), "fail" | "unsolved"));
    broken
        .map(|r| {
            let why = atlas.explanation(&r.scene, &r.rung);
            Broken {
                entry: r.scene.clone(),
                rung: r.rung.clone(),
                verdict: r.verdict.clone(),
                mode: r.mode.clone(),
                why: why.unwrap_or("the cause is not known"),
            }
        })
        .collect()
}

/// One line for each rung with a column for each engine, then the counts, then the causes of our
/// failures.
pub(super) fn table(atlas: &Atlas, rows: &[ResultRow]) -> String {
    let shares = shares(rows);
    let mut head = vec![("entry", Align::Left), ("rung", Align::Left)];
    head.extend(shares.iter().map(|s| (s.engine.as_str(), Align::Left)));
    let mut table = Table::new(head);
    let firsts = verdicts(rows);
    let mut entry = "";
    for rung in firsts.chunk_by(|a, b| a.scene == b.scene && a.rung == b.rung) {
        let name = if rung[0].scene == entry {
            ""
        } else {
            &rung[0].scene
        };
        entry = &rung[0].scene;
        let mut cells = vec![name.to_owned(), rung[0].rung.clone()];
        cells.extend(rung.iter().map(|r| cell(r, rows)));
        table.push(cells);
    }
    let mut out = table.to_string();
    for share in &shares {
        let [pass, fail, unsolved, none] = share.counts;
        let run = pass + fail + unsolved;
        let percent = 100.0 * pass as f64 / run.max(1) as f64;
        out += &format!(
            "{}: {pass} of {run} rungs passed ({} %), {fail} failed, {unsolved} unsolved; {none} not run\n",
            share.engine,
            number(percent, 3)
        );
    }
    for b in explanations(atlas, rows) {
        let name = format!("{} {}", b.entry, b.rung);
        out += &format!(
            "{}, {}: {}: {}\n",
            name.trim_end(),
            Engine::Moreau.name(),
            b.mode,
            b.why
        );
    }
    out
}

/// The mode of a pass; for a failure the verdict in capitals, the mode and the first broken measure.
fn cell(row: &ResultRow, rows: &[ResultRow]) -> String {
    let verdict = match row.verdict.as_str() {
        "pass" => return row.mode.clone(),
        "" => return format!("- ({})", row.mode),
        verdict => verdict.to_uppercase(),
    };
    let own = rows
        .iter()
        .filter(|r| r.scene == row.scene && r.rung == row.rung && r.engine == row.engine);
    let broken = own
        .filter(|r| limit(r).is_some_and(|limit| r.value.is_nan() || r.value > limit))
        .map(|r| match r.value.is_nan() {
            // a NaN has no figure to show
            true => String::new(),
            false => format!(" ({} {} {})", r.measure, number(r.value, 2), r.unit),
        })
        .next();
    let broken = broken.unwrap_or_default();
    format!("{verdict} {}{broken}", row.mode)
}

/// The limit of the row's value.
fn limit(row: &ResultRow) -> Option<f64> {
    row.reference.strip_prefix("at most ")?.parse().ok()
}
