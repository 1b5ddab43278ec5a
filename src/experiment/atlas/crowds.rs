//! Crowds of discs that are pressed together from all sides.

use super::trace::Trace;
use super::verdict::Check;
use super::{Rung, drafted, material, step};
use crate::experiment::RunError;

/// Discs of 1 m that springs pull to one point; drag brings them to rest.
pub(super) fn rush() -> Result<Vec<Rung>, RunError> {
    let rung = |side: u32| {
        let mut text = format!(
            "{}{}[gravity]\ny = 0\n",
            step(1.0 / 60.0, 10.0),
            material(0.5, 0.0)
        );
        for i in 0..side {
            for j in 0..side {
                let middle = 0.5 * f64::from(side - 1);
                let at = [i, j].map(|k| (f64::from(k) - middle) * 1.5);
                let name = format!("disc{i}-{j}");
                text += &format!(
                    "[[body]]\nname = \"{name}\"\ndisc = 0.5\nmass = 1\nposition = {at:?}\n\
                     linear_damping = 1\nangular_damping = 1\n[[joint]]\nkind = \"spring\"\n\
                     bodies = [\"world\", \"{name}\"]\nanchors = [[0, 0], {at:?}]\nlength = 0.001\n\
                     stiffness = 4\n"
                );
            }
        }
        let judge = |t: &Trace| {
            let last = &t.history[t.history.len() - 1];
            let speeds = t.moving().into_iter().map(|k| last.states[k].1.xy().norm());
            let fastest = speeds.fold(0.0, super::trace::larger);
            let mut checks = vec![
                Check::new("penetration", t.totals.penetration, "m", 1e-2, "penetrates"),
                Check::new("last-speed", fastest, "m/s", 5e-2, "restless"),
            ];
            // a peer does not tell the work of its contacts
            if t.totals.accounted {
                let rise = t.totals.work_contact_n.max(0.0) / t.totals.kinetic_most;
                checks.push(Check::new(
                    "contact-work",
                    rise,
                    "of the largest kinetic energy",
                    1e-2,
                    "gains-energy",
                ));
            }
            checks
        };
        let name = format!("{}", side * side);
        Ok(Rung::new(name, drafted("rush", &text)?, "settles", judge).quick_if(side < 8))
    };
    [6, 10, 20].map(rung).into_iter().collect()
}

/// A hundred discs of 1 m that start in each other, in a box that has room for them, hardly any, none.
pub(super) fn confined() -> Result<Vec<Rung>, RunError> {
    let rung = |name: &str, inside: f64| {
        let mut text = format!(
            "{}{}[gravity]\ny = 0\n",
            step(1.0 / 60.0, 5.0),
            material(0.2, 0.0)
        );
        let (far, long) = (0.5 * inside + 0.5, inside + 2.0);
        for (k, (shape, at)) in [
            ([1.0, long], [-far, 0.0]),
            ([1.0, long], [far, 0.0]),
            ([long, 1.0], [0.0, -far]),
            ([long, 1.0], [0.0, far]),
        ]
        .into_iter()
        .enumerate()
        {
            text += &format!(
                "[[body]]\nname = \"wall{k}\"\nkind = \"fixed\"\nbox = {shape:?}\nposition = {at:?}\n"
            );
        }
        let apart = (inside - 1.0) / 9.0 - 0.02;
        let from = -4.5 * apart;
        text += &format!(
            "[[body]]\nname = \"disc\"\ndisc = 0.5\nmass = 1\nposition = [{from:?}, {from:?}]\n\
             [[repeat]]\nof = \"disc\"\ncount = [10, 10]\nstep = [[{apart:?}, 0], [0, {apart:?}]]\n\
             jitter = 0.01\nseed = 1\n"
        );
        let judge = move |t: &Trace| {
            let outside = t.most(&t.moving(), |_, s| s.0.translation.amax() - 0.5 * inside);
            // of one disc that moves at 1 m/s
            let energy = t.totals.kinetic_most / 0.5;
            vec![
                Check::new(
                    "kinetic-energy",
                    energy,
                    "of a disc's at 1 m/s",
                    1e-2,
                    "launches",
                ),
                Check::new("outside", outside, "m", 0.0, "escapes"),
            ]
        };
        let scene = drafted("confined", &text)?;
        Ok(Rung::new(name, scene, "keeps quiet", judge).quick_if(inside > 10.0))
    };
    [
        rung("roomy", 10.5),
        rung("tight", 10.0),
        rung("overfull", 9.0),
    ]
    .into_iter()
    .collect()
}
