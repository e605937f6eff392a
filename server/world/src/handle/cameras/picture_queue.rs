//! Queue of wanted pictures. Each call passes the time, and none waits.
//!
//! * Here: its tasks. `renderers`: the programs that draw them.

mod renderers;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::time::Instant;

use super::kept::{Camera, make_room};
use super::picture::{Drawn, Picture, PictureOrder};
use crate::handle::CallError;
pub use renderers::RendererStatus;
use renderers::{FORGOTTEN, PRESENT, Renderer};

/// Number of renderers that get a task in turn before its callers are refused.
const MAX_TRIES: u32 = 3;
/// Maximum number of pictures at a camera's own rate that are drawn at one time. Without it, renderers that
/// never answer would make each of them hold its state until its time is over.
const MAX_UNSTEPPED_PICTURES: usize = 16;

/// Bounds of the queue.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Maximum number of pictures that clients wait for.
    pub(super) waiting: usize,
    /// Maximum bytes of these, uncompressed; also the maximum bytes of kept pictures.
    pub(super) bytes: u64,
    /// Time after which a renderer is considered unresponsive.
    pub(super) drawing: Duration,
}

/// Result of a task.
pub(super) type Answer = Result<Arc<Picture>, CallError>;

/// Receiver of a task's result.
pub(super) type Waiting = watch::Receiver<Option<Answer>>;

/// Tasks, renderers, and the newest pictures.
#[derive(Debug)]
pub(super) struct PictureQueue {
    bounds: Bounds,
    last_task: u64,
    last_picture: u64,
    /// Tasks, oldest first.
    tasks: BTreeMap<u64, Task>,
    renderers: BTreeMap<Arc<str>, Renderer>,
    /// Cameras by sensor id.
    cameras: BTreeMap<u64, Camera>,
}

#[derive(Debug)]
struct Task {
    order: Arc<PictureOrder>,
    since: Instant,
    /// Whether it is at a camera's own rate, and not requested by a client.
    is_due: bool,
    /// Renderer that draws it, and the start time.
    drawing: Option<(Arc<str>, Instant)>,
    /// Whether a picture for it is being checked.
    is_arriving: bool,
    tries: u32,
    answer: watch::Sender<Option<Answer>>,
}

/// Status of a camera in the queue.
#[derive(Clone, Debug, Default)]
pub(super) struct CameraStatus {
    pub(super) followed: bool,
    pub(super) newest: Option<Arc<Picture>>,
    pub(super) drawn: u64,
    pub(super) missed: u64,
}

/// A task for a renderer.
#[derive(Clone, Debug)]
pub struct PictureTask {
    /// Id, unique for the life of this daemon.
    pub id: u64,
    /// Order to draw.
    pub order: Arc<PictureOrder>,
    /// Time until the task goes to another renderer.
    pub time_left: Duration,
}

impl PictureQueue {
    pub(super) fn new(bounds: Bounds) -> Self {
        let (tasks, renderers, cameras) = Default::default();
        Self { bounds, last_task: 0, last_picture: 0, tasks, renderers, cameras }
    }

    /// Requests a picture for a client. Requests for the same camera share a task if it shows the requested
    /// state or a newer one.
    ///
    /// # Errors
    /// Returns an error if there is no renderer, or clients wait for too many pictures.
    pub(super) fn ask(&mut self, order: PictureOrder, now: Instant) -> Result<Waiting, CallError> {
        self.expire(now);
        self.check_renderers(now)?;
        let camera = order.camera.as_ref().map(|(id, _)| *id);
        let is_same = |task: &&Task| {
            task.order.camera.as_ref().map(|(id, _)| *id) == camera
                && task.order.state.sequence >= order.state.sequence
        };
        if camera.is_some()
            && let Some(task) = self.tasks.values().find(is_same)
        {
            return Ok(task.answer.subscribe());
        }
        let asked = || self.tasks.values().filter(|task| !task.is_due);
        let (count, most) = (asked().count() + 1, self.bounds.waiting);
        if count > most {
            let what = "pictures that are waited for".to_owned();
            return Err(CallError::LimitExceeded { what, value: count as u64, limit: most as u64 });
        }
        let bytes = asked().map(|task| task.order.view.bytes()).sum::<u64>() + order.view.bytes();
        if bytes > self.bounds.bytes {
            let what = "bytes of pictures that are waited for".to_owned();
            return Err(CallError::LimitExceeded { what, value: bytes, limit: self.bounds.bytes });
        }
        Ok(self.add(order, false, now))
    }

    /// Adds a due picture at a camera's own rate, after `missed_before` missed samples. It replaces a due one
    /// that no renderer has begun.
    pub(super) fn due(&mut self, order: PictureOrder, missed_before: u64, now: Instant) {
        self.expire(now);
        let Some((id, _)) = order.camera else { return };
        let older: Vec<u64> = self
            .tasks
            .iter()
            .filter(|(_, task)| task.is_due && task.drawing.is_none())
            .filter(|(_, task)| task.order.camera.as_ref().is_some_and(|(of, _)| *of == id))
            .map(|(task, _)| *task)
            .collect();
        let mut missed = missed_before + older.len() as u64;
        for task in older {
            match self.tasks.get_mut(&task) {
                // A client waits for it too.
                Some(task) if task.answer.receiver_count() > 0 => task.is_due = false,
                _ => drop(self.tasks.remove(&task)),
            }
        }
        let is_its = |task: &&Task| task.order.camera.as_ref().is_some_and(|(of, _)| *of == id);
        let drawn = self.tasks.values().filter(|task| task.is_due && task.drawing.is_some());
        if drawn.filter(is_its).count() < MAX_UNSTEPPED_PICTURES && self.check_renderers(now).is_ok() {
            self.add(order, true, now);
        } else {
            missed += 1;
        }
        self.cameras.entry(id).or_default().missed += missed;
    }

    fn add(&mut self, order: PictureOrder, is_due: bool, now: Instant) -> Waiting {
        self.last_task += 1;
        let (answer, waiting) = watch::channel(None);
        let order = Arc::new(order);
        let task = Task { order, since: now, is_due, drawing: None, is_arriving: false, tries: 0, answer };
        self.tasks.insert(self.last_task, task);
        waiting
    }

    /// Returns the oldest pending task among those that this renderer may draw.
    pub(super) fn next(
        &mut self,
        renderer: &Arc<str>,
        now: Instant,
        may: impl Fn(&PictureOrder) -> bool,
    ) -> Option<PictureTask> {
        self.expire(now);
        let is_free = |task: &Task| task.drawing.is_none() && may(&task.order);
        let (id, task) = self.tasks.iter_mut().find(|(_, task)| is_free(task))?;
        task.drawing = Some((Arc::clone(renderer), now));
        task.tries += 1;
        Some(PictureTask { id: *id, order: Arc::clone(&task.order), time_left: self.bounds.drawing })
    }

    /// Returns when the next task is taken from its renderer. A task whose picture is being checked stays,
    /// however late it is.
    pub(super) fn next_expiry(&self) -> Option<Instant> {
        let drawn = self.tasks.values().filter(|task| !task.is_arriving);
        let began = drawn.filter_map(|task| task.drawing.as_ref().map(|(_, began)| *began));
        began.min().map(|began| began + self.bounds.drawing)
    }

    /// Begins the check of a renderer's picture: returns its order, or `None` if no task waits for it from
    /// this renderer.
    pub(super) fn begin_put(
        &mut self,
        id: u64,
        renderer: &str,
        now: Instant,
        may: impl Fn(&PictureOrder) -> bool,
    ) -> Option<Arc<PictureOrder>> {
        self.expire(now);
        let task = self.tasks.get_mut(&id)?;
        let is_its = task.drawing.as_ref().is_some_and(|(of, _)| **of == *renderer);
        if !is_its || task.is_arriving || !may(&task.order) {
            return None;
        }
        task.is_arriving = true;
        Some(Arc::clone(&task.order))
    }

    /// Notes that a renderer disconnected while it sent a picture: the task can still be drawn, or goes to
    /// another renderer in time.
    pub(super) fn abandon_put(&mut self, id: u64) {
        if let Some(task) = self.tasks.get_mut(&id) {
            task.is_arriving = false;
        }
    }

    /// Ends a task with a checked picture or an error. Returns whether the task was waiting for it.
    pub(super) fn end_put(&mut self, id: u64, drawn: Result<Drawn, CallError>, now: Instant) -> bool {
        let Some(mut task) = self.tasks.remove(&id) else { return false };
        let Some((name, _)) = task.drawing.take() else { return false };
        let renderer = self.renderers.get_mut(&name);
        let drawn = match drawn {
            Ok(drawn) => drawn,
            Err(error) => {
                if let Some(renderer) = renderer {
                    renderer.failed += 1;
                }
                if task.is_due
                    && let Some((camera, _)) = &task.order.camera
                {
                    self.cameras.entry(*camera).or_default().missed += 1;
                }
                task.answer.send_replace(Some(Err(error)));
                return true;
            }
        };
        if let Some(renderer) = renderer {
            renderer.drawn += 1;
        }
        self.last_picture += 1;
        let picture = Arc::new(task.order.picture(self.last_picture, drawn, name));
        if let Some((camera, _)) = &task.order.camera {
            self.cameras.entry(*camera).or_default().keep(&picture, task.is_due, now);
            make_room(&mut self.cameras, self.bounds.bytes);
        }
        task.answer.send_replace(Some(Ok(picture)));
        true
    }

    /// Returns the newest picture of a camera if it shows this state or a newer one.
    pub(super) fn of_state(&self, camera: u64, state_sequence: u64) -> Option<Arc<Picture>> {
        self.cameras.get(&camera)?.of_state(state_sequence)
    }

    /// Returns a camera's newest picture at its own rate if its number is above `after` and it is not older
    /// than `since`.
    pub(super) fn of_rate(&self, camera: u64, after: u64, since: Option<Instant>) -> Option<Arc<Picture>> {
        self.cameras.get(&camera)?.of_rate(after, since)
    }

    /// Requests pictures of a camera at its own rate until a time.
    ///
    /// # Errors
    /// Returns an error if there is no renderer.
    pub(super) fn follow(&mut self, camera: u64, until: Instant, now: Instant) -> Result<(), CallError> {
        let entry = self.cameras.entry(camera).or_default();
        entry.followed_until = entry.followed_until.max(Some(until));
        self.check_renderers(now)
    }

    /// Returns the followed cameras.
    pub(super) fn followed(&self, now: Instant) -> impl Iterator<Item = u64> + '_ {
        let is_followed = move |camera: &Camera| camera.followed_until.is_some_and(|until| until > now);
        self.cameras.iter().filter(move |(_, camera)| is_followed(camera)).map(|(id, _)| *id)
    }

    pub(super) fn camera(&self, id: u64, now: Instant) -> CameraStatus {
        let Some(camera) = self.cameras.get(&id) else { return CameraStatus::default() };
        CameraStatus {
            followed: camera.followed_until.is_some_and(|until| until > now),
            newest: camera.newest.clone(),
            drawn: camera.drawn,
            missed: camera.missed,
        }
    }

    /// Drops data of deleted cameras.
    pub(super) fn tidy(&mut self, is_there: impl Fn(u64) -> bool, now: Instant) {
        self.cameras.retain(|id, _| is_there(*id));
        self.expire(now);
    }

    /// Takes tasks from unresponsive renderers, and drops tasks that no client wants any more.
    fn expire(&mut self, now: Instant) {
        let Self { bounds, tasks, renderers, cameras, .. } = self;
        tasks.retain(|_, task| {
            if task.is_arriving {
                return true;
            }
            let is_late = |began: Instant| now.saturating_duration_since(began) >= bounds.drawing;
            if let Some((name, _)) = task.drawing.take_if(|(_, began)| is_late(*began)) {
                if let Some(renderer) = renderers.get_mut(&name) {
                    renderer.failed += 1;
                }
                if task.tries >= MAX_TRIES {
                    let why = format!("{MAX_TRIES} attempts to draw it got no answer from a renderer");
                    task.answer.send_replace(Some(Err(CallError::PictureFailed { why })));
                    return false;
                }
                // At a camera's own rate, the next picture is already due.
                if task.is_due && task.answer.receiver_count() == 0 {
                    if let Some((camera, _)) = &task.order.camera {
                        cameras.entry(*camera).or_default().missed += 1;
                    }
                    return false;
                }
            }
            // A due picture does not hold its state until a renderer arrives.
            let is_awaited = task.is_due && now.saturating_duration_since(task.since) < PRESENT;
            is_awaited || task.drawing.is_some() || task.answer.receiver_count() > 0
        });
        let is_drawing = |name: &Arc<str>| {
            tasks.values().any(|task| task.drawing.as_ref().is_some_and(|(of, _)| of == name))
        };
        renderers.retain(|name, renderer| {
            let is_recent = now.saturating_duration_since(renderer.seen) < FORGOTTEN;
            renderer.waiting > 0 || is_recent || is_drawing(name)
        });
    }
}
