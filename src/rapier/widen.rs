use super::engine::math::Real;

/// The `f64` that a person meant by an `f32`: the shortest decimal that rounds to it.
///
/// `widen(0.3_f32)` is `0.3`, not `0.30000001192092896`. Friction, gravity, sizes and masses that
/// a user typed thus lose nothing on their way through rapier.
///
/// With the feature `f64` rapier keeps what was typed, and this gives it back as it is.
pub fn widen(value: Real) -> f64 {
    // integers and dyadic fractions are exact already, and need no printing
    if cfg!(feature = "f64") || !value.is_finite() || (value * 1024.0).fract() == 0.0 {
        return f64::from(value);
    }
    value.to_string().parse().unwrap_or(f64::from(value))
}

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
    }

    #[test]
    fn gives_what_was_typed() {
        assert_eq!(widen(0.3), 0.3);
        assert_eq!(widen(-9.81), -9.81);
        assert_eq!(widen(1e-7), 1e-7);
    }
}
