//! Which sessions of clients are there, so that what is bound to one ends with it.
//!
//! Zenoh says which sessions are connected to this one. A client behind a router says by a liveliness token that it is there.
//! A query need not say of which session it is. So where a session ends that never said it, the streams end of all that did not
//! say it either, and those that are there ask again.
//!
//! Bounded: [`SESSIONS`] of each kind are followed at one time; what is bound to others cannot be.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use simd_proto::keys;
use tokio_util::sync::CancellationToken;
use zenoh::Session;
use zenoh::sample::SampleKind;

use super::Error;
use simd_world::handle::Disconnect;

/// Sessions that are followed.
const SESSIONS: usize = 4096;

/// Those that are there.
#[derive(Clone, Debug, Default)]
pub(super) struct Sessions(Arc<Mutex<There>>);

#[derive(Debug, Default)]
struct There {
    /// By the tokens of clients.
    tokens: HashMap<String, CancellationToken>,
    /// That are connected to the daemon's own.
    connected: HashMap<String, Connected>,
    /// Cancelled, and made anew, when one ends that never said which it is.
    unnamed: CancellationToken,
}

#[derive(Debug, Default)]
struct Connected {
    ended: CancellationToken,
    /// A query said that it is of this session.
    is_named: bool,
}

impl Sessions {
    /// Follows the sessions of a daemon's clients from now on.
    pub(super) async fn follow(session: &Session, name: &str) -> Result<Self, Error> {
        let sessions = Self::default();
        let (taken, daemon) = (sessions.clone(), name.to_owned());
        let tokens = session.liveliness().declare_subscriber(keys::every_client(name)).history(true);
        let subscriber = tokens.callback(move |sample| {
            if let Some(zid) = keys::parse_client(&daemon, sample.key_expr().as_str()) {
                taken.note_token(zid, sample.kind());
            }
        });
        subscriber.background().await.map_err(Error::session)?;
        let connected = sessions.clone();
        let info = session.info();
        let events = info.transport_events_listener().history(true).callback(move |event| {
            connected.note_connection(&event.transport().zid().to_string(), event.kind());
        });
        events.background().await.map_err(Error::session)?;
        Ok(sessions)
    }

    fn lock(&self) -> MutexGuard<'_, There> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note_token(&self, zid: &str, kind: SampleKind) {
        let tokens = &mut self.lock().tokens;
        match kind {
            SampleKind::Put if tokens.len() < SESSIONS || tokens.contains_key(zid) => {
                tokens.entry(zid.to_owned()).or_default();
            }
            SampleKind::Put => {}
            SampleKind::Delete => {
                if let Some(token) = tokens.remove(zid) {
                    token.cancel();
                }
            }
        }
    }

    fn note_connection(&self, zid: &str, kind: SampleKind) {
        let There { connected, unnamed, .. } = &mut *self.lock();
        match kind {
            SampleKind::Put if connected.len() < SESSIONS || connected.contains_key(zid) => {
                connected.entry(zid.to_owned()).or_default();
            }
            SampleKind::Put => {}
            SampleKind::Delete => {
                let gone = connected.remove(zid).unwrap_or_default();
                gone.ended.cancel();
                if !gone.is_named {
                    std::mem::take(unnamed).cancel();
                }
            }
        }
    }

    /// What tells when a session has ended by its token; `None` where it has none.
    pub(super) fn of(&self, zid: &str) -> Option<Disconnect> {
        self.lock().tokens.get(zid).cloned().map(Disconnect)
    }

    /// What tells when the session of a query has ended, and whether that is certain. It may be another one where the query does
    /// not say of which it is.
    pub(super) fn end_of(&self, zid: Option<&str>) -> (CancellationToken, bool) {
        let There { tokens, connected, unnamed } = &mut *self.lock();
        let named = zid.and_then(|zid| match connected.get_mut(zid) {
            Some(connected) => {
                connected.is_named = true;
                Some(connected.ended.clone())
            }
            None => tokens.get(zid).cloned(),
        });
        match named {
            Some(ended) => (ended, true),
            None => (unnamed.clone(), false),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_is_there_from_its_token_to_its_end() {
        let sessions = Sessions::default();
        assert!(sessions.of("a1").is_none());
        sessions.note_token("a1", SampleKind::Put);
        let Disconnect(first) = sessions.of("a1").unwrap();
        sessions.note_token("a1", SampleKind::Put);
        assert!(!first.is_cancelled());
        sessions.note_token("a1", SampleKind::Delete);
        assert!(first.is_cancelled());
        assert!(sessions.of("a1").is_none());
        // One that comes back is another.
        sessions.note_token("a1", SampleKind::Put);
        assert!(!sessions.of("a1").unwrap().0.is_cancelled());
    }

    #[test]
    fn there_are_only_so_many() {
        let sessions = Sessions::default();
        (0..=SESSIONS).for_each(|number| sessions.note_token(&number.to_string(), SampleKind::Put));
        assert!(sessions.of(&(SESSIONS - 1).to_string()).is_some());
        assert!(sessions.of(&SESSIONS.to_string()).is_none());
    }

    #[test]
    fn what_a_session_asked_for_ends_with_it_and_what_may_be_its_own_too() {
        let sessions = Sessions::default();
        ["named", "other", "silent"].iter().for_each(|zid| sessions.note_connection(zid, SampleKind::Put));
        let (named, is_certain) = sessions.end_of(Some("named"));
        assert!(is_certain);
        let (other, _) = sessions.end_of(Some("other"));
        let (unnamed, is_certain) = sessions.end_of(None);
        assert!(!is_certain);
        sessions.note_connection("named", SampleKind::Delete);
        assert_eq!([&named, &other, &unnamed].map(CancellationToken::is_cancelled), [true, false, false]);
        sessions.note_connection("silent", SampleKind::Delete);
        assert_eq!([&other, &unnamed].map(CancellationToken::is_cancelled), [false, true]);
        assert!(!sessions.end_of(None).0.is_cancelled(), "who asks again is served");
    }
}
