//! Who set the targets of joints: it comes with each command and is shown with each state. No step reads it, so that
//! it is neither saved nor part of a fingerprint.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use super::Simulation;
use super::published_state::WorldLayout;

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

impl Simulation {
    /// Targets of these joints, each by its robot's index and its own in the model, were set.
    pub(super) fn targets_were_set(
        &mut self,
        joints: impl IntoIterator<Item = (usize, usize)>,
        source: Option<&Arc<TargetSource>>,
    ) {
        let sources = Arc::make_mut(&mut self.target_sources);
        for (robot, joint) in joints {
            let (Some(sources), Some(entity)) = (sources.get_mut(robot), self.entities.get(robot)) else {
                continue;
            };
            let sources = Arc::make_mut(sources);
            sources.resize(entity.model.joints.len(), None);
            if let Some(slot) = sources.get_mut(joint) {
                *slot = source.cloned();
            }
        }
    }

    /// Targets were put back to where they were before they were set.
    pub(super) fn targets_were_put_back(&mut self) {
        self.target_sources = Arc::new(vec![RobotTargetSources::default(); self.entities.len()]);
    }

    /// Robots came, went or changed their model, which makes other robots of them.
    pub(super) fn keep_target_sources(&mut self, before: &WorldLayout) {
        let versions = before.entities.iter().map(|entity| entity.version);
        let mut known: BTreeMap<u64, _> = versions.zip(self.target_sources.iter().cloned()).collect();
        let sources = self.entities.iter().map(|entity| known.remove(&entity.version).unwrap_or_default());
        self.target_sources = Arc::new(sources.collect());
    }
}
