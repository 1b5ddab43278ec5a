use crate::report::{HeightLimit, LifeRow, ProfileRow, VolumeRow, WearRow};
use crate::scene::Limit as SceneLimit;
use crate::wear::{Life, Limit, LimitLife, WearError, WearState};

/// The rows of a wear run, gathered while it goes.
#[derive(Debug, Clone, Default)]
pub struct WearHistory {
    pub wear: Vec<WearRow>,
    pub volume: Vec<VolumeRow>,
    pub profile: Vec<ProfileRow>,
    pub life: Vec<LifeRow>,
    pub limits: Vec<HeightLimit>,
    /// Of every limit, with what is known where it was not reached.
    pub crossings: Vec<LimitLife>,
    /// How far the history goes.
    pub hours: f64,
    pub cycles: f64,
}

impl WearHistory {
    /// Takes in the present profile of `bar`.
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

    /// Takes in the whole history of `bar` and finds when the limits are crossed.
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
            self.life.push(LifeRow {
                limit: limit.name.clone(),
                hours: crossing.hours.unwrap_or(f64::NAN),
                cycles: crossing.cycles.unwrap_or(f64::NAN),
                error_hours: crossing.error_hours.unwrap_or(f64::NAN),
                bar,
                cell: crossing.cell as u32 + 1,
            });
            self.crossings.push(crossing);
        }
        Ok(())
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
}
