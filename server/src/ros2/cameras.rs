//! Cameras: topics for the pictures and the parameters of each. A subscription makes renderers draw them.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use simd_core::simulation::published_state::PublishedState;
use simd_core::simulation::sensors::WorldSensor;
use simd_model::sensor::{Picture as Kind, SensorKind};
use simd_ros2::messages::sensor_msgs::{CameraInfo, Image};
use simd_ros2::messages::std_msgs::Header;
use simd_ros2::wire::Qos;

use super::endpoints::{Graph, Topic};
use super::robots::{DeclaredFor, Robot, SensorKey, sensor_topics};
use simd_world::SimHandle;
use simd_world::handle::{Picture, Plane};
use simd_world::recording::camera_message::{ImageKind, camera_info};
use simd_world::recording::stamp;

/// The topics of cameras.
#[derive(Debug, Default)]
pub(super) struct Cameras {
    declared_for: DeclaredFor,
    topics: BTreeMap<SensorKey, CameraTopics>,
}

/// The topics of a camera.
#[derive(Debug)]
struct CameraTopics {
    /// Optical frame: z forwards, x to the right.
    frame: String,
    info: Topic<CameraInfo>,
    color: Option<Topic<Image>>,
    depth: Option<Topic<Image>>,
    segmentation: Option<Topic<Image>>,
    /// Number of the last published picture.
    after: u64,
}

impl Cameras {
    /// Declares topics for each camera of the shown robots, and drops all others.
    ///
    /// # Errors
    /// Returns an error if a topic cannot be declared.
    pub(super) async fn follow(
        &mut self,
        graph: &Graph,
        shown: &[Robot],
        state: &PublishedState,
    ) -> Result<(), zenoh::Error> {
        if self.declared_for.is_of(state) {
            return Ok(());
        }
        let is_camera = |sensor: &&WorldSensor| matches!(sensor.definition.kind, SensorKind::Camera(_));
        let wanted = sensor_topics(state.sensors.iter().filter(is_camera), shown);
        self.topics.retain(|key, _| wanted.iter().any(|(wanted, ..)| wanted == key));
        for (key, sensor, robot) in wanted {
            let SensorKind::Camera(camera) = sensor.definition.kind else { continue };
            if let Entry::Vacant(entry) = self.topics.entry(key) {
                let frame = robot.optical_frame(&sensor.definition.name);
                let topics = CameraTopics::declare(graph, &entry.key().1, camera.picture, frame).await?;
                entry.insert(topics);
            }
        }
        self.declared_for.set(state);
        Ok(())
    }

    /// Publishes new pictures, if there is a subscriber. It waits while Zenoh does.
    pub(super) fn publish(&mut self, handle: &SimHandle) {
        for ((id, _), topics) in &mut self.topics {
            if !topics.is_wanted() {
                topics.after = 0;
            } else if let Some(picture) = handle.followed_picture(*id, topics.after) {
                topics.after = picture.sequence;
                topics.put(&picture);
            }
        }
    }
}

impl CameraTopics {
    async fn declare(graph: &Graph, topic: &str, kind: Kind, frame: String) -> Result<Self, zenoh::Error> {
        let (qos, name) = (Qos::DEFAULT, |part: &str| graph.name(&format!("{topic}/{part}")));
        let (mut color, mut depth, mut segmentation) = (None, None, None);
        if matches!(kind, Kind::Color | Kind::ColorAndDepth) {
            color = Some(graph.publisher(&name(ImageKind::COLOR.topic), qos).await?);
        }
        if matches!(kind, Kind::Depth | Kind::ColorAndDepth) {
            depth = Some(graph.publisher(&name(ImageKind::DEPTH.topic), qos).await?);
        }
        if kind == Kind::Segmentation {
            segmentation = Some(graph.publisher(&name(ImageKind::SEGMENTATION.topic), qos).await?);
        }
        let info = graph.publisher(&name(ImageKind::INFO_TOPIC), qos).await?;
        Ok(Self { frame, info, color, depth, segmentation, after: 0 })
    }

    fn is_wanted(&self) -> bool {
        let Self { frame: _, info, color, depth, segmentation, after: _ } = self;
        info.is_wanted() || [color, depth, segmentation].into_iter().flatten().any(Topic::is_wanted)
    }

    fn put(&self, picture: &Picture) {
        let Self { frame, info, color, depth, segmentation, after: _ } = self;
        let header = Header { stamp: stamp(picture.at.sim_time), frame_id: frame.clone() };
        let drawn = &picture.drawn;
        for (topic, plane, kind) in [
            (color, &drawn.color, ImageKind::COLOR),
            (depth, &drawn.depth, ImageKind::DEPTH),
            (segmentation, &drawn.segmentation, ImageKind::SEGMENTATION),
        ] {
            if let (Some(topic), Some(plane)) = (topic.as_ref().filter(|topic| topic.is_wanted()), plane)
                && let Some(message) = image(picture, plane, kind, header.clone())
            {
                topic.put(&message);
            }
        }
        if info.is_wanted() {
            let (width, height) = (picture.view.width, picture.view.height);
            info.put(&camera_info(header, width, height, picture.view.lens.pinhole()));
        }
    }
}

fn image(picture: &Picture, plane: &Plane, kind: ImageKind, header: Header) -> Option<Image> {
    let (width, height) = (picture.view.width, picture.view.height);
    let data = plane.unpacked(kind.size(width, height));
    let data = data.inspect_err(|error| tracing::debug!("a picture is not sent to ROS 2: {error}")).ok()?;
    Some(kind.image(header, width, height, &data))
}
