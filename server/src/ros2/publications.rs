//! The publications: time, joints and frames at a rate, descriptions and fixed frames when they change. One
//! task publishes all, since Zenoh may wait some milliseconds when it sends; it takes the newest state each
//! time.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use simd_core::simulation::published_state::WorldLayout;
use simd_ros2::messages::rosgraph_msgs::Clock;
use simd_ros2::messages::sensor_msgs::JointState;
use simd_ros2::messages::std_msgs;
use simd_ros2::messages::tf2_msgs::TFMessage;
use simd_ros2::wire::Qos;
use tokio::time::{MissedTickBehavior, interval};

use super::actions::Action;
use super::cameras::Cameras;
use super::commands::{Commands, Inbox};
use super::endpoints::{Graph, Topic};
use super::names::Names;
use super::robots::{MAX_ROBOTS, Robot, robots};
use super::sensors::Sensors;
use crate::config::Ros2;
use simd_world::SimHandle;
use simd_world::handle::Published;
use simd_world::recording::stamp;

/// Time after which an unchanged state is published again, for late subscribers.
const UNCHANGED: Duration = Duration::from_secs(1);
/// QoS of `tf2_ros`.
const TF: Qos = Qos { reliable: true, transient_local: false, depth: 100 };
/// QoS of `rclcpp::ClockQoS`.
const CLOCK: Qos = Qos { reliable: false, transient_local: false, depth: 1 };

/// Topics of a robot with joints.
struct RobotTopics {
    joint_states: Topic<JointState>,
    _description: Topic<std_msgs::String>,
    _commands: Commands,
    _action: Action,
}

/// Layout version and name of a robot: its topics are for one version under one name.
type Key = (u64, String);

/// Publishes until the world ends.
///
/// # Errors
/// Returns an error if a topic cannot be declared.
pub(super) async fn publish(
    graph: &Arc<Graph>,
    handle: &SimHandle,
    settings: &Ros2,
) -> Result<(), zenoh::Error> {
    let clock: Topic<Clock> = graph.publisher("/clock", CLOCK).await?;
    let tf: Topic<TFMessage> = graph.publisher("/tf", TF).await?;
    let tf_static: Topic<TFMessage> = graph.publisher("/tf_static", Qos::LATCHED).await?;
    let inbox = Inbox::open(handle);
    let mut ticks = interval(Duration::from_secs_f64(1.0 / settings.rate));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let (mut layout, mut shown): (Option<Arc<WorldLayout>>, Vec<Robot>) = (None, Vec::new());
    let mut topics: BTreeMap<Key, RobotTopics> = BTreeMap::new();
    let mut names = Names::new(settings);
    let (mut sensors, mut cameras) = (Sensors::default(), Cameras::default());
    // Robots with another name in ROS that the log has.
    let mut logged = BTreeSet::new();
    let mut fixed = None;
    let mut sent = 0;
    loop {
        ticks.tick().await;
        let Ok(state) = handle.newer_than(sent, Some(UNCHANGED)).await else { return Ok(()) };
        sent = state.sequence;
        if layout.as_ref().is_none_or(|before| !Arc::ptr_eq(before, &state.state.world)) {
            shown = robots(&state.state.world, &mut names);
            if state.state.world.entities.len() > MAX_ROBOTS {
                tracing::warn!("ROS 2 shows only the first {MAX_ROBOTS} robots");
            }
            let renamed: BTreeSet<(String, String)> = shown.iter().filter_map(Robot::renamed).collect();
            for (robot, name) in renamed.difference(&logged) {
                tracing::info!(robot, "names in ROS 2 are ASCII only: its name there is {name}");
            }
            logged = renamed;
            declare(graph, handle, &inbox, &shown, &mut topics).await?;
            layout = Some(Arc::clone(&state.state.world));
        }
        sensors.follow(graph, &shown, &state.state).await?;
        cameras.follow(graph, &shown, &state.state).await?;
        tokio::task::block_in_place(|| {
            let stamp = stamp(state.state.at.sim_time);
            if clock.is_wanted() {
                clock.put(&Clock { clock: stamp.clone() });
            }
            for robot in &shown {
                if let Some(topics) = key(robot).and_then(|key| topics.get(&key))
                    && topics.joint_states.is_wanted()
                {
                    topics.joint_states.put(&robot.joint_state(&state.state, &stamp));
                }
            }
            if tf.is_wanted() {
                let mut moving = TFMessage::default();
                shown.iter().for_each(|robot| robot.moving_frames(&state.state, &stamp, &mut moving));
                if !moving.transforms.is_empty() {
                    tf.put(&moving);
                }
            }
            sensors.publish(handle);
            cameras.publish(handle);
            let present = fixed_frames(&shown, &state);
            if fixed.as_ref() != Some(&present) {
                tf_static.put(&present);
                fixed = Some(present);
            }
        });
    }
}

fn fixed_frames(shown: &[Robot], state: &Published) -> TFMessage {
    let mut fixed = TFMessage::default();
    for robot in shown {
        robot.fixed_frames(&state.state, &mut fixed);
        robot.sensor_frames(&state.state, &mut fixed);
    }
    fixed
}

fn key(robot: &Robot) -> Option<Key> {
    Some((robot.entity.version, robot.topics.clone()?))
}

/// Declares topics for the shown robots, and drops all others.
async fn declare(
    graph: &Arc<Graph>,
    handle: &SimHandle,
    inbox: &Inbox,
    shown: &[Robot],
    topics: &mut BTreeMap<Key, RobotTopics>,
) -> Result<(), zenoh::Error> {
    let wanted: Vec<Key> = shown.iter().filter_map(key).collect();
    topics.retain(|key, _| wanted.contains(key));
    for robot in shown {
        let Some(key) = key(robot).filter(|key| !topics.contains_key(key)) else { continue };
        let name = |topic: &str| graph.name(&format!("{}{topic}", key.1));
        let joint_states = graph.publisher(&name("joint_states"), Qos::DEFAULT).await?;
        let description: Topic<std_msgs::String> =
            graph.publisher(&name("robot_description"), Qos::LATCHED).await?;
        let text = handle.description_of_model(&robot.entity.model).and_then(|sha256| handle.asset(&sha256));
        if let Some(text) = text {
            let message = std_msgs::String { data: String::from_utf8_lossy(&text).into_owned() };
            tokio::task::block_in_place(|| description.put(&message));
        }
        let commands = Commands::declare(graph, inbox, robot, name).await?;
        let action = Action::declare(graph, handle, robot, name).await?;
        topics.insert(
            key,
            RobotTopics { joint_states, _description: description, _commands: commands, _action: action },
        );
    }
    Ok(())
}
