//! Conversion of moments to the wire.

use std::time::{SystemTime, UNIX_EPOCH};

use prost_types::Timestamp;
use simd_core::Moment;
use simd_proto::v1;

use simd_world::handle::{Done, Published};

/// Returns the stamp of a published state.
pub fn published(state: &Published) -> v1::Stamp {
    stamp(state.state.at, Some(state.wall_time), state.sequence)
}

/// Returns the stamp of the moment from which a command holds.
pub fn done(done: &Done) -> v1::Stamp {
    stamp(done.applied.at, Some(done.wall_time), done.sequence)
}

/// Returns the stamp of a moment; `wall_time` and `sequence` belong to the state published at that moment, if
/// any.
pub fn stamp(at: Moment, wall_time: Option<SystemTime>, sequence: u64) -> v1::Stamp {
    v1::Stamp {
        epoch: at.epoch,
        step: at.step,
        sim_time: at.sim_time,
        wall_time: wall_time.map(timestamp),
        sequence,
    }
}

/// Converts wall time; a clock before 1970 reads as 1970.
pub fn timestamp(time: SystemTime) -> Timestamp {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    Timestamp {
        seconds: i64::try_from(since.as_secs()).unwrap_or(i64::MAX),
        nanos: i32::try_from(since.subsec_nanos()).unwrap_or(0),
    }
}
