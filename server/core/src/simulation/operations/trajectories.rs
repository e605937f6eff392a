//! Trajectories: start, execution and end. Another target, a reset or a hold of a joint ends its trajectory;
//! the other joints of that trajectory hold their positions.

use std::sync::Arc;

use crate::dynamics::{Actuator, Mode};
use crate::simulation::claim::ClaimId;
use crate::simulation::command::FollowTrajectory;
use crate::simulation::entity::Entity;
use crate::simulation::error::Error;
use crate::simulation::trajectory::{
    ActiveTrajectory, Begin, MAX_TIME, MAX_TRAJECTORIES, MAX_TRAJECTORY_JOINTS, Sample, Tolerance,
    TrajectoryEnd, TrajectoryJoint, Violation, check_points,
};
use crate::simulation::{EventKind, Reply, Simulation, check};

impl Simulation {
    pub(in crate::simulation) fn follow_trajectory(
        &mut self,
        request: &FollowTrajectory,
        claim: Option<ClaimId>,
    ) -> Result<Reply, Error> {
        let robot_index = self.robot_index(&request.robot)?;
        let joints = self.entities[robot_index].trajectory_joints(request, claim)?;
        if let Begin::After(seconds) = request.begin {
            check::within("delay", seconds, 0.0..=MAX_TIME)?;
        }
        check::optional_at_least_zero("goal_time_tolerance", request.goal_time_tolerance)?;
        let there = self.entities[robot_index].state.trajectories.len();
        if there >= MAX_TRAJECTORIES {
            return Err(Error::LimitExceeded {
                what: format!("the number of trajectories of robot {:?}", request.robot),
                value: there as u64 + 1,
                limit: MAX_TRAJECTORIES as u64,
            });
        }
        let id = self.take_version();
        let indices: Vec<_> = joints.iter().map(|joint| (robot_index, joint.joint)).collect();
        self.targets_were_set(indices, request.source.as_ref());
        self.entities[robot_index].state.trajectories.push(ActiveTrajectory {
            id,
            joints,
            points: Arc::clone(&request.points),
            // A trajectory for now begins with the next step, like all that were to begin by then.
            begin: if request.begin == Begin::Now { Begin::After(0.0) } else { request.begin },
            elapsed: 0.0,
            next: 0,
            goal_time_tolerance: request.goal_time_tolerance,
            ended: None,
        });
        self.entities[robot_index].begin_trajectories(0.0);
        self.report_ended(robot_index);
        Ok(Reply::TrajectoryAccepted { id })
    }

    /// Cancels a trajectory; without an id all of the robot.
    pub(in crate::simulation) fn cancel_trajectory(
        &mut self,
        robot: &str,
        id: Option<u64>,
        claim: Option<ClaimId>,
    ) -> Result<Reply, Error> {
        let robot_index = self.robot_index(robot)?;
        let entity = &self.entities[robot_index];
        let meant = |trajectory: &&ActiveTrajectory| id.is_none_or(|id| trajectory.id == id);
        for trajectory in entity.state.trajectories.iter().filter(meant) {
            trajectory.joints.iter().try_for_each(|joint| entity.allow_joint(joint.joint, claim))?;
        }
        if let Some(id) = id
            && !entity.state.trajectories.iter().any(|trajectory| trajectory.id == id)
        {
            return Err(check::refuse("id", id, "it must be the id of a trajectory that has not ended"));
        }
        let entity = &mut self.entities[robot_index];
        let by = "a request";
        entity.end_trajectories(|trajectory| id.is_none_or(|id| trajectory.id == id), by);
        self.report_ended(robot_index);
        Ok(Reply::Done)
    }

    /// Ends the trajectories of joints that have another target.
    pub(in crate::simulation) fn supersede_trajectories(&mut self, robot_index: usize, joints: &[usize]) {
        let entity = &mut self.entities[robot_index];
        if entity.state.trajectories.is_empty() {
            return;
        }
        for index in 0..entity.state.trajectories.len() {
            let trajectory = &entity.state.trajectories[index];
            if joints.iter().any(|joint| trajectory.has_joint(*joint)) {
                entity.end_trajectory(index, TrajectoryEnd::Superseded, joints);
            }
        }
        self.report_ended(robot_index);
    }

    /// Cancels the trajectories of joints of a robot, or of all, that were moved or lost their driver.
    pub(in crate::simulation) fn cancel_trajectories(
        &mut self,
        robot_index: usize,
        joints: Option<&[usize]>,
        by: &str,
    ) {
        let entity = &mut self.entities[robot_index];
        if entity.state.trajectories.is_empty() {
            return;
        }
        let meant = |trajectory: &ActiveTrajectory| {
            joints.is_none_or(|joints| joints.iter().any(|joint| trajectory.has_joint(*joint)))
        };
        entity.end_trajectories(meant, by);
        self.report_ended(robot_index);
    }

    /// Returns robots and the ids of their trajectories.
    pub(in crate::simulation) fn trajectory_ids(&self) -> Vec<(String, u64)> {
        let robots = self.entities.iter().map(|entity| &entity.state);
        let ids = robots.flat_map(|state| {
            state.trajectories.iter().map(|trajectory| (state.name.clone(), trajectory.id))
        });
        ids.collect()
    }

    /// Emits events for ended trajectories, and removes them.
    pub(in crate::simulation) fn report_ended(&mut self, robot_index: usize) {
        loop {
            let state = &mut self.entities[robot_index].state;
            let Some(index) = state.trajectories.iter().position(|trajectory| trajectory.ended.is_some())
            else {
                return;
            };
            let trajectory = state.trajectories.remove(index);
            let robot = state.name.clone();
            if let Some(end) = trajectory.ended {
                self.happened(EventKind::TrajectoryEnded { robot, id: trajectory.id, end });
            }
        }
    }
}

impl Entity {
    /// Returns the joints that a request names, if its sender may command them and its points suit them.
    fn trajectory_joints(
        &self,
        request: &FollowTrajectory,
        claim: Option<ClaimId>,
    ) -> Result<Vec<TrajectoryJoint>, Error> {
        let FollowTrajectory { robot: _, joints: names, points, tolerances, .. } = request;
        if names.is_empty() {
            return Err(check::refuse("joints", "empty", "it must name the joints of the points"));
        }
        if names.len() > MAX_TRAJECTORY_JOINTS {
            let expected = format!("a trajectory has at most {MAX_TRAJECTORY_JOINTS}");
            return Err(check::refuse("joints", format!("{} joints", names.len()), expected));
        }
        if !tolerances.is_empty() && tolerances.len() != names.len() {
            let expected = format!("there must be one for each of {} joints, or none", names.len());
            return Err(check::refuse("tolerances", format!("{} tolerances", tolerances.len()), expected));
        }
        check_points(points, names.len())
            .map_err(|(what, index)| check::refuse(format!("points[{index}]"), "not a point", what))?;
        let mut joints: Vec<TrajectoryJoint> = Vec::with_capacity(names.len());
        for (index, name) in names.iter().enumerate() {
            let within =
                |error: Error| error.within(|| format!("joints[{index}]")).of(|| format!("joint {name:?}"));
            let joint = self.joint(name)?;
            self.allow_joint(joint, claim)?;
            let body = self.actuated_body(joint, 0).map_err(within)?;
            if self.body.tree().joints[joint].len() != 1 {
                return Err(within(check::refuse(
                    "name",
                    format!("{name:?}"),
                    "the joint must have one axis",
                )));
            }
            if joints.iter().any(|other| other.joint == joint) {
                return Err(within(check::refuse("name", format!("{name:?}"), "a joint must be named once")));
            }
            let velocity = self.body.tree().bodies[body].velocity;
            let (lower, upper) = self.body.axes()[velocity].settings.limits.range();
            for point in points.iter() {
                let requested = point.positions[index];
                if !(lower..=upper).contains(&requested) {
                    return Err(Error::TargetBeyondLimit { joint: name.clone(), requested, lower, upper });
                }
            }
            let [path, goal] = tolerances.get(index).copied().unwrap_or_default();
            for (field, tolerance) in [("path", path), ("goal", goal)] {
                for (quantity, value) in [("position", tolerance.position), ("velocity", tolerance.velocity)]
                {
                    check::optional_at_least_zero(&format!("{field}.{quantity}"), value)
                        .map_err(|error| error.within(|| format!("tolerances[{index}]")))?;
                }
            }
            joints.push(TrajectoryJoint { joint, start: (0.0, 0.0), path, goal });
        }
        Ok(joints)
    }

    /// Returns the indices of the body, position and velocity of a joint with one axis.
    fn axis_of(&self, joint: usize) -> (usize, usize, usize) {
        let body = self.body.tree().joints[joint].start;
        let own = &self.body.tree().bodies[body];
        (body, own.position, own.velocity)
    }

    /// Begins the trajectories that are due, `seconds` later than at the last call.
    fn begin_trajectories(&mut self, seconds: f64) {
        for index in 0..self.state.trajectories.len() {
            let (before, rest) = self.state.trajectories.split_at_mut(index);
            let Some(trajectory) = rest.first_mut() else { return };
            let begins = match &mut trajectory.begin {
                Begin::Now => false,
                Begin::After(left) => {
                    *left -= seconds;
                    // Rounded to steps.
                    *left <= seconds / 2.0
                }
                Begin::Queued => {
                    !before.iter().any(|other| other.ended.is_none() && other.shares_joints(trajectory))
                }
            };
            if begins && trajectory.ended.is_none() {
                self.begin_trajectory(index);
            }
        }
    }

    /// Begins a trajectory at the setpoint of each joint's target, or at the joint's position.
    fn begin_trajectory(&mut self, index: usize) {
        let Self { state, body, .. } = self;
        let trajectory = &mut state.trajectories[index];
        trajectory.begin = Begin::Now;
        for joint in &mut trajectory.joints {
            let own = body.tree().joints[joint.joint].start;
            let at = &body.tree().bodies[own];
            let actuator = &body.axes()[at.velocity].actuator;
            joint.start = match actuator.mode {
                Mode::Position | Mode::Hold => (actuator.setpoint, actuator.velocity),
                Mode::None | Mode::Passive | Mode::Velocity | Mode::Effort => {
                    (body.positions()[at.position], body.velocities()[at.velocity])
                }
            };
        }
        let joints: Vec<usize> = trajectory.joints.iter().map(|joint| joint.joint).collect();
        for other in 0..index {
            let trajectory = &self.state.trajectories[other];
            if trajectory.ended.is_none() && joints.iter().any(|joint| trajectory.has_joint(*joint)) {
                self.end_trajectory(other, TrajectoryEnd::Superseded, &joints);
            }
        }
    }

    /// Ends a trajectory. Its joints hold their positions, except those that already have a new target.
    /// Trajectories queued after it are cancelled with it.
    fn end_trajectory(&mut self, index: usize, end: TrajectoryEnd, except: &[usize]) {
        let trajectory = &self.state.trajectories[index];
        if trajectory.ended.is_some() {
            return;
        }
        let succeeded = end == TrajectoryEnd::Succeeded;
        if trajectory.is_under_way() {
            for joint_index in 0..trajectory.joints.len() {
                let joint = self.state.trajectories[index].joints[joint_index].joint;
                let (body, _, velocity) = self.axis_of(joint);
                if succeeded {
                    self.body.axes_mut()[velocity].actuator.velocity = 0.0;
                } else if !except.contains(&joint) {
                    self.body.hold(body);
                }
            }
        }
        self.state.trajectories[index].ended = Some(end);
        if succeeded {
            return;
        }
        for later in index + 1..self.state.trajectories.len() {
            let (before, rest) = self.state.trajectories.split_at_mut(later);
            if let Some(waiting) = rest.first_mut()
                && waiting.begin == Begin::Queued
                && waiting.ended.is_none()
                && before[index].shares_joints(waiting)
            {
                waiting.ended =
                    Some(TrajectoryEnd::Cancelled { by: "the end of the one before it".to_owned() });
            }
        }
    }

    fn end_trajectories(&mut self, meant: impl Fn(&ActiveTrajectory) -> bool, by: &str) {
        for index in 0..self.state.trajectories.len() {
            if meant(&self.state.trajectories[index]) {
                let end = TrajectoryEnd::Cancelled { by: by.to_owned() };
                self.end_trajectory(index, end, &[]);
            }
        }
    }

    /// Sets the targets of joints with trajectories for the step of `time_step` seconds that begins.
    pub(in crate::simulation) fn follow_trajectories(&mut self, time_step: f64) {
        if self.state.trajectories.is_empty() {
            return;
        }
        for index in 0..self.state.trajectories.len() {
            let trajectory = &mut self.state.trajectories[index];
            if !trajectory.is_under_way() || trajectory.ended.is_some() {
                continue;
            }
            trajectory.advance(time_step);
            for joint_index in 0..trajectory.joints.len() {
                let trajectory = &self.state.trajectories[index];
                let Sample { position, velocity, acceleration: _, effort } = trajectory.sample(joint_index);
                let (_, _, axis) = self.axis_of(trajectory.joints[joint_index].joint);
                let present = &mut self.body.axes_mut()[axis].actuator;
                // In place: a smooth continuation does not interrupt the integrator.
                if present.mode == Mode::Position && present.servo.is_none() {
                    (present.target, present.setpoint, present.setpoint_velocity) = (position, position, 0.0);
                    (present.velocity, present.feed_forward) = (velocity, effort);
                } else {
                    let actuator = Actuator {
                        mode: Mode::Position,
                        target: position,
                        velocity,
                        feed_forward: effort,
                        setpoint: position,
                        ..Actuator::default()
                    };
                    self.body.set_actuator(axis, actuator);
                }
            }
        }
    }

    /// Ends trajectories that are over after a step of `time_step` seconds, and begins those that are due.
    /// [`Simulation::report_ended`] must report the ended ones.
    pub(in crate::simulation) fn judge_trajectories(&mut self, time_step: f64) {
        if self.state.trajectories.is_empty() {
            return;
        }
        for index in 0..self.state.trajectories.len() {
            let trajectory = &self.state.trajectories[index];
            if trajectory.is_under_way() && trajectory.ended.is_none() {
                let end = match self.state.disabled {
                    Some(_) => Some(TrajectoryEnd::Cancelled { by: "a fault of the robot".to_owned() }),
                    None => self.end_of(trajectory, time_step),
                };
                if let Some(end) = end {
                    self.end_trajectory(index, end, &[]);
                }
            }
        }
        self.begin_trajectories(time_step);
    }

    /// Returns whether any ended since the last report.
    pub(in crate::simulation) fn has_ended_trajectories(&self) -> bool {
        self.state.trajectories.iter().any(|trajectory| trajectory.ended.is_some())
    }

    /// Returns how a running trajectory has ended, if it has.
    fn end_of(&self, trajectory: &ActiveTrajectory, time_step: f64) -> Option<TrajectoryEnd> {
        // Rounded to steps.
        let late = trajectory.elapsed - trajectory.duration();
        if late < -time_step / 2.0 {
            return self.violation(trajectory, |joint| joint.path).map(TrajectoryEnd::PathToleranceViolated);
        }
        let Some(violation) = self.violation(trajectory, |joint| joint.goal) else {
            return Some(TrajectoryEnd::Succeeded);
        };
        let is_over =
            trajectory.goal_time_tolerance.is_some_and(|tolerance| late > tolerance - time_step / 2.0);
        is_over.then_some(TrajectoryEnd::GoalToleranceViolated(violation))
    }

    /// Returns the first joint that is beyond a tolerance.
    fn violation(
        &self,
        trajectory: &ActiveTrajectory,
        tolerance: impl Fn(&TrajectoryJoint) -> Tolerance,
    ) -> Option<Violation> {
        trajectory.joints.iter().enumerate().find_map(|(index, joint)| {
            let Tolerance { position, velocity } = tolerance(joint);
            if position.is_none() && velocity.is_none() {
                return None;
            }
            let wanted = trajectory.sample(index);
            let (_, q, qd) = self.axis_of(joint.joint);
            let at_end = trajectory.next >= trajectory.points.len();
            let wanted_velocity = if at_end { 0.0 } else { wanted.velocity };
            let errors = [
                ("position", self.body.positions()[q] - wanted.position, position),
                ("velocity", self.body.velocities()[qd] - wanted_velocity, velocity),
            ];
            errors.into_iter().find_map(|(quantity, error, tolerance)| {
                let tolerance = tolerance.filter(|tolerance| error.abs() > *tolerance)?;
                let joint = self.model.joints[joint.joint].name.clone();
                Some(Violation { joint, quantity, error, tolerance })
            })
        })
    }
}
