//! One robot in the world: its dynamics, the state it was spawned with, and its claims.

mod colliders;
mod damping;
mod joints;
mod pulls;
mod sensors;
mod setup;
mod sleep;
mod wrenches;

use std::hint::black_box;
use std::sync::Arc;

use glamx::DPose3;
use simd_model::RobotModel;
use simd_model::robot::{JointKind, JointLimits};

pub(super) use self::colliders::check_own_pairs;
use self::joints::is_actuated;
use super::claim::RobotClaims;
use super::contact_settings::ContactSettings;
use super::world_state::{EntityState, RobotState};
use crate::collision::{RobotColliders, Shapes, Surface};
use crate::dynamics::tree::JointType;
use crate::dynamics::{Articulation, Axis, Integrator, LARGEST_STATE, Mode, Tree};

/// A robot in the world: its description, its state, and the scratch of a step.
#[derive(Debug)]
pub(super) struct Entity {
    /// Version, which no other robot or model had before. Equal versions have equal immutable data.
    pub version: u64,
    /// Model of the robot.
    pub model: Arc<RobotModel>,
    /// State outside of the dynamics.
    pub state: EntityState,
    /// Tree, state of the dynamics, and their scratch.
    pub body: Articulation,
    /// Colliders: shapes, and scratch derived from the state.
    pub colliders: RobotColliders,
    /// Claims of the robot and its joints.
    pub claims: RobotClaims,
    /// Whether the new velocities of this part of a step are computed.
    pub is_started: bool,
}

/// Immutable data of one version of a robot. Cheap to copy.
#[derive(Clone, Debug)]
pub(super) struct Description {
    pub version: u64,
    pub model: Arc<RobotModel>,
    pub tree: Arc<Tree>,
    pub shapes: Arc<Shapes>,
}

/// Returns the tree of a robot of this model, shared with one of `robots` if possible. The data that hundreds
/// of robots read of it in each part of a step then stay in the cache.
pub(super) fn tree_for<'a>(
    robots: impl IntoIterator<Item = &'a Entity>,
    model: &Arc<RobotModel>,
    fixed_base: bool,
) -> Arc<Tree> {
    let is_like = |robot: &&Entity| Arc::ptr_eq(&robot.model, model) && robot.is_fixed() == fixed_base;
    let like = robots.into_iter().find(is_like);
    like.map_or_else(|| Arc::new(Tree::new(model, fixed_base)), |robot| Arc::clone(robot.body.tree()))
}

impl Entity {
    /// Creates a robot at rest, with each joint passive or holding. The tree must be of its model.
    pub(super) fn new(
        name: String,
        version: u64,
        model: Arc<RobotModel>,
        tree: Arc<Tree>,
        pose: DPose3,
        passive: bool,
    ) -> Self {
        let fixed_base = tree.fixed_base;
        let axes = axes(&model, &tree);
        let start = start_positions(&model, &tree, &axes);
        let mut body = Articulation::new(tree, pose, axes, &start);
        for index in 0..body.tree().bodies.len() {
            if is_actuated(&model, body.tree(), index) {
                if passive {
                    let velocity = body.tree().bodies[index].velocity;
                    body.axes_mut()[velocity].actuator.mode = Mode::Passive;
                } else {
                    body.hold(index);
                }
            }
        }
        let claims = RobotClaims::none(model.joints.len());
        let state = EntityState {
            name,
            loaded_at_start: false,
            fixed_base,
            contact_settings: ContactSettings::default(),
            surfaces: Vec::new(),
            groups: setup::groups(&model),
            link_damping: Vec::new(),
            collision_pairs: Arc::default(),
            asleep: false,
            rest_poses: Vec::new(),
            teleported: true,
            still_for: 0.0,
            disabled: None,
            spawned: Arc::new(body.state().clone()),
            last_good: (Vec::new(), Vec::new()),
            applied_wrenches: Vec::new(),
            expired_wrenches: Vec::new(),
            pulls: Vec::new(),
            trajectories: Vec::new(),
            sensors: Vec::new(),
        };
        let mut entity = Self {
            version,
            model,
            state,
            body,
            colliders: RobotColliders::default(),
            claims,
            is_started: false,
        };
        entity.begin_as_described(passive);
        entity.state.spawned = Arc::new(entity.body.state().clone());
        entity
    }

    /// Creates a robot in a state that was saved with this description.
    pub(super) fn from_state(description: &Description, RobotState { entity, body }: RobotState) -> Self {
        let Description { version, model, tree, shapes } = description;
        let colliders = RobotColliders::new(tree, shapes, Surface::default());
        let mut new = Self {
            version: *version,
            model: Arc::clone(model),
            state: entity,
            body: Articulation::with_state(Arc::clone(tree), body),
            colliders,
            claims: RobotClaims::none(model.joints.len()),
            is_started: false,
        };
        new.follow_state();
        new
    }

    /// Restores another state of this robot.
    pub(super) fn set_robot_state(&mut self, RobotState { entity, body }: &RobotState) {
        self.state = entity.clone();
        self.body.set_state(body);
        self.follow_state();
    }

    /// Updates colliders from the state.
    fn follow_state(&mut self) {
        self.colliders.set_surfaces(&self.state.surfaces);
        self.filter_colliders();
        if self.state.asleep {
            self.colliders.restore_poses(&self.state.rest_poses);
        }
    }

    /// Returns the state, which a save copies.
    pub(super) fn robot_state(&self) -> RobotState {
        RobotState { entity: self.state.clone(), body: self.body.state().clone() }
    }

    /// Returns the description, which saved states share.
    pub(super) fn description(&self) -> Description {
        Description {
            version: self.version,
            model: Arc::clone(&self.model),
            tree: Arc::clone(self.body.tree()),
            shapes: Arc::clone(self.colliders.shapes()),
        }
    }

    /// Returns whether its root link cannot move.
    pub(super) fn is_fixed(&self) -> bool {
        self.state.fixed_base
    }

    /// Reads the data that a step needs, and discards them: see [`Articulation::prefetch`].
    pub(super) fn prefetch(&self) {
        self.body.prefetch();
        self.colliders.prefetch();
        black_box(self.state.applied_wrenches.first().map(|wrench| wrench.link));
    }

    /// Stores the state, to restore it if the state after the step is not finite.
    pub(super) fn begin_step(&mut self) {
        self.begin_wrenches();
        if self.is_awake() {
            self.state.last_good.0.clear();
            self.state.last_good.0.extend_from_slice(self.body.positions());
            self.state.last_good.1.clear();
            self.state.last_good.1.extend_from_slice(self.body.velocities());
        }
    }

    /// Updates bodies and wrenches, and colliders if there are other robots. Contacts are looked for within
    /// `slack` metres and the motion in a part of a step of `h` seconds.
    pub(super) fn update_poses(&mut self, others: bool, slack: f64, (integrator, h): (Integrator, f64)) {
        if self.is_awake() {
            if self.has_external_forces() {
                self.update_external_forces();
                self.add_damping_forces(integrator, h);
            }
            self.body.update_kinematics();
        }
        let Self { body, colliders, state, .. } = self;
        if !state.asleep && (others || colliders.has_self_collision()) {
            colliders.update_poses(body.base(), slack, h, |body_index| body.body_motion(body_index));
        }
    }

    /// Ends a step of `time_step` seconds: removes expired wrenches.
    pub(super) fn end_step(&mut self, time_step: f64) {
        if self.is_active() {
            self.end_wrenches(time_step);
        }
    }

    /// Returns whether its state is not finite after a step.
    pub(super) fn is_not_finite(&self) -> bool {
        self.is_active() && !self.state.asleep && !self.body.is_finite()
    }

    /// Restores the last finite state and disables the robot. Returns the reason.
    pub(super) fn disable(&mut self) -> Arc<str> {
        let culprit = self.first_not_finite();
        self.body.positions_mut().copy_from_slice(&self.state.last_good.0);
        self.body.velocities_mut().fill(0.0);
        self.settle_setpoints();
        self.body.forget_last_step();
        let reason: Arc<str> = format!(
            "the state of {culprit} was not finite, or beyond {LARGEST_STATE:e}, after a step; the robot was \
             restored to the state before and disabled. Reset it, or check its masses and gains and the time \
             step"
        )
        .into();
        self.state.disabled = Some(Arc::clone(&reason));
        reason
    }

    /// Takes over the claims of another state of this robot, with its model there, for the joints that both
    /// have and that are actuated.
    pub(super) fn take_claims(&mut self, claims: &RobotClaims, model: &RobotModel) {
        self.claims =
            RobotClaims { whole: claims.whole.clone(), ..RobotClaims::none(self.model.joints.len()) };
        for (claim, joint) in claims.joints.iter().zip(&model.joints) {
            let Some(claim) = claim else { continue };
            let index = self.joint(&joint.name).ok().filter(|&index| self.actuated_body(index, 0).is_ok());
            if let Some(slot) = index.and_then(|index| self.claims.joints.get_mut(index)) {
                *slot = Some(Arc::clone(claim));
            }
        }
    }

    /// Returns a description of the part that is not finite.
    fn first_not_finite(&self) -> String {
        let tree = self.body.tree();
        let bad = tree.bodies.iter().find(|body| {
            let (p, v) = (body.position, body.velocity);
            let positions = &self.body.positions()[p..p + body.joint_type.positions()];
            let velocities = &self.body.velocities()[v..v + body.joint_type.velocities()];
            positions.iter().chain(velocities).any(|value| value.is_nan() || value.abs() > LARGEST_STATE)
        });
        match bad.and_then(|body| body.joint) {
            Some(joint) => format!("joint {:?}", self.model.joints[joint].name),
            None => "the root link".into(),
        }
    }
}

/// Returns the settings of all axes from the model, without actuators.
fn axes(model: &RobotModel, tree: &Tree) -> Vec<Axis> {
    let mut axes = vec![Axis::default(); tree.velocity_count];
    for body in &tree.bodies {
        let (Some(joint), false) = (body.joint, matches!(body.joint_type, JointType::Free { .. })) else {
            continue;
        };
        let joint = &model.joints[joint];
        let settings = &mut axes[body.velocity].settings;
        settings.damping = joint.damping;
        settings.friction = joint.friction;
        // A planar joint has axes of different units: its limits are ignored.
        settings.limits = match joint.kind {
            JointKind::Planar => JointLimits::default(),
            JointKind::Continuous | JointKind::Spherical => {
                JointLimits { lower: None, upper: None, ..joint.limits }
            }
            _ => joint.limits,
        };
    }
    setup::set_axes(model, tree, &mut axes);
    axes
}

/// Returns the initial positions: the description's, else zero, or the nearest limit if zero is beyond it; a
/// follower's follows its leader.
fn start_positions(model: &RobotModel, tree: &Tree, axes: &[Axis]) -> Vec<f64> {
    let mut q = vec![0.0; tree.position_count];
    for body in &tree.bodies {
        match body.joint_type {
            JointType::Free { .. } => q[body.position + 6] = 1.0,
            JointType::Spherical { axis: 0 } => q[body.position + 3] = 1.0,
            JointType::Spherical { .. } => {}
            JointType::Revolute | JointType::Prismatic => {
                q[body.position] = axes[body.velocity].settings.limits.nearest(0.0)
            }
        }
    }
    for (position, value) in setup::positions(model, tree) {
        q[position] = value;
    }
    apply_mimics(tree, &mut q);
    q.split_off(tree.root_positions())
}

/// Sets the positions of mimic joints. Chains are at most as long as the number of pairs.
pub(super) fn apply_mimics(tree: &Tree, q: &mut [f64]) {
    tree.apply_mimics(q);
}

/// Sets the velocities of mimic joints and of tendons.
pub(super) fn apply_mimic_velocities(tree: &Tree, qd: &mut [f64]) {
    for _ in 0..tree.mimics.len() {
        for pair in &tree.mimics {
            let leader = qd[tree.bodies[pair.leader].velocity];
            qd[tree.bodies[pair.follower].velocity] = pair.multiplier * leader;
        }
    }
    tree.tendons_follow(qd);
}
