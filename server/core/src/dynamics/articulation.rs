//! The state of one robot, and its step.

pub(super) mod balance;
mod body_state;
mod fetch;
mod leapfrog;
mod mobility;
pub(super) mod momenta;
mod poses;
mod rows;
mod saturation;
mod soundness;
mod state;

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};

use super::actuator::{Actuator, Axis, Drive};
use super::articulated::{InertiaPass, accelerate, base_acceleration};
use super::constraint::{Constraints, Impulses, collect, respond, solve};
use super::gains::set_default_gains;
use super::gravity_compensation::{SubtreeMass, compensate, is_compensated};
use super::integrate::advance;
use super::integrator::Integrator;
use super::kinematics::{BodyMotion, update_kinematics};
use super::scratch::{BodyScratch, MultiRhs, Scratch};
use super::spatial::Placement;
use super::spherical;
use super::spin::{Drift, FreeBody};
use super::symmetric::Symmetric;
use super::tree::{Body, JointType, Tree};
use super::velocity_terms::{VelocityTerms, is_fast};

pub use body_state::BodyState;
pub(in crate::dynamics) use saturation::{BOTH_WAYS_UNTIL, EXACT_ROUNDS, MAX_ROUNDS};
pub use soundness::LARGEST_STATE;

/// One robot: how it is built, where it is and how it moves, and the scratch of its step.
///
/// Vectors are as long as the tree says: positions, and velocities with all that is
/// aligned with them. A free root comes first.
#[derive(Debug)]
pub struct Articulation {
    /// Robots of one model share it. Passes borrow it and take no count: threads that step two such robots would take the line
    /// with that count from each other, and where the tree's lists are with it.
    tree: Arc<Tree>,
    state: BodyState,
    scratch: StepScratch,
}

/// What a step computes. It means nothing between steps.
#[derive(Debug)]
struct StepScratch {
    new_velocities: Vec<f64>,
    constraints: Constraints,
    passes: Scratch,
    integrator: Integrator,
    /// A limit acted in this step.
    is_held: bool,
    /// A constraint between links did.
    is_linked: bool,
    /// A contact did.
    is_touched: bool,
    /// Dry friction or a limit began or ended to hold in this step, or an actuator came to its effort limit or left it.
    is_kinked: bool,
    /// Forces from outside have jumped before this step.
    meets_jump: bool,
    /// Of each actuator's gains what is left; see [`Drive::weaken`].
    parts: Vec<f64>,
    /// Some are less than one.
    is_weakened: bool,
    /// Of an impulse.
    response: Vec<f64>,
    /// The split velocities of this step, which put positions right; empty where nothing did.
    split: Vec<f64>,
    /// Of a single body whose position was put right, m/s.
    shift: DVec3,
    /// Positions that are looked at, and bodies in them.
    ahead: Vec<f64>,
    bodies_ahead: Vec<BodyScratch>,
    /// Of gravity compensation.
    subtrees: Vec<SubtreeMass>,
    /// Of a robot that is a single free body.
    free_body: Option<FreeBody>,
    /// How that goes through the step without constraints.
    drift: Drift,
    velocity_terms: VelocityTerms,
    /// What resists the turning of a single free body beside its own moment, base axes; none before
    /// [`Articulation::stiffen`] says so.
    stiffening: Symmetric,
}

impl Articulation {
    /// A robot at rest with its root at `world_from_root` and its joints at
    /// `positions`, which are those of the joints alone; passive.
    pub fn new(tree: Arc<Tree>, world_from_root: DPose3, axes: Vec<Axis>, positions: &[f64]) -> Self {
        let state = BodyState::new(&tree, world_from_root, axes, positions);
        Self::with_state(tree, state)
    }

    /// A robot in a state of its tree.
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

    /// Advances by `h` seconds, touching nothing.
    ///
    /// 1. [`update_kinematics`](Self::update_kinematics): where bodies are and how they move.
    /// 2. [`start`](Self::start): each actuator's law for this step; articulated inertias,
    ///    accelerations, and so the new velocities, which in leapfrog are those in the middle of the step.
    /// 3. [`solve_alone`](Self::solve_alone): constraints change the new velocities; an actuator
    ///    whose effort at these velocities would exceed its limit applies the limit, and the new
    ///    velocities are found again. Robots that touch are solved together instead, by
    ///    [`Island`](super::island::Island).
    /// 4. [`finish`](Self::finish): positions follow the new velocities.
    ///
    /// Allocates nothing once the constraints have had their largest size, and something has spun fast if it will.
    pub fn step(&mut self, gravity: DVec3, h: f64, integrator: Integrator) {
        self.update_kinematics();
        self.start(gravity, h, integrator);
        self.solve_alone(gravity, h);
        self.finish(gravity, h);
    }

    /// Where bodies are and how they move.
    pub fn update_kinematics(&mut self) {
        update_kinematics(
            &self.tree,
            &self.state.positions,
            &self.state.velocities,
            &mut self.scratch.passes.bodies,
        );
    }

    /// Takes each actuator's law for the step, finds the new velocities without constraints, and
    /// the rows of joints.
    pub fn start(&mut self, gravity: DVec3, h: f64, integrator: Integrator) {
        self.begin_leapfrog(integrator);
        self.set_drives(gravity, h);
        self.predict(gravity, h);
        self.meet_jump(h);
        self.collect_rows(h);
    }

    /// Finds the rows of joints for the new velocities.
    fn collect_rows(&mut self, h: f64) {
        let Self { tree, state, scratch } = self;
        let StepScratch { new_velocities, constraints, .. } = scratch;
        let moved = (&*state.positions, &**new_velocities);
        collect(tree, &state.axes, moved, &state.impulses, h, constraints);
    }

    /// Makes the new velocities keep to the rows of joints.
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
            self.keep_rows();
            if !self.saturate(h, round) {
                break;
            }
        }
    }

    /// Makes the new velocities keep to the rows.
    fn solve_rows(&mut self) {
        let StepScratch { new_velocities, constraints, passes, .. } = &mut self.scratch;
        solve(&self.tree, &self.state.positions, constraints, passes, new_velocities);
    }

    /// Moves on with the new velocities.
    pub fn finish(&mut self, gravity: DVec3, h: f64) {
        self.note_efforts(h);
        self.note_changes(gravity, h);
        advance(&self.tree, &mut self.state.positions, &self.scratch.new_velocities, h);
        self.take_new_velocities(gravity, h);
    }

    /// Like [`finish`](Self::finish), with positions integrated by other velocities, which include position
    /// correction.
    pub fn finish_corrected(&mut self, split_velocities: &[f64], gravity: DVec3, h: f64) {
        self.scratch.is_touched = true;
        self.note_efforts(h);
        self.note_changes(gravity, h);
        advance(&self.tree, &mut self.state.positions, split_velocities, h);
        self.take_new_velocities(gravity, h);
    }

    /// Moves setpoints on, and takes each actuator's law for the step.
    fn set_drives(&mut self, gravity: DVec3, h: f64) {
        let Self { tree, state, scratch } = self;
        let StepScratch { passes, subtrees, is_weakened, .. } = scratch;
        *is_weakened = false;
        let mut any_compensates = false;
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
            // An actuator that saturated in the last step mostly does in this one.
            drive.saturated = saturated.map(|effort| drive.limit.copysign(effort)).filter(|e| e.is_finite());
        }
        if any_compensates {
            let BodyState { axes, drives, base, .. } = state;
            let base = Placement::new(base.rotation, base.translation);
            compensate(tree, axes, &passes.bodies, base_acceleration(&base, gravity), subtrees, drives);
        }
    }

    /// Second and third pass: the new velocities without constraints.
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
        if *integrator == Integrator::Leapfrog && free_body.is_some() {
            self.drift(gravity, h, 1.0);
            return;
        }
        let state = (&**positions, &**velocities, &**half_velocities);
        accelerate(tree, base_acceleration(&base, gravity), state, h, passes, new_velocities);
        if *integrator == Integrator::Leapfrog && is_fast(passes, h) {
            velocity_terms.solve(tree, state, h, passes, new_velocities);
        }
    }

    /// Where a body is and how it moves, as [`update_kinematics`](Self::update_kinematics) found: its origin, axes and
    /// velocity of the origin, world.
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

    /// The new velocities, as far as they are found.
    pub(super) fn new_velocities_mut(&mut self) -> &mut [f64] {
        &mut self.scratch.new_velocities
    }

    /// Forgets what the last step left for the next one to start from: warm-start
    /// impulses, saturation, efforts.
    pub fn forget_last_step(&mut self) {
        self.state.impulses = Impulses::new(&self.tree);
        self.state.drives.fill(Drive::default());
        self.state.efforts.fill(0.0);
        self.state.forget_last_step();
    }

    /// The change of all velocities by a unit impulse at the joint of a body, as the last
    /// step's factorisation has it: a column of (M + h K_d + h^2 K_p)^-1.
    pub fn response(&mut self, body: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.state.velocities.len()];
        let tree = Arc::clone(&self.tree);
        respond(&tree, &self.state.positions, &[(body, 1.0)], &mut self.scratch.passes, &mut out);
        out
    }

    /// What the actuators of the last step add to the diagonal of M, by velocity:
    /// armature + h (kd + damping) + h^2 kp, the latter as far as each joint's
    /// [`Implicitness`](super::integrator::Implicitness) goes; 0 for free bodies.
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

    /// Makes a joint hold the position that it has.
    pub fn hold(&mut self, body: usize) {
        let velocity = self.tree.bodies[body].velocity;
        let position = self.tree.position_of_axis(body, &self.state.positions);
        let actuator = Actuator::hold(position, self.state.velocities[velocity]);
        self.set_actuator(velocity, actuator);
    }
}

/// [`Articulation::set_drives`] for a body of a ball joint: all three with the first. Nothing for a free one. Says whether its actuator
/// compensates gravity.
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
