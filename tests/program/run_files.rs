//! The files that `run` and `compare` write: which, with what columns, and how exact.

use super::cli::scenes_of_bodies;
use crate::common::program::Place;
use crate::common::small;
use serde_json::Value;
use std::fs;

const BODIES: &str = "time_s,body,x_m,y_m,angle_rad,vx_m_s,vy_m_s,omega_rad_s";
const CONTACTS: &str = "time_s,body_1,body_2,cell,x_m,y_m,nx,ny,gap_m,impulse_n_ns,impulse_t_ns,\
                        slip_m,load_slip_nm,friction_work_j,status";
const COMPARISON: &str = "torque_nm,omega_rad_s,published_um,computed_um,relative_error,calibrated,\
                          worn_through_cycles";
const WEAR: &str = "cycles,hours,bar,cell,x_m,depth_m,load_slip_nm_per_cycle";
const FRICTION: &str = "friction,torque_nm,omega_rad_s,computed_um,life_hours,published_hours,\
                        worn_through_cycles";
const PROFILE: &str = "cycles,hours,bar,node,x_m,y_m";
const LIFE: &str = "limit,hours,cycles,error_hours,bar,cell";
const RESULTS: &str = "scene,rung,engine,scheme,solver,setting,dt_s,threads,precision,measure,\
                       value,unit,reference,seconds_per_simulated_second,spread,verdict,mode";

#[test]
fn every_scene_runs_and_leaves_its_files() {
    for scene in scenes_of_bodies() {
        let place = Place::new();
        let changes = small(scene).iter().flat_map(|change| ["--set", change]);
        let args = ["run", scene, "--steps", "3"].into_iter().chain(changes);
        let (code, out, err) = place.run(&args.collect::<Vec<_>>());
        assert_eq!(code, 0, "{scene}: {err}");
        assert!(out.starts_with(scene), "{out}");
        let folder = format!("out/{scene}");
        let mut expected = vec!["out".to_owned(), folder.clone()];
        for file in [
            "bodies.csv",
            "contacts.csv",
            "impacts.csv",
            "scene.svg",
            "steps.csv",
            "summary.json",
        ] {
            expected.push(format!("{folder}/{file}"));
        }
        assert_eq!(place.everything(), expected, "{scene}");
        assert!(out.contains(&folder), "says where the results are");
        assert_eq!(place.header(&format!("{folder}/bodies.csv")), BODIES);
        assert_eq!(place.header(&format!("{folder}/contacts.csv")), CONTACTS);
        let steps = place.header(&format!("{folder}/steps.csv"));
        assert!(
            steps.starts_with("time_s,dt_s,contacts,islands,resting,sweeps,"),
            "{steps}"
        );
        let columns = steps.split(',').count();
        let rows = place.rows(&format!("{folder}/steps.csv"));
        assert_eq!(rows.len(), 3);
        assert!(rows.iter().all(|r| r.len() == columns));
        // the start and three steps of every body
        let bodies = place.rows(&format!("{folder}/bodies.csv")).len();
        assert!(bodies >= 4 && bodies.is_multiple_of(4), "{scene}: {bodies}");
    }
}

#[test]
fn floats_are_written_in_full() {
    let place = Place::new();
    let (code, _, err) = place.run(&["run", "spinning-disc", "--steps", "3", "--out", "r"]);
    assert_eq!(code, 0, "{err}");
    let rows = place.rows("r/bodies.csv");
    let last = rows.last().unwrap();
    let x: f64 = last[2].parse().unwrap();
    // three sliding steps of 1/60 s from 5 m/s: exact up to a few roundings, so 15 digits at least
    let t: f64 = 3.0 / 60.0;
    assert!(
        (x - (5.0 * t - 0.5 * 0.5 * 9.81 * t * t)).abs() < 1e-15,
        "{x}"
    );
    assert!(last[2].len() > 12, "{}", last[2]);
}

#[test]
fn the_study_writes_its_comparison_and_its_life() {
    let place = Place::new();
    let (code, out, err) = place.run(&["run", "thresher-study", "--out", "r"]);
    assert_eq!(code, 0, "{err}");
    for (file, header) in [
        ("comparison.csv", COMPARISON),
        ("wear.csv", WEAR),
        ("profile.csv", PROFILE),
        ("life.csv", LIFE),
        ("friction.csv", FRICTION),
    ] {
        assert_eq!(place.header(&format!("r/{file}")), header);
    }
    let rows = place.rows("r/comparison.csv");
    assert_eq!(rows.len(), 12);
    assert_eq!(rows.iter().filter(|r| r[5] == "true").count(), 1);
    assert_eq!(
        (rows[0][0].as_str(), rows[0][5].as_str()),
        ("146.39", "true")
    );
    for svg in [
        "worn-profile.svg",
        "depth-per-cell.svg",
        "tooth-height.svg",
        "depth-over-speed.svg",
    ] {
        let text = fs::read_to_string(place.path(&format!("r/{svg}"))).unwrap();
        assert!(
            text.starts_with("<svg") && text.trim_end().ends_with("</svg>"),
            "{svg}"
        );
    }
    assert!(
        out.contains("calibrated") && out.contains("assumed"),
        "{out}"
    );
}

#[test]
fn compare_sets_engines_side_by_side() {
    let place = Place::new();
    let (code, out, err) = place.run(&["compare", "incline", "--steps", "20", "--repeats", "1"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(place.header("out/incline/results.csv"), RESULTS);
    let rows = place.rows("out/incline/results.csv");
    for engine in ["moreau", "rapier", "rapier-stiff"] {
        assert!(rows.iter().any(|r| r[2] == engine), "{engine}");
        assert!(out.contains(engine));
    }
    // the scene's closed form is measured at every point, more in tests/compare.rs
    let count = |measure| rows.iter().filter(|r| r[9] == measure).count();
    assert!(count("acceleration") > 3);
    assert_eq!(count("acceleration"), count("penetration"));
}

#[test]
fn compare_leaves_out_engines_that_have_not_the_geometry_and_says_so() {
    let place = Place::new();
    for scene in ["bowl", "woodpecker"] {
        let (code, out, err) = place.run(&["compare", scene, "--steps", "20", "--repeats", "1"]);
        assert_eq!(code, 0, "{err}");
        let rows = place.rows(&format!("out/{scene}/results.csv"));
        assert!(!rows.is_empty() && rows.iter().all(|r| r[2] == "moreau"));
        for engine in ["rapier", "rapier-stiff"] {
            let note = format!("note: skipped {engine}: scene {scene} is made of");
            assert!(out.contains(&note), "{out}");
        }
    }
}

/// `x_m` of a `[linear]` block's body is its coordinate, and contacts have a body to stand on.
#[test]
fn hand_written_models_fill_the_same_files() {
    let place = Place::new();
    let (code, _, err) = place.run(&["run", "woodpecker", "--steps", "10"]);
    assert_eq!(code, 0, "{err}");
    let bodies = place.rows("out/woodpecker/bodies.csv");
    assert_eq!(bodies.len(), 11 * 3);
    let start: Vec<f64> = bodies[..3].iter().map(|r| r[2].parse().unwrap()).collect();
    assert_eq!(start, [0.0, -0.1036, -0.2788]);
    assert!(!place.rows("out/woodpecker/contacts.csv").is_empty());
    let (code, _, err) = place.run(&["run", "riding-disc", "--steps", "10"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(place.rows("out/riding-disc/bodies.csv").len(), 11 * 2);
    // the numbers of both files are the scene's
    let contacts = place.rows("out/riding-disc/contacts.csv");
    assert_eq!(contacts.len(), 10);
    assert!(contacts.iter().all(|r| r[1] == "0" && r[2] == "1"));
    let summary = fs::read_to_string(place.path("out/riding-disc/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["settings"]["model"], "planar");
}

#[test]
fn a_second_run_replaces_its_files_and_keeps_others() {
    let place = Place::new();
    let run = |steps| {
        place
            .run(&["run", "beam", "--steps", steps, "--out", "r"])
            .0
    };
    assert_eq!(run("5"), 0);
    place.write("r/notes.txt", "mine");
    assert_eq!(run("2"), 0);
    assert_eq!(place.rows("r/steps.csv").len(), 2);
    assert_eq!(
        fs::read_to_string(place.path("r/notes.txt")).unwrap(),
        "mine"
    );
}

/// Bug: where no stiffness of the crop gives the operating torque, the text said that it was met, and
/// the run ended with 0.
#[test]
fn a_thresher_off_its_operating_torque_is_told() {
    let place = Place::new();
    let (code, out, err) = place.run(&["run", "thresher", "--set", "thresher.speed=1e6"]);
    assert_eq!(code, 2, "{out}{err}");
    assert!(
        out.contains("not the operating torque of 146.4 N m"),
        "{out}"
    );
    let summary = place.json("out/thresher/summary.json");
    let warnings = summary["warnings"].as_array().unwrap();
    assert!(
        warnings
            .iter()
            .any(|w| w.to_string().contains("operating torque"))
    );
}
