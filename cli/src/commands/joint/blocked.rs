//! The link that keeps a joint from its target.

use serde::Serialize;
use simd_client::proto::JointObstruction;

/// A link that touches a link which the joint moves, and pushes against the actuator.
#[derive(Clone, Serialize)]
pub(super) struct BlockedBy {
    robot: String,
    link: String,
    /// Blocked link of the joint's robot.
    own_link: String,
    /// Effort of the contact forces at the joint, N m or N.
    effort: f64,
}

impl BlockedBy {
    /// Returns the robot, and its link if it has several.
    pub(super) fn name(&self) -> String {
        if self.link.is_empty() { self.robot.clone() } else { format!("{}/{}", self.robot, self.link) }
    }
}

impl From<JointObstruction> for BlockedBy {
    fn from(found: JointObstruction) -> Self {
        let JointObstruction { joint: _, link: own_link, by_robot: robot, by_link: link, effort } = found;
        Self { robot, link, own_link, effort }
    }
}
