use super::{FileError, Loaded, StoredProblem};
use crate::contact::{
    BlockMatrix, BodyOperator, ContactProblem, Delassus, Law, Mat2, NO_BODY, Rows, Vec2, Vec3,
};
use nalgebra::{DMatrix, DVector};
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::HashSet;

/// The key that selects the kind; the other keys are read later.
#[derive(Deserialize)]
struct Head {
    kind: Kind,
}

#[derive(Serialize, Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Contact,
    Lcp,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ContactFile {
    #[serde(rename = "kind")]
    _kind: Kind,
    #[serde(default, rename = "units", deserialize_with = "ours")]
    _units: Units,
    operator: OperatorForm,
    free: Vec<[f64; 2]>,
    laws: Vec<LawForm>,
    solution: Option<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LcpFile {
    #[serde(rename = "kind")]
    _kind: Kind,
    matrix: Vec<Vec<f64>>,
    q: Vec<f64>,
    solution: Option<Vec<f64>>,
}

#[derive(Serialize, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
struct Units {
    operator: String,
    free: String,
    compliance: String,
    impulse: String,
}

impl Default for Units {
    fn default() -> Self {
        Units {
            operator: "1/kg".to_owned(),
            free: "m/s".to_owned(),
            compliance: "1/kg".to_owned(),
            impulse: "N s".to_owned(),
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum OperatorForm {
    Dense(Vec<Vec<f64>>),
    Blocks(Vec<BlockForm>),
    Bodies(BodiesForm),
}

/// Block row, block column, rows of the block.
type BlockForm = (u32, u32, [[f64; 2]; 2]);

/// Up to this many blocks an operator is written with all its numbers; also if half of its blocks
/// or more are stored.
const SMALL: usize = 32;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BodiesForm {
    inverse_mass: Vec<InverseMass>,
    rows: Vec<RowsForm>,
}

/// (1/m, 1/m, 1/J) [1/kg, 1/(kg m²)], none below 0.
struct InverseMass([f64; 3]);

impl<'de> Deserialize<'de> for InverseMass {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let values = <[f64; 3]>::deserialize(deserializer)?;
        match values.iter().find(|x| **x < 0.0) {
            Some(x) => Err(D::Error::custom(format!(
                "an inverse mass is {x}, must be at least 0"
            ))),
            None => Ok(InverseMass(values)),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RowsForm {
    bodies: [Option<u32>; 2],
    jacobian: [[[f64; 3]; 2]; 2],
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
enum LawForm {
    #[serde(deserialize_with = "contact_form")]
    Contact(ContactForm),
    Pin,
    Bounded(BoundedForm),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ContactForm {
    friction: f64,
    #[serde(default)]
    compliance: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BoundedForm {
    #[serde(skip_serializing_if = "Option::is_none")]
    lower: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    upper: Option<f64>,
    #[serde(default)]
    compliance: f64,
}

/// Refuses while the reader still knows the line.
fn contact_form<'de, D: Deserializer<'de>>(deserializer: D) -> Result<ContactForm, D::Error> {
    let form = ContactForm::deserialize(deserializer)?;
    for (name, value) in [("friction", form.friction), ("compliance", form.compliance)] {
        if value < 0.0 {
            return Err(D::Error::custom(format!(
                "{name} is {value}, must be at least 0"
            )));
        }
    }
    Ok(form)
}

fn ours<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Units, D::Error> {
    let units = Units::deserialize(deserializer)?;
    if units == Units::default() {
        return Ok(units);
    }
    let known = serde_json::to_string(&Units::default()).map_err(D::Error::custom)?;
    Err(D::Error::custom(format!("units must be {known}")))
}

/// Reads a JSON file of either kind.
pub(super) fn read(text: &str) -> Result<Loaded, FileError> {
    let loaded = match parse::<Head>(text)?.kind {
        Kind::Contact => {
            let file: ContactFile = parse(text)?;
            let problem = ContactProblem {
                operator: operator(file.operator, file.laws.len())?,
                free: file.free.into_iter().map(Vec2::from).collect(),
                laws: file.laws.iter().map(law).collect(),
            };
            let solution = file
                .solution
                .map(|p| p.into_iter().map(Vec2::from).collect());
            Loaded::contact(problem, solution)?
        }
        Kind::Lcp => {
            let file: LcpFile = parse(text)?;
            let matrix = dense("matrix", file.matrix)?;
            let solution = file.solution.map(DVector::from_vec);
            Loaded::lcp(matrix, DVector::from_vec(file.q), solution)
        }
    };
    loaded.problem.check()?;
    Ok(loaded)
}

fn parse<T: DeserializeOwned>(text: &str) -> Result<T, FileError> {
    serde_json::from_str(text).map_err(|e| {
        // the message already names the position at its start
        let (line, column) = (e.line(), e.column());
        let message = e.to_string();
        let place = format!(" at line {line} column {column}");
        FileError::Json {
            line,
            column,
            reason: message.strip_suffix(&place).unwrap_or(&message).to_owned(),
        }
    })
}

/// An operator of `size` blocks, for forms that do not state the size.
fn operator(form: OperatorForm, size: usize) -> Result<Delassus, FileError> {
    match form {
        OperatorForm::Dense(rows) => {
            let matrix = dense("operator.dense", rows)?;
            if matrix.nrows() % 2 != 0 {
                return Err(FileError::Content(format!(
                    "operator.dense has {} rows, must have two a block",
                    matrix.nrows()
                )));
            }
            Ok(Delassus::dense(matrix))
        }
        OperatorForm::Blocks(form) => {
            let mut places = HashSet::new();
            let mut blocks = Vec::new();
            for (k, (i, j, rows)) in form.into_iter().enumerate() {
                if i.max(j) as usize >= size {
                    return Err(FileError::Content(format!(
                        "operator.blocks[{k}] is at [{i}, {j}], and there are {size} laws"
                    )));
                }
                if !places.insert((i, j)) {
                    return Err(FileError::Content(format!(
                        "operator.blocks[{k}] is the second at [{i}, {j}]"
                    )));
                }
                let [[nn, nt], [tn, tt]] = rows;
                blocks.push((i, j, Mat2::new(nn, nt, tn, tt)));
            }
            Ok(Delassus::Blocks(BlockMatrix::from_blocks(size, blocks)))
        }
        OperatorForm::Bodies(form) => {
            let inverse_mass: Vec<Vec3> = (form.inverse_mass.iter())
                .map(|m| Vec3::from(m.0))
                .collect();
            let bodies = inverse_mass.len();
            let mut rows = Vec::new();
            for (block, row) in form.rows.into_iter().enumerate() {
                if let Some(body) = row.bodies.iter().flatten().find(|b| **b as usize >= bodies) {
                    return Err(FileError::Content(format!(
                        "operator.bodies.rows[{block}].bodies names body {body} of {bodies}"
                    )));
                }
                rows.push(Rows {
                    bodies: row.bodies.map(|body| body.unwrap_or(NO_BODY)),
                    jacobian: row.jacobian.map(|side| side.map(Vec3::from)),
                });
            }
            Ok(Delassus::Bodies(BodyOperator { inverse_mass, rows }))
        }
    }
}

/// A square matrix from its rows.
fn dense(key: &str, rows: Vec<Vec<f64>>) -> Result<DMatrix<f64>, FileError> {
    let n = rows.len();
    if let Some(row) = rows.iter().position(|row| row.len() != n) {
        return Err(FileError::Content(format!(
            "{key}[{row}] has {} numbers, must have {n}, one a row",
            rows[row].len()
        )));
    }
    Ok(DMatrix::from_fn(n, n, |i, j| rows[i][j]))
}

fn law(form: &LawForm) -> Law {
    match form {
        LawForm::Contact(form) => Law::Contact {
            friction: form.friction,
            compliance: form.compliance,
        },
        LawForm::Pin => Law::Pin,
        LawForm::Bounded(form) => Law::Bounded {
            lower: form.lower.unwrap_or(f64::NEG_INFINITY),
            upper: form.upper.unwrap_or(f64::INFINITY),
            compliance: form.compliance,
        },
    }
}

fn law_form(law: &Law) -> LawForm {
    match *law {
        Law::Contact {
            friction,
            compliance,
        } => LawForm::Contact(ContactForm {
            friction,
            compliance,
        }),
        Law::Pin => LawForm::Pin,
        Law::Bounded {
            lower,
            upper,
            compliance,
        } => LawForm::Bounded(BoundedForm {
            lower: lower.is_finite().then_some(lower),
            upper: upper.is_finite().then_some(upper),
            compliance,
        }),
    }
}

/// Writes a problem as JSON. Reading it gives the same value, to the last bit.
///
/// # Errors
/// [`FileError::Contact`], [`FileError::Content`] for an invalid problem.
pub fn to_json(problem: &StoredProblem) -> Result<String, FileError> {
    problem.check()?;
    let mut parts = Vec::new();
    match problem {
        StoredProblem::Contact { problem, solution } => {
            parts.push(part("kind", &Kind::Contact)?);
            parts.push(part("units", &Units::default())?);
            parts.push(operator_part(&problem.operator)?);
            parts.push(list("  ", "free", problem.free.iter().map(pair))?);
            parts.push(list("  ", "laws", problem.laws.iter().map(law_form))?);
            if let Some(solution) = solution {
                parts.push(list("  ", "solution", solution.iter().map(pair))?);
            }
        }
        StoredProblem::Lcp {
            matrix,
            q,
            solution,
        } => {
            parts.push(part("kind", &Kind::Lcp)?);
            parts.push(list("  ", "matrix", rows(matrix))?);
            parts.push(part("q", &q.as_slice())?);
            if let Some(z) = solution {
                parts.push(part("solution", &z.as_slice())?);
            }
        }
    }
    Ok(format!("{{\n{}\n}}\n", parts.join(",\n")))
}

fn operator_part(operator: &Delassus) -> Result<String, FileError> {
    let inner = match operator {
        Delassus::Blocks(m) if m.size() <= SMALL || 2 * m.held() >= m.size().pow(2) => {
            list("    ", "dense", rows(&operator.explicit()))?
        }
        Delassus::Blocks(m) => {
            let blocks = (0..m.size()).flat_map(|i| m.row(i).map(move |(j, m)| (i, j, m)));
            let nonzero = blocks.filter(|(_, _, m)| m.iter().any(|x| *x != 0.0));
            let form = |(i, j, m): (usize, usize, Mat2)| -> BlockForm {
                let rows = [[m[(0, 0)], m[(0, 1)]], [m[(1, 0)], m[(1, 1)]]];
                (i as u32, j as u32, rows)
            };
            list("    ", "blocks", nonzero.map(form))?
        }
        Delassus::Bodies(op) => {
            let inverse_mass = op.inverse_mass.iter().map(|m| [m.x, m.y, m.z]);
            let rows = op.rows.iter().map(|rows| RowsForm {
                bodies: rows.bodies.map(|body| (body != NO_BODY).then_some(body)),
                jacobian: rows
                    .jacobian
                    .map(|side| side.map(|row| [row.x, row.y, row.z])),
            });
            let inverse_mass = list("      ", "inverse_mass", inverse_mass)?;
            let rows = list("      ", "rows", rows)?;
            format!("    \"bodies\": {{\n{inverse_mass},\n{rows}\n    }}")
        }
    };
    Ok(format!("  \"operator\": {{\n{inner}\n  }}"))
}

fn rows(matrix: &DMatrix<f64>) -> impl Iterator<Item = Vec<f64>> + '_ {
    matrix.row_iter().map(|row| row.iter().copied().collect())
}

fn pair(p: &Vec2) -> [f64; 2] {
    [p.x, p.y]
}

fn json(value: &impl Serialize) -> Result<String, FileError> {
    serde_json::to_string(value).map_err(|e| FileError::Content(e.to_string()))
}

fn part(key: &str, value: &impl Serialize) -> Result<String, FileError> {
    Ok(format!("  \"{key}\": {}", json(value)?))
}

/// A list with one item per line, so that an error names the line of the item.
fn list(
    indent: &str,
    key: &str,
    items: impl Iterator<Item = impl Serialize>,
) -> Result<String, FileError> {
    let items: Result<Vec<String>, FileError> = items
        .map(|item| Ok(format!("{indent}  {}", json(&item)?)))
        .collect();
    Ok(format!(
        "{indent}\"{key}\": [\n{}\n{indent}]",
        items?.join(",\n")
    ))
}
