//! Readings of sensors in a recording: each reading of its steps once.

use std::collections::{BTreeMap, BTreeSet};

use glamx::DPose3;
use simd_ros2::messages::builtin_interfaces::Time;
use simd_ros2::messages::geometry_msgs::TransformStamped;
use simd_ros2::messages::std_msgs::Header;
use simd_ros2::messages::tf2_msgs::TFMessage;

use super::Encoders;
use super::file::{RecordingFile, Unwritten, nanos};
use super::ros::{topic_part, transform, write};
use super::sensor_message::{SensorMessage, SensorShape};
use crate::driver::{LoggedReading, Published, SensorLog};

/// Maximum bytes of readings taken at one time.
const BYTES: usize = 8 << 20;

/// Recorded readings.
#[derive(Debug, Default)]
pub(super) struct Readings {
    /// Number of the last written reading of each sensor.
    written: BTreeMap<u64, u64>,
    /// Sensors whose frames are in the file.
    described: BTreeSet<u64>,
    /// Sequences of the states of the first and the last step.
    steps: Option<(u64, u64)>,
}

impl Readings {
    /// Begins with the readings that come from now on.
    pub(super) fn begin(log: &SensorLog, state: &Published) -> Self {
        let ids = || state.state.sensors.iter().map(|sensor| sensor.id);
        let written = ids().zip(log.last_sequences(ids())).collect();
        Self { written, described: BTreeSet::new(), steps: None }
    }

    /// Notes that a step with this state is in the recording.
    pub(super) fn step(&mut self, state: &Published) {
        let first = self.steps.map_or(state.sequence, |(first, _)| first);
        self.steps = Some((first, state.sequence));
    }

    /// Begins another file, which has no descriptions yet.
    pub(super) fn begin_file(&mut self) {
        self.described.clear();
    }

    /// Writes the new readings.
    pub(super) fn write(
        &mut self,
        log: &SensorLog,
        state: &Published,
        encoders: &Encoders,
        file: &mut RecordingFile,
    ) -> Result<(), Unwritten> {
        let Some((first, last)) = self.steps else { return Ok(()) };
        let sensors = &state.state.sensors;
        self.written.retain(|id, _| sensors.iter().any(|sensor| sensor.id == *id));
        let wanted: Vec<(u64, u64)> =
            sensors.iter().map(|of| (of.id, self.written.get(&of.id).copied().unwrap_or(0))).collect();
        for (sensor, batch) in sensors.iter().zip(log.after(&wanted, BYTES)) {
            // The states of the other readings are not recorded yet.
            let count = batch.readings.partition_point(|reading| reading.state_sequence <= last);
            let (readings, later) = batch.readings.split_at(count);
            match later.first() {
                None => self.written.insert(sensor.id, batch.after),
                Some(next) => self.written.insert(sensor.id, next.sequence - 1),
            };
            let readings: Vec<_> = readings.iter().filter(|of| of.state_sequence >= first).collect();
            if readings.is_empty() {
                continue;
            }
            let Some(entity) = state.state.world.entities.get(sensor.robot) else { continue };
            let frame = |link: usize| {
                let link = entity.model.links.get(link).map_or("", |link| &link.name);
                format!("{}/{link}", entity.name)
            };
            let own_frame = format!("{}/sensors/{}", entity.name, sensor.definition.name);
            if self.described.insert(sensor.id) {
                let link = frame(sensor.definition.link);
                describe(sensor.definition.pose, link, own_frame.clone(), file)?;
            }
            let shape = SensorShape::new(sensor, entity, own_frame, frame);
            let robot = topic_part(&entity.name);
            let topic = format!("/{robot}/sensors/{}", topic_part(&sensor.definition.name));
            for reading in readings {
                file.time = nanos(reading.wall_time);
                write_reading(&topic, &shape, reading, encoders, file)?;
            }
        }
        Ok(())
    }
}

/// Writes the transform of a frame in another one: a sensor on its link, or the optical axes on a camera.
pub(super) fn describe(
    parent_from_frame: DPose3,
    parent: String,
    frame: String,
    file: &mut RecordingFile,
) -> std::io::Result<()> {
    let placed = TransformStamped {
        header: Header { stamp: Time::default(), frame_id: parent },
        child_frame_id: frame,
        transform: transform(parent_from_frame),
    };
    write(file, "/tf_static", &TFMessage { transforms: vec![placed] })
}

/// Writes a reading; without a ROS message for it, as a message of the schema.
fn write_reading(
    topic: &str,
    shape: &SensorShape,
    reading: &LoggedReading,
    encoders: &Encoders,
    file: &mut RecordingFile,
) -> std::io::Result<()> {
    match shape.message(reading) {
        Some(SensorMessage::Imu(message)) => write(file, topic, &message),
        Some(SensorMessage::Wrench(message)) => write(file, topic, &message),
        Some(SensorMessage::Range(message)) => write(file, topic, &message),
        Some(SensorMessage::Scan(message)) => write(file, topic, &message),
        Some(SensorMessage::Points(message)) => write(file, topic, &message),
        Some(SensorMessage::Joint(message)) => write(file, topic, &message),
        None => file.write_encoded(topic, "SensorReading", &(encoders.reading)(reading)),
    }
}
