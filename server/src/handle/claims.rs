//! Claims on joints, and the leases that end them: the world knows who holds a
//! claim, and only the handle knows what time it is.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_core::Command;
use simd_core::simulation::command::JointSelection;
use tokio::sync::oneshot;
use tokio::time::Instant;
use tokio_util::sync::{CancellationToken, DropGuard};

use super::{CallError, Done, SimHandle};

/// Shortest and longest lease.
const LEASE: std::ops::RangeInclusive<Duration> = Duration::from_millis(100)..=Duration::from_secs(3600);
/// Claims at one time.
const CLAIMS: usize = 1024;
/// How long to wait before a lapsed claim is tried to be released again, where
/// the mailbox was full.
const RETRY: Duration = Duration::from_millis(20);

/// The leases that run, by claim.
#[derive(Debug, Default)]
pub(super) struct Leases {
    running: Mutex<HashMap<String, Lease>>,
}

#[derive(Debug)]
struct Lease {
    length: Duration,
    ends: Instant,
    /// Ends the task that watches it, with the lease.
    _over: DropGuard,
}

impl Leases {
    /// Begins the lease anew.
    fn renew(&self, claim: &str) {
        if let Some(lease) = self.lock().get_mut(claim) {
            lease.ends = Instant::now() + lease.length;
        }
    }

    /// When it ends; `None` if there is no such lease (any more).
    fn end(&self, claim: &str) -> Option<Instant> {
        self.lock().get(claim).map(|lease| lease.ends)
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<String, Lease>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SimHandle {
    /// Takes joints for one client until the claim is released or was not used
    /// for as long as the lease. The answer has the secret that targets must carry.
    ///
    /// # Errors
    /// Where the lease is not within 0.1 s and an hour, where there are too many
    /// claims, or where the world refuses.
    pub async fn claim(
        &self,
        joints: Vec<JointSelection>,
        holder: String,
        lease: Duration,
    ) -> Result<(String, Done), CallError> {
        if !LEASE.contains(&lease) {
            return Err(CallError::InvalidValue {
                element: "lease".into(),
                value: format!("{} s", lease.as_secs_f64()),
                expected: "it must be between 0.1 s and 3600 s".into(),
            });
        }
        let claim = secret()?;
        let over = CancellationToken::new();
        {
            let mut running = self.inner.leases.lock();
            if running.len() >= CLAIMS {
                return Err(CallError::LimitExceeded {
                    what: "the number of claims".into(),
                    value: CLAIMS as u64 + 1,
                    limit: CLAIMS as u64,
                });
            }
            let ends = Instant::now() + lease;
            running.insert(claim.clone(), Lease { length: lease, ends, _over: over.clone().drop_guard() });
        }
        // A task of its own, so that a claim whose caller goes away before the
        // answer has a lease that ends it.
        let (reply, answer) = oneshot::channel();
        let (handle, secret) = (self.clone(), claim.clone());
        tokio::spawn(async move {
            let done = handle.command(Command::Claim { claim: secret.clone(), holder, joints }).await;
            if done.is_err() {
                handle.inner.leases.lock().remove(&secret);
                drop(reply.send(done));
                return;
            }
            handle.renew(&secret);
            drop(reply.send(done));
            handle.watch_lease(secret, over).await;
        });
        let lost = |_| CallError::Internal { message: "a claim was not answered".into() };
        Ok((claim, answer.await.map_err(lost)??))
    }

    /// Gives claimed joints back.
    ///
    /// # Errors
    /// Where there is no such claim.
    pub async fn release(&self, claim: &str) -> Result<Done, CallError> {
        let done = self.command(Command::Release { claim: claim.into(), lapsed: false }).await?;
        self.inner.leases.lock().remove(claim);
        Ok(done)
    }

    /// Begins the lease of a claim anew, if there is such a claim.
    pub fn renew(&self, claim: &str) {
        self.inner.leases.renew(claim);
    }

    /// Releases the claim when its lease ends. Holds no handle while it waits, so
    /// that a lease of an hour does not keep a daemon alive.
    async fn watch_lease(self, claim: String, over: CancellationToken) {
        let (weak, draining) = (Arc::downgrade(&self.inner), self.draining());
        drop(self);
        loop {
            let Some(inner) = weak.upgrade() else { return };
            let handle = Self { inner };
            let Some(ends) = handle.inner.leases.end(&claim) else { return };
            let wake = if ends > Instant::now() {
                ends
            } else {
                match handle.command(Command::Release { claim: claim.clone(), lapsed: true }).await {
                    Err(CallError::MailboxFull { .. }) => Instant::now() + RETRY,
                    Ok(_) | Err(_) => {
                        handle.inner.leases.lock().remove(&claim);
                        return;
                    }
                }
            };
            drop(handle);
            tokio::select! {
                () = tokio::time::sleep_until(wake) => {}
                () = over.cancelled() => return,
                () = draining.cancelled() => return,
            }
        }
    }
}

/// 128 random bits in hexadecimal.
fn secret() -> Result<String, CallError> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)
        .map_err(|error| CallError::Internal { message: format!("there is no randomness: {error}") })?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use std::task::Poll;

    use simd_core::simulation::command::SetTargets;

    use super::super::tests::paused;
    use super::*;

    fn lease(handle: &SimHandle, claim: &str) -> Option<Duration> {
        handle.inner.leases.end(claim).map(|ends| ends - Instant::now())
    }

    #[tokio::test(start_paused = true)]
    async fn targets_that_carry_a_claim_renew_its_lease_and_others_do_not() {
        let handle = paused();
        let length = Duration::from_secs(10);
        for claim in ["mine", "yours"] {
            let over = CancellationToken::new().drop_guard();
            let lease = Lease { length, ends: Instant::now() + length, _over: over };
            handle.inner.leases.lock().insert(claim.into(), lease);
        }
        tokio::time::advance(Duration::from_secs(4)).await;
        let targets = SetTargets { claim: Some("mine".into()), ..SetTargets::default() };
        let mut command = std::pin::pin!(handle.command(Command::SetTargets(targets)));
        // Once is enough to post it; waiting would let the paused clock run on.
        let _ = std::future::poll_fn(|cx| Poll::Ready(command.as_mut().poll(cx))).await;
        assert_eq!(lease(&handle, "mine"), Some(length));
        assert_eq!(lease(&handle, "yours"), Some(Duration::from_secs(6)));
        handle.renew("yours");
        handle.renew("nobody's");
        assert_eq!(lease(&handle, "yours"), Some(length));
        assert_eq!(lease(&handle, "nobody's"), None);
    }

    #[tokio::test]
    async fn a_released_claim_has_no_lease() {
        let handle = paused();
        let (claim, _) = handle.claim(Vec::new(), "me".into(), Duration::from_secs(3600)).await.unwrap();
        assert!(lease(&handle, &claim).is_some());
        handle.release(&claim).await.unwrap();
        assert_eq!(lease(&handle, &claim), None);
    }
}
