//! One robot in the world: its dynamics, what it was spawned with, who may drive it.

mod wrenches;

use std::hash::Hasher;
use std::ops::Range;
use std::sync::Arc;

use glamx::DPose3;
use simd_model::RobotModel;
use simd_model::robot::{JointKind, JointLimits};

pub use self::wrenches::ActiveWrench;
use super::check;
use super::command::{ClaimId, ContactSettings};
use super::error::Error;
use super::published_state::{Flags, Mode, PublishedState, RootState};
use crate::collision::RobotColliders;
use crate::dynamics::tree::JointType;
use crate::dynamics::{Articulation, Axis, Tree};

/// A robot in the world.
#[derive(Clone, Debug)]
pub(super) struct Entity {
    /// Unique in the world.
    pub name: String,
    /// Unlike that of any other robot or model before it.
    pub version: u64,
    /// Stays at a reset of scope `spawned`.
    pub loaded_at_start: bool,
    /// What it is.
    pub model: Arc<RobotModel>,
    /// What it touches with.
    pub colliders: RobotColliders,
    /// How its contacts were configured.
    pub contact_settings: ContactSettings,
    /// It rests, and no step looks at it.
    pub asleep: bool,
    /// A command has moved it since the last step.
    pub teleported: bool,
    /// For how long it has hardly moved, seconds.
    pub still_for: f64,
    /// Where it is and how it moves.
    pub body: Articulation,
    /// What a reset of scope `state` puts back. Shared, since copies of the state are made while it plays.
    pub spawned: Arc<Articulation>,
    /// Set while it is out of the simulation: why.
    pub disabled: Option<Arc<str>>,
    /// Who holds a claim on which joint of the model.
    pub claims: Vec<Option<Arc<Claim>>>,
    /// Wrenches that commands applied to links.
    pub applied_wrenches: Vec<ActiveWrench>,
    /// Wrenches that acted over the last step and have expired.
    pub expired_wrenches: Vec<ActiveWrench>,
    /// The state before the present step, to go back to if it is not finite.
    pub last_good: (Vec<f64>, Vec<f64>),
}

impl AsMut<Articulation> for Entity {
    fn as_mut(&mut self) -> &mut Articulation {
        &mut self.body
    }
}

/// Joints taken for one client.
#[derive(Clone, Debug)]
pub(super) struct Claim {
    /// What targets must carry.
    pub id: ClaimId,
    /// Who claims, for people.
    pub holder: Arc<str>,
}

impl Entity {
    /// A robot as it comes into the world: at rest, each joint passive or holding.
    pub(super) fn new(
        name: String,
        version: u64,
        model: Arc<RobotModel>,
        fixed_base: bool,
        pose: DPose3,
        passive: bool,
    ) -> Self {
        let tree = Arc::new(Tree::new(&model, fixed_base));
        let axes = axes(&model, &tree);
        let start = start_positions(&tree, &axes);
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
        let claims = vec![None; model.joints.len()];
        let (spawned, last_good) = (Arc::new(body.clone()), (Vec::new(), Vec::new()));
        let (disabled, applied_wrenches) = (None, Vec::new());
        Self {
            name,
            version,
            loaded_at_start: false,
            model,
            colliders: RobotColliders::default(),
            contact_settings: ContactSettings::default(),
            asleep: false,
            teleported: true,
            still_for: 0.0,
            body,
            spawned,
            disabled,
            claims,
            applied_wrenches,
            expired_wrenches: Vec::new(),
            last_good,
        }
    }

    /// Whether its root link cannot move.
    pub(super) fn is_fixed(&self) -> bool {
        self.body.tree().fixed_base
    }

    /// Keeps the state, to go back to if a step spoils it.
    pub(super) fn begin_step(&mut self) {
        self.begin_wrenches();
        if self.is_awake() {
            self.last_good.0.clear();
            self.last_good.0.extend_from_slice(self.body.positions());
            self.last_good.1.clear();
            self.last_good.1.extend_from_slice(self.body.velocities());
        }
    }

    /// Feeds everything that a step reads to a hasher.
    pub(super) fn hash_into(&self, hasher: &mut impl Hasher) {
        hasher.write(self.name.as_bytes());
        for flag in [self.disabled.is_some(), self.asleep, self.teleported] {
            hasher.write_u8(flag.into());
        }
        let surfaces = self.colliders.surfaces().flat_map(|surface| [surface.friction, surface.restitution]);
        for value in surfaces.chain([self.still_for]) {
            hasher.write_u64(value.to_bits());
        }
        // Each step updates those of an awake robot.
        let saved = if self.asleep { self.colliders.save_poses() } else { Vec::new() };
        for (pose, margin) in saved {
            let pose = pose.translation.to_array().into_iter().chain(pose.rotation.to_array());
            pose.chain([margin]).for_each(|value| hasher.write_u64(value.to_bits()));
        }
        self.applied_wrenches
            .iter()
            .chain(&self.expired_wrenches)
            .for_each(|wrench| wrench.hash_into(hasher));
        self.body.hash_into(hasher);
    }

    /// Updates bodies and wrenches, and colliders if there are other robots. Contacts
    /// are looked for within `slack` metres and what a part of a step, `h` seconds, moves the
    /// robot.
    pub(super) fn update_poses(&mut self, others: bool, slack: f64, h: f64) {
        if self.is_awake() {
            if !self.applied_wrenches.is_empty() {
                self.update_external_forces();
            }
            self.body.update_kinematics();
        }
        let Self { body, colliders, asleep, .. } = self;
        if !*asleep && (others || colliders.has_self_collision()) {
            colliders.update_poses(body.base(), slack, h, |body_index| body.body_motion(body_index));
        }
    }

    /// Ends a step of so many seconds: expired wrenches are taken out. A state that is not finite is put back and
    /// the robot disabled; returns why.
    pub(super) fn end_step(&mut self, time_step: f64) -> Option<Arc<str>> {
        if !self.is_active() {
            return None;
        }
        self.end_wrenches(time_step);
        if self.asleep || self.body.is_finite() {
            return None;
        }
        let culprit = self.first_not_finite();
        self.body.positions_mut().copy_from_slice(&self.last_good.0);
        self.body.velocities_mut().fill(0.0);
        self.body.forget_last_step();
        let reason: Arc<str> = format!(
            "the state of {culprit} was not finite after a step; the robot was put back to the state \
             before and taken out of the simulation. Reset it, or look at its masses, gains and time step"
        )
        .into();
        self.disabled = Some(Arc::clone(&reason));
        Some(reason)
    }

    /// Claims of another state of this robot, for the joints that both have and that can be driven.
    pub(super) fn take_claims_of(&mut self, old: &Self) {
        self.claims.fill(None);
        for (claim, joint) in old.claims.iter().zip(&old.model.joints) {
            let Some(claim) = claim else { continue };
            let index = self.joint(&joint.name).ok().filter(|&index| self.actuated_body(index, 0).is_ok());
            if let Some(slot) = index.and_then(|index| self.claims.get_mut(index)) {
                *slot = Some(Arc::clone(claim));
            }
        }
    }

    /// Index of a joint in the model.
    pub(super) fn joint(&self, joint: &str) -> Result<usize, Error> {
        self.model.joints.iter().position(|known| known.name == joint).ok_or_else(|| Error::JointNotFound {
            robot: self.name.clone(),
            joint: joint.to_owned(),
            known: self.model.joints.iter().map(|joint| joint.name.clone()).collect(),
        })
    }

    /// Index of a link in the model.
    pub(super) fn link(&self, link: &str) -> Result<usize, Error> {
        self.model.links.iter().position(|known| known.name == link).ok_or_else(|| Error::LinkNotFound {
            robot: self.name.clone(),
            link: link.to_owned(),
            known: self.model.links.iter().map(|link| link.name.clone()).collect(),
        })
    }

    /// The body of an axis of a joint that moves along one or, planar, three.
    pub(super) fn axis_body(&self, joint: usize, axis: u32) -> Result<usize, Error> {
        let name = &self.model.joints[joint].name;
        let bodies = self.body.tree().joints[joint].clone();
        if matches!(self.model.joints[joint].kind, JointKind::Fixed | JointKind::Floating) {
            return Err(Error::JointNotActuated {
                robot: self.name.clone(),
                joint: name.clone(),
                why: match self.model.joints[joint].kind {
                    JointKind::Fixed => "is fixed".into(),
                    _ => "is floating".into(),
                },
            });
        }
        let last = bodies.len().saturating_sub(1);
        bodies
            .clone()
            .nth(axis as usize)
            .ok_or_else(|| check::refuse("axis", axis, format!("the joint has axes 0 to {last}")))
    }

    /// The body of an axis that takes targets.
    pub(super) fn actuated_body(&self, joint: usize, axis: u32) -> Result<usize, Error> {
        let index = self.axis_body(joint, axis)?;
        if let Some(mimic) = self.model.joints[joint].mimic {
            return Err(Error::JointNotActuated {
                robot: self.name.clone(),
                joint: self.model.joints[joint].name.clone(),
                why: format!("follows joint {:?}", self.model.joints[mimic.joint].name),
            });
        }
        Ok(index)
    }

    /// Bodies that take targets, with their joint.
    pub(super) fn actuated(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let tree = self.body.tree();
        (0..tree.bodies.len())
            .filter(|&index| is_actuated(&self.model, tree, index))
            .filter_map(|index| Some((tree.bodies[index].joint?, index)))
    }

    /// Ranges of each joint of the model within the robot's own joint positions and velocities.
    pub(super) fn joint_ranges(&self) -> (Vec<Range<usize>>, Vec<Range<usize>>) {
        let tree = self.body.tree();
        let (mut position, mut velocity) = (0, 0);
        tree.joints
            .iter()
            .map(|bodies| {
                let (p, v) = (position, velocity);
                for body in &tree.bodies[bodies.clone()] {
                    position += body.joint_type.positions();
                    velocity += body.joint_type.velocities();
                }
                (p..position, v..velocity)
            })
            .unzip()
    }

    /// Adds what it shows to a snapshot, after a step of so many seconds in parts of `h` seconds.
    pub(super) fn observe(&self, state: &mut PublishedState, time_step: f64, h: f64) {
        let tree = self.body.tree();
        let root = tree.root_velocities();
        let mut accelerations = self.body.last_accelerations(h);
        let mut of_root = [0.0; 6];
        of_root.iter_mut().zip(accelerations.by_ref().take(root)).for_each(|(of, value)| *of = value);
        state.accelerations.extend(accelerations);
        let (linear, angular) = self.body.root_twist();
        state.roots.push(RootState {
            pose: self.body.root_pose(),
            linear,
            angular,
            disabled: self.disabled.clone(),
            accelerations: of_root,
        });
        state.positions.extend_from_slice(&self.body.positions()[tree.root_positions()..]);
        state.velocities.extend_from_slice(&self.body.velocities()[root..]);
        state.efforts.extend_from_slice(&self.body.efforts()[root..]);
        for axis in &self.body.axes()[root..] {
            state.targets.push(axis.actuator.target);
            state.modes.push(axis.actuator.mode);
            state.gains.push(axis.gains(time_step));
        }
        for body in tree.bodies.iter().filter(|body| body.joint.is_some()) {
            match body.joint_type {
                JointType::Free { .. } => state.flags.extend([Flags::default(); 6]),
                _ => state.flags.push(self.flags(body.position, body.velocity)),
            }
        }
    }

    fn flags(&self, position: usize, velocity: usize) -> Flags {
        /// A joint this near to a limit is at it, rad or m.
        const AT_LIMIT: f64 = 1e-6;
        let position = self.body.positions()[position];
        let limits = &self.body.axes()[velocity].settings.limits;
        Flags {
            saturated: self.body.is_saturated(velocity),
            at_lower: limits.lower.is_some_and(|lower| position <= lower + AT_LIMIT),
            at_upper: limits.upper.is_some_and(|upper| position >= upper - AT_LIMIT),
        }
    }

    /// Names what is not finite.
    fn first_not_finite(&self) -> String {
        let tree = self.body.tree();
        let bad = tree.bodies.iter().find(|body| {
            let (p, v) = (body.position, body.velocity);
            let positions = &self.body.positions()[p..p + body.joint_type.positions()];
            let velocities = &self.body.velocities()[v..v + body.joint_type.velocities()];
            positions.iter().chain(velocities).any(|value| !value.is_finite())
        });
        match bad.and_then(|body| body.joint) {
            Some(joint) => format!("joint {:?}", self.model.joints[joint].name),
            None => "the root link".into(),
        }
    }
}

/// Whether a body's axis takes targets.
fn is_actuated(model: &RobotModel, tree: &Tree, index: usize) -> bool {
    let body = &tree.bodies[index];
    let follows = |joint: usize| model.joints[joint].mimic.is_some();
    !matches!(body.joint_type, JointType::Free { .. }) && body.joint.is_some_and(|joint| !follows(joint))
}

/// Settings of all axes as the model gives them; nothing is driven yet.
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
        // A planar joint's limits would be of three kinds at once: only one axis can have them.
        settings.limits = match joint.kind {
            JointKind::Planar => JointLimits::default(),
            JointKind::Continuous => JointLimits { lower: None, upper: None, ..joint.limits },
            _ => joint.limits,
        };
    }
    axes
}

/// Zero, or the nearest limit where zero lies outside; a follower where its leader puts it.
fn start_positions(tree: &Tree, axes: &[Axis]) -> Vec<f64> {
    let mut q = vec![0.0; tree.position_count];
    for body in &tree.bodies {
        match body.joint_type {
            JointType::Free { .. } => q[body.position + 6] = 1.0,
            _ => q[body.position] = axes[body.velocity].settings.limits.nearest(0.0),
        }
    }
    apply_mimics(tree, &mut q);
    q.split_off(tree.root_positions())
}

/// Sets the positions of mimic joints. Chains are as deep as there are pairs.
pub(super) fn apply_mimics(tree: &Tree, q: &mut [f64]) {
    tree.apply_mimics(q);
}

/// Sets the velocities of mimic joints.
pub(super) fn apply_mimic_velocities(tree: &Tree, qd: &mut [f64]) {
    for _ in 0..tree.mimics.len() {
        for pair in &tree.mimics {
            let leader = qd[tree.bodies[pair.leader].velocity];
            qd[tree.bodies[pair.follower].velocity] = pair.multiplier * leader;
        }
    }
}
