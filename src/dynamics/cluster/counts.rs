//! How often a cluster is stopped in a step, and when that is often enough.

use crate::contact::NO_BODY;

/// Most bodies of a cluster of which all impacts are located for a swept body that rebounds, or for its
/// [`late_rebounds`](crate::dynamics::late_rebounds) or [`deep_impacts`](crate::dynamics::deep_impacts). The impacts,
/// and the work of each, grow with the bodies; larger ones are stepped in [`PARTS`](super::context::PARTS).
/// The break of a rack of fifteen balls is to be one of these: without it balls passed through each other.
/// A crowd of more bodies is large, see [`find_plain`](crate::dynamics::events::find_plain).
pub(in crate::dynamics) const LATE: usize = 32;

/// Most intervals that are solved in a step without events in search of the impacts of clusters of more than
/// [`LATE`] bodies with something too fast for parts, a bullet shot into a heap for instance: of all of them, and also
/// before they meet other bodies and are stepped from the start again. The plain rule then steps the rest: a second thin body that the swept one hits in
/// the step may be passed, which the summary tells. A solve of 500 bodies takes some 0.2 s; with eight a step took up
/// to 2.4 s, and bullets shot into heaps were stopped as often.
pub(super) const SOLVES: usize = 4;

/// So many bodies that hit each other are few, see [`MANY`].
const FEW: usize = 8;

/// Most rebounds of a pair in a cluster in a step; then the plain rule steps the rest. A cluster of several
/// pairs may have as many for each, up to [`LANDINGS`].
const EVENTS: usize = 4;
/// Most impacts without rebound. After one of them the contact stays closed, so that they come to an
/// end by themselves; the plain rule would leave an overlap where one closes in the first half of
/// what is left of the step.
const LANDINGS: usize = 16;
/// The same for two bodies that touch nothing else, whose events cost one small solve each, and for
/// further impacts of the pair that hit last. A body that chatters between two corners hits ever
/// faster, until both touch and the impact is that of both: after 20 where an interval is 0.4 of the
/// one before.
const CHATTER: usize = 64;
/// The same where up to [`FEW`] bodies hit each other, in a cluster of up to [`CHEAP`] bodies: a light body between
/// two heavy ones hits them hundreds of times before it gets away, or before all of them move as one.
const MANY: usize = 1024;
const CHEAP: usize = 4 * FEW;
/// So many last impacts within this share of a step, all of them slower than this share of the fastest one, look
/// endless. What bodies lose that stick together then is about the square of that share of the energy.
const LAST: usize = 8;
const SHORT: f64 = 1.0 / 32.0;
const SLOW: f64 = 1e-2;
/// Most ends of slides of a cluster in a step.
const STOPS: usize = 8;
/// Most parts of curved paths of a cluster in a step.
const TURNS: usize = 16;

/// What has happened to a cluster in a step.
pub(super) struct Counts {
    pub stops: usize,
    pub turns: usize,
    rebounds: usize,
    landings: usize,
    again: usize,
    /// Most rebounds.
    limit: usize,
    /// The bodies that have hit.
    hit: Vec<u32>,
    /// The surfaces that hit last.
    last: Option<[u32; 2]>,
    /// Times \[s\] and approach speeds \[m/s\] of the impacts, the oldest first.
    impacts: Vec<[f64; 2]>,
}

impl Counts {
    pub fn new() -> Counts {
        Counts {
            stops: 0,
            turns: 0,
            rebounds: 0,
            landings: 0,
            again: 0,
            limit: CHATTER,
            hit: Vec::new(),
            last: None,
            impacts: Vec::new(),
        }
    }

    /// Begins to count impacts anew.
    pub fn forget_impacts(&mut self) {
        let (stops, turns) = (self.stops, self.turns);
        let hit = std::mem::take(&mut self.hit);
        *self = Counts {
            stops,
            turns,
            hit,
            ..Counts::new()
        };
    }

    /// Whether a slide may end an interval.
    pub fn may_stop(&self) -> bool {
        self.stops < STOPS
    }

    /// Whether an interval may be cut.
    pub fn may_turn(&self) -> bool {
        self.turns < TURNS
    }

    /// Whether the last impacts followed each other so fast, and were so slow, that they look endless, in a step of
    /// `dt` \[s\].
    pub fn chatter(&self, dt: f64) -> bool {
        let speeds = |from: usize| {
            self.impacts[from..]
                .iter()
                .map(|i| i[1])
                .fold(0.0, f64::max)
        };
        self.impacts.len().checked_sub(LAST).is_some_and(|k| {
            let taken = self.impacts[k + LAST - 1][0] - self.impacts[k][0];
            taken < SHORT * dt && speeds(k) < SLOW * speeds(0)
        })
    }

    /// Whether few bodies hit each other, of so many of a cluster.
    pub fn are_few(&self, bodies: usize) -> bool {
        self.hit.len() <= FEW && bodies <= CHEAP
    }

    /// Counts an impact of these `surfaces` and bodies in a cluster of so many `bodies`; `lone` if two of them touch
    /// nothing else. It came at a `time` \[s\] and `speed` \[m/s\] in a step of `dt` \[s\]. Returns whether it was one
    /// too many.
    pub fn impact(
        &mut self,
        (surfaces, pair): ([u32; 2], [u32; 2]),
        bodies: usize,
        [lone, rebounds]: [bool; 2],
        [time, speed, dt]: [f64; 3],
    ) -> bool {
        self.impacts.push([time, speed]);
        for body in pair {
            if body != NO_BODY && !self.hit.contains(&body) {
                self.hit.push(body);
            }
        }
        let few = self.are_few(bodies);
        if !lone {
            self.limit = match few {
                true => LANDINGS,
                false => (EVENTS * bodies / 2).clamp(EVENTS, LANDINGS),
            };
        }
        match rebounds {
            _ if self.last == Some(surfaces) => self.again += 1,
            true => self.rebounds += 1,
            false => self.landings += 1,
        }
        self.last = Some(surfaces);
        let many = match few {
            true => self.rebounds >= MANY || self.rebounds >= self.limit && self.chatter(dt),
            false => self.rebounds >= self.limit,
        };
        many || self.landings >= LANDINGS.max(self.limit) || self.again >= CHATTER
    }
}
