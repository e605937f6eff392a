//! Present sessions of clients, so that objects bound to one end with it.
//!
//! Zenoh reports the sessions that are connected to this one. A client behind a router shows its presence by
//! a liveliness token. A query need not name its session; the streams of such a query end with their time,
//! which is short.
//!
//! Bounded: [`SESSIONS`] of each kind are followed at one time; nothing can be bound to others.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use simd_proto::keys;
use tokio_util::sync::CancellationToken;
use zenoh::Session;
use zenoh::sample::SampleKind;

use super::Error;
use simd_world::handle::Disconnect;

/// Maximum number of followed sessions.
const SESSIONS: usize = 4096;

/// The present sessions.
#[derive(Clone, Debug, Default)]
pub(super) struct Sessions(Arc<Mutex<There>>);

#[derive(Debug, Default)]
struct There {
    /// Sessions by the tokens of clients.
    tokens: HashMap<String, CancellationToken>,
    /// Sessions that are connected to the daemon's own.
    connected: HashMap<String, CancellationToken>,
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
        note(&mut self.lock().tokens, zid, kind);
    }

    fn note_connection(&self, zid: &str, kind: SampleKind) {
        note(&mut self.lock().connected, zid, kind);
    }

    /// Returns the token that is cancelled when a session's liveliness token ends; `None` if it has none.
    pub(super) fn of(&self, zid: &str) -> Option<Disconnect> {
        self.lock().tokens.get(zid).cloned().map(Disconnect)
    }

    /// Returns the token that is cancelled when the session that a query names ends; `None` if it is not
    /// followed.
    pub(super) fn end_of(&self, zid: &str) -> Option<CancellationToken> {
        let There { tokens, connected } = &*self.lock();
        connected.get(zid).or_else(|| tokens.get(zid)).cloned()
    }
}

/// Notes that a session has appeared or disappeared.
fn note(sessions: &mut HashMap<String, CancellationToken>, zid: &str, kind: SampleKind) {
    match kind {
        SampleKind::Put if sessions.len() < SESSIONS || sessions.contains_key(zid) => {
            sessions.entry(zid.to_owned()).or_default();
        }
        SampleKind::Put => {}
        SampleKind::Delete => {
            if let Some(ended) = sessions.remove(zid) {
                ended.cancel();
            }
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
        // A session that returns is another one.
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
    fn streams_of_a_session_end_with_it_and_no_others() {
        let sessions = Sessions::default();
        ["named", "other"].iter().for_each(|zid| sessions.note_connection(zid, SampleKind::Put));
        let [named, other] = ["named", "other"].map(|zid| sessions.end_of(zid).unwrap());
        assert!(sessions.end_of("unknown").is_none());
        sessions.note_connection("named", SampleKind::Delete);
        assert_eq!([&named, &other].map(CancellationToken::is_cancelled), [true, false]);
        assert!(sessions.end_of("named").is_none());
    }
}
