//! The failure atlas: our verdicts on its quick rungs, one by one, and the command as a user types it.

use crate::common::program::Place;
use moreau2d::experiment::{Atlas, Engine};
use moreau2d::report::{Progress, ResultRow, read_rows};
use moreau2d::scene::{AtlasEntry, atlas_entries};
use moreau2d::thresher::{load as load_machine, read_rung};
use std::collections::BTreeSet;
use std::fs;

/// Entry, rung, verdict and mode of ours. A change here is a change of what we can do: deliberate,
/// and said in the entry where it is for the worse.
const OURS: &str = include_str!("../data/atlas-quick.txt");

fn quiet() -> Progress {
    Progress::new("test", 1, true)
}

/// The first row of each rung and engine, in words.
fn verdicts(rows: &[ResultRow]) -> Vec<String> {
    let line = |r: &ResultRow| {
        let verdict = if r.verdict.is_empty() {
            "-"
        } else {
            &r.verdict
        };
        format!("{} | {} | {verdict} | {}", r.scene, r.rung, r.mode)
    };
    let mut lines: Vec<String> = rows.iter().map(line).collect();
    lines.dedup();
    lines
}

/// Without feature `f64` what needs it is skipped, with it all of it runs.
#[test]
fn our_verdicts_on_the_quick_rungs() {
    let atlas = Atlas::new(&[], true, read_rung).unwrap();
    let rows = atlas.run(&[Engine::Moreau], &quiet()).unwrap().rows;
    let found = verdicts(&rows);
    let expected: Vec<&str> = OURS.lines().collect();
    let missing: Vec<_> = expected
        .iter()
        .filter(|e| !found.iter().any(|f| f == *e))
        .collect();
    let new: Vec<_> = found
        .iter()
        .filter(|f| !expected.contains(&f.as_str()))
        .collect();
    if cfg!(feature = "f64") {
        // the same but for what could not run
        assert!(
            missing.iter().all(|m| m.ends_with("| - | skipped")),
            "missing {missing:#?}"
        );
        assert!(new.iter().all(|n| n.contains("| pass |")), "new {new:#?}");
    } else {
        assert!(
            missing.is_empty() && new.is_empty(),
            "missing {missing:#?}, new {new:#?}"
        );
        assert_eq!(found, expected, "in another order");
    }
    // a figure says what it is in: SI, or what it is a part of or counts
    for row in &rows {
        let bare = row.unit.is_empty() || row.unit == "1";
        assert!(!bare || row.measure == "verdict", "{row:?}");
    }
    // nothing that explodes, and what is not passed is explained
    for row in rows
        .iter()
        .filter(|r| r.verdict == "fail" || r.verdict == "unsolved")
    {
        assert_ne!(row.mode, "explodes", "{row:?}");
        let entry = AtlasEntry::load(&row.scene).unwrap();
        assert!(
            entry.explanation(&row.rung).is_some(),
            "{} {}",
            row.scene,
            row.rung
        );
    }
    // nine of ten, of those that run
    let ran = found.iter().filter(|l| !l.contains("| - |")).count();
    let passed = found.iter().filter(|l| l.contains("| pass |")).count();
    assert!(10 * passed >= 9 * ran, "{passed} of {ran}");
}

/// The whole atlas as it was run last: nine of ten rungs, nothing that explodes, nothing that is not
/// explained.
#[test]
fn the_committed_atlas_is_explained() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/benches/charts/atlas-results.csv"
    );
    let rows: Vec<ResultRow> = read_rows(path.as_ref()).unwrap();
    let ours: Vec<ResultRow> = rows.into_iter().filter(|r| r.engine == "moreau").collect();
    for entry in atlas_entries().unwrap() {
        assert!(ours.iter().any(|r| r.scene == entry.name), "{}", entry.name);
    }
    let lines = verdicts(&ours);
    let ran = lines.iter().filter(|l| !l.contains("| - |")).count();
    let passed = lines.iter().filter(|l| l.contains("| pass |")).count();
    assert!(ran >= 180 && 10 * passed >= 9 * ran, "{passed} of {ran}");
    for row in ours
        .iter()
        .filter(|r| r.verdict == "fail" || r.verdict == "unsolved")
    {
        assert_ne!(row.mode, "explodes");
        let entry = AtlasEntry::load(&row.scene).unwrap();
        assert!(
            entry.explanation(&row.rung).is_some(),
            "{} {}",
            row.scene,
            row.rung
        );
    }
}

/// A cause is of its own scene: a sentence with the figures of another explains nothing.
#[test]
fn no_two_entries_share_a_cause() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/benches/charts/atlas-results.csv"
    );
    let rows: Vec<ResultRow> = read_rows(path.as_ref()).unwrap();
    fn causes<'a>(entry: &'a AtlasEntry, rows: &[ResultRow]) -> BTreeSet<&'a str> {
        let rungs = rows.iter().filter(|r| r.scene == entry.name);
        rungs.filter_map(|r| entry.explanation(&r.rung)).collect()
    }
    let entries = atlas_entries().unwrap();
    let all: Vec<(&str, BTreeSet<&str>)> = entries
        .iter()
        .map(|e| (e.name.as_str(), causes(e, &rows)))
        .collect();
    assert!(all.iter().map(|(_, own)| own.len()).sum::<usize>() > 5);
    for (k, (name, own)) in all.iter().enumerate() {
        for (other, theirs) in &all[..k] {
            assert!(own.is_disjoint(theirs), "{name} and {other} share {own:?}");
        }
    }
}

/// A verdict of `pass` is what its measures say, and every rung is measured.
#[test]
fn every_pass_is_within_its_limits() {
    let names = [
        "tower",
        "zeno-ball",
        "initial-overlap",
        "stick-slip-incline",
    ]
    .map(str::to_owned);
    let atlas = Atlas::new(&names, true, read_rung).unwrap();
    let engines = Engine::ALL.map(|(_, engine)| engine);
    let rows = atlas.run(&engines, &quiet()).unwrap().rows;
    let mut failed = 0;
    for rung in rows.chunk_by(|a, b| a.scene == b.scene && a.rung == b.rung && a.engine == b.engine)
    {
        let holds = |r: &ResultRow| {
            let limit: f64 = r
                .reference
                .strip_prefix("at most ")
                .unwrap()
                .parse()
                .unwrap();
            r.value <= limit
        };
        let pass = rung[0].verdict == "pass";
        assert_eq!(rung.iter().all(holds), pass, "{rung:?}");
        assert!(
            rung.iter()
                .all(|r| r.verdict == rung[0].verdict && r.mode == rung[0].mode)
        );
        failed += usize::from(!pass);
    }
    // rapier's default sinks and creeps: a judge that passes all is none
    assert!(failed >= 5, "{failed}");
}

#[test]
fn all_but_the_times_is_the_same_again() {
    let atlas = Atlas::new(&["overhang".to_owned()], true, read_rung).unwrap();
    let run = || {
        let engines = [Engine::Moreau, Engine::RapierStiff];
        let mut rows = atlas.run(&engines, &quiet()).unwrap().rows;
        rows.iter_mut()
            .for_each(|r| r.seconds_per_simulated_second = None);
        // NaN is not equal to itself
        format!("{rows:?}")
    };
    assert_eq!(run(), run());
}

#[test]
fn the_command_writes_rows_picture_and_summary() {
    let place = Place::new();
    let (code, out, err) = place.run(&["atlas", "sliding-lift-off", "painleve", "--quick"]);
    assert_eq!(code, 0, "{err}");
    let files = ["atlas.svg", "results.csv", "summary.json"];
    assert_eq!(place.listing("out/atlas"), files);
    let rows: Vec<ResultRow> = read_rows(&place.path("out/atlas/results.csv")).unwrap();
    let engine = |name: &str, setting: &str| {
        rows.iter()
            .any(|r| r.engine == name && r.setting == setting)
    };
    assert!(engine("moreau", "default"));
    assert!(engine("rapier", "default") && engine("rapier-stiff", "stiff"));
    let svg = fs::read_to_string(place.path("out/atlas/atlas.svg")).unwrap();
    assert!(!svg.contains("NaN"));
    for row in &rows {
        assert!(
            svg.contains(&row.scene) && svg.contains(&row.rung),
            "{row:?}"
        );
    }
    // what rapier has not the parts for is told, and is no failure
    assert!(out.contains("rapier cannot"), "{out}");
    assert!(
        out.contains("moreau: 18 of 18 rungs passed (100 %)"),
        "{out}"
    );
    let summary = place.json("out/atlas/summary.json");
    assert_eq!(summary["engines"][0]["pass"], 18);
    assert_eq!(summary["engines"][1]["none"], 15);
    assert_eq!(summary["not_passed"].as_array().unwrap().len(), 0);
}

/// A rung that ours does not pass: exit code 2, and a sentence.
#[test]
fn a_failure_of_ours_is_said() {
    let place = Place::new();
    let (code, out, err) = place.run(&["atlas", "zeno-ball", "--quick", "--out", "a"]);
    assert_eq!(code, 2, "{err}");
    let entry = AtlasEntry::load("zeno-ball").unwrap();
    assert!(out.contains(entry.explanation("e 0.5").unwrap()), "{out}");
    // the figure in the table has its unit
    assert!(out.contains("relative error)"), "{out}");
    let summary = place.json("a/summary.json");
    assert_eq!(summary["not_passed"][0]["verdict"], "fail");
    let (code, out, _) = place.run(&["atlas", "zeno-ball", "--quick", "--json", "--out", "b"]);
    let printed: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, &printed["not_passed"]), (2, &summary["not_passed"]));
    let (_, out, err) = place.run(&["atlas", "zeno-ball", "--quick", "--quiet"]);
    assert_eq!((out.as_str(), err.as_str()), ("", ""));
}

#[test]
fn bad_input_is_refused_and_nothing_is_written() {
    let place = Place::new();
    place.write("taken", "a file");
    for (args, says) in [
        (&["atlas", "towr"][..], "did you mean `tower`?"),
        (&["atlas", "tower", "xyz"], "no entry `xyz`"),
        (&["atlas", "--quik"], "--quick"),
        (
            &["atlas", "tower", "--quick", "--out", "taken"],
            "not a folder",
        ),
    ] {
        place.refused(args, &[says]);
    }
}

/// Every entry of the reference cases' table is there, and has rungs, some of them quick; every file
/// of the folder is an entry.
#[test]
fn entries_are_whole() {
    let entries = atlas_entries().unwrap();
    let names: BTreeSet<String> = entries.iter().map(|e| e.name.clone()).collect();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/atlas");
    let files = fs::read_dir(folder).unwrap().map(|f| f.unwrap().path());
    let stem = |path: std::path::PathBuf| path.file_stem().unwrap().to_str().unwrap().to_owned();
    assert_eq!(files.map(stem).collect::<BTreeSet<_>>(), names);
    assert!(names.len() == entries.len() && names.len() >= 33);
    for entry in &entries {
        assert!(!entry.block.shows.is_empty() && !entry.block.passes.is_empty());
        let names = [entry.name.clone()];
        let all = Atlas::new(&names, false, read_rung).unwrap().rungs();
        let quick = Atlas::new(&names, true, read_rung).unwrap().rungs();
        assert!(quick <= all && all > 0, "{}", entry.name);
    }
}

/// Every rung of every entry is a scene that `run` takes and can build, no two of an entry the same.
#[test]
fn every_rung_is_a_scene() {
    let mut count = 0;
    for entry in atlas_entries().unwrap() {
        let mut hashes = BTreeSet::new();
        for rung in &entry.block.rungs {
            let name = format!("atlas/{}:{}", entry.name, rung.name);
            let (scene, machine) =
                load_machine(&name, &[]).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(scene, read_rung(&entry, rung).unwrap().0, "{name}");
            let flags = ["step.dt=0.001".to_owned()];
            assert_eq!(
                load_machine(&name, &flags).unwrap().0.step.dt,
                0.001,
                "{name}"
            );
            let same = !hashes.insert(scene.hash);
            // the wedge's flags are asked of a scene that it has already
            assert!(!same || rung.name == "shares flagged", "{name}");
            if machine.is_none() {
                assert!(scene.build().unwrap().bodies() > 0, "{name}");
            }
            count += 1;
        }
    }
    assert!(count >= 180, "{count}");
}

/// The figures of `run` are those of the atlas, for ours and for a peer.
#[test]
fn a_rung_runs_as_in_the_atlas() {
    let place = Place::new();
    let atlas = Atlas::new(&["bullet".to_owned()], true, read_rung).unwrap();
    for (name, engine) in [("moreau", Engine::Moreau), ("rapier", Engine::Rapier)] {
        let rows = atlas.run(&[engine], &quiet()).unwrap().rows;
        for rung in ["disc, 20 m/s", "spin 300 rad/s"] {
            let scene = format!("atlas/bullet:{rung}");
            let (code, _, err) = place.run(&["run", &scene, "--engine", name, "--quiet"]);
            assert_eq!(code, 0, "{err}");
            let totals = &place.json("out/bullet/summary.json")["totals"];
            let row = |r: &&ResultRow| r.rung == rung && r.measure == "penetration";
            let depth = rows.iter().find(row).unwrap().value;
            assert_eq!(totals["worst_penetration_m"], depth, "{name} {rung}");
            assert!(depth > 0.0 || engine == Engine::Moreau, "{name} {rung}");
        }
    }
    let (code, out, _) = place.run(&["scenes", "--atlas"]);
    assert!(code == 0 && out.contains("atlas/gears: ") && out.contains("    :12:24\n"));
}

/// An entry of one's own, a file: run, and refused with what is wrong in it.
#[test]
fn a_file_is_an_entry() {
    let place = Place::new();
    let text = |rungs: &str, checks: &str| {
        format!(
            "[atlas]\nshows = \"a tower\"\npasses = \"it stands\"\nbase = \"tower\"\n\
             judges = [{{ name = \"stands\", checks = [{checks}] }}]\nrungs = [{rungs}]\n"
        )
    };
    let rungs = "{ name = \"two\", set.repeat.box.count = [1, 2], set.step.time = 0.1 }";
    let check = "{ measure = \"penetration\", limit = 1e-4 }";
    place.write("mine.toml", text(rungs, check));
    let (code, out, err) = place.run(&["atlas", "mine.toml"]);
    assert!(
        code == 0 && out.contains("1 of 1 rungs passed"),
        "{out} {err}"
    );
    let (code, _, err) = place.run(&["run", "mine.toml:two", "--quiet"]);
    assert_eq!(code, 0, "{err}");
    for (scene, says) in [
        (
            "mine.toml",
            "say which rung of the entry, as in NAME:two; known: two",
        ),
        ("mine.toml:twoo", "unknown rung `twoo`; did you mean `two`?"),
        ("atlas/towr:10", "did you mean `tower`?"),
        ("atlas/tower:5", "unknown rung `5`; did you mean `50`?"),
    ] {
        place.refused(&["run", scene], &[says]);
    }
    let twice = format!("{rungs}, {rungs}");
    for (rungs, checks, says) in [
        (
            rungs,
            "{ measure = \"leen\" }",
            "unknown measure `leen`; did you mean `lean`?",
        ),
        (rungs, "{ measure = \"lean\" }", "needs `height`"),
        (
            rungs,
            "{ measure = \"penetration\", sise = 1 }",
            "did you mean `size`?",
        ),
        (
            rungs,
            "{ measure = \"below\", body = \"bix[0,0]\" }",
            "did you mean `box[0,0]`?",
        ),
        (&twice, check, "there is already a rung named `two`"),
        (
            "{ name = \"a\", judge = \"falls\" }",
            check,
            "unknown judge `falls`",
        ),
        (
            "{ name = \"a\", slo = true }",
            check,
            "did you mean `slow`?",
        ),
        (
            "{ name = \"a\", set.step.dtt = 1 }",
            check,
            "with rung `a`: step.dtt: unknown key",
        ),
        (
            "{ name = \"a\", set.body = { generate = \"slab\" } }",
            check,
            "did you mean `slabs`?",
        ),
        (
            "{ name = \"a\", set.body = { generate = \"slabs\" } }",
            check,
            "missing key `count",
        ),
        ("", check, "missing key `judges, rungs`"),
    ] {
        place.write("mine.toml", text(rungs, checks));
        place.refused(&["atlas", "mine.toml"], &[says]);
    }
}
