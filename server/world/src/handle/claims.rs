//! Claims, proofs that a caller holds one, and leases that end them. The world knows the claims on each
//! object; only the handle knows secrets and time.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use simd_core::simulation::command::{ClaimId, ClaimRequest, ReleaseCause};
use simd_core::{Applied, Command, Reply};
use simd_proto::proof::{self, Proof};
use tokio::sync::oneshot;
use tokio::time::Instant;
use tokio_util::sync::{CancellationToken, DropGuard};

use super::{CallError, Done, SimHandle};
use crate::account::Account;

/// Shortest and longest lease.
const LEASE: std::ops::RangeInclusive<Duration> = Duration::from_millis(100)..=Duration::from_secs(3600);
/// Time until the next attempt to release a lapsed claim if the mailbox was full.
const RETRY: Duration = Duration::from_millis(20);

/// Running leases, by claim.
#[derive(Debug, Default)]
pub(super) struct Leases {
    running: Mutex<HashMap<ClaimId, Lease>>,
    /// Last assigned id. An id is never used again.
    given: AtomicU64,
}

#[derive(Debug)]
struct Lease {
    /// Client that it counts for.
    account: Account,
    /// Secret whose holder may set the joints.
    secret: Arc<str>,
    /// Counter of the last accepted proof; the next one must be larger.
    counter: u64,
    length: Duration,
    ends: Instant,
    /// Whether its claim is on the world.
    of_world: bool,
    /// Ends the task that watches the lease, when the lease is dropped.
    _over: DropGuard,
}

impl Leases {
    /// Restarts the lease.
    fn renew(&self, claim: ClaimId) {
        if let Some(lease) = self.lock().get_mut(&claim) {
            lease.ends = Instant::now() + lease.length;
        }
    }

    /// Returns when it ends; `None` if the lease does not exist (any more).
    fn end(&self, claim: ClaimId) -> Option<Instant> {
        self.lock().get(&claim).map(|lease| lease.ends)
    }

    /// Returns whether the claim is active.
    pub(super) fn holds(&self, claim: ClaimId) -> bool {
        self.lock().contains_key(&claim)
    }

    /// Returns whether the claim is active and on the world.
    pub(super) fn holds_world(&self, claim: ClaimId) -> bool {
        self.lock().get(&claim).is_some_and(|lease| lease.of_world)
    }

    /// The claim that this is the secret of.
    fn of_secret(&self, secret: &str) -> Option<ClaimId> {
        let claim = ClaimId(proof::id_of(secret)?.parse().ok()?);
        let running = self.lock();
        let known = &running.get(&claim)?.secret;
        // Compared in constant time.
        let is_it = known.len() == secret.len()
            && known.bytes().zip(secret.bytes()).fold(0, |differ, (a, b)| differ | (a ^ b)) == 0;
        is_it.then_some(claim)
    }

    /// Returns the claim that a proof is for, if the proof is newer than the last accepted one.
    fn of_proof(&self, proof: &Proof, key: &str, payload: &[u8]) -> Result<ClaimId, Unproven> {
        let claim = ClaimId(proof.claim);
        let newer = |lease: &Lease| match proof.counter > lease.counter {
            true => Ok(()),
            false => Err(Unproven::Replayed { last: lease.counter }),
        };
        let secret = {
            let running = self.lock();
            let lease = running.get(&claim).ok_or(Unproven::NotFound)?;
            newer(lease)?;
            lease.secret.clone()
        };
        // Outside of the lock, since its time grows with the payload.
        if !proof.holds(&secret, key, payload) {
            return Err(Unproven::NotFound);
        }
        let mut running = self.lock();
        let lease = running.get_mut(&claim).ok_or(Unproven::NotFound)?;
        newer(lease)?;
        lease.counter = proof.counter;
        Ok(claim)
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<ClaimId, Lease>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Reason why a message has no claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unproven {
    /// The claim does not exist, or the proof was made without its secret.
    NotFound,
    /// A proof with this counter or a larger one was accepted before.
    Replayed {
        /// Largest accepted counter.
        last: u64,
    },
}

impl From<Unproven> for CallError {
    fn from(unproven: Unproven) -> Self {
        match unproven {
            Unproven::NotFound => Self::World(simd_core::Error::ClaimNotFound),
            Unproven::Replayed { last } => Self::InvalidValue {
                element: format!("the counter of {}", proof::PROOF_HEADER),
                value: "not new".into(),
                expected: format!("it must be larger than {last}, which was taken already"),
            },
        }
    }
}

impl SimHandle {
    /// The holder's name with its token: people ask the owner of a token to let go.
    fn named_holder(&self, holder: String) -> String {
        match &self.call.account {
            Account::Token(token) if **token != *holder => format!("{holder} (token {token})"),
            _ => holder,
        }
    }

    /// Returns whether the call acts for a claim on the world.
    pub(super) fn holds_world(&self) -> bool {
        self.call.claim.is_some_and(|claim| self.inner.leases.holds_world(claim))
    }

    /// Refuses a call that does not act for the claim on the world, if there is one.
    pub(super) fn check_holds_world(&self) -> Result<(), CallError> {
        match &self.newest().state.claimed_by {
            Some(holder) if !self.holds_world() => {
                Err(simd_core::Error::WorldClaimed { holder: holder.to_string() }.into())
            }
            _ => Ok(()),
        }
    }

    /// Takes robots, joints or the world for one client. The claim ends by a release, after a lease without use, when
    /// `until` is cancelled, and when the client's token is revoked. The id of the claim is made here. The answer
    /// has the secret by which the client is known from then on.
    ///
    /// # Errors
    /// Returns an error if the lease is not between 0.1 s and an hour, or the world refuses. Also if there
    /// are too many claims, in total or of this client.
    pub async fn claim(
        &self,
        request: ClaimRequest,
        lease: Duration,
        until: Option<CancellationToken>,
    ) -> Result<(String, Done), CallError> {
        if !LEASE.contains(&lease) {
            return Err(CallError::InvalidValue {
                element: "lease".into(),
                value: format!("{} s", lease.as_secs_f64()),
                expected: "it must be between 0.1 s and 3600 s".into(),
            });
        }
        let request = ClaimRequest { holder: self.named_holder(request.holder), ..request };
        let claim = ClaimId(self.inner.leases.given.fetch_add(1, Ordering::Relaxed) + 1);
        let secret = secret(claim)?;
        let over = CancellationToken::new();
        {
            let mut running = self.inner.leases.lock();
            let own = running.values().filter(|lease| lease.account == self.call.account).count();
            self.check_share("the number of claims", own + 1, self.info().limits.claims_of_client)?;
            let limit = self.info().limits.claims;
            if running.len() >= limit {
                return Err(CallError::LimitExceeded {
                    what: "the number of claims".into(),
                    value: limit as u64 + 1,
                    limit: limit as u64,
                });
            }
            let ends = Instant::now() + lease;
            let (account, secret) = (self.call.account.clone(), secret.as_str().into());
            let _over = over.clone().drop_guard();
            let of_world = request.world;
            running
                .insert(claim, Lease { account, secret, counter: 0, length: lease, ends, of_world, _over });
        }
        // A separate task, so that the claim has a lease even if its caller disconnects before the answer.
        let (reply, answer) = oneshot::channel();
        let handle = self.clone();
        tokio::spawn(async move {
            let done = handle.command(Command::Claim(ClaimRequest { claim, ..request })).await;
            let ended = match &done {
                Ok(Done { applied: Applied { reply: Reply::Claimed { ended }, .. }, .. }) => ended.as_slice(),
                Ok(_) => &[],
                Err(_) => std::slice::from_ref(&claim),
            };
            handle.inner.leases.lock().retain(|claim, _| !ended.contains(claim));
            if done.is_err() {
                drop(reply.send(done));
                return;
            }
            handle.renew(claim);
            drop(reply.send(done));
            handle.watch_lease(claim, over, until).await;
        });
        let lost = |_| CallError::Internal { message: "a claim was not answered".into() };
        Ok((secret, answer.await.map_err(lost)??))
    }

    /// Releases the claim that this handle acts for.
    ///
    /// # Errors
    /// Returns an error if the claim does not exist (any more).
    pub async fn release(&self) -> Result<Done, CallError> {
        let claim = self.call.claim.ok_or(CallError::from(Unproven::NotFound))?;
        let done = self.command(Command::Release { claim, cause: ReleaseCause::Released }).await?;
        self.inner.leases.lock().remove(&claim);
        Ok(done)
    }

    /// Returns the claim with this secret, for callers whose messages no other client can read.
    ///
    /// # Errors
    /// Returns an error if the claim does not exist.
    pub fn claim_of(&self, secret: &str) -> Result<ClaimId, CallError> {
        self.inner.leases.of_secret(secret).ok_or(Unproven::NotFound.into())
    }

    /// Returns the claim that a message proves to hold. A proof is valid once.
    ///
    /// # Errors
    /// Returns an error if the claim does not exist or the proof is wrong. Also if a proof with its counter
    /// or a larger one was accepted before.
    pub fn claim_proven(&self, proof: &Proof, key: &str, payload: &[u8]) -> Result<ClaimId, Unproven> {
        self.inner.leases.of_proof(proof, key, payload)
    }

    /// Returns the number of active claims.
    pub fn claim_count(&self) -> usize {
        self.inner.leases.lock().len()
    }

    /// Returns the claim that this handle acts for, and restarts its lease.
    pub(super) fn renewed_claim(&self) -> Option<ClaimId> {
        self.call.claim.inspect(|claim| self.renew(*claim))
    }

    /// Restarts the lease of a claim, if the claim exists.
    pub fn renew(&self, claim: ClaimId) {
        self.inner.leases.renew(claim);
    }

    /// Releases the claim when its lease ends, or `until` is cancelled. Holds no handle while it waits, so
    /// that a lease of an hour does not keep a daemon alive.
    async fn watch_lease(self, claim: ClaimId, over: CancellationToken, until: Option<CancellationToken>) {
        // An absent token is replaced by one that is never cancelled.
        let revoked = self.call.grant.as_ref().map(|grant| grant.revoked.clone());
        let (until, revoked) = (until.unwrap_or_default(), revoked.unwrap_or_default());
        let (weak, draining) = (Arc::downgrade(&self.inner), self.draining());
        drop(self);
        loop {
            let Some(inner) = weak.upgrade() else { return };
            let handle = Self::of_daemon(inner);
            let Some(ends) = handle.inner.leases.end(claim) else { return };
            let is_over = ends <= Instant::now() || revoked.is_cancelled();
            let cause = match until.is_cancelled() {
                true => Some(ReleaseCause::Disconnected),
                false => is_over.then_some(ReleaseCause::Lapsed),
            };
            let wake = match cause {
                None => ends,
                Some(cause) => match handle.command(Command::Release { claim, cause }).await {
                    Err(CallError::MailboxFull { .. }) => Instant::now() + RETRY,
                    Ok(_) | Err(_) => {
                        handle.inner.leases.lock().remove(&claim);
                        return;
                    }
                },
            };
            drop(handle);
            tokio::select! {
                () = tokio::time::sleep_until(wake) => {}
                () = until.cancelled(), if !until.is_cancelled() => {}
                () = revoked.cancelled(), if !revoked.is_cancelled() => {}
                () = over.cancelled() => return,
                () = draining.cancelled() => return,
            }
        }
    }
}

/// Returns a claim's id, a dot, and 128 random bits in hexadecimal.
fn secret(claim: ClaimId) -> Result<String, CallError> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)
        .map_err(|error| CallError::Internal { message: format!("there is no randomness: {error}") })?;
    let random: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(format!("{}.{random}", claim.0))
}

#[cfg(test)]
mod tests {
    use std::task::Poll;

    use simd_core::simulation::command::SetTargets;

    use super::super::testing::paused;
    use super::*;

    async fn claim_nothing(handle: &SimHandle, seconds: u64) -> Result<(String, Done), CallError> {
        let request = ClaimRequest { holder: "me".into(), ..ClaimRequest::default() };
        handle.claim(request, Duration::from_secs(seconds), None).await
    }

    fn lease(handle: &SimHandle, claim: u64) -> Option<Duration> {
        handle.inner.leases.end(ClaimId(claim)).map(|ends| ends - Instant::now())
    }

    #[tokio::test(start_paused = true)]
    async fn targets_that_carry_a_claim_renew_its_lease_and_others_do_not() {
        let handle = paused();
        let length = Duration::from_secs(10);
        let [mine, yours, unknown] = [1, 2, 3];
        for claim in [mine, yours] {
            let over = CancellationToken::new().drop_guard();
            let ends = Instant::now() + length;
            let (account, secret) = (Account::Process, "".into());
            let lease = Lease { account, secret, counter: 0, length, ends, of_world: false, _over: over };
            handle.inner.leases.lock().insert(ClaimId(claim), lease);
        }
        tokio::time::advance(Duration::from_secs(4)).await;
        let acting = handle.acting_for(Some(ClaimId(mine)));
        let mut command = std::pin::pin!(acting.command(Command::SetTargets(SetTargets::default())));
        // One poll is enough to post it; waiting would let the paused clock continue.
        let _ = std::future::poll_fn(|cx| Poll::Ready(command.as_mut().poll(cx))).await;
        assert_eq!(lease(&handle, mine), Some(length));
        assert_eq!(lease(&handle, yours), Some(Duration::from_secs(6)));
        handle.renew(ClaimId(yours));
        handle.renew(ClaimId(unknown));
        assert_eq!(lease(&handle, yours), Some(length));
        assert_eq!(lease(&handle, unknown), None);
    }

    #[tokio::test]
    async fn a_released_claim_has_no_lease() {
        let handle = paused();
        let (secret, _) = claim_nothing(&handle, 3600).await.unwrap();
        let claim = handle.claim_of(&secret).unwrap();
        assert!(lease(&handle, claim.0).is_some());
        handle.acting_for(Some(claim)).release().await.unwrap();
        assert_eq!(lease(&handle, claim.0), None);
        assert!(handle.claim_of(&secret).is_err());
    }

    #[tokio::test]
    async fn a_secret_is_of_one_claim_and_its_id_is_none() {
        let handle = paused();
        let (secret, _) = claim_nothing(&handle, 10).await.unwrap();
        let (id, random) = secret.split_once('.').unwrap();
        assert_eq!(random.len(), 32);
        let wrong = format!("{id}.{}", "0".repeat(32));
        for text in [id, &format!("{id}."), &wrong, &format!("{secret}0"), &format!("2.{random}"), ""] {
            assert!(handle.claim_of(text).is_err(), "{text}");
        }
    }

    #[tokio::test]
    async fn a_proof_is_taken_once_and_an_older_one_never() {
        let handle = paused();
        let (secret, _) = claim_nothing(&handle, 10).await.unwrap();
        let claim = handle.claim_of(&secret).unwrap();
        let take = |secret: &str, counter, key, payload: &[u8]| {
            let proof = Proof::new(secret, counter, "key", b"payload").unwrap();
            handle.claim_proven(&proof, key, payload)
        };
        assert_eq!(take(&secret, 5, "key", b"payload"), Ok(claim));
        for counter in [5, 4, 0] {
            let refused = Err(Unproven::Replayed { last: 5 });
            assert_eq!(take(&secret, counter, "key", b"payload"), refused, "{counter}");
        }
        // Refused proofs do not count.
        assert_eq!(take(&secret, 6, "other", b"payload"), Err(Unproven::NotFound));
        assert_eq!(take(&secret, 7, "key", b"other"), Err(Unproven::NotFound));
        assert_eq!(take("1.guessed", u64::MAX, "key", b"payload"), Err(Unproven::NotFound));
        assert_eq!(take("9.guessed", 1, "key", b"payload"), Err(Unproven::NotFound));
        assert_eq!(take(&secret, 6, "key", b"payload"), Ok(claim));
    }
}
