//! Commands that create and change constraints between links.

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

use crate::plain::{optional_pose3, vector3};

/// Constraint to create.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CreateConstraint {
    /// Name, unique in the world; `[A-Za-z0-9_-]+`. Empty means `constraint_1` or the next free one.
    pub name: String,
    /// Type of the constraint.
    pub kind: RequestedConstraint,
    /// First end.
    pub parent: RequestedEnd,
    /// Second end.
    pub child: RequestedEnd,
    /// Maximum force, N; for a gear the maximum effort on the child's joint, N m or N. `None` means no limit.
    pub max_force: Option<f64>,
    /// Maximum torque, N m. `None` means no limit.
    pub max_torque: Option<f64>,
    /// Whether it is removed once it needs more than the maximum, and is not limited to it.
    pub breaks: bool,
    /// Whether collisions between the two links are disabled.
    pub disable_collisions: bool,
}

/// Type of a requested constraint. Axes are in the frames of both ends, of any length but zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum RequestedConstraint {
    /// The frames coincide.
    Weld,
    /// The origins of the frames coincide.
    PointToPoint,
    /// Only a turn about the axis remains.
    Hinge {
        /// Axis of rotation of the child.
        #[serde(with = "vector3")]
        axis: DVec3,
    },
    /// Only a shift along the axis remains.
    Slide {
        /// Direction in which the child slides.
        #[serde(with = "vector3")]
        axis: DVec3,
    },
    /// Position of the child's joint = ratio * position of the parent's + offset.
    Gear {
        /// Ratio, in the units of the two joints.
        ratio: f64,
        /// Offset, rad or m. `None` means the present one.
        offset: Option<f64>,
    },
    /// The origins of the frames have a fixed distance.
    Distance {
        /// Distance, metres. `None` means the present one.
        length: Option<f64>,
        /// Whether they may be nearer.
        is_rope: bool,
    },
}

/// End of a constraint.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RequestedEnd {
    /// Name of the robot; empty means the world.
    pub robot: String,
    /// Link of the robot; empty means its root link. Not for gears.
    pub link: String,
    /// Joint of the robot with one axis, for gears.
    pub joint: String,
    /// Pose `link_from_frame`, or `world_from_frame`. `None` means the link's own frame for the parent, and
    /// the parent's present frame for the child.
    #[serde(with = "optional_pose3")]
    pub pose: Option<DPose3>,
}

/// New settings of a constraint; `None` leaves one unchanged.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChangeConstraint {
    /// Name of the constraint.
    pub name: String,
    /// Pose `link_from_frame` of the first end, or `world_from_frame`.
    #[serde(with = "optional_pose3")]
    pub parent_pose: Option<DPose3>,
    /// Pose `link_from_frame` of the second end, or `world_from_frame`.
    #[serde(with = "optional_pose3")]
    pub child_pose: Option<DPose3>,
    /// Maximum force as in [`CreateConstraint`]; may be infinite.
    pub max_force: Option<f64>,
    /// Maximum torque as in [`CreateConstraint`]; may be infinite.
    pub max_torque: Option<f64>,
    /// Whether it is removed once it needs more than the maximum.
    pub breaks: Option<bool>,
    /// Ratio of a gear.
    pub ratio: Option<f64>,
    /// Offset of a gear, rad or m.
    pub offset: Option<f64>,
    /// Length of a distance, metres.
    pub length: Option<f64>,
}
