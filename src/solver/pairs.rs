//! The complementary pairs of one block in the interior point.

use super::block_status::Status;
use crate::contact::{Law, Mat2, Vec2};

/// Most pairs of a block.
pub(super) const PAIRS: usize = 4;

/// Scales of the pairs: an impulse [N s] and a velocity \[m/s\].
#[derive(Debug, Clone, Copy)]
pub(super) struct Size {
    pub impulse: f64,
    pub velocity: f64,
}

/// Pairs `x ⟂ w` of one block, all positive, and the impulse of the block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Frictional contact: (P_N, β₁, β₂, λ); bounded row: (P − lower, upper − P); unused ones 1.
    pub x: [f64; PAIRS],
    /// Frictional contact: (ξ_N, λ + ξ_T, λ − ξ_T, μ P_N − β₁ − β₂); bounded row: the positive and
    /// the negative part of ξ.
    pub w: [f64; PAIRS],
    /// Impulse of a pin or a bounded row.
    bilateral: Vec2,
    law: Law,
    /// `a` in `w_N = ξ_N − a λ`: 0 for friction as it is, μ in the convex problem.
    dilation: f64,
}

/// A change of the pairs of one block.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Direction {
    pub x: [f64; PAIRS],
    pub w: [f64; PAIRS],
    bilateral: Vec2,
}

/// Least friction in the choice of the first point; the equations use the true one.
const LEAST_FRICTION: f64 = 1e-3;

impl Block {
    /// The first point: the same for all contacts, or near the given impulse and local velocity.
    pub fn start(law: &Law, near: Option<(Vec2, Vec2)>, size: Size, convex: bool) -> Block {
        let (a, v) = (size.impulse, size.velocity);
        let mut block = Block {
            x: [1.0; PAIRS],
            w: [1.0; PAIRS],
            bilateral: near.map_or(Vec2::zeros(), |(p, _)| p),
            law: *law,
            dilation: 0.0,
        };
        match *law {
            Law::Contact { friction, .. } => {
                block.dilation = if convex { friction } else { 0.0 };
                let mu = friction.max(LEAST_FRICTION);
                match near {
                    None => {
                        block.x = [a, 0.4 * mu * a, 0.4 * mu * a, v];
                        block.w = [v, v, v, 0.2 * mu * a];
                    }
                    Some((p, xi)) => {
                        let n = p.x.max(0.5 * a);
                        let t = p.y.clamp(-0.7 * mu * n, 0.7 * mu * n);
                        let slip = xi.y.abs().max(0.5 * v);
                        let both = 0.8 * mu * n;
                        block.x = [n, 0.5 * (both + t), 0.5 * (both - t), slip];
                        block.w = [
                            xi.x.max(0.5 * v),
                            (slip + xi.y).max(0.5 * v),
                            (slip - xi.y).max(0.5 * v),
                            0.2 * mu * n,
                        ];
                    }
                }
            }
            Law::Pin => {}
            Law::Bounded { lower, upper, .. } => {
                // strictly between the bounds, near the given impulse, a tenth of the room away
                // from a bound
                let room = 0.1 * (upper - lower).min(a);
                let p = if lower < upper {
                    block.bilateral.x.clamp(lower + room, upper - room)
                } else {
                    lower
                };
                block.bilateral = Vec2::new(p, 0.0);
                if lower < upper {
                    block.x[0] = p - lower;
                    block.x[1] = upper - p;
                    block.w[0] = v;
                    block.w[1] = v;
                }
            }
        }
        let used = block.used();
        for k in (0..PAIRS).filter(|&k| !used[k]) {
            (block.x[k], block.w[k]) = (1.0, 1.0);
        }
        block
    }

    fn used(&self) -> [bool; PAIRS] {
        match self.law {
            Law::Contact { friction, .. } if friction > 0.0 => [true; PAIRS],
            Law::Contact { .. } => [true, false, false, false],
            Law::Pin => [false; PAIRS],
            Law::Bounded { lower, upper, .. } => {
                let free = lower < upper;
                let [low, high] = [lower, upper].map(|b| free && b.is_finite());
                [low, high, false, false]
            }
        }
    }

    /// Number of pairs.
    pub fn pairs(&self) -> usize {
        self.used().iter().filter(|u| **u).count()
    }

    /// `Σ x w` over the pairs.
    pub fn product(&self) -> f64 {
        self.product_after(&Direction::default(), 0.0)
    }

    /// `Σ x w` after a step of length `step`.
    pub fn product_after(&self, d: &Direction, step: f64) -> f64 {
        let used = self.used();
        (0..PAIRS)
            .filter(|&k| used[k])
            .map(|k| (self.x[k] + step * d.x[k]) * (self.w[k] + step * d.w[k]))
            .sum()
    }

    /// `P_N λ` of a frictional contact \[J\], 0 at rest and where it is open.
    pub fn slide(&self) -> f64 {
        match self.law {
            Law::Contact { friction, .. } if friction > 0.0 => self.x[0] * self.x[3],
            _ => 0.0,
        }
    }

    /// The impulse of this point [N s].
    pub fn impulse(&self) -> Vec2 {
        match self.law {
            Law::Contact { friction, .. } if friction > 0.0 => {
                Vec2::new(self.x[0], self.x[1] - self.x[2])
            }
            Law::Contact { .. } => Vec2::new(self.x[0], 0.0),
            _ => self.bilateral,
        }
    }

    /// The status this point tends to.
    pub fn status(&self, size: Size) -> Status {
        let (x, w) = (&self.x, &self.w);
        match self.law {
            Law::Contact { friction, .. } => {
                if x[0] * size.velocity < w[0] * size.impulse {
                    Status::Open
                } else if friction == 0.0 || x[3] * size.impulse <= w[3] * size.velocity {
                    Status::Closed
                } else if x[1] > x[2] {
                    Status::SlipPlus
                } else {
                    Status::SlipMinus
                }
            }
            Law::Pin => Status::Closed,
            Law::Bounded { lower, upper, .. } => {
                let used = self.used();
                let at = |k: usize| used[k] && x[k] * size.velocity < w[k] * size.impulse;
                if lower == upper || at(0) {
                    Status::Lower
                } else if at(1) {
                    Status::Upper
                } else {
                    Status::Closed
                }
            }
        }
    }

    /// Gain `A` and offset `g` of `dr = g − A h`, the pairs eliminated.
    ///
    /// Aims at `x w = aim`, less the second-order term of `predictor` where given. `xi` is the
    /// local velocity of this point and `proximal` the weight δ tr(G_ii) [1/kg].
    pub fn respond(
        &self,
        xi: Vec2,
        aim: f64,
        predictor: Option<&Direction>,
        proximal: f64,
    ) -> (Mat2, Vec2) {
        let weight = Vec2::new(self.law.compliance() + proximal, proximal);
        match self.law {
            Law::Contact { friction, .. } if friction > 0.0 => {
                let e = Elimination::of(self, friction, xi, aim, predictor);
                soften(e.gain, e.offset, weight)
            }
            Law::Contact { .. } => {
                let rc = self.target(0, aim, predictor);
                let k = self.x[0] / self.w[0];
                let g = (rc + self.x[0] * (self.w[0] - xi.x)) / self.w[0];
                one_row(1.0 / (1.0 + k * weight.x), k, g)
            }
            Law::Pin => soften_rigid(xi, proximal),
            Law::Bounded { lower, upper, .. } if lower < upper => {
                let (stiffness, known) = self.bounds(xi.x, aim, predictor);
                let rate = 1.0 / (stiffness + weight.x);
                one_row(rate, 1.0, known)
            }
            Law::Bounded { .. } => (Mat2::zeros(), Vec2::zeros()),
        }
    }

    /// Changes of all pairs for a local velocity change `h` and an impulse change `dr` of
    /// [`Block::respond`] with the same arguments.
    pub fn direction(
        &self,
        xi: Vec2,
        h: Vec2,
        dr: Vec2,
        aim: f64,
        predictor: Option<&Direction>,
        proximal: f64,
    ) -> Direction {
        let mut d = Direction::default();
        let weight = Vec2::new(self.law.compliance() + proximal, proximal);
        let du = h + weight.component_mul(&dr);
        match self.law {
            Law::Contact { friction, .. } if friction > 0.0 => {
                let e = Elimination::of(self, friction, xi, aim, predictor);
                let n = e.normal - e.ratio[0] * du.x;
                let slip = (e.slip
                    - self.x[3] * friction * n
                    - self.x[3] * (e.ratio[1] - e.ratio[2]) * du.y)
                    / e.pivot;
                let n = n + e.ratio[0] * self.dilation * slip;
                let (b1, b2) = (
                    e.tangent[0] - e.ratio[1] * (slip + du.y),
                    e.tangent[1] - e.ratio[2] * (slip - du.y),
                );
                d.x = [n, b1, b2, slip];
                d.w = [
                    du.x - self.dilation * slip - e.gap[0],
                    slip + du.y - e.gap[1],
                    slip - du.y - e.gap[2],
                    friction * n - b1 - b2 - e.gap[3],
                ];
            }
            Law::Contact { .. } => {
                d.x[0] = dr.x;
                d.w[0] = du.x - (self.w[0] - xi.x);
            }
            Law::Pin => d.bilateral = dr,
            Law::Bounded { .. } => {
                d.bilateral = Vec2::new(dr.x, 0.0);
                let used = self.used();
                for (k, sign) in [(0, 1.0), (1, -1.0)] {
                    if used[k] {
                        d.x[k] = sign * dr.x;
                        let rc = self.target(k, aim, predictor);
                        d.w[k] = (rc - self.w[k] * d.x[k]) / self.x[k];
                    }
                }
            }
        }
        d
    }

    /// A step; products that fall below `least` are lifted to it.
    pub fn advance(&mut self, d: &Direction, step: f64, least: f64, size: Size) {
        self.bilateral += d.bilateral * step;
        let used = self.used();
        let bounded = matches!(self.law, Law::Bounded { .. });
        for k in (0..PAIRS).filter(|&k| used[k]) {
            let (x, w) = (&mut self.x[k], &mut self.w[k]);
            *x = (*x + step * d.x[k]).max(TINY);
            *w = (*w + step * d.w[k]).max(TINY);
            if *x * *w < least {
                // the slack of a bounded row is tied to its impulse; the others may move
                if bounded || *x * size.velocity >= *w * size.impulse {
                    *w = least / *x;
                } else {
                    *x = least / *w;
                }
            }
        }
    }

    /// `aim − x w − dx dw`.
    fn target(&self, k: usize, aim: f64, predictor: Option<&Direction>) -> f64 {
        let second = predictor.map_or(0.0, |d| d.x[k] * d.w[k]);
        aim - self.x[k] * self.w[k] - second
    }

    /// `dr = (known − h) / stiffness` of a bounded row without proximal term.
    fn bounds(&self, xi: f64, aim: f64, predictor: Option<&Direction>) -> (f64, f64) {
        let used = self.used();
        let (mut stiffness, mut known) = (0.0, -xi);
        for (k, sign) in [(0, 1.0), (1, -1.0)] {
            if used[k] {
                stiffness += self.w[k] / self.x[k];
                known += sign * (self.w[k] + self.target(k, aim, predictor) / self.x[k]);
            }
        }
        (stiffness, known)
    }
}

/// Positive numbers stay positive.
const TINY: f64 = 1e-200;

/// The four pairs of a frictional contact, eliminated down to `dr = offset − gain dξ`.
struct Elimination {
    gain: Mat2,
    offset: Vec2,
    /// `x / w` of the first three pairs.
    ratio: [f64; 3],
    /// `w` less what it should be.
    gap: [f64; PAIRS],
    normal: f64,
    tangent: [f64; 2],
    slip: f64,
    pivot: f64,
}

impl Elimination {
    fn of(
        block: &Block,
        friction: f64,
        xi: Vec2,
        aim: f64,
        predictor: Option<&Direction>,
    ) -> Elimination {
        let (x, w) = (&block.x, &block.w);
        let gap = [
            w[0] - xi.x + block.dilation * x[3],
            w[1] - x[3] - xi.y,
            w[2] - x[3] + xi.y,
            w[3] - (friction * x[0] - x[1] - x[2]),
        ];
        let known = |k: usize| block.target(k, aim, predictor) + x[k] * gap[k];
        let ratio = [0, 1, 2].map(|k| x[k] / w[k]);
        let normal = known(0) / w[0];
        let tangent = [known(1) / w[1], known(2) / w[2]];
        let slip = known(3) + x[3] * (tangent[0] + tangent[1]);
        let dilation = block.dilation * ratio[0];
        let pivot = w[3] + x[3] * (ratio[1] + ratio[2] + friction * dilation);
        // dλ = at_rest + per_normal dξ_N + per_tangent dξ_T
        let at_rest = (slip - x[3] * friction * normal) / pivot;
        let per_normal = x[3] * friction * ratio[0] / pivot;
        let difference = ratio[1] - ratio[2];
        let per_tangent = -x[3] * difference / pivot;
        let below = difference * per_normal;
        // −dilation · per_tangent is the same but for round-off; a symmetric system is factorised faster
        let above = if dilation > 0.0 { below } else { 0.0 };
        Elimination {
            gain: Mat2::new(
                ratio[0] - dilation * per_normal,
                above,
                below,
                ratio[1] + ratio[2] + difference * per_tangent,
            ),
            offset: Vec2::new(
                normal + dilation * at_rest,
                tangent[0] - tangent[1] - difference * at_rest,
            ),
            ratio,
            gap,
            normal,
            tangent,
            slip,
            pivot,
        }
    }
}

/// `dr = g − A (h + D dr)` solved for `dr`: gain `(I + A D)⁻¹ A`, offset `(I + A D)⁻¹ g`. The gain is
/// symmetric if `A` is.
fn soften(gain: Mat2, offset: Vec2, weight: Vec2) -> (Mat2, Vec2) {
    let [n, t] = [1.0 + gain[(0, 0)] * weight.x, 1.0 + gain[(1, 1)] * weight.y];
    let [above, below] = [gain[(0, 1)] * weight.y, gain[(1, 0)] * weight.x];
    let inverse = Mat2::new(t, -above, -below, n) / (n * t - above * below);
    let mut softened = inverse * gain;
    if gain[(0, 1)] == gain[(1, 0)] {
        softened[(0, 1)] = softened[(1, 0)];
    }
    (softened, inverse * offset)
}

fn soften_rigid(xi: Vec2, proximal: f64) -> (Mat2, Vec2) {
    let rate = 1.0 / proximal;
    (Mat2::from_diagonal_element(rate), xi * -rate)
}

fn one_row(scale: f64, gain: f64, offset: f64) -> (Mat2, Vec2) {
    (
        Mat2::new(scale * gain, 0.0, 0.0, 0.0),
        Vec2::new(scale * offset, 0.0),
    )
}
