//! Permits for work that few clients may do at a time. Waiting clients are served round robin, one call each,
//! so that one with many calls does not keep the others waiting. For long work, a client has at most one
//! permit, so that it cannot take all of them.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

use crate::account::Account;
use crate::call_error::CallError;

/// Permits, and the calls that wait for one.
#[derive(Debug)]
pub(crate) struct FairPermits {
    queue: Arc<Mutex<Queue>>,
    /// Name of the waiting calls, for refusals.
    what: &'static str,
    waiting: usize,
    waiting_of_one: usize,
}

#[derive(Debug)]
struct Queue {
    free: usize,
    /// Waiting clients in serving order, each with at least one call.
    clients: VecDeque<(Account, VecDeque<oneshot::Sender<Permit>>)>,
    /// Whether a client has at most one permit, and waits for a second one even if another is free.
    has_one_each: bool,
    /// Clients with a permit, if each has at most one.
    holders: Vec<Account>,
}

/// A permit for one piece of work, held until it is dropped.
#[derive(Debug)]
pub(crate) struct Permit {
    /// Queue that it returns to.
    queue: Option<Arc<Mutex<Queue>>>,
    /// Client that holds it.
    account: Account,
}

impl FairPermits {
    /// Makes `permits` permits, with at most `waiting` waiting calls, of which one client may have
    /// `waiting_of_one`.
    pub(crate) fn new(permits: usize, waiting: usize, waiting_of_one: usize, what: &'static str) -> Self {
        let queue =
            Queue { free: permits, clients: VecDeque::new(), has_one_each: false, holders: Vec::new() };
        Self { queue: Arc::new(Mutex::new(queue)), what, waiting, waiting_of_one }
    }

    /// Limits each client to one permit, even if others are free: a permit cannot be revoked, so later
    /// clients would wait for its work. The daemon's own process has no such limit.
    pub(crate) fn with_one_each(self) -> Self {
        lock(&self.queue).has_one_each = true;
        self
    }

    /// Returns a permit, once the client of this account is next in the round robin.
    ///
    /// # Errors
    /// Returns an error at once if too many calls wait already, of all clients or of this one.
    pub(crate) async fn acquire(&self, account: &Account) -> Result<Permit, CallError> {
        let receiver = {
            let mut queue = lock(&self.queue);
            if queue.free > 0 && queue.may_have_one(account) {
                queue.free -= 1;
                queue.hold(account);
                return Ok(Permit { queue: Some(Arc::clone(&self.queue)), account: account.clone() });
            }
            self.wait(&mut queue, account)?
        };
        receiver.await.map_err(|_closed| CallError::ShuttingDown)
    }

    fn wait(&self, queue: &mut Queue, account: &Account) -> Result<oneshot::Receiver<Permit>, CallError> {
        // Cancelled calls take no slot.
        for (_, calls) in &mut queue.clients {
            calls.retain(|call| !call.is_closed());
        }
        queue.clients.retain(|(_, calls)| !calls.is_empty());
        let waiting: usize = queue.clients.iter().map(|(_, calls)| calls.len()).sum();
        let own = queue.clients.iter().position(|(client, _)| client == account);
        let of_one = own.and_then(|index| queue.clients.get(index)).map_or(0, |(_, calls)| calls.len());
        let is_bounded = *account != Account::Process;
        let (value, limit, whose) = match is_bounded && of_one >= self.waiting_of_one {
            true => (of_one, self.waiting_of_one, " of one client"),
            false => (waiting, self.waiting, ""),
        };
        if value >= limit {
            let what = format!("the number of {}{whose}", self.what);
            return Err(CallError::LimitExceeded { what, value: value as u64 + 1, limit: limit as u64 });
        }
        let (sender, receiver) = oneshot::channel();
        match own.and_then(|index| queue.clients.get_mut(index)) {
            Some((_, calls)) => calls.push_back(sender),
            None => queue.clients.push_back((account.clone(), VecDeque::from([sender]))),
        }
        Ok(receiver)
    }
}

fn lock(queue: &Mutex<Queue>) -> MutexGuard<'_, Queue> {
    queue.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Queue {
    /// Returns whether a client may have a permit now.
    fn may_have_one(&self, client: &Account) -> bool {
        *client == Account::Process || !self.holders.contains(client)
    }

    /// Notes that a client gets a permit.
    fn hold(&mut self, client: &Account) {
        if self.has_one_each {
            self.holders.push(client.clone());
        }
    }

    /// Notes that a client returns a permit.
    fn give_back(&mut self, client: &Account) {
        if let Some(index) = self.holders.iter().position(|holder| holder == client) {
            self.holders.swap_remove(index);
        }
    }

    /// Takes the first call of the next client in the round robin that may have a permit, and notes that it
    /// holds one. The client then moves to the end.
    fn next(&mut self) -> Option<(Account, oneshot::Sender<Permit>)> {
        let index = self.clients.iter().position(|(client, _)| self.may_have_one(client))?;
        let (client, mut calls) = self.clients.remove(index)?;
        let call = calls.pop_front()?;
        if !calls.is_empty() {
            self.clients.push_back((client.clone(), calls));
        }
        self.hold(&client);
        Some((client, call))
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let Some(queue) = self.queue.take() else { return };
        let mut holder = self.account.clone();
        loop {
            let next = {
                let mut waiting = lock(&queue);
                waiting.give_back(&holder);
                let next = waiting.next();
                if next.is_none() {
                    waiting.free += 1;
                }
                next
            };
            let Some((account, call)) = next else { return };
            match call.send(Self { queue: Some(Arc::clone(&queue)), account }) {
                Ok(()) => return,
                // Its caller has disconnected: the permit goes to the next client.
                Err(mut unwanted) => {
                    unwanted.queue = None;
                    holder = unwanted.account.clone();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::future::Future;
    use std::pin::Pin;
    use std::task::{Context, Poll, Waker};

    use super::*;

    type Call = Pin<Box<dyn Future<Output = Result<Permit, CallError>>>>;

    fn permits(permits: usize, waiting: usize, of_one: usize) -> &'static FairPermits {
        Box::leak(Box::new(FairPermits::new(permits, waiting, of_one, "calls")))
    }

    fn call(permits: &'static FairPermits, client: &str) -> Call {
        let account = Account::Session(client.into());
        Box::pin(async move { permits.acquire(&account).await })
    }

    fn poll(call: &mut Call) -> Poll<Result<Permit, CallError>> {
        call.as_mut().poll(&mut Context::from_waker(Waker::noop()))
    }

    fn granted(call: &mut Call) -> Option<Permit> {
        match poll(call) {
            Poll::Ready(permit) => Some(permit.unwrap()),
            Poll::Pending => None,
        }
    }

    #[test]
    fn clients_are_served_round_robin_however_many_calls_one_has() {
        let permits = permits(1, 10, 10);
        let mut held = granted(&mut call(permits, "a"));
        let mut calls: Vec<(&str, Call)> =
            ["a", "a", "a", "b", "c", "b"].map(|client| (client, call(permits, client))).into();
        for (_, call) in &mut calls {
            assert!(granted(call).is_none());
        }
        let mut order = Vec::new();
        while !calls.is_empty() {
            drop(held.take());
            let index = calls.iter_mut().position(|(_, call)| {
                held = granted(call);
                held.is_some()
            });
            order.push(calls.remove(index.unwrap()).0);
        }
        assert_eq!(order, ["a", "b", "c", "a", "b", "a"]);
    }

    #[test]
    fn a_client_with_a_permit_waits_for_a_second_one_also_where_one_is_free() {
        let permits: &'static FairPermits =
            Box::leak(Box::new(FairPermits::new(2, 10, 10, "calls").with_one_each()));
        let first = granted(&mut call(permits, "a")).unwrap();
        let mut second = call(permits, "a");
        assert!(granted(&mut second).is_none(), "the other one is for other clients");
        let of_other = granted(&mut call(permits, "b")).unwrap();
        let mut third = call(permits, "c");
        assert!(granted(&mut third).is_none());
        drop(of_other);
        assert!(granted(&mut second).is_none(), "who is first in the order and has one is passed over");
        let third = granted(&mut third).unwrap();
        drop(first);
        let second = granted(&mut second).unwrap();
        drop((second, third));
        let both = ["a", "b"].map(|client| granted(&mut call(permits, client)));
        assert!(both.iter().all(Option::is_some), "all are free again");
    }

    #[test]
    fn a_client_whose_waiting_call_gave_up_can_have_a_permit_again() {
        let permits: &'static FairPermits =
            Box::leak(Box::new(FairPermits::new(1, 10, 10, "calls").with_one_each()));
        let held = granted(&mut call(permits, "a")).unwrap();
        let mut gone = call(permits, "b");
        assert!(granted(&mut gone).is_none());
        drop(gone);
        drop(held);
        assert!(granted(&mut call(permits, "b")).is_some());
    }

    #[test]
    fn one_client_has_a_part_of_the_places_and_all_have_all() {
        let permits = permits(1, 3, 2);
        let _held = granted(&mut call(permits, "a")).unwrap();
        let mut waiting = [call(permits, "a"), call(permits, "a")];
        waiting.iter_mut().for_each(|call| assert!(granted(call).is_none()));
        let refusal = |client| match poll(&mut call(permits, client)) {
            Poll::Ready(refused) => refused.unwrap_err().to_string(),
            Poll::Pending => panic!("{client} waits"),
        };
        assert!(refusal("a").contains("of one client would be 3, and the limit is 2"), "{}", refusal("a"));
        let mut last = call(permits, "b");
        assert!(granted(&mut last).is_none());
        assert!(
            refusal("c").contains("the number of calls would be 4, and the limit is 3"),
            "{}",
            refusal("c")
        );
        // A cancelled call takes no slot.
        drop(waiting);
        assert!(granted(&mut call(permits, "c")).is_none());
    }

    #[test]
    fn a_permit_whose_waiter_gave_up_is_free_again() {
        let permits = permits(1, 10, 10);
        let held = granted(&mut call(permits, "a")).unwrap();
        let mut gone = call(permits, "b");
        assert!(granted(&mut gone).is_none());
        drop(gone);
        drop(held);
        let held = granted(&mut call(permits, "c")).unwrap();
        let mut granted_late = call(permits, "d");
        assert!(granted(&mut granted_late).is_none());
        // It got its permit, but was never polled again.
        drop(held);
        drop(granted_late);
        assert!(granted(&mut call(permits, "e")).is_some());
    }
}
