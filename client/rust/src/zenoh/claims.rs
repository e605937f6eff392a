//! Keeps the secrets of claims off the network: of a request that acts for one, the secret becomes the id, and
//! what proves that the sender has it goes into the attachment.

use std::sync::{Mutex, PoisonError};

use bytes::Bytes;
use prost::Message;
use simd_proto::methods::Method;
use simd_proto::proof::{self, PROOF_HEADER, Proof};
use simd_proto::v1::{ControlRequest, ReleaseJointsRequest, SetJointTargetsRequest, StepSimulationRequest};

/// A request as others may read it.
pub(super) struct Sealed {
    pub(super) message: Bytes,
    /// That is to be proven with it.
    pub(super) secret: Option<String>,
}

/// Takes the secret out of a request.
pub(super) fn seal(method: &Method, message: Bytes) -> Sealed {
    match method.path.as_str() {
        "/simd.v1.JointService/SetJointTargets" => {
            seal_in(message, |request: &mut SetJointTargetsRequest| &mut request.claim)
        }
        "/simd.v1.JointService/ReleaseJoints" => {
            seal_in(message, |request: &mut ReleaseJointsRequest| &mut request.claim)
        }
        "/simd.v1.JointService/Control" => {
            seal_in(message, |request: &mut ControlRequest| &mut request.claim)
        }
        "/simd.v1.SimulationService/StepSimulation" => {
            seal_in(message, |request: &mut StepSimulationRequest| &mut request.claim)
        }
        _ => Sealed { message, secret: None },
    }
}

fn seal_in<R: Message + Default>(message: Bytes, claim: impl Fn(&mut R) -> &mut String) -> Sealed {
    // What is no message has no claim, and is refused by the daemon.
    let Ok(mut request) = R::decode(message.clone()) else { return Sealed { message, secret: None } };
    let Some(id) = proof::id_of(claim(&mut request)).map(str::to_owned) else {
        return Sealed { message, secret: None };
    };
    let secret = std::mem::replace(claim(&mut request), id);
    Sealed { message: request.encode_to_vec().into(), secret: Some(secret) }
}

/// Numbers proofs of one session.
#[derive(Debug, Default)]
pub(super) struct Counter(Mutex<u64>);

impl Counter {
    /// Has a message sent with what proves that its sender has the secret, as a line of the attachment. One is
    /// sent after the other, since the daemon takes no number after a larger one.
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

#[cfg(test)]
mod tests {
    use simd_proto::methods;

    use super::*;

    /// A method whose request has a claim, and that is not known here, would send the secret.
    #[test]
    fn every_request_that_names_a_claim_is_sealed() {
        let secret = "7.9f86d081884c7d659a2feaa0c55ad015";
        // In each of these messages the claim is the only field of type string at its number.
        let numbers = [("SetJointTargets", 3), ("ReleaseJoints", 1), ("Control", 4), ("StepSimulation", 5)];
        for (name, number) in numbers {
            let method =
                ["JointService", "SimulationService"].into_iter().find_map(|of| methods::find(of, name));
            let length = u8::try_from(secret.len()).unwrap();
            let mut wire = vec![(number << 3) | 2, length];
            wire.extend_from_slice(secret.as_bytes());
            let sealed = seal(method.unwrap(), wire.into());
            assert_eq!(sealed.secret.as_deref(), Some(secret), "{name}");
            assert_eq!(&*sealed.message, [(number << 3) | 2, 1, b'7'], "{name}");
        }
        let schema = include_str!("../../../../proto/simd/v1/joint.proto").to_owned()
            + include_str!("../../../../proto/simd/v1/simulation.proto");
        let named = schema.lines().filter(|line| line.trim_start().starts_with("string claim = "));
        // And in the answer to ClaimJoints, which has the secret.
        assert_eq!(named.count(), numbers.len() + 1);
    }

    #[test]
    fn what_has_no_secret_is_left_as_it_is() {
        let method = methods::find("JointService", "ReleaseJoints").unwrap();
        for claim in ["", "unknown", "a.b"] {
            let request = ReleaseJointsRequest { claim: claim.into(), ..Default::default() };
            let message = Bytes::from(request.encode_to_vec());
            let sealed = seal(method, message.clone());
            assert_eq!((sealed.message, sealed.secret), (message, None));
        }
    }
}
