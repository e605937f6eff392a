//! What waits for the threads that read descriptions and files, and for whom.

use std::pin::Pin;
use std::sync::mpsc::{Sender, channel};
use std::task::{Context, Waker};

use bytes::Bytes;
use simd_model::robot::Sha256;

use super::*;

/// Descriptions and files that are read at one time.
const READS: usize = 2;

/// Reads that go on until this is dropped, as many as there may be.
pub(crate) struct Reading {
    _ends: Vec<Sender<()>>,
}

/// Takes all threads that read.
pub(crate) async fn reading(handle: &SimHandle) -> Reading {
    let mut ends = Vec::new();
    for _ in 0..READS {
        let (end, is_ended) = channel::<()>();
        let (begun, has_begun) = oneshot::channel();
        let handle = handle.clone();
        let read = move || {
            let _ = begun.send(());
            let _ = is_ended.recv();
        };
        tokio::spawn(async move { handle.loader().off_thread(read).await });
        has_begun.await.unwrap();
        ends.push(end);
    }
    Reading { _ends: ends }
}

type Read = Pin<Box<dyn Future<Output = Result<(), CallError>> + Send>>;

/// All that one client may have waiting, until this is dropped.
pub(crate) struct Crowd {
    _waiting: Vec<Read>,
    _reading: Reading,
}

/// Has a client wait for threads that read, as often as it may.
pub(crate) async fn crowd(handle: &SimHandle, client: &Account) -> Crowd {
    let reading = reading(handle).await;
    let mut waiting: Vec<Read> = Vec::new();
    for _ in 0..handle.info().limits.waiting_descriptions_of_client {
        let handle = handle.clone();
        let read = async move { handle.loader().off_thread(|| ()).await };
        let mut read: Read = Box::pin(client.clone().scope(read));
        assert!(is_waiting(read.as_mut()));
        waiting.push(read);
    }
    Crowd { _waiting: waiting, _reading: reading }
}

/// Polls once.
pub(crate) fn is_waiting<F: Future + ?Sized>(work: Pin<&mut F>) -> bool {
    work.poll(&mut Context::from_waker(Waker::noop())).is_pending()
}

/// Asserts that something waits, also once each task that it began was polled.
pub(crate) async fn waits<F: Future + ?Sized>(mut work: Pin<&mut F>) {
    for _ in 0..8 {
        assert!(is_waiting(work.as_mut()));
        tokio::task::yield_now().await;
    }
}

/// They go on in tasks of their own, which do not know by themselves whose they are.
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
