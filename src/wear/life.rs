use super::jump::trapezoid_error;
use super::update::deepest;
use super::{WearError, all_finite, in_range, same_length};
use serde::{Deserialize, Serialize};

/// The quantity that a limit refers to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Measure {
    /// Worn depth \[m\] of the deepest cell, crossed upwards.
    Depth(f64),
    /// Height \[m\] of the profile above its base line, crossed downwards.
    Height(f64),
}

/// A named limit of use.
///
/// The study's: "6 mm tooth height", `Depth(12.8e-3)` of a tooth 18.8 mm high, and "base reached",
/// `Depth(18.8e-3)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Limit {
    pub name: String,
    pub at: Measure,
}

impl Limit {
    /// A limit on the worn depth \[m\].
    pub fn depth(name: &str, depth: f64) -> Self {
        Limit {
            name: name.to_owned(),
            at: Measure::Depth(depth),
        }
    }

    /// A limit on the height of the profile \[m\].
    pub fn height(name: &str, height: f64) -> Self {
        Limit {
            name: name.to_owned(),
            at: Measure::Height(height),
        }
    }
}

/// One point of a wear history, at the end of a jump.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LifePoint {
    pub cycles: f64,
    pub hours: f64,
    /// Worn depth of every cell \[m\].
    pub depth: Vec<f64>,
    /// Worn volume of every cell [m³ per metre of width]: its part of the area between the new
    /// profile and this one; the sum over the cells is that area.
    pub volume: Vec<f64>,
    /// Height of the profile \[m\] and its highest cell.
    pub height: f64,
    pub highest: usize,
    /// Depth per cycle \[m\] and `load_slip` per cycle [N m] of every cell, as used in the jump
    /// that ends here; zeros at the start.
    pub rate: Vec<f64>,
    pub load_slip: Vec<f64>,
    /// Sum of `|e|` of [`trapezoid_error`] of every cell \[m\] up to here. It uses absolute values:
    /// where the worn shape affects the load, a signed sum can pass through 0 in a cell whose depth
    /// is wrong. The value of the last point is extrapolated from the jump before until the next
    /// rate is known. `None` until there are two rates.
    pub jump_error: Option<Vec<f64>>,
    /// Standard deviation of the depth \[m\] of every cell, from the sampling of its rate.
    pub sampling_error: Vec<f64>,
}

/// When a limit is crossed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LimitLife {
    pub limit: String,
    /// The deciding cell: the first to reach the depth, or the last above the height.
    pub cell: usize,
    /// `None` if the history ends before the limit.
    pub cycles: Option<f64>,
    pub hours: Option<f64>,
    /// `None` if the limit is not reached, or the error of the jumps is unknown.
    pub error_hours: Option<f64>,
    /// The part of it from the jumps, `E / ḣ` of equation (1) of [`Life::crossing`]: a bound.
    pub jump_hours: Option<f64>,
    /// Hours at the last wear rate if the limit is not reached: an extrapolation, not a result.
    /// `None` if reached, or if nothing wears.
    pub extrapolated_hours: Option<f64>,
}

/// One jump, as input of the history.
#[derive(Debug, Clone, Copy)]
pub(super) struct JumpTaken<'a> {
    pub cycles: f64,
    pub cycle_seconds: f64,
    pub rate: &'a [f64],
    pub rate_error: f64,
    pub load_slip: &'a [f64],
    /// Area that this jump removed from every cell \[m²\].
    pub area: &'a [f64],
    pub height: f64,
    pub highest: usize,
}

/// The point after a jump that is not yet added.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NextPoint {
    /// Error of the last point, known by the rate of this jump.
    settled: Option<Vec<f64>>,
    point: LifePoint,
}

/// The history of a worn part, and the life computed from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Life {
    points: Vec<LifePoint>,
}

impl Life {
    /// A new part of `cells` cells, `height` \[m\] high at cell `highest`.
    pub(super) fn new(cells: usize, height: f64, highest: usize) -> Self {
        Life {
            points: vec![LifePoint {
                cycles: 0.0,
                hours: 0.0,
                depth: vec![0.0; cells],
                volume: vec![0.0; cells],
                height,
                highest,
                rate: vec![0.0; cells],
                load_slip: vec![0.0; cells],
                jump_error: Some(vec![0.0; cells]),
                sampling_error: vec![0.0; cells],
            }],
        }
    }

    /// The points; the first is the new part.
    pub fn points(&self) -> &[LifePoint] {
        &self.points
    }

    /// The present state.
    pub fn last(&self) -> &LifePoint {
        // the point of the new part is always there
        &self.points[self.points.len() - 1]
    }

    /// The point after an Euler jump, `h_i += N r_i`; its rate also gives the final error of the jump
    /// before. Nothing changes until it is [added](Life::add).
    pub(super) fn next(&self, jump: JumpTaken) -> Result<NextPoint, WearError> {
        let cells = self.last().depth.len();
        same_length("rates", jump.rate.len(), cells)?;
        same_length("load_slip", jump.load_slip.len(), cells)?;
        same_length("worn areas", jump.area.len(), cells)?;
        all_finite("rate of cell", jump.rate)?;
        let settled = self.settled(jump.rate)?;
        let jump_error = match (&settled, self.points.len()) {
            (Some(before), n) if n > 1 => {
                // assumes that the rate changes as it did over the jump before
                let ratio = jump.cycles / self.step(n - 1);
                let e = trapezoid_error(&self.last().rate, jump.rate, jump.cycles * ratio)?;
                Some(before.iter().zip(e).map(|(b, e)| b + e.abs()).collect())
            }
            _ => None,
        };
        let last = self.last();
        let next = LifePoint {
            cycles: last.cycles + jump.cycles,
            hours: last.hours + jump.cycles * jump.cycle_seconds / 3600.0,
            depth: (last.depth.iter().zip(jump.rate))
                .map(|(h, r)| h + jump.cycles * r)
                .collect(),
            volume: (last.volume.iter().zip(jump.area))
                .map(|(v, a)| v + a)
                .collect(),
            height: jump.height,
            highest: jump.highest,
            rate: jump.rate.to_vec(),
            load_slip: jump.load_slip.to_vec(),
            jump_error,
            // rates of different jumps are sampled independently
            sampling_error: (last.sampling_error.iter().zip(jump.rate))
                .map(|(s, r)| s.hypot(jump.rate_error * r * jump.cycles))
                .collect(),
        };
        all_finite("depth of cell", &next.depth)?;
        all_finite("worn volume of cell", &next.volume)?;
        all_finite("cycles and hours", &[next.cycles, next.hours])?;
        Ok(NextPoint {
            settled,
            point: next,
        })
    }

    /// Adds the point after a jump.
    pub(super) fn add(&mut self, next: NextPoint) {
        self.settle(next.settled);
        self.points.push(next.point);
    }

    /// Replaces the extrapolated error of the last point, once the rate at its end is known.
    pub(super) fn close(&mut self, rate: &[f64]) -> Result<(), WearError> {
        let settled = self.settled(rate)?;
        self.settle(settled);
        Ok(())
    }

    fn settle(&mut self, error: Option<Vec<f64>>) {
        if let Some(point) = self.points.last_mut() {
            point.jump_error = error;
        }
    }

    /// Length of the jump that ends at point `k ≥ 1` \[cycles\].
    fn step(&self, k: usize) -> f64 {
        self.points[k].cycles - self.points[k - 1].cycles
    }

    /// The error of the last point, from the rate at its end.
    fn settled(&self, rate: &[f64]) -> Result<Option<Vec<f64>>, WearError> {
        let k = self.points.len() - 1;
        if k == 0 {
            return Ok(self.points[0].jump_error.clone());
        }
        let error = trapezoid_error(&self.points[k].rate, rate, self.step(k))?;
        let before = self.points[k - 1].jump_error.as_ref();
        Ok(before.map(|b| b.iter().zip(error).map(|(b, e)| b + e.abs()).collect()))
    }

    /// When a limit is crossed. Interpolates linearly between two points, as an Euler jump assumes.
    ///
    /// ```text
    /// t = t_A + (limit − h_A) / ḣ,   error = (E + σ) / ḣ                                (1)
    /// ```
    ///
    /// at the deciding cell. `E` is the largest error of the jumps over all cells, because the
    /// common load passes the error of one cell on to the others (on the study's tooth `E` is 2 to
    /// 3 times the true largest error, and a cell's own estimate can be too small). `σ` is the
    /// sampling error of the deciding cell. Both are interpolated. For a height, `ḣ` is its mean
    /// decrease over the jump. A part that is beyond the limit when new crosses it at 0.
    ///
    /// # Errors
    /// [`WearError::Range`] unless the limit is finite (depth at least 0).
    pub fn crossing(&self, limit: &Limit) -> Result<LimitLife, WearError> {
        match limit.at {
            Measure::Depth(d) => in_range(
                "depth limit [m]",
                d,
                d >= 0.0 && d.is_finite(),
                "finite and at least 0",
            )?,
            Measure::Height(h) => in_range("height limit [m]", h, h.is_finite(), "finite")?,
        }
        let found = |cell, cycles, hours, jump_hours: Option<f64>, sampling: f64| LimitLife {
            limit: limit.name.clone(),
            cell,
            cycles: Some(cycles),
            hours: Some(hours),
            error_hours: jump_hours.map(|jumps| jumps + sampling),
            jump_hours,
            extrapolated_hours: None,
        };
        for (k, point) in self.points.iter().enumerate() {
            let (cell, left) = left_at(point, limit.at);
            if left > 0.0 {
                continue;
            }
            if k == 0 {
                return Ok(found(cell, 0.0, 0.0, Some(0.0), 0.0));
            }
            let before = &self.points[k - 1];
            let (cell, t) = first_in(before, point, limit.at);
            let mix = |a: f64, b: f64| a + t * (b - a);
            let hours = point.hours - before.hours;
            let per_hour = match limit.at {
                Measure::Depth(_) => (point.depth[cell] - before.depth[cell]) / hours,
                Measure::Height(_) => (before.height - point.height) / hours,
            };
            let sampling = mix(before.sampling_error[cell], point.sampling_error[cell]);
            let jump_hours = match (&before.jump_error, &point.jump_error) {
                (Some(a), Some(b)) => Some(mix(largest(a), largest(b)) / per_hour),
                _ => None,
            };
            return Ok(found(
                cell,
                mix(before.cycles, point.cycles),
                mix(before.hours, point.hours),
                jump_hours,
                sampling / per_hour,
            ));
        }
        Ok(self.extrapolate(limit))
    }

    /// For a limit that is not reached: extrapolates with the last rates to the first cell that
    /// reaches it.
    fn extrapolate(&self, limit: &Limit) -> LimitLife {
        let last = self.last();
        let (mut cell, left) = left_at(last, limit.at);
        let mut jumps = f64::INFINITY;
        if let Some(k) = (self.points.len() - 1).checked_sub(1) {
            let before = &self.points[k];
            match limit.at {
                Measure::Depth(d) => {
                    for (i, (a, b)) in before.depth.iter().zip(&last.depth).enumerate() {
                        let n = (d - b) / (b - a);
                        if b > a && n < jumps {
                            (cell, jumps) = (i, n);
                        }
                    }
                }
                Measure::Height(_) if before.height > last.height => {
                    jumps = left / (before.height - last.height);
                }
                Measure::Height(_) => {}
            }
            jumps *= last.hours - before.hours;
        }
        LimitLife {
            limit: limit.name.clone(),
            cell,
            cycles: None,
            hours: None,
            error_hours: None,
            jump_hours: None,
            extrapolated_hours: jumps.is_finite().then_some(last.hours + jumps),
        }
    }
}

fn largest(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(0.0, f64::max)
}

/// The deciding cell and its distance to the limit \[m\]; not above 0 once the limit is reached.
fn left_at(point: &LifePoint, limit: Measure) -> (usize, f64) {
    match limit {
        Measure::Depth(d) => {
            let cell = deepest(&point.depth);
            (cell, d - point.depth[cell])
        }
        Measure::Height(h) => (point.highest, point.height - h),
    }
}

/// The first cell that crosses between two points, and where in [0, 1].
fn first_in(before: &LifePoint, point: &LifePoint, limit: Measure) -> (usize, f64) {
    match limit {
        Measure::Depth(d) => {
            let mut best = (deepest(&point.depth), 1.0);
            for (i, (a, b)) in before.depth.iter().zip(&point.depth).enumerate() {
                let t = (d - a) / (b - a);
                if *b >= d && t < best.1 {
                    best = (i, t);
                }
            }
            best
        }
        Measure::Height(h) => {
            let t = (before.height - h) / (before.height - point.height);
            (before.highest, t)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cells, 2 and 3 nm a cycle at first, over jumps of 1000 cycles of 3.6 s.
    fn life(rates: &[[f64; 2]], rate_error: f64) -> Life {
        let mut life = Life::new(2, 10.0, 0);
        for (i, rate) in rates.iter().enumerate() {
            let next = life.next(JumpTaken {
                cycles: 1000.0,
                cycle_seconds: 3.6,
                rate,
                rate_error,
                load_slip: &[0.0, 0.0],
                area: &[0.0, 0.0],
                height: 9.0 - i as f64,
                highest: 0,
            });
            life.add(next.unwrap());
        }
        life
    }

    #[test]
    fn a_limit_is_crossed_where_the_straight_line_says() {
        let life = life(&[[2.0, 3.0], [4.0, 2.0], [4.0, 2.0]], 0.0);
        // depths: (2, 3), (6, 5), (10, 7) thousand; cell 0 overtakes; 1 hour is 1000 cycles
        let at = |d| life.crossing(&Limit::depth("worn", d)).unwrap();
        let early = at(1.5e3);
        assert_eq!((early.cell, early.hours), (1, Some(0.5)));
        let late = at(8e3);
        assert_eq!(
            (late.cell, late.hours, late.cycles),
            (0, Some(2.5), Some(2500.0))
        );
        // cell 0: the first jump was 1000 short, the others nothing; at 4 per cycle, 0.25 h
        assert_eq!(late.error_hours, Some(0.25));
        assert_eq!(late.extrapolated_hours, None);
        let height = life.crossing(&Limit::height("low", 8.5)).unwrap();
        assert_eq!((height.cell, height.hours), (0, Some(1.5)));
    }

    #[test]
    fn a_limit_not_reached_is_flagged() {
        let life = life(&[[2.0, 3.0]], 0.0);
        let far = life.crossing(&Limit::depth("worn", 6e3)).unwrap();
        assert_eq!((far.hours, far.error_hours), (None, None));
        assert_eq!((far.cell, far.extrapolated_hours), (1, Some(2.0)));
        // nothing wears: no forecast
        let still = Life::new(2, 10.0, 0);
        let never = still.crossing(&Limit::depth("worn", 1.0)).unwrap();
        assert_eq!(never.extrapolated_hours, None);
        assert!(life.crossing(&Limit::depth("nan", f64::NAN)).is_err());
    }

    #[test]
    fn one_jump_alone_has_no_error_until_its_end_rate_is_known() {
        let mut life = life(&[[2.0, 3.0]], 0.1);
        let limit = Limit::depth("worn", 3e3);
        assert_eq!(life.crossing(&limit).unwrap().error_hours, None);
        life.close(&[2.0, 4.0]).unwrap();
        // jumps 500, sampling 10 % of 3000, at 3 per cycle: 800 / 3000 h
        let error = life.crossing(&limit).unwrap().error_hours.unwrap();
        assert!((error - 800.0 / 3000.0).abs() < 1e-15);
    }

    #[test]
    fn sampling_errors_of_different_jumps_add_in_quadrature() {
        let life = life(&[[3.0, 0.0], [4.0, 0.0]], 0.1);
        // 0.1 hypot(3000, 4000); one rounding
        assert!((life.last().sampling_error[0] - 500.0).abs() < 1e-12);
    }
}
