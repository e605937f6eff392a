//! Maps names of daemons to sessions, as their tokens say, so that other sessions' answers are not taken for
//! the daemon's.
//!
//! A client stays with its first session as long as that session's token exists, even if another session
//! claims the name. When the token is gone, the only session with the name is the restarted daemon; if there
//! are several, none is chosen.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use simd_proto::keys;
use zenoh::sample::{Sample, SampleKind};
use zenoh::session::ZenohId;

use super::Presence;

/// Maximum number of remembered tokens; further ones are ignored.
const KEPT: usize = 4096;

/// State of the tokens so far. Clones share it.
#[derive(Clone, Debug, Default)]
pub(super) struct Daemons(Arc<Mutex<BTreeMap<String, Named>>>);

/// The sessions that claim one name.
#[derive(Debug, Default)]
struct Named {
    /// Sessions whose tokens exist.
    here: BTreeSet<ZenohId>,
    /// Session that calls go to.
    chosen: Option<ZenohId>,
}

impl Daemons {
    /// Records that a token was declared or removed.
    pub(super) fn update(&self, sample: &Sample) {
        self.token(sample.key_expr().as_str(), sample.kind());
    }

    fn token(&self, key: &str, kind: SampleKind) {
        let Some((name, zid)) = keys::parse_daemon(key) else { return };
        let Ok(zid) = zid.parse::<ZenohId>() else { return };
        let mut daemons = self.lock();
        match kind {
            SampleKind::Put => {
                if daemons.values().map(|named| named.here.len().max(1)).sum::<usize>() < KEPT {
                    daemons.entry(name.to_owned()).or_default().here.insert(zid);
                }
            }
            SampleKind::Delete => {
                let Some(named) = daemons.get_mut(name) else { return };
                named.here.remove(&zid);
                if named.here.is_empty() && named.chosen.is_none() {
                    daemons.remove(name);
                }
            }
        }
    }

    /// Returns the session that calls to the daemon of this name go to; `None` if no token was ever seen.
    ///
    /// # Errors
    /// Returns all sessions that claim the name, if there are several.
    pub(super) fn choose(&self, name: &str) -> Result<Option<ZenohId>, Vec<ZenohId>> {
        let mut daemons = self.lock();
        let Some(named) = daemons.get_mut(name) else { return Ok(None) };
        if named.chosen.is_none_or(|chosen| !named.here.contains(&chosen)) {
            let mut here = named.here.iter();
            match (here.next(), here.next()) {
                // The last session may still send its last answers.
                (None, _) => {}
                (Some(only), None) => named.chosen = Some(*only),
                (Some(_), Some(_)) => return Err(named.here.iter().copied().collect()),
            }
        }
        Ok(named.chosen)
    }

    /// Returns all daemons whose tokens exist, by name.
    pub(super) fn list(&self) -> Vec<Presence> {
        let daemons = self.lock();
        let each = daemons.iter().flat_map(|(name, named)| named.here.iter().map(move |zid| (name, zid)));
        each.map(|(name, zid)| Presence { name: name.clone(), zid: zid.to_string() }).collect()
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Named>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Explains why none of several sessions is chosen.
pub(super) fn several(name: &str, sessions: &[impl std::fmt::Display]) -> String {
    let listed: Vec<String> = sessions.iter().map(ToString::to_string).collect();
    let listed = listed.join(" and ");
    format!(
        "several sessions say that they are the daemon `{name}`: {listed}; end all but one, or start it with another --name"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn id(text: &str) -> ZenohId {
        text.parse().unwrap()
    }

    fn put(daemons: &Daemons, name: &str, zid: &str) {
        daemons.token(&keys::daemon(name, zid), SampleKind::Put);
    }

    fn delete(daemons: &Daemons, name: &str, zid: &str) {
        daemons.token(&keys::daemon(name, zid), SampleKind::Delete);
    }

    #[test]
    fn a_client_stays_with_its_daemon_and_continues_with_the_one_that_comes_after() {
        let daemons = Daemons::default();
        assert_eq!(daemons.choose("lab"), Ok(None));
        put(&daemons, "lab", "a1");
        assert_eq!(daemons.choose("lab"), Ok(Some(id("a1"))));
        // Another session with the same name changes nothing while the daemon's token exists.
        put(&daemons, "lab", "1");
        assert_eq!(daemons.choose("lab"), Ok(Some(id("a1"))));
        delete(&daemons, "lab", "1");
        delete(&daemons, "lab", "a1");
        assert_eq!(daemons.choose("lab"), Ok(Some(id("a1"))), "until another comes");
        put(&daemons, "lab", "b2");
        assert_eq!(daemons.choose("lab"), Ok(Some(id("b2"))));
    }

    #[test]
    fn neither_of_two_sessions_with_the_name_is_taken() {
        let daemons = Daemons::default();
        put(&daemons, "lab", "a1");
        put(&daemons, "lab", "b2");
        let both = daemons.choose("lab").unwrap_err();
        assert_eq!(both.len(), 2);
        let sentence = several("lab", &both);
        assert!(sentence.contains("a1") && sentence.contains("b2"), "{sentence}");
        delete(&daemons, "lab", "b2");
        assert_eq!(daemons.choose("lab"), Ok(Some(id("a1"))));
    }

    #[test]
    fn endless_tokens_take_no_endless_memory() {
        let daemons = Daemons::default();
        (1..2 * KEPT).for_each(|number| put(&daemons, "lab", &format!("{number:x}")));
        (1..2 * KEPT).for_each(|number| put(&daemons, &format!("n{number}"), "1"));
        let kept: usize = daemons.lock().values().map(|named| named.here.len()).sum();
        assert_eq!(kept, KEPT);
        (1..2 * KEPT).for_each(|number| delete(&daemons, "lab", &format!("{number:x}")));
        assert!(daemons.lock().is_empty());
    }
}
