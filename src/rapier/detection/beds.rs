//! Contacts at the faces between parts of several bodies, of which some may move.
//!
//! What comes down on two bricks that lie side by side may be deep in both at the midpoint of a step, nearer to
//! the face between them than to their tops. It cannot touch that face: the other brick is in front of it. Pairs
//! of parts that move are looked at once more when all contacts are known, with what the parts beside them leave
//! exposed of the two (see `kernels/exposed.rs`). Parts with a narrow gap between parallel faces cover each other
//! as well, as if the gap were filled. What is flush for good, see [`super::covers`].

use super::super::joints::OUTSIDE;
use super::super::kernels::{Beyond, Core, Exposed, Part, Polygon, Touch, touches};
use super::colliders::Known;
use super::couple::Couple;
use super::covers::{MOST, ROUNDING, SHARE, bounds, flush};
use super::grid::Grid;
use super::leaves::Leaf;
use super::narrow::are_boxes_apart;
use super::output::Group;
use super::pairs::Finder;
use super::present;
use super::rows::{Row, Rows};
use super::scratch::{Scratch, Suspect};
use super::seams::{AHEAD, FLUSH};
use crate::contact::Vec2;
use crate::dynamics::{ContactPoint, Detection};
use crate::rapier::parry::bounding_volume::Aabb;
use std::ops::Range;

/// Pairs of sharp polygons that lie face to face and hardly move against each other, sorted, in both orders.
struct Beds(Vec<[u32; 2]>);

impl Beds {
    /// The polygons that lie beside one.
    fn beside(&self, leaf: u32) -> impl Iterator<Item = u32> + Clone {
        let start = self.0.partition_point(|pair| pair[0] < leaf);
        let own = self.0[start..]
            .iter()
            .take_while(move |pair| pair[0] == leaf);
        own.map(|pair| pair[1])
    }
}

/// A polygon near a suspect, in the frame of the world.
struct Placed<'a> {
    leaf: &'a Leaf,
    polygon: Polygon,
    bounds: Aabb,
}

impl<'a> Placed<'a> {
    fn of(leaf: &'a Leaf) -> Option<Placed<'a>> {
        let polygon = leaf.part.sharp_polygon(&leaf.pose)?;
        Some(Placed {
            leaf,
            bounds: bounds(&polygon.points),
            polygon,
        })
    }
}

impl Finder<'_> {
    /// Two moving parts that are to be looked at once more.
    #[inline]
    pub(super) fn suspect(
        &self,
        couple: &Couple,
        found: &[Touch],
        contacts: Range<usize>,
    ) -> Option<Suspect> {
        let way = AHEAD * self.step * couple.closing();
        let meet = !contacts.is_empty() && found.iter().any(|touch| touch.gap <= way);
        let sharp = || couple.parts.iter().any(|part| part.is_sharp_polygon());
        (meet && sharp()).then_some(Suspect {
            leaves: couple.leaves,
            contacts,
        })
    }

    /// Replaces the contacts of suspects at faces that other parts cover.
    ///
    /// Within a step there are few suspects: what lies near them is asked from the `grid`, if there is one, and
    /// else looked for among all pairs of parts.
    pub(super) fn look_at_seams(
        &self,
        (rows, grid): (&Rows, Option<&Grid>),
        scratch: &mut Scratch,
        out: &mut Detection,
    ) {
        // what a hook lets through one part can touch what this covers
        if scratch.suspects.is_empty() || self.colliders.any_hooks() {
            return;
        }
        let suspects = std::mem::take(&mut scratch.suspects);
        let beds = self.beds((rows, grid.filter(|_| self.within)), &suspects);
        // from the last one on: the numbers of those before stay
        for Suspect { leaves, contacts } in suspects.iter().rev() {
            let found = &out.contacts[contacts.clone()];
            let covered = [0, 1].map(|i| self.covered_to(*leaves, i, found, (&beds, grid)));
            if covered.iter().all(Option::is_none) || !self.were_apart(*leaves, scratch) {
                continue;
            }
            let finder = Finder {
                covered: [0, 1].map(|i| covered[i].as_ref()),
                ..*self
            };
            let mut ties = std::mem::take(&mut scratch.ties);
            let mut own = Detection::default();
            finder.contacts(*leaves, &mut Group::default(), scratch, &mut own);
            let found = &out.contacts[contacts.clone()];
            let known = |new: &ContactPoint| found.iter().any(|old| is_same(old, new));
            if own.contacts.len() == found.len() && own.contacts.iter().all(known) {
                // they keep the numbers of their corners and faces
                scratch.ties = ties;
                continue;
            }
            ties.retain(|tie| !contacts.contains(&tie.contact));
            for tie in ties.iter_mut().filter(|tie| tie.contact >= contacts.end) {
                tie.contact = tie.contact - contacts.len() + own.contacts.len();
            }
            ties.extend(scratch.ties.drain(..).map(|mut tie| {
                tie.contact += contacts.start;
                tie
            }));
            scratch.ties = ties;
            out.contacts.splice(contacts.clone(), own.contacts);
        }
        scratch.ties.sort_by_key(|tie| tie.contact);
        scratch.suspects = suspects;
        scratch.suspects.clear();
    }

    /// Whether two parts did not overlap half a step ago. Where they did, their contacts stay as they are.
    fn were_apart(&self, leaves: [u32; 2], scratch: &mut Scratch) -> bool {
        let sides = leaves.map(|leaf| self.leaves.get(leaf));
        let bodies = sides.map(|leaf| self.present(leaf));
        let couple = Couple::new(self, leaves, sides, bodies, &scratch.faces);
        let start = couple.poses_at(-0.5 * self.step);
        let found = &mut scratch.touches;
        found.clear();
        touches(
            [&start[0], &start[1]],
            couple.parts,
            &couple.sight,
            0.0,
            found,
        );
        let thin = width(couple.parts[0]).min(width(couple.parts[1]));
        let least = -FLUSH * thin - couple.noise(found);
        found.iter().all(|touch| touch.gap >= least)
    }

    /// The beds that suspects may belong to.
    fn beds(&self, (rows, grid): (&Rows, Option<&Grid>), suspects: &[Suspect]) -> Beds {
        let all = || suspects.iter().flat_map(|suspect| suspect.leaves);
        let mut pairs = Vec::new();
        let mut add = |[a, b]: [u32; 2]| {
            if self.lie_beside([a, b]) {
                pairs.extend([[a, b], [b, a]]);
            }
        };
        match grid {
            Some(grid) => all().for_each(|leaf| grid.near_leaf(leaf, |other| add([leaf, other]))),
            None => {
                let mut asked = vec![false; self.leaves.list.len()];
                all().for_each(|leaf| asked[leaf as usize] = true);
                let asks = |row: &&Row| row.leaves.iter().any(|leaf| asked[*leaf as usize]);
                rows.iter().filter(asks).for_each(|row| add(row.leaves));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        Beds(pairs)
    }

    /// Whether two parts are sharp polygons that lie face to face and hardly move against each other: one that slides
    /// along another is soon elsewhere.
    fn lie_beside(&self, leaves: [u32; 2]) -> bool {
        let names = leaves.map(|leaf| &self.leaves.names[leaf as usize]);
        if names[0].body == names[1].body && names[0].body != OUTSIDE {
            return false;
        }
        let [one, two] = names.map(|name| present(self.present, name.body));
        let way = one.closing(two) * self.step;
        if way > FLUSH * one.radius.max(two.radius) && !(one.immovable && two.immovable) {
            return false;
        }
        let [a, b] = leaves.map(|leaf| self.leaves.get(leaf));
        let [flush, reach] = self.widths([a, b]);
        // of a rotated part the corners are off by more
        let widths = [4.0 * flush, reach];
        way <= reach && a.part.is_beside(&a.pose, &b.part, &b.pose, widths, None)
    }

    /// What parts are off at most that lie flush, and the widest gap between those that count as one surface \[m\].
    fn widths(&self, all: [&Leaf; 2]) -> [f64; 2] {
        let size = all[0].surface.size.min(all[1].surface.size);
        let far = all.map(|leaf| leaf.pose.translation.amax());
        let flush = (SHARE * size).max(ROUNDING * far[0].max(far[1]));
        let thin = width(&all[0].part).min(width(&all[1].part));
        [flush, (FLUSH * thin).max(flush)]
    }

    /// The polygons beside one that lie near a visitor or at its corners; of many, as on a floor, those near the
    /// visitor.
    fn beside_near(&self, [leaf, visitor]: [u32; 2], beds: &Beds, grid: Option<&Grid>) -> Vec<u32> {
        let circle = |leaf: u32| &self.leaves.near[leaf as usize];
        let near = |other: &u32| {
            let sides = [*other, visitor].map(|leaf| self.leaves.get(leaf));
            let sizes = sides.map(|leaf| leaf.surface.size);
            let reach = self.span.reach(sides.map(|leaf| self.present(leaf)), sizes);
            *other != visitor && !are_boxes_apart(sides, reach)
        };
        let all = beds.beside(leaf);
        let many = all.clone().nth(MANY).is_some();
        let mut found = Vec::new();
        match grid.filter(|_| many) {
            Some(grid) => grid.near_leaf(visitor, |other| {
                let known = beds.0.binary_search(&[leaf, other]).is_ok();
                found.extend((known && near(&other)).then_some(other));
            }),
            None if many => found.extend(all.filter(near)),
            None => {
                let Leaf { part, pose, .. } = self.leaves.get(leaf);
                let corners = part.sharp_polygon(pose).map(|polygon| polygon.points);
                let holds = |other: u32| {
                    let mut corners = corners.iter().flatten();
                    corners.any(|corner| circle(other).holds(*corner))
                };
                found.extend(all.filter(|k| near(k) || *k != visitor && holds(*k)));
            }
        }
        found.sort_unstable();
        found
    }

    /// One of two parts with what others leave exposed of it to the other one; `None` if the contacts that were
    /// `found` are all at what is.
    #[inline]
    fn covered_to(
        &self,
        leaves: [u32; 2],
        side: usize,
        found: &[ContactPoint],
        (beds, grid): (&Beds, Option<&Grid>),
    ) -> Option<Part> {
        let (leaf, visitor) = (leaves[side], leaves[1 - side]);
        beds.beside(leaf).next()?;
        // a neighbour stays where it is
        if beds.0.binary_search(&[leaf, visitor]).is_ok() {
            return None;
        }
        let beside = self.beside_near([leaf, visitor], beds, grid);
        let own = self.leaves.get(leaf);
        let outward = if side == 0 { 1.0 } else { -1.0 };
        let free = |c: &ContactPoint| {
            let way = own.pose.unrotate(outward * c.normal);
            let covers = |other: &u32| {
                let other = self.leaves.get(*other);
                let [flush, reach] = self.widths([own, other]);
                let widths = [4.0 * flush, reach];
                own.part
                    .is_beside(&own.pose, &other.part, &other.pose, widths, Some(way))
            };
            own.part.has_face(way) && !beside.iter().any(covers)
        };
        if beside.is_empty() || found.iter().all(free) {
            return None;
        }
        // what slides flush along a face is not stopped by it
        let guest = self.leaves.get(visitor);
        let [flush, _] = self.widths([own, guest]);
        let slides = |c: &ContactPoint| {
            let [one, two] = [own, guest].map(|leaf| self.present(leaf).velocity_at(c.position));
            let way = self.step * c.normal.dot(&(two - one));
            c.gap.abs().max(way.abs()) <= flush
        };
        self.left_by([leaf, visitor], &beside, beds, |exposed, polygon| {
            let leaves = |c: &ContactPoint| exposed.leaves(polygon, c.position, outward * c.normal);
            !found.iter().all(|c| slides(c) || leaves(c))
        })
    }

    /// What those `beside` it leave exposed of a sharp polygon to a visitor; `None` if that is all, or not `wanted`.
    #[inline(never)]
    fn left_by(
        &self,
        [leaf, visitor]: [u32; 2],
        beside: &[u32],
        beds: &Beds,
        wanted: impl FnOnce(&Exposed, &Polygon) -> bool,
    ) -> Option<Part> {
        let (own, guest) = (self.leaves.get(leaf), self.leaves.get(visitor));
        let known = self.colliders.get(own.slot);
        let known = known.filter(|known| known.covers())?;
        let placed = |number: u32| {
            let other = self.leaves.get(number);
            let alike = |it: &Known| it.is_like(known) && it.covers();
            let covers =
                !self.is_apart([guest, other]) && self.colliders.get(other.slot).is_some_and(alike);
            Placed::of(other).filter(|_| covers)
        };
        let first = Placed::of(own)?;
        let thin = FLUSH * width(&guest.part);
        // the second one, grown up to the first; a thin visitor may be in a narrow gap
        let meets = |one: &Placed, other: &Placed| {
            let flush = flush([&one.bounds, &other.bounds]);
            let [_, reach] = self.widths([one.leaf, other.leaf]);
            let widths = [flush, reach.min(thin).max(flush)];
            let grown = other.polygon.beside(&one.polygon, widths)?;
            Some((grown, flush))
        };
        let next = beside
            .iter()
            .filter_map(|other| meets(&first, &placed(*other)?));
        let next: Vec<(Polygon, f64)> = next.collect();
        if next.is_empty() {
            return None;
        }
        let list: Vec<(&Polygon, f64)> = next.iter().map(|(own, flush)| (own, *flush)).collect();
        // as far as the visitor may reach
        let most = 2.0 * self.present(guest).radius;
        let run = |corner: Vec2, beyond: Beyond| {
            let (mut at, mut far) = (leaf, 0.0);
            for _ in 0..MOST {
                let one = placed(at);
                let others = beds.beside(at).filter(|other| *other != visitor);
                let further = others.filter_map(|other| {
                    let (polygon, flush) = meets(one.as_ref()?, &placed(other)?)?;
                    let reach = beyond.reach(&polygon, corner + far * beyond.way, flush)?;
                    Some((reach, other))
                });
                match further.max_by(|a, b| a.0.total_cmp(&b.0)) {
                    Some((way, other)) if far + way < most => (at, far) = (other, far + way),
                    Some(_) => return f64::INFINITY,
                    None => return far,
                }
            }
            f64::INFINITY
        };
        let wanted = |exposed: &Exposed| wanted(exposed, &first.polygon);
        own.part
            .covered((&own.pose, &first.polygon), &list, run, wanted)
    }
}

/// Least width of a part \[m\]; 0 of a segment, and where it is not known.
fn width(part: &Part) -> f64 {
    let core = match &part.core {
        Core::Ball(radius) => 2.0 * radius,
        Core::Box(half) => 2.0 * half.min(),
        Core::Polygon(polygon) => polygon.thickness,
        Core::HalfPlane(_) => f64::INFINITY,
        Core::Edge(_) | Core::Other(_) => 0.0,
    };
    core + 2.0 * part.rounding
}

/// Number of parts beside one from which on they are looked for near the visitor.
const MANY: usize = 16;

/// Whether two contacts of a pair are the same but for the numbers of corners and faces.
fn is_same(one: &ContactPoint, two: &ContactPoint) -> bool {
    one.normal.dot(&two.normal) > 1.0 - 1e-12 && (one.position - two.position).norm() < 1e-9
}
