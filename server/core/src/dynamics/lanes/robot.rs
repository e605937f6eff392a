//! Copies of one robot, and how a copy enters and leaves the lanes.

use std::sync::Arc;

use glamx::DVec3;
use pulp::Simd;

use super::clearance::{Clearance, LaneClearance};
use super::feet::Feet;
use super::free::Root;
use super::joint::{Body, Law, State, has_setpoint};
use crate::dynamics::actuator::{Axis, Mode};
use crate::dynamics::articulated::base_acceleration;
use crate::dynamics::constraint::Impulses;
use crate::dynamics::gravity_compensation::is_compensated;
use crate::dynamics::integrator::{History, Integrator};
use crate::dynamics::lane::number::Lanes;
use crate::dynamics::lane::vectors::Vector;
use crate::dynamics::ldlt::Ldlt6;
use crate::dynamics::spatial::{Placement, Spatial};
use crate::dynamics::tree::{JointType, Tree};
use crate::dynamics::{Articulation, BodyState};

/// Parameters of steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stepping {
    pub(super) gravity: DVec3,
    /// Length of a part of a step, seconds.
    pub(super) h: f64,
    pub(super) parts: u32,
    pub(super) integrator: Integrator,
}

/// Copies of one robot, one in each lane. They have the same geometry and the same modes of actuators, but
/// may differ in masses, settings, targets and base poses.
#[derive(Debug)]
pub struct LaneRobot<S: Simd> {
    pub(super) simd: S,
    pub(super) tree: Arc<Tree>,
    pub(super) stepping: Stepping,
    /// Minus gravity in the axes of each base.
    pub(super) base_acceleration: Vector<S>,
    /// First body with a joint of one axis; lists by body are undefined before it. 1 if the root is free.
    pub(super) first: usize,
    /// Mode of each joint's actuator, as far as a copy has set it; it determines whether there is a setpoint.
    pub(super) modes: Vec<Option<Mode>>,
    pub(super) laws: Vec<Law<S>>,
    pub(super) states: Vec<State<S>>,
    /// State of a free root.
    pub(super) root: Root<S>,
    /// Number of the [`History`] that leapfrog can continue from.
    pub(super) history: Lanes<S>,
    /// State before the last step.
    before: (Vec<State<S>>, Root<S>, Lanes<S>),
    pub(super) bodies: Vec<Body<S>>,
    /// M^-1 J' of a unit impulse, by joint of the impulse, then by joint.
    pub(super) responses: Vec<Lanes<S>>,
    /// The root's velocities in these responses, by joint of the impulse.
    pub(super) root_responses: Vec<[Lanes<S>; 6]>,
    /// New velocities of the root.
    pub(super) root_new: [Lanes<S>; 6],
    /// Velocities that move the root's position.
    pub(super) root_way: [Lanes<S>; 6],
    /// Factorised articulated inertia of the root.
    pub(super) factors: Ldlt6<Lanes<S>>,
    /// See [`Clearance`].
    pub(super) levers: Vec<Lanes<S>>,
    /// Distance that points can still move before they can touch anything.
    pub(super) clearance: LaneClearance<S>,
    /// Distance from a moving robot within which contacts are looked for, metres, in addition to twice its
    /// motion in a part of a step.
    pub(super) slack: f64,
    /// Contacts with planes.
    pub(super) feet: Feet<S>,
    /// Tree whose inertias each lane has.
    tree_of_lanes: Vec<Option<Arc<Tree>>>,
    /// 1 in lanes with a copy.
    pub(super) occupied: Lanes<S>,
    /// 1 in lanes in which the last step equals the copy's own step.
    pub(super) is_done: Lanes<S>,
}

/// Histories by number.
const HISTORIES: [History; 5] =
    [History::Given, History::Interrupted, History::Kinked, History::Smooth, History::SmoothTwice];

/// Returns the number of a history.
pub(super) fn number(history: History) -> f64 {
    HISTORIES.iter().position(|known| *known == history).unwrap_or(0) as f64
}

/// Returns the first body with a joint of one axis; a free root comes before it.
fn first_joint(tree: &Tree) -> usize {
    usize::from(!tree.fixed_base)
}

/// Whether lanes do not know how an axis is driven.
fn is_left_out(axis: &Axis) -> bool {
    is_compensated(axis) || axis.actuator.servo.is_some()
}

/// Whether robots of such a tree can be in lanes.
pub fn fits_lanes(tree: &Tree) -> bool {
    let first = first_joint(tree);
    let (q, qd) = (tree.root_positions(), tree.root_velocities());
    let is_simple = |(index, body): (usize, &crate::dynamics::tree::Body)| {
        matches!(body.joint_type, JointType::Revolute | JointType::Prismatic)
            && (body.position, body.velocity) == (q + index, qd + index)
    };
    // A single free body drifts in a different way.
    tree.mimics.is_empty()
        && tree.tendons.is_empty()
        && tree.bodies.len() > first
        && tree.bodies[..first].iter().all(|root| matches!(root.joint_type, JointType::Free { .. }))
        && tree.bodies[first..].iter().enumerate().all(is_simple)
}

impl<S: Simd> LaneRobot<S> {
    /// Creates lanes without copies, for steps of `parts` equal parts of `h` seconds.
    pub fn new(
        simd: S,
        tree: &Arc<Tree>,
        gravity: DVec3,
        (h, parts): (f64, u32),
        integrator: Integrator,
    ) -> Self {
        let zero = Lanes::broadcast(simd, 0.0);
        let n = tree.bodies.len();
        Self {
            simd,
            tree: Arc::clone(tree),
            stepping: Stepping { gravity, h, parts, integrator },
            base_acceleration: Vector::broadcast(simd, DVec3::ZERO),
            first: first_joint(tree),
            modes: vec![None; n],
            laws: vec![Law::zero(zero); n],
            states: vec![State::zero(zero); n],
            root: Root::zero(zero),
            history: zero,
            before: (vec![State::zero(zero); n], Root::zero(zero), zero),
            bodies: vec![Body::zero(zero); n],
            responses: vec![zero; n * n],
            root_responses: vec![[zero; 6]; n],
            root_new: [zero; 6],
            root_way: [zero; 6],
            factors: Ldlt6::zero(zero),
            levers: vec![zero; n],
            clearance: LaneClearance::endless(zero),
            slack: 0.0,
            feet: Feet::none(zero),
            tree_of_lanes: vec![None; S::F64_LANES],
            occupied: zero,
            is_done: zero,
        }
    }

    /// Returns the bytes of all lanes together.
    pub fn bytes(&self) -> usize {
        let Self { modes, laws, states, before, bodies, responses, root_responses, levers, feet, .. } = self;
        size_of::<Self>()
            + size_of_val(&modes[..])
            + size_of_val(&laws[..])
            + size_of_val(&states[..])
            + size_of_val(&before.0[..])
            + size_of_val(&bodies[..])
            + size_of_val(&responses[..])
            + size_of_val(&root_responses[..])
            + size_of_val(&levers[..])
            + feet.bytes()
    }

    /// Copies a robot into a lane. Returns false if lanes cannot do its next step; the lane is then empty.
    pub fn take(&mut self, lane: usize, robot: &Articulation) -> bool {
        self.occupied.set(lane, 0.0);
        let (state, tree) = (robot.state(), robot.tree());
        let has_wrench =
            state.has_external_changed || state.external.iter().any(|push| *push != Spatial::ZERO);
        let must_begin = self.stepping.integrator == Integrator::Leapfrog && state.history == History::Given;
        let fits = tree.bodies.len() == self.states.len() && first_joint(tree) == self.first;
        if !fits || !fits_lanes(tree) || has_wrench || must_begin || state.axes.iter().any(is_left_out) {
            return false;
        }
        let (of_root, of_joints) = state.axes.split_at(tree.root_velocities());
        if of_root.iter().any(|axis| axis.settings.friction > 0.0) {
            return false;
        }
        for (known, axis) in self.modes[self.first..].iter_mut().zip(of_joints) {
            let mode = axis.actuator.mode;
            // The first copy determines the modes of its joints.
            if has_setpoint(*known.get_or_insert(mode)) != has_setpoint(mode) {
                return false;
            }
        }
        let base = Placement::new(state.base.rotation, state.base.translation);
        self.base_acceleration.set(lane, base_acceleration(&base, self.stepping.gravity));
        if !self.tree_of_lanes[lane].as_ref().is_some_and(|known| Arc::ptr_eq(known, tree)) {
            for (body, own) in self.bodies.iter_mut().zip(&tree.bodies) {
                body.set_inertia(lane, &own.inertia);
            }
            self.tree_of_lanes[lane] = Some(Arc::clone(tree));
        }
        self.take_state(lane, state);
        self.occupied.set(lane, 1.0);
        true
    }

    /// Sets how far any point of a copy can move before it can touch something. Lanes do not do a step in
    /// which contacts would be looked for farther away.
    pub fn set_clearance(&mut self, lane: usize, clearance: &Clearance) {
        self.slack = clearance.slack;
        self.clearance.around.set(lane, clearance.around);
        self.clearance.own.set(lane, clearance.own);
        self.levers.iter_mut().zip(&clearance.levers).for_each(|(slot, lever)| slot.set(lane, *lever));
    }

    /// Returns the first position and the first velocity of joints.
    fn first_of_joints(&self) -> (usize, usize) {
        (self.tree.root_positions(), self.tree.root_velocities())
    }

    /// Copies targets and state of a copy in a lane.
    fn take_state(&mut self, lane: usize, from: &BodyState) {
        // All fields are listed, so that new state is not forgotten here.
        let BodyState {
            base: _,
            positions,
            velocities,
            half_velocities,
            changes,
            changes_before,
            history,
            axes,
            drives,
            efforts,
            external: _,
            external_before: _,
            has_external_changed: _,
            impulses: Impulses { friction, mimic: _, lower, upper },
        } = from;
        self.history.set(lane, number(*history));
        if self.first > 0 {
            self.root.set(lane, from);
        }
        let (q, qd) = self.first_of_joints();
        let joints = self.states[self.first..].iter_mut().zip(&mut self.laws[self.first..]);
        for (joint, (state, law)) in joints.enumerate() {
            let i = qd + joint;
            let (axis, drive) = (&axes[i], &drives[i]);
            law.set(lane, axis, self.stepping.h);
            let numbers = [
                positions[q + joint],
                velocities[i],
                half_velocities[i],
                changes[i],
                changes_before[i],
                axis.actuator.setpoint,
                axis.actuator.setpoint_velocity,
                efforts[i],
                drive.stiffness,
                drive.damping,
                drive.position,
                drive.velocity,
                drive.feed_forward,
                drive.limit,
                drive.saturated.unwrap_or(f64::NAN),
                friction[i],
                lower[i],
                upper[i],
            ];
            state.numbers().into_iter().zip(numbers).for_each(|(slot, value)| slot.set(lane, value));
        }
    }

    /// Sets the target value of a copy's joint, for a target of this mode: as [`Articulation::set_actuator`]
    /// does if only the value changes.
    pub fn set_target(&mut self, lane: usize, body: usize, mode: Mode, value: f64) {
        if self.laws[body].set_target(lane, mode, value) {
            let most = number(mode.history_after(mode));
            self.history.set(lane, self.history.get(lane).min(most));
        }
    }

    fn history_of(&self, lane: usize) -> History {
        HISTORIES[(self.history.get(lane) as usize).min(HISTORIES.len() - 1)]
    }

    /// Removes the copy from a lane.
    pub fn release(&mut self, lane: usize) {
        self.occupied.set(lane, 0.0);
    }

    /// Returns whether a lane has a copy.
    pub fn has(&self, lane: usize) -> bool {
        self.occupied.get(lane) == 1.0
    }

    /// Returns whether the last step of a lane equals its copy's own step. If not, the copy is unchanged: it
    /// must be given back, to do the step alone.
    pub fn has_stepped(&self, lane: usize) -> bool {
        self.is_done.get(lane) == 1.0
    }

    /// Returns the number of copies that have done the last step.
    pub fn stepped(&self) -> usize {
        (0..S::F64_LANES).filter(|lane| self.has(*lane) && self.has_stepped(*lane)).count()
    }

    /// Returns position and velocity of the joint of a body of a copy.
    pub fn axis_state(&self, lane: usize, body: usize) -> (f64, f64) {
        let State { position, velocity, .. } = &self.states[body];
        (position.get(lane), velocity.get(lane))
    }

    /// Writes positions and velocities of the joints of a copy, and the efforts that their actuators applied.
    pub fn write_joints(&self, lane: usize, [positions, velocities, efforts]: [&mut [f64]; 3]) {
        let joints = self.states[self.first..].iter().zip(positions).zip(velocities).zip(efforts);
        for (((state, position), velocity), effort) in joints {
            *position = state.position.get(lane);
            *velocity = state.velocity.get(lane);
            *effort = state.effort.get(lane);
        }
    }

    /// Writes the state of the copy in a lane to its robot, and the targets that it was given there.
    pub fn give_back(&self, lane: usize, robot: &mut Articulation) {
        let into = robot.state_mut();
        into.history = self.history_of(lane);
        if self.first > 0 {
            self.root.give_back(lane, into);
        }
        let (q, qd) = self.first_of_joints();
        let joints = self.states[self.first..].iter().zip(&self.laws[self.first..]);
        for (joint, (state, law)) in joints.enumerate() {
            let i = qd + joint;
            let (axis, drive) = (&mut into.axes[i], &mut into.drives[i]);
            let saturated = state.drive.saturated.get(lane);
            drive.saturated = (!saturated.is_nan()).then_some(saturated);
            for (slot, number) in [
                (&mut into.positions[q + joint], &state.position),
                (&mut into.velocities[i], &state.velocity),
                (&mut into.half_velocities[i], &state.half_velocity),
                (&mut into.changes[i], &state.change),
                (&mut into.changes_before[i], &state.change_before),
                (&mut axis.actuator.target, &law.target),
                (&mut axis.actuator.setpoint, &state.setpoint),
                (&mut axis.actuator.setpoint_velocity, &state.setpoint_velocity),
                (&mut into.efforts[i], &state.effort),
                (&mut drive.stiffness, &state.drive.stiffness),
                (&mut drive.damping, &state.drive.damping),
                (&mut drive.position, &state.drive.position),
                (&mut drive.velocity, &state.drive.velocity),
                (&mut drive.feed_forward, &state.drive.feed_forward),
                (&mut drive.limit, &state.drive.limit),
                (&mut into.impulses.friction[i], &state.friction),
                (&mut into.impulses.lower[i], &state.lower),
                (&mut into.impulses.upper[i], &state.upper),
            ] {
                *slot = number.get(lane);
            }
        }
    }

    /// Saves the state, for lanes that do not complete the step.
    pub(super) fn begin(&mut self) {
        self.before.0.copy_from_slice(&self.states);
        if self.first > 0 {
            self.before.1 = self.root;
        }
        self.before.2 = self.history;
        self.feet.begin();
    }

    /// Restores lanes that have not completed the step.
    pub(super) fn put_back(&mut self) {
        for lane in (0..S::F64_LANES).filter(|lane| self.is_done.get(*lane) == 0.0) {
            self.history.set(lane, self.before.2.get(lane));
            self.root.put_back(lane, &self.before.1);
            self.feet.put_back(lane);
            for (state, before) in self.states.iter_mut().zip(&mut self.before.0) {
                let pairs = state.numbers().into_iter().zip(before.numbers());
                pairs.for_each(|(now, before)| now.set(lane, before.get(lane)));
            }
        }
    }
}
