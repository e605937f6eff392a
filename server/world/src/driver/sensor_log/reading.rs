//! A kept reading. It names robots and links instead of holding them, so that it keeps no deleted robot in
//! memory, and a copy is small.

use std::sync::Arc;
use std::time::SystemTime;

use glamx::DVec3;
use simd_core::Moment;
use simd_core::simulation::measure::{
    ContactMeasurement, ContactPartner, EncoderMeasurement, ImuMeasurement, Measurement, MotionMeasurement,
    SensorReading, WrenchMeasurement,
};
use simd_core::simulation::published_state::WorldLayout;
use simd_model::sensor::SensorKind;

/// A reading of a sensor, with its number.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedReading {
    /// Number, larger than in every earlier reading of a sensor of this name.
    pub sequence: u64,
    /// Count of the sensor's samples from 1, lost ones included. It restarts with each epoch.
    pub sample: u64,
    /// Moment of the measured state.
    pub at: Moment,
    /// Wall time at which that state was published.
    pub wall_time: SystemTime,
    /// Sequence of that state.
    pub state_sequence: u64,
    /// Measured values.
    pub measured: Measured,
}

/// Measured values by kind: see [`Measurement`].
#[derive(Clone, Debug, PartialEq)]
pub enum Measured {
    /// Inertial measurement unit.
    Imu(ImuMeasurement),
    /// Force-torque sensor.
    ForceTorque(WrenchMeasurement),
    /// Contact sensor.
    Contact(Arc<ContactReading>),
    /// Range finder, metres.
    Range(f64),
    /// Lidar.
    Lidar {
        /// Ranges row by row, metres.
        ranges: Arc<[f32]>,
        /// Number of ranges in a row.
        columns: u32,
        /// Time from one scan to the next, seconds.
        period: f64,
    },
    /// State of a link.
    LinkState(MotionMeasurement),
    /// Encoder.
    Encoder(EncoderMeasurement),
    /// Odometry.
    Odometry(MotionMeasurement),
}

/// [`ContactMeasurement`] with the names of touching links.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactReading {
    /// Whether the sum of all normal forces is above the sensor's threshold.
    pub touching: bool,
    /// Force on the link, world axes, N.
    pub force: DVec3,
    /// Sum of the normal forces, N.
    pub normal_force: f64,
    /// Touching links.
    pub partners: Vec<NamedContactPartner>,
    /// Number of touching links that are not listed.
    pub more_partners: usize,
}

/// [`ContactPartner`] with its names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NamedContactPartner {
    /// Name of the robot.
    pub robot: String,
    /// Name of the link.
    pub link: String,
    /// Its force on the sensor's link, world axes, N.
    pub force: DVec3,
    /// Sum of the normal forces of its points, N.
    pub normal_force: f64,
    /// Maximum penetration depth, metres; negative before they touch.
    pub depth: f64,
    /// Number of contact points.
    pub points: usize,
}

/// Publication time and sequence of a state.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfState {
    pub(super) wall_time: SystemTime,
    pub(super) sequence: u64,
}

impl LoggedReading {
    /// Makes a kept reading; the log assigns its number.
    pub(super) fn new(reading: SensorReading, of: OfState) -> Self {
        let SensorReading { id: _, definition, robot: _, world, sample, at, period, measurement } = reading;
        let measured = match measurement {
            Measurement::Imu(imu) => Measured::Imu(imu),
            Measurement::ForceTorque(wrench) => Measured::ForceTorque(wrench),
            Measurement::Contact(contact) => Measured::Contact(Arc::new(touch(contact, &world))),
            Measurement::Range(range) => Measured::Range(range),
            Measurement::Lidar(ranges) => {
                let columns = match definition.kind {
                    SensorKind::Lidar(scan) => scan.horizontal.samples,
                    _ => 1,
                };
                Measured::Lidar { ranges: ranges.into(), columns, period }
            }
            Measurement::LinkState(motion) => Measured::LinkState(motion),
            Measurement::Encoder(encoder) => Measured::Encoder(encoder),
            Measurement::Odometry(motion) => Measured::Odometry(motion),
        };
        let OfState { wall_time, sequence: state_sequence } = of;
        Self { sequence: 0, sample, at, wall_time, state_sequence, measured }
    }

    /// Returns its approximate memory, bytes.
    pub(crate) fn bytes(&self) -> usize {
        let beside = match &self.measured {
            Measured::Contact(touch) => {
                let names = |partner: &NamedContactPartner| partner.robot.len() + partner.link.len();
                let names: usize = touch.partners.iter().map(names).sum();
                size_of::<ContactReading>() + touch.partners.len() * size_of::<NamedContactPartner>() + names
            }
            Measured::Lidar { ranges, .. } => size_of_val(&**ranges),
            _ => 0,
        };
        size_of::<Self>() + beside
    }
}

fn touch(of: ContactMeasurement, world: &WorldLayout) -> ContactReading {
    let ContactMeasurement { touching, force, normal_force, partners, more_partners } = of;
    let partner = |of: ContactPartner| {
        let ContactPartner { robot, link, force, normal_force, depth, points } = of;
        let entity = world.entities.get(robot);
        NamedContactPartner {
            robot: entity.map(|entity| entity.name.clone()).unwrap_or_default(),
            link: entity
                .and_then(|entity| entity.model.links.get(link))
                .map(|link| link.name.clone())
                .unwrap_or_default(),
            force,
            normal_force,
            depth,
            points,
        }
    };
    let partners = partners.into_iter().map(partner).collect();
    ContactReading { touching, force, normal_force, partners, more_partners }
}
