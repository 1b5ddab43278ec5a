//! `run --resume`: a run that was stopped gives the bytes of one that was not.

use super::cli::{BALL, scenes_of_bodies};
use crate::common::program::Place;
use crate::common::small;
use moreau2d::checkpoint::{Reader, Writer};
use moreau2d::experiment::Engine;
use moreau2d::scene::Built;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

const KEPT: &str = "r/moreau2d-checkpoint";

/// Every file below a folder with its content.
fn tree(place: &Place, folder: &str) -> BTreeMap<String, Vec<u8>> {
    let all = place.everything().into_iter();
    let below = all.filter(|name| Path::new(name).starts_with(folder));
    let files = below.filter(|name| place.path(name).is_file());
    files
        .map(|name| (name.clone(), fs::read(place.path(&name)).unwrap()))
        .collect()
}

fn spawn(place: &Place, args: &[&str]) -> Child {
    let mut command = place.command(args);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().unwrap()
}

/// Kills with signal 9. Returns whether it was still at work.
fn kill(mut child: Child) -> bool {
    // it fails only for a process that has ended
    let _ = child.kill();
    child.wait().unwrap().code().is_none()
}

/// The first lines of all checkpoints: they change with the content.
fn saved(place: &Place) -> Vec<Vec<u8>> {
    let Ok(entries) = fs::read_dir(place.path(KEPT)) else {
        return Vec::new();
    };
    let mut paths: Vec<_> = entries.map(|e| e.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "state"));
    paths.sort();
    let line = |path| {
        let text: Vec<u8> = fs::read(path).unwrap_or_default();
        text.into_iter().take(80).collect()
    };
    paths.into_iter().map(line).collect()
}

/// Waits until a run has saved something new, or has ended.
fn saves_again(place: &Place, child: &mut Child, before: &[Vec<u8>]) {
    while saved(place) == before && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// A run with `--out r` that was killed after its first checkpoint.
fn stopped(args: &[&str]) -> Place {
    let place = Place::new();
    stop(&place, args);
    place
}

fn stop(place: &Place, args: &[&str]) {
    let mut child = spawn(place, &[args, &["--out", "r"]].concat());
    saves_again(place, &mut child, &[]);
    assert!(kill(child), "{args:?} ended before it could be stopped");
    assert!(!saved(place).is_empty());
}

/// The files of a run that was never stopped, and its exit code.
fn unbroken(args: &[&str]) -> (BTreeMap<String, Vec<u8>>, i32) {
    let place = Place::new();
    let (code, _, err) = place.run(&[args, &["--out", "r"]].concat());
    assert!(code != 1, "{args:?}: {err}");
    (tree(&place, "r"), code)
}

/// Kills a run after each of `kills` checkpoints, and compares its files with those of an unbroken one.
fn compare(args: &[&str], kills: usize) {
    let (whole, code) = unbroken(args);
    let place = stopped(args);
    for _ in 1..kills {
        let before = saved(&place);
        let mut child = spawn(&place, &["run", "--resume", "r"]);
        saves_again(&place, &mut child, &before);
        kill(child);
        if !place.path(KEPT).exists() {
            break;
        }
    }
    let (resumed, _, err) = place.run(&["run", "--resume", "r"]);
    assert!(place.path("r/summary.json").exists(), "{args:?}: {err}");
    assert!(
        resumed == code || err.contains("is finished"),
        "{resumed}: {err}"
    );
    let found = tree(&place, "r");
    let names = |tree: &BTreeMap<String, Vec<u8>>| tree.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&found), names(&whole), "{args:?}");
    for (name, content) in &whole {
        assert!(found[name] == *content, "{args:?}: {name} differs");
    }
    assert_eq!(place.listing("."), ["r"], "nothing hidden is left");
}

#[test]
fn killed_runs_give_the_bytes_of_unbroken_ones() {
    for args in [
        // impacts, joints and a page
        "run chain --events --report --steps 200 --checkpoint-every 20",
        // a closed form, of which every step is a sample
        "run bouncing-ball --events --steps 3000 --checkpoint-every 200",
        // several islands at rest, on two threads
        "run card-house --threads 2 --steps 120 --every 3 --checkpoint-every 12",
        // the models without rapier
        "run woodpecker --steps 4000 --checkpoint-every 400",
        "run double-pendulum --steps 2000 --checkpoint-every 200",
        // sides on which platforms let pass
        "run one-way-platforms --steps 400 --checkpoint-every 40",
    ] {
        compare(&args.split(' ').collect::<Vec<_>>(), 4);
    }
}

#[test]
fn killed_wear_gives_the_bytes_of_unbroken_wear() {
    let args = "run pin-on-disc --report --set step.dt=0.002 --set life.jump=1e-5 --set \
                wear.pin.cell=0.001 --checkpoint-every 40";
    compare(&args.split_whitespace().collect::<Vec<_>>(), 6);
}

/// Both lives of the machine, each from its last jump.
#[test]
fn a_killed_machine_gives_the_bytes_of_an_unbroken_one() {
    compare(&MACHINE.split_whitespace().collect::<Vec<_>>(), 4);
}

/// Grains without a life are saved once a second: while they fill the machine, and while it is measured.
#[test]
fn killed_grains_give_the_bytes_of_unbroken_ones() {
    compare(&GRAINS.split_whitespace().collect::<Vec<_>>(), 3);
}

/// Coarse grains that enter fast, on a step at which the run ends with 2: of the bytes nothing depends on that.
const GRAINS: &str = "run thresher-grains --every 40 --set step.dt=8e-5 --set thresher.entry_speed=8 --set \
                      thresher.grains.radius=0.0016 --set wear.revolutions=1";

/// A short life of the machine on coarse steps.
const MACHINE: &str = "run thresher --every 5 --set step.dt=3.2e-4 --set wear.jump=2e-3 --set \
                       wear.revolutions=1 --set wear.max_hours=30";

/// All that a step tells and all poses, as text that tells every bit.
fn told(built: &mut Built) -> String {
    let mut record = built.step().unwrap_or_else(|e| panic!("{e}"));
    built.measure_into(&mut record, |built, k| Engine::Moreau.state(built, k));
    let states: Vec<_> = (0..built.bodies()).map(|k| built.state(k)).collect();
    let lasting = built.lasting_overlap();
    format!("{record:?} {states:?} {lasting:?}")
}

/// Whatever a scene is made of, a world that is built anew and takes over its state goes on as it does.
#[test]
fn every_scene_goes_on_bit_for_bit() {
    for name in scenes_of_bodies() {
        let changes: Vec<String> = small(name).iter().map(|c| (*c).to_owned()).collect();
        let scene = moreau2d::scene::load(name, &changes).unwrap();
        let mut one = scene.build().unwrap();
        one.measure(|built, k| Engine::Moreau.state(built, k));
        for _ in 0..12 {
            told(&mut one);
        }
        let mut saved = Writer::default();
        one.save(&mut saved).unwrap();
        let mut two = scene.build().unwrap();
        two.load(&mut Reader::new(saved.bytes().to_vec())).unwrap();
        for step in 0..12 {
            assert!(told(&mut one) == told(&mut two), "{name}, step {step}");
        }
    }
}

/// Long enough that a kill finds it at work.
const LONG: [&str; 6] = [
    "run",
    "ball.toml",
    "--time",
    "5000",
    "--checkpoint-every",
    "20",
];

fn long() -> Place {
    let place = Place::new();
    place.write("ball.toml", BALL);
    stop(&place, &LONG);
    place
}

#[test]
fn what_does_not_fit_is_refused_and_stays() {
    let place = long();
    // the flags are those of the start
    place.refused(
        &["run", "--resume", "r", "--dt", "0.1"],
        &["--resume", "cannot be used"],
    );
    place.refused(
        &["run", "ball.toml", "--resume", "r"],
        &["--resume", "cannot be used"],
    );
    place.refused(&["run", "--resume", "s"], &["s: No such file"]);
    fs::create_dir(place.path("empty")).unwrap();
    place.refused(
        &["run", "--resume", "empty"],
        &["empty: no run was stopped here"],
    );
    let resume = ["run", "--resume", "r"];
    place.write("ball.toml", BALL.replace("0.3", "0.31"));
    place.refused(
        &resume,
        &["scene ball is not the one that was stopped", "hash"],
    );
    // of a title nothing depends
    place.write("ball.toml", BALL.replace("A ball", "The ball"));
    let record = format!("{KEPT}/run.json");
    let text = fs::read_to_string(place.path(&record)).unwrap();
    let version = env!("CARGO_PKG_VERSION");
    for (from, to, words) in [
        (version, "0.0.9", &["started by version 0.0.9", version][..]),
        (
            "\"format\": 6",
            "\"format\": 8",
            &["run.json", "format 8", "reads 6"],
        ),
        ("\"run\"", "\"scenes\"", &["is no run"]),
        ("arguments", "words", &["run.json", "damaged", "arguments"]),
        ("}", "", &["run.json", "damaged"]),
    ] {
        assert!(text.contains(from), "{text}");
        place.write(&record, text.replacen(from, to, 1));
        place.refused(&resume, words);
    }
    place.write(&record, &text);
    let state = format!("{KEPT}/run.state");
    let content = fs::read(place.path(&state)).unwrap();
    let mut other = content.clone();
    *other.last_mut().unwrap() ^= 1;
    let short = content[..content.len() / 2].to_vec();
    for damaged in [other, short, Vec::new()] {
        place.write(&state, damaged);
        place.refused(&resume, &["run.state: the checkpoint is damaged"]);
    }
    place.write(&state, content);
    let rows = format!("{KEPT}/files/bodies.csv");
    let all = fs::read(place.path(&rows)).unwrap();
    place.write(&rows, &all[..60]);
    place.refused(&resume, &["bodies.csv", "60 bytes of"]);
}

#[test]
fn a_finished_run_is_left_as_it_is() {
    let place = Place::new();
    let (code, ..) = place.run(&["run", "incline", "--out", "r"]);
    assert_eq!(code, 0);
    let before = tree(&place, "r");
    let (code, out, err) = place.run(&["run", "--resume", "r"]);
    assert_eq!((code, out.as_str()), (0, ""));
    assert_eq!(err, "r: the run is finished, nothing is left to do\n");
    assert!(tree(&place, "r") == before);
    // it ends as the run did
    let (code, ..) = place.run(&[
        "run",
        "incline",
        "--set",
        "verdict.imbalance=0",
        "--out",
        "s",
    ]);
    assert_eq!((code, place.run(&["run", "--resume", "s"]).0), (2, 2));
}

/// The program stops while files are moved into place: the rest follows.
#[test]
fn results_that_were_complete_are_moved_into_place() {
    let place = Place::new();
    place.run(&["run", "incline", "--out", "r"]);
    let whole = tree(&place, "r");
    let files = format!("{KEPT}/files");
    fs::create_dir_all(place.path(&files)).unwrap();
    fs::create_dir(place.path(&format!("{KEPT}/old"))).unwrap();
    place.write(&format!("{KEPT}/done"), "");
    for name in ["steps.csv", "summary.json"] {
        fs::rename(
            place.path(&format!("r/{name}")),
            place.path(&format!("{files}/{name}")),
        )
        .unwrap();
    }
    let (code, _, err) = place.run(&["run", "--resume", "r"]);
    assert_eq!(code, 0, "{err}");
    assert!(err.contains("is finished"), "{err}");
    assert!(tree(&place, "r") == whole);
}

/// Nothing is lost by mistake: what waits to be resumed is not begun anew.
#[test]
fn a_run_does_not_drop_one_that_was_stopped() {
    let place = long();
    let other = ["run", "ball.toml", "--steps", "30", "--out", "r"];
    for again in [&[&LONG[..], &["--out", "r"]].concat()[..], &other] {
        place.refused(again, &["was stopped here", "`run --resume r`", KEPT]);
    }
    place.write(&format!("{KEPT}/run.state"), "damaged");
    place.refused(&other, &["run.state: the checkpoint is damaged"]);
    fs::remove_dir_all(place.path(KEPT)).unwrap();
    let (code, _, err) = place.run(&other);
    assert_eq!(code, 0, "{err}");
    assert_eq!(place.rows("r/steps.csv").len(), 30);
}

/// While one goes on, another neither resumes it nor takes its folder away.
#[test]
fn a_run_at_work_is_left_alone() {
    let place = long();
    let before = saved(&place);
    let mut child = spawn(&place, &["run", "--resume", "r"]);
    saves_again(&place, &mut child, &before);
    let (code, _, err) = place.run(&["run", "--resume", "r"]);
    assert_eq!(code, 1);
    assert!(err.contains("another run is still writing here"), "{err}");
    let (code, _, err) = place.run(&["run", "ball.toml", "--steps", "30", "--out", "r"]);
    assert_eq!(code, 0, "{err}");
    let before = saved(&place);
    saves_again(&place, &mut child, &before);
    assert!(kill(child));
}

#[test]
fn what_writes_no_checkpoint_says_so() {
    let place = Place::new();
    for (args, words) in [
        ("run incline --checkpoint-every 0", "--checkpoint-every"),
        (
            "run incline --checkpoint-every 5 --engine rapier",
            "--checkpoint-every 5",
        ),
        ("run thresher --checkpoint-every 5", "--checkpoint-every 5"),
        (
            "run incline --checkpoint-every 5 --dump-problems p",
            "--checkpoint-every",
        ),
    ] {
        place.refused(&args.split(' ').collect::<Vec<_>>(), &[words]);
    }
}

/// Killed at 30 moments drawn from a seed, over the time that an unbroken run takes; each time it is
/// resumed to its end. Prints by how much both together took longer.
#[test]
#[ignore = "takes a minute, or half an hour for the machine in the release profile"]
fn thirty_kills_lose_nothing() {
    let machine = std::env::var("MOREAU2D_KILL").unwrap_or_default() == "machine";
    let args: Vec<&str> = match machine {
        true => vec!["run", "thresher"],
        false => "run card-house --events --time 100 --set step.dt=0.001"
            .split(' ')
            .collect(),
    };
    let start = Instant::now();
    let (whole, _) = unbroken(&args);
    let whole_time = start.elapsed().as_secs_f64();
    let mut random = 42u64;
    let (mut stopped, mut most, mut sum) = (0, f64::NEG_INFINITY, 0.0);
    for _ in 0..30 {
        // Knuth's linear congruential generator
        random = random
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        let moment = whole_time * (random >> 11) as f64 / (1u64 << 53) as f64;
        let place = Place::new();
        let child = spawn(&place, &[&args[..], &["--out", "r"]].concat());
        std::thread::sleep(Duration::from_secs_f64(moment));
        let killed = kill(child);
        let start = Instant::now();
        if place.path("r").exists() {
            let (code, _, err) = place.run(&["run", "--resume", "r"]);
            assert!(code != 1, "at {moment} s: {err}");
        }
        let lost = moment + start.elapsed().as_secs_f64() - whole_time;
        if killed {
            stopped += 1;
            most = most.max(lost);
            sum += lost;
        }
        assert!(tree(&place, "r") == whole, "at {moment} s of {whole_time}");
    }
    println!(
        "{args:?}: {whole_time:.2} s; {stopped} of 30 kills found it at work; {:.2} s lost on average, {most:.2} s \
         at most",
        sum / f64::from(stopped)
    );
    assert!(stopped > 15, "{stopped}");
}
