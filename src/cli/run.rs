use super::{Outcome, RunArgs, print_out, run_study, run_threshing, summary};
use crate::experiment::{Engine, Measure, RunError, Samples, measures, simulate};
use crate::report::{
    Align, BodyRow, ContactRow, CsvFile, OutputFolder, Progress, StepRow, Table, number,
};
use crate::scene::{Built, Scene};
use serde_json::json;

/// Most body rows that a run keeps unless `--every` says otherwise.
const BODY_ROWS: usize = 100_000;

pub(super) fn run(args: &RunArgs) -> Result<Outcome, RunError> {
    let scene = args.common.load()?;
    if scene.study.is_some() {
        only_moreau(args, &scene)?;
        return run_study::run(args, &scene);
    }
    if scene.thresher.is_some() {
        only_moreau(args, &scene)?;
        return run_threshing::run(args, &scene);
    }
    let folder = OutputFolder::create(args.common.folder(&scene))?;
    let steps = args.common.step_count(&scene);
    let mut built = scene.build()?;
    let every = args.every.map_or_else(
        || (steps * built.bodies.len()).div_ceil(BODY_ROWS).max(1),
        |n| n as usize,
    );
    let mut files = Files::create(&folder)?;
    files.bodies(0.0, &built, args.engine)?;
    let mut samples = Samples::start(&built, args.engine);
    let progress = Progress::new(&scene.name, steps as u64, args.common.quiet);
    let totals = simulate(&mut built, args.engine, steps, |k, record, built| {
        if scene.reference.is_some() {
            samples.add(record, built, args.engine);
        }
        if (k + 1) % every == 0 {
            files.steps.write(&StepRow::from(record))?;
            for contact in &record.contacts {
                files
                    .contacts
                    .write(&ContactRow::new(record.time, contact))?;
            }
            files.bodies(record.time, built, args.engine)?;
        }
        progress.advance();
        Ok(())
    })?;
    drop(progress);
    files.finish()?;
    let found = measures(&scene, &samples);
    let mut head = summary::header("run", &scene);
    head["settings"]["engine"] = json!(args.engine.name());
    head["settings"]["every"] = json!(every);
    let text = summary::write(
        &folder,
        head,
        json!({
            "totals": summary::totals(&totals),
            "measures": found.iter().map(measure_json).collect::<Vec<_>>(),
            "warnings": summary::warnings(&totals),
        }),
    )?;
    let target = folder.commit()?;
    if args.common.json {
        print_out(&text);
    } else if !args.common.quiet {
        let mut out = format!("{}: {}\n", scene.name, scene.title);
        out.push_str(&summary::describe(&totals));
        if !found.is_empty() {
            out.push_str(&measure_table(&found));
        }
        if every > 1 {
            out.push_str(&format!("every {every}th step is kept in the CSV files\n"));
        }
        out.push_str(&format!("results in {}\n", target.display()));
        print_out(&out);
    }
    Ok(if totals.unsolved_islands > 0 {
        Outcome::Unsolved
    } else {
        Outcome::Done
    })
}

fn only_moreau(args: &RunArgs, scene: &Scene) -> Result<(), RunError> {
    match args.engine {
        Engine::Moreau => Ok(()),
        other => Err(RunError::Unfit(format!(
            "--engine {}: scene {} wears, and only moreau gives the impulses that wear needs",
            other.name(),
            scene.name
        ))),
    }
}

struct Files {
    bodies: CsvFile<BodyRow>,
    contacts: CsvFile<ContactRow>,
    steps: CsvFile<StepRow>,
}

impl Files {
    fn create(folder: &OutputFolder) -> Result<Self, RunError> {
        Ok(Files {
            bodies: CsvFile::create(folder)?,
            contacts: CsvFile::create(folder)?,
            steps: CsvFile::create(folder)?,
        })
    }

    fn bodies(&mut self, time: f64, built: &Built, engine: Engine) -> Result<(), RunError> {
        for (k, &body) in built.bodies.iter().enumerate() {
            if let Some((pose, u)) = engine.state(built, body) {
                self.bodies.write(&BodyRow {
                    time_s: time,
                    body: k as u32,
                    x_m: pose.translation.x,
                    y_m: pose.translation.y,
                    angle_rad: pose.angle(),
                    vx_m_s: u.x,
                    vy_m_s: u.y,
                    omega_rad_s: u.z,
                })?;
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<(), RunError> {
        self.bodies.finish()?;
        self.contacts.finish()?;
        self.steps.finish()?;
        Ok(())
    }
}

fn measure_json(m: &Measure) -> serde_json::Value {
    json!({
        "name": m.name,
        "computed": summary::float(m.computed),
        "exact": summary::float(m.exact),
        "error": summary::float(m.error),
        "unit": m.unit,
    })
}

fn measure_table(found: &[Measure]) -> String {
    let mut table = Table::new([
        ("against the closed form", Align::Left),
        ("computed", Align::Right),
        ("exact", Align::Right),
        ("error", Align::Right),
    ]);
    for m in found {
        let unit = if m.unit == "1" { "" } else { m.unit };
        table.push([
            m.name.to_owned(),
            number(m.computed, 8),
            number(m.exact, 8),
            format!("{} {unit}", number(m.error, 2))
                .trim_end()
                .to_owned(),
        ]);
    }
    format!("{table}")
}
