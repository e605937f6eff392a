//! Proof over Zenoh that a client holds a claim, without sending the claim's secret. Any session may read
//! publications and queries. So they carry the claim's id, a counter, and a keyed hash of both and of the
//! payload.
//!
//! `ClaimJoints` answers with a secret such as `7.9f86d081884c7d65`, whose part before the dot is the claim's
//! id. Over Zenoh the field `claim` of a request has only the id, and the attachment has a line
//!
//! ```text
//! simd-claim: ID COUNTER CODE
//! ```
//!
//! CODE is HMAC-SHA256 in lowercase hexadecimal, keyed with the secret as text. It covers the lines `simd.v1
//! claim`, KEY and COUNTER, each ended by a line feed, and the payload. KEY is the key expression of the
//! query or publication. COUNTER is a decimal number that is larger than in the message before.

use std::time::{SystemTime, UNIX_EPOCH};

use hmac::{Hmac, Mac};
use prost::Message;
use sha2::Sha256;

use crate::hex;

/// Name of the line in the attachment.
pub const PROOF_HEADER: &str = "simd-claim";

/// Domain separation: no other hash is made with the same secret.
const DOMAIN: &str = "simd.v1 claim\n";

/// Length of a code in bytes.
const CODE_BYTES: usize = 32;

/// Proof in a message that its sender holds a claim.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Proof {
    /// Id of the claim.
    pub claim: u64,
    /// Larger than in the message before.
    pub counter: u64,
    code: [u8; CODE_BYTES],
}

impl Proof {
    /// Makes a proof with the secret. `None` if the text is not a secret of a daemon.
    pub fn new(secret: &str, counter: u64, key: &str, payload: &[u8]) -> Option<Self> {
        let claim = id_of(secret)?.parse().ok()?;
        let code = hashed(secret, counter, key, payload)?.finalize().into_bytes().into();
        Some(Self { claim, counter, code })
    }

    /// Parses the text after the header's name.
    pub fn parse(text: &str) -> Option<Self> {
        let mut words = text.split(' ');
        let (claim, counter, code) = (words.next()?, words.next()?, words.next()?);
        if words.next().is_some() {
            return None;
        }
        Some(Self { claim: number(claim)?, counter: number(counter)?, code: hex::bytes(code)? })
    }

    /// Returns whether it was made with the secret, for this key and payload. Compares in constant time.
    pub fn holds(&self, secret: &str, key: &str, payload: &[u8]) -> bool {
        let hash = hashed(secret, self.counter, key, payload);
        hash.is_some_and(|hash| hash.verify_slice(&self.code).is_ok())
    }
}

impl std::fmt::Display for Proof {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {} {}", self.claim, self.counter, hex::text(&self.code))
    }
}

/// A request that may act for a claim.
pub trait Claiming: Message + Default {
    /// Returns the claim's secret, or its id if others can read the request; empty for none.
    fn claim_mut(&mut self) -> &mut String;
}

/// Replaces the secret of a request with the id of its claim. Returns the request and the secret.
type Seal = fn(&[u8]) -> Option<(Vec<u8>, String)>;

include!("generated/claiming.rs");

/// Takes the secret out of a request, given by the name of its message and its bytes. Returns the request as
/// others may read it, and the secret that the proof needs. `None` if it has no secret.
pub fn seal(name: &str, message: &[u8]) -> Option<(Vec<u8>, String)> {
    let (_, seal) = CLAIMING.iter().find(|(of, _)| *of == name)?;
    seal(message)
}

fn seal_in<R: Claiming>(message: &[u8]) -> Option<(Vec<u8>, String)> {
    // Bytes that are not a message have no claim; the daemon refuses them.
    let mut request = R::decode(message).ok()?;
    let id = id_of(request.claim_mut())?.to_owned();
    let secret = std::mem::replace(request.claim_mut(), id);
    Some((request.encode_to_vec(), secret))
}

/// Returns the id in a claim's secret, which is not a secret; `None` if the text has none.
pub fn id_of(secret: &str) -> Option<&str> {
    let (id, _rest) = secret.split_once('.')?;
    number(id).map(|_| id)
}

/// Returns the counter of the message after one with `last`: the time in nanoseconds. A restarted program
/// that has kept its secret continues above its earlier counters.
pub fn next_counter(last: u64) -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(now.as_nanos()).unwrap_or(0).max(last.saturating_add(1))
}

/// Parses digits only: `parse` alone would accept a sign.
fn number(text: &str) -> Option<u64> {
    text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
}

fn hashed(secret: &str, counter: u64, key: &str, payload: &[u8]) -> Option<Hmac<Sha256>> {
    let mut hash = Hmac::<Sha256>::new_from_slice(secret.as_bytes()).ok()?;
    hash.update(DOMAIN.as_bytes());
    hash.update(format!("{key}\n{counter}\n").as_bytes());
    hash.update(payload);
    Some(hash)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECRET: &str = "7.9f86d081884c7d659a2feaa0c55ad015";
    const KEY: &str = "simd/lab/joint_targets";

    #[test]
    fn a_proof_reads_back_and_is_of_one_secret_key_counter_and_payload() {
        let proof = Proof::new(SECRET, 12, KEY, b"targets").unwrap();
        let said = proof.to_string();
        assert!(said.starts_with("7 12 "), "{said}");
        let read = Proof::parse(&said).unwrap();
        assert_eq!(read, proof);
        assert!(read.holds(SECRET, KEY, b"targets"));
        assert!(!read.holds(SECRET, KEY, b"target"));
        assert!(!read.holds(SECRET, "simd/lab/rpc/JointService/SetJointTargets", b"targets"));
        assert!(!read.holds("7.9f86d081884c7d659a2feaa0c55ad016", KEY, b"targets"));
        assert!(!Proof { counter: 13, ..read }.holds(SECRET, KEY, b"targets"));
    }

    /// The expected code is from Python's `hmac.new(secret, lines, "sha256")`: the clients agree.
    #[test]
    fn the_code_is_hmac_sha256_of_the_lines_and_the_payload() {
        let proof = Proof::new("1.00", 2, "simd/simd/joint_targets", b"abc").unwrap();
        let code = "9ddbd820b1795ba083e20c3f15c7927d31e141eb154402f94cef8a083c664dc0";
        assert_eq!(proof.to_string(), format!("1 2 {code}"));
    }

    #[test]
    fn other_texts_are_not_proofs() {
        let code = "0".repeat(64);
        for text in [
            String::new(),
            "7 12".into(),
            format!("7 12 {}", "0".repeat(63)),
            format!("7 12 {}", "g".repeat(64)),
            format!("7 12 {}ä", "0".repeat(62)),
            format!("7 12 +f{}", "0".repeat(62)),
            format!("7 12 {}", "F".repeat(64)),
            format!("7 12 {code} 1"),
            format!("+7 12 {code}"),
            format!("7 -12 {code}"),
            format!("7 99999999999999999999 {code}"),
        ] {
            assert_eq!(Proof::parse(&text), None, "{text}");
        }
        for secret in ["", "secret", "a.b", ".b", "-1.b"] {
            assert_eq!(Proof::new(secret, 1, KEY, b""), None, "{secret}");
        }
    }

    #[test]
    fn the_secret_is_taken_out_of_every_request_that_names_a_claim() {
        for (name, number) in
            [("SetJointTargetsRequest", 3), ("ReleaseJointsRequest", 1), ("SetEntityStateRequest", 5)]
        {
            let mut wire = vec![(number << 3) | 2, u8::try_from(SECRET.len()).unwrap()];
            wire.extend_from_slice(SECRET.as_bytes());
            assert_eq!(
                seal(name, &wire),
                Some((vec![(number << 3) | 2, 1, b'7'], SECRET.to_owned())),
                "{name}"
            );
        }
        let schema = [
            include_str!("../simd/v1/constraint.proto"),
            include_str!("../simd/v1/entity.proto"),
            include_str!("../simd/v1/joint.proto"),
            include_str!("../simd/v1/parameter.proto"),
            include_str!("../simd/v1/sensor.proto"),
            include_str!("../simd/v1/simulation.proto"),
        ];
        let named =
            schema.iter().flat_map(|file| file.lines()).filter(|line| line.starts_with("  string claim = "));
        // The answer to ClaimJoints also has the secret.
        assert_eq!(named.count(), CLAIMING.len() + 1);
    }

    #[test]
    fn messages_without_a_secret_stay_unchanged() {
        for claim in ["", "unknown", "a.b"] {
            let request = crate::v1::ReleaseJointsRequest { claim: claim.into(), ..Default::default() };
            assert_eq!(seal("ReleaseJointsRequest", &request.encode_to_vec()), None, "{claim}");
        }
        assert_eq!(seal("GetJointStatesRequest", &[]), None);
        assert_eq!(seal("ReleaseJointsRequest", &[0xff]), None);
    }

    #[test]
    fn counters_grow_whatever_the_clock_says() {
        let first = next_counter(0);
        assert!(next_counter(first) > first);
        assert_eq!(next_counter(u64::MAX - 1), u64::MAX);
    }
}
