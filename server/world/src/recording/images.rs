//! Pictures of cameras in a recording: pictures that a renderer draws at a camera's rate, as ROS 2 messages.
//! They stay within a limit of bytes per second. A running recording requests the pictures.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::time::{Duration, Instant, SystemTime};

use bytes::Bytes;
use glamx::{DPose3, DQuat};
use simd_core::simulation::published_state::EntityLayout;
use simd_core::simulation::sensors::WorldSensor;
use simd_model::sensor::SensorKind;
use simd_ros2::messages::std_msgs::Header;

use super::camera_message::{ImageKind, SENSOR_FROM_OPTICAL, camera_info};
use super::file::{RecordingFile, Unwritten, nanos};
use super::readings::describe;
use super::ros::{stamp, topic_part, write};
use crate::driver::Published;

/// Minimum time between two looks for new pictures.
const CHECK_INTERVAL: Duration = Duration::from_millis(10);
/// Minimum time per camera, since each camera costs a look at all followed ones.
const LOOK_OF_CAMERA: Duration = Duration::from_micros(100);
/// Maximum size of a recorded plane, bytes: readers of recordings refuse messages of 32 MiB.
const LARGEST: u64 = 16 << 20;
/// Longest wait of a camera.
const LONGEST: Duration = Duration::from_secs(600);
/// Number of cameras beyond which deleted ones are forgotten.
const MAX_CAMERAS: usize = 2_048;
/// Name of the metadata that summarizes the pictures of each camera.
pub(super) const METADATA: &str = "simd.cameras";

/// A picture of a camera.
pub(crate) struct CameraImage {
    /// Number, larger than in every earlier picture.
    pub(crate) sequence: u64,
    /// Sequence of the drawn state.
    pub(crate) state_sequence: u64,
    /// Simulated time of that state, seconds.
    pub(crate) sim_time: f64,
    /// Wall time at which that state was published.
    pub(crate) wall_time: SystemTime,
    /// Width, pixels.
    pub(crate) width: u32,
    /// Height, pixels.
    pub(crate) height: u32,
    /// Focal lengths and optical centre, pixels.
    pub(crate) pinhole: [f64; 4],
    /// Number of pictures at the camera's rate up to this one.
    pub(crate) drawn: u64,
    /// Planes.
    pub(crate) planes: Vec<ImagePlane>,
}

/// Values of a picture's pixels, row by row from the upper left one.
pub(crate) struct ImagePlane {
    pub(crate) kind: ImageKind,
    /// Returns the values in full length; it may take milliseconds if they are compressed.
    pub(crate) unpack: Box<dyn FnOnce() -> io::Result<Bytes>>,
}

/// No renderer has asked for work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NoRenderer;

/// Source of pictures. Renderers are known only in a higher layer.
pub(crate) trait ImageSource: fmt::Debug + Send + Sync {
    /// Returns the newest picture at a camera's own rate with a larger number than `after`; `camera` is the
    /// sensor's id. Further pictures are drawn for some seconds.
    ///
    /// # Errors
    /// Returns an error if there is no renderer.
    fn next_image(&self, camera: u64, after: u64) -> Result<Option<CameraImage>, NoRenderer>;
}

/// Recorded pictures of cameras.
#[derive(Debug)]
pub(super) struct Images {
    /// Limit of all cameras together, uncompressed.
    bytes_per_second: f64,
    /// Sequence of the last state before the recording: its pictures and earlier ones belong to no recorded
    /// step.
    before: u64,
    /// Time of the next look.
    next_look: Option<Instant>,
    /// Whether there was no renderer at the last look.
    is_undrawn: bool,
    cameras: BTreeMap<u64, Recorded>,
}

/// Recorded pictures of a camera.
#[derive(Debug, Default)]
struct Recorded {
    /// `ROBOT/NAME`.
    name: String,
    /// Number of the last picture.
    after: u64,
    /// Number of pictures at the camera's rate up to that one.
    drawn: Option<u64>,
    share: Share,
    /// Whether its frames are in the file.
    is_described: bool,
    /// Whether one of its planes is too large.
    is_too_large: bool,
    /// Number of pictures in the file.
    recorded: u64,
    /// Number of pictures that were drawn, but are not in the file.
    left_out: u64,
}

/// A camera's share of the bytes per second: after a picture, it waits for the time that the picture costs.
#[derive(Debug, Default)]
struct Share {
    free_at: Option<Instant>,
}

impl Share {
    fn is_free(&self, now: Instant) -> bool {
        self.free_at.is_none_or(|at| at <= now)
    }

    /// Takes the cost of a picture. Unused waiting time counts for the next picture, up to its cost: pictures
    /// do not come evenly.
    fn take(&mut self, bytes: u64, bytes_per_second: f64, now: Instant) {
        let cost =
            Duration::try_from_secs_f64(bytes as f64 / bytes_per_second).unwrap_or(LONGEST).min(LONGEST);
        let earliest = now.checked_sub(cost).unwrap_or(now);
        let from = self.free_at.map_or(now, |at| at.max(earliest));
        self.free_at = Some(from + cost);
    }
}

impl Images {
    /// Records pictures of states after the newest one; `None` if pictures are disabled.
    pub(super) fn begin(bytes_per_second: u64, newest: &Published) -> Option<Self> {
        (bytes_per_second > 0).then(|| Self {
            bytes_per_second: bytes_per_second as f64,
            before: newest.sequence,
            next_look: None,
            is_undrawn: false,
            cameras: BTreeMap::new(),
        })
    }

    /// Begins another file, which has no descriptions yet.
    pub(super) fn begin_file(&mut self) {
        for camera in self.cameras.values_mut() {
            (camera.is_described, camera.recorded, camera.left_out) = (false, 0, 0);
        }
    }

    /// Writes new pictures, at intervals.
    pub(super) fn keep_up(
        &mut self,
        source: &dyn ImageSource,
        state: &Published,
        now: Instant,
        file: &mut RecordingFile,
    ) -> Result<(), Unwritten> {
        match self.next_look {
            Some(next) if now < next => Ok(()),
            _ => self.write(source, state, now, file),
        }
    }

    /// Writes new pictures.
    pub(super) fn write(
        &mut self,
        source: &dyn ImageSource,
        state: &Published,
        now: Instant,
        file: &mut RecordingFile,
    ) -> Result<(), Unwritten> {
        let sensors = &state.state.sensors;
        let cameras = || sensors.iter().filter(|of| matches!(of.definition.kind, SensorKind::Camera(_)));
        if self.cameras.len() > MAX_CAMERAS {
            self.cameras.retain(|id, _| sensors.iter().any(|sensor| sensor.id == *id));
        }
        let count = u32::try_from(cameras().count()).unwrap_or(u32::MAX).max(1);
        let share = self.bytes_per_second / f64::from(count);
        self.next_look = now.checked_add(CHECK_INTERVAL.max(LOOK_OF_CAMERA.saturating_mul(count)));
        // Unknown if no camera is asked.
        let mut is_undrawn = None;
        for sensor in cameras() {
            let Some(entity) = state.state.world.entities.get(sensor.robot) else { continue };
            let camera = self.cameras.entry(sensor.id).or_default();
            if camera.name.is_empty() {
                camera.name = format!("{}/{}", entity.name, sensor.definition.name);
            }
            // Without a renderer, no camera has a picture.
            if is_undrawn == Some(true) || !camera.share.is_free(now) {
                continue;
            }
            match source.next_image(sensor.id, camera.after) {
                Ok(Some(image)) if image.state_sequence > self.before => {
                    camera.write(image, sensor, entity, (share, now), file)?;
                }
                Ok(_) => {}
                Err(NoRenderer) => {
                    is_undrawn = Some(true);
                    continue;
                }
            }
            is_undrawn = Some(false);
        }
        if is_undrawn == Some(true) && !self.is_undrawn {
            tracing::warn!(
                "no renderer draws this world: pictures of its cameras are not recorded until simd-camera runs"
            );
        }
        self.is_undrawn = is_undrawn.unwrap_or(self.is_undrawn);
        Ok(())
    }

    /// Returns a sentence about the recorded pictures of each camera, for people who miss some.
    pub(super) fn summary(&self) -> BTreeMap<String, String> {
        self.cameras.values().map(|camera| (camera.name.clone(), camera.summary())).collect()
    }
}

impl Recorded {
    fn write(
        &mut self,
        image: CameraImage,
        sensor: &WorldSensor,
        entity: &EntityLayout,
        (bytes_per_second, now): (f64, Instant),
        file: &mut RecordingFile,
    ) -> Result<(), Unwritten> {
        let CameraImage { sequence, sim_time, wall_time, width, height, pinhole, drawn, planes, .. } = image;
        let sizes = || planes.iter().map(|plane| plane.kind.size(width, height));
        // Pictures that were drawn between two looks, or while this camera waited.
        self.left_out += self.drawn.map_or(0, |before| drawn.saturating_sub(before + 1));
        (self.after, self.drawn) = (sequence, Some(drawn));
        if sizes().any(|bytes| bytes > LARGEST) {
            if !std::mem::replace(&mut self.is_too_large, true) {
                tracing::warn!(
                    camera = self.name,
                    "its pictures are not recorded: {width} x {height} pixels are too many"
                );
            }
            self.left_out += 1;
            return Ok(());
        }
        self.share.take(sizes().sum(), bytes_per_second, now);
        let name = &sensor.definition.name;
        let frame = format!("{}/sensors/{name}", entity.name);
        let optical = format!("{frame}_optical");
        file.time = nanos(wall_time);
        if !std::mem::replace(&mut self.is_described, true) {
            let link = entity.model.links.get(sensor.definition.link).map_or("", |link| &link.name);
            let turn = DPose3::from_rotation(DQuat::from_array(SENSOR_FROM_OPTICAL));
            describe(sensor.definition.pose, format!("{}/{link}", entity.name), frame.clone(), file)?;
            describe(turn, frame, optical.clone(), file)?;
        }
        let topic = format!("/{}/sensors/{}", topic_part(&entity.name), topic_part(name));
        let header = Header { stamp: stamp(sim_time), frame_id: optical };
        for ImagePlane { kind, unpack } in planes {
            match unpack() {
                Ok(data) => {
                    let message = kind.image(header.clone(), width, height, &data);
                    write(file, &format!("{topic}/{}", kind.topic), &message)?;
                }
                Err(error) => {
                    tracing::debug!(camera = self.name, "a picture is not recorded: {error}");
                    self.left_out += 1;
                    return Ok(());
                }
            }
        }
        let info = camera_info(header, width, height, pinhole);
        write(file, &format!("{topic}/{}", ImageKind::INFO_TOPIC), &info)?;
        self.recorded += 1;
        Ok(())
    }

    fn summary(&self) -> String {
        match self {
            Self { is_too_large: true, .. } => "its pictures are too large for a recording".to_owned(),
            Self { drawn: None, .. } => "no picture of it was drawn".to_owned(),
            Self { recorded, left_out: 0, .. } => format!("{recorded} pictures"),
            Self { recorded, left_out, .. } => {
                format!("{recorded} pictures; {left_out} more were drawn and left out")
            }
        }
    }
}
