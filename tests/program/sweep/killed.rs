//! Sweeps that are killed, damaged, or started at the same time.

use super::{SLIDING, alone, cases, tree};
use std::fs;
use std::process::Stdio;

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
