//! Who wants which pictures, and who draws them. Each call brings the time, and none waits.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;
use tokio::time::Instant;

use super::kept::{Camera, make_room};
use super::picture::{Drawn, Picture, PictureOrder};
use crate::handle::CallError;

/// Who asked for work is a renderer for so long after its last answer.
const PRESENT: Duration = Duration::from_secs(5);
/// What is known of a renderer that went is forgotten after so long.
const FORGOTTEN: Duration = Duration::from_secs(60);
/// Names of renderers that are known at one time.
const MOST_RENDERERS: usize = 64;
/// Renderers that are given a task one after the other, until its callers are refused.
const MOST_TRIES: u32 = 3;
/// Pictures of a camera's own rate that are drawn at one time: of one whose renderers take tasks and answer none, each would keep its
/// state until its time is over.
const MOST_DRAWN: usize = 16;

/// What the queue keeps to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Pictures that clients wait for.
    pub(super) waiting: usize,
    /// Bytes of these, nothing packed; and bytes of the pictures that are kept.
    pub(super) bytes: u64,
    /// A renderer that did not answer for so long does not.
    pub(super) drawing: Duration,
}

/// What becomes of a task.
pub(super) type Answer = Result<Arc<Picture>, CallError>;

/// A task's place, for one who waits for it.
pub(super) type Waiting = watch::Receiver<Option<Answer>>;

/// Tasks, renderers, and the newest pictures.
#[derive(Debug)]
pub(super) struct PictureQueue {
    bounds: Bounds,
    last_task: u64,
    last_picture: u64,
    /// Oldest first.
    tasks: BTreeMap<u64, Task>,
    renderers: BTreeMap<Arc<str>, Renderer>,
    /// By sensor.
    cameras: BTreeMap<u64, Camera>,
}

#[derive(Debug)]
struct Task {
    order: Arc<PictureOrder>,
    since: Instant,
    /// Of a camera's own rate, and not asked for by a client.
    is_due: bool,
    /// Who draws it, and since when.
    drawing: Option<(Arc<str>, Instant)>,
    /// A picture for it is being looked at.
    is_arriving: bool,
    tries: u32,
    answer: watch::Sender<Option<Answer>>,
}

#[derive(Debug)]
struct Renderer {
    seen: Instant,
    /// Calls of it that wait for work.
    waiting: usize,
    drawn: u64,
    failed: u64,
}

/// What the queue says of a camera.
#[derive(Clone, Debug, Default)]
pub(super) struct CameraStatus {
    pub(super) followed: bool,
    pub(super) newest: Option<Arc<Picture>>,
    pub(super) drawn: u64,
    pub(super) missed: u64,
}

/// A renderer that is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RendererStatus {
    /// Its name.
    pub name: Arc<str>,
    /// Pictures that it has drawn.
    pub drawn: u64,
    /// Tasks that it has.
    pub drawing: usize,
    /// Tasks that it did not do.
    pub failed: u64,
}

/// A task for a renderer.
#[derive(Clone, Debug)]
pub struct PictureTask {
    /// Unlike that of any other task of this daemon.
    pub id: u64,
    /// What is to be drawn.
    pub order: Arc<PictureOrder>,
    /// After that it goes to another renderer.
    pub time_left: Duration,
}

impl PictureQueue {
    pub(super) fn new(bounds: Bounds) -> Self {
        let (tasks, renderers, cameras) = Default::default();
        Self { bounds, last_task: 0, last_picture: 0, tasks, renderers, cameras }
    }

    /// A client wants a picture. Who wants one of the same camera and of a state that is no newer, waits for the same.
    ///
    /// # Errors
    /// Returns an error if no renderer is there, or too many pictures are waited for.
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

    /// A picture of a camera's own rate is due, after so many that never were: it replaces one that no renderer has begun.
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
        if drawn.filter(is_its).count() < MOST_DRAWN && self.check_renderers(now).is_ok() {
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

    /// A renderer begins to wait for work.
    ///
    /// # Errors
    /// Returns an error if there are too many.
    pub(super) fn begin_waiting(&mut self, name: &str, now: Instant) -> Result<Arc<str>, CallError> {
        self.expire(now);
        let known = self.renderers.get_key_value(name).map(|(name, _)| Arc::clone(name));
        let name = match known {
            Some(name) => name,
            None if self.renderers.len() < MOST_RENDERERS => name.into(),
            None => {
                let what = "renderers".to_owned();
                let (value, limit) = (self.renderers.len() as u64 + 1, MOST_RENDERERS as u64);
                return Err(CallError::LimitExceeded { what, value, limit });
            }
        };
        let new = Renderer { seen: now, waiting: 0, drawn: 0, failed: 0 };
        let renderer = self.renderers.entry(Arc::clone(&name)).or_insert(new);
        renderer.seen = now;
        renderer.waiting += 1;
        Ok(name)
    }

    /// It does not wait any more.
    pub(super) fn end_waiting(&mut self, name: &str, now: Instant) {
        if let Some(renderer) = self.renderers.get_mut(name) {
            renderer.waiting = renderer.waiting.saturating_sub(1);
            renderer.seen = now;
        }
    }

    /// The oldest task that is not being drawn, of those that this renderer may draw.
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

    /// When the next task is taken from its renderer. One whose picture is being looked at is not, however late it is.
    pub(super) fn next_expiry(&self) -> Option<Instant> {
        let drawn = self.tasks.values().filter(|task| !task.is_arriving);
        let began = drawn.filter_map(|task| task.drawing.as_ref().map(|(_, began)| *began));
        began.min().map(|began| began + self.bounds.drawing)
    }

    /// A picture for a task comes from a renderer: what it is to be, or `None` where nothing waits for it from there.
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

    /// Who was sending a picture went: the task is drawn on, or goes to another renderer in time.
    pub(super) fn abandon_put(&mut self, id: u64) {
        if let Some(task) = self.tasks.get_mut(&id) {
            task.is_arriving = false;
        }
    }

    /// Ends a task with the picture that was checked, or with why there is none. Returns whether it was waited for.
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

    /// The newest picture of a camera, where it is of this state or of a newer one.
    pub(super) fn of_state(&self, camera: u64, state_sequence: u64) -> Option<Arc<Picture>> {
        self.cameras.get(&camera)?.of_state(state_sequence)
    }

    /// A camera's newest picture of its own rate, where it is newer than that of this number and not older than `since`.
    pub(super) fn of_rate(&self, camera: u64, after: u64, since: Option<Instant>) -> Option<Arc<Picture>> {
        self.cameras.get(&camera)?.of_rate(after, since)
    }

    /// Pictures of a camera are wanted at its own rate, until then.
    ///
    /// # Errors
    /// Returns an error if no renderer is there.
    pub(super) fn follow(&mut self, camera: u64, until: Instant, now: Instant) -> Result<(), CallError> {
        let entry = self.cameras.entry(camera).or_default();
        entry.followed_until = entry.followed_until.max(Some(until));
        self.check_renderers(now)
    }

    /// The cameras whose own rate counts.
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

    /// Those that are there, by name.
    pub(super) fn renderers(&self, now: Instant) -> Vec<RendererStatus> {
        let present = self.renderers.iter().filter(|(name, of)| self.is_present(name, of, now));
        let status = |(name, of): (&Arc<str>, &Renderer)| RendererStatus {
            name: Arc::clone(name),
            drawn: of.drawn,
            drawing: self.drawn_by(name).count(),
            failed: of.failed,
        };
        present.map(status).collect()
    }

    /// Drops what is kept of cameras that are gone.
    pub(super) fn tidy(&mut self, is_there: impl Fn(u64) -> bool, now: Instant) {
        self.cameras.retain(|id, _| is_there(*id));
        self.expire(now);
    }

    fn drawn_by<'b>(&'b self, renderer: &'b str) -> impl Iterator<Item = &'b Task> {
        let is_its = move |task: &&Task| task.drawing.as_ref().is_some_and(|(of, _)| **of == *renderer);
        self.tasks.values().filter(is_its)
    }

    fn is_present(&self, name: &str, renderer: &Renderer, now: Instant) -> bool {
        let is_recent = now.saturating_duration_since(renderer.seen) < PRESENT;
        renderer.waiting > 0 || is_recent || self.drawn_by(name).next().is_some()
    }

    /// # Errors
    /// Returns an error if no renderer is there.
    pub(super) fn check_renderers(&self, now: Instant) -> Result<(), CallError> {
        match self.renderers.iter().any(|(name, of)| self.is_present(name, of, now)) {
            true => Ok(()),
            false => Err(CallError::NoRenderer),
        }
    }

    /// Takes tasks from renderers that do not answer, and drops what is not waited for any more.
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
                if task.tries >= MOST_TRIES {
                    let why = format!("{MOST_TRIES} times a renderer was given it and gave no answer");
                    task.answer.send_replace(Some(Err(CallError::PictureFailed { why })));
                    return false;
                }
                // Of a camera's own rate the next one is due already.
                if task.is_due && task.answer.receiver_count() == 0 {
                    if let Some((camera, _)) = &task.order.camera {
                        cameras.entry(*camera).or_default().missed += 1;
                    }
                    return false;
                }
            }
            // One that is due does not hold its state until a renderer comes.
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
