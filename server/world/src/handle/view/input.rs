//! Keys and mouse in pages, for programs that ask for them. Bounded: the newest win, and moves of a mouse that follow
//! each other are one.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::Instant;

use super::super::{CallError, Caller, SimHandle};
use super::View;

/// Events that are kept.
const EVENTS: usize = 1_024;
/// How long after a program has asked pages report.
const ASKED_FOR: Duration = Duration::from_secs(5);

/// Something that was done in a page.
#[derive(Clone, Debug, PartialEq)]
pub struct InputEvent {
    /// Grows with each.
    pub sequence: u64,
    /// The page's name.
    pub client: Arc<str>,
    /// What it is.
    pub kind: InputKind,
}

/// What was done.
#[derive(Clone, Debug, PartialEq)]
pub enum InputKind {
    /// A key went down or up.
    Key {
        /// As `KeyboardEvent.key` of browsers has it.
        key: String,
        /// As `KeyboardEvent.code` has it.
        code: String,
        /// Which of the two.
        is_down: bool,
    },
    /// The mouse moved, or a button of it went down or up.
    Mouse {
        /// From the left and the top of the picture, CSS pixels.
        at: [f64; 2],
        /// None: it moved.
        button: Option<MouseButton>,
        /// Of the button.
        is_down: bool,
    },
}

/// A button of a mouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MouseButton {
    /// The first one.
    Left,
    /// The wheel, where it can be pressed.
    Middle,
    /// The second one.
    Right,
}

/// What was done after a sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Of the newest event.
    pub sequence: u64,
    /// In their order.
    pub events: Vec<Arc<InputEvent>>,
    /// Some before these are gone.
    pub missed: bool,
}

/// The last events.
#[derive(Debug, Default)]
pub(super) struct InputLog {
    events: VecDeque<Arc<InputEvent>>,
    /// Of the newest.
    sequence: u64,
    /// Events up to this sequence are gone.
    gone: u64,
    /// Until when programs ask for events; none: no program ever did.
    asked_until: Option<Instant>,
    /// The one that asked last.
    asker: Arc<str>,
}

impl InputLog {
    /// The program that asks for events, where one does.
    pub(super) fn asks(&self, now: Instant) -> Option<Arc<str>> {
        self.asked_until.is_some_and(|until| now < until).then(|| Arc::clone(&self.asker))
    }

    /// A program asks for events until then. Returns whether pages have to learn of it.
    fn ask(&mut self, asker: &Arc<str>, now: Instant, until: Instant) -> bool {
        let is_new = self.asks(now).is_none_or(|before| before != *asker);
        if self.asks(now).is_none() {
            // What was done before it asked is not for it.
            self.events.clear();
            self.gone = self.sequence;
        }
        self.asker = Arc::clone(asker);
        self.asked_until = self.asked_until.into_iter().chain([until]).max();
        is_new
    }

    fn push(&mut self, client: &Arc<str>, kind: InputKind) {
        self.sequence += 1;
        let is_move = |kind: &InputKind| matches!(kind, InputKind::Mouse { button: None, .. });
        let before = self.events.back().filter(|event| event.client == *client && is_move(&event.kind));
        if is_move(&kind) && before.is_some() {
            self.events.pop_back();
        }
        let event = InputEvent { sequence: self.sequence, client: Arc::clone(client), kind };
        self.events.push_back(Arc::new(event));
        if self.events.len() > EVENTS
            && let Some(oldest) = self.events.pop_front()
        {
            self.gone = oldest.sequence;
        }
    }

    /// What there is after a sequence; a sequence that is ahead is from before a restart of the daemon.
    fn after(&self, sequence: u64) -> Input {
        let events = self.events.iter().filter(|event| event.sequence > sequence).cloned().collect();
        let missed = sequence < self.gone || sequence > self.sequence;
        Input { sequence: self.sequence, events, missed }
    }
}

impl View {
    async fn input_after(&self, sequence: u64, deadline: Instant) -> Input {
        loop {
            // Made before the look, so that an event between look and wait wakes it.
            let came = self.input_came.notified();
            let now = Instant::now();
            let input = self.at(now).input.after(sequence);
            if input.sequence != sequence || now >= deadline {
                return input;
            }
            tokio::select! {
                () = came => {}
                () = tokio::time::sleep_until(deadline) => {}
            }
        }
    }
}

impl SimHandle {
    /// A page says what was done in it. Returns whether a program asks for that; else it is dropped.
    pub fn report_input(&self, page: &Caller, input: Vec<InputKind>) -> bool {
        let (view, now) = (&self.inner.view, Instant::now());
        let mut state = view.at(now);
        let is_asked_for = state.input.asks(now).is_some();
        if is_asked_for && !input.is_empty() {
            for kind in input {
                state.input.push(&page.name, kind);
            }
            drop(state);
            view.input_came.notify_waiters();
        }
        is_asked_for
    }

    /// Keys and mouse after a sequence, waiting for the first of them; without a sequence, only the newest sequence, at
    /// once. Pages report them from now on, until five seconds after this call.
    ///
    /// # Errors
    /// Returns an error if the daemon drains before that, or the driver failed.
    pub async fn next_input(
        &self,
        after: Option<u64>,
        timeout: Duration,
        asker: Option<&Caller>,
    ) -> Result<Input, CallError> {
        let (view, now) = (&self.inner.view, Instant::now());
        let timeout = if after.is_some() { timeout } else { Duration::ZERO };
        let asker = asker.map(|caller| Arc::clone(&caller.name)).unwrap_or_default();
        let sequence = view.change(now, |state, _version| {
            let is_new = state.input.ask(&asker, now, now + timeout + ASKED_FOR);
            Ok((state.input.sequence, is_new))
        })?;
        match after {
            None => Ok(Input { sequence, events: Vec::new(), missed: false }),
            Some(after) => self.until_drained(view.input_after(after, now + timeout)).await,
        }
    }
}
