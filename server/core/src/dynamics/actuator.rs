//! Actuators: what drives a joint of one axis, solved implicitly, so that any
//! gains are stable at any time step.

use serde::{Deserialize, Serialize};
use simd_model::robot::JointLimits;

use super::integrator::{History, Implicitness, Integrator};
use super::real::{MaskOf, Real};

/// Kind of an actuator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// There is none: a fixed, floating or mimic joint.
    #[default]
    None,
    /// Applies no effort.
    Passive,
    /// Goes to a position.
    Position,
    /// Keeps a velocity.
    Velocity,
    /// Applies an effort.
    Effort,
    /// Stays where it was.
    Hold,
}

impl Mode {
    /// History that leapfrog may use after an actuator of this mode gets a target of the next mode. An effort
    /// acts unchanged in this step and the next. The response to another target may be a jump.
    pub(super) fn history_after(self, next: Self) -> History {
        if self == Self::Effort && next == Self::Effort { History::Kinked } else { History::Interrupted }
    }
}

/// Default stiffness over composite inertia, as an angular frequency, rad/s. The static error under gravity
/// is then below 1 mrad on common robots.
pub const DEFAULT_BANDWIDTH: f64 = 300.0;

/// Velocity damping over composite inertia by time step: static error under 0.1 %.
pub const DEFAULT_VELOCITY_GAIN: f64 = 1000.0;

/// Part of a joint's effort limit that its setpoint uses to accelerate and brake. The rest is for gravity and
/// for the effect of other joints.
pub const PROFILE_EFFORT: f64 = 0.5;

/// Part of its limit below which a saturated actuator is released.
pub(super) const NEARLY: f64 = 1.0 - 1e-9;

/// Smallest factor of gains in one round, or its square if they only decrease. No gain becomes zero.
const LEAST_PART: f64 = 1e-12;

/// Weakening ends when no actuator's gains change by more than this part.
pub(super) const SETTLED: f64 = 1e-2;

/// An axis that can be driven: a revolute or prismatic joint, or one of a planar one's three.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// Properties of the joint.
    pub settings: AxisSettings,
    /// Actuator of the joint.
    pub actuator: Actuator,
}

/// Properties of a joint without its geometry.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AxisSettings {
    /// N m s/rad or N s/m.
    pub damping: f64,
    /// Dry friction, N m or N.
    pub friction: f64,
    /// Rotor inertia seen at the joint, kg m^2 or kg.
    pub armature: f64,
    /// N m/rad or N/m, of a spring in addition to the actuator.
    pub spring_stiffness: f64,
    /// Position at which the spring exerts no effort, rad or m.
    pub spring_rest: f64,
    /// Limits of position, effort and velocity.
    pub limits: JointLimits,
    /// Stiffness of position targets that give none.
    pub default_stiffness: f64,
    /// Damping of position targets that give none.
    pub default_damping: f64,
    /// Damping of velocity targets that give none. Without it, it is that for the time step.
    pub velocity_damping: Option<f64>,
    /// Whether position targets act at once, within the limit of velocity. Otherwise the setpoint follows a
    /// profile.
    pub is_direct: bool,
    /// Whether position, velocity and hold targets get the effort that holds the links beyond the joint
    /// against gravity.
    pub gravity_compensation: bool,
    /// M_ii at the spawn pose, with armature. It sets the default gains.
    pub composite_inertia: f64,
}

/// The target of an axis and how it is pursued.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Actuator {
    /// Kind of the actuator.
    pub mode: Mode,
    /// rad or m; rad/s or m/s; N m or N: as the mode says.
    pub target: f64,
    /// In position mode: the velocity that the damper pulls towards at the target. A servo adds it.
    pub velocity: f64,
    /// In position mode; `None` is the joint's default.
    pub stiffness: Option<f64>,
    /// In position and velocity mode; `None` is the joint's default. In velocity mode this may be that for
    /// the time step.
    pub damping: Option<f64>,
    /// Added to the effort.
    pub feed_forward: f64,
    /// Maximum effort for this target, in addition to the joint's limit.
    pub max_effort: Option<f64>,
    /// Maximum velocity of the setpoint, in addition to the joint's limit.
    pub max_velocity: Option<f64>,
    /// Position that the setpoint has reached on its way to the target; see [`Axis::advance_setpoint`].
    pub setpoint: f64,
    /// Velocity of the setpoint.
    pub setpoint_velocity: f64,
    /// In position and velocity mode: keeps a velocity that depends on the joint's state, and has no spring.
    pub servo: Option<Servo>,
}

/// A position loop around a velocity loop; see [`Axis::asked_velocity`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Servo {
    /// Velocity for an error of the position, 1/s.
    pub gain: f64,
    /// Part of the free velocity that the joint keeps. The free velocity is the one after the step without
    /// actuators.
    pub slip: f64,
}

/// The law of an actuator over one step: effort = kp (target - q') + kd (velocity - qd') + feed forward.
///
/// An [`Implicitness`] gives q' and qd'. For backward Euler they are q + h qd+ and qd+, with qd+ the new
/// velocity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Drive<R: Real = f64, Saturated = Option<f64>> {
    /// kp.
    pub stiffness: R,
    /// kd.
    pub damping: R,
    /// target.
    pub position: R,
    /// velocity.
    pub velocity: R,
    /// Effort that does not depend on the state.
    pub feed_forward: R,
    /// Maximum effort.
    pub limit: R,
    /// Effort that replaces the law: the limit with its sign, if the solved effort would exceed it. In a step
    /// that does not find which actuators saturate, it is the effort of the weakened law.
    pub saturated: Saturated,
}

/// Passive forces of a joint, without its actuator; see [`AxisSettings`].
#[derive(Clone, Copy, Debug)]
pub struct OwnForces<R: Real = f64> {
    /// N m s/rad or N s/m.
    pub damping: R,
    /// kg m^2 or kg.
    pub armature: R,
    /// N m/rad or N/m.
    pub spring_stiffness: R,
    /// rad or m.
    pub spring_rest: R,
}

impl Actuator {
    /// Holds a position. A moving joint is braked first, and comes back.
    pub fn hold(position: f64, velocity: f64) -> Self {
        Self {
            mode: Mode::Hold,
            target: position,
            setpoint: position,
            setpoint_velocity: velocity,
            ..Self::default()
        }
    }
}

impl AxisSettings {
    /// Returns the passive forces of the joint.
    #[inline(always)]
    pub fn own_forces(&self) -> OwnForces {
        let Self { damping, armature, spring_stiffness, spring_rest, .. } = *self;
        OwnForces { damping, armature, spring_stiffness, spring_rest }
    }
}

impl<R: Real> OwnForces<R> {
    /// Their contribution to D: armature + h t damping + h^2 b spring stiffness.
    #[inline(always)]
    pub fn resistance(&self, h: R, at: Implicitness<R>) -> R {
        self.armature + h * at.damper() * self.damping + h * h * at.spring_after() * self.spring_stiffness
    }

    /// Effort of the damper and the spring at unchanged velocity, without their contribution to D.
    #[inline(always)]
    pub fn steady_effort(&self, q: R, velocity: R, h: R, at: Implicitness<R>) -> R {
        self.spring_stiffness * (self.spring_rest - q - h * at.spring_ahead() * velocity)
            - self.damping * velocity
    }

    /// Contribution of the damper and the spring to D for backward Euler.
    #[inline(always)]
    pub(in crate::dynamics) fn stiffness_of_step(&self, h: R) -> R {
        h * self.damping + h * h * self.spring_stiffness
    }
}

impl Axis {
    /// Returns the smaller of the joint's limit and the target's; infinite without both.
    fn most_effort(&self) -> f64 {
        least(self.settings.limits.effort, self.actuator.max_effort)
    }

    /// The law for a step of `h` seconds.
    pub fn drive(&self, h: f64) -> Drive {
        let (settings, actuator) = (&self.settings, &self.actuator);
        let limit = self.most_effort();
        let still = Drive { limit, ..Drive::default() };
        // A servo is a stiff loop, whatever the gains of the joint are.
        let own = settings.velocity_damping.filter(|_| actuator.servo.is_none());
        let stiff = DEFAULT_VELOCITY_GAIN * settings.composite_inertia / h;
        let keep_velocity = |velocity: f64| Drive {
            damping: actuator.damping.or(own).unwrap_or(stiff),
            velocity,
            feed_forward: actuator.feed_forward,
            ..still
        };
        match actuator.mode {
            Mode::None | Mode::Passive => still,
            Mode::Effort => Drive { feed_forward: actuator.target, ..still },
            Mode::Velocity => keep_velocity(actuator.target),
            Mode::Position if actuator.servo.is_some() => keep_velocity(actuator.velocity),
            Mode::Position | Mode::Hold => Drive {
                stiffness: actuator.stiffness.unwrap_or(settings.default_stiffness),
                damping: actuator.damping.unwrap_or(settings.default_damping),
                position: actuator.setpoint,
                velocity: actuator.velocity,
                feed_forward: actuator.feed_forward,
                ..still
            },
        }
    }

    /// Returns the velocity that a servo aims at over a step from the position `q`; `None` without a servo.
    /// `free` is the velocity after the step without actuators.
    ///
    /// A servo in front of a stiff damper is a constraint on the new velocity. The effort limit bounds its
    /// impulse. Bullet's joint motor is the same (`btMultiBodyJointMotor`).
    pub fn asked_velocity(&self, q: f64, free: f64) -> Option<f64> {
        let Actuator { mode, target, velocity, max_velocity, servo, .. } = self.actuator;
        let Servo { gain, slip } = servo?;
        let steady = if mode == Mode::Position { velocity + gain * (target - q) } else { target };
        let most = least(self.settings.limits.velocity, max_velocity);
        Some((steady + slip * free).max(-most).min(most))
    }

    /// Returns the maximum acceleration of the setpoint, for a limit of effort.
    pub(super) fn hardest(&self, limit: f64) -> f64 {
        let settings = &self.settings;
        if settings.is_direct { f64::INFINITY } else { PROFILE_EFFORT * limit / settings.composite_inertia }
    }

    /// Moves the setpoint by one step of `h` towards the target, along a trapezoidal velocity profile.
    ///
    /// The profile keeps the joint's velocity limit. Unless targets act at once, it accelerates and brakes
    /// with [`PROFILE_EFFORT`] of the effort limit over the composite inertia. Without those limits the
    /// setpoint is at the target at once.
    ///
    /// A stiff spring whose effort saturates all the way is a relay: it would swing around the target for
    /// seconds. The damper does not pull along with the setpoint. The joint follows 2 / bandwidth seconds
    /// behind, and never passes its velocity.
    pub fn advance_setpoint(&mut self, h: f64) {
        if !matches!(self.actuator.mode, Mode::Position | Mode::Hold) || self.actuator.servo.is_some() {
            return;
        }
        let Actuator { target, setpoint, setpoint_velocity, .. } = &mut self.actuator;
        if *setpoint == *target && *setpoint_velocity == 0.0 {
            // A setpoint that has arrived stays there.
            (*setpoint, *setpoint_velocity) = (*target, 0.0);
            return;
        }
        let hardest = self.hardest(self.most_effort());
        let Actuator { target, setpoint, setpoint_velocity, max_velocity, .. } = &mut self.actuator;
        let fastest = least(self.settings.limits.velocity, *max_velocity);
        (*setpoint, *setpoint_velocity) =
            advance_profile((*setpoint, *setpoint_velocity), *target, (hardest, fastest), h);
    }

    /// Anti-windup by back-calculation, at the end of a step with the law `drive` and the new velocity `qd`.
    ///
    /// If `law` exceeds the limit, moves the setpoint to where the law asks for the limit. A joint that a
    /// stronger force carried off is braked with its whole effort, and then moves back along a profile. With
    /// its setpoint at the target it would swing. A blocked joint continues to push with its limit.
    pub fn anti_windup(&mut self, drive: &Drive, law: f64, qd: f64) {
        let has_setpoint = matches!(self.actuator.mode, Mode::Position | Mode::Hold);
        if has_setpoint && drive.stiffness > 0.0 && law.abs() > drive.limit {
            self.actuator.setpoint += (drive.limit.copysign(law) - law) / drive.stiffness;
            self.actuator.setpoint_velocity = qd;
        }
    }

    /// Returns stiffness and damping in force, for reports.
    pub fn gains(&self, h: f64) -> (f64, f64) {
        let drive = self.drive(h);
        (drive.stiffness, drive.damping)
    }
}

/// Returns the setpoint and its velocity after a step towards a target that it has not reached. `hardest`
/// bounds its acceleration, and `fastest` its velocity.
#[inline(always)]
pub(super) fn advance_profile<R: Real>(
    (setpoint, velocity): (R, R),
    target: R,
    (hardest, fastest): (R, R),
    h: R,
) -> (R, R) {
    let left = target - setpoint;
    // The velocity from which braking by `hardest` each step still ends at the target.
    let gain = hardest * h;
    let (mut braking, is_bounded) = (h.splat(f64::INFINITY), gain.is_finite());
    if is_bounded.any() {
        let two = h.splat(2.0);
        let bounded = (gain * gain / h.splat(4.0) + two * hardest * left.abs()).sqrt() - gain / two;
        braking = is_bounded.select(bounded, braking);
    }
    let most = fastest.min(braking);
    let wanted = (left / h).max(-most).min(most);
    let velocity = velocity + (wanted - velocity).max(-gain).min(gain);
    let moved = velocity * h;
    // A setpoint within rounding of the target has arrived.
    let is_there = (left - moved).abs().le(h.splat(1e-12) * left.abs().max(h.splat(1.0)));
    (is_there.select(target, setpoint + moved), is_there.select(h.splat(0.0), velocity))
}

/// The smaller of two limits, infinite where neither is given.
fn least(one: Option<f64>, other: Option<f64>) -> f64 {
    one.unwrap_or(f64::INFINITY).min(other.unwrap_or(f64::INFINITY))
}

impl Drive {
    /// Decides whether the actuator saturates, given the effort of the law under the last decision. Returns
    /// whether the decision changed.
    ///
    /// A saturated actuator stays so while the law would exceed the limit on that side. After the first round
    /// a slightly smaller effort suffices, so that rounding does not release it.
    pub fn saturate(&mut self, law: f64, is_first: bool) -> bool {
        let least = if is_first { self.limit } else { self.limit * NEARLY };
        let next = match self.saturated {
            Some(effort) if law * effort.signum() >= least || self.limit == 0.0 => Some(effort),
            Some(_) => None,
            None => (law.abs() > self.limit).then(|| self.limit.copysign(law)),
        };
        let changed = next != self.saturated;
        self.saturated = next;
        changed
    }

    /// Scales the gains, of which `part` is left. At the velocities where the law asked for `law`, it then
    /// asks for at most the limit. Returns whether the gains changed by more than [`SETTLED`].
    ///
    /// The power of a bounded effort is Huber's function, which continues in a straight line. A parabola that
    /// touches it from above at the last velocities has this law. So each round lowers one common function,
    /// however many actuators saturate (iteratively reweighted least squares: Huber, "Robust Statistics"
    /// (1981), section 7.8). After any round the actuator pulls towards its target, while a constant effort
    /// may push away from it.
    ///
    /// With `less`, gains only decrease, and do so faster, to keep to the limit in the remaining rounds.
    pub fn weaken(&mut self, law: f64, less: bool, part: &mut f64) -> bool {
        if self.limit == 0.0 {
            self.saturated = Some(0.0);
            return false;
        }
        self.saturated = None;
        let factor = self.factor_to_limit(law, less, *part);
        if (factor - 1.0).abs() <= SETTLED {
            return false;
        }
        self.stiffness *= factor;
        self.damping *= factor;
        self.feed_forward *= factor;
        *part *= factor;
        true
    }

    /// Restores the gains of which `part` was left.
    pub fn strengthen(&mut self, part: f64) {
        if part < 1.0 {
            self.stiffness /= part;
            self.damping /= part;
            self.feed_forward /= part;
        }
    }

    /// Restores the gains at the end of a step. The effort is the one of the smaller gains.
    pub fn recover(&mut self, law: f64, part: f64) {
        self.strengthen(part);
        if part < 1.0 || law.abs() > self.limit {
            self.saturated = self.saturated.or(Some(law));
        }
    }

    /// Returns the effort over a step of `h` from `q` in which the velocity changes from `before` to `after`;
    /// the limit if saturated.
    pub fn effort(&self, q: f64, velocities: [f64; 2], h: f64, at: Implicitness) -> f64 {
        self.saturated.unwrap_or_else(|| self.law(q, velocities, h, at).clamp(-self.limit, self.limit))
    }

    /// The law's contribution to D: h t kd + h^2 b kp; h kd + h^2 kp for backward Euler.
    pub fn resistance(&self, h: f64, at: Implicitness) -> f64 {
        if self.saturated.is_some() { 0.0 } else { self.resistance_of_law(h, at) }
    }
}

impl<R: Real, Saturated> Drive<R, Saturated> {
    /// The law alone, without its limit.
    #[inline(always)]
    pub fn law(&self, q: R, [before, after]: [R; 2], h: R, at: Implicitness<R>) -> R {
        let moved = h * at.spring_after() * after - h * at.spring_before() * before;
        let velocity = at.damper() * after + (h.splat(1.0) - at.damper()) * before;
        self.stiffness * (self.position - q - moved)
            + self.damping * (self.velocity - velocity)
            + self.feed_forward
    }

    /// The law at unchanged velocity: the effort without the law's contribution to D.
    #[inline(always)]
    pub fn steady_law(&self, q: R, velocity: R, h: R, at: Implicitness<R>) -> R {
        self.stiffness * (self.position - q - h * at.spring_ahead() * velocity)
            + self.damping * (self.velocity - velocity)
            + self.feed_forward
    }

    /// The law's contribution to D, also if saturated.
    #[inline(always)]
    pub(in crate::dynamics) fn resistance_of_law(&self, h: R, at: Implicitness<R>) -> R {
        h * at.damper() * self.damping + h * h * at.spring_after() * self.stiffness
    }

    /// The law's contribution to D for backward Euler.
    #[inline(always)]
    pub(in crate::dynamics) fn stiffness_of_step(&self, h: R) -> R {
        h * self.damping + h * h * self.stiffness
    }

    /// Returns the implicitness of all forces, the implicitness of the law alone, and the two numbers of D =
    /// first / second. In leapfrog each joint has a separate implicitness, by its D without them.
    #[inline(always)]
    pub(super) fn resist(
        &self,
        is_saturated: R::Mask,
        own: R,
        joint: &OwnForces<R>,
        (integrator, h): (Integrator, R),
    ) -> (Implicitness<R>, Implicitness<R>, (R, R)) {
        let zero = h.splat(0.0);
        if integrator != Integrator::Leapfrog {
            let at = Implicitness::splat(h, Implicitness::BACKWARD);
            let of_law = is_saturated.select(zero, self.resistance_of_law(h, at));
            // Bullet's damping of joints is explicit: it is an effort only.
            let damping = if integrator.bullet().is_some() { zero } else { joint.damping };
            let of_joint = OwnForces { damping, ..*joint }.resistance(h, at);
            return (at, at, (own + of_joint + of_law, h.splat(1.0)));
        }
        let inertia = own + joint.armature;
        let of_joint = joint.stiffness_of_step(h);
        let of_all = of_joint + self.stiffness_of_step(h);
        let spring = joint.spring_stiffness + is_saturated.select(zero, self.stiffness);
        let resistance =
            Implicitness::resistance_ratio(inertia, is_saturated.select(of_joint, of_all), spring, h);
        let of_law = Implicitness::of_joint(of_all, inertia);
        let mut at = of_law;
        if is_saturated.any() {
            at = Implicitness::select(is_saturated, Implicitness::of_joint(of_joint, inertia), of_law);
        }
        (at, of_law, resistance)
    }

    /// Returns the factor of gains of which `part` is left; see [`weaken`](Drive::weaken).
    #[inline(always)]
    pub(super) fn factor_to_limit(&self, law: R, less: bool, part: R) -> R {
        let one = law.splat(1.0);
        let over = (self.limit / law.abs()).max(law.splat(LEAST_PART));
        if less {
            let over = over.min(one);
            over * over
        } else {
            (part * over).min(one) / part
        }
    }
}
