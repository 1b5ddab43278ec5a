use super::blocks::Limit as SceneLimit;
use super::life_error::LimitError;
use super::pictures::{HeightLimit, depth_per_cell, heights, tooth_height, worn_profile};
use super::rows::{LifeRow, OperationRow, ProfileRow, VolumeRow, WearRow};
use crate::report::{OutputFolder, ReportError, number, plus_minus, quantity, write_rows};
use crate::wear::{Life, Limit, LimitLife, WearError, WearState};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// The rows of a wear run, collected as it runs.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct WearHistory {
    pub wear: Vec<WearRow>,
    pub volume: Vec<VolumeRow>,
    pub profile: Vec<ProfileRow>,
    pub life: Vec<LifeRow>,
    /// Operation of the machine with every profile; empty for the study.
    pub operation: Vec<OperationRow>,
    pub limits: Vec<HeightLimit>,
    /// Crossings of every limit; an extrapolation for a limit that was not reached.
    pub crossings: Vec<LimitLife>,
    /// The machine's own limits: when it stops conveying, and when a base is worn through.
    pub machine_limits: Vec<LimitLife>,
    /// End of the history \[h\].
    pub hours: f64,
    pub cycles: f64,
}

impl WearHistory {
    /// Adds the present profile of `bar`.
    pub fn add_profile(&mut self, bar: u32, state: &WearState) {
        let now = state.life().last();
        self.hours = self.hours.max(now.hours);
        self.cycles = self.cycles.max(now.cycles);
        for (node, point) in state.profile().nodes().iter().enumerate() {
            self.profile.push(ProfileRow {
                cycles: now.cycles,
                hours: now.hours,
                bar,
                node: node as u32 + 1,
                x_m: point.x,
                y_m: point.y,
            });
        }
    }

    /// Adds the whole history of `bar` and finds when the limits are crossed.
    ///
    /// # Errors
    /// [`WearError::Range`] for a limit that is not finite.
    pub fn close(
        &mut self,
        bar: u32,
        state: &WearState,
        limits: &[SceneLimit],
    ) -> Result<(), WearError> {
        self.add_depths(bar, state.life(), state.cells().stations());
        for limit in limits {
            self.limits.push(HeightLimit {
                name: limit.name.clone(),
                height: limit.height,
            });
            let crossing = state
                .life()
                .crossing(&Limit::height(&limit.name, limit.height))?;
            self.life.push(life_row(bar, &crossing));
            self.crossings.push(crossing);
        }
        Ok(())
    }

    /// Puts the error of the hours, source by source, in place of that of the wear history.
    pub(super) fn set_errors(&mut self, errors: &[LimitError]) {
        for error in errors.iter().filter(|error| error.total().is_finite()) {
            for row in self.life.iter_mut().filter(|r| r.limit == error.limit) {
                row.error_hours = error.total();
            }
            let own = |c: &&mut LimitLife| c.limit == error.limit;
            let all = self.crossings.iter_mut().chain(&mut self.machine_limits);
            for crossing in all.filter(own) {
                crossing.error_hours = Some(error.total());
            }
        }
    }

    /// Adds the machine's own limits.
    pub(super) fn add_limits(&mut self, bar: u32, limits: impl IntoIterator<Item = LimitLife>) {
        for limit in limits {
            self.life.push(life_row(bar, &limit));
            self.machine_limits.push(limit);
        }
    }

    /// Crossings of all limits, the machine's own last.
    pub(super) fn lives(&self) -> impl Iterator<Item = &LimitLife> {
        self.crossings.iter().chain(&self.machine_limits)
    }

    fn add_depths(&mut self, bar: u32, life: &Life, stations: &[f64]) {
        for point in life.points() {
            for (cell, &x) in stations.iter().enumerate() {
                self.wear.push(WearRow {
                    cycles: point.cycles,
                    hours: point.hours,
                    bar,
                    cell: cell as u32 + 1,
                    x_m: x,
                    depth_m: point.depth[cell],
                    load_slip_nm_per_cycle: point.load_slip[cell],
                });
                self.volume.push(VolumeRow {
                    cycles: point.cycles,
                    hours: point.hours,
                    bar,
                    cell: cell as u32 + 1,
                    volume_m3_per_m: point.volume[cell],
                });
            }
        }
    }

    /// The deepest cell (from 1) and its depth \[m\] at the end.
    pub fn deepest(&self) -> Option<(u32, f64)> {
        self.wear
            .iter()
            .filter(|row| row.cycles == self.cycles)
            .map(|row| (row.cell, row.depth_m))
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Writes wear, worn volume, profile and life as CSV, and the three pictures of them.
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn write(
        &self,
        folder: &OutputFolder,
        subtitle: &str,
        base: f64,
    ) -> Result<(), ReportError> {
        write_rows(folder, &self.wear)?;
        write_rows(folder, &self.volume)?;
        write_rows(folder, &self.profile)?;
        write_rows(folder, &self.life)?;
        if !self.operation.is_empty() {
            write_rows(folder, &self.operation)?;
        }
        let chart = worn_profile(&self.profile, 1, base, subtitle)?;
        folder.write("worn-profile.svg", chart.to_svg()?)?;
        let chart = depth_per_cell(&self.wear, 1, subtitle)?;
        folder.write("depth-per-cell.svg", chart.to_svg()?)?;
        let points = heights(&self.profile);
        let chart = tooth_height(&points, &self.limits, &self.life, subtitle);
        folder.write("tooth-height.svg", chart.to_svg()?)
    }

    /// Crossings of the limits for `summary.json`.
    pub(super) fn life_json(&self) -> Vec<Value> {
        self.lives()
            .map(|c| {
                json!({
                    "limit": c.limit,
                    "cell": c.cell + 1,
                    "hours": c.hours,
                    "cycles": c.cycles,
                    "error_hours": c.error_hours,
                    "extrapolated_hours": c.extrapolated_hours,
                })
            })
            .collect()
    }

    /// Hours to each limit, as text.
    pub(super) fn describe(&self) -> String {
        let mut out = String::new();
        for (limit, c) in self.limits.iter().zip(&self.crossings) {
            let what = format!("{} (height {})", c.limit, quantity(limit.height, "m", 3));
            let when = self.when(c);
            out.push_str(&format!("  {what}: {when}, cell {} decides\n", c.cell + 1));
        }
        for c in &self.machine_limits {
            out.push_str(&format!("  {}: {}\n", c.limit, self.when(c)));
        }
        if let Some((cell, depth)) = self.deepest() {
            out.push_str(&format!(
                "  deepest wear {} in cell {cell} after {} hours\n",
                quantity(depth, "m", 4),
                number(self.hours, 4)
            ));
        }
        out
    }

    /// When a limit is reached, as text.
    fn when(&self, c: &LimitLife) -> String {
        match (c.hours, c.error_hours, c.extrapolated_hours) {
            // an unknown error is left out
            (Some(h), e, _) => {
                let hours = plus_minus(h, e.unwrap_or(f64::NAN));
                format!("after {hours} hours")
            }
            (None, _, Some(h)) => format!(
                "not reached in {} hours; about {} at the last rate",
                number(self.hours, 4),
                number(h, 3)
            ),
            (None, _, None) => format!("not within {} hours", number(self.hours, 4)),
        }
    }
}

fn life_row(bar: u32, crossing: &LimitLife) -> LifeRow {
    LifeRow {
        limit: crossing.limit.clone(),
        hours: crossing.hours.unwrap_or(f64::NAN),
        cycles: crossing.cycles.unwrap_or(f64::NAN),
        error_hours: crossing.error_hours.unwrap_or(f64::NAN),
        bar,
        cell: crossing.cell as u32 + 1,
    }
}
