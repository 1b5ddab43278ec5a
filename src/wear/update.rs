use super::{Profile, WearError, all_finite, in_range, same_length};
use crate::contact::Vec2;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// How worn depth changes the profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Update {
    /// Along the local normal, with area balance: [`wear_normal`].
    #[default]
    Normal,
    /// The method of the study: vertical depths, then one quadratic fit, [`refit_quadratic`], every
    /// node with the same width.
    Quadratic,
    /// The same with the width of every node along `x`, half an edge at both ends: the trapezoid
    /// rule, which converges with the mesh.
    QuadraticByWidth,
}

/// Wears a profile along its local normals, with area balance.
///
/// Node `i` moves by `c m_i`, where `m_i = −h_i n_i` inside and, at the two ends, along their faces
/// `d` by `h_i / (n · d)`, straight down by default, so that the surface recedes by `h_i` and the end
/// stays on its face. The area swept by the polyline is
///
/// ```text
/// removed(c) = c L + c² Q,  L = −½ Σ e_i × (m_i + m_{i+1}),  Q = ½ Σ m_i × m_{i+1}    (1)
/// ```
///
/// over the edges `e_i`. With the area vectors of [`Profile::area_vectors`], `L = Σ h_i w_i` is the
/// requested area, and `Q` is the effect of curvature. The `c` that solves `removed(c) = Σ h_i w_i`
/// balances the area to round-off.
///
/// # Arguments
/// - `depths`: `h_i ≥ 0` \[m\], one per node.
///
/// # Returns
/// The worn profile, which may cross itself (see [`crate::wear::clip_loops`]), and `c − 1`, the
/// relative imbalance before the correction.
///
/// # Errors
/// [`WearError::Length`], [`WearError::NonFinite`], [`WearError::Range`] (negative depth);
/// [`WearError::Unbalanced`] if no `c` between 0.5 and 2 balances the area, or the normal of a worn
/// end node does not point out of its face.
pub fn wear_normal(profile: &Profile, depths: &[f64]) -> Result<(Profile, f64), WearError> {
    check_depths(profile, depths)?;
    let nodes = profile.nodes();
    let last = nodes.len() - 1;
    let mut moves = Vec::with_capacity(nodes.len());
    for (i, (n, &h)) in profile.normals().into_iter().zip(depths).enumerate() {
        let face = profile.faces().and_then(|[first, end]| match i {
            0 => Some(first),
            i if i == last => Some(end),
            _ => None,
        });
        moves.push(match face {
            None => -h * n,
            Some(_) if h == 0.0 => Vec2::zeros(),
            Some(face) if n.dot(&face) > 0.0 => -h / n.dot(&face) * face,
            Some(_) => return Err(WearError::Unbalanced { node: i }),
        });
    }
    let (mut linear, mut quadratic) = (0.0, 0.0);
    for [a, b] in profile.edge_ends() {
        linear -= 0.5 * (nodes[b] - nodes[a]).perp(&(moves[a] + moves[b]));
        quadratic += 0.5 * moves[a].perp(&moves[b]);
    }
    let requested: f64 = depths
        .iter()
        .zip(profile.widths())
        .map(|(h, w)| h * w)
        .sum();
    if requested == 0.0 {
        return Ok((profile.clone(), 0.0));
    }
    let root = (linear * linear + 4.0 * quadratic * requested).sqrt();
    // NaN if no real c exists; a jump with c outside of a factor of two is too long
    let c = 2.0 * requested / (linear + root);
    if !(0.5..=2.0).contains(&c) {
        return Err(WearError::Unbalanced {
            node: deepest(depths),
        });
    }
    let worn = nodes.iter().zip(&moves).map(|(p, m)| p + c * m).collect();
    Ok((profile.moved(worn)?, c - 1.0))
}

/// The update of the study: `y_i − h_i`, fitted by one quadratic in the least-squares sense.
///
/// Every node keeps its station `x_i`, and `Σ w_i y_i` is exact: with equal weights, as in the
/// study, the sum of the heights, with widths along `x` the area under the profile. The fit spreads
/// a local scar over the whole tooth and adds steel beside it. Use it only to rebuild the study.
///
/// # Arguments
/// - `depths`: `h_i ≥ 0` \[m\], one per node.
/// - `weights`: `w_i > 0`, one per node; only their ratios count.
///
/// # Errors
/// [`WearError::Length`], [`WearError::NonFinite`], [`WearError::Range`] (negative depth, weight not
/// above 0); [`WearError::Winding`] unless `x` grows from node to node.
pub fn refit_quadratic(
    profile: &Profile,
    depths: &[f64],
    weights: &[f64],
) -> Result<Profile, WearError> {
    check_depths(profile, depths)?;
    let worn: Vec<Vec2> = profile
        .nodes()
        .iter()
        .zip(depths)
        .map(|(p, &h)| Vec2::new(p.x, p.y - h))
        .collect();
    let [alpha, beta, gamma] = Profile::unchecked(worn)?.fit_quadratic(weights)?;
    let fitted = |p: &Vec2| Vec2::new(p.x, (alpha * p.x + beta) * p.x + gamma);
    Profile::new(profile.nodes().iter().map(fitted).collect())
}

impl Profile {
    /// Least-squares quadratic through the nodes, `[α, β, γ]` of `y = α x² + β x + γ` in
    /// [1/m, –, m], every node with its weight.
    ///
    /// # Errors
    /// [`WearError::Winding`] unless `x` grows from node to node; [`WearError::Length`];
    /// [`WearError::Range`] for a weight that is not above 0.
    pub fn fit_quadratic(&self, weights: &[f64]) -> Result<[f64; 3], WearError> {
        let nodes = self.nodes();
        same_length("weights of a fit", weights.len(), nodes.len())?;
        for &w in weights {
            in_range("weight of a fit", w, w > 0.0 && w.is_finite(), "above 0")?;
        }
        for e in nodes.windows(2) {
            if e[1].x <= e[0].x {
                return Err(WearError::Winding {
                    measure: e[1].x - e[0].x,
                });
            }
        }
        // with t ∈ [−1, 1] the normal equations have a condition number of about 10
        let (a, b) = (nodes[0].x, nodes[nodes.len() - 1].x);
        let (centre, half) = (0.5 * (a + b), 0.5 * (b - a));
        let mut matrix = Matrix3::zeros();
        let mut right = Vector3::zeros();
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        for (p, w) in nodes.iter().zip(weights) {
            let t = (p.x - centre) / half;
            let row = Vector3::new(t * t, t, 1.0);
            matrix += row * row.transpose() * (w / mean);
            right += row * (p.y * (w / mean));
        }
        let fit = matrix.cholesky().map(|c| c.solve(&right));
        let Some(fit) = fit.filter(|f| f.iter().all(|v| v.is_finite())) else {
            return Err(WearError::NonFinite {
                what: "quadratic fit, coefficient",
                index: 0,
            });
        };
        let (alpha, slope) = (fit.x / (half * half), fit.y / half);
        let beta = slope - 2.0 * alpha * centre;
        let gamma = fit.z - slope * centre + alpha * centre * centre;
        Ok([alpha, beta, gamma])
    }
}

/// Smooths depths by diffusion over a length σ along the surface, in flux form.
///
/// ```text
/// f_i = (σ²/2n) (h_{i+1} − h_i) / e_i,   h_i += (f_i − f_{i−1}) / w_i              (1)
/// ```
///
/// in `n` passes, with no flux through the ends; `e_i` is the edge from node `i` to the next, on a ring
/// from the last to the first. The
/// flux out of one cell enters the next, so `Σ h_i w_i` is conserved to round-off. With
/// `(σ²/2n) (1/e_{i−1} + 1/e_i) / w_i ≤ 1/2` no new extreme appears and every wave decays without
/// changing sign. A peak becomes a bell of standard deviation σ on any mesh.
///
/// # Arguments
/// - `depths`: `h_i` \[m\], changed in place.
/// - `widths`: `w_i > 0` \[m\], one per node; `edges`: `e_i > 0` \[m\], one fewer, or as many on a ring.
/// - `length`: σ ≥ 0 \[m\]; 0 changes nothing.
///
/// # Errors
/// [`WearError::Length`], [`WearError::NonFinite`], [`WearError::Range`], also for a length of more
/// than a thousand edges; nothing is changed then.
pub fn smooth_depths(
    depths: &mut [f64],
    widths: &[f64],
    edges: &[f64],
    length: f64,
) -> Result<(), WearError> {
    same_length("widths", widths.len(), depths.len())?;
    let nodes = depths.len();
    let ring = edges.len() == nodes;
    same_length("edges", edges.len() + usize::from(!ring), nodes)?;
    all_finite("depth of node", depths)?;
    all_finite("width of node", widths)?;
    all_finite("edge", edges)?;
    let inside = length >= 0.0 && length.is_finite();
    in_range(
        "smoothing length [m]",
        length,
        inside,
        "finite and at least 0",
    )?;
    for &w in widths.iter().chain(edges) {
        in_range("tributary width or edge [m]", w, w > 0.0, "above 0")?;
    }
    if length == 0.0 {
        return Ok(());
    }
    let spread = 0.5 * length * length;
    let leaves = |i: usize| {
        let before = i.checked_sub(1).or(ring.then(|| nodes - 1));
        let before = before.map_or(0.0, |k| 1.0 / edges[k]);
        let after = edges.get(i).map_or(0.0, |e| 1.0 / e);
        spread * (before + after) / widths[i]
    };
    let passes = (0..depths.len()).map(leaves).fold(0.0, f64::max) / 0.5;
    let most = "at most a thousand edges";
    in_range("smoothing length [m]", length, passes <= 4e6, most)?;
    let passes = passes.ceil();
    for _ in 0..passes as usize {
        let flux: Vec<f64> = edges
            .iter()
            .enumerate()
            .map(|(i, e)| spread / passes * (depths[(i + 1) % nodes] - depths[i]) / e)
            .collect();
        for (i, f) in flux.into_iter().enumerate() {
            let next = (i + 1) % nodes;
            depths[i] += f / widths[i];
            depths[next] -= f / widths[next];
        }
    }
    Ok(())
}

fn check_depths(profile: &Profile, depths: &[f64]) -> Result<(), WearError> {
    same_length("depths", depths.len(), profile.node_count())?;
    all_finite("depth of node", depths)?;
    for &h in depths {
        in_range("depth [m]", h, h >= 0.0, "at least 0")?;
    }
    Ok(())
}

/// The first of the deepest nodes.
pub(super) fn deepest(depths: &[f64]) -> usize {
    let mut best = 0;
    for (i, h) in depths.iter().enumerate() {
        if *h > depths[best] {
            best = i;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tooth() -> Profile {
        Profile::quadratic(-5.539, -0.1014, 0.0188, 0.05, 26).unwrap()
    }

    fn dot(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    proptest! {
        #[test]
        fn the_area_removed_is_the_area_asked_for(
            depths in prop::collection::vec(0.0f64..5e-4, 26),
        ) {
            let old = tooth();
            let requested = dot(&depths, &old.widths());
            let (new, correction) = wear_normal(&old, &depths).unwrap();
            let removed = old.area_above(0.0) - new.area_above(0.0);
            // round-off of the area itself, 6e-4 m²
            prop_assert!((removed - requested).abs() < 1e-17);
            // Q / L is of the order depth / edge for a rough field: 0.5 mm on 2 mm
            prop_assert!(correction.abs() < 0.1);
            // both ends stay on their faces
            prop_assert_eq!(new.nodes()[0].x, 0.0);
            prop_assert_eq!(new.nodes()[25].x, old.nodes()[25].x);
        }

        #[test]
        fn smoothing_keeps_the_area_and_makes_no_new_extreme(
            start in prop::collection::vec(0.0f64..1.0, 12),
            widths in prop::collection::vec(0.1f64..1.0, 12),
            edges in prop::collection::vec(0.1f64..1.0, 11),
            length in 0.0f64..1.0,
        ) {
            let mut h = start.clone();
            smooth_depths(&mut h, &widths, &edges, length).unwrap();
            // 200 passes of 24 roundings of numbers of order 1
            prop_assert!((dot(&h, &widths) - dot(&start, &widths)).abs() < 1e-12);
            let (low, high) = (start.iter().copied().fold(1.0, f64::min), start.iter().copied().fold(0.0, f64::max));
            prop_assert!(h.iter().all(|v| (low - 1e-13..=high + 1e-13).contains(v)));
        }
    }

    #[test]
    fn smoothing_on_equal_cells_is_the_three_point_formula() {
        let mut h = vec![0.0, 0.0, 1.0, 0.0, 0.0];
        // one pass with ν = σ²/2 = 0.245 on cells of 1 m
        let widths = [0.5, 1.0, 1.0, 1.0, 0.5];
        smooth_depths(&mut h, &widths, &[1.0; 4], 0.7).unwrap();
        for (h, expected) in h.iter().zip([0.0, 0.245, 0.51, 0.245, 0.0]) {
            assert!((h - expected).abs() < 1e-15, "{h}");
        }
        assert!(matches!(
            smooth_depths(&mut h, &widths, &[1.0; 4], -1.0),
            Err(WearError::Range { .. })
        ));
    }

    /// A peak has the variance σ² on a mesh of 1 mm, of 0.5 mm, and one of edges of both.
    #[test]
    fn smoothing_spreads_by_its_length_on_any_mesh() {
        let length: f64 = 4e-3;
        for pattern in [&[1e-3][..], &[0.5e-3], &[0.5e-3, 1e-3, 1e-3]] {
            let edges: Vec<f64> = pattern.iter().copied().cycle().take(150).collect();
            let mut x = vec![0.0];
            edges.iter().for_each(|e| x.push(x[x.len() - 1] + e));
            let half = |k: Option<usize>| k.and_then(|k| edges.get(k)).map_or(0.0, |e| 0.5 * e);
            let widths: Vec<f64> = (0..x.len())
                .map(|i| half(i.checked_sub(1)) + half(Some(i)))
                .collect();
            let mut h = vec![0.0; x.len()];
            h[75] = 1.0;
            smooth_depths(&mut h, &widths, &edges, length).unwrap();
            let area = dot(&h, &widths);
            let centre = x[75];
            let moment = |p: i32| {
                let each = x.iter().zip(&h).zip(&widths);
                each.map(|((x, h), w)| (x - centre).powi(p) * h * w)
                    .sum::<f64>()
                    / area
            };
            assert!(
                (moment(2).sqrt() / length - 1.0).abs() < 1e-3,
                "{pattern:?}"
            );
        }
    }

    #[test]
    fn uncorrected_imbalance_falls_with_the_depth() {
        // even wear of a convex arc of curvature κ: Q / L = −κ h / 2 along the surface, first order
        let correction = |h: f64| wear_normal(&tooth(), &[h; 26]).unwrap().1;
        let ratio = correction(2e-4) / correction(1e-4);
        assert!((ratio - 2.0).abs() < 0.01, "{ratio}");
    }

    #[test]
    fn the_refit_flattens_a_scar_as_documented() {
        // a 2 mm scar at cell 6 comes out 1.15 mm deep, and 206 µm of steel grow elsewhere
        let old = tooth();
        let scar = |p: &Vec2| 2e-3 * (-((p.x - 0.01) / 0.006).powi(2)).exp();
        let depths: Vec<f64> = old.nodes().iter().map(scar).collect();
        let new = refit_quadratic(&old, &depths, &[1.0; 26]).unwrap();
        let change: Vec<f64> = old
            .nodes()
            .iter()
            .zip(new.nodes())
            .map(|(a, b)| a.y - b.y)
            .collect();
        let deepest = change.iter().copied().fold(f64::MIN, f64::max);
        let growth = -change.iter().copied().fold(f64::MAX, f64::min);
        // documented to three digits
        assert!((deepest - 1.15e-3).abs() < 5e-6, "{deepest}");
        assert!((growth - 206e-6).abs() < 1e-6, "{growth}");
        // least squares with a constant keeps the sum: round-off of 26 numbers of 0.02
        assert!((change.iter().sum::<f64>() - depths.iter().sum::<f64>()).abs() < 1e-15);
    }

    #[test]
    fn the_fit_gives_back_a_quadratic() {
        let [alpha, beta, gamma] = tooth().fit_quadratic(&[1.0; 26]).unwrap();
        // ulp of y = 0.0188 over x² = 0.0025, times the condition of about 10
        assert!((alpha + 5.539).abs() < 1e-12);
        assert!((beta + 0.1014).abs() < 1e-13);
        assert!((gamma - 0.0188).abs() < 1e-15);
    }

    #[test]
    fn bad_depths_are_refused() {
        let bad = |i: usize, v: f64| {
            let mut h = [0.0; 26];
            h[i] = v;
            wear_normal(&tooth(), &h)
        };
        assert!(matches!(
            bad(3, f64::NAN),
            Err(WearError::NonFinite { index: 3, .. })
        ));
        assert!(matches!(bad(3, -1.0), Err(WearError::Range { .. })));
        assert!(matches!(
            wear_normal(&tooth(), &[0.0; 5]),
            Err(WearError::Length { .. })
        ));
    }
}
