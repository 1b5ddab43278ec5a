//! The measures of the atlas: one table of names and functions of a run.

use super::MachineFigures;
use super::resumed;
use super::trace::{Moment, Trace, larger};
use super::verdict::Check;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::Pose64;
use crate::experiment::RunError;
use crate::scene::atlas::{AtlasCheck, AtlasRung};
use crate::scene::{Hint, JointKind, Scene, Shape};
use std::f64::consts::TAU;

/// A measure of a run.
pub(super) struct Measure {
    name: &'static str,
    /// Numbers that it takes from the check or from `with` of the rung, and their defaults; NaN marks a
    /// required number.
    takes: &'static [(&'static str, f64)],
    unit: &'static str,
    /// Mode of a rung that fails by it.
    fails: &'static str,
    of: Source,
}

enum Source {
    Run(fn(&Trace, &Ask) -> f64),
    /// A value to compare with `exact`: the measure is the relative error, for `rad` the difference.
    Against(fn(&Trace, &Ask) -> f64),
    /// Only for an engine that records the work of its contacts.
    Accounted(fn(&Trace, &Ask) -> f64),
    /// A measure that the run of a machine returns by name.
    Machine,
}

use Source::{Accounted, Against, Machine, Run};

const NEEDED: f64 = f64::NAN;
const RELATIVE: &str = "relative error";

const fn row(
    name: &'static str,
    takes: &'static [(&'static str, f64)],
    unit: &'static str,
    fails: &'static str,
    of: Source,
) -> Measure {
    Measure {
        name,
        takes,
        unit,
        fails,
        of,
    }
}

/// All measures. The body is that of the check, else the last of the scene. Moving bodies are those
/// that impulses can move. `y` is up.
#[rustfmt::skip]
const MEASURES: &[Measure] = &[
    // where bodies are, at worst over the run
    row("penetration", &[("size", 1.0)], "m", "penetrates", Run(|t, ask| t.totals.penetration / ask.number("size"))),
    row("lean", &[("height", NEEDED)], "of the height", "leans", Run(|t, ask| farthest(t, |way| way.x) / ask.number("height"))),
    row("sinking", &[("height", NEEDED)], "of the height", "falls", Run(|t, ask| farthest(t, |way| way.y) / ask.number("height"))),
    row("moved", &[("size", 1.0)], "m", "moves", Run(|t, ask| t.moved() / ask.number("size"))),
    row("standing", &[("least", NEEDED)], "of a block", "stands", Run(standing)),
    row("outside", &[("radius", NEEDED)], "m", "escapes", Run(|t, ask| t.most(&t.moving(), |_, s| s.0.translation.norm() - ask.number("radius")))),
    row("outside-box", &[("half", NEEDED)], "m", "escapes", Run(|t, ask| t.most(&t.moving(), |_, s| s.0.translation.amax() - ask.number("half")))),
    row("beyond", &[("at", NEEDED)], "m", "tunnels", Run(|t, ask| most_x(t, ask) - ask.number("at"))),
    row("below", &[], "m", "tunnels", Run(|t, ask| t.most(&[ask.body(t)], |_, s| -s.0.translation.y))),
    row("jump", &[("at", NEEDED)], "m", "launches", Run(|t, ask| t.most(&[ask.body(t)], |_, s| s.0.translation.y - ask.number("at")))),
    row("hop", &[("at", NEEDED)], "m", "hops", Run(|t, ask| t.most(&[ask.body(t)], |_, s| (s.0.translation.y - ask.number("at")).abs()))),
    row("gap", &[], "m", "lifts", Run(|t, ask| lowest_corner(t, ask.body(t)))),
    row("tilt", &[], "rad", "turns", Run(tilt)),
    row("past-limits", &[("after", 0.0)], "rad", "breaks-limits", Run(past_limits)),
    row("stretch", &[("length", NEEDED)], "of the length", "stretches", Run(|t, ask| t.joint_gaps()[1] / ask.number("length"))),
    // where they are at the end
    row("way", &[], "m", "creeps", Run(|t, ask| way(t, ask).abs())),
    row("distance", &[("acceleration", NEEDED)], RELATIVE, "wrong-speed", Run(distance)),
    row("off-course", &[("x", NEEDED), ("y", NEEDED)], "m", "off-course", Run(off_course)),
    row("peak", &[("exact", NEEDED), ("after", NEEDED)], RELATIVE, "wrong-height", Against(peak)),
    row("short", &[("at", NEEDED)], "m", "stops-short", Run(|t, ask| ask.number("at") - t.ends(ask.body(t))[1].translation.x)),
    row("overlap-left", &[("at", NEEDED)], "m", "stuck", Run(|t, ask| unless_said(t, (t.ends(ask.body(t))[1].translation.y - ask.number("at")).abs()))),
    row("overlap-of-two", &[("apart", NEEDED)], "m", "stuck", Run(overlap_of_two)),
    // how they turn
    row("turned", &[("exact", NEEDED)], "of its way", "jams", Against(|t, ask| turned(t, ask.body(t)))),
    row("teeth-skipped", &[("first", NEEDED), ("second", NEEDED)], "teeth", "skips", Run(teeth_skipped)),
    row("teeth-passed", &[("teeth", NEEDED)], "teeth", "slips", Run(|t, ask| turned(t, ask.body(t)) / (TAU / ask.number("teeth")))),
    // how fast they are
    row("speed-lost", &[("speed", NEEDED)], "of the speed", "trips", Run(|t, ask| t.most(&[ask.body(t)], |_, s| (s.1.x / ask.number("speed") - 1.0).abs()))),
    row("last-speed", &[], "m/s", "restless", Run(|t, _| last_speed(t))),
    row("rest-time", &[("drop", NEEDED)], RELATIVE, "wrong-time", Run(rest_time)),
    row("wave-speed", &[("exact", NEEDED)], RELATIVE, "wrong-speed", Against(|t, _| wave(t))),
    row("mean-square-speed", &[("exact", NEEDED), ("after", NEEDED)], RELATIVE, "wrong-speed", Against(agitation)),
    row("mean-angle", &[("exact", NEEDED), ("last", NEEDED)], "rad", "wrong-angle", Against(heap_angle)),
    row("discharge", &[("exact", NEEDED), ("level", NEEDED)], RELATIVE, "wrong-rate", Against(discharge)),
    // energies and forces
    row("energy-rise", &[], "of the start", "gains-energy", Run(|t, _| t.totals.energy_rise / t.totals.energy_start.abs())),
    row("energy-lift", &[], "m", "gains-energy", Run(energy_lift)),
    row("kinetic-energy", &[("size", 1.0)], "J", "launches", Run(|t, ask| t.totals.kinetic_most / ask.number("size"))),
    row("energy-kept", &[], "of the start", "wrong-energy", Run(|t, _| (t.totals.energy_end / t.totals.energy_start - 1.0).abs())),
    row("contact-work", &[], "of the largest kinetic energy", "gains-energy", Accounted(|t, _| t.totals.work_contact_n.max(0.0) / t.totals.kinetic_most)),
    row("wrench", &[("arm", NEEDED)], RELATIVE, "wrong-load", Run(wrench)),
    row("load", &[], "of the weight", "wrong-load", Run(load)),
    row("impact", &[], RELATIVE, "wrong-impulse", Run(impact)),
    row("friction-read", &[("exact", NEEDED)], RELATIVE, "wrong-impulse", Against(|t, _| t.forces.friction())),
    // what the closed form of the scene says of the measure called as the check is
    row("closed-form", &[("size", 1.0)], RELATIVE, "wrong", Run(|t, ask| t.error(ask.label()) / ask.number("size"))),
    // what is said of the run
    row("unsaid", &[], "yes or no", "silent", Run(|t, _| yes(!t.said()))),
    row("silent", &[], "yes or no", "silent", Run(|t, _| yes(t.totals.recovering == 0))),
    row("steps-not-flagged", &[], "steps", "silent", Run(|t, _| (t.totals.steps - t.totals.redundant_steps) as f64)),
    row("gain-not-reported", &[], "of the start", "silent", Run(gain_not_reported)),
    // of a second run
    row("resumed", &[], "m", "diverges", Run(|t, _| resumed::distance(t))),
    // of the study's rotor
    row("speed-left", &[], "rad/s", "turns", Machine),
    row("single-cells-refused", &[], "cells", "unique", Machine),
    row("stall-not-flagged", &[], "yes or no", "silent", Machine),
    row("shares", &[], RELATIVE, "wrong-load", Machine),
];

/// A check of a rung.
pub(super) struct Ask<'a> {
    check: &'a AtlasCheck,
    rung: &'a AtlasRung,
    measure: &'static Measure,
}

impl<'a> Ask<'a> {
    /// Finds the check's measure and verifies that its numbers and its body exist.
    ///
    /// # Errors
    /// [`RunError::Unfit`] for an unknown measure, number or body, with the nearest, and for a
    /// number that is missing.
    pub fn new(
        check: &'a AtlasCheck,
        rung: &'a AtlasRung,
        scene: &Scene,
    ) -> Result<Ask<'a>, RunError> {
        let place = format!("rung `{}`, check {}", rung.name, check.measure);
        let unknown = |what: &str, name: &str, known: Vec<&str>| {
            let hint = Hint::new(name, known);
            Err(RunError::Unfit(format!(
                "{place}: unknown {what} `{name}`{hint}"
            )))
        };
        let name = check.measure.as_str();
        let Some(measure) = MEASURES.iter().find(|m| m.name == name) else {
            return unknown("measure", name, MEASURES.iter().map(|m| m.name).collect());
        };
        let takes: Vec<&str> = measure.takes.iter().map(|(key, _)| *key).collect();
        if let Some(key) = check.numbers.keys().find(|k| !takes.contains(&k.as_str())) {
            return unknown("number", key, takes);
        }
        let ask = Ask {
            check,
            rung,
            measure,
        };
        if let Some(key) = takes.into_iter().find(|key| ask.number(key).is_nan()) {
            let what = format!("{place}: needs `{key}`, there or in `with` of the rung");
            return Err(RunError::Unfit(what));
        }
        let mut bodies = scene.bodies.iter().map(|b| b.name.as_str());
        match &check.body {
            Some(body) if !bodies.any(|b| b == body) => {
                let bodies = scene.bodies.iter().map(|b| b.name.as_str());
                unknown("body", body, bodies.collect())
            }
            _ => Ok(ask),
        }
    }

    fn number(&self, key: &str) -> f64 {
        let given = self.check.numbers.get(key).or(self.rung.with.get(key));
        let default = self.measure.takes.iter().find(|(name, _)| *name == key);
        given.copied().or(default.map(|d| d.1)).unwrap_or(NEEDED)
    }

    fn body(&self, t: &Trace) -> usize {
        t.body(self.check.body.as_deref().unwrap_or(""))
    }

    /// Its name in the results.
    fn label(&self) -> &str {
        self.check.name.as_deref().unwrap_or(self.measure.name)
    }

    /// The check on a run; `None` if the engine does not record the measure.
    pub fn of_run(&self, t: &Trace) -> Option<Check> {
        match self.measure.of {
            Run(value) => Some(self.judged(value(t, self))),
            Against(value) => Some(self.judged(self.off(value(t, self)))),
            Accounted(value) => t.totals.accounted.then(|| self.judged(value(t, self))),
            Machine => Some(self.judged(f64::NAN)),
        }
    }

    /// The check on a machine; NaN, which never passes, if the machine does not return the measure.
    pub fn of_machine(&self, figures: &MachineFigures) -> Check {
        let mut values = figures.values.iter();
        let found = values.find(|(name, _)| *name == self.measure.name);
        self.judged(found.map_or(f64::NAN, |(_, value)| *value))
    }

    /// How far a statistic is from `exact`.
    fn off(&self, value: f64) -> f64 {
        let exact = self.number("exact");
        match self.measure.unit {
            "rad" => (value - exact).abs(),
            _ => (value / exact - 1.0).abs(),
        }
    }

    /// The statistic itself.
    #[cfg(test)]
    pub fn statistic(&self, t: &Trace) -> f64 {
        match self.measure.of {
            Against(value) => value(t, self),
            _ => f64::NAN,
        }
    }

    fn judged(&self, value: f64) -> Check {
        let check = self.check;
        let fails = check.fails.as_deref().unwrap_or(self.measure.fails);
        let never = check.never.as_deref().filter(|_| value.is_nan());
        Check {
            measure: self.label().to_owned(),
            value,
            unit: check
                .unit
                .as_deref()
                .unwrap_or(self.measure.unit)
                .to_owned(),
            limit: check.limit.unwrap_or(f64::INFINITY),
            mode: never.unwrap_or(fails).to_owned(),
        }
    }
}

fn yes(is: bool) -> f64 {
    f64::from(u8::from(is))
}

/// Farthest \[m\] along one axis that a body that moves has been from its start.
fn farthest(t: &Trace, part: fn(Vec2) -> f64) -> f64 {
    let start = |k: usize| t.history[0].states[k].0.translation;
    t.most(&t.moving(), |k, s| part(s.0.translation - start(k)).abs())
}

/// Missing distance \[m\] of a body that must fall and move by `least` \[m\].
fn standing(t: &Trace, ask: &Ask) -> f64 {
    let moved = t.moved();
    if moved.is_nan() {
        return moved;
    }
    (ask.number("least") - moved).max(0.0)
}

fn most_x(t: &Trace, ask: &Ask) -> f64 {
    t.most(&[ask.body(t)], |_, s| s.0.translation.x)
}

/// Height \[m\] of the lower corner of a box's bottom.
fn lowest_corner(t: &Trace, k: usize) -> f64 {
    let (x, y) = match t.scene.bodies[k].shape {
        Shape::Box { width, height } => (0.5 * width, 0.5 * height),
        _ => (f64::NAN, f64::NAN),
    };
    let height = |pose: &Pose64| {
        let corners = [[-x, -y], [x, -y]].map(|c| pose.apply(Vec2::from(c)).y);
        corners[0].min(corners[1])
    };
    t.most(&[k], |_, s| height(&s.0))
}

/// From start to end along x \[m\].
fn way(t: &Trace, ask: &Ask) -> f64 {
    let way = t.ends(ask.body(t)).map(|p| p.translation.x);
    way[1] - way[0]
}

/// Of the way along x, against that of a constant acceleration [m/s²].
fn distance(t: &Trace, ask: &Ask) -> f64 {
    let time = t.totals.time;
    let exact = 0.5 * ask.number("acceleration") * time * time;
    (way(t, ask) / exact - 1.0).abs()
}

/// 0 if the engine reports that it could not separate the bodies.
fn unless_said(t: &Trace, left: f64) -> f64 {
    if t.totals.recovering > 0 { 0.0 } else { left }
}

/// Along x, of two bodies that must be `apart` \[m\].
fn overlap_of_two(t: &Trace, ask: &Ask) -> f64 {
    let [a, b] = [0, 1].map(|k| t.ends(t.moving()[k])[1].translation);
    unless_said(t, ask.number("apart") - (b - a).x)
}

/// Way of the body's angle from start to end \[rad\], whole turns counted.
fn turned(t: &Trace, k: usize) -> f64 {
    let angles: Vec<f64> = t.history.iter().map(|m| m.states[k].0.angle()).collect();
    let steps = angles.windows(2).map(|pair| {
        let step = pair[1] - pair[0];
        step - TAU * (step / TAU).round()
    });
    steps.sum()
}

/// Between the first two wheels that move, of so many teeth each.
fn teeth_skipped(t: &Trace, ask: &Ask) -> f64 {
    let [a, b] = [0, 1].map(|k| turned(t, t.moving()[k]));
    (ask.number("first") * a + ask.number("second") * b).abs() / TAU
}

/// Of the fastest body that moves, at the end [m/s].
fn last_speed(t: &Trace) -> f64 {
    let last = &t.history[t.history.len() - 1];
    let speeds = t.moving().into_iter().map(|k| last.states[k].1.xy().norm());
    speeds.fold(0.0, larger)
}

/// Speed at which a ball counts as at rest [m/s]: from there on it would bounce for another
/// `2 v/(g (1 − e))`, below 3e-3 of all.
const REST: f64 = 1e-2;

/// When a ball dropped from `drop` \[m\] has last been faster than [`REST`], against
/// `√(2h/g) (1+e)/(1−e)`; NaN if it still is.
fn rest_time(t: &Trace, ask: &Ask) -> f64 {
    let k = ask.body(t);
    let moves = |m: &Moment| m.states[k].1.y.abs() > REST;
    let last = t.history.iter().rposition(moves);
    let rest = last.and_then(|k| t.history.get(k + 1));
    let e = t.scene.materials[t.scene.bodies[k].material].restitution;
    let g = t.scene.gravity[1].abs();
    let exact = (2.0 * ask.number("drop") / g).sqrt() * (1.0 + e) / (1.0 - e);
    (rest.map_or(NEEDED, |m| m.time) / exact - 1.0).abs()
}

/// Speed of a wave of dominoes [m/s]: from the seventh to the seventeenth that leans by 0.2 rad.
fn wave(t: &Trace) -> f64 {
    let [a, b] = [6, 16].map(|k| t.moving()[k]);
    let fall = |k: usize| {
        let leans = |m: &&Moment| m.states[k].0.angle() < -0.2;
        t.history.iter().find(leans).map_or(f64::NAN, |m| m.time)
    };
    let place = |k: usize| t.scene.bodies[k].position[0];
    (place(b) - place(a)) / (fall(b) - fall(a))
}

/// Mean square speed [m²/s²] of the bodies that move, from the time `after` \[s\] on.
fn agitation(t: &Trace, ask: &Ask) -> f64 {
    let moving = t.moving();
    mean(t, ask.number("after"), |m| {
        let squares = moving.iter().map(|&k| m.states[k].1.xy().norm_squared());
        squares.sum::<f64>() / moving.len() as f64
    })
}

/// Mean angle \[rad\] of the centre of what moves from straight down, over the `last` seconds.
fn heap_angle(t: &Trace, ask: &Ask) -> f64 {
    let grains = t.moving();
    mean(t, t.totals.time - ask.number("last"), |m| {
        let sum: Vec2 = grains.iter().map(|&k| m.states[k].0.translation).sum();
        sum.x.atan2(-sum.y)
    })
}

/// Over all moments after a time \[s\].
fn mean(t: &Trace, after: f64, of: impl Fn(&Moment) -> f64) -> f64 {
    let late = t.history.iter().filter(|m| m.time > after);
    let (sum, count) = late.fold((0.0, 0.0), |(s, n), m| (s + of(m), n + 1.0));
    sum / count
}

/// Bodies a second that come below `level` \[m\], from the first quarter of them to the third.
fn discharge(t: &Trace, ask: &Ask) -> f64 {
    let grains = t.moving();
    let level = ask.number("level");
    let low = |m: &Moment, k: usize| m.states[k].0.translation.y < level;
    let out = |m: &Moment| grains.iter().filter(|&&k| low(m, k)).count();
    let reached = |share: usize| {
        let most = grains.len() * share / 4;
        let first = t.history.iter().find(|m| out(m) >= most);
        first.map_or(f64::NAN, |m| m.time)
    };
    0.5 * grains.len() as f64 / (reached(3) - reached(1))
}

/// Most that the energy rises, over that which lifts all by 1 m.
fn energy_lift(t: &Trace, _: &Ask) -> f64 {
    let g = t.scene.gravity[0].hypot(t.scene.gravity[1]);
    t.totals.energy_rise / (t.mass() * g)
}

/// Energy that contacts added but did not report, relative to the start.
fn gain_not_reported(t: &Trace, _: &Ask) -> f64 {
    let given = t.totals.work_contact_n + t.totals.work_contact_t;
    (given - t.totals.impact_gain).abs() / t.totals.energy_start
}

/// Normal forces on all that moves against the weights: force, and moment over `arm` \[m\].
fn wrench(t: &Trace, ask: &Ask) -> f64 {
    let found: Vec3 = t.moving().iter().map(|&k| t.forces.wrench(k)).sum();
    let g = Vec2::from(t.scene.gravity);
    let mut exact = Vec3::zeros();
    for k in t.moving() {
        let Some((mass, _)) = t.scene.bodies[k].mass_and_inertia() else {
            continue;
        };
        let weight = -g * mass;
        let at = t.ends(k)[1].translation;
        exact += Vec3::new(weight.x, weight.y, at.perp(&weight));
    }
    let weight = exact.xy().norm();
    let off = found - exact;
    larger(
        off.xy().norm() / weight,
        off.z.abs() / (ask.number("arm") * weight),
    )
}

/// Largest angle \[rad\] by which the body has turned from its start.
fn tilt(t: &Trace, ask: &Ask) -> f64 {
    let k = ask.body(t);
    let start = t.history[0].states[k].0.angle();
    t.most(&[k], |_, s| {
        let turn = s.0.angle() - start;
        (turn - TAU * (turn / TAU).round()).abs()
    })
}

/// Farthest \[rad\] that a revolute joint has turned beyond its limits, from the time `after` \[s\] on.
fn past_limits(t: &Trace, ask: &Ask) -> f64 {
    let late = || t.history.iter().filter(|m| m.time >= ask.number("after"));
    let turned = |k: Option<usize>, m: &Moment| {
        let start = |k: usize| t.history[0].states[k].0.angle();
        k.map_or(0.0, |k| m.states[k].0.angle() - start(k))
    };
    let revolute = t
        .scene
        .joints
        .iter()
        .filter(|j| j.kind == JointKind::Revolute);
    let limited = revolute.filter_map(|j| Some((j.bodies, j.limits?)));
    let past = limited.flat_map(|(bodies, [low, high])| {
        late().map(move |m| {
            let angle = turned(bodies[1], m) - turned(bodies[0], m);
            let angle = angle - TAU * (angle / TAU).round();
            (angle - high).max(low - angle)
        })
    });
    past.fold(0.0, larger)
}

/// Distance \[m\] of the body at the end from the place that the closed form gives.
fn off_course(t: &Trace, ask: &Ask) -> f64 {
    let place = Vec2::new(ask.number("x"), ask.number("y"));
    (t.ends(ask.body(t))[1].translation - place).norm()
}

/// Greatest height \[m\] of the body's origin from the time `after` \[s\] on.
fn peak(t: &Trace, ask: &Ask) -> f64 {
    let k = ask.body(t);
    let late = t.history.iter().filter(|m| m.time >= ask.number("after"));
    let heights = late.map(|m| m.states[k].0.translation.y);
    heights.fold(
        f64::NEG_INFINITY,
        |a, b| if b > a || b.is_nan() { b } else { a },
    )
}

/// Worst of all steps of the last tenth: the normal force of the body's contacts against its weight.
fn load(t: &Trace, ask: &Ask) -> f64 {
    let k = ask.body(t);
    let g = t.scene.gravity[0].hypot(t.scene.gravity[1]);
    let mass = t.scene.bodies[k].mass_and_inertia().map_or(NEEDED, |m| m.0);
    let off = t
        .forces
        .range(k)
        .map(|force| (force / (mass * g) - 1.0).abs());
    larger(off[0], off[1])
}

/// The impulse of a landing body that comes to rest, `m √(2 g d)` after a fall by d, against the
/// largest that one step reports. A step may add its weight: only what is beyond `m g Δt` counts.
fn impact(t: &Trace, _: &Ask) -> f64 {
    let g = t.scene.gravity[1].abs();
    let off = t.moving().into_iter().map(|k| {
        let [start, end] = t.ends(k).map(|p| p.translation.y);
        let mass = t.scene.bodies[k].mass_and_inertia().map_or(NEEDED, |m| m.0);
        let exact = mass * (2.0 * g * (start - end)).sqrt();
        let weight = mass * g * t.scene.step.dt;
        ((t.forces.most(k) - exact).abs() - weight).max(0.0) / exact
    });
    off.fold(0.0, larger)
}
