//! Pseudorandom numbers that depend only on their counter: not on the caller, nor on previous draws.

use std::f64::consts::TAU;

/// Fraction of the golden ratio in 64 bits: the step of SplitMix64.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// Returns the finaliser of SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number
/// generators", 2014).
fn mixed(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// Returns the hash of the previous words and this one.
pub(super) fn mixed_into(hash: u64, word: u64) -> u64 {
    mixed(hash.wrapping_add(GOLDEN) ^ mixed(word.wrapping_add(GOLDEN)))
}

/// Returns a number from 0 to below 1, of 53 bits.
fn unit(counter: &[u64]) -> f64 {
    let bits = counter.iter().fold(0, |hash, word| mixed_into(hash, *word));
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// Returns a number with a uniform distribution between two numbers.
pub(super) fn uniform(counter: [u64; 4], low: f64, high: f64) -> f64 {
    let [seed, copy, variation, element] = counter;
    let part = unit(&[seed, copy, variation, element, 0]);
    low * (1.0 - part) + high * part
}

/// Returns a number with a normal distribution (Box and Muller, 1958).
pub(super) fn normal(counter: [u64; 4], mean: f64, deviation: f64) -> f64 {
    let [seed, copy, variation, element] = counter;
    let [radius, angle] = [1, 2].map(|draw| unit(&[seed, copy, variation, element, draw]));
    mean + deviation * (-2.0 * (1.0 - radius).ln()).sqrt() * (TAU * angle).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(draw: impl Fn([u64; 4]) -> f64) -> Vec<f64> {
        (0..100).flat_map(|copy| (0..100).map(move |element| [7, copy, 0, element])).map(draw).collect()
    }

    /// The mean of 10,000 draws is within five of its standard deviations.
    #[test]
    fn draws_have_the_mean_and_the_deviation_that_they_should() {
        for (draws, mean, deviation) in [
            (all(|counter| uniform(counter, 2.0, 4.0)), 3.0, 2.0 / 12.0f64.sqrt()),
            (all(|counter| normal(counter, -1.0, 0.5)), -1.0, 0.5),
        ] {
            let count = draws.len() as f64;
            let found = draws.iter().sum::<f64>() / count;
            assert!((found - mean).abs() < 5.0 * deviation / count.sqrt(), "{found}");
            let spread = (draws.iter().map(|x| (x - found).powi(2)).sum::<f64>() / count).sqrt();
            assert!((spread / deviation - 1.0).abs() < 0.05, "{spread}");
        }
        assert!(all(|counter| uniform(counter, 2.0, 4.0)).iter().all(|x| (2.0..4.0).contains(x)));
    }

    #[test]
    fn draws_differ_by_seed_copy_variation_and_element_and_by_nothing_else() {
        let one = uniform([1, 2, 3, 4], 0.0, 1.0);
        assert_eq!(one.to_bits(), uniform([1, 2, 3, 4], 0.0, 1.0).to_bits());
        for other in [[0, 2, 3, 4], [1, 0, 3, 4], [1, 2, 0, 4], [1, 2, 3, 0], [2, 1, 3, 4]] {
            assert_ne!(one, uniform(other, 0.0, 1.0));
        }
    }
}
