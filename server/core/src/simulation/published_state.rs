//! Published state of a world: plain data, cheap to share.

use std::hash::{DefaultHasher, Hasher as _};
use std::ops::Range;
use std::sync::Arc;

use glamx::{DPose3, DVec3};
use simd_model::RobotModel;

use super::error::Error;
pub use super::moment::Moment;
use super::robot_settings::RobotSettings;
use super::saved::{NamedSavedState, no_saved_state};
use super::sensors::WorldSensor;
use super::target_sources::RobotTargetSources;
pub use super::trajectory::Begin;
use crate::collision::{RobotLinkPair, Shapes};
pub use crate::dynamics::Mode;
pub use crate::dynamics::constraint::link_constraint::{ConstraintDefinition, ConstraintEnd, ConstraintKind};
use crate::dynamics::{Configuration, Tree};

/// All robots at a moment. Values of all robots are in flat arrays; [`EntityLayout`] has each robot's ranges.
#[derive(Clone, Debug, Default)]
pub struct PublishedState {
    /// Moment of the state.
    pub at: Moment,
    /// Robots, and the location of their values.
    pub world: Arc<WorldLayout>,
    /// State of each robot's root.
    pub roots: Vec<RootState>,
    /// Joint positions: rad or m; for a floating joint x y z and a quaternion x y z w, for a spherical one a
    /// quaternion.
    pub positions: Vec<f64>,
    /// Joint velocities: rad/s or m/s. A floating joint has its linear velocity in the parent's axes, then
    /// the angular one in its own. A spherical joint has its angular velocity in the child's axes.
    pub velocities: Vec<f64>,
    /// Efforts that the actuators applied over the last step, N m or N. Aligned with `velocities`.
    pub efforts: Vec<f64>,
    /// Targets of the actuators, in the unit of their modes; an orientation is a rotation vector, rad.
    /// Aligned with `velocities`.
    pub targets: Vec<f64>,
    /// Modes of the actuators. Aligned with `velocities`.
    pub modes: Vec<Mode>,
    /// Stiffness and damping in force. Aligned with `velocities`.
    pub gains: Vec<(f64, f64)>,
    /// Changes of the velocities per second over the last part of the last step; zero if the velocities were
    /// set since. Aligned with `velocities`.
    pub accelerations: Vec<f64>,
    /// Flags of the joints. Aligned with `velocities`.
    pub flags: Vec<Flags>,
    /// Contacts of the last step, in an order that is the same for equal states.
    pub contacts: Vec<ContactReport>,
    /// Definitions of constraints between links, in the order of their creation. Shared like `settings`.
    pub constraints: Arc<Vec<ConstraintDefinition>>,
    /// States of the constraints over the last step.
    pub constraint_states: Vec<ConstraintState>,
    /// External wrenches on links.
    pub applied_wrenches: Vec<AppliedWrench>,
    /// Running and waiting trajectories, in the order in which each robot accepted them.
    pub trajectories: Vec<TrajectoryState>,
    /// Indices of the joints of all trajectories in their robots' models.
    pub trajectory_joints: Vec<usize>,
    /// Settings by commands, one for each robot. A state shares it with previous ones until something
    /// changes.
    pub settings: Arc<Vec<Arc<RobotSettings>>>,
    /// Enabled and disabled pairs of links of different robots. Shared like `settings`.
    pub collision_pairs: Arc<Vec<RobotLinkPair>>,
    /// Sources of the targets of each robot's joints. Shared like `settings`.
    pub target_sources: Arc<Vec<RobotTargetSources>>,
    /// Sensors by robot, in the order of their creation. Shared like `settings`.
    pub sensors: Arc<Vec<WorldSensor>>,
    /// Holder of a claim on the world.
    pub claimed_by: Option<Arc<str>>,
    /// Saved states, oldest first. Shared like `settings`.
    pub saved: Arc<Vec<NamedSavedState>>,
}

/// State of a constraint over the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConstraintState {
    /// Mean force on the second link over the last step, world, N; for a gear of a prismatic joint along its
    /// axis.
    pub force: DVec3,
    /// Mean torque about `point`, N m; for a gear of a revolute joint about its axis.
    pub torque: DVec3,
    /// Force and torque over the last part of the last step.
    pub last: [DVec3; 2],
    /// Point at which the force acts, world.
    pub point: DVec3,
    /// Position error at the start of the last part of the last step, metres; for a gear in the unit of the
    /// second joint.
    pub position_error: f64,
    /// Orientation error at the start of the last part of the last step, rad.
    pub angle_error: f64,
    /// Shortfall of the correction velocity against a fifth of the error in each step, because of other
    /// constraints or limits, m/s.
    pub velocity_residual: f64,
    /// Shortfall of the angular correction velocity, rad/s.
    pub angular_residual: f64,
    /// Whether it reached its maximum force or torque.
    pub is_saturated: bool,
}

/// Progress of a trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryState {
    /// Robot, by index in [`WorldLayout::entities`].
    pub robot: usize,
    /// Identifier of the trajectory.
    pub id: u64,
    /// Range in [`PublishedState::trajectory_joints`].
    pub joints: Range<usize>,
    /// Condition that it waits for; `Now` if it is running.
    pub begin: Begin,
    /// Simulated seconds since it began.
    pub elapsed: f64,
    /// Simulated seconds from its start to its last point.
    pub duration: f64,
}

/// Force and torque on a link over the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AppliedWrench {
    /// Robot, by index in [`WorldLayout::entities`].
    pub robot: usize,
    /// Link in its model, by index.
    pub link: usize,
    /// Force, newtons, at `point`.
    pub force: DVec3,
    /// Torque, newton metres.
    pub torque: DVec3,
    /// Whether they are in the link's axes, and not the world's.
    pub in_link_axes: bool,
    /// Point at which the force acts, in the link's frame, metres.
    pub point: DVec3,
}

/// Point at which two links touch.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactReport {
    /// Robots, by index in [`WorldLayout::entities`].
    pub robots: [usize; 2],
    /// Link of each robot in its model, by index.
    pub links: [usize; 2],
    /// Midpoint between the surfaces, world, metres.
    pub point: DVec3,
    /// Unit normal from the first link to the second, world.
    pub normal: DVec3,
    /// Penetration depth, metres; negative if they are about to touch.
    pub depth: f64,
    /// Mean normal force over the last step with which the first pushes the second, N.
    pub normal_force: f64,
    /// Mean friction force on the second over the last step, perpendicular to the normal, world, N.
    pub friction_force: DVec3,
    /// Force of the first on the second over the last part of the last step, world, N.
    pub last_force: DVec3,
}

/// Robots of a world. Replaced as a whole when they change.
#[derive(Debug, Default)]
pub struct WorldLayout {
    /// Robots in the order of their spawning.
    pub entities: Vec<Arc<EntityLayout>>,
    /// Indices of the robots in the order of their names: a command for a thousand robots looks up each.
    by_name: Vec<usize>,
}

impl WorldLayout {
    /// Creates a layout from the first robots of another one, and additional ones.
    pub(in crate::simulation) fn with_others(
        before: &Self,
        first: usize,
        others: Vec<Arc<EntityLayout>>,
    ) -> Self {
        let mut entities: Vec<_> = before.entities.iter().take(first).cloned().collect();
        let mut by_name: Vec<usize> = before.by_name.iter().copied().filter(|index| *index < first).collect();
        by_name.extend(first..first + others.len());
        entities.extend(others);
        // It is nearly in order already.
        by_name.sort_by(|a, b| entities[*a].name.cmp(&entities[*b].name));
        Self { entities, by_name }
    }

    /// Returns the index of the robot of this name.
    pub fn index_of(&self, name: &str) -> Option<usize> {
        let at = self.search(name).ok()?;
        self.by_name.get(at).copied()
    }

    fn search(&self, name: &str) -> Result<usize, usize> {
        let name_of = |index: &usize| self.entities.get(*index).map(|entity| entity.name.as_str());
        self.by_name.binary_search_by(|index| name_of(index).cmp(&Some(name)))
    }
}

/// A robot and the location of its values in a [`PublishedState`].
#[derive(Debug)]
pub struct EntityLayout {
    /// Name in the world.
    pub name: String,
    /// Version, which no other robot or model had before.
    pub version: u64,
    /// Model of the robot.
    pub model: Arc<RobotModel>,
    /// Tree of its bodies.
    pub tree: Arc<Tree>,
    /// Collision shapes.
    pub shapes: Arc<Shapes>,
    /// Whether its root link cannot move.
    pub fixed_base: bool,
    /// Whether the daemon loaded it at its start.
    pub loaded_at_start: bool,
    /// Range in [`PublishedState::positions`].
    pub positions: Range<usize>,
    /// Range in [`PublishedState::velocities`] and the lists aligned with it.
    pub velocities: Range<usize>,
    /// Range of each joint of the model within the robot's positions.
    pub joint_positions: Vec<Range<usize>>,
    /// Range of each joint of the model within the robot's velocities.
    pub joint_velocities: Vec<Range<usize>>,
}

/// State of a robot's root link.
#[derive(Clone, Debug, PartialEq)]
pub struct RootState {
    /// Pose `world_from_root`.
    pub pose: DPose3,
    /// Velocity of the root link's origin, world axes, m/s.
    pub linear: DVec3,
    /// Angular velocity, world axes, rad/s.
    pub angular: DVec3,
    /// Reason, while the robot is disabled.
    pub disabled: Option<Arc<str>>,
    /// Acceleration of a free root over the last part of the last step: linear in world axes, m/s^2, then
    /// angular in its own, rad/s^2. Zero if it is fixed or was moved since.
    pub accelerations: [f64; 6],
}

/// Flags of a joint at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags {
    /// Whether its effort limit bounds the actuator's effort, which is the limit or a weakened law's request.
    pub saturated: bool,
    /// Whether it is at the lower limit, within 1e-6 rad or m, or below it.
    pub at_lower: bool,
    /// Whether it is at the upper limit, within 1e-6 rad or m, or above it.
    pub at_upper: bool,
}

impl PublishedState {
    /// Copies all shared data from another state, so that this one, which will be overwritten, keeps no
    /// obsolete data in memory.
    pub fn share_with(&mut self, other: &Self) {
        self.world = Arc::clone(&other.world);
        self.constraints = Arc::clone(&other.constraints);
        self.settings = Arc::clone(&other.settings);
        self.collision_pairs = Arc::clone(&other.collision_pairs);
        self.target_sources = Arc::clone(&other.target_sources);
        self.sensors = Arc::clone(&other.sensors);
        self.saved = Arc::clone(&other.saved);
    }

    /// Returns a fingerprint of everything that moves: poses, velocities, actuators and contacts. It is equal
    /// if these are equal to the bit. It is for comparing runs of one build on one machine, step by step.
    /// Names, settings without effect so far, and the epoch are not included.
    pub fn fingerprint(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        hasher.write_u64(self.at.step);
        let mut numbers = |values: &[f64]| {
            hasher.write_usize(values.len());
            values.iter().for_each(|value| hasher.write_u64(value.to_bits()));
        };
        numbers(&[self.at.sim_time]);
        for RootState { pose, linear, angular, disabled: _, accelerations } in &self.roots {
            numbers(&pose.translation.to_array());
            numbers(&pose.rotation.to_array());
            [linear, angular].into_iter().for_each(|vector| numbers(&vector.to_array()));
            numbers(accelerations);
        }
        for values in [&self.positions, &self.velocities, &self.efforts, &self.targets, &self.accelerations] {
            numbers(values);
        }
        for contact in &self.contacts {
            for vector in [contact.point, contact.normal, contact.friction_force, contact.last_force] {
                numbers(&vector.to_array());
            }
            numbers(&[contact.depth, contact.normal_force]);
        }
        hasher.finish()
    }

    /// Returns a saved state by name.
    ///
    /// # Errors
    /// Returns an error if there is no such state.
    pub fn saved(&self, name: &str) -> Result<&NamedSavedState, Error> {
        self.saved.iter().find(|kept| kept.name == name).ok_or_else(|| no_saved_state(&self.saved, name))
    }

    /// Returns a robot by name, with its index among the robots.
    pub fn entity(&self, name: &str) -> Option<(usize, &Arc<EntityLayout>)> {
        let index = self.world.index_of(name)?;
        Some((index, self.world.entities.get(index)?))
    }

    /// Returns `world_from_link` of each link of the robot at this index, in the model's order.
    pub fn link_poses(&self, index: usize) -> Option<Vec<DPose3>> {
        let entity = self.world.entities.get(index)?;
        let positions = self.positions.get(entity.positions.clone())?;
        Some(entity.tree.link_poses(self.roots.get(index)?.pose, positions))
    }

    /// Returns the linear velocity of the origin and the angular velocity of each link of the robot at this
    /// index. They are in world axes, in the model's order.
    pub fn link_twists(&self, index: usize) -> Option<Vec<(DVec3, DVec3)>> {
        let entity = self.world.entities.get(index)?;
        Some(entity.tree.link_twists(&self.configuration(index)?))
    }

    /// Returns the configuration of the robot at this index.
    pub fn configuration(&self, index: usize) -> Option<Configuration> {
        let entity = self.world.entities.get(index)?;
        let root = self.roots.get(index)?;
        Some(Configuration {
            root: root.pose,
            linear: root.linear,
            angular: root.angular,
            positions: self.positions.get(entity.positions.clone())?.to_vec(),
            velocities: self.velocities.get(entity.velocities.clone())?.to_vec(),
        })
    }
}
