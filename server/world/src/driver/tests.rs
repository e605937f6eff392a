//! The driver by hand, event by event, without threads and waits.

mod calls;
mod long_steps;
mod pace;
mod relay;
mod steps;

use simd_core::simulation::command::{ClaimRequest, PhysicsChange, ResetScope, RobotTargets, SetTargets};
use simd_core::{Applied, Command};
use tokio::sync::oneshot::{self, Receiver};

use super::fake_world::{FakeWorld, nothing, refused};
use super::*;
use crate::call_error::CallError;

type Answer<T> = Receiver<Result<T, CallError>>;

/// A driver and its link.
struct Bench {
    driver: Driver<FakeWorld>,
    link: Link,
}

impl Bench {
    fn new(state: RunState, pace: Pace) -> Self {
        let config = Config { state, pace, mailbox: 600, ..Config::default() };
        let (driver, link) = build(FakeWorld::default(), config);
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
        self.post(|reply| Event::Step { targets: None, steps, claim: None, sender: None, reply })
    }

    /// Requests steps with targets, which a fake world refuses for `missing`.
    fn steps_of(&self, robot: &str, steps: u64) -> Answer<Stepped> {
        let targets = RobotTargets { robot: robot.into(), ..RobotTargets::default() };
        let targets = Some(SetTargets { robots: vec![targets], ..SetTargets::default() });
        self.post(|reply| Event::Step { targets, steps, claim: None, sender: None, reply })
    }

    fn command(&self, command: Command) -> Answer<Done> {
        self.post(|reply| Event::Command { command, claim: None, sender: None, reply })
    }

    fn state(&self, state: RunState) -> Answer<Done> {
        self.post(|reply| Event::SetState { state, claim: None, sender: None, reply })
    }

    fn iterations(&mut self, count: u32) {
        for _ in 0..count {
            assert!(self.driver.run_once().is_continue());
        }
    }

    fn step(&self) -> u64 {
        self.link.state_cell.newest().state.at.step
    }

    fn happened(&self) -> Vec<LogEvent> {
        self.link.events.after(0).events.into_iter().map(|event| event.what).collect()
    }
}

fn done<T>(mut answer: Answer<T>) -> T {
    answer.try_recv().expect("there is an answer").expect("it is not a refusal")
}

fn stepped(answer: Answer<Stepped>) -> Done {
    done(answer).done
}

fn refusal<T: std::fmt::Debug>(mut answer: Answer<T>) -> CallError {
    answer.try_recv().expect("there is an answer").expect_err("it is a refusal")
}
