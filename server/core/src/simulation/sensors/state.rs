//! A sensor's state: when it began, which samples it has taken, and how far its walk has gone.

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

/// Sensors of a world at the most.
pub const MAX_SENSORS: usize = 1_024;

/// A sample falls due so much before the end of its period, as a part of a step: sums of steps are rounded.
const EARLY: f64 = 1e-3;

/// A sensor, and what it remembers from sample to sample: what a save copies and a fingerprint reads.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SensorState {
    /// What it is.
    #[serde(with = "shared")]
    pub definition: Arc<SensorDefinition>,
    /// Sim time from which its samples are counted.
    pub begun: f64,
    /// How many of its periods have passed since.
    pub periods: u64,
    /// Samples that it has taken.
    pub samples: u64,
    /// Sim time of the last of them.
    pub last: f64,
    /// Where the walk of each of its channels is, in the order of [`SensorKind::channels`].
    pub walk: [f64; MAX_CHANNELS],
    /// `world_from_start`: where odometry counts from.
    #[serde(with = "pose3")]
    pub start: DPose3,
    /// Of an encoder with backlash; of all else as it began.
    pub shaft: EncoderShaft,
    /// [`WorldSensor::id`](super::WorldSensor::id); 0: none yet.
    #[serde(skip)]
    pub id: u64,
}

/// A sample that a step has taken, and whose measurement is to be made: see
/// [`PublishedState::readings`](crate::simulation::PublishedState::readings).
#[derive(Clone, Debug)]
pub struct DueSample {
    /// [`WorldSensor::id`](super::WorldSensor::id).
    pub id: u64,
    /// What the sensor is.
    pub definition: Arc<SensorDefinition>,
    /// Index of its robot.
    pub robot: usize,
    /// Counts from 1.
    pub sample: u64,
    /// After which step.
    pub at: Moment,
    /// Gravity in that step, m/s^2, world.
    pub gravity: DVec3,
    /// From one sample to the next, seconds.
    pub period: f64,
    /// What its noise is drawn from: the seed, and the names of robot and sensor.
    pub stream: u64,
    /// As [`SensorState::walk`].
    pub walk: [f64; MAX_CHANNELS],
    /// As [`SensorState::start`].
    pub start: DPose3,
    /// As [`SensorState::shaft`].
    pub shaft: EncoderShaft,
}

/// Where a sensor is as it begins.
#[derive(Clone, Copy, Debug)]
pub(in crate::simulation) struct SensorOrigin {
    /// `world_from_sensor`; of odometry alone.
    pub(in crate::simulation) start: DPose3,
    /// Position of its joint, rad or m; of an encoder alone.
    pub(in crate::simulation) joint: f64,
}

/// No sensor takes more than one sample in a step.
fn rate_period(rate: Option<f64>, time_step: f64) -> f64 {
    rate.map_or(time_step, |rate| (1.0 / rate).max(time_step))
}

impl DueSample {
    /// Whether its measurement takes long, so that it is not to be made on the physics thread: of rays, and of cameras, whose
    /// pictures the core does not draw.
    pub fn takes_long(&self) -> bool {
        matches!(self.definition.kind, SensorKind::Lidar(_) | SensorKind::Range(_) | SensorKind::Camera(_))
    }

    /// Whether it is of a camera: it has a time, and no reading.
    pub fn is_of_camera(&self) -> bool {
        matches!(self.definition.kind, SensorKind::Camera(_))
    }
}

impl SensorState {
    /// One that begins at this sim time, at this place.
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

    /// The joint that it follows with backlash.
    pub(in crate::simulation) fn followed_joint(&self) -> Option<usize> {
        match (self.definition.kind, self.definition.on) {
            (SensorKind::Encoder { backlash }, SensorMount::Joint(joint)) if backlash > 0.0 => Some(joint),
            _ => None,
        }
    }

    /// A step has brought that joint to this position.
    pub(in crate::simulation) fn follow_joint(&mut self, position: f64) {
        if let SensorKind::Encoder { backlash } = self.definition.kind {
            self.shaft.follow(position, backlash);
        }
    }

    /// Takes the sample that the step to this moment has brought, if one is due. Sample k is taken by the first step that reaches
    /// k / rate since the beginning.
    pub(in crate::simulation) fn take(
        &mut self,
        (robot, name): (usize, &str),
        at: Moment,
        settings: &PhysicsSettings,
    ) -> Option<DueSample> {
        let definition = &*self.definition;
        let periods = definition.rate.map_or(self.periods.saturating_add(1), |rate| {
            // What is below zero is 0 then.
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

    /// Where its samples and its odometry are counted from is now, at this sim time and place.
    pub(in crate::simulation) fn begin_anew(&mut self, now: f64, origin: SensorOrigin) {
        (self.begun, self.last) = (now, now);
        (self.periods, self.samples) = (0, 0);
        self.put_back(origin);
    }

    /// Its robot was put back: its walk, its odometry and its backlash begin anew, and its samples go on.
    pub(in crate::simulation) fn put_back(&mut self, origin: SensorOrigin) {
        (self.walk, self.start) = ([0.0; MAX_CHANNELS], origin.start);
        self.shaft = EncoderShaft::amid(origin.joint);
    }

    /// Whether the numbers of one from elsewhere can be, where its world is at this sim time; what is wrong is a fragment of a sentence.
    pub(in crate::simulation) fn check(&self, now: f64) -> Result<(), String> {
        let Self { definition: _, begun, periods: _, samples: _, last, walk, start, shaft, id: _ } = self;
        sizes("times", [*begun, *last])?;
        if *begun > now || *last > now {
            return Err(format!("times beyond {now} s, where its world is"));
        }
        finite("walks", *walk)?;
        finite("a place of its shaft", [shaft.position])?;
        pose("a place where it began", start)
    }
}
