//! Clients that step one world together. It advances once all of them have asked, to the nearest step that
//! one asked for. A client that does not ask in time, or disconnects, is no longer a member, and the others
//! continue.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

use simd_core::simulation::command::SetTargets;
use tokio::sync::{Notify, oneshot};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use self::group::{Group, Member, SettingTargets, State};
use super::{CallError, SimHandle};
use crate::driver::{LockstepChange, LogEvent, Stepped};

mod group;
#[cfg(test)]
mod tests;

/// Maximum number of members.
const MEMBERS: usize = 64;
/// Permitted times for a member from one step to its next request.
const TIMEOUT: std::ops::RangeInclusive<Duration> = Duration::from_millis(10)..=Duration::from_secs(3600);

/// Members, in the order in which they joined.
#[derive(Debug, Default)]
pub(super) struct Lockstep {
    /// Locked for a look or a change, never across a step.
    group: Mutex<Group>,
    /// Notifies of a changed deadline of a member.
    changed: Notify,
}

/// A member, as others see it.
#[derive(Clone, Debug, PartialEq)]
pub struct LockstepMember {
    /// Name of the client; empty if it gives none.
    pub client: Arc<str>,
    /// Longest time from one step to its next request.
    pub timeout: Duration,
    /// Number of steps that it waits for; 0 if the others wait for it.
    pub waits_for: u64,
}

/// Notifies when dropped that a member may have changed.
struct NotifyOnDrop<'n>(&'n Notify);

impl Drop for NotifyOnDrop<'_> {
    fn drop(&mut self) {
        self.0.notify_waiters();
    }
}

impl Lockstep {
    fn lock(&self) -> MutexGuard<'_, Group> {
        self.group.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SimHandle {
    /// Makes the caller a member. Returns its id, which each request must have, and the other members. With
    /// `until`, the membership lasts as long as its connection.
    ///
    /// # Errors
    /// Returns an error if the time is not between 10 ms and an hour, or there are too many members.
    pub fn join_lockstep(
        &self,
        client: &str,
        timeout: Duration,
        until: Option<CancellationToken>,
    ) -> Result<(Arc<str>, Vec<LockstepMember>), CallError> {
        self.check_robots(None)?;
        self.check_holds_world()?;
        if !TIMEOUT.contains(&timeout) {
            return Err(CallError::InvalidValue {
                element: "timeout".into(),
                value: format!("{} s", timeout.as_secs_f64()),
                expected: "it must be between 0.01 s and 3600 s".into(),
            });
        }
        let mut random = [0; 16];
        getrandom::fill(&mut random).map_err(|error| CallError::Internal { message: error.to_string() })?;
        let id: Arc<str> = random.iter().map(|byte| format!("{byte:02x}")).collect::<String>().into();
        {
            let mut group = self.inner.lockstep.lock();
            if group.members.len() >= MEMBERS {
                return Err(CallError::LimitExceeded {
                    what: "the number of members in lockstep".into(),
                    value: MEMBERS as u64 + 1,
                    limit: MEMBERS as u64,
                });
            }
            let state = State::Computes { deadline: Instant::now() + timeout };
            let (id, client, claim) = (Arc::clone(&id), client.into(), self.call.claim);
            group.members.push(Member { id, client, timeout, claim, state });
        }
        self.log_lockstep(client, LockstepChange::Joined);
        tokio::spawn(self.clone().watch_member(Arc::clone(&id), until.unwrap_or_default()));
        Ok((id, self.lockstep_members()))
    }

    /// Ends a membership, and refuses its waiting request.
    ///
    /// # Errors
    /// Returns an error if the member does not exist (any more).
    pub fn leave_lockstep(&self, id: &str) -> Result<(), CallError> {
        self.remove_member(id, LockstepChange::Left).ok_or(CallError::LockstepMemberNotFound)
    }

    /// Returns the members, in the order in which they joined.
    pub fn lockstep_members(&self) -> Vec<LockstepMember> {
        let seen = |member: &Member| LockstepMember {
            client: Arc::clone(&member.client),
            timeout: member.timeout,
            waits_for: match member.state {
                State::Waits { remaining, sets_targets: None, .. } => remaining,
                State::Waits { .. } | State::Computes { .. } => 0,
            },
        };
        self.inner.lockstep.lock().members.iter().map(seen).collect()
    }

    /// Refuses calls that only members may make while there are any. The holder of a claim on the world is
    /// exempt.
    pub(super) fn check_no_lockstep(&self) -> Result<(), CallError> {
        if self.holds_world() {
            return Ok(());
        }
        match self.inner.lockstep.lock().members.len() {
            0 => Ok(()),
            members => Err(CallError::InLockstep { members: members as u64 }),
        }
    }

    /// Sets targets and makes steps together with the other members. Answers once the world has advanced by
    /// `steps`, for which each of the others must have asked too. If the targets are refused, or the steps
    /// are known to be refused, nothing is set, and the member has not asked.
    ///
    /// # Errors
    /// Returns an error if the caller is not a member, has asked already, or leaves, or if the targets or
    /// steps are refused.
    pub(super) async fn step_together(
        &self,
        id: &str,
        targets: Option<SetTargets>,
        steps: u64,
    ) -> Result<Stepped, CallError> {
        // Notifies even if the caller disconnects before its answer, or its targets are refused: dropped
        // after the state is changed.
        let _changed = NotifyOnDrop(&self.inner.lockstep.changed);
        let (reply, answer) = oneshot::channel();
        let steps_claim = {
            // Checked and changed under one lock: another request of this member may arrive at the same time.
            let mut group = self.inner.lockstep.lock();
            let member = group.asks(id)?;
            let now = Instant::now();
            let sets_targets = match member.state {
                State::Computes { deadline } if targets.is_some() => {
                    Some(SettingTargets { deadline: now + member.timeout, asks_by: deadline })
                }
                _ => None,
            };
            member.claim = self.call.claim;
            member.state = State::Waits { remaining: steps, is_counted: false, sets_targets, reply };
            group.steps_claim(&self.inner.leases)
        };
        let mut clamped = Vec::new();
        if let Some(targets) = targets {
            clamped = self.set_targets_of_member(targets, steps_claim).await?;
            self.inner.lockstep.lock().targets_are_set(id);
        }
        self.inner.lockstep.changed.notify_waiters();
        self.advance_lockstep();
        let stepped = answer.await.map_err(|_left| CallError::LockstepMemberNotFound)??;
        Ok(Stepped { clamped, ..stepped })
    }

    /// Advances the world while steps are due, in one task at a time.
    fn advance_lockstep(&self) {
        {
            let mut group = self.inner.lockstep.lock();
            if group.is_stepping || !group.is_due(&self.inner.leases) {
                return;
            }
            group.is_stepping = true;
        }
        let handle = self.clone();
        // A separate task: it continues if the caller that started it disconnects.
        tokio::spawn(async move {
            loop {
                let due = {
                    let mut group = handle.inner.lockstep.lock();
                    let due = group.begin(&handle.inner.leases);
                    group.is_stepping = due.is_some();
                    due
                };
                let Some((steps, claim)) = due else { return };
                let outcome = handle.acting_for(claim).step_alone(None, steps).await;
                handle.inner.lockstep.lock().done(steps, &outcome);
                handle.inner.lockstep.changed.notify_waiters();
            }
        });
    }

    /// Ends a membership when its time is over, or its connection has ended.
    async fn watch_member(self, id: Arc<str>, until: CancellationToken) {
        loop {
            let changed = self.inner.lockstep.changed.notified();
            let deadline = {
                let mut group = self.inner.lockstep.lock();
                group.forget_gone();
                match group.find(&id) {
                    Ok(Member { state: State::Computes { deadline }, .. }) => Some(*deadline),
                    Ok(Member { state: State::Waits { sets_targets, .. }, .. }) => {
                        sets_targets.map(|setting| setting.deadline)
                    }
                    Err(_) => return,
                }
            };
            let over = async {
                match deadline {
                    Some(deadline) => tokio::time::sleep_until(deadline).await,
                    None => std::future::pending().await,
                }
            };
            let change = tokio::select! {
                () = self.inner.draining.cancelled() => return,
                () = until.cancelled() => LockstepChange::Disconnected,
                () = over => LockstepChange::TimedOut,
                () = changed => continue,
            };
            if self.remove_member(&id, change).is_some() {
                return;
            }
        }
    }

    /// Removes a member; `None` if it does not exist, or asked just in time.
    fn remove_member(&self, id: &str, change: LockstepChange) -> Option<()> {
        let member = {
            let mut group = self.inner.lockstep.lock();
            let in_time = |state: &State| match state {
                State::Waits { sets_targets: None, .. } => true,
                State::Waits { sets_targets: Some(SettingTargets { deadline, .. }), .. }
                | State::Computes { deadline } => Instant::now() < *deadline,
            };
            let index = group.members.iter().position(|member| {
                *member.id == *id && !(change == LockstepChange::TimedOut && in_time(&member.state))
            })?;
            group.members.remove(index)
        };
        self.log_lockstep(&member.client, change);
        // The others may have waited for it.
        self.inner.lockstep.changed.notify_waiters();
        self.advance_lockstep();
        Some(())
    }

    fn log_lockstep(&self, client: &str, change: LockstepChange) {
        let state = self.newest();
        let members = self.inner.lockstep.lock().members.len();
        let what = LogEvent::LockstepChanged { at: state.state.at, client: client.into(), change, members };
        self.inner.driver.events.push(SystemTime::now(), state.sequence, what);
    }
}
