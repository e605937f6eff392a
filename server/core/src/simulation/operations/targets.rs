//! Targets for joints: checked as a whole, then applied as a whole.

use crate::dynamics::{Actuator, Axis, Mode};
use crate::simulation::claim::ClaimId;
use crate::simulation::command::{Clamped, JointTarget, RobotTargets, SetTargets, Target, WholeTarget};
use crate::simulation::entity::Entity;
use crate::simulation::error::Error;
use crate::simulation::{Reply, Simulation, check};

/// A target that was found good: which robot, which degree of freedom, what it does there.
struct Accepted {
    entity: usize,
    joint: usize,
    dof: usize,
    actuator: Actuator,
}

impl Simulation {
    pub(in crate::simulation) fn set_targets(
        &mut self,
        request: &SetTargets,
        claim: Option<ClaimId>,
    ) -> Result<Reply, Error> {
        let mut check = Check { request, claim, accepted: Vec::new(), clamped: Vec::new() };
        for (index, targets) in request.robots.iter().enumerate() {
            let robot_index = self.robot_index(&targets.robot)?;
            let within = |error: Error| error.within(|| format!("robots[{index}]"));
            check.robot(robot_index, &self.entities[robot_index], targets).map_err(within)?;
        }
        let Check { accepted, clamped, .. } = check;
        let law = |actuator: &Actuator| (actuator.mode, actuator.stiffness, actuator.damping);
        let mut changed_law = false;
        let joints: Vec<_> = accepted.iter().map(|target| (target.entity, target.joint)).collect();
        self.targets_were_set(joints, request.source.as_ref());
        for targets in accepted.chunk_by(|one, next| one.entity == next.entity) {
            if let [first, ..] = targets
                && !self.entities[first.entity].state.trajectories.is_empty()
            {
                let joints: Vec<usize> = targets.iter().map(|target| target.joint).collect();
                self.supersede_trajectories(first.entity, &joints);
            }
        }
        for Accepted { entity, joint: _, dof, actuator } in accepted {
            let body = &mut self.entities[entity].body;
            changed_law |= law(&body.axes()[dof].actuator) != law(&actuator);
            body.set_actuator(dof, actuator);
        }
        Ok(Reply::Targets { clamped, changed_law })
    }
}

/// The check of one request.
struct Check<'a> {
    request: &'a SetTargets,
    /// That the request came with.
    claim: Option<ClaimId>,
    accepted: Vec<Accepted>,
    clamped: Vec<Clamped>,
}

impl Check<'_> {
    fn robot(&mut self, robot_index: usize, entity: &Entity, targets: &RobotTargets) -> Result<(), Error> {
        if targets.layout_version != 0 && targets.layout_version != entity.version {
            return Err(Error::LayoutChanged {
                robot: entity.state.name.clone(),
                requested: targets.layout_version,
                present: entity.version,
            });
        }
        if let Some(whole) = &targets.whole {
            self.whole(robot_index, entity, whole)?;
        }
        for (index, joint_target) in targets.joints.iter().enumerate() {
            let JointTarget { joint: name, axis, target } = joint_target;
            let within =
                |error: Error| error.within(|| format!("joints[{index}]")).of(|| format!("joint {name:?}"));
            let joint = entity.joint(name)?;
            let body = entity.actuated_body(joint, *axis).map_err(within)?;
            check_target(target).map_err(within)?;
            self.joint(robot_index, entity, joint, body, target)?;
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
                    let expected =
                        format!("it must be {expected}, as the layout of robot {:?} has", entity.state.name);
                    return Err(check::refuse("whole.values", format!("{} values", v.len()), expected));
                }
                if let Some(index) = v.iter().position(|value| !value.is_finite()) {
                    return Err(check::refuse(
                        format!("whole.values[{index}]"),
                        v[index],
                        "it must be finite",
                    ));
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
        entity.allow_joint(joint, self.claim)?;
        let body = &entity.body.tree().bodies[body];
        let axis = &entity.body.axes()[body.velocity];
        let (position, joint_velocity) =
            (entity.body.positions()[body.position], entity.body.velocities()[body.velocity]);
        let limits = &axis.settings.limits;
        let mut bounded = |requested: f64, lower: f64, upper: f64| {
            let applied = requested.clamp(lower, upper);
            if applied != requested {
                if self.request.refuse_beyond_limits {
                    return Err(Error::TargetBeyondLimit { joint: name.clone(), requested, lower, upper });
                }
                let (robot, joint) = (entity.state.name.clone(), name.clone());
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

/// Every number of a target.
fn check_target(target: &Target) -> Result<(), Error> {
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
            check::finite("position.position", position)?;
            check::finite("position.velocity", velocity)?;
            check::optional_at_least_zero("position.stiffness", stiffness)?;
            check::optional_at_least_zero("position.damping", damping)?;
            check::optional_at_least_zero("position.max_effort", max_effort)?;
            check::optional_at_least_zero("position.max_velocity", max_velocity)?;
            check::finite("position.feed_forward_effort", feed_forward).map(drop)
        }
        Target::Velocity { velocity, damping, feed_forward, max_effort } => {
            check::finite("velocity.velocity", velocity)?;
            check::optional_at_least_zero("velocity.damping", damping)?;
            check::optional_at_least_zero("velocity.max_effort", max_effort)?;
            check::finite("velocity.feed_forward_effort", feed_forward).map(drop)
        }
        Target::Effort(effort) => check::finite("effort.effort", effort).map(drop),
        Target::Passive | Target::Hold => Ok(()),
    }
}
