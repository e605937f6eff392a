//! Quantities and errors of sensors, in the terms that descriptions and clients share: kinds, scans of rays,
//! noise.

mod check;

use glamx::DPose3;
use serde::{Deserialize, Serialize};

pub use self::check::{BadSensor, check};

/// Maximum number of sensors of a robot.
pub const MAX_SENSORS_PER_ROBOT: usize = 64;

/// Maximum bytes of a sensor's name.
pub const MAX_SENSOR_NAME: usize = 128;

/// Maximum rays of one scan.
pub const MAX_SCAN_RAYS: u64 = 131_072;

/// Maximum entries in a sensor's list of noise: one for each channel.
pub const MAX_CHANNEL_NOISE: usize = 16;

/// A sensor that a description declares. Indices refer to the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// Name in the file, as far as the wire allows; unique within the robot.
    pub name: String,
    /// Link or joint of the sensor.
    pub on: SensorMount,
    /// `link_from_sensor`: in the frame of the link, or of the joint's child.
    pub pose: DPose3,
    /// Samples per second of sim time, above 0. `None`: one each step.
    pub rate: Option<f64>,
    /// Quantity that it measures.
    pub kind: SensorKind,
    /// Noise of its channels; later entries win. Other channels have none.
    pub noise: Vec<ChannelNoise>,
    /// Seed of its noise, with the names of robot and sensor.
    pub seed: u64,
}

/// Link or joint of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SensorMount {
    /// A link, by its index in the model.
    Link(usize),
    /// A joint, by its index in the model: for force-torque sensors and encoders.
    Joint(usize),
}

/// Quantity that a sensor measures. A sensor's frame has x forwards, y to the left and z up, as in ROS's REP
/// 103.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SensorKind {
    /// Specific force, angular velocity and orientation.
    Imu,
    /// Force and torque that a joint carries, including fixed joints.
    ForceTorque {
        /// Axes of the result.
        axes: WrenchAxes,
        /// Direction of the force.
        direction: WrenchDirection,
    },
    /// Contacts of a link, with their forces.
    Contact {
        /// Threshold on the sum of normal forces, N, at least 0; above it, the link counts as touched. 0: any
        /// force.
        threshold: f64,
    },
    /// One ray, along x.
    Range(RangeLimits),
    /// Many rays.
    Lidar(Scan),
    /// World pose and twist of the sensor: ground truth.
    LinkState,
    /// Position and velocity of a joint of one axis.
    Encoder {
        /// Motion of the joint after it reverses until the encoder follows: rad or m, at least 0.
        backlash: f64,
    },
    /// Pose relative to the sensor's start, and twist, in its own axes.
    Odometry,
    /// Pictures of a camera. Only declared: the core draws none.
    Camera(Camera),
}

/// Axes of a force-torque sensor. The torque is about the sensor's origin in all of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum WrenchAxes {
    /// Axes of the joint's child, as SDFormat's `child`.
    #[default]
    Child,
    /// Axes of the joint's parent.
    Parent,
    /// Axes of the sensor.
    Sensor,
}

/// Direction of a measured force.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum WrenchDirection {
    /// Force of the child on the parent, as SDFormat's `child_to_parent`.
    #[default]
    ChildOnParent,
    /// Force of the parent on the child.
    ParentOnChild,
}

/// Limits of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RangeLimits {
    /// Metres; nearer surfaces read minus infinity (REP 117).
    pub least: f64,
    /// Metres; rays without a hit within it read plus infinity.
    pub most: f64,
}

/// The rays of a lidar: each vertical angle with each horizontal one. Ranges are listed row by row, from the
/// least vertical angle on; each row from the least horizontal angle on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// Angles about z, from x to y.
    pub horizontal: Sweep,
    /// Angles up from the plane of x and y.
    pub vertical: Sweep,
    /// Limits of each ray.
    pub range: RangeLimits,
    /// True: the lidar turns once in a period. Each column of rays has its own time, and the last one has the
    /// time of the sample. False: all rays have that time.
    pub rolling: bool,
}

/// Equally spaced angles, including both ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// At least 1; a single sample is at `least`.
    pub samples: u32,
    /// rad.
    pub least: f64,
    /// rad, at least `least`.
    pub most: f64,
}

impl Sweep {
    /// Makes a single angle.
    pub const fn one(angle: f64) -> Self {
        Self { samples: 1, least: angle, most: angle }
    }

    /// Returns the angle at an index, rad.
    pub fn angle(&self, index: u32) -> f64 {
        self.least + f64::from(index) * self.increment()
    }

    /// Returns the step between angles, rad; 0 for a single angle.
    pub fn increment(&self) -> f64 {
        match self.samples {
            0 | 1 => 0.0,
            samples => (self.most - self.least) / f64::from(samples - 1),
        }
    }
}

impl Scan {
    /// Returns the number of rays.
    pub fn rays(&self) -> u64 {
        u64::from(self.horizontal.samples) * u64::from(self.vertical.samples)
    }
}

/// A pinhole camera that looks along x.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Planes of its pictures.
    pub picture: Picture,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// rad.
    pub horizontal_field_of_view: f64,
    /// Metres: nearer surfaces are not seen.
    pub near: f64,
    /// Metres: farther surfaces are not seen.
    pub far: f64,
}

/// Planes of a camera's pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Picture {
    /// Colours.
    #[default]
    Color,
    /// Distances.
    Depth,
    /// Both.
    ColorAndDepth,
    /// Robot and link of each pixel.
    Segmentation,
}

/// Noise of a sensor's channels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelNoise {
    /// The quantity.
    pub channels: Channels,
    /// Component: 0, 1 or 2 for x, y or z. `None`: all, each with independent noise.
    pub axis: Option<u8>,
    /// The noise.
    pub noise: Noise,
}

/// A quantity that a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Channels {
    /// IMU: specific force, m/s^2.
    LinearAcceleration,
    /// IMU, link state and odometry, rad/s.
    AngularVelocity,
    /// IMU, link state and odometry: a small turn about the sensor's axes, rad.
    Orientation,
    /// Force-torque and contact sensors: N.
    Force,
    /// Force-torque sensors: N m.
    Torque,
    /// Link state and odometry: m.
    Position,
    /// Link state and odometry: m/s.
    LinearVelocity,
    /// Encoder: rad or m.
    JointPosition,
    /// Encoder: rad/s or m/s.
    JointVelocity,
    /// Range finder and lidar: m. All rays share bias and walk.
    Range,
}

/// Errors of a channel, in its units.
///
/// `measured = round((true + bias + walk + normal) / quantum) * quantum`
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Standard deviation of white noise, drawn for each sample from a normal distribution about 0; at least
    /// 0.
    pub standard_deviation: f64,
    /// Mean of the bias, which is drawn once.
    pub bias_mean: f64,
    /// Standard deviation of the bias; at least 0.
    pub bias_standard_deviation: f64,
    /// Standard deviation of the walk after one second, at least 0. After t seconds it is `random_walk *
    /// sqrt(t)`, while t is small compared with the correlation time.
    pub random_walk: f64,
    /// Seconds after which the walk is forgotten (a first-order Gauss-Markov process), above 0. `None`:
    /// never.
    pub correlation_time: Option<f64>,
    /// Values are whole multiples of it; 0: any. An encoder's resolution.
    pub quantum: f64,
    /// Probability that a sample is lost, 0 to 1. A lost ray is NaN. On other channels the whole sample is
    /// lost, and the largest value of several channels counts.
    pub dropout: f64,
}

impl SensorKind {
    /// Returns the quantities that it measures, each with the number of its values. For a range finder and a
    /// lidar, one value stands for all rays.
    pub fn channels(&self) -> &'static [(Channels, usize)] {
        match self {
            Self::Imu => &[
                (Channels::LinearAcceleration, 3),
                (Channels::AngularVelocity, 3),
                (Channels::Orientation, 3),
            ],
            Self::ForceTorque { .. } => &[(Channels::Force, 3), (Channels::Torque, 3)],
            Self::Contact { .. } => &[(Channels::Force, 3)],
            Self::Range(_) | Self::Lidar(_) => &[(Channels::Range, 1)],
            Self::LinkState | Self::Odometry => &[
                (Channels::Position, 3),
                (Channels::Orientation, 3),
                (Channels::LinearVelocity, 3),
                (Channels::AngularVelocity, 3),
            ],
            Self::Encoder { .. } => &[(Channels::JointPosition, 1), (Channels::JointVelocity, 1)],
            Self::Camera(_) => &[],
        }
    }

    /// Returns the number of rays of a reading.
    pub fn rays(&self) -> u64 {
        match self {
            Self::Range(_) => 1,
            Self::Lidar(scan) => scan.rays(),
            Self::Imu
            | Self::ForceTorque { .. }
            | Self::Contact { .. }
            | Self::LinkState
            | Self::Encoder { .. }
            | Self::Odometry
            | Self::Camera(_) => 0,
        }
    }

    /// Returns whether it is on a joint, and not on a link.
    pub fn is_of_joint(&self) -> bool {
        matches!(self, Self::ForceTorque { .. } | Self::Encoder { .. })
    }

    /// Returns its word, with which the names of unnamed sensors begin.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Imu => "imu",
            Self::ForceTorque { .. } => "force_torque",
            Self::Contact { .. } => "contact",
            Self::Range(_) => "range",
            Self::Lidar(_) => "lidar",
            Self::LinkState => "link_state",
            Self::Encoder { .. } => "encoder",
            Self::Odometry => "odometry",
            Self::Camera(_) => "camera",
        }
    }
}

impl Channels {
    /// Returns its words, for people.
    pub fn word(self) -> &'static str {
        match self {
            Self::LinearAcceleration => "linear acceleration",
            Self::AngularVelocity => "angular velocity",
            Self::Orientation => "orientation",
            Self::Force => "force",
            Self::Torque => "torque",
            Self::Position => "position",
            Self::LinearVelocity => "linear velocity",
            Self::JointPosition => "joint position",
            Self::JointVelocity => "joint velocity",
            Self::Range => "range",
        }
    }
}

/// Maximum number of a sensor's values with noise.
pub const MAX_CHANNELS: usize = 12;
