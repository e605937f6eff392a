//! The one way to the world, for every front-end: plain types, no wire types.
//!
//! * Here: commands to the driver, states, events, the end.
//! * `claims`: claims on joints and their leases.
//! * `clients`: who is here, and whose targets joints have.
//! * `heavy`: permits for reads that take long.
//! * `once`: answers to retries.
//! * `parameters`: sliders and buttons.
//! * Bringing robots in is in [`crate::loading`].

mod call_error;
mod claims;
mod clients;
mod event_log;
mod heavy;
mod info;
mod once;
mod parameters;
mod published;
mod robots;
#[cfg(test)]
mod tests;

use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use simd_core::simulation::command::{PhysicsChange, ResetScope, SetTargets};
use simd_core::{Command, PhysicsSettings};
use tokio::sync::oneshot;
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

pub use call_error::CallError;
pub use claims::Unproven;
pub use clients::{Aim, Caller, Client, Peer, TargetSource, Transport};
pub(crate) use clients::{Scope, UnderWay};
pub(crate) use event_log::EventLog;
pub use event_log::{EventBatch, Happened, LoggedEvent};
pub(crate) use heavy::Cancelled;
use heavy::HeavyWork;
pub use info::{DaemonInfo, DaemonLimits};
pub(crate) use once::{Asked, Outcome};
pub use parameters::{NameTaken, Parameter, ParameterChange, ParameterKind, ParameterList};
pub use published::{Done, Pace, PaceChange, Published, RunState, Statistics, Stepped};
pub use robots::{AssetState, Loaded, Prepared, Reloaded, Source, SpawnRequest, Validated};

use crate::driver::{self, Event, ReplyTo};
use crate::loading::Loader;
use claims::Leases;
use clients::Clients;
use once::Answers;
use parameters::Parameters;

/// How often what nobody needs any more is looked for.
const TIDY: Duration = Duration::from_secs(10);

/// The one way to the world. Clones are the same handle.
#[derive(Clone, Debug)]
pub struct SimHandle {
    inner: Arc<Inner>,
}

#[derive(Debug)]
struct Inner {
    driver: driver::Link,
    loader: Loader,
    answers: Answers,
    leases: Leases,
    clients: Arc<Clients>,
    parameters: Parameters,
    heavy: HeavyWork,
    info: DaemonInfo,
    draining: CancellationToken,
}

impl SimHandle {
    /// A handle on a driver that was started.
    pub(crate) fn new(driver: driver::Link, loader: Loader, info: DaemonInfo) -> Self {
        let (answers, leases, clients, heavy, draining) = Default::default();
        let parameters = Parameters::new(info.limits.parameters);
        Self {
            inner: Arc::new(Inner {
                driver,
                loader,
                answers,
                leases,
                clients,
                parameters,
                heavy,
                info,
                draining,
            }),
        }
    }

    /// Changes the world.
    ///
    /// # Errors
    /// Where the world refuses, or the mailbox is full.
    pub async fn command(&self, command: Command) -> Result<Done, CallError> {
        if let Command::SetTargets(targets) = &command
            && let Some(claim) = targets.claim
        {
            self.renew(claim);
        }
        let puts_targets_back = match &command {
            Command::Reset(scope) => scope.state || *scope == ResetScope::default(),
            Command::RestoreState { .. } => true,
            _ => false,
        };
        let done = self.ask(|reply| Event::Command { command, reply }).await?;
        if puts_targets_back {
            self.forget_targets();
        }
        Ok(done)
    }

    /// Plays, pauses or stops.
    ///
    /// # Errors
    /// Where the mailbox is full.
    pub async fn set_state(&self, state: RunState) -> Result<Done, CallError> {
        let done = self.ask(|reply| Event::SetState { state, reply }).await?;
        if state == RunState::Stopped {
            self.forget_targets();
        }
        Ok(done)
    }

    /// Does steps as fast as possible, and answers when they are done. Dropping
    /// the future ends them.
    ///
    /// # Errors
    /// While playing, where the number is 0 or beyond the limit, where a play, a
    /// pause, a stop or a reset comes between, and where the daemon drains.
    pub async fn step(&self, steps: u64) -> Result<Done, CallError> {
        Ok(self.step_with(None, steps).await?.done)
    }

    /// Sets targets and does steps, in one: both or, where one is refused, nothing.
    /// Steps that another call waits for come first, and have the targets too.
    ///
    /// # Errors
    /// Those of [`SimHandle::step`], and where the world refuses the targets.
    pub async fn step_with(&self, targets: Option<SetTargets>, steps: u64) -> Result<Stepped, CallError> {
        let limit = self.inner.info.limits.steps;
        if steps == 0 {
            return Err(CallError::InvalidValue {
                element: "steps".into(),
                value: "0".into(),
                expected: "it must be at least 1".into(),
            });
        }
        if steps > limit {
            return Err(CallError::LimitExceeded { what: "steps".into(), value: steps, limit });
        }
        if let Some(claim) = targets.as_ref().and_then(|targets| targets.claim) {
            self.renew(claim);
        }
        self.until_drained(self.ask(|reply| Event::Step { targets, steps, reply })).await?
    }

    /// Changes how steps follow the wall clock.
    ///
    /// # Errors
    /// Where the factor is not within 0.001 and 1,000.
    pub async fn set_pace(&self, pace: Pace) -> Result<Done, CallError> {
        let (done, _, _) = self.set_physics(PhysicsChange::default(), pace.into()).await?;
        Ok(done)
    }

    /// Changes how steps are done and how they follow the wall clock: both or,
    /// where one of them is refused, nothing. Answers with what is in force.
    ///
    /// # Errors
    /// Where a value is not within its bounds.
    pub async fn set_physics(
        &self,
        change: PhysicsChange,
        pace: PaceChange,
    ) -> Result<(Done, PhysicsSettings, Pace), CallError> {
        if let Some(factor) = pace.factor {
            Pace::RealTime { factor }.check()?;
        }
        self.ask(|reply| Event::SetPhysics { change, pace, reply }).await
    }

    /// The newest state, at once.
    pub fn newest(&self) -> Arc<Published> {
        self.inner.driver.board.newest()
    }

    /// The newest state once it is newer than `sequence`; after `timeout`, the
    /// newest that there is.
    ///
    /// # Errors
    /// Where the daemon drains before that, or the driver failed.
    pub async fn newer_than(
        &self,
        sequence: u64,
        timeout: Option<Duration>,
    ) -> Result<Arc<Published>, CallError> {
        let newer = self.inner.driver.board.newer_than(sequence);
        let Some(timeout) = timeout else { return self.until_drained(newer).await };
        match tokio::time::timeout(timeout, self.until_drained(newer)).await {
            Ok(newer) => newer,
            Err(_elapsed) => Ok(self.newest()),
        }
    }

    /// How well the world keeps time. Never waits for a step; one that takes longer than the mean of the last
    /// ones shows while it is going on.
    pub fn statistics(&self) -> Statistics {
        self.statistics_at(&self.newest())
    }

    /// The same, with what a published state says.
    pub fn statistics_at(&self, state: &Published) -> Statistics {
        let driver = &self.inner.driver;
        let present = driver.board.present_step(std::time::Instant::now()).as_secs_f64();
        Statistics {
            mailbox_refusals: driver.mailbox.refusals(),
            step_duration: state.statistics.step_duration.max(present),
            ..state.statistics
        }
    }

    /// What is in force.
    pub fn physics(&self) -> (PhysicsSettings, Pace) {
        let newest = self.newest();
        (newest.physics, newest.statistics.pace)
    }

    /// Does what may take milliseconds, and reads nothing but a published state, where it holds nobody up.
    ///
    /// # Errors
    /// At once where too many such calls wait.
    pub(crate) async fn heavy<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Cancelled) -> T + Send + 'static,
    ) -> Result<T, CallError> {
        self.inner.heavy.run(work).await
    }

    /// Who this daemon is, and its limits.
    pub fn info(&self) -> &DaemonInfo {
        &self.inner.info
    }

    /// Does the work of a request, or gives the answer that the same request got before.
    ///
    /// # Errors
    /// Where its id was that of another request; what the work gives is in the outcome.
    pub(crate) async fn once<W>(&self, asked: Asked, work: W) -> Result<Outcome, CallError>
    where
        W: Future<Output = Outcome> + Send + 'static,
    {
        self.inner.answers.once(asked, work).await
    }

    /// Bytes of all remembered answers.
    #[cfg(test)]
    pub(crate) fn remembered(&self) -> usize {
        self.inner.answers.weight()
    }

    /// What happened after an event's number, at once.
    pub fn events_after(&self, sequence: u64) -> EventBatch {
        self.inner.driver.events.after(sequence)
    }

    /// What happened after an event's number, waiting at most `timeout` for the first.
    ///
    /// # Errors
    /// Where the daemon drains before that, or the driver failed.
    pub async fn next_events(&self, after: u64, timeout: Duration) -> Result<EventBatch, CallError> {
        self.until_drained(self.inner.driver.events.next(after, timeout)).await
    }

    /// Cancelled when the daemon drains: every stream ends with OK then.
    pub fn draining(&self) -> CancellationToken {
        self.inner.draining.clone()
    }

    /// Cancelled when the driver has ended, because it was told to or because it failed.
    pub(crate) fn driver_ended(&self) -> CancellationToken {
        self.inner.driver.mailbox.ended().clone()
    }

    /// What the driver failed with, if it did.
    pub(crate) fn driver_failure(&self) -> Option<&str> {
        self.inner.driver.mailbox.failure()
    }

    /// Ends the driver after the step that it is in.
    pub(crate) fn end_driver(&self) {
        self.inner.driver.mailbox.close();
    }

    /// Looks now and then for what nobody needs any more. Ends when the daemon drains.
    pub(crate) async fn keep_tidy(self) {
        let draining = self.draining();
        let mut ticks = tokio::time::interval(TIDY);
        while draining.run_until_cancelled(ticks.tick()).await.is_some() {
            self.tidy(Instant::now());
        }
    }

    /// Lets go of what nobody needs any more.
    pub(crate) fn tidy(&self, now: Instant) {
        self.inner.answers.tidy(now);
        self.inner.loader.tidy(now);
    }

    /// What is known of robots' descriptions.
    pub(crate) fn loader(&self) -> &Loader {
        &self.inner.loader
    }

    async fn ask<T>(&self, event: impl FnOnce(ReplyTo<T>) -> Event) -> Result<T, CallError> {
        let (reply, answer) = oneshot::channel();
        let mailbox = &self.inner.driver.mailbox;
        mailbox.post(event(reply))?;
        match answer.await {
            Ok(answer) => answer,
            Err(_dropped) => {
                // Only an ending driver drops a question; then it says why.
                mailbox.ended().cancelled().await;
                Err(mailbox.end())
            }
        }
    }

    async fn until_drained<T>(&self, work: impl Future<Output = T>) -> Result<T, CallError> {
        tokio::select! {
            biased;
            done = work => Ok(done),
            () = self.inner.draining.cancelled() => Err(CallError::ShuttingDown),
            () = self.inner.driver.mailbox.ended().cancelled() => Err(self.inner.driver.mailbox.end()),
        }
    }
}
