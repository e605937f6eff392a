//! Uploaded files by their hash. Files that no robot uses are dropped after a while, or earlier if there is
//! no room: least recently used first.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::time::Duration;

use simd_model::robot::Sha256;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use crate::call_error::CallError;

/// Bytes that a file counts for beside its own, so that a million empty files are not free.
const ENTRY_BYTES: u64 = 1024;

/// Files by hash, up to a number of bytes.
#[derive(Debug)]
pub(super) struct Store {
    files: HashMap<Sha256, File>,
    /// Files that no robot uses, by their last use.
    idle: BTreeMap<u64, Sha256>,
    bytes: u64,
    limit: u64,
    /// Time after which an unused file is forgotten.
    unused: Duration,
    /// Number of uses so far.
    clock: u64,
    /// Received files whose hash is still to be checked; each token is cancelled after the check.
    checking: HashMap<Sha256, CancellationToken>,
}

#[derive(Debug)]
struct File {
    bytes: Arc<[u8]>,
    used: u64,
    /// Time of the last use.
    since: Instant,
    /// Number of robots that use it.
    pins: u32,
}

impl Store {
    /// Makes an empty store with a limit in bytes, which forgets files that are unused for this time.
    pub(super) fn new(limit: u64, unused: Duration) -> Self {
        let (files, idle, checking) = Default::default();
        Self { files, idle, bytes: 0, limit, unused, clock: 0, checking }
    }

    /// Returns the token of a file whose hash is being checked. Another upload of the same file must wait for
    /// it, and not get the answer that it is not in progress.
    pub(super) fn checking(&self, sha256: &Sha256) -> Option<CancellationToken> {
        self.checking.get(sha256).cloned()
    }

    /// Notes the begin of the check of a file's hash; [`Store::end_check`] must follow.
    pub(super) fn begin_check(&mut self, sha256: Sha256) {
        self.checking.insert(sha256, CancellationToken::new());
    }

    /// Notes the end of the check; the file is stored or not.
    pub(super) fn end_check(&mut self, sha256: &Sha256) {
        if let Some(done) = self.checking.remove(sha256) {
            done.cancel();
        }
    }

    /// Returns whether a file is stored, without counting as a use.
    pub(super) fn contains(&self, sha256: &Sha256) -> bool {
        self.files.contains_key(sha256)
    }

    /// Returns a file, and counts as a use.
    pub(super) fn get(&mut self, sha256: &Sha256) -> Option<Arc<[u8]>> {
        let file = self.files.get_mut(sha256)?;
        self.clock += 1;
        let before = std::mem::replace(&mut file.used, self.clock);
        file.since = Instant::now();
        if self.idle.remove(&before).is_some() {
            self.idle.insert(self.clock, *sha256);
        }
        Some(file.bytes.clone())
    }

    /// Stores a file under its hash.
    ///
    /// # Errors
    /// Returns an error if the files of robots leave too little room.
    pub(super) fn insert(&mut self, sha256: Sha256, bytes: Arc<[u8]>) -> Result<(), CallError> {
        if self.get(&sha256).is_some() {
            return Ok(());
        }
        let size = charge(&bytes);
        while self.bytes + size > self.limit {
            let Some((_, oldest)) = self.idle.pop_first() else {
                return Err(CallError::LimitExceeded {
                    what: "the size of all kept files, in bytes,".into(),
                    value: self.bytes + size,
                    limit: self.limit,
                });
            };
            if let Some(file) = self.files.remove(&oldest) {
                self.bytes -= charge(&file.bytes);
            }
        }
        self.clock += 1;
        self.bytes += size;
        self.idle.insert(self.clock, sha256);
        self.files.insert(sha256, File { bytes, used: self.clock, since: Instant::now(), pins: 0 });
        Ok(())
    }

    /// Keeps files while a robot uses them.
    pub(super) fn pin(&mut self, files: &[Sha256]) {
        for sha256 in files {
            if let Some(file) = self.files.get_mut(sha256) {
                file.pins += 1;
                self.idle.remove(&file.used);
            }
        }
    }

    /// Ends one [`Store::pin`].
    pub(super) fn unpin(&mut self, files: &[Sha256]) {
        for sha256 in files {
            if let Some(file) = self.files.get_mut(sha256) {
                file.pins = file.pins.saturating_sub(1);
                if file.pins == 0 {
                    // The robot used it until now.
                    self.clock += 1;
                    (file.used, file.since) = (self.clock, Instant::now());
                    self.idle.insert(self.clock, *sha256);
                }
            }
        }
    }

    /// Drops files that were unused for long.
    pub(super) fn forget_unused(&mut self, now: Instant) {
        while let Some(first) = self.idle.first_entry() {
            let file = self.files.get(first.get());
            if file.is_some_and(|file| now.saturating_duration_since(file.since) < self.unused) {
                return;
            }
            let sha256 = first.remove();
            if let Some(file) = self.files.remove(&sha256) {
                self.bytes -= charge(&file.bytes);
            }
        }
    }

    /// Returns the bytes of all files, with `ENTRY_BYTES` each.
    #[cfg(test)]
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }
}

fn charge(bytes: &[u8]) -> u64 {
    bytes.len() as u64 + ENTRY_BYTES
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNUSED: Duration = Duration::from_secs(600);

    fn file(n: u8) -> (Sha256, Arc<[u8]>) {
        let bytes = vec![n; 1000];
        (Sha256::of(&bytes), bytes.into())
    }

    /// Returns a store for three files of [`file`].
    fn store() -> Store {
        Store::new(3 * (1000 + ENTRY_BYTES), UNUSED)
    }

    fn put(store: &mut Store, n: u8) -> Sha256 {
        let (sha256, bytes) = file(n);
        store.insert(sha256, bytes).unwrap();
        sha256
    }

    #[test]
    fn the_longest_unused_file_makes_room() {
        let mut store = store();
        let [a, b, c] = [0, 1, 2].map(|n| put(&mut store, n));
        assert_eq!(store.get(&a).as_deref(), Some(&*file(0).1));
        let d = put(&mut store, 3);
        assert_eq!([a, b, c, d].map(|file| store.contains(&file)), [true, false, true, true]);
        put(&mut store, 2);
        put(&mut store, 4);
        assert_eq!([a, c, d].map(|file| store.contains(&file)), [false, true, true], "sent again is used");
    }

    #[test]
    fn used_files_stay() {
        let mut store = store();
        let used = [0, 1].map(|n| put(&mut store, n));
        store.pin(&used);
        store.pin(&used[..1]);
        for n in 2..10 {
            put(&mut store, n);
        }
        assert!(used.iter().all(|file| store.contains(file)));
        store.unpin(&used);
        for n in 2..10 {
            put(&mut store, n);
        }
        assert_eq!(used.map(|file| store.contains(&file)), [true, false], "the first is pinned once more");
    }

    #[tokio::test(start_paused = true)]
    async fn unused_files_are_dropped_after_a_while() {
        let mut store = store();
        let [used, asked, idle] = [0, 1, 2].map(|n| put(&mut store, n));
        store.pin(&[used]);
        tokio::time::advance(UNUSED / 2).await;
        assert!(store.get(&asked).is_some());
        tokio::time::advance(UNUSED / 2).await;
        store.forget_unused(Instant::now());
        assert_eq!([used, asked, idle].map(|file| store.contains(&file)), [true, true, false]);
        store.unpin(&[used]);
        tokio::time::advance(UNUSED / 2).await;
        store.forget_unused(Instant::now());
        assert_eq!([used, asked].map(|file| store.contains(&file)), [true, false], "it was in use until now");
        tokio::time::advance(UNUSED / 2).await;
        store.forget_unused(Instant::now());
        assert_eq!(store.bytes(), 0);
    }

    #[test]
    fn a_store_full_of_used_files_refuses_and_names_its_limit() {
        let mut store = store();
        let used = [0, 1, 2].map(|n| put(&mut store, n));
        store.pin(&used);
        let (sha256, bytes) = file(3);
        let refused = store.insert(sha256, bytes).unwrap_err().to_string();
        assert!(refused.ends_with("and the limit is 6072"), "{refused}");
        assert!(used.iter().all(|file| store.contains(file)));
    }
}
