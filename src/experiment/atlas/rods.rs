//! Rods on rough floors: impulses without impacts, and impacts that seem to give energy.

use super::trace::Trace;
use super::verdict::Check;
use super::{Rung, catalogue, drafted, material, step};
use crate::contact::Vec2;
use crate::experiment::RunError;

/// Friction at three angles below and above what a sliding force can exist with: 1.67, 1.35, 1.60.
pub(super) fn painleve() -> Result<Vec<Rung>, RunError> {
    let mut rungs = Vec::new();
    for degrees in [45.0_f64, 60.0, 75.0] {
        for mu in [1.0, 1.5, 2.0, 3.0, 5.0] {
            let angle = degrees.to_radians();
            let flags = [
                format!("friction={mu:?}"),
                format!("body.rod.angle={angle:?}"),
                format!("body.rod.position=[0,{:?}]", 0.5 * angle.sin()),
            ];
            let p = 1.0 + 3.0 * angle.cos() * (angle.cos() - mu * angle.sin());
            let (passes, wrong) = if p < 0.0 {
                ("jams", "slides")
            } else {
                ("slides", "jams")
            };
            let judge = move |t: &Trace| {
                let rise = t.totals.energy_rise / t.totals.energy_start;
                vec![
                    Check::new("jams", t.error("jams"), "yes or no", 0.0, wrong),
                    Check::new("energy-rise", rise, "of the start", 1e-6, "gains-energy"),
                ]
            };
            let scene = catalogue("painleve", &flags)?;
            rungs.push(Rung::new(format!("{degrees} deg, {mu}"), scene, passes, judge).quick());
        }
    }
    Ok(rungs)
}

/// A double pendulum that strikes a rough floor, its links at 20 and 30 degrees: Newton's law gives
/// it energy where both coefficients are large. What it gives is reported; under the default law it
/// is none.
///
/// # Source
/// Kane & Levinson, *Dynamics: Theory and Applications* (1985), sec. 5.8 and problem 14.6.
pub(super) fn kane() -> Result<Vec<Rung>, RunError> {
    let mut rungs = Vec::new();
    for (e, mu) in [(0.5, 0.5), (0.9, 0.5), (0.9, 1.0), (1.0, 2.0)] {
        for law in ["newton", "capped"] {
            let newton = law == "newton";
            let judge = move |t: &Trace| {
                let start = t.totals.energy_start;
                if newton {
                    let given = t.totals.work_contact_n + t.totals.work_contact_t;
                    let silent = (given - t.totals.impact_gain).abs() / start;
                    vec![Check::new(
                        "gain-not-reported",
                        silent,
                        "of the start",
                        1e-9,
                        "silent",
                    )]
                } else {
                    // the paradox is of size one; the pins' part of a step is 5e-4
                    let rise = t.totals.energy_rise / start;
                    vec![Check::new(
                        "energy-rise",
                        rise,
                        "of the start",
                        1e-3,
                        "gains-energy",
                    )]
                }
            };
            let passes = if newton { "says so" } else { "no gain" };
            let rung = Rung::new(
                format!("{law} {e}, {mu}"),
                pendulum(law, e, mu)?,
                passes,
                judge,
            );
            rungs.push(if newton {
                rung.quick().ours_alone("it has one law of impact only")
            } else {
                rung.quick()
            });
        }
    }
    Ok(rungs)
}

fn pendulum(law: &str, e: f64, mu: f64) -> Result<crate::scene::Scene, RunError> {
    let angles = [20.0_f64, 30.0].map(f64::to_radians);
    let rates = [-0.1, -0.2];
    let radius = 0.02;
    let along = angles.map(|a| Vec2::new(a.sin(), -a.cos()));
    let across = angles.map(|a| Vec2::new(a.cos(), a.sin()));
    let knee = along[0];
    let tip = knee + along[1];
    let place = [along[0] * 0.5, knee + along[1] * 0.5];
    let speed = [
        across[0] * (0.5 * rates[0]),
        across[0] * rates[0] + across[1] * (0.5 * rates[1]),
    ];
    let mut text = format!(
        "{}impact_law = \"{law}\"\n{}[gravity]\ny = 0\n[[body]]\nname = \"floor\"\nkind = \"fixed\"\n\
         box = [9, 1]\nposition = [0, {:?}]\n",
        step(1.0 / 240.0, 0.1),
        material(mu, e),
        tip.y - radius - 0.5 - 1e-3
    );
    for k in 0..2 {
        text += &format!(
            "[[body]]\nname = \"link{k}\"\nmass = 1\ninertia = {:?}\ncapsule = [1, {radius:?}]\n\
             position = [{:?}, {:?}]\nangle = {:?}\nvelocity = [{:?}, {:?}]\nspin = {:?}\n",
            1.0 / 12.0,
            place[k].x,
            place[k].y,
            angles[k] - std::f64::consts::FRAC_PI_2,
            speed[k].x,
            speed[k].y,
            rates[k]
        );
    }
    text += &format!(
        "[[joint]]\nkind = \"revolute\"\nbodies = [\"world\", \"link0\"]\nat = [0, 0]\n[[joint]]\n\
         kind = \"revolute\"\nbodies = [\"link0\", \"link1\"]\nat = [{:?}, {:?}]\n",
        knee.x, knee.y
    );
    drafted("kane", &text)
}
