//! What `calibrate` found, in words and for `summary.json`.

use super::calibrate::{Against, CalibrateArgs, Found};
use super::calibrate_data::Kind;
use crate::experiment::Second;
use crate::report::number;
use serde_json::json;

impl Found {
    /// The part of `summary.json`.
    pub(super) fn json(&self, args: &CalibrateArgs) -> serde_json::Value {
        let against = self.against.iter().map(|of| {
            let second = of.second.as_ref().ok();
            let finite = |value: fn(&Second) -> f64| second.map(value).filter(|x| x.is_finite());
            json!({
                "key": of.key,
                "value": of.value,
                "told_apart": second.map(Second::told),
                "cosine_squared": finite(|s| s.alike),
                "coefficient_per_key": finite(|s| s.trade),
                "relative_deviation_alone": finite(|s| s.alone),
                "relative_deviation_both": finite(|s| s.both),
                "why": of.second.as_ref().err(),
            })
        });
        let [low, high] = self.interval();
        json!({
            "part": self.worn.part,
            "measured": self.data.kind.word(),
            "measurements": self.data.kind.len(),
            "key": self.worn.key,
            "coefficient_m2_n": self.coefficient(),
            "low_m2_n": low,
            "high_m2_n": high,
            "level": self.data.level,
            "deviation": self.fit.deviation,
            "deviation_given": self.data.deviation.is_some(),
            "scatter": self.fit.scatter,
            "freedom": self.fit.freedom,
            "density_kg_m3": self.data.density(&self.worn, args).0,
            "width_m": self.data.width(&self.worn, args).0,
            "against": against.collect::<Vec<_>>(),
        })
    }

    pub(super) fn describe(&self, args: &CalibrateArgs) -> String {
        let (data, fit, kind) = (&self.data, &self.fit, &self.data.kind);
        let k = |value: f64| number(value, 4);
        let interval = match self.interval() {
            [Some(low), Some(high)] => format!("{} to {} m2/N", k(low), k(high)),
            [low, _] => format!(
                "at least {} m2/N (the run ends before the upper end)",
                k(low.unwrap_or(0.0))
            ),
        };
        let mut out = format!(
            "{} = {} m2/N, {} with {} %\n{} of {}, {} measured after {} h\n",
            self.worn.key,
            k(self.coefficient()),
            interval,
            number(100.0 * data.level, 3),
            kind.word(),
            self.worn.part,
            match kind.len() {
                1 => "once".to_owned(),
                n => format!("{n} times"),
            },
            range(&data.hours)
        );
        let source = match data.deviation {
            Some(_) => "given".to_owned(),
            None => format!("from the scatter, {} degrees of freedom", fit.freedom),
        };
        out.push_str(&format!(
            "noise: independent normal errors of standard deviation {}, {source}; the interval has the error of \
             the measurements\nalone, not that of the run nor of its inputs\n",
            kind.show(fit.deviation)
        ));
        if let Kind::Mass(_) = kind {
            let (density, whence) = data.density(&self.worn, args);
            out.push_str(&format!("density {density} kg/m3, {whence}\n"));
            let (width, whence) = data.width(&self.worn, args);
            out.push_str(&format!("width {width} m, {whence}\n"));
        }
        if fit.low == 0.0 {
            out.push_str("the data do not tell K from 0: no wear at all lies in the interval\n");
        }
        out.push_str(&self.misfit());
        out.push_str(
            "K cannot be told from the hours, nor from a factor on all loads: wear tells their product alone, 1 % \
             more hours is\n1 % less K\n",
        );
        if !self.worn.with.is_empty() {
            out.push_str(&format!("{}\n", self.worn.with));
        }
        self.against
            .iter()
            .for_each(|of| out.push_str(&of.describe()));
        out.push_str(&format!(
            "to run with it: --set {}={:.5e}\n",
            self.worn.key,
            self.coefficient()
        ));
        out
    }

    /// Whether the residuals are larger than the uncertainty that was given.
    fn misfit(&self) -> String {
        let (fit, kind) = (&self.fit, &self.data.kind);
        let given = self.data.deviation.is_some() && fit.freedom > 0;
        let shape = match kind {
            Kind::Profile(..) => {
                ": the scene does not wear in this shape, or points share an error; the interval is too narrow"
            }
            _ => ": the uncertainty is too small, or the parts differ; the interval is too narrow",
        };
        // the deviation of n - 1 squares about 1
        let most = 1.0 + 3.0 * (0.5 / fit.freedom.max(1) as f64).sqrt();
        match given && fit.scatter > most * fit.deviation {
            true => format!(
                "note: residuals scatter by {}, more than the {} that were given{shape}\n",
                kind.show(fit.scatter),
                kind.show(fit.deviation)
            ),
            false => match kind {
                Kind::Profile(..) => format!(
                    "residuals of the points scatter by {}; points that share an error of the tracing make the \
                     interval too narrow\n",
                    kind.show(fit.scatter)
                ),
                _ => String::new(),
            },
        }
    }
}

impl Against {
    pub(super) fn describe(&self) -> String {
        let key = &self.key;
        let second = match &self.second {
            Ok(second) => second,
            Err(why) => return format!("{key}: its effect could not be computed: {why}\n"),
        };
        if second.trade.abs() < 1e-6 {
            return format!("{key}: moves nothing that was measured\n");
        }
        let trade = format!(
            "1 % more of it asks for {} % {} K",
            number(second.trade.abs(), 2),
            if second.trade > 0.0 { "more" } else { "less" }
        );
        match second.told() {
            true => format!(
                "K and {key}, {}, can be told apart: with both unknown the standard deviation of K is {} %, with \
                 {key} known {} %; {trade}\n",
                self.value,
                number(100.0 * second.both, 2),
                number(100.0 * second.alone, 2)
            ),
            false => format!(
                "these data cannot tell K from {key}, {}: both move them alike (cosine squared {}); {trade}\n",
                self.value,
                number(second.alike, 4)
            ),
        }
    }
}

/// A list of hours in words.
fn range(hours: &[f64]) -> String {
    let low = hours.iter().copied().fold(f64::INFINITY, f64::min);
    let high = hours.iter().copied().fold(0.0, f64::max);
    match low == high {
        true => number(low, 4),
        false => format!("{} to {}", number(low, 4), number(high, 4)),
    }
}
