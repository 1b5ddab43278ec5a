//! What came out of a comparison, whether it can be trusted, and what to do: the first words of its page.

use super::atlas_table::{Broken, Share};
use crate::experiment::Engine;
use crate::report::{Domination, Lead, ResultRow, counted, number};

/// The words for points of several engines and settings, of `compare` and `chart`.
///
/// # Arguments
/// - `repeats`: runs of each point, of which the times are medians.
/// - `notes`: how many notes there are.
pub(super) fn of_points(rows: &[ResultRow], repeats: usize, notes: usize) -> Lead {
    let domination = Domination::new(rows);
    let (peers, dominated, _) = domination.counts();
    let mut scenes: Vec<&str> = rows.iter().map(|r| r.scene.as_str()).collect();
    scenes.dedup();
    let on = match scenes[..] {
        [one] => format!("On {one}"),
        _ => format!("On {} scenes", scenes.len()),
    };
    let what_came_out = match peers {
        0 => format!("{on} no point of a peer is to be compared with."),
        _ => format!(
            "{on}, {dominated} of {peers} points of the peers are dominated ({} %): a point of moreau is \
             at least as accurate at no more time.",
            number(100.0 * dominated as f64 / peers as f64, 3),
        ),
    };
    let failed: usize = domination.pairs.iter().map(|pair| pair.ours_failed).sum();
    let ours = match failed {
        0 => "every point of moreau was solved".to_owned(),
        n => format!("{n} measures of moreau are of points that failed or are not solved"),
    };
    let mut references: Vec<&str> = rows.iter().map(|r| r.reference.as_str()).collect();
    references.retain(|r| r.parse::<f64>().is_err() && !r.is_empty());
    references.sort_unstable();
    references.dedup();
    let against = match references[..] {
        [] => String::new(),
        [one] => format!(" Errors are measured against: {one}."),
        _ => format!(
            " Errors are measured against {} references, which results.csv names for each row.",
            references.len()
        ),
    };
    let times = match repeats {
        1 => "Times are of a single run on this computer, and single times scatter".to_owned(),
        n => format!("Times are medians of {n} runs on this computer"),
    };
    let yes = match (failed, repeats) {
        (0, 1) => "The errors, yes; the times, no",
        (0, _) => "Yes",
        _ => "Not everywhere",
    };
    Lead {
        good: failed == 0,
        what_came_out,
        can_it_be_trusted: format!("{yes}: {ours}.{against} {times}.{}", noted(notes)),
        what_to_do: match (failed, repeats) {
            (0, 1) => {
                "Run it again with --repeats 5 before a difference in time of less than a half is \
                       taken for one."
            }
            (0, _) => {
                "Choose the point whose error you can bear, and read its time off the picture."
            }
            _ => "Look for `unsolved` and for modes in results.csv before the pictures are read.",
        }
        .to_owned(),
    }
}

/// The words for an atlas.
pub(super) fn of_rungs(shares: &[Share], broken: &[Broken], notes: usize) -> Lead {
    let passed = shares.iter().map(|share| {
        let [pass, fail, unsolved, _] = share.counts;
        format!("{} {pass} of {}", share.engine, pass + fail + unsolved)
    });
    let passed: Vec<String> = passed.collect();
    let what_came_out = format!(
        "Rungs passed, of those that each engine can run: {}.",
        passed.join(", ")
    );
    let ours = Engine::Moreau.name();
    let can_it_be_trusted = format!(
        "A rung is judged by limits that its file states, the same for each engine, and not by another \
         engine.{}",
        noted(notes)
    );
    let what_to_do = match broken {
        [] => format!("Nothing must be done: {ours} passes every rung that it ran."),
        [first, ..] => {
            let rung = match first.rung.as_str() {
                "" => format!("issues/{}", first.entry),
                rung => format!("atlas/{}:{rung}", first.entry),
            };
            format!(
                "{ours} does not pass {}: the lines below the table name the cause of each. To see one, type \
                 moreau2d run {rung} --report.",
                counted(broken.len(), "rung")
            )
        }
    };
    Lead {
        good: broken.is_empty(),
        what_came_out,
        can_it_be_trusted,
        what_to_do,
    }
}

fn noted(notes: usize) -> String {
    match notes {
        0 => String::new(),
        n => format!(
            " {} below limit what can be read from it.",
            counted(n, "note")
        ),
    }
}
