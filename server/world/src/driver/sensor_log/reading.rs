//! A reading as it is kept. What it is of is named, so that it keeps no robot in memory that is gone, and a copy of it is
//! small.

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
    /// Larger than that of every reading of a sensor of this name before.
    pub sequence: u64,
    /// Counts the sensor's samples from 1, lost ones too. Begins anew where an epoch does.
    pub sample: u64,
    /// Of the state that was measured.
    pub at: Moment,
    /// When that state was published.
    pub wall_time: SystemTime,
    /// Of that state.
    pub state_sequence: u64,
    /// What was measured.
    pub measured: Measured,
}

/// What was measured, by kind: see [`Measurement`].
#[derive(Clone, Debug, PartialEq)]
pub enum Measured {
    /// Of an inertial unit.
    Imu(ImuMeasurement),
    /// Of a sensor of force and torque.
    ForceTorque(WrenchMeasurement),
    /// Of a sensor of contact.
    Contact(Arc<ContactReading>),
    /// Of a range finder, metres.
    Range(f64),
    /// Of a lidar.
    Lidar {
        /// Metres, row by row.
        ranges: Arc<[f32]>,
        /// Ranges in a row.
        columns: u32,
        /// From one scan to the next, seconds.
        period: f64,
    },
    /// Of a link's state.
    LinkState(MotionMeasurement),
    /// Of an encoder.
    Encoder(EncoderMeasurement),
    /// Of odometry.
    Odometry(MotionMeasurement),
}

/// [`ContactMeasurement`] with the names of who touches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactReading {
    /// The sum of all normal forces is above the sensor's threshold.
    pub touching: bool,
    /// On the link, world axes, N.
    pub force: DVec3,
    /// The sum of the normal forces, N.
    pub normal_force: f64,
    /// Who touches it.
    pub partners: Vec<NamedContactPartner>,
    /// Those that are not listed.
    pub more_partners: usize,
}

/// [`ContactPartner`] with its names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NamedContactPartner {
    /// Its robot.
    pub robot: String,
    /// Its name.
    pub link: String,
    /// Of it on the sensor's link, world axes, N.
    pub force: DVec3,
    /// The sum of the normal forces of its points, N.
    pub normal_force: f64,
    /// How far the two overlap at the most, metres; negative where they are about to touch.
    pub depth: f64,
    /// Points at which they touch.
    pub points: usize,
}

/// When a state was published, and its number.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfState {
    pub(super) wall_time: SystemTime,
    pub(super) sequence: u64,
}

impl LoggedReading {
    /// As it is kept; the number is given by who keeps it.
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

    /// About how much memory it takes.
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
