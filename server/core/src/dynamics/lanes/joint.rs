//! Joints of one axis in lanes, and the bodies that they move.

use pulp::Simd;

use crate::dynamics::actuator::{self, Axis, Mode, OwnForces};
use crate::dynamics::inertia;
use crate::dynamics::integrator::Implicitness;
use crate::dynamics::lane::number::Lanes;
use crate::dynamics::lane::vectors::{Articulated, Matrix, Rigid, Spatial, Symmetric, Vector};
use crate::dynamics::real::Real as _;

/// Settings and target of a joint, which a step does not change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law<S: Simd> {
    /// See [`AxisSettings`](crate::dynamics::actuator::AxisSettings).
    pub(super) friction: Lanes<S>,
    pub(super) own: OwnForces<Lanes<S>>,
    /// Lower limit; minus infinity if there is none.
    pub(super) lower: Lanes<S>,
    /// Upper limit; infinity if there is none.
    pub(super) upper: Lanes<S>,
    /// See [`Drive`](crate::dynamics::actuator::Drive).
    pub(super) stiffness: Lanes<S>,
    pub(super) damping: Lanes<S>,
    pub(super) velocity: Lanes<S>,
    pub(super) feed_forward: Lanes<S>,
    pub(super) limit: Lanes<S>,
    /// Target value.
    pub(super) target: Lanes<S>,
    /// Maximum acceleration of its setpoint.
    pub(super) hardest: Lanes<S>,
    /// Maximum speed of its setpoint.
    pub(super) fastest: Lanes<S>,
}

/// State of a joint that a step changes, a part of [`BodyState`](crate::dynamics::BodyState).
#[derive(Clone, Copy, Debug)]
pub(super) struct State<S: Simd> {
    pub(super) position: Lanes<S>,
    pub(super) velocity: Lanes<S>,
    pub(super) half_velocity: Lanes<S>,
    pub(super) change: Lanes<S>,
    pub(super) change_before: Lanes<S>,
    pub(super) setpoint: Lanes<S>,
    pub(super) setpoint_velocity: Lanes<S>,
    pub(super) effort: Lanes<S>,
    /// Law of the last step.
    pub(super) drive: Drive<S>,
    /// Impulses of the rows in the last step.
    pub(super) friction: Lanes<S>,
    pub(super) lower: Lanes<S>,
    pub(super) upper: Lanes<S>,
}

/// Law of an actuator. `saturated` is NaN if it is not saturated.
pub(super) type Drive<S> = actuator::Drive<Lanes<S>, Lanes<S>>;

/// A row on the velocity of one joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row<S: Simd> {
    /// 1 if there is one.
    pub(super) is_there: Lanes<S>,
    pub(super) bias: Lanes<S>,
    pub(super) impulse: Lanes<S>,
}

/// Scratch of a step for a body and its joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body<S: Simd> {
    /// Inertia of its copy, in its own axes.
    pub(super) inertia: Rigid<S>,
    pub(super) rotation: Matrix<S>,
    pub(super) reach: Vector<S>,
    /// Vector from the base's origin to its own; only for robots with feet.
    pub(super) origin: Vector<S>,
    /// Inertia of it and its subtree; only where feet touch.
    pub(super) composite: Rigid<S>,
    pub(super) velocity: Spatial<S>,
    pub(super) velocity_product: Spatial<S>,
    pub(super) articulated: Articulated<S>,
    pub(super) bias: Spatial<S>,
    pub(super) column: Spatial<S>,
    pub(super) implicitness: Implicitness<Lanes<S>>,
    /// Implicitness of its actuator's law, also while that is saturated.
    pub(super) of_law: Implicitness<Lanes<S>>,
    pub(super) inverse_d: Lanes<S>,
    pub(super) drive: Lanes<S>,
    pub(super) acceleration: Spatial<S>,
    pub(super) delta: Spatial<S>,
    pub(super) impulse: Lanes<S>,
    pub(super) new_velocity: Lanes<S>,
    /// Velocity that moves its joint's position.
    pub(super) way: Lanes<S>,
    /// Rows of dry friction, lower limit and upper limit.
    pub(super) rows: [Row<S>; 3],
    /// Largest impulse of dry friction in a step.
    pub(super) most_friction: Lanes<S>,
    /// Remaining part of its actuator's gains.
    pub(super) part: Lanes<S>,
}

/// Returns whether a mode has a setpoint.
pub(super) fn has_setpoint(mode: Mode) -> bool {
    matches!(mode, Mode::Position | Mode::Hold)
}

impl<S: Simd> Law<S> {
    /// Returns zero in all numbers.
    pub(super) fn zero(zero: Lanes<S>) -> Self {
        Self {
            friction: zero,
            own: OwnForces { damping: zero, armature: zero, spring_stiffness: zero, spring_rest: zero },
            lower: zero,
            upper: zero,
            stiffness: zero,
            damping: zero,
            velocity: zero,
            feed_forward: zero,
            limit: zero,
            target: zero,
            hardest: zero,
            fastest: zero,
        }
    }

    /// Copies the settings of a copy, for steps of `h`.
    pub(super) fn set(&mut self, lane: usize, axis: &Axis, h: f64) {
        let (settings, actuator, drive) = (&axis.settings, &axis.actuator, axis.drive(h));
        let (lower, upper) = settings.limits.range();
        let given = |limit: Option<f64>| limit.unwrap_or(f64::INFINITY);
        for (slot, value) in [
            (&mut self.own.damping, settings.damping),
            (&mut self.friction, settings.friction),
            (&mut self.own.armature, settings.armature),
            (&mut self.own.spring_stiffness, settings.spring_stiffness),
            (&mut self.own.spring_rest, settings.spring_rest),
            (&mut self.lower, lower),
            (&mut self.upper, upper),
            (&mut self.stiffness, drive.stiffness),
            (&mut self.damping, drive.damping),
            (&mut self.velocity, drive.velocity),
            (&mut self.feed_forward, drive.feed_forward),
            (&mut self.limit, drive.limit),
            (&mut self.target, actuator.target),
            (&mut self.hardest, axis.hardest(drive.limit)),
            (&mut self.fastest, given(settings.limits.velocity).min(given(actuator.max_velocity))),
        ] {
            slot.set(lane, value);
        }
    }

    /// Sets the target value of a copy, clamped as a command's value is. The mode and other parts of the
    /// target stay. Returns whether the value changed.
    pub(super) fn set_target(&mut self, lane: usize, mode: Mode, value: f64) -> bool {
        let (lower, upper) = match mode {
            // A target of a rollout has no limits: these are the joint's.
            Mode::Velocity => (-self.fastest.get(lane), self.fastest.get(lane)),
            Mode::Effort => (-self.limit.get(lane), self.limit.get(lane)),
            _ => (self.lower.get(lane), self.upper.get(lane)),
        };
        let target = value.clamp(lower, upper);
        let is_another = target != self.target.get(lane);
        self.target.set(lane, target);
        match mode {
            Mode::Velocity => self.velocity.set(lane, target),
            Mode::Effort => self.feed_forward.set(lane, target),
            _ => {}
        }
        is_another
    }
}

impl<S: Simd> State<S> {
    /// Returns zero in all numbers.
    pub(super) fn zero(zero: Lanes<S>) -> Self {
        let drive = Drive {
            stiffness: zero,
            damping: zero,
            position: zero,
            velocity: zero,
            feed_forward: zero,
            limit: zero,
            saturated: zero.splat(f64::NAN),
        };
        Self {
            position: zero,
            velocity: zero,
            half_velocity: zero,
            change: zero,
            change_before: zero,
            setpoint: zero,
            setpoint_velocity: zero,
            effort: zero,
            drive,
            friction: zero,
            lower: zero,
            upper: zero,
        }
    }

    /// Returns all numbers, in a fixed order.
    pub(super) fn numbers(&mut self) -> [&mut Lanes<S>; 18] {
        let Self {
            position,
            velocity,
            half_velocity,
            change,
            change_before,
            setpoint,
            setpoint_velocity,
            effort,
            drive,
            friction,
            lower,
            upper,
        } = self;
        let Drive {
            stiffness,
            damping,
            position: drive_position,
            velocity: drive_velocity,
            feed_forward,
            limit,
            saturated,
        } = drive;
        [
            position,
            velocity,
            half_velocity,
            change,
            change_before,
            setpoint,
            setpoint_velocity,
            effort,
            stiffness,
            damping,
            drive_position,
            drive_velocity,
            feed_forward,
            limit,
            saturated,
            friction,
            lower,
            upper,
        ]
    }
}

impl<S: Simd> Body<S> {
    /// Returns zero in all numbers.
    pub(super) fn zero(zero: Lanes<S>) -> Self {
        let vector = Vector::zero(zero);
        let spatial = Spatial { angular: vector, linear: vector };
        let matrix = Matrix { x: vector, y: vector, z: vector };
        let symmetric = Symmetric::scalar(zero);
        let row = Row { is_there: zero, bias: zero, impulse: zero };
        let backward = Implicitness::splat(zero, Implicitness::BACKWARD);
        Self {
            inertia: Rigid { mass: zero, first_moment: vector, moment: symmetric },
            rotation: matrix,
            reach: vector,
            origin: vector,
            composite: Rigid { mass: zero, first_moment: vector, moment: symmetric },
            velocity: spatial,
            velocity_product: spatial,
            articulated: Articulated { moment: symmetric, coupling: matrix, mass: symmetric },
            bias: spatial,
            column: spatial,
            implicitness: backward,
            of_law: backward,
            inverse_d: zero,
            drive: zero,
            acceleration: spatial,
            delta: spatial,
            impulse: zero,
            new_velocity: zero,
            way: zero,
            rows: [row; 3],
            most_friction: zero,
            part: zero.splat(1.0),
        }
    }

    /// Copies the inertia of a copy.
    pub(super) fn set_inertia(&mut self, lane: usize, inertia: &inertia::Rigid) {
        let Rigid { mass, first_moment, moment } = &mut self.inertia;
        mass.set(lane, inertia.mass);
        first_moment.set(lane, inertia.first_moment);
        let given = &inertia.moment;
        for (slot, value) in [
            (&mut moment.xx, given.xx),
            (&mut moment.xy, given.xy),
            (&mut moment.xz, given.xz),
            (&mut moment.yy, given.yy),
            (&mut moment.yz, given.yz),
            (&mut moment.zz, given.zz),
        ] {
            slot.set(lane, value);
        }
    }
}
