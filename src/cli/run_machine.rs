use super::resume::{self, Stopped};
use super::run_files::RunFiles;
use super::run_lead::machine_lead;
use super::{Outcome, RunArgs, run_inputs, run_page, summary};
use crate::checkpoint::{Reader, Writer};
use crate::dynamics::record::StepRecord;
use crate::experiment::{RunError, Totals};
use crate::report::{
    BodyRow, CsvFile, GrainRow, OutputFolder, Progress, ReportError, Stage, written_rows,
};
use crate::scene::Scene;
use crate::thresher::{
    CropWatch, Machine, Setup, Study, Thresher, ThreshingWorld, machine_stage, run_crops,
    run_lives, run_study,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Steps between written rows of the first measured revolution: 1.6 degrees of rotation.
const EVERY: usize = 20;

/// Results of a machine: part of the summary, text for the terminal, totals, and what makes the results
/// those of another machine.
type Found = (Value, String, Totals, Option<String>);

/// Runs the machine of a scene and writes its results.
pub(super) fn run(
    args: &RunArgs,
    scene: &Scene,
    machine: &Machine,
    stopped: Option<Stopped>,
) -> Result<Outcome, RunError> {
    let folder = resume::folder(args, scene, Some(machine), stopped)?;
    let (mut found, mut text, totals, wrong) = match machine {
        Machine::Study(setup) => study(args, scene, setup, &folder)?,
        Machine::Thresher(setup) if setup.parameters.grains.is_some() => {
            grains(args, scene, setup, &folder)?
        }
        Machine::Thresher(setup) => thresher(args, scene, setup, &folder)?,
    };
    if let Some(inputs) = run_inputs::run(args, scene, Some(machine), &folder, &found)? {
        text.push_str(&inputs.describe());
        found["uncertain"] = inputs.json();
        if !args.summary_only {
            inputs.write(&folder)?;
        }
    }
    found["totals"] = summary::totals(&totals);
    let warnings = summary::warnings(&totals);
    found["warnings"] = json!(warnings.iter().chain(&wrong).collect::<Vec<_>>());
    found["wrong"] = json!(wrong);
    let (mut head, say) = (summary::header("run", scene), args.common.flags.say());
    if let Some(of_scene) = &mut head.scene {
        of_scene.warnings = machine.step_warnings(scene.step.dt);
    }
    let lead = machine_lead(&found, &totals, warnings.len(), wrong.as_deref());
    let summary = summary::write(&folder, head, found)?;
    let text_of_page = without_clock(&text);
    let stage = match machine {
        Machine::Thresher(setup) if args.report => seen(&folder, scene, setup)?,
        _ => None,
    };
    run_page::write(
        args,
        &folder,
        &summary,
        lead,
        stage.as_ref(),
        Some(&text_of_page),
    )?;
    summary::finish(folder, &summary, say, |target| {
        let place = target.display();
        format!(
            "{}: {}\n\n{text}\nresults in {place}\n",
            scene.name, scene.title
        )
    })?;
    Ok(match totals.unsolved_islands == 0 && wrong.is_none() {
        true => Outcome::Done,
        false => Outcome::Failed,
    })
}

/// The machine as the files show it; `None` if they show no step.
fn seen(
    folder: &OutputFolder,
    scene: &Scene,
    setup: &Setup<Thresher>,
) -> Result<Option<Stage>, RunError> {
    let rows: Vec<BodyRow> = written_rows(folder)?;
    let most = rows.iter().map(|row| row.body as usize + 1).max();
    let stage = most.map(|count| machine_stage(scene, setup, count));
    Ok(stage.transpose()?)
}

/// The text without the line that tells how long a step took: a page is the same for the same command.
fn without_clock(text: &str) -> String {
    let lines = text.lines().filter(|line| !line.contains(" per step; "));
    lines.collect::<Vec<_>>().join("\n")
}

fn study(
    args: &RunArgs,
    scene: &Scene,
    setup: &Setup<Study>,
    folder: &OutputFolder,
) -> Result<Found, RunError> {
    let study = &setup.parameters;
    let points = (study.torques.len() * study.speeds.len()) as u64;
    let progress = Progress::new(&scene.name, points, args.common.flags.quiet);
    let outcome = run_study(scene, setup, &progress)?;
    drop(progress);
    if !args.summary_only {
        outcome.write(folder, study, &setup.tooth)?;
    }
    let found = outcome.json(study);
    let wrong = outcome.worn_through(study);
    let warnings: Vec<String> = wrong.iter().cloned().collect();
    let text = outcome.describe(study) + &summary::noted(&warnings);
    Ok((found, text, outcome.totals, wrong))
}

fn thresher(
    args: &RunArgs,
    scene: &Scene,
    setup: &Setup<Thresher>,
    folder: &OutputFolder,
) -> Result<Found, RunError> {
    let kept = |name: &str| folder.checkpoint(name, None);
    // once the life has a checkpoint, the first revolution is over and its files are there
    let seen = kept("life").is_some_and(|life| life.is_saved());
    let quiet = args.common.flags.quiet;
    let every = args.every.map_or(EVERY, |n| n as usize);
    let mut files = RunFiles::create(folder, every, args.summary_only || seen)?;
    let lives = run_lives(
        scene,
        setup,
        |label, total| Progress::new(label, total, quiet),
        &mut |record, world| {
            files.add(record, || world.bodies())?;
            Ok(files.flush()?)
        },
        &kept,
    )?;
    files.finish()?;
    let p = &setup.parameters;
    let found = lives.json(p);
    if !args.summary_only {
        lives.run.write(folder, p, &setup.tooth)?;
    }
    let mut text = lives.describe(p, &setup.tooth);
    let totals = lives.totals();
    let wrong = lives.run.missed_torque(p);
    let mut warnings = summary::warnings(&totals);
    warnings.extend(wrong.clone());
    text.push_str(&summary::noted(&warnings));
    Ok((found, text, totals, wrong))
}

fn grains(
    args: &RunArgs,
    scene: &Scene,
    setup: &Setup<Thresher>,
    folder: &OutputFolder,
) -> Result<Found, RunError> {
    let quiet = args.common.flags.quiet;
    let every = args.every.map_or(EVERY, |n| n as usize);
    let mut seen = Seen {
        folder,
        every,
        nothing: args.summary_only,
        files: None,
        sizes: None,
    };
    let crops = run_crops(
        scene,
        setup,
        |label, total| Progress::new(label, total, quiet),
        &mut seen,
        &|name| folder.checkpoint(name, None),
    )?;
    if let Some(files) = seen.files {
        files.finish()?;
    }
    if let Some(sizes) = seen.sizes {
        sizes.file.finish()?;
    }
    let p = &setup.parameters;
    if !args.summary_only {
        crops.write(folder, p, &setup.tooth)?;
    }
    let (totals, wrong) = (crops.grains.totals, crops.wrong(p));
    let mut warnings = summary::warnings(&totals);
    warnings.extend(wrong.clone());
    let mut text = crops.describe(p) + &summary::noted(&warnings);
    if !args.summary_only {
        text.push_str(
            "impacts.csv has the impacts on steel alone, not those of grains on grains\n",
        );
    }
    Ok((crops.json(p), text, totals, wrong))
}

/// The files of the first revolution with grains.
struct Seen<'a> {
    folder: &'a OutputFolder,
    every: usize,
    nothing: bool,
    /// Once the run has begun.
    files: Option<RunFiles>,
    sizes: Option<Sizes>,
}

/// `grains.csv`, and the radius \[m\] that it tells of each number.
struct Sizes {
    file: CsvFile<GrainRow>,
    radii: BTreeMap<u32, f64>,
}

impl Sizes {
    /// Writes the grains that have taken a number since the step written before.
    fn add(&mut self, time: f64, world: &ThreshingWorld) -> Result<(), ReportError> {
        for (body, radius) in world.radii() {
            if self.radii.insert(body, radius) != Some(radius) {
                self.file.write(&GrainRow {
                    time_s: time,
                    body,
                    radius_m: radius,
                })?;
            }
        }
        Ok(())
    }
}

impl CropWatch for Seen<'_> {
    fn begin(&mut self, saved: Option<&mut Reader>) -> Result<(), RunError> {
        let folder = self.folder;
        match saved {
            Some(saved) => {
                self.files = Some(RunFiles::load(folder, self.every, saved)?);
                let sizes: Option<(u64, BTreeMap<u32, f64>)> = saved.take()?;
                self.sizes = sizes
                    .map(|(length, radii)| {
                        let file = CsvFile::reopen(folder, length)?;
                        Ok::<_, ReportError>(Sizes { file, radii })
                    })
                    .transpose()?;
            }
            None => {
                self.files = Some(RunFiles::create(folder, self.every, self.nothing)?);
                if !self.nothing {
                    let file = CsvFile::create(folder)?;
                    let radii = BTreeMap::new();
                    self.sizes = Some(Sizes { file, radii });
                }
            }
        }
        Ok(())
    }

    fn step(&mut self, record: &StepRecord, world: &ThreshingWorld) -> Result<(), RunError> {
        let Some(files) = &mut self.files else {
            return Ok(());
        };
        // of 180 000 impacts a revolution most are those of grains on grains
        let keeps = |bodies| world.is_on_steel(bodies);
        files.add_where(record, keeps, || world.bodies())?;
        if let Some(sizes) = self.sizes.as_mut().filter(|_| files.wrote_step()) {
            sizes.add(record.time, world)?;
        }
        Ok(())
    }

    fn save(&mut self, to: &mut Writer) -> Result<(), RunError> {
        if let Some(files) = &mut self.files {
            files.save(to)?;
        }
        let sizes = self.sizes.as_mut();
        let sizes = sizes.map(|s| Ok::<_, ReportError>((s.file.settle()?, &s.radii)));
        to.put(&sizes.transpose()?)?;
        Ok(())
    }
}
