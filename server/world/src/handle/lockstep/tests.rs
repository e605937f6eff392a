//! Members that ask, without a transport.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::{Context, Poll, Waker};

use super::super::testing::paused;
use super::*;

/// Returns on both of two threads at nearly the same time.
fn meet(arrived: &AtomicUsize) {
    arrived.fetch_add(1, Ordering::SeqCst);
    while arrived.load(Ordering::SeqCst) & 1 == 1 {
        std::thread::yield_now();
    }
}

/// Returns the refusals of two simultaneous requests.
fn ask_twice_at_once(handle: &SimHandle, member: &str) -> Vec<String> {
    let (begun, asked) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let ask = || {
        let mut call = std::pin::pin!(handle.step_together(member, None, 1));
        meet(&begun);
        let polled = call.as_mut().poll(&mut Context::from_waker(Waker::noop()));
        // A request whose caller disconnects does not count as asked.
        meet(&asked);
        match polled {
            Poll::Ready(answer) => Some(answer.unwrap_err().to_string()),
            Poll::Pending => None,
        }
    };
    std::thread::scope(|scope| {
        let threads = [scope.spawn(ask), scope.spawn(ask)];
        threads.into_iter().filter_map(|thread| thread.join().unwrap()).collect()
    })
}

#[tokio::test]
async fn one_of_two_simultaneous_requests_of_a_member_is_refused() {
    let handle = paused();
    let timeout = Duration::from_secs(3600);
    let (member, _) = handle.join_lockstep("twice", timeout, None).unwrap();
    // The world waits for this member.
    let _other = handle.join_lockstep("other", timeout, None).unwrap();
    for _ in 0..500 {
        let refused = ask_twice_at_once(&handle, &member);
        assert_eq!(refused.len(), 1, "{refused:?}");
        assert!(refused[0].contains("a member asks again only after its answer"), "{refused:?}");
    }
}

/// A program may keep the future of a call and not poll it.
#[tokio::test(start_paused = true)]
async fn a_member_that_does_not_wait_for_its_targets_keeps_no_other_waiting() {
    let handle = paused();
    let timeout = Duration::from_secs(10);
    let (kept, _) = handle.join_lockstep("kept", timeout, None).unwrap();
    let (other, _) = handle.join_lockstep("other", 100 * timeout, None).unwrap();
    let mut call = std::pin::pin!(handle.step_together(&kept, Some(SetTargets::default()), 1));
    assert!(call.as_mut().poll(&mut Context::from_waker(Waker::noop())).is_pending());
    let stepped = handle.step_together(&other, None, 1).await.unwrap();
    assert_eq!(stepped.done.applied.at.step, 1);
}
