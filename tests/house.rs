//! The order of the house: a folder of `src/` uses only those before it in the list of the design,
//! and only `src/rapier` knows the engine.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The core, in order: each folder of `src/` and what it may use, a folder or one module of it.
const CORE: [(&str, &[&str]); 8] = [
    ("threads", &[]),
    ("linalg", &[]),
    ("contact", &["linalg"]),
    ("solver", &["threads", "linalg", "contact"]),
    ("dynamics", &["threads", "contact", "solver"]),
    ("rapier", &["threads", "contact", "solver", "dynamics"]),
    ("wear", &["contact", "dynamics::record"]),
    // where the two that never see each other meet
    ("worn", &["contact", "dynamics", "rapier", "wear"]),
];

/// The lab, behind the feature `lab`, in order: each folder uses the core and the folders before it.
const LAB: [&str; 11] = [
    "checkpoint",
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

/// What no file of the core may name: files, the terminal, clocks.
const HOST: [&str; 8] = [
    "std::fs",
    "std::io",
    "std::path",
    "std::env",
    "std::time",
    "std::process",
    "println",
    "eprintln",
];

/// What one file of the core alone may name: that of the threads, behind the feature `parallel`.
const THREADS: ([&str; 2], &str) = (["rayon", "std::thread"], "threads/pool.rs");

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

/// Every run of `super::` in `code`: where it begins, how many floors it climbs, and what follows.
fn climbs(code: &str) -> Vec<(usize, usize, &str)> {
    let mut found = Vec::new();
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
        found.push((at, climbed, rest));
    }
    found
}

/// The paths from the crate's root that `code` of `module` names, by `crate::` or by `super::`.
fn uses(module: &[String], code: &str) -> Vec<Vec<String>> {
    let mut out = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        expand(&code[at + "crate::".len()..], &[], &mut out);
    }
    for (at, climbed, rest) in climbs(code) {
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
        names.extend(THREADS.0);
        if source.path.ends_with(THREADS.1) {
            names.retain(|name| !THREADS.0.contains(name));
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

/// Folders in which no file may import, by whatever way round, a file that imports it.
const WITHOUT_CIRCLES: [&str; 4] = ["linalg", "contact", "solver", "dynamics"];

/// Which file imports which within a folder; a name that `mod.rs` re-exports is the file's that has it.
fn imports(sources: &[Source], folder: &str) -> BTreeMap<String, BTreeSet<String>> {
    let own =
        |source: &&Source| !source.is_test() && source.module.first().is_some_and(|m| m == folder);
    let files: BTreeMap<String, String> = sources
        .iter()
        .filter(own)
        .map(|source| (source.module.join("::"), source.product()))
        .collect();
    // what a module re-exports, and from where; and its code without that
    let mut exports = BTreeMap::new();
    let mut codes = BTreeMap::new();
    for (module, code) in &files {
        let mut rest = String::new();
        for statement in code.split_inclusive(';') {
            let start = statement
                .find("pub use ")
                .or(statement.find("pub(crate) use "));
            let Some(start) = start.filter(|_| statement.ends_with(';')) else {
                rest.push_str(statement);
                continue;
            };
            rest.push_str(&statement[..start]);
            let tree = &statement[start..];
            let tree = &tree[tree.find("use ").unwrap_or(0) + 4..];
            let prefix: Vec<String> = module.split("::").map(str::to_owned).collect();
            let mut paths = Vec::new();
            expand(tree, &prefix, &mut paths);
            for path in paths {
                let (name, home) = path.split_last().expect("a path has a name");
                exports.insert((module.clone(), name.clone()), home.join("::"));
            }
        }
        codes.insert(module.clone(), rest);
    }
    let resolve = |path: &[String]| -> Option<String> {
        let prefixes = (1..=path.len()).rev();
        let (mut file, length) = prefixes
            .map(|k| (path[..k].join("::"), k))
            .find(|(file, _)| files.contains_key(file))?;
        if let Some(name) = path.get(length) {
            while let Some(home) = exports.get(&(file.clone(), name.clone())) {
                if !files.contains_key(home) {
                    break;
                }
                file.clone_from(home);
            }
        }
        Some(file)
    };
    let mut graph: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, code) in &codes {
        let depth: Vec<String> = module.split("::").map(str::to_owned).collect();
        let mut paths = Vec::new();
        for (at, _) in code.match_indices("crate::") {
            expand(&code[at + "crate::".len()..], &[], &mut paths);
        }
        for (_, climbed, rest) in climbs(code) {
            let prefix = &depth[..depth.len().saturating_sub(climbed)];
            expand(rest, prefix, &mut paths);
        }
        let found = paths.iter().filter_map(|path| resolve(path));
        let others = found.filter(|file| file != module);
        graph.entry(module.clone()).or_default().extend(others);
    }
    graph
}

/// Files of a graph that can be reached from themselves.
fn in_circles(graph: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let reaches = |start: &String| {
        let mut seen = BTreeSet::new();
        let mut open: Vec<&String> = graph[start].iter().collect();
        while let Some(file) = open.pop() {
            if seen.insert(file) {
                open.extend(graph.get(file).into_iter().flatten());
            }
        }
        seen.contains(start)
    };
    graph.keys().filter(|file| reaches(file)).cloned().collect()
}

#[test]
fn no_file_imports_what_imports_it() {
    let sources = sources();
    let mut edges = 0;
    for folder in WITHOUT_CIRCLES {
        let graph = imports(&sources, folder);
        edges += graph.values().map(BTreeSet::len).sum::<usize>();
        let circles = in_circles(&graph);
        assert!(circles.is_empty(), "import circles through {circles:?}");
    }
    // a reader that finds nothing proves nothing
    assert!(edges > 100, "{edges} edges");
}

/// The reader of circles: a circle through a re-export is seen, a chain is none.
#[test]
fn planted_circles_are_found() {
    let source = |path: &str, code: &str| Source {
        path: PathBuf::from(path),
        module: path.split("::").map(str::to_owned).collect(),
        code: code.to_owned(),
    };
    let facade = "mod law;\nmod problem;\npub use law::Law;\npub use problem::Problem;\n";
    let circle = [
        source("contact", facade),
        source("contact::law", "use super::Problem;"),
        source("contact::problem", "use crate::contact::{Law, Other};"),
    ];
    let graph = imports(&circle, "contact");
    assert_eq!(in_circles(&graph), ["contact::law", "contact::problem"]);
    let chain = [
        source("contact", facade),
        source("contact::law", "use crate::linalg::Block;"),
        source("contact::problem", "use super::Law;"),
    ];
    assert!(in_circles(&imports(&chain, "contact")).is_empty());
}

/// Rows of a table in a documentation comment: the cells of each line, without its header.
fn table_rows(text: &str, heading: &str) -> Vec<Vec<String>> {
    let lines = text.lines().skip_while(|line| *line != heading);
    let rows = lines.skip(2).take_while(|line| line.starts_with("//! |"));
    let cells = |row: &str| {
        let row = row.trim_start_matches("//! |").trim_end_matches('|');
        row.split('|').map(|cell| cell.trim().to_owned()).collect()
    };
    rows.map(cells).collect()
}

/// The page that tells how a contact becomes wear names files and items that exist.
#[test]
fn the_page_of_the_data_flow_names_what_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = include_str!("../src/guide/data_flow.rs");
    let rows = table_rows(page, "//! | step | file | name | what it does |");
    assert!(rows.len() > 20, "{} rows", rows.len());
    for row in rows {
        let [file, name] = [&row[1], &row[2]].map(|cell| cell.trim_matches('`'));
        let text = fs::read_to_string(root.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        let defined = ["struct", "enum", "trait", "fn"]
            .iter()
            .any(|kind| words(&without_comments(&text), &format!("{kind} {name}")).count() > 0);
        assert!(defined, "{file} does not define {name}");
    }
    // every other path on the page exists too
    for quoted in page
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|q| q.contains('/'))
    {
        let path = quoted.trim_end_matches('/');
        assert!(root.join(path).exists(), "{path} does not exist");
    }
}

/// A glossary is of use while it is short.
#[test]
fn the_glossary_has_at_most_forty_terms() {
    let rows = table_rows(include_str!("../src/lib.rs"), "//! | term | meaning |");
    assert!((20..=40).contains(&rows.len()), "{} terms", rows.len());
}
