use super::*;

fn row(scene: &str, rung: &str, engine: &str, verdict: &str, mode: &str) -> ResultRow {
    ResultRow {
        scene: scene.into(),
        rung: rung.into(),
        engine: engine.into(),
        scheme: String::new(),
        solver: String::new(),
        setting: "default".into(),
        dt_s: 0.01,
        threads: 1,
        precision: "f64".into(),
        measure: "m".into(),
        value: f64::NAN,
        unit: "1".into(),
        reference: String::new(),
        seconds_per_simulated_second: None,
        spread: None,
        verdict: verdict.into(),
        mode: mode.into(),
    }
}

/// Every entry, rung and word is there, whatever its length, and NaN is nowhere.
#[test]
fn every_verdict_is_drawn() {
    let mut rows = Vec::new();
    for k in 0..25 {
        let rung = format!("rung {k}");
        rows.push(row("ladder", &rung, "moreau", "pass", "stands"));
        rows.push(row(
            "ladder",
            &rung,
            "rapier",
            "fail",
            "penetrates-very-much",
        ));
    }
    rows.push(row("other <b>", "1", "moreau", "unsolved", "uncertified"));
    rows.push(row("other <b>", "1", "rapier", "", "cannot"));
    let svg = matrix(&rows).unwrap();
    assert!(!svg.contains("NaN") && svg.contains("</svg>"));
    let count = |word: &str| svg.lines().filter(|l| l.trim() == word).count();
    for k in 0..25 {
        assert_eq!(count(&format!("rung {k}")), 1);
    }
    assert_eq!(count("stands"), 25);
    assert_eq!(count("penetrates-very-much"), 25);
    assert_eq!(count("uncertified"), 1);
    assert_eq!(count("–"), 1);
    assert_eq!(count("ladder"), 1);
    assert!(svg.contains("other &lt;b&gt;"));
}

/// Rows of one rung and engine are one cell.
#[test]
fn measures_of_a_rung_share_a_cell() {
    let rows = vec![
        row("a", "1", "moreau", "pass", "stands"),
        row("a", "1", "moreau", "pass", "stands"),
        row("a", "1", "rapier", "pass", "stands"),
    ];
    let bands = bands(&rows);
    assert_eq!(bands.len(), 1);
    assert_eq!(bands[0].columns.len(), 1);
    assert_eq!(bands[0].columns[0].cells.len(), 2);
}

#[test]
fn no_rows_are_an_error() {
    assert!(matches!(matrix(&[]), Err(ReportError::EmptyChart { .. })));
}

/// Fills differ in lightness alone: pass, unsolved, fail, from light to dark.
#[test]
fn verdicts_differ_in_grey() {
    let grey = |v: &str| {
        let RGBColor(r, g, b) = look(v).0;
        0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b)
    };
    assert!(grey("") > grey("pass") + 20.0);
    assert!(grey("pass") > grey("unsolved") + 25.0);
    assert!(grey("unsolved") > grey("fail") + 60.0);
}
