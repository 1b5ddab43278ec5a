//! Stacks: loads that must get through many contacts to the ground.

use super::trace::Trace;
use super::verdict::Check;
use super::{FLOOR, Rung, catalogue, drafted};
use crate::experiment::RunError;

/// Worst penetration over the size of a box.
const PENETRATION: f64 = 1e-4;
/// Sideways over height.
const LEAN: f64 = 1e-3;

/// `size` \[m\] of the boxes, `height` \[m\] of the stack.
pub(super) fn stands(trace: &Trace, size: f64, height: f64) -> Vec<Check> {
    let start = |k: usize| trace.history[0].states[k].0.translation;
    let aside = trace.most(&trace.moving(), |k, s| (s.0.translation - start(k)).x.abs());
    vec![
        Check::new("lean", aside / height, "of the height", LEAN, "leans"),
        Check::new(
            "sinking",
            sinking(trace) / height,
            "of the height",
            LEAN,
            "falls",
        ),
        penetration(trace, size),
    ]
}

/// Farthest that a body has been below or above its start \[m\].
fn sinking(trace: &Trace) -> f64 {
    let start = |k: usize| trace.history[0].states[k].0.translation;
    trace.most(&trace.moving(), |k, s| (s.0.translation - start(k)).y.abs())
}

pub(super) fn penetration(trace: &Trace, size: f64) -> Check {
    let depth = trace.totals.penetration / size;
    Check::new("penetration", depth, "of a box", PENETRATION, "penetrates")
}

/// One box on another of a tenth to a millionth of its mass, and on nine of them.
pub(super) fn heavy_on_light() -> Result<Vec<Rung>, RunError> {
    let rung = |boxes: u32, power: i32| {
        let flags = [
            format!("repeat.0.count=[1,{boxes}]"),
            format!("body.heavy.position=[0,{boxes}.5]"),
            format!("body.heavy.density=1e{}", 3 + power),
        ];
        let name = if boxes == 1 {
            format!("1e{power}")
        } else {
            format!("on {boxes}, 1e{power}")
        };
        let judge = |t: &Trace| {
            // no drift: the way of the heavy one
            let drift = Check::new("drift", t.moved(), "m", 1e-3, "drifts");
            vec![penetration(t, 1.0), drift]
        };
        Ok(Rung::new(name, catalogue("heavy-top", &flags)?, "stands", judge).quick())
    };
    let one = (1..=6).map(|p| rung(1, p));
    one.chain([2, 4, 6].map(|p| rung(9, p))).collect()
}

pub(super) fn tower() -> Result<Vec<Rung>, RunError> {
    let rung = |n: u32| {
        let scene = catalogue("tower", &[format!("repeat.0.count=[1,{n}]")])?;
        let judge = move |t: &Trace| stands(t, 1.0, f64::from(n));
        Ok(Rung::new(n.to_string(), scene, "stands", judge).quick_if(n <= 50))
    };
    [10, 20, 50, 100, 200].map(rung).into_iter().collect()
}

pub(super) fn pyramid() -> Result<Vec<Rung>, RunError> {
    let rung = |n: u32| {
        let flags = [
            format!("repeat.0.count=[{n},{n}]"),
            format!("body.box.position=[{:?},0.5]", -0.51 * f64::from(n - 1)),
            "body.floor.box=[400,2]".to_owned(),
        ];
        let judge = move |t: &Trace| stands(t, 1.0, f64::from(n));
        Ok(Rung::new(
            n.to_string(),
            catalogue("pyramid", &flags)?,
            "stands",
            judge,
        )
        .quick_if(n < 30))
    };
    [10, 30, 100].map(rung).into_iter().collect()
}

/// Slabs 1 m high, the lowest 1 m wide, each half a metre wider to both sides than the one below
/// it: the whole stands on the width of one box.
pub(super) fn inverted_pyramid() -> Result<Vec<Rung>, RunError> {
    let rung = |n: u32| {
        let slab = |k: u32| {
            let y = f64::from(k) + 0.5;
            let width = k + 1;
            format!("[[body]]\nname = \"slab{k}\"\nbox = [{width}, 1]\nposition = [0, {y:?}]\n")
        };
        let text: String = (0..n).map(slab).collect();
        let scene = drafted("inverted-pyramid", &format!("{FLOOR}{text}"))?;
        let judge = move |t: &Trace| stands(t, 1.0, f64::from(n));
        Ok(Rung::new(n.to_string(), scene, "stands", judge).quick_if(n <= 30))
    };
    [10, 30, 100].map(rung).into_iter().collect()
}
