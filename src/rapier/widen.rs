use super::engine::math::Real;
use std::f64::consts::LOG10_2;

/// The `f64` that a person meant by an `f32`: the shortest decimal that rounds to it.
///
/// `widen(0.3_f32)` is `0.3`, not `0.30000001192092896`. Friction, gravity, sizes and masses that
/// a user typed thus lose nothing on their way through rapier.
///
/// With the feature `f64` rapier keeps what was typed, and this gives it back as it is.
pub fn widen(value: Real) -> f64 {
    shortest(value, 9)
}

/// The same of a number that is read again and again, and hardly ever typed: decimals of more than
/// some six digits are not looked for.
pub(super) fn widen_state(value: Real) -> f64 {
    shortest(value, 6)
}

/// The shortest decimal of at most `digits` digits, or one more, that rounds to `value`; what has
/// none as it is.
fn shortest(value: Real, digits: i32) -> f64 {
    let wide = f64::from(value);
    // integers and dyadic fractions are exact already, and have no shorter decimal;
    // not `fract`, which is a call where the processor is not known to have it
    let whole = |x: f64| x as i64 as f64 == x;
    let dyadic = whole(wide) || wide.abs() < 16.0 && whole(wide * 1024.0);
    if cfg!(feature = "f64") || !value.is_finite() || dyadic {
        return wide;
    }
    // of both numbers of the quotient nothing is lost
    let decimal = |power: f64| (wide * power + 0.5f64.copysign(wide)) as i64 as f64 / power;
    let meant = |power: &f64| decimal(*power) as Real == value;
    // decimals that make that many digits
    let exponent = ((wide.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    let leading = (f64::from(exponent) * LOG10_2).floor() as i32;
    let most = (digits - 1 - leading).clamp(1, 22) as usize;
    let power = POWERS[most - 1];
    // nearly all numbers that nobody typed: no decimal lies within half a unit of their last place
    let scaled = wide * power;
    let off = scaled - (scaled + 0.5f64.copysign(wide)) as i64 as f64;
    if off.abs() > scaled.abs() * HALF_PLACE || !meant(&power) {
        return wide;
    }
    let fewest = POWERS[..most].partition_point(|power| !meant(power));
    decimal(POWERS[fewest])
}

/// The step length that a person meant \[s\]: `1/n` for a whole number `n` of steps a second that
/// rounds to it, else [`widen`].
pub(super) fn widen_step(dt: Real) -> f64 {
    let rate = (1.0 / f64::from(dt)).round();
    if rate >= 1.0 && (1.0 / rate) as Real == dt {
        1.0 / rate
    } else {
        widen(dt)
    }
}

/// Half a unit in the last place over the number, at most, and a little for the rounding here.
#[allow(clippy::unnecessary_cast)] // widens with the feature `f64`
const HALF_PLACE: f64 = 0.500_001 * Real::EPSILON as f64;

/// 10¹ to 10²², all exact.
const POWERS: [f64; 22] = [
    1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17,
    1e18, 1e19, 1e20, 1e21, 1e22,
];

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rounds_back_to_the_same(bits in any::<u32>()) {
            #[allow(clippy::unnecessary_cast)] // widens with the feature `f64`
            let value = f32::from_bits(bits) as Real;
            prop_assume!(value.is_finite());
            prop_assert_eq!(widen(value) as Real, value);
        }

        /// What a user types comes back, whatever its size.
        #[test]
        #[cfg(not(feature = "f64"))]
        fn gives_back_up_to_six_digits(digits in -999_999i32..=999_999, scale in -12i32..=0) {
            let typed: f64 = format!("{digits}e{scale}").parse().unwrap();
            prop_assert_eq!(widen(typed as f32), typed);
            prop_assert_eq!(widen_state(typed as f32), typed);
        }
    }

    #[test]
    fn a_step_of_a_sixtieth_is_one() {
        for rate in [1.0, 24.0, 30.0, 60.0, 120.0, 144.0, 1000.0] {
            assert_eq!(widen_step((1.0 / rate) as Real), 1.0 / rate);
        }
        assert_eq!(widen_step(0.016), 0.016);
        assert_eq!(widen_step(0.3), 0.3);
    }

    #[test]
    fn gives_what_was_typed() {
        assert_eq!(widen(0.3), 0.3);
        assert_eq!(widen(-9.81), -9.81);
        assert_eq!(widen(1e-7), 1e-7);
    }
}
