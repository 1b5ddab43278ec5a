//! The bands of a result of `[uncertain]` as rows of a file, for `summary.json` and as a picture.

use super::input_bands::{Bands, Cause, Effect};
use super::input_cases::shortened;
use crate::report::{Tornado, TornadoRow, row};
use crate::scene::Scene;
use serde_json::{Value, json};

row! {
    /// A result of a scene with inputs at other values.
    InputRow in "uncertain.csv" {
        result: String,
        unit: String,
        /// The key that is changed; `together` for all at once.
        input: String,
        value: String,
        /// NaN where there is none.
        found: f64,
        /// Over the nominal result.
        ratio: f64,
        /// `run`, `closed form`, or why there is no result.
        how: String,
    }
}

impl Bands<'_> {
    pub(super) fn rows(&self) -> impl Iterator<Item = InputRow> + '_ {
        let row = |input: &str, effect: &Effect| {
            let found = effect.found.clone().unwrap_or(f64::NAN);
            InputRow {
                result: self.output.name.clone(),
                unit: self.output.unit.to_owned(),
                input: input.to_owned(),
                value: effect.text.clone(),
                found,
                ratio: found / self.nominal,
                how: self.how(effect),
            }
        };
        let alone = self.causes.iter().flat_map(move |cause| {
            let key = cause.input.key.as_str();
            cause.effects.iter().map(move |effect| row(key, effect))
        });
        let together = self.together.iter();
        alone.chain(together.map(move |(_, effect)| row("together", effect)))
    }

    pub(super) fn json(&self) -> Value {
        let one = |effect: &Effect| {
            json!({
                "value": effect.text,
                "found": effect.found.as_ref().ok(),
                "how": self.how(effect),
            })
        };
        let cause = |cause: &&Cause| {
            json!({
                "input": cause.input.key,
                "nominal": cause.input.nominal,
                "band": cause.ends(self.nominal),
                "values": cause.effects.iter().map(one).collect::<Vec<_>>(),
            })
        };
        json!({
            "result": self.output.name,
            "unit": self.output.unit,
            "limit": self.output.limit,
            "nominal": self.nominal,
            "numerics": self.numerics(),
            "inputs": self.inputs(),
            "causes": self.ranked().iter().map(cause).collect::<Vec<_>>(),
            "together": self.together.iter().map(|(_, e)| one(e)).collect::<Vec<_>>(),
            "largest": self.largest(),
        })
    }

    pub(super) fn picture(&self, scene: &Scene) -> Tornado {
        let band = |name: &str, ends: [f64; 2]| TornadoRow {
            name: name.to_owned(),
            ends: ends.map(|end| (end, self.show(end))).into(),
            band: true,
        };
        let mut rows: Vec<TornadoRow> = Vec::new();
        for cause in self.ranked() {
            let ends = cause.effects.iter().filter_map(|effect| {
                let value = *effect.found.as_ref().ok()?;
                Some((value, effect.text.clone()))
            });
            rows.push(TornadoRow {
                name: format!(
                    "{} ({})",
                    cause.input.key,
                    shortened(&cause.input.nominal, cause.input.number)
                ),
                ends: ends.collect(),
                band: false,
            });
        }
        rows.push(band("all inputs", self.inputs()));
        rows.extend(self.numerics().map(|ends| band("numerics", ends)));
        Tornado {
            title: "What each uncertain input does".to_owned(),
            subtitle: format!("{}, {}", scene.name, self.title()),
            axis: format!("{} [{}]", self.output.name, self.output.unit),
            nominal: self.nominal,
            rows,
            notes: vec![
                "Above each bar what the input is at its end; in brackets what it is in the scene, the upright \
                 line."
                    .to_owned(),
                "All inputs: one at a time, logarithms added in quadrature; inputs that act on each other are \
                 not seen by it."
                    .to_owned(),
            ],
        }
    }
}
