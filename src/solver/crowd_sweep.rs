use super::crowd_part::{Border, Part, Round, Swept};
use super::groups::NOTHING;
use super::momentum::share;
use super::parts::{BETWEEN, Parts};
use crate::contact::{Law, NO_BODY, Vec2, Vec3};
use crate::threads::Threads;
use fearless_simd::Level;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Gauss-Seidel sweeps with momentum over four contacts at a time, for [`Crowd`](super::crowd::Crowd).
///
/// As [`FourSweep`](super::four_sweep::FourSweep), but made for many sweeps over a heap of which half of
/// the contacts stay open. Its results differ in the order of the blocks and in the last bits:
///
/// - Contacts that are probably open may come first, in groups of their own. A group of open contacts is
///   left after a look at its normal velocities.
/// - The inverses of the local systems are stored: a sweep does not divide.
/// - Momentum moves the impulses of a group on when it is visited, not in a pass of its own.
/// - The blocks of a large problem lie in [`Parts`], which threads sweep at the same time, and between
///   them. A sweep forward takes the parts and then what lies between, a sweep back the reverse.
#[derive(Debug, Default)]
pub(super) struct CrowdSweep {
    split: Parts,
    parts: Vec<Mutex<Part>>,
    between: Part,
    /// For each body its number in its part, and that in what lies between.
    places: Vec<u32>,
    places_between: Vec<u32>,
    /// Bodies of parts that blocks between the parts move.
    borders: Vec<Border>,
    /// `max_i |b_i|` \[m/s\].
    free: f64,
}

impl CrowdSweep {
    /// Arranges the blocks of a problem and gathers their data. Returns `false` if few blocks can be
    /// solved at the same time, as in a tower.
    ///
    /// # Arguments
    /// - `start`: impulses, and velocities `M⁻¹ Jᵀ P` of the bodies at them.
    /// - `open_first`: whether contacts that are probably open come before all others.
    pub fn begin(
        &mut self,
        swept: Swept,
        start: (&[Vec2], &[Vec3]),
        open_first: bool,
        threads: &Threads,
    ) -> bool {
        let Swept { problem, op, .. } = swept;
        self.split.split(op);
        self.parts.resize_with(self.split.count(), Mutex::default);
        self.share_bodies(op.inverse_mass.len());
        self.share_blocks(swept, start.0, open_first);
        let CrowdSweep {
            parts,
            between,
            places,
            places_between,
            ..
        } = self;
        let gathers = |part: &mut Part| {
            part.gather(swept, start, places);
            part.fours.len()
        };
        let all: Vec<&mut Part> = parts.iter_mut().map(inside).collect();
        let mut groups: usize = threads.map(all, gathers).into_iter().sum();
        between.gather(swept, start, places_between);
        groups += between.fours.len();
        self.free = problem.free.iter().map(|b| b.amax()).fold(0.0, f64::max);
        2 * groups <= problem.len()
    }

    /// Number of parts of the problem.
    #[cfg(test)]
    pub fn parts(&self) -> usize {
        self.parts.len()
    }

    /// Number of bodies of no part.
    #[cfg(test)]
    pub fn of_no_part(&self) -> usize {
        self.between.own
    }

    /// Numbers the bodies of each part.
    fn share_bodies(&mut self, bodies: usize) {
        let mut parts: Vec<&mut Part> = self.parts.iter_mut().map(inside).collect();
        for part in parts
            .iter_mut()
            .map(|p| &mut **p)
            .chain([&mut self.between])
        {
            part.numbers.clear();
            part.blocks.clear();
            part.own = 0;
        }
        self.borders.clear();
        self.places.clear();
        self.places_between.clear();
        self.places_between.resize(bodies, NOTHING);
        for body in 0..bodies as u32 {
            let (part, place) = match self.split.of(body) {
                BETWEEN => (&mut self.between, &mut self.places_between[body as usize]),
                part => {
                    self.places.push(NOTHING);
                    (&mut *parts[part as usize], &mut self.places[body as usize])
                }
            };
            *place = part.numbers.len() as u32;
            part.numbers.push(body);
            part.own = part.numbers.len();
            self.places.resize(body as usize + 1, NOTHING);
        }
    }

    /// Gives each part its blocks, and finds the bodies that those between them move.
    fn share_blocks(&mut self, swept: Swept, impulses: &[Vec2], open_first: bool) {
        let Swept { problem, op, .. } = swept;
        let mut parts: Vec<&mut Part> = self.parts.iter_mut().map(inside).collect();
        let between = &mut self.between;
        let mut share = |i: usize| {
            let bodies = op.rows[i].bodies;
            let part = self.split.of_block(bodies);
            if part != BETWEEN {
                parts[part as usize].blocks.push(i as u32);
                return;
            }
            between.blocks.push(i as u32);
            for body in bodies.into_iter().filter(|b| *b != NO_BODY) {
                let place = &mut self.places_between[body as usize];
                if *place == NOTHING {
                    *place = between.numbers.len() as u32;
                    between.numbers.push(body);
                    self.borders.push(Border {
                        part: self.split.of(body),
                        inside: self.places[body as usize],
                        between: *place,
                    });
                }
            }
        };
        let pushes = |i: &usize| {
            let contact = matches!(problem.laws[*i], Law::Contact { .. });
            !contact || problem.free[*i].x < 0.0 || impulses[*i] != Vec2::zeros()
        };
        let all = 0..problem.len();
        if open_first {
            all.clone().filter(|i| !pushes(i)).for_each(&mut share);
            all.filter(pushes).for_each(share);
        } else {
            all.for_each(share);
        }
    }

    /// Up to `most` sweeps, an even number, forward and back in turn, with momentum up to the last `plain`.
    /// After each two, `enough` gets the largest change of a local velocity, the largest velocity to
    /// compare it with \[m/s\], and a function that writes the impulses; it returns whether to stop.
    pub fn run(
        &mut self,
        threads: &Threads,
        (most, plain): (usize, usize),
        mut enough: impl FnMut([f64; 2], &dyn Fn(&mut [Vec2])) -> bool,
    ) -> usize {
        let (level, round) = (Level::new(), Mutex::new(Round::default()));
        let (parts, borders, between) = (&self.parts, &self.borders, &mut self.between);
        let work = |k: usize| {
            let round = *lock(&round);
            lock(&parts[k]).sweep(level, round);
        };
        threads.rounds(parts.len(), work, |next| {
            let (mut count, mut turns) = (0, true);
            for pair in 0..most.div_ceil(2) {
                let starts = pair == 0;
                count = if turns { 0 } else { count + 1 };
                let factor = if starts { 0.0 } else { share(count) };
                let forward = Round {
                    backwards: false,
                    momentum: (2 * pair + plain < most).then_some(factor),
                    starts,
                };
                let back = Round {
                    backwards: true,
                    ..Round::default()
                };
                *lock(&round) = forward;
                next();
                if !between.blocks.is_empty() {
                    let mut parts: Vec<_> = parts.iter().map(lock).collect();
                    borders
                        .iter()
                        .for_each(|at| between.take(at, &parts[at.part as usize]));
                    between.sweep(level, forward);
                    between.sweep(level, back);
                    borders
                        .iter()
                        .for_each(|at| between.give(at, &mut parts[at.part as usize]));
                }
                *lock(&round) = back;
                next();
                let (mut found, mut turn) = ([0.0, self.free], 0.0);
                for part in parts {
                    let part = lock(part);
                    turn += part.turn;
                    found = [found[0].max(part.found[0]), found[1].max(part.found[1])];
                }
                turn += between.turn;
                found = [
                    found[0].max(between.found[0]),
                    found[1].max(between.found[1]),
                ];
                turns = turn > 0.0;
                let write = |impulses: &mut [Vec2]| {
                    parts.iter().for_each(|part| lock(part).write(impulses));
                    between.write(impulses);
                };
                if enough(found, &write) {
                    return 2 * (pair + 1);
                }
            }
            most
        })
    }
}

fn inside(part: &mut Mutex<Part>) -> &mut Part {
    part.get_mut().unwrap_or_else(PoisonError::into_inner)
}

fn lock<T>(part: &Mutex<T>) -> MutexGuard<'_, T> {
    part.lock().unwrap_or_else(PoisonError::into_inner)
}
