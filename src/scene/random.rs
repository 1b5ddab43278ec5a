//! Random numbers that depend on a seed alone.

/// Steele, Lea & Flood (2014): a 64-bit counter through a mixing function.
pub(crate) struct SplitMix64(pub u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Evenly over [-1, 1), from the upper 53 bits.
    pub fn symmetric(&mut self) -> f64 {
        (self.next() >> 11) as f64 * 2.0_f64.powi(-52) - 1.0
    }

    /// Evenly over (0, 1), the ends left out, from the upper 52 bits.
    pub fn unit(&mut self) -> f64 {
        ((self.next() >> 12) as f64 + 0.5) * 2.0_f64.powi(-52)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn split_mix_gives_the_published_sequence() {
        // First numbers from seed 1234567, as in the reference implementation's test vector.
        let mut random = SplitMix64(1_234_567);
        assert_eq!(random.next(), 6_457_827_717_110_365_317);
        assert_eq!(random.next(), 3_203_168_211_198_807_973);
    }
}
