//! Answers to callers, sent by the driver itself or by the [relay](super::relay).

use super::event::ReplyTo;
use super::main_loop::Driver;
use super::published::Stepped;
use super::relay::{Addressed, Answer};
use super::world::World;
use crate::call_error::CallError;

impl<W: World> Driver<W> {
    pub(super) fn answer(&self, answer: Answer) {
        match &self.relay {
            Some(relay) => relay.answer(answer),
            None => answer.send(),
        }
    }

    pub(super) fn answer_steps(&self, reply: ReplyTo<Stepped>, answer: Result<Stepped, CallError>) {
        self.answer(Answer::Stepped(Addressed { reply, answer }));
    }

    /// Ends all calls that wait for steps; `by` names the cause.
    pub(super) fn supersede_steps(&mut self, by: &str) {
        while let Some((reply, superseded)) = self.steps.superseded(by) {
            self.answer_steps(reply, Err(superseded));
        }
    }
}
