//! Shares of each client: calls per second and streams, so that one client leaves room for others.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::time::Instant;

use super::{CallError, SimHandle};
use crate::account::Account;

/// Maximum number of remembered clients; beyond it, clients that have had their full share for the longest
/// time are forgotten.
const KEPT: usize = 4096;

/// Shares of clients.
#[derive(Debug)]
pub(super) struct Accounts {
    /// Locked for a look or a change.
    shares: Mutex<BTreeMap<Account, Share>>,
    calls_per_second: u32,
    streams: u32,
}

/// Share of one client.
#[derive(Clone, Copy, Debug)]
struct Share {
    /// Number of calls that it may make at once. It grows with time.
    calls: f64,
    /// Time for which `calls` holds.
    at: Instant,
    streams: u32,
}

/// A stream of a client, counted until this is dropped.
#[derive(Debug)]
pub struct ClientStream {
    accounts: Arc<Accounts>,
    account: Account,
}

impl Accounts {
    /// Limits calls per second, with as many in one burst, and streams. 0 means unlimited calls.
    pub(super) fn new(calls_per_second: u32, streams: u32) -> Self {
        Self { shares: Mutex::default(), calls_per_second, streams }
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Account, Share>> {
        self.shares.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts a call.
    fn call(&self, account: &Account, now: Instant) -> Result<(), CallError> {
        if self.calls_per_second == 0 || *account == Account::Process {
            return Ok(());
        }
        let rate = f64::from(self.calls_per_second);
        let mut shares = self.lock();
        let share = self.share(&mut shares, account, now);
        let earned = now.saturating_duration_since(share.at).as_secs_f64() * rate;
        (share.calls, share.at) = ((share.calls + earned).min(rate), now);
        if share.calls < 1.0 {
            return Err(CallError::LimitExceeded {
                what: format!("the number of calls a second by {account}"),
                value: u64::from(self.calls_per_second) + 1,
                limit: self.calls_per_second.into(),
            });
        }
        share.calls -= 1.0;
        Ok(())
    }

    fn stream(self: &Arc<Self>, account: &Account, now: Instant) -> Result<Option<ClientStream>, CallError> {
        if *account == Account::Process {
            return Ok(None);
        }
        let mut shares = self.lock();
        let share = self.share(&mut shares, account, now);
        if share.streams >= self.streams {
            return Err(CallError::LimitExceeded {
                what: format!("the number of streams of {account}"),
                value: u64::from(share.streams) + 1,
                limit: self.streams.into(),
            });
        }
        share.streams += 1;
        Ok(Some(ClientStream { accounts: Arc::clone(self), account: account.clone() }))
    }

    fn share<'s>(
        &self,
        shares: &'s mut BTreeMap<Account, Share>,
        account: &Account,
        now: Instant,
    ) -> &'s mut Share {
        if shares.len() >= KEPT && !shares.contains_key(account) {
            let idle = shares.iter().filter(|(_, share)| share.streams == 0);
            let oldest = idle.min_by_key(|(_, share)| share.at).map(|(account, _)| account.clone());
            if let Some(oldest) = oldest {
                shares.remove(&oldest);
            }
        }
        let whole = Share { calls: f64::from(self.calls_per_second), at: now, streams: 0 };
        shares.entry(account.clone()).or_insert(whole)
    }
}

impl Drop for ClientStream {
    fn drop(&mut self) {
        if let Some(share) = self.accounts.lock().get_mut(&self.account) {
            share.streams = share.streams.saturating_sub(1);
        }
    }
}

impl SimHandle {
    /// Refuses a call that takes memory.
    ///
    /// # Errors
    /// Returns an error if nearly all of the memory limit is allocated.
    pub fn check_memory(&self) -> Result<(), CallError> {
        let limit = self.info().limits.memory_limit;
        match crate::process::full_heap(limit) {
            Some(value) => Err(CallError::LimitExceeded {
                what: "the memory of the daemon in bytes, for calls that take more (seven eighths of service.memory_limit)".into(),
                value,
                limit: limit / 8 * 7,
            }),
            None => Ok(()),
        }
    }

    /// Counts a call of this handle's client.
    ///
    /// # Errors
    /// Returns an error if the client has used its share of this second.
    pub fn count_call(&self) -> Result<(), CallError> {
        self.inner.accounts.call(&self.call.account, Instant::now())
    }

    /// Refuses a value above the share of this handle's client.
    pub(super) fn check_share(&self, what: &str, value: usize, limit: usize) -> Result<(), CallError> {
        let account = &self.call.account;
        if *account == Account::Process || value <= limit {
            return Ok(());
        }
        let what = format!("{what} of {account}");
        Err(CallError::LimitExceeded { what, value: value as u64, limit: limit as u64 })
    }

    /// Counts a stream of this handle's client, until the result is dropped.
    ///
    /// # Errors
    /// Returns an error if the client has used its share.
    pub fn count_stream(&self) -> Result<Option<ClientStream>, CallError> {
        self.inner.accounts.stream(&self.call.account, Instant::now())
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn client(name: &str) -> Account {
        Account::Token(name.into())
    }

    #[test]
    fn calls_beyond_the_share_of_a_second_are_refused_and_come_back_with_time() {
        let (accounts, start) = (Accounts::new(10, 1), Instant::now());
        let done = |name: &str, now| (0..20).filter(|_| accounts.call(&client(name), now).is_ok()).count();
        assert_eq!(done("a", start), 10);
        assert_eq!(done("b", start), 10, "another has a share of its own");
        assert_eq!(done("a", start + Duration::from_millis(300)), 3);
        assert_eq!(done("a", start + Duration::from_secs(100)), 10, "and no more for waiting long");
        let refused = accounts.call(&client("a"), start).unwrap_err().to_string();
        assert!(
            refused.contains("calls a second by the token of a would be 11, and the limit is 10"),
            "{refused}"
        );
        assert!((0..1000).all(|_| accounts.call(&Account::Process, start).is_ok()));
        let any = Accounts::new(0, 1);
        assert!((0..1000).all(|_| any.call(&client("a"), start).is_ok()));
    }

    #[test]
    fn streams_are_counted_until_they_end() {
        let (accounts, now) = (Arc::new(Accounts::new(1, 2)), Instant::now());
        let open = |name: &str| accounts.stream(&client(name), now);
        let kept = (open("a").unwrap(), open("a").unwrap(), open("b").unwrap());
        assert!(open("a").unwrap_err().to_string().contains("streams of the token of a would be 3"));
        drop(kept.0);
        assert!(open("a").is_ok());
    }

    #[test]
    fn a_flood_of_new_clients_is_remembered_up_to_a_number_and_streams_stay_counted() {
        let (accounts, start) = (Arc::new(Accounts::new(10, 1)), Instant::now());
        let kept = accounts.stream(&client("kept"), start).unwrap();
        for number in 0..KEPT as u64 + 100 {
            let now = start + Duration::from_nanos(number);
            accounts.call(&Account::Connection(number), now).unwrap();
        }
        assert_eq!(accounts.lock().len(), KEPT);
        assert!(accounts.stream(&client("kept"), start).is_err());
        drop(kept);
    }
}
