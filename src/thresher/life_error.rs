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
//! cycles that are sampled once a jump. The bias of jumps, time step and mesh is measured by three more
//! lives, `wear.error = "measured"`: with steps twice as long, and with them jumps half as deep, and
//! edges half as long. Every life has noise, so that a measured bias has it too, and (1) counts both.

use super::life::ThreshingOutcome;
use super::machine::Setup;
use super::parameters::Thresher;
use super::rows::ErrorRow;
use crate::experiment::RunError;
use crate::report::{number, quantity};
use crate::scene::Scene;
use crate::wear::{Life, LimitLife};

/// Share of an error of first order that goes when its cause is halved.
const FIRST_ORDER: f64 = 0.5;
/// Fewest jumps from which their scatter about a trend is told.
const FEWEST: usize = 6;

/// How large one source's error is \[h\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// The run minus the truth, as measured with a standard deviation `noise`.
    Bias {
        hours: f64,
        noise: f64,
    },
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
            Size::Bias { hours, .. } => hours,
            _ => 0.0,
        })
    }

    /// Standard deviation of all noise together \[h\], that of the measured biases included.
    pub fn noise(&self) -> f64 {
        let squares = self.sum(|size| match size {
            Size::Noise(h) | Size::Bias { noise: h, .. } => h * h,
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
            let (kind, hours, noise) = match source.size {
                Size::Bias { hours, noise } => ("bias", hours, noise),
                Size::Bound(h) => ("bound", h, 0.0),
                Size::Noise(h) => ("noise", h, h),
                Size::NotMeasured => ("not measured", f64::NAN, f64::NAN),
            };
            ErrorRow {
                limit: self.limit.clone(),
                source: source.source.to_owned(),
                kind: kind.to_owned(),
                hours,
                noise_hours: noise,
                how: source.how.clone(),
            }
        })
    }

    /// One line a source.
    pub(super) fn describe(&self) -> String {
        let mut out = format!("error of the hours to {}:\n", self.limit);
        for source in &self.sources {
            let size = match source.size {
                Size::Bias { hours, noise } => format!("{hours:+.2} ± {noise:.2} h"),
                Size::Bound(h) => format!("≤ {h:.2} h"),
                Size::Noise(h) => format!("± {h:.2} h"),
                Size::NotMeasured => "not measured".to_owned(),
            };
            out.push_str(&format!(
                "  {:<10} {size:>14}  {}\n",
                source.source, source.how
            ));
        }
        out.push_str(&format!(
            "  together   {:>14}  biases by sign, and twice the noise\n  inputs, apart: 1 % more of K or \
             of the load is {:.2} h less\n",
            format!("± {:.2} h", self.total()),
            0.01 * self.hours,
        ));
        out
    }
}

/// What the run tells of the error of each limit that it reached.
///
/// # Arguments
/// - `stop`: when the machine no longer conveyed, and the standard deviation of its hours besides that of
///   the wear \[h\].
pub(super) fn of_run(
    life: &Life,
    crossings: &[LimitLife],
    stop: (&LimitLife, f64),
) -> Vec<LimitError> {
    let reached = |(c, scatter): (&LimitLife, f64)| {
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
                sampling(life, c.cell, hours, scatter),
            ],
        })
    };
    let all = crossings.iter().map(|c| (c, 0.0)).chain([stop]);
    all.filter_map(reached).collect()
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
/// variance `6 e²`, and a life of jumps of `N_k` cycles the deviation `e √(Σ N_k²) / Σ N_k`. `other` is a
/// standard deviation of the hours \[h\] besides.
fn sampling(life: &Life, cell: usize, hours: f64, other: f64) -> SourceError {
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
    let torque = match other > 0.0 {
        true => format!(", and the torque that stops the drive by {other:.2} h"),
        false => String::new(),
    };
    SourceError {
        source: "sampling",
        size: Size::Noise((hours * scatter * squares.sqrt() / sum).hypot(other)),
        how: format!(
            "the {} rates of cell {} scatter by {} % about their trend, each at another phase of the \
             feed{torque}",
            logs.len(),
            cell + 1,
            number(100.0 * scatter, 2)
        ),
    }
}

/// A life computed in another way.
struct Other {
    /// To each limit that it reached.
    errors: Vec<LimitError>,
    jumps: f64,
    /// How it was computed, in words.
    what: String,
}

/// Measures the biases of jumps, time step and mesh by three more lives, at the crop's stiffness of
/// the run, and puts them in place of what the run told.
///
/// All three take steps twice as long, which costs half and tells the bias of the step; the others
/// differ from that life by jumps half as deep, and by edges half as long. Such edges bound the depth of
/// the jumps as well: their life is compared with that of jumps half as deep. With `n` jumps, steps `dt`
/// and edges `h` the life is taken as `T = T₀ + a/n + b dt + c h`. Euler jumps are of first order. A step
/// is of second order where it resolves its contacts, and so is a mesh where the load is smooth, but no
/// order of either can be seen in lives: halving twice gives differences that their noise hides. Both are
/// counted as of first order, the lowest that they can have: their biases are then told too large.
/// Coarser meshes than the run's may be too coarse to tell.
///
/// # Arguments
/// - `live`: a life of a scene with its setup, with the stiffness of the setup, and its name.
///
/// # Errors
/// Those of a checkpoint of such a life. That a life fails is part of the outcome.
pub(super) fn measure(
    scene: &Scene,
    setup: &Setup<Thresher>,
    outcome: &mut ThreshingOutcome,
    live: impl Fn(&Scene, &Setup<Thresher>, &str) -> Result<ThreshingOutcome, RunError> + Sync,
) -> Result<(), RunError> {
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
        (&held, "steps", steps.clone()),
        (
            &shorter,
            "jumps",
            format!("{steps}, jumps of {}", quantity(shorter.wear.jump, "m", 2)),
        ),
        (
            &finer,
            "nodes",
            format!("{steps}, {} nodes", finer.tooth.cells),
        ),
    ];
    let others = std::thread::scope(|scope| {
        let (live, slower) = (&live, &slower);
        let running = cases.map(|(setup, name, what)| {
            let run = scope.spawn(move || live(slower, setup, name));
            (run, what)
        });
        running.map(|(run, what)| match run.join() {
            Ok(Ok(found)) => Ok(Ok(Other {
                errors: found.errors,
                jumps: found.jumps as f64,
                what,
            })),
            // of a file, not of the life
            Ok(Err(error @ (RunError::Checkpoint(_) | RunError::Report(_)))) => Err(error),
            Ok(Err(error)) => Ok(Err(error.to_string())),
            Err(_) => Ok(Err("it panicked".to_owned())),
        })
    });
    let mut found = Vec::new();
    for other in others {
        found.push(other?);
    }
    let others = found;
    for error in &mut outcome.errors {
        let of = |k: usize| -> Result<At, String> {
            let other = (others[k].as_ref()).map_err(|reason| format!("failed: {reason}"))?;
            let found = other.errors.iter().find(|e| e.limit == error.limit);
            let none = || format!("the life with {} does not reach it", other.what);
            let found = found.ok_or_else(none)?;
            Ok(At {
                hours: found.hours,
                noise: found.noise(),
                jumps: other.jumps,
                what: &other.what,
            })
        };
        let (run, noise) = (error.hours, error.noise());
        // a of T and its standard deviation
        let mut of_jumps = [0.0; 2];
        let jumps = of(0).and_then(|coarse| {
            let fine = of(1)?;
            of_jumps = coarse.jump_part(&fine)?;
            Ok(fine.bias(of_jumps.map(|a| a / coarse.jumps)))
        });
        let step = of(0).map(|other| {
            let bias = [other.hours - run, other.noise.hypot(noise)];
            other.bias(bias)
        });
        let mesh = of(1).and_then(|coarse| {
            let fine = of(2)?;
            Ok(fine.bias(coarse.mesh_part(&fine, of_jumps)))
        });
        for (source, found) in error.sources.iter_mut().zip([jumps, step, mesh]) {
            source.take(found);
        }
    }
    Ok(())
}

/// When another life reaches a limit.
struct At<'a> {
    hours: f64,
    /// Standard deviation \[h\].
    noise: f64,
    jumps: f64,
    what: &'a str,
}

impl At<'_> {
    /// `a` \[h\] and its standard deviation, from a life with more jumps.
    fn jump_part(&self, fine: &At) -> Result<[f64; 2], String> {
        if fine.jumps <= self.jumps {
            return Err("the mesh sets the depth of the jumps, not wear.jump".to_owned());
        }
        let change = 1.0 / self.jumps - 1.0 / fine.jumps;
        let noise = self.noise.hypot(fine.noise);
        Ok([self.hours - fine.hours, noise].map(|h| h / change))
    }

    /// `c h` of this life \[h\] and its standard deviation, from one with edges half as long; `a` is that of
    /// the jumps, of which the two may have a few more or less.
    fn mesh_part(&self, fine: &At, a: [f64; 2]) -> [f64; 2] {
        let change = 1.0 / self.jumps - 1.0 / fine.jumps;
        let difference = self.hours - fine.hours - a[0] * change;
        let noise = self.noise.hypot(fine.noise).hypot(a[1] * change);
        [difference, noise].map(|h| h / FIRST_ORDER)
    }

    /// A bias and its standard deviation that this life tells, and in words how.
    fn bias(&self, [hours, noise]: [f64; 2]) -> (Size, String) {
        let how = format!("the life with {} is {:.2} h", self.what, self.hours);
        (Size::Bias { hours, noise }, how)
    }
}

impl SourceError {
    /// A measured bias and how it is known; or why there is none, which leaves what the run told.
    fn take(&mut self, found: Result<(Size, String), String>) {
        match found {
            Ok((size, how)) => (self.size, self.how) = (size, how),
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

    /// `T = T₀ + a/n + b dt + c h`: each part comes out, and with the noise of the lives it hangs on.
    #[test]
    fn parts_of_first_order_are_told_apart() {
        let life = |jumps: f64, edge: f64, noise: f64| At {
            hours: 100.0 + 60.0 / jumps + 3.0 * edge,
            noise,
            jumps,
            what: "",
        };
        let coarse = life(20.0, 1.0, 0.6);
        let shorter = life(60.0, 1.0, 0.8);
        let a = coarse.jump_part(&shorter).unwrap();
        assert!((a[0] - 60.0).abs() < 1e-12 && (a[1] - 30.0).abs() < 1e-12);
        // edges half as long, and jumps nearly as deep as those of the second life
        let mesh = shorter.mesh_part(&life(40.0, 0.5, 0.6), a);
        assert!((mesh[0] - 3.0).abs() < 1e-12, "{mesh:?}");
        // 30 (1/60 − 1/40)
        let noise = 2.0 * 1.0_f64.hypot(0.25);
        assert!((mesh[1] - noise).abs() < 1e-12, "{mesh:?}");
        assert!(coarse.jump_part(&life(20.0, 1.0, 0.8)).is_err());
    }

    #[test]
    fn biases_add_by_sign_and_noise_in_quadrature() {
        use Size::{Bound, Noise, NotMeasured};
        let bias = |hours, noise| Size::Bias { hours, noise };
        let all = error([
            bias(-0.75, 0.0),
            bias(0.5, 0.0),
            bias(-0.25, 0.0),
            Noise(0.125),
        ]);
        assert_eq!((all.bias(), all.noise(), all.total()), (-0.5, 0.125, 0.75));
        let noisy = error([bias(-0.75, 3.0), bias(0.5, 0.0), NotMeasured, Noise(4.0)]);
        assert_eq!(
            (noisy.bias(), noisy.noise(), noisy.total()),
            (-0.25, 5.0, 10.25)
        );
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
