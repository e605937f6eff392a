//! The published state of a world: plain data, cheap to share.

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

/// All robots at a moment. Values of all robots lie in flat arrays;
/// [`EntityLayout`] says where each robot's are.
#[derive(Clone, Debug, Default)]
pub struct PublishedState {
    /// When.
    pub at: Moment,
    /// Which robots there are, and where their values lie.
    pub world: Arc<WorldLayout>,
    /// One a robot.
    pub roots: Vec<RootState>,
    /// Joint positions: rad or m; for a floating joint x y z and a quaternion x y z w, for a spherical one a quaternion.
    pub positions: Vec<f64>,
    /// Joint velocities: rad/s or m/s; for a floating joint linear in the parent's
    /// axes, then angular in its own, for a spherical one angular in the child's own axes.
    pub velocities: Vec<f64>,
    /// What each actuator applied over the last step, N m or N. Aligned with `velocities`.
    pub efforts: Vec<f64>,
    /// What each actuator is to reach, in the unit of its mode: an orientation as a rotation vector, rad. Aligned with `velocities`.
    pub targets: Vec<f64>,
    /// Aligned with `velocities`.
    pub modes: Vec<Mode>,
    /// Stiffness and damping in force. Aligned with `velocities`.
    pub gains: Vec<(f64, f64)>,
    /// The change of the velocities in a second over the last part of the last step; zero where the velocities were
    /// given since. Aligned with `velocities`.
    pub accelerations: Vec<f64>,
    /// Aligned with `velocities`.
    pub flags: Vec<Flags>,
    /// What touches, as the last step had it, in an order that is the same for equal states.
    pub contacts: Vec<ContactReport>,
    /// What constraints between links are, in the order in which they were made. Shared like `settings`.
    pub constraints: Arc<Vec<ConstraintDefinition>>,
    /// What each of them did over the last step.
    pub constraint_states: Vec<ConstraintState>,
    /// What acts on links from outside.
    pub applied_wrenches: Vec<AppliedWrench>,
    /// Trajectories that are carried out or wait, in the order in which each robot took them.
    pub trajectories: Vec<TrajectoryState>,
    /// Of all trajectories: the indices of their joints in their robots' models.
    pub trajectory_joints: Vec<usize>,
    /// What commands set, one a robot. A state shares it with those before as long as nothing changed.
    pub settings: Arc<Vec<Arc<RobotSettings>>>,
    /// Links of different robots that were switched off or on. Shared like `settings`.
    pub collision_pairs: Arc<Vec<RobotLinkPair>>,
    /// Who set the targets of each robot's joints. Shared like `settings`.
    pub target_sources: Arc<Vec<RobotTargetSources>>,
    /// What sensors there are, by robot, in the order in which they were made. Shared like `settings`.
    pub sensors: Arc<Vec<WorldSensor>>,
    /// Who holds a claim on the world.
    pub claimed_by: Option<Arc<str>>,
    /// The states that the world can go back to, oldest first. Shared like `settings`.
    pub saved: Arc<Vec<NamedSavedState>>,
}

/// What a constraint did over the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConstraintState {
    /// Mean force on the second link over the last step, world, N; of a gear of a sliding joint along its axis.
    pub force: DVec3,
    /// The same torque about `point`, N m; of a gear of a turning joint about its axis.
    pub torque: DVec3,
    /// Force and torque over the last part of the last step.
    pub last: [DVec3; 2],
    /// Where the force acts, world.
    pub point: DVec3,
    /// How far the last part of the last step found the links from where they are to be, metres; of a gear the unit of
    /// the second joint.
    pub position_error: f64,
    /// The same of their orientations, rad.
    pub angle_error: f64,
    /// By how much slower than a fifth of the error in each step they go to where they are to be, since other constraints ask for
    /// something else or the limits are reached: m/s.
    pub velocity_residual: f64,
    /// The same of their orientations, rad/s.
    pub angular_residual: f64,
    /// It did what it may do at the most.
    pub is_saturated: bool,
}

/// How far a trajectory is.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryState {
    /// Index of the robot in [`WorldLayout::entities`].
    pub robot: usize,
    /// What it is called.
    pub id: u64,
    /// In [`PublishedState::trajectory_joints`].
    pub joints: Range<usize>,
    /// What it waits for; `Now` where it is carried out.
    pub begin: Begin,
    /// Simulated seconds since it began.
    pub elapsed: f64,
    /// Simulated seconds from its beginning to its last point.
    pub duration: f64,
}

/// A force and a torque on a link over the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AppliedWrench {
    /// Index of the robot in [`WorldLayout::entities`].
    pub robot: usize,
    /// Index of the link in its model.
    pub link: usize,
    /// Newtons, at `point`.
    pub force: DVec3,
    /// Newton metres.
    pub torque: DVec3,
    /// In the link's axes, not the world's.
    pub in_link_axes: bool,
    /// In the link's frame, metres.
    pub point: DVec3,
}

/// A point where two links touch.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactReport {
    /// Indices of the two robots in [`WorldLayout::entities`].
    pub robots: [usize; 2],
    /// Of each robot's link in its model.
    pub links: [usize; 2],
    /// World, in the middle between the surfaces, metres.
    pub point: DVec3,
    /// From the first link to the second, of unit length, world.
    pub normal: DVec3,
    /// How far the two overlap, metres; negative where they are about to touch.
    pub depth: f64,
    /// Mean force over the last step with which the first pushes the second along the normal, N.
    pub normal_force: f64,
    /// Mean force of friction on the second over the last step, across the normal, world, N.
    pub friction_force: DVec3,
    /// Force of the first on the second over the last part of the last step, world, N.
    pub last_force: DVec3,
}

/// Which robots there are. Replaced as a whole when that changes.
#[derive(Debug, Default)]
pub struct WorldLayout {
    /// In the order of their spawning.
    pub entities: Vec<Arc<EntityLayout>>,
    /// Their indices in the order of their names: a command for a thousand robots names each.
    by_name: Vec<usize>,
}

impl WorldLayout {
    /// The first robots of another layout, and these after them.
    pub(in crate::simulation) fn with_others(
        before: &Self,
        first: usize,
        others: Vec<Arc<EntityLayout>>,
    ) -> Self {
        let mut entities: Vec<_> = before.entities.iter().take(first).cloned().collect();
        let mut by_name: Vec<usize> = before.by_name.iter().copied().filter(|index| *index < first).collect();
        by_name.extend(first..first + others.len());
        entities.extend(others);
        // Which is nearly in order already.
        by_name.sort_by(|a, b| entities[*a].name.cmp(&entities[*b].name));
        Self { entities, by_name }
    }

    /// The index of the robot of this name.
    pub fn index_of(&self, name: &str) -> Option<usize> {
        let at = self.search(name).ok()?;
        self.by_name.get(at).copied()
    }

    fn search(&self, name: &str) -> Result<usize, usize> {
        let name_of = |index: &usize| self.entities.get(*index).map(|entity| entity.name.as_str());
        self.by_name.binary_search_by(|index| name_of(index).cmp(&Some(name)))
    }
}

/// A robot and where its values lie in a [`PublishedState`].
#[derive(Debug)]
pub struct EntityLayout {
    /// Its name in the world.
    pub name: String,
    /// Unlike that of any other robot or model before it.
    pub version: u64,
    /// What it is.
    pub model: Arc<RobotModel>,
    /// How it moves.
    pub tree: Arc<Tree>,
    /// What it touches with.
    pub shapes: Arc<Shapes>,
    /// Its root link cannot move.
    pub fixed_base: bool,
    /// The daemon loaded it at its start.
    pub loaded_at_start: bool,
    /// In [`PublishedState::positions`].
    pub positions: Range<usize>,
    /// In [`PublishedState::velocities`] and what is aligned with them.
    pub velocities: Range<usize>,
    /// For each joint of the model, its range within the robot's own positions.
    pub joint_positions: Vec<Range<usize>>,
    /// For each joint of the model, its range within the robot's own velocities.
    pub joint_velocities: Vec<Range<usize>>,
}

/// Where a robot's root link is.
#[derive(Clone, Debug, PartialEq)]
pub struct RootState {
    /// `world_from_root`.
    pub pose: DPose3,
    /// Of the root link's origin, world axes, m/s.
    pub linear: DVec3,
    /// World axes, rad/s.
    pub angular: DVec3,
    /// Set while the robot is out of the simulation: why.
    pub disabled: Option<Arc<str>>,
    /// Of a free root, over the last part of the last step: linear in world axes, m/s^2, then angular in
    /// its own, rad/s^2; zero where it is fixed or was put somewhere since.
    pub accelerations: [f64; 6],
}

/// What is special about a joint at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags {
    /// Its effort limit bounds the actuator, which applies it, or what a weakened law asks for.
    pub saturated: bool,
    /// At the lower limit, within 1e-6 rad or m, or below it.
    pub at_lower: bool,
    /// At the upper limit, within 1e-6 rad or m, or above it.
    pub at_upper: bool,
}

impl PublishedState {
    /// Takes from another state all that a state shares with those before it, so that this one, which is to be written
    /// over, keeps nothing that is gone in memory.
    pub fn share_with(&mut self, other: &Self) {
        self.world = Arc::clone(&other.world);
        self.constraints = Arc::clone(&other.constraints);
        self.settings = Arc::clone(&other.settings);
        self.collision_pairs = Arc::clone(&other.collision_pairs);
        self.target_sources = Arc::clone(&other.target_sources);
        self.sensors = Arc::clone(&other.sensors);
        self.saved = Arc::clone(&other.saved);
    }

    /// A number that is equal where what moves is equal to the bit: where robots are, how they move, what drives them
    /// and what touches. For comparing runs of one build on one machine, step by step; settings that have not acted yet
    /// and names are not in it, and the epoch is not.
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

    /// A state that the world can go back to, by name.
    ///
    /// # Errors
    /// Returns an error if there is no such state.
    pub fn saved(&self, name: &str) -> Result<&NamedSavedState, Error> {
        self.saved.iter().find(|kept| kept.name == name).ok_or_else(|| no_saved_state(&self.saved, name))
    }

    /// A robot by name, with its index among the robots.
    pub fn entity(&self, name: &str) -> Option<(usize, &Arc<EntityLayout>)> {
        let index = self.world.index_of(name)?;
        Some((index, self.world.entities.get(index)?))
    }

    /// `world_from_link` of each link of the robot at this index, in the model's order.
    pub fn link_poses(&self, index: usize) -> Option<Vec<DPose3>> {
        let entity = self.world.entities.get(index)?;
        let positions = self.positions.get(entity.positions.clone())?;
        Some(entity.tree.link_poses(self.roots.get(index)?.pose, positions))
    }

    /// Linear velocity of the origin and angular velocity of each link of the robot at this
    /// index, world axes, in the model's order.
    pub fn link_twists(&self, index: usize) -> Option<Vec<(DVec3, DVec3)>> {
        let entity = self.world.entities.get(index)?;
        Some(entity.tree.link_twists(&self.configuration(index)?))
    }

    /// Where the robot at this index is and how it moves.
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
