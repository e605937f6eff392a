//! Programs that draw the pictures of a queue, and whether they are active.

use std::sync::Arc;
use std::time::Duration;

use tokio::time::Instant;

use super::{PictureQueue, Task};
use crate::handle::CallError;

/// Time for which a renderer counts as active after its last call.
pub(super) const PRESENT: Duration = Duration::from_secs(5);
/// Time after which an absent renderer is forgotten.
pub(super) const FORGOTTEN: Duration = Duration::from_secs(60);
/// Maximum number of known renderers.
const MAX_RENDERERS: usize = 64;

#[derive(Debug)]
pub(super) struct Renderer {
    pub(super) seen: Instant,
    /// Number of its calls that wait for work.
    pub(super) waiting: usize,
    pub(super) drawn: u64,
    pub(super) failed: u64,
}

/// An active renderer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RendererStatus {
    /// Name.
    pub name: Arc<str>,
    /// Number of pictures that it has drawn.
    pub drawn: u64,
    /// Number of its present tasks.
    pub drawing: usize,
    /// Number of tasks that it failed.
    pub failed: u64,
}

impl PictureQueue {
    /// Notes that a renderer waits for work, and returns its name.
    ///
    /// # Errors
    /// Returns an error if there are too many renderers.
    pub(in crate::handle::cameras) fn begin_waiting(
        &mut self,
        name: &str,
        now: Instant,
    ) -> Result<Arc<str>, CallError> {
        self.expire(now);
        let known = self.renderers.get_key_value(name).map(|(name, _)| Arc::clone(name));
        let name = match known {
            Some(name) => name,
            None if self.renderers.len() < MAX_RENDERERS => name.into(),
            None => {
                let what = "renderers".to_owned();
                let (value, limit) = (self.renderers.len() as u64 + 1, MAX_RENDERERS as u64);
                return Err(CallError::LimitExceeded { what, value, limit });
            }
        };
        let new = Renderer { seen: now, waiting: 0, drawn: 0, failed: 0 };
        let renderer = self.renderers.entry(Arc::clone(&name)).or_insert(new);
        renderer.seen = now;
        renderer.waiting += 1;
        Ok(name)
    }

    /// Notes that the renderer no longer waits.
    pub(in crate::handle::cameras) fn end_waiting(&mut self, name: &str, now: Instant) {
        if let Some(renderer) = self.renderers.get_mut(name) {
            renderer.waiting = renderer.waiting.saturating_sub(1);
            renderer.seen = now;
        }
    }

    /// Returns the active renderers, by name.
    pub(in crate::handle::cameras) fn renderers(&self, now: Instant) -> Vec<RendererStatus> {
        let present = self.renderers.iter().filter(|(name, of)| self.is_present(name, of, now));
        let status = |(name, of): (&Arc<str>, &Renderer)| RendererStatus {
            name: Arc::clone(name),
            drawn: of.drawn,
            drawing: self.drawn_by(name).count(),
            failed: of.failed,
        };
        present.map(status).collect()
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
    /// Returns an error if there is no active renderer.
    pub(in crate::handle::cameras) fn check_renderers(&self, now: Instant) -> Result<(), CallError> {
        match self.renderers.iter().any(|(name, of)| self.is_present(name, of, now)) {
            true => Ok(()),
            false => Err(CallError::NoRenderer),
        }
    }
}
