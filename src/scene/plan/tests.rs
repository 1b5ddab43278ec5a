use super::*;
use crate::scene::Origin;

fn parse(text: &str) -> Result<Plan, SceneError> {
    Plan::parse("p.toml", text)
}

fn flags(plan: &Plan, number: usize) -> Vec<String> {
    let case = plan.case(number).unwrap();
    case.changes.into_iter().map(|change| change.flag).collect()
}

#[test]
fn a_grid_has_every_value_with_every_other() {
    let plan = parse(
        "scene = \"tower\"\n[set]\n\"step.time\" = 1\n[grid]\n\"step.dt\" = [0.01, 5e-3]\n\
         \"a.b\" = [\"x\\\"y\", [1, 2.5], true]\n",
    )
    .unwrap();
    // in the order of the file, not of the alphabet
    assert_eq!(plan.keys, ["step.dt", "a.b"]);
    assert_eq!(plan.len(), 6);
    assert_eq!(
        flags(&plan, 0),
        ["step.time=1", "step.dt=0.01", "a.b=\"x\\\"y\""]
    );
    assert_eq!(
        flags(&plan, 4),
        ["step.time=1", "step.dt=0.005", "a.b=[1, 2.5]"]
    );
    let case = plan.case(3).unwrap();
    // words without their quotes
    assert_eq!(
        case.values,
        [Some("0.005".to_owned()), Some("x\"y".to_owned())]
    );
    let line = Origin::Line {
        line: 6,
        column: 10,
    };
    assert_eq!(case.changes[2].place.origin, line);
    assert_eq!(case.changes[2].place.path, "a.b");
}

#[test]
fn keys_may_be_paths_of_toml() {
    let quoted = parse("scene = \"t\"\n[grid]\n\"step.dt\" = [1, 2]\n").unwrap();
    let bare = parse("scene = \"t\"\n[grid]\nstep.dt = [1, 2]\n").unwrap();
    assert_eq!(flags(&quoted, 1), flags(&bare, 1));
}

#[test]
fn cases_grid_and_sample_multiply() {
    let plan = parse(
        "scene = \"t\"\n[[case]]\n\"a.x\" = 1\n[[case]]\n\"a.x\" = 2\n\"a.y\" = 3\n\
         [grid]\n\"b\" = [5, 6, 7]\n[sample]\ncount = 4\nseed = 9\n[sample.keys]\n\
         \"c\" = { distribution = \"uniform\", from = 0, to = 1 }\n",
    )
    .unwrap();
    assert_eq!(plan.len(), 2 * 3 * 4);
    assert_eq!(plan.keys, ["a.x", "a.y", "b", "c"]);
    let all: Vec<Case> = (0..plan.len()).map(|k| plan.case(k).unwrap()).collect();
    assert_eq!(all[0].values[1], None, "left to the scene");
    assert_eq!(all[12].values[1], Some("3".to_owned()));
    // the same draws with every case of the others
    assert_eq!(all[0].values[3], all[20].values[3]);
    for (k, case) in all.iter().enumerate() {
        assert!(all[..k].iter().all(|other| other.values != case.values));
    }
}

#[test]
fn a_value_may_follow_a_key_that_varies() {
    let plan = parse(
        "scene = \"t\"\n[set]\n\"s.list\" = \"[{a.x}, {a.x}]\"\n\"s.word\" = \"{ x = 1 }\"\n\
         [grid]\n\"a.x\" = [1, 2.5]\n",
    )
    .unwrap();
    assert_eq!(
        flags(&plan, 1),
        ["s.list=[2.5, 2.5]", "s.word=\"{ x = 1 }\"", "a.x=2.5"]
    );
    let text = "scene = \"t\"\n[set]\n\"s\" = \"{a.z}\"\n[grid]\n\"a.x\" = [1]\n";
    let error = parse(text).unwrap().case(0).unwrap_err().to_string();
    assert!(
        error.starts_with("p.toml:3:1: s: unknown key that varies `a.z`"),
        "{error}"
    );
    assert!(error.contains("did you mean `a.x`?"), "{error}");
}

#[test]
fn files_are_looked_for_beside_the_plan() {
    let beside = |scene: &str| {
        let plan = parse(&format!("scene = \"{scene}\"\n[grid]\na = [1]\n")).unwrap();
        plan.scene_beside(Path::new("plans/p.toml"))
    };
    assert_eq!(beside("tower"), "tower");
    assert_eq!(beside("atlas/tower:50"), "atlas/tower:50");
    assert_eq!(beside("my.toml"), "plans/my.toml");
    assert_eq!(beside("/x/my.toml:r"), "/x/my.toml:r");
}

#[test]
fn numbers_past_the_last_case_are_refused() {
    let plan = parse("scene = \"t\"\n[grid]\na = [1, 2]\nb = [1, 2]\n").unwrap();
    assert!(plan.case(3).is_ok());
    for number in [4, 5, usize::MAX] {
        let error = plan.case(number).unwrap_err().to_string();
        assert_eq!(
            error,
            format!("p.toml:1:1: case = {number}: allowed is 0 to 3")
        );
    }
}

/// Kolmogorov's distance over six hundred decades, whose ratio is above all numbers.
#[test]
fn a_sample_may_span_all_numbers() {
    let values = drawn(
        "distribution = \"loguniform\", from = 1e-300, to = 1e300",
        400,
        "",
    );
    let below = |x: f64| values.iter().filter(|value| **value < x).count() as f64 / 400.0;
    assert!(values.iter().all(|x| (1e-300..=1e300).contains(x)));
    for decade in (-300..300).step_by(20) {
        let expected = f64::from(decade + 300) / 600.0;
        let distance = (below(10_f64.powi(decade)) - expected).abs();
        assert!(distance < 1.95 / 20.0, "1e{decade}: {distance}");
    }
    let error = parse(
        "scene = \"t\"\n[sample]\ncount = 9\nseed = 1\n[sample.keys]\n\
         \"a.b\" = { distribution = \"uniform\", from = -1e308, to = 1e308 }\n",
    );
    let error = error.unwrap_err().to_string();
    assert!(
        error.starts_with("p.toml:6:1: sample.keys.a.b: draw 0 is inf"),
        "{error}"
    );
}

/// The rest of a plan after its scene, and what is said of it.
const WRONG: [[&str; 2]; 24] = [
    ["", "missing key `[grid], [[case]] or [sample]`"],
    [
        "[gird]\na = [1]\n",
        "p.toml:2:2: gird: unknown key `gird`; did you mean `grid`?",
    ],
    ["[grid]\n", "grid: has no key: give at least one"],
    [
        "grid = 3\n",
        "p.toml:2:1: grid: expected a table of keys of the scene, found 3",
    ],
    [
        "[grid]\na = []\n",
        "p.toml:3:1: grid.a = []: allowed is at least one value",
    ],
    [
        "[grid]\na = 3\n",
        "p.toml:3:1: grid.a: expected a list of values in [ ], found 3",
    ],
    [
        "[grid]\na = [1, nan]\n",
        "p.toml:3:9: grid.a.1 = NaN: allowed is a finite number",
    ],
    [
        "[grid]\na = [1, 2, 1]\n",
        "p.toml:3:12: grid.a.2: 1 is listed twice",
    ],
    [
        "[grid]\na = [1979-05-27]\n",
        "expected a value of a scene, found a date",
    ],
    ["[grid]\n\"a=b\" = [1]\n", "`a=b` is no key of a scene"],
    ["[grid]\n\"a.b\" = [1]\na.b = [2]\n", "is set twice"],
    [
        "[set]\na = 1\n[grid]\na = [1]\n",
        "p.toml:5:6: a: is set in two blocks of the plan",
    ],
    ["case = 3\n", "expected tables [[case]], found 3"],
    ["[[case]]\n", "case.0: has no key"],
    [
        "[sample]\ncount = 3\nsed = 1\n",
        "unknown key `sed`; did you mean `seed`?",
    ],
    ["[sample]\ncount = 3\n", "sample: missing key `seed`"],
    [
        "[sample]\ncount = 0\nseed = 1\n",
        "p.toml:3:1: sample.count = 0: allowed is 1 to 100000",
    ],
    [
        "[sample]\ncount = 3\nseed = -1\n",
        "sample.seed = -1: allowed is 0 to",
    ],
    [
        "[sample]\ncount = 1.5\nseed = 1\n",
        "expected a whole number, found 1.5",
    ],
    ["[sample]\ncount = 3\nseed = 1\n", "missing key `keys`"],
    [
        "[sample]\ncount = 3\nseed = 1\n[sample.keys]\n",
        "keys: has no key",
    ],
    [
        "[sample]\ncount = 3\nseed = 1\n[sample.keys]\na = 3\n",
        "expected { distribution = \"NAME\", ... }, found 3",
    ],
    [
        "[grid]\na = [1, 2]\n[sample]\ncount = 60000\nseed = 1\n[sample.keys]\n\"a.b\" = { distribution = \"uniform\", from = 0, to = 1 }\n",
        "sample = 2 x 60000 cases: allowed is 1 to 100000 cases in all",
    ],
    ["[grid\n", "p.toml:2"],
];

/// Distributions of `a.b`, and what is said of them.
const WRONG_DISTRIBUTIONS: [[&str; 2]; 13] = [
    [
        "distribution = \"norml\", mean = 1, deviation = 1",
        "unknown distribution `norml`; did you mean `normal`?",
    ],
    ["distribution = 3", "expected the name of a distribution"],
    [
        "distribution = \"normal\", mean = 1",
        "missing key `deviation`",
    ],
    [
        "distribution = \"normal\", mean = 1, deviation = 1, sigma = 1",
        "unknown key `sigma`",
    ],
    [
        "distribution = \"normal\", mean = 1, deviation = 0",
        "deviation = 0.0: allowed is above 0.0",
    ],
    [
        "distribution = \"normal\", mean = 0, deviation = 1, from = 30, to = 31",
        "almost no value of the distribution lies between",
    ],
    [
        "distribution = \"uniform\", from = 2, to = 1",
        "to = 1.0: allowed is above 2.0",
    ],
    [
        "distribution = \"uniform\", from = 2, to = inf",
        "to = inf: allowed is a finite number",
    ],
    [
        "distribution = \"uniform\", from = \"a\", to = 1",
        "expected a number, found the string \"a\"",
    ],
    [
        "distribution = \"loguniform\", from = 0, to = 1",
        "from = 0.0: allowed is above 0.0",
    ],
    [
        "distribution = \"lognormal\", median = 1, factor = 1",
        "factor = 1.0: allowed is above 1.0",
    ],
    [
        "distribution = \"triangular\", from = 0, mode = 3, to = 2",
        "to = 2.0: allowed is at least 3.0",
    ],
    [
        "distribution = \"whole\", from = 0.5, to = 2",
        "from = 0.5: allowed is a whole number",
    ],
];

/// File, line, key, value, what is allowed, and the nearest name.
#[test]
fn wrong_plans_are_refused_with_their_place() {
    let refused = |text: &str, expected: &str| {
        let error = parse(text).unwrap_err().to_string();
        assert!(
            error.contains(expected),
            "{text}\n  {error}\n  lacks {expected}"
        );
        assert!(error.starts_with("p.toml:"), "{error}");
    };
    refused("[grid]\na = [1]\n", "missing key `scene`");
    refused(
        "scene = 3\n",
        "p.toml:1:1: scene: expected name or file of a scene, in quotes, found 3",
    );
    for [rest, expected] in WRONG {
        refused(&format!("scene = \"t\"\n{rest}"), expected);
    }
    for [distribution, expected] in WRONG_DISTRIBUTIONS {
        let sample = "[sample]\ncount = 3\nseed = 1\n[sample.keys]\n";
        let text = format!("scene = \"t\"\n{sample}\"a.b\" = {{ {distribution} }}\n");
        refused(&text, expected);
    }
}

/// The values of a key in a sample.
fn drawn(distribution: &str, count: usize, more: &str) -> Vec<f64> {
    let plan = parse(&format!(
        "scene = \"t\"\n[sample]\ncount = {count}\nseed = 5\n[sample.keys]\n{more}\n\
         \"x\" = {{ {distribution} }}\n"
    ))
    .unwrap();
    let at = plan.keys.iter().position(|key| key == "x").unwrap();
    let value = |k| {
        plan.case(k).unwrap().values[at]
            .clone()
            .unwrap()
            .parse()
            .unwrap()
    };
    (0..count).map(value).collect()
}

/// Kolmogorov's distance of a sample from its distribution function: above 1.95/√n with a probability of
/// 1e-3 if they belong together.
#[test]
fn draws_follow_their_distribution() {
    const N: usize = 4000;
    // Abramowitz & Stegun (1964), 7.1.26: to 1.5e-7
    let erf = |x: f64| {
        let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
        let sum = [
            1.061_405_429,
            -1.453_152_027,
            1.421_413_741,
            -0.284_496_736,
            0.254_829_592,
        ]
        .into_iter()
        .fold(0.0, |sum, a| (sum + a) * t);
        (1.0 - sum * (-x * x).exp()) * x.signum()
    };
    let gauss = move |x: f64| 0.5 * (1.0 + erf(x / 2.0_f64.sqrt()));
    type Function = Box<dyn Fn(f64) -> f64>;
    let all: [(&str, Function); 6] = [
        (
            "\"uniform\", from = -1, to = 3",
            Box::new(|x| (x + 1.0) / 4.0),
        ),
        (
            "\"loguniform\", from = 0.1, to = 10",
            Box::new(|x| (x.log10() + 1.0) / 2.0),
        ),
        (
            "\"normal\", mean = 2, deviation = 0.5",
            Box::new(move |x| gauss((x - 2.0) / 0.5)),
        ),
        (
            "\"normal\", mean = 0, deviation = 1, from = 0",
            Box::new(move |x| 2.0 * gauss(x) - 1.0),
        ),
        (
            "\"lognormal\", median = 3, factor = 1.5",
            Box::new(move |x| gauss((x / 3.0).ln() / 1.5_f64.ln())),
        ),
        (
            "\"triangular\", from = 0, mode = 1, to = 3",
            Box::new(|x| match x < 1.0 {
                true => x * x / 3.0,
                false => 1.0 - (3.0 - x).powi(2) / 6.0,
            }),
        ),
    ];
    for (distribution, function) in all {
        let mut values = drawn(&format!("distribution = {distribution}"), N, "");
        values.sort_by(f64::total_cmp);
        let far = |(k, x): (usize, &f64)| {
            let (below, above) = (k as f64 / N as f64, (k + 1) as f64 / N as f64);
            (function(*x) - below)
                .abs()
                .max((function(*x) - above).abs())
        };
        let distance = values.iter().enumerate().map(far).fold(0.0, f64::max);
        assert!(
            distance < 1.95 / (N as f64).sqrt(),
            "{distribution}: {distance}"
        );
    }
    let values = drawn("distribution = \"whole\", from = -1, to = 2", N, "");
    for whole in [-1.0, 0.0, 1.0, 2.0] {
        let share = values.iter().filter(|x| **x == whole).count() as f64 / N as f64;
        // four standard deviations
        assert!(
            (share - 0.25).abs() < 4.0 * (0.25 * 0.75 / N as f64).sqrt(),
            "{whole}: {share}"
        );
    }
}

/// A longer sample, and one with more keys, begin as the shorter did: what was run is not lost.
#[test]
fn more_draws_leave_the_first_as_they_were() {
    let uniform = "distribution = \"uniform\", from = 0, to = 1";
    let few = drawn(uniform, 5, "");
    let other = format!("\"a\" = {{ {uniform} }}");
    assert_eq!(few, drawn(uniform, 50, "")[..5]);
    assert_eq!(few, drawn(uniform, 5, &other));
    assert!(few.iter().all(|x| format!("{x:?}").len() <= 14), "{few:?}");
}
