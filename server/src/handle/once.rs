//! Answers to requests that carry an id, so that a retry is not done twice.
//!
//! An id is that of one caller and one kind of request. What was asked for is known by a digest: the same id with
//! another request is refused, and never answered with what the first one got. Answers are kept as the bytes that
//! they have on the wire, and are bounded by number, by bytes and by time.

use std::collections::{HashMap, VecDeque};
use std::future::Future;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use simd_model::robot::Sha256;
use tokio::sync::watch;
use tokio::time::Instant;

use super::{CallError, Peer, Scope};

/// How many answers are remembered.
const KEPT: usize = 1024;
/// Bytes of all answers that are remembered, with what belongs to them.
const MAX_WEIGHT: usize = 64 << 20;
/// What an answer takes beside its bytes and its id.
const ENTRY: usize = 512;
/// How long an answer is remembered.
const KEPT_FOR: Duration = Duration::from_secs(3600);
/// Bytes of an id.
pub(crate) const MAX_ID: usize = 256;

/// A request that may come again.
#[derive(Clone, Debug)]
pub(crate) struct Asked {
    /// Whose id it is.
    pub(crate) scope: Scope,
    /// The kind of request, as the schema calls it.
    pub(crate) kind: &'static str,
    /// As the caller gave it; not empty.
    pub(crate) id: String,
    /// Of all that is asked for.
    pub(crate) digest: Sha256,
    /// By what way it came, where nobody else can say the same.
    pub(crate) peer: Option<Peer>,
    /// The answer is given again by the way of the first request alone, whatever name the caller gives.
    pub(crate) is_secret: bool,
}

/// What work gave, as bytes that only the caller of [`SimHandle::once`](super::SimHandle::once) reads.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    /// An answer, or a refusal.
    pub(crate) bytes: Result<Bytes, Bytes>,
    /// It passes by itself (a full mailbox, a shutdown, a fault): nothing to remember.
    pub(crate) is_passing: bool,
}

/// `None` until the work is done.
type Waiting = watch::Receiver<Option<Outcome>>;

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Key {
    scope: Scope,
    kind: &'static str,
    id: String,
}

/// The answers to the last requests.
#[derive(Clone, Debug, Default)]
pub(super) struct Answers {
    /// Held for a look or a change of the map, never across the work.
    kept: Arc<Mutex<Kept>>,
}

#[derive(Debug, Default)]
struct Kept {
    by_key: HashMap<Arc<Key>, Entry>,
    /// Keys with the number of their entry, oldest first. An entry that was
    /// forgotten and made again has another number.
    order: VecDeque<(Arc<Key>, u64)>,
    entries: u64,
    /// Of all entries.
    weight: usize,
}

#[derive(Debug)]
struct Entry {
    number: u64,
    first: Asked,
    since: Instant,
    answer: Waiting,
    /// Bytes.
    weight: usize,
}

impl Answers {
    /// Does the work, or gives the answer that the same request got before. Work runs to its end and is remembered
    /// even if its caller goes away: the retry comes for that answer. The oldest answers go where all take too much
    /// memory.
    ///
    /// # Errors
    /// Where the id is too long, was that of another request, or its answer is for another connection.
    pub(super) async fn once<W>(&self, asked: Asked, work: W) -> Result<Outcome, CallError>
    where
        W: Future<Output = Outcome> + Send + 'static,
    {
        if asked.id.len() > MAX_ID {
            return Err(CallError::InvalidValue {
                element: "request_id".into(),
                value: format!("{} bytes long", asked.id.len()),
                expected: format!("it must have at most {MAX_ID} bytes"),
            });
        }
        let id = asked.id.clone();
        let mut waiting = self.answer(asked, work)?;
        let answer = match waiting.wait_for(Option::is_some).await {
            Ok(answer) => answer.clone(),
            Err(_gone) => None,
        };
        answer.ok_or_else(|| CallError::Internal {
            message: format!("the request {id:?} failed without an answer"),
        })
    }

    /// Where the answer is or will be; starts the work where there is neither.
    fn answer<W>(&self, asked: Asked, work: W) -> Result<Waiting, CallError>
    where
        W: Future<Output = Outcome> + Send + 'static,
    {
        let key = Arc::new(Key { scope: asked.scope.clone(), kind: asked.kind, id: asked.id.clone() });
        let mut kept = self.lock();
        if let Some(entry) = kept.by_key.get(&key) {
            entry.check(&asked)?;
            return Ok(entry.answer.clone());
        }
        let (sender, answer) = watch::channel(None);
        let number = kept.begin(&key, asked, answer.clone());
        drop(kept);

        let mut unanswered = Unanswered { answers: self.clone(), key, number, armed: true };
        tokio::spawn(async move {
            let outcome = work.await;
            unanswered.armed = outcome.is_passing;
            let (Ok(bytes) | Err(bytes)) = &outcome.bytes;
            unanswered.answers.lock().weigh(&unanswered.key, number, bytes.len());
            drop(unanswered);
            sender.send_replace(Some(outcome));
        });
        Ok(answer)
    }

    /// Forgets what nobody comes back for any more.
    pub(super) fn tidy(&self, now: Instant) {
        let mut kept = self.lock();
        while let Some((oldest, number)) = kept.order.front().cloned() {
            let entry = kept.by_key.get(&oldest).filter(|entry| entry.number == number);
            // Work that is not done is waited for.
            if entry.is_some_and(|entry| entry.answer.borrow().is_none() || now < entry.since + KEPT_FOR) {
                return;
            }
            kept.order.pop_front();
            kept.forget(&oldest, number);
        }
    }

    /// Bytes of all that is remembered.
    #[cfg(test)]
    pub(super) fn weight(&self) -> usize {
        self.lock().weight
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Entry {
    /// Whether the answer is that to `asked`.
    fn check(&self, asked: &Asked) -> Result<(), CallError> {
        let reused =
            |how: &str| Err(CallError::RequestIdReused { id: asked.id.clone(), how: how.to_owned() });
        if self.first.digest != asked.digest {
            return reused("is that of another request; send a new id with each new request");
        }
        if self.first.is_secret && (self.first.peer.is_none() || self.first.peer != asked.peer) {
            return reused(
                "was answered with a secret, which is given again only over the connection that asked for it first",
            );
        }
        Ok(())
    }
}

impl Kept {
    fn begin(&mut self, key: &Arc<Key>, first: Asked, answer: Waiting) -> u64 {
        self.entries += 1;
        let number = self.entries;
        // The id is in the key and in the request.
        let weight = ENTRY + 2 * key.id.len();
        self.weight += weight;
        let entry = Entry { number, first, since: Instant::now(), answer, weight };
        self.by_key.insert(key.clone(), entry);
        self.order.push_back((key.clone(), number));
        while self.order.len() > KEPT {
            self.forget_oldest();
        }
        number
    }

    fn forget_oldest(&mut self) {
        if let Some((oldest, number)) = self.order.pop_front() {
            self.forget(&oldest, number);
        }
    }

    fn forget(&mut self, key: &Key, number: u64) {
        if self.by_key.get(key).is_some_and(|entry| entry.number == number)
            && let Some(entry) = self.by_key.remove(key)
        {
            self.weight -= entry.weight;
        }
    }

    /// Makes room for an answer by forgetting older ones.
    fn weigh(&mut self, key: &Key, number: u64, bytes: usize) {
        let Some(entry) = self.by_key.get_mut(key).filter(|entry| entry.number == number) else { return };
        entry.weight += bytes;
        self.weight += bytes;
        while self.weight > MAX_WEIGHT && self.order.front().is_some_and(|(_, oldest)| *oldest != number) {
            self.forget_oldest();
        }
    }
}

/// Forgets an id whose work gave nothing to remember, also where it panicked.
struct Unanswered {
    answers: Answers,
    key: Arc<Key>,
    number: u64,
    armed: bool,
}

impl Drop for Unanswered {
    fn drop(&mut self) {
        if self.armed {
            self.answers.lock().forget(&self.key, self.number);
        }
    }
}

#[cfg(test)]
mod tests;
