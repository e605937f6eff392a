//! Commands that make and change constraints between links.

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

use crate::plain::{optional_pose3, vector3};

/// A constraint to make.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CreateConstraint {
    /// Unique in the world; `[A-Za-z0-9_-]+`. Empty: `constraint_1` or the next one that is free.
    pub name: String,
    /// What it asks for.
    pub kind: RequestedConstraint,
    /// The first end.
    pub parent: RequestedEnd,
    /// The second one.
    pub child: RequestedEnd,
    /// N; of a gear the effort on the child's joint, N m or N. `None`: no limit.
    pub max_force: Option<f64>,
    /// N m. `None`: no limit.
    pub max_torque: Option<f64>,
    /// It goes where it would need more, instead of doing what it may.
    pub breaks: bool,
    /// The two links do not touch each other.
    pub disable_collisions: bool,
}

/// What a constraint asks for. Axes are in the frames of both ends, of any length but zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum RequestedConstraint {
    /// The frames are one.
    Weld,
    /// Their origins are one.
    PointToPoint,
    /// What is left is a turn about the axis.
    Hinge {
        /// About which the child turns.
        #[serde(with = "vector3")]
        axis: DVec3,
    },
    /// What is left is a shift along the axis.
    Slide {
        /// Along which the child slides.
        #[serde(with = "vector3")]
        axis: DVec3,
    },
    /// Position of the child's joint = ratio * position of the parent's + offset.
    Gear {
        /// Of the units of the two joints.
        ratio: f64,
        /// rad or m. `None`: as it is now.
        offset: Option<f64>,
    },
    /// The origins of the frames are so far from each other.
    Distance {
        /// Metres. `None`: as it is now.
        length: Option<f64>,
        /// They may be nearer.
        is_rope: bool,
    },
}

/// An end of a constraint.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RequestedEnd {
    /// The robot's name; empty: the world.
    pub robot: String,
    /// A link of it; empty: its root link. Not for gears.
    pub link: String,
    /// For gears: a joint of it, of one axis.
    pub joint: String,
    /// `link_from_frame`, or `world_from_frame`. `None`: of the parent the link's own; of the child where that of the
    /// parent is now.
    #[serde(with = "optional_pose3")]
    pub pose: Option<DPose3>,
}

/// New settings of a constraint; `None` leaves one as it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChangeConstraint {
    /// Its name.
    pub name: String,
    /// `link_from_frame` of the first end, or `world_from_frame`.
    #[serde(with = "optional_pose3")]
    pub parent_pose: Option<DPose3>,
    /// The same of the second one.
    #[serde(with = "optional_pose3")]
    pub child_pose: Option<DPose3>,
    /// As in [`CreateConstraint`]; may be infinite.
    pub max_force: Option<f64>,
    /// As in [`CreateConstraint`]; may be infinite.
    pub max_torque: Option<f64>,
    /// Whether it goes where it would need more.
    pub breaks: Option<bool>,
    /// Of a gear.
    pub ratio: Option<f64>,
    /// Of a gear, rad or m.
    pub offset: Option<f64>,
    /// Of a distance, metres.
    pub length: Option<f64>,
}
