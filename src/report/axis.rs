/// How values are spaced along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    Linear,
    /// Decimal logarithm; values that are not positive cannot be drawn.
    Log,
}

impl Scale {
    /// Where `value` lies along the axis, before scaling to the picture; `None` where nowhere.
    pub(super) fn place(self, value: f64) -> Option<f64> {
        let placed = match self {
            Scale::Linear => value,
            Scale::Log if value > 0.0 => value.log10(),
            Scale::Log => return None,
        };
        placed.is_finite().then_some(placed)
    }
}

/// An axis: its label, with the unit in brackets, and its scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub label: String,
    pub scale: Scale,
}

impl Axis {
    pub fn linear(label: impl Into<String>) -> Self {
        Axis {
            label: label.into(),
            scale: Scale::Linear,
        }
    }

    pub fn log(label: impl Into<String>) -> Self {
        Axis {
            label: label.into(),
            scale: Scale::Log,
        }
    }
}

/// Ticks at places along the axis (see [`Scale::place`]).
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Ticks {
    pub major: Vec<(f64, String)>,
    pub minor: Vec<f64>,
}

/// Room around the data: 4 % at either end, none below an axis that starts at exactly 0. A log
/// axis has a decade at least, so that round-off does not fill the picture.
///
/// `None` where the range overflows.
pub(super) fn padded(low: f64, high: f64, scale: Scale) -> Option<(f64, f64)> {
    let mut span = high - low;
    // Equal values, or values that differ by round-off alone, get a range of their own size.
    let size = low.abs().max(high.abs());
    // Below 1e-290 powers of ten leave the normal numbers, and nothing measured is that small.
    if span <= 1e-12 * size || span < 1e-290 {
        span = match scale {
            Scale::Linear if size > 1e-290 => size,
            _ => 1.0,
        };
        let middle = low / 2.0 + high / 2.0;
        let range = (middle - span / 2.0, middle + span / 2.0);
        return (range.0.is_finite() && range.1.is_finite()).then_some(range);
    }
    let least = if scale == Scale::Log { 1.0 } else { 0.0 };
    let pad = (0.04 * span).max(0.5 * (least - span));
    let from = if scale == Scale::Linear && low == 0.0 {
        0.0
    } else {
        low - pad
    };
    let to = if scale == Scale::Linear && high == 0.0 {
        0.0
    } else {
        high + pad
    };
    (to - from).is_finite().then_some((from, to))
}

/// Ticks of a range of places, about `wanted` of them labelled.
pub(super) fn ticks(range: (f64, f64), scale: Scale, wanted: usize) -> Ticks {
    match scale {
        Scale::Linear => linear_ticks(range, wanted),
        Scale::Log => log_ticks(range, wanted),
    }
}

/// Multiples of 1, 2 or 5 times a power of ten.
fn linear_ticks((low, high): (f64, f64), wanted: usize) -> Ticks {
    let raw = (high - low) / wanted.max(1) as f64;
    let decade = raw.log10().floor() as i32;
    // The nearest by ratio.
    let (mantissa, exponent) = match raw / 10f64.powi(decade) {
        m if m < 2f64.sqrt() => (1, decade),
        m if m < 10f64.sqrt() => (2, decade),
        m if m < 50f64.sqrt() => (5, decade),
        _ => (1, decade + 1),
    };
    // As an exact integer where possible: 3 × 0.1 is not 0.3.
    let value = |k: f64| {
        let units = k * f64::from(mantissa);
        if exponent < 0 {
            units / 10f64.powi(-exponent)
        } else {
            units * 10f64.powi(exponent)
        }
    };
    let step = value(1.0);
    // Round-off must not lose a tick at the very end.
    let first = (low / step - 1e-6).ceil();
    let count = ((high / step + 1e-6).floor() - first).clamp(0.0, 100.0) as usize;
    let values: Vec<f64> = (0..=count).map(|i| value(first + i as f64)).collect();
    let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let label = |v: f64| {
        if v == 0.0 {
            "0".to_owned()
        } else if !(1e-2..1e5).contains(&largest) {
            let own = v.abs().log10().floor() as i32;
            let decimals = (own - exponent).max(0) as usize;
            power_label(&format!("{v:.decimals$e}"))
        } else {
            let decimals = (-exponent).max(0) as usize;
            minus(&format!("{v:.decimals$}"))
        }
    };
    Ticks {
        major: values.iter().map(|&v| (v, label(v))).collect(),
        minor: Vec::new(),
    }
}

fn log_ticks((low, high): (f64, f64), wanted: usize) -> Ticks {
    let (first, last) = (low.floor() as i32, high.ceil() as i32);
    let inside = |p: &f64| (low - 1e-9..=high + 1e-9).contains(p);
    let at = |m: u8, e: i32| f64::from(m).log10() + f64::from(e);
    let decades: Vec<i32> = (first..=last).filter(|&e| inside(&f64::from(e))).collect();
    let grid = |mantissas: &[u8]| -> Vec<(u8, i32)> {
        (first..=last)
            .flat_map(|e| mantissas.iter().map(move |&m| (m, e)))
            .filter(|&(m, e)| inside(&at(m, e)))
            .collect()
    };
    let plain = low >= -3.0 && high <= 4.0;
    let label = |(m, e): (u8, i32)| {
        if plain {
            let decimals = (-e).max(0) as usize;
            format!("{:.decimals$}", f64::from(m) * 10f64.powi(e))
        } else {
            power_label(&format!("{m}e{e}"))
        }
    };
    let minor =
        |mantissas: &[u8]| -> Vec<f64> { grid(mantissas).iter().map(|&(m, e)| at(m, e)).collect() };
    let all: [u8; 9] = [1, 2, 3, 4, 5, 6, 7, 8, 9];
    if decades.len() > 2 {
        let stride = decades.len().div_ceil(wanted.max(2)) as i32;
        let major = decades
            .iter()
            .filter(|&&e| e.rem_euclid(stride) == 0)
            .map(|&e| (f64::from(e), label((1, e))));
        return Ticks {
            major: major.collect(),
            minor: minor(if stride == 1 { &all[1..] } else { &all[..1] }),
        };
    }
    let labelled = grid(&[1, 2, 5]);
    if labelled.len() > 2 {
        return Ticks {
            major: labelled
                .iter()
                .map(|&(m, e)| (at(m, e), label((m, e))))
                .collect(),
            minor: minor(&all),
        };
    }
    // Less than a decade: the values are nearly evenly spaced, and so are their labels.
    let mut ticks = linear_ticks((10f64.powf(low), 10f64.powf(high)), wanted);
    for (place, _) in &mut ticks.major {
        *place = place.log10();
    }
    ticks.major.retain(|(place, _)| place.is_finite());
    ticks
}

/// `"2e-9"` as 2×10⁻⁹, `"1e3"` as 10³.
fn power_label(scientific: &str) -> String {
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((scientific, "0"));
    let superscript: String = exponent
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            digit => char::from_u32('⁰' as u32 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
        })
        .collect();
    match mantissa {
        "1" => format!("10{superscript}"),
        _ => minus(&format!("{mantissa}×10{superscript}")),
    }
}

/// A typographic minus.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(range: (f64, f64), scale: Scale) -> Vec<String> {
        ticks(range, scale, 6)
            .major
            .into_iter()
            .map(|t| t.1)
            .collect()
    }

    #[test]
    fn linear_labels_are_round_and_carry_only_their_digits() {
        let linear = |a, b| labels((a, b), Scale::Linear).join(" ");
        assert_eq!(linear(0.0, 52.0), "0 10 20 30 40 50");
        assert_eq!(linear(-0.1, 0.5), "−0.1 0 0.1 0.2 0.3 0.4 0.5");
        assert_eq!(
            linear(0.0, 2.6e-9),
            "0 5×10⁻¹⁰ 1.0×10⁻⁹ 1.5×10⁻⁹ 2.0×10⁻⁹ 2.5×10⁻⁹"
        );
        assert_eq!(linear(0.0, 4.4e6), "0 10⁶ 2×10⁶ 3×10⁶ 4×10⁶");
    }

    #[test]
    fn log_labels_follow_the_span() {
        let log = |a: f64, b: f64| labels((a.log10(), b.log10()), Scale::Log).join(" ");
        assert_eq!(log(0.5, 2000.0), "1 10 100 1000");
        assert_eq!(log(1e-12, 1e-8), "10⁻¹² 10⁻¹¹ 10⁻¹⁰ 10⁻⁹ 10⁻⁸");
        assert_eq!(log(1e-16, 1e2), "10⁻¹⁶ 10⁻¹² 10⁻⁸ 10⁻⁴ 10⁰");
        assert_eq!(log(0.9, 30.0), "1 2 5 10 20");
        assert_eq!(log(2.1, 2.4), "2.10 2.15 2.20 2.25 2.30 2.35 2.40");
    }

    #[test]
    fn ranges_are_never_empty_nor_infinite() {
        assert_eq!(padded(3.0, 3.0, Scale::Linear), Some((1.5, 4.5)));
        assert_eq!(padded(0.0, 0.0, Scale::Linear), Some((-0.5, 0.5)));
        assert_eq!(padded(0.0, 100.0, Scale::Linear), Some((0.0, 104.0)));
        assert_eq!(padded(-f64::MAX, f64::MAX, Scale::Linear), None);
        assert_eq!(padded(2.0, 2.5, Scale::Log), Some((1.75, 2.75)));
        assert_eq!(padded(-10.0, 0.0, Scale::Log), Some((-10.4, 0.4)));
        for value in [5e-324, -1e-300, f64::MAX] {
            let range = padded(value, value, Scale::Linear);
            for tick in range
                .map(|r| ticks(r, Scale::Linear, 6))
                .into_iter()
                .flat_map(|t| t.major)
            {
                assert!(tick.0.is_finite(), "{value}");
            }
        }
    }
}
