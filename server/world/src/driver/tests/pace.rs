//! Playing, pausing, stopping, and the pace of steps.

use super::*;

#[test]
fn stop_is_a_pause_at_the_start_and_the_first_step_leaves_it() {
    let mut bench = Bench::paused();
    let steps = bench.steps(3);
    bench.iterations(4);
    done(steps);
    let stopped = bench.state(RunState::Stopped);
    bench.iterations(1);
    let at = done(stopped).applied.at;
    assert_eq!((at.epoch, at.step), (1, 0));
    assert_eq!(bench.link.state_cell.newest().statistics.state, RunState::Stopped);
    let _steps = bench.steps(1);
    bench.iterations(2);
    assert_eq!(bench.link.state_cell.newest().statistics.state, RunState::Paused);
    let states = bench.happened().into_iter().filter_map(|event| match event {
        LogEvent::StateChanged { state, .. } => Some(state),
        _ => None,
    });
    assert_eq!(states.collect::<Vec<_>>(), [RunState::Stopped, RunState::Paused]);
}

#[test]
fn physics_and_pace_change_together_and_are_reported_once() {
    let mut bench = Bench::paused();
    let pace = Pace::RealTime { factor: 2.0 };
    let change = PhysicsChange { time_step: Some(0.01), ..PhysicsChange::default() };
    let mut both =
        bench.post(|reply| Event::SetPhysics { change, pace: pace.into(), claim: None, sender: None, reply });
    let change = PhysicsChange::default();
    let free = Pace::AsFastAsPossible { factor: 2.0 };
    let _pace =
        bench.post(|reply| Event::SetPhysics { change, pace: free.into(), claim: None, sender: None, reply });
    bench.iterations(2);
    let (done, settings, in_force) = both.try_recv().unwrap().unwrap();
    assert_eq!((settings.time_step, in_force), (0.01, pace));
    assert!(done.sequence > 1);
    let seen: Vec<_> = bench.happened();
    let at = done.applied.at;
    assert_eq!(
        seen,
        [pace, free].map(|pace| LogEvent::PhysicsChanged { at, settings, pace }),
        "one event each, with the pace of its time"
    );
    assert_eq!(bench.link.state_cell.newest().physics.time_step, 0.01);
}

/// Each names one half of a pace; the result has both, in any order.
#[test]
fn halves_of_a_pace_from_two_callers_make_a_whole() {
    let mut bench = Bench::paused();
    let half = |pace: PaceChange| {
        bench.post(|reply| Event::SetPhysics {
            change: PhysicsChange::default(),
            pace,
            claim: None,
            sender: None,
            reply,
        })
    };
    let _first = half(PaceChange { as_fast_as_possible: Some(true), factor: None });
    let _second = half(PaceChange { as_fast_as_possible: None, factor: Some(3.0) });
    bench.iterations(2);
    let pace = bench.link.state_cell.newest().statistics.pace;
    assert_eq!(pace, Pace::AsFastAsPossible { factor: 3.0 });
}

#[test]
fn dropped_lag_is_counted_and_reported() {
    let mut bench = Bench::new(RunState::Playing, Pace::default());
    let long_ago = Instant::now() - Duration::from_secs(5);
    bench.driver.pacer = Pacer::new(Some(1e-3), Duration::from_millis(200), long_ago);
    bench.iterations(1);
    let statistics = bench.link.state_cell.newest().statistics;
    assert_eq!(statistics.overruns, 1);
    assert!(statistics.dropped_lag > 4.9);
    let [LogEvent::Overrun { at, dropped_lag }] = bench.happened()[..] else { panic!() };
    assert_eq!((at.step, dropped_lag), (1, statistics.dropped_lag));
}

#[test]
fn playing_after_a_pause_owes_no_steps() {
    let mut bench = Bench::paused();
    bench.driver.pacer.restart(Instant::now() - Duration::from_secs(5));
    let _played = bench.state(RunState::Playing);
    bench.iterations(1);
    assert!(matches!(bench.driver.pacer.next(Instant::now() - Duration::from_secs(1)), pacer::Due::At(_)));
    assert_eq!(bench.link.state_cell.newest().statistics.overruns, 0);
}
