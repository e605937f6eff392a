//! Waits for the threads that read descriptions and files are counted by client.

use bytes::Bytes;
use simd_model::robot::Sha256;

use super::*;
use crate::handle::testing::{crowd, waits};

/// They continue in separate tasks, which do not inherit the client's account.
#[tokio::test]
async fn uploads_and_recordings_wait_as_those_of_their_client() {
    let handle = paused();
    let [busy, other] = ["busy", "other"].map(|name| Account::Session(name.into()));
    let crowd = crowd(&handle, &busy).await;
    let data = Bytes::from_static(b"a file");
    let (sha256, total) = (Sha256::of(&data), data.len() as u64);
    let upload = || handle.upload(sha256, total, 0, data.clone());
    let record = || {
        let (name, state_period, keep_last, max_bytes, max_duration) = Default::default();
        handle.start_recording(RecordingRequest { name, state_period, keep_last, max_bytes, max_duration })
    };
    let expected = "of one client would be 33, and the limit is 32";
    let refused = busy.clone().scope(upload()).await.unwrap_err().to_string();
    assert!(refused.contains(expected), "{refused}");
    let refused = busy.scope(record()).await.unwrap_err().to_string();
    assert!(refused.contains(expected), "{refused}");

    let mut uploaded = Box::pin(other.clone().scope(upload()));
    waits(uploaded.as_mut()).await;
    let mut recorded = Box::pin(other.scope(record()));
    waits(recorded.as_mut()).await;
    drop(crowd);
    assert_eq!(uploaded.await.unwrap(), total);
    let refused = recorded.await.unwrap_err();
    assert!(matches!(refused, CallError::RecordingNotPossible { .. }), "{refused}");
}
