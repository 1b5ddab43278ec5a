//! Closed forms of Archard wear through rapier bodies and detected contacts.
//!
//! Load from the contacts of compliant foundations, two points a cell, on the nodes of the cell that
//! detection named; explicit jumps, no smoothing. The long ladders are ignored tests: run them with
//! `cargo test --release --test wear ladder -- --ignored --nocapture`.

use crate::rig::{DT, Guide, K, LEVER, Rig, SPEED, part};
use moreau2d::contact::Vec2;
use moreau2d::wear::{JumpRule, LoadSlip, Profile};

/// Modulus of every foundation [Pa/m].
const MODULUS: f64 = 1e9;

fn flat(width: f64, nodes: usize) -> Profile {
    Profile::quadratic(0.0, 0.0, 0.0, width, nodes).unwrap()
}

/// The profile with every other node higher by `by` \[m\].
fn saw(profile: &Profile, by: f64) -> Profile {
    let tooth = |(i, p): (usize, &Vec2)| p + Vec2::new(0.0, by * (i % 2) as f64);
    Profile::new(profile.nodes().iter().enumerate().map(tooth).collect()).unwrap()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Largest distance of the heights from their mean \[m\].
fn roughness(profile: &Profile) -> f64 {
    let y: Vec<f64> = profile.nodes().iter().map(|p| p.y).collect();
    let mean = mean(&y);
    y.iter().map(|y| (y - mean).abs()).fold(0.0, f64::max)
}

const WIDTH: f64 = 0.04;
/// Mean elastic penetration of the pads \[m\].
const DEPTH: f64 = 1e-5;

fn pad(profile: Profile) -> Rig {
    Rig::new(
        profile,
        Guide::Straight,
        MODULUS * DEPTH * WIDTH,
        MODULUS,
        None,
    )
}

/// Roughness and end nodes of a pad after jumps of `K k S` = 1/2, in depths of a jump.
fn guided(nodes: usize, jumps: usize) -> [f64; 2] {
    let mut rig = pad(flat(WIDTH, nodes));
    let mut ends: f64 = 0.0;
    for _ in 0..jumps {
        let (depth, _) = rig.jump(0.5).unwrap();
        let mean = 0.5 * DEPTH;
        for h in [depth[0], depth[nodes - 1]] {
            ends = ends.max((h / mean - 1.0).abs());
        }
    }
    // h = K F s / A
    let expected = K * MODULUS * DEPTH * rig.slid;
    let y: Vec<f64> = rig.part.profile().nodes().iter().map(|p| -p.y).collect();
    assert!(
        // a pad counts as at rest with 1e-6 of its load to go
        (mean(&y) / expected - 1.0).abs() < 1e-5,
        "{} {expected}",
        mean(&y)
    );
    assert!(rig.area_error() < 1e-12, "{}", rig.area_error());
    [roughness(rig.part.profile()) / (0.5 * DEPTH), ends]
}

/// A wave that one jump leaves is known after the next: fifty jumps say as much as a thousand, which
/// the ladder takes.
#[test]
fn a_guided_pad_stays_flat_to_its_ends() {
    for nodes in [13, 52] {
        let [rough, ends] = guided(nodes, 50);
        assert!(rough < 1e-3 && ends < 1e-3, "{nodes}: {rough} {ends}");
    }
}

#[test]
#[ignore = "a thousand jumps on four meshes"]
fn ladder_of_the_guided_pad() {
    for nodes in [13, 26, 52, 104] {
        let [rough, ends] = guided(nodes, 1000);
        println!("guided pad, {nodes} nodes: roughness {rough:.1e}, ends {ends:.1e} of a jump");
        assert!(rough < 1e-3 && ends < 1e-3, "{nodes}: {rough} {ends}");
    }
}

/// Height of a saw-tooth over its start after `jumps` jumps of `K k S` = `c`.
fn sawn(c: f64, jumps: usize) -> f64 {
    let start = saw(&flat(WIDTH, 27), 0.1 * DEPTH);
    let mut rig = pad(start.clone());
    for _ in 0..jumps {
        rig.jump(c).unwrap();
    }
    roughness(rig.part.profile()) / roughness(&start)
}

#[test]
fn a_saw_tooth_decays_below_two_and_grows_above() {
    // |1 - c| a jump, to the change of the widths by slopes of 1e-3
    for c in [0.5f64, 1.9, 2.1] {
        let jumps = if c < 1.0 { 6 } else { 20 };
        let expected = (1.0 - c).abs().powi(jumps as i32);
        let found = sawn(c, jumps);
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{c}: {found} {expected}"
        );
    }
}

/// Bug that this guards: both callers gave no feedback, and the bound was dead.
#[test]
fn the_measured_feedback_shortens_a_jump() {
    let mut rig = pad(saw(&flat(WIDTH, 27), 0.1 * DEPTH));
    // by the law alone: K k v dt a step of 1e-3 s
    let step = K * MODULUS * SPEED * DT;
    let rule = |stability: f64| JumpRule {
        cycles: 2.1 / step,
        depth: 1.0,
        stability,
    };
    let (depth, kks) = rig.jump_by(&rule(1.0));
    assert!((kks - 1.0).abs() < 1e-12);
    let most = depth.iter().copied().fold(0.0, f64::max);
    // no node wears by more than its penetration, 1.05 of the mean at most
    assert!(most < 1.06 * DEPTH, "{most}");
    assert!((rig.jump_by(&rule(1.9)).1 - 1.9).abs() < 1e-12);
    // a jump that is stable is not shortened
    let short = JumpRule {
        cycles: 0.5 / step,
        ..rule(1.0)
    };
    let (_, kks) = rig.jump_by(&short);
    assert!((kks - 0.5).abs() < 1e-6, "{kks}");
}

/// Error of the slope of a hinged pad, and the largest deviation from a straight line, relative to
/// `h = 3 K M s x / a³`.
fn hinged(nodes: usize, jumps: usize) -> [f64; 2] {
    // a penetration so small that fifty jumps tilt the pad by 0.0013
    let load = MODULUS * 0.2 * DEPTH / WIDTH * WIDTH.powi(3) / 3.0 / LEVER;
    let mut rig = Rig::new(flat(WIDTH, nodes), Guide::Hinge, load, MODULUS, None);
    for _ in 0..jumps {
        rig.jump(0.5).unwrap();
    }
    assert!(rig.area_error() < 1e-12, "{}", rig.area_error());
    assert!(rig.tilt().abs() < 0.01, "{}", rig.tilt());
    let expected = 3.0 * K * load * LEVER * rig.slid / WIDTH.powi(3);
    let points = rig.part.profile().nodes();
    let slope = -points[nodes - 1].y / points[nodes - 1].x;
    let off = points
        .iter()
        .map(|p| (-p.y / WIDTH - slope * p.x / WIDTH).abs());
    [slope / expected - 1.0, off.fold(0.0, f64::max) / slope]
}

#[test]
fn a_hinged_pad_wears_in_proportion_to_the_distance_from_its_hinge() {
    let errors = [13, 26, 52].map(|nodes| hinged(nodes, 20));
    for ([error, straight], n) in errors.into_iter().zip([12.0, 25.0, 51.0f64]) {
        // lumped widths: 1/(2 n²) of n cells
        let expected = -0.5 / (n * n);
        assert!((error - expected).abs() < 5e-5, "{errors:?}");
        assert!(straight < 1e-6, "{errors:?}");
    }
}

#[test]
#[ignore = "fifty jumps on four meshes"]
fn ladder_of_the_hinged_pad() {
    let errors = [13, 26, 52, 104].map(|nodes| hinged(nodes, 50));
    println!("hinged pad: slope and straightness {errors:?}");
    for pair in errors.windows(2) {
        assert!(pair[0][0].abs() > 3.0 * pair[1][0].abs(), "{errors:?}");
    }
}

/// Radius of the cylinder \[m\], and the half angle of its flat at the end \[rad\].
const RADIUS: f64 = 0.02;
const HALF: f64 = 0.2;

/// The cylinder with `cells` over the width of its flat at the end, the depth of its centre then
/// \[m\], and the area that is gone: `R² (φ − sin φ cos φ) = K F s`.
fn arc(cells: usize) -> (Profile, f64, f64) {
    let size = 2.0 * RADIUS * HALF.sin() / cells as f64;
    let side = (0.65 * cells as f64).ceil() as i32;
    let at = |i: i32| {
        let x = size * f64::from(i);
        Vec2::new(x, (RADIUS * RADIUS - x * x).sqrt() - RADIUS)
    };
    let profile = Profile::new((-side..=side).map(at).collect()).unwrap();
    let depth = RADIUS * (1.0 - HALF.cos());
    let area = RADIUS * RADIUS * (HALF - HALF.sin() * HALF.cos());
    (profile, depth, area)
}

/// Relative error of the depth at the centre of a cylinder worn flat, with `cells` over the width of
/// the flat at the end, where the elastic penetration is `soft` of the depth.
fn cylinder(cells: usize, soft: f64) -> (f64, usize) {
    let (profile, depth, area) = arc(cells);
    let load = MODULUS * soft * depth * 2.0 * RADIUS * HALF.sin();
    let slip = area / (K * load);
    let mut rig = Rig::new(profile, Guide::Straight, load, MODULUS, None);
    let mut jumps = 0;
    while rig.slid < slip * (1.0 - 1e-12) {
        let rule = JumpRule {
            cycles: (slip - rig.slid) / (SPEED * DT),
            depth: 1.0,
            stability: 0.5,
        };
        rig.jump_by(&rule);
        jumps += 1;
    }
    assert!(rig.area_error() < 1e-12, "{}", rig.area_error());
    (-rig.part.profile().height() / depth - 1.0, jumps)
}

#[test]
fn a_cylinder_wears_flat() {
    // the ends of the flat lie on nodes of all three meshes
    let errors = [26, 52, 104].map(|cells| cylinder(cells, 0.005).0.abs());
    assert!(errors[2] < 1e-3, "{errors:?}");
    for pair in errors.windows(2) {
        assert!(pair[0] > 3.0 * pair[1], "{errors:?}");
    }
}

#[test]
#[ignore = "hundreds of jumps on four meshes"]
fn ladder_of_the_cylinder() {
    for soft in [0.02, 0.005, 0.002] {
        let errors = [13, 26, 52, 104].map(|cells| cylinder(cells, soft));
        println!("cylinder, softness {soft}: error of the depth, jumps {errors:?}");
        // 13 cells over the flat do not end at its ends
        for pair in errors[1..].windows(2) {
            assert!(pair[0].0.abs() > 3.0 * pair[1].0.abs(), "{errors:?}");
        }
        assert!(errors[3].0.abs() < 1e-4, "{errors:?}");
    }
}

/// Roughness of a punch over its start after `K k S` = 3 in equal jumps.
fn punch(nodes: usize, jumps: usize) -> f64 {
    let golden = |i: usize| ((i + 1) as f64 * 0.618_033_988_75).fract() - 0.5;
    let plane = flat(WIDTH, nodes);
    let rough = plane.nodes().iter().enumerate();
    let rough = rough.map(|(i, p)| p + Vec2::new(0.0, 0.2 * DEPTH * golden(i)));
    let start = Profile::new(rough.collect()).unwrap();
    let mut rig = pad(start.clone());
    for _ in 0..jumps {
        rig.jump(3.0 / jumps as f64).unwrap();
    }
    let spread = |p: &Profile| {
        let y: Vec<f64> = p.nodes().iter().map(|p| p.y).collect();
        y.iter().copied().fold(f64::MIN, f64::max) - y.iter().copied().fold(f64::MAX, f64::min)
    };
    spread(rig.part.profile()) / spread(&start)
}

#[test]
fn a_rough_punch_evens_out_exponentially() {
    // explicit jumps are of first order, their extrapolation of second
    let found = [15, 30, 60].map(|jumps| punch(53, jumps));
    let error = |k: usize| ((2.0 * found[k + 1] - found[k]) / (-3.0f64).exp() - 1.0).abs();
    assert!(error(0) > 3.0 * error(1), "{found:?}");
    assert!(error(1) < 1e-3, "{found:?} {}", error(1));
}

/// The law is that of each node by itself, and exact on any mesh: the error is that of the jumps.
#[test]
#[ignore = "thousands of jumps"]
fn ladder_of_the_rough_punch() {
    let exact = (-3.0f64).exp();
    for nodes in [14, 27, 53, 105] {
        let [a, b] = [500, 1000].map(|jumps| punch(nodes, jumps));
        let (plain, without) = (b / exact - 1.0, (2.0 * b - a) / exact - 1.0);
        println!("rough punch, {nodes} nodes: 1000 jumps {plain:.1e}, with 500 {without:.1e}");
        // a pad counts as at rest with 1e-6 of its load to go: 1e-4 of what is left of its roughness
        assert!(without.abs() < 1e-3, "{nodes}: {without}");
    }
    let plain = punch(105, 5000) / exact - 1.0;
    println!("rough punch, 105 nodes: 5000 jumps {plain:.1e}");
    assert!(plain.abs() < 1e-3, "{plain}");
}

/// A pad forth and back on a counterface, both of which wear: relative errors of the pad's depth, of
/// the depth of the counterface where the whole pad passes, and of both areas.
fn reciprocating(cells: usize) -> [f64; 4] {
    let (width, stroke, steps) = (8e-3, 12e-3, 120);
    let (k_face, load) = (3.0 * K, MODULUS * DEPTH * width);
    // 25 mm of counterface in cells that fit neither the pad's nor the stroke
    let face = flat(0.025, (2.7 * cells as f64) as usize);
    let nodes: Vec<Vec2> = flat(width, cells + 1).nodes().to_vec();
    let aside = |p: &Vec2| p + Vec2::new(-0.0225, 0.0);
    let pad = Profile::new(nodes.iter().map(aside).collect()).unwrap();
    let mut rig = Rig::new(pad, Guide::Straight, load, MODULUS, Some((face, k_face)));
    let speed = stroke / f64::from(steps) / DT;
    for _ in 0..20 {
        rig.step();
    }
    let (mut on_pad, mut on_face) = (
        LoadSlip::new(rig.part.profile().node_count()),
        LoadSlip::new(rig.counterpart.as_ref().unwrap().profile().node_count()),
    );
    for direction in [1.0, -1.0] {
        rig.drive(direction * speed);
        for _ in 0..steps {
            let record = rig.step();
            rig.add(&record, [&mut on_pad, &mut on_face]);
        }
    }
    // a depth so small that both stay flat for the load
    let cycles = 1e-4 * DEPTH / (K * load * 2.0 * stroke / width);
    let area = |p: &Profile| p.area_above(0.0);
    let mut parts = [rig.part.clone(), rig.counterpart.clone().unwrap()];
    let sums = [&on_pad, &on_face];
    let mut areas = [0.0; 2];
    for ((part, sum), (k, error)) in parts
        .iter_mut()
        .zip(sums)
        .zip([K, k_face].into_iter().zip(&mut areas))
    {
        let before = area(part.profile());
        part.advance(sum.sums(), cycles, 0.0).unwrap();
        let taken = k * cycles * sum.sums().iter().sum::<f64>();
        *error = ((before - area(part.profile())) / taken - 1.0).abs();
    }
    let off = |h: &f64, expected: f64| (h / expected - 1.0).abs();
    let depth = K * load * 2.0 * stroke * cycles / width;
    let pad = parts[0].depth().iter().map(|h| off(h, depth));
    let centre = 2.0 * k_face * load * cycles;
    // the pad lies on 14.5 to 22.5 mm at first, and goes to 2.5 to 10.5 mm
    let whole = parts[1].profile().nodes().iter().zip(parts[1].depth());
    let whole = whole.filter(|(p, _)| (0.0115..0.0135).contains(&p.x));
    let face = whole.map(|(_, h)| off(h, centre));
    [
        pad.fold(0.0, f64::max),
        face.fold(0.0, f64::max),
        areas[0],
        areas[1],
    ]
}

#[test]
fn a_reciprocating_pad_wears_both_partners() {
    let found = reciprocating(13);
    assert!(found[0] < 1e-3 && found[1] < 1e-3, "{found:?}");
    assert!(found[2] < 1e-12 && found[3] < 1e-12, "{found:?}");
}

#[test]
#[ignore = "four meshes"]
fn ladder_of_the_reciprocating_pad() {
    for cells in [13, 26, 52, 104] {
        let found = reciprocating(cells);
        println!("reciprocating pad, {cells} cells: pad, face, their areas {found:?}");
        assert!(found[0] < 1e-4 && found[1] < 1e-4, "{found:?}");
        assert!(found[2] < 1e-12 && found[3] < 1e-12, "{found:?}");
    }
}

#[test]
fn a_pad_that_sticks_wears_exactly_nothing() {
    let load = MODULUS * DEPTH * WIDTH;
    let mut rig = Rig::new(flat(WIDTH, 13), Guide::Free, load, MODULUS, None);
    for _ in 0..20 {
        rig.step();
    }
    let sum = rig.cycle();
    let record = rig.step();
    assert!(record.contacts.len() >= 24, "{}", record.contacts.len());
    assert!(
        record
            .contacts
            .iter()
            .all(|c| c.impulse_n > 0.0 && c.impulse_t != 0.0)
    );
    assert_eq!(sum.sums(), [0.0; 13]);
    assert_eq!(sum.stiffness(), [0.0; 13]);
    let mut still = part(flat(WIDTH, 13), K);
    still.advance(sum.sums(), 1e9, 0.0).unwrap();
    assert_eq!(still.profile(), &flat(WIDTH, 13));
}

/// Largest deviation of a guided pad from flat, in depths of a jump, and of the slope of a hinged pad
/// from its closed form, with wear compliance: jumps of `kks` elastic penetrations under a modulus
/// that is `stiff` times that of the other tests.
fn implicit_pads(nodes: usize, kks: f64, stiff: f64) -> [f64; 2] {
    let modulus = stiff * MODULUS;
    // the same depth a jump, whatever the modulus
    let slip = kks / (K * MODULUS);
    let depth = 1e-7;
    let load = depth / (K * slip) * WIDTH;
    let start = saw(&flat(WIDTH, nodes), 0.1 * depth);
    let mut pad = Rig::new(start, Guide::Straight, load, MODULUS, None);
    let mut hinge = Rig::new(flat(WIDTH, nodes), Guide::Hinge, load, MODULUS, None);
    for _ in 0..20 {
        pad.jump_implicitly(modulus, slip);
        hinge.jump_implicitly(modulus, slip);
    }
    let points = hinge.part.profile().nodes();
    let slope = -points[nodes - 1].y / points[nodes - 1].x;
    let expected = 3.0 * K * load * LEVER * hinge.slid / WIDTH.powi(3);
    [
        roughness(pad.part.profile()) / depth,
        slope / expected - 1.0,
    ]
}

/// Far beyond the limit of explicit jumps, and where contacts are rigid.
#[test]
fn wear_compliance_holds_pads_flat_at_any_jump() {
    for (kks, stiff) in [(100.0, 1.0), (100.0, f64::INFINITY)] {
        let [rough, slope] = implicit_pads(52, kks, stiff);
        assert!(
            rough < 1e-3 && slope.abs() < 1e-3,
            "{stiff}: {rough} {slope}"
        );
    }
}

#[test]
#[ignore = "sixty jumps on four meshes"]
fn ladder_with_wear_compliance() {
    for modulus in [MODULUS, f64::INFINITY] {
        let pads = [13, 26, 52, 104].map(|nodes| implicit_pads(nodes, 100.0, modulus / MODULUS));
        println!("wear compliance, {modulus} Pa/m: roughness, slope of a hinge {pads:?}");
        let errors = [26, 52, 104].map(|cells| implicit_cylinder(cells, modulus, 120));
        println!("wear compliance, {modulus} Pa/m: cylinder {errors:?}");
        assert!(pads[3][0] < 1e-3 && pads[3][1].abs() < 1e-3 && errors[2].abs() < 1e-3);
    }
}

/// A cylinder worn flat with wear compliance: relative error of the depth at its centre.
fn implicit_cylinder(cells: usize, modulus: f64, jumps: usize) -> f64 {
    let (profile, depth, area) = arc(cells);
    let load = MODULUS * 5e-4 * depth * 2.0 * RADIUS * HALF.sin();
    let slip = area / (K * load) / jumps as f64;
    let mut rig = Rig::new(profile, Guide::Straight, load, MODULUS, None);
    for _ in 0..jumps {
        rig.jump_implicitly(modulus, slip);
    }
    assert!(rig.area_error() < 1e-12, "{}", rig.area_error());
    -rig.part.profile().height() / depth - 1.0
}

#[test]
fn wear_compliance_wears_a_cylinder_flat() {
    // of 60 jumps the first wears 26 µm, which the mesh follows
    for modulus in [MODULUS, f64::INFINITY] {
        let error = implicit_cylinder(52, modulus, 60);
        assert!(error.abs() < 1e-3, "{modulus}: {error}");
    }
}
