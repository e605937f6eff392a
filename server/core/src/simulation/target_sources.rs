//! Who set the targets of joints: it comes with each command and is shown with each state. No step reads it, so that
//! it is neither saved nor part of a fingerprint.

use std::sync::Arc;
use std::time::Duration;

/// Who set a target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TargetSource {
    /// As the client calls itself; empty where it did not say.
    pub client: Arc<str>,
    /// When, on the clock of the sender of commands.
    pub at: Duration,
}

/// Who set the target of each joint of a robot's model; empty where no target was set.
pub type RobotTargetSources = Arc<Vec<Option<Arc<TargetSource>>>>;
