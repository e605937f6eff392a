//! Checks whether a publication or a query proves that its sender holds a claim.
//!
//! The check runs on Zenoh's own thread, in the order of the messages. Counters only grow, so a later message
//! must not be checked before an earlier one. It costs a hash of the payload, and only if there is a proof.

use simd_proto::keys;
use simd_proto::proof::{PROOF_HEADER, Proof};
use zenoh::bytes::ZBytes;

use simd_api::service::claims::Proven;
use simd_world::SimHandle;
use simd_world::handle::Unproven;

/// Maximum size of an attachment, bytes: a name and a proof take some two hundred.
pub(super) const MAX_ATTACHMENT_BYTES: usize = 4096;

/// Returns the proof of a message with this key.
pub(super) fn proven(
    handle: &SimHandle,
    key: &str,
    payload: Option<&ZBytes>,
    attachment: Option<&ZBytes>,
) -> Proven {
    let Some(attachment) = attachment.filter(|attachment| attachment.len() <= MAX_ATTACHMENT_BYTES) else {
        return Proven::Nothing;
    };
    let text = attachment.to_bytes();
    let text = String::from_utf8_lossy(&text);
    let Some(said) = keys::parse_attachment(&text, PROOF_HEADER) else { return Proven::Nothing };
    let Some(proof) = Proof::parse(said) else { return Proven::Refused(Unproven::NotFound) };
    let payload = payload.map(ZBytes::to_bytes).unwrap_or_default();
    if payload.len() as u64 > handle.info().limits.message_bytes {
        // The reader of the message refuses it for its length.
        return Proven::Nothing;
    }
    match handle.claim_proven(&proof, key, &payload) {
        Ok(claim) => Proven::Claim(claim),
        Err(unproven) => Proven::Refused(unproven),
    }
}
