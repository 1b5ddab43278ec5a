//! Events are never worse than the plain step, over the catalogue and the atlas of complaints.

use crate::common::{Run, load, run, small};
use moreau2d::dynamics::Scheme;
use moreau2d::scene::{issue_entries, scenes};

/// Overlap or gap that events may add, as a share of the smallest body: a tenth of that at which a
/// scene has not held. An event starts a contact on the surface, where the plain step holds it half a
/// step's curve above; the error of its path is smaller, but may lie on the other side.
const SHARE: f64 = 1e-4;

/// Energy that contacts and joints may give more than in the plain step, as a share of the largest
/// kinetic energy.
const GIVEN: f64 = 1e-9;

/// Further step lengths, as multiples of a scene's own. Of a scene that is chaos one run is a draw: the mean
/// over several counts, of the logarithms where a figure is a length or an energy.
const CHAOS: [f64; 4] = [0.9, 0.95, 1.05, 1.1];

/// What is compared: its name, its value, and by how much it may grow.
fn figures(run: &Run) -> [(&'static str, f64, f64); 4] {
    let sizes = (0..run.built.bodies()).filter_map(|k| run.built.size(k));
    let size = sizes.filter(|s| *s > 0.0).fold(f64::INFINITY, f64::min);
    let largest = run.records.iter().map(|r| r.energy.kinetic_end);
    let (t, most) = (&run.totals, GIVEN * largest.fold(0.0, f64::max));
    let length = |value: f64| (value / size, SHARE);
    let deepest = t.penetration.max(t.penetration_impact);
    let [overlap, gap] = [deepest, t.joint_gap].map(length);
    [
        ("overlap", overlap.0, overlap.1),
        ("joint gap", gap.0, gap.1),
        ("unsolved", t.unsolved_islands as f64, 0.0),
        ("energy given", t.constraint_gain + t.impact_gain, most),
    ]
}

/// The figures of a scene at so many times its own step, without events and with them.
fn both(name: &str, times: f64) -> [[(&'static str, f64, f64); 4]; 2] {
    let own = load(name, small(name)).step;
    let dt = format!("step.dt={:?}", own.dt * times);
    let time = format!("step.time={:?}", own.time.min(10.0));
    ["step.events=false", "step.events=true"].map(|events| {
        let mut flags = small(name).to_vec();
        flags.extend([dt.as_str(), &time, events]);
        figures(&run(&load(name, &flags)))
    })
}

/// The figures that are worse with events at `1/parts` of the scene's step, and in the mean over
/// [`CHAOS`] too.
fn worse(name: &str, parts: u32) -> Vec<(&'static str, f64, f64)> {
    if load(name, &[]).step.scheme == Scheme::Moreau {
        return Vec::new(); // sees no gaps, and refuses events
    }
    let step = 1.0 / f64::from(parts);
    let grows = |plain: f64, located: f64, allowed: f64| located > plain + allowed;
    let [plain, located] = both(name, step);
    let mut found: Vec<usize> = (0..plain.len())
        .filter(|&k| grows(plain[k].1, located[k].1, plain[k].2))
        .collect();
    if !found.is_empty() {
        let others = CHAOS.map(|times| both(name, times * step));
        let mean = |k: usize, events: usize| {
            let all = others.iter().map(|run| run[events][k].1.max(plain[k].2));
            let own = [&plain, &located][events][k].1.max(plain[k].2);
            let count = 1.0 + CHAOS.len() as f64;
            match plain[k].0 {
                "unsolved" => all.fold(own, |sum, x| sum + x) / count,
                _ => (all.fold(own.ln(), |sum, x| sum + x.ln()) / count).exp(),
            }
        };
        found.retain(|&k| grows(mean(k, 0), mean(k, 1), plain[k].2));
    }
    let of = |k: usize| (plain[k].0, plain[k].1, located[k].1);
    found.into_iter().map(of).collect()
}

fn compare(names: &[String], parts: u32) {
    let mut found = Vec::new();
    for name in names {
        for (figure, plain, located) in worse(name, parts) {
            println!("{name}, dt/{parts}: {figure} {plain:.3e} -> {located:.3e}");
            found.push((name, figure, plain, located));
        }
    }
    assert!(found.is_empty(), "worse with events: {found:?}");
}

/// The catalogue without its wear, and the atlas of complaints.
fn all() -> Vec<String> {
    let wear = [
        "pin-on-disc",
        "thresher",
        "thresher-grains",
        "thresher-study",
    ];
    let own = scenes().unwrap().into_iter().map(|s| s.name.to_owned());
    let own = own.filter(|name| !wear.contains(&name.as_str()));
    let issues = issue_entries().unwrap().into_iter();
    own.chain(issues.map(|e| format!("issues/{}", e.name)))
        .collect()
}

/// Scenes with many bodies, and those with many steps.
const LARGE: [&str; 11] = [
    "box-drum",
    "drum",
    "drum-of-boxes",
    "grains",
    "hit-heap",
    "joint-grid",
    "large-pyramid",
    "many-pyramids",
    "tumbler",
    "slider-crank",
    "issues/rope-on-drum",
];

#[test]
fn events_are_never_worse_over_the_catalogue() {
    let mut names = all();
    names.retain(|name| !LARGE.contains(&name.as_str()));
    compare(&names, 1);
}

/// `cargo test --release --test dynamics -- --ignored events_worse --nocapture`
#[test]
#[ignore = "ten minutes"]
fn nor_in_large_scenes() {
    compare(&LARGE.map(str::to_owned), 1);
}

#[test]
#[ignore = "minutes"]
fn nor_at_shorter_steps() {
    // other steps than a sixtieth were chosen for their scenes
    let mut names = all();
    names.retain(|name| load(name, &[]).step.dt == 1.0 / 60.0 && !LARGE.contains(&name.as_str()));
    for parts in [2, 4, 8] {
        compare(&names, parts);
    }
}

/// A thin arch falls. Its stones meet corner to corner in flight, and an impact inside a step drives them
/// on. One fall is a draw: the mean of the logarithms over several thicknesses counts. Single logarithms
/// scatter by some 0.8, so that the mean of eight is known to about 0.3.
#[test]
fn falling_arches_overlap_less_with_events() {
    for parts in [1, 2, 4, 8] {
        let dt = format!("step.dt={:?}", 1.0 / f64::from(60 * parts));
        let [plain, located] = ["step.events=false", "step.events=true"].map(|events| {
            let depth = |k: u32| {
                let thickness = 0.1046 * (1.0 - 0.0025 * f64::from(k));
                let sector =
                    format!("body.voussoir.sector=[1, {thickness:?}, 0.11635528346628864]");
                let totals = run(&load("arch", &[&sector, &dt, events])).totals;
                totals.penetration.max(totals.penetration_impact).ln()
            };
            ((0..8).map(depth).sum::<f64>() / 8.0).exp()
        });
        println!("1/{}: {plain:.2e} -> {located:.2e} m", 60 * parts);
        assert!(
            located < 1.5 * plain,
            "1/{}: {plain} -> {located}",
            60 * parts
        );
    }
}
