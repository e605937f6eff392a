//! Handles for tests: on a fake world, and with clients that wait for threads.

#![allow(clippy::unwrap_used)]

use std::pin::Pin;
use std::sync::Mutex;
use std::sync::mpsc::{Sender, channel};
use std::task::{Context, Waker};

use simd_core::Command;

use super::*;
use crate::account::Account;
use crate::blocking_threads::BlockingThreads;
use crate::driver;
use crate::driver::fake_world::FakeWorld;
use crate::loading::Loader;

/// Commands, each with the step before which it was applied.
pub type Applied = Arc<Mutex<Vec<(u64, Command)>>>;

/// Returns a handle on a fake world, and the commands that reach it.
pub fn handle(world: FakeWorld, state: RunState) -> (SimHandle, Applied) {
    driven(world, driver::Config { state, ..Default::default() })
}

/// Returns a handle on a fake world whose driver has this configuration.
pub fn driven(world: FakeWorld, config: driver::Config) -> (SimHandle, Applied) {
    let applied = world.applied.clone();
    let driver = driver::start(world, config).unwrap();
    let limits = DaemonLimits::default();
    let info = DaemonInfo { name: "test".into(), version: "0", limits };
    (
        SimHandle::new(
            driver,
            Loader::new(limits, &[], BlockingThreads::computing().unwrap()).unwrap(),
            info,
        ),
        applied,
    )
}

/// Returns a handle on a paused fake world.
pub fn paused() -> SimHandle {
    handle(FakeWorld::default(), RunState::Paused).0
}

/// Maximum number of descriptions and files that are read at one time.
const READS: usize = 2;

/// Reads that last until this is dropped, as many as permitted.
pub struct Reading {
    _ends: Vec<Sender<()>>,
}

/// Occupies all reading threads.
pub async fn reading(handle: &SimHandle) -> Reading {
    let mut ends = Vec::new();
    for _ in 0..READS {
        let (end, is_ended) = channel::<()>();
        let (begun, has_begun) = oneshot::channel();
        let handle = handle.clone();
        let read = move || {
            let _ = begun.send(());
            let _ = is_ended.recv();
        };
        tokio::spawn(async move { handle.loader().off_thread(&Account::Process, read).await });
        has_begun.await.unwrap();
        ends.push(end);
    }
    Reading { _ends: ends }
}

type Read = Pin<Box<dyn Future<Output = Result<(), CallError>> + Send>>;

/// All waiting calls that one client may have, until this is dropped.
pub struct Crowd {
    _waiting: Vec<Read>,
    _reading: Reading,
}

/// Makes a client wait for reading threads, as often as it may.
pub async fn crowd(handle: &SimHandle, client: &Account) -> Crowd {
    let reading = reading(handle).await;
    let mut waiting: Vec<Read> = Vec::new();
    for _ in 0..handle.info().limits.waiting_descriptions_of_client {
        let (handle, client) = (handle.clone(), client.clone());
        let mut read: Read = Box::pin(async move { handle.loader().off_thread(&client, || ()).await });
        assert!(is_waiting(read.as_mut()));
        waiting.push(read);
    }
    Crowd { _waiting: waiting, _reading: reading }
}

/// Polls once.
pub fn is_waiting<F: Future + ?Sized>(work: Pin<&mut F>) -> bool {
    work.poll(&mut Context::from_waker(Waker::noop())).is_pending()
}

/// Asserts that a call waits, even after each task that it spawned was polled.
pub async fn waits<F: Future + ?Sized>(mut work: Pin<&mut F>) {
    for _ in 0..8 {
        assert!(is_waiting(work.as_mut()));
        tokio::task::yield_now().await;
    }
}
