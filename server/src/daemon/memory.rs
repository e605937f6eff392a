//! Saves the world when the memory limit comes near: the daemon ends beyond it, without a drain.

use std::time::Duration;

use super::autosave;
use crate::config::Autosave;
use simd_world::handle::SimHandle;
use simd_world::process;

/// Time between two looks at the memory.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);

/// Looks until the daemon drains. Saves once each time that the memory becomes full.
pub(super) async fn watch(handle: SimHandle, autosave: Option<Autosave>) {
    let limit = handle.info().limits.memory_limit;
    let draining = handle.draining();
    let mut looks = tokio::time::interval(CHECK_INTERVAL);
    looks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let mut was_full = false;
    while draining.run_until_cancelled(looks.tick()).await.is_some() {
        let full = process::full_heap(limit);
        if let Some(allocated) = full.filter(|_| !was_full) {
            tracing::error!(allocated, limit, "the memory is nearly full: calls that take more are refused");
            if let Some(autosave) = &autosave {
                autosave::last(&handle, autosave).await;
            }
        }
        was_full = full.is_some();
    }
}
