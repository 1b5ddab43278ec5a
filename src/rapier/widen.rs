use super::engine::math::Real;

/// The `f64` that a person meant by an `f32`: the shortest decimal that rounds to it.
///
/// `widen(0.3_f32)` is `0.3`, not `0.30000001192092896`. Friction, gravity, sizes and masses that a
/// user typed thus lose no digits on their way through rapier.
///
/// With the feature `f64` rapier stores the number as typed, and this returns it unchanged.
pub fn widen(value: Real) -> f64 {
    shortest(value, 9)
}

/// Like [`widen`], for state that is read again and again and hardly ever typed: tries decimals of
/// up to some six digits only.
#[inline]
pub(super) fn widen_state(value: Real) -> f64 {
    shortest(value, 6)
}

/// The shortest decimal of at most `digits` digits, or one more, that rounds to `value`; `value`
/// itself if there is none.
#[inline(always)]
fn shortest(value: Real, digits: i32) -> f64 {
    let wide = f64::from(value);
    // nearly all computed numbers and all unchanged ones return here or below
    if cfg!(feature = "f64") || nearest(wide) == wide {
        return wide;
    }
    let scaled = wide * POWERS[places(wide, digits)];
    let off = scaled - nearest(scaled);
    // no such decimal lies within half a unit of the last place of `value`
    if off.abs() > half_place(wide) * POWERS[places(wide, digits)] {
        return wide;
    }
    typed(value, digits)
}

/// Index of the power in [`POWERS`] that makes `digits` digits of `wide`.
#[inline]
fn places(wide: f64, digits: i32) -> usize {
    let exponent = ((wide.to_bits() >> 52) & 0x7ff) as i32 - 1023;
    // integer part of exponent · log10 2, exact for all exponents
    let leading = (exponent * 1_262_611) >> 22;
    (digits - 2 - leading).clamp(0, POWERS.len() as i32 - 1) as usize
}

/// The nearest integer to a number below 2⁵¹: the last place of the sum is 1. Larger numbers, which
/// in single precision are integers, also give an integer.
#[inline(always)]
fn nearest(x: f64) -> f64 {
    const LAST_PLACE_ONE: f64 = 6_755_399_441_055_744.0;
    (x + LAST_PLACE_ONE) - LAST_PLACE_ONE
}

/// [`shortest`] for a number to which a decimal of `digits` digits may round.
#[cold]
#[inline(never)]
fn typed(value: Real, digits: i32) -> f64 {
    let wide = f64::from(value);
    // whole numbers are exact already, and so are dyadic fractions. Below 8 no other
    // decimal of six digits rounds to them; above, half a unit of the last place is 4.8e-7, and 8 + 3/1024 is 3.1e-7 from 8.00293.
    // A cast instead of `fract`, which is a library call on processors without a rounding instruction
    let whole = |x: f64| x as i64 as f64 == x;
    let dyadic = whole(wide) || wide.abs() < 8.0 && whole(wide * 1024.0);
    if !value.is_finite() || dyadic {
        return wide;
    }
    // numerator and denominator of the quotient are exact
    let decimal = |power: f64| (wide * power + 0.5f64.copysign(wide)) as i64 as f64 / power;
    let meant = |power: &f64| decimal(*power) as Real == value;
    let most = places(wide, digits);
    if !meant(&POWERS[most]) {
        return wide;
    }
    // computed numbers nearly always return here
    let needs_all = most == 0 || !meant(&POWERS[most - 1]);
    let fewest = match needs_all {
        true => most,
        false => POWERS[..most].partition_point(|power| !meant(power)),
    };
    decimal(POWERS[fewest])
}

/// The step length that a person meant \[s\]: `1/n` if it rounds to `dt` for a whole number `n` of
/// steps a second, else [`widen`].
pub(super) fn widen_step(dt: Real) -> f64 {
    let rate = (1.0 / f64::from(dt)).round();
    if rate >= 1.0 && (1.0 / rate) as Real == dt {
        1.0 / rate
    } else {
        widen(dt)
    }
}

/// Half a unit in the last place of a single-precision number, and a little more to cover the
/// rounding of the comparison.
#[allow(clippy::unnecessary_cast)] // widens with the feature `f64`
#[inline(always)]
fn half_place(wide: f64) -> f64 {
    const SIGN_AND_EXPONENT: u64 = 0xfff << 52;
    let power_of_two = f64::from_bits(wide.abs().to_bits() & SIGN_AND_EXPONENT);
    // below the least normal number all numbers have the same last place
    power_of_two.max(Real::MIN_POSITIVE as f64) * (0.500_001 * Real::EPSILON as f64)
}

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

        /// A typed decimal comes back, whatever its size.
        #[test]
        #[cfg(not(feature = "f64"))]
        fn gives_back_up_to_six_digits(digits in -999_999i32..=999_999, scale in -12i32..=0) {
            let typed: f64 = format!("{digits}e{scale}").parse().unwrap();
            prop_assert_eq!(widen(typed as f32), typed);
            prop_assert_eq!(widen_state(typed as f32), typed);
        }
    }

    /// A decimal of six digits whose `f32` is a dyadic fraction comes back too: the 128 such numbers lie
    /// between 8 and 10.
    #[test]
    #[cfg(not(feature = "f64"))]
    fn gives_back_decimals_next_to_dyadic_fractions() {
        for digits in 100_000..=999_999 {
            let typed: f64 = format!("{digits}e-5").parse().unwrap();
            assert_eq!(widen(typed as f32), typed);
            assert_eq!(widen_state(typed as f32), typed);
        }
    }

    #[test]
    fn as_many_digits_as_asked_for() {
        for exponent in -150..=127 {
            let wide = 1.5 * 2f64.powi(exponent);
            let leading = (f64::from(exponent) * std::f64::consts::LOG10_2).floor();
            let power = 10f64.powi((5.0 - leading).clamp(1.0, 22.0) as i32);
            assert_eq!(POWERS[places(wide, 6)], power, "2^{exponent}");
        }
    }

    /// The quick test never misses a decimal: neither at the ends of a binade, nor for subnormal
    /// numbers.
    #[test]
    #[cfg(not(feature = "f64"))]
    fn half_a_place_is_that_of_the_number() {
        let mut value = f32::from_bits(1);
        while value < 1e30 {
            for x in [value, f32::from_bits(value.to_bits() + 1)] {
                let above = f64::from(f32::from_bits(x.to_bits() + 1));
                let half = 0.5 * (above - f64::from(x));
                assert!(half_place(f64::from(x)) >= half, "{x:e}");
                assert!(half_place(f64::from(x)) < 1.00001 * half, "{x:e}");
            }
            value *= 2.0;
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
