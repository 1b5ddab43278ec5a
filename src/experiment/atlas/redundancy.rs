//! More contacts than a load can tell apart.

use super::trace::{Trace, larger};
use super::verdict::{Check, RELATIVE};
use super::{Rung, drafted, material, step};
use crate::contact::{Vec2, Vec3};
use crate::experiment::RunError;

/// A plank with a load at its end on a row of small discs or on the edges of a polyline: whatever the
/// shares, the wrench of the normal forces is that of the weights.
pub(super) fn redundant_contacts() -> Result<Vec<Rung>, RunError> {
    let discs = |n: u32| {
        let disc = |k: u32| {
            let x = -5.0 + 10.0 * f64::from(k) / f64::from(n - 1);
            format!("{{ disc = 0.004, position = [{x:?}, -0.004] }}")
        };
        let discs: Vec<String> = (0..n).map(disc).collect();
        rung(
            n.to_string(),
            n <= 100,
            &format!("parts = [{}]", discs.join(", ")),
        )
    };
    let polyline = |n: u32| {
        let point = |k: u32| format!("[{:?}, 0]", 6.0 - 12.0 * f64::from(k) / f64::from(n));
        let points: Vec<String> = (0..=n).map(point).collect();
        rung(
            format!("polyline of {n}"),
            true,
            &format!("polyline = [{}]", points.join(", ")),
        )
    };
    [2, 10, 100, 1000]
        .map(discs)
        .into_iter()
        .chain([10, 100].map(polyline))
        .collect()
}

fn rung(name: String, quick: bool, support: &str) -> Result<Rung, RunError> {
    let text = format!(
        "{}{}[[body]]\nname = \"support\"\nkind = \"fixed\"\n{support}\n\
         [[body]]\nname = \"plank\"\nbox = [10.2, 0.5]\nposition = [0, 0.25]\n[[body]]\n\
         name = \"load\"\nbox = [1, 1]\nposition = [3.5, 1]\n",
        step(1.0 / 60.0, 3.0),
        material(0.5, 0.0)
    );
    let judge = |t: &Trace| {
        let found: Vec3 = ["plank", "load"].iter().map(|n| t.wrench[t.body(n)]).sum();
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
        // over half of its length
        let off = larger(off.xy().norm() / weight, off.z.abs() / (5.0 * weight));
        vec![
            Check::new("moved", t.moved(), "m", 1e-3, "creeps"),
            Check::new("wrench", off, RELATIVE, 1e-3, "wrong-load"),
        ]
    };
    Ok(Rung::new(name, drafted("redundant-contacts", &text)?, "holds", judge).quick_if(quick))
}
