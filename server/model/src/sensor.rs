//! What sensors measure and how well, in the words that a description and a client share: kinds, scans of rays, noise.

mod check;

use glamx::DPose3;
use serde::{Deserialize, Serialize};

pub use self::check::{BadSensor, check};

/// Sensors of a robot at the most.
pub const MAX_SENSORS_PER_ROBOT: usize = 64;

/// Bytes of a sensor's name at the most.
pub const MAX_SENSOR_NAME: usize = 128;

/// Rays of one scan at the most.
pub const MAX_SCAN_RAYS: u64 = 131_072;

/// Entries of a sensor's list of noise at the most: one for each channel.
pub const MAX_CHANNEL_NOISE: usize = 16;

/// A sensor that a description declares. Indices are those of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// As in the file, as far as a name on the wire may be so, and unlike that of any other of the robot.
    pub name: String,
    /// What it is on.
    pub on: SensorMount,
    /// `link_from_sensor`: in the frame of the link, or of the joint's child.
    pub pose: DPose3,
    /// Samples in a second of sim time, above 0. `None`: one each step.
    pub rate: Option<f64>,
    /// What it measures.
    pub kind: SensorKind,
    /// Of its channels; the later ones win. Those that are not named have none.
    pub noise: Vec<ChannelNoise>,
    /// What its noise is drawn from, with the names of robot and sensor.
    pub seed: u64,
}

/// What a sensor is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SensorMount {
    /// A link, by its index in the model.
    Link(usize),
    /// A joint, by its index in the model: of sensors of force and torque, and of encoders.
    Joint(usize),
}

/// What a sensor measures. A sensor's frame has x forwards, y to the left and z up, as ROS's REP 103 has it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SensorKind {
    /// Specific force, angular velocity and orientation.
    Imu,
    /// Force and torque that a joint carries, a fixed one too.
    ForceTorque {
        /// In whose axes.
        axes: WrenchAxes,
        /// Of which link on which.
        direction: WrenchDirection,
    },
    /// What touches a link, and how hard.
    Contact {
        /// It says that it is touched from this sum of normal forces on, N, at least 0. With 0, where any force is.
        threshold: f64,
    },
    /// One ray, along x.
    Range(RangeLimits),
    /// Many rays.
    Lidar(Scan),
    /// Where the sensor is in the world and how it moves: ground truth.
    LinkState,
    /// Position and velocity of a joint of one axis.
    Encoder {
        /// How far the joint moves where it turns round before the encoder goes along: rad or m, at least 0.
        backlash: f64,
    },
    /// Where the sensor is against where it began, and how it moves, in its own axes.
    Odometry,
    /// What a camera sees. Only declared: the core draws no pictures.
    Camera(Camera),
}

/// In whose axes a sensor of force and torque measures. The torque is about the sensor's origin in all of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum WrenchAxes {
    /// Of the joint's child, as SDFormat's `child`.
    #[default]
    Child,
    /// Of the joint's parent.
    Parent,
    /// Of the sensor.
    Sensor,
}

/// Whose force on whom.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum WrenchDirection {
    /// Of the child on the parent, as SDFormat's `child_to_parent`.
    #[default]
    ChildOnParent,
    /// Of the parent on the child.
    ParentOnChild,
}

/// What a ray can tell from nothing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RangeLimits {
    /// Metres; what is nearer is measured as minus infinity (REP 117).
    pub least: f64,
    /// Metres; where nothing is within it, plus infinity is measured.
    pub most: f64,
}

/// The rays of a lidar: each of the vertical angles with each of the horizontal ones. Ranges are listed line by line, from the
/// least vertical angle on, and in each from the least horizontal angle on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// About z, from x to y.
    pub horizontal: Sweep,
    /// Up from the plane of x and y.
    pub vertical: Sweep,
    /// Of each ray.
    pub range: RangeLimits,
    /// It turns once in a period: each column of rays is of its own time, the last of the moment of the sample. `false`: all are of
    /// that moment.
    pub rolling: bool,
}

/// Angles at equal distances, both ends among them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// At least 1; one is at `least`.
    pub samples: u32,
    /// rad.
    pub least: f64,
    /// rad, at least `least`.
    pub most: f64,
}

impl Sweep {
    /// One angle.
    pub const fn one(angle: f64) -> Self {
        Self { samples: 1, least: angle, most: angle }
    }

    /// The angle at an index, rad.
    pub fn angle(&self, index: u32) -> f64 {
        self.least + f64::from(index) * self.increment()
    }

    /// From one angle to the next, rad; 0 where there is one alone.
    pub fn increment(&self) -> f64 {
        match self.samples {
            0 | 1 => 0.0,
            samples => (self.most - self.least) / f64::from(samples - 1),
        }
    }
}

impl Scan {
    /// How many rays there are.
    pub fn rays(&self) -> u64 {
        u64::from(self.horizontal.samples) * u64::from(self.vertical.samples)
    }
}

/// A pinhole camera that looks along x.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// What it makes pictures of.
    pub picture: Picture,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// rad.
    pub horizontal_field_of_view: f64,
    /// Metres: what is nearer is not seen.
    pub near: f64,
    /// Metres: what is farther is not seen.
    pub far: f64,
}

/// What a camera makes pictures of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Picture {
    /// Colours.
    #[default]
    Color,
    /// Distances.
    Depth,
    /// Both.
    ColorAndDepth,
    /// Which robot and link.
    Segmentation,
}

/// The noise of channels of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelNoise {
    /// Which quantity.
    pub channels: Channels,
    /// Which part of it: 0, 1 or 2 for x, y or z. `None`: all, each with noise of its own.
    pub axis: Option<u8>,
    /// What is added.
    pub noise: Noise,
}

/// A quantity that a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Channels {
    /// Of an IMU: specific force, m/s^2.
    LinearAcceleration,
    /// Of an IMU, a link's state and odometry, rad/s.
    AngularVelocity,
    /// Of an IMU, a link's state and odometry: a small turn about the sensor's axes, rad.
    Orientation,
    /// Of sensors of force and torque and of contact: N.
    Force,
    /// Of sensors of force and torque: N m.
    Torque,
    /// Of a link's state and odometry: m.
    Position,
    /// Of a link's state and odometry: m/s.
    LinearVelocity,
    /// Of an encoder: rad or m.
    JointPosition,
    /// Of an encoder: rad/s or m/s.
    JointVelocity,
    /// Of a range finder and a lidar: m. Bias and walk are one for all rays.
    Range,
}

/// What is added to a true value, and what is left of the sum. Units are those of the channel.
///
/// `measured = round((true + bias + walk + normal) / quantum) * quantum`
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Of what is drawn anew for each sample from a normal distribution about 0; at least 0.
    pub standard_deviation: f64,
    /// Mean of the bias, which is drawn once.
    pub bias_mean: f64,
    /// Standard deviation of the bias; at least 0.
    pub bias_standard_deviation: f64,
    /// What the walk grows by: its standard deviation after one second, at least 0. After t seconds it is
    /// `random_walk * sqrt(t)`, while t is small beside the correlation time.
    pub random_walk: f64,
    /// Seconds after which the walk is forgotten (a first-order Gauss-Markov process), above 0. `None`: never.
    pub correlation_time: Option<f64>,
    /// Values are whole multiples of it; 0: any. An encoder's resolution.
    pub quantum: f64,
    /// The part of samples that are lost, 0 to 1. A lost ray is NaN; of other kinds the whole sample is lost, and of
    /// several channels the largest counts.
    pub dropout: f64,
}

impl SensorKind {
    /// The quantities that it measures, with the number of the numbers of each; of a range finder and a lidar, one stands for all rays.
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

    /// How many rays a reading of it takes.
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

    /// Whether it is on a joint, and not on a link.
    pub fn is_of_joint(&self) -> bool {
        matches!(self, Self::ForceTorque { .. } | Self::Encoder { .. })
    }

    /// In one word, as a name of one that has none begins.
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
    /// In words, for people.
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

/// Numbers of a sensor that have noise, at the most.
pub const MAX_CHANNELS: usize = 12;
