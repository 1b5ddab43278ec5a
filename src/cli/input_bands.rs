//! The bands of a result of `[uncertain]`, and their table.

use super::input_cases::{Output, shortened};
use crate::report::{Align, Table, number, quantity};
use crate::scene::Uncertain;

/// What an input does to an output at one of its values.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Effect {
    pub text: String,
    pub found: Result<f64, String>,
    pub limit: Option<String>,
    pub closed: bool,
}

/// What an input does to an output.
pub(super) struct Cause<'a> {
    pub input: &'a Uncertain,
    pub effects: Vec<Effect>,
    /// Logarithms of the largest ratios, down and up, both at least 0.
    pub reach: [f64; 2],
}

/// An output with its two bands.
pub(super) struct Bands<'a> {
    pub output: Output,
    pub nominal: f64,
    pub causes: Vec<Cause<'a>>,
    /// All inputs at once at the ends that make the first output least, 0, and most, 1; none where that is
    /// one input alone.
    pub together: Vec<(usize, Effect)>,
}

impl<'a> Cause<'a> {
    pub(super) fn new(input: &'a Uncertain, effects: Vec<Effect>, nominal: f64) -> Cause<'a> {
        let mut reach = [0.0f64; 2];
        for value in effects
            .iter()
            .filter_map(|effect| effect.found.as_ref().ok())
        {
            let log = (value / nominal).ln();
            reach = [reach[0].max(-log), reach[1].max(log)];
        }
        Cause {
            input,
            effects,
            reach,
        }
    }

    fn span(&self) -> f64 {
        self.reach[0] + self.reach[1]
    }

    /// Least and largest value of the output.
    pub(super) fn ends(&self, nominal: f64) -> [f64; 2] {
        let [down, up] = self.reach;
        [nominal * (-down).exp(), nominal * up.exp()]
    }
}

impl Bands<'_> {
    /// The ends of equation (1) of `run_inputs`.
    pub(super) fn inputs(&self) -> [f64; 2] {
        let sum = |side: usize| {
            let squares = self.causes.iter().map(|cause| cause.reach[side].powi(2));
            squares.sum::<f64>().sqrt()
        };
        [self.nominal * (-sum(0)).exp(), self.nominal * sum(1).exp()]
    }

    /// All effects multiplied, without and with equation (1)'s square root: what the corners would be.
    fn product(&self) -> [f64; 2] {
        let sum = |side: usize| self.causes.iter().map(|c| c.reach[side]).sum::<f64>();
        [self.nominal * (-sum(0)).exp(), self.nominal * sum(1).exp()]
    }

    pub(super) fn numerics(&self) -> Option<[f64; 2]> {
        let error = self.output.error;
        error
            .is_finite()
            .then_some([self.nominal - error, self.nominal + error])
    }

    /// Causes, the largest first; equal ones in the order of the file.
    pub(super) fn ranked(&self) -> Vec<&Cause<'_>> {
        let mut all: Vec<&Cause> = self.causes.iter().collect();
        all.sort_by(|a, b| b.span().total_cmp(&a.span()));
        all
    }

    pub(super) fn show(&self, value: f64) -> String {
        match self.output.unit {
            "h" => format!("{} h", number(value, 4)),
            unit => quantity(value, unit, 4),
        }
    }

    fn range(&self, [from, to]: [f64; 2]) -> String {
        format!("{} to {}", self.show(from), self.show(to))
    }

    /// What the output is.
    pub(super) fn title(&self) -> String {
        match &self.output.limit {
            Some(limit) => format!("{}, until {limit}", self.output.name),
            None => self.output.name.clone(),
        }
    }

    /// The largest cause in words.
    pub(super) fn largest(&self) -> String {
        let ranked = self.ranked();
        let Some(first) = ranked.first().filter(|cause| cause.span() > 0.0) else {
            return "no input moves it".to_owned();
        };
        let squares = |cause: &Cause| cause.span().powi(2);
        let all: f64 = ranked.iter().map(|cause| squares(cause)).sum();
        let wide = |[a, b]: [f64; 2]| (b / a).ln();
        let numerics = self.numerics().filter(|[from, _]| *from > 0.0).map(wide);
        let beside = match numerics {
            Some(log) if log > first.span() => ", less than the numerics",
            _ => "",
        };
        format!(
            "the largest cause is {}: alone it gives {}, a factor of {}, and {} % of the squares of (1){beside}",
            first.input.key,
            self.range(first.ends(self.nominal)),
            number(first.span().exp(), 3),
            number(100.0 * squares(first) / all, 2)
        )
    }

    pub(super) fn describe(&self) -> String {
        let numerics = self
            .numerics()
            .map_or("not known".to_owned(), |n| self.range(n));
        let mut out = format!(
            "{}: {}, with two bands\n  numerics  {numerics}\n  inputs    {}\n",
            self.title(),
            self.show(self.nominal),
            self.range(self.inputs())
        );
        let mut table = Table::new([
            ("input", Align::Left),
            ("value", Align::Right),
            (self.output.name.as_str(), Align::Right),
            ("ratio", Align::Right),
            ("how", Align::Left),
        ]);
        for cause in self.ranked() {
            let own = [
                cause.input.key.clone(),
                shortened(&cause.input.nominal, cause.input.number),
                self.show(self.nominal),
                String::new(),
                "the scene".to_owned(),
            ];
            table.push(own);
            for effect in &cause.effects {
                self.push(&mut table, String::new(), effect);
            }
        }
        out.push_str(&format!("{table}"));
        out.push_str(&format!("{}\n", self.largest()));
        for (side, effect) in &self.together {
            let found = match &effect.found {
                Ok(value) => self.show(*value),
                Err(why) => format!("no result ({why})"),
            };
            out.push_str(&format!(
                "all at once, {}: {found}; the single effects multiplied are {}\n",
                effect.text,
                self.show(self.product()[*side])
            ));
        }
        out
    }

    fn push(&self, table: &mut Table, name: String, effect: &Effect) {
        let (value, ratio) = match &effect.found {
            Ok(value) => (self.show(*value), number(value / self.nominal, 4)),
            Err(_) => ("-".to_owned(), "-".to_owned()),
        };
        table.push([name, effect.text.clone(), value, ratio, self.how(effect)]);
    }

    pub(super) fn how(&self, effect: &Effect) -> String {
        match &effect.found {
            Err(why) => why.clone(),
            Ok(_) if effect.closed => "closed form, 1/K".to_owned(),
            Ok(_) => match &effect.limit {
                limit if *limit == self.output.limit => "run".to_owned(),
                Some(limit) => format!("run; {limit} first"),
                None => "run".to_owned(),
            },
        }
    }
}
