//! Markers: lines, points and texts that programs draw. Bounded in number and bytes, in total and for each
//! client.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use glamx::{DQuat, DVec3};
use simd_core::Error;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::super::{CallError, Owner, SimHandle};
use crate::account::Account;

/// Maximum number of markers, in total and of one client.
const MARKERS: usize = 4_096;
const MARKERS_OF_CLIENT: usize = 3_072;
/// Maximum bytes of markers, in total and of one client.
const BYTES: usize = 16 << 20;
const BYTES_OF_CLIENT: usize = 12 << 20;
/// Memory of a marker beside its points and texts, bytes.
const ENTRY: usize = 512;
/// Number of remembered ids of deleted markers, for pages.
const DELETED: usize = 4_096;
/// Time between two checks for disconnected clients.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);

/// A drawn marker.
#[derive(Clone, Debug)]
pub struct Marker {
    /// Id, which is never used again.
    pub id: u64,
    /// Shape.
    pub shape: MarkerShape,
    /// Red, green, blue and alpha from 0 to 1, for shapes without colours.
    pub color: Option<[f64; 4]>,
    /// Robot that it moves with; empty for none.
    pub robot: String,
    /// Link of the robot; empty for its root link.
    pub link: String,
    /// Time at which it expires.
    pub expires: Option<Instant>,
    /// Version of the view at its last change.
    pub version: u64,
    /// Owner.
    pub owner: Owner,
    /// Cancelled when the client has disconnected.
    until: Option<CancellationToken>,
}

/// Shapes of markers.
#[derive(Clone, Debug, PartialEq)]
pub enum MarkerShape {
    /// Line segments.
    Lines {
        /// Both ends of each segment: x, y, z, metres.
        points: Vec<f32>,
        /// Red, green, blue for each segment, or empty.
        colors: Vec<f32>,
        /// Width, CSS pixels.
        width: f32,
    },
    /// Dots.
    Points {
        /// Coordinates x, y, z of each dot, metres.
        points: Vec<f32>,
        /// Red, green, blue for each dot, or empty.
        colors: Vec<f32>,
        /// Size, CSS pixels.
        size: f32,
    },
    /// Text.
    Text {
        /// Content.
        text: String,
        /// Begin of the text, metres.
        position: DVec3,
        /// Orientation, with text along x and y up; `None` faces the camera.
        orientation: Option<DQuat>,
        /// Height of a line, metres.
        size: f64,
    },
}

/// A marker to draw.
#[derive(Clone, Debug)]
pub struct NewMarker {
    /// Id of the marker that it replaces, if that still exists; 0 for none.
    pub replaces: u64,
    /// Shape.
    pub shape: MarkerShape,
    /// Colour for shapes without colours.
    pub color: Option<[f64; 4]>,
    /// Robot that it moves with; empty for none.
    pub robot: String,
    /// Link of the robot; empty for its root link.
    pub link: String,
    /// Lifetime; `None` until it is deleted.
    pub life_time: Option<Duration>,
}

impl NewMarker {
    /// Returns its size, bytes.
    fn weight(&self) -> usize {
        weight(&self.shape, &self.robot, &self.link)
    }
}

impl Marker {
    fn weight(&self) -> usize {
        weight(&self.shape, &self.robot, &self.link)
    }

    fn is_over(&self, now: Instant) -> bool {
        self.expires.is_some_and(|at| at <= now)
            || self.until.as_ref().is_some_and(CancellationToken::is_cancelled)
    }

    /// Returns the next time at which it may end.
    fn next_look(&self, now: Instant) -> Option<Instant> {
        let look = self.until.as_ref().map(|_| now + CHECK_INTERVAL);
        self.expires.into_iter().chain(look).min()
    }
}

fn weight(shape: &MarkerShape, robot: &str, link: &str) -> usize {
    let shape = match shape {
        MarkerShape::Lines { points, colors, width: _ } | MarkerShape::Points { points, colors, size: _ } => {
            size_of::<f32>() * (points.len() + colors.len())
        }
        MarkerShape::Text { text, .. } => text.len(),
    };
    ENTRY + shape + robot.len() + link.len()
}

/// All markers.
#[derive(Debug, Default)]
pub(super) struct Markers {
    /// Markers by id, which is the order in which they were added.
    by_id: BTreeMap<u64, Arc<Marker>>,
    /// Last assigned id.
    given: u64,
    /// Share of all markers.
    total: Share,
    /// Shares of clients with markers.
    shares: BTreeMap<Account, Share>,
    /// Version and id of deleted markers, oldest first.
    deleted: VecDeque<(u64, u64)>,
    /// Deletions up to this version may not be remembered.
    forgotten: u64,
    /// No marker ends before this time; `None` if no marker expires.
    next_look: Option<Instant>,
}

/// Counted markers and bytes.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    markers: usize,
    bytes: usize,
}

impl Share {
    fn add(&mut self, bytes: usize) {
        *self = Self { markers: self.markers + 1, bytes: self.bytes + bytes };
    }

    fn remove(&mut self, bytes: usize) {
        let (markers, bytes) = (self.markers.saturating_sub(1), self.bytes.saturating_sub(bytes));
        *self = Self { markers, bytes };
    }

    fn check(self, (markers, bytes): (usize, usize), whose: &str) -> Result<(), CallError> {
        let counted = [("number", self.markers, markers), ("bytes", self.bytes, bytes)];
        match counted.into_iter().find(|(_, value, limit)| value > limit) {
            Some((what, value, limit)) => Err(CallError::LimitExceeded {
                what: format!("the {what} of {whose}"),
                value: value as u64,
                limit: limit as u64,
            }),
            None => Ok(()),
        }
    }
}

impl Markers {
    /// Returns the next time at which a marker may end.
    pub(super) fn next_look(&self) -> Option<Instant> {
        self.next_look
    }

    /// Returns whether deletions after a version may be forgotten.
    pub(super) fn has_forgotten(&self, version: u64) -> bool {
        version < self.forgotten
    }

    /// Returns the markers added or replaced after a version, and the ids of deleted ones; without a version,
    /// all markers.
    pub(super) fn since(&self, version: Option<u64>) -> (Vec<Arc<Marker>>, Vec<u64>) {
        let Some(version) = version else { return (self.by_id.values().cloned().collect(), Vec::new()) };
        let newer = self.by_id.values().filter(|marker| marker.version > version);
        let gone = self.deleted.iter().rev().take_while(|(at, _)| *at > version).map(|(_, id)| *id);
        (newer.cloned().collect(), gone.collect())
    }

    /// Drops markers that have ended. Returns whether there were any.
    pub(super) fn drop_over(&mut self, now: Instant, version: u64) -> bool {
        if self.next_look.is_none_or(|at| now < at) {
            return false;
        }
        let over: Vec<u64> =
            self.by_id.values().filter(|marker| marker.is_over(now)).map(|marker| marker.id).collect();
        for id in &over {
            self.delete(*id, version);
        }
        self.next_look = self.by_id.values().filter_map(|marker| marker.next_look(now)).min();
        !over.is_empty()
    }

    fn put(&mut self, marker: Marker, now: Instant) {
        let weight = marker.weight();
        let account = marker.owner.account().clone();
        self.next_look = self.next_look.into_iter().chain(marker.next_look(now)).min();
        if let Some(replaced) = self.by_id.insert(marker.id, Arc::new(marker)) {
            self.uncount(&replaced);
        }
        self.total.add(weight);
        self.shares.entry(account).or_default().add(weight);
    }

    fn delete(&mut self, id: u64, version: u64) {
        let Some(gone) = self.by_id.remove(&id) else { return };
        self.uncount(&gone);
        self.deleted.push_back((version, id));
        if self.deleted.len() > DELETED
            && let Some((version, _)) = self.deleted.pop_front()
        {
            self.forgotten = version;
        }
    }

    fn uncount(&mut self, gone: &Marker) {
        let (weight, account) = (gone.weight(), gone.owner.account());
        self.total.remove(weight);
        if let Some(share) = self.shares.get_mut(account) {
            share.remove(weight);
            if share.markers == 0 {
                self.shares.remove(account);
            }
        }
    }

    /// Refuses markers above the limits, not counting those that are replaced.
    fn check_room(&self, wanted: &[NewMarker], account: &Account) -> Result<(), CallError> {
        let mut total = self.total;
        let mut own = self.shares.get(account).copied().unwrap_or_default();
        let mut replaced: Vec<u64> = wanted.iter().map(|marker| marker.replaces).collect();
        replaced.sort_unstable();
        replaced.dedup();
        for old in replaced.iter().filter_map(|id| self.by_id.get(id)) {
            total.remove(old.weight());
            if old.owner.account() == account {
                own.remove(old.weight());
            }
        }
        for marker in wanted {
            total.add(marker.weight());
            own.add(marker.weight());
        }
        own.check((MARKERS_OF_CLIENT, BYTES_OF_CLIENT), &format!("the markers by {account}"))?;
        total.check((MARKERS, BYTES), "all markers")
    }
}

impl SimHandle {
    /// Draws markers, all or none. With `until`, they are deleted when it is cancelled. Returns their ids.
    ///
    /// # Errors
    /// Returns an error if a robot or link does not exist or the caller may not change it. Also if another
    /// owner's marker would be replaced, or there would be too many.
    pub fn add_markers(
        &self,
        wanted: Vec<NewMarker>,
        until: Option<&CancellationToken>,
    ) -> Result<Vec<u64>, CallError> {
        for marker in &wanted {
            let robot = [marker.robot.as_str()];
            self.check_robots(if marker.robot.is_empty() { None } else { Some(&robot) })?;
            self.check_parent(marker)?;
        }
        let (owner, now) = (self.owner(), Instant::now());
        self.inner.view.change(now, |state, version| {
            let markers = &mut state.markers;
            for old in wanted.iter().filter_map(|marker| markers.by_id.get(&marker.replaces)) {
                self.check_marker(old)?;
            }
            markers.check_room(&wanted, owner.account())?;
            let mut ids = Vec::with_capacity(wanted.len());
            for NewMarker { replaces, shape, color, robot, link, life_time } in wanted {
                let id = if markers.by_id.contains_key(&replaces) {
                    replaces
                } else {
                    markers.given += 1;
                    markers.given
                };
                let expires = life_time.map(|life_time| now + life_time);
                let (owner, until) = (owner.clone(), until.cloned());
                markers.put(Marker { id, shape, color, robot, link, expires, version, owner, until }, now);
                ids.push(id);
            }
            Ok((ids, true))
        })
    }

    /// Deletes markers; without ids, all that belong to no other owner. Returns the ids of the deleted ones.
    ///
    /// # Errors
    /// Returns an error if one belongs to another owner; then none is deleted.
    pub fn delete_markers(&self, ids: &[u64]) -> Result<Vec<u64>, CallError> {
        self.inner.view.change(Instant::now(), |state, version| {
            let markers = &mut state.markers;
            let gone: Vec<u64> = if ids.is_empty() {
                let own = markers.by_id.values().filter(|marker| self.owns(&marker.owner));
                own.map(|marker| marker.id).collect()
            } else {
                // Each counts once, however often it is named.
                let named: BTreeSet<u64> = ids.iter().copied().collect();
                named.into_iter().filter(|id| markers.by_id.contains_key(id)).collect()
            };
            for marker in gone.iter().filter_map(|id| markers.by_id.get(id)) {
                self.check_marker(marker)?;
            }
            for id in &gone {
                markers.delete(*id, version);
            }
            let is_other = !gone.is_empty();
            Ok((gone, is_other))
        })
    }

    /// Returns the version of the view, and all markers in the order in which they were added.
    pub fn markers(&self) -> (u64, Vec<Arc<Marker>>) {
        let state = self.inner.view.at(Instant::now());
        (state.version, state.markers.by_id.values().cloned().collect())
    }

    fn check_marker(&self, marker: &Marker) -> Result<(), CallError> {
        self.check_owner(|| format!("marker {}", marker.id), &marker.owner)
    }

    /// Refuses a marker on a missing robot or link.
    fn check_parent(&self, marker: &NewMarker) -> Result<(), CallError> {
        if marker.robot.is_empty() {
            return Ok(());
        }
        let newest = self.newest();
        let Some((_, entity)) = newest.state.entity(&marker.robot) else {
            let known = newest.state.world.entities.iter().map(|entity| entity.name.clone()).collect();
            return Err(Error::RobotNotFound { robot: marker.robot.clone(), known }.into());
        };
        let links = &entity.model.links;
        if marker.link.is_empty() || links.iter().any(|link| link.name == marker.link) {
            return Ok(());
        }
        let known = links.iter().map(|link| link.name.clone()).collect();
        Err(Error::LinkNotFound { robot: marker.robot.clone(), link: marker.link.clone(), known }.into())
    }
}
