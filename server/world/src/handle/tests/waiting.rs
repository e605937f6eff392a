//! Waits for the threads that read descriptions and files are counted by client.

use bytes::Bytes;
use simd_model::robot::Sha256;

use super::*;
use crate::handle::testing::{crowd, waits};

/// They continue in separate tasks.
#[tokio::test]
async fn uploads_and_recordings_wait_as_those_of_their_client() {
    let handle = paused();
    let [busy, other] = ["busy", "other"].map(|name| Account::Session(name.into()));
    let crowd = crowd(&handle, &busy).await;
    let data = Bytes::from_static(b"a file");
    let (sha256, total) = (Sha256::of(&data), data.len() as u64);
    let [of_busy, of_other] = [&busy, &other].map(|account| handle.of_call(CallContext::of(account.clone())));
    let upload = |handle: &SimHandle| {
        let (handle, data) = (handle.clone(), data.clone());
        async move { handle.upload(FilePart { sha256, total, offset: 0, data }).await }
    };
    let record = |handle: &SimHandle| {
        let handle = handle.clone();
        let (name, state_period, keep_last, max_bytes, max_duration) = Default::default();
        let request = RecordingRequest { name, state_period, keep_last, max_bytes, max_duration };
        async move { handle.start_recording(request).await }
    };
    let expected = "of one client would be 33, and the limit is 32";
    let refused = upload(&of_busy).await.unwrap_err().to_string();
    assert!(refused.contains(expected), "{refused}");
    let refused = record(&of_busy).await.unwrap_err().to_string();
    assert!(refused.contains(expected), "{refused}");

    let mut uploaded = Box::pin(upload(&of_other));
    waits(uploaded.as_mut()).await;
    let mut recorded = Box::pin(record(&of_other));
    waits(recorded.as_mut()).await;
    drop(crowd);
    assert_eq!(uploaded.await.unwrap(), total);
    let refused = recorded.await.unwrap_err();
    assert!(matches!(refused, CallError::RecordingNotPossible { .. }), "{refused}");
}
