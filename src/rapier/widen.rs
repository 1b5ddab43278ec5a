use super::engine::math::Real;

/// The `f64` that a person meant by an `f32`: the shortest decimal that rounds to it.
///
/// `widen(0.3_f32)` is `0.3`, not `0.30000001192092896`. Friction, gravity, sizes and masses that
/// a user typed thus lose nothing on their way through rapier.
///
/// With the feature `f64` rapier keeps what was typed, and this gives it back as it is.
pub fn widen(value: Real) -> f64 {
    // integers and dyadic fractions are exact already, and have no shorter decimal
    if cfg!(feature = "f64") || !value.is_finite() || (value * 1024.0).fract() == 0.0 {
        return f64::from(value);
    }
    // the fewest decimals that give it back; both numbers of the quotient are exact
    let wide = f64::from(value);
    for power in POWERS {
        let digits = (wide * power).round();
        let decimal = digits / power;
        if decimal as Real == value {
            return decimal;
        }
        if digits.abs() > 1e15 {
            break;
        }
    }
    value.to_string().parse().unwrap_or(wide)
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

        /// The shortest decimal is the one that the standard library prints.
        #[test]
        #[cfg(not(feature = "f64"))]
        fn is_the_decimal_that_is_printed(value in -1.0e6f32..1.0e6, scale in -12i32..6) {
            let value = value * 10f32.powi(scale);
            prop_assume!((value * 1024.0).fract() != 0.0);
            prop_assert_eq!(widen(value), value.to_string().parse::<f64>().unwrap());
        }
    }

    #[test]
    fn gives_what_was_typed() {
        assert_eq!(widen(0.3), 0.3);
        assert_eq!(widen(-9.81), -9.81);
        assert_eq!(widen(1e-7), 1e-7);
    }
}
