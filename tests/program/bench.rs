//! `moreau2d bench` as a user types it. The arithmetic of profile and growth is tested where it is.

use crate::common::program::Place;
use moreau2d::oracles::SOLVERS;
use moreau2d::report::{Performance, PerformanceRow, ResultRow, read_rows};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;

/// A folder with the problems of three steps of a tower in `p`.
fn with_problems() -> Place {
    let place = Place::new();
    let args = ["run", "tower", "--steps", "3", "--dump-problems", "p"];
    assert_eq!(place.run(&args).0, 0);
    assert_eq!(place.listing("p").len(), 3);
    place
}

/// `bench --solvers` on `p`, results in `r`.
fn bench(place: &Place, flags: &[&str]) -> (i32, String, String) {
    let args = ["bench", "--solvers", "--problems", "p", "--out", "r"];
    place.run(&[&args[..], flags].concat())
}

fn rows(place: &Place) -> Vec<ResultRow> {
    read_rows(&place.path("r/results.csv")).unwrap()
}

/// An LCP, and a contact problem of one block, in the text format.
const LCP: &str = "2\n0 2 2\n2 2\n1 0 0 1\n-1 -1\n";
const BLOCK: &str = "2 1\n0 2 2\n2 2\n1 0 0 1\n-1 0.1\n0.5\n";

const MEASURES: [&str; 6] = [
    "solve-time",
    "residual",
    "sweeps",
    "factorisations",
    "pivots",
    "blocks",
];

#[test]
fn every_solver_is_in_the_table_the_profile_and_the_picture() {
    let place = with_problems();
    place.write("p/lcp.dat", LCP);
    place.write("p/index.csv", "file,expected\n");
    let (code, out, err) = bench(&place, &["--repeats", "2"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("note: 1 plain LCPs left out"), "{out}");
    let header = fs::read_to_string(place.path("r/results.csv")).unwrap();
    assert_eq!(
        header.lines().next().unwrap(),
        "scene,rung,engine,scheme,solver,setting,dt_s,threads,precision,measure,value,unit,\
         reference,seconds_per_simulated_second,spread,verdict,mode"
    );
    let rows = rows(&place);
    let keys: BTreeSet<(&str, &str, &str)> = rows
        .iter()
        .map(|r| (&*r.scene, &*r.solver, &*r.measure))
        .collect();
    assert_eq!(keys.len(), rows.len(), "no row twice");
    for step in 1..=3 {
        let scene = format!("step-{step:06}-island-0001");
        for solver in SOLVERS {
            for measure in MEASURES {
                assert!(
                    keys.contains(&(&scene, solver, measure)),
                    "{scene} {solver} {measure}"
                );
            }
        }
    }
    assert_eq!(rows.len(), 3 * SOLVERS.len() * MEASURES.len());
    for row in &rows {
        assert!(row.value.is_finite(), "{row:?}");
        assert!(["pass", "unsolved"].contains(&row.verdict.as_str()));
        // a tower of ten boxes is beyond enumeration, and nothing else is untried
        assert_eq!(row.mode == "untried", row.solver == "enumeration");
        assert_eq!(row.setting, "tolerance 1e-8");
        if row.measure == "residual" && row.verdict == "pass" {
            assert!(row.value <= 1e-8, "{row:?}");
        }
        if row.solver == "auto" {
            assert_eq!(row.verdict, "pass", "{row:?}");
        }
    }
    // profile and picture are drawn from the rows alone
    let performance = Performance::new(&rows);
    let profile: Vec<PerformanceRow> = read_rows(&place.path("r/performance-profile.csv")).unwrap();
    assert_eq!(profile, performance.profile());
    let svg = fs::read_to_string(place.path("r/performance-profile.svg")).unwrap();
    assert!(
        svg == performance.chart().to_svg().unwrap(),
        "not of the rows"
    );
    assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"));
    for solver in SOLVERS {
        assert!(profile.iter().any(|r| r.solver == solver), "{solver}");
        assert!(svg.contains(&format!("{solver}: ")), "{solver}");
        assert!(out.contains(solver), "{solver}: {out}");
    }
    assert!(
        out.contains("solved of 3") && out.contains("cheapest"),
        "{out}"
    );
}

/// Everything but the clock is the same again.
#[test]
fn a_second_bench_differs_in_its_times_alone() {
    let place = with_problems();
    let values = || -> Vec<(String, u64)> {
        assert_eq!(bench(&place, &["--repeats", "1", "--quiet"]).0, 0);
        let rows = rows(&place);
        let counted = rows.iter().filter(|r| r.measure != "solve-time");
        counted
            .map(|r| {
                let key = format!("{} {} {} {}", r.scene, r.solver, r.measure, r.verdict);
                (key, r.value.to_bits())
            })
            .collect()
    };
    let first = values();
    assert_eq!(first.len(), 3 * SOLVERS.len() * (MEASURES.len() - 1));
    assert_eq!(first, values());
    // a single timing has no spread
    assert!(rows(&place).iter().all(|r| r.spread.is_none()));
}

/// What no solver solves is in the results and ends with 0 all the same.
#[test]
fn failing_solvers_are_no_failure_of_the_program() {
    let place = Place::new();
    fs::create_dir(place.path("p")).unwrap();
    // pressed onto the floor by a velocity that no impulse changes
    place.write("p/stuck.dat", BLOCK.replace("1 0 0 1", "0 0 0 1"));
    place.write("p/block.dat", BLOCK);
    let (code, out, err) = bench(&place, &["--json", "--tolerance", "1e-10"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let summary: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        out,
        fs::read_to_string(place.path("r/summary.json")).unwrap()
    );
    assert_eq!(summary["settings"]["tolerance"], 1e-10);
    assert_eq!(
        (&summary["all"]["problems"], &summary["all"]["unsolved"]),
        (&2.into(), &1.into())
    );
    assert_eq!(summary["by_blocks"][0]["blocks"], "1");
    assert_eq!(summary["by_blocks"][0]["problems"], 2);
    for (solver, score) in SOLVERS.iter().zip(0..) {
        let score = &summary["all"]["solvers"][score];
        assert_eq!(&score["solver"], solver);
        assert_eq!(score["solved"], 1, "{solver}");
    }
    let rows = rows(&place);
    let stuck = rows.iter().filter(|r| r.scene == "stuck");
    assert!(stuck.clone().count() > 0 && stuck.clone().all(|r| r.verdict == "unsolved"));
    assert!(rows.iter().all(|r| r.setting == "tolerance 1e-10"));
}

#[test]
fn problems_of_one_name_are_told_apart() {
    let place = Place::new();
    fs::create_dir(place.path("p")).unwrap();
    place.write("p/a.dat", BLOCK);
    place.write("p/b.c.dat", BLOCK);
    place.write(
        "p/a.json",
        "{\"kind\": \"contact\", \"operator\": {\"dense\": [[1, 0], [0, 1]]}, \
         \"free\": [[-1, 0]], \"laws\": [{\"contact\": {\"friction\": 0.5}}]}",
    );
    assert_eq!(bench(&place, &["--repeats", "1", "--quiet"]).0, 0);
    let names: BTreeSet<String> = rows(&place).into_iter().map(|r| r.scene).collect();
    assert_eq!(
        names,
        BTreeSet::from(["a.dat", "a.json", "b.c"].map(str::to_owned))
    );
}

/// In a folder without stored problems those of the catalogue's scenes are solved, and this is said.
#[test]
fn solvers_are_measured_in_any_folder() {
    let place = Place::new();
    let (code, out, err) = place.run(&["bench", "--solvers", "--repeats", "1", "--out", "b"]);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("tests/data/problems is not here"), "{out}");
    let summary = place.json("b/summary.json");
    assert_eq!(summary["settings"]["problems"], "of the catalogue");
    let all = &summary["all"];
    assert!(all["problems"].as_u64().unwrap() >= 15, "{all}");
    let solvers = all["solvers"].as_array().unwrap();
    let auto = solvers.iter().find(|s| s["solver"] == "auto").unwrap();
    assert_eq!(auto["solved"], all["problems"]);
}

#[test]
fn bad_input_is_refused_and_leaves_nothing() {
    let place = Place::new();
    for folder in ["empty", "lcps", "broken"] {
        fs::create_dir(place.path(folder)).unwrap();
    }
    place.write("empty/index.csv", "file\n");
    place.write("lcps/lcp.dat", LCP);
    place.write("broken/a.dat", BLOCK);
    place.write("broken/b.dat", BLOCK.replace("-1 0.1", "-1 x"));
    place.write("file.json", "{}");
    let cases: [(&[&str], &[&str]); 8] = [
        (
            &["bench", "--solvers", "tower"],
            &["tower", "--problems DIR"],
        ),
        (
            &["bench", "--solvers", "--problems", "none"],
            &["none", "no such folder", "--dump-problems"],
        ),
        (
            &["bench", "--solvers", "--problems", "file.json"],
            &["file.json", "not a folder"],
        ),
        (
            &["bench", "--solvers", "--problems", "empty"],
            &["empty", "no problem files", "--dump-problems"],
        ),
        (
            &["bench", "--solvers", "--problems", "lcps"],
            &["lcps", "plain LCPs only", "lemke"],
        ),
        (
            &["bench", "--solvers", "--problems", "broken"],
            &["broken/b.dat: line 5: expected", "x"],
        ),
        (
            &["bench", "--solvers", "--tolerance", "1"],
            &["must be 1e-15 to 1e-2"],
        ),
        (&["bench", "--solvers", "--repeats", "0"], &["1..=100"]),
    ];
    for (args, words) in cases {
        place.refused(args, words);
    }
}

/// Two sizes of a scene, both engines: time, phases and what the steps are worth, from one file.
#[test]
fn throughput_has_phases_quality_and_sizes() {
    let place = Place::new();
    let args = "bench tower pyramid --steps 4 --settle 2 --against rapier,rapier-stiff --out r";
    let (code, out, err) = place.run(&args.split(' ').collect::<Vec<_>>());
    assert_eq!(code, 0, "{err}");
    let rows = rows(&place);
    let engines = ["moreau", "rapier", "rapier-stiff"];
    for scene in ["tower", "pyramid"] {
        for engine in engines {
            let value = |measure: &str| {
                // ours is measured twice: at rest it has no phases of a solve
                let mut own = rows.iter().filter(|r| {
                    (&*r.scene, &*r.engine, &*r.measure) == (scene, engine, measure)
                        && r.setting.contains("rest solved") == (engine == "moreau")
                });
                let row = own
                    .next()
                    .unwrap_or_else(|| panic!("{engine}: no {measure}"));
                assert!(own.next().is_none(), "{engine}: two of {measure}");
                row.value
            };
            let step = value("step-time");
            assert!(step > 0.0 && value("contacts") > 0.0);
            if engine == "moreau" {
                let phases = ["detection", "assembly", "solve", "record", "write"];
                let each = phases.map(|phase| value(&format!("{phase}-time")));
                assert!(each.iter().all(|t| *t > 0.0), "{each:?}");
                assert!(value("residual") <= 1e-8 && value("unsolved-islands") == 0.0);
                assert!(value("penetration") < 1e-9);
            } else {
                // its soft contacts sink under what stands on them
                assert!(value("penetration") > 1e-6 && value("contact-sweeps") > 0.0);
            }
            assert!(out.contains(scene) && out.contains(engine), "{out}");
        }
    }
    let kept = |r: &&ResultRow| r.engine == "moreau" && !r.setting.contains("rest solved");
    assert!(rows.iter().filter(kept).count() >= 2, "both ways of ours");
    // one size each: no growth can be told
    assert!(rows.iter().all(|r| r.measure != "growth"));
    let summary = fs::read_to_string(place.path("r/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["settings"]["steps"], 4);
}

/// A quick bench times contacts, not free fall: every scene has settled so far.
#[test]
fn a_quick_bench_has_contacts_everywhere() {
    let place = Place::new();
    let (code, out, err) = place.run(&["bench", "--quick", "--out", "r"]);
    assert_eq!(code, 0, "{err}");
    let rows = rows(&place);
    let scenes: BTreeSet<&str> = rows.iter().map(|r| r.scene.as_str()).collect();
    assert_eq!(
        scenes,
        BTreeSet::from(["drum", "many-pyramids", "tower", "wall"]),
        "{out}"
    );
    for scene in scenes {
        for engine in ["moreau", "rapier"] {
            let own = |r: &&ResultRow| (&*r.scene, &*r.engine) == (scene, engine);
            let contacts = rows.iter().filter(own).find(|r| r.measure == "contacts");
            let contacts = contacts.unwrap().value;
            // of the drum's two hundred discs each lies on something
            let least = if scene == "drum" { 150.0 } else { 10.0 };
            assert!(contacts > least, "{scene} {engine}: {contacts}");
        }
    }
}

#[test]
fn what_cannot_be_measured_is_said() {
    let place = Place::new();
    for (args, words) in [
        ("bench towr", &["unknown scene", "`tower`"][..]),
        ("bench thresher", &["wear scene"]),
        ("bench woodpecker", &["--engine rapier", "only moreau"]),
        ("bench tower --against rapir", &["rapir"]),
        ("bench tower --time 3", &["--time", "--steps"]),
        ("bench --solvers --dt 0.1", &["nothing is stepped"]),
        ("bench --solvers --tolerance 7", &["--tolerance 7"]),
        ("bench tower --repeats 3", &["--solvers"]),
    ] {
        place.refused(&args.split(' ').collect::<Vec<_>>(), words);
    }
}
