//! Measurements of sensors, from only a published state, on any thread.
//!
//! * `reading`: readings.
//! * `motion`: inertial units, states of links, odometry, forces and torques of joints.
//! * `touch`: contact.
//! * `scan`: rays.

mod motion;
mod reading;
mod scan;
mod touch;

use std::sync::Arc;

use simd_model::sensor::{Channels, SensorKind, SensorMount};

use self::motion::RobotMotion;
pub use self::reading::{
    ContactMeasurement, ContactPartner, EncoderMeasurement, ImuMeasurement, MAX_CONTACT_PARTNERS,
    Measurement, MotionMeasurement, SensorReading, WrenchMeasurement,
};
use super::published_state::PublishedState;
use super::sensors::{DueSample, SampleNoise};
use crate::collision::scene::Scene;

impl PublishedState {
    /// Appends the readings of samples taken by the step to this state, in their order. Lost samples and
    /// those of another step have none. Intermediate results for a robot, or for all shapes, are computed
    /// once for consecutive samples.
    pub fn readings(&self, due: &[DueSample], readings: &mut Vec<SensorReading>) {
        let mut measuring = Measuring::new(self);
        readings.extend(due.iter().filter_map(|sample| measuring.reading(sample, &|| false)));
    }

    /// Returns the reading of one sample taken by the step to this state. Returns `None` as soon as
    /// `is_cancelled`, which is called before each robot and each line of rays.
    pub fn reading(&self, due: &DueSample, is_cancelled: &dyn Fn() -> bool) -> Option<SensorReading> {
        Measuring::new(self).reading(due, is_cancelled)
    }
}

/// Intermediate results of the previous sample, which the next one may reuse.
struct Measuring<'s> {
    state: &'s PublishedState,
    motion: Option<RobotMotion>,
    scene: Option<Scene>,
}

impl<'s> Measuring<'s> {
    fn new(state: &'s PublishedState) -> Self {
        Self { state, motion: None, scene: None }
    }

    fn reading(&mut self, due: &DueSample, is_cancelled: &dyn Fn() -> bool) -> Option<SensorReading> {
        let state = self.state;
        let noise = SampleNoise::new(due);
        if due.at != state.at || noise.is_lost() {
            return None;
        }
        let measurement = self.measurement(due, &noise, is_cancelled)?;
        Some(SensorReading {
            id: due.id,
            definition: Arc::clone(&due.definition),
            robot: due.robot,
            world: Arc::clone(&state.world),
            sample: due.sample,
            at: due.at,
            period: due.period,
            measurement,
        })
    }

    fn measurement(
        &mut self,
        due: &DueSample,
        noise: &SampleNoise<'_>,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Option<Measurement> {
        let (state, definition) = (self.state, &*due.definition);
        Some(match &definition.kind {
            SensorKind::Imu => Measurement::Imu(self.motion(due.robot)?.imu(due, noise)?),
            SensorKind::ForceTorque { axes, direction } => {
                let SensorMount::Joint(joint) = definition.on else { return None };
                let on_child = self.motion(due.robot)?.reaction(state, due, joint)?;
                let motion = self.motion(due.robot)?;
                let wrench = motion.wrench(state, due, joint, (*axes, *direction), on_child)?;
                Measurement::ForceTorque(WrenchMeasurement {
                    force: noise.vector(Channels::Force, wrench.force),
                    torque: noise.vector(Channels::Torque, wrench.torque),
                })
            }
            SensorKind::Contact { threshold } => {
                Measurement::Contact(touch::contact(state, due, *threshold, noise))
            }
            SensorKind::LinkState => Measurement::LinkState(self.motion(due.robot)?.link_state(due, noise)?),
            SensorKind::Odometry => Measurement::Odometry(self.motion(due.robot)?.odometry(due, noise)?),
            SensorKind::Encoder { backlash } => Measurement::Encoder(encoder(state, due, *backlash, noise)?),
            SensorKind::Range(limits) => {
                let rays = self.rays(due, is_cancelled)?;
                Measurement::Range(rays.range(limits, noise))
            }
            SensorKind::Lidar(scan) => {
                let rays = self.rays(due, is_cancelled)?;
                Measurement::Lidar(rays.scan(scan, noise, is_cancelled)?)
            }
            SensorKind::Camera(_) => return None,
        })
    }

    fn motion(&mut self, robot: usize) -> Option<&mut RobotMotion> {
        if self.motion.as_ref().is_none_or(|motion| motion.robot != robot) {
            self.motion = Some(RobotMotion::new(self.state, robot)?);
        }
        self.motion.as_mut()
    }

    /// Returns the rays of a sensor, from its pose.
    fn rays(&mut self, due: &DueSample, is_cancelled: &dyn Fn() -> bool) -> Option<scan::Rays<'_>> {
        let entity = self.state.world.entities.get(due.robot)?;
        let body = entity.tree.links.get(due.definition.link)?.body;
        let motion = self.motion(due.robot)?.sensor(due)?;
        let state = self.state;
        let scene = self.scene.get_or_insert_with(|| state.scene(is_cancelled));
        let own = (due.robot, body);
        (!is_cancelled()).then_some(scan::Rays { scene, motion, period: due.period, own })
    }
}

/// Returns the position of the joint or, with backlash, of the shaft, which stands still while the joint
/// takes up the play.
fn encoder(
    state: &PublishedState,
    due: &DueSample,
    backlash: f64,
    noise: &SampleNoise<'_>,
) -> Option<EncoderMeasurement> {
    let SensorMount::Joint(joint) = due.definition.on else { return None };
    let entity = state.world.entities.get(due.robot)?;
    let position = entity.positions.start + entity.joint_positions.get(joint)?.start;
    let velocity = entity.velocities.start + entity.joint_velocities.get(joint)?.start;
    let (mut position, mut velocity) = (*state.positions.get(position)?, *state.velocities.get(velocity)?);
    if backlash > 0.0 {
        position = due.shaft.position;
        velocity = if due.shaft.is_driven { velocity } else { 0.0 };
    }
    Some(EncoderMeasurement {
        position: noise.scalar(Channels::JointPosition, position),
        velocity: noise.scalar(Channels::JointVelocity, velocity),
    })
}
