//! The table of a sweep: a row for each case, a column for each key and each result of the summaries.

use super::sweep::PlannedCase;
use super::sweep_case::Record;
use crate::experiment::RunError;
use serde_json::Value;
use std::collections::HashMap;

/// Parts of a summary that are no results.
const NO_RESULTS: [&str; 9] = [
    "program",
    "version",
    "command",
    "scene",
    "title",
    "scene_hash",
    "settings",
    "warnings",
    "pictures",
];
/// Parts that come last.
const LAST: [&str; 2] = ["verdict", "totals"];
/// Keys that name an element of a list.
const LABELS: [&str; 3] = ["name", "body", "limit"];

/// A case with its results.
pub(super) struct Row {
    pub case: PlannedCase,
    pub record: Record,
    results: HashMap<String, Value>,
}

/// See the head of this file.
pub(super) struct SweepTable {
    pub keys: Vec<String>,
    /// Names of the results.
    pub columns: Vec<String>,
    pub rows: Vec<Row>,
}

impl SweepTable {
    pub fn new(keys: Vec<String>) -> Self {
        SweepTable {
            keys,
            columns: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// Adds a case; `summary` is null where its run ended with an error.
    pub fn add(&mut self, case: PlannedCase, record: Record, summary: &Value) {
        let mut found = Vec::new();
        flatten("", summary, &mut found);
        found.retain(|(name, _)| {
            let first = name.split('.').next().unwrap_or_default();
            !NO_RESULTS.contains(&first)
        });
        let mut results = HashMap::new();
        for (name, value) in found {
            results.insert(name, value);
        }
        self.rows.push(Row {
            case,
            record,
            results,
        });
    }

    /// Collects the columns: by name, those of [`LAST`] at the end.
    pub fn close(&mut self) {
        let names = self.rows.iter().flat_map(|row| row.results.keys());
        let mut columns: Vec<String> = names.cloned().collect();
        columns.sort();
        columns.dedup();
        let place = |name: &String| LAST.iter().position(|last| name.starts_with(last));
        columns.sort_by_key(|name| place(name).map_or(0, |at| at + 1));
        self.columns = columns;
    }

    /// The result `column` of a row as a number.
    pub fn number(&self, row: &Row, column: &str) -> Option<f64> {
        row.results.get(column).and_then(Value::as_f64)
    }

    /// Whether a result is a number in one row at least, and not the same in all.
    pub fn varies(&self, column: &str) -> bool {
        let mut values = self.rows.iter().map(|row| self.number(row, column));
        let first = values.next().flatten();
        values.any(|value| value != first)
    }

    /// `sweep.csv`
    ///
    /// # Errors
    /// None: it is written to memory.
    pub fn csv(&self) -> Result<Vec<u8>, RunError> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let wrong = |error: csv::Error| RunError::Unfit(format!("sweep.csv: {error}"));
        let head = ["case"]
            .into_iter()
            .chain(self.keys.iter().map(String::as_str));
        let head = head.chain(["held", "why"]);
        let head = head.chain(self.columns.iter().map(String::as_str));
        writer.write_record(head).map_err(wrong)?;
        for row in &self.rows {
            let mut cells = vec![row.case.case.clone()];
            let values = row.case.values.iter();
            cells.extend(values.map(|value| value.clone().unwrap_or_default()));
            cells.push(row.record.held.to_string());
            cells.push(row.record.why.clone().unwrap_or_default());
            let results = self.columns.iter().map(|name| row.results.get(name));
            cells.extend(results.map(|value| match value {
                None | Some(Value::Null) => String::new(),
                Some(Value::String(text)) => text.clone(),
                Some(value) => value.to_string(),
            }));
            writer.write_record(&cells).map_err(wrong)?;
        }
        writer
            .into_inner()
            .map_err(|error| RunError::Unfit(format!("sweep.csv: {error}")))
    }
}

/// The numbers, words and truths of a summary under their paths, such as `life.unfit.hours`. Elements of
/// a list go by their name; the only element of a list needs none; other lists are left out.
fn flatten(path: &str, value: &Value, out: &mut Vec<(String, Value)>) {
    let below = |word: &str| match path.is_empty() {
        true => word.to_owned(),
        false => format!("{path}.{word}"),
    };
    match value {
        Value::Object(table) => {
            for (key, value) in table {
                flatten(&below(key), value, out);
            }
        }
        Value::Array(items) => {
            let named = LABELS.into_iter().find_map(|label| names(items, label));
            match (named, &items[..]) {
                (Some((label, names)), _) => {
                    for (name, item) in names.iter().zip(items) {
                        let mut item = item.clone();
                        if let Value::Object(table) = &mut item {
                            table.remove(label);
                        }
                        flatten(&below(name), &item, out);
                    }
                }
                (None, [only @ Value::Object(_)]) => flatten(path, only, out),
                _ => {}
            }
        }
        _ => out.push((path.to_owned(), value.clone())),
    }
}

/// The names of the elements of a list by `label`, if each has one of its own.
fn names<'a>(items: &[Value], label: &'a str) -> Option<(&'a str, Vec<String>)> {
    let mut names = Vec::new();
    for item in items {
        let name = item.get(label)?.as_str()?.to_owned();
        if names.contains(&name) {
            return None;
        }
        names.push(name);
    }
    (!names.is_empty()).then_some((label, names))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn results_get_the_names_of_their_lists() {
        let summary = json!({
            "life": [
                { "limit": "unfit", "hours": 12.5, "cell": 1 },
                { "limit": "base", "hours": null, "cell": 2 },
            ],
            "comparison": [{ "computed_um": 7.0 }],
            "frictions": [{ "friction": 0.1 }, { "friction": 0.2 }],
            "verdict": { "checks": [{ "name": "overlap", "limit": 0.1, "value": 0.0 }], "held": true },
            "passed": [["a", "b"]],
            "ended": null,
        });
        let mut found = Vec::new();
        flatten("", &summary, &mut found);
        let names: Vec<&str> = found.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(
            names,
            [
                "comparison.computed_um",
                "ended",
                "life.unfit.cell",
                "life.unfit.hours",
                "life.base.cell",
                "life.base.hours",
                "verdict.checks.overlap.limit",
                "verdict.checks.overlap.value",
                "verdict.held"
            ]
        );
    }
}
