//! What can be asked of a world beyond what a snapshot shows.

use glamx::DVec3;
use simd_model::robot::Limits;

use super::command::SnapshotInfo;
use super::saved::Saved;
use super::snapshot::Mode;
use crate::collision::Surface;

/// A question; answered between steps.
#[derive(Clone, Debug, PartialEq)]
pub enum Query {
    /// Settings and targets of a robot's joints.
    Joints {
        /// The robot's name.
        robot: String,
    },
    /// The states that are kept, oldest first.
    Snapshots,
    /// One of them.
    Saved {
        /// Its name.
        name: String,
    },
    /// What rays hit. At most [`MOST_RAYS`](super::links::MOST_RAYS) of them.
    CastRays {
        /// The start and the end of each, world, metres.
        rays: Vec<[DVec3; 2]>,
    },
    /// What a robot's joints carried over the last step.
    Reactions {
        /// The robot's name.
        robot: String,
    },
    /// Friction and restitution of a robot's links.
    Links {
        /// The robot's name.
        robot: String,
    },
}

/// The answer to a [`Query`].
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// To [`Query::Joints`]: one for each joint of the model, in its order, with
    /// the layout version that they belong to.
    Joints {
        /// Of the robot, as in the snapshot's layout.
        layout_version: u64,
        /// One a joint.
        joints: Vec<JointStatus>,
    },
    /// To [`Query::Snapshots`].
    Snapshots(Vec<SnapshotInfo>),
    /// To [`Query::Saved`]: with what is said of it.
    Saved(SnapshotInfo, Saved),
    /// To [`Query::CastRays`]: one a ray, `None` where it hits nothing.
    Rays(Vec<Option<RayReport>>),
    /// To [`Query::Reactions`]: one for each joint of the model, with the layout version
    /// that they belong to.
    Reactions {
        /// Of the robot, as in the snapshot's layout.
        layout_version: u64,
        /// Force and torque of the parent link on the child, in the child link's frame and
        /// about its origin, N and N m.
        wrenches: Vec<[DVec3; 2]>,
    },
    /// To [`Query::Links`]: one a link of the model, `None` where it has no collider.
    Links(Vec<Option<Surface>>),
}

/// Where a ray meets a link.
#[derive(Clone, Debug, PartialEq)]
pub struct RayReport {
    /// The robot's name.
    pub robot: String,
    /// The link's name.
    pub link: String,
    /// World, metres.
    pub point: DVec3,
    /// Out of the surface, of unit length, world.
    pub normal: DVec3,
    /// The part of the way from start to end, 0 to 1.
    pub fraction: f64,
}

/// What holds for a joint at the moment. Of a planar joint's three axes the
/// settings are those of the first.
#[derive(Clone, Debug, PartialEq)]
pub struct JointStatus {
    /// What its actuator does.
    pub mode: Mode,
    /// In force.
    pub limits: Limits,
    /// N m s/rad or N s/m.
    pub damping: f64,
    /// N m or N.
    pub friction: f64,
    /// kg m^2 or kg.
    pub armature: f64,
    /// Stiffness and damping in force.
    pub gains: (f64, f64),
    /// Stiffness and damping of targets that give none.
    pub default_gains: (f64, f64),
    /// Who holds a claim on it.
    pub claimed_by: Option<String>,
}
