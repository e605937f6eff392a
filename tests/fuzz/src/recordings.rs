//! A recording of an untrusted origin: it is replayed as far as it goes, or refused in a sentence.

use simd_world::recording::{Replayed, replay};

/// Whatever is in a file, a replay of it ends, and says what became of it. Says whether anything was replayed.
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
