//! Sources of targets, updated with commands and with changes of robots.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::simulation::Simulation;
use crate::simulation::published_state::WorldLayout;
use crate::simulation::target_sources::{RobotTargetSources, TargetSource};

impl Simulation {
    /// Records the source of targets for these joints, each by the indices of its robot and of the joint in
    /// the model.
    pub(in crate::simulation) fn targets_were_set(
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

    /// Clears all sources after a state before the targets was restored.
    pub(in crate::simulation) fn targets_were_put_back(&mut self) {
        self.target_sources = Arc::new(vec![RobotTargetSources::default(); self.entities.len()]);
    }

    /// Updates the sources when robots from this index on were added, deleted or reloaded, which makes other
    /// robots of them.
    pub(in crate::simulation) fn keep_target_sources(&mut self, before: &WorldLayout, first: usize) {
        let versions = before.entities.iter().map(|entity| entity.version);
        let known = versions.zip(self.target_sources.iter().cloned()).skip(first);
        let mut known: BTreeMap<u64, _> = known.collect();
        let mut sources = self.target_sources[..first].to_vec();
        let later = self.entities[first..].iter();
        sources.extend(later.map(|entity| known.remove(&entity.version).unwrap_or_default()));
        self.target_sources = Arc::new(sources);
    }
}
