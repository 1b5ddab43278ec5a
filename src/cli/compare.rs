use super::{CompareArgs, Outcome, print_out, summary};
use crate::experiment::{self, Engine, RunError};
use crate::report::{Align, CsvFile, OutputFolder, Progress, Table, number, quantity};
use serde_json::json;

pub(super) fn compare(args: &CompareArgs) -> Result<Outcome, RunError> {
    let scene = args.common.load()?;
    if scene.study.is_some() || scene.thresher.is_some() {
        return Err(RunError::Unfit(format!(
            "scene {}: a wear scene is not compared with rapier, which gives no slip; use `run`",
            scene.name
        )));
    }
    let folder = OutputFolder::create(args.common.folder(&scene))?;
    let all = Engine::ALL.map(|(_, engine)| engine);
    let (engines, unfit): (Vec<Engine>, Vec<Engine>) = all
        .into_iter()
        .partition(|engine| engine.fits(&scene).is_ok());
    let skipped: Vec<String> = unfit
        .iter()
        .filter_map(|engine| engine.fits(&scene).err())
        .map(|error| error.to_string().replacen("--engine ", "skipped ", 1))
        .collect();
    let steps = args.common.step_count(&scene);
    let repeats = args.repeats as usize;
    let total = steps * engines.len() * repeats;
    let progress = Progress::new(&scene.name, total as u64, args.common.quiet);
    let comparison = experiment::compare(&scene, &engines, steps, repeats, &progress)?;
    drop(progress);
    let mut file = CsvFile::create(&folder)?;
    for row in &comparison.rows {
        file.write(row)?;
    }
    file.finish()?;
    let more = json!({ "rows": comparison.rows.len(), "repeats": repeats, "warnings": skipped });
    let text = summary::write(&folder, summary::header("compare", &scene), more)?;
    let target = folder.commit()?;
    if args.common.json {
        print_out(&text);
    } else if !args.common.quiet {
        let mut out = format!("{}: {}\n", scene.name, scene.title);
        out.push_str(&table(&comparison, &engines));
        for engine in &skipped {
            out.push_str(&format!("note: {engine}\n"));
        }
        out.push_str(&format!("results in {}\n", target.display()));
        print_out(&out);
    }
    Ok(Outcome::Done)
}

/// One line a measure, one column an engine.
fn table(comparison: &experiment::Comparison, engines: &[Engine]) -> String {
    let mut head = vec![("measure (less is better)", Align::Left)];
    head.extend(engines.iter().map(|e| (e.name(), Align::Right)));
    let mut table = Table::new(head);
    let mut measures: Vec<(&str, &str)> = Vec::new();
    for row in &comparison.rows {
        if !measures.iter().any(|(m, _)| *m == row.measure) {
            measures.push((&row.measure, &row.unit));
        }
    }
    for (measure, unit) in measures {
        let unit = if unit == "1" || unit.is_empty() {
            String::new()
        } else {
            format!(" [{unit}]")
        };
        let mut cells = vec![format!("{measure}{unit}")];
        for engine in engines {
            let row = comparison
                .rows
                .iter()
                .find(|r| r.engine == engine.name() && r.measure == measure);
            cells.push(row.map_or("-".to_owned(), |r| number(r.value, 3)));
        }
        table.push(cells);
    }
    let mut cells = vec!["time per simulated second".to_owned()];
    for engine in engines {
        let time = comparison.engines.iter().find(|e| e.0 == engine.name());
        cells.push(time.map_or("-".to_owned(), |t| {
            format!("{} ± {} %", quantity(t.2, "s", 3), number(100.0 * t.3, 2))
        }));
    }
    table.push(cells);
    format!("{table}")
}
