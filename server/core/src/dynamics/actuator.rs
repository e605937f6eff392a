//! Actuators: what drives a joint of one axis, solved implicitly, so that any
//! gains are stable at any time step.

use std::hash::Hasher;

use simd_model::robot::Limits;

/// What an actuator does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// There is none: a fixed, floating or mimic joint.
    #[default]
    None,
    /// Nothing.
    Passive,
    /// Goes to a position.
    Position,
    /// Keeps a rate.
    Velocity,
    /// Applies an effort.
    Effort,
    /// Stays where it was.
    Hold,
}

/// Stiffness over composite inertia, as an angular frequency: the static error
/// under gravity is then below 1 mrad on common robots. rad/s.
pub const DEFAULT_BANDWIDTH: f64 = 300.0;

/// Velocity damping over composite inertia by time step: static error under 0.1 %.
pub const DEFAULT_VELOCITY_GAIN: f64 = 1000.0;

/// An axis that can be driven: a revolute or prismatic joint, or one of a planar one's three.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What the joint itself is like.
    pub settings: AxisSettings,
    /// What drives it.
    pub actuator: Actuator,
}

/// What a joint is like, apart from its geometry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AxisSettings {
    /// N m s/rad or N s/m.
    pub damping: f64,
    /// Dry friction, N m or N.
    pub friction: f64,
    /// Rotor inertia seen at the joint, kg m^2 or kg.
    pub armature: f64,
    /// Of position, effort and rate.
    pub limits: Limits,
    /// Stiffness of position targets that give none.
    pub default_stiffness: f64,
    /// Damping of position targets that give none.
    pub default_damping: f64,
    /// M_ii at the spawn pose, armature included: what default gains are made of.
    pub composite_inertia: f64,
}

/// The target of an axis and how it is pursued.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Actuator {
    /// What it does.
    pub mode: Mode,
    /// rad or m; rad/s or m/s; N m or N: as the mode says.
    pub target: f64,
    /// In position mode: the rate that the damper pulls towards at the target.
    pub rate: f64,
    /// In position mode; `None` is the joint's default.
    pub stiffness: Option<f64>,
    /// In position and velocity mode; `None` is the joint's default, in velocity
    /// mode that for the time step.
    pub damping: Option<f64>,
    /// Added to the effort.
    pub feed_forward: f64,
    /// Where a position target has got to: it moves no faster than the joint's
    /// velocity limit.
    pub setpoint: f64,
}

/// The law of an actuator over one step, in the terms of dynamics: effort =
/// kp (target - q - h qd+) + kd (rate - qd+) + feed forward, with qd+ the new rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drive {
    /// kp.
    pub stiffness: f64,
    /// kd.
    pub damping: f64,
    /// target.
    pub position: f64,
    /// rate.
    pub rate: f64,
    /// Whatever the state.
    pub feed_forward: f64,
    /// The most effort that it can apply.
    pub limit: f64,
    /// The limit with its sign, where the solved effort would exceed it.
    pub saturated: Option<f64>,
}

impl AxisSettings {
    /// What the joint itself adds to D: armature + h damping.
    pub fn resistance(&self, h: f64) -> f64 {
        self.armature + h * self.damping
    }
}

impl Axis {
    /// Feeds everything that a step reads to a hasher.
    pub fn hash(&self, hasher: &mut impl Hasher) {
        let AxisSettings { damping, friction, armature, limits, .. } = &self.settings;
        let Actuator { mode, target, rate, stiffness, damping: kd, feed_forward, setpoint } = &self.actuator;
        hasher.write_u8(*mode as u8);
        let optional = [limits.lower, limits.upper, limits.effort, limits.velocity, *stiffness, *kd];
        for value in optional {
            hasher.write_u64(value.map_or(u64::MAX, f64::to_bits));
        }
        let defaults =
            [self.settings.default_stiffness, self.settings.default_damping, self.settings.composite_inertia];
        let values = [damping, friction, armature, target, rate, feed_forward, setpoint];
        for value in values.into_iter().chain(&defaults) {
            hasher.write_u64(value.to_bits());
        }
    }

    /// Moves the setpoint on, and gives the law for a step of `h` seconds.
    pub fn drive(&mut self, h: f64) -> Drive {
        let settings = &self.settings;
        let actuator = &mut self.actuator;
        let limit = settings.limits.effort.unwrap_or(f64::INFINITY);
        let still = Drive { limit, ..Drive::default() };
        match actuator.mode {
            Mode::None | Mode::Passive => still,
            Mode::Effort => Drive { feed_forward: actuator.target, ..still },
            Mode::Velocity => Drive {
                damping: actuator.damping.unwrap_or(DEFAULT_VELOCITY_GAIN * settings.composite_inertia / h),
                rate: actuator.target,
                feed_forward: actuator.feed_forward,
                ..still
            },
            Mode::Position | Mode::Hold => {
                let reach = settings.limits.velocity.map_or(f64::INFINITY, |limit| limit * h);
                let left = actuator.target - actuator.setpoint;
                let moved = left.clamp(-reach, reach);
                actuator.setpoint = if left == moved { actuator.target } else { actuator.setpoint + moved };
                // The damper does not pull along with the setpoint: the joint follows 2 / bandwidth
                // seconds behind, and in return its rate never passes the limit.
                Drive {
                    stiffness: actuator.stiffness.unwrap_or(settings.default_stiffness),
                    damping: actuator.damping.unwrap_or(settings.default_damping),
                    position: actuator.setpoint,
                    rate: actuator.rate,
                    feed_forward: actuator.feed_forward,
                    ..still
                }
            }
        }
    }

    /// Stiffness and damping in force, for people.
    pub fn gains(&self, h: f64) -> (f64, f64) {
        let drive = self.clone().drive(h);
        (drive.stiffness, drive.damping)
    }
}

impl Drive {
    /// What the actuator applies at rate `qd` after a step of `h` from `q`; the
    /// limit where it is saturated.
    pub fn effort(&self, q: f64, qd: f64, h: f64) -> f64 {
        self.saturated.unwrap_or_else(|| self.law(q, qd, h).clamp(-self.limit, self.limit))
    }

    /// The law alone, without its limit.
    pub fn law(&self, q: f64, qd: f64, h: f64) -> f64 {
        self.stiffness * (self.position - q - h * qd) + self.damping * (self.rate - qd) + self.feed_forward
    }

    /// What the law adds to D: h kd + h^2 kp.
    pub fn resistance(&self, h: f64) -> f64 {
        if self.saturated.is_some() { 0.0 } else { h * self.damping + h * h * self.stiffness }
    }
}
