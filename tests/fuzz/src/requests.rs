//! Requests as any bytes: the first selects the method, the rest is the message.

use simd_proto::checked::{Refused, requests};

/// A message is decoded, or refused in a sentence before that.
pub fn untrusted_requests(bytes: &[u8]) {
    let Some((which, message)) = bytes.split_first() else { return };
    let known = requests();
    let Some((_name, decode)) = known.get(usize::from(*which) % known.len().max(1)) else { return };
    match decode(message) {
        Ok(()) | Err(Refused::Malformed) => {}
        Err(Refused::TooMuch { bytes, most }) => {
            assert_eq!(bytes, message.len());
            assert!(most > bytes, "a short message has room");
        }
    }
}
