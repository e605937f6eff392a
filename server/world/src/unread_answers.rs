//! Bytes of answers that clients have yet to read: bounded in total, for each client and for each connection,
//! on every transport.
//!
//! Bytes are counted from before an answer is made until the transport has sent or dropped it. A client may
//! have as much as is left for all others. So a client that reads nothing fills a half, and the next client
//! finds as much room as each one before it.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bytes::Bytes;

use crate::account::Account;
use crate::call_error::CallError;

/// Bytes that an open call counts for, beside its answer: the transport's own memory of it.
pub const CALL: u64 = 16 << 10;
/// Size of a method's last answer from which its answers are made where they delay no other call, bytes.
pub const LARGE: u64 = 256 << 10;
/// Divisor of the limit for one connection.
const OF_CONNECTION: u64 = 3;

/// Bytes that clients have yet to read.
#[derive(Debug)]
pub struct UnreadAnswers {
    limit: u64,
    /// Locked for a look or a change.
    held: Mutex<Held>,
    /// Sizes of the last answers of each method, by its path. Locked for a look or a change.
    sizes: Mutex<HashMap<&'static str, u64>>,
}

#[derive(Debug, Default)]
struct Held {
    all: u64,
    clients: HashMap<Account, u64>,
    connections: HashMap<u64, u64>,
}

/// Client and connection that bytes count for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reader {
    /// Client.
    pub account: Account,
    /// Number of its connection, if any.
    pub connection: Option<u64>,
}

/// Bytes that a client has yet to read, until this is dropped.
#[derive(Debug)]
pub struct Unread {
    answers: Arc<UnreadAnswers>,
    reader: Reader,
    bytes: u64,
}

impl UnreadAnswers {
    /// Makes an account with at most `limit` bytes in total.
    pub fn new(limit: u64) -> Arc<Self> {
        Arc::new(Self { limit, held: Mutex::default(), sizes: Mutex::default() })
    }

    /// Counts bytes for a client before they are made.
    ///
    /// # Errors
    /// Returns an error if the client would have more unread bytes than permitted.
    pub fn hold(self: &Arc<Self>, reader: &Reader, bytes: u64) -> Result<Unread, CallError> {
        let mut unread = Unread { answers: Arc::clone(self), reader: reader.clone(), bytes: 0 };
        unread.grow(bytes)?;
        Ok(unread)
    }

    /// Returns all counted bytes.
    pub fn bytes(&self) -> u64 {
        self.lock().all
    }

    /// Returns the expected size of a method's answer, from its last ones.
    pub fn expected(&self, path: &str) -> u64 {
        self.sizes().get(path).copied().unwrap_or_default()
    }

    /// Notes the size of a method's answer. One small answer among large ones changes little.
    pub fn made(&self, path: &'static str, bytes: u64) {
        let mut sizes = self.sizes();
        let expected = sizes.entry(path).or_default();
        *expected = bytes.max(*expected / 2);
    }

    fn lock(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn sizes(&self) -> MutexGuard<'_, HashMap<&'static str, u64>> {
        self.sizes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Held {
    /// Adds bytes of a client. Otherwise, returns whose limit it would exceed, with the value and the limit.
    fn add(&mut self, reader: &Reader, bytes: u64, limit: u64) -> Result<(), (String, u64, u64)> {
        let of_client = self.clients.get(&reader.account).copied().unwrap_or_default() + bytes;
        let free = limit.saturating_sub(self.all);
        if of_client > free {
            return Err((reader.account.to_string(), of_client, free));
        }
        if let Some(number) = reader.connection {
            let of_connection = self.connections.get(&number).copied().unwrap_or_default() + bytes;
            let most = limit / OF_CONNECTION;
            if of_connection > most {
                return Err((format!("connection {number}"), of_connection, most));
            }
            self.connections.insert(number, of_connection);
        }
        self.clients.insert(reader.account.clone(), of_client);
        self.all += bytes;
        Ok(())
    }

    fn remove(&mut self, reader: &Reader, bytes: u64) {
        self.all = self.all.saturating_sub(bytes);
        take(&mut self.clients, &reader.account, bytes);
        if let Some(number) = reader.connection {
            take(&mut self.connections, &number, bytes);
        }
    }
}

/// Takes bytes from an entry, and removes it with the last ones.
fn take<K: Eq + Hash>(entries: &mut HashMap<K, u64>, key: &K, bytes: u64) {
    let Some(held) = entries.get_mut(key) else { return };
    *held = held.saturating_sub(bytes);
    if *held == 0 {
        entries.remove(key);
    }
}

impl Unread {
    /// Counts more bytes.
    ///
    /// # Errors
    /// Returns an error if the client would have more unread bytes than permitted. Then the count is
    /// unchanged.
    pub fn grow(&mut self, bytes: u64) -> Result<(), CallError> {
        // The daemon's own process reads its answers.
        if self.reader.account != Account::Process {
            let limit = self.answers.limit;
            self.answers.lock().add(&self.reader, bytes, limit).map_err(|(whose, value, limit)| {
                let what = format!("bytes of answers that {whose} has not read (service.unread_bytes)");
                CallError::LimitExceeded { what, value, limit }
            })?;
        }
        self.bytes += bytes;
        Ok(())
    }

    /// Counts exactly these bytes.
    ///
    /// # Errors
    /// As [`Self::grow`].
    pub fn set(&mut self, bytes: u64) -> Result<(), CallError> {
        match bytes.checked_sub(self.bytes) {
            Some(more) => self.grow(more),
            None => {
                self.release(self.bytes - bytes);
                Ok(())
            }
        }
    }

    /// Counts other bytes of the same client.
    ///
    /// # Errors
    /// As [`Self::grow`].
    pub fn another(&self, bytes: u64) -> Result<Self, CallError> {
        self.answers.hold(&self.reader, bytes)
    }

    fn release(&mut self, bytes: u64) {
        if self.reader.account != Account::Process {
            self.answers.lock().remove(&self.reader, bytes);
        }
        self.bytes -= bytes;
    }
}

impl Drop for Unread {
    fn drop(&mut self) {
        self.release(self.bytes);
    }
}

/// Bytes that are counted until their last holder drops them.
struct Counted {
    bytes: Bytes,
    _unread: Arc<Unread>,
}

impl AsRef<[u8]> for Counted {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

/// Returns the same bytes, which count as long as a holder has them or a part of them.
pub fn counted(bytes: Bytes, unread: Arc<Unread>) -> Bytes {
    Bytes::from_owner(Counted { bytes, _unread: unread })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reader(session: &str) -> Reader {
        Reader { account: Account::Session(session.into()), connection: None }
    }

    /// Takes parts of 10 bytes for a client until it is refused.
    fn fill(answers: &Arc<UnreadAnswers>, reader: &Reader) -> Vec<Unread> {
        std::iter::from_fn(|| answers.hold(reader, 10).ok()).collect()
    }

    #[test]
    fn each_client_that_reads_nothing_leaves_room_for_the_next() {
        let answers = UnreadAnswers::new(1200);
        let mut held = Vec::new();
        for (number, most) in [600, 300, 150].into_iter().enumerate() {
            let own = fill(&answers, &reader(&number.to_string()));
            assert_eq!(own.len() * 10, most, "client {number}");
            held.extend(own);
        }
        assert_eq!(answers.bytes(), 1050);
        let refused = answers.hold(&reader("0"), 10).unwrap_err();
        assert_eq!(
            refused.to_string(),
            "bytes of answers that session 0 has not read (service.unread_bytes) would be 610, and the limit is 150"
        );
        drop(held);
        assert_eq!(answers.bytes(), 0);
        assert!(answers.lock().clients.is_empty(), "clients that hold nothing are forgotten");
    }

    #[test]
    fn a_connection_has_a_third_and_its_client_more() {
        let answers = UnreadAnswers::new(900);
        let of = |number| Reader { account: Account::Token("arm".into()), connection: Some(number) };
        let first = fill(&answers, &of(1));
        assert_eq!(first.len(), 30);
        let second = fill(&answers, &of(2));
        assert_eq!(second.len(), 15, "both are of one client, which has a half");
        drop((first, second));
        assert!(answers.lock().connections.is_empty());
    }

    #[test]
    fn a_refused_count_is_as_before_and_one_that_shrinks_gives_back() {
        let answers = UnreadAnswers::new(100);
        let mut unread = answers.hold(&reader("a"), 20).unwrap();
        unread.grow(1000).unwrap_err();
        assert_eq!(answers.bytes(), 20);
        unread.set(5).unwrap();
        assert_eq!(answers.bytes(), 5);
        unread.set(40).unwrap();
        assert_eq!(answers.bytes(), 40);
    }

    #[test]
    fn bytes_count_until_their_last_part_is_dropped() {
        let answers = UnreadAnswers::new(100);
        let unread = Arc::new(answers.hold(&reader("a"), 40).unwrap());
        let mut whole = counted(Bytes::from_static(b"answer"), unread);
        let part = whole.split_to(2);
        drop(whole);
        assert_eq!((answers.bytes(), part.as_ref()), (40, &b"an"[..]));
        drop(part);
        assert_eq!(answers.bytes(), 0);
    }

    #[test]
    fn the_daemons_own_process_has_no_limit() {
        let answers = UnreadAnswers::new(10);
        let own = Reader { account: Account::Process, connection: None };
        let _held = answers.hold(&own, 1000).unwrap();
        assert_eq!(answers.bytes(), 0);
    }

    #[test]
    fn the_next_answer_of_a_method_is_expected_to_be_as_large() {
        let answers = UnreadAnswers::new(10);
        answers.made("/a", 1000);
        answers.made("/a", 10);
        assert_eq!((answers.expected("/a"), answers.expected("/b")), (500, 0));
    }
}
