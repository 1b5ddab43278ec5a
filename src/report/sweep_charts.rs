//! Pictures of a sweep: lines over one key, maps over two, points over a sample.

use super::value_map::{MapCell, MapPanel, ValueMap};
use super::{Axis, Chart, ReportError, Series, Style, panels};
use std::collections::{HashMap, HashSet};

/// Most maps of a picture.
const MOST_MAPS: usize = 24;
/// Most rows or columns of a map.
const MOST_CELLS: usize = 200;

/// One result of the cases of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepResult<'a> {
    /// Name of the result, with its unit.
    pub result: &'a str,
    /// What was swept.
    pub subject: &'a str,
    /// The keys that vary.
    pub keys: &'a [String],
    pub points: Vec<SweepPoint<'a>>,
}

/// A case.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPoint<'a> {
    /// What each key is set to; empty where it is left to the scene.
    pub values: Vec<&'a str>,
    pub result: Option<f64>,
    /// Whether the scene held.
    pub held: bool,
}

/// A key and its values: numbers from the smallest to the largest, words in the order of the cases.
struct Key<'a> {
    name: &'a str,
    index: usize,
    values: Vec<&'a str>,
}

impl Key<'_> {
    fn numeric(&self) -> bool {
        self.values.iter().all(|value| parsed(value).is_some())
    }
}

fn parsed(text: &str) -> Option<f64> {
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

impl SweepResult<'_> {
    /// The picture; `None` where nothing varies, or where what varies is no number or too much to draw.
    ///
    /// # Errors
    /// [`ReportError::EmptyChart`] where no case has the result; [`ReportError::Chart`].
    pub fn picture(&self) -> Result<Option<String>, ReportError> {
        let keys = self.varied();
        let grid = self.is_grid(&keys);
        match &keys[..] {
            [] => Ok(None),
            [key] if key.numeric() => Ok(Some(self.over(key, Style::LinePoints).to_svg()?)),
            _ if grid => match self.map(&keys) {
                Some(map) => Ok(Some(map.to_svg()?)),
                None => Ok(None),
            },
            _ => {
                let numeric = keys.iter().filter(|key| key.numeric());
                let charts: Vec<Chart> = numeric.map(|key| self.over(key, Style::Points)).collect();
                match charts.is_empty() {
                    true => Ok(None),
                    false => Ok(Some(panels(&charts)?)),
                }
            }
        }
    }

    /// The keys with more than one value.
    fn varied(&self) -> Vec<Key<'_>> {
        let mut keys = Vec::new();
        for (index, name) in self.keys.iter().enumerate() {
            let mut seen = HashSet::new();
            let all = self.points.iter().map(|point| point.values[index]);
            let values = all.filter(|value| seen.insert(*value)).collect();
            let mut key = Key {
                name,
                index,
                values,
            };
            if key.numeric() {
                let number = |text: &&str| parsed(text).unwrap_or(f64::NAN);
                key.values.sort_by(|a, b| number(a).total_cmp(&number(b)));
            }
            if key.values.len() > 1 {
                keys.push(key);
            }
        }
        keys
    }

    /// Whether most pairs of values are there, each once.
    fn is_grid(&self, keys: &[Key<'_>]) -> bool {
        let all = keys
            .iter()
            .try_fold(1_usize, |n, key| n.checked_mul(key.values.len()));
        let mut places: Vec<Vec<&str>> = Vec::new();
        for point in &self.points {
            places.push(keys.iter().map(|key| point.values[key.index]).collect());
        }
        places.sort();
        let once = places.windows(2).all(|pair| pair[0] != pair[1]);
        once && all.is_some_and(|all| all <= 2 * self.points.len())
    }

    /// The result over a key.
    fn over(&self, key: &Key<'_>, style: Style) -> Chart {
        let place = |point: &SweepPoint<'_>| {
            let x = parsed(point.values[key.index]).unwrap_or(f64::NAN);
            (x, point.result.unwrap_or(f64::NAN))
        };
        let mut all: Vec<(f64, f64)> = self.points.iter().map(place).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut chart = Chart::new(self.result, self.axis(key), Axis::linear(self.result));
        chart.subtitle = self.subject.to_owned();
        chart.series.push(Series::new("", style, all));
        let broken: Vec<_> = self.points.iter().filter(|p| !p.held).map(place).collect();
        if broken.iter().any(|point| point.1.is_finite()) {
            let name = "the scene did not hold";
            chart.series.push(Series::new(name, Style::Points, broken));
        }
        chart
    }

    /// Logarithmic over two decades or more.
    fn axis(&self, key: &Key<'_>) -> Axis {
        let ends = [key.values.first(), key.values.last()];
        let [low, high] = ends.map(|end| end.and_then(|text| parsed(text)).unwrap_or(0.0));
        match low > 0.0 && high / low >= 100.0 {
            true => Axis::log(key.name),
            false => Axis::linear(key.name),
        }
    }

    /// A map over the last two keys for each combination of the others; `None` if it is too large.
    fn map(&self, keys: &[Key<'_>]) -> Option<ValueMap> {
        let (x, rest) = keys.split_last()?;
        let (y, rest) = match rest.split_last() {
            Some((y, rest)) => (Some(y), rest),
            None => (None, rest),
        };
        let rows = y.map_or(1, |y| y.values.len());
        let count: usize = rest.iter().map(|key| key.values.len()).product();
        if count > MOST_MAPS || x.values.len() > MOST_CELLS || rows > MOST_CELLS {
            return None;
        }
        let mut points: HashMap<Vec<&str>, &SweepPoint<'_>> = HashMap::new();
        for point in &self.points {
            points.insert(keys.iter().map(|k| point.values[k.index]).collect(), point);
        }
        let panel = |number: usize| {
            let mut left = number;
            let mut fixed: Vec<(&Key<'_>, &str)> = Vec::new();
            for key in rest.iter().rev() {
                fixed.push((key, key.values[left % key.values.len()]));
                left /= key.values.len();
            }
            fixed.reverse();
            let words = fixed
                .iter()
                .map(|(key, value)| format!("{} = {value}", key.name));
            let cell = |row: usize, column: usize| {
                let mut place: Vec<&str> = fixed.iter().map(|(_, value)| *value).collect();
                place.extend(y.map(|y| y.values[row]));
                place.push(x.values[column]);
                let point = points.get(&place);
                MapCell {
                    value: point.and_then(|point| point.result),
                    doubtful: point.is_some_and(|point| !point.held),
                }
            };
            let cells = |row| {
                (0..x.values.len())
                    .map(|column| cell(row, column))
                    .collect()
            };
            let labels = |key: &Key<'_>| key.values.iter().map(|v| (*v).to_owned()).collect();
            MapPanel {
                heading: words.collect::<Vec<_>>().join(", "),
                columns: labels(x),
                rows: y.map_or(vec![String::new()], labels),
                cells: (0..rows).map(cells).collect(),
            }
        };
        let doubtful = self.points.iter().any(|point| !point.held);
        let empty = self.points.iter().any(|point| point.result.is_none());
        let notes = [
            (
                doubtful,
                "framed: the scene did not hold, or the case ended with an error",
            ),
            (
                empty,
                "–: the case has no such value, as of a limit that is not reached",
            ),
        ];
        let notes = notes.into_iter().filter(|(is, _)| *is);
        Some(ValueMap {
            title: self.result.to_owned(),
            subtitle: self.subject.to_owned(),
            x: x.name.to_owned(),
            y: y.map_or_else(String::new, |y| y.name.to_owned()),
            maps: (0..count).map(panel).collect(),
            notes: notes.map(|(_, note)| note.to_owned()).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(keys: &[&str], points: &[(&[&'static str], f64)]) -> Option<String> {
        let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
        let points = points.iter().map(|(values, result)| SweepPoint {
            values: values.to_vec(),
            result: Some(*result),
            held: *result < 9.0,
        });
        let of = SweepResult {
            result: "life [h]",
            subject: "s",
            keys: &keys,
            points: points.collect(),
        };
        of.picture().unwrap()
    }

    #[test]
    fn one_key_gives_a_line() {
        // 10 after 2, though the text comes before
        let svg = picture(&["a"], &[(&["10"], 3.0), (&["2"], 1.0), (&["5"], 9.5)]).unwrap();
        assert!(
            svg.contains("polyline") && svg.contains("the scene did not hold"),
            "{svg}"
        );
        assert!(
            picture(&["a"], &[(&["1"], 3.0)]).is_none(),
            "nothing varies"
        );
        // words have no place on an axis: one row of cells
        let svg = picture(&["a"], &[(&["fixed"], 3.0), (&["moved"], 1.0)]).unwrap();
        assert!(svg.contains("fixed") && svg.contains("3.000"), "{svg}");
    }

    #[test]
    fn two_keys_give_a_map_and_three_a_map_each() {
        let mut points: Vec<(Vec<&'static str>, f64)> = Vec::new();
        for (k, c) in ["x", "y"].into_iter().enumerate() {
            for (j, b) in ["1", "2"].into_iter().enumerate() {
                for (i, a) in ["10", "20", "30"].into_iter().enumerate() {
                    points.push((vec![c, b, a], (100 * k + 10 * j + i) as f64));
                }
            }
        }
        let all: Vec<(&[&'static str], f64)> = points.iter().map(|(v, r)| (&v[..], *r)).collect();
        let svg = picture(&["c", "b", "a"], &all).unwrap();
        assert!(
            svg.contains("c = x") && svg.contains("c = y") && svg.contains("112.0"),
            "{svg}"
        );
        let half: Vec<(&[&'static str], f64)> = all[..6].to_vec();
        let svg = picture(&["c", "b", "a"], &half).unwrap();
        assert!(!svg.contains("c = x") && svg.contains("12.00"), "{svg}");
        // a case is missing
        assert!(picture(&["c", "b", "a"], &half[1..]).unwrap().contains('–'));
    }

    #[test]
    fn a_sample_gives_points_over_each_key() {
        let points: [(&[&'static str], f64); 4] = [
            (&["0.1", "7"], 1.0),
            (&["0.2", "3"], 2.0),
            (&["0.3", "5"], 3.0),
            (&["0.4", "1"], 4.0),
        ];
        let svg = picture(&["k", "mu"], &points).unwrap();
        assert_eq!(svg.matches("<svg").count(), 3, "two panels in a document");
        assert!(!svg.contains("polyline") || svg.contains("circle"), "{svg}");
    }
}
