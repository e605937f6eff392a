//! Sources of joint targets, which come with each command and are published with each state. No step reads
//! them, so they are neither saved nor part of a fingerprint.

use std::sync::Arc;
use std::time::Duration;

/// Source of a target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TargetSource {
    /// Name that the client gave; empty if none.
    pub client: Arc<str>,
    /// Time on the clock of the sender of commands.
    pub at: Duration,
}

/// Source of the target of each joint of a robot's model; empty if no target was set.
pub type RobotTargetSources = Arc<Vec<Option<Arc<TargetSource>>>>;
