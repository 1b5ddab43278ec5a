//! `moreau2d solve` and `run --dump-problems` as a user types them.

mod any_numbers;
mod lcp;

use crate::common::program::Place;
use moreau2d::contact::examples::tower;
use moreau2d::contact::{ContactProblem, Delassus, Vec2, natural_map};
use moreau2d::problems::{DatStorage, StoredProblem, read, to_dat, to_json};
use serde_json::Value;
use std::fs;

/// A stored contact problem of the folder, and its solution.
fn contact(place: &Place, name: &str) -> (ContactProblem, Option<Vec<Vec2>>) {
    let loaded = read(&fs::read(place.path(name)).unwrap()).unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    match loaded.problem {
        StoredProblem::Contact { problem, solution } => (problem, solution),
        StoredProblem::Lcp { .. } => panic!("{name} is an LCP"),
    }
}

fn numbers(list: &Value) -> Vec<f64> {
    let number = |x: &Value| x.as_f64().unwrap();
    list.as_array().unwrap().iter().map(number).collect()
}

/// What a run dumps is solved again to the tolerance, from bodies and made dense, and the judge
/// agrees with the impulses written. Of each scene every tenth step of the steps given.
#[test]
fn dumped_problems_are_solved_again() {
    let place = Place::new();
    for (scene, steps, islands) in [("tower", "20", 2), ("wedge", "20", 2), ("drum", "300", 30)] {
        let every = if scene == "drum" { "150" } else { "10" };
        let args = ["run", scene, "--steps", steps, "--dump-problems", scene];
        let (code, out, err) = place.run(&[&args[..], &["--dump-every", every]].concat());
        assert_eq!(code, 0, "{err}");
        let files = place.listing(scene);
        // a tower and a wedge are one island; the discs of the drum fall in many and meet in few
        let enough = if scene == "drum" {
            files.len() > 5 && files.len() < islands
        } else {
            files.len() == islands
        };
        assert!(enough, "{scene}: {files:?}");
        assert!(
            out.contains(&format!("{} contact problems in {scene}", files.len())),
            "{out}"
        );
        for file in files {
            let file = format!("{scene}/{file}");
            let (problem, solution) = contact(&place, &file);
            let stored = solution.expect("a dump holds the impulses found");
            // the run's own tolerance
            assert!(natural_map(&problem, &stored).certified(1e-8), "{file}");
            let dense = StoredProblem::Contact {
                problem: ContactProblem {
                    operator: Delassus::dense(problem.operator.explicit()),
                    ..problem.clone()
                },
                solution: None,
            };
            place.write("dense.json", to_json(&dense).unwrap());
            let mut names = vec![&file, "dense.json"];
            match to_dat(&dense, DatStorage::Blocks) {
                Ok(text) => {
                    place.write("dense.dat", text);
                    names.push("dense.dat");
                }
                // the wedge hangs on hinges, for which that format has no place
                Err(error) => assert!(scene == "wedge" && error.to_string().contains("a pin")),
            }
            for name in names {
                let args = ["solve", name, "--tolerance", "1e-9", "--out", "r.json"];
                let (code, out, err) = place.run(&args);
                assert_eq!((code, err.as_str()), (0, ""), "{name}: {out}");
                let result = place.json("r.json");
                assert_eq!(
                    (&result["kind"], &result["status"]),
                    (&"contact".into(), &"solved".into())
                );
                let flat = numbers(&result["impulses"]);
                let impulses: Vec<Vec2> = flat.chunks(2).map(|p| Vec2::new(p[0], p[1])).collect();
                let (problem, _) = contact(&place, name);
                let residual = natural_map(&problem, &impulses);
                assert!(residual.certified(1e-9), "{name}");
                // nothing is lost in the file
                assert_eq!(
                    result["residual"].as_f64(),
                    Some(residual.relative),
                    "{name}"
                );
            }
        }
    }
}

/// Contact in closed form, in a mechanism, and impacts located in time leave problems as well.
#[test]
fn every_kind_of_world_dumps() {
    for (scene, more) in [
        ("loop", &[][..]),
        ("woodpecker", &[]),
        ("three-discs", &["--events"]),
    ] {
        let place = Place::new();
        let args = [
            "run",
            scene,
            "--steps",
            "300",
            "--dump-problems",
            "deep/er",
            "--quiet",
        ];
        let (code, out, err) = place.run(&[&args[..], more].concat());
        assert_eq!((code, out.as_str(), err.as_str()), (0, "", ""), "{scene}");
        let files = place.listing("deep/er");
        assert!(!files.is_empty(), "{scene}");
        let first = format!("deep/er/{}", files[0]);
        assert_eq!(place.run(&["solve", &first]).0, 0, "{scene}");
    }
}

#[test]
fn dumping_changes_nothing_and_replaces_its_own_names_only() {
    let place = Place::new();
    let run = |more: &[&str]| {
        let args = [&["run", "pyramid", "--steps", "4", "--out", "r"][..], more].concat();
        assert_eq!(place.run(&args).0, 0);
        fs::read(place.path("r/contacts.csv")).unwrap()
    };
    let plain = run(&[]);
    fs::create_dir(place.path("d")).unwrap();
    place.write("d/notes.txt", "mine");
    place.write("d/step-000003-island-0001.json", "old");
    assert_eq!(run(&["--dump-problems", "d", "--dump-every", "3"]), plain);
    assert_eq!(
        place.listing("d"),
        ["notes.txt", "step-000003-island-0001.json"]
    );
    assert_eq!(
        contact(&place, "d/step-000003-island-0001.json").0.len(),
        200
    );
}

#[test]
fn dumps_that_cannot_be_are_refused() {
    let place = Place::new();
    place.write("file", "");
    for (args, words) in [
        (&["beam", "--dump-every", "2"][..], &["--dump-problems"][..]),
        (
            &["beam", "--dump-problems", "file"],
            &["file", "not a folder"],
        ),
        (
            &["beam", "--engine", "rapier", "--dump-problems", "d"],
            &["--dump-problems", "rapier", "moreau"],
        ),
        (
            &["thresher-study", "--dump-problems", "d"],
            &["--dump-problems", "thresher-study"],
        ),
    ] {
        place.refused(&[&["run"], args].concat(), words);
    }
}

/// `M = [2 1; 1 2]`, q = −1: z = (1, 1)/3.
const LCP: &str = "2\n0 2 2\n2 2\n2 1 1 2\n-1 -1\n";

/// One contact pressed at 3 m/s by `W = 2 1/kg`: P_N = 3/2.
const BOX: &str = "2 1\n0 2 2\n2 2\n2 0 0 2\n-3 0\n0.5\n";

#[test]
fn a_result_is_printed_written_or_kept_quiet() {
    let place = Place::new();
    place.write("box.txt", BOX);
    let (code, out, err) = place.run(&["solve", "box.txt", "--out", "new/r.json"]);
    assert_eq!((code, err.as_str()), (0, ""));
    for words in [
        "box.txt: contact problem, 1 contact\n",
        "solver auto: solved; 0 sweeps",
        "natural-map residual 0 (relative)",
        "tolerance 1e-8",
    ] {
        assert!(out.contains(words), "{words}: {out}");
    }
    let result = place.json("new/r.json");
    assert_eq!(numbers(&result["impulses"]), [1.5, 0.0]);
    for (key, value) in [
        ("kind", "contact"),
        ("solver", "auto"),
        ("status", "solved"),
    ] {
        assert_eq!(result[key], value);
    }
    assert_eq!(result["iterations"]["sweeps"], 0);
    assert_eq!(result["residual"], 0.0);
    let (code, out, err) = place.run(&["solve", "box.txt", "--json"]);
    assert_eq!((code, err.as_str()), (0, ""));
    assert_eq!(serde_json::from_str::<Value>(&out).unwrap(), result);
    let (code, out, err) = place.run(&["solve", "box.txt", "--quiet"]);
    assert_eq!((code, out.as_str(), err.as_str()), (0, "", ""));
    // every solver by its name; enumeration takes no tower
    for solver in ["auto", "enumeration", "nsgs", "direct", "lemke"] {
        let (code, out, _) = place.run(&["solve", "box.txt", "--solver", solver]);
        assert_eq!(code, 0, "{solver}: {out}");
    }
}

fn stored(boxes: usize) -> StoredProblem {
    StoredProblem::Contact {
        problem: tower(boxes, 0.5, |_| 1.0).problem(),
        solution: None,
    }
}

/// Ten feet under one box: 20 rows on three coordinates. The least shares are those of any solver.
#[test]
fn what_is_not_unique_is_told_and_shared_out_on_demand() {
    let place = Place::new();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/problems/");
    let feet = &format!("{data}box-ten-feet.json");
    let shares = |solver: &str, more: &[&str]| {
        let args = ["solve", feet, "--solver", solver, "--out", "r.json"];
        let (code, out, err) = place.run(&[&args[..], more].concat());
        assert_eq!((code, err.as_str()), (0, ""), "{solver}");
        assert!(out.contains("17 independent ways"), "{out}");
        let result = place.json("r.json");
        assert_eq!(result["self_stress"], 17);
        let asked = if more.is_empty() {
            "found"
        } else {
            "minimum-norm"
        };
        assert_eq!(result["shares"], asked);
        numbers(&result["impulses"])
    };
    let apart = |a: &[f64], b: &[f64]| {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let fine = ["--tolerance", "1e-12"];
    let (a, b) = (shares("lemke", &[]), shares("direct", &[]));
    assert!(apart(&a, &b) > 1e-3);
    let least = [&["--shares", "minimum-norm"][..], &fine].concat();
    let (a, b) = (shares("lemke", &least), shares("direct", &least));
    assert!(apart(&a, &b) < 1e-9, "{a:?} {b:?}");

    let steep = &format!("{data}painleve-three.json");
    let (code, out, _) = place.run(&["solve", steep, "--out", "r.json"]);
    assert_eq!(code, 0);
    assert!(out.contains("the motion may not be unique"), "{out}");
    assert_eq!(place.json("r.json")["steep_contacts"][0], 0);
    // 1600 closed rows: no word on uniqueness, but on what was asked for
    place.write("tall.json", to_json(&stored(400)).unwrap());
    let (code, out, _) = place.run(&["solve", "tall.json", "--shares", "minimum-norm"]);
    assert_eq!(code, 0);
    assert!(out.contains("too many closed rows"), "{out}");
    assert!(
        out.contains("; those of least norm") || out.contains("; none of smaller norm were found"),
        "{out}"
    );
    let (code, _, err) = place.run(&["solve", feet, "--shares", "least"]);
    assert_eq!(code, 1);
    assert!(err.contains("minimum-norm"), "{err}");
}

#[test]
fn not_solved_ends_with_two_and_says_why() {
    let place = Place::new();
    let tower = ["--set", "repeat.0.count=[1, 40]", "--steps", "1"];
    let args = [&["run", "tower", "--dump-problems", "d"], &tower[..]].concat();
    assert_eq!(place.run(&args).0, 0);
    let file = "d/step-000001-island-0001.json";
    let (code, out, _) = place.run(&["solve", file, "--solver", "enumeration", "--out", "r.json"]);
    assert_eq!(code, 2, "{out}");
    assert!(
        out.contains("unsolved") && out.contains("nothing was tried"),
        "{out}"
    );
    assert!(
        out.contains("the solution in the file has residual"),
        "{out}"
    );
    assert_eq!(place.json("r.json")["status"], "unsolved");
    // no Gauss-Seidel gets there in its budget
    let args = ["solve", file, "--solver", "nsgs", "--tolerance", "1e-14"];
    let (code, out, _) = place.run(&args);
    assert_eq!(code, 2, "{out}");
    assert!(
        out.contains("2000 sweeps") && !out.contains("nothing was tried"),
        "{out}"
    );
}

/// A mark before the text, as Windows editors write it, and their line ends.
#[test]
fn a_byte_order_mark_is_skipped() {
    let place = Place::new();
    let json = r#"{"kind": "lcp", "matrix": [[2]], "q": [-1]}"#;
    for text in [BOX, json] {
        let windows = format!("\u{feff}{}", text.replace('\n', "\r\n"));
        place.write("windows", windows);
        let (code, _, err) = place.run(&["solve", "windows"]);
        assert_eq!((code, err.as_str()), (0, ""));
    }
}

#[test]
fn a_warning_goes_to_standard_error_and_into_the_result() {
    let place = Place::new();
    place.write("box.dat", BOX.replace("2 0 0 2", "2 1 1.000001 2"));
    let (code, _, err) = place.run(&["solve", "box.dat", "--out", "r.json"]);
    assert_eq!(code, 0);
    assert!(err.starts_with("warning: W was symmetrised"), "{err}");
    let told = place.json("r.json")["warnings"][0].clone();
    assert!(err.contains(told.as_str().unwrap()), "{told}");
    // it sticks: the tangential row of the file, (1, 2), holds, not that of the symmetric part
    place.write(
        "rough.dat",
        BOX.replace("2 0 0 2", "2 1 1.000001 2").replace("0.5", "1"),
    );
    let tight = [
        "solve",
        "rough.dat",
        "--tolerance",
        "1e-13",
        "--out",
        "s.json",
    ];
    assert_eq!(place.run(&tight).0, 0);
    let p = numbers(&place.json("s.json")["impulses"]);
    assert!((p[0] + 2.0 * p[1]).abs() < 1e-12, "{p:?}");
}

#[test]
fn bad_input_ends_with_one_and_leaves_nothing() {
    let place = Place::new();
    place.write("box.dat", BOX);
    place.write("cut.dat", &BOX[..20]);
    place.write("empty.json", "\u{feff} \r\n");
    place.write("three.dat", BOX.replacen('2', "3", 1));
    place.write("bytes.dat", b"2 1\n\xff\xfe");
    place.write("fclib.hdf5", b"\x89HDF\r\n\x1a\n...");
    place.write("lcp.dat", LCP);
    fs::create_dir(place.path("folder")).unwrap();
    let cases: [(&[&str], &[&str]); 15] = [
        (&["none.dat"], &["none.dat"]),
        (&["folder"], &["folder"]),
        (&["cut.dat"], &["cut.dat: line 4", "end of the file"]),
        (&["three.dat"], &["three.dat: line 1", "three-dimensional"]),
        (&["bytes.dat"], &["bytes.dat: line 2", "not text"]),
        (&["fclib.hdf5"], &["fclib.hdf5", "HDF5"]),
        (&["box.dat", "--solver", "drect"], &["drect", "`direct`"]),
        (&["box.dat", "--tolerance", "0"], &["1e-15 to 1e-2"]),
        (&["box.dat", "--tolerance", "nan"], &["1e-15 to 1e-2"]),
        (&["box.dat", "--out", "folder"], &["folder"]),
        (
            &["box.dat", "--out", "./box.dat"],
            &["the problem file itself"],
        ),
        (&["empty.json"], &["empty.json: the file is empty"]),
        (
            &["box.dat", "--out", "box.dat/r.json"],
            &["box.dat", "not a folder"],
        ),
        (
            &["lcp.dat", "--solver", "nsgs"],
            &["nsgs", "lcp.dat", "lemke"],
        ),
        (&[], &["FILE"]),
    ];
    for (args, words) in cases {
        let all = [&["solve"], args, &["--out", "r.json"]].concat();
        let args = if args.contains(&"--out") {
            [&["solve"], args].concat()
        } else {
            all
        };
        place.refused(&args, words);
    }
}
