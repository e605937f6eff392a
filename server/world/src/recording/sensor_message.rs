//! Readings of sensors as ROS 2 messages, for its graph and for recordings.

use std::sync::Arc;

use glamx::DVec3;
use simd_core::simulation::measure::{EncoderMeasurement, ImuMeasurement, WrenchMeasurement};
use simd_core::simulation::published_state::EntityLayout;
use simd_core::simulation::sensors::{SensorDefinition, WorldSensor};
use simd_model::sensor::{Channels, RangeLimits, Scan, SensorKind, SensorMount, WrenchAxes};
use simd_ros2::messages::geometry_msgs::{Quaternion, Vector3, Wrench, WrenchStamped};
use simd_ros2::messages::sensor_msgs::{Imu, JointState, LaserScan, PointCloud2, PointField, Range};
use simd_ros2::messages::std_msgs::Header;

use super::ros::stamp;
use crate::driver::{LoggedReading, Measured};

/// Bytes of a number of a point in a cloud: x, y, z, and for a rolling scan the seconds since its first
/// column.
const NUMBER_BYTES: u32 = 4;

/// ROS message of a reading.
#[derive(Clone, Debug, PartialEq)]
pub enum SensorMessage {
    /// Inertial measurement unit.
    Imu(Imu),
    /// Force-torque sensor.
    Wrench(WrenchStamped),
    /// Range finder.
    Range(Range),
    /// Lidar with one row.
    Scan(LaserScan),
    /// Lidar with several rows.
    Points(PointCloud2),
    /// Encoder.
    Joint(JointState),
}

/// Data of a sensor's messages in addition to its readings.
#[derive(Debug)]
pub struct SensorShape {
    /// Definition of the sensor.
    pub definition: Arc<SensorDefinition>,
    /// Frame of its measurements.
    pub frame: String,
    /// Joint of an encoder.
    joint: String,
}

/// Times of a scan's rays, seconds.
#[derive(Debug)]
struct Rolled {
    /// Simulated time of the first column: ROS's stamp of a scan.
    first: f64,
    /// Time from one column to the next: 0 if all rays are simultaneous.
    between: f64,
    /// Time from one scan to the next.
    period: f64,
}

impl Rolled {
    fn new(reading: &LoggedReading, scan: &Scan, period: f64) -> Self {
        let columns = f64::from(scan.horizontal.samples.max(1));
        let between = if scan.rolling { period / columns } else { 0.0 };
        let first = (reading.at.sim_time - between * (columns - 1.0)).max(0.0);
        Self { first, between, period }
    }
}

impl SensorShape {
    /// Makes the shape of a robot's sensor, from the names of the sensor's frame and of links' frames.
    pub fn new(
        sensor: &WorldSensor,
        entity: &EntityLayout,
        own_frame: String,
        link_frame: impl Fn(usize) -> String,
    ) -> Self {
        let definition = Arc::clone(&sensor.definition);
        let joint = match definition.on {
            SensorMount::Joint(joint) => entity.model.joints.get(joint),
            SensorMount::Link(_) => None,
        };
        let frame = match (definition.kind, joint) {
            (SensorKind::ForceTorque { axes: WrenchAxes::Child, .. }, Some(joint)) => link_frame(joint.child),
            (SensorKind::ForceTorque { axes: WrenchAxes::Parent, .. }, Some(joint)) => {
                link_frame(joint.parent)
            }
            _ => own_frame,
        };
        let joint = joint.map(|joint| joint.name.clone()).unwrap_or_default();
        Self { definition, frame, joint }
    }

    /// Returns the message of a reading; `None` if ROS has none for it.
    pub fn message(&self, reading: &LoggedReading) -> Option<SensorMessage> {
        Some(match (&reading.measured, &self.definition.kind) {
            (Measured::Imu(of), _) => SensorMessage::Imu(self.imu(reading, of)),
            (Measured::ForceTorque(of), _) => SensorMessage::Wrench(self.wrench(reading, of)),
            (Measured::Range(range), SensorKind::Range(limits)) => {
                SensorMessage::Range(self.range(reading, limits, *range))
            }
            (Measured::Lidar { ranges, period, columns: _ }, SensorKind::Lidar(scan)) => {
                let rolled = Rolled::new(reading, scan, *period);
                match scan.vertical.samples {
                    1 => SensorMessage::Scan(self.scan(&rolled, scan, ranges)),
                    _ => SensorMessage::Points(self.points(&rolled, scan, ranges)),
                }
            }
            (Measured::Encoder(of), _) => SensorMessage::Joint(self.joint(reading, of)),
            _ => return None,
        })
    }

    fn header(&self, reading: &LoggedReading) -> Header {
        Header { stamp: stamp(reading.at.sim_time), frame_id: self.frame.clone() }
    }

    /// Returns the variances of the noise of each sample, on the diagonal.
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

    fn imu(&self, reading: &LoggedReading, of: &ImuMeasurement) -> Imu {
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

    fn scan(&self, rolled: &Rolled, scan: &Scan, ranges: &[f32]) -> LaserScan {
        LaserScan {
            header: Header { stamp: stamp(rolled.first), frame_id: self.frame.clone() },
            angle_min: scan.horizontal.least as f32,
            angle_max: scan.horizontal.most as f32,
            angle_increment: scan.horizontal.increment() as f32,
            // All rays are simultaneous, except in a rolling scan.
            time_increment: rolled.between as f32,
            scan_time: rolled.period as f32,
            range_min: scan.range.least as f32,
            range_max: scan.range.most as f32,
            ranges: ranges.to_vec(),
            intensities: Vec::new(),
        }
    }

    /// Returns a point cloud, in which rays without a hit are NaN points.
    fn points(&self, rolled: &Rolled, scan: &Scan, ranges: &[f32]) -> PointCloud2 {
        let (width, height) = (scan.horizontal.samples, scan.vertical.samples);
        let fields = [("x", 0), ("y", 1), ("z", 2), ("time", 3)];
        let fields = if scan.rolling { &fields[..] } else { &fields[..3] };
        let point_step = NUMBER_BYTES * fields.len() as u32;
        let column = |index: u32| (scan.horizontal.angle(index).sin_cos(), rolled.between * f64::from(index));
        let about: Vec<((f64, f64), f64)> = (0..width).map(column).collect();
        let mut data = Vec::with_capacity(ranges.len() * point_step as usize);
        for (row, ranges) in (0..height).zip(ranges.chunks(about.len().max(1))) {
            let (rise, level) = scan.vertical.angle(row).sin_cos();
            for (((sine, cosine), time), range) in about.iter().zip(ranges) {
                let range = if range.is_finite() { f64::from(*range) } else { f64::NAN };
                for coordinate in [level * cosine, level * sine, rise] {
                    data.extend(((range * coordinate) as f32).to_le_bytes());
                }
                if scan.rolling {
                    data.extend((*time as f32).to_le_bytes());
                }
            }
        }
        let field = |&(name, number): &(&str, u32)| PointField {
            name: name.to_owned(),
            offset: NUMBER_BYTES * number,
            datatype: PointField::FLOAT32,
            count: 1,
        };
        PointCloud2 {
            header: Header { stamp: stamp(rolled.first), frame_id: self.frame.clone() },
            height,
            width,
            fields: fields.iter().map(field).collect(),
            is_bigendian: false,
            point_step,
            row_step: point_step * width,
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

fn vector(DVec3 { x, y, z }: DVec3) -> Vector3 {
    Vector3 { x, y, z }
}
