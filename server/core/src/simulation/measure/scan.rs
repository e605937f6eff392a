//! What rays measure.

use glamx::{DPose3, DVec3};
use simd_model::sensor::{RangeLimits, Scan};

use crate::collision::scene::{PlacedShape, Scene};
use crate::simulation::sensors::{RayNoise, SampleNoise};

/// The rays of a sensor: from where it is, to all but the body that it sits on.
pub(super) struct Rays<'s> {
    pub(super) scene: &'s Scene,
    /// `world_from_sensor`.
    pub(super) pose: DPose3,
    /// Its robot and the body of its link: all links that fixed joints connect to it are not seen.
    pub(super) own: (usize, Option<usize>),
}

impl Rays<'_> {
    /// One ray along x.
    pub(super) fn range(&self, limits: &RangeLimits, noise: &SampleNoise<'_>) -> f64 {
        self.measured(DVec3::X, limits, &noise.rays(), 0)
    }

    /// All rays, line by line; nothing once `is_cancelled`.
    pub(super) fn scan(
        &self,
        scan: &Scan,
        noise: &SampleNoise<'_>,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Option<Vec<f32>> {
        let Scan { horizontal, vertical, range } = scan;
        let noise = noise.rays();
        let around: Vec<(f64, f64)> =
            (0..horizontal.samples).map(|index| horizontal.angle(index).sin_cos()).collect();
        let mut ranges = Vec::with_capacity(around.len() * vertical.samples as usize);
        let mut ray = 0;
        for line in 0..vertical.samples {
            if is_cancelled() {
                return None;
            }
            let (up, level) = vertical.angle(line).sin_cos();
            for (sine, cosine) in &around {
                let direction = DVec3::new(level * cosine, level * sine, up);
                ranges.push(self.measured(direction, range, &noise, ray) as f32);
                ray += 1;
            }
        }
        Some(ranges)
    }

    /// The range along a direction of the sensor's frame, of unit length, with noise.
    fn measured(&self, direction: DVec3, limits: &RangeLimits, noise: &RayNoise, ray: u32) -> f64 {
        let range = self.true_range(direction, limits);
        match noise.of(ray, range) {
            None => f64::NAN,
            Some(measured) if range.is_finite() => measured.clamp(limits.least, limits.most),
            Some(_) => range,
        }
    }

    /// REP 117: infinite where nothing is in reach, minus infinity where it is too near.
    fn true_range(&self, direction: DVec3, limits: &RangeLimits) -> f64 {
        let from = self.pose.translation;
        let to = from + self.pose.rotation * direction * limits.most;
        let is_seen = |placed: &PlacedShape| (placed.robot, placed.body) != self.own;
        let Some(hit) = self.scene.cast(from, to, is_seen) else { return f64::INFINITY };
        let range = hit.fraction * limits.most;
        if range < limits.least { f64::NEG_INFINITY } else { range }
    }
}
