//! A thread that answers and announces in the place of the physics thread.

use super::*;

fn bench() -> Bench {
    let mut bench = Bench::paused();
    let Link { board, events, sensors, .. } = bench.link.clone();
    bench.driver.relay = Some(Relay::start(RealTime::default(), board, events, sensors).unwrap());
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

#[tokio::test]
async fn readers_that_wait_are_woken() {
    let mut bench = bench();
    let board = Arc::clone(&bench.link.board);
    let announcing = Arc::clone(&board);
    tokio::spawn(async move { announcing.announce().await });
    for _ in 0..100 {
        let (board, newest) = (Arc::clone(&board), board.newest().sequence);
        let reader = tokio::spawn(async move { board.newer_than(newest).await.sequence });
        tokio::task::yield_now().await;
        drop(bench.command(nothing()));
        bench.iterations(1);
        let woken = tokio::time::timeout(std::time::Duration::from_secs(20), reader).await;
        assert_eq!(woken.expect("it is woken").unwrap(), newest + 1);
    }
}
