//! The world as a whole: commands, steps, its pace, its published states.

use std::sync::Arc;
use std::time::Duration;

use simd_core::simulation::command::{ClaimId, Clamped, PhysicsChange, SetTargets};
use simd_core::{Command, PhysicsSettings, Reply};

use super::{CallError, RunState, SimHandle};
use crate::driver::{Done, Event, Pace, PaceChange, Published, Statistics, Stepped};

impl SimHandle {
    /// Changes the world.
    ///
    /// # Errors
    /// Returns an error if the world refuses it, or the mailbox is full.
    pub async fn command(&self, command: Command) -> Result<Done, CallError> {
        if !self.call.only().is_empty() || self.call.note.is_some() {
            let robots = command.robots();
            self.note_robots(robots.iter().flatten().copied());
            self.check_robots(robots.as_deref())?;
        }
        match command {
            Command::SaveState { .. }
            | Command::DeleteSavedState { .. }
            | Command::ImportSavedState { .. } => self.change_saved_state(command).await,
            _ => self.post(command).await,
        }
    }

    pub(super) async fn post(&self, command: Command) -> Result<Done, CallError> {
        let (claim, sender) = (self.renewed_claim(), self.call.sender());
        self.ask(|reply| Event::Command { command, claim, sender, reply }).await
    }

    /// Plays, pauses or stops the world.
    ///
    /// # Errors
    /// Returns an error if the mailbox is full.
    pub async fn set_state(&self, state: RunState) -> Result<Done, CallError> {
        self.check_robots(None)?;
        if state == RunState::Playing {
            self.check_no_lockstep()?;
        }
        let (claim, sender) = (self.renewed_claim(), self.call.sender());
        self.ask(|reply| Event::SetState { state, claim, sender, reply }).await
    }

    /// Makes steps as fast as possible, and returns when they are done. Dropping the future ends them.
    ///
    /// # Errors
    /// Returns an error while playing, if the number is 0 or above the limit, or if the daemon drains. Also
    /// if a play, a pause, a stop or a reset intervenes.
    pub async fn step(&self, steps: u64) -> Result<Done, CallError> {
        Ok(self.step_with(None, steps).await?.done)
    }

    /// Sets targets and makes steps. If either is refused, neither is done. Steps of earlier calls are made
    /// first, with the new targets too.
    ///
    /// # Errors
    /// As [`SimHandle::step`], and if the world refuses the targets.
    pub async fn step_with(&self, targets: Option<SetTargets>, steps: u64) -> Result<Stepped, CallError> {
        self.check_steps(steps)?;
        self.check_no_lockstep()?;
        self.step_alone(targets, steps).await
    }

    /// Like `step_with`, together with the other lockstep members: once each of them has asked. Targets are
    /// set at once, while the world waits, unless the steps are already known to be refused.
    ///
    /// # Errors
    /// Returns an error if the caller is not a member, has asked already, or leaves, and as
    /// [`SimHandle::step_with`].
    pub async fn step_with_others(
        &self,
        member: &str,
        targets: Option<SetTargets>,
        steps: u64,
    ) -> Result<Stepped, CallError> {
        self.check_steps(steps)?;
        self.step_together(member, targets, steps).await
    }

    /// Sets targets before steps with `steps_claim`, if those are allowed; the outer `None` means that the
    /// claim is not known yet.
    pub(super) async fn set_targets_of_member(
        &self,
        targets: SetTargets,
        steps_claim: Option<Option<ClaimId>>,
    ) -> Result<Vec<Clamped>, CallError> {
        self.note_robots(targets.robots.iter().map(|targets| targets.robot.as_str()));
        let (claim, sender) = (self.renewed_claim(), self.call.sender());
        let set = self.ask(|reply| Event::TargetsOfMember { targets, claim, steps_claim, sender, reply });
        match set.await?.applied.reply {
            Reply::Targets { clamped, changed_law: _ } => Ok(clamped),
            _ => Ok(Vec::new()),
        }
    }

    fn check_steps(&self, steps: u64) -> Result<(), CallError> {
        self.check_robots(None)?;
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
        Ok(())
    }

    pub(super) async fn step_alone(
        &self,
        targets: Option<SetTargets>,
        steps: u64,
    ) -> Result<Stepped, CallError> {
        let (claim, sender) = (self.renewed_claim(), self.call.sender());
        self.until_drained(self.ask(|reply| Event::Step { targets, steps, claim, sender, reply })).await?
    }

    /// Changes physics settings and pace. If either is refused, neither is changed. Returns the settings in
    /// force.
    ///
    /// # Errors
    /// Returns an error if a value is out of its bounds.
    pub async fn set_physics(
        &self,
        change: PhysicsChange,
        pace: PaceChange,
    ) -> Result<(Done, PhysicsSettings, Pace), CallError> {
        self.check_robots(None)?;
        if let Some(factor) = pace.factor {
            Pace::RealTime { factor }.check()?;
        }
        let (claim, sender) = (self.renewed_claim(), self.call.sender());
        self.ask(|reply| Event::SetPhysics { change, pace, claim, sender, reply }).await
    }

    /// Returns the newest state, at once.
    pub fn newest(&self) -> Arc<Published> {
        self.inner.driver.state_cell.newest()
    }

    /// Returns the newest state once it is newer than `sequence`; after `timeout`, the newest one.
    ///
    /// # Errors
    /// Returns an error if the daemon drains before that, or the driver failed.
    pub async fn newer_than(
        &self,
        sequence: u64,
        timeout: Option<Duration>,
    ) -> Result<Arc<Published>, CallError> {
        let newer = self.inner.driver.state_cell.newer_than(sequence);
        let Some(timeout) = timeout else { return self.until_drained(newer).await };
        match tokio::time::timeout(timeout, self.until_drained(newer)).await {
            Ok(newer) => newer,
            Err(_elapsed) => Ok(self.newest()),
        }
    }

    /// Returns timing statistics, without waiting for a step. A step that takes longer than the mean shows
    /// while it runs.
    pub fn statistics(&self) -> Statistics {
        self.statistics_at(&self.newest())
    }

    /// Returns timing statistics that match a published state.
    pub fn statistics_at(&self, state: &Published) -> Statistics {
        let driver = &self.inner.driver;
        let present = driver.state_cell.present_step(std::time::Instant::now()).as_secs_f64();
        Statistics {
            mailbox_refusals: driver.mailbox.refusals(),
            step_duration: state.statistics.step_duration.max(present),
            ..state.statistics
        }
    }

    /// Returns the settings and the pace in force.
    pub fn physics(&self) -> (PhysicsSettings, Pace) {
        let newest = self.newest();
        (newest.physics, newest.statistics.pace)
    }
}
