//! The order of the house: a folder of `src/` uses only those before it in the list of the design,
//! and only `src/rapier` knows the engine.

use std::fs;
use std::path::{Path, PathBuf};

/// The core, in order: each folder of `src/` and what it may use, a folder or one module of it.
const CORE: [(&str, &[&str]); 6] = [
    ("linalg", &[]),
    ("contact", &["linalg"]),
    ("solver", &["linalg", "contact"]),
    ("dynamics", &["contact", "solver"]),
    ("rapier", &["contact", "solver", "dynamics"]),
    ("wear", &["contact", "dynamics::record"]),
];

/// The lab, behind the feature `lab`, in order: each folder uses the core and the folders before it.
const LAB: [&str; 10] = [
    "models",
    "oracles",
    "problems",
    "peers",
    "scene",
    "report",
    "experiment",
    "thresher",
    "cli",
    // documentation alone, its examples are compiled as a user's
    "guide",
];

/// What no file of the core may name: files, the terminal, clocks, threads.
const HOST: [&str; 9] = [
    "std::fs",
    "std::io",
    "std::path",
    "std::env",
    "std::time",
    "std::thread",
    "std::process",
    "println",
    "eprintln",
];

/// The one file that shares work out to threads, behind the feature `parallel`.
const THREADS: (&str, &str) = ("rayon", "crew.rs");

/// What only `src/rapier` and `src/peers` may name. (A string may say `"f32"`, serde's forwarding macro lists all
/// primitive types, and an inline test may borrow a number.)
const ENGINE: [&str; 4] = ["rapier2d", "parry2d", "glamx", "f32"];
const SERDE_LIST: &str = "u64 u128 f32 f64";

/// One source file: its module path (`["dynamics", "stepper"]`) and its text without comments.
struct Source {
    path: PathBuf,
    module: Vec<String>,
    code: String,
}

impl Source {
    /// The code up to its inline tests, without declarations of test files.
    fn product(&self) -> String {
        let lines: Vec<&str> = self.code.lines().collect();
        let mut product = Vec::new();
        let mut at = 0;
        while at < lines.len() {
            if lines[at].trim() == "#[cfg(test)]" {
                if !lines.get(at + 1).is_some_and(|next| next.ends_with(';')) {
                    break;
                }
                at += 2;
                continue;
            }
            product.push(lines[at]);
            at += 1;
        }
        product.join("\n")
    }

    /// Whether the whole file is a test.
    fn is_test(&self) -> bool {
        let name = self.module.last();
        name.is_some_and(|name| name == "tests" || name.ends_with("_tests"))
    }
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                let relative = path.strip_prefix(&root).unwrap().with_extension("");
                let mut module: Vec<String> = relative
                    .iter()
                    .map(|part| part.to_string_lossy().into_owned())
                    .collect();
                if ["mod", "lib", "main"].contains(&module[module.len() - 1].as_str()) {
                    module.pop();
                }
                found.push(Source {
                    path,
                    module,
                    code: without_comments(&text),
                });
            }
        }
    }
    found
}

/// Line comments only: the code has no others.
fn without_comments(text: &str) -> String {
    text.lines()
        .map(|line| line.split("//").next().unwrap_or(""))
        .collect::<Vec<_>>()
        .join("\n")
}

/// Plain string literals emptied; good enough for words that are no part of an escape.
fn without_strings(code: &str) -> String {
    code.replace("\\\"", "")
        .split('"')
        .step_by(2)
        .collect::<Vec<_>>()
        .join("\"\"")
}

/// All paths of the use tree (or expression path) at the start of `text`, as far as it is plain.
fn expand(text: &str, prefix: &[String], out: &mut Vec<Vec<String>>) {
    let text = text.trim_start();
    if let Some(group) = text.strip_prefix('{') {
        let mut depth = 0;
        let mut start = 0;
        for (at, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                ',' if depth == 0 => {
                    expand(&group[start..at], prefix, out);
                    start = at + 1;
                }
                '}' if depth == 0 => {
                    expand(&group[start..at], prefix, out);
                    return;
                }
                '}' => depth -= 1,
                _ => {}
            }
        }
        return;
    }
    let word: String = text
        .chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect();
    if word.is_empty() {
        return;
    }
    let mut path = prefix.to_vec();
    path.push(word.clone());
    match text[word.len()..].strip_prefix("::") {
        Some(rest) if !rest.starts_with('<') => expand(rest, &path, out),
        _ => out.push(path),
    }
}

/// The paths from the crate's root that `code` of `module` names, by `crate::` or by `super::`.
fn uses(module: &[String], code: &str) -> Vec<Vec<String>> {
    let mut out = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        expand(&code[at + "crate::".len()..], &[], &mut out);
    }
    let mut end = 0;
    for (at, _) in code.match_indices("super::") {
        if at < end {
            continue;
        }
        let mut rest = &code[at..];
        let mut climbed = 0;
        while let Some(after) = rest.strip_prefix("super::") {
            rest = after;
            climbed += 1;
        }
        end = code.len() - rest.len();
        // an inline module (tests) is one floor deeper than its file
        let inline = code[..at].lines().any(|line| {
            let line = line.trim();
            line.starts_with("mod ") && line.ends_with('{')
        });
        let depth = module.len() + usize::from(inline);
        assert!(climbed <= depth, "super beyond the crate");
        if climbed >= module.len().max(1) && depth == climbed {
            expand(rest, &[], &mut out);
        }
    }
    out
}

/// What a folder may use; `None` for one that has no place in the house.
fn allowed(folder: &str) -> Option<Vec<&'static str>> {
    if let Some((_, allowed)) = CORE.iter().find(|(name, _)| *name == folder) {
        return Some(allowed.to_vec());
    }
    let place = LAB.iter().position(|name| *name == folder)?;
    let core = CORE.iter().map(|(name, _)| *name);
    Some(core.chain(LAB[..place].iter().copied()).collect())
}

fn is_core(source: &Source) -> bool {
    let folder = source.module.first();
    folder.is_some_and(|f| CORE.iter().any(|(name, _)| name == f))
}

/// What `code` in a module uses that it may not.
fn forbidden(module: &[String], code: &str) -> Vec<String> {
    let Some(folder) = module.first() else {
        return Vec::new();
    };
    let allowed = allowed(folder)
        .unwrap_or_else(|| panic!("src/{folder} has no place in the house: add it to this test"));
    let is_folder =
        |name: &str| CORE.iter().any(|(folder, _)| *folder == name) || LAB.contains(&name);
    uses(module, code)
        .into_iter()
        .filter(|path| is_folder(&path[0]) && path[0] != *folder)
        .filter(|path| {
            !allowed.iter().any(|a| {
                let words: Vec<&str> = a.split("::").collect();
                path.len() >= words.len() && words.iter().zip(path).all(|(w, p)| w == p)
            })
        })
        .map(|path| path.join("::"))
        .collect()
}

fn words<'a>(code: &'a str, word: &'a str) -> impl Iterator<Item = usize> + 'a {
    let part = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(word)
        .filter(move |(at, _)| {
            !code[..*at].ends_with(part) && !code[at + word.len()..].starts_with(part)
        })
        .map(|(at, _)| at)
}

#[test]
fn no_folder_uses_one_above_it() {
    let sources = sources();
    let mut edges = 0;
    let mut broken = Vec::new();
    for source in &sources {
        edges += uses(&source.module, &source.code).len();
        for path in forbidden(&source.module, &source.code) {
            broken.push(format!("{} uses crate::{path}", source.path.display()));
        }
    }
    // a reader that finds nothing proves nothing
    assert!(sources.len() > 50 && edges > 150, "{edges} edges");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn only_rapier_and_peers_name_the_engine() {
    let mut broken = Vec::new();
    let mut inside = 0;
    for source in sources() {
        let code = without_strings(&source.product()).replace(SERDE_LIST, "");
        for name in ENGINE {
            let count = words(&code, name).count();
            if source
                .module
                .first()
                .is_some_and(|m| m == "rapier" || m == "peers")
            {
                // inside, the alias of either precision is the name
                inside += count + words(&code, "super::engine").count();
            } else if count > 0 {
                broken.push(format!("{} names {name}", source.path.display()));
            }
        }
    }
    assert!(inside > 10, "{inside}");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// The core can be compiled for the web: no files, terminal, clock or threads, and no feature of the
/// lab.
#[test]
fn the_core_names_no_host() {
    let mut broken = Vec::new();
    let core: Vec<Source> = sources().into_iter().filter(is_core).collect();
    assert!(core.len() > 80, "{}", core.len());
    for source in &core {
        let product = source.product();
        let code = without_strings(&product);
        let mut names: Vec<&str> = HOST.to_vec();
        if !source.path.ends_with(THREADS.1) {
            names.push(THREADS.0);
        }
        names.retain(|name| words(&code, name).count() > 0);
        if product.contains("feature = \"lab\"") {
            names.push("the feature lab");
        }
        if !names.is_empty() && !source.is_test() {
            broken.push(format!("{} names {names:?}", source.path.display()));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// The reader itself: planted edges are seen, those that are allowed are not.
#[test]
fn planted_edges_are_found() {
    let at = |path: &str| path.split("::").map(str::to_owned).collect::<Vec<_>>();
    let cases = [
        ("contact::cone", "use crate::solver::Nsgs;", 1),
        (
            "wear",
            "use crate::dynamics::{record::StepRecord, Rotor};",
            1,
        ),
        (
            "wear",
            "use crate::dynamics::record::{ContactRecord, StepRecord};",
            0,
        ),
        ("wear::state", "fn f() { crate::rapier::widen(0.0); }", 1),
        (
            "rapier::mass",
            "use crate::{contact::Vec2,\n    wear::{Profile, Archard}};",
            2,
        ),
        (
            "scene::check::bodies",
            "use super::super::super::report::Table;",
            1,
        ),
        ("scene::check::bodies", "use super::super::file::Body;", 0),
        ("report", "mod tests {\n use super::super::cli::main;\n}", 1),
        ("dynamics", "use crate::scene::Scene as Crate;", 1),
        (
            "experiment",
            "use crate::report::Progress; // use crate::cli;",
            0,
        ),
    ];
    for (module, code, expected) in cases {
        let found = forbidden(&at(module), &without_comments(code));
        assert_eq!(found.len(), expected, "{module}: {code}\n{found:?}");
    }
    assert_eq!(words("let x: f32 = af32 + f32x4;", "f32").count(), 1);
}
