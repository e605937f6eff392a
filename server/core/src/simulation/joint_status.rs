//! What holds for the joints of a robot, found from a published state alone.

use super::published_state::{Mode, PublishedState};
use super::robot_settings::JointSettings;

/// What holds for a joint: its settings, and what its actuator does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointStatus {
    /// What its actuator does; of a planar joint's three axes that of the first.
    pub mode: Mode,
    /// Stiffness and damping in force.
    pub gains: (f64, f64),
    /// Set by commands.
    pub settings: JointSettings,
}

impl PublishedState {
    /// What holds for the joints of the robot at this index, in the model's order.
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
