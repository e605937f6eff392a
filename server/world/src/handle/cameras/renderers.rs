//! Calls of renderers: work for them, and their results.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::{Instant, timeout_at};

use super::{Cameras, Drawn, PictureOrder, PictureTask};
use crate::handle::{CallError, Cancelled, SimHandle};

impl SimHandle {
    /// Returns the next task for a renderer, waiting at most `timeout`.
    ///
    /// # Errors
    /// Returns an error if there are too many renderers, or the daemon drains.
    pub async fn next_picture_task(
        &self,
        renderer: &str,
        timeout: Duration,
    ) -> Result<Option<PictureTask>, CallError> {
        let deadline = Instant::now() + timeout;
        let cameras = &self.inner.cameras;
        let name = cameras.queue().begin_waiting(renderer, Instant::now())?;
        let present = EndWaiting { cameras, name };
        loop {
            let work_came = cameras.work_came.notified();
            let (task, expiry) = {
                let mut queue = cameras.queue();
                (queue.next(&present.name, Instant::now(), |order| self.may_draw(order)), queue.next_expiry())
            };
            if task.is_some() {
                return Ok(task);
            }
            // By then, a task of an unresponsive renderer is free.
            let wake = expiry.map_or(deadline, |expiry| expiry.min(deadline));
            match timeout_at(wake, self.until_drained(work_came)).await {
                Ok(ended) => ended?,
                Err(_elapsed) if Instant::now() >= deadline => return Ok(None),
                Err(_elapsed) => {}
            }
        }
    }

    /// Accepts a renderer's picture for a task, or the reason why there is none. Returns whether the task
    /// waits for it from this renderer.
    ///
    /// # Errors
    /// Returns an error if the picture does not match the task, which then goes to another renderer in time.
    pub async fn put_picture(
        &self,
        id: u64,
        renderer: &str,
        drawn: Result<Drawn, String>,
    ) -> Result<bool, CallError> {
        let cameras = &self.inner.cameras;
        let may = |order: &PictureOrder| self.may_draw(order);
        let put = cameras.queue().begin_put(id, renderer, Instant::now(), may);
        let Some(order) = put else { return Ok(false) };
        let arriving = Arriving { cameras, id: Some(id) };
        let drawn = match drawn {
            Ok(drawn) => {
                let check = move |_: &Cancelled| drawn.check(&order.view).map(|()| drawn);
                Ok(self.heavy(check).await??)
            }
            Err(why) => {
                let why = format!("renderer {renderer} says: {why}");
                Err(CallError::PictureFailed { why })
            }
        };
        let was_waited_for = arriving.end(drawn);
        cameras.picture_came.notify_waiters();
        cameras.work_came.notify_waiters();
        Ok(was_waited_for)
    }

    /// Returns whether this caller may draw an order. Pictures from any point of view show the whole world.
    fn may_draw(&self, order: &PictureOrder) -> bool {
        let robot = order.camera.as_ref().map(|(_, name)| [name.robot.as_str()]);
        self.check_robots(robot.as_ref().map(<[&str; 1]>::as_slice)).is_ok()
    }
}

/// Ends the wait of a renderer, also of one whose call ends early.
struct EndWaiting<'h> {
    cameras: &'h Cameras,
    name: Arc<str>,
}

impl Drop for EndWaiting<'_> {
    fn drop(&mut self) {
        self.cameras.queue().end_waiting(&self.name, Instant::now());
    }
}

/// Ends the arrival of a picture, also if its call ends before the check.
struct Arriving<'h> {
    cameras: &'h Cameras,
    id: Option<u64>,
}

impl Arriving<'_> {
    fn end(mut self, drawn: Result<Drawn, CallError>) -> bool {
        self.id.take().is_some_and(|id| self.cameras.queue().end_put(id, drawn, Instant::now()))
    }
}

impl Drop for Arriving<'_> {
    fn drop(&mut self) {
        if let Some(id) = self.id {
            self.cameras.queue().abandon_put(id);
            // The task's time may be over, which waiting renderers did not wait for.
            self.cameras.work_came.notify_waiters();
        }
    }
}
