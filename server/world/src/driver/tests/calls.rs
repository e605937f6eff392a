//! Calls: the mailbox, their share of time next to steps, and when their effects are shown.

use super::*;

#[test]
fn a_full_mailbox_refuses_at_once_and_counts() {
    let (driver, link) = build(FakeWorld::default(), Config { mailbox: 2, ..Config::default() });
    let post = || {
        let (reply, _answer) = oneshot::channel();
        link.mailbox.post(Event::Command { command: nothing(), claim: None, sender: None, reply })
    };
    assert!(post().is_ok() && post().is_ok());
    assert!(matches!(post(), Err(CallError::MailboxFull { capacity: 2 })));
    assert!(post().is_err());
    assert_eq!(link.mailbox.refusals(), 2);
    drop(driver);
    assert!(matches!(post(), Err(CallError::ShuttingDown)));
}

/// A period of zero leaves room for one call per step, of any duration.
#[test]
fn a_flood_of_calls_does_not_stop_the_world() {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    bench.iterations(2);
    let change = PhysicsChange { time_step: Some(0.0), ..PhysicsChange::default() };
    let _changed = bench.command(Command::SetPhysics(change));
    bench.iterations(2);
    let before = bench.step();
    let _answers: Vec<_> = (0..600).map(|_| bench.command(nothing())).collect();
    bench.iterations(2 * 600);
    assert_eq!(bench.step(), before + 600);
}

#[test]
fn a_world_that_never_waits_serves_a_call_before_each_step() {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    bench.iterations(10);
    let call = bench.command(nothing());
    bench.iterations(1);
    assert_eq!(done(call).applied.at.step, 10);
}

#[test]
fn a_paused_world_shows_a_command_before_it_is_answered() {
    let mut bench = Bench::paused();
    let before = bench.link.state_cell.newest().sequence;
    let (applied, refused) = (bench.command(nothing()), bench.command(refused()));
    bench.iterations(2);
    assert_eq!(done(applied).sequence, before + 1);
    refusal(refused);
    assert_eq!(bench.link.state_cell.newest().sequence, before + 1, "a refusal changes nothing");
}

#[test]
fn a_playing_world_shows_values_of_targets_with_the_next_step_and_all_else_at_once() {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    // A step may run before a call, once calls have used their part of its period.
    let mut shows_at_once = |command| {
        let mut answer = bench.command(command);
        loop {
            let before = bench.link.state_cell.newest().sequence;
            bench.iterations(1);
            if let Ok(answer) = answer.try_recv() {
                return answer.unwrap().sequence == before + 1;
            }
        }
    };
    assert!(!shows_at_once(nothing()));
    let robots = vec![RobotTargets { robot: "arm".into(), ..RobotTargets::default() }];
    assert!(shows_at_once(Command::SetTargets(SetTargets { robots, ..SetTargets::default() })));
    assert!(shows_at_once(Command::Claim(ClaimRequest::default())));
    assert!(shows_at_once(Command::Reset(ResetScope { time: true, ..ResetScope::default() })));
}

#[test]
fn commands_are_recorded_in_order_with_their_step() {
    let mut bench = Bench::paused();
    let recording = bench.driver.world.applied.clone();
    let _answers = (bench.command(nothing()), bench.steps(2));
    bench.iterations(2 + 2);
    let _answers = (bench.command(refused()), bench.state(RunState::Stopped));
    bench.iterations(2);
    let steps: Vec<_> = recording.lock().unwrap().iter().map(|(step, _)| *step).collect();
    assert_eq!(steps, [0, 0], "the stop is a reset, and a reset ends the time before it");
    assert!(matches!(recording.lock().unwrap()[1].1, Command::Reset(_)));
}

#[test]
fn a_full_mailbox_does_not_keep_the_driver_from_ending() {
    let mut bench = Bench::paused();
    let mut answers: Vec<_> = (0..600).map(|_| bench.command(nothing())).collect();
    bench.iterations(1);
    bench.link.mailbox.close();
    assert!(bench.driver.run_once().is_break());
    let Driver { inbox, .. } = bench.driver;
    inbox.ending().end();
    drop(inbox);
    let Applied { .. } = answers.remove(0).try_recv().unwrap().unwrap().applied;
    assert!(answers[0].try_recv().is_err(), "the others are dropped");
    assert!(matches!(bench.link.mailbox.end(), CallError::ShuttingDown));
}

#[test]
fn a_driver_that_looks_for_calls_takes_one_that_wakes_nothing() {
    let config = Config { state: RunState::Paused, spin_us: u32::MAX, ..Config::default() };
    let (mut driver, link) = build(FakeWorld::default(), config);
    let driver = std::thread::spawn(move || driver.run_once().is_continue());
    let (reply, answer) = oneshot::channel();
    link.mailbox.put(Event::Command { command: nothing(), claim: None, sender: None, reply }).unwrap();
    assert!(answer.blocking_recv().unwrap().is_ok());
    assert!(driver.join().unwrap());
}
