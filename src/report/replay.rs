//! The motion of a run for its page, read from the CSV files that the run wrote.

use super::packed::pack;
use super::stage::{Pose, Stage, View};
use super::{
    BodyRow, ContactRow, GrainRow, ImpactRow, OutputFolder, ReportError, Row, StepRow, written_rows,
};
use serde::Serialize;

/// Most characters of packed numbers. A page of 1000 bodies then stays below 8 MB with its charts.
const BUDGET: usize = 7_300_000;
/// Most frames: more than a screen shows in a minute, and than a time bar has pixels.
const MOST_FRAMES: usize = 3000;
/// Part of the budget that impacts may take.
const OF_IMPACTS: usize = 4;
/// Pieces of the time bar that can be marked.
const PIECES: usize = 500;
/// Mark of a piece with problems that are not certified, but bounded within the limit of the verdict.
const BOUNDED: u8 = 8;
/// Characters of a packed number.
const PACKED: usize = 5;

/// Limits above which a step is marked on the time bar.
#[derive(Debug, Clone)]
pub struct Watch {
    /// Ends of steps \[s\] that are marked as overlaps in any case.
    pub moments: Vec<f64>,
    /// Whether problems that are bounded, not certified, are within the limit of the verdict.
    pub bounded: bool,
    /// Penetration \[m\], and how long it must last \[s\].
    pub overlap: f64,
    pub lasting: f64,
    /// Error of the energy balance of a step \[J\].
    pub imbalance: f64,
}

/// A table of packed numbers, row after row.
#[derive(Debug, Clone, Default, Serialize)]
struct Packed {
    columns: Vec<String>,
    data: String,
    #[serde(skip)]
    wanted: Vec<usize>,
}

/// Frames of a run: every written step, or one in several where all would be too much for a page.
///
/// A body that is not there at a time has no numbers in that frame; one that is fixed may be left out of the
/// files. Files that say nothing of the start have the bodies of the first step in their first frame.
#[derive(Debug, Clone, Serialize)]
pub struct Replay {
    /// Time of the first frame \[s\].
    start: f64,
    /// Number of frames, and of written steps of which one is shown.
    pub frames: usize,
    pub stride: usize,
    /// Rows of `steps.csv`, one a frame; the first frame, of the start, has none.
    step: Packed,
    /// Rows of `bodies.csv`, all bodies of each frame; with the radii of `grains.csv`, if it is there.
    body: Packed,
    /// Rows of `contacts.csv`, those of each frame, and how many these are; the status apart.
    contact: Packed,
    contacts: Vec<usize>,
    statuses: String,
    /// Rows of `impacts.csv`, and the frame at or after each.
    impact: Packed,
    impacts: Vec<usize>,
    /// Impacts that had no room.
    impacts_left_out: usize,
    /// Pieces of equal length of the time bar, a hexadecimal digit each: the sum of 1 failed, 2
    /// overlap that lasts or is too deep, or a passage, 4 energy balance, and of [`BOUNDED`].
    red: String,
    /// What the bodies need of the plane in all frames.
    pub view: View,
}

/// A CSV file of the run, read row by row.
pub(super) struct Rows {
    reader: csv::Reader<std::fs::File>,
    row: csv::StringRecord,
    path: std::path::PathBuf,
}

impl Rows {
    pub(super) fn open<R: Row>(folder: &OutputFolder) -> Result<(Self, Vec<String>), ReportError> {
        let path = folder.place(R::FILE);
        let mut reader =
            csv::Reader::from_path(folder.path(R::FILE)).map_err(ReportError::csv(&path))?;
        let header = reader.headers().map_err(ReportError::csv(&path))?;
        let header = header.iter().map(str::to_owned).collect();
        let rows = Rows {
            reader,
            row: csv::StringRecord::new(),
            path,
        };
        Ok((rows, header))
    }

    pub(super) fn next(&mut self) -> Result<bool, ReportError> {
        let read = self.reader.read_record(&mut self.row);
        read.map_err(ReportError::csv(&self.path))
    }

    /// NaN where the cell is empty.
    pub(super) fn number(&self, column: usize) -> f64 {
        let cell = self.row.get(column).unwrap_or("");
        cell.parse().unwrap_or(f64::NAN)
    }

    pub(super) fn word(&self, column: usize) -> &str {
        self.row.get(column).unwrap_or("")
    }
}

impl Packed {
    /// A table of all columns but `left_out`.
    fn new(header: &[String], left_out: &[&str]) -> Packed {
        let wanted = (0..header.len()).filter(|k| !left_out.contains(&header[*k].as_str()));
        let wanted: Vec<usize> = wanted.collect();
        Packed {
            columns: wanted.iter().map(|k| header[*k].clone()).collect(),
            data: String::new(),
            wanted,
        }
    }

    fn add(&mut self, rows: &Rows) {
        for k in &self.wanted {
            pack(rows.number(*k), &mut self.data);
        }
    }
}

pub(super) fn column(header: &[String], name: &str) -> usize {
    // the headers are those of our own row types
    header.iter().position(|h| h == name).unwrap_or(usize::MAX)
}

impl Replay {
    /// Reads the files of a run that are written and not yet committed.
    ///
    /// # Errors
    /// `ReportError::Io` and `ReportError::Csv`.
    pub fn read(folder: &OutputFolder, stage: &Stage, watch: Watch) -> Result<Replay, ReportError> {
        Replay::within(folder, stage, watch, BUDGET)
    }

    /// As [`Replay::read`], with at most `budget` characters of packed numbers.
    ///
    /// # Errors
    /// `ReportError::Io` and `ReportError::Csv`.
    pub fn within(
        folder: &OutputFolder,
        stage: &Stage,
        watch: Watch,
        budget: usize,
    ) -> Result<Replay, ReportError> {
        let count = stage.bodies.len().max(1);
        let mut shown = Shown::of(folder, count, budget)?;
        let (body, poses) = shown.bodies(folder, stage)?;
        let frames = poses.len() / count;
        let (step, red) = shown.steps(folder, watch)?;
        let (contact, contacts, statuses) = shown.contacts(folder, frames)?;
        let (impact, impacts, impacts_left_out) = shown.impacts(folder, frames)?;
        Ok(Replay {
            start: shown.start,
            frames,
            stride: shown.stride,
            step,
            body,
            contact,
            contacts,
            statuses,
            impact,
            impacts,
            impacts_left_out,
            red,
            view: View::of(stage, poses.chunks_exact(count)),
        })
    }
}

/// Which blocks of rows are frames: the start, every `stride`-th step, and the last.
struct Shown {
    /// Ends of the written steps \[s\].
    times: Vec<f64>,
    stride: usize,
    /// Time of the first frame \[s\].
    start: f64,
    /// How many impacts are shown, and the least of their impulses [N s].
    most_impacts: usize,
    weakest: f64,
}

impl Shown {
    /// As many frames of `count` bodies as there is room for.
    fn of(folder: &OutputFolder, count: usize, budget: usize) -> Result<Shown, ReportError> {
        let times = steps(folder)?.into_iter().map(|[end, _]| end);
        let times: Vec<f64> = times.collect();
        let all_contacts = count_rows::<ContactRow>(folder)?;
        let numbers = times.len() * (BodyRow::HEADER.len() * count + StepRow::HEADER.len())
            + all_contacts * ContactRow::HEADER.len();
        let width = PACKED * ImpactRow::HEADER.len();
        let most_impacts = budget / (OF_IMPACTS * width);
        let mut impulses = impulses(folder)?;
        let kept = impulses.len().min(most_impacts);
        let weakest = match impulses.len() > most_impacts {
            true => {
                *impulses
                    .select_nth_unstable_by(kept, |a, b| b.total_cmp(a))
                    .1
            }
            false => f64::NEG_INFINITY,
        };
        let room = budget - width * kept;
        let stride = (PACKED * numbers).div_ceil(room);
        let stride = stride.max(times.len().div_ceil(MOST_FRAMES)).max(1);
        let start = 0.0;
        Ok(Shown {
            times,
            stride,
            start,
            most_impacts,
            weakest,
        })
    }

    fn has(&self, block: usize) -> bool {
        block.is_multiple_of(self.stride) || block == self.times.len()
    }

    /// Step k, from 0, ends block k + 1.
    fn block(&self, step: usize) -> usize {
        (step + 1).min(self.times.len())
    }

    /// The frame at or after a block.
    fn frame(&self, block: usize, frames: usize) -> usize {
        block.div_ceil(self.stride).min(frames.max(1) - 1)
    }

    /// Rows of the bodies, and their poses; finds the time of the first frame.
    fn bodies(
        &mut self,
        folder: &OutputFolder,
        stage: &Stage,
    ) -> Result<(Packed, Vec<Pose>), ReportError> {
        let (mut rows, header) = Rows::open::<BodyRow>(folder)?;
        let mut body = Packed::new(&header, &["time_s", "body"]);
        let [at, which] = ["time_s", "body"].map(|name| column(&header, name));
        let mut sizes = match folder.path(GrainRow::FILE).is_file() {
            true => written_rows::<GrainRow>(folder)?,
            false => Vec::new(),
        };
        let mut radii = vec![f64::NAN; stage.bodies.len()];
        let sized = !sizes.is_empty();
        if sized {
            body.columns.push("radius_m".to_owned());
        }
        sizes.reverse();
        // the wanted columns start with the pose
        let missing = stage.bodies.iter().map(|actor| match actor.kind {
            "fixed" => vec![0.0; body.wanted.len()],
            _ => vec![f64::NAN; body.wanted.len()],
        });
        let missing: Vec<Vec<f64>> = missing.collect();
        let mut poses: Vec<Pose> = Vec::new();
        let mut frame = |numbers: &[Vec<f64>], time: f64, body: &mut Packed| {
            while let Some(row) = sizes.pop_if(|row| row.time_s <= time) {
                if let Some(radius) = radii.get_mut(row.body as usize) {
                    *radius = row.radius_m;
                }
            }
            for (row, radius) in numbers.iter().zip(&radii) {
                row.iter().for_each(|number| pack(*number, &mut body.data));
                if sized {
                    pack(*radius, &mut body.data);
                }
                poses.push([row[0], row[1], row[2]]);
            }
        };
        let mut block = 0;
        let mut now = None;
        let mut numbers = missing.clone();
        loop {
            let more = rows.next()?;
            let time = rows.number(at);
            if let Some(time_of_block) = now
                && !(more && time_of_block == time)
            {
                if block == 0 && self.times.first() == Some(&time_of_block) {
                    self.start = time_of_block;
                    frame(&numbers, time_of_block, &mut body);
                    block = 1;
                }
                if self.has(block) {
                    frame(&numbers, time_of_block, &mut body);
                }
                block += 1;
                numbers.clone_from(&missing);
            }
            if !more {
                break;
            }
            now = Some(time);
            if let Some(row) = numbers.get_mut(rows.number(which) as usize) {
                let wanted = body.wanted.iter();
                *row = wanted.map(|column| rows.number(*column)).collect();
            }
        }
        Ok((body, poses))
    }

    /// Rows of the steps, and [`Replay::red`].
    fn steps(&self, folder: &OutputFolder, watch: Watch) -> Result<(Packed, String), ReportError> {
        let (mut rows, header) = Rows::open::<StepRow>(folder)?;
        let mut step = Packed::new(&header, &[]);
        let names = [
            "unsolved",
            "failed",
            "penetration_m",
            "imbalance_j",
            "time_s",
        ];
        let [unsolved, failed, overlap, imbalance, at] = names.map(|name| column(&header, name));
        let mut red = [0_u8; PIECES];
        let end = self.times.last().copied().unwrap_or(0.0);
        let mut mark = |from: f64, to: f64, bit: u8| {
            let share = |time: f64| (time - self.start) / (end - self.start);
            let piece = |time: f64| (share(time) * PIECES as f64).clamp(0.0, PIECES as f64);
            let from = (piece(from) as usize).min(PIECES - 1);
            let to = (piece(to).ceil() as usize).max(from + 1);
            red[from..to].iter_mut().for_each(|bits| *bits |= bit);
        };
        let mut since = None;
        let (mut k, mut last) = (0, None);
        while rows.next()? {
            k += 1;
            if self.has(k) {
                step.add(&rows);
            }
            // a row tells what happened since the row before
            let to = rows.number(at);
            let from = last.replace(to).unwrap_or(self.start);
            if rows.number(unsolved) > 0.0 {
                // a run without the column says nothing of failures
                let within = watch.bounded && rows.number(failed) == 0.0;
                mark(from, to, if within { BOUNDED } else { 1 });
            }
            if rows.number(imbalance).abs() > watch.imbalance {
                mark(from, to, 4);
            }
            // times are sums of steps, or multiples
            let within = |time: &f64| (from..to).contains(&(time - 1e-9 * to));
            if watch.moments.iter().any(within) {
                mark(from, to, 2);
            }
            // an overlap counts once it has lasted, as in the verdict
            let deep = rows.number(overlap) > watch.overlap;
            let start = deep.then(|| since.unwrap_or(from));
            if let Some(start) = start.filter(|start| to - start >= watch.lasting.min(end)) {
                mark(start, to, 2);
            }
            since = start;
        }
        let red = red.iter().map(|bits| format!("{bits:x}"));
        Ok((step, red.collect()))
    }

    /// Rows of the contacts, how many each frame has, and their statuses.
    fn contacts(
        &self,
        folder: &OutputFolder,
        frames: usize,
    ) -> Result<(Packed, Vec<usize>, String), ReportError> {
        let (mut rows, header) = Rows::open::<ContactRow>(folder)?;
        let mut contact = Packed::new(&header, &["status"]);
        let [at, status] = ["time_s", "status"].map(|name| column(&header, name));
        let mut contacts = vec![0; frames];
        let mut statuses = String::new();
        let mut k = 0;
        while rows.next()? {
            let time = rows.number(at);
            while k < self.times.len() && self.times[k] < time {
                k += 1;
            }
            let block = self.block(k);
            if self.has(block) {
                contact.add(&rows);
                statuses.push(letter(rows.word(status)));
                contacts[self.frame(block, frames)] += 1;
            }
        }
        Ok((contact, contacts, statuses))
    }

    /// Rows of the strongest impacts, the frame at or after each, and how many had no room.
    fn impacts(
        &self,
        folder: &OutputFolder,
        frames: usize,
    ) -> Result<(Packed, Vec<usize>, usize), ReportError> {
        let (mut rows, header) = Rows::open::<ImpactRow>(folder)?;
        let mut impact = Packed::new(&header, &[]);
        let [at, impulse] = ["time_s", "impulse_n_ns"].map(|name| column(&header, name));
        let (mut impacts, mut left_out, mut k) = (Vec::new(), 0, 0);
        while rows.next()? {
            if impacts.len() == self.most_impacts || rows.number(impulse) < self.weakest {
                left_out += 1;
                continue;
            }
            impact.add(&rows);
            // in the order of the steps that found them; a time past the end tells nothing
            let time = rows.number(at);
            let found = self.times.partition_point(|end| *end < time);
            if found < self.times.len() {
                k = found;
            }
            impacts.push(self.frame(self.block(k), frames));
        }
        Ok((impact, impacts, left_out))
    }
}

/// Normal impulses of all impacts [N s].
fn impulses(folder: &OutputFolder) -> Result<Vec<f64>, ReportError> {
    let (mut rows, header) = Rows::open::<ImpactRow>(folder)?;
    let impulse = column(&header, "impulse_n_ns");
    let mut impulses = Vec::new();
    while rows.next()? {
        impulses.push(rows.number(impulse));
    }
    Ok(impulses)
}

fn count_rows<R: Row>(folder: &OutputFolder) -> Result<usize, ReportError> {
    let (mut rows, _) = Rows::open::<R>(folder)?;
    let mut count = 0;
    while rows.next()? {
        count += 1;
    }
    Ok(count)
}

/// Ends and lengths of the written steps \[s\].
pub(super) fn steps(folder: &OutputFolder) -> Result<Vec<[f64; 2]>, ReportError> {
    let (mut rows, header) = Rows::open::<StepRow>(folder)?;
    let columns = ["time_s", "dt_s"].map(|name| column(&header, name));
    let mut steps = Vec::new();
    while rows.next()? {
        steps.push(columns.map(|column| rows.number(column)));
    }
    Ok(steps)
}

/// One letter for a status.
fn letter(status: &str) -> char {
    match status {
        "stick" => 's',
        "slip+" => 'p',
        "slip-" => 'm',
        "impact" => 'i',
        _ => 'o',
    }
}
