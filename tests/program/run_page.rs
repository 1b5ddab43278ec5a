//! `run --report`: the page is one file, says what the CSV files say, and is small.

use crate::common::program::Place;
use serde_json::Value;
use std::fs;

/// The 64 digits of packed numbers.
const DIGITS: &str = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

/// Runs with `--report`, and returns the page and the numbers in it.
fn page(place: &Place, args: &[&str]) -> (String, Value) {
    let all = [&["run"], args, &["--report", "--quiet", "--out", "r"]].concat();
    let (code, _, err) = place.run(&all);
    assert!(code == 0 || code == 2, "{args:?}: {err}");
    let html = fs::read_to_string(place.path("r/report.html")).unwrap();
    let (_, data) = html.split_once("id=\"data\">").unwrap();
    let (data, _) = data.split_once("</script>").unwrap();
    let data = serde_json::from_str(data).unwrap();
    (html, data)
}

/// The numbers of a packed table, row after row, and the names of its columns.
fn table(data: &Value) -> (Vec<String>, Vec<f64>) {
    let columns: Vec<String> = serde_json::from_value(data["columns"].clone()).unwrap();
    let text = data["data"].as_str().unwrap();
    let number = |five: &[u8]| {
        let digit = |c: u8| DIGITS.find(char::from(c)).unwrap() as i64;
        let code = five.iter().fold(0, |code, c| 64 * code + digit(*c));
        let (mantissa, exponent) = ((code >> 9) - (1 << 20), (code & 511) - (1 << 8));
        match code {
            0 => f64::NAN,
            _ => format!("{mantissa}e{exponent}").parse().unwrap(),
        }
    };
    (columns, text.as_bytes().chunks(5).map(number).collect())
}

/// The cells of a CSV file's columns, rounded to six digits; NaN for an empty one.
fn expected(place: &Place, file: &str, columns: &[String]) -> Vec<f64> {
    let header = place.header(file);
    let header: Vec<&str> = header.split(',').collect();
    let at: Vec<usize> = columns
        .iter()
        .map(|name| header.iter().position(|h| h == name).unwrap())
        .collect();
    let six = |cell: &String| match cell.parse::<f64>() {
        Ok(value) => format!("{value:.5e}").parse().unwrap(),
        Err(_) => f64::NAN,
    };
    let rows = place.rows(file);
    rows.iter()
        .flat_map(|row| at.iter().map(|k| six(&row[*k])).collect::<Vec<f64>>())
        .collect()
}

#[track_caller]
fn same(a: &[f64], b: &[f64]) {
    assert_eq!(a.len(), b.len());
    let differs = |(a, b): &(&f64, &f64)| a != b && !(a.is_nan() && b.is_nan());
    assert_eq!(a.iter().zip(b).find(differs), None);
}

#[test]
fn the_page_holds_the_numbers_of_the_files() {
    for args in [
        &["ball-and-chain", "--steps", "30"] as &[&str],
        &["bouncing-ball", "--events", "--time", "2"],
        &["woodpecker", "--steps", "50"],
        &["tower", "--engine", "rapier", "--steps", "5"],
    ] {
        let place = Place::new();
        let (_, data) = page(&place, args);
        assert_eq!(data["stride"], 1);
        for (key, file, rows) in [
            ("step", "r/steps.csv", 5),
            ("body", "r/bodies.csv", 5),
            ("contact", "r/contacts.csv", 0),
            ("impact", "r/impacts.csv", 0),
        ] {
            let (columns, numbers) = table(&data[key]);
            same(&numbers, &expected(&place, file, &columns));
            assert!(numbers.len() >= rows, "{args:?} {key}");
        }
        let statuses: String = (place.rows("r/contacts.csv").iter())
            .map(|row| match row.last().unwrap().as_str() {
                "stick" => 's',
                "slip+" => 'p',
                "slip-" => 'm',
                "impact" => 'i',
                _ => 'o',
            })
            .collect();
        assert_eq!(data["statuses"], statuses);
        let counts: Vec<usize> = serde_json::from_value(data["contacts"].clone()).unwrap();
        assert_eq!(counts.iter().sum::<usize>(), statuses.len());
        // a frame holds the contacts of its step, here one row for each that is there at its end
        if args[0] == "tower" {
            let told: Vec<usize> = (place.rows("r/steps.csv").iter())
                .map(|row| row[2].parse().unwrap())
                .collect();
            assert_eq!(counts[1..], told);
        }
    }
}

/// It opens without network and without other files, and is the same for the same command.
#[test]
fn the_page_stands_alone_and_is_the_same_again() {
    let [first, again] = [Place::new(), Place::new()];
    let (html, _) = page(&first, &["drum", "--steps", "20"]);
    assert!(
        html == page(&again, &["drum", "--steps", "20"]).0,
        "differs"
    );
    for word in [
        "http:", "https:", "://", "src=", "href=", "url(", "@import", "fetch(",
    ] {
        assert!(!html.contains(word), "{word}");
    }
    let root = first.path("");
    assert!(
        !html.contains(root.to_str().unwrap()),
        "names a folder of this machine"
    );
    let summary = first.json("r/summary.json");
    for word in [
        "run drum --steps 20 --report --quiet --out r",
        summary["scene_hash"].as_str().unwrap(),
        summary["version"].as_str().unwrap(),
        "Content-Security-Policy",
    ] {
        assert!(html.contains(word), "{word}");
    }
    assert!(first.listing("r").contains(&"scene.svg".to_owned()));
}

#[test]
fn a_title_ends_no_script() {
    let place = Place::new();
    let title = "scene.title=\"</script><img onerror=alert(1)> & 'x' {{data}}\"";
    let (html, _) = page(&place, &["incline", "--steps", "3", "--set", title]);
    assert!(!html.contains("<img"));
    assert_eq!(html.matches("</script>").count(), 2);
    assert!(html.contains("&lt;/script&gt;&lt;img onerror=alert(1)&gt; &amp; &#39;x&#39;"));
    let svg = fs::read_to_string(place.path("r/scene.svg")).unwrap();
    assert!(!svg.contains("<img") && svg.contains("&lt;img"));
}

/// What fails leads the page, and where it fails is red on the time bar.
#[test]
fn a_run_that_did_not_hold_says_so_first() {
    let place = Place::new();
    // laid with overlaps, in islands that no solve certifies: catalogue.rs
    let (html, data) = page(&place, &["box-drum", "--steps", "3"]);
    let summary = place.json("r/summary.json");
    assert_eq!(summary["verdict"]["held"], false);
    assert!(html.contains("bad-run\" id=\"lead\"") && html.contains("Not everywhere: "));
    assert!(html.contains("for the overlap"));
    let red = data["red"].as_str().unwrap();
    // failed, or bounded within what the verdict allows
    let of = |digit: &char| digit.to_digit(16).unwrap() & (1 + 8) != 0;
    let unsolved = red.chars().filter(of).count();
    let share = summary["totals"]["unsolved_steps"].as_f64().unwrap() / 3.0;
    assert!(
        unsolved as f64 >= share * 500.0 - 1.0 && unsolved > 0,
        "{unsolved}"
    );
    let (html, data) = page(&place, &["tower", "--steps", "40"]);
    assert!(!html.contains("bad-run\" id") && html.contains("Yes, within the model"));
    assert!(
        data["red"]
            .as_str()
            .unwrap()
            .bytes()
            .all(|bits| bits == b'0')
    );
}

/// The step with the deepest overlap and the steps with passages are red too, if the scene did not hold for them.
#[test]
fn moments_that_the_verdict_names_are_red() {
    let place = Place::new();
    // a light disc in front of a wall, hit by a heavy one: the published rule sees the wall a step late
    place.write(
        "late.toml",
        "[scene]\nname = \"late\"\ntitle = \"Late\"\n[gravity]\ny = 0\n[step]\ntime = 0.5\n\
         scheme = \"moreau\"\n[[material]]\nname = \"m\"\nfriction = 0\nrestitution = 0.8\n\
         [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [1, 4]\nposition = [1.5, 0]\n\
         material = \"m\"\n[[body]]\nname = \"light\"\ndisc = 0.25\nmass = 1\n\
         position = [0.749, 0]\nmaterial = \"m\"\n[[body]]\nname = \"heavy\"\ndisc = 0.25\n\
         mass = 4\nposition = [-1, 0]\nvelocity = [18, 0]\nmaterial = \"m\"\n",
    );
    let marked = |more: &[&str]| {
        let (_, data) = page(&place, &[&["late.toml"], more].concat());
        let red = data["red"].as_str().unwrap();
        let places: Vec<f64> = red
            .match_indices('2')
            .map(|(k, _)| k as f64 / 1000.0)
            .collect();
        let summary = place.json("r/summary.json");
        let checks = summary["verdict"]["checks"].as_array().unwrap();
        let deepest = checks.iter().find(|check| check["name"] == "deepest");
        (places, deepest.unwrap()["time_s"].as_f64().unwrap())
    };
    let (red, at) = marked(&[]);
    let step = at - 1.0 / 60.0 - 2e-3..at;
    assert!(
        red.len() > 10 && red.iter().all(|time| step.contains(time)),
        "{at}: {red:?}"
    );
    let (red, _) = marked(&["--set", "verdict.deepest=1"]);
    assert!(red.is_empty(), "{red:?}");
}

/// Bug: problems that are bounded within the limit of the verdict were red beside "Nothing must be done".
#[test]
fn what_the_verdict_allows_is_not_red() {
    let place = Place::new();
    let marks = |more: &[&str]| {
        // near round-off some steps of a moving heap are bounded, whatever its draw
        let args = [&["hit-heap", "--time", "1", "--tolerance", "1e-12"], more].concat();
        let (html, data) = page(&place, &args);
        let red = data["red"].as_str().unwrap().to_owned();
        let has = |bit: u32| red.chars().any(|d| d.to_digit(16).unwrap() & bit != 0);
        (html.contains("Nothing must be done"), has(1), has(8))
    };
    assert_eq!(marks(&[]), (true, false, true));
    assert_eq!(marks(&["--set", "verdict.bounded=0"]), (false, true, false));
}

/// The settings that an accuracy chose, and why, are on the page.
#[test]
fn the_choice_of_an_accuracy_is_told() {
    let place = Place::new();
    let (html, _) = page(&place, &["pendulum", "--time", "1", "--accuracy", "1e-2"]);
    let reason = place.json("r/summary.json")["accuracy"]["reason"].clone();
    assert!(html.contains(reason.as_str().unwrap()), "{reason}");
}

/// Frames are left out where all would be too much; the red places are not.
#[test]
fn a_long_run_is_thinned_and_a_large_one_stays_small() {
    let place = Place::new();
    let (html, data) = page(&place, &["pendulum", "--dt", "1e-4", "--time", "1"]);
    assert_eq!(data["stride"], 4);
    assert_eq!(data["frames"], 2501);
    assert!(html.len() < 2_000_000, "{}", html.len());
    let (columns, numbers) = table(&data["step"]);
    let steps = expected(&place, "r/steps.csv", &columns);
    let rows: Vec<f64> = steps
        .chunks(columns.len())
        .skip(3)
        .step_by(4)
        .flatten()
        .copied()
        .collect();
    same(&numbers, &rows);
    // a thousand boxes in fifty towers over 10 s: what the page holds goes by its contacts
    let place = Place::new();
    let (html, data) = page(
        &place,
        &[
            "tower",
            "--time=10",
            "--set=repeat.box.count=[50,20]",
            "--set=repeat.box.step=[[2,0],[0,1]]",
            "--set=body.floor.box=[220,2]",
        ],
    );
    assert!(html.len() < 8_000_000, "{}", html.len());
    assert!(data["frames"].as_u64().unwrap() > 20, "{}", data["frames"]);
}

#[test]
fn a_machine_has_a_page_of_its_life() {
    let place = Place::new();
    let (html, data) = page(&place, &["thresher-study"]);
    // no clock is in it
    assert!(
        html == page(&Place::new(), &["thresher-study"]).0,
        "differs"
    );
    assert!(data.is_null() && !html.contains("<canvas"));
    let pictures = place
        .listing("r")
        .iter()
        .filter(|f| f.ends_with(".svg"))
        .count();
    assert_eq!(html.matches("<svg").count(), pictures);
    assert!(html.contains("What came out") && html.contains("assumed"));
    assert!(html.len() < 2_000_000, "{}", html.len());
}

/// The machine on coarse steps, for a life of a few hours.
const MACHINE: [&str; 11] = [
    "thresher",
    "--every",
    "5",
    "--set",
    "step.dt=3.2e-4",
    "--set",
    "wear.jump=2e-3",
    "--set",
    "wear.revolutions=1",
    "--set",
    "wear.max_hours=5",
];

#[test]
fn the_page_of_a_machine_replays_its_first_revolution() {
    let place = Place::new();
    let (html, data) = page(&place, &MACHINE);
    assert!(html.len() <= 2_000_000, "{} bytes", html.len());
    let bodies = data["stage"]["bodies"].as_array().unwrap();
    let kinds: Vec<&str> = bodies.iter().map(|b| b["kind"].as_str().unwrap()).collect();
    assert_eq!((kinds[0], kinds[1]), ("driven", "fixed"));
    // a core and eight toothed bars
    assert_eq!(bodies[0]["pieces"].as_array().unwrap().len(), 9);
    let frames = data["frames"].as_u64().unwrap() as usize;
    assert!(frames > 20);
    let (columns, numbers) = table(&data["body"]);
    let row = |frame: usize, body: usize| {
        let at = (frame * bodies.len() + body) * columns.len();
        &numbers[at..at + columns.len()]
    };
    assert_eq!(numbers.len(), frames * bodies.len() * columns.len());
    // each row of the file is in its frame, and a segment that is not there has no numbers
    assert_eq!(data["stride"], 1);
    let mut there = 0;
    let expected = expected(&place, "r/bodies.csv", &columns);
    let file = place.rows("r/bodies.csv");
    let mut times: Vec<&str> = file.iter().map(|row| row[0].as_str()).collect();
    times.dedup();
    for (cells, numbers) in file.iter().zip(expected.chunks(columns.len())) {
        // the first frame is the first step once more
        let block = 1 + times.iter().position(|t| *t == cells[0]).unwrap();
        same(row(block, cells[1].parse().unwrap()), numbers);
        there += 1;
    }
    let shown = (1..frames).flat_map(|frame| (0..bodies.len()).map(move |body| (frame, body)));
    let drawn = shown
        .filter(|(frame, body)| !row(*frame, *body)[0].is_nan())
        .count();
    // the concave is fixed and in no row
    assert_eq!(drawn, there + frames - 1);
    let first: f64 = times[0].parse().unwrap();
    assert!((data["start"].as_f64().unwrap() - first).abs() < 1e-12);
    for word in [
        "Crop is soft",
        "counter-clockwise",
        "torque-over-hours.svg",
        "depth-per-cell.svg",
    ] {
        assert!(html.contains(word), "{word}");
    }
}
