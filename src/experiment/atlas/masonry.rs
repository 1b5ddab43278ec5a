//! Dry masonry: what stands by friction and balance alone, at both sides of the limit that the
//! equilibrium oracle gives ([`crate::experiment::can_stand`]).

use super::trace::Trace;
use super::verdict::Check;
use super::{FLOOR, Rung, catalogue, drafted, material, step};
use crate::experiment::equilibrium::EquilibriumError;
use crate::experiment::{RunError, can_stand, limit};
use crate::scene::Scene;

/// What must stand moves no farther than this part of a block \[1\]; what must fall goes ten times
/// as far at least.
const STANDS: f64 = 1e-3;
const FALLS: f64 = 1e-2;

/// Within what the verdict must be right \[1\].
const MARGINS: [f64; 2] = [0.02, -0.02];

fn broken(error: EquilibriumError) -> RunError {
    RunError::Unfit(format!("the equilibrium oracle: {error}"))
}

/// Whether it stands or falls as it must; `size` \[m\] of its blocks.
fn right_verdict(t: &Trace, stands: bool, size: f64) -> Vec<Check> {
    let moved = t.moved() / size;
    vec![if stands {
        Check::new("moved", moved, "of a block", STANDS, "falls")
    } else {
        let missing = if moved.is_nan() {
            moved
        } else {
            (FALLS - moved).max(0.0)
        };
        Check::new("standing", missing, "of a block", 0.0, "stands")
    }]
}

fn word(stands: bool) -> &'static str {
    if stands { "stands" } else { "falls" }
}

/// The oracle's own verdict names the rung; a margin that it does not share is a broken ladder.
fn dated(name: String, scene: Scene, stands: bool, size: f64) -> Result<Rung, RunError> {
    if can_stand(&scene).map_err(broken)? != stands {
        let what = format!("the equilibrium oracle says otherwise of {name}");
        return Err(RunError::Unfit(what));
    }
    let judge = move |t: &Trace| right_verdict(t, stands, size);
    Ok(Rung::new(name, scene, word(stands), judge))
}

fn percent(margin: f64) -> String {
    format!("{:+} %", 100.0 * margin)
}

/// Semicircular arches of 7, 27 and 61 voussoirs, thicker and thinner than the least.
pub(super) fn arch() -> Result<Vec<Rung>, RunError> {
    let mut rungs = Vec::new();
    for (n, margins) in [
        (7u32, &MARGINS[..]),
        (27, &[0.02, 0.01, 0.005, -0.005, -0.01, -0.02]),
        (61, &MARGINS),
    ] {
        let with = |thickness: f64| {
            let angle = std::f64::consts::PI / f64::from(n);
            let flags = [
                format!("body.voussoir.sector=[1,{thickness:?},{angle:?}]"),
                format!("repeat.0.ring.count={n}"),
                "step.time=4".to_owned(),
            ];
            catalogue("arch", &flags)
        };
        let stands = |t: f64| can_stand(&with(t)?).map_err(broken);
        let least = limit(0.03, 0.2, stands)?;
        for &margin in margins {
            let scene = with(least * (1.0 + margin))?;
            let rung = dated(
                format!("{n}, {}", percent(margin)),
                scene,
                margin > 0.0,
                1.0,
            )?;
            rungs.push(rung.quick_if(n < 60));
        }
    }
    Ok(rungs)
}

/// Storeys of pairs of cards under a board each, the top one a single pair.
fn cards(storeys: u32, friction: f64) -> Result<Scene, RunError> {
    // slope of a card, height of a storey, thickness of a card level and upright, of a board
    let (slope, height, thick, board) = (0.45, 1.0, 0.05, 0.05);
    let apart = 2.0 * slope * height + 0.1;
    let mut text = format!(
        "{}{}{FLOOR}",
        step(1.0 / 60.0, 5.0),
        material(friction, 0.0)
    );
    let mut body = |name: String, shape: String, x: f64, y: f64| {
        text += &format!("[[body]]\nname = \"{name}\"\n{shape}\nposition = [{x:?}, {y:?}]\n");
    };
    let out = -slope * height;
    let left = [
        [out, 0.0],
        [out + thick, 0.0],
        [0.0, height - thick / slope],
        [0.0, height],
    ];
    let mut right = left.map(|[x, y]| [-x, y]);
    right.reverse();
    for storey in 0..storeys {
        let pairs = storeys - storey;
        let y = f64::from(storey) * (height + board);
        for pair in 0..pairs {
            let x = apart * (f64::from(pair) - 0.5 * f64::from(pairs - 1));
            body(
                format!("left{storey}-{pair}"),
                format!("polygon = {left:?}"),
                x,
                y,
            );
            body(
                format!("right{storey}-{pair}"),
                format!("polygon = {right:?}"),
                x,
                y,
            );
        }
        if pairs > 1 {
            let width = apart * f64::from(pairs - 1) + 0.4;
            let shape = format!("box = [{width:?}, {board:?}]");
            body(
                format!("board{storey}"),
                shape,
                0.0,
                y + height + 0.5 * board,
            );
        }
    }
    drafted("card-house", &text)
}

pub(super) fn card_house() -> Result<Vec<Rung>, RunError> {
    let mut rungs = Vec::new();
    for storeys in [1, 3, 5] {
        let stands = |mu: f64| can_stand(&cards(storeys, mu)?).map_err(broken);
        let least = limit(0.01, 1.0, stands)?;
        for margin in MARGINS {
            let scene = cards(storeys, least * (1.0 + margin))?;
            let name = format!("{storeys}, mu {}", percent(margin));
            rungs.push(dated(name, scene, margin > 0.0, 1.0)?.quick_if(storeys < 5));
        }
    }
    Ok(rungs)
}

/// n blocks over the edge of a table, together by `Σ 1/(2k)` of their width, 2 % less and more.
pub(super) fn overhang() -> Result<Vec<Rung>, RunError> {
    let mut rungs = Vec::new();
    for n in [4u32, 6, 8, 12] {
        for margin in MARGINS {
            let mut text = format!(
                "{}[[body]]\nname = \"table\"\nkind = \"fixed\"\nbox = [20, 2]\n\
                 position = [-10, -1]\n",
                step(1.0 / 60.0, 10.0)
            );
            let mut x = -0.5;
            for k in (1..=n).rev() {
                x += (1.0 - margin) * 0.5 / f64::from(k);
                let y = 0.1 + 0.2 * f64::from(n - k);
                text += &format!(
                    "[[body]]\nname = \"block{k}\"\nbox = [1, 0.2]\nposition = [{x:?}, {y:?}]\n"
                );
            }
            let name = format!("{n}, {}", percent(-margin));
            let rung = dated(name, drafted("overhang", &text)?, margin > 0.0, 1.0)?;
            rungs.push(rung.quick());
        }
    }
    Ok(rungs)
}

/// A lid squeezes a wedge of half angle β, a little rougher and smoother than tan β; and whether it
/// is said that the loads on its faces are one of many.
pub(super) fn wedge() -> Result<Vec<Rung>, RunError> {
    let with = |tangent: f64, margin: f64| {
        let whole = 2.0 * tangent.atan();
        let (sin, cos) = whole.sin_cos();
        let lid = [1.5 * cos - 0.1 * sin, 1.5 * sin + 0.1 * cos];
        let flags = [
            format!("friction={:?}", tangent * (1.0 + margin)),
            format!(
                "body.wedge.polygon=[[1,0],[2,0],[{:?},{:?}],[{cos:?},{sin:?}]]",
                2.0 * cos,
                2.0 * sin
            ),
            format!("body.lid.position={lid:?}"),
            format!("body.lid.angle={whole:?}"),
        ];
        catalogue("wedge", &flags)
    };
    let mut rungs = Vec::new();
    for tangent in [0.1, 0.25, 0.5] {
        for margin in MARGINS {
            let name = format!("{tangent}, {}", percent(margin));
            rungs.push(dated(name, with(tangent, margin)?, margin > 0.0, 1.0)?.quick());
        }
    }
    let flagged = |t: &Trace| {
        let silent = (t.totals.steps - t.totals.redundant_steps) as f64;
        vec![Check::new(
            "steps-not-flagged",
            silent,
            "steps",
            0.0,
            "silent",
        )]
    };
    let rung = Rung::new("shares flagged", with(0.25, 0.02)?, "flagged", flagged);
    rungs.push(
        rung.quick()
            .ours_alone("it says nothing of loads that are not unique"),
    );
    Ok(rungs)
}
