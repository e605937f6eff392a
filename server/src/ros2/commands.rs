//! The subscriptions: topics that command controllers of `ros2_control`.
//!
//! | topic | message | what it does |
//! |---|---|---|
//! | `forward_position_controller/commands` | `std_msgs/Float64MultiArray` | a position for each joint |
//! | `forward_velocity_controller/commands` | `std_msgs/Float64MultiArray` | a velocity for each joint |
//! | `forward_effort_controller/commands` | `std_msgs/Float64MultiArray` | an effort for each joint |
//! | `joint_commands` | `sensor_msgs/JointState` | positions, else velocities, else efforts, by name |
//! | `joint_trajectory_controller/joint_trajectory` | `trajectory_msgs/JointTrajectory` | a trajectory; one without points ends all |
//!
//! They pass the same handle as the commands of other clients: claims apply. Bounded: messages that arrive
//! while [`WAITING`] others wait are lost and counted, and a message above [`MAX_BYTES`] is refused unread.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use simd_core::Command;
use simd_core::simulation::command::{
    Begin, FollowTrajectory, JointTarget, RobotTargets, SetTargets, Target, TrajectoryPoint,
};
use simd_core::simulation::published_state::Mode;
use simd_ros2::Message as _;
use simd_ros2::messages::sensor_msgs::JointState;
use simd_ros2::messages::std_msgs::Float64MultiArray;
use simd_ros2::messages::trajectory_msgs::JointTrajectory;
use tokio::sync::mpsc;
use tokio::time::{MissedTickBehavior, interval};
use zenoh::sample::Sample;

use super::endpoints::{Graph, Subscription};
use super::robots::Robot;
use simd_world::SimHandle;

/// Maximum number of messages that wait to be read.
const WAITING: usize = 32;
/// Maximum size of one message, bytes: ten thousand points of a seven-joint arm fit.
const MAX_BYTES: usize = 1024 * 1024;
/// Time between two logged summaries of refusals.
const REPORT: Duration = Duration::from_secs(1);

/// Kind of a message.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Positions,
    Velocities,
    Efforts,
    ByName,
    Trajectory,
}

/// A message on its way.
#[derive(Debug)]
struct Sent {
    robot: Arc<str>,
    kind: Kind,
    payload: Vec<u8>,
}

/// Inbox of messages. The task that reads them ends with the last clone.
#[derive(Clone, Debug)]
pub(super) struct Inbox {
    sender: mpsc::Sender<Sent>,
    lost: Arc<AtomicU64>,
}

/// The subscriptions of a robot, until they are dropped.
#[derive(Debug)]
pub(super) struct Commands {
    _subscriptions: Vec<Subscription>,
}

impl Inbox {
    /// Makes an inbox, and starts the task that reads it.
    pub(super) fn open(handle: &SimHandle) -> Self {
        let (sender, receiver) = mpsc::channel(WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        tokio::spawn(take(handle.clone(), receiver, Arc::clone(&lost)));
        Self { sender, lost }
    }

    /// Runs on Zenoh's own thread, without waiting.
    fn put(&self, robot: &Arc<str>, kind: Kind, sample: &Sample) {
        let payload = sample.payload();
        let sent = (payload.len() <= MAX_BYTES).then(|| Sent {
            robot: Arc::clone(robot),
            kind,
            payload: payload.to_bytes().into_owned(),
        });
        if sent.is_none_or(|sent| self.sender.try_send(sent).is_err()) {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Commands {
    /// Subscribes for a robot. `name` makes the full name of a topic.
    pub(super) async fn declare(
        graph: &Graph,
        inbox: &Inbox,
        robot: &Robot,
        name: impl Fn(&str) -> String,
    ) -> Result<Self, zenoh::Error> {
        let robot: Arc<str> = robot.entity.name.as_str().into();
        let mut subscriptions = Vec::new();
        for (quantity, kind) in
            [("position", Kind::Positions), ("velocity", Kind::Velocities), ("effort", Kind::Efforts)]
        {
            let topic = name(&format!("forward_{quantity}_controller/commands"));
            let (inbox, robot) = (inbox.clone(), Arc::clone(&robot));
            let take = move |sample: &Sample| inbox.put(&robot, kind, sample);
            subscriptions.push(graph.subscription::<Float64MultiArray>(&topic, take).await?);
        }
        let trajectories = (inbox.clone(), Arc::clone(&robot));
        let inbox = inbox.clone();
        let take = move |sample: &Sample| inbox.put(&robot, Kind::ByName, sample);
        subscriptions.push(graph.subscription::<JointState>(&name("joint_commands"), take).await?);
        let topic = name("joint_trajectory_controller/joint_trajectory");
        let take = move |sample: &Sample| trajectories.0.put(&trajectories.1, Kind::Trajectory, sample);
        subscriptions.push(graph.subscription::<JointTrajectory>(&topic, take).await?);
        Ok(Self { _subscriptions: subscriptions })
    }
}

/// Processes messages in order; refusals are logged at most once per second.
async fn take(handle: SimHandle, mut receiver: mpsc::Receiver<Sent>, lost: Arc<AtomicU64>) {
    let mut ticks = interval(REPORT);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut refused: Option<(u64, String)> = None;
    loop {
        tokio::select! {
            sent = receiver.recv() => {
                let Some(sent) = sent else { return };
                if let Err(sentence) = command(&handle, &sent).await {
                    refused = Some((refused.map_or(0, |(number, _)| number) + 1, sentence));
                }
            },
            _tick = ticks.tick() => {
                if let Some((refused, sentence)) = refused.take() {
                    tracing::warn!(refused, "commands of ROS 2 are refused: {sentence}");
                }
                let lost = lost.swap(0, Ordering::Relaxed);
                if lost > 0 {
                    tracing::warn!(lost, "commands of ROS 2 arrive faster than they can be read, or are too long");
                }
            },
        }
    }
}

async fn command(handle: &SimHandle, sent: &Sent) -> Result<(), String> {
    let joints = match sent.kind {
        Kind::Trajectory => {
            let message = JointTrajectory::from_cdr(&sent.payload).map_err(|error| error.to_string())?;
            let command = trajectory(handle, &sent.robot, message);
            return handle.command(command).await.map(drop).map_err(|error| error.to_string());
        }
        Kind::ByName => {
            let message = JointState::from_cdr(&sent.payload).map_err(|error| error.to_string())?;
            by_name(&message)?
        }
        Kind::Positions => in_order(handle, sent, Target::position)?,
        Kind::Velocities => in_order(handle, sent, Target::velocity)?,
        Kind::Efforts => in_order(handle, sent, Target::Effort)?,
    };
    if joints.is_empty() {
        return Ok(());
    }
    let targets = SetTargets {
        robots: vec![RobotTargets { robot: sent.robot.to_string(), joints, ..RobotTargets::default() }],
        refuse_beyond_limits: false,
        source: Some(handle.target_source()),
    };
    handle.command(Command::SetTargets(targets)).await.map(drop).map_err(|error| error.to_string())
}

/// Converts a trajectory. It begins at the stamp of its header, in simulated time; at once if the stamp is
/// zero or past.
pub(super) fn trajectory(handle: &SimHandle, robot: &str, message: JointTrajectory) -> Command {
    let JointTrajectory { header, joint_names: joints, points } = message;
    let robot = robot.to_owned();
    if points.is_empty() {
        return Command::CancelTrajectory { robot, id: None };
    }
    #[allow(
        clippy::cast_precision_loss,
        reason = "a stamp is below 2^62 ns, and a step is far longer than its rounding"
    )]
    let start = header.stamp.nanoseconds() as f64 * 1e-9;
    let delay = start - handle.newest().state.at.sim_time;
    let begin = if delay > 0.0 { Begin::After(delay) } else { Begin::Now };
    let points = points.into_iter().map(|point| TrajectoryPoint {
        time: point.time_from_start.seconds(),
        positions: point.positions,
        velocities: point.velocities,
        accelerations: point.accelerations,
        efforts: point.effort,
    });
    Command::FollowTrajectory(FollowTrajectory {
        robot,
        joints,
        points: Arc::new(points.collect()),
        begin,
        source: Some(handle.target_source()),
        ..FollowTrajectory::default()
    })
}

fn target(joint: &str, target: Target) -> JointTarget {
    JointTarget { joint: joint.to_owned(), axis: 0, target }
}

/// Reads one number for each actuated joint, in the order of `joint_states`.
fn in_order(handle: &SimHandle, sent: &Sent, of: fn(f64) -> Target) -> Result<Vec<JointTarget>, String> {
    let message = Float64MultiArray::from_cdr(&sent.payload).map_err(|error| error.to_string())?;
    let state = handle.newest();
    let names = driven(&state.state, &sent.robot);
    if message.data.len() != names.len() {
        return Err(format!(
            "std_msgs/msg/Float64MultiArray.data has {} numbers; it must have {}, for {}",
            message.data.len(),
            names.len(),
            names.join(", ")
        ));
    }
    Ok(names.iter().zip(&message.data).map(|(name, value)| target(name, of(*value))).collect())
}

/// Returns the names of a robot's actuated joints, in the order of `joint_states`.
fn driven(state: &simd_core::PublishedState, robot: &str) -> Vec<String> {
    let Some((_, entity)) = state.entity(robot) else { return Vec::new() };
    let modes = state.modes.get(entity.velocities.clone()).unwrap_or_default();
    let axes = entity.model.joints.iter().zip(&entity.joint_velocities);
    let is_driven = |range: &std::ops::Range<usize>| {
        range.len() == 1 && modes.get(range.start).is_some_and(|m| *m != Mode::None)
    };
    axes.filter(|(_, range)| is_driven(range)).map(|(joint, _)| joint.name.clone()).collect()
}

/// Returns the target of each joint: its position if there are positions, with its velocity if there are
/// velocities too. Otherwise, it is its velocity or its effort. NaN leaves the joint unchanged.
fn by_name(message: &JointState) -> Result<Vec<JointTarget>, String> {
    let JointState { name, position, velocity, effort, .. } = message;
    for (field, values) in [("position", position), ("velocity", velocity), ("effort", effort)] {
        if !values.is_empty() && values.len() != name.len() {
            return Err(format!(
                "sensor_msgs/msg/JointState.{field} has {} numbers; it must have one for each of {} names, or none",
                values.len(),
                name.len()
            ));
        }
    }
    let value = |values: &[f64], joint: usize| values.get(joint).copied().filter(|value| !value.is_nan());
    let targets = name.iter().enumerate().filter_map(|(joint, name)| {
        let wanted = match (value(position, joint), value(velocity, joint), value(effort, joint)) {
            (Some(position), velocity, _) => match Target::position(position) {
                Target::Position { stiffness, damping, feed_forward, max_effort, max_velocity, .. } => {
                    let velocity = velocity.unwrap_or_default();
                    Target::Position {
                        position,
                        velocity,
                        stiffness,
                        damping,
                        feed_forward,
                        max_effort,
                        max_velocity,
                    }
                }
                other => other,
            },
            (None, Some(velocity), _) => Target::velocity(velocity),
            (None, None, Some(effort)) => Target::Effort(effort),
            (None, None, None) => return None,
        };
        Some(target(name, wanted))
    });
    Ok(targets.collect())
}
