//! Chooses the face of parts that touch corner to corner, by what their bodies touch beside them.
//!
//! Parts at rest, `|g| ≤ noise`, and a body that comes down on one that cannot move: the contact takes the
//! direction of another contact of one of the two bodies in the same plane, if the two parts are apart
//! along it at the start of the step. They then slide on one surface that consists of several parts. Parts
//! that move along each other, see [`super::seams`].

use super::super::kernels::{Axis, Touch, with_axes};
use super::couple::Couple;
use super::pairs::Finder;
use super::points::Pair;
use super::seams::AHEAD;
use crate::contact::NO_BODY;
use crate::dynamics::ContactPoint;

/// A contact at a corner that could as well be met along other directions.
pub(super) struct Tie {
    /// Its index among all contacts.
    pub contact: usize,
    /// Whether it is stored twice, as two contacts at the same point.
    twice: bool,
    setting: Pair,
    sides: [u32; 2],
    /// The same contact along the other directions, and a second one where the parts lie flat.
    others: Vec<(Touch, Option<Touch>)>,
    noise: f64,
    /// Whether a body comes down on one that cannot move.
    lands: bool,
}

impl Finder<'_> {
    /// The [`Tie`] of two parts: at rest, if their only contact has the same gap along other directions;
    /// of a body that lands on one that cannot move, if other directions separate the two at the start.
    /// `contact` is its index.
    #[inline]
    pub(super) fn tie(
        &self,
        couple: &Couple,
        setting: &Pair,
        found: &[Touch],
        contact: usize,
    ) -> Option<Tie> {
        if self.alone {
            return None;
        }
        let (sides, bodies) = (couple.sides, couple.bodies);
        let size = sides[0].surface.size;
        let lone = match found {
            [_] => true,
            [a, b] => (a.point - b.point).norm() <= 1e-3 * size,
            _ => false,
        };
        let first = found[0];
        let on_still = bodies.iter().filter(|body| body.immovable).count() == 1;
        if !on_still && (!lone || first.gap.abs() > 1e-3 * size) {
            return None;
        }
        let noise = couple.noise(found);
        let u = bodies[1].velocity_at(first.point) - bodies[0].velocity_at(first.point);
        let lands = u.norm() * self.step > noise;
        let fast = u.norm() * self.step > 0.5 * couple.size();
        let apart = |t: &Touch| t.gap.abs() > noise || (t.point - first.point).norm() > noise;
        let now = couple.poses();
        let at = match lands {
            false if !lone || found.iter().any(apart) => return None,
            false => now,
            true => {
                let way = |t: &Touch| self.step * t.normal.dot(&u);
                let slides = |t: &Touch| t.gap.abs().max(way(t).abs()) <= noise;
                let closes = |t: &Touch| t.gap + AHEAD * way(t) < 0.0;
                if !on_still || fast || found.iter().all(slides) || !found.iter().any(closes) {
                    return None;
                }
                couple.poses_at(-0.5 * self.step)
            }
        };
        let slide = (0.5 + AHEAD) * couple.speed() * self.step;
        let view = (first.normal, Some(&couple.sight));
        let others = with_axes(couple.parts, &now, view, |axes| {
            let other = |axis: Axis| {
                let direction = axes.direction(&now, axis);
                if direction.dot(&first.normal) >= 1.0 - 1e-9 {
                    return None;
                }
                let gap = axes.separation(&at, axes.direction(&at, axis));
                let touches = match lands {
                    true => gap >= -noise,
                    false => gap.abs() <= noise,
                };
                if !touches {
                    return None;
                }
                let touch = axes.touch(&now, axis, noise)?;
                // a face that the body does not get to
                if lands && axes.beyond(&now, axis, touch.point) > slide {
                    return None;
                }
                let second = axes.second(&now, axis, &touch, noise);
                Some((touch, second.filter(|_| lands)))
            };
            axes.open(&now).filter_map(other).collect::<Vec<_>>()
        })?;
        (!others.is_empty()).then_some(Tie {
            contact,
            twice: found.len() > 1,
            setting: *setting,
            sides: couple.leaves,
            others,
            noise,
            lands,
        })
    }

    /// Gives contacts at corners the direction of another contact in the same plane.
    pub(super) fn break_ties(&self, ties: &[Tie], out: &mut [ContactPoint]) {
        if ties.is_empty() {
            return;
        }
        let mut known = Known::new(self.present.len(), ties, out);
        for tie in ties {
            let own = out[tie.contact];
            // it lands on a plane with another contact already
            if tie.lands && self.is_told(tie, &own, &known, out) {
                known.decide(tie);
                continue;
            }
            let parts = tie.sides.map(|leaf| self.leaves.get(leaf));
            let chosen = tie.others.iter().find(|(touch, _)| {
                let wanted = self.point(&tie.setting, parts, touch);
                self.is_told(tie, &wanted, &known, out)
            });
            let Some((touch, second)) = chosen else {
                continue;
            };
            known.decide(tie);
            out[tie.contact] = self.point(&tie.setting, parts, touch);
            if tie.twice {
                let again = Touch {
                    feature: touch.feature ^ 1 << 28,
                    ..*touch
                };
                let second = second.unwrap_or(again);
                out[tie.contact + 1] = self.point(&tie.setting, parts, &second);
            }
        }
    }

    /// Whether another contact of one of the bodies has the direction of `wanted`, in the same plane.
    fn is_told(
        &self,
        tie: &Tie,
        wanted: &ContactPoint,
        known: &Known,
        out: &[ContactPoint],
    ) -> bool {
        let own = out[tie.contact];
        let edges = |c: &ContactPoint| c.places.map(|place| place.edge);
        let bodies = tie.setting.numbers.into_iter().enumerate();
        let moves = |body: u32| body != NO_BODY && !self.present[body as usize].immovable;
        bodies.filter(|(_, body)| moves(*body)).any(|(mine, body)| {
            let mut contacts = known.of_body[body as usize].iter();
            contacts.any(|&k| {
                let c = &out[k as usize];
                let sign = if c.bodies[mine] == body { 1.0 } else { -1.0 };
                let other = c.bodies[usize::from(c.bodies[0] == body)];
                let still = other == NO_BODY || self.present[other as usize].immovable;
                (c.key.pair, edges(c)) != (own.key.pair, edges(&own))
                    && (still || !tie.lands)
                    && sign * c.normal.dot(&wanted.normal) > 1.0 - 1e-9
                    && match tie.lands {
                        true => {
                            (!known.open[k as usize] || (c.gap - wanted.gap).abs() <= tie.noise)
                                && in_one_plane(wanted, c, mine, tie.noise)
                        }
                        false => {
                            let off = c.normal.dot(&(c.position - wanted.position));
                            off.abs().max(c.gap.abs()) <= 2.0 * tie.noise
                        }
                    }
            })
        })
    }
}

/// Whether two contacts of a body, which is side `mine` of the first, are on one plane of bodies that cannot
/// move. Contacts then lie on the body's own surface.
fn in_one_plane(a: &ContactPoint, b: &ContactPoint, mine: usize, noise: f64) -> bool {
    let up = if mine == 1 { a.normal } else { -a.normal };
    let height = |c: &ContactPoint| up.dot(&c.position) - c.gap;
    (height(a) - height(b)).abs() <= 2.0 * noise
}

/// What tells the directions of ties.
struct Known {
    /// The indices of the contacts of each body.
    of_body: Vec<Vec<u32>>,
    /// Contacts of a landing that may still take another direction. They tell nothing of others, unless the
    /// body's own surface goes on there: their gap is the same then. The inner face between two parts of a
    /// body may face the side of a tile far ahead.
    open: Vec<bool>,
}

impl Known {
    fn new(bodies: usize, ties: &[Tie], contacts: &[ContactPoint]) -> Known {
        let mut known = Known {
            of_body: vec![Vec::new(); bodies],
            open: vec![false; contacts.len()],
        };
        for (k, contact) in contacts.iter().enumerate() {
            for body in contact.bodies.iter().filter(|b| **b != NO_BODY) {
                known.of_body[*body as usize].push(k as u32);
            }
        }
        for tie in ties.iter().filter(|tie| tie.lands) {
            known.set_open(tie, true);
        }
        known
    }

    fn set_open(&mut self, tie: &Tie, open: bool) {
        self.open[tie.contact] = open;
        if tie.twice {
            self.open[tie.contact + 1] = open;
        }
    }

    /// The direction of its contact is that of another one.
    fn decide(&mut self, tie: &Tie) {
        self.set_open(tie, false);
    }
}
