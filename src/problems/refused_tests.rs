//! Tests: bad files and their messages, huge counts, malformed bytes.

use super::*;
use proptest::prelude::*;

const JSON: &str = r#"{
  "kind": "contact",
  "operator": {"dense": [[1.6, -1.2], [-1.2, 3.4]]},
  "free": [[0.05, -3]],
  "laws": [{"contact": {"friction": 2}}]
}"#;

/// Text files, and the words of their errors.
const TEXTS: &[(&str, &str)] = &[
    ("", "the file is empty"),
    ("hello world", "line 1 | `hello world`"),
    ("\n\n7 9 9", "line 3 | neither | `7 9 9`"),
    ("3 1\n0 3 3\n3 3\n", "line 1 | three-dimensional"),
    ("2 1\n0 2 2\n", "line 2 | the rows of W | end of the file"),
    ("2 1\n0 2 2\n2 3\n", "line 3 | again, 2 | found 3"),
    (
        "2 1\n0 2 2\n2 2\n2 1\n1",
        "line 5 | W (or M)[1, 1] | end of the file",
    ),
    ("2 1\n0 2 2\n2 2\n2 x\n1 2", "line 4 | [1, 0] | `x`"),
    ("2 1\n0 2 2\n2 2\n2 nan\n1 2", "line 4 | finite | `nan`"),
    ("2 1\n0 2 2\n2 2\n2 1e999\n1 2", "finite | `1e999`"),
    (
        "2 2\n0 2 2\n2 2\n1 0 0 1\n",
        "line 2 | W of 4 x 4 | found 2 x 2",
    ),
    (
        "2 1\n0 2 3\n2 3\n1 0 0 1 1 1\n",
        "line 2 | W of 2 x 2 | 2 x 3",
    ),
    (
        "2 1\n0 2 2\n2 2\n2 1\n1 2\n-1",
        "line 6 | q[1], one of 2 | end of the file",
    ),
    (
        "2 1\n0 2 2\n2 2\n2 1\n1 2\n-1 0\n",
        "mu[0], one of 1 | end of the file",
    ),
    (
        "2 1\n0 2 2\n2 2\n2 1\n1 2\n-1 0\n-0.5",
        "line 7 | mu[0] is -0.5 | at least 0",
    ),
    (
        "2 1\n0 2 2\n2 2\n2 1\n1 2\n-1 0\ninf",
        "line 7 | mu[0] | finite",
    ),
    (
        "2 1\n0 2 2\n2 2\n1 2 2 1\n-1 0\n0.5",
        "W is not positive semidefinite",
    ),
    (
        "2 1\n0 2 2\n2 2\n0 0 0 0\n-1 0\n0.5",
        "block 0 | infinite mass",
    ),
    (
        "2 1\n0 2 2\n2 2\n-1 0 0 -1\n0 2 2\n2 2\n1 0 0 1\n0 0\n0 0\n0.5",
        "M is not positive definite",
    ),
    (
        "2 1\n0 3 3\n3 3\n1 0 0 0 1 0 0 0 1\n0 3 4\n",
        "line 5 | H of 3 x 2 | found 3 x 4",
    ),
    ("2\n0 2 3\n2 3\n", "line 2 | M of 2 x 2 | 2 x 3"),
    ("2\n7 2 2\n", "the columns of W | end of the file"),
    ("4 9 7 8 8", "neither"),
    ("5\n2 5 5\n3\n", "line 3 | origin of M is 3"),
    ("5\n2 5 5\n1\nCSpxrse", "line 4 | `CSparse` | `CSpxrse`"),
    (
        "5\n2 5 5\n1\nCSparse\n5-by-5",
        "line 5 | `nnz:` | end of the file",
    ),
    (
        "5\n2 5 5\n1\nCSparse\nnnz: 1\n5 0 : 1",
        "line 6 | row | below 5 | found 5",
    ),
    (
        "5\n2 5 5\n2\nCSparse\nnnz: 1\ncol 1",
        "line 6 | the column of M, 0 | found 1",
    ),
    (
        "5\n2 5 5\n2\nCSparse\nnnz: 1\ncol 0 : locations 0 to 7",
        "line 6 | ends at entry 7 | -1 to 0",
    ),
    ("2\n1 2 2\n4\n2 2\n1 3\n", "line 5 | rise to 2"),
    ("2\n1 2 2\n4\n2 2\n1 1\n", "line 5 | rise to 2"),
    (
        "2\n1 2 2\n1\n1 1\n2\n2\n3 1\n",
        "line 7 | row pointer, 2 | found 3",
    ),
    (
        "2\n1 2 2\n1\n1 1\n2\n2\n2 1\n0 0\n",
        "line 8 | row pointer | rise from 0 to 1",
    ),
    (
        "2\n1 2 2\n1\n1 1\n2\n2\n2 1\n0 1\n1\n",
        "line 9 | block column | below 1",
    ),
    (
        "2\n1 2 2\n1\n1 1\n2\n2\n2 1\n0 1\n0\n9\n",
        "line 10 | next block, 0 | found 9",
    ),
    ("2\n0 0 0\n", "line 2 | M of 2 x 2 | 0 x 0"),
];

/// What replaces what in [`JSON`], and the words of the error.
const REPLACED: &[(&str, &str, &str)] = &[
    (
        r#""free""#,
        r#""fre""#,
        "line 4 | unknown field `fre` | `free`",
    ),
    ("friction", "fricton", "line 5 | unknown field `fricton`"),
    ("dense", "dence", "line 3 | unknown variant `dence`"),
    (
        r#"contact","#,
        r#"contcat","#,
        "line 2 | `contcat` | `contact` or `lcp`",
    ),
    (
        ": 2}",
        ": -2}",
        "line 5 | friction is -2, must be at least 0",
    ),
    ("0.05", "NaN", "line 4"),
    ("0.05", "1e999", "line 4 | number out of range"),
    ("0.05, -3", "0.05", "line 4 | array of length 2"),
    ("[[0.05, -3]]", "[]", "1 blocks | 0 free terms"),
    (", 3.4", "", "operator.dense[1] has 1 numbers | must have 2"),
    (
        "[[1.6, -1.2], [-1.2, 3.4]]",
        "[[1]]",
        "1 rows | two a block",
    ),
    ("3.4", "0.4", "W is not positive semidefinite"),
    ("[-1.2, 3", "[-1.1, 3", "asymmetric"),
    ("\n}", "\n} x", "line 6 | trailing"),
    (
        "\n}",
        r#","solution": []}"#,
        "solution has 0 entries, must have 1",
    ),
    ("\n}", r#","free": []}"#, "duplicate field `free`"),
    (r#""kind": "contact","#, "", "missing field `kind`"),
    (
        r#"{"contact": {"friction": 2}}"#,
        r#"{"bounded": {"lower": 2, "upper": 1}}"#,
        "block 0 | lower bound is 2",
    ),
    (
        r#""operator""#,
        r#""units": {"operator": "1/g", "free": "m/s", "compliance": "1/kg", "impulse": "N s"}, "operator""#,
        "line 3 | units must be | 1/kg",
    ),
    (
        r#""operator""#,
        r#""units": {"free": "mm/s"}, "operator""#,
        "line 3 | units must be | m/s",
    ),
    (
        r#"{"dense": [[1.6, -1.2], [-1.2, 3.4]]}"#,
        r#"{"bodies": {"inverse_mass": [[1, 1, -1]], "rows": []}}"#,
        "line 3 | inverse mass is -1",
    ),
    (
        r#"{"dense": [[1.6, -1.2], [-1.2, 3.4]]}"#,
        r#"{"bodies": {"inverse_mass": [[1, 1, 1]], "rows": [{"bodies": [null, 1], "jacobian": [[[0,0,0],[0,0,0]],[[0,1,0],[1,0,0]]]}]}}"#,
        "rows[0].bodies names body 1 of 1",
    ),
];

/// JSON files of their own.
const WHOLE: &[(&str, &str)] = &[
    (
        r#"{"kind": "lcp", "matrix": [[1, 2]], "q": [1]}"#,
        "matrix[0] has 2",
    ),
    (
        r#"{"kind": "lcp", "matrix": [[1]], "q": [1, 2]}"#,
        "q has 2 | 1 x 1",
    ),
];

fn message(bytes: &[u8]) -> String {
    read(bytes).map_or_else(|e| e.to_string(), |p| format!("{p:?}"))
}

/// Asserts that every file's message has all its words, separated by ` | `.
#[track_caller]
fn assert_refused<'a>(cases: impl Iterator<Item = (String, &'a str)>) {
    let mut wrong = Vec::new();
    for (text, words) in cases {
        let message = message(text.as_bytes());
        if words.split(" | ").any(|word| !message.contains(word)) {
            wrong.push(format!("{text:?}: lacks one of {words:?}: {message}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn bad_text_files_are_refused_in_words() {
    assert_refused(TEXTS.iter().map(|(text, words)| (text.to_string(), *words)));
    assert_eq!(read(b"2 1\n\xff"), Err(FileError::NotText { line: 2 }));
    assert_eq!(read(b"\x89HDF\r\n\x1a\nrest"), Err(FileError::Hdf5));
}

#[test]
fn bad_json_files_are_refused_in_words() {
    let replaced = REPLACED.iter().map(|(old, new, words)| {
        assert!(JSON.contains(old), "{old}");
        (JSON.replace(old, new), *words)
    });
    assert_refused(replaced);
    assert_refused(WHOLE.iter().map(|(text, words)| (text.to_string(), *words)));
    assert_refused([(JSON[..60].to_owned(), "line 3 | EOF")].into_iter());
}

/// The numbers are missing, so reading allocates no memory for them and takes no time.
#[test]
fn huge_counts_are_no_allocation() {
    const HUGE: &str = "4611686018427387904";
    for text in [
        format!("{HUGE}\n0 {HUGE} {HUGE}\n{HUGE} {HUGE}\n1 2"),
        format!("{HUGE}\n1 {HUGE} {HUGE}\n{HUGE}\n{HUGE} {HUGE}\n1 2"),
        format!("{HUGE}\n2 {HUGE} {HUGE}\n1\nCSparse\nnnz: {HUGE}\n0 0 : 1"),
        format!("{HUGE}\n2 {HUGE} {HUGE}\n2\nCSparse\nnnz: 0\ncol 0 : locations 0 to -1"),
        format!("2 {HUGE}\n2 {HUGE} {HUGE}\n1\nCSparse\nnnz: 0\n1 2"),
        format!("2 {HUGE}\n0 0 {HUGE}\n0 {HUGE}\n"),
        format!("2 18446744073709551615\n0 1 1\n1 1\n1 0 1 {HUGE}\n1 {HUGE}\n1"),
    ] {
        assert!(read(text.as_bytes()).is_err(), "{text}");
    }
    // complete and sparse, but an LCP is made dense
    let n = MOST_ROWS + 1;
    let q = "-1 ".repeat(n);
    let text = format!("{n}\n2 {n} {n}\n1\nCSparse\nnnz: 1\n0 0 : 1\n{q}");
    let message = read(text.as_bytes()).unwrap_err().to_string();
    assert!(
        message.contains("10001 x 10001, at most 10000"),
        "{message}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    /// Cuts out, doubles or replaces bytes of a valid file: read or refused, never a panic.
    #[test]
    fn mangled_files_never_panic(
        which in 0usize..9,
        at in any::<prop::sample::Index>(),
        cut in 0usize..8,
        insert in prop_oneof![
            "[0-9 .eE+-]{0,6}",
            "[ -~]{0,4}",
            Just("99999999999999999999 ".to_owned()),
            Just("-1 ".to_owned()),
            Just("nan ".to_owned()),
            Just("1e308 ".to_owned()),
            Just("]}".to_owned()),
        ],
    ) {
        let good = [
            JSON,
            "2\n0 2 2\n2 2\n1 2\n3 4\n-1 -2\n",
            "2\n1 2 2\n4\n2 2\n1 2\n1 2\n3 4\n0 2 4\n0 1 0 1\n0 1\n1 3\n2 2\n3 4\n-1 -1\n",
            "2\n2 2 2\n2\nCSparse\nnnz: 2, 1-norm: 7\ncol 0 : locations 0 to 0\n0 : 1\n\
             col 1 : locations 1 to 1\n1 : 4\n-1 -1\n",
            "2 1\n0 3 3\n3 3\n2 0 0 0 2 0 0 0 4\n0 3 2\n3 2\n0 1 0 -1 0 1\n2 4 12\n10 20\n0.4\n",
            "2 2\n0 4 4\n4 4\n2 0 0 0\n0 3 0 0\n0 0 4 1\n0 0 1 5\n-1 2 -3 4\n0.5 0\n",
            "{\"kind\": \"contact\", \"operator\": {\"bodies\": {\"inverse_mass\": [[1, 1, 1]], \
             \"rows\": [{\"bodies\": [null, 0], \"jacobian\": [[[0,0,0],[0,0,0]],[[0,1,0],[1,0,0]]]\
             }]}}, \"free\": [[-1, 0]], \"laws\": [\"pin\"], \"solution\": [[1, 0]]}",
            "{\"kind\": \"contact\", \"operator\": {\"blocks\": [[0, 0, [[2, 1], [1, 2]]], [1, 1, \
             [[2, 0], [0, 2]]], [0, 1, [[1, 0], [0, 0]]], [1, 0, [[1, 0], [0, 0]]]]}, \"free\": \
             [[-1, 0], [-1, 0]], \"laws\": [\"pin\", \"pin\"]}",
            "2 1\n2 3 3\n1\nCSparse\nnnz: 3\n0 0 : 2\n1 1 : 2\n2 2 : 4\n2 3 2\n1\nCSparse\nnnz: 3\n\
             1 0 : 1\n0 1 : -1\n2 1 : 1\n2 4 12\n10 20\n0.4\n",
        ][which];
        prop_assert!(read(good.as_bytes()).is_ok());
        let mut bytes = good.as_bytes().to_vec();
        let start = at.index(bytes.len());
        let end = (start + cut).min(bytes.len());
        bytes.splice(start..end, insert.bytes());
        let _ = read(&bytes);
        let _ = read(&bytes[..start]);
    }

    #[test]
    fn any_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let _ = read(&bytes);
    }
}
