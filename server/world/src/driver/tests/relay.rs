//! A thread that answers and announces in place of the physics thread.

use super::*;

fn bench() -> Bench {
    let mut bench = Bench::paused();
    let Link { state_cell, events, sensors, .. } = bench.link.clone();
    bench.driver.relay = Some(Relay::start((RealTime::default(), 256), state_cell, events, sensors).unwrap());
    bench
}

#[test]
fn commands_are_answered_also_those_that_are_left_at_the_end() {
    let mut bench = bench();
    let answer = bench.command(nothing());
    bench.iterations(1);
    assert!(answer.blocking_recv().unwrap().is_ok());
    let answer = bench.command(refused());
    bench.iterations(1);
    assert!(answer.blocking_recv().unwrap().is_err());
    let answers: Vec<_> = (0..600).map(|_| bench.command(nothing())).collect();
    bench.iterations(600);
    drop(bench.driver);
    for answer in answers {
        assert!(answer.blocking_recv().unwrap().is_ok());
    }
}

#[test]
fn all_other_calls_are_answered_too() {
    let mut bench = bench();
    let physics = bench.post(|reply| Event::SetPhysics {
        change: PhysicsChange::default(),
        pace: PaceChange::default(),
        claim: None,
        sender: None,
        reply,
    });
    let whole = bench.post(|reply| Event::WholeState { reply });
    let recorded = bench.post(|reply| Event::Record { queue: None, reply });
    let (refused, stepped) = (bench.steps_of("missing", 1), bench.steps(1));
    bench.iterations(6);
    assert!(physics.blocking_recv().unwrap().is_ok());
    assert!(whole.blocking_recv().unwrap().is_ok());
    assert!(recorded.blocking_recv().unwrap().is_ok());
    assert!(refused.blocking_recv().unwrap().is_err());
    assert_eq!(stepped.blocking_recv().unwrap().unwrap().done.applied.at.step, 1);
    let (superseded, paused) = (bench.steps(1_000_000), bench.state(RunState::Paused));
    bench.iterations(2);
    assert!(paused.blocking_recv().unwrap().is_ok());
    assert!(matches!(superseded.blocking_recv().unwrap(), Err(CallError::Superseded { .. })));
}

#[tokio::test]
async fn readers_that_wait_are_woken() {
    let mut bench = bench();
    let state_cell = Arc::clone(&bench.link.state_cell);
    let announcing = Arc::clone(&state_cell);
    tokio::spawn(async move { announcing.announce().await });
    for _ in 0..100 {
        let (state_cell, newest) = (Arc::clone(&state_cell), state_cell.newest().sequence);
        let reader = tokio::spawn(async move { state_cell.newer_than(newest).await.sequence });
        tokio::task::yield_now().await;
        drop(bench.command(nothing()));
        bench.iterations(1);
        let woken = tokio::time::timeout(std::time::Duration::from_secs(20), reader).await;
        assert_eq!(woken.expect("it is woken").unwrap(), newest + 1);
    }
}
