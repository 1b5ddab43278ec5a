use super::four_sides::{Body, FourSides, is_alone, larger, load_pair, solve_alone};
use super::groups::{Groups, NOTHING};
use super::momentum::share;
use super::parts::{BETWEEN, Parts};
use crate::contact::{
    BodyOperator, ContactProblem, Four, Law, Mat2, NO_BODY, Rows, Slip, Vec2, Vec3, load_four,
};
use crate::threads::Threads;
use fearless_simd::{Level, Select, Simd, SimdBase, SimdMask, dispatch, f64x4};
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

/// A body of a part that blocks between the parts move.
#[derive(Debug, Clone, Copy)]
struct Border {
    part: u32,
    /// Its number in the part, and in what lies between.
    inside: u32,
    between: u32,
}

/// What all parts do in a round.
#[derive(Debug, Clone, Copy, Default)]
struct Round {
    backwards: bool,
    /// β of this sweep, see [`Momentum`](super::momentum::Momentum).
    momentum: Option<f64>,
    /// Whether momentum starts here.
    starts: bool,
}

/// The problem of a sweep, with its blocks `G_ii` \[1/kg\].
#[derive(Clone, Copy)]
pub(super) struct Swept<'a> {
    pub problem: &'a ContactProblem,
    pub op: &'a BodyOperator,
    pub diagonal: &'a [Mat2],
}

impl Swept<'_> {
    /// Whether a block must be solved by the general rule.
    fn is_general(&self, i: usize) -> bool {
        let g = &self.diagonal[i];
        let det = g[(0, 0)] * g[(1, 1)] - g[(0, 1)] * g[(0, 1)];
        let regular = det > 1e-14 * g[(0, 0)] * g[(1, 1)];
        !regular || is_alone(self.problem, self.op, i)
    }
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

/// Blocks that are swept together, and their bodies.
#[derive(Debug, Default)]
struct Part {
    /// Blocks in the order of a sweep, and the number in the problem of each body: the part's `own`, then
    /// those of other parts.
    blocks: Vec<u32>,
    numbers: Vec<u32>,
    own: usize,
    groups: Groups,
    fours: Vec<FourRows>,
    /// Rows, `G_ii` [1/kg] and law of the blocks that are solved alone.
    alone: Vec<(Rows, Mat2, Law)>,
    /// All bodies, then one that does not move, for sides without a body.
    bodies: Vec<Body>,
    /// At `P_k` and at `Q_k`, see [`Momentum`](super::momentum::Momentum).
    before: Vec<Body>,
    start: Vec<Body>,
    inverse_mass: Vec<Vec3>,
    /// Change and scale of the last sweep, and of (2) of [`Momentum`](super::momentum::Momentum) the share
    /// of the part's own bodies after the last sweep back.
    found: [f64; 2],
    turn: f64,
}

impl Part {
    /// Gathers the data of the part's blocks and bodies; `places` has the numbers of the bodies here.
    fn gather(&mut self, swept: Swept, start: (&[Vec2], &[Vec3]), places: &[u32]) {
        let Swept {
            problem,
            op,
            diagonal,
        } = swept;
        let (impulses, velocities) = start;
        let sides = |i: usize| {
            (op.rows[i].bodies).map(|body| places.get(body as usize).map_or(NO_BODY, |k| *k))
        };
        self.inverse_mass.clear();
        (self.inverse_mass).extend(self.numbers.iter().map(|&k| op.inverse_mass[k as usize]));
        let blocks = self.blocks.iter().map(|&i| (i as usize, sides(i as usize)));
        let general = |i| swept.is_general(i);
        self.groups
            .arrange_pairs(self.numbers.len(), blocks, general);
        let still = self.numbers.len() as u32;
        let (masses, alone) = (&self.inverse_mass, &mut self.alone);
        alone.clear();
        self.fours.clear();
        self.fours
            .extend(self.groups.members().iter().map(|blocks| {
                let first = blocks[0] as usize;
                let mut four = FourRows {
                    sides: FourSides::of(still),
                    ..FourRows::default()
                };
                if general(first) {
                    four.alone = Some(alone.len() as u32);
                    let rows = Rows {
                        bodies: sides(first),
                        ..op.rows[first]
                    };
                    alone.push((rows, diagonal[first], problem.laws[first]));
                }
                for (lane, &block) in blocks.iter().enumerate().filter(|(_, b)| **b != NOTHING) {
                    let i = block as usize;
                    let rows = Rows {
                        bodies: sides(i),
                        ..op.rows[i]
                    };
                    four.sides.put(lane, &rows, masses);
                    four.set(lane, &diagonal[i], &problem.laws[i]);
                    for (k, to) in four.free.iter_mut().enumerate() {
                        to[lane] = problem.free[i][k];
                    }
                    for (k, to) in four.impulses.iter_mut().enumerate() {
                        to[lane] = impulses[i][k];
                    }
                }
                four.idle = four.alone.is_none() && four.impulses == [[0.0; 4]; 2];
                four
            }));
        self.bodies.clear();
        self.bodies.extend(self.numbers.iter().map(|&k| {
            let (u, m) = (velocities[k as usize], op.inverse_mass[k as usize]);
            [u.x, u.y, u.z, m.x]
        }));
        self.bodies.push([0.0; 4]);
        (self.found, self.turn) = ([0.0; 2], 0.0);
    }

    /// Takes over a body of another part, and gives it back.
    fn take(&mut self, at: &Border, part: &Part) {
        self.bodies[at.between as usize] = part.bodies[at.inside as usize];
    }

    fn give(&self, at: &Border, part: &mut Part) {
        part.bodies[at.inside as usize] = self.bodies[at.between as usize];
    }

    /// A step of momentum for the part's own bodies, as
    /// [`Momentum::step`](super::momentum::Momentum::step); the first starts it.
    fn speed_up(&mut self, factor: f64, starts: bool) {
        let own = self.own;
        if starts {
            self.before.clear();
            self.before.extend_from_slice(&self.bodies[..own]);
        } else {
            for (body, before) in self.bodies.iter_mut().zip(&mut self.before) {
                for (now, before) in body.iter_mut().zip(before).take(3) {
                    let next = *now + factor * (*now - *before);
                    *before = std::mem::replace(now, next);
                }
            }
        }
        self.start.clear();
        self.start.extend_from_slice(&self.bodies[..own]);
    }

    /// The part's share of the sum that tells whether a pair of sweeps turns back.
    fn turns(&self) -> f64 {
        let states = self.start.iter().zip(&self.before);
        let bodies = self.bodies.iter().zip(states).zip(&self.inverse_mass);
        // no share of what cannot move
        let mass = |w: f64| if w > 0.0 { 1.0 / w } else { 0.0 };
        let turn = |((u, (u0, u1)), w): ((&Body, (&Body, &Body)), &Vec3)| -> f64 {
            let along = |k: usize| mass(w[k]) * (u0[k] - u[k]) * (u[k] - u1[k]);
            (0..3).map(along).sum()
        };
        bodies.map(turn).sum()
    }

    /// One sweep, of impulses moved on by the momentum of the round if it has one.
    fn sweep(&mut self, level: Level, round: Round) {
        if let Some(factor) = round.momentum {
            self.speed_up(factor, round.starts);
        }
        let (fours, bodies) = (self.fours.iter_mut(), &mut self.bodies[..]);
        let of = (&self.alone[..], &self.inverse_mass[..]);
        self.found = dispatch!(level, simd => if round.backwards {
            pass(simd, fours.rev(), bodies, of, None)
        } else {
            pass(simd, fours, bodies, of, round.momentum)
        });
        if round.backwards {
            self.turn = self.turns();
        }
    }

    /// Writes the impulses back to their blocks.
    fn write(&self, impulses: &mut [Vec2]) {
        for (four, blocks) in self.fours.iter().zip(self.groups.members()) {
            let blocks = blocks.iter().enumerate();
            for (lane, &block) in blocks.filter(|(_, b)| **b != NOTHING) {
                impulses[block as usize] =
                    Vec2::new(four.impulses[0][lane], four.impulses[1][lane]);
            }
        }
    }
}

/// Four blocks that share no body. Groups with fewer blocks are filled up with open contacts of the
/// body that does not move.
#[derive(Debug, Clone, Default)]
struct FourRows {
    /// Of a group with only its first block, which is not a contact between points: the place of its rows.
    alone: Option<u32>,
    /// Whether all impulses are 0, now and before the last step of momentum.
    idle: bool,
    sides: FourSides,
    free: [Four; 2],
    impulses: [Four; 2],
    before: [Four; 2],
    /// `G_ii`: nn, nt, tt [1/kg].
    block: [Four; 3],
    friction: Four,
    /// tt, nt, nn of `G_ii`, with the compliance, over its determinant \[kg\]; NaN without friction.
    stick: [Four; 3],
    /// `1 / (G_nn + R ± μ G_nt)` \[kg\] for a contact that slips with `P_T = ± μ P_N`; 0 if it cannot.
    slip: [Four; 2],
}

impl FourRows {
    fn set(&mut self, lane: usize, block: &Mat2, law: &Law) {
        let Law::Contact {
            friction,
            compliance,
        } = *law
        else {
            return;
        };
        let [nn, nt, tt] = [block[(0, 0)], block[(0, 1)], block[(1, 1)]];
        for (to, from) in self.block.iter_mut().zip([nn, nt, tt]) {
            to[lane] = from;
        }
        self.friction[lane] = friction;
        let soft = nn + compliance;
        let det = soft * tt - nt * nt;
        let stick = if friction == 0.0 { f64::NAN } else { 1.0 / det };
        for (to, from) in self.stick.iter_mut().zip([tt, nt, soft]) {
            to[lane] = from * stick;
        }
        for (to, side) in self.slip.iter_mut().zip([1.0, -1.0]) {
            let along = soft + side * friction * nt;
            to[lane] = if along > 0.0 { 1.0 / along } else { 0.0 };
        }
    }

    /// Solves a group of one block. Returns change and scale of its velocity \[m/s\].
    fn step_alone(
        &mut self,
        block: (&Rows, &Mat2, &Law),
        inverse_mass: &[Vec3],
        bodies: &mut [Body],
        momentum: Option<f64>,
    ) -> [f64; 2] {
        if let Some(factor) = momentum {
            let impulses = self.impulses.iter_mut().flatten();
            for (now, before) in impulses.zip(self.before.iter_mut().flatten()) {
                let next = *now + factor * (*now - *before);
                *before = std::mem::replace(now, next);
            }
        }
        let [old, free] = [&self.impulses, &self.free].map(|p| Vec2::new(p[0][0], p[1][0]));
        let (new, found) = solve_alone((old, free), block, inverse_mass, bodies);
        (self.impulses[0][0], self.impulses[1][0]) = (new.x, new.y);
        found
    }
}

/// One sweep over the groups in the order given.
#[inline(always)]
fn pass<'a, S: Simd>(
    simd: S,
    fours: impl Iterator<Item = &'a mut FourRows>,
    bodies: &mut [Body],
    (alone, masses): (&[(Rows, Mat2, Law)], &[Vec3]),
    momentum: Option<f64>,
) -> [f64; 2] {
    let mut largest = [f64x4::splat(simd, 0.0); 2];
    let mut apart = [0.0f64; 2];
    for four in fours {
        if let Some(k) = four.alone {
            let (rows, block, law) = &alone[k as usize];
            let block = (rows, block, law);
            let [change, scale] = four.step_alone(block, masses, bodies, momentum);
            apart = [apart[0].max(change), apart[1].max(scale)];
        } else {
            step(simd, four, bodies, momentum, &mut largest);
        }
    }
    let of = |four: f64x4<S>, apart: f64| four.as_slice().iter().copied().fold(apart, f64::max);
    [of(largest[0], apart[0]), of(largest[1], apart[1])]
}

/// Solves four contacts: reads velocities, solves, writes velocities.
#[inline(always)]
fn step<S: Simd>(
    simd: S,
    four: &mut FourRows,
    bodies: &mut [Body],
    momentum: Option<f64>,
    largest: &mut [f64x4<S>; 2],
) {
    let zero = f64x4::splat(simd, 0.0);
    let [u1, u2] = four.sides.velocities(simd, bodies);
    let n = load_pair(simd, &four.sides.normal);
    let [a1, a2] = [&four.sides.arms[0], &four.sides.arms[1]];
    let free_n = load_four(simd, &four.free[0]);
    let normal = n[0] * (u2[0] - u1[0])
        + n[1] * (u2[1] - u1[1])
        + (load_four(simd, &a1[0]) * u1[2] + load_four(simd, &a2[0]) * u2[2])
        + free_n;
    if four.idle && normal.simd_ge(zero).all_true() {
        return;
    }
    let t = [-n[1], n[0]];
    let tangential = t[0] * (u2[0] - u1[0])
        + t[1] * (u2[1] - u1[1])
        + (load_four(simd, &a1[1]) * u1[2] + load_four(simd, &a2[1]) * u2[2])
        + load_four(simd, &four.free[1]);
    let now = load_pair(simd, &four.impulses);
    let mut before = load_pair(simd, &four.before);
    let mut old = now;
    if let Some(factor) = momentum {
        let factor = f64x4::splat(simd, factor);
        old = [
            now[0] + factor * (now[0] - before[0]),
            now[1] + factor * (now[1] - before[1]),
        ];
        before = now;
        before[0].store_slice(&mut four.before[0]);
        before[1].store_slice(&mut four.before[1]);
    }
    let block = load_triple(simd, &four.block);
    let free = [
        normal - (block[0] * old[0] + block[1] * old[1]),
        tangential - (block[1] * old[0] + block[2] * old[1]),
    ];
    let new = solve(simd, four, block, free);
    new[0].store_slice(&mut four.impulses[0]);
    new[1].store_slice(&mut four.impulses[1]);
    let none = new[0].simd_eq(zero) & before[0].simd_eq(zero);
    four.idle = none.all_true() && (new[1].simd_eq(zero) & before[1].simd_eq(zero)).all_true();

    let delta = [new[0] - old[0], new[1] - old[1]];
    let trace = block[0] + block[2];
    largest[1] = larger(larger(new[0].abs(), new[1].abs()) * trace, largest[1]);
    largest[0] = larger(larger(delta[0].abs(), delta[1].abs()) * trace, largest[0]);
    four.sides.push(simd, bodies, [u1, u2], delta);
}

/// [`solve_local`](crate::contact::solve_local) of four contacts with `b_i` in `free`, by the stored
/// inverses.
#[inline(always)]
fn solve<S: Simd>(
    simd: S,
    four: &FourRows,
    [_, nt, tt]: [f64x4<S>; 3],
    [x, y]: [f64x4<S>; 2],
) -> [f64x4<S>; 2] {
    let zero = f64x4::splat(simd, 0.0);
    let friction = load_four(simd, &four.friction);
    let [by_tt, by_nt, by_nn] = load_triple(simd, &four.stick);
    let open = x.simd_ge(zero);
    let stick = [y * by_nt - x * by_tt, x * by_nt - y * by_nn];
    // false without friction, where both are NaN
    let sticks = stick[0].simd_ge(zero) & stick[1].abs().simd_le(friction * stick[0]);
    if (open | sticks).all_true() {
        return [open.select(zero, stick[0]), open.select(zero, stick[1])];
    }
    let rough = !friction.simd_eq(zero);
    let [plus, minus] = load_pair(simd, &four.slip);
    let up = stick[1].simd_gt(zero);
    let one = f64x4::splat(simd, 1.0);
    let side = up.select(one, -one);
    let inverse = up.select(plus, minus);
    let first = slide([x, y], [nt, tt, friction], side, inverse);
    let first_solves = (first.valid & first.violation.simd_le(zero)) | !rough;
    let mut slip = first.impulse;
    if !(open | sticks | first_solves).all_true() {
        let inverse = up.select(minus, plus);
        let second = slide([x, y], [nt, tt, friction], -side, inverse);
        slip = first.or(second, first_solves, zero);
    }
    let slip = [slip[0], rough.select(slip[1], zero)];
    [
        open.select(zero, sticks.select(stick[0], slip[0])),
        open.select(zero, sticks.select(stick[1], slip[1])),
    ]
}

/// The slip of contacts to one side, with the stored inverse of the rows that slip.
#[inline(always)]
fn slide<S: Simd>(
    [x, y]: [f64x4<S>; 2],
    [nt, tt, friction]: [f64x4<S>; 3],
    side: f64x4<S>,
    inverse: f64x4<S>,
) -> Slip<S> {
    let share = side * friction;
    let normal = -x * inverse;
    Slip {
        impulse: [normal, share * normal],
        valid: inverse.simd_gt(f64x4::splat(x.simd, 0.0)),
        violation: side * (y + (nt + share * tt) * normal),
    }
}

#[inline(always)]
fn load_triple<S: Simd>(simd: S, [a, b, c]: &[Four; 3]) -> [f64x4<S>; 3] {
    [load_four(simd, a), load_four(simd, b), load_four(simd, c)]
}
