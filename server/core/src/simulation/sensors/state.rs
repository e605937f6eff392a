//! State of a sensor: its start, its samples and its random walk.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};
use simd_model::sensor::{MAX_CHANNELS, SensorKind, SensorMount};

use super::backlash::EncoderShaft;
use super::definition::SensorDefinition;
use super::generator::stream;
use crate::plain::{pose3, shared};
use crate::simulation::moment::Moment;
use crate::simulation::settings::PhysicsSettings;
use crate::valid::{finite, pose, sizes};

/// Maximum number of sensors of a world.
pub const MAX_SENSORS: usize = 1_024;

/// Time before the end of its period at which a sample is due, as a part of a step: sums of steps are
/// rounded.
const EARLY: f64 = 1e-3;

/// A sensor with its state between samples, which saves copy and fingerprints read.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SensorState {
    /// Definition of the sensor.
    #[serde(with = "shared")]
    pub definition: Arc<SensorDefinition>,
    /// Sim time from which its samples are counted.
    pub begun: f64,
    /// Number of its periods since then.
    pub periods: u64,
    /// Number of samples taken.
    pub samples: u64,
    /// Sim time of the last sample.
    pub last: f64,
    /// Random walk of each channel, in the order of [`SensorKind::channels`].
    pub walk: [f64; MAX_CHANNELS],
    /// Origin of odometry, `world_from_start`.
    #[serde(with = "pose3")]
    pub start: DPose3,
    /// Shaft of an encoder with backlash; unchanged for other sensors.
    pub shaft: EncoderShaft,
    /// [`WorldSensor::id`](super::WorldSensor::id); 0 means none yet.
    #[serde(skip)]
    pub id: u64,
}

/// Sample that a step has taken, and that is still to be measured: see
/// [`PublishedState::readings`](crate::simulation::PublishedState::readings).
#[derive(Clone, Debug)]
pub struct DueSample {
    /// [`WorldSensor::id`](super::WorldSensor::id).
    pub id: u64,
    /// Definition of the sensor.
    pub definition: Arc<SensorDefinition>,
    /// Robot, by index.
    pub robot: usize,
    /// Number of the sample, from 1.
    pub sample: u64,
    /// Moment after the step.
    pub at: Moment,
    /// Gravity in that step, m/s^2, world.
    pub gravity: DVec3,
    /// Time between samples, seconds.
    pub period: f64,
    /// Random stream of its noise, from the seed and the names of robot and sensor.
    pub stream: u64,
    /// Random walks, as [`SensorState::walk`].
    pub walk: [f64; MAX_CHANNELS],
    /// Origin of odometry, as [`SensorState::start`].
    pub start: DPose3,
    /// Shaft, as [`SensorState::shaft`].
    pub shaft: EncoderShaft,
}

/// Initial pose of a sensor.
#[derive(Clone, Copy, Debug)]
pub(in crate::simulation) struct SensorOrigin {
    /// Pose `world_from_sensor`, only for odometry.
    pub(in crate::simulation) start: DPose3,
    /// Position of its joint, rad or m, only for an encoder.
    pub(in crate::simulation) joint: f64,
}

/// Returns the period of a sensor, at least a time step: no sensor takes more than one sample in a step.
fn rate_period(rate: Option<f64>, time_step: f64) -> f64 {
    rate.map_or(time_step, |rate| (1.0 / rate).max(time_step))
}

impl DueSample {
    /// Returns whether its measurement takes so long that it must not run on the physics thread. This holds
    /// for rays, and for cameras, whose pictures the core does not draw.
    pub fn takes_long(&self) -> bool {
        matches!(self.definition.kind, SensorKind::Lidar(_) | SensorKind::Range(_) | SensorKind::Camera(_))
    }

    /// Returns whether it belongs to a camera: it has a time, and no reading.
    pub fn is_of_camera(&self) -> bool {
        matches!(self.definition.kind, SensorKind::Camera(_))
    }
}

impl SensorState {
    /// Creates a sensor that begins at this sim time, with this origin.
    pub(in crate::simulation) fn new(definition: SensorDefinition, now: f64, origin: SensorOrigin) -> Self {
        Self {
            definition: Arc::new(definition),
            begun: now,
            periods: 0,
            samples: 0,
            last: now,
            walk: [0.0; MAX_CHANNELS],
            start: origin.start,
            shaft: EncoderShaft::amid(origin.joint),
            id: 0,
        }
    }

    /// Returns the joint that it follows with backlash.
    pub(in crate::simulation) fn followed_joint(&self) -> Option<usize> {
        match (self.definition.kind, self.definition.on) {
            (SensorKind::Encoder { backlash }, SensorMount::Joint(joint)) if backlash > 0.0 => Some(joint),
            _ => None,
        }
    }

    /// Moves its shaft when a step has brought that joint to this position.
    pub(in crate::simulation) fn follow_joint(&mut self, position: f64) {
        if let SensorKind::Encoder { backlash } = self.definition.kind {
            self.shaft.follow(position, backlash);
        }
    }

    /// Takes the sample that is due at this moment, if any. The first step that reaches k / rate since the
    /// start takes sample k.
    pub(in crate::simulation) fn take(
        &mut self,
        (robot, name): (usize, &str),
        at: Moment,
        settings: &PhysicsSettings,
    ) -> Option<DueSample> {
        let definition = &*self.definition;
        let periods = definition.rate.map_or(self.periods.saturating_add(1), |rate| {
            // Negative numbers become 0.
            ((at.sim_time - self.begun + EARLY * settings.time_step) * rate).floor() as u64
        });
        if periods <= self.periods {
            return None;
        }
        (self.periods, self.samples) = (periods, self.samples.saturating_add(1));
        let mut stream_of_sensor = 0;
        if !definition.noise.is_empty() {
            let stream = stream(definition.seed, name, &definition.name);
            definition.walk_on(stream, self.samples, (at.sim_time - self.last).max(0.0), &mut self.walk);
            stream_of_sensor = stream.0;
        }
        self.last = at.sim_time;
        Some(DueSample {
            id: self.id,
            definition: Arc::clone(&self.definition),
            robot,
            sample: self.samples,
            at,
            gravity: settings.gravity,
            period: rate_period(definition.rate, settings.time_step),
            stream: stream_of_sensor,
            walk: self.walk,
            start: self.start,
            shaft: self.shaft,
        })
    }

    /// Restarts its samples and its odometry at this sim time and origin.
    pub(in crate::simulation) fn begin_anew(&mut self, now: f64, origin: SensorOrigin) {
        (self.begun, self.last) = (now, now);
        (self.periods, self.samples) = (0, 0);
        self.put_back(origin);
    }

    /// Restarts its walk, its odometry and its backlash when its robot was reset; its samples continue.
    pub(in crate::simulation) fn put_back(&mut self, origin: SensorOrigin) {
        (self.walk, self.start) = ([0.0; MAX_CHANNELS], origin.start);
        self.shaft = EncoderShaft::amid(origin.joint);
    }

    /// Checks the numbers of a sensor from elsewhere, for this sim time of its world. The error is a fragment
    /// of a sentence.
    pub(in crate::simulation) fn check(&self, now: f64) -> Result<(), String> {
        let Self { definition: _, begun, periods: _, samples: _, last, walk, start, shaft, id: _ } = self;
        sizes("times", [*begun, *last])?;
        if *begun > now || *last > now {
            return Err(format!("times beyond {now} s, the time of its world"));
        }
        finite("walks", *walk)?;
        finite("a place of its shaft", [shaft.position])?;
        pose("a start pose", start)
    }
}
