//! The driver's loop: waits for an event and handles it, forever. Every cause of change is in
//! [`Driver::handle_event`].

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use simd_core::simulation::EventKind;
use simd_core::simulation::command::{ClaimId, PhysicsChange, ResetScope};
use simd_core::{Applied, Command, Error, PhysicsSettings, Reply};

use super::call_budget::CallBudget;
use super::event::Event;
use super::event_log::{EventLog, LogEvent};
use super::long_step::LongSteps;
use super::mailbox::Inbox;
use super::meter::Meter;
use super::obstruction_watch::ObstructionWatch;
use super::pacer::{Due, Pacer};
use super::published::{Done, Pace, PaceChange, Statistics, Stepped};
use super::published_state_cell::Publisher;
use super::recorder_queue::{AppliedCommand, Entry, RecorderQueue, Sender};
use super::relay::{Addressed, Answer, Relay};
use super::sensor_log::SensorWriter;
use super::step_queue::{Pending, StepQueue};
use super::world::World;
use crate::call_error::CallError;
use crate::run_state::RunState;

/// Owner of the world and of everything that decides when it steps.
pub(super) struct Driver<W> {
    pub(super) world: W,
    pub(super) inbox: Inbox,
    pub(super) publisher: Publisher,
    pub(super) events: Arc<EventLog>,
    pub(super) sensors: SensorWriter,
    pub(super) state: RunState,
    pub(super) pace: Pace,
    pub(super) pacer: Pacer,
    pub(super) meter: Meter,
    pub(super) obstructions: ObstructionWatch,
    /// Steps that callers wait for; empty while playing.
    pub(super) steps: StepQueue,
    /// Whether the world changed since the last published state.
    pub(super) has_unpublished: bool,
    /// Steps since the start.
    pub(super) iterations: u64,
    pub(super) calls: CallBudget,
    pub(super) long_steps: LongSteps,
    /// Number of calls that may still be served before an interrupted step restarts.
    pub(super) before_retry: usize,
    /// Queue of the present recorder, if any.
    pub(super) recorder_queue: Option<Arc<RecorderQueue>>,
    /// Thread that sends answers in place of the driver, if any.
    pub(super) relay: Option<Relay>,
}

impl<W: World> Driver<W> {
    /// Runs until it is asked to end.
    pub(super) fn run(&mut self) {
        while self.run_once().is_continue() {}
    }

    /// Returns whether [`run_once`](Self::run_once) has something to do that does not wait for time, as it
    /// does while the world plays.
    pub(super) fn has_work(&mut self) -> bool {
        self.state != RunState::Playing && (self.inbox.has_some() || self.steps.is_wanted())
    }

    /// Publishes changes of a caller that disconnected before its first step.
    pub(super) fn publish_pending(&mut self) {
        if self.has_unpublished && self.state != RunState::Playing {
            self.publish();
        }
    }

    /// Handles one event.
    pub(super) fn run_once(&mut self) -> ControlFlow<()> {
        let event = self.next_event();
        self.publisher.work_begins(Instant::now());
        let goes_on = self.handle_event(event);
        if self.recorder_queue.as_ref().is_some_and(|queue| queue.takes_world()) {
            self.record_world();
        }
        self.publisher.work_ends();
        goes_on
    }

    /// Returns the next event. Calls are served before a step that is due, in their order, for a part of its
    /// period.
    fn next_event(&mut self) -> Event {
        let due = match self.state {
            RunState::Playing => Some(self.pacer.next(Instant::now())),
            RunState::Paused | RunState::Stopped if self.steps.is_wanted() => Some(Due::Now),
            RunState::Paused | RunState::Stopped => {
                // Their caller disconnected before the first step.
                if self.has_unpublished {
                    self.publish();
                }
                None
            }
        };
        match due {
            Some(Due::Now) if !self.may_serve() => Event::StepDue,
            Some(Due::Now) => self.inbox.try_next().unwrap_or(Event::StepDue),
            Some(Due::At(deadline)) => self.inbox.next_before(deadline).unwrap_or(Event::StepDue),
            None => self.inbox.next(),
        }
    }

    /// Returns whether a call may go before a step that is due.
    fn may_serve(&mut self) -> bool {
        // The call that interrupted the step is in the mailbox, after others.
        if self.before_retry > 0 && self.inbox.has_interrupting() {
            self.before_retry -= 1;
            return true;
        }
        let settings = self.world.settings();
        self.calls.may_serve(Instant::now(), period(self.pace, &settings).unwrap_or(settings.time_step))
    }

    fn handle_event(&mut self, event: Event) -> ControlFlow<()> {
        self.calls.served();
        match event {
            Event::StepDue => self.step(),
            Event::Command { command, claim, sender, reply } => {
                let answer = self.command(&command, claim, sender);
                self.answer(Answer::Applied(Addressed { reply, answer }, command));
            }
            Event::SetState { state, claim, sender, reply } => {
                let answer = self.set_state(state, claim, sender);
                self.answer(Answer::Done(Addressed { reply, answer }));
            }
            Event::Step { reply, .. } if reply.is_closed() => {}
            Event::Step { targets, steps, claim, sender, reply } => {
                match self.begin_steps(targets, claim, sender) {
                    Ok(clamped) => self.steps.push(steps, clamped, reply),
                    Err(refused) => self.answer_steps(reply, Err(refused)),
                }
            }
            Event::TargetsOfMember { reply, .. } if reply.is_closed() => {}
            Event::TargetsOfMember { targets, claim, steps_claim, sender, reply } => {
                let command = Command::SetTargets(targets);
                let answer = self.targets_of_member(&command, claim, steps_claim, sender);
                self.answer(Answer::Applied(Addressed { reply, answer }, command));
            }
            Event::SetPhysics { change, pace, claim, sender, reply } => {
                let answer = self.set_physics(change, pace, claim, sender);
                self.answer(Answer::Physics(Addressed { reply, answer }));
            }
            Event::Record { queue, reply } => {
                let answer = Ok(self.set_recorder_queue(queue));
                self.answer(Answer::Moment(Addressed { reply, answer }));
            }
            Event::WholeState { reply } if reply.is_closed() => {}
            Event::WholeState { reply } => {
                let answer = Ok(self.whole_state());
                self.answer(Answer::WholeState(Addressed { reply, answer }));
            }
            Event::Shutdown => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    /// Applies a command. Commands reach the world only here: their sequence, each with its step, is a
    /// complete recording of a run.
    pub(super) fn apply(
        &mut self,
        command: &Command,
        claim: Option<ClaimId>,
        sender: Sender,
    ) -> Result<Applied, Error> {
        let applied = self.world.apply_for(command, claim)?;
        if self.recorder_queue.is_some() {
            let (at, command) = (applied.at, command.clone());
            self.record(Entry::Applied(Box::new(AppliedCommand { at, command, claim, sender })));
        }
        tracing::trace!(epoch = applied.at.epoch, step = applied.at.step, ?command, "applied");
        // A restored state has its own time step.
        self.follow_pace();
        self.long_steps.applied(command);
        Ok(applied)
    }

    pub(super) fn command(
        &mut self,
        command: &Command,
        claim: Option<ClaimId>,
        sender: Sender,
    ) -> Result<Done, CallError> {
        let applied = self.apply(command, claim, sender)?;
        match command {
            Command::Reset(_) => self.supersede_steps("a reset"),
            Command::RestoreState { .. } => self.supersede_steps("a restored state"),
            _ => {}
        }
        // The sender sees the change in states that it reads after the answer. While the world plays, the
        // next step shows the values of targets and wrenches, in which they act: they may arrive with every
        // step.
        let is_shown_by_next_step = matches!(
            (command, &applied.reply),
            (Command::ApplyWrench(_) | Command::PullLink(_), _)
                | (_, Reply::Targets { changed_law: false, .. })
        );
        if self.state != RunState::Playing || !is_shown_by_next_step {
            self.publish();
        }
        self.log_events();
        Ok(self.done(applied))
    }

    fn step(&mut self) {
        self.calls.step();
        let begun = Instant::now();
        self.publisher.step_begins(begun);
        let is_whole = self.long_steps.is_expected().then(|| {
            let (watch, least) = (self.inbox.watch(), self.long_steps.uninterrupted());
            let interrupt = || watch.is_closing() || (watch.has_interrupting() && begun.elapsed() >= least);
            self.world.step_interruptible(&interrupt)
        });
        let is_whole = is_whole.unwrap_or_else(|| {
            self.world.step();
            true
        });
        self.publisher.step_ends();
        let ended = Instant::now();
        if !is_whole {
            self.long_steps.interrupted(ended - begun);
            self.before_retry = self.inbox.capacity();
            return;
        }
        self.long_steps.ended(ended - begun);
        self.before_retry = 0;
        self.iterations += 1;
        self.meter.record(ended, self.world.settings().time_step, ended - begun);
        let state_cell = self.publisher.state_cell();
        state_cell.step_durations.observe(ended - begun);
        if let Some(lateness) = self.pacer.lateness(begun).filter(|_| self.state == RunState::Playing) {
            state_cell.step_lateness.observe(lateness);
        }
        let became_paused = self.state == RunState::Stopped;
        match self.state {
            RunState::Playing => self.pacer.stepped(),
            // The world is no longer at its start.
            RunState::Stopped => self.state = RunState::Paused,
            RunState::Paused => {}
        }
        self.publish();
        let world = &mut self.world;
        self.sensors.measure(|due| world.take_due_samples(due));
        if self.recorder_queue.is_some() {
            let newest = self.publisher.state_cell().newest();
            self.record(Entry::Step(newest));
        }
        self.log_events();
        self.log_obstructions();
        let at = self.world.now();
        if became_paused {
            self.log(LogEvent::StateChanged { at, state: RunState::Paused });
        }
        if let Some(dropped_lag) = self.pacer.report(ended) {
            tracing::warn!(dropped_lag, "the world cannot keep up; lag is dropped");
            self.log(LogEvent::Overrun { at, dropped_lag });
        }
        if let Some(Pending { clamped, reply, .. }) = self.steps.stepped() {
            let done = self.done(Applied { at, reply: Reply::Done });
            let state = self.publisher.state_cell().newest();
            self.answer_steps(reply, Ok(Stepped { done, state, clamped }));
        }
    }

    fn set_state(
        &mut self,
        state: RunState,
        claim: Option<ClaimId>,
        sender: Sender,
    ) -> Result<Done, CallError> {
        self.world.allow_world(claim)?;
        let now = Instant::now();
        let before = self.state;
        match state {
            RunState::Playing if before == RunState::Playing => {}
            RunState::Playing => {
                self.supersede_steps("a play");
                self.pacer.restart(now);
                self.meter.restart(now);
            }
            RunState::Paused => self.supersede_steps("a pause"),
            RunState::Stopped => {
                let scope = ResetScope { time: true, state: true, spawned: false };
                self.apply(&Command::Reset(scope), claim, sender)?;
                self.supersede_steps("a stop");
            }
        }
        self.state = state;
        self.publish();
        self.log_events();
        let at = self.world.now();
        if state != before {
            self.log(LogEvent::StateChanged { at, state });
        }
        Ok(self.done(Applied { at, reply: Reply::Done }))
    }

    fn set_physics(
        &mut self,
        change: PhysicsChange,
        pace: PaceChange,
        claim: Option<ClaimId>,
        sender: Sender,
    ) -> Result<(Done, PhysicsSettings, Pace), CallError> {
        self.world.allow_world(claim)?;
        let (settings_before, pace_before) = (self.world.settings(), self.pace);
        let at = if change == PhysicsChange::default() {
            self.world.now()
        } else {
            self.apply(&Command::SetPhysics(change), claim, sender)?.at
        };
        // Computed here and not by the caller, since another change may have happened in between.
        self.pace = pace.of(self.pace);
        self.follow_pace();
        self.publish();
        self.log_events();
        let settings = self.world.settings();
        if self.pace != pace_before && settings == settings_before {
            // The world does not know the pace, so it reported nothing.
            self.log(LogEvent::PhysicsChanged { at, settings, pace: self.pace });
        }
        Ok((self.done(Applied { at, reply: Reply::Physics(settings) }), settings, self.pace))
    }

    /// Passes the period of a step to the pacer.
    fn follow_pace(&mut self) {
        let period = period(self.pace, &self.world.settings());
        self.pacer.set_period(period, Instant::now());
    }

    pub(super) fn publish(&mut self) {
        self.has_unpublished = false;
        let playing = self.state == RunState::Playing;
        let statistics = Statistics {
            state: self.state,
            pace: self.pace,
            real_time_factor: if playing { self.meter.real_time_factor() } else { 0.0 },
            overruns: self.pacer.overruns(),
            dropped_lag: self.pacer.dropped_lag(),
            iterations: self.iterations,
            step_duration: self.meter.step_duration().max(self.long_steps.ran().as_secs_f64()),
            mailbox_refusals: self.inbox.refusals(),
        };
        let world = &self.world;
        self.publisher.publish(|state| {
            world.observe(&mut state.state);
            state.physics = world.settings();
            state.statistics = statistics;
        });
        self.sensors.published();
    }

    /// Logs the world's events, after the state that shows them is published.
    fn log_events(&mut self) {
        for event in self.world.take_events() {
            let event = match event.kind {
                EventKind::PhysicsChanged(settings) => {
                    LogEvent::PhysicsChanged { at: event.at, settings, pace: self.pace }
                }
                _ => LogEvent::World(event),
            };
            self.log(event);
        }
    }

    fn done(&self, applied: Applied) -> Done {
        let newest = self.publisher.state_cell().newest();
        Done { applied, sequence: newest.sequence, wall_time: newest.wall_time }
    }
}

/// Returns the wall seconds of a step; `None` for steps without a pace.
pub(super) fn period(pace: Pace, settings: &PhysicsSettings) -> Option<f64> {
    match pace {
        Pace::RealTime { factor } => Some(settings.time_step / factor),
        Pace::AsFastAsPossible { .. } => None,
    }
}
