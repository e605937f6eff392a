//! The action `control_msgs/FollowJointTrajectory` of each robot: three services and two topics, like all
//! actions of ROS 2. A goal is a trajectory of the world; it is carried out even if its client disconnects.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_core::Command;
use simd_core::Reply;
use simd_core::simulation::EventKind;
use simd_core::simulation::command::Tolerance;
use simd_core::simulation::trajectory::TrajectoryEnd;
use simd_ros2::messages::action_msgs::{
    CancelGoal, CancelGoalRequest, CancelGoalResponse, GoalInfo, GoalStatus, GoalStatusArray,
};
use simd_ros2::messages::builtin_interfaces::Time;
use simd_ros2::messages::control_msgs::{
    FollowJointTrajectoryFeedback, FollowJointTrajectoryFeedbackMessage, FollowJointTrajectoryGetResult,
    FollowJointTrajectoryGetResultRequest, FollowJointTrajectoryGetResultResponse, FollowJointTrajectoryGoal,
    FollowJointTrajectoryResult, FollowJointTrajectorySendGoal, FollowJointTrajectorySendGoalRequest,
    FollowJointTrajectorySendGoalResponse, JointTolerance,
};
use simd_ros2::messages::trajectory_msgs::JointTrajectoryPoint;
use simd_ros2::messages::unique_identifier_msgs::UUID;
use simd_ros2::wire::Qos;
use tokio::sync::watch;

use super::commands::trajectory;
use super::endpoints::{Graph, Server, Topic};
use super::robots::Robot;
use super::services::one;
use simd_world::SimHandle;
use simd_world::handle::LogEvent;
use simd_world::recording::stamp;

/// Maximum number of remembered goals; those that ended first are forgotten first.
pub(super) const GOALS: usize = 32;
/// Time between two feedback messages.
const FEEDBACK: Duration = Duration::from_millis(50);
/// QoS of the status in `rcl_action`.
const STATUS: Qos = Qos::LATCHED;

/// The action of a robot, until it is dropped.
#[derive(Debug)]
pub(super) struct Action {
    _servers: Vec<Server>,
}

/// Known goals of a robot.
#[derive(Debug)]
struct Goals {
    robot: String,
    /// Goals, oldest first.
    list: Mutex<VecDeque<Arc<Goal>>>,
    status: Topic<GoalStatusArray>,
    feedback: Topic<FollowJointTrajectoryFeedbackMessage>,
}

#[derive(Debug)]
struct Goal {
    info: GoalInfo,
    /// Id of its trajectory.
    id: u64,
    joints: Vec<String>,
    /// State, and the result once it has ended.
    state: watch::Sender<(i8, FollowJointTrajectoryResult)>,
}

impl Action {
    /// Declares the action of a robot. `name` makes the full name of a topic.
    pub(super) async fn declare(
        graph: &Arc<Graph>,
        handle: &SimHandle,
        robot: &Robot,
        name: impl Fn(&str) -> String,
    ) -> Result<Self, zenoh::Error> {
        let name =
            |part: &str| name(&format!("joint_trajectory_controller/follow_joint_trajectory/_action/{part}"));
        let goals = Arc::new(Goals {
            robot: robot.entity.name.clone(),
            list: Mutex::default(),
            status: graph.publisher(&name("status"), STATUS).await?,
            feedback: graph.publisher(&name("feedback"), Qos::DEFAULT).await?,
        });
        tokio::task::block_in_place(|| goals.publish());
        let send = {
            let goals = Arc::clone(&goals);
            move |handle: SimHandle, request| send_goal(Arc::clone(&goals), handle, request)
        };
        let result = {
            let goals = Arc::clone(&goals);
            move |_: SimHandle, request| get_result(Arc::clone(&goals), request)
        };
        let cancel = move |handle: SimHandle, request| cancel_goal(Arc::clone(&goals), handle, request);
        let calls = graph.calls();
        let servers = vec![
            one::<FollowJointTrajectorySendGoal, _, _>(graph, calls, handle, &name("send_goal"), send)
                .await?,
            // Clients that wait for a result take no room from other requests.
            one::<FollowJointTrajectoryGetResult, _, _>(
                graph,
                graph.waiting_calls(),
                handle,
                &name("get_result"),
                result,
            )
            .await?,
            one::<CancelGoal, _, _>(graph, calls, handle, &name("cancel_goal"), cancel).await?,
        ];
        Ok(Self { _servers: servers })
    }
}

impl Goals {
    fn lock(&self) -> MutexGuard<'_, VecDeque<Arc<Goal>>> {
        self.list.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Publishes the states of all goals. May wait for some milliseconds.
    fn publish(&self) {
        let status_list = self.lock().iter().map(|goal| goal.status()).collect();
        self.status.put(&GoalStatusArray { status_list });
    }

    fn find(&self, id: UUID) -> Option<Arc<Goal>> {
        self.lock().iter().find(|goal| goal.info.goal_id == id).cloned()
    }

    /// Returns false if the maximum number of goals is active.
    fn has_room(&self) -> bool {
        let mut list = self.lock();
        if list.len() >= GOALS
            && let Some(oldest) = list.iter().position(|goal| goal.is_over())
        {
            list.remove(oldest);
        }
        list.len() < GOALS
    }
}

impl Goal {
    fn status(&self) -> GoalStatus {
        GoalStatus { goal_info: self.info.clone(), status: self.state.borrow().0 }
    }

    fn is_over(&self) -> bool {
        self.state.borrow().0 >= GoalStatus::STATUS_SUCCEEDED
    }
}

async fn send_goal(
    goals: Arc<Goals>,
    handle: SimHandle,
    request: FollowJointTrajectorySendGoalRequest,
) -> FollowJointTrajectorySendGoalResponse {
    let stamp = stamp(handle.newest().state.at.sim_time);
    match begin(&goals, &handle, request, stamp.clone()).await {
        Ok(()) => FollowJointTrajectorySendGoalResponse { accepted: true, stamp },
        Err(sentence) => {
            tracing::warn!(robot = goals.robot, "a goal of ROS 2 is refused: {sentence}");
            FollowJointTrajectorySendGoalResponse { accepted: false, stamp }
        }
    }
}

async fn begin(
    goals: &Arc<Goals>,
    handle: &SimHandle,
    request: FollowJointTrajectorySendGoalRequest,
    stamp: Time,
) -> Result<(), String> {
    let FollowJointTrajectorySendGoalRequest { goal_id, goal } = request;
    let FollowJointTrajectoryGoal {
        trajectory: wanted,
        multi_dof_trajectory,
        path_tolerance,
        component_path_tolerance: _,
        goal_tolerance,
        component_goal_tolerance: _,
        goal_time_tolerance,
    } = goal;
    if !multi_dof_trajectory.points.is_empty() {
        return Err("joints of several axes have no trajectories".to_owned());
    }
    if wanted.points.is_empty() {
        return Err("the trajectory has no points".to_owned());
    }
    if goals.find(goal_id).is_some() {
        return Err("a goal with this id exists".to_owned());
    }
    if !goals.has_room() {
        return Err(format!("{GOALS} goals are still active"));
    }
    let joints = wanted.joint_names.clone();
    let mut tolerances = vec![[Tolerance::default(); 2]; joints.len()];
    for (kind, given) in [path_tolerance, goal_tolerance].into_iter().enumerate() {
        for JointTolerance { name, position, velocity, acceleration: _ } in given {
            let Some(joint) = joints.iter().position(|joint| *joint == name) else {
                return Err(format!("a tolerance is of joint {name:?}, which the trajectory does not have"));
            };
            // 0 means the default, which is none here, and -1 means unlimited.
            let some = |value: f64| (value > 0.0).then_some(value);
            tolerances[joint][kind] = Tolerance { position: some(position), velocity: some(velocity) };
        }
    }
    let after = handle.events_after(u64::MAX).last_sequence;
    let mut command = trajectory(handle, &goals.robot, wanted);
    if let Command::FollowTrajectory(request) = &mut command {
        request.tolerances = tolerances;
        let seconds = goal_time_tolerance.seconds();
        request.goal_time_tolerance = (seconds > 0.0).then_some(seconds);
    }
    let done = handle.command(command).await.map_err(|error| error.to_string())?;
    let Reply::TrajectoryAccepted { id } = done.applied.reply else {
        return Err("the world gives another answer".to_owned());
    };
    let state = watch::Sender::new((GoalStatus::STATUS_EXECUTING, FollowJointTrajectoryResult::default()));
    let goal = Arc::new(Goal { info: GoalInfo { goal_id, stamp }, id, joints, state });
    goals.lock().push_back(Arc::clone(&goal));
    tokio::spawn(follow(Arc::clone(goals), handle.clone(), goal, after));
    Ok(())
}

/// Reports the progress of a goal, until its end.
async fn follow(goals: Arc<Goals>, handle: SimHandle, goal: Arc<Goal>, mut after: u64) {
    tokio::task::block_in_place(|| goals.publish());
    let end = loop {
        let Ok(batch) = handle.next_events(after, FEEDBACK).await else { return };
        after = batch.last_sequence;
        let end = batch.events.into_iter().find_map(|event| match event.what {
            LogEvent::World(event) => match event.kind {
                EventKind::TrajectoryEnded { robot, id, end } if (&robot, id) == (&goals.robot, goal.id) => {
                    Some(end)
                }
                _ => None,
            },
            _ => None,
        });
        if let Some(end) = end {
            break result(&end);
        }
        // Its end may be among the lost events: it is ended now, instead of never.
        if batch.missed > 0 {
            let cancel = Command::CancelTrajectory { robot: goals.robot.clone(), id: Some(goal.id) };
            // If it has ended, it cannot be cancelled.
            let _ = handle.command(cancel).await;
            let error_string = "events were lost, and its end with them; it was cancelled".to_owned();
            let error_code = FollowJointTrajectoryResult::INVALID_GOAL;
            break (GoalStatus::STATUS_ABORTED, FollowJointTrajectoryResult { error_code, error_string });
        }
        if goals.feedback.is_wanted()
            && let Some(feedback) = feedback(&handle, &goals.robot, &goal)
        {
            tokio::task::block_in_place(|| goals.feedback.put(&feedback));
        }
    };
    goal.state.send_replace(end);
    tokio::task::block_in_place(|| goals.publish());
}

fn result(end: &TrajectoryEnd) -> (i8, FollowJointTrajectoryResult) {
    type R = FollowJointTrajectoryResult;
    let (status, error_code) = match end {
        TrajectoryEnd::Succeeded => (GoalStatus::STATUS_SUCCEEDED, R::SUCCESSFUL),
        TrajectoryEnd::PathToleranceViolated(_) => (GoalStatus::STATUS_ABORTED, R::PATH_TOLERANCE_VIOLATED),
        TrajectoryEnd::GoalToleranceViolated(_) => (GoalStatus::STATUS_ABORTED, R::GOAL_TOLERANCE_VIOLATED),
        // Like joint_trajectory_controller for a goal that is cancelled, or preempted by another one.
        TrajectoryEnd::Cancelled { .. } | TrajectoryEnd::Superseded => {
            (GoalStatus::STATUS_CANCELED, R::SUCCESSFUL)
        }
    };
    (status, R { error_code, error_string: end.to_string() })
}

/// Returns the desired and actual positions of a goal's joints.
fn feedback(handle: &SimHandle, robot: &str, goal: &Goal) -> Option<FollowJointTrajectoryFeedbackMessage> {
    let newest = handle.newest();
    let (_, entity) = newest.state.entity(robot)?;
    let [mut desired, mut actual, mut error] = <[JointTrajectoryPoint; 3]>::default();
    for name in &goal.joints {
        let joint = entity.model.joints.iter().position(|joint| joint.name == *name)?;
        let at = entity.positions.start + entity.joint_positions.get(joint)?.start;
        let axis = entity.velocities.start + entity.joint_velocities.get(joint)?.start;
        let (position, target) = (newest.state.positions.get(at)?, newest.state.targets.get(axis)?);
        desired.positions.push(*target);
        actual.positions.push(*position);
        actual.velocities.push(*newest.state.velocities.get(axis)?);
        error.positions.push(target - position);
    }
    let mut feedback = FollowJointTrajectoryFeedback {
        joint_names: goal.joints.clone(),
        desired,
        actual,
        error,
        ..Default::default()
    };
    feedback.header.stamp = stamp(newest.state.at.sim_time);
    Some(FollowJointTrajectoryFeedbackMessage { goal_id: goal.info.goal_id, feedback })
}

/// Waits for the result of a goal.
async fn get_result(
    goals: Arc<Goals>,
    request: FollowJointTrajectoryGetResultRequest,
) -> FollowJointTrajectoryGetResultResponse {
    let Some(goal) = goals.find(request.goal_id) else {
        return FollowJointTrajectoryGetResultResponse {
            status: GoalStatus::STATUS_UNKNOWN,
            ..Default::default()
        };
    };
    let mut state = goal.state.subscribe();
    let over = state.wait_for(|(status, _)| *status >= GoalStatus::STATUS_SUCCEEDED).await;
    match over.as_deref() {
        Ok((status, result)) => {
            FollowJointTrajectoryGetResultResponse { status: *status, result: result.clone() }
        }
        // The goal holds the sender.
        Err(_) => FollowJointTrajectoryGetResultResponse::default(),
    }
}

/// Cancels a goal by its id, goals accepted up to a time, or, with neither, all goals.
async fn cancel_goal(goals: Arc<Goals>, handle: SimHandle, request: CancelGoalRequest) -> CancelGoalResponse {
    let CancelGoalRequest { goal_info: GoalInfo { goal_id, stamp } } = request;
    let (has_id, until) = (goal_id != UUID::default(), stamp.nanoseconds());
    let all: Vec<Arc<Goal>> = goals.lock().iter().cloned().collect();
    let known = all.iter().any(|goal| goal.info.goal_id == goal_id);
    let meant = |goal: &&Arc<Goal>| match (has_id, until) {
        (true, _) if goal.info.goal_id == goal_id => true,
        (false, 0) => true,
        (_, until) => until > 0 && goal.info.stamp.nanoseconds() <= until,
    };
    let mut response = CancelGoalResponse::default();
    for goal in all.iter().filter(meant).filter(|goal| !goal.is_over()) {
        let command = Command::CancelTrajectory { robot: goals.robot.clone(), id: Some(goal.id) };
        match handle.command(command).await {
            Ok(_) => response.goals_canceling.push(goal.info.clone()),
            Err(error) => tracing::warn!(robot = goals.robot, "a goal of ROS 2 is not cancelled: {error}"),
        }
    }
    if response.goals_canceling.is_empty() {
        response.return_code = match (has_id, known) {
            (true, false) => CancelGoalResponse::ERROR_UNKNOWN_GOAL_ID,
            (true, true) => CancelGoalResponse::ERROR_GOAL_TERMINATED,
            (false, _) => CancelGoalResponse::ERROR_REJECTED,
        };
    }
    response
}
