//! Markers: lines, points and texts that programs draw. Bounded in number and bytes, in all and for each client.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use glamx::{DQuat, DVec3};
use simd_core::Error;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::super::{CallError, Owner, SimHandle};
use crate::account::Account;

/// Markers at one time, and those of one client.
const MARKERS: usize = 4_096;
const MARKERS_OF_CLIENT: usize = 3_072;
/// Bytes of all of them, and of those of one client.
const BYTES: usize = 16 << 20;
const BYTES_OF_CLIENT: usize = 12 << 20;
/// What a marker takes beside its points and texts.
const ENTRY: usize = 512;
/// Ids of markers that are gone that are remembered, for pages.
const DELETED: usize = 4_096;
/// How often it is looked for clients that are gone.
const LOOK: Duration = Duration::from_millis(100);

/// Something that is drawn.
#[derive(Clone, Debug)]
pub struct Marker {
    /// Never given to two.
    pub id: u64,
    /// What it is.
    pub shape: MarkerShape,
    /// Red, green, blue and alpha from 0 to 1, of what has no colours of its own.
    pub color: Option<[f64; 4]>,
    /// The robot that it moves with; empty for none.
    pub robot: String,
    /// Of the robot; empty for its root link.
    pub link: String,
    /// When it goes by itself.
    pub expires: Option<Instant>,
    /// Of the view when it last changed.
    pub version: u64,
    /// Who drew it.
    pub owner: Owner,
    /// Cancelled when that client is gone.
    until: Option<CancellationToken>,
}

/// What a marker is.
#[derive(Clone, Debug, PartialEq)]
pub enum MarkerShape {
    /// Straight lines.
    Lines {
        /// Both ends of each: x, y, z, metres.
        points: Vec<f32>,
        /// Red, green, blue for each line, or none.
        colors: Vec<f32>,
        /// CSS pixels.
        width: f32,
    },
    /// Dots.
    Points {
        /// x, y, z of each, metres.
        points: Vec<f32>,
        /// Red, green, blue for each, or none.
        colors: Vec<f32>,
        /// CSS pixels.
        size: f32,
    },
    /// Words.
    Text {
        /// What is written.
        text: String,
        /// Where it begins, metres.
        position: DVec3,
        /// Along x with y up; none: it faces the camera.
        orientation: Option<DQuat>,
        /// Height of a line, metres.
        size: f64,
    },
}

/// A marker to draw.
#[derive(Clone, Debug)]
pub struct NewMarker {
    /// The id of the one whose place it takes, if that is still there; 0 for none.
    pub replaces: u64,
    /// What it is.
    pub shape: MarkerShape,
    /// Of what has no colours of its own.
    pub color: Option<[f64; 4]>,
    /// The robot that it moves with; empty for none.
    pub robot: String,
    /// Of the robot; empty for its root link.
    pub link: String,
    /// How long it stays; none is until it is deleted.
    pub life_time: Option<Duration>,
}

impl NewMarker {
    /// Bytes.
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

    /// When it may be over.
    fn next_look(&self, now: Instant) -> Option<Instant> {
        let look = self.until.as_ref().map(|_| now + LOOK);
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

/// All of them.
#[derive(Debug, Default)]
pub(super) struct Markers {
    /// By id, which is the order in which they were added.
    by_id: BTreeMap<u64, Arc<Marker>>,
    /// Ids that were given.
    given: u64,
    /// Of all of them.
    total: Share,
    /// Of clients that have one.
    shares: BTreeMap<Account, Share>,
    /// Version and id of those that went, the oldest first.
    deleted: VecDeque<(u64, u64)>,
    /// Those that went with this version, or before it, may not be remembered.
    forgotten: u64,
    /// Nothing is over before then; none: nothing goes by itself.
    next_look: Option<Instant>,
}

/// What is counted.
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
    /// When something may be over.
    pub(super) fn next_look(&self) -> Option<Instant> {
        self.next_look
    }

    /// Whether deletions after a version may be forgotten.
    pub(super) fn has_forgotten(&self, version: u64) -> bool {
        version < self.forgotten
    }

    /// Those that were added or replaced after a version, and the ids of those that went; or all there are.
    pub(super) fn since(&self, version: Option<u64>) -> (Vec<Arc<Marker>>, Vec<u64>) {
        let Some(version) = version else { return (self.by_id.values().cloned().collect(), Vec::new()) };
        let newer = self.by_id.values().filter(|marker| marker.version > version);
        let gone = self.deleted.iter().rev().take_while(|(at, _)| *at > version).map(|(_, id)| *id);
        (newer.cloned().collect(), gone.collect())
    }

    /// Drops those that are over. Returns whether there were any.
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

    /// Refuses what would be too much of a client, with all that it replaces out of the way.
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
    /// Draws markers, all or none. With `until` they go when it is cancelled. Answers with their ids.
    ///
    /// # Errors
    /// Returns an error if a robot or link is not there or is not the caller's to change, where one that is another's would be replaced, and where there would be too many.
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

    /// Takes markers away, all that are not another's where none is named. Answers with the ids of those that went.
    ///
    /// # Errors
    /// Returns an error if one is another's; then none goes.
    pub fn delete_markers(&self, ids: &[u64]) -> Result<Vec<u64>, CallError> {
        self.inner.view.change(Instant::now(), |state, version| {
            let markers = &mut state.markers;
            let gone: Vec<u64> = if ids.is_empty() {
                let own = markers.by_id.values().filter(|marker| self.owns(&marker.owner));
                own.map(|marker| marker.id).collect()
            } else {
                // Once each, however often it is named.
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

    /// The version of the view, and all markers in the order in which they were added.
    pub fn markers(&self) -> (u64, Vec<Arc<Marker>>) {
        let state = self.inner.view.at(Instant::now());
        (state.version, state.markers.by_id.values().cloned().collect())
    }

    fn check_marker(&self, marker: &Marker) -> Result<(), CallError> {
        self.check_owner(|| format!("marker {}", marker.id), &marker.owner)
    }

    /// Refuses a marker on what is not there.
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
