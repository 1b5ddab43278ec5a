//! The printed error of the machine's life holds the lives of other meshes, steps, jumps, phases and
//! samples.

use moreau2d::report::Progress;
use moreau2d::thresher::{self, LimitError, Machine, Size, ThreshingOutcome, run_threshing};

fn life(hold: &str, flags: &[&str]) -> ThreshingOutcome {
    let held = format!("thresher.hold={hold}");
    let flags = [&[held.as_str()], flags].concat();
    let flags: Vec<String> = flags.into_iter().map(str::to_owned).collect();
    let (scene, Some(Machine::Thresher(setup))) = thresher::load("thresher", &flags).unwrap()
    else {
        panic!("no thresher");
    };
    let hidden = |_: &str, _: u64| Progress::new("", 1, true);
    run_threshing(&scene, &setup, hidden, &mut |_, _| Ok(()), &|_| None).unwrap()
}

fn error<'a>(outcome: &'a ThreshingOutcome, limit: &str) -> &'a LimitError {
    let found = outcome.errors.iter().find(|e| e.limit == limit);
    found.unwrap_or_else(|| panic!("{limit} is not reached"))
}

/// Lives whose jumps are short by their mesh, or by request, sample each once: over the life that is as
/// many revolutions as the scene's own life has.
fn holds_other_lives(hold: &str, limit: &str) {
    let cases: [&[&str]; 8] = [
        &["tooth.cells=51", "wear.revolutions=1"],
        &["tooth.cells=101", "wear.revolutions=1"],
        &["wear.jump=1.2e-4", "wear.revolutions=1"],
        &["step.dt=2e-5"],
        &["thresher.feed_phase=0.3"],
        &["thresher.feed_phase=0.7"],
        &["wear.revolutions=1"],
        &["wear.revolutions=4"],
    ];
    let (run, others) = std::thread::scope(|scope| {
        let running =
            cases.map(|flags| scope.spawn(move || error(&life(hold, flags), limit).clone()));
        let run = life(hold, &["wear.error=measured"]);
        (run, running.map(|other| other.join().unwrap()))
    });
    let error = error(&run, limit);
    for source in &error.sources {
        println!("{}: {:?}, {}", source.source, source.size, source.how);
        assert_ne!(source.size, Size::NotMeasured, "{source:?}");
    }
    println!("{limit}: {} ± {} h", error.hours, error.total());
    for (flags, other) in cases.iter().zip(&others) {
        println!("{flags:?}: {} h, noise {} h", other.hours, other.noise());
    }
    for (flags, other) in cases.iter().zip(&others) {
        let off = other.hours - error.hours;
        assert!(off.abs() < error.total(), "{flags:?}: {off} h off");
    }
}

/// Half an hour of computing on two free cores, both protocols:
/// `cargo test --release --test wear machine_life -- --ignored --nocapture`.
#[test]
#[ignore = "a quarter of an hour"]
fn other_lives_with_the_torque_held_end_within_the_printed_error() {
    holds_other_lives("torque", "unfit");
}

#[test]
#[ignore = "a quarter of an hour"]
fn other_lives_with_the_feed_held_end_within_the_printed_error() {
    holds_other_lives("feed", "no longer conveys");
}
