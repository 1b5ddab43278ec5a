//! What a shell and a terminal see: completions, widths, pipes, sizes.

use crate::common::program::Place;
use std::fs;
use std::io::Write;
use std::process::{Output, Stdio};

/// Runs with `input` as standard input.
fn piped(place: &Place, args: &[&str], input: &[u8]) -> (i32, String, String) {
    let mut command = place.command(args);
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    // the program may refuse its input before it has read all of it
    let _ = child.stdin.take().unwrap().write_all(input);
    let Output {
        status,
        stdout,
        stderr,
    } = child.wait_with_output().unwrap();
    let [out, err] = [stdout, stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(!err.contains("panicked"), "{err}");
    (status.code().unwrap_or(-1), out, err)
}

fn tower() -> Vec<u8> {
    fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/tower.toml")).unwrap()
}

#[test]
fn completions_know_commands_and_flags() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let (code, out, err) = place.run(&["completions", shell]);
        assert_eq!((code, err.as_str()), (0, ""), "{shell}");
        for word in ["thresher-study", "explain", "animate", "completions"] {
            // names of scenes are no part of a script
            assert_eq!(
                out.contains(word),
                word != "thresher-study",
                "{shell}: {word}"
            );
        }
    }
    place.refused(
        &["completions", "tcsh"],
        &["tcsh", "bash, elvish, fish, powershell, zsh"],
    );
}

#[test]
fn help_is_at_most_80_columns_wide() {
    let place = Place::new();
    for command in [
        "",
        "run",
        "scenes",
        "explain",
        "compare",
        "chart",
        "atlas",
        "bench",
        "sweep",
        "merge",
        "solve",
        "completions",
    ] {
        let mut args = vec!["--help"];
        if !command.is_empty() {
            args.insert(0, command);
        }
        let (code, out, _) = place.run(&args);
        assert_eq!(code, 0);
        let wide = out.lines().find(|line| line.chars().count() > 80);
        assert_eq!(wide, None, "{command}");
    }
}

#[test]
fn a_scene_comes_from_standard_input() {
    let place = Place::new();
    place.write("tower.toml", tower());
    let (code, _, err) = place.run(&[
        "run",
        "tower.toml",
        "--steps",
        "3",
        "--quiet",
        "--out",
        "file",
    ]);
    assert_eq!(code, 0, "{err}");
    let run = ["run", "-", "--steps", "3", "--quiet", "--out", "piped"];
    let (code, _, err) = piped(&place, &run, &tower());
    assert_eq!(code, 0, "{err}");
    for file in ["bodies.csv", "contacts.csv", "steps.csv"] {
        let read = |folder: &str| fs::read(place.path(&format!("{folder}/{file}"))).unwrap();
        assert_eq!(read("file"), read("piped"), "{file}");
    }
    let (code, out, _) = piped(&place, &["explain", "-"], &tower());
    assert!(code == 0 && out.starts_with("tower: "), "{out}");
    // one point of a chart reads its scene twice, standard input once
    let point = [
        "chart", "-", "--quick", "--engine", "moreau", "--time", "0.1", "--out", "c", "--quiet",
    ];
    let (code, _, err) = piped(&place, &point, &tower());
    assert_eq!(code, 0, "{err}");
}

#[test]
fn what_is_wrong_in_standard_input_has_its_place() {
    let place = Place::new();
    let text = String::from_utf8(tower())
        .unwrap()
        .replacen("\nbox =", "\nbxx =", 1);
    let line = 1 + text[..text.find("bxx").unwrap()].matches('\n').count();
    for (args, input, words) in [
        (
            &["run", "-"] as &[&str],
            text.as_bytes(),
            [format!("<stdin>:{line}:"), "did you mean `box`".to_owned()],
        ),
        (
            &["run", "-"],
            b"",
            [
                "<stdin>: cannot read the scene: it is empty".to_owned(),
                "`moreau2d run - < FILE`".to_owned(),
            ],
        ),
        (
            &["explain", "-"],
            b"\xff",
            ["<stdin>".to_owned(), "cannot read the scene".to_owned()],
        ),
        (
            &["chart", "-", "-"],
            &tower(),
            ["named twice".to_owned(), "tower".to_owned()],
        ),
    ] {
        let (code, out, err) = piped(&place, args, input);
        assert_eq!((code, out.as_str()), (1, ""), "{args:?}: {err}");
        for word in words {
            assert!(err.contains(&word), "{args:?}: lacks `{word}`: {err}");
        }
    }
    assert!(place.everything().is_empty());
}

#[test]
fn a_file_that_is_too_large_is_refused_unparsed() {
    let place = Place::new();
    // no TOML at all: the size comes first
    let text = vec![b'='; (8 << 20) + 1];
    place.write("big.toml", &text);
    place.refused(
        &["run", "big.toml"],
        &["big.toml: larger than 8 MiB", "[[repeat]]"],
    );
    let (code, _, err) = piped(&place, &["run", "-"], &text);
    assert!(
        code == 1 && err.contains("<stdin>: larger than 8 MiB"),
        "{err}"
    );
    place.write("big.toml", &text[1..]);
    place.refused(&["run", "big.toml"], &["big.toml:1:", "malformed TOML"]);
}

#[test]
#[cfg(target_os = "linux")]
fn what_cannot_be_printed_is_an_error() {
    let place = Place::new();
    for args in [
        &["scenes"] as &[&str],
        &["scenes", "--keys"],
        &["--help"],
        &["completions", "bash"],
        &["run", "tower", "--steps", "2", "--out", "r"],
        &["explain", "pendulum"],
    ] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let output = place.command(args).stdout(full).output().unwrap();
        let err = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{args:?}: {err}");
        assert!(err.contains("<stdout>: "), "{args:?}: {err}");
    }
    // the results were there before they were printed
    assert!(place.path("r/summary.json").exists());
}

#[test]
fn a_closed_pipe_is_no_error() {
    let place = Place::new();
    for args in [&["scenes", "--keys"] as &[&str], &["completions", "zsh"]] {
        let mut command = place.command(args);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{args:?}");
        assert!(output.stderr.is_empty(), "{args:?}");
    }
}

#[test]
fn a_bench_draws_its_throughput() {
    let place = Place::new();
    let args = [
        "bench", "wedge", "--steps", "3", "--settle", "2", "--quiet", "--out", "b",
    ];
    let (code, _, err) = place.run(&args);
    assert_eq!(code, 0, "{err}");
    let svg = fs::read_to_string(place.path("b/throughput.svg")).unwrap();
    for word in ["contacts", "time of a step", "moreau", "rapier", "wedge"] {
        assert!(svg.contains(word), "{word}");
    }
    assert_eq!(
        place.json("b/summary.json")["pictures"][0],
        "throughput.svg"
    );
}
