//! Sticking and sliding: blocks on slopes and edges.

use super::trace::Trace;
use super::verdict::{Check, RELATIVE};
use super::{FLOOR, Rung, catalogue, drafted, material, step};
use crate::contact::Vec2;
use crate::experiment::RunError;
use crate::scene::Built;

/// What an engine in single precision cannot tell from rest \[m\] at 1 m: 3e-7 of the body's size
/// from its gaps, and as much again from its poses.
const STILL: f64 = 1e-6;

/// A block at `1 ± δ` of the angle of friction: zero creep below, the right acceleration above.
pub(super) fn stick_slip_incline() -> Result<Vec<Rung>, RunError> {
    let rung = |excess: f64| {
        let slope = 0.5 * (1.0 + excess);
        let scene = catalogue("incline", &[format!("slope={slope:?}")])?;
        let name = format!("{:+}", excess);
        let judge = move |t: &Trace| {
            vec![if excess > 0.0 {
                let off = t.error("acceleration");
                Check::new("acceleration", off, RELATIVE, 1e-2, "wrong-speed")
            } else {
                Check::new("creep", t.error("creep"), "m", STILL, "creeps")
            }]
        };
        let passes = if excess > 0.0 { "slides" } else { "holds" };
        Ok(Rung::new(name, scene, passes, judge).quick())
    };
    [-1e-2, -1e-3, 1e-3, 1e-2].map(rung).into_iter().collect()
}

/// A block that slides fast keeps on the floor: convex relaxations of Coulomb's law lift it by
/// `Δt μ v`, 0.05 m at 6 m/s.
pub(super) fn sliding_lift_off() -> Result<Vec<Rung>, RunError> {
    let rung = |speed: f64| {
        let flags = [
            format!("body.block.velocity=[{speed:?},0]"),
            "body.floor.box=[400,2]".to_owned(),
        ];
        let judge = |t: &Trace| {
            let block = t.body("block");
            // the lowest corner
            let height = |pose: &crate::dynamics::Pose64| {
                let corners = [[-0.5, -0.5], [0.5, -0.5]].map(|c| pose.apply(Vec2::from(c)).y);
                corners[0].min(corners[1])
            };
            let gap = t.most(&[block], |_, s| height(&s.0));
            vec![Check::new("gap", gap, "m", STILL, "lifts")]
        };
        let scene = catalogue("sliding-block", &flags)?;
        Ok(Rung::new(format!("{speed} m/s"), scene, "stays", judge).quick())
    };
    [2.0, 6.0, 20.0].map(rung).into_iter().collect()
}

/// Boxes of five materials on a ramp of 0.25 rad: each holds or slides as its friction says.
pub(super) fn friction_ramp() -> Result<Vec<Rung>, RunError> {
    let angle: f64 = 0.25;
    let rung = |mu: f64| {
        let text = format!(
            "{}{}[gravity]\nangle = {angle:?}\n{FLOOR}[[body]]\nname = \"box\"\nbox = [1, 1]\n\
             position = [-100, 0.5]\n",
            step(1.0 / 60.0, 4.0),
            material(mu, 0.0)
        );
        let exact = 9.81 * (angle.sin() - mu * angle.cos());
        let judge = move |t: &Trace| {
            let way = t.ends(t.body("box")).map(|p| p.translation.x);
            let way = way[1] - way[0];
            let time = t.totals.time;
            vec![if exact > 0.0 {
                let off = (way / (0.5 * exact * time * time) - 1.0).abs();
                Check::new("distance", off, RELATIVE, 1e-2, "wrong-speed")
            } else {
                Check::new("creep", way.abs(), "m", STILL * 100.0, "creeps")
            }]
        };
        let passes = if exact > 0.0 { "slides" } else { "holds" };
        Ok(Rung::new(
            format!("mu {mu}"),
            drafted("friction-ramp", &text)?,
            passes,
            judge,
        )
        .quick())
    };
    [0.75, 0.5, 0.35, 0.25, 0.1, 0.0]
        .map(rung)
        .into_iter()
        .collect()
}

/// A box or disc slides without friction over the joints of a polyline, oriented or plain.
pub(super) fn ghost_edges() -> Result<Vec<Rung>, RunError> {
    let rung = |plain: bool, shape: &str, edges: u32| {
        // from the right to the left: the solid is on the left of its direction, below
        let points: Vec<String> = (0..=edges)
            .map(|k| format!("[{:?}, 0]", 20.0 - 40.0 * f64::from(k) / f64::from(edges)))
            .collect();
        let text = format!(
            "{}{}[[body]]\nname = \"floor\"\nkind = \"fixed\"\npolyline = [{}]\n[[body]]\n\
             name = \"slider\"\n{shape}\nposition = [-15, 0.5]\nvelocity = [5, 0]\n",
            step(1.0 / 60.0, 6.0),
            material(0.0, 0.0),
            points.join(", ")
        );
        let judge = |t: &Trace| {
            let slider = t.body("slider");
            let loss = t.most(&[slider], |_, s| (s.1.x / 5.0 - 1.0).abs());
            let hop = t.most(&[slider], |_, s| (s.0.translation.y - 0.5).abs());
            vec![
                // ten roundings of single precision
                Check::new("speed-lost", loss, "of the speed", 1e-6, "trips"),
                Check::new("hop", hop, "m", 10.0 * STILL, "hops"),
            ]
        };
        let kind = if plain { "plain " } else { "" };
        let word = if shape.starts_with("box") {
            "box"
        } else {
            "disc"
        };
        let name = format!("{kind}{word}, {edges}");
        let rung = Rung::new(name, drafted("ghost-edges", &text)?, "slides", judge).quick();
        Ok(if plain {
            rung.prepared(open_floor)
        } else {
            rung
        })
    };
    let mut rungs = Vec::new();
    for plain in [false, true] {
        for shape in ["box = [1, 1]", "disc = 0.5"] {
            for edges in [20, 400] {
                let rung: Result<Rung, RunError> = rung(plain, shape, edges);
                rungs.push(rung?);
            }
        }
    }
    Ok(rungs)
}

fn open_floor(built: &mut Built) {
    let floor = built.simulation().map(|(_, bodies)| bodies[0]);
    if let (Some(floor), Some(simulation)) = (floor, built.simulation_mut()) {
        simulation.open_chains(floor);
    }
}
