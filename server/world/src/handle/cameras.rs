//! Pictures of the world: requests for them, and their renderers.
//!
//! The daemon draws nothing: renderers are clients that ask for work. None of this is part of the world, and
//! the physics thread is not asked: renderers draw published states.
//!
//! * `queue`: tasks and renderers. `kept`: the newest pictures. `picture`: orders and results.
//! * `lens`: point of view and projection. `renderers`: calls of renderers. `recorded`: pictures for
//!   recordings.

mod kept;
mod lens;
mod picture;
mod picture_queue;
mod recorded;
mod renderers;
#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_core::Error;
use simd_core::simulation::sensors::WorldSensor;
use simd_model::sensor::{Camera, Picture as PictureKind, SensorKind};
use tokio::sync::Notify;
use tokio::time::{Instant, timeout_at};

pub use self::lens::{BadMatrix, Intrinsics, Lens, intrinsics};
pub use self::picture::MAX_PIXELS;
pub use self::picture::{
    CameraName, Drawn, Light, Picture, PictureOrder, PictureRobot, Plane, Planes, View as PictureView,
};
pub use self::picture_queue::{PictureTask, RendererStatus};

use self::picture_queue::{Bounds, PictureQueue, Waiting};
use super::{CallError, Published, SimHandle};
use crate::driver::CameraSample;
use crate::info::DaemonLimits;

/// Time for which a camera is followed after the last request for its next picture.
const FOLLOWED: Duration = Duration::from_secs(5);
/// Maximum age of a camera's picture for a client that has none yet.
const FRESH: Duration = Duration::from_secs(1);
/// Default background.
const WHITE: [f64; 3] = [1.0; 3];

/// Pictures for any number of clients and renderers.
#[derive(Debug)]
pub(super) struct Cameras {
    /// Locked for a look or a change, never across a wait.
    queue: Mutex<PictureQueue>,
    /// Wakes renderers when there may be work.
    work_came: Notify,
    /// Wakes clients when a camera may have a new picture at its own rate, or may be gone.
    picture_came: Notify,
    /// Wakes when another camera is followed.
    followed: Notify,
}

/// A camera of a robot, and facts about its pictures.
#[derive(Clone, Debug)]
pub struct CameraReport {
    /// Robot and name.
    pub name: CameraName,
    /// Camera.
    pub camera: Camera,
    /// Pictures per simulated second; `None` for one each step.
    pub rate: Option<f64>,
    /// Whether pictures at its rate are wanted.
    pub followed: bool,
    /// Newest picture.
    pub newest: Option<Arc<Picture>>,
    /// Number of pictures at its rate.
    pub drawn: u64,
    /// Number of pictures that were due and not drawn.
    pub missed: u64,
}

impl Cameras {
    pub(super) fn new(limits: &DaemonLimits) -> Self {
        let DaemonLimits { waiting_pictures: waiting, picture_bytes: bytes, drawing_time: drawing, .. } =
            *limits;
        let queue = Mutex::new(PictureQueue::new(Bounds { waiting, bytes, drawing }));
        Self { queue, work_came: Notify::new(), picture_came: Notify::new(), followed: Notify::new() }
    }

    fn queue(&self) -> MutexGuard<'_, PictureQueue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SimHandle {
    /// Returns the cameras of robots in the newest state, and the active renderers.
    pub fn camera_reports(&self) -> (Arc<Published>, Vec<CameraReport>, Vec<RendererStatus>) {
        let (state, now) = (self.newest(), Instant::now());
        let queue = self.inner.cameras.queue();
        let report = |sensor: &WorldSensor| {
            let camera = camera_of(sensor)?;
            let status = queue.camera(sensor.id, now);
            Some(CameraReport {
                name: name_of(&state, sensor),
                camera,
                rate: sensor.definition.rate,
                followed: status.followed,
                newest: status.newest,
                drawn: status.drawn,
                missed: status.missed,
            })
        };
        let reports = state.state.sensors.iter().filter_map(report).collect();
        let renderers = queue.renderers(now);
        drop(queue);
        (state, reports, renderers)
    }

    /// Returns a picture of a robot's camera, of the newest state or a later one.
    ///
    /// # Errors
    /// Returns an error if the camera does not exist, there is no renderer, or no picture in time.
    pub async fn present_picture(
        &self,
        robot: &str,
        sensor: &str,
        timeout: Duration,
    ) -> Result<Arc<Picture>, CallError> {
        let state = self.newest();
        let sensor = find(&state, robot, sensor)?;
        let kept = self.inner.cameras.queue().of_state(sensor.id, state.sequence);
        if let Some(picture) = kept {
            return Ok(picture);
        }
        let order = order(&state, sensor)
            .ok_or_else(|| CallError::Internal { message: "a camera has no pose".into() })?;
        self.check_size(&order.view)?;
        self.asked(order, timeout).await
    }

    /// Returns the newest picture at a camera's own rate with a larger number than `after`, waiting at most
    /// `timeout`. The camera is followed for some seconds.
    ///
    /// # Errors
    /// Returns an error if the camera does not exist (any more), there is no renderer, or no picture in time.
    pub async fn next_picture_of(
        &self,
        robot: &str,
        sensor: &str,
        after: u64,
        timeout: Duration,
    ) -> Result<Arc<Picture>, CallError> {
        let cameras = &self.inner.cameras;
        let deadline = Instant::now() + timeout;
        let since = (after == 0).then(|| Instant::now().checked_sub(FRESH)).flatten();
        loop {
            let came = cameras.picture_came.notified();
            // The camera may be deleted or created again: then it is another one with that name.
            let id = {
                let state = self.newest();
                let sensor = find(&state, robot, sensor)?;
                order(&state, sensor).map_or(Ok(()), |order| self.check_size(&order.view))?;
                sensor.id
            };
            let now = Instant::now();
            self.follow_camera(id, deadline.max(now + FOLLOWED))?;
            if let Some(picture) = cameras.queue().of_rate(id, after, since) {
                return Ok(picture);
            }
            timeout_at(deadline, self.until_drained(came)).await.map_err(|_elapsed| self.too_late())??;
        }
    }

    /// Returns a picture of the newest state from any point of view.
    ///
    /// # Errors
    /// Returns an error if there is no renderer or no picture in time.
    pub async fn take_picture(
        &self,
        view: PictureView,
        timeout: Duration,
    ) -> Result<Arc<Picture>, CallError> {
        self.check_size(&view)?;
        self.asked(PictureOrder { camera: None, view, state: self.newest() }, timeout).await
    }

    async fn asked(&self, order: PictureOrder, timeout: Duration) -> Result<Arc<Picture>, CallError> {
        let deadline = Instant::now() + timeout;
        let cameras = &self.inner.cameras;
        let mut waiting: Waiting = cameras.queue().ask(order, Instant::now())?;
        cameras.work_came.notify_waiters();
        let answered = async {
            match waiting.wait_for(Option::is_some).await.map(|answer| answer.clone()) {
                Ok(Some(answer)) => answer,
                // Its task was dropped.
                Ok(None) | Err(_) => Err(self.too_late()),
            }
        };
        timeout_at(deadline, self.until_drained(answered)).await.map_err(|_elapsed| self.too_late())??
    }

    /// Returns the reason why no picture came in time.
    fn too_late(&self) -> CallError {
        let present = self.inner.cameras.queue().check_renderers(Instant::now());
        present.err().unwrap_or(CallError::PictureTimeout)
    }

    /// Refuses a picture that is too large for an answer or a message.
    fn check_size(&self, view: &PictureView) -> Result<(), CallError> {
        let side = (view.width.max(view.height).into(), MAX_PIXELS.into(), "pixels of a side of a picture");
        let size = (view.bytes(), self.inner.info.limits.picture_bytes, "bytes of a picture");
        for (value, limit, what) in [side, size] {
            if value > limit {
                return Err(CallError::LimitExceeded { what: what.to_owned(), value, limit });
            }
        }
        Ok(())
    }

    /// Requests pictures of a camera at its own rate until a time; `id` is the sensor's.
    ///
    /// # Errors
    /// Returns an error if there is no renderer.
    pub(crate) fn follow_camera(&self, id: u64, until: Instant) -> Result<(), CallError> {
        let mut queue = self.inner.cameras.queue();
        let followed = queue.follow(id, until, Instant::now());
        // Done at once, so that no sample of a later step is missed.
        self.want_followed(&queue);
        drop(queue);
        self.inner.cameras.followed.notify_waiters();
        followed
    }

    /// Keeps the samples of followed cameras; returns whether there are any.
    fn want_followed(&self, queue: &PictureQueue) -> bool {
        let now = Instant::now();
        self.inner.driver.sensors.want_cameras(queue.followed(now));
        queue.followed(now).next().is_some()
    }

    /// Like `follow_camera`, for publications at intervals: also returns the newest picture after a number.
    pub fn followed_picture(&self, id: u64, after: u64) -> Option<Arc<Picture>> {
        // Without a renderer, subscribers get nothing.
        self.follow_camera(id, Instant::now() + FOLLOWED).ok()?;
        self.inner.cameras.queue().of_rate(id, after, None)
    }

    /// Returns the cameras of the newest state, with the ids of their sensors.
    pub fn cameras_by_id(&self) -> Vec<(u64, CameraName)> {
        let state = self.newest();
        let cameras = state.state.sensors.iter().filter(|sensor| camera_of(sensor).is_some());
        cameras.map(|sensor| (sensor.id, name_of(&state, sensor))).collect()
    }

    /// Makes tasks from the samples of followed cameras, until the daemon drains.
    pub async fn order_pictures(self) {
        let (draining, log) = (self.draining(), Arc::clone(&self.inner.driver.sensors));
        let orders = async {
            let mut sensors = Arc::clone(&self.newest().state.sensors);
            loop {
                let followed = self.inner.cameras.followed.notified();
                let grown = log.grown();
                let newest = self.newest();
                if !Arc::ptr_eq(&newest.state.sensors, &sensors) {
                    sensors = Arc::clone(&newest.state.sensors);
                    // Clients that wait for a picture of a deleted camera must learn of it.
                    self.inner.cameras.picture_came.notify_waiters();
                }
                for (id, CameraSample { state, missed }) in log.camera_samples() {
                    let sensor = state.state.sensors.iter().find(|sensor| sensor.id == id);
                    let order = sensor.and_then(|sensor| order(&state, sensor));
                    if let Some(order) = order.filter(|order| self.check_size(&order.view).is_ok()) {
                        self.inner.cameras.queue().due(order, missed, Instant::now());
                        self.inner.cameras.work_came.notify_waiters();
                    }
                }
                let is_any_followed = self.want_followed(&self.inner.cameras.queue());
                match is_any_followed {
                    true => grown.await,
                    false => followed.await,
                }
            }
        };
        draining.run_until_cancelled(orders).await;
    }

    /// Drops data of deleted cameras.
    pub(super) fn tidy_cameras(&self, now: Instant) {
        let state = self.newest();
        let is_there = |id: u64| state.state.sensors.iter().any(|sensor| sensor.id == id);
        self.inner.cameras.queue().tidy(is_there, now);
    }
}

fn camera_of(sensor: &WorldSensor) -> Option<Camera> {
    match sensor.definition.kind {
        SensorKind::Camera(camera) => Some(camera),
        _ => None,
    }
}

fn name_of(state: &Published, sensor: &WorldSensor) -> CameraName {
    let robot = state.state.world.entities.get(sensor.robot);
    let robot = robot.map(|robot| robot.name.clone()).unwrap_or_default();
    CameraName { robot, sensor: sensor.definition.name.clone() }
}

/// Finds a robot's camera by its name; an empty name means its only camera.
fn find<'s>(state: &'s Published, robot: &str, sensor: &str) -> Result<&'s WorldSensor, CallError> {
    let Some((index, _)) = state.state.entity(robot) else {
        let known = state.state.world.entities.iter().map(|entity| entity.name.clone()).collect();
        return Err(Error::RobotNotFound { robot: robot.to_owned(), known }.into());
    };
    let cameras = || state.state.sensors.iter().filter(|of| of.robot == index && camera_of(of).is_some());
    let mut named = cameras().filter(|of| sensor.is_empty() || of.definition.name == sensor);
    match (named.next(), named.next()) {
        (Some(found), None) => Ok(found),
        (Some(_), Some(_)) => Err(CallError::InvalidValue {
            element: "sensor".to_owned(),
            value: "empty".to_owned(),
            expected: format!("robot {robot:?} has {} cameras: name one", cameras().count()),
        }),
        (None, _) if sensor.is_empty() => Err(CallError::InvalidValue {
            element: "sensor".to_owned(),
            value: "empty".to_owned(),
            expected: format!("robot {robot:?} has no camera: add one to it"),
        }),
        (None, _) => {
            let known = cameras().map(|of| of.definition.name.clone()).collect();
            let (robot, sensor) = (robot.to_owned(), sensor.to_owned());
            Err(Error::SensorNotFound { robot, sensor, known }.into())
        }
    }
}

/// Makes the order for a camera's picture of a state.
fn order(state: &Arc<Published>, sensor: &WorldSensor) -> Option<PictureOrder> {
    let camera = camera_of(sensor)?;
    let poses = state.state.link_poses(sensor.robot)?;
    let world_from_camera = *poses.get(sensor.definition.link)? * sensor.definition.pose;
    let planes = match camera.picture {
        PictureKind::Color => Planes { color: true, ..Planes::default() },
        PictureKind::Depth => Planes { depth: true, ..Planes::default() },
        PictureKind::ColorAndDepth => Planes { color: true, depth: true, segmentation: false },
        PictureKind::Segmentation => Planes { segmentation: true, ..Planes::default() },
    };
    let view = PictureView {
        width: camera.width,
        height: camera.height,
        lens: Lens::of_camera(&camera, world_from_camera),
        planes,
        light: Light::default(),
        background: WHITE,
    };
    Some(PictureOrder { camera: Some((sensor.id, name_of(state, sensor))), view, state: Arc::clone(state) })
}
