//! Proves with each message that its sender has the secret of its claim.

use std::sync::{Mutex, PoisonError};

use simd_proto::proof::{self, PROOF_HEADER, Proof};

/// Numbers the proofs of one session.
#[derive(Debug, Default)]
pub(super) struct Counter(Mutex<u64>);

impl Counter {
    /// Sends a message with a proof that its sender has the secret, as a line of the attachment. Messages are
    /// sent one after the other, since the daemon takes no counter after a larger one.
    pub(super) fn prove<T>(
        &self,
        secret: &str,
        key: &str,
        payload: &[u8],
        send: impl FnOnce(Option<String>) -> T,
    ) -> T {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *last = proof::next_counter(*last);
        let proof = Proof::new(secret, *last, key, payload);
        send(proof.map(|proof| format!("{PROOF_HEADER}: {proof}")))
    }
}
