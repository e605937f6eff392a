//! Answers to requests with an id, so that a retry is not executed twice.
//!
//! An id belongs to one caller and one kind of request. A digest identifies the request: the same id with
//! another request is refused, and never gets the first one's answer. Answers are kept as their bytes on the
//! wire. They are bounded by number, bytes and time. At a bound, the caller with the most loses one, so that
//! many requests of one caller leave the answers of the others.

use std::cmp::Reverse;
use std::collections::{BTreeMap, HashMap};
use std::future::Future;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use simd_model::robot::Sha256;
use tokio::sync::watch;
use tokio::time::Instant;
use tracing::Instrument as _;

use super::{CallError, Peer, Scope, SimHandle};
use crate::info::DaemonLimits;

/// Memory of an answer beside its bytes and its id, bytes.
const ENTRY: usize = 512;
/// Maximum length of an id, bytes.
pub(crate) const MAX_ID: usize = 256;

/// A request that may arrive again.
#[derive(Clone, Debug)]
pub struct IdentifiedRequest {
    /// Scope of the id.
    pub scope: Scope,
    /// Kind of request, as the schema names it.
    pub kind: &'static str,
    /// Id from the caller; not empty.
    pub id: String,
    /// Digest of the whole request.
    pub digest: Sha256,
    /// Connection of the caller, if no other caller can claim to have it.
    pub peer: Option<Peer>,
    /// Whether the answer is repeated only over the connection of the first request, regardless of the
    /// caller's name.
    pub is_secret: bool,
}

/// Result of the work, as bytes that only the caller of [`SimHandle::once`] reads.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Answer or refusal.
    pub bytes: Result<Bytes, Bytes>,
    /// Whether it is a refusal that a retry may not get (a full mailbox, a shutdown, a fault), and is not
    /// remembered.
    pub is_transient: bool,
}

/// Receives `None` until the work is done.
type OutcomeReceiver = watch::Receiver<Option<Outcome>>;

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Key {
    scope: Scope,
    kind: &'static str,
    id: String,
}

/// Answers to the last requests.
#[derive(Clone, Debug)]
pub(super) struct AnswerCache {
    /// Locked for a look or a change of the map, never across the work.
    entries: Arc<Mutex<Entries>>,
}

#[derive(Debug)]
struct Entries {
    /// Maximum number of remembered requests, including those in progress. One caller may have half of them
    /// in progress: the rest is for others.
    limit: usize,
    /// Maximum bytes of all remembered answers, including overhead.
    max_weight: usize,
    /// Time for which an answer is remembered.
    kept_for: Duration,
    by_key: HashMap<Arc<Key>, Entry>,
    /// Shares of callers with entries.
    shares: HashMap<Scope, Share>,
    /// Number of the last answer.
    answers: u64,
    /// Bytes of all entries.
    weight: usize,
}

#[derive(Debug)]
struct Entry {
    request: IdentifiedRequest,
    outcome: OutcomeReceiver,
    /// `None` while the work is in progress.
    answered: Option<Answered>,
    /// Size, bytes.
    weight: usize,
}

#[derive(Clone, Copy, Debug)]
struct Answered {
    number: u64,
    at: Instant,
}

/// Share of one caller.
#[derive(Debug, Default)]
struct Share {
    /// Number of requests in progress.
    under_way: usize,
    /// Answered requests by the number of the answer, oldest first.
    answered: BTreeMap<u64, Arc<Key>>,
    /// Size, bytes.
    weight: usize,
}

impl Share {
    fn entries(&self) -> usize {
        self.under_way + self.answered.len()
    }
}

impl AnswerCache {
    pub(super) fn new(limits: &DaemonLimits) -> Self {
        let (by_key, shares, answers, weight) = Default::default();
        let (limit, max_weight, kept_for) = (limits.answers, limits.answer_bytes, limits.answer_time);
        let entries = Entries { limit, max_weight, kept_for, by_key, shares, answers, weight };
        Self { entries: Arc::new(Mutex::new(entries)) }
    }

    /// Executes the work, or returns the earlier answer to the same request. Work runs to its end and is
    /// remembered even if its caller disconnects: the retry needs that answer. If `work` is an error, the
    /// caller may not have it done. Then nothing is executed or remembered: another caller may send the same
    /// request and be allowed to.
    ///
    /// # Errors
    /// Returns an error if the id is too long, was used for another request, or its answer belongs to another
    /// connection. Also if the work is not allowed, or too many requests are in progress.
    pub(super) async fn once<W>(
        &self,
        request: IdentifiedRequest,
        work: Result<W, CallError>,
    ) -> Result<Outcome, CallError>
    where
        W: Future<Output = Outcome> + Send + 'static,
    {
        if request.id.len() > MAX_ID {
            return Err(CallError::InvalidValue {
                element: "request_id".into(),
                value: format!("{} bytes long", request.id.len()),
                expected: format!("it must have at most {MAX_ID} bytes"),
            });
        }
        let id = request.id.clone();
        let mut receiver = self.find_or_begin(request, work)?;
        let outcome = match receiver.wait_for(Option::is_some).await {
            Ok(outcome) => outcome.clone(),
            Err(_gone) => None,
        };
        outcome.ok_or_else(|| CallError::Internal {
            message: format!("the request {id:?} failed without an answer"),
        })
    }

    /// Returns the receiver of the answer; starts the work if the request is new.
    fn find_or_begin<W>(
        &self,
        request: IdentifiedRequest,
        work: Result<W, CallError>,
    ) -> Result<OutcomeReceiver, CallError>
    where
        W: Future<Output = Outcome> + Send + 'static,
    {
        let key = Arc::new(Key { scope: request.scope.clone(), kind: request.kind, id: request.id.clone() });
        let mut entries = self.lock();
        if let Some(entry) = entries.by_key.get(&key) {
            entry.check(&request)?;
            return Ok(entry.outcome.clone());
        }
        let work = work?;
        let (sender, receiver) = watch::channel(None);
        entries.begin(&key, request, receiver.clone())?;
        drop(entries);

        let unanswered = Unanswered { cache: self.clone(), key };
        let task = async move {
            // In this order, so that if the work panics its request is forgotten before a caller notices.
            let (sender, unanswered) = (sender, unanswered);
            let outcome = work.await;
            if outcome.is_transient {
                drop(unanswered);
            } else {
                unanswered.answered(&outcome);
            }
            sender.send_replace(Some(outcome));
        };
        tokio::spawn(task.in_current_span());
        Ok(receiver)
    }

    /// Forgets answers that are too old. Work in progress is kept.
    pub(super) fn tidy(&self, now: Instant) {
        let mut entries = self.lock();
        let kept_for = entries.kept_for;
        let is_old = |(key, entry): (&Arc<Key>, &Entry)| {
            let answered = entry.answered?;
            (now >= answered.at + kept_for).then(|| key.clone())
        };
        let old: Vec<_> = entries.by_key.iter().filter_map(is_old).collect();
        for key in old {
            entries.forget(&key);
        }
    }

    /// Returns the bytes of all remembered answers.
    #[cfg(any(test, feature = "testing"))]
    pub(super) fn weight(&self) -> usize {
        self.lock().weight
    }

    fn lock(&self) -> MutexGuard<'_, Entries> {
        self.entries.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Entry {
    /// Checks that the answer belongs to `request`.
    fn check(&self, request: &IdentifiedRequest) -> Result<(), CallError> {
        let reused =
            |how: &str| Err(CallError::RequestIdReused { id: request.id.clone(), how: how.to_owned() });
        if self.request.digest != request.digest {
            return reused("was used by another request; send a new id with each new request");
        }
        let is_same_peer = self.request.peer.is_some() && self.request.peer == request.peer;
        if self.request.is_secret && !is_same_peer {
            return reused(
                "was answered with a secret, which is given again only over the connection that asked for it first",
            );
        }
        Ok(())
    }
}

impl Entries {
    /// Makes an entry for new work, and room for it.
    fn begin(
        &mut self,
        key: &Arc<Key>,
        request: IdentifiedRequest,
        outcome: OutcomeReceiver,
    ) -> Result<(), CallError> {
        let under_way = self.shares.get(&key.scope).map_or(0, |share| share.under_way);
        let most = (self.limit / 2).max(1);
        let beyond = |whose: &str, value: usize, limit: usize| {
            let what = format!("the number of requests with an id in progress, {whose},");
            Err(CallError::LimitExceeded { what, value: value as u64 + 1, limit: limit as u64 })
        };
        if under_way >= most {
            return beyond("of one caller", under_way, most);
        }
        if self.by_key.len() >= self.limit && !self.evict(Share::entries, None) {
            let whose = "of all callers (send this one again when others have ended, or without an id)";
            return beyond(whose, self.by_key.len(), self.limit);
        }
        // The id is in the key and in the request.
        let weight = ENTRY + 2 * key.id.len();
        self.weight += weight;
        let share = self.shares.entry(key.scope.clone()).or_default();
        share.under_way += 1;
        share.weight += weight;
        self.by_key.insert(key.clone(), Entry { request, outcome, answered: None, weight });
        Ok(())
    }

    /// Stores the answer to a request in progress, and forgets others if all exceed the limit of memory.
    fn answered(&mut self, key: &Arc<Key>, bytes: usize) {
        let (Some(entry), Some(share)) = (self.by_key.get_mut(key), self.shares.get_mut(&key.scope)) else {
            return;
        };
        self.answers += 1;
        let number = self.answers;
        entry.answered = Some(Answered { number, at: Instant::now() });
        entry.weight += bytes;
        share.under_way -= 1;
        share.answered.insert(number, key.clone());
        share.weight += bytes;
        self.weight += bytes;
        while self.weight > self.max_weight && self.evict(|share| share.weight, Some(number)) {}
    }

    /// Forgets the oldest answer of the caller with the most; in a tie, the older answer. Returns whether
    /// there was one.
    fn evict(&mut self, size: impl Fn(&Share) -> usize, except: Option<u64>) -> bool {
        let oldest = |share: &Share| {
            let (number, key) = share.answered.iter().find(|(number, _key)| Some(**number) != except)?;
            Some((size(share), Reverse(*number), key.clone()))
        };
        let of_largest =
            self.shares.values().filter_map(oldest).max_by_key(|(size, number, _)| (*size, *number));
        let Some((_size, _number, key)) = of_largest else { return false };
        self.forget(&key);
        true
    }

    fn forget(&mut self, key: &Key) {
        let Some(entry) = self.by_key.remove(key) else { return };
        self.weight -= entry.weight;
        let Some(share) = self.shares.get_mut(&key.scope) else { return };
        share.weight -= entry.weight;
        match entry.answered {
            Some(answered) => drop(share.answered.remove(&answered.number)),
            None => share.under_way -= 1,
        }
        if share.entries() == 0 {
            self.shares.remove(&key.scope);
        }
    }
}

/// Work in progress. If it has no result to remember or panics, its request is forgotten.
struct Unanswered {
    cache: AnswerCache,
    key: Arc<Key>,
}

impl Unanswered {
    fn answered(self, outcome: &Outcome) {
        let (Ok(bytes) | Err(bytes)) = &outcome.bytes;
        self.cache.lock().answered(&self.key, bytes.len());
    }
}

impl Drop for Unanswered {
    fn drop(&mut self) {
        let mut entries = self.cache.lock();
        if entries.by_key.get(&self.key).is_some_and(|entry| entry.answered.is_none()) {
            entries.forget(&self.key);
        }
    }
}

impl SimHandle {
    /// Executes the work of a request, or returns the earlier answer to the same request, even if this caller
    /// may not have the work done.
    ///
    /// # Errors
    /// Returns an error if its id was used for another request, too many are in progress, or the work is not
    /// allowed. Errors of the work itself are in the outcome.
    pub async fn once<W>(
        &self,
        request: IdentifiedRequest,
        work: Result<W, CallError>,
    ) -> Result<Outcome, CallError>
    where
        W: Future<Output = Outcome> + Send + 'static,
    {
        self.inner.answers.once(request, work).await
    }

    /// Bytes of all remembered answers.
    #[cfg(any(test, feature = "testing"))]
    pub fn remembered(&self) -> usize {
        self.inner.answers.weight()
    }
}

#[cfg(test)]
mod tests;
