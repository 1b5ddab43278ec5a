//! Box2D as a peer: what it is given of a scene, and what is read of it.

use crate::common::program::Place;
use moreau2d::contact::{Vec2, Vec3};
use moreau2d::dynamics::Pose64;
use moreau2d::dynamics::record::StepRecord;
use moreau2d::experiment::{Engine, RunError, Samples, Totals, measures, simulate, step_count};
use moreau2d::report::{PointRow, ResultRow, read_rows};
use moreau2d::scene::{self, Scene};
use std::collections::BTreeSet;

fn scene(text: &str) -> Scene {
    let header = "[scene]\nname = \"s\"\ntitle = \"t\"\n";
    Scene::parse("s.toml", &(header.to_owned() + text), &[]).unwrap()
}

/// The last state of every body, all records, and the totals.
type Ended = (Vec<(Pose64, Vec3)>, Vec<StepRecord>, Totals);

fn run(scene: &Scene, engine: Engine) -> Ended {
    let mut built = scene.build().unwrap();
    let mut records = Vec::new();
    let steps = step_count(&scene.step);
    let totals = simulate(&mut built, engine, steps, |record, _| {
        records.push(record.clone());
        Ok(())
    });
    let states = (0..built.bodies()).map(|k| engine.state(&built, k).unwrap());
    (states.collect(), records, totals.unwrap())
}

fn last(text: &str) -> (Pose64, Vec3) {
    *run(&scene(text), Engine::Box2d).0.last().unwrap()
}

const FLOOR: &str = "[[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [40, 2]\n\
                     position = [0, -1]\n";

/// Semi-implicit Euler in N substeps of h: the fall is `g h² N (N + 1) / 2`.
#[test]
fn a_body_falls_turns_and_is_slowed_as_its_keys_say() {
    let thrown = "[step]\ndt = 0.01\ntime = 1\n[[body]]\nname = \"b\"\n\
                  polygon = [[0, 0], [2, 0], [0, 1]]\nposition = [1, 2]\nangle = 0.5\n\
                  velocity = [3, 0]\nspin = -2\n";
    let start = scene(thrown).build().unwrap().state(0).unwrap();
    let (pose, u) = last(thrown);
    let (h, n) = (0.0025, 400.0);
    assert!((u - Vec3::new(3.0, -9.81, -2.0)).norm() < 1e-4, "{u}");
    assert!(
        (pose.angle() - (0.5 - 2.0)).abs() < 1e-4,
        "{}",
        pose.angle()
    );
    // of the centre of mass, which is not the origin of the body
    let centre = Vec2::new(2.0 / 3.0, 1.0 / 3.0);
    let fallen = pose.apply(centre) - start.0.apply(centre);
    let expected = Vec2::new(3.0, -9.81 * h * h * n * (n + 1.0) / 2.0);
    assert!((fallen - expected).norm() < 1e-4, "{fallen} {expected}");

    let slowed = last(&format!("{thrown}gravity_scale = 0\nlinear_damping = 2\n")).1;
    let expected = 3.0 / (1.0 + 2.0 * h).powf(n);
    assert!(
        (slowed.x - expected).abs() < 1e-4 && slowed.y == 0.0,
        "{slowed}"
    );
}

#[test]
fn a_block_slides_as_far_as_coulomb_says() {
    let block = scene::load("sliding-block", &[]).unwrap();
    let mut built = block.build().unwrap();
    let mut samples = Samples::start(&built, Engine::Box2d);
    let steps = step_count(&block.step);
    simulate(&mut built, Engine::Box2d, steps, |record, built| {
        samples.add(record, built, Engine::Box2d);
        Ok(())
    })
    .unwrap();
    let found = measures(&block, &samples);
    let distance = found.iter().find(|m| m.name == "distance").unwrap();
    // half a substep's way and the soft contact: 4e-3
    assert!(distance.error < 1e-2, "{distance:?}");
}

/// Soft contacts sink as rapier's do, 6 mm under ten boxes, and the stack stays upright.
#[test]
fn a_tower_stands() {
    let tower = scene::load("tower", &["step.time=10".to_owned()]).unwrap();
    let [(_, _, ours), (states, _, theirs)] =
        [Engine::Rapier, Engine::Box2d].map(|engine| run(&tower, engine));
    assert!(theirs.penetration < 1.5 * ours.penetration, "{theirs:?}");
    assert!(
        theirs.penetration > 1e-4,
        "its contacts are soft: {theirs:?}"
    );
    assert_eq!(theirs.most_contacts, 20);
    let lean = states.iter().map(|(pose, _)| pose.translation.x.abs());
    assert!(lean.fold(0.0, f64::max) < 1e-3);
}

/// Box2D alone would take the root of the product, 0.346, and the larger restitution, 1.
#[test]
fn coefficients_combine_as_rapier_combines_them() {
    let materials = "[[material]]\nname = \"low\"\nfriction = 0.2\nrestitution = 0\n\
                     [[material]]\nname = \"high\"\nfriction = 0.6\nrestitution = 1\n";
    let floor = format!("{materials}{FLOOR}material = \"low\"\n");
    let slides = format!(
        "[step]\ndt = 0.001\ntime = 1.5\n{floor}[[body]]\nname = \"b\"\nbox = [2, 0.2]\n\
         position = [0, 0.1]\nvelocity = [4, 0]\nmaterial = \"high\"\n"
    );
    let way = last(&slides).0.translation.x;
    let exact = 16.0 / (2.0 * 0.4 * 9.81);
    assert!((way / exact - 1.0).abs() < 0.01, "{way} {exact}");

    // 4.43 m/s down, half of it up; after 0.45 + 0.226 s at the highest
    let falls = format!(
        "[step]\ndt = 0.001\ntime = 0.677\n{floor}[[body]]\nname = \"b\"\ndisc = 0.5\n\
         position = [0, 1.5]\nmaterial = \"high\"\n"
    );
    let height = last(&falls).0.translation.y - 0.5;
    assert!((height / 0.25 - 1.0).abs() < 0.05, "{height}");
}

/// A belt's top runs to +x where its speed is negative, for Box2D as for rapier.
#[test]
fn a_belt_takes_a_block_along() {
    for speed in [-1.5, 2.0] {
        let belt = format!(
            "[step]\ntime = 2\n{FLOOR}surface_velocity = {speed:?}\n\
             [[body]]\nname = \"b\"\nbox = [1, 0.5]\nposition = [0, 0.25]\n"
        );
        let u = last(&belt).1;
        assert!((u.x + speed).abs() < 1e-3, "{speed}: {u}");
    }
}

#[test]
fn a_pin_holds_a_pendulum() {
    let (states, records, totals) = run(
        &scene(
            "[step]\ntime = 5\n[[body]]\nname = \"b\"\ndisc = 0.2\nposition = [1, 0]\n\
             [[joint]]\nkind = \"revolute\"\nbodies = [\"world\", \"b\"]\nat = [0, 0]\n",
        ),
        Engine::Box2d,
    );
    let gap = states[0].0.apply(Vec2::new(-1.0, 0.0)).norm();
    assert!(gap < 2e-3, "{gap}");
    // one swing down and up again, as high as the start but for 2 %
    let energy = records.last().unwrap().energy;
    let most = records.iter().map(|r| r.energy.kinetic_end);
    let most = most.fold(0.0, f64::max);
    assert!((energy.kinetic_end + energy.potential_end).abs() < 0.1 * most);
    assert!(totals.energy_rise < 0.02 * most, "{totals:?}");
}

#[test]
fn every_joint_does_what_its_name_says() {
    let hung = "[step]\ntime = 4\n[[body]]\nname = \"b\"\nbox = [0.4, 0.2]\nmass = 2\n\
                position = [0, -1]\n";
    let joined = |kind: &str, keys: &str| {
        format!("{hung}[[joint]]\nkind = \"{kind}\"\nbodies = [\"world\", \"b\"]\n{keys}\n")
    };
    // welded to a point that is not its own
    let (pose, _) = last(&joined("fixed", "at = [0.5, 0]"));
    assert!((pose.translation - Vec2::new(0.0, -1.0)).norm() < 2e-2 && pose.angle().abs() < 2e-2);
    // down a rail of 45 degrees to its end
    let rail = "at = [0, -1]\naxis = [1, -1]\nlimits = [0, 0.5]";
    for kind in ["prismatic", "pin-slot"] {
        let (pose, _) = last(&joined(kind, rail));
        let end = Vec2::new(0.5, -0.5) / f64::sqrt(2.0) * 1.0 + Vec2::new(0.0, -1.0);
        assert!(
            (pose.translation - end).norm() < 2e-2,
            "{kind}: {}",
            pose.translation
        );
    }
    // a rope of 1.5 m lets it fall by half a metre
    let (pose, u) = last(&joined("rope", "anchors = [[0, 0], [0, -1]]\nlength = 1.5"));
    assert!(
        (pose.translation.y + 1.5).abs() < 1e-2 && u.norm() < 0.1,
        "{}",
        pose.translation
    );
    // k x = m g, 2 * 9.81 / 98.1 = 0.2 m; damped by a third of the critical
    let spring = "anchors = [[0, 0], [0, -1]]\nlength = 1\nstiffness = 98.1\ndamping = 10";
    let (pose, _) = last(&joined("spring", spring));
    assert!(
        (pose.translation.y + 1.2).abs() < 2e-3,
        "{}",
        pose.translation
    );
    // a motor that is strong enough turns it at its speed
    let motor = "at = [0, -1]\nmotor = { speed = 3, max_torque = 100 }";
    let (_, u) = last(&joined("revolute", motor));
    assert!((u.z - 3.0).abs() < 1e-3, "{u}");
    let weak = "at = [0, -1]\nmotor = { speed = 1e3, max_torque = 0.01 }";
    let (_, u) = last(&joined("revolute", weak));
    let inertia = 2.0 * (0.16 + 0.04) / 12.0;
    assert!((u.z / (0.01 * 4.0 / inertia) - 1.0).abs() < 0.01, "{u}");
}

/// The solid is on the left of a polyline's direction, and its ends carry as its middle does.
#[test]
fn polylines_push_to_their_right() {
    for (points, rests) in [
        ("[[2, 0], [0.1, 0], [-2, 0]]", true),
        ("[[-2, 0], [0.1, 0], [2, 0]]", false),
    ] {
        for x in [-1.5, 0.0, 1.5] {
            let text = format!(
                "[step]\ntime = 1\n[[body]]\nname = \"line\"\nkind = \"fixed\"\npolyline = {points}\n\
                 [[body]]\nname = \"b\"\ndisc = 0.3\nposition = [{x:?}, 0.5]\n"
            );
            let scene = scene(&text);
            let heights = [Engine::Rapier, Engine::Box2d]
                .map(|engine| run(&scene, engine).0[1].0.translation.y);
            for height in heights {
                assert_eq!(
                    (height - 0.3).abs() < 5e-3,
                    rests,
                    "{points} {x}: {heights:?}"
                );
            }
        }
    }
}

/// What contacts carry is what keeps a block where it is: its weight, along both axes.
#[test]
fn contacts_carry_the_weight_of_what_rests() {
    let text = format!(
        "[gravity]\nx = 2\ny = -9.81\n[step]\ntime = 2\n{FLOOR}\
         [[body]]\nname = \"b\"\nbox = [1, 0.5]\nmass = 3\nposition = [0, 0.25]\n"
    );
    let (states, records, _) = run(&scene(&text), Engine::Box2d);
    assert!(states[1].0.translation.x.abs() < 1e-2);
    let record = records.last().unwrap();
    assert_eq!(record.contacts.len(), 2);
    let mut sum = Vec2::zeros();
    for c in &record.contacts {
        let tangent = Vec2::new(-c.normal.y, c.normal.x);
        let sign = if c.bodies[1] == 1 { 1.0 } else { -1.0 };
        sum += sign * (c.normal * c.impulse_n + tangent * c.impulse_t);
    }
    let weight = 3.0 * record.dt * Vec2::new(-2.0, 9.81);
    assert!(
        (sum - weight).norm() < 1e-3 * weight.norm(),
        "{sum} {weight}"
    );
}

#[test]
fn two_runs_leave_the_same_bytes() {
    let files = ["bodies.csv", "contacts.csv", "steps.csv", "summary.json"];
    let place = Place::new();
    for out in ["a", "b"] {
        let args = "run pyramid --engine box2d --steps 100 --quiet --out";
        let mut args: Vec<&str> = args.split(' ').collect();
        args.push(out);
        let (code, _, err) = place.run(&args);
        assert_eq!(code, 0, "{err}");
    }
    for name in files {
        let read = |out: &str| std::fs::read(place.path(out).join(name)).unwrap();
        assert!(read("a") == read("b"), "{name}");
    }
}

#[test]
fn what_box2d_has_not_is_refused_by_name() {
    let corner = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / 9.0).sin_cos();
        format!("[{cos:?}, {sin:?}]")
    };
    let corners: Vec<String> = (0..9).map(corner).collect();
    let ninegon = format!(
        "[[body]]\nname = \"b\"\npolygon = [{}]\n",
        corners.join(", ")
    );
    let hung = "[[body]]\nname = \"b\"\nbox = [0.4, 0.2]\nposition = [0, -1]\n[[joint]]\n\
                bodies = [\"world\", \"b\"]\n";
    for (text, words) in [
        (ninegon, "polygons of 9 corners"),
        (
            "[[body]]\nname = \"b\"\npolygon = [[0, 0], [1, 0], [1, 1], [0.99, 1.01], [0, 1]]\n"
                .into(),
            "polygons with corners within 20 mm",
        ),
        (
            format!(
                "{FLOOR}one_way = [0, 1]\n[[body]]\nname = \"b\"\ndisc = 1\nposition = [0, 2]\n"
            ),
            "one-way surfaces",
        ),
        (
            "[[material]]\nname = \"m\"\nstiffness = 1e4\n[[body]]\nname = \"b\"\ndisc = 1\n"
                .into(),
            "compliant surfaces",
        ),
        (
            format!(
                "{hung}kind = \"spring\"\nanchors = [[0, 0], [0.1, -1]]\nlength = 1\n\
                 stiffness = 10\n"
            ),
            "springs off the centres of mass",
        ),
        (
            format!("{hung}kind = \"revolute\"\nat = [0, 0]\nlimits = [-1, 3.13]\n"),
            "limits beyond 178 degrees (joint world-b)",
        ),
    ] {
        let scene = scene(&text);
        assert!(Engine::Rapier.fits(&scene).is_ok(), "{text}");
        match Engine::Box2d.fits(&scene) {
            Err(RunError::Unfit(why)) => {
                let named = format!("--engine box2d: Box2D has no {words}");
                assert!(why.starts_with(&named), "{why}");
            }
            other => panic!("{text}: {other:?}"),
        }
    }
    let place = Place::new();
    for (args, words) in [
        (&["run", "bowl", "--engine", "box2d"][..], "Box2D has not"),
        (&["run", "thresher-study", "--engine", "box2d"], "wears"),
        (
            &["run", "one-way-platforms", "--engine", "box2d"],
            "one-way",
        ),
        (
            &["chart", "one-way-platforms", "--engine", "box2d"],
            "one-way",
        ),
        (
            &["bench", "one-way-platforms", "--against", "box2d"],
            "one-way",
        ),
        (
            &["chart", "tower", "--engine", "box2d", "--soft", "30,4,1"],
            "HZ,SUBSTEPS such as",
        ),
        (
            &["run", "tower", "--engine", "box2d", "--events"],
            "--events",
        ),
        (
            &["run", "tower", "--engine", "box3d"],
            "did you mean box2d?",
        ),
    ] {
        place.refused(args, &[words]);
    }
}

/// A comparison goes on without it and says why.
#[test]
fn a_comparison_leaves_out_what_box2d_has_not() {
    let place = Place::new();
    let args = "compare one-way-platforms --steps 5 --repeats 1 --no-sweep --out r";
    let (code, out, err) = place.run(&args.split(' ').collect::<Vec<_>>());
    assert_eq!(code, 0, "{err}");
    assert!(
        out.contains("note: skipped box2d: Box2D has no one-way surfaces"),
        "{out}"
    );
    let rows: Vec<ResultRow> = read_rows(&place.path("r/results.csv")).unwrap();
    let engines: BTreeSet<&str> = rows.iter().map(|r| r.engine.as_str()).collect();
    assert_eq!(
        engines,
        BTreeSet::from(["moreau", "rapier", "rapier-stiff"])
    );

    let (code, out, err) = place.run(&["atlas", "painleve", "--quick"]);
    assert_eq!(code, 0, "{err}");
    for peer in ["rapier", "Box2D"] {
        assert!(out.contains(&format!("painleve: {peer} cannot")), "{out}");
    }
}

/// A box that trips over the seams of a plain polyline gets normals from Box2D that are no unit
/// vectors: its contacts cannot be read, and the run goes on.
#[test]
fn contacts_that_cannot_be_read_do_not_end_a_run() {
    let place = Place::new();
    let (code, out, err) = place.run(&["atlas", "ghost-edges", "--quick", "--out", "r"]);
    assert_eq!(code, 0, "{err}");
    assert!(!out.contains("stopped"), "{out}");
    let rows: Vec<ResultRow> = read_rows(&place.path("r/results.csv")).unwrap();
    let rung = |r: &&ResultRow| r.rung == "plain box, 400" && r.engine == "box2d";
    let found: Vec<&str> = rows.iter().filter(rung).map(|r| r.mode.as_str()).collect();
    assert!(
        !found.is_empty() && found.iter().all(|mode| *mode == "trips"),
        "{found:?}"
    );
}

/// What cannot be read is counted: the box that trips over the seams of a plain polyline.
#[test]
fn contacts_that_cannot_be_read_are_counted() {
    let point = |k: i32| format!("[{:?}, 0]", 20.0 - 0.1 * f64::from(k));
    let points: Vec<String> = (0..=400).map(point).collect();
    let text = format!(
        "[step]\ntime = 6\n[[material]]\nname = \"m\"\nfriction = 0\n[[body]]\nname = \"line\"\n\
         kind = \"fixed\"\npolyline = [{}]\n[[body]]\nname = \"slider\"\nbox = [1, 1]\n\
         position = [-15, 0.5]\nvelocity = [5, 0]\n",
        points.join(", ")
    );
    let scene = scene(&text);
    let ended = |plain: bool| {
        let mut built = scene.build().unwrap();
        let line = built.simulation().unwrap().1[0];
        if plain {
            built.simulation_mut().unwrap().open_chains(line);
        }
        let mut unread = 0;
        let steps = step_count(&scene.step);
        let totals = simulate(&mut built, Engine::Box2d, steps, |record, _| {
            unread += record.unread;
            Ok(())
        });
        assert_eq!(totals.unwrap().unread, unread);
        unread
    };
    assert_eq!(ended(false), 0);
    assert!(ended(true) > 0);
}

/// Box2D finds gaps at the start of a step; in the record they are of its end, as the poses are.
#[test]
fn gaps_are_of_the_end_of_the_step() {
    // without friction it does not turn: of contacts that it keeps Box2D takes the point of a disc
    // for turning with it
    let text = format!(
        "[step]\ntime = 0.5\n[[material]]\nname = \"m\"\nfriction = 0\n{FLOOR}[[body]]\nname = \"b\"\n\
         disc = 0.5\nposition = [0, 0.501]\nvelocity = [0.5, -1]\n"
    );
    let scene = scene(&text);
    let mut built = scene.build().unwrap();
    let (mut seen, mut moved) = (0, 0.0_f64);
    // where the first step starts
    let mut last = 0.001;
    let steps = step_count(&scene.step);
    simulate(&mut built, Engine::Box2d, steps, |record, built| {
        let (pose, _) = Engine::Box2d.state(built, 1).unwrap();
        for c in &record.contacts {
            let gap = pose.translation.y - 0.5;
            assert!(
                (c.gap - gap).abs() < 1e-5,
                "{}: {} {gap}",
                record.time,
                c.gap
            );
            moved = moved.max((c.gap - last).abs());
            last = c.gap;
            seen += 1;
        }
        Ok(())
    })
    .unwrap();
    // what stood still would tell nothing
    assert!(seen > 10 && moved > 1e-4, "{seen} {moved}");
}

const PRESET: &str = "30 Hz up to 1/8 of the substeps' rate, x2 at fixed bodies, 4 substeps";

#[test]
fn every_view_has_a_row_for_it_with_all_its_settings() {
    let place = Place::new();
    for (args, setting) in [
        ("compare tower --steps 5 --repeats 1 --out r", PRESET),
        ("chart tower --quick --time 0.2 --out r", PRESET),
        (
            "bench tower --against rapier,box2d --steps 4 --settle 2 --out r",
            PRESET,
        ),
        ("atlas tower --quick --out r", "default"),
    ] {
        let (code, out, err) = place.run(&args.split(' ').collect::<Vec<_>>());
        assert_eq!(code, 0, "{args}: {err}");
        // the table of a chart tells of all peers together
        assert!(
            out.contains("box2d") || args.starts_with("chart"),
            "{args}: {out}"
        );
        let rows: Vec<ResultRow> = read_rows(&place.path("r/results.csv")).unwrap();
        let own: Vec<&ResultRow> = rows.iter().filter(|r| r.engine == "box2d").collect();
        assert!(own.iter().any(|r| r.setting == setting), "{args}: {own:?}");
        for row in &own {
            assert_eq!(
                (row.solver.as_str(), row.precision.as_str()),
                ("soft", "f32")
            );
            assert_eq!(row.scheme, "");
            assert!(row.value.is_finite(), "{row:?}");
        }
        if args.starts_with("compare") {
            // three steps of the preset; the sweep at 4 and at 40 substeps, where 30 Hz, and 30, 120 and
            // 300 Hz are possible; at a quarter of the step 30 and 120 Hz, and 30 to 1200 Hz
            let settings: BTreeSet<(u64, &str)> = own
                .iter()
                .map(|r| (r.dt_s.to_bits(), r.setting.as_str()))
                .collect();
            assert_eq!(settings.len(), 3 + (4 + 6) - 2);
        }
    }
}

/// The command beside a point gives its values again bit for bit.
#[test]
fn a_point_of_a_chart_is_run_again_by_its_command() {
    let place = Place::new();
    let args = "chart tower --quick --engine box2d --soft 120,40 --dt 0.01 --time 0.2 --out r";
    let (code, _, err) = place.run(&args.split(' ').collect::<Vec<_>>());
    assert_eq!(code, 0, "{err}");
    let points: Vec<PointRow> = read_rows(&place.path("r/points.csv")).unwrap();
    assert_eq!(points.len(), 1);
    assert!(
        points[0].command.contains("--soft 120,40"),
        "{:?}",
        points[0]
    );
    assert!(points[0].setting.starts_with("120 Hz"), "{:?}", points[0]);
    let command = format!("{} --out again", points[0].command);
    let words: Vec<&str> = command.split(' ').skip(1).collect();
    let (code, _, err) = place.run(&words);
    assert_eq!(code, 0, "{command}: {err}");
    let values = |out: &str| -> Vec<(String, u64)> {
        let rows: Vec<ResultRow> = read_rows(&place.path(out).join("results.csv")).unwrap();
        let all = rows.into_iter();
        all.map(|r| (r.measure, r.value.to_bits())).collect()
    };
    assert_eq!(values("r"), values("again"));
}
