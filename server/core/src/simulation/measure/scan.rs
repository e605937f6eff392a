//! Measurements of rays.

use glamx::{DPose3, DVec3};
use simd_model::sensor::{RangeLimits, Scan};

use super::motion::SensorMotion;
use crate::collision::scene::{PlacedShape, Scene};
use crate::simulation::sensors::{RayNoise, SampleNoise};

/// Rays of a sensor, from its pose, which ignore the body that it is mounted on.
pub(super) struct Rays<'s> {
    pub(super) scene: &'s Scene,
    /// Pose and motion of the sensor.
    pub(super) motion: SensorMotion,
    /// Time between scans, seconds.
    pub(super) period: f64,
    /// Robot of the sensor and body of its link: links that fixed joints connect to it are invisible.
    pub(super) own: (usize, Option<usize>),
}

impl Rays<'_> {
    /// Measures one ray along x.
    pub(super) fn range(&self, limits: &RangeLimits, noise: &SampleNoise<'_>) -> f64 {
        self.measured(&self.motion.pose, DVec3::X, limits, &noise.rays(), 0)
    }

    /// Measures all rays, line by line; `None` once `is_cancelled`.
    pub(super) fn scan(
        &self,
        scan: &Scan,
        noise: &SampleNoise<'_>,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Option<Vec<f32>> {
        let Scan { horizontal, vertical, range, rolling } = scan;
        let noise = noise.rays();
        let columns = horizontal.samples;
        // Corrections of such scans take the twist within one as constant too (Zhang and Singh 2014, "LOAM",
        // section V).
        let pose_of = |column: u32| match rolling {
            true => self.motion.before(self.period * f64::from(columns - 1 - column) / f64::from(columns)),
            false => self.motion.pose,
        };
        let around: Vec<((f64, f64), DPose3)> =
            (0..columns).map(|column| (horizontal.angle(column).sin_cos(), pose_of(column))).collect();
        let mut ranges = Vec::with_capacity(around.len() * vertical.samples as usize);
        let mut ray = 0;
        for line in 0..vertical.samples {
            if is_cancelled() {
                return None;
            }
            let (up, level) = vertical.angle(line).sin_cos();
            for ((sine, cosine), pose) in &around {
                let direction = DVec3::new(level * cosine, level * sine, up);
                ranges.push(self.measured(pose, direction, range, &noise, ray) as f32);
                ray += 1;
            }
        }
        Some(ranges)
    }

    /// Returns the range along a direction of the sensor's frame, of unit length, with noise.
    fn measured(
        &self,
        pose: &DPose3,
        direction: DVec3,
        limits: &RangeLimits,
        noise: &RayNoise,
        ray: u32,
    ) -> f64 {
        let range = self.true_range(pose, direction, limits);
        match noise.of(ray, range) {
            None => f64::NAN,
            Some(measured) if range.is_finite() => measured.clamp(limits.least, limits.most),
            Some(_) => range,
        }
    }

    /// Returns the range without noise, by REP 117: infinite if nothing is in range, minus infinity if it is
    /// too near.
    fn true_range(&self, pose: &DPose3, direction: DVec3, limits: &RangeLimits) -> f64 {
        let from = pose.translation;
        let to = from + pose.rotation * direction * limits.most;
        let is_seen = |placed: &PlacedShape| (placed.robot, placed.body) != self.own;
        let Some(fraction) = self.scene.fraction(from, to, is_seen) else { return f64::INFINITY };
        let range = fraction * limits.most;
        if range < limits.least { f64::NEG_INFINITY } else { range }
    }
}
