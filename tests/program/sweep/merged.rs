//! Tables of sweeps.

use super::{SLIDING, alone, cases, done};
use crate::common::program::Place;
use std::fs;

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
        &["none: no folder of a sweep, it has no plan.json"],
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
