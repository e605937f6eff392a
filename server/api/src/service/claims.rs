//! The claim that a call acts for. Over gRPC no other client can read the call, and it carries the claim's
//! secret. Over Zenoh any session may read it: it carries the claim's id, and the front-end has checked its
//! proof.

use simd_core::simulation::command::ClaimId;
use simd_proto::proof;
use tonic::Extensions;

use simd_world::SimHandle;
use simd_world::handle::{CallError, Unproven};

/// Proof of a claim in a message that other clients may have heard. A front-end with such messages adds it to
/// the extensions of each request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proven {
    /// No proof.
    Nothing,
    /// The sender holds this claim.
    Claim(ClaimId),
    /// The proof is invalid.
    Refused(Unproven),
}

/// Form in which a call names its claim.
#[derive(Clone, Copy, Debug)]
pub enum Presented {
    /// By its secret.
    Secret,
    /// By its id, if proven.
    Id(Proven),
}

impl Presented {
    /// Returns the form that the front-end chose.
    pub(crate) fn of(extensions: &Extensions) -> Self {
        extensions.get().copied().map_or(Self::Secret, Self::Id)
    }

    /// Returns the claim that a request names, if any.
    ///
    /// # Errors
    /// Returns an error if the claim does not exist, or the caller does not prove that it holds it.
    pub fn claim(self, handle: &SimHandle, named: &str) -> Result<Option<ClaimId>, CallError> {
        if named.is_empty() {
            return Ok(None);
        }
        match self {
            Self::Secret => handle.claim_of(named).map(Some),
            Self::Id(_) if proof::id_of(named).is_some() => Err(CallError::InvalidValue {
                element: "claim".into(),
                value: "a secret".into(),
                expected: format!(
                    "over Zenoh it must be the claim's id, which is before the dot, with a line {} in the \
                     attachment that proves it: others can read what is sent",
                    proof::PROOF_HEADER
                ),
            }),
            Self::Id(Proven::Claim(claim)) if claim.0.to_string() == named => Ok(Some(claim)),
            Self::Id(Proven::Refused(unproven)) => Err(unproven.into()),
            Self::Id(Proven::Nothing | Proven::Claim(_)) => Err(Unproven::NotFound.into()),
        }
    }
}
