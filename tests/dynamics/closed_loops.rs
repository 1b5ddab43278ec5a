//! Closed loops: every step of a run is certified by the judge, or says that it is not.

use crate::common::load;
use moreau2d::contact::natural_map;
use moreau2d::experiment::Engine;

const TOLERANCE: f64 = 1e-6;
const ALL: f64 = 1.0;
/// Of what is hit hard or slides fast.
const MOST: f64 = 0.95;

struct Loop {
    scene: &'static str,
    flags: &'static [&'static str],
    /// Steps in every run of the tests.
    steps: usize,
    /// Least share of steps that are certified.
    share: f64,
}

const fn of(scene: &'static str, flags: &'static [&'static str], steps: usize, share: f64) -> Loop {
    Loop {
        scene,
        flags,
        steps,
        share,
    }
}

const STACKS: [Loop; 3] = [
    of("tower", &["repeat.0.count=[1,100]"], 400, ALL),
    of("heavy-top", &[], 1000, ALL),
    of(
        "pyramid",
        &["repeat.0.count=[30,30]", "body.box.position=[-14.79,0.5]"],
        150,
        ALL,
    ),
];
const LARGE: [Loop; 1] = [of(
    "pyramid",
    &[
        "repeat.0.count=[100,100]",
        "body.box.position=[-50.49,0.5]",
        "body.floor.box=[120,2]",
    ],
    5,
    ALL,
)];
const JOINTED: [Loop; 3] = [
    of("arch", &[], 1000, ALL),
    of("chain", &[], 1000, ALL),
    of("wedge", &[], 1000, ALL),
];
const DRUMS: [Loop; 5] = [
    of("drum", &["material=[{name=\"m\",friction=0.2}]"], 300, MOST),
    of("drum", &["material=[{name=\"m\",friction=0.3}]"], 300, MOST),
    of("drum", &["material=[{name=\"m\",friction=0.5}]"], 300, ALL),
    of("drum", &["material=[{name=\"m\",friction=0.7}]"], 300, ALL),
    of("drum", &["material=[{name=\"m\",friction=0.9}]"], 300, ALL),
];
const HEAP: [Loop; 1] = [of("hit-heap", &[], 1000, MOST)];

impl Loop {
    /// The count of certified steps, as an error where it is too low.
    fn run(&self, steps: usize) -> Result<String, String> {
        let tolerance = format!("step.tolerance={TOLERANCE}");
        let scene = load(self.scene, &[self.flags, &[&tolerance]].concat());
        let mut built = scene.build().unwrap();
        built.keep_problems(true);
        let (mut certified, mut most) = (0, 0);
        for step in 1..=steps {
            let record = Engine::Moreau.step(&mut built).unwrap();
            let what = format!("{} {:?} step {step}", self.scene, self.flags);
            let mut open = 0;
            for solved in built.problems() {
                let residual = natural_map(&solved.problem, &solved.impulses);
                assert_eq!(residual, solved.report.residual, "{what}");
                let good = residual.certified(TOLERANCE);
                assert!(good || !solved.report.solved(), "{what}: {residual:?}");
                open += usize::from(!good);
                most = most.max(solved.problem.len());
            }
            // an island is open as first asked, and solved without its push-outs, or told
            let told = record.unsolved + record.relaxed;
            assert!(open <= told, "{what}: {open} open, {told} told");
            let good = record.unsolved == 0;
            assert!(
                record.residual <= TOLERANCE || !good,
                "{what}: {}",
                record.residual
            );
            certified += usize::from(good);
        }
        let share = certified as f64 / steps as f64;
        let what = format!("{} {:?}: {certified} of {steps}", self.scene, self.flags);
        assert!(most > 1, "{what}: nothing was asked");
        if share >= self.share {
            Ok(what)
        } else {
            Err(what)
        }
    }
}

#[track_caller]
fn assert_all(loops: &[Loop]) {
    for l in loops {
        if let Err(what) = l.run(l.steps) {
            panic!("{what}");
        }
    }
}

#[test]
fn stacks() {
    assert_all(&STACKS);
    assert_all(&LARGE);
}

#[test]
fn arch_chain_and_wedge() {
    assert_all(&JOINTED);
}

#[test]
fn drums() {
    assert_all(&DRUMS);
}

#[test]
fn a_heap_that_is_hit() {
    assert_all(&HEAP);
}

/// The whole thousand steps of each, with the counts; the pyramid of 5050 boxes takes minutes:
/// `cargo test --release --test dynamics closed_loops -- --ignored --nocapture`
#[test]
#[ignore = "takes minutes"]
fn a_thousand_steps_of_all() {
    let small = STACKS.iter().chain(&JOINTED).chain(&DRUMS).chain(&HEAP);
    let ends = small
        .chain(&LARGE)
        .map(|l| l.run(1000))
        .inspect(|end| println!("{end:?}"));
    let failed: Vec<_> = ends.filter_map(Result::err).collect();
    assert!(failed.is_empty(), "{failed:#?}");
}
