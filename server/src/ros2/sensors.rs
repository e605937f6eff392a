//! Sensors: a topic for each, and a message for each of its readings.

use std::collections::BTreeMap;

use simd_core::simulation::published_state::PublishedState;
use simd_core::simulation::sensors::WorldSensor;
use simd_model::sensor::SensorKind;
use simd_ros2::messages::geometry_msgs::WrenchStamped;
use simd_ros2::messages::sensor_msgs::{Imu, JointState, LaserScan, PointCloud2, Range};
use simd_ros2::wire::Qos;

use super::endpoints::{Graph, Topic};
use super::robots::{DeclaredFor, Robot, SensorKey, sensor_topics};
use simd_world::SimHandle;
use simd_world::handle::{MAX_WATCHED_SENSORS, SensorCursor};
use simd_world::recording::sensor_message::{SensorMessage, SensorShape};

/// The topics of sensors.
#[derive(Debug, Default)]
pub(super) struct Sensors {
    declared_for: DeclaredFor,
    /// Topics by sensor and name.
    topics: BTreeMap<SensorKey, SensorTopic>,
}

/// The topic of a sensor.
#[derive(Debug)]
struct SensorTopic {
    robot: String,
    output: Output,
    shape: SensorShape,
    /// Number of the last published reading; `None` without a subscriber.
    after: Option<u64>,
}

#[derive(Debug)]
enum Output {
    Imu(Topic<Imu>),
    Wrench(Topic<WrenchStamped>),
    Range(Topic<Range>),
    Scan(Topic<LaserScan>),
    Points(Topic<PointCloud2>),
    Joint(Topic<JointState>),
}

impl Sensors {
    /// Declares a topic for each sensor of the shown robots that has a ROS message, and drops all others.
    ///
    /// # Errors
    /// Returns an error if a topic cannot be declared.
    pub(super) async fn follow(
        &mut self,
        graph: &Graph,
        shown: &[Robot],
        state: &PublishedState,
    ) -> Result<(), zenoh::Error> {
        if self.declared_for.is_of(state) {
            return Ok(());
        }
        let wanted = sensor_topics(state.sensors.iter(), shown);
        self.topics.retain(|key, _| wanted.iter().any(|(wanted, ..)| wanted == key));
        for (key, sensor, robot) in wanted {
            if self.topics.contains_key(&key) {
                continue;
            }
            let Some(output) = Output::declare(graph, &graph.name(&key.1), &sensor.definition.kind).await?
            else {
                continue;
            };
            let (robot, shape) = (robot.entity.name.clone(), shape(sensor, robot));
            self.topics.insert(key, SensorTopic { robot, output, shape, after: None });
        }
        self.declared_for.set(state);
        Ok(())
    }

    /// Publishes new readings, if there is a subscriber. It waits while Zenoh does.
    pub(super) fn publish(&mut self, handle: &SimHandle) {
        let mut topics: Vec<(u64, &mut SensorTopic)> = Vec::new();
        for ((id, _), topic) in &mut self.topics {
            if topic.output.is_wanted() {
                topics.push((*id, topic));
            } else {
                topic.after = None;
            }
        }
        if topics.iter().any(|(_, topic)| topic.after.is_none()) {
            let last: BTreeMap<u64, u64> = handle.last_readings();
            for (id, topic) in &mut topics {
                topic.after.get_or_insert_with(|| last.get(id).copied().unwrap_or(0));
            }
        }
        for topics in topics.chunks_mut(MAX_WATCHED_SENSORS) {
            let cursors: Vec<SensorCursor> = topics.iter().map(|(_, topic)| topic.cursor()).collect();
            // If one of them is deleted, the next state shows it.
            let Ok(readings) = handle.readings_after(&cursors) else { continue };
            for ((_, topic), of) in topics.iter_mut().zip(readings) {
                topic.after = Some(of.batch.after);
                let messages = of.batch.readings.iter().filter_map(|reading| topic.shape.message(reading));
                messages.for_each(|message| topic.output.put(&message));
            }
        }
    }
}

impl SensorTopic {
    fn cursor(&self) -> SensorCursor {
        let sensor = self.shape.definition.name.clone();
        SensorCursor { robot: self.robot.clone(), sensor, after: self.after.unwrap_or(0) }
    }
}

/// Returns the data of a sensor's messages in addition to its readings.
pub(super) fn shape(sensor: &WorldSensor, robot: &Robot) -> SensorShape {
    let frame = robot.sensor_frame(&sensor.definition.name);
    SensorShape::new(sensor, &robot.entity, frame, |link| robot.link_frame(link))
}

impl Output {
    /// Declares a topic with the ROS message for a kind; `None` if it has none.
    async fn declare(graph: &Graph, topic: &str, kind: &SensorKind) -> Result<Option<Self>, zenoh::Error> {
        let qos = Qos::DEFAULT;
        Ok(Some(match kind {
            SensorKind::Imu => Self::Imu(graph.publisher(topic, qos).await?),
            SensorKind::ForceTorque { .. } => Self::Wrench(graph.publisher(topic, qos).await?),
            SensorKind::Range(_) => Self::Range(graph.publisher(topic, qos).await?),
            SensorKind::Lidar(scan) if scan.vertical.samples == 1 => {
                Self::Scan(graph.publisher(topic, qos).await?)
            }
            SensorKind::Lidar(_) => Self::Points(graph.publisher(topic, qos).await?),
            SensorKind::Encoder { .. } => Self::Joint(graph.publisher(topic, qos).await?),
            SensorKind::Contact { .. }
            | SensorKind::LinkState
            | SensorKind::Odometry
            | SensorKind::Camera(_) => {
                return Ok(None);
            }
        }))
    }

    fn is_wanted(&self) -> bool {
        match self {
            Self::Imu(topic) => topic.is_wanted(),
            Self::Wrench(topic) => topic.is_wanted(),
            Self::Range(topic) => topic.is_wanted(),
            Self::Scan(topic) => topic.is_wanted(),
            Self::Points(topic) => topic.is_wanted(),
            Self::Joint(topic) => topic.is_wanted(),
        }
    }

    fn put(&self, message: &SensorMessage) {
        match (self, message) {
            (Self::Imu(topic), SensorMessage::Imu(message)) => topic.put(message),
            (Self::Wrench(topic), SensorMessage::Wrench(message)) => topic.put(message),
            (Self::Range(topic), SensorMessage::Range(message)) => topic.put(message),
            (Self::Scan(topic), SensorMessage::Scan(message)) => topic.put(message),
            (Self::Points(topic), SensorMessage::Points(message)) => topic.put(message),
            (Self::Joint(topic), SensorMessage::Joint(message)) => topic.put(message),
            // A message has its sensor's kind.
            _ => {}
        }
    }
}
