//! Targets for joints: checked as a whole, then applied as a whole.

use std::sync::Arc;

use simd_model::robot::JointLimits;

use super::command::{Clamped, RobotTargets, SetTargets, Target, WholeTarget};
use super::entity::{Claim, Entity};
use super::error::Error;
use super::{Reply, Simulation};
use crate::dynamics::{Actuator, Axis, Mode};

/// A target that was found good: which robot, which velocity, what it does there.
struct Accepted {
    entity: usize,
    joint: usize,
    dof: usize,
    actuator: Actuator,
}

impl Simulation {
    pub(super) fn set_targets(&mut self, request: &SetTargets) -> Result<Reply, Error> {
        if let Some(claim) = &request.claim
            && !self.claims.contains_key(claim)
        {
            return Err(Error::ClaimNotFound);
        }
        let mut check = Check { request, accepted: Vec::new(), clamped: Vec::new() };
        for targets in &request.robots {
            let robot_index = self.robot_index(&targets.robot)?;
            check.robot(robot_index, &self.entities[robot_index], targets)?;
        }
        let Check { accepted, clamped, .. } = check;
        let law = |actuator: &Actuator| (actuator.mode, actuator.stiffness, actuator.damping);
        let mut changed_law = false;
        let joints: Vec<_> = accepted.iter().map(|target| (target.entity, target.joint)).collect();
        self.targets_were_set(joints, request.source.as_ref());
        for Accepted { entity, joint: _, dof, actuator } in accepted {
            let present = &mut self.entities[entity].body.axes_mut()[dof].actuator;
            changed_law |= law(present) != law(&actuator);
            *present = actuator;
        }
        Ok(Reply::Targets { clamped, changed_law })
    }
}

/// The check of one request.
struct Check<'a> {
    request: &'a SetTargets,
    accepted: Vec<Accepted>,
    clamped: Vec<Clamped>,
}

impl Check<'_> {
    fn robot(&mut self, robot_index: usize, entity: &Entity, targets: &RobotTargets) -> Result<(), Error> {
        if targets.layout_version != 0 && targets.layout_version != entity.version {
            return Err(Error::LayoutChanged {
                robot: entity.name.clone(),
                requested: targets.layout_version,
                present: entity.version,
            });
        }
        if let Some(whole) = &targets.whole {
            self.whole(robot_index, entity, whole)?;
        }
        let mut seen = vec![false; entity.body.velocities().len()];
        for joint_target in &targets.joints {
            let joint = entity.joint(&joint_target.joint)?;
            let body = entity.actuated_body(joint, joint_target.axis)?;
            let dof = entity.body.tree().bodies[body].velocity;
            if std::mem::replace(&mut seen[dof], true) {
                return Err(Error::InvalidValue {
                    element: format!("the list of targets for robot {:?}", entity.name),
                    value: format!("naming joint {:?} twice", joint_target.joint),
                    expected: "each joint can have one target in a request".into(),
                });
            }
            self.joint(robot_index, entity, joint, body, &joint_target.target)?;
        }
        Ok(())
    }

    fn whole(&mut self, robot_index: usize, entity: &Entity, whole: &WholeTarget) -> Result<(), Error> {
        let tree = entity.body.tree();
        let root = tree.root_velocities();
        let expected = tree.velocity_count - root;
        let values: &[f64] = match whole {
            WholeTarget::Position(v) | WholeTarget::Velocity(v) | WholeTarget::Effort(v) => {
                if v.len() != expected {
                    return Err(Error::InvalidValue {
                        element: format!("the number of values for robot {:?}", entity.name),
                        value: v.len().to_string(),
                        expected: format!("its layout has {expected}"),
                    });
                }
                v
            }
            WholeTarget::Passive | WholeTarget::Hold => &[],
        };
        for (joint, body) in entity.actuated() {
            let value = values.get(tree.bodies[body].velocity - root).copied().unwrap_or(0.0);
            let target = match whole {
                WholeTarget::Position(_) => Target::position(value),
                WholeTarget::Velocity(_) => Target::velocity(value),
                WholeTarget::Effort(_) => Target::Effort(value),
                WholeTarget::Passive => Target::Passive,
                WholeTarget::Hold => Target::Hold,
            };
            self.joint(robot_index, entity, joint, body, &target)?;
        }
        Ok(())
    }

    fn joint(
        &mut self,
        robot_index: usize,
        entity: &Entity,
        joint: usize,
        body: usize,
        target: &Target,
    ) -> Result<(), Error> {
        let name = &entity.model.joints[joint].name;
        let is_another = |claim: &&Arc<Claim>| self.request.claim != Some(claim.id);
        if let Some(claim) = entity.claims[joint].as_ref().filter(is_another) {
            return Err(Error::JointClaimed {
                robot: entity.name.clone(),
                joint: name.clone(),
                holder: claim.holder.to_string(),
            });
        }
        let body = &entity.body.tree().bodies[body];
        let axis = &entity.body.axes()[body.velocity];
        let (position, joint_velocity) =
            (entity.body.positions()[body.position], entity.body.velocities()[body.velocity]);
        finite(name, target)?;
        let limits = &axis.settings.limits;
        let mut bounded = |requested: f64, lower: f64, upper: f64| {
            let applied = requested.clamp(lower, upper);
            if applied != requested {
                if self.request.refuse_beyond_limits {
                    return Err(Error::TargetBeyondLimit { joint: name.clone(), requested, lower, upper });
                }
                let (robot, joint) = (entity.name.clone(), name.clone());
                self.clamped.push(Clamped { robot, joint, requested, applied });
            }
            Ok(applied)
        };
        let symmetric = |limit: Option<f64>| limit.unwrap_or(f64::INFINITY);
        let actuator = match *target {
            Target::Position {
                position: wanted,
                velocity,
                stiffness,
                damping,
                feed_forward,
                max_effort,
                max_velocity,
            } => {
                let (lower, upper) = limits.range();
                let wanted = bounded(wanted, lower, upper)?;
                // On from where the target before has got to, or from where the joint is.
                let (setpoint, setpoint_velocity) = match axis.actuator.mode {
                    Mode::Position | Mode::Hold => (axis.actuator.setpoint, axis.actuator.setpoint_velocity),
                    Mode::None | Mode::Passive | Mode::Velocity | Mode::Effort => (position, joint_velocity),
                };
                Actuator {
                    mode: Mode::Position,
                    target: wanted,
                    velocity,
                    stiffness,
                    damping: damping.or_else(|| stiffness.map(|k| critical(k, axis))),
                    feed_forward,
                    max_effort,
                    max_velocity,
                    setpoint,
                    setpoint_velocity,
                }
            }
            Target::Velocity { velocity, damping, feed_forward, max_effort } => {
                let most = symmetric(limits.velocity);
                let target = bounded(velocity, -most, most)?;
                Actuator {
                    mode: Mode::Velocity,
                    target,
                    damping,
                    feed_forward,
                    max_effort,
                    ..Actuator::default()
                }
            }
            Target::Effort(effort) => {
                let most = symmetric(limits.effort);
                let target = bounded(effort, -most, most)?;
                Actuator { mode: Mode::Effort, target, ..Actuator::default() }
            }
            Target::Passive => Actuator { mode: Mode::Passive, ..Actuator::default() },
            Target::Hold => Actuator::hold(position, joint_velocity),
        };
        self.accepted.push(Accepted { entity: robot_index, joint, dof: body.velocity, actuator });
        Ok(())
    }
}

/// The damping that goes with a stiffness without overshoot: 2 sqrt(k M_ii).
fn critical(stiffness: f64, axis: &Axis) -> f64 {
    2.0 * (stiffness * axis.settings.composite_inertia).sqrt()
}

/// Every number of a target is finite, and gains and limits are not negative.
fn finite(joint: &str, target: &Target) -> Result<(), Error> {
    let check = |what: &str, value: f64, gain: bool| {
        if value.is_finite() && !(gain && value < 0.0) {
            return Ok(());
        }
        Err(Error::InvalidValue {
            element: format!("{what} of joint {joint:?}"),
            value: value.to_string(),
            expected: format!("it must be a finite number{}", if gain { ", 0 or more" } else { "" }),
        })
    };
    match *target {
        Target::Position {
            position,
            velocity,
            stiffness,
            damping,
            feed_forward,
            max_effort,
            max_velocity,
        } => {
            check("the position target", position, false)?;
            check("the velocity of the position target", velocity, false)?;
            check("the stiffness", stiffness.unwrap_or(0.0), true)?;
            check("the damping", damping.unwrap_or(0.0), true)?;
            check("the largest effort", max_effort.unwrap_or(0.0), true)?;
            check("the largest velocity", max_velocity.unwrap_or(0.0), true)?;
            check("the feed-forward effort", feed_forward, false)
        }
        Target::Velocity { velocity, damping, feed_forward, max_effort } => {
            check("the velocity target", velocity, false)?;
            check("the damping", damping.unwrap_or(0.0), true)?;
            check("the largest effort", max_effort.unwrap_or(0.0), true)?;
            check("the feed-forward effort", feed_forward, false)
        }
        Target::Effort(effort) => check("the effort target", effort, false),
        Target::Passive | Target::Hold => Ok(()),
    }
}

/// A finite number, or a sentence that names the element.
pub(super) fn finite_value(element: impl FnOnce() -> String, value: f64) -> Result<f64, Error> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(Error::InvalidValue {
        element: element(),
        value: value.to_string(),
        expected: "it must be a finite number".into(),
    })
}

/// The largest position or velocity that a joint can be put at: a joint that follows it may
/// go a million times as far and still be computed with. rad, m, rad/s or m/s.
const LARGEST: f64 = 1e12;

/// A number that a joint can be put at, or a sentence that names the element.
pub(super) fn moderate_value(element: impl FnOnce() -> String, value: f64) -> Result<f64, Error> {
    if value.abs() <= LARGEST {
        return Ok(value);
    }
    Err(Error::InvalidValue {
        element: element(),
        value: value.to_string(),
        expected: format!("it must be a number between -{LARGEST:e} and {LARGEST:e}"),
    })
}

/// Limits that can be: ordered, finite, not negative where they bound a size.
pub(super) fn sane_limits(joint: &str, limits: &JointLimits) -> Result<(), Error> {
    let bad = |what: &str, value: f64, expected: &str| {
        Err(Error::InvalidValue {
            element: format!("the {what} limit of joint {joint:?}"),
            value: value.to_string(),
            expected: expected.into(),
        })
    };
    for (what, value) in [("lower", limits.lower), ("upper", limits.upper)] {
        if let Some(value) = value.filter(|value| !value.is_finite()) {
            return bad(what, value, "it must be a finite number, or absent");
        }
    }
    for (what, value) in [("effort", limits.effort), ("velocity", limits.velocity)] {
        if let Some(value) = value.filter(|value| !(value.is_finite() && *value >= 0.0)) {
            return bad(what, value, "it must be a finite number, 0 or more, or absent");
        }
    }
    match (limits.lower, limits.upper) {
        (Some(lower), Some(upper)) if lower > upper => {
            bad("lower", lower, &format!("it must not be above the upper limit, {upper}"))
        }
        _ => Ok(()),
    }
}
