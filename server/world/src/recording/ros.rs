//! Motion of robots as ROS 2 messages, so that other tools show a recording without conversion.
//!
//! A robot's topics are below its name, even if it is the only one: robots may be spawned and deleted during
//! a recording. Frames are `ROBOT/LINK`, and a robot's root link is in the frame `world`. Stamps are
//! simulated time.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glamx::DPose3;
use simd_core::simulation::published_state::EntityLayout;
use simd_model::robot::JointKind;
use simd_ros2::Message;
use simd_ros2::messages::builtin_interfaces::Time;
use simd_ros2::messages::geometry_msgs::{Quaternion, Transform, TransformStamped, Vector3};
use simd_ros2::messages::rosgraph_msgs::Clock;
use simd_ros2::messages::sensor_msgs::JointState;
use simd_ros2::messages::std_msgs::{Header, String as Text};
use simd_ros2::messages::tf2_msgs::TFMessage;

use super::file::{RecordingFile, Unwritten};
use crate::driver::Published;
use crate::loading::Loader;

/// Frame of all robots.
const WORLD: &str = "world";

/// Selection of recorded states, and robots described in the file.
#[derive(Debug)]
pub(super) struct States {
    /// Simulated seconds between states; `None` disables them.
    period: Option<f64>,
    /// Epoch, and the simulated time of the next recorded state.
    next: Option<(u64, f64)>,
    /// Versions of robots whose descriptions and fixed links are in the file.
    described: BTreeSet<u64>,
}

impl States {
    pub(super) fn new(period: Option<f64>) -> Self {
        Self { period, next: None, described: BTreeSet::new() }
    }

    /// Begins another file, which has no descriptions yet.
    pub(super) fn begin_file(&mut self) {
        self.next = None;
        self.described.clear();
    }

    /// Returns whether a state must be recorded.
    pub(super) fn is_due(&mut self, state: &Published) -> bool {
        let Some(period) = self.period else { return false };
        let (epoch, now) = (state.state.at.epoch, state.state.at.sim_time);
        // Rounded to the nearest step.
        let near = 0.5 * state.physics.time_step.min(period);
        let is_due = self.next.is_none_or(|(of, next)| of != epoch || now >= next - near);
        if is_due {
            let on_time = self.next.filter(|(of, next)| *of == epoch && now - next < period);
            self.next = Some((epoch, on_time.map_or(now, |(_, next)| next) + period));
        }
        is_due
    }

    pub(super) fn write(
        &mut self,
        state: &Published,
        loader: &Loader,
        file: &mut RecordingFile,
    ) -> Result<(), Unwritten> {
        let stamp = stamp(state.state.at.sim_time);
        write(file, "/clock", &Clock { clock: stamp.clone() })?;
        let mut moving = Vec::new();
        let mut versions = BTreeSet::new();
        for (index, entity) in state.state.world.entities.iter().enumerate() {
            versions.insert(entity.version);
            if let Some(joints) = joint_state(state, entity, &stamp) {
                write(file, &format!("/{}/joint_states", topic_part(&entity.name)), &joints)?;
            }
            let poses = state.state.link_poses(index).unwrap_or_default();
            moving.extend(transforms(entity, &poses, &stamp, false));
            if self.described.insert(entity.version) {
                describe(entity, &poses, &stamp, loader, file)?;
            }
        }
        self.described.retain(|version| versions.contains(version));
        Ok(write(file, "/tf", &TFMessage { transforms: moving })?)
    }
}

/// Writes the facts about a robot that are recorded once: its description, and its links that are fixed to
/// others.
fn describe(
    entity: &Arc<EntityLayout>,
    poses: &[DPose3],
    stamp: &Time,
    loader: &Loader,
    file: &mut RecordingFile,
) -> Result<(), Unwritten> {
    let source = loader.robot_source(&entity.model)?;
    let urdf = loader.file_of_robot(&source.description)?;
    let data = String::from_utf8_lossy(&urdf).into_owned();
    write(file, &format!("/{}/robot_description", topic_part(&entity.name)), &Text { data })?;
    let fixed = transforms(entity, poses, stamp, true);
    if !fixed.is_empty() {
        write(file, "/tf_static", &TFMessage { transforms: fixed })?;
    }
    Ok(())
}

/// Returns the transforms of a robot's links in their parents: of links on fixed joints, or of all
/// others. The root link counts as moving, since any robot can be moved.
fn transforms(
    entity: &EntityLayout,
    world_from_link: &[DPose3],
    stamp: &Time,
    fixed: bool,
) -> Vec<TransformStamped> {
    let frame = |link: usize| {
        let link = entity.model.links.get(link).map_or("", |link| &link.name);
        format!("{}/{link}", entity.name)
    };
    let transform = |parent: String, child: usize, pose: DPose3| TransformStamped {
        header: Header { stamp: stamp.clone(), frame_id: parent },
        child_frame_id: frame(child),
        transform: self::transform(pose),
    };
    let root = world_from_link.first().filter(|_| !fixed).map(|pose| transform(WORLD.to_owned(), 0, *pose));
    let joints = entity.model.joints.iter().filter(|joint| (joint.kind == JointKind::Fixed) == fixed);
    let joints = joints.filter_map(|joint| {
        let (parent, child) = (world_from_link.get(joint.parent)?, world_from_link.get(joint.child)?);
        Some(transform(frame(joint.parent), joint.child, parent.inverse() * *child))
    });
    root.into_iter().chain(joints).collect()
}

/// Converts a pose to ROS.
pub(super) fn transform(DPose3 { rotation, translation }: DPose3) -> Transform {
    Transform {
        translation: Vector3 { x: translation.x, y: translation.y, z: translation.z },
        rotation: Quaternion { x: rotation.x, y: rotation.y, z: rotation.z, w: rotation.w },
    }
}

/// Returns the joints of a robot with a single position; `None` if it has none of them.
fn joint_state(state: &Published, entity: &EntityLayout, stamp: &Time) -> Option<JointState> {
    let mut message = JointState {
        header: Header { stamp: stamp.clone(), frame_id: String::new() },
        ..JointState::default()
    };
    let ranges = entity.joint_positions.iter().zip(&entity.joint_velocities);
    for (joint, (positions, velocities)) in entity.model.joints.iter().zip(ranges) {
        if positions.len() != 1 || velocities.len() != 1 {
            continue;
        }
        let position = state.state.positions.get(entity.positions.start + positions.start)?;
        let index = entity.velocities.start + velocities.start;
        message.name.push(joint.name.clone());
        message.position.push(*position);
        message.velocity.push(*state.state.velocities.get(index)?);
        message.effort.push(*state.state.efforts.get(index)?);
    }
    (!message.name.is_empty()).then_some(message)
}

/// Returns a robot's name for a topic, which cannot have a hyphen.
pub(super) fn topic_part(name: &str) -> String {
    name.replace('-', "_")
}

/// Converts simulated time to ROS. It is never negative.
pub fn stamp(sim_time: f64) -> Time {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cast from a float saturates"
    )]
    let nanoseconds = (sim_time * 1e9).round() as u64;
    Time::from_nanoseconds(nanoseconds)
}

pub(super) fn write<M: Message>(file: &mut RecordingFile, topic: &str, message: &M) -> std::io::Result<()> {
    let hash = || BTreeMap::from([("topic_type_hash".to_owned(), M::type_hash().to_owned())]);
    let channel = file.channel(topic, "cdr", hash, (M::NAME, "ros2msg"), || M::definition().into_bytes())?;
    file.write(channel, &message.to_cdr())
}
