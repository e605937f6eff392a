//! Claims on joints.

use std::sync::Arc;

/// Which claim on joints. It is no secret: that a caller holds the claim is proven before a command is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClaimId(pub u64);

/// Joints taken for one client.
#[derive(Clone, Debug)]
pub(super) struct Claim {
    /// What targets must carry.
    pub id: ClaimId,
    /// Who claims, for people.
    pub holder: Arc<str>,
}
