//! Cameras of pages, and the camera that a client requests for them.

use std::sync::Arc;
use std::time::Duration;

use glamx::DVec3;
use tokio::time::Instant;

use super::super::{Caller, SimHandle};

/// Maximum number of pages with known cameras; beyond it, the page that was silent longest is dropped.
const PAGES: usize = 64;
/// Time for which a page counts as open after its last call.
const STAYS: Duration = Duration::from_secs(5);

/// The camera of a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewCamera {
    /// Position, world axes, metres.
    pub position: DVec3,
    /// Point that it turns about, world axes, metres.
    pub target: DVec3,
    /// Up direction, world axes.
    pub up: DVec3,
    /// Vertical field of view, radians.
    pub field_of_view: f64,
    /// Width and height of the picture, CSS pixels.
    pub size: [u32; 2],
}

/// Requested camera of all pages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraTarget {
    /// Version, which grows with each request.
    pub version: u64,
    /// Position, world axes, metres.
    pub position: DVec3,
    /// Point that it looks at, world axes, metres.
    pub target: DVec3,
    /// Vertical field of view, radians; 0 keeps the present one.
    pub field_of_view: f64,
}

/// The camera of an open page.
#[derive(Clone, Debug, PartialEq)]
pub struct PageCamera {
    /// Name of the page.
    pub client: Arc<str>,
    /// Present camera.
    pub camera: ViewCamera,
    /// Time since it last moved.
    pub age: Duration,
    /// Version of the newest request that it has followed.
    pub followed: u64,
}

/// Cameras of all pages.
#[derive(Debug, Default)]
pub(super) struct Cameras {
    pages: Vec<Page>,
    target: Option<CameraTarget>,
}

#[derive(Debug)]
struct Page {
    caller: Caller,
    camera: ViewCamera,
    moved: Instant,
    heard: Instant,
    followed: u64,
}

impl Cameras {
    /// Returns the last request.
    pub(super) fn target(&self) -> Option<CameraTarget> {
        self.target
    }

    /// Notes a call of a page.
    pub(super) fn heard(&mut self, caller: &Caller, now: Instant) {
        if let Some(page) = self.pages.iter_mut().find(|page| page.caller == *caller) {
            page.heard = now;
        }
    }

    fn moved(&mut self, caller: &Caller, camera: ViewCamera, followed: u64, now: Instant) {
        self.pages.retain(|page| page.caller != *caller);
        if self.pages.len() >= PAGES
            && let Some((silent, _)) = self.pages.iter().enumerate().min_by_key(|(_, page)| page.heard)
        {
            self.pages.swap_remove(silent);
        }
        self.pages.push(Page { caller: caller.clone(), camera, moved: now, heard: now, followed });
    }

    fn followed(&mut self, caller: &Caller, followed: u64) {
        if let Some(page) = self.pages.iter_mut().find(|page| page.caller == *caller) {
            page.followed = followed;
        }
    }

    /// Returns the cameras of open pages; the one that moved last comes first.
    fn open(&mut self, now: Instant) -> Vec<PageCamera> {
        self.pages.retain(|page| now.saturating_duration_since(page.heard) < STAYS);
        self.pages.sort_by_key(|page| std::cmp::Reverse(page.moved));
        let seen = |page: &Page| PageCamera {
            client: Arc::clone(&page.caller.name),
            camera: page.camera,
            age: now.saturating_duration_since(page.moved),
            followed: page.followed,
        };
        self.pages.iter().map(seen).collect()
    }
}

impl SimHandle {
    /// Stores the camera of a page, if it has moved, and the version of the request that it has followed.
    pub fn report_camera(&self, page: &Caller, camera: Option<ViewCamera>, followed: u64) {
        let now = Instant::now();
        let mut state = self.inner.view.at(now);
        match camera {
            Some(camera) => state.cameras.moved(page, camera, followed, now),
            None => state.cameras.followed(page, followed),
        }
        state.cameras.heard(page, now);
    }

    /// Moves the cameras of all pages. Returns the version of the request.
    pub fn set_camera(&self, position: DVec3, target: DVec3, field_of_view: f64) -> u64 {
        let view = &self.inner.view;
        let set = view.change(Instant::now(), |state, _version| {
            let version = state.cameras.target.map_or(0, |before| before.version) + 1;
            state.cameras.target = Some(CameraTarget { version, position, target, field_of_view });
            Ok((version, true))
        });
        // The change always succeeds.
        set.unwrap_or_default()
    }

    /// Returns the cameras of open pages, the one that moved last first, and the last request.
    pub fn cameras(&self) -> (Vec<PageCamera>, Option<CameraTarget>) {
        let now = Instant::now();
        let mut state = self.inner.view.at(now);
        (state.cameras.open(now), state.cameras.target)
    }
}
