//! The error of a life of the thresher, source by source.
//!
//! A bias has a sign: the hours of the run minus the true ones. Biases of several sources are added
//! with their signs, noise in quadrature. The printed error is
//!
//! ```text
//! |Σ bias| + Σ bounds + 2 √(Σ σ²)                                                       (1)
//! ```
//!
//! What the run itself tells costs nothing: a bound on the error of the jumps, and the noise of
//! cycles that are sampled one a jump. The bias of jumps, time step and mesh is measured by three more
//! lives, `wear.error = "measured"`: with steps twice as long, and with them jumps half as deep, and
//! edges half as long. Their cycles are nearly free of noise, so that differences of lives tell more than
//! differences of single cycles do.

use super::life::ThreshingOutcome;
use super::machine::Setup;
use super::parameters::Thresher;
use super::rows::ErrorRow;
use crate::report::{number, quantity};
use crate::scene::Scene;
use crate::wear::{Life, LimitLife};

/// Fewest jumps from which their scatter about a trend is told.
const FEWEST: usize = 6;

/// How large one source's error is \[h\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// The run minus the truth.
    Bias(f64),
    /// At most this, of either sign.
    Bound(f64),
    /// Standard deviation.
    Noise(f64),
    NotMeasured,
}

/// The error of a life from one source.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceError {
    pub source: &'static str,
    pub size: Size,
    /// How it is known.
    pub how: String,
}

/// The error of the hours to one limit.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitError {
    pub limit: String,
    /// The hours of the run.
    pub hours: f64,
    /// Jumps, time step, mesh, sampling.
    pub sources: [SourceError; 4],
}

impl LimitError {
    /// Sum of the biases \[h\].
    pub fn bias(&self) -> f64 {
        self.sum(|size| match size {
            Size::Bias(h) => h,
            _ => 0.0,
        })
    }

    /// Standard deviation of all noise together \[h\].
    pub fn noise(&self) -> f64 {
        let squares = self.sum(|size| match size {
            Size::Noise(h) => h * h,
            _ => 0.0,
        });
        squares.sqrt()
    }

    /// Equation (1) of this module \[h\]; NaN if no source is known.
    pub fn total(&self) -> f64 {
        if self.sources.iter().all(|s| s.size == Size::NotMeasured) {
            return f64::NAN;
        }
        let bounds = self.sum(|size| match size {
            Size::Bound(h) => h,
            _ => 0.0,
        });
        self.bias().abs() + bounds + 2.0 * self.noise()
    }

    fn sum(&self, of: impl Fn(Size) -> f64) -> f64 {
        self.sources.iter().map(|s| of(s.size)).sum()
    }

    /// Rows of `life-error.csv`.
    pub(super) fn rows(&self) -> impl Iterator<Item = ErrorRow> + '_ {
        self.sources.iter().map(|source| {
            let (kind, hours) = match source.size {
                Size::Bias(h) => ("bias", h),
                Size::Bound(h) => ("bound", h),
                Size::Noise(h) => ("noise", h),
                Size::NotMeasured => ("not measured", f64::NAN),
            };
            ErrorRow {
                limit: self.limit.clone(),
                source: source.source.to_owned(),
                kind: kind.to_owned(),
                hours,
                how: source.how.clone(),
            }
        })
    }

    /// One line a source.
    pub(super) fn describe(&self) -> String {
        let mut out = format!("error of the hours to {}:\n", self.limit);
        for source in &self.sources {
            let size = match source.size {
                Size::Bias(h) => format!("{h:+.2} h"),
                Size::Bound(h) => format!("≤ {h:.2} h"),
                Size::Noise(h) => format!("± {h:.2} h"),
                Size::NotMeasured => "not measured".to_owned(),
            };
            out.push_str(&format!(
                "  {:<10} {size:>12}  {}\n",
                source.source, source.how
            ));
        }
        out.push_str(&format!(
            "  together   {:>12}  biases by sign, and twice the noise\n  inputs, apart: 1 % more of K or \
             of the load is {:.2} h less\n",
            format!("± {:.2} h", self.total()),
            0.01 * self.hours,
        ));
        out
    }
}

/// What the run tells of the error of each limit that it reached.
pub(super) fn of_run(life: &Life, crossings: &[LimitLife]) -> Vec<LimitError> {
    let reached = |c: &LimitLife| {
        let hours = c.hours?;
        let jumps = match c.jump_hours {
            Some(bound) => SourceError {
                source: "jumps",
                size: Size::Bound(bound),
                how: "sum of the changes of the rates; wear.error = \"measured\" tells the bias"
                    .to_owned(),
            },
            None => not_measured("jumps", "fewer than two rates are known"),
        };
        let extra = "wear.error = \"measured\" measures it";
        Some(LimitError {
            limit: c.limit.clone(),
            hours,
            sources: [
                jumps,
                not_measured("time step", extra),
                not_measured("mesh", extra),
                sampling(life, c.cell, hours),
            ],
        })
    };
    crossings.iter().filter_map(reached).collect()
}

fn not_measured(source: &'static str, why: &str) -> SourceError {
    SourceError {
        source,
        size: Size::NotMeasured,
        how: why.to_owned(),
    }
}

/// Noise of the hours from the scatter of the rates of a cell about their trend.
///
/// Each jump simulates its cycle at another phase of the feed, so that the cycles are replicates. Of
/// the logarithms of independent rates of relative deviation `e` the second differences have the
/// variance `6 e²`, and a life of jumps of `N_k` cycles the deviation `e √(Σ N_k²) / Σ N_k`.
fn sampling(life: &Life, cell: usize, hours: f64) -> SourceError {
    let points = life.points();
    let mut logs = Vec::new();
    let (mut sum, mut squares) = (0.0, 0.0);
    for pair in points.windows(2).take_while(|pair| pair[0].hours < hours) {
        let cycles = pair[1].cycles - pair[0].cycles;
        sum += cycles;
        squares += cycles * cycles;
        logs.push(pair[1].rate[cell].ln());
    }
    let second: Vec<f64> = (logs.windows(3))
        .map(|r| (r[0] - 2.0 * r[1] + r[2]).powi(2))
        .filter(|square| square.is_finite())
        .collect();
    if logs.len() < FEWEST || second.len() + 2 < FEWEST {
        return not_measured("sampling", "too few jumps to tell their scatter");
    }
    let scatter = (second.iter().sum::<f64>() / (6.0 * second.len() as f64)).sqrt();
    SourceError {
        source: "sampling",
        size: Size::Noise(hours * scatter * squares.sqrt() / sum),
        how: format!(
            "the {} rates of cell {} scatter by {} % about their trend, each at another phase of the \
             feed",
            logs.len(),
            cell + 1,
            number(100.0 * scatter, 2)
        ),
    }
}

/// A life computed in another way.
struct Other {
    /// To each limit, in the order of the scene.
    hours: Vec<Option<f64>>,
    jumps: f64,
    /// How it was computed, in words.
    what: String,
}

/// Measures the biases of jumps, time step and mesh by three more lives, at the crop's stiffness of
/// the run, and puts them in place of what the run told.
///
/// All three take steps twice as long, which costs half and tells the bias of the step; the others
/// differ from that life by jumps half as deep, or by edges half as long. With `n` jumps, steps `dt`
/// and edges `h` the life is taken as `T = T₀ + a/n + b dt + c h²`: Euler jumps are of first order,
/// contact points at the ends of the overlaps of second. A step is of second order where it resolves
/// its contacts, and counted as of first: the bias of the time step is then told too large. Coarser
/// meshes than the run's may be too coarse to tell.
///
/// # Arguments
/// - `live`: a life of a scene with its setup, with the stiffness of the setup.
pub(super) fn measure(
    scene: &Scene,
    setup: &Setup<Thresher>,
    outcome: &mut ThreshingOutcome,
    live: impl Fn(&Scene, &Setup<Thresher>) -> Result<ThreshingOutcome, String> + Sync,
) {
    let mut held = setup.clone();
    held.parameters.crop_stiffness = outcome.stiffness;
    let mut slower = scene.clone();
    slower.step.dt *= 2.0;
    let mut shorter = held.clone();
    shorter.wear.jump = 0.5 * outcome.mean_jump;
    let mut finer = held.clone();
    finer.tooth.cells = 2 * setup.tooth.cells - 1;
    let steps = format!("steps of {}", quantity(slower.step.dt, "s", 2));
    let cases = [
        (&held, steps.clone()),
        (
            &shorter,
            format!("{steps}, jumps of {}", quantity(shorter.wear.jump, "m", 2)),
        ),
        (&finer, format!("{steps}, {} nodes", finer.tooth.cells)),
    ];
    let others = std::thread::scope(|scope| {
        let (live, slower) = (&live, &slower);
        let running = cases.map(|(setup, what)| (scope.spawn(move || live(slower, setup)), what));
        running.map(|(run, what)| -> Result<Other, String> {
            let found = run.join().map_err(|_| "it panicked".to_owned()).flatten()?;
            Ok(Other {
                hours: found.history.crossings.iter().map(|c| c.hours).collect(),
                jumps: found.jumps as f64,
                what,
            })
        })
    });
    let names: Vec<String> = (outcome.history.crossings.iter())
        .map(|c| c.limit.clone())
        .collect();
    for error in &mut outcome.errors {
        let limit = names.iter().position(|name| *name == error.limit);
        let hours = |k: usize| -> Result<(f64, &Other), String> {
            let other = others[k]
                .as_ref()
                .map_err(|reason| format!("failed: {reason}"))?;
            let hours = limit.and_then(|i| other.hours[i]);
            let none = || format!("the life with {} does not reach it", other.what);
            Ok((hours.ok_or_else(none)?, other))
        };
        let [jumps, step, mesh, _] = &mut error.sources;
        // a/n of the run
        let mut of_jumps = 0.0;
        jumps.take(hours(0).and_then(|(coarse, at)| {
            let (fine, other) = hours(1)?;
            if other.jumps <= at.jumps {
                return Err("the mesh sets the depth of the jumps, not wear.jump".to_owned());
            }
            of_jumps = (coarse - fine) / (1.0 - at.jumps / other.jumps);
            Ok((of_jumps, fine, other))
        }));
        let run = error.hours;
        step.take(hours(0).map(|(other, at)| (other - run, other, at)));
        mesh.take(hours(0).and_then(|(coarse, at)| {
            let (fine, other) = hours(2)?;
            // a finer mesh bounds the depth of its jumps
            let fine_at_equal_jumps = fine + of_jumps * (1.0 - at.jumps / other.jumps);
            Ok(((coarse - fine_at_equal_jumps) / (1.0 - 0.25), fine, other))
        }));
    }
}

impl SourceError {
    /// A measured bias \[h\], with the hours of the other life; or why there is none, which leaves what the
    /// run told.
    fn take(&mut self, found: Result<(f64, f64, &Other), String>) {
        match found {
            Ok((bias, hours, other)) => {
                self.size = Size::Bias(bias);
                self.how = format!("the life with {} is {hours:.2} h", other.what);
            }
            Err(why) => self.how = format!("{}; {why}", self.how),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(sizes: [Size; 4]) -> LimitError {
        LimitError {
            limit: "unfit".to_owned(),
            hours: 180.0,
            sources: ["jumps", "time step", "mesh", "sampling"]
                .into_iter()
                .zip(sizes)
                .map(|(source, size)| SourceError {
                    source,
                    size,
                    how: "told".to_owned(),
                })
                .collect::<Vec<_>>()
                .try_into()
                .unwrap(),
        }
    }

    #[test]
    fn biases_add_by_sign_and_noise_in_quadrature() {
        use Size::{Bias, Bound, Noise, NotMeasured};
        let all = error([Bias(-0.75), Bias(0.5), Bias(-0.25), Noise(0.125)]);
        assert_eq!((all.bias(), all.noise(), all.total()), (-0.5, 0.125, 0.75));
        let two = error([Noise(3.0), Noise(4.0), NotMeasured, NotMeasured]);
        assert_eq!(two.total(), 10.0);
        let run = error([Bound(2.5), NotMeasured, NotMeasured, Noise(0.125)]);
        assert_eq!(run.total(), 2.75);
        assert!(error([NotMeasured; 4]).total().is_nan());
        let text = run.describe();
        for words in [
            "≤ 2.50 h",
            "not measured",
            "± 0.12 h",
            "± 2.75 h",
            "1.80 h less",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
        let kinds: Vec<String> = all.rows().map(|row| row.kind).collect();
        assert_eq!(kinds, ["bias", "bias", "bias", "noise"]);
    }
}
