//! The driver by hand, turn by turn: no thread and no waiting.

use simd_core::simulation::command::{ClaimId, PhysicsChange, ResetScope, RobotTargets, SetTargets};
use simd_core::{Applied, Command};
use tokio::sync::oneshot::{self, Receiver};

use super::long_step::LongSteps;
use super::toy::{Midst, Toy, nothing, refused};
use super::*;
use crate::handle::{CallError, Done, Happened, PaceChange, Stepped};

type Answer<T> = Receiver<Result<T, CallError>>;

/// A driver, and the other end of it.
struct Bench {
    driver: Driver<Toy>,
    link: Link,
}

impl Bench {
    fn new(state: RunState, pace: Pace) -> Self {
        let config = Config { state, pace, mailbox: 600, ..Config::default() };
        let (driver, link) = build(Toy::default(), config);
        Self { driver, link }
    }

    fn paused() -> Self {
        Self::new(RunState::Paused, Pace::default())
    }

    fn post<T>(&self, event: impl FnOnce(ReplyTo<T>) -> Event) -> Answer<T> {
        let (reply, answer) = oneshot::channel();
        self.link.mailbox.post(event(reply)).unwrap();
        answer
    }

    fn steps(&self, steps: u64) -> Answer<Stepped> {
        self.post(|reply| Event::Step { targets: None, steps, reply })
    }

    /// With targets, which a toy refuses for `nobody`.
    fn steps_of(&self, robot: &str, steps: u64) -> Answer<Stepped> {
        let targets = RobotTargets { robot: robot.into(), ..RobotTargets::default() };
        let targets = Some(SetTargets { robots: vec![targets], ..SetTargets::default() });
        self.post(|reply| Event::Step { targets, steps, reply })
    }

    fn command(&self, command: Command) -> Answer<Done> {
        self.post(|reply| Event::Command { command, reply })
    }

    fn state(&self, state: RunState) -> Answer<Done> {
        self.post(|reply| Event::SetState { state, reply })
    }

    fn turns(&mut self, count: u32) {
        for _ in 0..count {
            assert!(self.driver.turn().is_continue());
        }
    }

    fn step(&self) -> u64 {
        self.link.board.newest().state.at.step
    }

    fn happened(&self) -> Vec<Happened> {
        self.link.events.after(0).events.into_iter().map(|event| event.what).collect()
    }
}

fn done<T>(mut answer: Answer<T>) -> T {
    answer.try_recv().expect("there is an answer").expect("it is no refusal")
}

fn stepped(answer: Answer<Stepped>) -> Done {
    done(answer).done
}

fn refusal<T: std::fmt::Debug>(mut answer: Answer<T>) -> CallError {
    answer.try_recv().expect("there is an answer").expect_err("it is a refusal")
}

#[test]
fn a_full_mailbox_refuses_at_once_and_counts() {
    let (driver, link) = build(Toy::default(), Config { mailbox: 2, ..Config::default() });
    let post = || {
        let (reply, _answer) = oneshot::channel();
        link.mailbox.post(Event::Command { command: nothing(), reply })
    };
    assert!(post().is_ok() && post().is_ok());
    assert!(matches!(post(), Err(CallError::MailboxFull { capacity: 2 })));
    assert!(post().is_err());
    assert_eq!(link.mailbox.refusals(), 2);
    drop(driver);
    assert!(matches!(post(), Err(CallError::ShuttingDown)));
}

#[test]
fn steps_are_done_without_waiting_and_answered_after_the_last() {
    let mut bench = Bench::paused();
    let mut answer = bench.steps(5);
    bench.turns(5);
    assert!(answer.try_recv().is_err(), "the fifth step is not done");
    bench.turns(1);
    let done = stepped(answer);
    assert_eq!((done.applied.at.step, done.sequence), (5, bench.link.board.newest().sequence));
    assert_eq!(bench.driver.iterations, 5);
    assert_eq!(bench.link.board.newest().statistics.real_time_factor, 0.0, "it does not play");
}

#[test]
fn calls_are_served_between_the_steps_of_a_step_call() {
    let mut bench = Bench::paused();
    let mut steps = bench.steps(100);
    bench.turns(11);
    let call = bench.command(nothing());
    bench.turns(1);
    assert_eq!(done(call).applied.at.step, 10);
    bench.turns(90);
    assert!(steps.try_recv().is_ok());
}

#[test]
fn step_calls_queue() {
    let mut bench = Bench::paused();
    let (first, second) = (bench.steps(3), bench.steps(4));
    bench.turns(2 + 7);
    assert_eq!((stepped(first).applied.at.step, stepped(second).applied.at.step), (3, 7));
}

#[test]
fn a_caller_that_goes_away_ends_its_steps_and_no_others() {
    let mut bench = Bench::paused();
    let (first, second) = (bench.steps(1000), bench.steps(2));
    bench.turns(2 + 10);
    drop(first);
    bench.turns(2);
    assert_eq!(stepped(second).applied.at.step, 12);
}

#[test]
fn targets_that_come_with_steps_hold_before_the_first_and_are_answered_once() {
    let mut bench = Bench::paused();
    let published = bench.link.board.newest().sequence;
    let answer = bench.steps_of("arm", 2);
    bench.turns(3);
    let Stepped { done, state, clamped } = done(answer);
    assert_eq!(bench.driver.world.applied.lock().unwrap().len(), 1);
    assert_eq!(bench.driver.world.applied.lock().unwrap()[0].0, 0);
    assert_eq!((done.applied.at.step, state.state.at.step, clamped), (2, 2, Vec::new()));
    assert_eq!((done.sequence, state.sequence), (published + 2, published + 2), "a state a step, no more");
    // The state is that of the last of its steps, whatever comes after it.
    let _answers = (bench.steps(5), bench.command(nothing()));
    bench.turns(2 + 5);
    assert_eq!(bench.step(), 7);
    assert_eq!(state.state.at.step, 2);
}

#[test]
fn steps_whose_targets_are_refused_are_not_done_nor_targets_whose_steps_are() {
    let mut bench = Bench::paused();
    let answer = bench.steps_of("nobody", 2);
    bench.turns(1);
    assert!(matches!(refusal(answer), CallError::World(_)));
    assert!(!bench.driver.steps.is_wanted());
    assert_eq!(bench.step(), 0);

    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    let answer = bench.steps_of("arm", 2);
    bench.turns(1);
    assert!(matches!(refusal(answer), CallError::WrongState { .. }));
    assert!(bench.driver.world.applied.lock().unwrap().is_empty());
}

#[test]
fn a_caller_that_goes_away_before_its_steps_sets_no_targets() {
    let mut bench = Bench::paused();
    drop(bench.steps_of("arm", 2));
    bench.turns(1);
    assert!(bench.driver.world.applied.lock().unwrap().is_empty());
    // One that goes away after that has set them, and everybody sees it.
    let published = bench.link.board.newest().sequence;
    let answer = bench.steps_of("arm", 2);
    bench.turns(1);
    drop(answer);
    let other = bench.command(refused());
    bench.turns(1);
    assert!(matches!(refusal(other), CallError::World(_)));
    assert_eq!((bench.link.board.newest().sequence, bench.step()), (published + 1, 0));
}

#[test]
fn stepping_while_playing_is_refused_with_the_remedy() {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    let answer = bench.steps(1);
    bench.turns(1);
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
        bench.turns(2 + 3);
        let cause = cause(&bench);
        bench.turns(1);
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
    bench.turns(3 + 2);
    assert_eq!(stepped(steps).applied.at.step, 2);
    assert!(matches!(refusal(refused), CallError::World(_)));
    done(applied);
}

/// A period of nothing leaves room for one call a step, however short that call is.
#[test]
fn a_flood_of_calls_does_not_stop_the_world() {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    bench.turns(2);
    let change = PhysicsChange { time_step: Some(0.0), ..PhysicsChange::default() };
    let _changed = bench.command(Command::SetPhysics(change));
    bench.turns(2);
    let before = bench.step();
    let _answers: Vec<_> = (0..600).map(|_| bench.command(nothing())).collect();
    bench.turns(2 * 600);
    assert_eq!(bench.step(), before + 600);
}

#[test]
fn a_world_that_never_waits_serves_a_call_before_each_step() {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    bench.turns(10);
    let call = bench.command(nothing());
    bench.turns(1);
    assert_eq!(done(call).applied.at.step, 10);
}

#[test]
fn stop_is_a_pause_at_the_start_and_the_first_step_leaves_it() {
    let mut bench = Bench::paused();
    let steps = bench.steps(3);
    bench.turns(4);
    done(steps);
    let stopped = bench.state(RunState::Stopped);
    bench.turns(1);
    let at = done(stopped).applied.at;
    assert_eq!((at.epoch, at.step), (1, 0));
    assert_eq!(bench.link.board.newest().statistics.state, RunState::Stopped);
    let _steps = bench.steps(1);
    bench.turns(2);
    assert_eq!(bench.link.board.newest().statistics.state, RunState::Paused);
    let states = bench.happened().into_iter().filter_map(|event| match event {
        Happened::StateChanged { state, .. } => Some(state),
        _ => None,
    });
    assert_eq!(states.collect::<Vec<_>>(), [RunState::Stopped, RunState::Paused]);
}

#[test]
fn a_paused_world_shows_a_command_before_it_is_answered() {
    let mut bench = Bench::paused();
    let before = bench.link.board.newest().sequence;
    let (applied, refused) = (bench.command(nothing()), bench.command(refused()));
    bench.turns(2);
    assert_eq!(done(applied).sequence, before + 1);
    refusal(refused);
    assert_eq!(bench.link.board.newest().sequence, before + 1, "a refusal changes nothing");
}

#[test]
fn a_playing_world_shows_values_of_targets_with_the_next_step_and_all_else_at_once() {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    let before = bench.link.board.newest().sequence;
    let targets = bench.command(nothing());
    let robots = vec![RobotTargets { robot: "arm".into(), ..RobotTargets::default() }];
    let law = bench.command(Command::SetTargets(SetTargets { robots, ..SetTargets::default() }));
    let claim = bench.command(Command::Claim { claim: ClaimId(1), holder: "me".into(), joints: Vec::new() });
    let reset = bench.command(Command::Reset(ResetScope { time: true, ..ResetScope::default() }));
    bench.turns(4);
    assert_eq!(done(targets).sequence, before);
    assert_eq!(done(law).sequence, before + 1);
    assert_eq!(done(claim).sequence, before + 2);
    assert_eq!(done(reset).sequence, before + 3);
}

#[test]
fn physics_and_pace_change_together_and_are_told_of_once() {
    let mut bench = Bench::paused();
    let pace = Pace::RealTime { factor: 2.0 };
    let change = PhysicsChange { time_step: Some(0.01), ..PhysicsChange::default() };
    let mut both = bench.post(|reply| Event::SetPhysics { change, pace: pace.into(), reply });
    let change = PhysicsChange::default();
    let free = Pace::AsFastAsPossible { factor: 2.0 };
    let _pace = bench.post(|reply| Event::SetPhysics { change, pace: free.into(), reply });
    bench.turns(2);
    let (done, settings, in_force) = both.try_recv().unwrap().unwrap();
    assert_eq!((settings.time_step, in_force), (0.01, pace));
    assert!(done.sequence > 1);
    let told: Vec<_> = bench.happened();
    let at = done.applied.at;
    assert_eq!(
        told,
        [pace, free].map(|pace| Happened::PhysicsChanged { at, settings, pace }),
        "one event each, with the pace of its time"
    );
    assert_eq!(bench.link.board.newest().physics.time_step, 0.01);
}

/// Each names one half of a pace; what comes of them has both, in whichever order they were sent.
#[test]
fn halves_of_a_pace_from_two_callers_make_a_whole() {
    let mut bench = Bench::paused();
    let half = |pace: PaceChange| {
        bench.post(|reply| Event::SetPhysics { change: PhysicsChange::default(), pace, reply })
    };
    let _first = half(PaceChange { as_fast_as_possible: Some(true), factor: None });
    let _second = half(PaceChange { as_fast_as_possible: None, factor: Some(3.0) });
    bench.turns(2);
    let pace = bench.link.board.newest().statistics.pace;
    assert_eq!(pace, Pace::AsFastAsPossible { factor: 3.0 });
}

#[test]
fn what_reaches_the_world_is_recorded_in_order_with_its_step() {
    let mut bench = Bench::paused();
    let recording = bench.driver.world.applied.clone();
    let _answers = (bench.command(nothing()), bench.steps(2));
    bench.turns(2 + 2);
    let _answers = (bench.command(refused()), bench.state(RunState::Stopped));
    bench.turns(2);
    let steps: Vec<_> = recording.lock().unwrap().iter().map(|(step, _)| *step).collect();
    assert_eq!(steps, [0, 0], "the stop is a reset, and a reset ends the time before it");
    assert!(matches!(recording.lock().unwrap()[1].1, Command::Reset(_)));
}

#[test]
fn a_full_mailbox_does_not_keep_the_driver_from_ending() {
    let mut bench = Bench::paused();
    let mut answers: Vec<_> = (0..600).map(|_| bench.command(nothing())).collect();
    bench.turns(1);
    bench.link.mailbox.close();
    assert!(bench.driver.turn().is_break());
    let Driver { inbox, .. } = bench.driver;
    inbox.ending().end();
    drop(inbox);
    let Applied { .. } = answers.remove(0).try_recv().unwrap().unwrap().applied;
    assert!(answers[0].try_recv().is_err(), "the others are dropped");
    assert!(matches!(bench.link.mailbox.end(), CallError::ShuttingDown));
}

#[test]
fn dropped_lag_is_counted_and_told_of() {
    let mut bench = Bench::new(RunState::Playing, Pace::default());
    let long_ago = Instant::now() - Duration::from_secs(5);
    bench.driver.pacer = Pacer::new(Some(1e-3), Duration::from_millis(200), long_ago);
    bench.turns(1);
    let statistics = bench.link.board.newest().statistics;
    assert_eq!(statistics.overruns, 1);
    assert!(statistics.dropped_lag > 4.9);
    let [Happened::Overrun { at, dropped_lag }] = bench.happened()[..] else { panic!() };
    assert_eq!((at.step, dropped_lag), (1, statistics.dropped_lag));
}

#[test]
fn playing_after_a_pause_owes_no_steps() {
    let mut bench = Bench::paused();
    bench.driver.pacer.restart(Instant::now() - Duration::from_secs(5));
    let _played = bench.state(RunState::Playing);
    bench.turns(1);
    assert!(matches!(bench.driver.pacer.next(Instant::now() - Duration::from_secs(1)), pacer::Due::At(_)));
    assert_eq!(bench.link.board.newest().statistics.overruns, 0);
}

/// A driver that plays, whose steps do what `midst` says and can be interrupted at once.
fn with_long_steps(midst: impl FnMut(&Mailbox, &dyn Fn() -> bool) -> bool + Send + 'static) -> Bench {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    let (mailbox, mut midst) = (bench.link.mailbox.clone(), midst);
    bench.driver.world.midst = Some(Midst(Box::new(move |interrupt| midst(&mailbox, interrupt))));
    bench.driver.long_steps.be_impatient();
    bench
}

fn delete(name: &str) -> Command {
    Command::Delete { robot: name.into() }
}

#[test]
fn a_pause_in_the_midst_of_a_step_puts_the_step_back() {
    let (answered, answer) = std::sync::mpsc::channel();
    let mut bench = with_long_steps(move |mailbox, interrupt| {
        assert!(!interrupt());
        let (reply, pause) = oneshot::channel();
        mailbox.post(Event::SetState { state: RunState::Paused, reply }).unwrap();
        answered.send(pause).unwrap();
        !interrupt()
    });
    bench.turns(2);
    let at = done(answer.recv().unwrap()).applied.at;
    assert_eq!((at.step, bench.driver.iterations), (0, 0));
    let statistics = bench.link.board.newest().statistics;
    assert_eq!(statistics.state, RunState::Paused);
    assert!(statistics.step_duration > 0.0, "how long it had run");
}

#[test]
fn calls_that_end_nothing_wait_for_the_step() {
    let mut bench = with_long_steps(|mailbox, interrupt| {
        for command in [nothing(), Command::SetPhysics(PhysicsChange::default())] {
            let (reply, _answer) = oneshot::channel();
            mailbox.post(Event::Command { command, reply }).unwrap();
        }
        let (reply, _answer) = oneshot::channel();
        mailbox.post(Event::SetState { state: RunState::Playing, reply }).unwrap();
        !interrupt()
    });
    bench.turns(1);
    assert_eq!(bench.step(), 1);
}

#[test]
fn what_a_step_was_interrupted_for_is_done_before_it_begins_anew_and_in_its_order() {
    let mut attempts = 0;
    let mut bench = with_long_steps(move |mailbox, interrupt| {
        attempts += 1;
        if attempts == 1 {
            let calls = (0..100).map(|_| nothing()).chain([delete("nobody"), nothing()]);
            for command in calls {
                let (reply, _answer) = oneshot::channel();
                mailbox.post(Event::Command { command, reply }).unwrap();
            }
            return !interrupt();
        }
        assert!(!interrupt(), "nothing is left that interrupts");
        true
    });
    // A period of nothing leaves no time for calls.
    let change = PhysicsChange { time_step: Some(0.0), ..PhysicsChange::default() };
    bench.driver.world.apply(&Command::SetPhysics(change)).unwrap();
    bench.turns(1 + 101);
    assert_eq!(bench.step(), 0);
    bench.turns(2);
    assert_eq!((bench.step(), bench.driver.world.applied.lock().unwrap().len()), (1, 1 + 101));
}

#[test]
fn a_step_is_left_alone_for_a_time_before_it_is_interrupted() {
    let mut bench = with_long_steps(|mailbox, interrupt| {
        let (reply, _answer) = oneshot::channel();
        mailbox.post(Event::Command { command: delete("nobody"), reply }).unwrap();
        !interrupt()
    });
    bench.turns(1);
    assert_eq!(bench.step(), 0);
    // Left alone for a time that is not over.
    bench.driver.long_steps = LongSteps::default();
    bench.turns(2);
    assert_eq!(bench.step(), 1);
}

#[test]
fn ending_interrupts_a_step() {
    let mut bench = with_long_steps(|mailbox, interrupt| {
        mailbox.close();
        !interrupt()
    });
    bench.driver.long_steps = LongSteps::default();
    bench.turns(1);
    assert!(bench.driver.turn().is_break());
    assert_eq!(bench.step(), 0);
}

#[test]
fn a_step_shows_how_long_it_has_been_going_on() {
    let (sender, seen) = std::sync::mpsc::channel();
    let mut bench = with_long_steps(|_, _| true);
    let board = bench.link.board.clone();
    let look = move || board.present_step(Instant::now() + Duration::from_secs(17));
    assert_eq!(look(), Duration::ZERO);
    bench.driver.world.midst = Some(Midst(Box::new(move |_| sender.send(look()).is_ok())));
    bench.turns(1);
    assert!(seen.recv().unwrap() >= Duration::from_secs(17));
    assert_eq!(bench.link.board.present_step(Instant::now()), Duration::ZERO);
}
