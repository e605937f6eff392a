//! Which claim a call acts for. Over gRPC no other client can read the call, and it has the claim's secret.
//! Over Zenoh any session may read it: it has the claim's id, and the front-end saw whether it is proven.

use simd_core::simulation::command::ClaimId;
use simd_proto::proof;
use tonic::Extensions;

use simd_world::SimHandle;
use simd_world::handle::{CallError, Unproven};

/// What a message that others may have heard proves of claims. A front-end of such messages puts it
/// among the extensions of each request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Proven {
    /// It has no proof.
    Nothing,
    /// Its sender holds this claim.
    Claim(ClaimId),
    /// Its proof is not good.
    Refused(Unproven),
}

/// How the claims of one call are read.
#[derive(Clone, Copy, Debug)]
pub enum Presented {
    /// By their secret.
    Secret,
    /// By their id, where it is proven.
    Id(Proven),
}

impl Presented {
    /// As the front-end has it.
    pub(crate) fn of(extensions: &Extensions) -> Self {
        extensions.get().copied().map_or(Self::Secret, Self::Id)
    }

    /// The claim that a request names, or none where it names none.
    ///
    /// # Errors
    /// Returns an error if there is no such claim, or the caller does not prove that it is its own.
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
