//! What the tests of scenes share.

mod closed_forms;
mod content;
mod contradictions;
mod errors;
mod joints;
mod keys;
mod mangled;
mod models;
mod warnings;
mod wear;

use super::*;

const BALL: &str = r#"[scene]
name = "ball"
title = "A ball on a floor"
[step]
dt = 0.01
[[material]]
name = "steel"
[[body]]
name = "floor"
kind = "fixed"
box = [10, 1]
[[body]]
name = "ball"
disc = 0.5
position = [0, 1]
"#;

fn parse(text: &str, flags: &[&str]) -> Result<Scene, SceneError> {
    let flags: Vec<String> = flags.iter().map(|flag| (*flag).to_owned()).collect();
    Scene::parse("t.toml", text, &flags)
}

/// A scene of the catalogue or of a file, whatever machine it holds.
fn load_any(name: &str) -> Scene {
    let machine = |_: &serde_json::Value, _: &At<'_>| Ok(());
    load_machine(name, &[], machine).unwrap().0
}

fn error_of(text: &str, flags: &[&str]) -> String {
    match parse(text, flags) {
        Ok(_) => panic!("accepted: {flags:?}\n{text}"),
        Err(error) => error.to_string(),
    }
}

/// Asserts that the error of `BALL` with `old` replaced by `new` holds all of `expected`.
#[track_caller]
fn assert_error(old: &str, new: &str, expected: &[&str]) {
    for part in expected {
        refused(BALL, old, new, part);
    }
}

/// The same of another text.
#[track_caller]
fn refused(text: &str, old: &str, new: &str, expected: &str) {
    assert!(text.contains(old), "{old}");
    let error = error_of(&text.replacen(old, new, 1), &[]);
    assert!(
        error.contains(expected),
        "{new}\n  {error}\n  lacks {expected}"
    );
}
