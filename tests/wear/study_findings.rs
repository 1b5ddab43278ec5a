//! What agrees with the published study and what cannot: the figures of the guide `study_findings`.

use moreau2d::report::Progress;
use moreau2d::thresher::{
    self, Machine, PUBLISHED, StudyOutcome, Update, depth_over_friction, life_over_friction,
    oracle_load_slip, run_study,
};

fn load(
    flags: &[&str],
) -> (
    moreau2d::scene::Scene,
    moreau2d::thresher::Setup<moreau2d::thresher::Study>,
) {
    let flags: Vec<String> = flags.iter().map(|f| (*f).to_owned()).collect();
    let (scene, machine) = thresher::load("thresher-study", &flags).unwrap();
    let Some(Machine::Study(setup)) = machine else {
        panic!("no study");
    };
    (scene, setup)
}

/// A load cycle is exact with any step: 5e-15 from the algebra with this one.
fn run(flags: &[&str]) -> StudyOutcome {
    let (scene, setup) = load(&[&["step.dt=1e-5"], flags].concat());
    run_study(&scene, &setup, &Progress::new("", 1, true)).unwrap()
}

/// Agrees: torque, and speed up to 100 rad/s. The kinks at 110 and 120 rad/s do not, and they are of the data:
/// the freest power law has them too.
#[test]
fn the_depths_agree_up_to_the_kinks_and_no_power_law_has_those() {
    let outcome = run(&["study.frictions=[]"]);
    let rows = &outcome.comparison;
    assert_eq!(rows.len(), PUBLISHED.len());
    for row in rows {
        let off = row.relative_error;
        match (row.torque_nm, row.omega_rad_s) {
            (146.39, speed) if speed <= 100.0 => assert!(off.abs() < 0.045, "{row:?}"),
            (146.39, speed) => assert!(off < -0.16 && speed > 100.0, "{row:?}"),
            _ => assert!(off.abs() < 0.22, "{row:?}"),
        }
    }
    // ln h = a + b ln T + c ln ω, least squares over all twelve points
    let logs = rows.iter().map(|r| {
        let x = [1.0, r.torque_nm.ln(), r.omega_rad_s.ln()];
        (x, r.published_um.ln())
    });
    let (mut a, mut b) = ([[0.0; 3]; 3], [0.0; 3]);
    for (x, y) in logs.clone() {
        for i in 0..3 {
            b[i] += x[i] * y;
            (0..3).for_each(|j| a[i][j] += x[i] * x[j]);
        }
    }
    let found = solve(a, b);
    let miss = logs.map(|(x, y)| {
        let law: f64 = x.iter().zip(&found).map(|(x, c)| x * c).sum();
        ((law - y).exp() - 1.0).abs()
    });
    let misses: Vec<f64> = miss.collect();
    let mean = misses.iter().sum::<f64>() / 12.0;
    let most = misses.iter().copied().fold(0.0, f64::max);
    println!(
        "power law: torque^{:.3} speed^{:.3}, mean {mean:.3}, most {most:.3}",
        found[1], found[2]
    );
    assert!(mean > 0.04 && most > 0.12, "{mean} {most}");
}

/// Gauss's elimination of a matrix with a positive diagonal.
fn solve(mut a: [[f64; 3]; 3], mut b: [f64; 3]) -> [f64; 3] {
    for k in 0..3 {
        for i in k + 1..3 {
            let factor = a[i][k] / a[k][k];
            (k..3).for_each(|j| a[i][j] -= factor * a[k][j]);
            b[i] -= factor * b[k];
        }
    }
    let mut x = [0.0; 3];
    for k in (0..3).rev() {
        let rest: f64 = (k + 1..3).map(|j| a[k][j] * x[j]).sum();
        x[k] = (b[k] - rest) / a[k][k];
    }
    x
}

/// Cannot agree: under a given torque more friction leaves less normal force, so that wear falls, in every way
/// to share the load. The published depths rise, the published lives reverse three times.
#[test]
fn friction_acts_the_other_way_in_every_sharing_of_the_load() {
    for shares in ["winkler", "equal", "lever"] {
        let flag = format!("study.shares={shares}");
        let held = "study.contact_time=6.953e-4";
        let outcome = run(&["study.torques=[146.39]", "study.speeds=[70]", &flag, held]);
        let rows = &outcome.frictions;
        // every row is one of its own
        for pair in rows.windows(2) {
            assert!(
                pair[1].computed_um < 0.99 * pair[0].computed_um,
                "{shares}: {pair:?}"
            );
            // the other sharings wear the base through before the tall end is unfit
            if shares == "winkler" {
                assert!(pair[1].life_hours > 1.01 * pair[0].life_hours, "{pair:?}");
            }
        }
        for pair in outcome.friction_depths.windows(2) {
            if pair[0].torque_nm == pair[1].torque_nm {
                assert!(
                    pair[1].computed_um < pair[0].computed_um,
                    "{shares}: {pair:?}"
                );
            }
        }
        if shares == "winkler" {
            let published: Vec<f64> = (rows.iter())
                .map(|r| r.published_hours)
                .filter(|h| h.is_finite())
                .collect();
            let rises: Vec<bool> = published.windows(2).map(|p| p[1] > p[0]).collect();
            assert_eq!(rises.windows(2).filter(|r| r[0] != r[1]).count(), 3);
            // a range of one torque at one friction cannot hold both of the torques
            let at = |torque: f64, friction: f64| {
                let rows = outcome.friction_depths.iter();
                let mut own = rows.filter(|r| r.torque_nm == torque && r.friction == friction);
                own.next().unwrap().clone()
            };
            let (low, high) = (at(20.87, 0.14), at(54.37, 0.14));
            assert_eq!(
                (low.published_least_um, low.published_most_um),
                (492.0, 718.0)
            );
            assert!(low.computed_um > low.published_most_um);
            let ratio = high.computed_um / low.computed_um;
            // nearly as the torques, 2.6; the published range spans 1.46
            assert!((2.3..2.7).contains(&ratio), "{ratio}");
        }
    }
}

/// "Maximum at cell 6, minimum at cell 26" belongs to an axis distance of 31.6 mm and equal torques of the
/// cells: there the lever of the normal force of cell 6 vanishes. At 0.25 m the tall end leads.
#[test]
fn the_sixth_cell_is_deepest_for_the_short_lever_alone() {
    let deepest = |flags: &[&str]| {
        let (_, setup) = load(flags);
        let profile = setup.tooth.profile().unwrap();
        let study = &setup.parameters;
        let load =
            oracle_load_slip(study, &profile, Update::Quadratic, 146.39, 70.0, 7e-4).unwrap();
        let most = (0..load.len())
            .max_by(|a, b| load[*a].total_cmp(&load[*b]))
            .unwrap();
        let least = (0..load.len())
            .min_by(|a, b| load[*a].total_cmp(&load[*b]))
            .unwrap();
        [most + 1, least + 1]
    };
    let short = ["study.axis_distance=0.0316", "study.shares=lever"];
    let [most, least] = deepest(&short);
    println!("31.6 mm: most at {most}, least at {least}");
    assert_eq!([most, least], [6, 26]);
    let [most, _] = deepest(&[]);
    assert_eq!(most, 1);
}

#[test]
fn the_pictures_have_every_published_number() {
    let outcome = run(&["study.torques=[146.39]", "study.speeds=[70]"]);
    let chart = life_over_friction(&outcome.frictions, "");
    assert_eq!(chart.series[0].points.len(), 6);
    let published = &chart.series[1].points;
    for point in [
        (0.14, 64.0),
        (0.25, 27.0),
        (0.3, 31.0),
        (0.35, 14.0),
        (0.35, 31.0),
        (0.4, 20.0),
    ] {
        assert!(published.contains(&point), "{published:?}");
    }
    assert_eq!(published.len(), 6);
    let chart = depth_over_friction(&outcome.friction_depths, "");
    let ranges: Vec<_> = chart
        .series
        .iter()
        .skip(2)
        .map(|s| s.points.clone())
        .collect();
    let bar = |f: f64, [a, b]: [f64; 2]| vec![(f, 1e-3 * a), (f, 1e-3 * b)];
    assert_eq!(
        ranges,
        [bar(0.14, [492.0, 718.0]), bar(0.4, [2569.0, 2850.0])]
    );
    assert!(chart.to_svg().is_ok());
}
