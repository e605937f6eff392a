//! Sessions of clients that say by a liveliness token that they are there: Zenoh tells when one has ended, and what is
//! bound to it ends too.
//!
//! Bounded: [`SESSIONS`] tokens are followed at one time; what is bound to others cannot be.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use simd_proto::keys;
use tokio_util::sync::CancellationToken;
use zenoh::Session;
use zenoh::sample::SampleKind;

use super::Error;
use simd_world::handle::Disconnect;

/// Tokens that are followed.
const SESSIONS: usize = 4096;

/// Those that are there.
#[derive(Clone, Debug, Default)]
pub(super) struct Sessions(Arc<Mutex<HashMap<String, CancellationToken>>>);

impl Sessions {
    /// Follows the tokens of a daemon's clients from now on.
    pub(super) async fn follow(session: &Session, name: &str) -> Result<Self, Error> {
        let sessions = Self::default();
        let (taken, daemon) = (sessions.clone(), name.to_owned());
        let tokens = session.liveliness().declare_subscriber(keys::every_client(name)).history(true);
        let subscriber = tokens.callback(move |sample| {
            if let Some(zid) = keys::parse_client(&daemon, sample.key_expr().as_str()) {
                taken.note(zid, sample.kind());
            }
        });
        subscriber.background().await.map_err(Error::session)?;
        Ok(sessions)
    }

    fn note(&self, zid: &str, kind: SampleKind) {
        let mut there = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match kind {
            SampleKind::Put if there.len() < SESSIONS || there.contains_key(zid) => {
                there.entry(zid.to_owned()).or_default();
            }
            SampleKind::Put => {}
            SampleKind::Delete => {
                if let Some(token) = there.remove(zid) {
                    token.cancel();
                }
            }
        }
    }

    /// What tells when a session has ended; `None` where it has no token.
    pub(super) fn of(&self, zid: &str) -> Option<Disconnect> {
        let there = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        there.get(zid).cloned().map(Disconnect)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_is_there_from_its_token_to_its_end() {
        let sessions = Sessions::default();
        assert!(sessions.of("a1").is_none());
        sessions.note("a1", SampleKind::Put);
        let Disconnect(first) = sessions.of("a1").unwrap();
        sessions.note("a1", SampleKind::Put);
        assert!(!first.is_cancelled());
        sessions.note("a1", SampleKind::Delete);
        assert!(first.is_cancelled());
        assert!(sessions.of("a1").is_none());
        // One that comes back is another.
        sessions.note("a1", SampleKind::Put);
        assert!(!sessions.of("a1").unwrap().0.is_cancelled());
    }

    #[test]
    fn there_are_only_so_many() {
        let sessions = Sessions::default();
        (0..=SESSIONS).for_each(|number| sessions.note(&number.to_string(), SampleKind::Put));
        assert!(sessions.of(&(SESSIONS - 1).to_string()).is_some());
        assert!(sessions.of(&SESSIONS.to_string()).is_none());
    }
}
