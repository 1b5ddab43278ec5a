//! The table of `moreau2d::guide::features` names tests; each must exist, so that it cannot rot.

use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Names of all tests of `tests/GROUP/FILE.rs`, or of the files of `tests/GROUP/FILE/`.
fn tests_of(file: &str) -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let groups = fs::read_dir(root)
        .unwrap()
        .map(|group| group.unwrap().path());
    let mut paths = Vec::new();
    for group in groups.filter(|path| path.is_dir()) {
        let single = group.join(file).with_extension("rs");
        if single.is_file() {
            paths.push(single);
        } else if let Ok(folder) = fs::read_dir(group.join(file)) {
            paths.extend(folder.map(|entry| entry.unwrap().path()));
        }
    }
    assert!(
        !paths.is_empty(),
        "no tests/*/{file}.rs and no tests/*/{file}/"
    );
    let mut names = BTreeSet::new();
    for path in paths {
        let text = fs::read_to_string(path).unwrap();
        let mut marked = false;
        for line in text.lines().map(str::trim) {
            if line == "#[test]" {
                marked = true;
            } else if let Some(rest) = line.strip_prefix("fn ") {
                let name = rest.split('(').next().unwrap_or("");
                if std::mem::take(&mut marked) {
                    names.insert(name.to_owned());
                }
            }
        }
    }
    names
}

#[test]
fn every_line_of_the_table_names_tests_that_exist() {
    let text = include_str!("../../src/guide/features.rs");
    let rows: Vec<&str> = text.lines().filter(|l| l.starts_with("//! | ")).collect();
    let heads = rows.iter().filter(|r| r.starts_with("//! | rapier2d |"));
    let heads = heads.count();
    let mut named = 0;
    for row in rows.iter().filter(|r| !r.starts_with("//! | rapier2d |")) {
        let cells: Vec<&str> = row
            .trim_matches(['/', '!', ' ', '|'])
            .split(" | ")
            .collect();
        assert_eq!(cells.len(), 3, "{row}");
        let words: Vec<&str> = cells[2].split_whitespace().collect();
        assert!(!words.is_empty(), "{row}");
        for word in words {
            let test = word.strip_prefix('`').and_then(|w| w.strip_suffix('`'));
            let parts = test.and_then(|t| t.split_once("::"));
            let (file, name) = parts.unwrap_or_else(|| panic!("{word} is no `file::test`"));
            assert!(
                tests_of(file).contains(name),
                "no test {name} in tests/{file}"
            );
            named += 1;
        }
    }
    // a reader that finds nothing proves nothing
    assert!(
        heads == 5 && rows.len() > 40 && named > 60,
        "{heads} {named}"
    );
    assert!(!tests_of("features").contains("tests_of"));
}

/// How stiff and how often rapier solves is nothing to us.
#[test]
fn rapiers_solver_settings_change_nothing() {
    let run = |set: fn(&mut IntegrationParameters)| {
        let mut world = PhysicsWorld::new();
        set(&mut world.integration_parameters);
        world.insert(
            RigidBodyBuilder::fixed(),
            ColliderBuilder::cuboid(10.0, 0.5),
        );
        let boxes = (0..6).map(|k| {
            let place = Vector::new(0.1 * (k % 3) as Real, 1.2 + 1.1 * k as Real);
            let body = RigidBodyBuilder::dynamic().translation(place);
            world.insert(body, ColliderBuilder::cuboid(0.5, 0.5)).0
        });
        let boxes: Vec<RigidBodyHandle> = boxes.collect();
        let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
        for _ in 0..90 {
            pipeline.step(&mut world).unwrap();
        }
        let poses = boxes.iter().map(|h| pipeline.pose(*h));
        poses.collect::<Vec<_>>()
    };
    let plain = run(|_| {});
    let other = run(|parameters| {
        parameters.num_solver_iterations = 1;
        parameters.num_internal_pgs_iterations = 7;
        parameters.contact_softness.natural_frequency = 3.0;
        parameters.contact_recycling = false;
        parameters.max_ccd_substeps = 5;
    });
    assert_eq!(plain, other);
}

/// Voxels collide with their border, exact as other shapes.
#[test]
fn a_box_rests_on_voxels() {
    let mut world = PhysicsWorld::new();
    let corners: Vec<Vector> = (0..20)
        .map(|k| Vector::new(0.25 * k as Real - 2.4, 0.1))
        .collect();
    let voxels = ColliderBuilder::voxels_from_points(Vector::new(0.25, 0.25), &corners);
    world.insert(RigidBodyBuilder::fixed(), voxels);
    let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.05, 1.0));
    let (body, _) = world.insert(body, ColliderBuilder::cuboid(0.5, 0.5));
    let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    for _ in 0..90 {
        assert_eq!(pipeline.step(&mut world).unwrap().unsolved, 0);
    }
    // voxels of 0.25 m on a grid of that size: their top is at 0.25 m
    let height = pipeline.pose(body).unwrap().translation.y;
    assert!((height - 0.75).abs() < 1e-9, "{height}");
}
