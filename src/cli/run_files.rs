use crate::checkpoint::{Reader, Writer};
use crate::contact::Vec3;
use crate::dynamics::Pose64;
use crate::dynamics::record::{ContactRecord, StepRecord};
use crate::experiment::RunError;
use crate::report::{BodyRow, ContactRow, CsvFile, ImpactRow, OutputFolder, ReportError, StepRow};

/// Number of a body in the record, its pose and its velocity.
pub(super) type BodyState = (u32, Pose64, Vec3);

/// Writes every N-th step of a run to `bodies.csv`, `contacts.csv` and `steps.csv`, and every impact
/// to `impacts.csv`; or nothing. [`RunFiles::add_last`] adds the last step.
pub(super) struct RunFiles {
    /// `None` for a run of which only the summary is kept.
    rows: Option<Rows>,
    every: usize,
    count: usize,
    /// Contacts of the last step.
    last: Vec<ContactRecord>,
    /// End of the last step \[s\].
    time: f64,
    /// Of the steps since the last row.
    since: Option<StepRow>,
}

struct Rows {
    bodies: CsvFile<BodyRow>,
    contacts: CsvFile<ContactRow>,
    impacts: CsvFile<ImpactRow>,
    steps: CsvFile<StepRow>,
}

impl RunFiles {
    /// # Arguments
    /// - `summary_only`: whether to write no file at all.
    pub fn create(
        folder: &OutputFolder,
        every: usize,
        summary_only: bool,
    ) -> Result<Self, ReportError> {
        let rows = || -> Result<Rows, ReportError> {
            Ok(Rows {
                bodies: CsvFile::create(folder)?,
                contacts: CsvFile::create(folder)?,
                impacts: CsvFile::create(folder)?,
                steps: CsvFile::create(folder)?,
            })
        };
        Ok(RunFiles {
            rows: (!summary_only).then(rows).transpose()?,
            every,
            count: 0,
            last: Vec::new(),
            time: 0.0,
            since: None,
        })
    }

    /// Saves where the files end, down to the disk.
    pub fn save(&mut self, to: &mut Writer) -> Result<(), RunError> {
        let lengths = match &mut self.rows {
            Some(rows) => Some([
                rows.bodies.settle()?,
                rows.contacts.settle()?,
                rows.impacts.settle()?,
                rows.steps.settle()?,
            ]),
            None => None,
        };
        to.put(&(lengths, self.count, self.time, &self.last, &self.since))?;
        Ok(())
    }

    /// Goes on with the files of a run that was stopped.
    pub fn load(folder: &OutputFolder, every: usize, from: &mut Reader) -> Result<Self, RunError> {
        let (lengths, count, time, last, since): (Option<[u64; 4]>, _, _, _, _) = from.take()?;
        let rows = match lengths {
            Some([bodies, contacts, impacts, steps]) => Some(Rows {
                bodies: CsvFile::reopen(folder, bodies)?,
                contacts: CsvFile::reopen(folder, contacts)?,
                impacts: CsvFile::reopen(folder, impacts)?,
                steps: CsvFile::reopen(folder, steps)?,
            }),
            None => None,
        };
        Ok(RunFiles {
            rows,
            every,
            count,
            last,
            time,
            since,
        })
    }

    /// Hands what is buffered to the system, so that nothing is lost if the program is killed.
    pub fn flush(&mut self) -> Result<(), ReportError> {
        if let Some(rows) = &mut self.rows {
            rows.bodies.flush()?;
            rows.contacts.flush()?;
            rows.impacts.flush()?;
            rows.steps.flush()?;
        }
        Ok(())
    }

    /// Writes a row for each body at `time` \[s\].
    pub fn add_bodies(
        &mut self,
        time: f64,
        states: impl IntoIterator<Item = BodyState>,
    ) -> Result<(), ReportError> {
        let Some(rows) = &mut self.rows else {
            return Ok(());
        };
        for (body, pose, u) in states {
            rows.bodies.write(&BodyRow {
                time_s: time,
                body,
                x_m: pose.translation.x,
                y_m: pose.translation.y,
                angle_rad: pose.angle(),
                vx_m_s: u.x,
                vy_m_s: u.y,
                omega_rad_s: u.z,
            })?;
        }
        Ok(())
    }

    /// Writes the impacts of a step, and the step itself if it is an N-th one.
    pub fn add<I: IntoIterator<Item = BodyState>>(
        &mut self,
        record: &StepRecord,
        states: impl FnOnce() -> I,
    ) -> Result<(), ReportError> {
        self.add_where(record, |_| true, states)
    }

    /// As [`RunFiles::add`], with those impacts alone whose two bodies `keeps` takes.
    pub fn add_where<I: IntoIterator<Item = BodyState>>(
        &mut self,
        record: &StepRecord,
        keeps: impl Fn([u32; 2]) -> bool,
        states: impl FnOnce() -> I,
    ) -> Result<(), ReportError> {
        let Some(rows) = &mut self.rows else {
            return Ok(());
        };
        self.last.clone_from(&record.contacts);
        self.time = record.time;
        for impact in record.impacts.iter().filter(|i| keeps(i.bodies)) {
            rows.impacts.write(&ImpactRow::from(impact))?;
        }
        self.count += 1;
        let mut row = StepRow::of(record);
        if let Some(before) = self.since.take() {
            row.include(&before);
        }
        self.since = Some(row);
        match self.count.is_multiple_of(self.every) {
            true => self.add_last(states),
            false => Ok(()),
        }
    }

    /// Writes the step added last, unless it is written: so that every step of a run is in a row.
    pub fn add_last<I: IntoIterator<Item = BodyState>>(
        &mut self,
        states: impl FnOnce() -> I,
    ) -> Result<(), ReportError> {
        let (Some(rows), Some(row)) = (&mut self.rows, self.since.take()) else {
            return Ok(());
        };
        rows.steps.write(&row)?;
        for contact in &self.last {
            rows.contacts.write(&ContactRow::new(contact))?;
        }
        self.add_bodies(self.time, states())
    }

    /// Whether the step added last was written.
    pub fn wrote_step(&self) -> bool {
        self.rows.is_some() && self.count > 0 && self.since.is_none()
    }

    /// Writes out what is buffered.
    ///
    /// # Returns
    /// The contacts of the last step and its end \[s\].
    pub fn finish(self) -> Result<(Vec<ContactRecord>, f64), ReportError> {
        if let Some(rows) = self.rows {
            rows.bodies.finish()?;
            rows.contacts.finish()?;
            rows.impacts.finish()?;
            rows.steps.finish()?;
        }
        Ok((self.last, self.time))
    }
}
