//! What is held while the teeth wear, and when the machine can no longer be operated.

use super::cycle::{Cycle, SETTLING, Threshing};
use super::parameters::{Hold, Thresher};
use super::rows::{OperationRow, ProfileRow};
use super::wear_history::WearHistory;
use crate::dynamics::record::StepRecord;
use crate::experiment::RunError;
use crate::report::Progress;
use crate::thresher::ThreshingWorld;
use crate::wear::{Life, Limit, LimitLife, Profile, WearError, WearState};
use serde::{Deserialize, Serialize};

/// The torque is held this near the operating torque.
pub(super) const TORQUE_TOLERANCE: f64 = 0.02;
/// Cycles that are measured again for one profile at most.
const ATTEMPTS: usize = 8;
/// Within a cycle the modulus stays this near the one of its start.
const STEERED: [f64; 2] = [0.7, 1.4];
/// A machine that holds this many times the crop of a strip laid end to end is plugged: most of
/// what was fed since it was full has not left it.
const PLUGGED: f64 = 2.0;
/// Below this share of the wanted speed the governor no longer holds it: the drive is at its torque
/// limit, and stalls as the teeth wear on.
const STALLED: f64 = 0.98;

/// Cycles before a stall, it included, through which the line of the torque is laid.
const FITTED: usize = 6;

/// Mean torque, power and flow of one measured cycle, machine totals.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Operation {
    /// Of the drive \[N m\].
    pub torque: f64,
    /// What the drive would have to give to keep the cylinder's speed \[N m\]: more than it can once
    /// the cylinder slows down.
    pub demand: f64,
    /// Of the cylinder \[rad/s\].
    pub speed: f64,
    /// Power of the drive and of the feeder \[W\].
    pub drive: f64,
    pub feeder: f64,
    /// Winkler modulus of the crop \[Pa/m\].
    pub stiffness: f64,
    /// Mean crop in the machine over that of a strip laid end to end.
    pub filled: f64,
    /// Crop that left [kg/s].
    pub out: f64,
    /// Whether the crop passes and the drive turns.
    pub conveys: bool,
}

impl Operation {
    /// The row of this cycle at the present end of the life of `state`.
    pub fn row(&self, state: &WearState) -> OperationRow {
        let now = state.life().last();
        OperationRow {
            cycles: now.cycles,
            hours: now.hours,
            torque_nm: self.torque,
            demand_nm: self.demand,
            speed_rad_s: self.speed,
            drive_w: self.drive,
            feeder_w: self.feeder,
            crop_stiffness_pa_m: self.stiffness,
            crop_filled: self.filled,
            crop_out_kg_s: self.out,
            conveys: self.conveys,
        }
    }
}

/// Whether a machine that is `filled` and turns at `speed` over the wanted speed conveys.
pub(super) fn conveys(filled: f64, speed: f64) -> bool {
    filled < PLUGGED && speed > STALLED
}

/// Holds the mean torque of a measured cycle, with [`Hold::Torque`].
///
/// The torque of a revolution scatters by some 2 %, with the crop. At every passage of a bar the
/// modulus is set to what gives the operating torque in the mean of the whole cycle,
///
/// ```text
/// k = k_start (1 − f T/T₀) / (1 − f)                                                   (1)
/// ```
///
/// where `T` is the mean torque of the part `f` that has passed. What is left is the scatter of the
/// last passage, an eighth of a revolution.
#[derive(Serialize, Deserialize)]
pub(super) struct HeldTorque {
    /// Operating torque of the slice \[N m\]; `None` with [`Hold::Feed`].
    target: Option<f64>,
    steps: usize,
    /// Steps of a passage of a bar.
    passage: usize,
    /// Modulus at the start, and its sum over the steps \[Pa/m\].
    start: f64,
    sum: f64,
}

impl HeldTorque {
    /// For a cycle of `steps` steps.
    pub fn new(machine: &Threshing, steps: usize, revolutions: u32) -> HeldTorque {
        let p = machine.parameters;
        let held = p.hold == Hold::Torque;
        HeldTorque {
            target: held.then(|| p.per_metre(p.operating_torque)),
            steps,
            passage: steps.div_ceil(p.bars as usize * revolutions as usize),
            start: machine.world.stiffness(),
            sum: 0.0,
        }
    }

    /// After step number `step`, from 0; `torque` is the mean since the start \[N m\], of the slice.
    pub fn steer(&mut self, world: &mut ThreshingWorld, step: usize, torque: f64) {
        self.sum += world.stiffness();
        let passed = step + 1;
        let at_passage = passed.is_multiple_of(self.passage) && passed < self.steps;
        if let Some(target) = self.target.filter(|_| at_passage) {
            let f = passed as f64 / self.steps as f64;
            let ratio = (1.0 - f * torque / target) / (1.0 - f);
            if ratio.is_finite() {
                world.set_stiffness(self.start * ratio.clamp(STEERED[0], STEERED[1]));
            }
        }
    }

    /// The mean modulus of the cycle \[Pa/m\], which the machine keeps.
    pub fn close(self, world: &mut ThreshingWorld) -> f64 {
        if self.target.is_some() {
            world.set_stiffness(self.sum / self.steps.max(1) as f64);
        }
        world.stiffness()
    }
}

impl Threshing<'_> {
    /// Settles the machine with a new `profile` and measures it, under what the operator holds.
    ///
    /// # Errors
    /// [`RunError`].
    pub(super) fn next_cycle(
        &mut self,
        before: &Cycle,
        profile: &Profile,
        revolutions: u32,
        progress: &Progress,
    ) -> Result<Cycle, RunError> {
        match self.parameters.hold {
            Hold::Feed => self.settled_cycle(profile, revolutions, progress),
            Hold::Torque => {
                self.rescale(before);
                let cycle = self.settled_cycle(profile, revolutions, progress)?;
                self.hold_torque(cycle, profile, revolutions, progress)
            }
        }
    }

    /// As long as the measured torque is more than 2 % off the operating torque, divides the modulus
    /// of the crop by their ratio, and measures again.
    ///
    /// The modulus is the lever, as the torque is nearly proportional to it. The feed rate is none:
    /// at a given thickness it sets the inertia of the crop alone, a few per cent of the power.
    ///
    /// # Errors
    /// [`RunError`].
    pub(super) fn hold_torque(
        &mut self,
        mut cycle: Cycle,
        profile: &Profile,
        revolutions: u32,
        progress: &Progress,
    ) -> Result<Cycle, RunError> {
        for _ in 0..ATTEMPTS {
            let ratio = cycle.operation.torque / self.parameters.operating_torque;
            // grains have no stiffness to scale
            let held = (ratio - 1.0).abs() <= TORQUE_TOLERANCE || self.parameters.grains.is_some();
            if held || !cycle.operation.conveys {
                break;
            }
            self.rescale(&cycle);
            cycle = self.settled_cycle(profile, revolutions, progress)?;
        }
        Ok(cycle)
    }

    fn settled_cycle(
        &mut self,
        profile: &Profile,
        revolutions: u32,
        progress: &Progress,
    ) -> Result<Cycle, RunError> {
        let mut ignore = |_: &StepRecord, _: &ThreshingWorld| Ok(());
        self.world.set_profile(profile)?;
        self.run(SETTLING, progress)?;
        self.measure(profile, revolutions, progress, &mut ignore)
    }

    /// Divides the modulus of the crop by the ratio of a measured torque to the operating torque.
    fn rescale(&mut self, cycle: &Cycle) {
        let ratio = cycle.operation.torque / self.parameters.operating_torque;
        if ratio.is_finite() && ratio > 0.0 {
            let stiffness = self.world.stiffness() / ratio.clamp(0.2, 5.0);
            self.world.set_stiffness(stiffness);
        }
    }
}

/// The machine's own limits, when it stops conveying and when the base under a tooth is worn
/// through, and the standard deviation of the hours of the first by the scatter of the torque \[h\].
/// `base` is the thickness of the base \[m\].
///
/// # Errors
/// [`WearError`].
pub(super) fn limits(
    history: &WearHistory,
    state: &WearState,
    p: &Thresher,
    base: f64,
) -> Result<([LimitLife; 2], f64), WearError> {
    let (conveyance, scatter) = conveyance(&history.operation, state.life(), p)?;
    let through = worn_through(history, state.life(), base);
    Ok(([conveyance, through], scatter))
}

/// The machine conveyed at one measured profile and not at the next. Where the drive stalls, the hours
/// are those at which the torque that it would have to give passes its limit: the torque of a cycle
/// scatters, and how far a stalled cylinder slows down depends on how long it is simulated. A machine
/// that is plugged passed its limit halfway between the two.
fn conveyance(
    rows: &[OperationRow],
    life: &Life,
    p: &Thresher,
) -> Result<(LimitLife, f64), WearError> {
    let none = LimitLife {
        limit: "no longer conveys".to_owned(),
        cell: 0,
        cycles: None,
        hours: None,
        error_hours: None,
        jump_hours: None,
        extrapolated_hours: None,
    };
    let Some(k) = rows.iter().position(|row| !row.conveys) else {
        return Ok((none, 0.0));
    };
    let (before, after) = (&rows[k.saturating_sub(1)], &rows[k]);
    let points: Vec<(f64, f64)> = (rows[..=k].iter())
        .map(|row| (row.hours, row.demand_nm))
        .collect();
    let recent = &points[points.len().saturating_sub(FITTED)..];
    let most = p.drive_torque_factor * p.operating_torque;
    let stalls = (after.crop_filled < PLUGGED).then(|| passes(recent, most));
    let (hours, scatter) = stalls.flatten().unwrap_or((
        0.5 * (before.hours + after.hours),
        0.5 * (after.hours - before.hours),
    ));
    // what is known of the height that the teeth have then is known of these hours
    let height = height_at(life, hours);
    let found = life.crossing(&Limit::height(&none.limit, height))?;
    let error_hours = found.jump_hours.map(|jumps| jumps + 2.0 * scatter);
    let known = LimitLife {
        hours: Some(hours),
        error_hours: error_hours.or(Some(2.0 * scatter)),
        ..found
    };
    Ok((known, scatter))
}

/// Where the least-squares line through `points` reaches `y`, and the standard deviation of that place
/// by the scatter about the line. `None` for fewer than three points, and for a line that does not
/// rise to `y` between them.
fn passes(points: &[(f64, f64)], y: f64) -> Option<(f64, f64)> {
    let n = points.len() as f64;
    let (x0, y0) = (points.iter()).fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let sum =
        |of: fn(f64, f64) -> f64| -> f64 { points.iter().map(|p| of(p.0 - x0, p.1 - y0)).sum() };
    let spread = sum(|x, _| x * x);
    let slope = sum(|x, y| x * y) / spread;
    let at = x0 + (y - y0) / slope;
    let inside = points.len() > 2 && slope > 0.0 && points[0].0 <= at && at <= points.last()?.0;
    let off = points.iter().map(|p| p.1 - y0 - slope * (p.0 - x0));
    let variance = off.map(|r| r * r).sum::<f64>() / (n - 2.0);
    let of_line = variance * (1.0 / n + (at - x0).powi(2) / spread);
    inside.then(|| (at, of_line.sqrt() / slope))
}

/// Height of the teeth after `hours`, on a straight line between two profiles \[m\].
fn height_at(life: &Life, hours: f64) -> f64 {
    let points = life.points();
    let after = points.iter().position(|point| point.hours >= hours);
    let k = after
        .unwrap_or(points.len() - 1)
        .max(1)
        .min(points.len() - 1);
    let (a, b) = (&points[k.saturating_sub(1)], &points[k]);
    match b.hours > a.hours {
        true => a.height + (hours - a.hours) / (b.hours - a.hours) * (b.height - a.height),
        false => b.height,
    }
}

/// The lowest node reaches the underside of the base. Between two profiles it sinks evenly; after
/// the last, at the last rate.
pub(super) fn worn_through(history: &WearHistory, life: &Life, base: f64) -> LimitLife {
    let lowest = lowest(&history.profile);
    let mut limit = LimitLife {
        limit: "base worn through".to_owned(),
        cell: lowest.last().map_or(0, |low| low.node),
        cycles: None,
        hours: None,
        error_hours: None,
        jump_hours: None,
        extrapolated_hours: None,
    };
    let through = lowest.iter().position(|low| low.y <= -base);
    let k = through.unwrap_or(lowest.len().saturating_sub(1));
    if k == 0 {
        return limit;
    }
    let (a, b) = (&lowest[k - 1], &lowest[k]);
    let sunk = a.y - b.y;
    if sunk <= 0.0 {
        return limit;
    }
    let t = (a.y + base) / sunk;
    let hours = a.hours + t * (b.hours - a.hours);
    if through.is_none() {
        limit.extrapolated_hours = Some(hours);
        return limit;
    }
    limit.cell = b.node;
    limit.cycles = Some(a.cycles + t * (b.cycles - a.cycles));
    limit.hours = Some(hours);
    // as for the height of a tooth: the errors of the depth over the speed of the surface
    let point = &life.points()[k];
    let most = |errors: &[f64]| errors.iter().copied().fold(0.0, f64::max);
    let depth = point.jump_error.as_deref().map(most);
    limit.error_hours =
        depth.map(|e| (e + most(&point.sampling_error)) / sunk * (b.hours - a.hours));
    limit
}

/// The lowest node of a written profile.
struct Lowest {
    cycles: f64,
    hours: f64,
    y: f64,
    node: usize,
}

/// The lowest node of every profile, in their order.
fn lowest(rows: &[ProfileRow]) -> Vec<Lowest> {
    let mut found: Vec<Lowest> = Vec::new();
    for row in rows {
        let low = Lowest {
            cycles: row.cycles,
            hours: row.hours,
            y: row.y_m,
            node: row.node as usize - 1,
        };
        match found.last_mut().filter(|last| last.cycles == row.cycles) {
            Some(last) if last.y <= low.y => {}
            Some(last) => *last = low,
            None => found.push(low),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_scattered_points_passes_a_value() {
        let exact: Vec<(f64, f64)> = (0..5).map(|k| (f64::from(k), 2.0 * f64::from(k))).collect();
        let (at, scatter) = passes(&exact, 5.0).unwrap();
        assert!(
            (at - 2.5).abs() < 1e-14 && scatter < 1e-14,
            "{at} {scatter}"
        );
        // residuals +-1 of a slope of 2 at the mean of 4 points: sqrt(4/2/4)/2
        let points = [(0.0, 1.0), (1.0, 1.0), (2.0, 3.0), (3.0, 7.0)];
        let (at, scatter) = passes(&points, 3.0).unwrap();
        assert!((at - 1.5).abs() < 1e-14, "{at}");
        assert!((scatter - 0.5_f64.sqrt() / 2.0).abs() < 1e-14, "{scatter}");
        assert_eq!(passes(&exact[..2], 1.0), None);
        assert_eq!(passes(&exact, 9.0), None);
        let falls: Vec<(f64, f64)> = exact.iter().map(|p| (p.0, -p.1)).collect();
        assert_eq!(passes(&falls, -3.0), None);
    }
}
