//! Random numbers as a function of a counter, so that a reading does not depend on previous draws.
//!
//! Philox4x32 with ten rounds: Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3",
//! SC 2011. The finalizer of splitmix64 mixes the keys: Steele, Lea and Flood, "Fast splittable pseudorandom
//! number generators", OOPSLA 2014.

/// Purpose of a number: the last word of the counter.
#[derive(Clone, Copy, Debug)]
pub(super) enum Purpose {
    /// A sample.
    Sample = 0,
    /// Bias of a channel, which is drawn once.
    Bias = 1,
    /// Increment of a random walk.
    Walk = 2,
    /// Whether a sample is lost.
    Loss = 3,
}

/// Random numbers of one sensor, which are equal for equal seeds and names.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stream(pub(super) u64);

impl Stream {
    /// Returns four words for a sample and a channel or ray.
    fn words(self, sample: u64, channel: u32, purpose: Purpose) -> [u32; 4] {
        let [low, high] = halves(sample);
        philox([low, high, channel, purpose as u32], halves(self.0))
    }

    /// Returns a uniformly distributed number from 0 to below 1.
    pub(super) fn uniform(self, sample: u64, channel: u32, purpose: Purpose) -> f64 {
        let [a, b, ..] = self.words(sample, channel, purpose);
        unit(a, b)
    }

    /// Returns a number with a normal distribution about 0 with a standard deviation of 1. Source: Box and
    /// Muller, "A note on the generation of random normal deviates", 1958.
    pub(super) fn normal(self, sample: u64, channel: u32, purpose: Purpose) -> f64 {
        let [a, b, c, d] = self.words(sample, channel, purpose);
        // 1 - u is above 0, so that its logarithm is finite.
        let radius = (-2.0 * (1.0 - unit(a, b)).ln()).sqrt();
        radius * (std::f64::consts::TAU * unit(c, d)).cos()
    }
}

/// Returns the stream of a sensor.
pub(super) fn stream(seed: u64, robot: &str, sensor: &str) -> Stream {
    let mut state = mixed(seed);
    for name in [robot, sensor] {
        // The length distinguishes "ab" and "c" from "a" and "bc".
        state = mixed(state ^ name.len() as u64);
        for byte in name.bytes() {
            state = mixed(state ^ u64::from(byte));
        }
    }
    Stream(state)
}

/// Returns the finalizer of splitmix64, after its increment.
fn mixed(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// Returns the lower and the upper 32 bits.
fn halves(value: u64) -> [u32; 2] {
    [value as u32, (value >> 32) as u32]
}

/// Returns a number from 0 to below 1, in steps of 2^-53.
fn unit(low: u32, high: u32) -> f64 {
    let bits = (u64::from(high) << 32 | u64::from(low)) >> 11;
    bits as f64 * (1.0 / (1u64 << 53) as f64)
}

fn philox(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for round in 0..10 {
        if round > 0 {
            key = [key[0].wrapping_add(0x9e37_79b9), key[1].wrapping_add(0xbb67_ae85)];
        }
        let [low_0, high_0] = halves(u64::from(counter[0]) * 0xd251_1f53);
        let [low_1, high_1] = halves(u64::from(counter[2]) * 0xcd9e_8d57);
        counter = [high_1 ^ counter[1] ^ key[0], low_1, high_0 ^ counter[3] ^ key[1], low_0];
    }
    counter
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `kat_vectors` of Random123, the authors' library.
    #[test]
    fn philox_gives_what_its_authors_publish() {
        let all = u32::MAX;
        assert_eq!(philox([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(philox([all; 4], [all; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
        assert_eq!(
            philox([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    /// For a million draws of a normal distribution, the mean has a standard deviation of 0.001, and the
    /// variance one of 0.0014.
    #[test]
    fn normal_numbers_have_the_mean_the_variance_and_the_tails_of_a_normal_distribution() {
        let stream = stream(7, "arm", "imu");
        let count = 1_000_000;
        let (mut sum, mut squares, mut beyond_two) = (0.0, 0.0, 0);
        for sample in 0..count {
            let value = stream.normal(sample, 0, Purpose::Sample);
            sum += value;
            squares += value * value;
            beyond_two += u32::from(value.abs() > 2.0);
        }
        let count = count as f64;
        assert!((sum / count).abs() < 0.005, "mean {}", sum / count);
        assert!((squares / count - 1.0).abs() < 0.007, "variance {}", squares / count);
        // 4.550 % lie beyond two standard deviations.
        assert!((f64::from(beyond_two) / count - 0.045_50).abs() < 0.001, "{beyond_two}");
    }

    #[test]
    fn two_sensors_with_one_seed_have_different_numbers() {
        let numbers = |robot: &str, sensor: &str| stream(1, robot, sensor).uniform(1, 0, Purpose::Sample);
        assert_ne!(numbers("a", "bc"), numbers("ab", "c"));
        assert_ne!(numbers("a", "b"), numbers("a", "c"));
        assert_eq!(numbers("a", "b"), numbers("a", "b"));
    }
}
