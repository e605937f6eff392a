//! Sensors: a topic for each, and a message for each of its readings.

use std::collections::BTreeMap;
use std::sync::Arc;

use glamx::DVec3;
use simd_core::simulation::measure::{EncoderMeasurement, ImuMeasurement, WrenchMeasurement};
use simd_core::simulation::published_state::{PublishedState, WorldLayout};
use simd_core::simulation::sensors::{SensorDefinition, WorldSensor};
use simd_model::sensor::{Channels, RangeLimits, Scan, SensorKind, SensorMount, WrenchAxes};
use simd_ros2::messages::geometry_msgs::{Quaternion, Vector3, Wrench, WrenchStamped};
use simd_ros2::messages::sensor_msgs::{Imu, JointState, LaserScan, PointCloud2, PointField, Range};
use simd_ros2::messages::std_msgs::Header;
use simd_ros2::wire::{Qos, word};

use super::endpoints::{Graph, Topic};
use super::robots::{Robot, stamp};
use crate::SimHandle;
use crate::handle::{LoggedReading, MOST_FOLLOWED, Measured, SensorCursor};

/// Of a point in a cloud: x, y and z.
const POINT_BYTES: u32 = 12;

/// The topics of sensors.
#[derive(Debug, Default)]
pub(super) struct Sensors {
    /// What there was when they were declared.
    of: Option<(Arc<Vec<WorldSensor>>, Arc<WorldLayout>)>,
    /// By the sensor and the topic's name.
    topics: BTreeMap<(u64, String), SensorTopic>,
}

/// The topic of a sensor.
#[derive(Debug)]
struct SensorTopic {
    robot: String,
    output: Output,
    shape: Shape,
    /// The number of the last reading that was published; `None` where nobody subscribes.
    after: Option<u64>,
}

/// What the messages of a sensor have beside its readings.
#[derive(Debug)]
pub(super) struct Shape {
    pub(super) definition: Arc<SensorDefinition>,
    /// In which it measures.
    pub(super) frame: String,
    /// Of an encoder: its joint.
    pub(super) joint: String,
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
    /// Has a topic for each sensor of the robots that are shown, of which ROS has a message, and no other.
    ///
    /// # Errors
    /// Where a topic cannot be declared.
    pub(super) async fn follow(
        &mut self,
        graph: &Graph,
        shown: &[Robot],
        state: &PublishedState,
    ) -> Result<(), zenoh::Error> {
        // Names of topics follow from all robots.
        let is_same = |(sensors, world): &(Arc<_>, Arc<_>)| {
            Arc::ptr_eq(sensors, &state.sensors) && Arc::ptr_eq(world, &state.world)
        };
        if self.of.as_ref().is_some_and(is_same) {
            return Ok(());
        }
        let mut wanted: Vec<((u64, String), (&WorldSensor, &Robot))> = Vec::new();
        for sensor in &*state.sensors {
            // Robots that are shown are the first ones.
            let Some(robot) = shown.get(sensor.robot) else { continue };
            let mut topic = format!("{}sensors/{}", robot.prefix, word(&sensor.definition.name));
            // Names that differ may be one word to ROS.
            while wanted.iter().any(|((_, taken), _)| *taken == topic) {
                topic.push('_');
            }
            wanted.push(((sensor.id, topic), (sensor, robot)));
        }
        self.topics.retain(|key, _| wanted.iter().any(|(wanted, _)| wanted == key));
        for (key, (sensor, robot)) in wanted {
            if self.topics.contains_key(&key) {
                continue;
            }
            let Some(output) = Output::declare(graph, &graph.name(&key.1), &sensor.definition.kind).await? else {
                continue;
            };
            let (robot, shape) = (robot.entity.name.clone(), Shape::new(sensor, robot));
            self.topics.insert(key, SensorTopic { robot, output, shape, after: None });
        }
        self.of = Some((Arc::clone(&state.sensors), Arc::clone(&state.world)));
        Ok(())
    }

    /// Publishes the readings that came since the last time, where somebody subscribes. Waits where Zenoh does.
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
        for topics in topics.chunks_mut(MOST_FOLLOWED) {
            let cursors: Vec<SensorCursor> = topics.iter().map(|(_, topic)| topic.cursor()).collect();
            // Where one of them is gone the next state says so.
            let Ok(readings) = handle.readings_after(&cursors) else { continue };
            for ((_, topic), of) in topics.iter_mut().zip(readings) {
                topic.after = Some(of.batch.after);
                of.batch.readings.iter().for_each(|reading| topic.output.put(&topic.shape, reading));
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

impl Shape {
    pub(super) fn new(sensor: &WorldSensor, robot: &Robot) -> Self {
        let definition = Arc::clone(&sensor.definition);
        let joint = match definition.on {
            SensorMount::Joint(joint) => robot.entity.model.joints.get(joint),
            SensorMount::Link(_) => None,
        };
        let frame = match (definition.kind, joint) {
            (SensorKind::ForceTorque { axes: WrenchAxes::Child, .. }, Some(joint)) => robot.link_frame(joint.child),
            (SensorKind::ForceTorque { axes: WrenchAxes::Parent, .. }, Some(joint)) => robot.link_frame(joint.parent),
            _ => robot.sensor_frame(&definition.name),
        };
        let joint = joint.map(|joint| joint.name.clone()).unwrap_or_default();
        Self { definition, frame, joint }
    }

    fn header(&self, reading: &LoggedReading) -> Header {
        Header { stamp: stamp(reading.at.sim_time), frame_id: self.frame.clone() }
    }

    /// The variances of what is drawn for each sample, on the diagonal.
    fn covariance(&self, of: Channels) -> [f64; 9] {
        let mut covariance = [0.0; 9];
        for noise in self.definition.noise.iter().filter(|noise| noise.channels == of) {
            let variance = noise.noise.standard_deviation.powi(2);
            for axis in 0..3 {
                if noise.axis.is_none_or(|only| usize::from(only) == axis) {
                    covariance[4 * axis] = variance;
                }
            }
        }
        covariance
    }

    pub(super) fn imu(&self, reading: &LoggedReading, of: &ImuMeasurement) -> Imu {
        let [x, y, z, w] = of.orientation.to_array();
        Imu {
            header: self.header(reading),
            orientation: Quaternion { x, y, z, w },
            orientation_covariance: self.covariance(Channels::Orientation),
            angular_velocity: vector(of.angular_velocity),
            angular_velocity_covariance: self.covariance(Channels::AngularVelocity),
            linear_acceleration: vector(of.linear_acceleration),
            linear_acceleration_covariance: self.covariance(Channels::LinearAcceleration),
        }
    }

    fn wrench(&self, reading: &LoggedReading, of: &WrenchMeasurement) -> WrenchStamped {
        let wrench = Wrench { force: vector(of.force), torque: vector(of.torque) };
        WrenchStamped { header: self.header(reading), wrench }
    }

    fn range(&self, reading: &LoggedReading, limits: &RangeLimits, range: f64) -> Range {
        Range {
            header: self.header(reading),
            radiation_type: Range::INFRARED,
            field_of_view: 0.0,
            min_range: limits.least as f32,
            max_range: limits.most as f32,
            range: range as f32,
            variance: self.covariance(Channels::Range)[0] as f32,
        }
    }

    pub(super) fn scan(&self, reading: &LoggedReading, scan: &Scan, ranges: &[f32]) -> LaserScan {
        LaserScan {
            header: self.header(reading),
            angle_min: scan.horizontal.least as f32,
            angle_max: scan.horizontal.most as f32,
            angle_increment: scan.horizontal.increment() as f32,
            // All rays are of one moment.
            time_increment: 0.0,
            scan_time: self.definition.rate.map_or(0.0, |rate| 1.0 / rate) as f32,
            range_min: scan.range.least as f32,
            range_max: scan.range.most as f32,
            ranges: ranges.to_vec(),
            intensities: Vec::new(),
        }
    }

    /// Rays that hit nothing are points that are no numbers.
    pub(super) fn points(&self, reading: &LoggedReading, scan: &Scan, ranges: &[f32]) -> PointCloud2 {
        let (width, height) = (scan.horizontal.samples, scan.vertical.samples);
        let about: Vec<(f64, f64)> = (0..width).map(|index| scan.horizontal.angle(index).sin_cos()).collect();
        let mut data = Vec::with_capacity(ranges.len() * POINT_BYTES as usize);
        for (row, ranges) in (0..height).zip(ranges.chunks(about.len().max(1))) {
            let (rise, level) = scan.vertical.angle(row).sin_cos();
            for ((sine, cosine), range) in about.iter().zip(ranges) {
                let range = if range.is_finite() { f64::from(*range) } else { f64::NAN };
                for coordinate in [level * cosine, level * sine, rise] {
                    data.extend(((range * coordinate) as f32).to_le_bytes());
                }
            }
        }
        let field = |(name, offset): (&str, u32)| PointField {
            name: name.to_owned(),
            offset,
            datatype: PointField::FLOAT32,
            count: 1,
        };
        PointCloud2 {
            header: self.header(reading),
            height,
            width,
            fields: [("x", 0), ("y", 4), ("z", 8)].map(field).into(),
            is_bigendian: false,
            point_step: POINT_BYTES,
            row_step: POINT_BYTES * width,
            data,
            is_dense: ranges.iter().all(|range| range.is_finite()),
        }
    }

    fn joint(&self, reading: &LoggedReading, of: &EncoderMeasurement) -> JointState {
        JointState {
            header: Header { stamp: stamp(reading.at.sim_time), frame_id: String::new() },
            name: vec![self.joint.clone()],
            position: vec![of.position],
            velocity: vec![of.velocity],
            effort: Vec::new(),
        }
    }
}

impl Output {
    /// A topic of the message that ROS has for a kind; `None` where it has none.
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
            SensorKind::Encoder => Self::Joint(graph.publisher(topic, qos).await?),
            SensorKind::Contact { .. } | SensorKind::LinkState | SensorKind::Odometry | SensorKind::Camera(_) => {
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

    fn put(&self, shape: &Shape, reading: &LoggedReading) {
        match (self, &reading.measured, &shape.definition.kind) {
            (Self::Imu(topic), Measured::Imu(of), _) => topic.put(&shape.imu(reading, of)),
            (Self::Wrench(topic), Measured::ForceTorque(of), _) => topic.put(&shape.wrench(reading, of)),
            (Self::Range(topic), Measured::Range(range), SensorKind::Range(limits)) => {
                topic.put(&shape.range(reading, limits, *range));
            }
            (Self::Scan(topic), Measured::Lidar { ranges, .. }, SensorKind::Lidar(scan)) => {
                topic.put(&shape.scan(reading, scan, ranges));
            }
            (Self::Points(topic), Measured::Lidar { ranges, .. }, SensorKind::Lidar(scan)) => {
                topic.put(&shape.points(reading, scan, ranges));
            }
            (Self::Joint(topic), Measured::Encoder(of), _) => topic.put(&shape.joint(reading, of)),
            // A reading is of its sensor's kind.
            _ => {}
        }
    }
}

fn vector(DVec3 { x, y, z }: DVec3) -> Vector3 {
    Vector3 { x, y, z }
}
