//! Wrong tokens by their senders: the more one sends, the longer it waits for each refusal.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::account::Account;

/// Wrong tokens that are refused at once: a person mistypes, and a program tries again.
const FREE: u32 = 5;
/// Time between two refusals of one sender after that.
const PAUSE: Duration = Duration::from_millis(500);
/// Longest wait for a refusal.
const LONGEST: Duration = Duration::from_secs(10);
/// Senders that are remembered. The one that was silent for longest is forgotten.
const SENDERS: usize = 1024;

/// Wrong tokens since the start, and who sent them lately.
#[derive(Debug, Default)]
pub(super) struct Guesses(Mutex<Senders>);

#[derive(Debug, Default)]
struct Senders {
    count: u64,
    /// When the pause after the last refusal of each ends.
    until: HashMap<Account, Instant>,
}

impl Guesses {
    /// Counts a wrong token. Returns how long its refusal has to wait.
    pub(super) fn note(&self, sender: &Account, now: Instant) -> Duration {
        let mut senders = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Senders { count, until } = &mut *senders;
        *count += 1;
        if !until.contains_key(sender) && until.len() >= SENDERS {
            until.retain(|_, until| *until > now);
            let oldest = until.iter().min_by_key(|(_, until)| **until).map(|(sender, _)| sender.clone());
            if let Some(oldest) = oldest.filter(|_| until.len() >= SENDERS) {
                until.remove(&oldest);
            }
        }
        let free = PAUSE * FREE;
        let after = until.entry(sender.clone()).or_insert(now);
        *after = (*after).max(now) + PAUSE;
        let wait = after.saturating_duration_since(now).saturating_sub(free);
        if wait > LONGEST {
            *after = now + free + LONGEST;
        }
        wait.min(LONGEST)
    }

    /// Wrong tokens since the start.
    pub(super) fn count(&self) -> u64 {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sender(number: u64) -> Account {
        Account::Connection(number)
    }

    #[test]
    fn the_sixth_wrong_token_waits_and_silence_is_forgiven() {
        let (guesses, now) = (Guesses::default(), Instant::now());
        let waits: Vec<_> = (0..8).map(|_| guesses.note(&sender(1), now).as_millis()).collect();
        assert_eq!(waits, [0, 0, 0, 0, 0, 500, 1000, 1500]);
        assert_eq!(guesses.note(&sender(2), now), Duration::ZERO, "another sender");
        assert_eq!(guesses.note(&sender(1), now + Duration::from_secs(60)), Duration::ZERO);
        assert_eq!(guesses.count(), 10);
        let longest = (0..1_000).map(|_| guesses.note(&sender(1), now)).max();
        assert_eq!(longest, Some(LONGEST));
    }

    #[test]
    fn a_bounded_number_of_senders_is_remembered() {
        let (guesses, now) = (Guesses::default(), Instant::now());
        for number in 0..3_000 {
            guesses.note(&sender(number), now + Duration::from_micros(number));
        }
        assert_eq!(guesses.0.lock().unwrap().until.len(), SENDERS);
        assert!(guesses.0.lock().unwrap().until.contains_key(&sender(2_999)));
    }
}
