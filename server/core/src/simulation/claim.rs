//! Claims: robots, joints and the world taken for one client.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// Which claim. It is no secret: that a caller holds the claim is proven before a command is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
pub struct ClaimId(pub u64);

/// What one client has taken.
#[derive(Clone, Debug)]
pub(super) struct Claim {
    /// What commands must come with.
    pub id: ClaimId,
    /// Who claims, for people.
    pub holder: Arc<str>,
    /// A claim with a higher one takes over from it.
    pub priority: u32,
}

impl Claim {
    /// Whether this is not the claim that a command came with.
    pub(in crate::simulation) fn is_of_another(&self, claim: Option<ClaimId>) -> bool {
        claim != Some(self.id)
    }
}

/// Who holds a robot and its joints.
#[derive(Clone, Debug, Default)]
pub(super) struct RobotClaims {
    /// Of the whole robot; then of each of its actuated joints too.
    pub whole: Option<Arc<Claim>>,
    /// One for each joint of the model.
    pub joints: Vec<Option<Arc<Claim>>>,
}

impl RobotClaims {
    /// Of a robot with so many joints, of which none is claimed.
    pub(in crate::simulation) fn none(joints: usize) -> Self {
        Self { whole: None, joints: vec![None; joints] }
    }

    /// The claim on a joint. A joint that is not actuated is the whole robot's.
    pub(in crate::simulation) fn of_joint(&self, joint: usize) -> Option<&Arc<Claim>> {
        self.joints.get(joint).and_then(Option::as_ref).or(self.whole.as_ref())
    }

    /// All of them, some more than once.
    pub(in crate::simulation) fn iter(&self) -> impl Iterator<Item = &Arc<Claim>> {
        self.whole.iter().chain(self.joints.iter().flatten())
    }

    /// The claim of another client than the sender of a command.
    pub(in crate::simulation) fn of_another(&self, claim: Option<ClaimId>) -> Option<&Arc<Claim>> {
        self.iter().find(|held| held.is_of_another(claim))
    }

    /// Ends a claim: the joints that it was on, and whether there was anything.
    pub(in crate::simulation) fn end(&mut self, claim: ClaimId) -> (Vec<usize>, bool) {
        let is_it = |held: &Option<Arc<Claim>>| held.as_ref().is_some_and(|held| held.id == claim);
        let joints: Vec<usize> = (0..self.joints.len()).filter(|&joint| is_it(&self.joints[joint])).collect();
        joints.iter().for_each(|&joint| self.joints[joint] = None);
        let was_whole = is_it(&self.whole);
        if was_whole {
            self.whole = None;
        }
        let any = was_whole || !joints.is_empty();
        (joints, any)
    }
}
