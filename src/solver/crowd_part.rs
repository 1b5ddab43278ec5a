use super::crowd_four::{FourRows, pass};
use super::four_sides::{Body, is_alone};
use super::groups::{Groups, NOTHING};
use crate::contact::{BodyOperator, ContactProblem, Law, Mat2, NO_BODY, Rows, Vec2, Vec3};
use fearless_simd::{Level, dispatch};

/// Blocks that are swept together, and their bodies.
#[derive(Debug, Default)]
pub(super) struct Part {
    /// Blocks in the order of a sweep, and the number in the problem of each body: the part's `own`, then
    /// those of other parts.
    pub blocks: Vec<u32>,
    pub numbers: Vec<u32>,
    pub own: usize,
    groups: Groups,
    pub fours: Vec<FourRows>,
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
    pub found: [f64; 2],
    pub turn: f64,
}

impl Part {
    /// Gathers the data of the part's blocks and bodies; `places` has the numbers of the bodies here.
    pub fn gather(&mut self, swept: Swept, start: (&[Vec2], &[Vec3]), places: &[u32]) {
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
                let mut four = FourRows::of(still);
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
    pub fn take(&mut self, at: &Border, part: &Part) {
        self.bodies[at.between as usize] = part.bodies[at.inside as usize];
    }

    pub fn give(&self, at: &Border, part: &mut Part) {
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
    pub fn sweep(&mut self, level: Level, round: Round) {
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
    pub fn write(&self, impulses: &mut [Vec2]) {
        for (four, blocks) in self.fours.iter().zip(self.groups.members()) {
            let blocks = blocks.iter().enumerate();
            for (lane, &block) in blocks.filter(|(_, b)| **b != NOTHING) {
                impulses[block as usize] =
                    Vec2::new(four.impulses[0][lane], four.impulses[1][lane]);
            }
        }
    }
}

/// A body of a part that blocks between the parts move.
#[derive(Debug, Clone, Copy)]
pub(super) struct Border {
    pub part: u32,
    /// Its number in the part, and in what lies between.
    pub inside: u32,
    pub between: u32,
}

/// What all parts do in a round.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Round {
    pub backwards: bool,
    /// β of this sweep, see [`Momentum`](super::momentum::Momentum).
    pub momentum: Option<f64>,
    /// Whether momentum starts here.
    pub starts: bool,
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
