//! The state of one robot, and its step.

mod body_state;
mod state;

use std::hash::Hasher;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};

use super::actuator::{Actuator, Axis, Drive};
use super::articulated::{accelerate, base_acceleration, gather_inertia};
use super::constraint::{
    Constraints, Impulses, collect, keep, prepare, project, respond, respond_to_force, solve, sweep,
};
use super::gains::set_default_gains;
use super::integrate::{advance, write_free_pose};
use super::kinematics::update_kinematics;
use super::scratch::{BodyScratch, Scratch};
use super::spatial::{Placement, Spatial};
use super::tree::{JointType, Tree};
use crate::collision::BodyMotion;

pub use body_state::BodyState;
pub(crate) use body_state::{finite, pose, sizes};

/// Rounds at the most in which actuators are found to saturate. Each round that
/// changes something saturates one actuator more, and two are the rule.
pub(super) const MAX_ROUNDS: usize = 4;

/// One robot: where it is, how it moves, what drives it.
///
/// Vectors are as long as the tree says: positions, and velocities with all that is
/// aligned with them. A free root comes first.
#[derive(Clone, Debug)]
pub struct Articulation {
    tree: Arc<Tree>,
    /// World from the base: the root link where it is fixed, else the world itself.
    base: DPose3,
    /// q.
    positions: Vec<f64>,
    /// qd.
    velocities: Vec<f64>,
    /// One per degree of freedom; those of free bodies have no actuator and no settings.
    axes: Vec<Axis>,
    /// The laws of the step, one per degree of freedom.
    drives: Vec<Drive>,
    /// What the actuators applied over the last step, one per degree of freedom.
    efforts: Vec<f64>,
    /// Forces from outside on each body, in its own frame. Held until changed.
    external: Vec<Spatial>,
    /// Between steps: the velocities before the last one.
    new_velocities: Vec<f64>,
    /// Whether it was a step that gave it its velocities.
    has_stepped: bool,
    constraints: Constraints,
    scratch: Scratch,
}

impl Articulation {
    /// A robot at rest with its root at `world_from_root` and its joints at
    /// `positions`, which are those of the joints alone; passive.
    pub fn new(tree: Arc<Tree>, world_from_root: DPose3, axes: Vec<Axis>, positions: &[f64]) -> Self {
        let mut q = vec![0.0; tree.root_positions()];
        if !tree.fixed_base {
            write_free_pose(&mut q, world_from_root.translation, world_from_root.rotation);
        }
        q.extend_from_slice(positions);
        q.resize(tree.position_count, 0.0);
        let n = tree.velocity_count;
        let mut new = Self {
            base: if tree.fixed_base { world_from_root } else { DPose3::IDENTITY },
            positions: q,
            velocities: vec![0.0; n],
            axes,
            drives: vec![Drive::default(); n],
            efforts: vec![0.0; n],
            external: vec![Spatial::ZERO; tree.bodies.len()],
            new_velocities: vec![0.0; n],
            has_stepped: false,
            constraints: Constraints { warm: Impulses::new(&tree), ..Constraints::default() },
            scratch: Scratch {
                bodies: vec![BodyScratch::default(); tree.bodies.len()],
                free: vec![Default::default(); tree.free_bodies()],
            },
            tree,
        };
        new.axes.resize(n, Axis::default());
        set_default_gains(&new.tree, &new.positions, &mut new.axes);
        new
    }

    /// Advances by `h` seconds, touching nothing: semi-implicit Euler.
    ///
    /// 1. [`update_kinematics`](Self::update_kinematics): where bodies are and how they move.
    /// 2. [`start`](Self::start): each actuator's law for this step; articulated inertias,
    ///    accelerations, and so the new velocities.
    /// 3. [`solve_alone`](Self::solve_alone): constraints change the new velocities; an actuator
    ///    whose effort at these velocities would exceed its limit applies the limit, and the new
    ///    velocities are found again. Robots that touch are solved together instead, by
    ///    [`Island`](super::island::Island).
    /// 4. [`finish`](Self::finish): positions follow the new velocities.
    ///
    /// Allocates nothing once the constraints have had their largest size.
    pub fn step(&mut self, gravity: DVec3, h: f64) {
        self.update_kinematics();
        self.start(gravity, h);
        self.solve_alone(gravity, h);
        self.finish(h);
    }

    /// Where bodies are and how they move.
    pub fn update_kinematics(&mut self) {
        update_kinematics(&self.tree, &self.positions, &self.velocities, &mut self.scratch.bodies);
    }

    /// Takes each actuator's law for the step, finds the new velocities without constraints, and
    /// the rows of joints.
    pub fn start(&mut self, gravity: DVec3, h: f64) {
        let tree = Arc::clone(&self.tree);
        self.set_drives(&tree, h);
        self.predict(gravity, h);
        let state = (&*self.positions, &*self.new_velocities);
        collect(&tree, &self.axes, state, h, &mut self.constraints);
    }

    /// Makes the new velocities keep to the rows of joints.
    pub fn solve_alone(&mut self, gravity: DVec3, h: f64) {
        let tree = Arc::clone(&self.tree);
        for round in 0..MAX_ROUNDS {
            if round > 0 {
                self.predict(gravity, h);
            }
            solve(&tree, &self.positions, &mut self.constraints, &mut self.scratch, &mut self.new_velocities);
            if !self.saturate(h, round == 0) {
                break;
            }
        }
    }

    /// Moves on with the new velocities.
    pub fn finish(&mut self, h: f64) {
        self.note_efforts(h);
        self.take_new_velocities();
        advance(&self.tree, &mut self.positions, &self.velocities, h);
    }

    /// Like [`finish`](Self::finish), with positions integrated by other velocities, which include position
    /// correction.
    pub fn finish_corrected(&mut self, split_velocities: &[f64], h: f64) {
        self.note_efforts(h);
        self.take_new_velocities();
        advance(&self.tree, &mut self.positions, split_velocities, h);
    }

    fn take_new_velocities(&mut self) {
        std::mem::swap(&mut self.velocities, &mut self.new_velocities);
        self.has_stepped = true;
    }

    /// What the actuators apply at the new velocities.
    fn note_efforts(&mut self, h: f64) {
        for body in &self.tree.bodies {
            if !matches!(body.joint_type, JointType::Free { .. }) {
                let (q, qd) = (self.positions[body.position], self.new_velocities[body.velocity]);
                self.efforts[body.velocity] = self.drives[body.velocity].effort(q, qd, h);
            }
        }
    }

    /// Moves setpoints on, and takes each actuator's law for the step.
    fn set_drives(&mut self, tree: &Tree, h: f64) {
        for body in &tree.bodies {
            if matches!(body.joint_type, JointType::Free { .. }) {
                continue;
            }
            let (q, qd) = (self.positions[body.position], self.velocities[body.velocity]);
            let (axis, drive) = (&mut self.axes[body.velocity], &mut self.drives[body.velocity]);
            let saturated = drive.saturated;
            if saturated.is_some() {
                axis.anti_windup(drive, q, qd, h);
            }
            axis.advance_setpoint(h);
            *drive = axis.drive(h);
            // An actuator that saturated in the last step mostly does in this one.
            drive.saturated = saturated.map(|effort| drive.limit.copysign(effort)).filter(|e| e.is_finite());
        }
    }

    /// Second and third pass: the new velocities without constraints.
    pub(super) fn predict(&mut self, gravity: DVec3, h: f64) {
        let tree = &*self.tree;
        let state = (&*self.positions, &*self.velocities);
        let base = Placement::new(self.base.rotation, self.base.translation);
        gather_inertia(tree, &self.axes, &self.drives, &self.external, state, h, &mut self.scratch);
        accelerate(
            tree,
            base_acceleration(&base, gravity),
            state,
            h,
            &mut self.scratch,
            &mut self.new_velocities,
        );
    }

    /// Finds the actuators whose solved effort is beyond their limit, and where
    /// `release`, those that were saturated and need not be. Says whether any changed.
    pub(super) fn saturate(&mut self, h: f64, release: bool) -> bool {
        let mut changed = false;
        for body in &self.tree.bodies {
            let drive = &mut self.drives[body.velocity];
            if matches!(body.joint_type, JointType::Free { .. }) || drive.limit == f64::INFINITY {
                continue;
            }
            let law = drive.law(self.positions[body.position], self.new_velocities[body.velocity], h);
            let next = match drive.saturated {
                // Held at its limit: right as long as the law would go beyond on that side.
                Some(effort) if law * effort.signum() >= drive.limit || !release => Some(effort),
                Some(_) => None,
                None => (law.abs() > drive.limit).then(|| drive.limit.copysign(law)),
            };
            changed |= next != drive.saturated;
            drive.saturated = next;
        }
        changed
    }

    /// Where a body is and how it moves, as [`update_kinematics`](Self::update_kinematics) found: its origin, axes and
    /// velocity of the origin, world.
    pub fn body_motion(&self, body: usize) -> BodyMotion {
        let at = &self.scratch.bodies[body];
        let turn = self.base.rotation;
        let own = DQuat::from_mat3(&at.rotation);
        BodyMotion {
            pose: DPose3::from_parts(self.base.transform_point(at.origin), (turn * own).normalize()),
            linear: turn * at.velocity.linear,
            angular: turn * at.velocity.angular,
        }
    }

    /// A unit impulse at a world point of a body, in a world direction, as it acts about the body's
    /// origin, in the base's axes.
    pub(super) fn wrench(&self, body: usize, point: DVec3, direction: DVec3) -> Spatial {
        let arm = self.base.inverse_transform_point(point) - self.scratch.bodies[body].origin;
        let direction = self.base.rotation.inverse() * direction;
        Spatial::new(arm.cross(direction), direction)
    }

    /// Writes J for an impulse on a body about its origin, in the base's axes.
    pub(super) fn wrench_row(&self, body: usize, wrench: Spatial, jacobian: &mut [f64]) {
        project(&self.tree, &self.positions, &self.scratch.bodies, (body, wrench), jacobian);
    }

    /// Writes M^-1 J' for the same.
    pub(super) fn wrench_response(&mut self, body: usize, wrench: Spatial, response: &mut [f64]) {
        respond_to_force(&self.tree, &self.positions, (body, wrench), &mut self.scratch, response);
    }

    /// Gives `velocities` the impulses that the rows of joints start from.
    pub(super) fn prepare_rows(&mut self, velocities: &mut [f64]) {
        prepare(&self.tree, &self.positions, &mut self.constraints, &mut self.scratch, velocities);
    }

    /// Once through the rows of joints: the largest change of a velocity.
    pub(super) fn sweep_rows(&mut self, velocities: &mut [f64]) -> f64 {
        sweep(&mut self.constraints, velocities)
    }

    /// Keeps the impulses of the rows of joints for the next step.
    pub(super) fn keep_rows(&mut self) {
        keep(&mut self.constraints);
    }

    /// The new velocities, as far as they are found.
    pub(super) fn new_velocities_mut(&mut self) -> &mut [f64] {
        &mut self.new_velocities
    }

    /// Whether the new velocities are numbers.
    pub fn new_velocities_are_finite(&self) -> bool {
        self.new_velocities.iter().all(|velocity| velocity.is_finite())
    }

    /// Forgets what the last step left for the next one to start from: warm-start
    /// impulses, saturation, efforts.
    pub fn forget_last_step(&mut self) {
        self.constraints.warm = Impulses::new(&self.tree);
        self.drives.fill(Drive::default());
        self.efforts.fill(0.0);
        self.has_stepped = false;
    }

    /// The change of all velocities by a unit impulse at the joint of a body, as the last
    /// step's factorisation has it: a column of (M + h K_d + h^2 K_p)^-1.
    pub fn response(&mut self, body: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.velocities.len()];
        let tree = Arc::clone(&self.tree);
        respond(&tree, &self.positions, &[(body, 1.0)], &mut self.scratch, &mut out);
        out
    }

    /// What the actuators of the last step add to the diagonal of M, by velocity:
    /// armature + h (kd + damping) + h^2 kp.
    pub fn resistance(&self, h: f64) -> Vec<f64> {
        let pairs = self.axes.iter().zip(&self.drives);
        pairs.map(|(axis, drive)| axis.settings.resistance(h) + drive.resistance(h)).collect()
    }

    /// Feeds everything that a step reads to a hasher.
    pub fn hash_into(&self, hasher: &mut impl Hasher) {
        let base = self.base.translation.to_array().into_iter().chain(self.base.rotation.to_array());
        for value in base.chain(self.positions.iter().copied()).chain(self.velocities.iter().copied()) {
            hasher.write_u64(value.to_bits());
        }
        for axis in &self.axes {
            axis.hash_into(hasher);
        }
        for (drive, push) in self.drives.iter().zip(&self.external) {
            // A law is read again only where its actuator saturated; see `Axis::anti_windup`.
            hasher.write_u64(drive.saturated.map_or(u64::MAX, f64::to_bits));
            if drive.saturated.is_some() {
                let Drive { stiffness, damping, velocity, feed_forward, limit, .. } = *drive;
                for value in [stiffness, damping, velocity, feed_forward, limit] {
                    hasher.write_u64(value.to_bits());
                }
            }
            for value in push.angular.to_array().into_iter().chain(push.linear.to_array()) {
                hasher.write_u64(value.to_bits());
            }
        }
        self.constraints.warm.hash_into(hasher);
    }

    /// Sets default gains from the composite inertias at the present positions.
    pub fn set_default_gains(&mut self) {
        set_default_gains(&self.tree, &self.positions, &mut self.axes);
    }

    /// Makes a joint hold the position that it has.
    pub fn hold(&mut self, body: usize) {
        let body = &self.tree.bodies[body];
        let (position, velocity) = (self.positions[body.position], self.velocities[body.velocity]);
        self.axes[body.velocity].actuator = Actuator::hold(position, velocity);
    }
}
