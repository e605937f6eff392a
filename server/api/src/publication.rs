//! Messages that are published while a client subscribes: the same on every transport.

use std::sync::Arc;
use std::time::Duration;

use prost::Message as _;
use simd_proto::v1;
use simd_world::SimHandle;
use simd_world::handle::{CallError, Published, RunState};

use crate::convert::{Selection, to_proto};

/// Time between two publications of statistics.
pub const STATISTICS: Duration = Duration::from_millis(100);
/// Time after which values that have not changed are published again, for late subscribers.
pub const UNCHANGED: Duration = Duration::from_secs(1);
/// Longest wait for the next step of a playing world.
const FRESH: Duration = Duration::from_millis(2);

/// Encodes the message of a robot, given by its index in a state. Returns `None` if the state has fewer
/// robots.
pub type Encode = fn(&Published, usize) -> Option<Vec<u8>>;

/// Encodes the states of a robot's joints.
pub fn joint_states(state: &Published, robot: usize) -> Option<Vec<u8>> {
    Selection::whole_robot(state, robot).map(|states| states.encode_to_vec())
}

/// Encodes the poses of a robot's links.
pub fn link_poses(state: &Published, robot: usize) -> Option<Vec<u8>> {
    let entity = state.state.world.entities.get(robot)?;
    let robots = vec![to_proto::entity::link_poses(&state.state, robot, entity)];
    let stamp = Some(to_proto::stamp::published(state));
    Some(v1::GetLinkPosesResponse { stamp, robots }.encode_to_vec())
}

/// Returns the first fresh state after the state `sent`. While the world plays it waits for the next step,
/// since the newest state may be a step old.
///
/// # Errors
/// Returns an error if the world ends.
pub async fn newest(handle: &SimHandle, sent: u64) -> Result<Arc<Published>, CallError> {
    let there = handle.newest();
    if there.sequence > sent && there.statistics.state == RunState::Playing {
        return handle.newer_than(there.sequence, Some(FRESH)).await;
    }
    handle.newer_than(sent, Some(UNCHANGED)).await
}
