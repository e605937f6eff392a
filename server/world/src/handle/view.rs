//! What pages show beside the world, and what people do in them: markers, cameras, keys and mouse. No part of the
//! world, so that no step, reset or saved state knows of it, and the physics thread is not asked.
//!
//! * `markers`: what programs draw. `colors`: what links look like. `cameras`: where the cameras of pages are, and are to be.
//! * `input`: keys and mouse.
//!
//! All of it has one version, by which pages ask for what has changed.

mod cameras;
mod colors;
mod input;
mod markers;
#[cfg(test)]
mod tests;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::Notify;
use tokio::time::Instant;

pub use cameras::{CameraTarget, PageCamera, ViewCamera};
pub use colors::{GivenColor, LinkColor};
pub use input::{Input, InputEvent, InputKind, MouseButton};
pub use markers::{Marker, MarkerShape, NewMarker};

use super::{CallError, Caller, SimHandle};
use cameras::Cameras;
use colors::{Colors, Given};
use input::InputLog;
use markers::Markers;

/// For any number of readers and writers.
#[derive(Debug)]
pub(super) struct View {
    /// Held for a look or a change, never across a wait.
    state: Mutex<State>,
    /// The version is another.
    changed: Notify,
    /// There are more events of keys or mouse.
    input_came: Notify,
}

#[derive(Debug)]
struct State {
    /// 1 before anything was drawn; grows with every change.
    version: u64,
    markers: Markers,
    colors: Colors,
    cameras: Cameras,
    input: InputLog,
}

/// What has changed since a version.
#[derive(Clone, Debug)]
pub struct ViewChange {
    /// Of the view now.
    pub version: u64,
    /// `markers` are all there are.
    pub whole: bool,
    /// Those that were added or replaced, by their ids.
    pub markers: Vec<Arc<Marker>>,
    /// Ids of those that are gone.
    pub deleted: Vec<u64>,
    /// Colours of links, where those changed.
    pub colors: Option<Arc<Given>>,
    /// Where cameras are to be, where a client said so.
    pub camera: Option<CameraTarget>,
    /// The client that asks for keys and mouse, where one does.
    pub asks: Option<Arc<str>>,
}

impl Default for View {
    fn default() -> Self {
        let (markers, colors, cameras, input) = Default::default();
        let state = Mutex::new(State { version: 1, markers, colors, cameras, input });
        Self { state, changed: Notify::new(), input_came: Notify::new() }
    }
}

impl View {
    /// The state as it is at this time: without markers that are over.
    fn at(&self, now: Instant) -> MutexGuard<'_, State> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let next = state.version + 1;
        if state.markers.drop_over(now, next) {
            state.version = next;
            self.changed.notify_waiters();
        }
        state
    }

    /// Changes the state. The change gets the version that it makes, and says whether it made one.
    fn change<T>(
        &self,
        now: Instant,
        change: impl FnOnce(&mut State, u64) -> Result<(T, bool), CallError>,
    ) -> Result<T, CallError> {
        let mut state = self.at(now);
        let next = state.version + 1;
        let (answer, is_other) = change(&mut state, next)?;
        if is_other {
            state.version = next;
            drop(state);
            self.changed.notify_waiters();
        }
        Ok(answer)
    }

    /// What has changed since a version once something has, or nothing after the deadline. A version that is ahead is from
    /// before a restart of the daemon: all of it has changed.
    async fn other_than(&self, version: u64, deadline: Instant) -> ViewChange {
        loop {
            // Made before the look, so that a change between look and wait wakes it.
            let changed = self.changed.notified();
            let now = Instant::now();
            let wake = {
                let state = self.at(now);
                if state.version != version || now >= deadline {
                    return state.since(version, now);
                }
                state.markers.next_look().map_or(deadline, |look| look.min(deadline))
            };
            tokio::select! {
                () = changed => {}
                () = tokio::time::sleep_until(wake) => {}
            }
        }
    }
}

impl State {
    fn since(&self, version: u64, now: Instant) -> ViewChange {
        let whole = version == 0 || version > self.version || self.markers.has_forgotten(version);
        let (markers, deleted) = self.markers.since(if whole { None } else { Some(version) });
        ViewChange {
            version: self.version,
            whole,
            markers,
            deleted,
            colors: self.colors.since(if whole { None } else { Some(version) }),
            camera: self.cameras.target(),
            asks: self.input.asks(now),
        }
    }
}

impl SimHandle {
    /// What has changed since a version, once something has; after `timeout`, nothing. The caller is a page that is open,
    /// if it has said where its camera is.
    ///
    /// # Errors
    /// Returns an error if the daemon drains before that, or the driver failed.
    pub async fn next_view(
        &self,
        version: u64,
        timeout: Duration,
        page: Option<&Caller>,
    ) -> Result<ViewChange, CallError> {
        let (view, now) = (&self.inner.view, Instant::now());
        if let Some(page) = page {
            view.at(now).cameras.heard(page, now);
        }
        self.until_drained(view.other_than(version, now + timeout)).await
    }

    /// Drops what is over.
    pub(super) fn tidy_view(&self, now: Instant) {
        drop(self.inner.view.at(now));
    }
}
