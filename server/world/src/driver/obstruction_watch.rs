//! Notices when contacts begin to keep a driven joint from its target.

use std::collections::BTreeSet;

use simd_core::PublishedState;
use simd_core::simulation::obstructions::Obstruction;

use super::event_log::{BlockedJoint, LogEvent};
use super::main_loop::Driver;
use super::world::World;

/// Simulated seconds between two looks. A joint is reported if two consecutive looks find it blocked.
const INTERVAL: f64 = 0.5;

/// Maximum number of joints that are reported at one look, and that are remembered. More blocked joints mean
/// a crash, which needs no report.
const MAX_JOINTS: usize = 64;

/// A robot's layout version and the index of its joint.
type Key = (u64, usize);

/// Findings of the last look.
#[derive(Debug, Default)]
pub(super) struct ObstructionWatch {
    /// Simulated time of the next look.
    next: f64,
    kept_back: BTreeSet<Key>,
    reported: BTreeSet<Key>,
}

/// A blocked joint, with the index of its robot.
pub(super) type Reported = (usize, Obstruction);

impl ObstructionWatch {
    /// Returns the joints of a state that were blocked at the last look too, and were not reported before.
    pub(super) fn look(&mut self, state: &PublishedState) -> Vec<Reported> {
        let now = state.at.sim_time;
        // Time decreases when a world is reset.
        if now < self.next && self.next - now <= INTERVAL {
            return Vec::new();
        }
        self.next = now + INTERVAL;
        let mut kept_back = BTreeSet::new();
        let mut reports = Vec::new();
        'robots: for (robot, entity) in state.world.entities.iter().enumerate() {
            for obstruction in state.obstructions(robot) {
                let key = (entity.version, obstruction.joint);
                if kept_back.len() >= MAX_JOINTS {
                    break 'robots;
                }
                kept_back.insert(key);
                if self.kept_back.contains(&key) && self.reported.insert(key) {
                    reports.push((robot, obstruction));
                }
            }
        }
        self.reported.retain(|key| kept_back.contains(key));
        self.kept_back = kept_back;
        reports
    }
}

impl<W: World> Driver<W> {
    /// Logs joints that contacts have begun to keep from their targets.
    pub(super) fn log_obstructions(&mut self) {
        let newest = self.publisher.state_cell().newest();
        let state = &newest.state;
        for (robot, found) in self.obstructions.look(state) {
            let (Some(entity), Some(by)) =
                (state.world.entities.get(robot), state.world.entities.get(found.by_robot))
            else {
                continue;
            };
            let joint = entity.model.joints.get(found.joint);
            let blocked = BlockedJoint {
                robot: entity.name.clone(),
                joint: joint.map(|joint| joint.name.clone()).unwrap_or_default(),
                by_robot: by.name.clone(),
                by_link: found.by_link_name(&by.model),
            };
            self.log(LogEvent::JointBlocked { at: state.at, blocked: Box::new(blocked) });
        }
    }
}
