//! Long steps, and their interruptions.

use super::super::fake_world::StepHook;
use super::super::long_step::LongSteps;
use super::*;

/// Returns a playing driver whose steps call `hook` and can be interrupted at once.
fn with_long_steps(hook: impl FnMut(&Mailbox, &dyn Fn() -> bool) -> bool + Send + 'static) -> Bench {
    let mut bench = Bench::new(RunState::Playing, Pace::AsFastAsPossible { factor: 1.0 });
    let (mailbox, mut hook) = (bench.link.mailbox.clone(), hook);
    bench.driver.world.step_hook = Some(StepHook(Box::new(move |interrupt| hook(&mailbox, interrupt))));
    bench.driver.long_steps.interrupt_at_once();
    bench
}

fn delete(name: &str) -> Command {
    Command::Delete { robot: name.into() }
}

#[test]
fn a_pause_within_a_step_puts_the_step_back() {
    let (answered, answer) = std::sync::mpsc::channel();
    let mut bench = with_long_steps(move |mailbox, interrupt| {
        assert!(!interrupt());
        let (reply, pause) = oneshot::channel();
        mailbox.post(Event::SetState { state: RunState::Paused, claim: None, sender: None, reply }).unwrap();
        answered.send(pause).unwrap();
        !interrupt()
    });
    bench.iterations(2);
    let at = done(answer.recv().unwrap()).applied.at;
    assert_eq!((at.step, bench.driver.iterations), (0, 0));
    let statistics = bench.link.state_cell.newest().statistics;
    assert_eq!(statistics.state, RunState::Paused);
    assert!(statistics.step_duration > 0.0, "how long it had run");
}

#[test]
fn calls_that_end_nothing_wait_for_the_step() {
    let mut bench = with_long_steps(|mailbox, interrupt| {
        for command in [nothing(), Command::SetPhysics(PhysicsChange::default())] {
            let (reply, _answer) = oneshot::channel();
            mailbox.post(Event::Command { command, claim: None, sender: None, reply }).unwrap();
        }
        let (reply, _answer) = oneshot::channel();
        mailbox.post(Event::SetState { state: RunState::Playing, claim: None, sender: None, reply }).unwrap();
        !interrupt()
    });
    bench.iterations(1);
    assert_eq!(bench.step(), 1);
}

#[test]
fn interrupting_calls_are_done_in_order_before_the_step_restarts() {
    let mut attempts = 0;
    let mut bench = with_long_steps(move |mailbox, interrupt| {
        attempts += 1;
        if attempts == 1 {
            let calls = (0..100).map(|_| nothing()).chain([delete("missing"), nothing()]);
            for command in calls {
                let (reply, _answer) = oneshot::channel();
                mailbox.post(Event::Command { command, claim: None, sender: None, reply }).unwrap();
            }
            return !interrupt();
        }
        assert!(!interrupt(), "nothing is left that interrupts");
        true
    });
    // A period of zero leaves no time for calls.
    let change = PhysicsChange { time_step: Some(0.0), ..PhysicsChange::default() };
    bench.driver.world.apply_for(&Command::SetPhysics(change), None).unwrap();
    bench.iterations(1 + 101);
    assert_eq!(bench.step(), 0);
    bench.iterations(2);
    assert_eq!((bench.step(), bench.driver.world.applied.lock().unwrap().len()), (1, 1 + 101));
}

#[test]
fn a_step_is_left_alone_for_a_time_before_it_is_interrupted() {
    let mut bench = with_long_steps(|mailbox, interrupt| {
        let (reply, _answer) = oneshot::channel();
        mailbox
            .post(Event::Command { command: delete("missing"), claim: None, sender: None, reply })
            .unwrap();
        !interrupt()
    });
    bench.iterations(1);
    assert_eq!(bench.step(), 0);
    // The time for which it is left alone is not over.
    bench.driver.long_steps = LongSteps::default();
    bench.iterations(2);
    assert_eq!(bench.step(), 1);
}

#[test]
fn ending_interrupts_a_step() {
    let mut bench = with_long_steps(|mailbox, interrupt| {
        mailbox.close();
        !interrupt()
    });
    bench.driver.long_steps = LongSteps::default();
    bench.iterations(1);
    assert!(bench.driver.run_once().is_break());
    assert_eq!(bench.step(), 0);
}

#[test]
fn a_step_shows_how_long_it_has_been_going_on() {
    let (sender, seen) = std::sync::mpsc::channel();
    let mut bench = with_long_steps(|_, _| true);
    let state_cell = bench.link.state_cell.clone();
    let look = move || state_cell.present_step(Instant::now() + Duration::from_secs(17));
    assert_eq!(look(), Duration::ZERO);
    bench.driver.world.step_hook = Some(StepHook(Box::new(move |_| sender.send(look()).is_ok())));
    bench.iterations(1);
    assert!(seen.recv().unwrap() >= Duration::from_secs(17));
    assert_eq!(bench.link.state_cell.present_step(Instant::now()), Duration::ZERO);
}
