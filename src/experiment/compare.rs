use super::baseline::Baseline;
use super::setting::Setting;
use super::simulate::Engine;
use crate::peers::{BaselineSettings, Box2dSettings};
use crate::scene::{Scheme, Step};

/// The sweep of a peer's settings runs every combination, at the scene's step and at a quarter of
/// it. Box2D has no iterations.
const FREQUENCIES: [f64; 4] = [30.0, 120.0, 500.0, 2000.0];
const SUBSTEPS: [usize; 2] = [4, 40];
const ITERATIONS: [usize; 2] = [1, 4];

/// Steps per second of the ladder where the scene's step is 1/60 s.
const LADDER: [f64; 6] = [30.0, 60.0, 125.0, 250.0, 500.0, 1000.0];

/// Step lengths \[s\] of a comparison around `dt`, in falling order, and the index of `dt`.
///
/// Without a ladder: `dt`, its half and its quarter. The ladder is 1/30, 1/60, 1/125, 1/250, 1/500
/// and 1/1000 s if `dt` is 1/60 s within 1 %, else 2, 1, 1/2, 1/4, 1/8 and 1/16 times `dt`.
fn step_lengths(dt: f64, ladder: bool) -> (Vec<f64>, usize) {
    if !ladder {
        return (vec![dt, dt / 2.0, dt / 4.0], 0);
    }
    let mut lengths: Vec<f64> = if (60.0 * dt - 1.0).abs() < 0.01 {
        LADDER.map(f64::recip).to_vec()
    } else {
        (-1..5).map(|k| dt / 2f64.powi(k)).collect()
    };
    lengths[1] = dt;
    (lengths, 1)
}

/// The points that a comparison runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparison {
    /// Schemes of our engine, each with or without event location.
    pub schemes: Vec<(Scheme, bool)>,
    /// Whether to run the ladder of six step lengths in place of three.
    pub ladder: bool,
    /// Whether to run the sweep of the peers' settings besides their presets.
    pub sweep: bool,
    /// Further tolerances and solvers of our engine, in the first scheme and at the scene's step.
    pub tolerances: Vec<f64>,
    pub solvers: Vec<String>,
}

impl Comparison {
    /// The points. First, at every step length: our engine in each scheme, rapier's default and stiff
    /// presets, and Box2D if it is built in. Then the sweep of frequency, substeps and iterations at
    /// two step lengths, rapier's under the name of the stiff engine: all these settings together
    /// bound a peer's accuracy, so that a single preset would not be a fair comparison.
    ///
    /// # Arguments
    /// - `step`: the step of the scene: step length, simulated time, and our solver and tolerance.
    pub fn settings(&self, step: &Step) -> Vec<Setting> {
        let (lengths, base) = step_lengths(step.dt, self.ladder);
        let ours = self.schemes.iter().map(|&(scheme, events)| {
            let step = Step {
                scheme,
                events,
                ..step.clone()
            };
            Setting::new(Engine::Moreau, &step)
        });
        let peers = Engine::ALL.iter().filter(|(_, e)| e.peer().is_some());
        let peers = peers.map(|(_, e)| Setting::new(*e, step));
        let mut settings = Vec::new();
        for setting in ours.chain(peers) {
            settings.extend(lengths.iter().map(|&dt| setting.with_dt(dt)));
        }
        for setting in self.variants(step) {
            if !settings.contains(&setting) {
                settings.push(setting);
            }
        }
        if self.sweep {
            for dt in [lengths[base], lengths[base + 2]] {
                for (engine, baseline) in sweep(dt) {
                    let mut setting = Setting::new(engine, step).with_dt(dt);
                    setting.baseline = Some(baseline);
                    if !settings.contains(&setting) {
                        settings.push(setting);
                    }
                }
            }
        }
        settings
    }

    /// Our engine with one setting changed.
    fn variants(&self, step: &Step) -> Vec<Setting> {
        let Some(&(scheme, events)) = self.schemes.first() else {
            return Vec::new();
        };
        let with = |tolerance: f64, solver: &str| {
            let step = Step {
                scheme,
                events,
                tolerance,
                solver: solver.to_owned(),
                ..step.clone()
            };
            Setting::new(Engine::Moreau, &step)
        };
        let tolerances = self.tolerances.iter().map(|&t| with(t, &step.solver));
        let solvers = self
            .solvers
            .iter()
            .map(|solver| with(step.tolerance, solver));
        tolerances.chain(solvers).collect()
    }

    /// The finest step length of a comparison around `dt`, and a time that is a multiple of every
    /// step length \[s\].
    pub fn finest_and_period(&self, dt: f64) -> (f64, f64) {
        let (lengths, _) = step_lengths(dt, self.ladder);
        let finest = lengths[lengths.len() - 1];
        let period = if lengths[0] == LADDER[0].recip() {
            // six steps of 1/30 s, 25 of 1/125 s
            0.2
        } else {
            lengths[0]
        };
        (finest, period)
    }
}

/// The sweep at steps of `dt` \[s\].
fn sweep(dt: f64) -> Vec<(Engine, Baseline)> {
    let mut all = Vec::new();
    for contact_frequency in FREQUENCIES {
        for substeps in SUBSTEPS {
            for iterations in ITERATIONS {
                let settings = BaselineSettings {
                    contact_frequency,
                    substeps,
                    iterations,
                };
                all.push((Engine::RapierStiff, Baseline::Rapier(settings)));
            }
        }
    }
    if !Engine::ALL.iter().any(|(_, e)| *e == Engine::Box2d) {
        return all;
    }
    for substeps in SUBSTEPS {
        let most = Box2dSettings::highest(substeps, dt);
        let mut lower = 0.0;
        for contact_frequency in FREQUENCIES {
            // Box2D limits the frequency: settings above the limit are the same
            if lower < most {
                let settings = Box2dSettings {
                    contact_frequency,
                    substeps,
                };
                all.push((Engine::Box2d, Baseline::Box2d(settings)));
            }
            lower = contact_frequency;
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ladder_holds_the_scenes_own_step() {
        let (lengths, base) = step_lengths(1.0 / 60.0, true);
        assert_eq!(lengths, LADDER.map(f64::recip));
        assert_eq!(lengths[base], 1.0 / 60.0);
        let (lengths, base) = step_lengths(2e-3, true);
        assert_eq!(lengths, [4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4]);
        assert_eq!(lengths[base], 2e-3);
        // near 1/60 the scene's own step takes the place of 1/60
        assert_eq!(step_lengths(0.0167, true).0[..2], [1.0 / 30.0, 0.0167]);
    }

    #[test]
    fn no_point_runs_twice_and_every_combination_runs() {
        let mut comparison = Comparison {
            schemes: vec![(Scheme::Staggered, false)],
            ladder: false,
            sweep: true,
            ..Comparison::default()
        };
        let settings = comparison.settings(&Step::default());
        for (k, setting) in settings.iter().enumerate() {
            assert!(!settings[..k].contains(setting), "{setting:?}");
        }
        let of = |box2d: bool| {
            let found = settings.iter();
            found
                .filter(|s| (s.engine == Engine::Box2d) == box2d)
                .count()
        };
        // three lengths of ours, default and preset; the sweep's 2 x 16 less the preset's two
        assert_eq!(of(false), 9 + 32 - 2);
        // Box2D at 4 and 40 substeps: 30 Hz, and 30, 120, 300 Hz; at a quarter of the step 30 and
        // 120, and 30, 120, 500, 1200 Hz; less twice its preset
        let there = cfg!(feature = "box2d");
        assert_eq!(of(true), if there { 3 + (4 + 6) - 2 } else { 0 });
        let base = if there { 12 } else { 9 };
        comparison.sweep = false;
        assert_eq!(comparison.settings(&Step::default()), settings[..base]);
        // one thing changed, at the scene's step; what stands there already is not run again
        comparison.tolerances = vec![1e-4, Step::default().tolerance];
        comparison.solvers = vec!["nsgs".to_owned()];
        let more = comparison.settings(&Step::default());
        assert_eq!(more[..base], settings[..base]);
        let changed: Vec<(f64, f64, &str)> = more[base..]
            .iter()
            .map(|s| (s.step.dt, s.step.tolerance, s.step.solver.as_str()))
            .collect();
        assert_eq!(
            changed,
            [(1.0 / 60.0, 1e-4, "auto"), (1.0 / 60.0, 1e-8, "nsgs")]
        );
    }

    #[test]
    fn the_period_holds_every_step() {
        for (dt, ladder) in [(1.0 / 60.0, true), (1.0 / 60.0, false), (2e-3, true)] {
            let comparison = Comparison {
                ladder,
                ..Comparison::default()
            };
            let (finest, period) = comparison.finest_and_period(dt);
            let (lengths, _) = step_lengths(dt, ladder);
            assert_eq!(Some(&finest), lengths.last());
            for length in lengths {
                let steps = period / length;
                assert!((steps - steps.round()).abs() < 1e-9, "{dt}: {length}");
            }
        }
    }
}
