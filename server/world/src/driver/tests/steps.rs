//! Steps that calls request while the world does not play.

use super::*;

#[test]
fn steps_are_done_without_waiting_and_answered_after_the_last() {
    let mut bench = Bench::paused();
    let mut answer = bench.steps(5);
    bench.iterations(5);
    assert!(answer.try_recv().is_err(), "the fifth step is not done");
    bench.iterations(1);
    let done = stepped(answer);
    assert_eq!((done.applied.at.step, done.sequence), (5, bench.link.state_cell.newest().sequence));
    assert_eq!(bench.driver.iterations, 5);
    assert_eq!(bench.link.state_cell.newest().statistics.real_time_factor, 0.0, "it does not play");
}

#[test]
fn calls_are_served_between_the_steps_of_a_step_call() {
    let mut bench = Bench::paused();
    let mut steps = bench.steps(100);
    bench.iterations(11);
    let call = bench.command(nothing());
    bench.iterations(1);
    assert_eq!(done(call).applied.at.step, 10);
    bench.iterations(90);
    assert!(steps.try_recv().is_ok());
}

#[test]
fn step_calls_queue() {
    let mut bench = Bench::paused();
    let (first, second) = (bench.steps(3), bench.steps(4));
    bench.iterations(2 + 7);
    assert_eq!((stepped(first).applied.at.step, stepped(second).applied.at.step), (3, 7));
}

#[test]
fn a_caller_that_goes_away_ends_its_steps_and_no_others() {
    let mut bench = Bench::paused();
    let (first, second) = (bench.steps(1000), bench.steps(2));
    bench.iterations(2 + 10);
    drop(first);
    bench.iterations(2);
    assert_eq!(stepped(second).applied.at.step, 12);
}

#[test]
fn targets_that_come_with_steps_hold_before_the_first_and_are_answered_once() {
    let mut bench = Bench::paused();
    let published = bench.link.state_cell.newest().sequence;
    let answer = bench.steps_of("arm", 2);
    bench.iterations(3);
    let Stepped { done, state, clamped } = done(answer);
    assert_eq!(bench.driver.world.applied.lock().unwrap().len(), 1);
    assert_eq!(bench.driver.world.applied.lock().unwrap()[0].0, 0);
    assert_eq!((done.applied.at.step, state.state.at.step, clamped), (2, 2, Vec::new()));
    assert_eq!((done.sequence, state.sequence), (published + 2, published + 2), "a state a step, no more");
    // The state belongs to the last of its steps, whatever follows.
    let _answers = (bench.steps(5), bench.command(nothing()));
    bench.iterations(2 + 5);
    assert_eq!(bench.step(), 7);
    assert_eq!(state.state.at.step, 2);
}

#[test]
fn steps_whose_targets_are_refused_are_not_done_nor_targets_whose_steps_are() {
    let mut bench = Bench::paused();
    let answer = bench.steps_of("missing", 2);
    bench.iterations(1);
    assert!(matches!(refusal(answer), CallError::World(_)));
    assert!(!bench.driver.steps.is_wanted());
    assert_eq!(bench.step(), 0);

    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    let answer = bench.steps_of("arm", 2);
    bench.iterations(1);
    assert!(matches!(refusal(answer), CallError::WrongState { .. }));
    assert!(bench.driver.world.applied.lock().unwrap().is_empty());
}

#[test]
fn a_caller_that_goes_away_before_its_steps_sets_no_targets() {
    let mut bench = Bench::paused();
    drop(bench.steps_of("arm", 2));
    bench.iterations(1);
    assert!(bench.driver.world.applied.lock().unwrap().is_empty());
    // A caller that disconnects later has set them, and all clients see them.
    let published = bench.link.state_cell.newest().sequence;
    let answer = bench.steps_of("arm", 2);
    bench.iterations(1);
    drop(answer);
    let other = bench.command(refused());
    bench.iterations(1);
    assert!(matches!(refusal(other), CallError::World(_)));
    assert_eq!((bench.link.state_cell.newest().sequence, bench.step()), (published + 1, 0));
}

#[test]
fn stepping_while_playing_is_refused_with_the_remedy() {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    let answer = bench.steps(1);
    bench.iterations(1);
    assert_eq!(refusal(answer).to_string(), "simulation is playing; pause it before stepping");
}

#[test]
fn state_changes_and_resets_end_step_calls_and_say_so() {
    let reset = || Command::Reset(ResetScope { state: true, ..ResetScope::default() });
    let restore = || Command::RestoreState { name: "a".into() };
    type Post<'a> = &'a dyn Fn(&Bench) -> Answer<Done>;
    let causes: [(&str, Post<'_>); 5] = [
        ("a play", &|bench| bench.state(RunState::Playing)),
        ("a pause", &|bench| bench.state(RunState::Paused)),
        ("a stop", &|bench| bench.state(RunState::Stopped)),
        ("a reset", &|bench| bench.command(reset())),
        ("a restored state", &|bench| bench.command(restore())),
    ];
    for (by, cause) in causes {
        let mut bench = Bench::paused();
        let (first, second) = (bench.steps(10), bench.steps(20));
        bench.iterations(2 + 3);
        let cause = cause(&bench);
        bench.iterations(1);
        done(cause);
        assert_eq!(refusal(first).to_string(), format!("{by} ended the call after 3 of 10 steps"));
        assert_eq!(refusal(second).to_string(), format!("{by} ended the call after 0 of 20 steps"));
    }
}

#[test]
fn other_commands_leave_step_calls_alone() {
    let mut bench = Bench::paused();
    let steps = bench.steps(2);
    let refused = bench.command(refused());
    let applied = bench.command(nothing());
    bench.iterations(3 + 2);
    assert_eq!(stepped(steps).applied.at.step, 2);
    assert!(matches!(refusal(refused), CallError::World(_)));
    done(applied);
}
