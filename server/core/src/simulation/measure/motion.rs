//! Measurements from a robot's motion: inertial units, states of links, odometry, forces and torques of
//! joints.

use glamx::{DPose3, DQuat, DVec3};
use simd_model::sensor::{Channels, WrenchAxes, WrenchDirection};

use super::reading::{ImuMeasurement, MotionMeasurement, WrenchMeasurement};
use crate::dynamics::link_motion::LinkMotion;
use crate::simulation::published_state::PublishedState;
use crate::simulation::sensors::{DueSample, SampleNoise};

/// Motion of a robot at a moment.
pub(super) struct RobotMotion {
    pub(super) robot: usize,
    /// `world_from_link` of each link.
    pub(super) poses: Vec<DPose3>,
    /// Motion of each link, in the base's axes.
    links: Vec<LinkMotion>,
    world_from_base: DQuat,
    /// Force and torque of each joint, once requested.
    reactions: Option<Vec<[DVec3; 2]>>,
}

/// Pose and motion of a sensor, world axes.
pub(super) struct SensorMotion {
    pub(super) pose: DPose3,
    linear: DVec3,
    angular: DVec3,
    acceleration: DVec3,
}

impl SensorMotion {
    /// Returns `world_from_sensor` some seconds before, as if its twist had been constant in its own axes.
    /// This is motion on a screw (Murray, Li and Sastry 1994, "A mathematical introduction to robotic
    /// manipulation", equation 2.36).
    pub(super) fn before(&self, seconds: f64) -> DPose3 {
        let sensor_from_world = self.pose.rotation.inverse();
        let turn = sensor_from_world * self.angular * -seconds;
        let way = sensor_from_world * self.linear * -seconds;
        let angle = turn.length();
        // (1 - cos x) / x^2 and (x - sin x) / x^3, whose differences cancel if x is small.
        let (first, second) = if angle < 1e-4 {
            (0.5, 1.0 / 6.0)
        } else {
            ((1.0 - angle.cos()) / (angle * angle), (angle - angle.sin()) / angle.powi(3))
        };
        let across = turn.cross(way);
        let way = way + across * first + turn.cross(across) * second;
        self.pose * DPose3::from_parts(way, DQuat::from_scaled_axis(turn))
    }
}

impl RobotMotion {
    pub(super) fn new(state: &PublishedState, robot: usize) -> Option<Self> {
        let (poses, links) = (state.link_poses(robot)?, state.link_motions(robot)?);
        let world_from_base = state.world_from_base(robot)?;
        Some(Self { robot, poses, links, world_from_base, reactions: None })
    }

    pub(super) fn sensor(&self, due: &DueSample) -> Option<SensorMotion> {
        let definition = &*due.definition;
        let (pose, link) = (self.poses.get(definition.link)?, self.links.get(definition.link)?);
        let reach = link.rotation * definition.pose.translation;
        Some(SensorMotion {
            pose: *pose * definition.pose,
            linear: self.world_from_base * link.velocity_at(reach),
            angular: self.world_from_base * link.angular,
            acceleration: self.world_from_base * link.acceleration_at(reach),
        })
    }

    /// Returns the inertial measurement. The specific force is a - g, in the sensor's axes, as shown by a
    /// mass on springs (Titterton and Weston, "Strapdown inertial navigation technology", 2.2).
    pub(super) fn imu(&self, due: &DueSample, noise: &SampleNoise<'_>) -> Option<ImuMeasurement> {
        let SensorMotion { pose, linear: _, angular, acceleration } = self.sensor(due)?;
        let sensor_from_world = pose.rotation.inverse();
        let specific_force = sensor_from_world * (acceleration - due.gravity);
        Some(ImuMeasurement {
            linear_acceleration: noise.vector(Channels::LinearAcceleration, specific_force),
            angular_velocity: noise.vector(Channels::AngularVelocity, sensor_from_world * angular),
            orientation: noise.orientation(pose.rotation),
        })
    }

    pub(super) fn link_state(&self, due: &DueSample, noise: &SampleNoise<'_>) -> Option<MotionMeasurement> {
        let SensorMotion { pose, linear, angular, acceleration: _ } = self.sensor(due)?;
        Some(with_noise(pose, linear, angular, noise))
    }

    pub(super) fn odometry(&self, due: &DueSample, noise: &SampleNoise<'_>) -> Option<MotionMeasurement> {
        let SensorMotion { pose, linear, angular, acceleration: _ } = self.sensor(due)?;
        let sensor_from_world = pose.rotation.inverse();
        let start_from_sensor = due.start.inverse() * pose;
        Some(with_noise(start_from_sensor, sensor_from_world * linear, sensor_from_world * angular, noise))
    }

    /// Returns force and torque of a joint's parent on its child, in the child's frame and about its origin.
    pub(super) fn reaction(
        &mut self,
        state: &PublishedState,
        due: &DueSample,
        joint: usize,
    ) -> Option<[DVec3; 2]> {
        if self.reactions.is_none() {
            self.reactions = state.reactions_of(self.robot, &self.poses, &self.links, due.gravity);
        }
        self.reactions.as_ref()?.get(joint).copied()
    }

    /// Returns force and torque as the sensor measures them: about its origin, in the configured axes and
    /// direction.
    pub(super) fn wrench(
        &self,
        state: &PublishedState,
        due: &DueSample,
        joint: usize,
        (axes, direction): (WrenchAxes, WrenchDirection),
        [force, torque]: [DVec3; 2],
    ) -> Option<WrenchMeasurement> {
        let joint = state.world.entities.get(self.robot)?.model.joints.get(joint)?;
        let child_from_sensor = due.definition.pose;
        let torque = torque - child_from_sensor.translation.cross(force);
        let turn = match axes {
            WrenchAxes::Child => DQuat::IDENTITY,
            WrenchAxes::Parent => {
                let [parent, child] = [joint.parent, joint.child].map(|link| self.poses.get(link));
                parent?.rotation.inverse() * child?.rotation
            }
            WrenchAxes::Sensor => child_from_sensor.rotation.inverse(),
        };
        let sign = match direction {
            WrenchDirection::ParentOnChild => 1.0,
            WrenchDirection::ChildOnParent => -1.0,
        };
        Some(WrenchMeasurement { force: turn * force * sign, torque: turn * torque * sign })
    }
}

fn with_noise(pose: DPose3, linear: DVec3, angular: DVec3, noise: &SampleNoise<'_>) -> MotionMeasurement {
    let position = noise.vector(Channels::Position, pose.translation);
    MotionMeasurement {
        pose: DPose3::from_parts(position, noise.orientation(pose.rotation)),
        linear: noise.vector(Channels::LinearVelocity, linear),
        angular: noise.vector(Channels::AngularVelocity, angular),
    }
}
