//! A driver in its lock, driven by hand: threads exist only where a test starts them.

use std::sync::Arc;

use tokio::sync::oneshot;

use super::super::fake_world::FakeWorld;
use super::super::{Config, Event, Link, build};
use super::*;

fn shared(state: RunState) -> (Arc<Shared<FakeWorld>>, Link) {
    let (driver, link) = build(FakeWorld::default(), Config { state, ..Config::default() });
    (Arc::new(Shared::new(driver)), link)
}

/// Asks for steps; the answer is the number of the last step.
fn steps(link: &Link, steps: u64) -> impl FnMut() -> Option<u64> + use<> {
    let (reply, mut answer) = oneshot::channel();
    let event = Event::Step { targets: None, steps, claim: None, sender: None, reply };
    link.mailbox.put(event).unwrap();
    move || answer.try_recv().ok().map(|stepped| stepped.unwrap().done.applied.at.step)
}

#[test]
fn a_caller_that_finds_the_driver_idle_does_its_steps_itself() {
    let (shared, link) = shared(RunState::Paused);
    let (mut answer, mut step) = (steps(&link, 10), None);
    shared.drive(&mut || {
        step = step.or_else(&mut answer);
        step.is_some()
    });
    assert_eq!(step.or_else(answer), Some(10));
}

#[test]
fn a_caller_stops_once_it_is_answered_and_leaves_the_rest_to_others() {
    let (shared, link) = shared(RunState::Paused);
    let (mut mine, mut other) = (steps(&link, 2), steps(&link, 5));
    let mut step = None;
    shared.drive(&mut || {
        step = step.or_else(&mut mine);
        step.is_some()
    });
    assert_eq!(step, Some(2));
    assert_eq!(other(), None);
    shared.drive(&mut || false);
    assert_eq!(other(), Some(7));
}

#[test]
fn a_caller_that_finds_the_driver_taken_leaves_its_call_to_who_has_it() {
    let (shared, link) = shared(RunState::Paused);
    let held = shared.driver.lock().unwrap();
    let mut answer = steps(&link, 1);
    shared.drive(&mut || false);
    assert_eq!(answer(), None);
    drop(held);
    shared.drive(&mut || false);
    assert_eq!(answer(), Some(1));
}

#[test]
fn a_caller_does_no_step_of_a_world_that_plays() {
    let (shared, link) = shared(RunState::Playing);
    let mut answer = steps(&link, 1);
    shared.drive(&mut || false);
    assert_eq!(answer(), None);
    assert_eq!(link.state_cell.newest().state.at.step, 0);
}

#[test]
fn a_driver_that_is_asked_to_end_is_ended_by_the_thread_that_has_it() {
    let (shared, link) = shared(RunState::Paused);
    link.mailbox.close();
    shared.drive(&mut || false);
    assert!(link.mailbox.ended().is_cancelled());
    // The driver's thread notices the end, and does not wait.
    shared.serve();
}
