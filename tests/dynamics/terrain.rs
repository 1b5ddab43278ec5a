//! Polygons and boxes thrown on terrain: open polylines with convex and concave corners.

use crate::common::{Random, parse, run};
use crate::thrown_together::Overlaps;

fn points(all: &[[f64; 2]]) -> String {
    let all: Vec<String> = all.iter().map(|[x, y]| format!("[{x:?}, {y:?}]")).collect();
    format!("[{}]", all.join(", "))
}

/// The start of a scene with a terrain.
fn terrain(dt: f64, [friction, restitution]: [f64; 2], line: &[[f64; 2]]) -> String {
    format!(
        "[scene]\nname = \"terrain\"\ntitle = \"Bodies fall on terrain\"\n\n\
         [step]\ndt = {dt:?}\ntime = 2\n\n\
         [[material]]\nname = \"rough\"\nfriction = {friction:?}\nrestitution = {restitution:?}\n\n\
         [[body]]\nname = \"terrain\"\nkind = \"fixed\"\npolyline = {}\n",
        points(line)
    )
}

/// A body: its shape, place, angle, velocity and spin.
fn body(name: &str, shape: &str, [x, y, angle]: [f64; 3], [u, v, spin]: [f64; 3]) -> String {
    format!(
        "\n[[body]]\nname = \"{name}\"\n{shape}\ndensity = 500\nposition = [{x:?}, {y:?}]\nangle = {angle:?}\n\
         velocity = [{u:?}, {v:?}]\nspin = {spin:?}\n"
    )
}

/// A box, or the hull of points on an ellipse, by chance, of a half length.
fn shape(random: &mut Random, size: f64) -> String {
    if random.below(3) == 0 {
        return format!("box = [{size:?}, {:?}]", size * random.between(0.2, 1.0));
    }
    let count = 3 + random.below(6);
    let turn = std::f64::consts::TAU;
    let corners: Vec<[f64; 2]> = (0..count)
        .map(|k| (k as f64 + random.between(0.1, 0.9)) * turn / count as f64)
        .map(|angle| [size * angle.cos(), 0.7 * size * angle.sin()])
        .collect();
    format!("polygon = {}", points(&corners))
}

/// So many bodies fall on a terrain from places at which they are apart.
fn shower(random: &mut Random, bodies: usize) -> String {
    let (mut line, mut x) = (Vec::new(), 8.0);
    while x > -8.0 {
        line.push([x, random.between(-0.3, 0.15)]);
        x -= random.between(0.3, 1.5);
    }
    line.push([-8.0, 0.0]);
    let dt = [1.0 / 30.0, 1.0 / 60.0, 1.0 / 60.0, 1.0 / 120.0][random.below(4)];
    let material = [
        random.between(0.1, 0.6),
        [0.0, 0.0, 0.0, 0.3][random.below(4)],
    ];
    let mut text = terrain(dt, material, &line);
    let mut placed: Vec<[f64; 3]> = Vec::new();
    while placed.len() < bodies {
        let [x, y] = [random.between(-3.0, 3.0), random.between(0.8, 6.0)];
        let size = random.between(0.15, 0.5);
        let mut others = placed.iter();
        if others.any(|[a, b, r]| (x - a).hypot(y - b) < size + r + 0.02) {
            continue;
        }
        let shape = shape(random, size);
        let place = [x, y, random.between(-1.5, 1.5)];
        let motion = [
            random.between(-4.0, 4.0),
            random.between(-4.0, 1.0),
            random.between(-10.0, 10.0),
        ];
        text += &body(&format!("b{}", placed.len()), &shape, place, motion);
        placed.push([x, y, size]);
    }
    text
}

/// Bug: a body that turned for one step as it landed was held at the depth of that turn while it slid on. Of these 200
/// scenes 9 ended with a lasting overlap above a thousandth, now 1; in 7 bodies passed through something, in three of
/// these through the terrain; now in 2, and none through the terrain.
#[test]
fn showers_on_terrain_end_without_overlap() {
    let mut random = Random(60);
    let mut overlaps = Overlaps::default();
    for k in 0..200 {
        let bodies = 2 + random.below(9);
        let run = run(&parse(&shower(&mut random, bodies)));
        overlaps.add(k, &run);
        for body in 1..=bodies {
            let end = run.state(body).0.translation;
            assert!(end.x.abs() > 8.0 || end.y > -0.5, "{k}, {body}: {end:?}");
        }
    }
    overlaps.assert_at_most(2, 3);
}

/// One body on a terrain at 1/30 s: the friction, the terrain, and place, motion and corners of the body.
type Fall = (
    f64,
    &'static [[f64; 2]],
    [f64; 3],
    [f64; 3],
    &'static [[f64; 2]],
);

/// Bug: each of these fell through the terrain, or into it by its width.
const FALLS: [Fall; 4] = [
    // a plank that turns on a corner comes down on the segment beside it: the corner's contact hid the other
    (
        0.3,
        &[
            [3.2902, -0.0144],
            [2.5032, 0.11663],
            [1.6988, 0.08639],
            [0.9302, 0.0847],
        ],
        [2.10251359, 1.68557562, 0.5070253789519801],
        [0.54787721, -1.15343562, 4.67621655216602],
        &[
            [0.219032442, 0.0141047377],
            [0.150614416, 0.11221093],
            [-0.208205494, 0.0496540862],
            [-0.217901466, 0.0210019765],
            [-0.219944012, -0.00169303722],
            [-0.208321257, -0.0494155969],
            [0.198090675, -0.0669271118],
            [0.205153622, -0.0555308267],
        ],
    ),
    // a triangle whose centre is below the surface has no contact through its far side
    (
        0.1,
        &[
            [1.8447, 0.145],
            [0.6921, -0.0843],
            [-0.4845, 0.1185],
            [-1.3919, -0.1217],
            [-2.864, -0.159],
        ],
        [-2.35474997, 2.12040106, 0.9890145141781401],
        [2.19532766, 0.592406545, -4.355403403088625],
        &[
            [-0.00973274874, 0.221910987],
            [-0.198342624, -0.17324665],
            [0.316776735, -0.0109830392],
        ],
    ),
    // a corner of the terrain beside a face is not met by it, and left to no neighbour
    (
        0.3,
        &[
            [7.4, 0.0857],
            [6.2286, -0.1043],
            [5.3634, -0.2139],
            [4.7314, -0.272],
            [3.5811, -0.1673],
        ],
        [2.71652346, 2.33648623, 1.3915654491168405],
        [7.29021648, -6.78714815, 15.499641780927469],
        &[
            [-0.0308933473, 0.141111993],
            [-0.176833037, -0.0711195329],
            [-0.122439105, -0.114168719],
            [-0.0930001708, -0.127052055],
            [0.199357954, -0.0300979927],
            [0.203568576, -0.00863534338],
        ],
    ),
    // corner to corner in flight, and past the surface by the next midpoint
    (
        0.1,
        &[
            [3.9207, -0.2532],
            [2.46783, 0.0308575],
            [2.13799, 0.060139],
            [1.04898, -0.20992],
            [0.0, 0.079],
        ],
        [1.64457115, 3.95864538, -0.36088000710372947],
        [1.74441387, -11.2489335, 1.9424184564483085],
        &[
            [0.00563530202, 0.113044958],
            [-0.154513279, -0.033110273],
            [-0.137258035, -0.0596928549],
            [-0.0331816948, -0.110703302],
            [0.160525855, -0.0129666408],
        ],
    ),
];

#[test]
fn fast_polygons_do_not_fall_through_corners_of_terrain() {
    for (k, (friction, line, place, motion, corners)) in FALLS.into_iter().enumerate() {
        let shape = format!("polygon = {}", points(corners));
        let text = terrain(1.0 / 30.0, [friction, 0.0], line) + &body("b", &shape, place, motion);
        let run = run(&parse(&text));
        let deepest = run
            .built
            .deepest_overlap()
            .map_or(0.0, |deepest| deepest.ratio);
        println!("{k}: {deepest}, {} passages", run.totals.passages);
        assert!(deepest < 0.5 && run.totals.passages == 0, "{k}: {deepest}");
        let end = run.state(1).0.translation;
        let [right, left] = [line[0][0], line[line.len() - 1][0]];
        assert!(
            end.y > -0.5 || end.x > right || end.x < left,
            "{k}: {end:?}"
        );
    }
}

/// Bug: each corner that a body slides over is a new landing, which leaves it as deep as it is at the midpoint. The
/// position pass took a quarter of that back in a step: 15 of these 60 slides kept 0.1 to 0.7 % of the body all along.
#[test]
fn slides_over_the_corners_of_hills_keep_no_overlap() {
    let mut random = Random(61);
    let mut overlaps = Overlaps::default();
    for k in 0..60 {
        let count = 20 + random.below(20);
        let [height, wave, phase] = [
            random.between(0.1, 0.5),
            random.between(0.3, 1.0),
            random.between(0.0, 6.0),
        ];
        let mut line = Vec::new();
        for j in 0..=count {
            let x = 8.0 - 16.0 * j as f64 / count as f64;
            line.push([
                x,
                height * (wave * x + phase).sin() + random.between(-0.02, 0.02),
            ]);
        }
        let size = random.between(0.2, 0.4);
        let shape = match random.below(3) {
            0 => format!("disc = {size:?}"),
            1 => format!("capsule = [{:?}, {:?}]", 0.7 * size, 0.3 * size),
            _ => shape(&mut random, size),
        };
        let near = line.iter().filter(|p| (p[0] + 5.0).abs() < 1.2);
        let top = near.map(|p| p[1]).fold(f64::NEG_INFINITY, f64::max);
        let place = [-5.0, top + size + 0.05, 0.0];
        let motion = [random.between(3.0, 9.0), 0.0, 0.0];
        let text = terrain(1.0 / 60.0, [0.0, 0.0], &line) + &body("b", &shape, place, motion);
        overlaps.add(k, &run(&parse(&text)));
    }
    overlaps.assert_at_most(0, 0);
}
