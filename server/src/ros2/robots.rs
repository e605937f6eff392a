//! Topics and frames of robots, and the messages of a state.
//!
//! The first robot with joints is shown as by its driver: `/joint_states`, and frames named like its links. Others have
//! their name before their topics and frames (see [`super::names`]). Robots without joints, such as a box, have only
//! frames.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::published_state::{EntityLayout, PublishedState, WorldLayout};
use simd_core::simulation::sensors::{SensorDefinition, WorldSensor};
use simd_model::robot::JointKind;
use simd_model::sensor::SensorKind;
use simd_ros2::messages::builtin_interfaces::Time;
use simd_ros2::messages::geometry_msgs::{Point, Pose, Quaternion, Transform, TransformStamped, Vector3};
use simd_ros2::messages::sensor_msgs::JointState;
use simd_ros2::messages::std_msgs::Header;
use simd_ros2::messages::tf2_msgs::TFMessage;
use simd_ros2::wire::word;

use super::names::{Named, Names};
use simd_world::recording::camera_message::SENSOR_FROM_OPTICAL;

/// Frame that contains all robots.
pub(super) const WORLD: &str = "world";
/// Maximum number of shown robots: the first ones.
pub(super) const MAX_ROBOTS: usize = 64;

/// A robot as the graph sees it.
#[derive(Clone, Debug)]
pub(super) struct Robot {
    /// Layout of the robot, and of its values in a state.
    pub(super) entity: Arc<EntityLayout>,
    /// Index in the layout of the world.
    pub(super) index: usize,
    /// Prefix of its topics: empty, or `arm/`. `None` if it has no joints, and so no topics.
    pub(super) topics: Option<String>,
    /// Prefix of its frames, and of its sensors' topics: empty, or `arm/`.
    pub(super) prefix: String,
    /// Frame of each link.
    frames: Vec<String>,
    /// Indices in the model of the joints with a single position.
    joints: Vec<usize>,
}

/// Returns the robots of a layout, in its order, and names new ones.
pub(super) fn robots(world: &WorldLayout, names: &mut Names) -> Vec<Robot> {
    let shown = || world.entities.iter().enumerate().take(MAX_ROBOTS);
    let present: Vec<Named<'_>> = shown()
        .map(|(_, entity)| Named { robot: &entity.name, is_jointed: !joints(entity).is_empty() })
        .collect();
    names.follow(&present);
    shown()
        .map(|(index, entity)| {
            let joints = joints(entity);
            let prefix = names.prefix(&entity.name);
            let frames = entity.model.links.iter().map(|link| format!("{prefix}{}", link.name)).collect();
            let topics = (!joints.is_empty()).then(|| prefix.clone());
            Robot { entity: Arc::clone(entity), index, topics, prefix, frames, joints }
        })
        .collect()
}

fn joints(entity: &EntityLayout) -> Vec<usize> {
    let has_one = |joint: &usize| entity.joint_positions.get(*joint).is_some_and(|range| range.len() == 1);
    (0..entity.model.joints.len()).filter(has_one).collect()
}

impl Robot {
    /// Returns its name and the one in ROS, if topics or frames have another.
    pub(super) fn renamed(&self) -> Option<(String, String)> {
        let name = self.prefix.trim_end_matches('/');
        (!name.is_empty() && name != self.entity.name).then(|| (self.entity.name.clone(), name.to_owned()))
    }

    /// Returns the names of joints with a single position, in the order of `joint_states`.
    pub(super) fn joint_names(&self) -> impl Iterator<Item = &str> {
        self.joints.iter().filter_map(|&joint| Some(self.entity.model.joints.get(joint)?.name.as_str()))
    }

    /// Returns positions, velocities and efforts of the joints, from a state of the same layout.
    pub(super) fn joint_state(&self, state: &PublishedState, stamp: &Time) -> JointState {
        let mut message = JointState {
            header: Header { stamp: stamp.clone(), frame_id: String::new() },
            ..JointState::default()
        };
        for (&joint, name) in self.joints.iter().zip(self.joint_names()) {
            let own = |ranges: &[std::ops::Range<usize>]| ranges.get(joint).map_or(0, |range| range.start);
            let position = self.entity.positions.start + own(&self.entity.joint_positions);
            let velocity = self.entity.velocities.start + own(&self.entity.joint_velocities);
            let value = |values: &[f64], at: usize| values.get(at).copied().unwrap_or_default();
            message.name.push(name.to_owned());
            message.position.push(value(&state.positions, position));
            message.velocity.push(value(&state.velocities, velocity));
            message.effort.push(value(&state.efforts, velocity));
        }
        message
    }

    /// Adds the moving frames: of a free root, and of links on moving joints.
    pub(super) fn moving_frames(&self, state: &PublishedState, stamp: &Time, message: &mut TFMessage) {
        let Some(world_from_link) = state.link_poses(self.index) else { return };
        if !self.entity.fixed_base
            && let (Some(pose), Some(root)) = (world_from_link.first(), self.frames.first())
        {
            push(message, stamp, WORLD, root, *pose);
        }
        for joint in self.entity.model.joints.iter().filter(|joint| joint.kind != JointKind::Fixed) {
            let (Some(parent), Some(child)) =
                (world_from_link.get(joint.parent), world_from_link.get(joint.child))
            else {
                continue;
            };
            self.push_joint(message, stamp, joint.parent, joint.child, parent.inverse() * *child);
        }
    }

    /// Adds the fixed frames: of a fixed root, and of links on fixed joints.
    pub(super) fn fixed_frames(&self, state: &PublishedState, message: &mut TFMessage) {
        let start = Time::default();
        if self.entity.fixed_base
            && let (Some(root), Some(frame)) = (state.roots.get(self.index), self.frames.first())
        {
            push(message, &start, WORLD, frame, root.pose);
        }
        for joint in self.entity.model.joints.iter().filter(|joint| joint.kind == JointKind::Fixed) {
            self.push_joint(message, &start, joint.parent, joint.child, joint.parent_from_joint);
        }
    }

    /// Adds the frames of its sensors.
    pub(super) fn sensor_frames(&self, state: &PublishedState, message: &mut TFMessage) {
        for sensor in state.sensors.iter().filter(|sensor| sensor.robot == self.index) {
            let SensorDefinition { name, link, pose, .. } = &*sensor.definition;
            if let Some(frame) = self.frames.get(*link) {
                push(message, &Time::default(), frame, &self.sensor_frame(name), *pose);
                if matches!(sensor.definition.kind, SensorKind::Camera(_)) {
                    let optical = DPose3::from_parts(DVec3::ZERO, DQuat::from_array(SENSOR_FROM_OPTICAL));
                    push(
                        message,
                        &Time::default(),
                        &self.sensor_frame(name),
                        &self.optical_frame(name),
                        optical,
                    );
                }
            }
        }
    }

    /// Returns the frame of a camera's pictures, with z forwards and x to the right (REP 103).
    pub(super) fn optical_frame(&self, name: &str) -> String {
        format!("{}_optical", self.sensor_frame(name))
    }

    /// Returns the frame of a sensor: named like the sensor, unless a link has that name.
    pub(super) fn sensor_frame(&self, name: &str) -> String {
        let mut frame = format!("{}{name}", self.prefix);
        while self.frames.contains(&frame) {
            frame.push_str("_sensor");
        }
        frame
    }

    /// Returns the frame of a link; empty if it does not exist.
    pub(super) fn link_frame(&self, link: usize) -> String {
        self.frames.get(link).cloned().unwrap_or_default()
    }

    fn push_joint(&self, message: &mut TFMessage, stamp: &Time, parent: usize, child: usize, pose: DPose3) {
        if let (Some(parent), Some(child)) = (self.frames.get(parent), self.frames.get(child)) {
            push(message, stamp, parent, child, pose);
        }
    }
}

fn push(message: &mut TFMessage, stamp: &Time, parent: &str, child: &str, pose: DPose3) {
    // A root link called world is the world.
    if parent == child {
        return;
    }
    let [x, y, z] = pose.translation.to_array();
    message.transforms.push(TransformStamped {
        header: Header { stamp: stamp.clone(), frame_id: parent.to_owned() },
        child_frame_id: child.to_owned(),
        transform: Transform { translation: Vector3 { x, y, z }, rotation: quaternion(pose) },
    });
}

fn quaternion(pose: DPose3) -> Quaternion {
    let [x, y, z, w] = pose.rotation.to_array();
    Quaternion { x, y, z, w }
}

/// Converts a pose to ROS.
pub(super) fn pose_message(pose: DPose3) -> Pose {
    let [x, y, z] = pose.translation.to_array();
    Pose { position: Point { x, y, z }, orientation: quaternion(pose) }
}

/// A sensor's id, and the name of its topic.
pub(super) type SensorKey = (u64, String);

/// Sensors and robots for which topics were last declared.
#[derive(Debug, Default)]
pub(super) struct DeclaredFor(Option<(Arc<Vec<WorldSensor>>, Arc<WorldLayout>)>);

impl DeclaredFor {
    /// Returns whether a state has the same sensors and robots. Names of topics follow from all robots.
    pub(super) fn is_of(&self, state: &PublishedState) -> bool {
        self.0.as_ref().is_some_and(|(sensors, world)| {
            Arc::ptr_eq(sensors, &state.sensors) && Arc::ptr_eq(world, &state.world)
        })
    }

    /// Sets the sensors and robots of a state.
    pub(super) fn set(&mut self, state: &PublishedState) {
        self.0 = Some((Arc::clone(&state.sensors), Arc::clone(&state.world)));
    }
}

/// Returns the sensors of the shown robots, with distinct names of topics.
pub(super) fn sensor_topics<'s>(
    sensors: impl Iterator<Item = &'s WorldSensor>,
    shown: &'s [Robot],
) -> Vec<(SensorKey, &'s WorldSensor, &'s Robot)> {
    let mut topics: Vec<(SensorKey, &WorldSensor, &Robot)> = Vec::new();
    for sensor in sensors {
        // The shown robots are the first ones.
        let Some(robot) = shown.get(sensor.robot) else { continue };
        let mut topic = format!("{}sensors/{}", robot.prefix, word(&sensor.definition.name));
        // Different names may become one word in ROS.
        while topics.iter().any(|((_, taken), ..)| *taken == topic) {
            topic.push('_');
        }
        topics.push(((sensor.id, topic), sensor, robot));
    }
    topics
}
