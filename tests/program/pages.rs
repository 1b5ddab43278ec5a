//! `compare`, `chart` and `atlas` with `--report`: one page that needs no other file.

use crate::common::program::Place;
use std::fs;

fn page(args: &[&str]) -> (Place, String) {
    let place = Place::new();
    let all = [args, &["--report", "--quiet", "--out", "r"]].concat();
    let (code, _, err) = place.run(&all);
    assert!(code == 0 || code == 2, "{args:?}: {err}");
    let html = fs::read_to_string(place.path("r/report.html")).unwrap();
    (place, html)
}

#[test]
fn a_page_has_the_pictures_tables_and_what_was_typed() {
    for (args, pictures) in [
        (
            &[
                "compare",
                "sliding-block",
                "--repeats",
                "1",
                "--no-sweep",
                "--time",
                "0.5",
            ] as &[&str],
            &["work-precision.svg"] as &[&str],
        ),
        (
            &["chart", "sliding-block", "--quick", "--time", "0.5"],
            &["sliding-block.svg"],
        ),
        (&["atlas", "tower", "--quick"], &["atlas.svg"]),
    ] {
        let (place, html) = page(args);
        for word in [
            "What came out",
            "Trust",
            "What to do",
            "<h2>Results</h2>",
            "<h2>Settings</h2>",
        ] {
            assert!(html.contains(word), "{args:?} lacks {word}");
        }
        assert!(
            html.contains(&format!("moreau2d {}", args.join(" "))),
            "{args:?}"
        );
        assert!(html.contains(env!("CARGO_PKG_VERSION")));
        // nothing is loaded, and no picture is left to its file
        assert!(
            !html.contains("src=") && !html.contains("@import"),
            "{args:?}"
        );
        assert!(html.contains("default-src 'none'"));
        for picture in pictures {
            let svg = fs::read_to_string(place.path(&format!("r/{picture}"))).unwrap();
            let body = svg.split_once('>').unwrap().1;
            // an element of a page needs no name space
            let body = body.replace(" xmlns=\"http://www.w3.org/2000/svg\"", "");
            assert!(
                html.contains(body.trim_end()),
                "{args:?}: {picture} is not on the page"
            );
        }
        assert!(html.contains(">null</script>"), "{args:?}: nothing moves");
    }
}

#[test]
fn what_came_out_is_counted_from_the_table() {
    let (place, html) = page(&["atlas", "tower", "--quick"]);
    let rows = place.rows("r/results.csv");
    let of = |verdict: &str| {
        let mut rungs: Vec<&str> = rows
            .iter()
            .filter(|row| row[2] == "moreau" && row[15] == verdict)
            .map(|row| row[1].as_str())
            .collect();
        rungs.dedup();
        rungs.len()
    };
    let (pass, fail) = (of("pass"), of("fail"));
    assert!(pass > 0);
    assert!(
        html.contains(&format!("moreau {pass} of {}", pass + fail)),
        "{pass} {fail}"
    );
}

#[test]
fn without_the_flag_there_is_no_page() {
    let place = Place::new();
    let (code, _, err) = place.run(&["atlas", "tower", "--quick", "--quiet", "--out", "r"]);
    assert_eq!(code, 0, "{err}");
    assert!(!place.path("r/report.html").exists());
}
