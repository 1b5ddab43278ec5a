//! Tests of block sparse operators in files, and of problems too large for memory.

use super::symmetry::check_semidefinite;
use super::tests::{contact_of, coulomb, dense_of};
use super::*;
use crate::contact::examples::Lcg;
use crate::contact::{BlockMatrix, BodyOperator, Mat2, NO_BODY, Rows, Vec3};
use proptest::prelude::*;

/// A chain of bodies, each in contact with the one before, with random rows and masses.
fn chain(contacts: usize, seed: u64) -> StoredProblem {
    let mut random = Lcg(seed);
    let mut vector = || Vec3::from_fn(|_, _| random.next() - 0.5);
    let rows = (0..contacts as u32).map(|k| Rows {
        bodies: [k.checked_sub(1).unwrap_or(NO_BODY), k],
        jacobian: [[vector(), vector()], [vector(), vector()]],
    });
    let bodies = BodyOperator {
        rows: rows.collect(),
        inverse_mass: (0..contacts).map(|_| vector().map(|x| x + 1.0)).collect(),
    };
    StoredProblem::Contact {
        problem: ContactProblem {
            operator: Delassus::Blocks(bodies.blocks()),
            free: (0..contacts).map(|_| vector().xy()).collect(),
            laws: vec![coulomb(0.5); contacts],
        },
        solution: None,
    }
}

#[test]
fn a_sparse_operator_reads_back_bit_for_bit() {
    for contacts in [33, 80] {
        let problem = chain(contacts, contacts as u64);
        let json = to_json(&problem).unwrap();
        assert!(json.contains("\"blocks\"") && !json.contains("\"dense\""));
        let blocks = to_dat(&problem, DatStorage::Blocks).unwrap();
        let dense = to_dat(&problem, DatStorage::Dense).unwrap();
        for text in [&json, &blocks, &dense] {
            let loaded = read(text.as_bytes()).unwrap();
            assert_eq!(loaded.problem, problem);
            assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
            assert_eq!(to_json(&loaded.problem).unwrap(), json);
        }
        // three block diagonals, less the ends
        let loaded = read(json.as_bytes()).unwrap();
        let Delassus::Blocks(operator) = &contact_of(&loaded).operator else {
            panic!("explicit")
        };
        assert_eq!(operator.held(), 3 * contacts - 2);
        // a compressed listing of the same, with all digits
        let mut listing = format!("2 {contacts}\n2 {0} {0}\n2\nCSparse\nnnz: ", 2 * contacts);
        listing += &format!("{}\n", 4 * operator.held());
        let explicit = dense_of(&loaded);
        let mut entries = 0;
        for (j, column) in explicit.column_iter().enumerate() {
            let held = column.iter().enumerate().filter(|(_, x)| **x != 0.0);
            let lines: Vec<String> = held.map(|(i, x)| format!("{i} : {x:e}\n")).collect();
            let last = entries + lines.len() - 1;
            listing += &format!(
                "col {j} : locations {entries} to {last}\n{}",
                lines.concat()
            );
            entries = last + 1;
        }
        let StoredProblem::Contact { problem: p, .. } = &problem else {
            panic!("a contact problem")
        };
        for b in &p.free {
            listing += &format!("{:e} {:e}\n", b.x, b.y);
        }
        listing += &"0.5 ".repeat(contacts);
        assert_eq!(read(listing.as_bytes()).unwrap().problem, problem);
    }
}

/// A small matrix is written dense; a file may use a form that the writer would not choose.
#[test]
fn blocks_of_json_are_read_and_refused_in_words() {
    let with = |blocks: &str| {
        let text = format!(
            "{{\"kind\": \"contact\",\n\"operator\": {{\"blocks\": [{blocks}]}},\n\"free\": \
             [[-1, 0], [-1, 0]],\n\"laws\": [{0}, {0}]}}",
            "{\"contact\": {\"friction\": 0.5}}"
        );
        read(text.as_bytes())
    };
    let diagonal = "[1, 1, [[2, 0], [0, 2]]], [0, 0, [[3, 0], [0, 3]]]";
    let loaded = with(&format!(
        "{diagonal}, [0, 1, [[1, 2], [0, 0]]], [1, 0, [[1, 0], [2, 0]]]"
    ))
    .unwrap();
    assert_eq!(dense_of(&loaded)[(0, 3)], 2.0);
    assert_eq!(contact_of(&loaded).operator.diagonal(0)[(1, 1)], 3.0);
    assert!(to_json(&loaded.problem).unwrap().contains("\"dense\""));
    let cases: [(&str, &[&str]); 6] = [
        (
            "[0, 2, [[1, 0], [0, 1]]]",
            &["operator.blocks[2] is at [0, 2]", "2 laws"],
        ),
        (
            "[1, 1, [[1, 0], [0, 1]]]",
            &["operator.blocks[2] is the second at [1, 1]"],
        ),
        (
            "[0, 1, [[1, 0], [0, 0]]]",
            &["W[0, 2] = 1e0", "[2, 0] = 0e0", "asymmetric"],
        ),
        ("[0, -1, [[1, 0], [0, 1]]]", &["line 2", "`-1`"]),
        ("[0, 1, [[1, 0]]]", &["line 2", "array of length 2"]),
        ("[0, 1]", &["line 2", "tuple of size 3"]),
    ];
    for (more, words) in cases {
        let message = with(&format!("{diagonal}, {more}"))
            .unwrap_err()
            .to_string();
        for word in words {
            assert!(message.contains(word), "{more}: lacks `{word}`: {message}");
        }
    }
    let message = with("[1, 1, [[2, 0], [0, 2]]]").unwrap_err().to_string();
    assert!(
        message.contains("block 0") && message.contains("infinite mass"),
        "{message}"
    );
}

/// Rows of zeros pass. A zero on the diagonal with numbers beside it does not, at any scale.
#[test]
fn zeros_on_the_diagonal() {
    let check = |rows: &[f64]| {
        let matrix = BlockMatrix::from_dense(&DMatrix::from_row_slice(2, 2, rows));
        check_semidefinite(&matrix, "W").is_ok()
    };
    for scale in [1e-200, 1.0, 1e200] {
        assert!(check(&[scale, 0.0, 0.0, 0.0]));
        assert!(check(&[scale, scale, scale, scale]));
        assert!(!check(&[scale, 1e-30 * scale, 1e-30 * scale, 0.0]));
        assert!(!check(&[scale, 0.0, 0.0, -1e-30 * scale]));
        assert!(!check(&[scale, 1.001 * scale, 1.001 * scale, scale]));
    }
    assert!(!check(&[1.0, f64::MAX, f64::MAX, 1.0]));
}

proptest! {
    /// Against the eigenvalues of the scaled matrix, on both sides of the bound.
    #[test]
    fn semidefinite_is_what_the_eigenvalues_say(
        size in 2usize..12,
        seed in any::<u64>(),
        couplings in 0usize..20,
        beside in prop_oneof![-1.9f64..-1.1, -0.9f64..5.0],
    ) {
        let mut random = Lcg(seed);
        let mut blocks = Vec::new();
        for k in 0..size as u32 {
            blocks.push((k, k, Mat2::new(1.0, 0.3, 0.3, 1.0)));
        }
        for _ in 0..couplings {
            let mut node = || (random.next() * size as f64) as u32;
            let (i, j) = (node(), node());
            if i != j {
                let block = 0.4 * Mat2::from_fn(|_, _| random.next() - 0.5);
                blocks.push((i, j, block));
                blocks.push((j, i, block.transpose()));
            }
        }
        // move the least eigenvalue to `beside` times the bound; the diagonal stays in proportion
        let unit = BlockMatrix::from_blocks(size, blocks);
        let full = Delassus::Blocks(unit).explicit();
        let least = full.symmetric_eigenvalues().min();
        let wanted = beside * ASYMMETRY;
        let shift = (wanted - least) / (1.0 - wanted);
        prop_assume!(1.0 + shift > 0.01);
        let mut matrix = full + DMatrix::identity(2 * size, 2 * size) * shift;
        // a congruence by a diagonal does not matter
        for k in 0..2 * size {
            let scale = 10f64.powi(k as i32 % 5 - 2);
            matrix.row_mut(k).scale_mut(scale);
            matrix.column_mut(k).scale_mut(scale);
        }
        let verdict = check_semidefinite(&BlockMatrix::from_dense(&matrix), "W");
        prop_assert_eq!(verdict.is_ok(), beside > -1.0, "{:?}", verdict);
    }
}

/// `W = Hᵀ M⁻¹ H` over the parts that M falls into, against the formula.
#[test]
fn a_mass_matrix_in_parts() {
    let mut random = Lcg(4);
    let (n, contacts) = (9, 4);
    // coordinates 0 4 7 are one part, 1 2 another, each other one alone
    let part = [0, 1, 1, 3, 0, 5, 6, 0, 8];
    let mut mass = DMatrix::from_fn(n, n, |i, j| {
        let value = random.next() - 0.5;
        if part[i] == part[j] { value } else { 0.0 }
    });
    mass = 0.5 * &mass + 0.5 * mass.transpose() + DMatrix::identity(n, n) * 2.0;
    // contact 3 touches the same parts as contact 0
    let h = DMatrix::from_fn(n, 2 * contacts, |i, j| {
        let value = random.next() - 0.5;
        if part[i] % 4 == (j / 2) % 3 {
            value
        } else {
            0.0
        }
    });
    let (q, b) = (
        DVector::from_fn(n, |_, _| random.next() - 0.5),
        DVector::from_fn(2 * contacts, |_, _| random.next() - 0.5),
    );
    let inverse = mass.clone().try_inverse().unwrap();
    let (w, free) = (h.tr_mul(&(&inverse * &h)), h.tr_mul(&(&inverse * &q)) + &b);
    let list = |x: &[f64]| x.iter().map(|x| format!("{x:e} ")).collect::<String>();
    let (q, b) = (list(q.as_slice()), list(b.as_slice()));
    let full = |m: &DMatrix<f64>| {
        let (rows, columns) = m.shape();
        format!(
            "0 {rows} {columns}\n{rows} {columns}\n{}\n",
            list(m.as_slice())
        )
    };
    let triplets = |m: &DMatrix<f64>| {
        let (rows, columns) = m.shape();
        let places = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
        let held: Vec<String> = places
            .filter(|&place| m[place] != 0.0)
            .map(|(i, j)| format!("{i} {j} : {:e}\n", m[(i, j)]))
            .collect();
        let count = held.len();
        format!(
            "2 {rows} {columns}\n1\nCSparse\nnnz: {count}\n{}",
            held.concat()
        )
    };
    let rest = format!("{q}\n{b}\n{}", "0.5 ".repeat(contacts));
    for text in [
        format!("2 {contacts}\n{}{}{rest}", full(&mass), full(&h)),
        format!("2 {contacts}\n{}{}{rest}", triplets(&mass), triplets(&h)),
    ] {
        let loaded = read(text.as_bytes()).unwrap();
        assert!(loaded.warnings.is_empty());
        let problem = contact_of(&loaded);
        // numbers of order one: a few ulp a product
        assert!((dense_of(&loaded) - &w).amax() < 1e-13);
        for (k, b) in problem.free.iter().enumerate() {
            assert!((b - free.fixed_rows::<2>(2 * k)).amax() < 1e-13);
        }
        // contacts 1 and 2 share no part with any other
        let Delassus::Blocks(operator) = &problem.operator else {
            panic!("explicit")
        };
        assert_eq!(operator.pairs(), [(0, 3)]);
    }
    // the error names the positions in the file
    let mut uneven = mass.clone();
    uneven[(0, 7)] += 4e-6;
    let text = format!("2 {contacts}\n{}{}{rest}", full(&uneven), triplets(&h));
    let loaded = read(text.as_bytes()).unwrap();
    assert_eq!(loaded.warnings.len(), 1);
    assert!(loaded.warnings[0].starts_with("M was symmetrised: [0, 7]"));
    uneven[(0, 7)] += 4e-4;
    let text = format!("2 {contacts}\n{}{}{rest}", full(&uneven), triplets(&h));
    let message = read(text.as_bytes()).unwrap_err().to_string();
    assert!(message.starts_with("M[0, 7] = "), "{message}");
}

/// A listing of `n` rows with 9 on the diagonal and -1 at the given pairs.
fn symmetric_listing(n: usize, pairs: impl Iterator<Item = (usize, usize)>) -> String {
    let mut lines: Vec<String> = (0..n).map(|k| format!("{k} {k} : 9\n")).collect();
    lines.extend(pairs.map(|(i, j)| format!("{i} {j} : -1\n{j} {i} : -1\n")));
    let text = lines.concat();
    let count = text.lines().count();
    format!("2 {n} {n}\n1\nCSparse\nnnz: {count}\n{text}")
}

/// More rows than could be made dense are accepted if they couple sparsely.
#[test]
fn only_what_takes_too_much_memory_is_refused() {
    let contacts = MOST_ROWS;
    let n = 2 * contacts;
    let rest = format!("{}\n{}", "-1 ".repeat(n), "0.5 ".repeat(contacts));
    let w = symmetric_listing(n, (2..n).map(|k| (k - 2, k)));
    let loaded = read(format!("2 {contacts}\n{w}{rest}").as_bytes()).unwrap();
    assert_eq!(contact_of(&loaded).len(), contacts);
    // a mass matrix that couples all its coordinates
    let n = MOST_ROWS + 1;
    let m = symmetric_listing(n, (1..n).map(|k| (k - 1, k)));
    let zeros = "0 ".repeat(n);
    let text = format!("2 1\n{m}2 {n} 2\n1\nCSparse\nnnz: 2\n0 0 : 1\n1 1 : 1\n{zeros}-1 0\n0.5");
    let message = read(text.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("10000 x 10000 are stored"), "{message}");
    // one coordinate in all contacts: W would be full
    let contacts = 5001;
    let h: String = (0..contacts)
        .map(|k| format!("0 {} : 1\n", 2 * k))
        .collect();
    let text = format!(
        "2 {contacts}\n2 1 1\n1\nCSparse\nnnz: 1\n0 0 : 1\n2 1 {}\n1\nCSparse\nnnz: {contacts}\n{h}\
         0\n{}{}",
        2 * contacts,
        "-1 ".repeat(2 * contacts),
        "0.5 ".repeat(contacts)
    );
    let message = read(text.as_bytes()).unwrap_err().to_string();
    assert!(message.contains("at most 25000000 are stored"), "{message}");
    // few blocks, coupled at random, whose factors fill up
    let contacts = 24_000;
    let n = 2 * contacts;
    let mut random = Lcg(1);
    let mut node = || (random.next() * contacts as f64) as usize;
    let pairs: Vec<_> = (0..3 * contacts)
        .map(|_| (2 * node(), 2 * node() + 1))
        .collect();
    let w = symmetric_listing(n, pairs.into_iter());
    let rest = format!("{}\n{}", "-1 ".repeat(n), "0.5 ".repeat(contacts));
    let message = read(format!("2 {contacts}\n{w}{rest}").as_bytes());
    let message = message.unwrap_err().to_string();
    assert!(message.contains("the factors of W"), "{message}");
}
