//! The printed error of the machine's life holds the lives of other meshes, steps, jumps and phases.

use moreau2d::report::Progress;
use moreau2d::thresher::{self, Machine, Size, ThreshingOutcome, run_threshing};

fn life(flags: &[&str]) -> ThreshingOutcome {
    let flags: Vec<String> = flags.iter().map(|f| (*f).to_owned()).collect();
    let (scene, Some(Machine::Thresher(setup))) = thresher::load("thresher", &flags).unwrap()
    else {
        panic!("no thresher");
    };
    let hidden = |_: &str, _: u64| Progress::new("", 1, true);
    run_threshing(&scene, &setup, hidden, &mut |_, _| Ok(())).unwrap()
}

fn hours(outcome: &ThreshingOutcome) -> f64 {
    outcome.history.crossings[0].hours.unwrap()
}

/// Half an hour of computing on two free cores:
/// `cargo test --release --test wear machine_life -- --ignored --nocapture`.
#[test]
#[ignore = "half an hour"]
fn other_meshes_steps_jumps_and_phases_end_within_the_printed_error() {
    let cases: [&[&str]; 6] = [
        &["tooth.cells=51"],
        &["tooth.cells=101"],
        &["step.dt=1e-5"],
        &["wear.jump=1.2e-4"],
        &["thresher.feed_phase=0.3"],
        &["thresher.feed_phase=0.7"],
    ];
    let (run, others) = std::thread::scope(|scope| {
        let running = cases.map(|flags| scope.spawn(move || hours(&life(flags))));
        let run = life(&["wear.error=measured"]);
        (run, running.map(|other| other.join().unwrap()))
    });
    let error = &run.errors[0];
    for source in &error.sources {
        println!("{}: {:?}, {}", source.source, source.size, source.how);
        assert_ne!(source.size, Size::NotMeasured, "{source:?}");
    }
    println!("{} ± {} h", error.hours, error.total());
    for (flags, other) in cases.iter().zip(others) {
        println!("{flags:?}: {other} h");
        assert!(
            (other - error.hours).abs() < error.total(),
            "{flags:?}: {other} h"
        );
    }
}
