//! Without the feature `box2d`: every place that takes an engine says what would bring it.

use crate::common::program::Place;
use moreau2d::experiment::{Engine, RunError};
use moreau2d::scene;

const WORDS: &str = "not built in: needs the cargo feature `box2d`";

#[test]
fn every_command_names_the_feature() {
    for args in [
        &["run", "tower", "--engine", "box2d"][..],
        &["chart", "tower", "--engine", "box2d"],
        &["bench", "tower", "--against", "box2d"],
        &["bench", "tower", "--against", "rapier,box2d"],
    ] {
        Place::new().refused(args, &[WORDS]);
    }
}

#[test]
fn the_library_names_it_too_and_lists_no_such_engine() {
    assert!(Engine::ALL.iter().all(|(name, _)| *name != "box2d"));
    assert!(Engine::named("box2d").unwrap_err().starts_with(WORDS));
    let tower = scene::load("tower", &[]).unwrap();
    let Err(RunError::Unfit(why)) = Engine::Box2d.fits(&tower) else {
        panic!("fits without being there");
    };
    assert!(why.contains(WORDS), "{why}");
    let mut built = tower.build().unwrap();
    assert!(Engine::Box2d.prepare(&mut built).is_err());
    assert!(Engine::Box2d.step(&mut built).is_err());
}
