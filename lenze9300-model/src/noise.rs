//! Counter-based noise: a number that depends on seed, channel and counter alone.
//!
//! A generator with a state would make the noise of one channel depend on how often another was asked, and a run
//! in parallel differ from one in sequence. Here every value can be computed on its own, in any order, and is the
//! same on every machine.

/// 64 random bits for place `counter` of `channel` under `seed`.
///
/// The mixing function is SplitMix64's (Steele, Lea, Flood: *Fast splittable pseudorandom number generators*,
/// OOPSLA 2014), applied to the three numbers one after the other.
///
/// ```
/// use lenze9300_model::noise::bits;
/// assert_eq!(bits(1, 2, 3), bits(1, 2, 3));
/// assert_ne!(bits(1, 2, 3), bits(1, 2, 4));
/// ```
pub fn bits(seed: u64, channel: u64, counter: u64) -> u64 {
    mix(mix(mix(seed) ^ channel) ^ counter)
}

/// A number in −1…1, evenly distributed, 53 bits fine.
pub fn symmetric(seed: u64, channel: u64, counter: u64) -> f64 {
    const STEPS: f64 = (1_u64 << 53) as f64;
    let unit = (bits(seed, channel, counter) >> 11) as f64 / STEPS;
    2.0 * unit - 1.0
}

/// A whole number in 0…`below` − 1; 0 when `below` is 0.
///
/// Taken by multiplication, not by remainder, so that small ranges are even to one part in 2³².
pub fn below(seed: u64, channel: u64, counter: u64, below: u32) -> u32 {
    let high = bits(seed, channel, counter) >> 32;
    ((high * u64::from(below)) >> 32) as u32
}

fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_value_is_that_of_the_published_generator() {
        // SplitMix64 seeded with 0 yields 0xE220A8397B1DCDAF first (reference implementation, S. Vigna).
        assert_eq!(mix(0), 0xE220_A839_7B1D_CDAF);
    }

    #[test]
    fn symmetric_noise_fills_its_range_evenly() {
        let n = 100_000;
        let values: Vec<f64> = (0..n).map(|k| symmetric(7, 1, k)).collect();
        let mean = values.iter().sum::<f64>() / n as f64;
        let variance = values.iter().map(|v| v * v).sum::<f64>() / n as f64;
        assert!(values.iter().all(|v| (-1.0..1.0).contains(v)));
        // Mean 0 with standard error 1/sqrt(3n) = 0.0018; variance of an even distribution over ±1 is 1/3.
        assert!(mean.abs() < 0.01, "mean {mean}");
        assert!((variance - 1.0 / 3.0).abs() < 0.01, "variance {variance}");
    }

    #[test]
    fn whole_numbers_stay_below_their_bound_and_reach_both_ends() {
        let seen: Vec<u32> = (0..2000).map(|k| below(3, 9, k, 21)).collect();
        assert_eq!(seen.iter().min(), Some(&0));
        assert_eq!(seen.iter().max(), Some(&20));
        assert_eq!(below(3, 9, 0, 0), 0);
    }
}
