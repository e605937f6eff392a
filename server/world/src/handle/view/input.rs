//! Keyboard and mouse input of pages, for programs that ask for it. Bounded: the newest events win, and
//! consecutive moves of a mouse are merged.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use tokio::time::Instant;

use super::super::{CallError, Caller, SimHandle};
use super::View;

/// Number of events that are kept.
const EVENTS: usize = 1_024;
/// Time for which pages report after a program has asked.
const ASKED_FOR: Duration = Duration::from_secs(5);

/// An input event of a page.
#[derive(Clone, Debug, PartialEq)]
pub struct InputEvent {
    /// Number, which grows with each event.
    pub sequence: u64,
    /// Name of the page.
    pub client: Arc<str>,
    /// Kind of event.
    pub kind: InputKind,
}

/// Kinds of input events.
#[derive(Clone, Debug, PartialEq)]
pub enum InputKind {
    /// A key went down or up.
    Key {
        /// Value of `KeyboardEvent.key` of browsers.
        key: String,
        /// Value of `KeyboardEvent.code` of browsers.
        code: String,
        /// Whether it went down.
        is_down: bool,
    },
    /// The mouse moved, or a button of it went down or up.
    Mouse {
        /// Position from the left and the top of the picture, CSS pixels.
        at: [f64; 2],
        /// Button; `None` for a move.
        button: Option<MouseButton>,
        /// Whether the button went down.
        is_down: bool,
    },
}

/// A button of a mouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MouseButton {
    /// The first button.
    Left,
    /// The wheel, if it can be pressed.
    Middle,
    /// The second button.
    Right,
}

/// Input after a sequence.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// Sequence of the newest event.
    pub sequence: u64,
    /// Events, in order.
    pub events: Vec<Arc<InputEvent>>,
    /// Whether earlier events are lost.
    pub missed: bool,
}

/// Log of the last events.
#[derive(Debug, Default)]
pub(super) struct InputLog {
    events: VecDeque<Arc<InputEvent>>,
    /// Sequence of the newest event.
    sequence: u64,
    /// Events up to this sequence are lost.
    gone: u64,
    /// Time until which programs ask for events; `None` if no program ever did.
    asked_until: Option<Instant>,
    /// Program that asked last.
    asker: Arc<str>,
}

impl InputLog {
    /// Returns the program that asks for events, if any.
    pub(super) fn asks(&self, now: Instant) -> Option<Arc<str>> {
        self.asked_until.is_some_and(|until| now < until).then(|| Arc::clone(&self.asker))
    }

    /// Notes that a program asks for events until `until`. Returns whether pages must be notified.
    fn ask(&mut self, asker: &Arc<str>, now: Instant, until: Instant) -> bool {
        let is_new = self.asks(now).is_none_or(|before| before != *asker);
        if self.asks(now).is_none() {
            // The program does not get input from before its request.
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

    /// Returns the events after a sequence; a larger sequence than the newest is from before a restart of the
    /// daemon.
    fn after(&self, sequence: u64) -> Input {
        let events = self.events.iter().filter(|event| event.sequence > sequence).cloned().collect();
        let missed = sequence < self.gone || sequence > self.sequence;
        Input { sequence: self.sequence, events, missed }
    }
}

impl View {
    async fn input_after(&self, sequence: u64, deadline: Instant) -> Input {
        loop {
            // Created before the look, so that an event in between wakes it.
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
    /// Stores input of a page. Returns whether a program asks for it; otherwise it is dropped.
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

    /// Returns keyboard and mouse events after a sequence, waiting for the first; without a sequence, only
    /// the newest sequence, at once. Pages report them from now on, until five seconds after this call.
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
