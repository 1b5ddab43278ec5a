//! Joints in long rows and nets, pulled at by what is much heavier.

use super::trace::Trace;
use super::verdict::Check;
use super::{Rung, catalogue, drafted, material, step};
use crate::experiment::RunError;

/// Sum of the gaps of all joints at the worst time, over the length of all links.
const STRETCH: f64 = 1e-3;

/// `length` \[m\] of all links.
fn stretch(t: &Trace, length: f64) -> Check {
    Check::new(
        "stretch",
        t.joint_gaps()[1] / length,
        "of the length",
        STRETCH,
        "stretches",
    )
}

/// Most that the energy rises, over that which lifts all by 1 m.
fn energy(t: &Trace) -> Check {
    let g = t.scene.gravity[0].hypot(t.scene.gravity[1]);
    let rise = t.totals.energy_rise / (t.mass() * g);
    Check::new("energy-rise", rise, "m", 1e-2, "gains-energy")
}

/// Ten links of 1 m and a weight that leans on a wall, or swings against it.
pub(super) fn heavy_end() -> Result<Vec<Rung>, RunError> {
    let rung = |name: String, ratio: f64, swings: bool, dt: f64| -> Result<Rung, RunError> {
        let (slope, wall) = if swings { (0.4, 3.0) } else { (0.1, 0.5) };
        let text = format!(
            "{}{}[gravity]\nslope = {slope:?}\n[[body]]\nname = \"wall\"\nkind = \"fixed\"\n\
             box = [2, 30]\nposition = [{:?}, -8]\n[[body]]\nname = \"link\"\nmass = 1\n\
             box = [1, 0.2]\nposition = [0, -0.5]\nangle = {:?}\n[[repeat]]\nof = \"link\"\n\
             count = [10]\nstep = [[0, -1]]\npin = [0.5, 0]\n[[body]]\nname = \"weight\"\n\
             mass = {ratio:?}\ndisc = 0.5\nposition = [0, -10.5]\n[[joint]]\nkind = \"revolute\"\n\
             bodies = [\"world\", \"link[0]\"]\nat = [0, 0]\n[[joint]]\nkind = \"revolute\"\n\
             bodies = [\"link[9]\", \"weight\"]\nat = [0, -10]\n",
            step(dt, 5.0),
            material(0.5, 0.0),
            wall + 1.0,
            -std::f64::consts::FRAC_PI_2
        );
        let judge = |t: &Trace| vec![stretch(t, 10.0), energy(t)];
        Ok(Rung::new(name, drafted("heavy-end", &text)?, "holds", judge).quick())
    };
    let mut rungs = Vec::new();
    for (word, swings) in [("leans", false), ("swings", true)] {
        for (ratio, rate) in [(10.0, 60.0), (100.0, 60.0), (1000.0, 60.0), (1000.0, 240.0)] {
            let name = format!("{word} {ratio}, 1/{rate}");
            rungs.push(rung(name, ratio, swings, 1.0 / rate)?);
        }
    }
    Ok(rungs)
}

/// Planks that hang in an arc between two banks, and boxes that fall on them.
pub(super) fn bridge() -> Result<Vec<Rung>, RunError> {
    let rung = |planks: u32| {
        // a quarter of a circle, planks of 1 m
        let half = 0.5 * std::f64::consts::FRAC_PI_2 / f64::from(planks);
        let radius = 0.5 / half.tan();
        let (from, to) = (1.25 * std::f64::consts::PI, 1.75 * std::f64::consts::PI);
        let bank = radius / half.cos() * 0.5_f64.sqrt();
        let mut text = format!(
            "{}{}[[body]]\nname = \"plank\"\nbox = [0.2, 1]\n[[repeat]]\nof = \"plank\"\n\
             pin = [0, 0.5]\nring = {{ centre = [0, 0], radius = {radius:?}, count = {planks}, \
             arc = [{from:?}, {to:?}] }}\n",
            step(1.0 / 60.0, 5.0),
            material(0.6, 0.0)
        );
        for (k, x) in [(0, -bank), (planks - 1, bank)] {
            text += &format!(
                "[[joint]]\nkind = \"revolute\"\nbodies = [\"world\", \"plank[{k}]\"]\n\
                 at = [{x:?}, {:?}]\n",
                -bank
            );
        }
        for k in 0..3 {
            let x = f64::from(k - 1) * 1.5;
            let y = 2.0 - radius;
            text +=
                &format!("[[body]]\nname = \"box{k}\"\nbox = [1, 1]\nposition = [{x:?}, {y:?}]\n");
        }
        let judge = move |t: &Trace| {
            let depth = t.totals.penetration;
            vec![
                stretch(t, f64::from(planks)),
                Check::new("penetration", depth, "m", 1e-2, "penetrates"),
                energy(t),
            ]
        };
        Ok(Rung::new(
            planks.to_string(),
            drafted("bridge", &text)?,
            "holds",
            judge,
        )
        .quick_if(planks < 40))
    };
    [10, 20, 40, 80].map(rung).into_iter().collect()
}

/// The catalogue's scene at its own step and at 1/60 s.
pub(super) fn ball_and_chain() -> Result<Vec<Rung>, RunError> {
    let rung = |name: &str, dt: f64| {
        let flags = [format!("step.dt={dt:?}")];
        let judge = |t: &Trace| vec![energy(t), stretch(t, 40.0)];
        let scene = catalogue("ball-and-chain", &flags)?;
        Ok(Rung::new(name, scene, "holds", judge).quick_if(dt > 0.01))
    };
    [rung("1/240 s", 1.0 / 240.0), rung("1/60 s", 1.0 / 60.0)]
        .into_iter()
        .collect()
}

/// Nets of discs that hang by some of their upper edge.
pub(super) fn joint_grid() -> Result<Vec<Rung>, RunError> {
    let rung = |n: u32| {
        let held: Vec<String> = (0..n.div_ceil(14))
            .map(|k| format!("[{}, 0]", n / 2 - k))
            .collect();
        let flags = [
            format!("repeat.0.count=[{n},{n}]"),
            format!("repeat.0.fixed=[{}]", held.join(", ")),
            format!("step.time={:?}", if n > 50 { 1.0 } else { 5.0 }),
        ];
        let judge = move |t: &Trace| vec![stretch(t, f64::from(2 * n * n)), energy(t)];
        let scene = catalogue("joint-grid", &flags)?;
        Ok(Rung::new(format!("{n} x {n}"), scene, "holds", judge).quick_if(n <= 10))
    };
    [10, 30, 100].map(rung).into_iter().collect()
}
