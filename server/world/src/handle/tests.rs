//! The handle on a running driver.

mod waiting;

use simd_core::Command;
use simd_core::simulation::command::{ClaimRequest, PhysicsChange, ReleaseCause};
use tokio::time::Instant;

use super::testing::{driven, handle, paused};
use super::*;
use crate::driver::fake_world::{FakeWorld, nothing};

#[tokio::test]
async fn a_command_is_done_and_its_state_can_be_read() {
    let handle = paused();
    let before = handle.newest().sequence;
    let done = handle.command(nothing()).await.unwrap();
    assert!(done.sequence > before);
    assert!(handle.newest().sequence >= done.sequence);
    assert_eq!(handle.step(10).await.unwrap().applied.at.step, 10);
    assert_eq!(handle.statistics().iterations, 10);
}

/// Returns a handle whose callers drive.
fn by_callers(world: FakeWorld) -> SimHandle {
    let state = RunState::Paused;
    driven(world, driver::Config { state, callers_drive: true, step_threads: 1, ..Default::default() }).0
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn callers_that_drive_have_all_of_their_steps_done() {
    let handle = by_callers(FakeWorld::default());
    let callers = (0..8).map(|_| {
        let handle = handle.clone();
        tokio::spawn(async move {
            for _ in 0..100 {
                handle.step(1).await.unwrap();
                handle.command(nothing()).await.unwrap();
            }
        })
    });
    for caller in callers.collect::<Vec<_>>() {
        caller.await.unwrap();
    }
    assert_eq!(handle.newest().state.at.step, 800);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn callers_that_look_for_their_answers_get_them_and_the_reason_of_the_end() {
    let (state, spin_us) = (RunState::Paused, 200);
    let config = driver::Config { state, spin_us, ..Default::default() };
    let handle = driven(FakeWorld::panicking_at(500), config).0;
    let callers = (0..4).map(|_| {
        let handle = handle.clone();
        tokio::spawn(async move {
            for _ in 0..100 {
                handle.step(1).await.unwrap();
                handle.command(nothing()).await.unwrap();
            }
        })
    });
    for caller in callers.collect::<Vec<_>>() {
        caller.await.unwrap();
    }
    assert_eq!(handle.newest().state.at.step, 400);
    for error in [handle.step(200).await.unwrap_err(), handle.step(1).await.unwrap_err()] {
        assert!(error.to_string().contains("on purpose"), "{error}");
    }
}

#[test]
fn a_caller_looks_for_no_longer_than_it_may() {
    let (reply, mut answer) = oneshot::channel();
    assert_eq!(look(&mut answer, Duration::from_micros(50)), Err(TryRecvError::Empty));
    reply.send(1).unwrap();
    assert_eq!(look(&mut answer, Duration::MAX), Ok(1));
    let (reply, mut answer) = oneshot::channel::<u32>();
    drop(reply);
    assert_eq!(look(&mut answer, Duration::MAX), Err(TryRecvError::Closed));
}

#[tokio::test]
async fn a_world_that_callers_drive_plays_and_is_paused_again() {
    let handle = by_callers(FakeWorld::default());
    let before = handle.newest().sequence;
    handle.set_state(RunState::Playing).await.unwrap();
    let played = handle.newer_than(before + 5, None).await.unwrap();
    assert!(played.state.at.step > 0);
    let paused = handle.set_state(RunState::Paused).await.unwrap();
    assert_eq!(handle.step(1).await.unwrap().applied.at.step, paused.applied.at.step + 1);
}

#[tokio::test]
async fn a_world_that_panics_under_a_caller_fails_every_call_with_the_reason() {
    let handle = by_callers(FakeWorld::panicking_at(3));
    let waiting = handle.newer_than(1_000, None);
    let (during, waiting) = tokio::join!(handle.step(10), waiting);
    let after = handle.command(nothing()).await;
    for error in [during.unwrap_err(), waiting.unwrap_err(), after.unwrap_err()] {
        assert!(error.to_string().contains("on purpose"), "{error}");
    }
    assert!(handle.driver_ended().is_cancelled());
}

#[tokio::test]
async fn a_world_that_callers_drive_ends_when_it_is_asked_to() {
    let handle = by_callers(FakeWorld::default());
    handle.end_driver();
    handle.driver_ended().cancelled().await;
    assert!(matches!(handle.command(nothing()).await, Err(CallError::ShuttingDown)));
}

#[tokio::test]
async fn a_world_that_panics_fails_every_call_with_the_reason() {
    let (handle, _) = handle(FakeWorld::panicking_at(3), RunState::Paused);
    let waiting = handle.newer_than(1_000, None);
    let (during, waiting) = tokio::join!(handle.step(10), waiting);
    let after = handle.command(nothing()).await;
    for error in [during.unwrap_err(), waiting.unwrap_err(), after.unwrap_err()] {
        assert!(
            matches!(&error, CallError::Internal { message } if message.contains("on purpose")),
            "{error}"
        );
    }
    assert!(handle.driver_ended().is_cancelled());
    assert!(handle.driver_failure().is_some());
}

#[tokio::test]
async fn a_world_whose_end_panics_too_leaves_no_caller_waiting() {
    let (handle, _) = handle(FakeWorld::panicking_twice_at(3), RunState::Paused);
    let during = handle.step(10).await.unwrap_err();
    handle.driver_ended().cancelled().await;
    assert!(during.to_string().contains("on purpose"), "{during}");
    assert!(handle.driver_failure().is_some_and(|failure| failure.contains("on purpose")));
}

#[tokio::test]
async fn a_world_that_only_fails_to_end_is_a_failure_of_the_driver() {
    let (handle, _) = handle(FakeWorld::panicking_twice_at(u64::MAX), RunState::Paused);
    handle.end_driver();
    handle.driver_ended().cancelled().await;
    assert!(handle.driver_failure().is_some_and(|failure| failure.contains("cleaned up")));
}

#[tokio::test]
async fn after_the_end_calls_are_refused_as_shutting_down() {
    let handle = paused();
    handle.end_driver();
    handle.driver_ended().cancelled().await;
    assert!(matches!(handle.command(nothing()).await, Err(CallError::ShuttingDown)));
    assert!(matches!(handle.step(1).await, Err(CallError::ShuttingDown)));
}

#[tokio::test]
async fn draining_ends_what_waits() {
    let handle = paused();
    let drain = async { handle.draining().cancel() };
    let (state, events, ()) = tokio::join!(
        handle.newer_than(1_000, None),
        handle.next_events(1_000, Duration::from_secs(3600)),
        drain,
    );
    assert!(matches!(state, Err(CallError::ShuttingDown)));
    assert!(matches!(events, Err(CallError::ShuttingDown)));
    let steps = handle.step(handle.info().limits.steps).await;
    assert!(matches!(steps, Err(CallError::ShuttingDown)));
}

#[tokio::test(start_paused = true)]
async fn waiting_in_vain_gives_the_newest_there_is() {
    let handle = paused();
    let newest = handle.newest().sequence;
    let waited = handle.newer_than(newest, Some(Duration::from_secs(60))).await.unwrap();
    assert_eq!(waited.sequence, newest);
}

#[tokio::test]
async fn steps_and_factors_out_of_bounds_are_refused() {
    let handle = paused();
    assert!(matches!(handle.step(0).await, Err(CallError::InvalidValue { .. })));
    assert!(matches!(handle.step(u64::MAX).await, Err(CallError::LimitExceeded { .. })));
    for factor in [0.0, -1.0, f64::NAN, 1001.0] {
        let pace = Pace::AsFastAsPossible { factor }.into();
        let refused = handle.set_physics(PhysicsChange::default(), pace).await;
        assert!(matches!(refused, Err(CallError::InvalidValue { .. })), "{factor}");
    }
    let change = PhysicsChange { time_step: Some(0.01), ..PhysicsChange::default() };
    let bad = Pace::RealTime { factor: 0.0 }.into();
    assert!(handle.set_physics(change, bad).await.is_err());
    assert_eq!(handle.physics().0.time_step, 0.001, "all or nothing");
    let (_, settings, pace) =
        handle.set_physics(change, Pace::RealTime { factor: 0.5 }.into()).await.unwrap();
    assert_eq!(handle.physics(), (settings, pace));
}

/// The slower one's last part arrives while the faster one's file is being hashed.
#[tokio::test]
async fn two_uploads_of_the_same_file_at_once_both_succeed() {
    let handle = paused();
    let data = bytes::Bytes::from_static(b"a file in two parts");
    let sha256 = simd_model::robot::Sha256::of(&data);
    let total = data.len() as u64;
    let (first, second) = (data.slice(..8), data.slice(8..));
    for _ in 0..2 {
        assert_eq!(
            handle.upload(FilePart { sha256, total, offset: 0, data: first.clone() }).await.unwrap(),
            8
        );
    }
    let mut faster =
        std::pin::pin!(handle.upload(FilePart { sha256, total, offset: 8, data: second.clone() }));
    let polled = std::future::poll_fn(|cx| std::task::Poll::Ready(faster.as_mut().poll(cx))).await;
    assert!(polled.is_pending(), "it is being checked");
    let slower = handle.upload(FilePart { sha256, total, offset: 8, data: second.clone() });
    let (faster, slower) = tokio::join!(faster, slower);
    assert_eq!((faster.unwrap(), slower.unwrap()), (total, total));
    assert_eq!(handle.asset(&sha256).unwrap(), data);
}

/// No caller waits forever if the bytes do not match the hash, or their sender has disconnected.
#[tokio::test]
async fn a_second_upload_outlives_a_first_that_fails() {
    let handle = paused();
    let good = bytes::Bytes::from_static(b"right");
    let sha256 = simd_model::robot::Sha256::of(&good);
    {
        let bad = handle.upload(FilePart {
            sha256,
            total: 5,
            offset: 0,
            data: bytes::Bytes::from_static(b"wrong"),
        });
        let mut bad = std::pin::pin!(bad);
        let polled = std::future::poll_fn(|cx| std::task::Poll::Ready(bad.as_mut().poll(cx))).await;
        assert!(polled.is_pending());
    }
    assert_eq!(handle.upload(FilePart { sha256, total: 5, offset: 0, data: good.clone() }).await.unwrap(), 5);
    assert_eq!(handle.asset(&sha256).unwrap(), good);
}

#[tokio::test]
async fn a_lease_out_of_bounds_is_refused() {
    let handle = paused();
    for lease in [Duration::ZERO, Duration::from_secs(3601)] {
        let refused = handle.claim(ClaimRequest::default(), lease, None).await;
        assert!(matches!(refused, Err(CallError::InvalidValue { .. })));
    }
}

/// While the test waits for the driver's thread, tokio's paused clock advances to the next timer
/// automatically: the end of the lease.
#[tokio::test(start_paused = true)]
async fn a_claim_that_is_not_used_lapses_and_is_released() {
    let (handle, applied) = handle(FakeWorld::default(), RunState::Paused);
    let begun = Instant::now();
    let (claim, _) = handle.claim(ClaimRequest::default(), Duration::from_secs(10), None).await.unwrap();
    let claim = handle.claim_of(&claim).unwrap();
    let mut released = false;
    while !released {
        // The release publishes a state.
        let newest = handle.newest().sequence;
        let wait = handle.newer_than(newest, Some(Duration::from_secs(1)));
        let _ = wait.await.unwrap();
        let applied = applied.lock().unwrap();
        released = applied.iter().any(
            |(_, command)| matches!(command, Command::Release { claim: of, cause: ReleaseCause::Lapsed } if *of == claim),
        );
    }
    assert!(begun.elapsed() >= Duration::from_secs(10));
}
