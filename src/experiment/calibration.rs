//! The wear coefficient from measured wear, with an interval.
//!
//! Time enters Archard's law only as `K t`: a scene wears with `x K` in the time `t` as it does with `K` in
//! `x t`. One run at `K` therefore gives what is measured for every other coefficient. With `f_i(t)` what the
//! run gives for the datum `y_i`, measured after `t_i` with an error of standard deviation σ,
//!
//! ```text
//! S(x) = Σ (y_i - f_i(x t_i))²,    x̂ = argmin S                                     (1)
//! S(x) ≤ S(x̂) + q² σ²                                                              (2)
//! ```
//!
//! (2) is the interval of a level: q is the quantile of the normal distribution where σ is given, of Student's
//! with n - 1 degrees of freedom where it is taken from the scatter, `σ² = S(x̂) / (n - 1)`. For repeated
//! measurements of one number (2) is the textbook's interval of the mean, as f carries it to x. The errors are
//! taken as independent, of the same size and normal. Between the points of the run f is linear, and (1) and
//! (2) are solved exactly.
//!
//! # Source
//! Seber & Wild, Nonlinear Regression (1989), ch. 5; the interval is that of the likelihood ratio.

/// One run of a scene, as seen by data.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Time of each point of the run \[h\], rising from 0.
    pub hours: Vec<f64>,
    /// For each point what the run gives for each datum.
    pub found: Vec<Vec<f64>>,
}

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    pub values: Vec<f64>,
    /// After how long each \[h\].
    pub hours: Vec<f64>,
    /// Standard deviation of each value, in its unit; `None` takes it from the scatter.
    pub deviation: Option<f64>,
    /// Level of the interval, within 0 and 1.
    pub level: f64,
}

/// The coefficient that fits the data, over that of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// `x̂`.
    pub ratio: f64,
    /// Ends of (2): 0 where no wear at all fits as well, `None` where the run ends before.
    pub low: f64,
    pub high: Option<f64>,
    /// σ, given or from the scatter.
    pub deviation: f64,
    /// n - 1.
    pub freedom: usize,
    /// Standard deviation of the residuals.
    pub scatter: f64,
    /// For each datum what the run gives with `x̂`, and its derivative by `ln x`.
    pub fitted: Vec<f64>,
    pub slope: Vec<f64>,
}

/// Why there is no fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    #[error("no measurement")]
    Empty,
    /// Another number of values than of times, or of columns of the run; times that do not rise.
    #[error("the data and the run do not belong together")]
    Shape,
    #[error("a value that is not finite")]
    NonFinite,
    #[error("one measurement has no scatter: give its uncertainty")]
    NoScatter,
    #[error("measurements without scatter leave no interval: give their uncertainty")]
    Equal,
    /// The least sum of squares is at the end of the run.
    #[error("the run ends before it wears as much as was measured")]
    Beyond,
    /// The least sum of squares is at no wear.
    #[error("no wear at all fits the measurements best")]
    NoWear,
}

impl Course {
    /// What the run gives for datum `i` after `hours`, within the run.
    fn at(&self, i: usize, hours: f64) -> f64 {
        let k = self.hours.partition_point(|h| *h < hours);
        let k = k.clamp(1, self.hours.len() - 1);
        let (a, b) = (self.hours[k - 1], self.hours[k]);
        let share = ((hours - a) / (b - a)).clamp(0.0, 1.0);
        self.found[k - 1][i] + share * (self.found[k][i] - self.found[k - 1][i])
    }

    /// What the run gives for all data with `ratio` times its coefficient.
    pub fn all(&self, measured: &Measured, ratio: f64) -> Vec<f64> {
        let hours = measured.hours.iter().enumerate();
        hours.map(|(i, h)| self.at(i, ratio * h)).collect()
    }

    /// Ratios between which every `f_i` is linear, from 0 to the end of the run.
    fn breaks(&self, measured: &Measured) -> Vec<f64> {
        let longest = measured.hours.iter().copied().fold(0.0, f64::max);
        let end = self.hours[self.hours.len() - 1] / longest;
        let mut times = measured.hours.clone();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let mut all: Vec<f64> = (times.iter())
            .flat_map(|t| self.hours.iter().map(move |h| h / t))
            .filter(|ratio| *ratio < end)
            .collect();
        all.push(end);
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// Fits the coefficient: equations (1) and (2).
    ///
    /// # Errors
    /// [`CalibrationError`].
    pub fn fit(&self, measured: &Measured) -> Result<Fit, CalibrationError> {
        self.check(measured)?;
        let n = measured.values.len();
        let breaks = self.breaks(measured);
        let residuals = |ratio: f64| -> Vec<f64> {
            let found = self.all(measured, ratio);
            let pairs = found.iter().zip(&measured.values);
            pairs.map(|(f, y)| f - y).collect()
        };
        let pieces: Vec<Piece> = (breaks.windows(2))
            .map(|ends| Piece::new([ends[0], ends[1]], &residuals(ends[0]), &residuals(ends[1])))
            .collect();
        let best = pieces.iter().map(Piece::least);
        let best = best.min_by(|a, b| a.1.total_cmp(&b.1));
        let (ratio, least) = best.ok_or(CalibrationError::Shape)?;
        if ratio >= breaks[breaks.len() - 1] {
            return Err(CalibrationError::Beyond);
        }
        if ratio <= 0.0 {
            return Err(CalibrationError::NoWear);
        }
        let scatter = match n {
            1 => 0.0,
            n => (least / (n - 1) as f64).sqrt(),
        };
        let (deviation, quantile) = match measured.deviation {
            Some(given) => (given, normal_quantile(measured.level)),
            None if n == 1 => return Err(CalibrationError::NoScatter),
            None if scatter == 0.0 => return Err(CalibrationError::Equal),
            None => (scatter, student_quantile(measured.level, n - 1)),
        };
        let most = least + (quantile * deviation).powi(2);
        let within: Vec<[f64; 2]> = pieces.iter().filter_map(|p| p.below(most)).collect();
        let low = within.iter().map(|w| w[0]).fold(ratio, f64::min);
        let high = within.iter().map(|w| w[1]).fold(ratio, f64::max);
        let step = 1e-4;
        let ends = [ratio * (1.0 - step), ratio * (1.0 + step)].map(|x| self.all(measured, x));
        Ok(Fit {
            ratio,
            low,
            high: (high < breaks[breaks.len() - 1]).then_some(high),
            deviation,
            freedom: n - 1,
            scatter,
            fitted: self.all(measured, ratio),
            slope: (ends[0].iter().zip(&ends[1]))
                .map(|(a, b)| (b - a) / (2.0 * step))
                .collect(),
        })
    }

    fn check(&self, measured: &Measured) -> Result<(), CalibrationError> {
        let n = measured.values.len();
        if n == 0 {
            return Err(CalibrationError::Empty);
        }
        let rising = self.hours.windows(2).all(|pair| pair[1] > pair[0]);
        let columns = self.found.iter().all(|row| row.len() == n);
        let fits = measured.hours.len() == n && self.found.len() == self.hours.len() && columns;
        if !fits || !rising || self.hours.len() < 2 || self.hours[0] != 0.0 {
            return Err(CalibrationError::Shape);
        }
        let numbers = self.found.iter().flatten().chain(&measured.values);
        let positive = measured.hours.iter().chain(&measured.deviation);
        let level = measured.level > 0.0 && measured.level < 1.0;
        let finite = numbers.into_iter().all(|x| x.is_finite());
        match finite && level && positive.into_iter().all(|x| *x > 0.0 && x.is_finite()) {
            true => Ok(()),
            false => Err(CalibrationError::NonFinite),
        }
    }
}

/// A range of ratios on which `S = a t² + 2 b t + c`, with t from 0 to 1.
struct Piece {
    ends: [f64; 2],
    a: f64,
    b: f64,
    c: f64,
}

impl Piece {
    fn new(ends: [f64; 2], first: &[f64], last: &[f64]) -> Piece {
        let (mut a, mut b, mut c) = (0.0, 0.0, 0.0);
        for (r, s) in first.iter().zip(last) {
            let d = s - r;
            a += d * d;
            b += r * d;
            c += r * r;
        }
        Piece { ends, a, b, c }
    }

    fn ratio(&self, t: f64) -> f64 {
        match t {
            // exact at the ends
            t if t <= 0.0 => self.ends[0],
            t if t >= 1.0 => self.ends[1],
            t => self.ends[0] + t * (self.ends[1] - self.ends[0]),
        }
    }

    /// The ratio of least S, and S.
    fn least(&self) -> (f64, f64) {
        let t = match self.a > 0.0 {
            true => (-self.b / self.a).clamp(0.0, 1.0),
            false => 0.0,
        };
        (self.ratio(t), (self.a * t + 2.0 * self.b) * t + self.c)
    }

    /// The ratios with S of at most `most`.
    fn below(&self, most: f64) -> Option<[f64; 2]> {
        if self.a <= 0.0 {
            return (self.c <= most).then_some(self.ends);
        }
        let middle = -self.b / self.a;
        let root = middle * middle - (self.c - most) / self.a;
        if root < 0.0 {
            return None;
        }
        let (from, to) = (middle - root.sqrt(), middle + root.sqrt());
        (from <= 1.0 && to >= 0.0).then(|| [self.ratio(from), self.ratio(to)])
    }
}

/// How a second parameter p compares with K in the same data.
///
/// With `s_K` and `s_p` the derivatives of what is measured by `ln K` and `ln p`, and `c` the cosine of their
/// angle, the standard deviation of ln K is `σ / |s_K|` where p is known, and `1 / √(1 - c²)` times as much
/// where it is found from the same data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Second {
    /// `c²`.
    pub alike: f64,
    /// Change of K per change of p, in per cent each, that leaves the fit where it is.
    pub trade: f64,
    /// Standard deviation of ln K with p known, and with p found from the same data.
    pub alone: f64,
    pub both: f64,
}

/// Standard deviation of ln K from which on a parameter cannot be told from K: a factor of two either way, at
/// two standard deviations, is 0.35.
const TOLD: f64 = 0.35;
/// `c²` above which the difference of two directions is round-off of the runs.
const PARALLEL: f64 = 0.999;

impl Second {
    /// # Arguments
    /// - `slope`: derivative of what is measured by `ln p`, for each datum of `fit`.
    pub fn new(fit: &Fit, slope: &[f64]) -> Second {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let (kk, pp) = (dot(&fit.slope, &fit.slope), dot(slope, slope));
        let kp = dot(&fit.slope, slope);
        let alike = match pp > 0.0 && kk > 0.0 {
            true => (kp * kp / (kk * pp)).min(1.0),
            false => 0.0,
        };
        let alone = fit.deviation / kk.sqrt();
        Second {
            alike,
            trade: -kp / kk,
            alone,
            both: alone / (1.0 - alike).sqrt(),
        }
    }

    /// Whether the data tell p and K apart.
    pub fn told(&self) -> bool {
        self.alike < PARALLEL && self.both < TOLD
    }
}

/// Parts of Simpson's rule.
const PARTS: usize = 4000;

/// q with `∫₀^q density = level ∫₀^end density`, by Simpson's rule.
fn quantile(level: f64, end: f64, density: impl Fn(f64) -> f64) -> f64 {
    let width = end / PARTS as f64;
    let mut sums = vec![0.0];
    let mut sum = 0.0;
    for k in 0..PARTS {
        let at = |part: f64| density(width * (k as f64 + part));
        sum += (at(0.0) + 4.0 * at(0.5) + at(1.0)) * width / 6.0;
        sums.push(sum);
    }
    let wanted = level * sum;
    let k = sums.partition_point(|s| *s < wanted).clamp(1, PARTS);
    let share = (wanted - sums[k - 1]) / (sums[k] - sums[k - 1]);
    width * (k as f64 - 1.0 + share)
}

/// q such that a standard normal number lies within ±q with the probability `level`.
pub fn normal_quantile(level: f64) -> f64 {
    // beyond 9 lies 1e-19
    quantile(level, 9.0, |x| (-0.5 * x * x).exp())
}

/// q such that a number of Student's distribution lies within ±q with the probability `level`.
///
/// With `t = √ν tan θ` the density is proportional to `cos^(ν-1) θ`.
pub fn student_quantile(level: f64, freedom: usize) -> f64 {
    let power = freedom as f64 - 1.0;
    let end = match power > 0.0 {
        // cos^power is 1e-18 there
        true => (-41.0 / power).exp().acos(),
        false => std::f64::consts::FRAC_PI_2,
    };
    let angle = quantile(level, end, |angle| angle.cos().powf(power));
    (freedom as f64).sqrt() * angle.tan()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight course: wear in proportion to the time, seen by n data.
    fn straight(n: usize) -> Course {
        Course {
            hours: vec![0.0, 10.0, 40.0, 100.0],
            found: [0.0, 10.0, 40.0, 100.0].map(|f| vec![f; n]).into(),
        }
    }

    fn measured(values: &[f64], deviation: Option<f64>) -> Measured {
        Measured {
            values: values.to_vec(),
            hours: vec![20.0; values.len()],
            deviation,
            level: 0.95,
        }
    }

    /// Tables of any textbook.
    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (level, q) in [(0.95, 1.959_964), (0.68, 0.994_458), (0.99, 2.575_829)] {
            assert!((normal_quantile(level) - q).abs() < 1e-5, "{level}");
        }
        for (freedom, q) in [
            (1, 12.706_2),
            (2, 4.302_65),
            (4, 2.776_45),
            (30, 2.042_27),
            (1_000_000, 1.959_966),
        ] {
            let found = student_quantile(0.95, freedom);
            assert!((found / q - 1.0).abs() < 1e-5, "{freedom}: {found}");
        }
    }

    /// Of repeated measurements of one number the interval is that of their mean.
    #[test]
    fn repeated_measurements_give_the_interval_of_their_mean() {
        let values = [24.0, 27.0, 25.5, 29.0, 26.5];
        let fit = straight(5).fit(&measured(&values, None)).unwrap();
        let mean = values.iter().sum::<f64>() / 5.0;
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let deviation = (squares / 4.0).sqrt();
        let half = 2.776_445 * deviation / 5f64.sqrt();
        // 20 hours, one unit an hour
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
        close(fit.ratio, mean / 20.0);
        close(fit.low, (mean - half) / 20.0);
        close(fit.high.unwrap(), (mean + half) / 20.0);
        close(fit.deviation, deviation);
        let given = straight(5).fit(&measured(&values, Some(3.0))).unwrap();
        let half = 1.959_964 * 3.0 / 5f64.sqrt();
        close(given.low, (mean - half) / 20.0);
        close(given.high.unwrap(), (mean + half) / 20.0);
    }

    #[test]
    fn what_leaves_no_fit_is_an_error_that_says_so() {
        let fit =
            |values: &[f64], deviation| straight(values.len()).fit(&measured(values, deviation));
        assert_eq!(fit(&[], None), Err(CalibrationError::Empty));
        assert_eq!(fit(&[5.0], None), Err(CalibrationError::NoScatter));
        assert_eq!(fit(&[5.0, 5.0], None), Err(CalibrationError::Equal));
        assert_eq!(
            fit(&[f64::NAN], Some(1.0)),
            Err(CalibrationError::NonFinite)
        );
        assert_eq!(fit(&[200.0], Some(1.0)), Err(CalibrationError::Beyond));
        assert_eq!(fit(&[-5.0], Some(1.0)), Err(CalibrationError::NoWear));
        let other = straight(2).fit(&measured(&[5.0], Some(1.0)));
        assert_eq!(other, Err(CalibrationError::Shape));
        // an interval that begins at no wear, and one that the run does not close
        assert_eq!(fit(&[5.0], Some(4.0)).unwrap().low, 0.0);
        assert_eq!(fit(&[95.0], Some(4.0)).unwrap().high, None);
    }

    /// Repeated numbers cannot tell two parameters apart, a shape can.
    #[test]
    fn a_parameter_that_acts_as_the_coefficient_is_not_told_from_it() {
        let fit = straight(3)
            .fit(&measured(&[19.0, 20.0, 21.0], None))
            .unwrap();
        let same = Second::new(&fit, &[-10.0; 3]);
        assert!(!same.told() && same.both.is_infinite());
        // half the effect, the other way round: 1 % more of it asks for 0.5 % more of K
        assert!((same.trade - 0.5).abs() < 1e-6, "{same:?}");
        let other = Second::new(&fit, &[10.0, -10.0, 0.0]);
        assert!(other.told() && other.alike < 1e-20, "{other:?}");
    }
}
