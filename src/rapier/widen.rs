/// The `f64` that a person meant by an `f32`: the shortest decimal that rounds to it.
///
/// `widen(0.3_f32)` is `0.3`, not `0.30000001192092896`. Friction, gravity, sizes and masses that
/// a user typed thus lose nothing on their way through rapier.
pub fn widen(value: f32) -> f64 {
    // integers and dyadic fractions are exact already, and need no printing
    if !value.is_finite() || (value * 1024.0).fract() == 0.0 {
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
        fn rounds_back_to_the_same_f32(bits in any::<u32>()) {
            let value = f32::from_bits(bits);
            prop_assume!(value.is_finite());
            prop_assert_eq!(widen(value) as f32, value);
        }
    }

    #[test]
    fn gives_what_was_typed() {
        assert_eq!(widen(0.3), 0.3);
        assert_eq!(widen(-9.81), -9.81);
        assert_eq!(widen(1e-7), 1e-7);
    }
}
