//! Drawings in pages, and input from pages: markers, cameras, keyboard and mouse. They are not part of the
//! world: steps, resets and saved states do not include them, and the physics thread is not asked.
//!
//! * `markers`: drawings of programs. `colors`: colours of links. `cameras`: present and requested cameras of
//!   pages.
//! * `input`: keyboard and mouse.
//!
//! All of it has one version, with which pages ask for changes.

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

/// View state, for any number of readers and writers.
#[derive(Debug)]
pub(super) struct View {
    /// Locked for a look or a change, never across a wait.
    state: Mutex<State>,
    /// Notifies of a new version.
    changed: Notify,
    /// Notifies of new keyboard or mouse events.
    input_came: Notify,
}

#[derive(Debug)]
struct State {
    /// Version: 1 at first; grows with every change.
    version: u64,
    markers: Markers,
    colors: Colors,
    cameras: Cameras,
    input: InputLog,
}

/// Changes since a version.
#[derive(Clone, Debug)]
pub struct ViewChange {
    /// Present version.
    pub version: u64,
    /// Whether `markers` has all markers.
    pub whole: bool,
    /// Added or replaced markers, by id.
    pub markers: Vec<Arc<Marker>>,
    /// Ids of deleted markers.
    pub deleted: Vec<u64>,
    /// Colours of links, if changed.
    pub colors: Option<Arc<Given>>,
    /// Requested camera, if a client set one.
    pub camera: Option<CameraTarget>,
    /// Client that asks for keyboard and mouse, if any.
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
    /// Returns the state at this time, without expired markers.
    fn at(&self, now: Instant) -> MutexGuard<'_, State> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let next = state.version + 1;
        if state.markers.drop_over(now, next) {
            state.version = next;
            self.changed.notify_waiters();
        }
        state
    }

    /// Changes the state. The closure gets the version that it would make, and returns whether it changed
    /// anything.
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

    /// Waits for a change after a version until the deadline, and returns the changes. A version above the
    /// present one is from before a restart of the daemon: then everything has changed.
    async fn other_than(&self, version: u64, deadline: Instant) -> ViewChange {
        loop {
            // Created before the look, so that a change in between wakes it.
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
    /// Waits for changes since a version; returns no changes after `timeout`. The caller counts as an open
    /// page if it has reported its camera.
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

    /// Drops expired markers.
    pub(super) fn tidy_view(&self, now: Instant) {
        drop(self.inner.view.at(now));
    }
}
