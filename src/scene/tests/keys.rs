//! The table of keys and the structs that are read say the same.

use super::*;
use crate::scene::keys::{KEYS, listing};
use crate::scene::machine::{self, NoMachine, Whole};
use std::collections::BTreeSet;

/// Every block that the table holds, so that reading it leaves no block out.
const ALL: &str = r#"
[scene]
name = "all"
title = "All blocks"
[[material]]
name = "steel"
[[body]]
name = "ball"
hollow = false
two_sided = false
oscillation = { amplitude = [0, 0], angular_frequency = 1 }
parts = [{ disc = 1 }]
[[joint]]
kind = "revolute"
bodies = ["ball", "world"]
motor = {}
[[repeat]]
of = "ball"
ring = { centre = [0, 0], radius = 1, count = 1 }
[linear]
coordinates = ["x"]
mass = [[1]]
[[linear.contact]]
name = "floor"
gap = 0
normal = [1]
[[wear]]
body = "ball"
coefficient = 1e-13
[life]
duration = 1
[reference]
closed_form = "beam"
"#;

fn collect(json: &serde_json::Value, path: &str, paths: &mut BTreeSet<String>) {
    match json {
        serde_json::Value::Object(table) => {
            for (key, value) in table {
                let path = match path {
                    "" => key.clone(),
                    path => format!("{path}.{key}"),
                };
                collect(value, &path, paths);
            }
        }
        serde_json::Value::Array(items) if items.iter().any(|item| item.is_object()) => {
            items.iter().for_each(|item| collect(item, path, paths));
        }
        _ => {
            paths.insert(path.to_owned());
        }
    }
}

/// A key that the table lacks would be read and not checked.
#[test]
fn the_table_holds_every_key_that_is_read_and_no_other() {
    let document = Document::parse("t.toml", ALL).unwrap();
    let (file, machine) = machine::read::<NoMachine>(&document).unwrap();
    let mut read = BTreeSet::new();
    let whole = Whole::new(&file, &machine);
    collect(&whole.tree(), "", &mut read);
    // the machine's blocks are checked with the machine
    for block in ["tooth", "study", "thresher"] {
        assert!(read.remove(block), "{block}");
    }
    let table: BTreeSet<String> = KEYS.iter().map(|key| key.path.to_owned()).collect();
    assert_eq!(table.len(), KEYS.len(), "a key stands twice");
    assert_eq!(read, table);
}

/// Both ends of every range are allowed, what lies beyond them is not.
#[test]
fn ranges_hold_their_ends() {
    use crate::scene::keys::{Allowed, check};
    let fits = |key: &str, value: String| {
        let text = match key.rsplit_once('.') {
            Some((block, key)) => format!("[{block}]\n{key} = {value}\n"),
            None => format!("{key} = {value}\n"),
        };
        check(&Document::parse("t.toml", &text).unwrap()).is_ok()
    };
    let mut tried = 0;
    for key in KEYS {
        match key.allowed {
            Allowed::Real(least, most) => {
                for value in [least, most] {
                    assert!(fits(key.path, format!("{value:e}")), "{} {value}", key.path);
                }
                for value in [least - least.abs().max(1e-3), most + most.abs()] {
                    assert!(
                        !fits(key.path, format!("{value:e}")),
                        "{} {value}",
                        key.path
                    );
                }
            }
            Allowed::Whole(least, most) => {
                assert!(fits(key.path, least.to_string()) && fits(key.path, most.to_string()));
                assert!(
                    !fits(key.path, (i64::from(least) - 1).to_string()),
                    "{}",
                    key.path
                );
            }
            Allowed::Word(words) => {
                assert!(
                    words
                        .iter()
                        .all(|word| fits(key.path, format!("\"{word}\"")))
                );
                assert!(
                    !fits(key.path, "\"no-such-word\"".to_owned()),
                    "{}",
                    key.path
                );
            }
            _ => continue,
        }
        tried += 1;
    }
    assert!(tried > 50, "{tried}");
}

/// `src/scene/keys.md` stands in the docs. To write it anew: `cargo run -- scenes --keys`.
#[test]
fn the_documented_keys_are_those_of_the_table() {
    assert_eq!(include_str!("../keys.md"), listing());
}
