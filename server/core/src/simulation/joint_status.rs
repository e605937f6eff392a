//! Status of a robot's joints, from only a published state.

use super::published_state::{Mode, PublishedState};
use super::robot_settings::JointSettings;

/// Status of a joint: its settings, and the mode of its actuator.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointStatus {
    /// Mode of its actuator; for a planar joint of its first axis.
    pub mode: Mode,
    /// Stiffness and damping in force.
    pub gains: (f64, f64),
    /// Settings by commands.
    pub settings: JointSettings,
}

impl PublishedState {
    /// Returns the status of the joints of the robot at this index, in the model's order.
    pub fn joint_status(&self, robot: usize) -> Option<Vec<JointStatus>> {
        let entity = self.world.entities.get(robot)?;
        let modes = self.modes.get(entity.velocities.clone())?;
        let gains = self.gains.get(entity.velocities.clone())?;
        let joints = self.settings.get(robot)?.joints.iter().zip(&entity.joint_velocities);
        let status = |(settings, axes): (&JointSettings, &std::ops::Range<usize>)| {
            let first = axes.clone().next();
            JointStatus {
                mode: first.and_then(|axis| modes.get(axis)).copied().unwrap_or_default(),
                gains: first.and_then(|axis| gains.get(axis)).copied().unwrap_or_default(),
                settings: settings.clone(),
            }
        };
        Some(joints.map(status).collect())
    }
}
