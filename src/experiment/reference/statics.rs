//! Supports, contact forces, and whether a structure holds.
//!
//! # Source
//! Equilibrium of rigid bodies with Coulomb's law, as in any text, e.g. Meriam & Kraige, *Statics*;
//! the arch by limit analysis, see [`can_stand`].

use super::super::assembly::can_stand;
use super::{Measure, Samples, down, find, friction, mass};
use crate::contact::Vec2;
use crate::scene::{Scene, Shape};

/// Distance that a body which must fall has moved by the end of the run, as a share of its size. This
/// is far beyond creep. An excess load of 1 % of gravity reaches it within the two seconds of a scene
/// (0.2 m).
const GONE: f64 = 1e-2;

/// `N₁ = W b/(a+b)`, `N₂ = W a/(a+b)`, each with half of the beam's own weight.
pub(super) fn beam(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let names = ["left", "right", "beam", "load"].map(|n| find(scene, n));
    let [Some(left), Some(right), Some(beam), Some(load)] = names else {
        return Vec::new();
    };
    let (Some(own), Some(weight)) = (mass(scene, beam), mass(scene, load)) else {
        return Vec::new();
    };
    let Shape::Box { height, .. } = scene.bodies[beam].shape else {
        return Vec::new();
    };
    let g = down(scene);
    let x = |k: usize| scene.bodies[k].position[0];
    let (a, b) = (x(load) - x(left), x(right) - x(load));
    let under = scene.bodies[beam].position[1] - 0.5 * height;
    let force = |post: usize| s.force(Vec2::new(x(post), under), 0.5 * height).x;
    let half = 0.5 * own * g;
    vec![
        Measure::relative("left-force", force(left), half + weight * g * b / (a + b)),
        Measure::relative("right-force", force(right), half + weight * g * a / (a + b)),
    ]
}

/// One disc on two others, all equal. The base discs are apart: `sin α` is half the distance of
/// their centres over the diameter. The contacts with the top disc have `n = W/2`,
/// `t = n tan(α/2)`, those with the floor `3 W/2`. The stack holds iff `μ ≥ tan(α/2)`.
///
/// No moment acts on a base disc: its two friction forces are equal, and the resultant of each of
/// its two contacts passes through the other contact.
pub(super) fn three_discs(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let [Some(left), Some(right), Some(top)] = ["left", "right", "top"].map(|n| find(scene, n))
    else {
        return Vec::new();
    };
    let (Some(m), Shape::Disc { radius }) = (mass(scene, top), &scene.bodies[top].shape) else {
        return Vec::new();
    };
    let place = |k: usize| Vec2::from(scene.bodies[k].position);
    let weight = m * down(scene);
    let sine = 0.25 * (place(right).x - place(left).x) / radius;
    let limit = (0.5 * sine.asin()).tan();
    let hold = friction(scene, left, top) >= limit;
    let motion = s.motion(top, Vec2::zeros());
    let mut out = vec![Measure::verdict(hold, motion, GONE * radius)];
    if hold {
        // the larger error of the two sides
        let worst = |name, a: f64, b: f64, exact: f64| {
            let [a, b] = [a, b].map(|f| Measure::relative(name, f / weight, exact));
            if a.error > b.error { a } else { b }
        };
        let [l, r] = [left, right].map(|k| s.force(0.5 * (place(k) + place(top)), 0.2 * radius));
        let under = |k: usize| s.force(place(k) - Vec2::new(0.0, *radius), 0.2 * radius).x;
        out.push(worst("top-normal", l.x, r.x, 0.5));
        out.push(worst("top-friction", l.y, r.y, 0.5 * limit));
        out.push(worst("floor-normal", under(left), under(right), 1.5));
    }
    out
}

/// A capsule of half length l and radius r leans at the angle φ from the floor on a smooth wall. It
/// holds iff `μ ≥ l cos φ/(2 l sin φ + r)`.
///
/// Moments about the foot: `W l cos φ = H (2 l sin φ + r − r)` with the wall's push H at the height
/// of the upper centre and the floor's friction at the foot, r below the lower centre.
pub(super) fn ladder(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(ladder)) = (find(scene, "floor"), find(scene, "ladder")) else {
        return Vec::new();
    };
    let body = &scene.bodies[ladder];
    let Shape::Capsule { length, radius } = body.shape else {
        return Vec::new();
    };
    let limit = 0.5 * length * body.angle.cos() / (length * body.angle.sin() + radius);
    let hold = friction(scene, floor, ladder) >= limit;
    let motion = s.motion(ladder, Vec2::zeros());
    vec![Measure::verdict(hold, motion, GONE * length)]
}

/// A block of width b and height h on a slope of angle φ slides iff `tan φ > μ`, and tips iff
/// `tan φ > b/h`; the smaller limit counts. A block that slides, with `a = g (sin φ − μ cos φ)`,
/// does not tip if `μ < b/h`.
pub(super) fn block_on_slope(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(block)) = (find(scene, "floor"), find(scene, "block")) else {
        return Vec::new();
    };
    let Shape::Box { width, height } = scene.bodies[block].shape else {
        return Vec::new();
    };
    let mu = friction(scene, floor, block);
    let (along, across) = (scene.gravity[0], down(scene));
    let slope = along / across;
    if slope > mu && mu < width / height {
        let (pose, u) = s.last()[block];
        return vec![
            Measure::relative("acceleration", u.x / s.end(), along - mu * across),
            Measure::absolute("tilt", "rad", pose.angle(), 0.0),
        ];
    }
    let hold = slope <= width / height;
    let motion = s.motion(block, Vec2::zeros());
    vec![Measure::verdict(hold, motion, GONE * height)]
}

/// A wedge without weight, of half angle β, squeezed between two faces stays iff `μ ≥ tan β`.
///
/// The two forces, one at each face, balance only if they lie on one line. This line is at an angle
/// of at least β from one of the two normals.
pub(super) fn wedge(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let [Some(floor), Some(wedge), Some(lid)] = ["floor", "wedge", "lid"].map(|n| find(scene, n))
    else {
        return Vec::new();
    };
    let limit = (0.5 * scene.bodies[lid].angle).tan();
    let hold = friction(scene, floor, wedge) >= limit;
    let inside = s.motion(wedge, Vec2::zeros());
    let size = Vec2::from(scene.bodies[lid].position).norm();
    vec![Measure::verdict(hold, inside, GONE * size)]
}

/// An arch of voussoirs on two springings stands iff some distribution of forces within the friction
/// cones of its joints balances the weights.
pub(super) fn arch(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let stones = (0..scene.bodies.len()).filter(|&k| scene.bodies[k].name.starts_with("voussoir["));
    let stones: Vec<usize> = stones.collect();
    let Some(Shape::Polygon { points }) = stones.first().map(|&k| &scene.bodies[k].shape) else {
        return Vec::new();
    };
    // inner and outer radius, from the first two corners of a voussoir
    let [Some(inner), Some(outer)] = [0, 1].map(|c| points.get(c).map(|p| p[0].hypot(p[1]))) else {
        return Vec::new();
    };
    let motion = |k: &usize| s.motion(*k, Vec2::new(0.5 * (inner + outer), 0.0));
    let most = stones.iter().map(motion).fold(0.0, f64::max);
    // without a result of the linear programme there is no verdict: the measure is NaN
    match can_stand(scene) {
        Ok(hold) => vec![Measure::verdict(hold, most, GONE * inner)],
        Err(_) => vec![Measure::absolute("creep", "m", f64::NAN, 0.0)],
    }
}

/// A belt without weight on a drum slips iff the ratio of its tensions exceeds `exp(μ φ)`. While it
/// slips, the ratio is equal to that. (Euler 1769, Eytelwein 1808.)
///
/// The tensions follow from the weights' accelerations in the first step, `T = m (g + a)`. The belt
/// is then still at rest, without centrifugal force.
pub(super) fn capstan(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let [Some(heavy), Some(light), Some(drum)] = ["heavy", "light", "drum"].map(|n| find(scene, n))
    else {
        return Vec::new();
    };
    let links: Vec<usize> = (0..scene.bodies.len())
        .filter(|&k| scene.bodies[k].name.starts_with("link["))
        .collect();
    let (Some(&first), Some(&last)) = (links.first(), links.last()) else {
        return Vec::new();
    };
    let (Some(m2), Some(m1)) = (mass(scene, heavy), mass(scene, light)) else {
        return Vec::new();
    };
    let n = links.len() as f64;
    let angle = (scene.bodies[last].angle - scene.bodies[first].angle) * n / (n - 1.0);
    let ratio = (friction(scene, drum, first) * angle).exp();
    if m2 / m1 <= ratio {
        let motion = s.motion(heavy, Vec2::zeros());
        return vec![Measure::verdict(true, motion, 0.0)];
    }
    if s.steps() == 0 {
        return Vec::new();
    }
    let g = down(scene);
    let tension = |k: usize, m: f64| m * (g + s.states[1][k].1.y / s.step_length(0));
    let computed = tension(heavy, m2) / tension(light, m1);
    vec![Measure::relative("tension-ratio", computed, ratio)]
}
