//! State of one robot, and its step.

pub(super) mod balance;
mod body_state;
mod leapfrog;
mod mobility;
pub(super) mod momenta;
mod poses;
mod prefetch;
mod rows;
mod saturation;
mod soundness;
mod speed_limits;
mod state;

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};

use super::actuator::{Actuator, Axis, Drive};
use super::articulated::{InertiaPass, MidStep, accelerate, base_acceleration};
use super::constraint::{Constraints, Impulses, OfTendons, collect, collect_tendons, respond, solve};
use super::gains::set_default_gains;
use super::gravity_compensation::{SubtreeMass, compensate, is_compensated};
use super::integrate::advance;
use super::integrator::Integrator;
use super::kinematics::{BodyMotion, update_kinematics};
use super::scratch::{BodyScratch, MultiRhs, Scratch};
use super::spatial::{Placement, Spatial};
use super::spherical;
use super::spin::{Drift, FreeBody};
use super::symmetric::Symmetric;
use super::tendon;
use super::tree::{Body, JointType, Tree};
use super::velocity_terms::{VelocityTerms, is_fast};

pub use body_state::BodyState;
pub(in crate::dynamics) use saturation::{BOTH_WAYS_UNTIL, EXACT_ROUNDS, MAX_ROUNDS};

/// One robot: its structure, its state, and the scratch of its step.
///
/// Vectors have the lengths of the tree: positions, and velocities with everything aligned to them. A free
/// root comes first.
#[derive(Debug)]
pub struct Articulation {
    /// Structure, shared by robots of one model. Passes borrow it and never clone the `Arc`. Otherwise
    /// threads that step two such robots would contend for its count's cache line, which also holds the
    /// tree's lists.
    tree: Arc<Tree>,
    state: BodyState,
    scratch: StepScratch,
}

/// Results of a step, without meaning between steps.
#[derive(Debug)]
struct StepScratch {
    new_velocities: Vec<f64>,
    constraints: Constraints,
    passes: Scratch,
    integrator: Integrator,
    /// Whether a limit acted in this step.
    is_held: bool,
    /// Whether a constraint between links acted.
    is_linked: bool,
    /// Whether a contact acted.
    is_touched: bool,
    /// Whether dry friction or a limit began or ceased to hold in this step, or an actuator reached or left
    /// its effort limit.
    is_kinked: bool,
    /// Whether external forces jumped before this step.
    meets_jump: bool,
    /// Remaining part of each actuator's gains; see [`Drive::weaken`].
    parts: Vec<f64>,
    /// Whether some of `parts` are less than one.
    is_weakened: bool,
    /// Response to an impulse.
    response: Vec<f64>,
    /// Split velocities of this step, which correct positions; empty if there are none.
    split: Vec<f64>,
    /// Velocity of the position correction of a single body, m/s.
    shift: DVec3,
    /// Predicted positions, and the bodies at them.
    ahead: Vec<f64>,
    bodies_ahead: Vec<BodyScratch>,
    /// Subtree masses for gravity compensation.
    subtrees: Vec<SubtreeMass>,
    /// Inertia of a robot that is a single free body.
    free_body: Option<FreeBody>,
    /// Motion of the free body through the step without constraints.
    drift: Drift,
    velocity_terms: VelocityTerms,
    /// Resistance to turning of a single free body in addition to its own moment, base axes; zero before
    /// [`Articulation::add_turning_resistance`] sets it.
    stiffening: Symmetric,
}

impl Articulation {
    /// Creates a passive robot at rest with its root at `world_from_root` and its joints at `positions`,
    /// which exclude a free root's.
    pub fn new(tree: Arc<Tree>, world_from_root: DPose3, axes: Vec<Axis>, positions: &[f64]) -> Self {
        let state = BodyState::new(&tree, world_from_root, axes, positions);
        Self::with_state(tree, state)
    }

    /// Creates a robot with a state of its tree.
    pub fn with_state(tree: Arc<Tree>, state: BodyState) -> Self {
        let free_body = match &tree.bodies[..] {
            [body] if matches!(body.joint_type, JointType::Free { .. }) && !tree.fixed_base => {
                FreeBody::new(&body.inertia)
            }
            _ => None,
        };
        let scratch = StepScratch {
            new_velocities: vec![0.0; tree.velocity_count],
            integrator: Integrator::default(),
            is_held: false,
            is_linked: false,
            is_touched: false,
            is_kinked: false,
            meets_jump: false,
            parts: vec![1.0; tree.velocity_count],
            is_weakened: false,
            response: vec![0.0; tree.velocity_count],
            split: Vec::new(),
            shift: DVec3::ZERO,
            ahead: Vec::new(),
            bodies_ahead: Vec::new(),
            subtrees: Vec::new(),
            free_body,
            drift: Drift::default(),
            velocity_terms: VelocityTerms::new(&tree),
            stiffening: Symmetric::ZERO,
            constraints: Constraints::default(),
            passes: Scratch {
                bodies: vec![BodyScratch::default(); tree.bodies.len()],
                free: vec![Default::default(); tree.free_bodies()],
                rhs: if tree.bodies.len() > 1 {
                    vec![MultiRhs::default(); tree.bodies.len()]
                } else {
                    Vec::new()
                },
            },
        };
        Self { tree, state, scratch }
    }

    /// Advances by `h` seconds, without contacts.
    ///
    /// 1. [`update_kinematics`](Self::update_kinematics): poses and velocities of bodies.
    /// 2. [`start`](Self::start): each actuator's law for this step, articulated inertias and accelerations.
    ///    They give the new velocities; in leapfrog these belong to the middle of the step.
    /// 3. [`solve_alone`](Self::solve_alone): constraints change the new velocities. An actuator whose effort
    ///    would exceed its limit applies the limit, and the new velocities are computed again. Robots that
    ///    touch are solved together instead, by [`Island`](super::island::Island).
    /// 4. [`finish`](Self::finish): integrates positions with the new velocities.
    ///
    /// Allocates nothing once the constraints have reached their largest size, and fast spins have occurred
    /// if they ever do.
    pub fn step(&mut self, gravity: DVec3, h: f64, integrator: Integrator) {
        self.update_kinematics();
        self.start(gravity, h, integrator);
        self.solve_alone(gravity, h);
        self.finish(gravity, h);
    }

    /// Computes poses and velocities of all bodies.
    pub fn update_kinematics(&mut self) {
        update_kinematics(
            &self.tree,
            &self.state.positions,
            &self.state.velocities,
            &mut self.scratch.passes.bodies,
        );
    }

    /// Determines each actuator's law for the step, the new velocities without constraints, and the rows of
    /// joints.
    pub fn start(&mut self, gravity: DVec3, h: f64, integrator: Integrator) {
        self.begin_leapfrog(integrator);
        self.set_drives(gravity, h);
        self.predict(gravity, h);
        self.meet_jump(h);
        self.collect_rows(h);
    }

    /// Collects the rows of joints for the new velocities.
    fn collect_rows(&mut self, h: f64) {
        let Self { tree, state, scratch } = self;
        let StepScratch { new_velocities, constraints, integrator, .. } = scratch;
        let moved = (&*state.positions, &**new_velocities);
        collect(tree, &state.axes, moved, &state.impulses, (*integrator, h), constraints);
        if !tree.tendons.is_empty() {
            let BodyState { axes, drives, positions, half_velocities, impulses: warm, .. } = &*state;
            let of = OfTendons { axes, drives, positions, half_velocities, new_velocities, warm };
            collect_tendons(tree, of, (h, *integrator), constraints);
        }
    }

    /// Makes the new velocities satisfy the rows of joints.
    pub fn solve_alone(&mut self, gravity: DVec3, h: f64) {
        let is_floating = self.scratch.integrator == Integrator::Leapfrog && self.is_floating();
        for round in 0..MAX_ROUNDS {
            if round > 0 {
                self.predict(gravity, h);
            }
            if is_floating {
                self.solve_floating(gravity, h);
            } else {
                self.solve_rows();
            }
            self.store_impulses();
            if !self.saturate(h, round) {
                break;
            }
        }
    }

    /// Makes the new velocities satisfy the rows.
    fn solve_rows(&mut self) {
        let StepScratch { new_velocities, constraints, passes, .. } = &mut self.scratch;
        solve(&self.tree, &self.state.positions, constraints, passes, new_velocities);
        self.tree.tendons_follow(new_velocities);
    }

    /// Integrates positions with the new velocities.
    pub fn finish(&mut self, gravity: DVec3, h: f64) {
        self.tree.tendons_follow(&mut self.scratch.new_velocities);
        self.note_efforts(h);
        self.limit_velocities();
        self.note_changes(gravity, h);
        advance(&self.tree, &mut self.state.positions, &self.scratch.new_velocities, h);
        self.take_new_velocities(gravity, h);
        self.place_tendons();
    }

    /// Like [`finish`](Self::finish), with positions integrated by other velocities, which include position
    /// correction.
    pub fn finish_corrected(&mut self, split_velocities: &[f64], gravity: DVec3, h: f64) {
        self.scratch.is_touched = true;
        self.tree.tendons_follow(&mut self.scratch.new_velocities);
        self.note_efforts(h);
        self.limit_velocities();
        self.note_changes(gravity, h);
        advance(&self.tree, &mut self.state.positions, split_velocities, h);
        self.take_new_velocities(gravity, h);
        self.place_tendons();
    }

    /// Sets positions and velocities of tendons to those of their joints.
    fn place_tendons(&mut self) {
        if !self.tree.tendons.is_empty() {
            self.tree.apply_tendons(&mut self.state.positions);
            self.tree.tendons_follow(&mut self.state.velocities);
            self.tree.tendons_follow(&mut self.state.half_velocities);
        }
    }

    /// Advances setpoints, and determines each actuator's law for the step.
    fn set_drives(&mut self, gravity: DVec3, h: f64) {
        let Self { tree, state, scratch } = self;
        let StepScratch { passes, subtrees, is_weakened, .. } = scratch;
        *is_weakened = false;
        let (mut any_compensates, mut any_slips) = (false, false);
        for body in &tree.bodies {
            if !matches!(body.joint_type, JointType::Revolute | JointType::Prismatic) {
                any_compensates |= set_ball_drives(state, body, h);
                continue;
            }
            let (axis, drive) = (&mut state.axes[body.velocity], &mut state.drives[body.velocity]);
            let saturated = drive.saturated;
            axis.advance_setpoint(h);
            *drive = axis.drive(h);
            any_compensates |= is_compensated(axis);
            if let Some(velocity) = axis.asked_velocity(state.positions[body.position], 0.0) {
                drive.velocity = velocity;
                any_slips |= axis.actuator.servo.is_some_and(|servo| servo.slip != 0.0);
                // Another position target begins where the joint is.
                axis.actuator.setpoint = state.positions[body.position];
                axis.actuator.setpoint_velocity = state.velocities[body.velocity];
            }
            // An actuator that saturated in the last step mostly does in this one.
            drive.saturated = saturated.map(|effort| drive.limit.copysign(effort)).filter(|e| e.is_finite());
        }
        if any_compensates {
            let BodyState { axes, drives, base, .. } = state;
            let base = Placement::new(base.rotation, base.translation);
            compensate(tree, axes, &passes.bodies, base_acceleration(&base, gravity), subtrees, drives);
        }
        if any_slips {
            self.let_slip(gravity, h);
        }
    }

    /// Adds to the velocities that servos aim at the parts of the free velocities that they let through.
    fn let_slip(&mut self, gravity: DVec3, h: f64) {
        for drive in &mut self.state.drives {
            // A saturated actuator has no gains.
            drive.saturated = Some(drive.feed_forward);
        }
        self.predict(gravity, h);
        let Self { tree, state, scratch } = self;
        let BodyState { positions, axes, drives, .. } = state;
        for body in &tree.bodies {
            let dof = body.velocity;
            if matches!(body.joint_type, JointType::Revolute | JointType::Prismatic)
                && let Some(velocity) =
                    axes[dof].asked_velocity(positions[body.position], scratch.new_velocities[dof])
            {
                drives[dof].velocity = velocity;
            }
        }
        drives.iter_mut().for_each(|drive| drive.saturated = None);
    }

    /// Second and third pass: computes the new velocities without constraints.
    pub(super) fn predict(&mut self, gravity: DVec3, h: f64) {
        let tree = &*self.tree;
        self.scratch.stiffening = Symmetric::ZERO;
        let BodyState { positions, velocities, half_velocities, .. } = &self.state;
        let StepScratch { new_velocities, passes, integrator, velocity_terms, free_body, .. } =
            &mut self.scratch;
        let base = Placement::new(self.state.base.rotation, self.state.base.translation);
        let pass = InertiaPass {
            tree,
            axes: &self.state.axes,
            drives: &self.state.drives,
            external: &self.state.external,
            positions,
            half_velocities,
            h,
            integrator: *integrator,
            scratch: &mut *passes,
        };
        pass.run();
        if !tree.tendons.is_empty() {
            tendon::release(
                tree,
                (&self.state.axes, &self.state.drives),
                (h, *integrator),
                &mut passes.bodies,
            );
        }
        if *integrator == Integrator::Leapfrog && free_body.is_some() {
            self.drift(gravity, h, 1.0);
            return;
        }
        let state = MidStep { q: positions, qd: velocities, half: half_velocities };
        accelerate(tree, base_acceleration(&base, gravity), state, h, passes, new_velocities);
        if integrator.bullet().is_some() {
            self.limit_velocities();
            return;
        }
        if *integrator == Integrator::Leapfrog && is_fast(passes, h) {
            velocity_terms.solve(tree, state, h, passes, new_velocities);
        }
    }

    /// Returns the pose of a body and the velocity of its origin in the world, as computed by
    /// [`update_kinematics`](Self::update_kinematics).
    pub fn body_motion(&self, body: usize) -> BodyMotion {
        let at = &self.scratch.passes.bodies[body];
        let turn = self.state.base.rotation;
        let own = DQuat::from_mat3(&at.rotation);
        BodyMotion {
            pose: DPose3::from_parts(self.state.base.transform_point(at.origin), (turn * own).normalize()),
            linear: turn * at.velocity.linear,
            angular: turn * at.velocity.angular,
        }
    }

    /// Returns the motion of a body in its own axes, by the last update of the kinematics.
    pub fn own_motion(&self, body: usize) -> Spatial {
        let at = &self.scratch.passes.bodies[body];
        let turned = at.rotation.transpose();
        Spatial::new(turned * at.velocity.angular, turned * at.velocity.linear)
    }

    /// Returns the new velocities computed so far.
    pub(super) fn new_velocities_mut(&mut self) -> &mut [f64] {
        &mut self.scratch.new_velocities
    }

    /// Clears what the next step would start from: warm-start impulses, saturation, efforts.
    pub fn forget_last_step(&mut self) {
        self.state.impulses = Impulses::new(&self.tree);
        self.state.drives.fill(Drive::default());
        self.state.efforts.fill(0.0);
        self.state.forget_last_step();
    }

    /// Returns the change of all velocities by a unit impulse at the joint of a body, a column of
    /// `(M + h K_d + h^2 K_p)^-1`. Uses the last step's factorisation.
    pub fn response(&mut self, body: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.state.velocities.len()];
        let tree = Arc::clone(&self.tree);
        respond(&tree, &self.state.positions, &[(body, 1.0)], &mut self.scratch.passes, &mut out);
        out
    }

    /// Returns what the actuators of the last step add to the diagonal of M, by velocity: armature + h (kd +
    /// damping) + h^2 kp. The springs and dampers count as far as each joint's
    /// [`Implicitness`](super::integrator::Implicitness) says; 0 for free bodies.
    pub fn resistance(&self, h: f64) -> Vec<f64> {
        let mut resistance = vec![0.0; self.tree.velocity_count];
        for (body, at) in self.tree.bodies.iter().zip(&self.scratch.passes.bodies) {
            let dof = body.velocity;
            if !matches!(body.joint_type, JointType::Free { .. }) {
                resistance[dof] = self.state.axes[dof].settings.own_forces().resistance(h, at.implicitness)
                    + self.state.drives[dof].resistance(h, at.implicitness);
            }
        }
        resistance
    }

    /// Sets default gains from the composite inertias at the present positions.
    pub fn set_default_gains(&mut self) {
        set_default_gains(&self.tree, &self.state.positions, &mut self.state.axes);
    }

    /// Makes a joint hold its position.
    pub fn hold(&mut self, body: usize) {
        let velocity = self.tree.bodies[body].velocity;
        let position = self.tree.position_of_axis(body, &self.state.positions);
        let actuator = Actuator::hold(position, self.state.velocities[velocity]);
        self.set_actuator(velocity, actuator);
    }
}

/// Like [`Articulation::set_drives`], for a body of a ball joint: sets all three axes at the first. Does
/// nothing for a free body. Returns whether the actuator compensates gravity.
#[inline(never)]
fn set_ball_drives(state: &mut BodyState, body: &Body, h: f64) -> bool {
    let JointType::Spherical { axis } = body.joint_type else { return false };
    let BodyState { positions, axes, drives, .. } = state;
    if axis == 0 {
        let dofs = body.velocity..body.velocity + 3;
        let actuators = (&mut axes[dofs.clone()], &mut drives[dofs]);
        spherical::set_drives(&positions[body.position..], actuators, h);
    }
    is_compensated(&axes[body.velocity])
}

#[cfg(test)]
mod tests;
