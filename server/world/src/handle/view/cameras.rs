//! Where the cameras of pages are, and where a client wants them to be.

use std::sync::Arc;
use std::time::Duration;

use glamx::DVec3;
use tokio::time::Instant;

use super::super::{Caller, SimHandle};

/// Pages whose cameras are known; of more, the one goes that was silent for longest.
const PAGES: usize = 64;
/// How long after its last call a page is open.
const STAYS: Duration = Duration::from_secs(5);

/// The camera of a page.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewCamera {
    /// World axes, metres.
    pub position: DVec3,
    /// What it turns about: world axes, metres.
    pub target: DVec3,
    /// World axes.
    pub up: DVec3,
    /// Vertical, radians.
    pub field_of_view: f64,
    /// Of the picture: its width and height, CSS pixels.
    pub size: [u32; 2],
}

/// Where cameras are to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraTarget {
    /// Grows with each that was set.
    pub version: u64,
    /// World axes, metres.
    pub position: DVec3,
    /// What it looks at: world axes, metres.
    pub target: DVec3,
    /// Vertical, radians; 0: as it is.
    pub field_of_view: f64,
}

/// The camera of a page that is open.
#[derive(Clone, Debug, PartialEq)]
pub struct PageCamera {
    /// The page's name.
    pub client: Arc<str>,
    /// Where it is.
    pub camera: ViewCamera,
    /// Since it last moved.
    pub age: Duration,
    /// The version of the newest target that it has followed.
    pub followed: u64,
}

/// Of all pages.
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
    /// What was set last.
    pub(super) fn target(&self) -> Option<CameraTarget> {
        self.target
    }

    /// A page has called.
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

    /// Of those that are open, the one that moved last first.
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
    /// A page says where its camera is, if it has moved, and which target it has followed.
    pub fn report_camera(&self, page: &Caller, camera: Option<ViewCamera>, followed: u64) {
        let now = Instant::now();
        let mut state = self.inner.view.at(now);
        match camera {
            Some(camera) => state.cameras.moved(page, camera, followed, now),
            None => state.cameras.followed(page, followed),
        }
        state.cameras.heard(page, now);
    }

    /// Moves the cameras of all pages. Answers with the version of the target.
    pub fn set_camera(&self, position: DVec3, target: DVec3, field_of_view: f64) -> u64 {
        let view = &self.inner.view;
        let set = view.change(Instant::now(), |state, _version| {
            let version = state.cameras.target.map_or(0, |before| before.version) + 1;
            state.cameras.target = Some(CameraTarget { version, position, target, field_of_view });
            Ok((version, true))
        });
        // Nothing refuses it.
        set.unwrap_or_default()
    }

    /// The cameras of pages that are open, the one that moved last first, and what was set last.
    pub fn cameras(&self) -> (Vec<PageCamera>, Option<CameraTarget>) {
        let now = Instant::now();
        let mut state = self.inner.view.at(now);
        (state.cameras.open(now), state.cameras.target)
    }
}
