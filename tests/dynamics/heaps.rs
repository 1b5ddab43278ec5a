//! Random heaps that nobody tuned anything on: none fails, small ones are certified, and no step takes
//! work without end.

use crate::common::{Random, parse};
use moreau2d::experiment::{Engine, simulate};
use std::time::Instant;

/// What the steps of heaps needed and left.
#[derive(Debug, Default)]
struct Seen {
    steps: usize,
    /// Steps with all islands certified at 1e-8; steps with a crowd; islands that failed.
    certified: usize,
    crowded: usize,
    failed: usize,
    contacts: usize,
    /// Largest velocity residual \[m/s\].
    residual: f64,
    /// Largest work of a step, and its time \[s\], which is printed only.
    factorisations: usize,
    sweeps: usize,
    slowest: f64,
}

impl Seen {
    fn step(&mut self, text: &str, steps: usize) {
        let mut built = parse(text).build().unwrap();
        let mut last = Instant::now();
        simulate(&mut built, Engine::Moreau, steps, |record, _| {
            self.slowest = self.slowest.max(last.elapsed().as_secs_f64());
            self.steps += 1;
            self.certified += usize::from(record.unsolved == 0);
            self.crowded += usize::from(record.crowds > 0);
            self.failed += record.failed;
            self.contacts = self.contacts.max(record.contacts.len());
            self.residual = self.residual.max(record.residual_velocity);
            self.factorisations = self.factorisations.max(record.factorisations);
            self.sweeps = self.sweeps.max(record.sweeps);
            last = Instant::now();
            Ok(())
        })
        .unwrap();
    }
}

/// A bin of this half width, its material, and bodies as `add` writes them.
fn bin(half: f64, friction: f64, add: impl FnOnce(&mut String)) -> String {
    let mut text = format!(
        "[scene]\nname = \"heap\"\ntitle = \"A random heap\"\n\
         [[material]]\nname = \"m\"\nfriction = {friction}\n\
         [[body]]\nname = \"bin\"\nkind = \"fixed\"\nmaterial = \"m\"\nparts = [\n\
         {{ box = [{:?}, 1], position = [0, -0.5] }},\n\
         {{ box = [1, 60], position = [{:?}, 30] }},\n{{ box = [1, 60], position = [{:?}, 30] }}]\n",
        2.0 * half + 2.0,
        -half - 0.5,
        half + 0.5,
    );
    add(&mut text);
    text
}

/// Adds a body that moves at up to `speed` along x and y.
fn body(random: &mut Random, text: &mut String, shape: &str, [x, y]: [f64; 2], speed: f64) {
    let mut any = |most: f64| random.between(-most, most);
    let k = text.len();
    *text += &format!(
        "[[body]]\nname = \"b{k}\"\nmaterial = \"m\"\n{shape}\nposition = [{x:?}, {y:?}]\n\
         velocity = [{:?}, {:?}]\nspin = {:?}\n",
        any(speed),
        any(speed),
        any(speed),
    );
}

/// 80 discs of radii 0.05 to 0.1 m, ten to a row, that fall on each other and slide.
fn discs(seed: u64) -> String {
    let mut random = Random(seed);
    let friction = random.between(0.0, 1.0);
    bin(1.1, friction, |text| {
        for k in 0..80 {
            let radius = random.between(0.05, 0.1);
            let [x, y] = [f64::from(k % 10), f64::from(k / 10)];
            let place = [-0.95 + 0.21 * x, 0.1 + 0.2 * y + random.between(0.0, 0.005)];
            body(&mut random, text, &format!("disc = {radius:?}"), place, 2.0);
        }
    })
}

/// Boxes, discs and hexagons close together, some 100 to 1800, that move at up to 3 m/s.
fn mixed(seed: u64) -> String {
    let mut random = Random(seed);
    let columns = 8 + random.below(28);
    let rows = 12 + random.below(40);
    let friction = random.between(0.1, 0.9);
    let kind = random.below(4);
    let (width, gap) = (0.2, random.between(0.001, 0.02));
    bin(0.5 * (width + gap) * columns as f64, friction, |text| {
        for k in 0..columns * rows {
            let [x, y] = [k % columns, k / columns].map(|n| (n as f64 + 0.5) * (width + gap));
            let place = [x - 0.5 * (width + gap) * columns as f64, y];
            let own = if kind == 3 { random.below(3) } else { kind };
            let shape = match own {
                0 => format!("box = [{width}, {:?}]", random.between(0.15, width)),
                1 => format!("disc = {:?}", random.between(0.07, 0.5 * width)),
                _ => "polygon = [[0.1, 0.0], [0.05, 0.086], [-0.05, 0.086], [-0.1, 0.0], \
                      [-0.05, -0.086], [0.05, -0.086]]"
                    .to_owned(),
            };
            body(&mut random, text, &shape, place, 3.0);
        }
    })
}

/// Up to 300 boxes or discs, most of which overlap others at the start.
fn overlapped(seed: u64) -> String {
    let mut random = Random(seed);
    let count = 20 + random.below(280);
    let half = random.between(0.6, 1.5);
    bin(half, random.between(0.0, 0.8), |text| {
        for _ in 0..count {
            let place = [random.between(-half, half), random.between(0.1, 2.0)];
            let size = random.between(0.1, 0.25);
            let shape = match random.below(2) {
                0 => format!("box = [{size:?}, {size:?}]"),
                _ => format!("disc = {:?}", 0.5 * size),
            };
            body(&mut random, text, &shape, place, 1.0);
        }
    })
}

fn look(of: fn(u64) -> String, seeds: std::ops::Range<u64>, steps: usize) -> Seen {
    let mut seen = Seen::default();
    for seed in seeds {
        seen.step(&of(seed), steps);
    }
    println!("{seen:?}");
    seen
}

/// Nothing fails. Of small heaps nearly every step is certified at 1e-8.
fn check(small: std::ops::Range<u64>, large: std::ops::Range<u64>, steps: usize) {
    let seen = look(discs, small, 40);
    assert_eq!(seen.failed, 0, "{seen:?}");
    assert!(
        seen.certified as f64 >= 0.95 * seen.steps as f64,
        "{seen:?}"
    );
    let seen = look(mixed, large, steps);
    assert_eq!(seen.failed, 0, "{seen:?}");
    assert!(seen.crowded > 0, "{seen:?}");
}

#[test]
fn some_random_heaps_do_not_fail() {
    check(0..12, 0..4, 40);
}

#[test]
#[ignore = "some minutes"]
fn random_heaps_do_not_fail() {
    check(1000..1200, 1000..1040, 40);
}

/// The solver gives up on a problem after some 2500 factorisations at most; one of 2000 contacts takes less
/// than half a millisecond, so that a step takes no more than about a second. Bodies that are pressed
/// together may have no solution, and a step may say so.
fn bounded(seen: &Seen) {
    assert!(seen.factorisations < 3000, "{seen:?}");
    assert!(100 * seen.failed <= seen.steps, "{seen:?}");
}

#[test]
fn no_step_of_overlapped_bodies_is_without_end() {
    bounded(&look(overlapped, 0..3, 10));
}

#[test]
#[ignore = "a minute"]
fn no_step_of_many_overlapped_scenes_is_without_end() {
    bounded(&look(overlapped, 1000..1040, 30));
}

/// 64 discs by chance fall into a bin and on each other. Returns the deepest overlap over the smaller radius, by the
/// distances of the centres at all ends of steps.
fn deepest_of_a_heap(seed: u64, restitution: f64) -> f64 {
    let mut random = Random(seed);
    let mut text = format!(
        "[scene]\nname = \"heap\"\ntitle = \"Discs fall into a bin\"\n[step]\ntime = 1.5\n\
         [[material]]\nname = \"m\"\nfriction = 0.4\nrestitution = {restitution}\n\
         [[body]]\nname = \"bin\"\nkind = \"fixed\"\nparts = [\n  {{ box = [1.4, 0.2], position = [0, -0.1] }},\n  \
         {{ box = [0.2, 4], position = [-0.6, 2] }},\n  {{ box = [0.2, 4], position = [0.6, 2] }},\n]\n"
    );
    let mut radii = Vec::new();
    for k in 0..64 {
        let radius = random.between(0.035, 0.05);
        let [x, y, vx, vy] = [(); 4].map(|()| random.between(-1.0, 1.0));
        let (column, row) = (f64::from(k % 8), f64::from(k / 8));
        text += &format!(
            "[[body]]\nname = \"b{k}\"\ndisc = {radius:?}\nposition = [{:?}, {:?}]\nvelocity = [{vx:?}, {vy:?}]\n",
            0.12 * (column - 3.5) + 0.005 * x,
            0.5 + 0.12 * row + 0.005 * y,
        );
        radii.push(radius);
    }
    let mut built = parse(&text).build().unwrap();
    let mut deepest = 0.0f64;
    simulate(&mut built, Engine::Moreau, 90, |_, built| {
        let all = (0..64).map(|k| built.state(1 + k).unwrap().0.translation);
        let centres: Vec<_> = all.collect();
        for (i, a) in centres.iter().enumerate() {
            for (j, b) in centres[..i].iter().enumerate() {
                let depth = radii[i] + radii[j] - (a - b).norm();
                deepest = deepest.max(depth / radii[i].min(radii[j]));
            }
        }
        Ok(())
    })
    .unwrap();
    deepest
}

/// Bug: more than 32 bodies that rebound from each other were left as deep as they move in a step: the discs of these
/// scenes by 1.1 or 0.8 of a radius in the mean, with restitution 0.3 or 0.8.
#[test]
fn discs_that_rebound_in_a_heap_keep_apart() {
    for restitution in [0.3, 0.8] {
        let all: Vec<f64> = (1..=6).map(|k| deepest_of_a_heap(k, restitution)).collect();
        let mean = all.iter().sum::<f64>() / 6.0;
        println!("{mean} of {all:?}");
        assert!(mean < 0.25, "{restitution}: {all:?}");
    }
}
