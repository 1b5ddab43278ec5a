//! Wear takes steel and gives none: every worn profile lies within the new one, and within the one
//! before it is no more steel than was there.

use super::rig::part;
use moreau2d::contact::Vec2;
use moreau2d::report::Progress;
use moreau2d::thresher::{self, Machine, WearHistory, run_study, run_threshing};
use moreau2d::wear::{JumpRule, Profile, WearError, WearState};
use proptest::prelude::*;

/// Steel above the new profile that is called round-off \[m\], and area that is \[m²\].
const ROUND_OFF: f64 = 1e-9;
const AREA: f64 = 1e-15;

/// Height of a profile at `x` \[m\] by the straight line between its nodes, which run to the right.
fn height(nodes: &[Vec2], x: f64) -> f64 {
    let (first, last) = (nodes[0], nodes[nodes.len() - 1]);
    assert!(
        (first.x - ROUND_OFF..=last.x + ROUND_OFF).contains(&x),
        "x = {x} m is past the ends of the profile"
    );
    let right = nodes.partition_point(|p| p.x < x).clamp(1, nodes.len() - 1);
    let (a, b) = (nodes[right - 1], nodes[right]);
    a.y + (x - a.x) / (b.x - a.x) * (b.y - a.y)
}

/// How far a worn profile rises above the new one \[m\]; both are straight between their nodes.
fn rise(worn: &[Vec2], new: &[Vec2]) -> f64 {
    let stations = worn.iter().chain(new).map(|p| p.x);
    let above = stations.map(|x| height(worn, x) - height(new, x));
    above.fold(f64::NEG_INFINITY, f64::max)
}

fn area(nodes: &[Vec2]) -> f64 {
    let strip = |e: &[Vec2]| 0.5 * (e[1].x - e[0].x) * (e[0].y + e[1].y);
    nodes.windows(2).map(strip).sum()
}

/// The profiles of a history, the new one first.
fn profiles(history: &WearHistory) -> Vec<Vec<Vec2>> {
    let mut profiles: Vec<Vec<Vec2>> = Vec::new();
    for row in &history.profile {
        if row.node == 1 {
            profiles.push(Vec::new());
        }
        let p = Vec2::new(row.x_m, row.y_m);
        profiles.last_mut().unwrap().push(p);
    }
    profiles
}

fn assert_contained(history: &WearHistory) {
    let profiles = profiles(history);
    assert!(profiles.len() > 5, "{} profiles", profiles.len());
    for (k, pair) in profiles.windows(2).enumerate() {
        let above = rise(&pair[1], &profiles[0]);
        assert!(above < ROUND_OFF, "after jump {}: {above} m", k + 1);
        let grown = area(&pair[1]) - area(&pair[0]);
        assert!(grown < AREA, "jump {}: {grown} m² grown", k + 1);
    }
    assert_volumes(history, &profiles);
}

/// The worn volumes of the cells are what lies between the new profile and each worn one.
fn assert_volumes(history: &WearHistory, profiles: &[Vec<Vec2>]) {
    let cells = history.volume.iter().filter(|r| r.cycles == 0.0).count();
    assert_eq!(history.volume.len(), cells * profiles.len());
    let mut last = 0.0;
    for (rows, profile) in history.volume.chunks(cells).zip(profiles) {
        let sum: f64 = rows.iter().map(|r| r.volume_m3_per_m).sum();
        let between = area(&profiles[0]) - area(profile);
        assert!((sum - between).abs() < AREA, "{sum} m², {between} m²");
        assert!(rows.iter().all(|r| r.volume_m3_per_m >= 0.0));
        last = sum;
    }
    assert!(last > 1e-5, "{last} m²");
}

/// Bug that this guards: the tooth of the study grew 633 um at its tip, because its life was that
/// of the published re-fit.
#[test]
fn the_tooth_of_the_study_grows_nowhere() {
    let one = ["study.torques=[146.39]", "study.speeds=[70]"].map(str::to_owned);
    let (scene, Some(Machine::Study(setup))) = thresher::load("thresher-study", &one).unwrap()
    else {
        panic!("no study");
    };
    let outcome = run_study(&scene, &setup, &Progress::new("", 1, true)).unwrap();
    assert_contained(&outcome.history.unwrap());
}

#[test]
fn the_teeth_of_the_thresher_grow_nowhere() {
    let short = ["wear.max_hours=40", "wear.revolutions=1", "wear.jump=6e-4"].map(str::to_owned);
    let (scene, Some(Machine::Thresher(setup))) = thresher::load("thresher", &short).unwrap()
    else {
        panic!("no thresher");
    };
    let hidden = |_: &str, _: u64| Progress::new("", 1, true);
    let outcome = run_threshing(&scene, &setup, hidden, &mut |_, _| Ok(()), &|_| None).unwrap();
    assert_contained(&outcome.history);
}

/// One jump of the longest that the mesh can follow, 0.3 of an edge.
fn jump(state: &mut WearState, load: impl Fn(usize) -> f64) -> Result<(), WearError> {
    let rule = JumpRule {
        cycles: 1e300,
        depth: 1e300,
        stability: 1.0,
    };
    let load: Vec<f64> = (0..state.profile().node_count()).map(load).collect();
    let next = state.next_jump(&rule, &load, 0.0)?;
    state.advance(&load, next.cycles, 0.0)?;
    Ok(())
}

/// Bug that this guards: two corners of a cap nearer than half a cell were merged into one above
/// them, which kept the area and grew steel.
#[test]
fn a_cap_with_a_short_edge_grows_no_steel() {
    let xy = [
        (0.0, 0.0),
        (1.0, 0.5),
        (1.2, 0.5),
        (2.2, 0.0),
        (3.2, -0.5),
        (4.2, -1.0),
    ];
    let nodes: Vec<Vec2> = xy.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
    let mut state = part(Profile::new(nodes.clone()).unwrap(), 1.0);
    // the toe wears alone
    jump(&mut state, |node| f64::from(node == 5)).unwrap();
    let above = rise(state.profile().nodes(), &nodes);
    assert!(above < ROUND_OFF, "{above} m");
    assert!(area(state.profile().nodes()) < area(&nodes));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Ragged surfaces under ragged loads: edges of a tenth to two cells, peaks and valleys.
    #[test]
    fn a_made_profile_grows_nowhere(
        steps in prop::collection::vec((0.1f64..2.0, -0.5f64..0.5), 8..24),
        loads in prop::collection::vec(0.0f64..1.0, 16..17),
    ) {
        let mut p = Vec2::zeros();
        let mut nodes = vec![p];
        for (dx, slope) in steps {
            p += Vec2::new(dx, slope * dx);
            nodes.push(p);
        }
        let mut state = part(Profile::new(nodes.clone()).unwrap(), 1.0);
        for k in 0..20 {
            let before = state.profile().clone();
            jump(&mut state, |node| loads[(node + 3 * k) % loads.len()].powi(2)).unwrap();
            let worn = state.profile();
            let above = worn.rise_over(&Profile::new(nodes.clone()).unwrap());
            prop_assert!(above < ROUND_OFF, "jump {}: {} m", k, above);
            // round-off of areas of a few hundred
            let grown = worn.area_above(0.0) - before.area_above(0.0);
            prop_assert!(grown < 1e-11, "jump {}: {} m²", k, grown);
        }
    }
}
