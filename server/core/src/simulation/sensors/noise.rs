//! Noise of a sample's true values.

use glamx::{DQuat, DVec3};
use simd_model::sensor::{Channels, MAX_CHANNELS, Noise, SensorKind};

use super::definition::SensorDefinition;
use super::generator::{Purpose, Stream};
use super::state::DueSample;

/// Noise of one sample. It depends only on the sensor's seed and names, the sample's number, and the random
/// walk.
#[derive(Debug)]
pub struct SampleNoise<'a> {
    definition: &'a SensorDefinition,
    stream: Stream,
    sample: u64,
    walk: &'a [f64; MAX_CHANNELS],
}

/// Noise of rays: all of them share bias and walk.
#[derive(Clone, Copy, Debug)]
pub struct RayNoise {
    stream: Stream,
    sample: u64,
    noise: Option<Noise>,
    /// Bias plus walk.
    offset: f64,
}

impl<'a> SampleNoise<'a> {
    /// Returns the noise of a sample.
    pub fn new(due: &'a DueSample) -> Self {
        let DueSample { definition, stream, sample, walk, .. } = due;
        Self { definition, stream: Stream(*stream), sample: *sample, walk }
    }

    /// Returns whether the whole sample is lost: the largest of several dropouts counts. Rays are lost
    /// independently.
    pub fn is_lost(&self) -> bool {
        if matches!(self.definition.kind, SensorKind::Range(_) | SensorKind::Lidar(_)) {
            return false;
        }
        let of_channel =
            |(_, of, axis)| self.definition.noise_of(of, axis).map_or(0.0, |noise| noise.dropout);
        let dropout = channels(&self.definition.kind).map(of_channel).fold(0.0, f64::max);
        dropout > 0.0 && self.stream.uniform(self.sample, 0, Purpose::Loss) < dropout
    }

    /// Adds noise to a quantity of three numbers.
    pub fn vector(&self, of: Channels, value: DVec3) -> DVec3 {
        let [x, y, z] = value.to_array();
        DVec3::new(self.number(of, 0, x), self.number(of, 1, y), self.number(of, 2, z))
    }

    /// Adds noise to a quantity of one number.
    pub fn scalar(&self, of: Channels, value: f64) -> f64 {
        self.number(of, 0, value)
    }

    /// Returns an orientation, rotated about the sensor's axes by the noise of a small turn.
    pub fn orientation(&self, value: DQuat) -> DQuat {
        let turn = self.vector(Channels::Orientation, DVec3::ZERO);
        if turn == DVec3::ZERO { value } else { (value * DQuat::from_scaled_axis(turn)).normalize() }
    }

    /// Returns the noise of rays.
    pub fn rays(&self) -> RayNoise {
        let noise = self.definition.noise_of(Channels::Range, 0).copied();
        let offset = noise.map_or(0.0, |noise| bias(self.stream, 0, &noise) + self.walk[0]);
        RayNoise { stream: self.stream, sample: self.sample, noise, offset }
    }

    fn number(&self, of: Channels, axis: u8, value: f64) -> f64 {
        let Some(noise) = self.definition.noise_of(of, axis) else { return value };
        let Some((channel, ..)) = channels(&self.definition.kind).find(|(_, o, a)| (*o, *a) == (of, axis))
        else {
            return value;
        };
        let walk = self.walk.get(channel as usize).copied().unwrap_or_default();
        let normal = normal(self.stream, self.sample, channel, noise);
        quantised(value + bias(self.stream, channel, noise) + walk + normal, noise.quantum)
    }
}

impl RayNoise {
    /// Returns the range of a ray, metres; `None` if it is lost.
    pub fn of(&self, ray: u32, range: f64) -> Option<f64> {
        let Some(noise) = &self.noise else { return Some(range) };
        if noise.dropout > 0.0 && self.stream.uniform(self.sample, ray, Purpose::Loss) < noise.dropout {
            return None;
        }
        let normal = normal(self.stream, self.sample, ray, noise);
        Some(quantised(range + self.offset + normal, noise.quantum))
    }
}

impl SensorDefinition {
    /// Returns the noise of a part of a quantity: the last entry that names it.
    fn noise_of(&self, of: Channels, axis: u8) -> Option<&Noise> {
        let names = |noise: &&simd_model::sensor::ChannelNoise| {
            noise.channels == of && noise.axis.is_none_or(|named| named == axis)
        };
        self.noise.iter().rev().find(names).map(|noise| &noise.noise)
    }

    /// Advances the walks of all channels by some seconds, to a sample.
    pub(super) fn walk_on(&self, stream: Stream, sample: u64, seconds: f64, walk: &mut [f64; MAX_CHANNELS]) {
        if self.noise.iter().all(|noise| noise.noise.random_walk == 0.0) {
            return;
        }
        for ((channel, of, axis), walk) in channels(&self.kind).zip(walk) {
            let Some(noise) = self.noise_of(of, axis).filter(|noise| noise.random_walk > 0.0) else {
                continue;
            };
            let (left, spread) = step_of_walk(noise, seconds);
            *walk = left * *walk + spread * stream.normal(sample, channel, Purpose::Walk);
        }
    }
}

/// Returns the remaining part of a walk after some seconds, and the standard deviation of its increment. This
/// is exact for a Wiener process, and for the Gauss-Markov process dx = -x / tau dt + s dW (Gardiner,
/// "Stochastic methods", section 4.5.4).
fn step_of_walk(noise: &Noise, seconds: f64) -> (f64, f64) {
    match noise.correlation_time {
        None => (1.0, noise.random_walk * seconds.sqrt()),
        Some(tau) => {
            let variance = -0.5 * tau * (-2.0 * seconds / tau).exp_m1();
            ((-seconds / tau).exp(), noise.random_walk * variance.sqrt())
        }
    }
}

/// Returns all channels of a type of sensor: the number of each, its quantity, and the part of that.
fn channels(kind: &SensorKind) -> impl Iterator<Item = (u32, Channels, u8)> + use<> {
    let parts = kind.channels().iter().flat_map(|(of, count)| (0..*count).map(move |axis| (*of, axis as u8)));
    (0..).zip(parts).map(|(channel, (of, axis))| (channel, of, axis))
}

fn bias(stream: Stream, channel: u32, noise: &Noise) -> f64 {
    let deviation = noise.bias_standard_deviation;
    if deviation == 0.0 {
        return noise.bias_mean;
    }
    noise.bias_mean + deviation * stream.normal(0, channel, Purpose::Bias)
}

fn normal(stream: Stream, sample: u64, channel: u32, noise: &Noise) -> f64 {
    let deviation = noise.standard_deviation;
    if deviation == 0.0 { 0.0 } else { deviation * stream.normal(sample, channel, Purpose::Sample) }
}

fn quantised(value: f64, quantum: f64) -> f64 {
    let counted = (value / quantum).round() * quantum;
    // If a quantum is so small that the quotient is infinite, it has no effect.
    if quantum > 0.0 && counted.is_finite() { counted } else { value }
}
