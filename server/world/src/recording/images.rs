//! Pictures of cameras in a recording: those that a renderer draws at a camera's rate, as messages of ROS 2, and no more of them than
//! so many bytes a second. To record is what has them drawn.

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

/// How often new pictures are looked for at the most.
const LOOK: Duration = Duration::from_millis(10);
/// Of many cameras less often: each of them costs a look at all that are followed.
const LOOK_OF_CAMERA: Duration = Duration::from_micros(100);
/// Bytes of the largest plane that is recorded: readers of recordings refuse messages of 32 MiB.
const LARGEST: u64 = 16 << 20;
/// No camera waits for longer.
const LONGEST: Duration = Duration::from_secs(600);
/// Cameras that are remembered; of those that are gone more are forgotten.
const MOST_CAMERAS: usize = 2_048;
/// The name of the metadata that says what there is of each camera.
pub(super) const METADATA: &str = "simd.cameras";

/// A picture of a camera.
pub(crate) struct CameraImage {
    /// Larger than that of every picture before.
    pub(crate) sequence: u64,
    /// The state that was drawn.
    pub(crate) state_sequence: u64,
    /// Of that state.
    pub(crate) sim_time: f64,
    /// When that state was published.
    pub(crate) wall_time: SystemTime,
    /// Pixels.
    pub(crate) width: u32,
    /// Pixels.
    pub(crate) height: u32,
    /// Focal lengths and where the axis is, pixels.
    pub(crate) pinhole: [f64; 4],
    /// Pictures of the camera's rate up to this one.
    pub(crate) drawn: u64,
    /// What it has for each pixel.
    pub(crate) planes: Vec<ImagePlane>,
}

/// Numbers of a picture, row by row from the upper left pixel.
pub(crate) struct ImagePlane {
    pub(crate) kind: ImageKind,
    /// Gives them, as long as they are to be; it may take milliseconds where they were packed.
    pub(crate) unpack: Box<dyn FnOnce() -> io::Result<Bytes>>,
}

/// No renderer has asked for work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NoRenderer;

/// Where pictures come from. Who draws them is known further up.
pub(crate) trait ImageSource: fmt::Debug + Send + Sync {
    /// The newest picture of a camera's own rate after that of a number, by the sensor's id; more are drawn for some seconds.
    ///
    /// # Errors
    /// Returns an error if no renderer is there.
    fn next_image(&self, camera: u64, after: u64) -> Result<Option<CameraImage>, NoRenderer>;
}

/// What of cameras is in the recording.
#[derive(Debug)]
pub(super) struct Images {
    /// Of all cameras together, nothing packed.
    bytes_per_second: f64,
    /// Pictures of this state and of those before are of no step of the recording.
    before: u64,
    /// When they are looked for again.
    next_look: Option<Instant>,
    /// No renderer was there at the last look.
    is_undrawn: bool,
    cameras: BTreeMap<u64, Recorded>,
}

/// What of a camera is in the recording.
#[derive(Debug, Default)]
struct Recorded {
    /// `ROBOT/NAME`.
    name: String,
    /// The number of the last picture.
    after: u64,
    /// Its pictures of the camera's rate up to that one.
    drawn: Option<u64>,
    share: Share,
    /// Its frames are in the file.
    is_described: bool,
    /// One of its planes is too large.
    is_too_large: bool,
    /// In the file.
    recorded: u64,
    /// Drawn meanwhile, and not in the file.
    left_out: u64,
}

/// A camera's part of the bytes of a second: who has written a picture waits for as long as it costs.
#[derive(Debug, Default)]
struct Share {
    free_at: Option<Instant>,
}

impl Share {
    fn is_free(&self, now: Instant) -> bool {
        self.free_at.is_none_or(|at| at <= now)
    }

    /// Waiting that a picture did not use counts for the next one, for as long as that costs: pictures do not come evenly.
    fn take(&mut self, bytes: u64, bytes_per_second: f64, now: Instant) {
        let cost =
            Duration::try_from_secs_f64(bytes as f64 / bytes_per_second).unwrap_or(LONGEST).min(LONGEST);
        let earliest = now.checked_sub(cost).unwrap_or(now);
        let from = self.free_at.map_or(now, |at| at.max(earliest));
        self.free_at = Some(from + cost);
    }
}

impl Images {
    /// Those of states after the newest one; `None` where none are to be recorded.
    pub(super) fn begin(bytes_per_second: u64, newest: &Published) -> Option<Self> {
        (bytes_per_second > 0).then(|| Self {
            bytes_per_second: bytes_per_second as f64,
            before: newest.sequence,
            next_look: None,
            is_undrawn: false,
            cameras: BTreeMap::new(),
        })
    }

    /// Another file has none of what is said once.
    pub(super) fn begin_file(&mut self) {
        for camera in self.cameras.values_mut() {
            (camera.is_described, camera.recorded, camera.left_out) = (false, 0, 0);
        }
    }

    /// Writes the pictures that came since the last time, now and then.
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

    /// Writes the pictures that came since the last time.
    pub(super) fn write(
        &mut self,
        source: &dyn ImageSource,
        state: &Published,
        now: Instant,
        file: &mut RecordingFile,
    ) -> Result<(), Unwritten> {
        let sensors = &state.state.sensors;
        let cameras = || sensors.iter().filter(|of| matches!(of.definition.kind, SensorKind::Camera(_)));
        if self.cameras.len() > MOST_CAMERAS {
            self.cameras.retain(|id, _| sensors.iter().any(|sensor| sensor.id == *id));
        }
        let count = u32::try_from(cameras().count()).unwrap_or(u32::MAX).max(1);
        let share = self.bytes_per_second / f64::from(count);
        self.next_look = now.checked_add(LOOK.max(LOOK_OF_CAMERA.saturating_mul(count)));
        // Not known where no camera is asked.
        let mut is_undrawn = None;
        for sensor in cameras() {
            let Some(entity) = state.state.world.entities.get(sensor.robot) else { continue };
            let camera = self.cameras.entry(sensor.id).or_default();
            if camera.name.is_empty() {
                camera.name = format!("{}/{}", entity.name, sensor.definition.name);
            }
            // Without a renderer none of them has one.
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

    /// What there is of each camera, in a sentence, for who wonders where its pictures are.
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
        // Of those that were drawn between two looks, or while this camera waited.
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
