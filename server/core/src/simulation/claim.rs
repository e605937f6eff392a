//! Claims: robots, joints and the world reserved for one client.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// Identifier of a claim. It is not a secret: a caller proves that it holds the claim before a command is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
pub struct ClaimId(pub u64);

/// Claim of one client.
#[derive(Clone, Debug)]
pub(super) struct Claim {
    /// Identifier that commands must come with.
    pub id: ClaimId,
    /// Name of the holder, for people.
    pub holder: Arc<str>,
    /// Priority; a claim with a higher one takes over.
    pub priority: u32,
}

impl Claim {
    /// Returns whether this is not the claim that a command came with.
    pub(in crate::simulation) fn is_of_another(&self, claim: Option<ClaimId>) -> bool {
        claim != Some(self.id)
    }
}

/// Claims of a robot and its joints.
#[derive(Clone, Debug, Default)]
pub(super) struct RobotClaims {
    /// Claim of the whole robot, which then also covers each of its actuated joints.
    pub whole: Option<Arc<Claim>>,
    /// Claims of joints, one for each joint of the model.
    pub joints: Vec<Option<Arc<Claim>>>,
}

impl RobotClaims {
    /// Creates the claims of a robot with this number of joints, none of them claimed.
    pub(in crate::simulation) fn none(joints: usize) -> Self {
        Self { whole: None, joints: vec![None; joints] }
    }

    /// Returns the claim on a joint. A joint that is not actuated belongs to the whole robot.
    pub(in crate::simulation) fn of_joint(&self, joint: usize) -> Option<&Arc<Claim>> {
        self.joints.get(joint).and_then(Option::as_ref).or(self.whole.as_ref())
    }

    /// Returns all claims; some may repeat.
    pub(in crate::simulation) fn iter(&self) -> impl Iterator<Item = &Arc<Claim>> {
        self.whole.iter().chain(self.joints.iter().flatten())
    }

    /// Returns a claim of another client than the sender of a command.
    pub(in crate::simulation) fn of_another(&self, claim: Option<ClaimId>) -> Option<&Arc<Claim>> {
        self.iter().find(|held| held.is_of_another(claim))
    }

    /// Ends a claim. Returns the joints that it covered, and whether it covered anything.
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
