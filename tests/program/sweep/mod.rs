//! `sweep` and `merge`: many cases of a scene, in parts, killed and gone on with.

mod killed;
mod merged;
mod plans;

use crate::common::program::Place;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// 24 short cases.
const SLIDING: &str = include_str!("../../../scenes/sweeps/sliding-block.toml");

/// Every file below a folder with its content.
fn tree(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn walk(folder: &Path, root: &Path, out: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path
                .strip_prefix(root)
                .unwrap()
                .to_string_lossy()
                .into_owned();
            match path.is_dir() {
                true => {
                    out.insert(format!("{name}/"), Vec::new());
                    walk(&path, root, out);
                }
                false => {
                    out.insert(name, fs::read(&path).unwrap());
                }
            }
        }
    }
    let mut out = BTreeMap::new();
    walk(folder, folder, &mut out);
    out
}

/// Names of the cases in a folder.
fn cases(place: &Place, folder: &str) -> Vec<String> {
    let mut names = place.listing(folder);
    names.retain(|name| name != "plan.json" && !name.starts_with('.'));
    names
}

#[track_caller]
fn done(place: &Place, args: &[&str]) -> String {
    let (code, out, err) = place.run(args);
    assert_eq!((code, err.as_str()), (0, ""), "{args:?}: {out}");
    out
}

/// The sweep `plan.toml` of one process, in `alone`, and its table in `table`.
fn alone(plan: &str) -> Place {
    let place = Place::new();
    place.write("plan.toml", plan);
    done(
        &place,
        &["sweep", "plan.toml", "--jobs", "1", "--out", "alone"],
    );
    done(&place, &["merge", "alone", "--out", "table"]);
    place
}

#[test]
fn jobs_and_parts_give_the_same_bytes() {
    let place = alone(SLIDING);
    let (whole, table) = (tree(&place.path("alone")), tree(&place.path("table")));
    assert_eq!(cases(&place, "alone").len(), 24);
    done(
        &place,
        &["sweep", "plan.toml", "--jobs", "4", "--out", "four"],
    );
    assert!(tree(&place.path("four")) == whole, "--jobs 4");
    for count in [1, 3, 7] {
        // in folders of their own, and in one
        let parts: Vec<String> = (1..=count).map(|k| format!("part-{count}-{k}")).collect();
        let shared = format!("shared-{count}");
        let mut seen = 0;
        for (k, part) in parts.iter().enumerate() {
            let shard = format!("{}/{count}", k + 1);
            for out in [part, &shared] {
                done(
                    &place,
                    &["sweep", "plan.toml", "--shard", &shard, "--out", out],
                );
            }
            seen += cases(&place, part).len();
        }
        assert_eq!(seen, 24, "every case in one part");
        assert!(
            tree(&place.path(&shared)) == whole,
            "{count} parts in a folder"
        );
        let merged = format!("table-{count}");
        let folders = parts.iter().map(String::as_str);
        let args: Vec<&str> = ["merge"]
            .into_iter()
            .chain(folders)
            .chain(["--out", &merged])
            .collect();
        done(&place, &args);
        assert!(
            tree(&place.path(&merged)) == table,
            "table of {count} parts"
        );
    }
}

/// Cases that do not hold, or end with an error, stop no other; they are done, and told again.
#[test]
fn what_did_not_hold_is_listed_and_not_run_again() {
    let place = Place::new();
    place.write(
        "plan.toml",
        "scene = \"thresher-study\"\n[set]\n\"study.torques\" = [146.39]\n\"study.speeds\" = [70]\n\
         \"study.frictions\" = []\n\"study.batches\" = 1\n\"wear.max_hours\" = 1\n[grid]\n\
         \"study.contact_time\" = [3e-4, 3e-3]\n\"study.update\" = [\"quadratic\", \"normal\"]\n",
    );
    let run = |out: &str| {
        let (code, out, err) = place.run(&["sweep", "plan.toml", "--jobs", "1", "--out", out]);
        assert_eq!((code, err.as_str()), (2, ""), "{out}");
        out
    };
    let first = run("s");
    assert!(
        first.contains("1 held, 1 did not hold, 2 ended with an error"),
        "{first}"
    );
    for why in ["the jump wears", "the base is worn through before"] {
        assert!(first.contains(why), "{why}: {first}");
    }
    let again = run("s");
    assert!(again.contains("4 were done before"), "{again}");
    assert_eq!(again.replace("4 were done before\n", ""), first);
    // the table has them, with the reason
    done(&place, &["merge", "s", "--out", "t"]);
    let rows = place.rows("t/sweep.csv");
    let held: Vec<&str> = rows.iter().map(|row| row[3].as_str()).collect();
    assert_eq!(held, ["true", "false", "false", "false"]);
    assert!(
        rows[1][4].contains("take more study.batches"),
        "{:?}",
        rows[1]
    );
    assert!(rows[2][4].contains("worn through"), "{:?}", rows[2]);
    let picture = fs::read_to_string(place.path("t/comparison.computed_um.svg")).unwrap();
    assert!(picture.contains("framed: the scene did not hold"));
}

/// Lives and depths are the columns that matter: a pin, the study and the machine.
#[test]
fn scenes_that_wear_are_swept() {
    let place = Place::new();
    place.write(
        "pin.toml",
        "scene = \"pin-on-disc\"\n[grid]\n\"wear.pin.coefficient\" = [1e-12, 2e-12, 4e-12]\n",
    );
    done(&place, &["sweep", "pin.toml", "--out", "pin", "--files"]);
    let out = done(&place, &["merge", "pin", "--out", "pins"]);
    assert!(out.contains("wear.pin.deepest_m.svg"), "{out}");
    let head = place.header("pins/sweep.csv");
    let depth = head
        .split(',')
        .position(|name| name == "wear.pin.deepest_m")
        .unwrap();
    for (row, coefficient) in place
        .rows("pins/sweep.csv")
        .iter()
        .zip([1e-12, 2e-12, 4e-12])
    {
        // K F s / A
        let expected = coefficient * 1000.0 * 0.01 * 0.04 * 9.81 * 0.5 * 3.6e6 / 0.01;
        let computed: f64 = row[depth].parse().unwrap();
        assert!(
            (computed / expected - 1.0).abs() < 1e-4,
            "{computed} {expected}"
        );
        let case = format!("pin/{}", row[0]);
        assert!(
            place.listing(&case).contains(&"wear.csv".to_owned()),
            "--files keeps them"
        );
    }
    // a machine far from its operating point ends at once, and says so
    place.write(
        "machine.toml",
        "scene = \"thresher\"\n[grid]\n\"thresher.speed\" = [9e5, 1e6]\n",
    );
    let (code, out, err) = place.run(&["sweep", "machine.toml", "--out", "machine"]);
    assert_eq!(code, 2, "{out}");
    // steps that are too long are told once
    assert_eq!(err.lines().count(), 1, "{err}");
    assert!(
        err.starts_with("warning: in 2 cases, as in the first: step.dt = "),
        "{err}"
    );
    assert_eq!(out.matches("not the operating torque").count(), 2, "{out}");
    done(
        &place,
        &[
            "merge",
            "machine",
            "--out",
            "machines",
            "--draw",
            "torque_new_nm",
        ],
    );
    assert_eq!(place.rows("machines/sweep.csv").len(), 2);
}
