//! The same scenes far from the origin, tiny and huge: verdicts as at home.

use super::stacks::stands;
use super::trace::Trace;
use super::verdict::{Check, RELATIVE};
use super::{Rung, catalogue};
use crate::experiment::RunError;

/// A tower and a block on an incline, far out. Single precision means poses of 1e-3 m at 1e4 m.
pub(super) fn far_origin() -> Result<Vec<Rung>, RunError> {
    let mut rungs = Vec::new();
    for (far, name) in [(1e2, "1e2 m"), (1e4, "1e4 m"), (1e6, "1e6 m")] {
        let flags = [
            format!("body.floor.position=[{far:?},-1]"),
            format!("body.box.position=[{far:?},0.5]"),
        ];
        let scene = catalogue("tower", &flags)?;
        let tower = Rung::new(format!("tower, {name}"), scene, "stands", |t| {
            stands(t, 1.0, 10.0)
        });
        let mut all = vec![tower];
        for slope in [0.4995, 0.5005] {
            let flags = [
                format!("body.floor.position=[{far:?},-1]"),
                format!("body.block.position=[{far:?},0.5]"),
                format!("slope={slope:?}"),
            ];
            let (passes, word) = if slope < 0.5 {
                ("holds", "hold")
            } else {
                ("slides", "slide")
            };
            let rung = Rung::new(
                format!("{word}, {name}"),
                catalogue("incline", &flags)?,
                passes,
                |t| incline(t, 1.0),
            );
            all.push(rung);
        }
        rungs.extend(all.into_iter().map(|rung| {
            let rung = rung.quick();
            if far > 1e4 { rung.double() } else { rung }
        }));
    }
    Ok(rungs)
}

/// `size` \[m\] of the block.
fn incline(t: &Trace, size: f64) -> Vec<Check> {
    let slides = t.measures.iter().any(|m| m.name == "acceleration");
    vec![if slides {
        Check::new(
            "acceleration",
            t.error("acceleration"),
            RELATIVE,
            1e-2,
            "wrong-speed",
        )
    } else {
        Check::new(
            "creep",
            t.error("creep") / size,
            "of the size",
            1e-6,
            "creeps",
        )
    }]
}

/// Boxes of 1 mm and 100 m, steps that go with the square root of the size, and 1e-6 and 0.1 s.
pub(super) fn tiny_and_huge() -> Result<Vec<Rung>, RunError> {
    let mut rungs = Vec::new();
    for (size, dt, time, name) in [
        (1e-3_f64, 1e-3_f64.sqrt() / 60.0, 0.3, "1 mm"),
        (1e-3, 1e-6, 0.01, "1 mm, 1e-6 s"),
        (1.0, 1e-4, 1.0, "1 m, 1e-4 s"),
        (1e2, 0.1, 100.0, "100 m, 0.1 s"),
        (1e2, 1.0 / 60.0, 20.0, "100 m"),
    ] {
        let common = [
            format!("step.dt={dt:?}"),
            format!("step.time={time:?}"),
            format!("body.floor.box=[{:?},{:?}]", 40.0 * size, 2.0 * size),
            format!("body.floor.position=[0,{:?}]", -size),
        ];
        let scaled = |name: &str, body: &str, more: String| {
            let mut flags = common.to_vec();
            flags.push(format!("body.{body}.box=[{size:?},{size:?}]"));
            flags.push(format!("body.{body}.position=[0,{:?}]", 0.5 * size));
            flags.push(more);
            catalogue(name, &flags)
        };
        let step = format!("repeat.0.step=[[0,0],[0,{size:?}]]");
        let tower = scaled("tower", "box", step)?;
        let quick = time / dt < 2e3;
        let judge = move |t: &Trace| stands(t, size, 10.0 * size);
        let rung = Rung::new(format!("tower, {name}"), tower, "stands", judge);
        rungs.push(rung.quick_if(quick));
        for slope in [0.4995, 0.5005] {
            let scene = scaled("incline", "block", format!("slope={slope:?}"))?;
            let (passes, word) = if slope < 0.5 {
                ("holds", "hold")
            } else {
                ("slides", "slide")
            };
            let judge = move |t: &Trace| incline(t, size);
            let rung = Rung::new(format!("{word}, {name}"), scene, passes, judge);
            rungs.push(rung.quick_if(quick));
        }
    }
    Ok(rungs)
}
