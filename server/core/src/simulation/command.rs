//! Everything that can change a world from outside, and what is said in return.
//!
//! Commands are written by serde for recordings. What files carry beside them is left out and has to be filled in by
//! who reads them: models, shapes and saved states. Who set a target is left out too, since no step reads it.

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

/// A change of the world. Applied between steps: whole or, where it is refused, not at all.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Command {
    /// Brings a robot into the world.
    Spawn(Box<Spawn>),
    /// Gives a robot a new model; see [`Reload`].
    Reload(Box<Reload>),
    /// Takes a robot out of the world.
    Delete {
        /// Its name.
        robot: String,
    },
    /// Holds two links together.
    CreateConstraint(Box<CreateConstraint>),
    /// Changes how two links are held together.
    ChangeConstraint(Box<ChangeConstraint>),
    /// Lets two links go.
    DeleteConstraint {
        /// Its name.
        name: String,
    },
    /// Gives joints new targets.
    SetTargets(SetTargets),
    /// Has joints carry out a trajectory.
    FollowTrajectory(FollowTrajectory),
    /// Ends trajectories before they are over; their joints hold where they are.
    CancelTrajectory {
        /// Whose.
        robot: String,
        /// Which, as [`Reply::TrajectoryAccepted`] said; `None` is all of the robot.
        id: Option<u64>,
    },
    /// Puts joints at a position and a velocity.
    ResetJoints {
        /// Which joints of which robots.
        robots: Vec<RobotReset>,
    },
    /// Changes settings of joints.
    SetJointProperties {
        /// Whose joints.
        robot: String,
        /// Which, and what.
        joints: Vec<JointProperties>,
    },
    /// Changes settings of links.
    SetLinkProperties {
        /// Whose links.
        robot: String,
        /// Which, and what; the later ones win.
        links: Vec<LinkProperties>,
    },
    /// Changes what a robot touches; see [`CollisionFilterChange`].
    SetCollisionFilter(CollisionFilterChange),
    /// Takes robots, joints or the world for one client.
    Claim(ClaimRequest),
    /// Gives them back; joints hold their position.
    Release {
        /// What [`ClaimRequest`] was given.
        claim: ClaimId,
        /// Why.
        cause: ReleaseCause,
    },
    /// Puts a robot's root link elsewhere.
    SetEntityState {
        /// Its name.
        robot: String,
        /// `world_from_root`.
        #[serde(with = "optional_pose3")]
        pose: Option<DPose3>,
        /// Linear and angular velocity of the root link's origin, world axes. Zero for a fixed base.
        #[serde(with = "optional_two_vectors3")]
        twist: Option<(DVec3, DVec3)>,
    },
    /// Applies a wrench to a link.
    ApplyWrench(LinkWrench),
    /// Pulls a link to a point of the world.
    PullLink(LinkPull),
    /// Changes gravity, time step, substeps, integrator or how surfaces combine.
    SetPhysics(PhysicsChange),
    /// Puts the world back.
    Reset(ResetScope),
    /// Keeps the state of the world under a name, replacing one of that name.
    SaveState {
        /// Its name.
        name: String,
    },
    /// Puts the world back to a kept state.
    RestoreState {
        /// Its name.
        name: String,
    },
    /// Forgets a kept state.
    DeleteSavedState {
        /// Its name.
        name: String,
    },
    /// Keeps a state that came from elsewhere under a name, replacing one of that name.
    ImportSavedState {
        /// Its name.
        name: String,
        /// The state. A recording has it as a file.
        #[serde(skip, default = "Saved::nothing")]
        saved: Saved,
    },
    /// Brings several robots into the world at one moment: all of them, or none.
    SpawnAll(Vec<Spawn>),
    /// Puts a sensor on a robot.
    CreateSensor(Box<CreateSensor>),
    /// Takes a sensor off a robot.
    DeleteSensor {
        /// Whose.
        robot: String,
        /// Its name.
        name: String,
    },
}

impl Command {
    /// The robots that it changes, by name; `None` where it concerns the whole world.
    pub fn robots(&self) -> Option<Vec<&str>> {
        Some(match self {
            // It may become a robot of any name.
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
            // Whose claim it is was proven.
            Self::Release { .. } => Vec::new(),
            // Its name alone does not say of which robots a constraint is.
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

/// What a robot touches from now on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CollisionFilterChange {
    /// Its name.
    pub robot: String,
    /// Whether its links touch each other; `None` leaves it.
    pub self_collision: Option<bool>,
    /// Pairs of links, the later ones win.
    pub pairs: Vec<CollisionPair>,
}

/// A pair of links that is switched off or on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CollisionPair {
    /// Name of a link of the robot.
    pub link: String,
    /// The other one's robot; empty is the same one.
    pub other_robot: String,
    /// Name of the other link.
    pub other_link: String,
    /// Whether the two touch; `None`: as groups, masks and joints say.
    pub enabled: Option<bool>,
}

/// What one client takes, so that only commands that come with the claim change it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClaimRequest {
    /// Which it is from now on. Unique; the caller makes it.
    pub claim: ClaimId,
    /// Who claims, for people.
    pub holder: String,
    /// Which joints. A selection that names none is of the whole robot.
    pub joints: Vec<JointSelection>,
    /// The world: what concerns all robots, such as a pause.
    pub world: bool,
    /// Claims with a lower one that are in the way end.
    pub priority: u32,
    /// Claims that are in the way end, whatever their priority.
    pub take_over: bool,
}

/// Why a claim ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReleaseCause {
    /// Its holder gave it back.
    Released,
    /// It was not used for as long as its lease.
    Lapsed,
    /// The connection that it was bound to ended.
    Disconnected,
    /// Another claim took over.
    TakenOver {
        /// The other one's holder.
        by: String,
    },
}

/// Joints of a robot; none named means all that move.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointSelection {
    /// The robot's name.
    pub robot: String,
    /// Names of joints.
    pub joints: Vec<String>,
}

/// A wrench on a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkWrench {
    /// The robot's name.
    pub robot: String,
    /// The link's name.
    pub link: String,
    /// Newtons.
    #[serde(with = "vector3")]
    pub force: DVec3,
    /// Newton metres.
    #[serde(with = "vector3")]
    pub torque: DVec3,
    /// Force and torque are in the link's axes, not the world's.
    pub in_link_axes: bool,
    /// Where the force acts, in the link's frame, metres.
    #[serde(with = "vector3")]
    pub point: DVec3,
    /// For how long.
    pub duration: WrenchDuration,
}

/// New physics settings; `None` leaves one as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PhysicsChange {
    /// m/s^2, world axes.
    #[serde(with = "optional_vector3")]
    pub gravity: Option<DVec3>,
    /// Seconds a step, 1e-6 to 0.1.
    pub time_step: Option<f64>,
    /// Parts of a step, 1 to 1,000.
    pub substeps: Option<u32>,
    /// The method of a step.
    pub integrator: Option<Integrator>,
    /// How coefficients of surfaces that touch become those of the contact.
    pub surface_combination: Option<SurfaceCombination>,
    /// Free bodies at rest sleep; false wakes all.
    pub sleeping: Option<bool>,
}

/// What a reset puts back, in the words of `simulation_interfaces`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResetScope {
    /// Step and sim time go to zero; a new epoch begins.
    pub time: bool,
    /// Robots go back to the state they were spawned with.
    pub state: bool,
    /// Robots that were not loaded at the start go.
    pub spawned: bool,
}

/// A command that was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Applied {
    /// The moment from which it holds.
    pub at: Moment,
    /// What came of it.
    pub reply: Reply,
}

/// What came of a command.
#[derive(Clone, Debug, PartialEq)]
pub enum Reply {
    /// Nothing more to say.
    Done,
    /// The robot is in the world.
    Spawned {
        /// Under this name.
        name: String,
    },
    /// Several robots are in the world.
    SpawnedAll {
        /// Their names, in the order of the command.
        names: Vec<String>,
    },
    /// The constraint holds from the next step on.
    ConstraintCreated {
        /// Under this name.
        name: String,
    },
    /// The sensor takes samples from now on.
    SensorCreated {
        /// Under this name.
        name: String,
    },
    /// The robot has its new model.
    Reloaded {
        /// Joints it did not have.
        added: Vec<String>,
        /// Joints it has no longer.
        removed: Vec<String>,
    },
    /// The targets hold.
    Targets {
        /// Those that lay beyond a limit.
        clamped: Vec<Clamped>,
        /// A joint has another mode or other gains than before.
        changed_law: bool,
    },
    /// The trajectory is carried out, or waits.
    TrajectoryAccepted {
        /// What it is called from now on.
        id: u64,
    },
    /// The claim holds.
    Claimed {
        /// Claims that it took over from, which ended.
        ended: Vec<ClaimId>,
    },
    /// The world is put back.
    Reset {
        /// Robots that are gone.
        deleted: Vec<String>,
    },
    /// The settings in force.
    Physics(PhysicsSettings),
    /// A kept state.
    SavedState(SavedStateInfo),
}
