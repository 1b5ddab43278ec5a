//! `sweep` and `merge`: many cases of a scene, in parts, killed and gone on with.

use crate::common::program::Place;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Stdio;

/// 24 short cases.
const SLIDING: &str = include_str!("../../scenes/sweeps/sliding-block.toml");

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

/// The table has the keys that vary and what the summaries say: here the closed form of a sliding block.
#[test]
fn the_table_has_keys_and_results() {
    let place = alone(SLIDING);
    let head = place.header("table/sweep.csv");
    let head: Vec<&str> = head.split(',').collect();
    assert_eq!(
        head[..5],
        [
            "case",
            "gravity.magnitude",
            "body.block.velocity.0",
            "held",
            "why"
        ]
    );
    let column = |name: &str| head.iter().position(|other| *other == name).unwrap();
    let rows = place.rows("table/sweep.csv");
    assert_eq!(rows.len(), 24);
    for row in &rows {
        let number = |k: usize| row[k].parse::<f64>().unwrap();
        let (gravity, speed) = (number(1), number(2));
        let exact = speed * speed / (2.0 * 0.5 * gravity);
        let computed = number(column("measures.distance.computed"));
        // the step's own error at 1/60 s
        assert!((computed / exact - 1.0).abs() < 1e-2, "{row:?} {exact}");
        assert_eq!(row[3], "true");
        // where the block is at the end, at rest
        let x = number(column("end.block.x_m"));
        assert!((x / exact - 1.0).abs() < 1e-2, "{x} {exact}");
        assert!(number(column("end.block.vx_m_s")).abs() < 1e-9);
    }
    let picture = fs::read_to_string(place.path("table/measures.distance.computed.svg")).unwrap();
    assert!(picture.contains("gravity.magnitude") && picture.contains("body.block.velocity.0"));
    // a case is what `run` gives with the same changes
    let summary = place.json(&format!("alone/{}/summary.json", rows[0][0]));
    let set = [
        "step.time=4",
        "gravity.magnitude=4",
        "body.block.velocity.0=3",
    ];
    let set = set.iter().flat_map(|set| ["--set", set]);
    let args: Vec<&str> = ["run", "sliding-block", "--out", "r"]
        .into_iter()
        .chain(set)
        .collect();
    done(&place, &args);
    assert_eq!(place.json("r/summary.json"), summary);
}

/// Killed at 30 moments, each when another number of cases is there. A last case, which takes minutes, keeps
/// the sweep at work until it is killed.
#[test]
fn a_killed_sweep_goes_on_and_loses_at_most_a_case_for_each_job() {
    let case = |time: f64, gravity: f64, speed: f64| {
        format!(
            "[[case]]\n\"step.time\" = {time}\n\"step.dt\" = 0.004\n\"gravity.magnitude\" = {gravity}\n\
             \"body.block.velocity.0\" = {speed}\n"
        )
    };
    let mut plan = "scene = \"sliding-block\"\n".to_owned();
    for gravity in [4.0, 6.0, 8.0, 9.81, 12.0, 16.0] {
        plan.extend([3.0, 4.0, 5.0, 6.0].map(|speed| case(20.0, gravity, speed)));
    }
    let place = alone(&plan);
    let whole = tree(&place.path("alone"));
    place.write("long.toml", plan + &case(1e5, 4.0, 3.0));
    let mut kills = 0;
    for (folder, jobs, moments) in [
        ("one", "1", (0..24).step_by(2).collect::<Vec<usize>>()),
        ("two", "2", (0..24).step_by(3).collect()),
        ("more", "2", (1..24).step_by(3).collect()),
        ("last", "1", vec![22, 23]),
    ] {
        for moment in moments {
            let mut command = place.command(&[
                "sweep",
                "long.toml",
                "--jobs",
                jobs,
                "--out",
                folder,
                "--quiet",
            ]);
            let mut child = command.stderr(Stdio::null()).spawn().unwrap();
            let there = || match place.path(folder).exists() {
                true => cases(&place, folder),
                false => Vec::new(),
            };
            while there().len() < moment && child.try_wait().unwrap().is_none() {
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            let before = there();
            // kill -9
            child.kill().unwrap();
            let code = child.wait().unwrap().code();
            assert_eq!(code, None, "was done before the signal");
            let after = there();
            assert!(after.len() >= moment && before.iter().all(|case| after.contains(case)));
            // what is there is whole
            for case in &after {
                let name = |file: &str| format!("{folder}/{case}/{file}");
                let files = [name("case.json"), name("summary.json")];
                for file in files {
                    let content = fs::read(place.path(&file)).unwrap();
                    assert!(whole[file.split_once('/').unwrap().1] == content, "{file}");
                }
            }
            kills += 1;
        }
        let there = cases(&place, folder).len();
        let long = place.json(&format!("{folder}/plan.json"))["cases"][24]["case"].clone();
        let args = ["sweep", "plan.toml", "--jobs", jobs, "--out", folder];
        let (code, out, err) = place.run(&args);
        assert_eq!(code, 0, "{err}");
        assert!(err.contains("has cases of another plan") && err.lines().count() == 1);
        if there > 0 {
            assert!(
                out.contains(&format!("\n{there} were done before\n")),
                "{out}"
            );
        }
        // with nothing hidden left behind but the long case, which is of the other plan
        let long = format!(".{}-", long.as_str().unwrap());
        for name in place
            .listing(folder)
            .iter()
            .filter(|name| name.starts_with(&long))
        {
            fs::remove_dir_all(place.path(&format!("{folder}/{name}"))).unwrap();
        }
        assert!(tree(&place.path(folder)) == whole, "{folder}");
    }
    assert_eq!(kills, 30);
}

#[test]
fn damaged_cases_are_named_and_run_again() {
    let place = alone(SLIDING);
    let whole = tree(&place.path("alone"));
    let names = cases(&place, "alone");
    let file = |k: usize, file: &str| format!("alone/{}/{file}", names[k]);
    let text = fs::read_to_string(place.path(&file(0, "summary.json"))).unwrap();
    place.write(&file(0, "summary.json"), &text[..100]);
    fs::remove_file(place.path(&file(1, "summary.json"))).unwrap();
    fs::remove_file(place.path(&file(2, "case.json"))).unwrap();
    place.write(&file(3, "case.json"), "{}");
    place.write(&file(4, "summary.json"), text.replace("2.0", "2.1"));
    fs::copy(
        place.path(&file(6, "case.json")),
        place.path(&file(5, "case.json")),
    )
    .unwrap();
    let expected = [
        (0, "summary.json has 100 bytes of"),
        (1, "summary.json is missing"),
        (2, "case.json is missing"),
        (3, "case.json cannot be read: missing field"),
        (4, "summary.json "),
        (5, "case.json is that of case"),
    ];
    // a table without them, which says so
    let (code, out, err) = place.run(&["merge", "alone", "--out", "less"]);
    assert_eq!(code, 2, "{out}{err}");
    assert!(out.contains("18 cases, 18 held\n"), "{out}");
    assert_eq!(place.rows("less/sweep.csv").len(), 18);
    for (k, why) in expected {
        let line = format!("damaged: {}, alone/{}: {why}", names[k], names[k]);
        assert!(out.contains(&line), "{line}\n{out}");
    }
    let (code, out, err) = place.run(&["sweep", "plan.toml", "--out", "alone"]);
    assert_eq!(code, 0, "{out}{err}");
    assert!(out.contains("18 were done before"), "{out}");
    assert_eq!(err.lines().count(), 6, "{err}");
    for (k, why) in expected {
        let line = format!("note: alone/{} is damaged: {why}", names[k]);
        assert!(err.contains(&line), "{line}\n{err}");
    }
    assert!(tree(&place.path("alone")) == whole);
}

#[test]
fn results_of_several_versions_and_of_other_plans_make_no_table() {
    let place = alone(SLIDING);
    let version = format!("\"version\": \"{}\"", env!("CARGO_PKG_VERSION"));
    let older = |file: &str| {
        let text = fs::read_to_string(place.path(file)).unwrap();
        assert!(text.contains(&version), "{text}");
        place.write(file, text.replace(&version, "\"version\": \"0.0.9\""));
    };
    done(
        &place,
        &["sweep", "plan.toml", "--shard", "1/24", "--out", "old"],
    );
    older("old/plan.json");
    place.refused(
        &["merge", "alone", "old", "--out", "t"],
        &["old: version is 0.0.9, in alone", "one version"],
    );
    // a single case of another version
    done(
        &place,
        &["sweep", "plan.toml", "--shard", "1/24", "--out", "mixed"],
    );
    let case = &cases(&place, "mixed")[0];
    older(&format!("mixed/{case}/case.json"));
    place.refused(
        &["merge", "mixed", "--out", "t"],
        &[&format!("mixed/{case}: version is 0.0.9, of the sweep")],
    );
    // a sweep runs it again
    let args = ["sweep", "plan.toml", "--shard", "1/24", "--out", "mixed"];
    let (code, _, err) = place.run(&args);
    assert_eq!(code, 0, "{err}");
    assert_eq!(
        err,
        format!("note: mixed/{case} is of version 0.0.9; it is run again\n")
    );
    let (code, out, _) = place.run(&["merge", "mixed", "--out", "t"]);
    assert!(code == 2 && out.contains("1 case, 1 held"), "{out}");
    // the plan of another version is said, and replaced
    let (code, _, err) = place.run(&["sweep", "plan.toml", "--shard", "1/24", "--out", "old"]);
    assert_eq!(code, 0, "{err}");
    assert!(
        err.contains("note: old has cases of another plan (scene sliding-block, version 0.0.9)")
    );
    place.write(
        "other.toml",
        "scene = \"sliding-block\"\n[grid]\n\"step.dt\" = [0.01]\n",
    );
    done(&place, &["sweep", "other.toml", "--out", "other"]);
    place.refused(
        &["merge", "alone", "other", "--out", "t"],
        &["other: keys is step.dt, in alone gravity.magnitude, body.block.velocity.0"],
    );
    place.refused(
        &["merge", "none", "--out", "t"],
        &["none/plan.json", "No such file"],
    );
    place.write("alone/plan.json", "{");
    place.refused(
        &["merge", "alone", "--out", "t"],
        &["alone/plan.json: is no plan of a sweep"],
    );
    place.refused(&["merge", "--out", "t"], &["<DIR>"]);
    // a case with a value too few
    let mut plan = place.json("mixed/plan.json");
    plan["cases"][3]["values"].as_array_mut().unwrap().pop();
    place.write("mixed/plan.json", plan.to_string());
    place.refused(
        &["merge", "mixed", "--out", "t"],
        &["mixed/plan.json: case ", " has 1 value for 2 keys"],
    );
    let args = ["sweep", "plan.toml", "--shard", "1/24", "--out", "mixed"];
    let (code, out, err) = place.run(&args);
    assert!(
        code == 0 && out.contains("1 were done before"),
        "{out}{err}"
    );
    let (code, out, _) = place.run(&["merge", "mixed", "--out", "t"]);
    assert!(code == 2 && out.contains("1 case, 1 held"), "{out}");
}

/// Equal cases, and values that are the same number, are one case that the summary counts.
#[test]
fn equal_cases_run_once_and_are_told() {
    let place = Place::new();
    let case = |dt: &str| format!("[[case]]\n\"step.dt\" = {dt}\n");
    let plan = |cases: &[&str]| {
        let cases: String = cases.iter().map(|dt| case(dt)).collect();
        place.write("plan.toml", format!("scene = \"sliding-block\"\n{cases}"));
    };
    plan(&["0.01", "0.02", "0.01", "1e-2"]);
    let out = done(&place, &["sweep", "plan.toml", "--out", "s"]);
    let told = "\n4 cases over step.dt, 2 the same as one before and not run again\n2 held";
    assert!(out.contains(told), "{out}");
    assert_eq!(cases(&place, "s").len(), 2);
    plan(&["0.01"]);
    let out = done(&place, &["sweep", "plan.toml", "--out", "one"]);
    assert!(out.contains("\n1 case over step.dt\n1 held"), "{out}");
}

/// Columns whose names are one name to some file systems.
#[test]
fn pictures_of_alike_columns_have_names_of_their_own() {
    let place = Place::new();
    let body = |name: &str, x: f64| {
        format!("[[body]]\nname = \"{name}\"\ndisc = 0.5\nposition = [{x}, 0]\n")
    };
    let bodies = body("ab", 0.0) + &body("ab-2", 5.0) + &body("AB", 10.0);
    let scene = format!("[scene]\nname = \"alike\"\ntitle = \"t\"\n{bodies}");
    place.write("alike.toml", scene);
    place.write(
        "plan.toml",
        "scene = \"alike.toml\"\n[grid]\n\"step.time\" = [0.1, 0.2]\n",
    );
    done(&place, &["sweep", "plan.toml", "--out", "s"]);
    let columns = ["end.ab.y_m", "end.ab-2.y_m", "end.AB.y_m"];
    let mut args = vec!["merge", "s", "--out", "t"];
    args.extend(columns.iter().flat_map(|column| ["--draw", column]));
    done(&place, &args);
    let names = ["end.ab.y_m.svg", "end.ab-2.y_m.svg", "end.AB.y_m-2.svg"];
    assert_eq!(
        place.json("t/summary.json")["pictures"],
        serde_json::json!(names)
    );
    for (name, column) in names.iter().zip(columns) {
        let picture = fs::read_to_string(place.path(&format!("t/{name}"))).unwrap();
        assert!(picture.contains(column), "{name} lacks {column}");
    }
}

/// As `run` does, with files beside the plan.
#[test]
fn a_scene_without_an_ending_is_found_beside_the_plan() {
    let place = Place::new();
    fs::create_dir(place.path("plans")).unwrap();
    let ball = "[scene]\nname = \"ball\"\ntitle = \"t\"\n[[body]]\nname = \"ball\"\ndisc = 0.5\n";
    place.write("plans/ball", ball);
    let plan = |scene: &str| {
        let text = format!("scene = \"{scene}\"\n[grid]\n\"step.time\" = [0.1]\n");
        place.write("plans/p.toml", text);
    };
    plan("ball");
    let out = done(&place, &["sweep", "plans/p.toml", "--out", "s"]);
    assert!(out.starts_with("ball: t\n"), "{out}");
    plan("bal");
    place.refused(
        &["sweep", "plans/p.toml", "--out", "u"],
        &[
            "plans/p.toml:1:1: scene: unknown scene `bal`",
            "and there is no file plans/bal\n",
        ],
    );
    // a name of the catalogue comes first
    place.write("plans/tower", ball);
    plan("tower");
    let out = done(&place, &["sweep", "plans/p.toml", "--out", "t"]);
    assert!(out.starts_with("tower: "), "{out}");
}

#[test]
fn what_is_missing_is_told() {
    let place = Place::new();
    place.write("plan.toml", SLIDING);
    done(
        &place,
        &["sweep", "plan.toml", "--shard", "2/3", "--out", "part"],
    );
    let (code, out, _) = place.run(&["merge", "part", "--out", "t"]);
    assert_eq!(code, 2);
    assert_eq!(out.matches("missing: ").count(), 16, "{out}");
    assert!(
        out.contains("gravity.magnitude = 4, body.block.velocity.0 = 3"),
        "{out}"
    );
    let summary = place.json("t/summary.json");
    assert_eq!(summary["missing"].as_array().unwrap().len(), 16);
    assert_eq!(summary["cases"], 8);
    let names = cases(&place, "part");
    for name in names {
        fs::remove_dir_all(place.path(&format!("part/{name}"))).unwrap();
    }
    place.refused(
        &["merge", "part", "--out", "u"],
        &["part: none of the 24 cases is there"],
    );
}

/// Every case is checked before the first runs; errors name file, line, key, value, what is allowed and
/// the nearest name.
#[test]
fn bad_plans_run_no_case() {
    let place = Place::new();
    place.write(
        "ball.toml",
        "[scene]\nname = \"ball\"\ntitle = \"t\"\n[[body]]\nname = \"ball\"\ndisc = 0.5\n",
    );
    for (scene, rest, words) in [
        (
            "tower",
            "[grid]\n\"step.dt\" = [0.01, -1]\n",
            "plan.toml:3:20: step.dt = -1.0: allowed is 1e-9 to 1 s",
        ),
        (
            "tower",
            "[grid]\n\"step.dt\" = [0.01, \"a\"]\n",
            "plan.toml:3:20: step.dt: expected a number, found the string \"a\"",
        ),
        (
            "tower",
            "[grid]\n\"step.dtt\" = [0.01]\n",
            "plan.toml:3:15: step.dtt: unknown key `dtt`; did you mean `dt`?",
        ),
        (
            "tower",
            "[set]\ntoleranc = 0.2\n[grid]\n\"step.dt\" = [0.01]\n",
            "plan.toml:3:1: unknown key `toleranc`; did you mean `tolerance`?",
        ),
        (
            "tower",
            "[grid]\ntime = [1]\nname = [\"a\"]\n",
            "plan.toml:4:9: name: could be any of",
        ),
        (
            "tower",
            "[grid]\n\"body.bx.disc\" = [1]\n",
            "plan.toml:3:19: body",
        ),
        (
            "tower",
            "[grid]\n\"step.dt\" = []\n",
            "plan.toml:3:1: grid.step.dt = []: allowed is at least one value",
        ),
        ("tower", "[grid]\n", "plan.toml:2:2: grid: has no key"),
        (
            "towr",
            "[grid]\n\"step.dt\" = [0.01]\n",
            "plan.toml:1:1: scene: unknown scene `towr`; did you mean `tower`?",
        ),
        (
            "bal.toml",
            "[grid]\n\"step.dt\" = [0.01]\n",
            "plan.toml:1:1: scene: bal.toml: no such file",
        ),
        (
            "pin-on-disc",
            "[grid]\n\"verdict.overlap\" = [1]\n\"gravity.y\" = [-1]\n\"life.duration\" = [0]\n",
            "plan.toml:5:20: life.duration = 0.0: allowed is",
        ),
        (
            "thresher-study",
            "[grid]\n\"wear.error\" = [\"measured\"]\n",
            "plan.toml:3:17: wear.error = \"measured\": has no effect on a [study]",
        ),
        (
            "tower",
            "[grid]\n\"step.dt\" = [0.01]\ndt = [0.02]\n",
            "has no effect before",
        ),
    ] {
        place.write("plan.toml", format!("scene = \"{scene}\"\n{rest}"));
        place.refused(&["sweep", "plan.toml"], &[words]);
    }
    place.write(
        "plan.toml",
        "scene = \"ball.toml\"\n[grid]\n\"step.time\" = [0.1]\n",
    );
    done(&place, &["sweep", "plan.toml"]);
    assert_eq!(cases(&place, "out/sweep-plan").len(), 1);
    place.refused(&["sweep", "none.toml"], &["none.toml: No such file"]);
    for out in ["ball.toml", "ball.toml/deep"] {
        place.refused(
            &["sweep", "plan.toml", "--out", out],
            &["ball.toml: exists and is not a folder"],
        );
    }
    place.refused(
        &["sweep", "plan.toml", "--shard", "3/2"],
        &["--shard", "K/N"],
    );
    place.refused(
        &["sweep", "plan.toml", "--shard", "/2"],
        &["neither SLURM_ARRAY_TASK_ID nor"],
    );
    place.refused(&["sweep", "plan.toml", "--jobs", "0"], &["1..=1024"]);
    place.refused(
        &["merge", "out/sweep-plan", "--draw", "totals.energy_nd_j"],
        &["no such column; did you mean `totals.energy_end_j`?"],
    );
    place.refused(&["merge", "out/sweep-plan", "--draw", "ended"], &["ended"]);
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

/// The plan of the study: its twelve published points are those of `run`.
#[test]
fn the_plan_of_the_study_has_144_cases() {
    let text = include_str!("../../scenes/sweeps/thresher-study.toml");
    let plan = moreau2d::scene::plan::Plan::parse("study.toml", text).unwrap();
    assert_eq!((plan.len(), plan.keys.len()), (144, 3));
    // two of them, at the friction of the study
    let place = Place::new();
    let fewer = text
        .replace("[20.87, 54.37, 110.91, 146.39]", "[146.39]")
        .replace("[70, 80, 90, 100, 110, 120]", "[70, 120]")
        .replace("[0.14, 0.18, 0.25, 0.3, 0.35, 0.4]", "[0.3, 0.4]");
    place.write("plan.toml", fewer);
    done(&place, &["sweep", "plan.toml", "--out", "s"]);
    done(&place, &["merge", "s", "--out", "t"]);
    let head = place.header("t/sweep.csv");
    let at = |name: &str| head.split(',').position(|other| other == name).unwrap();
    let (depth, life) = (at("comparison.computed_um"), at("life.unfit.hours"));
    let rows = place.rows("t/sweep.csv");
    let number = |row: usize, column: usize| rows[row][column].parse::<f64>().unwrap();
    // as `run thresher-study` prints them, with the contact time that it fits
    assert!((number(0, depth) - 7620.0).abs() < 0.01, "{:?}", rows[0]);
    assert!((number(2, depth) - 11967.0).abs() < 0.5, "{:?}", rows[2]);
    // depth falls with friction and rises with speed, the life the other way
    assert!(number(1, depth) < number(0, depth) && number(1, life) > number(0, life));
    assert!(number(2, depth) > number(0, depth) && number(2, life) < number(0, life));
}

/// Several processes that begin at the same time in one folder, parts of a sweep or the same sweep.
#[test]
fn parts_may_start_at_the_same_time_in_one_folder() {
    let place = alone(SLIDING);
    let whole = tree(&place.path("alone"));
    let start = |k: usize| {
        let shard = format!("{k}/5");
        let mut command = place.command(&["sweep", "plan.toml", "--shard", &shard, "--out", "all"]);
        command.stdout(Stdio::null()).spawn().unwrap()
    };
    let children: Vec<_> = (1..=5).map(start).collect();
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    assert!(tree(&place.path("all")) == whole);
    for round in 0..5 {
        let folder = format!("same-{round}");
        let start = |_| {
            let mut command =
                place.command(&["sweep", "plan.toml", "--jobs", "2", "--out", &folder]);
            command.stdout(Stdio::null()).spawn().unwrap()
        };
        let children: Vec<_> = (0..4).map(start).collect();
        for mut child in children {
            assert!(child.wait().unwrap().success());
        }
        assert!(tree(&place.path(&folder)) == whole);
    }
    // the tasks of job arrays
    for (name, value, shard, folder) in [
        ("HQ_TASK_ID", 0, Some("/5"), "queue"),
        ("SLURM_ARRAY_TASK_ID", 3, None, "slurm"),
    ] {
        for k in 0..5 {
            let mut args = vec!["sweep", "plan.toml", "--out", folder];
            args.extend(shard.iter().flat_map(|shard| ["--shard", shard]));
            let mut command = place.command(&args);
            command.env(name, (value + k).to_string());
            command
                .env("SLURM_ARRAY_TASK_MIN", "3")
                .env("SLURM_ARRAY_TASK_COUNT", "5");
            assert!(command.output().unwrap().status.success());
        }
        assert!(tree(&place.path(folder)) == whole, "{name}");
    }
}
