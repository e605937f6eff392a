//! Targets for joints: validated as a whole, then applied as a whole.

use crate::dynamics::spherical::rotation_vector;
use crate::dynamics::{Actuator, Articulation, Axis, Mode, Servo};
use crate::simulation::claim::ClaimId;
use crate::simulation::command::{Clamped, JointTarget, RobotTargets, SetTargets, Target, WholeTarget};
use crate::simulation::entity::Entity;
use crate::simulation::error::Error;
use crate::simulation::{Reply, Simulation, check};

/// A validated target: robot, degree of freedom, and actuator.
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
        let law = |actuator: &Actuator| (actuator.mode, actuator.stiffness, actuator.damping, actuator.servo);
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

/// Validation of one request.
struct Check<'a> {
    request: &'a SetTargets,
    /// Claim of the request.
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
            let is_spherical = entity.is_spherical(joint);
            if is_spherical && *axis != 0 {
                let expected = "a spherical joint takes targets as a whole: it must be 0";
                return Err(within(check::refuse("axis", axis, expected)));
            }
            let of_axes = of_axes(target, is_spherical).map_err(within)?;
            for (target, body) in of_axes.into_iter().flatten().zip(body..) {
                self.joint(robot_index, entity, joint, body, &target)?;
            }
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
                check::moderate_list("whole.values", v)?;
                v
            }
            WholeTarget::Passive | WholeTarget::Hold => &[],
        };
        for (joint, body) in entity.actuated() {
            let offset = tree.bodies[body].velocity - root;
            let value = values.get(offset).copied().unwrap_or(0.0);
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
        let (actuator, beyond) = actuator_for(&entity.body, body, target);
        if let Some(Beyond { requested, lower, upper }) = beyond {
            if self.request.refuse_beyond_limits {
                return Err(Error::TargetBeyondLimit { joint: name.clone(), requested, lower, upper });
            }
            let (robot, joint) = (entity.state.name.clone(), name.clone());
            self.clamped.push(Clamped { robot, joint, requested, applied: requested.clamp(lower, upper) });
        }
        let dof = entity.body.tree().bodies[body].velocity;
        self.accepted.push(Accepted { entity: robot_index, joint, dof, actuator });
        Ok(())
    }
}

/// Excess of a target beyond a limit.
pub(super) struct Beyond {
    requested: f64,
    /// Lower limit.
    lower: f64,
    /// Upper limit.
    upper: f64,
}

/// Returns the actuator of a body for a target of its one axis, clamped to its limits.
pub(super) fn actuator_for(robot: &Articulation, body: usize, target: &Target) -> (Actuator, Option<Beyond>) {
    let position = robot.tree().position_of_axis(body, robot.positions());
    let dof = robot.tree().bodies[body].velocity;
    let (axis, joint_velocity) = (&robot.axes()[dof], robot.velocities()[dof]);
    let limits = &axis.settings.limits;
    let mut beyond = None;
    let mut bounded = |requested: f64, lower: f64, upper: f64| {
        let applied = requested.clamp(lower, upper);
        if applied != requested {
            beyond = Some(Beyond { requested, lower, upper });
        }
        applied
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
            let wanted = bounded(wanted, lower, upper);
            // Continues from the previous target's setpoint, or from the joint's position.
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
                servo: None,
            }
        }
        Target::Velocity { velocity, damping, feed_forward, max_effort } => {
            let most = symmetric(limits.velocity);
            let target = bounded(velocity, -most, most);
            Actuator {
                mode: Mode::Velocity,
                target,
                damping,
                feed_forward,
                max_effort,
                ..Actuator::default()
            }
        }
        // Limits stop the joint: a servo's position may lie beyond them.
        Target::Servo {
            position: wanted,
            rate,
            velocity,
            slip,
            damping,
            feed_forward,
            max_effort,
            max_velocity,
        } => {
            let (mode, target) =
                if rate > 0.0 { (Mode::Position, wanted) } else { (Mode::Velocity, velocity) };
            Actuator {
                mode,
                target,
                velocity,
                damping,
                feed_forward,
                max_effort,
                max_velocity,
                setpoint: position,
                setpoint_velocity: joint_velocity,
                servo: Some(Servo { gain: rate, slip }),
                ..Actuator::default()
            }
        }
        Target::Effort(effort) => {
            let most = symmetric(limits.effort);
            let target = bounded(effort, -most, most);
            Actuator { mode: Mode::Effort, target, ..Actuator::default() }
        }
        // Targets of a spherical joint are split before.
        Target::Passive | Target::Orientation { .. } | Target::AngularVelocity { .. } | Target::Torque(_) => {
            Actuator { mode: Mode::Passive, ..Actuator::default() }
        }
        Target::Hold => Actuator::hold(position, joint_velocity),
    };
    (actuator, beyond)
}

/// Returns the target of each axis of a joint with one axis or, if spherical, three.
fn of_axes(target: &Target, is_spherical: bool) -> Result<[Option<Target>; 3], Error> {
    let each = |of: &dyn Fn(usize) -> Target| Ok(std::array::from_fn(|k| Some(of(k))));
    match *target {
        Target::Orientation {
            orientation,
            velocity,
            stiffness,
            damping,
            feed_forward,
            max_effort,
            max_velocity,
        } if is_spherical => {
            let vector = rotation_vector(orientation.normalize());
            each(&|k| Target::Position {
                position: vector[k],
                velocity: velocity[k],
                stiffness,
                damping,
                feed_forward: feed_forward[k],
                max_effort,
                max_velocity,
            })
        }
        Target::AngularVelocity { velocity, damping, feed_forward, max_effort } if is_spherical => {
            each(&|k| Target::Velocity {
                velocity: velocity[k],
                damping,
                feed_forward: feed_forward[k],
                max_effort,
            })
        }
        Target::Torque(torque) if is_spherical => each(&|k| Target::Effort(torque[k])),
        Target::Passive | Target::Hold if is_spherical => each(&|_| *target),
        Target::Orientation { .. } => {
            Err(check::refuse("spherical_position", "an orientation", "the joint is not spherical"))
        }
        Target::AngularVelocity { velocity, .. } => {
            Err(check::refuse("spherical_velocity", velocity, "the joint is not spherical"))
        }
        Target::Torque(torque) => {
            Err(check::refuse("spherical_effort", torque, "the joint is not spherical"))
        }
        Target::Position { position, .. } if is_spherical => {
            Err(check::refuse("position", position, "the joint is spherical: it takes an orientation"))
        }
        Target::Velocity { velocity, .. } if is_spherical => {
            Err(check::refuse("velocity", velocity, "the joint is spherical: it takes an angular velocity"))
        }
        Target::Servo { position, .. } if is_spherical => {
            Err(check::refuse("servo", position, "the joint is spherical: it takes an orientation"))
        }
        Target::Effort(effort) if is_spherical => {
            Err(check::refuse("effort", effort, "the joint is spherical: it takes a torque"))
        }
        Target::Position { .. }
        | Target::Velocity { .. }
        | Target::Servo { .. }
        | Target::Effort(_)
        | Target::Passive
        | Target::Hold => Ok([Some(*target), None, None]),
    }
}

/// Returns the critical damping for a stiffness: 2 sqrt(k M_ii).
fn critical(stiffness: f64, axis: &Axis) -> f64 {
    2.0 * (stiffness * axis.settings.composite_inertia).sqrt()
}

/// Checks every number of a target.
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
            check::moderate("position.position", position)?;
            check::moderate("position.velocity", velocity)?;
            check::gain("position.stiffness", stiffness)?;
            check::gain("position.damping", damping)?;
            check::optional_at_least_zero("position.max_effort", max_effort)?;
            check::optional_at_least_zero("position.max_velocity", max_velocity)?;
            check::moderate("position.feed_forward_effort", feed_forward).map(drop)
        }
        Target::Velocity { velocity, damping, feed_forward, max_effort } => {
            check::moderate("velocity.velocity", velocity)?;
            check::gain("velocity.damping", damping)?;
            check::optional_at_least_zero("velocity.max_effort", max_effort)?;
            check::moderate("velocity.feed_forward_effort", feed_forward).map(drop)
        }
        Target::Servo { position, rate, velocity, slip, damping, feed_forward, max_effort, max_velocity } => {
            check::moderate("servo.position", position)?;
            check::gain("servo.rate", Some(rate))?;
            check::moderate("servo.velocity", velocity)?;
            check::within("servo.slip", slip, -1.0..=1.0)?;
            check::gain("servo.damping", damping)?;
            check::optional_at_least_zero("servo.max_effort", max_effort)?;
            check::optional_at_least_zero("servo.max_velocity", max_velocity)?;
            check::moderate("servo.feed_forward_effort", feed_forward).map(drop)
        }
        Target::Effort(effort) => check::moderate("effort.effort", effort).map(drop),
        Target::Orientation {
            orientation,
            velocity,
            stiffness,
            damping,
            feed_forward,
            max_effort,
            max_velocity,
        } => {
            check::orientation("spherical_position.orientation", orientation)?;
            check::moderate_point("spherical_position.angular_velocity", velocity)?;
            check::gain("spherical_position.stiffness", stiffness)?;
            check::gain("spherical_position.damping", damping)?;
            check::optional_at_least_zero("spherical_position.max_effort", max_effort)?;
            check::optional_at_least_zero("spherical_position.max_velocity", max_velocity)?;
            check::moderate_point("spherical_position.feed_forward_torque", feed_forward).map(drop)
        }
        Target::AngularVelocity { velocity, damping, feed_forward, max_effort } => {
            check::moderate_point("spherical_velocity.angular_velocity", velocity)?;
            check::gain("spherical_velocity.damping", damping)?;
            check::optional_at_least_zero("spherical_velocity.max_effort", max_effort)?;
            check::moderate_point("spherical_velocity.feed_forward_torque", feed_forward).map(drop)
        }
        Target::Torque(torque) => check::moderate_point("spherical_effort.torque", torque).map(drop),
        Target::Passive | Target::Hold => Ok(()),
    }
}
