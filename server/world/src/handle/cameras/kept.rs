//! The newest pictures of cameras, kept while there is room.

use std::collections::BTreeMap;
use std::sync::Arc;

use tokio::time::Instant;

use super::picture::Picture;

/// Kept data of a robot's camera.
#[derive(Debug, Default)]
pub(super) struct Camera {
    /// Time until which pictures at its own rate are wanted.
    pub(super) followed_until: Option<Instant>,
    /// Picture of the newest state.
    pub(super) newest: Option<Arc<Picture>>,
    /// Newest picture at its own rate, with its arrival time.
    of_rate: Option<(Arc<Picture>, Instant)>,
    /// Number of pictures at its own rate.
    pub(super) drawn: u64,
    /// Number of pictures that were due and not drawn.
    pub(super) missed: u64,
}

impl Camera {
    /// Keeps a new picture; `is_due` if it is at the camera's own rate.
    pub(super) fn keep(&mut self, picture: &Arc<Picture>, is_due: bool, now: Instant) {
        let is_newer = |other: &Arc<Picture>| other.state_sequence <= picture.state_sequence;
        if self.newest.as_ref().is_none_or(is_newer) {
            self.newest = Some(Arc::clone(picture));
        }
        if is_due {
            self.drawn += 1;
            self.of_rate = Some((Arc::clone(picture), now));
        }
    }

    /// Returns the newest picture if it shows this state or a newer one.
    pub(super) fn of_state(&self, state_sequence: u64) -> Option<Arc<Picture>> {
        self.newest.clone().filter(|picture| picture.state_sequence >= state_sequence)
    }

    /// Returns the newest picture at its own rate if its number is above `after` and it is not older than
    /// `since`.
    pub(super) fn of_rate(&self, after: u64, since: Option<Instant>) -> Option<Arc<Picture>> {
        let (picture, came) = self.of_rate.as_ref()?;
        let is_news = picture.sequence > after && since.is_none_or(|since| *came >= since);
        is_news.then(|| Arc::clone(picture))
    }

    /// Returns the number of the oldest picture.
    fn oldest(&self) -> Option<u64> {
        let newest = self.newest.as_ref().map(|picture| picture.sequence);
        let of_rate = self.of_rate.as_ref().map(|(picture, _)| picture.sequence);
        newest.into_iter().chain(of_rate).min()
    }

    fn drop_oldest(&mut self) {
        let oldest = self.oldest();
        self.newest.take_if(|picture| Some(picture.sequence) == oldest);
        self.of_rate.take_if(|(picture, _)| Some(picture.sequence) == oldest);
    }

    /// Returns the bytes of its pictures. A picture that is kept for two reasons counts once.
    fn bytes(&self) -> u64 {
        let newest = self.newest.as_ref();
        let other = self.of_rate.as_ref().map(|(picture, _)| picture);
        let other = other.filter(|other| newest.is_none_or(|newest| !Arc::ptr_eq(newest, other)));
        newest.into_iter().chain(other).map(|picture| picture.drawn.bytes()).sum()
    }
}

/// Drops the oldest pictures of any cameras, until all take at most `bytes`.
pub(super) fn make_room(cameras: &mut BTreeMap<u64, Camera>, bytes: u64) {
    while cameras.values().map(Camera::bytes).sum::<u64>() > bytes {
        let having = cameras.values_mut().filter(|camera| camera.oldest().is_some());
        let Some(camera) = having.min_by_key(|camera| camera.oldest()) else { return };
        camera.drop_oldest();
    }
}
