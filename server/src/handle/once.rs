//! Answers to requests that carry an id, so that a retry is not done twice.

use std::any::Any;
use std::collections::{HashMap, VecDeque};
use std::future::Future;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::watch;

use super::CallError;

/// How many ids are remembered.
const KEPT: usize = 1024;
/// Bytes of answers that are remembered, of those that are weighed.
const MAX_WEIGHT: usize = 64 << 20;
/// Bytes of an id.
const MAX_ID: usize = 256;

type Answer = Result<Arc<dyn Any + Send + Sync>, CallError>;
/// `None` until the work is done.
type Waiting = watch::Receiver<Option<Answer>>;

/// The answers to the last requests.
#[derive(Clone, Debug, Default)]
pub(super) struct Answers {
    /// Held for a look or a change of the map, never across the work.
    kept: Arc<Mutex<Kept>>,
}

#[derive(Debug, Default)]
struct Kept {
    by_id: HashMap<String, Entry>,
    /// Ids with the number of their entry, oldest first. An entry that was
    /// forgotten and made again has another number.
    order: VecDeque<(String, u64)>,
    entries: u64,
    /// Of all entries.
    weight: usize,
}

#[derive(Debug)]
struct Entry {
    number: u64,
    answer: Waiting,
    /// Bytes; 0 while there is no answer.
    weight: usize,
}

impl Answers {
    /// Does the work, or gives the answer that the same id got before. Work with
    /// an id runs to its end and is remembered even if its caller goes away: the
    /// retry comes for that answer. An error that passes by itself (a full mailbox, a
    /// shutdown, a fault) is no answer to remember. `weigh` gives an answer's bytes, where
    /// they grow with the world: the oldest answers go where all weigh too much.
    pub(super) async fn once<T, W>(&self, id: &str, weigh: fn(&T) -> usize, work: W) -> Result<T, CallError>
    where
        T: Clone + Send + Sync + 'static,
        W: Future<Output = Result<T, CallError>> + Send + 'static,
    {
        if id.is_empty() {
            return work.await;
        }
        if id.len() > MAX_ID {
            return Err(CallError::InvalidValue {
                element: "request_id".into(),
                value: format!("{} bytes long", id.len()),
                expected: format!("it must have at most {MAX_ID} bytes"),
            });
        }
        let mut waiting = self.answer(id, weigh, work);
        let answer = match waiting.wait_for(Option::is_some).await {
            Ok(answer) => answer.clone(),
            Err(_gone) => None,
        };
        let Some(answer) = answer else {
            return Err(CallError::Internal {
                message: format!("the request {id:?} failed without an answer"),
            });
        };
        match answer?.downcast_ref::<T>() {
            Some(answer) => Ok(answer.clone()),
            None => Err(CallError::InvalidValue {
                element: "request_id".into(),
                value: format!("{id:?}"),
                expected: "it must not be that of another kind of request".into(),
            }),
        }
    }

    /// Where the answer is or will be; starts the work where there is neither.
    fn answer<T, W>(&self, id: &str, weigh: fn(&T) -> usize, work: W) -> Waiting
    where
        T: Clone + Send + Sync + 'static,
        W: Future<Output = Result<T, CallError>> + Send + 'static,
    {
        let mut kept = self.lock();
        if let Some(entry) = kept.by_id.get(id) {
            return entry.answer.clone();
        }
        let (sender, answer) = watch::channel(None);
        kept.entries += 1;
        let number = kept.entries;
        kept.by_id.insert(id.to_owned(), Entry { number, answer: answer.clone(), weight: 0 });
        kept.order.push_back((id.to_owned(), number));
        while kept.order.len() > KEPT {
            if let Some((oldest, number)) = kept.order.pop_front() {
                kept.forget(&oldest, number);
            }
        }
        drop(kept);

        let mut unanswered = Unanswered { answers: self.clone(), id: id.to_owned(), number, armed: true };
        tokio::spawn(async move {
            let answer = work.await;
            let weight = answer.as_ref().map_or(0, weigh);
            let answer = answer.map(|answer| Arc::new(answer) as Arc<dyn Any + Send + Sync>);
            unanswered.armed = answer.as_ref().is_err_and(CallError::is_passing);
            unanswered.answers.lock().weigh(&unanswered.id, number, weight);
            drop(unanswered);
            sender.send_replace(Some(answer));
        });
        answer
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kept {
    fn forget(&mut self, id: &str, number: u64) {
        if self.by_id.get(id).is_some_and(|entry| entry.number == number)
            && let Some(entry) = self.by_id.remove(id)
        {
            self.weight -= entry.weight;
        }
    }

    /// Makes room for an answer by forgetting older ones.
    fn weigh(&mut self, id: &str, number: u64, weight: usize) {
        let Some(entry) = self.by_id.get_mut(id).filter(|entry| entry.number == number) else { return };
        entry.weight = weight;
        self.weight += weight;
        while self.weight > MAX_WEIGHT && self.order.front().is_some_and(|(_, oldest)| *oldest != number) {
            if let Some((oldest, number)) = self.order.pop_front() {
                self.forget(&oldest, number);
            }
        }
    }
}

/// Forgets an id whose work gave nothing to remember, also where it panicked.
struct Unanswered {
    answers: Answers,
    id: String,
    number: u64,
    armed: bool,
}

impl Drop for Unanswered {
    fn drop(&mut self) {
        if self.armed {
            self.answers.lock().forget(&self.id, self.number);
        }
    }
}

#[cfg(test)]
mod tests;
