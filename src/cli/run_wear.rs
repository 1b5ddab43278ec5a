use super::resume::{self, Stopped};
use super::run::{NEW, head, row_interval, start_files, states, write_moving, write_still};
use super::run_files::{BodyState, RunFiles};
use super::run_lead::lead;
use super::{Outcome, RunArgs, run_inputs, run_page, summary};
use crate::checkpoint::Writer;
use crate::experiment::{Engine, Judge, RunError, Verdict, WearOutcome};
use crate::report::{
    Align, Lead, OutputFolder, Progress, Stage, Table, number, quantity, write_rows,
};
use crate::scene::{Scene, Shape};
use crate::thresher::{ProfileRow, WearRow, depth_per_cell, worn_profile};
use serde::Serialize;
use serde_json::{Value, json};

/// Share of the load at open contacts above which a run says so: what a settled contact has is less.
const OPEN_LOAD: f64 = 0.01;

/// Turn \[rad\] of an outline from which on it has a corner.
const SHARP: f64 = 1.0;

/// The part of `summary.json` that a run with wear writes.
#[derive(Serialize)]
struct Found<'a> {
    totals: Value,
    /// Of the steps until the first jump, with the bodies as they are new.
    verdict: &'a Verdict,
    wear: Vec<WornBody>,
    wear_s: f64,
    wear_hours: f64,
    jumps: usize,
    wear_compliance: bool,
    /// Largest share of the load that a jump measured at open contacts.
    wear_open_load: f64,
    ended: Option<&'a str>,
    warnings: &'a [String],
    /// What uncertain inputs do.
    #[serde(skip_serializing_if = "Value::is_null")]
    uncertain: Value,
}

/// What a body has lost.
#[derive(Serialize)]
struct WornBody {
    body: String,
    coefficient_m2_n: f64,
    deepest_m: f64,
    deepest_cell: u32,
    mean_m: f64,
    volume_m3_per_m: f64,
    /// Largest estimate over the cells; null before the second jump.
    jump_error_m: Option<f64>,
}

/// Runs a scene with `[[wear]]` and writes its results.
pub(super) fn run(
    args: &RunArgs,
    scene: &Scene,
    stopped: Option<Stopped>,
) -> Result<Outcome, RunError> {
    let folder = resume::folder(args, scene, None, stopped)?;
    let steps = args.common.step_count(scene);
    let mut built = scene.build()?;
    let every = row_interval(args, 2 * steps * built.bodies());
    let mut judge = Judge::new(scene, &built);
    let mut wear = WearOutcome::start(scene, &mut built)?;
    let (mut checkpoint, saved) = resume::checkpoint(args, &folder)?;
    let mut files = match saved {
        Some(mut saved) => {
            built.load(&mut saved)?;
            wear.load(&mut saved)?;
            judge.load(&mut saved)?;
            RunFiles::load(&folder, every, &mut saved)?
        }
        None => start_files(args, &folder, every, &built)?,
    };
    let progress = Progress::new(&scene.name, 1000, args.common.flags.quiet);
    let found = wear.go_on(
        scene,
        &mut built,
        steps,
        &progress,
        |record, built, wear| {
            if wear.is_new() {
                judge.add(record, built, Engine::Moreau);
                files.add(record, || states(built, Engine::Moreau))?;
                if wear.ends_cycle() {
                    // the files are of new bodies
                    files.add_last(|| states(built, Engine::Moreau))?;
                }
            }
            if let Some(checkpoint) = &mut checkpoint
                && checkpoint.is_due(wear.totals.steps)
            {
                let mut to = Writer::default();
                built.save(&mut to)?;
                wear.save(&mut to)?;
                judge.save(&mut to)?;
                files.save(&mut to)?;
                checkpoint.save(&to)?;
            }
            Ok(())
        },
    )?;
    drop(progress);
    let last = files.finish()?;
    let states = states(&built, Engine::Moreau);
    if !args.summary_only {
        write_still(&folder, scene, &states, &last)?;
        write_moving(args, &folder, scene)?;
        write(&folder, scene, &found)?;
    }
    let verdict = judge.verdict(&found.totals, &built);
    let notes = notes(scene, &found);
    let worn = bodies(scene, &found);
    let inputs = run_inputs::run(args, scene, None, &folder, &json!({ "wear": worn }))?;
    if let Some(inputs) = inputs.as_ref().filter(|_| !args.summary_only) {
        inputs.write(&folder)?;
    }
    let more = Found {
        totals: summary::totals(&found.totals),
        verdict: &verdict,
        wear: worn,
        wear_s: found.worn.seconds(),
        wear_hours: found.worn.seconds() / 3600.0,
        jumps: found.jumps.len(),
        wear_compliance: found.compliance,
        wear_open_load: found.open_load,
        ended: found.ended.as_deref(),
        warnings: &notes,
        uncertain: inputs.as_ref().map_or(Value::Null, |inputs| inputs.json()),
    };
    let summary = summary::write(&folder, head(scene, Engine::Moreau, every), &more)?;
    let lead = wear_lead(scene, &found, &more, &states);
    let mut table = table(&more);
    table.push_str(&inputs.map_or_else(String::new, |inputs| inputs.describe()));
    let stage = Stage::of(scene);
    run_page::write(args, &folder, &summary, lead, Some(&stage), Some(&table))?;
    summary::finish(folder, &summary, args.common.flags.say(), |target| {
        let steps = summary::describe(&found.totals, Engine::Moreau, scene.step.events);
        format!(
            "{}: {}\n{steps}{} (overlaps, joints and passages are judged until the first jump)\n\
             {}{table}results in {}\n",
            scene.name,
            scene.title,
            verdict.sentence,
            summary::noted(&notes),
            target.display()
        )
    })?;
    Ok(match verdict.held && found.ended.is_none() {
        true => Outcome::Done,
        false => Outcome::Failed,
    })
}

/// The head of the page: what wore, and whether it can be trusted.
fn wear_lead(scene: &Scene, found: &WearOutcome, more: &Found, states: &[BodyState]) -> Lead {
    let (totals, notes) = (&found.totals, more.warnings.len());
    let mut lead = lead(
        scene,
        Engine::Moreau,
        totals,
        more.verdict,
        &[],
        states,
        notes,
    );
    lead.good &= found.ended.is_none();
    lead.what_came_out = format!("{} {} {NEW}", worn_words(more), lead.what_came_out);
    if let Some(why) = &found.ended {
        lead.what_to_do = format!(
            "The wear ended before its duration: {why}. {}",
            lead.what_to_do
        );
    }
    lead
}

fn notes(scene: &Scene, found: &WearOutcome) -> Vec<String> {
    let mut notes = summary::warnings(&found.totals);
    if found.compliance {
        notes.push(
            "contacts are rigid, or stiff for the jumps: surfaces yielded by what each jump wears \
             (wear compliance), which makes the shares of the load unique"
                .to_owned(),
        );
    }
    if found.open_load > OPEN_LOAD {
        notes.push(format!(
            "{} % of the load was measured at open contacts: bodies hop, or slide by sloping cells far in \
             a step; a shorter step.dt or a longer jump helps, and for sloping cells a surface_velocity in \
             place of the body's",
            number(100.0 * found.open_load, 2)
        ));
    }
    for (surface, name) in found.names.iter().enumerate() {
        let mut points = found.state(surface).life().points().iter();
        if points.all(|point| point.load_slip.iter().all(|load| *load == 0.0)) {
            notes.push(format!(
                "nothing slid under load on the edges of body {name} that wear: it did not wear"
            ));
        }
        if has_worn_corners(scene, surface, found) {
            notes.push(format!(
                "{name} wears as a whole: its worn corners go inwards along their bisectors, and take the faces beside \
                 them along, also those that nothing touches. `edges = [first, last]` lets the touched ones wear alone"
            ));
        }
    }
    if let Some(why) = &found.ended {
        notes.push(format!("the wear ended before its duration: {why}"));
    }
    notes
}

/// Whether a whole outline of flat faces has worn at a corner.
fn has_worn_corners(scene: &Scene, surface: usize, found: &WearOutcome) -> bool {
    let shape = &scene.bodies[scene.wear[surface].body].shape;
    let faces = matches!(shape, Shape::Box { .. } | Shape::Polygon { .. });
    let profile = found.state(surface).profile();
    let (nodes, n) = (profile.nodes(), profile.node_count());
    let depth = found.state(surface).depth();
    let is_corner = |k: usize| {
        let [before, here, after] = [k + n - 1, k, k + 1].map(|i| nodes[i % n]);
        let (come, go) = (here - before, after - here);
        // the solid is on the right
        come.perp(&go) < 0.0 && come.angle(&go) > SHARP
    };
    // a mesh that has changed has other nodes than the first one has cells
    let same = depth.len() == n;
    faces && same && profile.is_ring() && (0..n).any(|k| depth[k] > 0.0 && is_corner(k))
}

fn bodies(scene: &Scene, found: &WearOutcome) -> Vec<WornBody> {
    let of = |(surface, name): (usize, &String)| {
        let point = found.state(surface).life().last();
        let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let deepest = largest(&point.depth);
        let cells = point.depth.len();
        let last = found.state(surface).profile();
        let area: f64 = point.volume.iter().sum();
        // cells count in the order of the body's edges, the profile's run the other way
        let cell = point.depth.iter().rev().position(|h| *h == deepest);
        WornBody {
            body: name.clone(),
            coefficient_m2_n: scene.wear[surface].coefficient,
            deepest_m: deepest,
            deepest_cell: cell.map_or(0, |cell| cell.min(cells) as u32 + 1),
            mean_m: area / last.widths().iter().sum::<f64>(),
            volume_m3_per_m: area,
            jump_error_m: point.jump_error.as_deref().map(largest),
        }
    };
    found.names.iter().enumerate().map(of).collect()
}

/// The wear in a sentence.
fn worn_words(found: &Found) -> String {
    let deepest = |a: &&WornBody, b: &&WornBody| a.deepest_m.total_cmp(&b.deepest_m);
    let body = found.wear.iter().max_by(deepest);
    body.map_or_else(String::new, |body| {
        format!(
            "After {} h of wear, computed in {} jumps, {} has lost {} in cell {}, the deepest.",
            number(found.wear_hours, 4),
            found.jumps,
            body.body,
            quantity(body.deepest_m, "m", 4),
            body.deepest_cell
        )
    })
}

fn table(found: &Found) -> String {
    let mut table = Table::new([
        ("body", Align::Left),
        ("deepest", Align::Right),
        ("cell", Align::Right),
        ("mean depth", Align::Right),
        ("volume per metre", Align::Right),
        ("error of the jumps", Align::Right),
    ]);
    for body in &found.wear {
        table.push([
            body.body.clone(),
            quantity(body.deepest_m, "m", 4),
            body.deepest_cell.to_string(),
            quantity(body.mean_m, "m", 4),
            format!("{} m³", number(body.volume_m3_per_m, 4)),
            body.jump_error_m
                .map_or("unknown".to_owned(), |e| quantity(e, "m", 2)),
        ]);
    }
    format!(
        "worn for {} h in {} jumps\n{table}",
        number(found.wear_hours, 4),
        found.jumps
    )
}

/// Wear, profiles and jumps as CSV, and two pictures of each body.
fn write(folder: &OutputFolder, scene: &Scene, found: &WearOutcome) -> Result<(), RunError> {
    write_rows(folder, &found.cells)?;
    write_rows(folder, &found.nodes)?;
    write_rows(folder, &found.jumps)?;
    for (surface, name) in found.names.iter().enumerate() {
        let file: String = name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
            .collect();
        let subtitle = format!("{}, body {name}", scene.name);
        let mut chart = depth_per_cell(&drawn_cells(found, name), 1, &subtitle)?;
        chart.title = "Wear depth along the surface".to_owned();
        chart.x.label = "along the new surface, from its first point [mm]".to_owned();
        folder.write(&format!("wear-per-cell-{file}.svg"), &chart.to_svg()?)?;
        let closed = found.state(surface).profile().is_ring();
        let nodes = drawn_nodes(found, name, closed);
        let mut chart = worn_profile(&nodes, 1, 0.0, &subtitle)?;
        chart.title = "Worn surface".to_owned();
        chart.x.label = "x in the frame of the body [mm]".to_owned();
        chart.y.label = "y in the frame of the body [mm]".to_owned();
        folder.write(&format!("worn-surface-{file}.svg"), &chart.to_svg()?)?;
    }
    Ok(())
}

/// The cells of a body at the distance of their places from the first one, along the new surface: of a
/// closed one two cells lie at every x.
fn drawn_cells(found: &WearOutcome, name: &str) -> Vec<WearRow> {
    let (mut along, mut last) = (0.0, None);
    let rows = found.cells.iter().filter(|row| row.body == name);
    rows.map(|row| {
        let place = (row.x_m, row.y_m);
        along = match last.filter(|_| row.cell > 1) {
            Some((x, y)) => along + f64::hypot(row.x_m - x, row.y_m - y),
            None => 0.0,
        };
        last = Some(place);
        WearRow {
            cycles: row.seconds,
            hours: row.hours,
            bar: 1,
            cell: row.cell,
            x_m: along,
            depth_m: row.depth_m,
            load_slip_nm_per_cycle: row.load_slip_nm_per_s,
        }
    })
    .collect()
}

/// The nodes of a body; of a `closed` surface the first one once more behind the last.
fn drawn_nodes(found: &WearOutcome, name: &str, closed: bool) -> Vec<ProfileRow> {
    let rows: Vec<_> = found.nodes.iter().filter(|row| row.body == name).collect();
    let times = rows.chunk_by(|a, b| a.seconds == b.seconds);
    let outline = times.flat_map(|nodes| nodes.iter().chain(nodes.first().filter(|_| closed)));
    outline
        .map(|row| ProfileRow {
            cycles: row.seconds,
            hours: row.hours,
            bar: 1,
            node: row.node,
            x_m: row.x_m,
            y_m: row.y_m,
        })
        .collect()
}
