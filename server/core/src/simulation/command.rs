//! Commands, which are all changes of a world from outside, and their replies.
//!
//! Serde writes commands for recordings. Models, shapes and saved states are left out, since files carry them
//! separately: the reader must fill them in. The source of a target is left out too, since no step reads it.

mod constraint;
mod joint;
mod pull;
mod robot;
mod sensor;
mod target;

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

pub use self::constraint::{ChangeConstraint, CreateConstraint, RequestedConstraint, RequestedEnd};
pub use self::joint::{
    FollowTrajectory, JointOrientation, JointProperties, JointReset, RobotReset, SphericalReset,
};
pub use self::pull::LinkPull;
pub use self::robot::{Reload, Spawn};
pub use self::sensor::CreateSensor;
pub use self::target::{Clamped, JointTarget, RobotTargets, SetTargets, Target, WholeTarget};
pub use super::claim::ClaimId;
pub use super::contact_settings::{
    ContactSettings, LinkProperties, MAX_COLLISION_PAIRS, MAX_LINK_PROPERTIES,
};
use super::moment::Moment;
pub use super::pull::{DEFAULT_PULL_DURATION, MAX_PULL_DURATION};
use super::saved::Saved;
pub use super::saved::SavedStateInfo;
use super::settings::{Integrator, PhysicsSettings, SurfaceCombination};
pub use super::trajectory::{Begin, Tolerance, TrajectoryPoint};
pub use super::wrench::{MAX_WRENCH_DURATION, WrenchDuration};
use crate::plain::{optional_pose3, optional_two_vectors3, optional_vector3, vector3};

/// Change of the world. Applied between steps: whole or, if it is refused, not at all.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Command {
    /// Adds a robot to the world.
    Spawn(Box<Spawn>),
    /// Replaces the model of a robot; see [`Reload`].
    Reload(Box<Reload>),
    /// Deletes a robot.
    Delete {
        /// Name of the robot.
        robot: String,
    },
    /// Creates a constraint between two links.
    CreateConstraint(Box<CreateConstraint>),
    /// Changes a constraint between two links.
    ChangeConstraint(Box<ChangeConstraint>),
    /// Deletes a constraint between two links.
    DeleteConstraint {
        /// Name of the constraint.
        name: String,
    },
    /// Sets targets of joints.
    SetTargets(SetTargets),
    /// Starts a trajectory of joints.
    FollowTrajectory(FollowTrajectory),
    /// Cancels trajectories; their joints hold their positions.
    CancelTrajectory {
        /// Name of the robot.
        robot: String,
        /// Identifier from [`Reply::TrajectoryAccepted`]; `None` means all of the robot.
        id: Option<u64>,
    },
    /// Sets positions and velocities of joints.
    ResetJoints {
        /// Joints by robot.
        robots: Vec<RobotReset>,
    },
    /// Changes settings of joints.
    SetJointProperties {
        /// Name of the robot.
        robot: String,
        /// New settings by joint.
        joints: Vec<JointProperties>,
    },
    /// Changes settings of links.
    SetLinkProperties {
        /// Name of the robot.
        robot: String,
        /// New settings by link; later ones win.
        links: Vec<LinkProperties>,
        /// Whether the robot stays awake, even if the world lets bodies sleep; `None` leaves it.
        stays_awake: Option<bool>,
    },
    /// Changes the collision filter of a robot; see [`CollisionFilterChange`].
    SetCollisionFilter(CollisionFilterChange),
    /// Claims robots, joints or the world for one client.
    Claim(ClaimRequest),
    /// Releases a claim; joints hold their position.
    Release {
        /// Identifier from [`ClaimRequest`].
        claim: ClaimId,
        /// Reason for the release.
        cause: ReleaseCause,
    },
    /// Moves a robot's root link.
    SetEntityState {
        /// Name of the robot.
        robot: String,
        /// New `world_from_root`.
        #[serde(with = "optional_pose3")]
        pose: Option<DPose3>,
        /// Linear velocity of the root link's origin and angular velocity, world axes. Zero for a fixed base.
        #[serde(with = "optional_two_vectors3")]
        twist: Option<(DVec3, DVec3)>,
    },
    /// Applies a wrench to a link.
    ApplyWrench(LinkWrench),
    /// Pulls a link to a point of the world.
    PullLink(LinkPull),
    /// Changes gravity, time step, substeps, integrator or the combination of surfaces.
    SetPhysics(PhysicsChange),
    /// Resets the world.
    Reset(ResetScope),
    /// Saves the state of the world under a name, replacing one of that name.
    SaveState {
        /// Name of the saved state.
        name: String,
    },
    /// Restores a saved state.
    RestoreState {
        /// Name of the saved state.
        name: String,
    },
    /// Deletes a saved state.
    DeleteSavedState {
        /// Name of the saved state.
        name: String,
    },
    /// Adds a saved state from elsewhere under a name, replacing one of that name.
    ImportSavedState {
        /// Name of the saved state.
        name: String,
        /// State. A recording has it as a file.
        #[serde(skip, default = "Saved::nothing")]
        saved: Saved,
    },
    /// Adds several robots to the world at one moment: all of them, or none.
    SpawnAll(Vec<Spawn>),
    /// Adds a sensor to a robot.
    CreateSensor(Box<CreateSensor>),
    /// Deletes a sensor of a robot.
    DeleteSensor {
        /// Name of the robot.
        robot: String,
        /// Name of the sensor.
        name: String,
    },
}

impl Command {
    /// Returns the names of robots that it changes; `None` if it concerns the whole world.
    pub fn robots(&self) -> Option<Vec<&str>> {
        Some(match self {
            // The robot may get any name.
            Self::Spawn(spawn) if spawn.allow_renaming => return None,
            Self::Spawn(spawn) => vec![&spawn.name],
            Self::SpawnAll(spawns) if spawns.iter().any(|spawn| spawn.allow_renaming) => return None,
            Self::SpawnAll(spawns) => spawns.iter().map(|spawn| spawn.name.as_str()).collect(),
            Self::Reload(reload) => vec![&reload.robot],
            Self::SetTargets(targets) => targets.robots.iter().map(|robot| robot.robot.as_str()).collect(),
            Self::ResetJoints { robots } => robots.iter().map(|reset| reset.robot.as_str()).collect(),
            Self::FollowTrajectory(follow) => vec![&follow.robot],
            Self::CreateSensor(create) => vec![&create.robot],
            Self::Delete { robot }
            | Self::DeleteSensor { robot, .. }
            | Self::CancelTrajectory { robot, .. }
            | Self::SetJointProperties { robot, .. }
            | Self::SetLinkProperties { robot, .. }
            | Self::SetEntityState { robot, .. } => vec![robot],
            Self::SetCollisionFilter(change) => {
                let others = change.pairs.iter().map(|pair| pair.other_robot.as_str());
                let others = others.filter(|other| !other.is_empty());
                std::iter::once(change.robot.as_str()).chain(others).collect()
            }
            Self::ApplyWrench(wrench) => vec![&wrench.robot],
            Self::PullLink(pull) => vec![&pull.robot],
            Self::CreateConstraint(create) => {
                let ends = [&create.parent, &create.child].map(|end| end.robot.as_str());
                ends.into_iter().filter(|robot| !robot.is_empty()).collect()
            }
            Self::Claim(request) if request.world => return None,
            Self::Claim(request) => request.joints.iter().map(|joints| joints.robot.as_str()).collect(),
            // The caller has proven that the claim is its own.
            Self::Release { .. } => Vec::new(),
            // The name alone does not identify the robots of a constraint.
            Self::ChangeConstraint(_)
            | Self::DeleteConstraint { .. }
            | Self::SetPhysics(_)
            | Self::Reset(_)
            | Self::SaveState { .. }
            | Self::RestoreState { .. }
            | Self::DeleteSavedState { .. }
            | Self::ImportSavedState { .. } => return None,
        })
    }
}

/// Change of a robot's collision filter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CollisionFilterChange {
    /// Name of the robot.
    pub robot: String,
    /// Whether its links touch each other; `None` leaves it.
    pub self_collision: Option<bool>,
    /// Pairs of links; later ones win.
    pub pairs: Vec<CollisionPair>,
}

/// Pair of links that is enabled or disabled.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CollisionPair {
    /// Name of a link of the robot.
    pub link: String,
    /// Robot of the other link; empty means the same robot.
    pub other_robot: String,
    /// Name of the other link.
    pub other_link: String,
    /// Whether the two touch; `None` leaves this to groups, masks and joints.
    pub enabled: Option<bool>,
}

/// Claim of one client: only commands that come with it may change what it covers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClaimRequest {
    /// Identifier of the claim. Unique; the caller makes it.
    pub claim: ClaimId,
    /// Name of the holder, for people.
    pub holder: String,
    /// Joints. A selection without names means the whole robot.
    pub joints: Vec<JointSelection>,
    /// Whether it includes the world: actions that concern all robots, such as a pause.
    pub world: bool,
    /// Priority; conflicting claims with a lower one end.
    pub priority: u32,
    /// Whether conflicting claims end, whatever their priority.
    pub take_over: bool,
}

/// Reason for the end of a claim.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReleaseCause {
    /// Its holder released it.
    Released,
    /// Its lease expired without use.
    Lapsed,
    /// The connection that it was bound to ended.
    Disconnected,
    /// Another claim took over.
    TakenOver {
        /// Holder of the other claim.
        by: String,
    },
}

/// Joints of a robot; an empty list means all that move.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointSelection {
    /// Name of the robot.
    pub robot: String,
    /// Names of joints.
    pub joints: Vec<String>,
}

/// Wrench on a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkWrench {
    /// Name of the robot.
    pub robot: String,
    /// Name of the link.
    pub link: String,
    /// Force, N.
    #[serde(with = "vector3")]
    pub force: DVec3,
    /// Torque, N m.
    #[serde(with = "vector3")]
    pub torque: DVec3,
    /// Whether force and torque are in the link's axes, and not the world's.
    pub in_link_axes: bool,
    /// Point at which the force acts, in the link's frame, metres.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// Duration of the wrench.
    pub duration: WrenchDuration,
}

/// New physics settings; `None` leaves one unchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PhysicsChange {
    /// Gravity, m/s^2, world axes.
    #[serde(with = "optional_vector3")]
    pub gravity: Option<DVec3>,
    /// Time step, seconds, 1e-6 to 0.1.
    pub time_step: Option<f64>,
    /// Number of parts of a step, 1 to 1,000.
    pub substeps: Option<u32>,
    /// Integration method.
    pub integrator: Option<Integrator>,
    /// Combination of the coefficients of touching surfaces.
    pub surface_combination: Option<SurfaceCombination>,
    /// Whether free bodies at rest sleep; false wakes all.
    pub sleeping: Option<bool>,
}

/// Scope of a reset, in the terms of `simulation_interfaces`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResetScope {
    /// Whether step and sim time return to zero, which begins a new epoch.
    pub time: bool,
    /// Whether robots return to the state they were spawned with.
    pub state: bool,
    /// Whether robots that were not loaded at the start are deleted.
    pub spawned: bool,
}

/// Result of a command that was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Applied {
    /// Moment from which it holds.
    pub at: Moment,
    /// Reply to the command.
    pub reply: Reply,
}

/// Reply to a command.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// Nothing to report.
    Done,
    /// The robot was added.
    Spawned {
        /// Name of the robot.
        name: String,
    },
    /// Several robots were added.
    SpawnedAll {
        /// Names of the robots, in the order of the command.
        names: Vec<String>,
    },
    /// The constraint was created, and holds from the next step on.
    ConstraintCreated {
        /// Name of the constraint.
        name: String,
    },
    /// The sensor was created, and takes samples from now on.
    SensorCreated {
        /// Name of the sensor.
        name: String,
    },
    /// The robot has its new model.
    Reloaded {
        /// Joints that the old model did not have.
        added: Vec<String>,
        /// Joints that the new model does not have.
        removed: Vec<String>,
    },
    /// The targets are set.
    Targets {
        /// Targets that were beyond a limit.
        clamped: Vec<Clamped>,
        /// Whether a joint has another mode or other gains than before.
        changed_law: bool,
    },
    /// The trajectory has started, or waits.
    TrajectoryAccepted {
        /// Identifier of the trajectory.
        id: u64,
    },
    /// The claim holds.
    Claimed {
        /// Claims that it took over from, which ended.
        ended: Vec<ClaimId>,
    },
    /// The world was reset.
    Reset {
        /// Robots that were deleted.
        deleted: Vec<String>,
    },
    /// The settings in force.
    Physics(PhysicsSettings),
    /// A saved state.
    SavedState(SavedStateInfo),
}
