//! The same run gives the same bytes. Each run is a process of its own, so that anything that
//! hangs on a hash map's order, on the time or on an address shows.

use std::fs;
use std::path::Path;
use std::process::Command;

fn run(scene: &str, flags: &[&str], folder: &Path) {
    let status = Command::new(env!("CARGO_BIN_EXE_moreau2d"))
        .args(["run", scene, "--quiet", "--out"])
        .arg(folder)
        .args(flags)
        .status()
        .unwrap();
    // 2: something is unsolved, which must repeat itself as well
    assert!(matches!(status.code(), Some(0 | 2)), "{scene}: {status}");
}

/// `summary.json` without what a clock says.
fn summary(folder: &Path) -> serde_json::Value {
    fn strip(value: &mut serde_json::Value) {
        if let serde_json::Value::Object(map) = value {
            map.retain(|key, _| !key.contains("wall") && !key.contains("date"));
            map.values_mut().for_each(strip);
        }
    }
    let text = fs::read_to_string(folder.join("summary.json")).unwrap();
    let mut value = serde_json::from_str(&text).unwrap();
    strip(&mut value);
    value
}

fn assert_same_twice(scene: &str, flags: &[&str], files: &[&str], least_bytes: usize) {
    let root = tempfile::tempdir().unwrap();
    let folders = ["a", "b"].map(|name| root.path().join(name));
    for folder in &folders {
        run(scene, flags, folder);
    }
    for file in files {
        let [a, b] = [&folders[0], &folders[1]].map(|f| fs::read(f.join(file)).unwrap());
        // an empty file proves nothing
        assert!(
            a.len() > least_bytes,
            "{scene}: {file} has {} bytes",
            a.len()
        );
        assert!(a == b, "{scene}: {file} differs");
    }
    let [a, b] = [&folders[0], &folders[1]].map(|f| summary(f));
    assert_eq!(a, b, "{scene}");
    assert!(a["totals"]["steps"].as_u64().unwrap() > 0);
}

const FILES: [&str; 3] = ["bodies.csv", "contacts.csv", "steps.csv"];

#[test]
fn a_pyramid_stands_the_same_way_twice() {
    assert_same_twice("pyramid", &["--steps", "60"], &FILES, 1000);
}

/// 0.4 s: the grains have fallen on the drum and on each other, so that differences have grown.
#[test]
fn a_drum_tumbles_the_same_way_twice() {
    let files = [&FILES[..], &["impacts.csv"]].concat();
    assert_same_twice("drum", &["--time", "0.4", "--every", "4"], &files, 5000);
}

#[test]
fn the_study_wears_the_same_way_twice() {
    let files = ["comparison.csv", "wear.csv", "profile.csv", "life.csv"];
    assert_same_twice("thresher-study", &[], &files, 50);
}
