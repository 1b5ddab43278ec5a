//! What a good file becomes, and what the catalogue holds.

use super::*;
use std::collections::BTreeSet;

#[test]
fn repeats_place_grids_pyramids_and_rings() {
    let names = |scene: &Scene| {
        scene
            .bodies
            .iter()
            .map(|b| b.name.clone())
            .collect::<Vec<_>>()
    };
    let repeat = |keys: &str| parse(&format!("{BALL}[[repeat]]\nof = \"ball\"\n{keys}\n"), &[]);

    let scene = repeat("count = [3, 2]\nstep = [[2, 0], [0, 1]]\nshrink = 1").unwrap();
    let expected = [
        "floor",
        "ball[0,0]",
        "ball[1,0]",
        "ball[2,0]",
        "ball[0,1]",
        "ball[1,1]",
    ];
    assert_eq!(names(&scene), expected);
    assert_eq!(scene.bodies[3].position, [4.0, 1.0]);
    // The second row starts half a step to the right, on top of the first.
    assert_eq!(scene.bodies[4].position, [1.0, 2.0]);

    let text =
        format!("{BALL}[[repeat]]\nof = \"ball\"\ncount = [3, 1]\nstep = [[2, 0], [0, 1]]\n");
    for key in ["repeat.ball.count=[5,1]", "repeat.0.count=[5,1]"] {
        assert_eq!(parse(&text, &[key]).unwrap().bodies.len(), 6, "{key}");
    }
    // two that repeat the same body have numbers only
    let twice = format!("{text}[[repeat]]\nof = \"ball\"\ncount = [2]\nstep = [[0, 9]]\n");
    let error = parse(&twice, &["repeat.ball.count=[5,1]"]).unwrap_err();
    assert!(
        error.to_string().contains("unknown element `ball`"),
        "{error}"
    );
    let error = parse(&twice, &["repeat.1.count=[0]"]).unwrap_err();
    assert!(
        error.to_string().contains("repeat.1.count.0 = 0"),
        "{error}"
    );

    let scene = repeat("name = \"r\"\nring = { centre = [1, 0], radius = 2, count = 4 }").unwrap();
    assert_eq!(names(&scene)[1..], ["r[0]", "r[1]", "r[2]", "r[3]"]);
    let second = &scene.bodies[2];
    // Round-off of a cosine at 90 degrees, times the radius.
    assert!((second.position[0] - 1.0).abs() < 1e-15 && second.position[1] == 2.0);
    assert_eq!(second.angle, std::f64::consts::FRAC_PI_2);

    // On an arc each copy stands in the middle of its share.
    let arc = "ring = { centre = [0, 0], radius = 1, count = 2, arc = [0, 3] }";
    let angles = repeat(arc).unwrap().bodies[1..]
        .iter()
        .map(|b| b.angle)
        .collect::<Vec<_>>();
    assert_eq!(angles, [0.75, 2.25]);

    let random = "count = [40]\nstep = [[1, 0]]\njitter = 0.1\nradius_spread = 0.2\nseed = ";
    let scene = repeat(&format!("{random}7")).unwrap();
    assert_eq!(scene, repeat(&format!("{random}7")).unwrap());
    assert_ne!(scene, repeat(&format!("{random}8")).unwrap());
    for (k, body) in scene.bodies[1..].iter().enumerate() {
        let Shape::Disc { radius } = body.shape else {
            panic!("{:?}", body.shape)
        };
        assert!((0.4..=0.6).contains(&radius));
        assert!((body.position[0] - k as f64).abs() <= 0.1);
    }
}

#[test]
fn further_counts_repeat_the_grid() {
    let text = format!(
        "{BALL}[[repeat]]\nof = \"ball\"\ncount = [3, 2, 2, 2]\n\
         step = [[2, 0], [0, 1], [10, 0], [0, 10]]\nshrink = 1\n"
    );
    let scene = parse(&text, &[]).unwrap();
    // four grids of 3 + 2
    assert_eq!(scene.bodies.len(), 1 + 20);
    let last = scene.bodies.last().unwrap();
    assert_eq!(last.name, "ball[1,1,1,1]");
    assert_eq!(last.position, [2.0 + 1.0 + 10.0, 1.0 + 1.0 + 10.0]);
}

#[test]
fn pins_tie_a_grid_along_each_step_and_copies_can_be_fixed() {
    let text = format!(
        "{BALL}[[repeat]]\nof = \"ball\"\ncount = [3, 2]\nstep = [[1, 0], [0, -1]]\n\
         pins = [[0.5, 0], [0, -0.5]]\nfixed = [[0, 0], [1, 0]]\n"
    );
    let scene = parse(&text, &[]).unwrap();
    let fixed =
        |k: usize| scene.bodies[k].kind == BodyKind::Fixed && scene.bodies[k].mass.is_none();
    assert!(fixed(1) && fixed(2) && !fixed(3));
    let ties: Vec<_> = scene.joints.iter().map(|j| (j.bodies, j.at[0])).collect();
    let expected = [
        // none between the two that are fixed
        ([Some(2), Some(3)], [1.5, 1.0]),
        ([Some(4), Some(5)], [0.5, 0.0]),
        ([Some(5), Some(6)], [1.5, 0.0]),
        ([Some(1), Some(4)], [0.0, 0.5]),
        ([Some(2), Some(5)], [1.0, 0.5]),
        ([Some(3), Some(6)], [2.0, 0.5]),
    ];
    assert_eq!(ties, expected);
}

#[test]
fn parts_make_a_body_of_several_shapes() {
    let text = BALL.replacen(
        "disc = 0.5",
        "parts = [{ disc = 0.5 }, { box = [2, 1], position = [3, 0], angle = 0.5 }]\n\
         gravity_scale = -1\nlinear_damping = 0.25",
        1,
    );
    let body = parse(&text, &[]).unwrap().bodies.remove(1);
    let Shape::Compound(parts) = &body.shape else {
        panic!("{:?}", body.shape)
    };
    assert_eq!(parts[0].shape, Shape::Disc { radius: 0.5 });
    assert_eq!((parts[1].position, parts[1].angle), ([3.0, 0.0], 0.5));
    assert_eq!((body.gravity_scale, body.damping), (-1.0, [0.25, 0.0]));
}

#[test]
fn joints_reach_copies_by_name() {
    let text = format!(
        "{BALL}[[repeat]]\nof = \"ball\"\ncount = [2]\nstep = [[2, 0]]\n\
         [[joint]]\nkind = \"revolute\"\nat = [2, 1]\nbodies = [\"ball[1]\", \"world\"]\n\
         motor = {{ speed = 3, max_torque = 2 }}\n"
    );
    let scene = parse(&text, &[]).unwrap();
    assert_eq!(scene.joints[0].bodies, [Some(2), None]);
    assert_eq!(scene.joints[0].motor.unwrap().speed, Some(3.0));
}

#[test]
fn pins_tie_copies_into_chains_and_rings() {
    let joints = |keys: &str| {
        let text = format!("{BALL}[[repeat]]\nof = \"ball\"\npin = [0.5, 0]\n{keys}\n");
        parse(&text, &[]).unwrap().joints
    };
    let chain = joints("count = [3]\nstep = [[1, 0]]");
    let ends: Vec<_> = chain.iter().map(|j| (j.bodies, j.at[0])).collect();
    let expected = [
        ([Some(1), Some(2)], [0.5, 1.0]),
        ([Some(2), Some(3)], [1.5, 1.0]),
    ];
    assert_eq!(ends, expected);
    // a whole ring closes, and the point turns with the copy
    let ring = joints("ring = { centre = [0, 0], radius = 1, count = 4 }");
    assert_eq!(ring.len(), 4);
    assert_eq!(ring[3].bodies, [Some(4), Some(1)]);
    let [x, y] = ring[1].at[0];
    // a rounding of the cosine at 90 degrees
    assert!(x.abs() < 1e-15 && (y - 1.5).abs() < 1e-15, "{x} {y}");
    let arc = joints("ring = { centre = [0, 0], radius = 1, count = 4, arc = [0, 1] }");
    assert_eq!(arc.len(), 3);
}

#[test]
fn a_sector_is_a_voussoir() {
    let text = BALL.replacen("disc = 0.5", "sector = [2, 0.5, 0.4]", 1);
    let Shape::Polygon { points } = &parse(&text, &[]).unwrap().bodies[1].shape else {
        panic!("no polygon")
    };
    let polar = points.iter().map(|[x, y]| (x.hypot(*y), y.atan2(*x)));
    let expected = [(1.75, -0.2), (2.25, -0.2), (2.25, 0.2), (1.75, 0.2)];
    for (found, expected) in polar.zip(expected) {
        // a few roundings there and back
        assert!((found.0 - expected.0).abs() < 1e-14);
        assert!((found.1 - expected.1).abs() < 1e-14);
    }
}

#[test]
fn flags_change_the_scene_before_it_is_checked() {
    let broken = BALL.replacen("dt = 0.01", "dt = -1", 1);
    let scene = parse(
        &broken,
        &["step.dt=0.5", "body.ball.position=[3, 4]", "body.1.disc=2"],
    )
    .unwrap();
    assert_eq!(scene.step.dt, 0.5);
    assert_eq!(scene.bodies[1].position, [3.0, 4.0]);
    assert_eq!(scene.bodies[1].shape, Shape::Disc { radius: 2.0 });

    // A bare key that one block has, at its default in the file; text falls back to a string.
    let scene = parse(
        BALL,
        &["scheme=moreau", "gravity.y=0", "material.0.friction = 0.1"],
    )
    .unwrap();
    assert_eq!(scene.step.scheme, Scheme::Moreau);
    assert_eq!(scene.gravity, [0.0, 0.0]);
    assert_eq!(scene.materials[0].friction, 0.1);
    assert_eq!(
        parse(BALL, &["body.ball.position.0=7"]).unwrap().bodies[1].position,
        [7.0, 1.0]
    );
}

#[test]
fn gravity_turns_towards_positive_x() {
    let gravity = |keys: &str| {
        let text = BALL.replacen("[step]", &format!("[gravity]\n{keys}\n[step]"), 1);
        parse(&text, &[]).unwrap().gravity
    };
    assert_eq!(parse(BALL, &[]).unwrap().gravity, [0.0, -9.81]);
    assert_eq!(gravity("x = 1"), [1.0, -9.81]);
    let [x, y] = gravity("magnitude = 10\nslope = 0.75");
    // 3-4-5 triangle; a few roundings of numbers of size 10.
    assert!((x - 6.0).abs() < 1e-14 && (y + 8.0).abs() < 1e-14);
    let [x, y] = gravity("magnitude = 10\nangle = 0.6435011087932844");
    assert!((x - 6.0).abs() < 1e-14 && (y + 8.0).abs() < 1e-14);
}

#[test]
fn the_catalogue_holds_every_file_and_loads_it() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes");
    let files: BTreeSet<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    let listed: BTreeSet<String> = scenes()
        .unwrap()
        .iter()
        .map(|s| s.name.to_owned())
        .collect();
    assert_eq!(files, listed);
    let mut hashes = BTreeSet::new();
    for name in &listed {
        let scene = load_any(name);
        assert_eq!(scene.name, *name, "the file and its scene share a name");
        assert_eq!(scene.hash, load_any(&format!("{folder}/{name}.toml")).hash);
        assert!(hashes.insert(scene.hash), "{name}");
    }
}

#[test]
fn catalogue_scenes_hold_what_their_titles_say() {
    let bodies = |name: &str| load(name, &[]).unwrap().bodies.len();
    assert_eq!(bodies("pyramid"), 1 + 55);
    assert_eq!(bodies("tower"), 1 + 10);
    assert_eq!(bodies("cradle"), 5);
    assert_eq!(bodies("drum"), 1 + 200);
    assert_eq!(bodies("arch"), 1 + 27);
    assert_eq!(bodies("large-pyramid"), 1 + 5050);
    assert_eq!(bodies("many-pyramids"), 10 + 100 * 55);
    assert_eq!(bodies("tumbler"), 1 + 45 * 45);
    assert_eq!(bodies("box-drum"), 1 + 900);
    assert_eq!(bodies("drum-of-boxes"), 1 + 576);
    assert_eq!(bodies("grains"), 2 + 1000);
    assert_eq!(bodies("loaded-arch"), 1 + 17 + 4);
    assert_eq!(bodies("card-house"), 1 + 30 + 10);
    assert_eq!(bodies("high-mass-ratio-1"), 1 + 3 * 55);
    assert_eq!(bodies("one-way-platforms"), 2 + 4 + 4 + 1);
    let grid = load("joint-grid", &[]).unwrap();
    // two rows of pins less the six between its seven fixed discs
    assert_eq!(
        (grid.bodies.len(), grid.joints.len()),
        (10_000, 2 * 9900 - 6)
    );
    assert_eq!(bodies("ball-and-chain"), 40 + 1);
    let capstan = load("capstan", &[]).unwrap();
    // 64 links, the drum and two weights; a pin between links and one at each end
    assert_eq!(
        (capstan.bodies.len(), capstan.joints.len()),
        (64 + 3, 63 + 2)
    );
    let incline = load("incline", &[]).unwrap();
    // tan of the slope over the friction coefficient, two roundings.
    let ratio = incline.gravity[0] / -incline.gravity[1] / incline.materials[0].friction;
    assert!((ratio - 1.001).abs() < 1e-15);
}

#[test]
fn drum_grains_start_apart_and_inside() {
    let scene = load("drum", &[]).unwrap();
    let grains: Vec<_> = scene.bodies[1..]
        .iter()
        .map(|body| match body.shape {
            Shape::Disc { radius } => (body.position, radius),
            _ => panic!("{:?}", body.shape),
        })
        .collect();
    // The sides of a 32-gon are this far from its centre.
    let inside = (std::f64::consts::PI / 32.0).cos();
    for (i, (p, r)) in grains.iter().enumerate() {
        assert!(p[0].hypot(p[1]) + r < inside);
        for (q, s) in &grains[..i] {
            assert!((p[0] - q[0]).hypot(p[1] - q[1]) > r + s);
        }
    }
}

#[test]
fn the_hash_sees_values_and_not_their_spelling() {
    let hash = |text: &str, flags: &[&str]| parse(text, flags).unwrap().hash;
    let same = BALL
        .replacen("dt = 0.01", "# as before\ntime = 10.0\ndt = 1e-2", 1)
        .replacen("A ball on a floor", "Another title", 1);
    assert_eq!(hash(BALL, &[]), hash(&same, &[]));
    assert_ne!(hash(BALL, &[]), hash(BALL, &["step.dt=0.02"]));
}

/// Bug: a closed outline that was wound clockwise was a hollow, and nothing said so.
#[test]
fn a_closed_outline_is_a_solid_whichever_way_it_is_wound() {
    let solid = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let clockwise = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]];
    let read = |points: [[f64; 2]; 3], more: &str| {
        let shape = format!("polyline = {points:?}\nclosed = true\n{more}");
        parse(&BALL.replacen("disc = 0.5", &shape, 1), &[]).map(|scene| scene.bodies[1].clone())
    };
    let written = |points: [[f64; 2]; 3]| Shape::Polyline {
        points: points.to_vec(),
        closed: true,
    };
    for points in [solid, clockwise] {
        assert_eq!(read(points, "").unwrap().shape, written(solid));
        let hollow = read(points, "hollow = true\nmass = 1\ninertia = 1").unwrap();
        assert_eq!(hollow.shape, written(clockwise));
        let error = read(points, "hollow = true").unwrap_err().to_string();
        assert!(error.contains("missing key `mass and inertia"), "{error}");
    }
}
