//! Collects the blocks of an interval: chooses the rule of every contact and joint.

use super::contact_cache::{CachedContact, CachedContacts, JointEnergy, Left};
use super::events::LOCATED_CROWD;
use super::first_step::{drives, is_driven};
use super::gap_resolution::noise_of;
use super::interval::{
    Block, Collected, Interval, Source, belongs, diagonal, movable, side_velocities,
};
use super::joint_rules::{JointSituation, joint_impact_rule, joint_rule};
use super::model::{ContactKey, ContactPoint, JointKind, JointRow, NormalLaw};
use super::rules::{
    Choice, Rule, Rules, Situation, Span, applied_acceleration, centripetal, impact_rule,
    reference_acceleration, resting_speed, rule,
};
use super::visco_elastic::Springs;
use crate::contact::{NO_BODY, Vec2, Vec3};
use crate::threads::Threads;
use std::ops::Range;

/// Acceleration of a gap by the turning of the rows that counts, as a share of the reference acceleration.
const SINKS: f64 = 0.01;

/// Least penetration of a limit that is closed by position: \[m or rad\], and relative to its arm.
const PASSED: f64 = 1e-9;

/// Least number of contacts for a thread: some 100 µs.
const LEAST: usize = 1000;

/// What the choice of a rule depends on besides the interval.
struct Choices<'a> {
    rules: &'a Rules,
    cache: &'a CachedContacts,
    members: Option<&'a [bool]>,
    inverse_mass: &'a [Vec3],
    span: Span,
    springs: Springs,
}

impl Choices<'_> {
    /// Where to search the cache for contacts from number `start` on. They are in nearly the same order
    /// as the entries, and about as many.
    fn place(&self, start: usize, contacts: &[ContactPoint]) -> usize {
        let entries = self.cache.entries().len();
        let guess = start * entries / contacts.len();
        self.cache.place(&contacts[start].key, guess)
    }
}

impl Interval {
    /// Chooses the rule of every contact and joint among `members` (all bodies if `None`).
    pub fn collect(
        &mut self,
        rules: &Rules,
        cache: &CachedContacts,
        members: Option<&[bool]>,
        inverse_mass: &[Vec3],
        span: Span,
        threads: &Threads,
    ) {
        self.clear_blocks();
        self.driven = drives(&self.start, inverse_mass);
        let contacts = &self.detection.contacts;
        let count = contacts.len();
        let choices = Choices {
            rules,
            cache,
            members,
            inverse_mass,
            span,
            springs: Springs::of(contacts, inverse_mass.len()),
        };
        let ends = threads.split(count, count / LEAST);
        let mut own = Collected::default();
        self.swap_blocks(&mut own);
        // joints are searched for behind the last contact
        let mut next = cache.next();
        if ends.is_empty() {
            self.collect_contacts(&choices, 0..count, &mut next, &mut own);
        } else {
            let mut parts = std::mem::take(&mut self.parts);
            parts.resize_with(parts.len().max(ends.len() - 1), Collected::default);
            let starts = std::iter::once(0).chain(ends.iter().copied());
            let into = std::iter::once(&mut own).chain(&mut parts);
            let jobs = starts.zip(&ends).zip(into).collect();
            let this = &*self;
            let last = threads.map(jobs, |((start, &end), into)| {
                let mut next = match start {
                    0 => next,
                    _ => choices.place(start, &this.detection.contacts),
                };
                this.collect_contacts(&choices, start..end, &mut next, into);
                next
            });
            next = last.last().copied().unwrap_or(next);
            parts.iter_mut().for_each(|part| own.append(part));
            self.parts = parts;
        }
        cache.set_next(next);
        self.collect_joints((rules, cache), members, inverse_mass, span, &mut own);
        self.swap_blocks(&mut own);
    }

    /// Chooses the rules of the contacts from number `from` on, which were found later, and adds their blocks
    /// behind all others.
    pub fn collect_more(
        &mut self,
        rules: &Rules,
        cache: &CachedContacts,
        inverse_mass: &[Vec3],
        span: Span,
        from: usize,
    ) {
        self.later = self.later.or(Some(from));
        let contacts = &self.detection.contacts;
        let choices = Choices {
            rules,
            cache,
            members: None,
            inverse_mass,
            span,
            springs: Springs::of(&contacts[from..], inverse_mass.len()),
        };
        let mut more = Collected::default();
        let mut next = cache.next();
        self.collect_contacts(&choices, from..contacts.len(), &mut next, &mut more);
        more.pairs.retain(|pair| !self.pairs.contains(pair));
        let mut own = Collected::default();
        self.swap_blocks(&mut own);
        own.append(&mut more);
        self.swap_blocks(&mut own);
    }

    /// Chooses the rules of some contacts, and adds the blocks of those that take part to `into`.
    /// `next` is that of [`CachedContacts::find`].
    fn collect_contacts(
        &self,
        choices: &Choices,
        range: Range<usize>,
        next: &mut usize,
        into: &mut Collected,
    ) {
        let &Choices {
            rules,
            cache,
            members,
            inverse_mass,
            span,
            ref springs,
        } = choices;
        for index in range {
            let contact = &self.detection.contacts[index];
            let movable = movable(contact.rows.bodies, inverse_mass);
            let rigid = matches!(contact.law, NormalLaw::Rigid { .. });
            if rigid && movable != [NO_BODY; 2] && into.pairs.last() != Some(&contact.key.pair) {
                into.pairs.push(contact.key.pair);
            }
            let Some(sides) = self.receiving(contact, movable, members) else {
                continue;
            };
            let cached = cache.find(&contact.key, next);
            let mut now = self.situation(rules, contact, cached, inverse_mass, span);
            now.rates = springs.rates(contact, inverse_mass);
            let choice = rule(rules, contact, &now);
            let rebounds = match choice {
                Choice::Inactive => contact.law.restitution() > 0.0,
                Choice::Deferred => false,
                Choice::Active(rule) => rule.impact,
            };
            if rebounds {
                into.rebounding.push(index);
            }
            match choice {
                Choice::Inactive => {}
                Choice::Deferred => into.deferred.push(index),
                Choice::Active(rule) => {
                    let warm = cached.map_or(Vec2::zeros(), |m| m.impulse * (span.length / m.dt));
                    push_contact(into, index, contact, sides, &now, rule, warm);
                }
            }
        }
    }

    /// The data that the rule of a contact depends on; `cached` is the contact's cache entry.
    #[inline]
    fn situation(
        &self,
        rules: &Rules,
        contact: &ContactPoint,
        cached: Option<&CachedContact>,
        inverse_mass: &[Vec3],
        span: Span,
    ) -> Situation {
        let surface = Vec2::new(0.0, contact.surface_velocity);
        let gamma_a = contact.rows.velocity(&self.start) + surface;
        let swept = rules.sweeps
            && (self.roles).swept(contact.rows.bodies, gamma_a, span.step, inverse_mass);
        let located = rules.events || swept && !self.is_plain(contact, inverse_mass);
        // only rebounding and deferred contacts depend on accelerations
        let bounces = contact.law.restitution() > 0.0;
        let (mut applied, mut acceleration) = (0.0, 0.0);
        if located || bounces {
            applied = applied_acceleration(contact, &self.accelerations);
            acceleration = centripetal(contact, &self.start).max(applied);
        }
        let crowd = |b: &u32| self.crowded.get(*b as usize).copied();
        let crowd = contact.rows.bodies.iter().filter_map(crowd).max();
        let crowd = crowd.filter(|_| !swept).unwrap_or(0);
        let mut left = cached.and_then(|m| m.left);
        if let Some(left) = left.as_mut().filter(|l| l.on_surface && self.driven) {
            left.on_surface = !is_driven(contact, &self.start, inverse_mass);
        }
        let slow = resting_speed(contact, applied, span.step);
        let held = left.is_some_and(|l| l.gamma.x.abs() <= slow);
        let noise = noise_of(contact.rows.bodies, &self.noise);
        let quiet = |change: Vec2| change.map(|v| if v.abs() <= noise { 0.0 } else { v });
        let since = |l: Left| 0.5 * span.length + l.ago;
        Situation {
            span,
            gamma_a,
            gamma_f: contact.rows.velocity(&self.free) + surface,
            acceleration,
            applied,
            pressed: held || cached.is_some_and(|m| m.impulse.x > 0.0),
            stuck: cached.is_some_and(|m| m.stuck),
            turning: left.map(|l| quiet(gamma_a - l.gamma) / since(l)),
            sinks: left.is_some_and(|left| {
                !left.on_surface
                    && self.sinks(contact, gamma_a, &left, since(left))
                    && !(self.driven && is_driven(contact, &self.start, inverse_mass))
            }),
            first: self.first && left.is_some_and(|l| l.on_surface),
            ahead: self.ahead.get(&contact.key).copied(),
            left,
            rebounded: cached.is_some_and(|m| m.rebounded),
            located,
            unseen: cached.is_none(),
            few: crowd <= LOCATED_CROWD,
            crowded: crowd > 0,
            sought: self.sought == Some(contact.surfaces),
            rates: [0.0; 2],
        }
    }

    /// Whether a fast contact takes the rule of any other, see [`find_plain`](super::events::find_plain). Not if it
    /// rebounds: that rule would throw the body back early, into others that are not seen.
    fn is_plain(&self, contact: &ContactPoint, inverse_mass: &[Vec3]) -> bool {
        let own = movable(contact.rows.bodies, inverse_mass);
        let mut own = own.iter().filter(|b| **b != NO_BODY);
        contact.law.restitution() == 0.0
            && own.all(|b| self.plain.get(*b as usize).is_some_and(|plain| *plain))
    }

    /// See [`Situation::sinks`].
    fn sinks(&self, contact: &ContactPoint, gamma_a: Vec2, left: &Left, since: f64) -> bool {
        let now = (gamma_a - left.gamma).x / since;
        let before = left.turning.map_or(0.0, |c| c.x);
        let least = || reference_acceleration(contact, &self.start, &self.accelerations);
        let most = now.max(before);
        most < 0.0 && most < -SINKS * least()
    }

    /// Collects the blocks of an instant: joints, and contacts for which `restitution` returns a
    /// coefficient; no forces. A limit takes part if it touches or was `pressed` before.
    pub fn collect_impact(
        &mut self,
        rules: &Rules,
        members: &[bool],
        inverse_mass: &[Vec3],
        restitution: impl Fn(usize) -> Option<f64>,
        pressed: impl Fn(&ContactKey) -> bool,
    ) {
        self.length = 0.0;
        self.free.clone_from(&self.start);
        self.clear_blocks();
        let mut own = Collected::default();
        self.swap_blocks(&mut own);
        let found = std::mem::take(&mut self.detection);
        for (index, contact) in found.contacts.iter().enumerate() {
            let (NormalLaw::Rigid { .. }, Some(in_force)) = (contact.law, restitution(index))
            else {
                continue;
            };
            let movable = movable(contact.rows.bodies, inverse_mass);
            let Some(sides) = self.receiving(contact, movable, Some(members)) else {
                continue;
            };
            let surface = Vec2::new(0.0, contact.surface_velocity);
            let gamma = contact.rows.velocity(&self.start) + surface;
            let Rule { free, law, impact } = impact_rule(rules, contact, gamma, in_force);
            let block = Block {
                source: Source::Contact(index),
                bodies: contact.rows.bodies,
                gamma_a: gamma,
                gamma_f: gamma,
                impact,
                bilateral: false,
                loaded: false,
                pressed_before: false,
                stuck_before: false,
                continues: false,
                on_surface: false,
                sinks: false,
                held: [0.0; 2],
                turning: None,
            };
            own.push(block, sides, gamma + free, law, Vec2::zeros());
        }
        self.clear_energies(found.joints.len());
        for (index, joint) in found.joints.iter().enumerate() {
            if !belongs(joint.rows.bodies, Some(members), inverse_mass)
                || diagonal(joint, inverse_mass) <= 0.0
            {
                continue;
            }
            if let Some((free, law)) = joint_impact_rule(joint, pressed(&joint.key)) {
                let gamma = joint.rows.velocity(&self.start);
                let block = joint_block(index, joint, [gamma; 2]);
                let sides = movable(joint.rows.bodies, inverse_mass);
                own.push(block, sides, gamma + free, law, Vec2::zeros());
            }
        }
        self.detection = found;
        self.swap_blocks(&mut own);
    }

    /// Adds the blocks of the joints that take part to `into`.
    fn collect_joints(
        &mut self,
        (rules, cache): (&Rules, &CachedContacts),
        members: Option<&[bool]>,
        inverse_mass: &[Vec3],
        span: Span,
        into: &mut Collected,
    ) {
        let joints = std::mem::take(&mut self.detection.joints);
        self.clear_energies(joints.len());
        for (index, joint) in joints.iter().enumerate() {
            let diagonal = diagonal(joint, inverse_mass);
            // leave out a row that cannot move anything
            if !belongs(joint.rows.bodies, members, inverse_mass) || diagonal <= 0.0 {
                continue;
            }
            let sides = side_velocities(&joint.rows, &self.start);
            let now = JointSituation {
                span,
                gamma_a: joint.rows.velocity(&self.start),
                gamma_f: joint.rows.velocity(&self.free),
                bend: joint.bend.after(sides, span.horizon),
                diagonal,
            };
            let Some((free, law)) = joint_rule(rules, joint, &now) else {
                continue;
            };
            if let JointKind::Limit { gap } = joint.kind
                && rules.corrects_gaps()
                && gap < -now.bend.norm() - PASSED * (1.0 + joint.bend.reach())
            {
                self.passed_limits.push(index);
            }
            let cached = cache.get(&joint.key);
            let warm = cached.map_or(Vec2::zeros(), |m| m.impulse * (span.length / m.dt));
            self.energies[index] = cached.map_or(JointEnergy::default(), |m| m.energy);
            let block = joint_block(index, joint, [now.gamma_a, now.gamma_f]);
            let sides = movable(joint.rows.bodies, inverse_mass);
            into.push(block, sides, now.gamma_f + free, law, warm);
        }
        self.detection.joints = joints;
    }

    fn clear_energies(&mut self, joints: usize) {
        self.energies.clear();
        self.energies.resize(joints, JointEnergy::default());
    }
}

/// Adds the block of a contact.
#[inline]
fn push_contact(
    into: &mut Collected,
    index: usize,
    contact: &ContactPoint,
    sides: [u32; 2],
    now: &Situation,
    Rule { free, law, impact }: Rule,
    warm: Vec2,
) {
    let loaded = matches!(contact.law, NormalLaw::Load { .. });
    // under a given load only friction is solved: its row comes first
    let rows = |v: Vec2| if loaded { Vec2::new(v.y, 0.0) } else { v };
    let gamma_f = rows(now.gamma_f);
    let block = Block {
        source: Source::Contact(index),
        bodies: contact.rows.bodies,
        gamma_a: rows(now.gamma_a),
        gamma_f,
        impact,
        bilateral: false,
        loaded,
        pressed_before: now.pressed,
        stuck_before: now.stuck,
        continues: now.pressed || now.left.is_some(),
        on_surface: now.left.is_some_and(|left| left.on_surface),
        sinks: now.sinks,
        held: held_depth(now),
        turning: now.turning,
    };
    into.push(block, sides, gamma_f + free, law, rows(warm));
}

/// `h (γ_E,prev − γ_A) / 2` \[m\], the depth at which `b = g/h` is steady on a path that curves towards the other
/// surface, and the largest so far. No more than the turning of the step before makes, and 0 if either step curves
/// away: a body that turns as it lands, or moves on over a corner, is held at no depth. Of a contact that sinks the depth
/// `|c| h²/8` between midpoint and end alone is left.
fn held_depth(now: &Situation) -> [f64; 2] {
    now.left.map_or([0.0; 2], |left| {
        let h = now.span.length;
        let c = |turning: Option<Vec2>| turning.map_or(0.0, |c| c.x);
        let curved = (left.gamma.x - now.gamma_a.x).min(-h * c(left.turning));
        match now.sinks {
            true => [0.125 * h * h * c(now.turning).abs(), 0.0],
            false => [0.5 * h * curved.max(0.0), left.held],
        }
    })
}

fn joint_block(index: usize, joint: &JointRow, [gamma_a, gamma_f]: [Vec2; 2]) -> Block {
    Block {
        source: Source::Joint(index),
        bodies: joint.rows.bodies,
        gamma_a,
        gamma_f,
        impact: false,
        bilateral: matches!(joint.kind, JointKind::Pin { .. } | JointKind::Lock { .. }),
        loaded: false,
        pressed_before: false,
        stuck_before: false,
        continues: false,
        on_surface: false,
        sinks: false,
        held: [0.0; 2],
        turning: None,
    }
}
