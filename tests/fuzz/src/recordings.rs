//! A recording of an untrusted origin: it is replayed as far as possible, or refused with a sentence.

use simd_world::recording::{Replayed, replay};

/// A replay of any file ends, and reports its result. Returns true if anything was replayed.
pub fn recordings(bytes: &[u8]) -> bool {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let Ok(runtime) = runtime else { return false };
    match runtime.block_on(replay(|| Ok(bytes), None)) {
        Ok(Replayed { difference, ends_early, damaged, steps, .. }) => {
            let sentences = [difference, ends_early, damaged];
            assert!(sentences.iter().flatten().all(|said| !said.is_empty()), "what is wrong is said");
            steps > 0
        }
        Err(refused) => {
            assert!(!refused.is_empty(), "a refusal says why");
            false
        }
    }
}
