//! Waits for calls in which the daemon works for long: only its silence ends them.

use std::{future::Future, pin::pin, time::Duration};

/// Returns the outcome of a call, or the time waited until the daemon was silent for `timeout`.
///
/// Each time `timeout` ends, `is_alive` asks the daemon something that it answers at once.
pub(crate) async fn until_silent<T, A: Future<Output = bool>>(
    timeout: Duration,
    call: impl Future<Output = T>,
    is_alive: impl Fn() -> A,
) -> Result<T, Duration> {
    let mut call = pin!(call);
    let mut waited = Duration::ZERO;
    loop {
        if let Ok(outcome) = tokio::time::timeout(timeout, &mut call).await {
            return Ok(outcome);
        }
        waited = waited.saturating_add(timeout);
        tokio::select! {
            biased;
            outcome = &mut call => return Ok(outcome),
            answered = tokio::time::timeout(timeout, is_alive()) => {
                if answered != Ok(true) {
                    return Err(waited);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{cell::Cell, future};

    use super::*;

    const TIMEOUT: Duration = Duration::from_secs(10);

    #[tokio::test(start_paused = true)]
    async fn a_long_call_is_waited_for_while_the_daemon_answers() {
        let asked = Cell::new(0);
        let is_alive = || {
            asked.set(asked.get() + 1);
            future::ready(true)
        };
        let long = tokio::time::sleep(TIMEOUT * 11);
        assert_eq!(until_silent(TIMEOUT, long, is_alive).await, Ok(()));
        assert!(asked.get() >= 10, "{}", asked.get());
    }

    #[tokio::test(start_paused = true)]
    async fn a_daemon_that_says_nothing_or_refuses_ends_the_wait() {
        let never = future::pending::<()>;
        assert_eq!(until_silent(TIMEOUT, never(), || future::ready(false)).await, Err(TIMEOUT));
        assert_eq!(until_silent(TIMEOUT, never(), future::pending::<bool>).await, Err(TIMEOUT));
    }

    #[tokio::test(start_paused = true)]
    async fn a_call_that_ends_while_the_daemon_is_asked_has_its_outcome() {
        let call = tokio::time::sleep(TIMEOUT + Duration::from_secs(1));
        assert_eq!(until_silent(TIMEOUT, call, future::pending::<bool>).await, Ok(()));
    }
}
