//! Discs without friction in a box, against their exact motion from impact to impact.

use crate::common::series::Series;
use crate::common::{parse, run};

/// Equal discs of several masses in a square box with a corner at the origin, without gravity.
struct Discs {
    side: f64,
    restitution: f64,
    radius: f64,
    masses: Vec<f64>,
    places: Vec<[f64; 2]>,
    velocities: Vec<[f64; 2]>,
}

const TIME: f64 = 0.1;

/// What an impact is with.
#[derive(Clone, Copy)]
enum Partner {
    /// A wall across this axis.
    Wall(usize),
    Disc(usize),
}

impl Discs {
    fn empty(side: f64, series: &mut Series) -> Discs {
        Discs {
            side,
            restitution: [0.3, 0.5, 0.8, 0.9][series.within(0.0, 4.0) as usize],
            radius: [0.02, 0.05][series.within(0.0, 2.0) as usize],
            masses: Vec::new(),
            places: Vec::new(),
            velocities: Vec::new(),
        }
    }

    fn add(&mut self, place: [f64; 2], velocity: [f64; 2], series: &mut Series) {
        self.masses.push(10f64.powf(series.within(-1.0, 1.0)));
        self.places.push(place);
        self.velocities.push(velocity);
    }

    /// Two to four discs in a row, all of which move towards the right wall.
    fn row(series: &mut Series) -> Discs {
        let mut discs = Discs::empty(10.0, series);
        let (count, scale) = (series.within(2.0, 5.0) as usize, series.within(1.0, 40.0));
        let (mut x, mut speed) = (discs.side - discs.radius, 0.0);
        for k in 0..count {
            x -= series.within(0.0, 0.06) * (0.1 * scale + 0.2) + 1e-4;
            speed = match k {
                0 => scale * series.next(),
                _ => f64::max(speed, 0.0) + scale * series.within(-0.1, 0.6),
            };
            discs.add([x, 5.0], [speed, 0.0], series);
            x -= 2.0 * discs.radius;
        }
        discs
    }

    /// Two to eight discs that fly about, at up to 60 m/s in a box of a metre.
    fn gas(series: &mut Series) -> Discs {
        let mut discs = Discs::empty(1.0, series);
        let (count, scale) = (series.within(2.0, 9.0) as usize, series.within(2.0, 60.0));
        let r = discs.radius + 0.001;
        while discs.places.len() < count {
            let place = [0; 2].map(|_| series.within(r, 1.0 - r));
            let velocity = [0; 2].map(|_| series.within(-scale, scale));
            let far = |p: &[f64; 2]| (p[0] - place[0]).hypot(p[1] - place[1]) > 2.0 * r;
            if discs.places.iter().all(far) {
                discs.add(place, velocity, series);
            }
        }
        discs
    }

    /// Time until a disc meets its partner.
    fn until(&self, x: &[[f64; 2]], v: &[[f64; 2]], k: usize, partner: Partner) -> Option<f64> {
        match partner {
            Partner::Wall(axis) => {
                let (place, speed) = (x[k][axis], v[k][axis]);
                let left = match speed > 0.0 {
                    true => self.side - self.radius - place,
                    false => place - self.radius,
                };
                (speed != 0.0).then(|| left.max(0.0) / speed.abs())
            }
            Partner::Disc(other) => {
                let d = [0, 1].map(|i| x[k][i] - x[other][i]);
                let w = [0, 1].map(|i| v[k][i] - v[other][i]);
                let (closing, square) = (-d[0] * w[0] - d[1] * w[1], w[0] * w[0] + w[1] * w[1]);
                let free = (d[0] * d[0] + d[1] * d[1] - 4.0 * self.radius * self.radius).max(0.0);
                let root = closing * closing - square * free;
                (closing > 0.0 && root >= 0.0).then(|| free / (closing + root.sqrt()))
            }
        }
    }

    /// The velocities \[m/s\] at the end, and the number of impacts; `None` if there are too many.
    fn exact(&self, most: usize) -> Option<(Vec<[f64; 2]>, usize)> {
        let (mut x, mut v, mut left) = (self.places.clone(), self.velocities.clone(), TIME);
        for impacts in 0..most {
            let mut next = (left, None);
            for k in 0..x.len() {
                let walls = [Partner::Wall(0), Partner::Wall(1)];
                for partner in walls.into_iter().chain((0..k).map(Partner::Disc)) {
                    let time = self.until(&x, &v, k, partner);
                    if let Some(time) = time.filter(|time| *time < next.0) {
                        next = (time, Some((k, partner)));
                    }
                }
            }
            for (x, v) in x.iter_mut().zip(&v) {
                *x = [0, 1].map(|i| x[i] + v[i] * next.0);
            }
            left -= next.0;
            let e = self.restitution;
            match next.1 {
                None => return Some((v, impacts)),
                Some((k, Partner::Wall(axis))) => v[k][axis] *= -e,
                Some((k, Partner::Disc(other))) => {
                    let n = [0, 1].map(|i| (x[k][i] - x[other][i]) / (2.0 * self.radius));
                    let closing: f64 = (0..2).map(|i| n[i] * (v[other][i] - v[k][i])).sum();
                    let inverse = [k, other].map(|k| 1.0 / self.masses[k]);
                    let impulse = (1.0 + e) * closing / (inverse[0] + inverse[1]);
                    for i in 0..2 {
                        v[k][i] += impulse * inverse[0] * n[i];
                        v[other][i] -= impulse * inverse[1] * n[i];
                    }
                }
            }
        }
        None
    }

    /// Places and velocities at the end of a run, and the passages that its verdict names.
    fn simulated(&self, events: bool) -> (Vec<[f64; 2]>, Vec<[f64; 2]>, usize) {
        let (side, count) = (self.side, self.masses.len());
        let disc = |k: usize| {
            format!(
                "[[body]]\nname = \"b{k}\"\ndisc = {}\nmass = {}\nposition = {:?}\nvelocity = {:?}\n",
                self.radius, self.masses[k], self.places[k], self.velocities[k]
            )
        };
        let wall = |k: usize| {
            let mut place = [0.5 * side; 2];
            place[k / 2] = [-0.1, side + 0.1][k % 2];
            let mut size = [side + 0.4; 2];
            size[k / 2] = 0.2;
            format!(
                "[[body]]\nname = \"w{k}\"\nkind = \"fixed\"\nbox = {size:?}\nposition = {place:?}\n"
            )
        };
        let bodies: String = (0..count).map(disc).chain((0..4).map(wall)).collect();
        let run = run(&parse(&format!(
            "[scene]\nname = \"discs\"\ntitle = \"Discs in a box\"\n[gravity]\ny = 0\n\
             [step]\ntime = {TIME}\nevents = {events}\n\
             [[material]]\nname = \"m\"\nfriction = 0\nrestitution = {}\n{bodies}",
            self.restitution
        )));
        let states: Vec<_> = (0..count).map(|body| run.state(body)).collect();
        let x = states
            .iter()
            .map(|(place, _)| place.translation.into())
            .collect();
        let v = states.iter().map(|(_, u)| u.xy().into()).collect();
        (x, v, run.totals.passages)
    }

    /// Where events are located they end as they should, and else where no disc is in another one or in a wall.
    fn check(&self, what: &str, counts: &mut [usize; 3]) {
        let Some((exact, impacts)) = self.exact(64) else {
            return;
        };
        let speeds = self.velocities.iter().map(|v| v[0].hypot(v[1]));
        let fastest = speeds.fold(0.0, f64::max);
        for events in [false, true] {
            let (x, v, passages) = self.simulated(events);
            let what = format!("{what}, {impacts} impacts, events {events}");
            for (k, p) in x.iter().enumerate() {
                let walls = p.iter().map(|x| x.min(self.side - x) - self.radius);
                let others = x[..k].iter().map(|q| (p[0] - q[0]).hypot(p[1] - q[1]));
                let least = others.map(|d| d - 2.0 * self.radius).chain(walls);
                let least = least.fold(0.0, f64::min);
                assert!(least > -0.25 * self.radius, "{what}: {least} m");
            }
            if events {
                assert_eq!(passages, 0, "{what}");
                let off = v
                    .iter()
                    .zip(&exact)
                    .map(|(v, e)| (v[0] - e[0]).hypot(v[1] - e[1]));
                let off = off.fold(0.0, f64::max) / fastest;
                // round-off grows with each impact, and bodies that chatter stick together in the end
                let kind = usize::from(impacts >= 16) + usize::from(impacts >= 32);
                assert!(off < [1e-6, 1e-2, 5e-2][kind], "{what}: {off}");
                counts[kind] += 1;
            }
        }
    }
}

/// Bug: a quarter of such rows ended wrong with events, and a third without: a disc that was thrown at a multiple of
/// its speed met nothing in that step, and up to nearly all energy was lost after sixteen impacts.
#[test]
fn rows_before_a_wall_end_as_impact_by_impact() {
    let (mut series, mut counts) = (Series(7), [0; 3]);
    for number in 0..150 {
        Discs::row(&mut series).check(&format!("row {number}"), &mut counts);
    }
    assert!(counts[0] > 60 && counts[1] > 10, "{counts:?}");
}

/// Bug: of two hundred such boxes 78 of the 184 with less than 64 impacts ended wrong, half of these in silence, and 51
/// were said to have had discs that passed through each other. Discs that passed each other were moved apart;
/// what one disc turned back from was not in the way of another; and what was thrown far met nothing.
#[test]
fn discs_in_a_box_end_as_impact_by_impact() {
    let (mut series, mut counts) = (Series(8), [0; 3]);
    for number in 0..120 {
        Discs::gas(&mut series).check(&format!("box {number}"), &mut counts);
    }
    assert!(counts[0] > 60 && counts[1] > 10, "{counts:?}");
}
