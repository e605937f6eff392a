//! Clients that step one world together: it advances once each of them has asked, to the nearest step that one asked for.
//! Who does not ask in its time, or goes away, is a member no more, and the others go on.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

use simd_core::simulation::command::{ClaimId, SetTargets};
use tokio::sync::{Notify, oneshot};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

use super::{CallError, SimHandle};
use crate::account::Account;
use crate::driver::{LockstepChange, LogEvent, Stepped};

/// Members at one time.
const MEMBERS: usize = 64;
/// How long a member may take from one step to asking for the next.
const TIMEOUT: std::ops::RangeInclusive<Duration> = Duration::from_millis(10)..=Duration::from_secs(3600);

/// The members, in the order in which they joined.
#[derive(Debug, Default)]
pub(super) struct Lockstep {
    /// Held for a look or a change, never across a step.
    group: Mutex<Group>,
    /// A member's deadline may be another.
    changed: Notify,
}

#[derive(Debug, Default)]
struct Group {
    members: Vec<Member>,
    /// Whether the world advances for them.
    is_stepping: bool,
}

#[derive(Debug)]
struct Member {
    /// The sender that has it is this member.
    id: Arc<str>,
    client: Arc<str>,
    timeout: Duration,
    state: State,
}

#[derive(Debug)]
enum State {
    /// It has to ask until then.
    Computes { deadline: Instant },
    /// It has asked for so many steps, of which so many are still to be done.
    Waits {
        remaining: u64,
        /// With which it asked.
        claim: Option<ClaimId>,
        /// Whether the steps that are being done are done for it: it asked before they began.
        is_counted: bool,
        /// Where its targets are still to be set: until then it has not asked.
        sets_targets: Option<SettingTargets>,
        reply: oneshot::Sender<Result<Stepped, CallError>>,
    },
}

/// A member's targets are on their way to the world.
#[derive(Clone, Copy, Debug)]
struct SettingTargets {
    /// They have to be set until then: a caller may have stopped to wait for it.
    deadline: Instant,
    /// It has to have asked by then where they are refused, or its caller goes away: what that takes is its own time, or it
    /// could hold the others for ever.
    asks_by: Instant,
}

/// A member, as others see it.
#[derive(Clone, Debug, PartialEq)]
pub struct LockstepMember {
    /// As it calls itself; empty where it does not.
    pub client: Arc<str>,
    /// How long it may take from one step to asking for the next.
    pub timeout: Duration,
    /// Steps that it waits for; 0 where the others wait for it.
    pub waits_for: u64,
}

/// Says that a member may have changed.
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

impl Group {
    fn find(&mut self, id: &str) -> Result<&mut Member, CallError> {
        let found = self.members.iter_mut().find(|member| *member.id == *id);
        found.ok_or(CallError::LockstepMemberNotFound)
    }

    /// The member of that id, which has not asked.
    fn asks(&mut self, id: &str) -> Result<&mut Member, CallError> {
        self.forget_gone();
        let member = self.find(id)?;
        if matches!(member.state, State::Waits { .. }) {
            return Err(CallError::InvalidValue {
                element: "lockstep_member".into(),
                value: "that of a request that waits".into(),
                expected: "a member asks once, and again when it has its answer".into(),
            });
        }
        Ok(member)
    }

    /// Callers that went away have not asked.
    fn forget_gone(&mut self) {
        for member in &mut self.members {
            if let State::Waits { sets_targets, reply, .. } = &member.state
                && reply.is_closed()
            {
                let asks_by = sets_targets.map(|setting| setting.asks_by);
                let deadline = asks_by.unwrap_or_else(|| Instant::now() + member.timeout);
                member.state = State::Computes { deadline };
            }
        }
    }

    /// Whether all have asked.
    fn is_due(&mut self) -> bool {
        self.forget_gone();
        let has_asked = |member: &Member| matches!(member.state, State::Waits { sets_targets: None, .. });
        !self.members.is_empty() && self.members.iter().all(has_asked)
    }

    /// What the next steps come with: the first claim that a member asked with, in the order in which they joined, or none.
    /// `None` while one has yet to ask.
    fn steps_claim(&self) -> Option<Option<ClaimId>> {
        let asked_with = |member: &Member| match member.state {
            State::Waits { claim, .. } => Some(claim),
            State::Computes { .. } => None,
        };
        let claims: Option<Vec<Option<ClaimId>>> = self.members.iter().map(asked_with).collect();
        claims.map(|claims| claims.into_iter().flatten().next())
    }

    /// From now on it has asked.
    fn targets_are_set(&mut self, id: &str) {
        if let Ok(Member { state: State::Waits { sets_targets, .. }, .. }) = self.find(id) {
            *sets_targets = None;
        }
    }

    /// Where all have asked: steps to the nearest that one asked for, which are done for all of them from now on, and the
    /// first claim that a member came with, in the order in which they joined.
    fn begin(&mut self) -> Option<(u64, Option<ClaimId>)> {
        if !self.is_due() {
            return None;
        }
        let (mut steps, mut first) = (u64::MAX, None);
        for member in &mut self.members {
            if let State::Waits { remaining, claim, is_counted, .. } = &mut member.state {
                *is_counted = true;
                steps = steps.min(*remaining);
                first = first.or(*claim);
            }
        }
        Some((steps, first))
    }

    /// Takes steps that were done off what members wait for, and answers those whose steps are done; after a refusal, all.
    fn done(&mut self, steps: u64, outcome: &Result<Stepped, CallError>) {
        for member in &mut self.members {
            let State::Waits { remaining, is_counted: true, .. } = &mut member.state else { continue };
            *remaining = remaining.saturating_sub(steps);
            if *remaining > 0 && outcome.is_ok() {
                continue;
            }
            let asked = State::Computes { deadline: Instant::now() + member.timeout };
            if let State::Waits { reply, .. } = std::mem::replace(&mut member.state, asked) {
                // Who is gone needs no answer.
                let _ = reply.send(outcome.clone());
            }
        }
    }
}

impl SimHandle {
    /// Makes the caller a member; gives what it shows with each request, and who else is one. With `until`, it is one for as long as
    /// its connection lasts.
    ///
    /// # Errors
    /// Returns an error if the time is not within 10 ms and an hour, and where there are too many members.
    pub fn join_lockstep(
        &self,
        client: &str,
        timeout: Duration,
        until: Option<CancellationToken>,
    ) -> Result<(Arc<str>, Vec<LockstepMember>), CallError> {
        self.check_robots(None)?;
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
            group.members.push(Member { id: Arc::clone(&id), client: client.into(), timeout, state });
        }
        self.log_lockstep(client, LockstepChange::Joined);
        tokio::spawn(self.clone().watch_member(Arc::clone(&id), until.unwrap_or_default()));
        Ok((id, self.lockstep_members()))
    }

    /// Ends a membership. A request of it that waits is refused.
    ///
    /// # Errors
    /// Returns an error if there is no such member (any more).
    pub fn leave_lockstep(&self, id: &str) -> Result<(), CallError> {
        self.remove_member(id, LockstepChange::Left).ok_or(CallError::LockstepMemberNotFound)
    }

    /// Who steps the world together, in the order in which they joined.
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

    /// Refuses what only the members may do, where there are any. Who has claimed the world is held up by none of them.
    pub(super) fn check_no_lockstep(&self) -> Result<(), CallError> {
        if self.claim.is_some_and(|claim| self.inner.leases.holds_world(claim)) {
            return Ok(());
        }
        match self.inner.lockstep.lock().members.len() {
            0 => Ok(()),
            members => Err(CallError::InLockstep { members: members as u64 }),
        }
    }

    /// Sets targets and does steps together with the other members: answers once the world has advanced by so many, and each of the
    /// others has asked for as many by then. Where the targets are refused, or it is known by then that the steps will be, nothing is
    /// set, and the member has not asked.
    ///
    /// # Errors
    /// Returns an error if the caller is no member, has asked already, or leaves; and those of targets and steps.
    pub(super) async fn step_together(
        &self,
        id: &str,
        targets: Option<SetTargets>,
        steps: u64,
    ) -> Result<Stepped, CallError> {
        // Also where the caller goes away before it is answered, or its targets are refused: dropped after what says so.
        let _changed = NotifyOnDrop(&self.inner.lockstep.changed);
        let (reply, answer) = oneshot::channel();
        let steps_claim = {
            // Looked at and changed at once: another request of this member may come at the same moment.
            let mut group = self.inner.lockstep.lock();
            let member = group.asks(id)?;
            let now = Instant::now();
            let sets_targets = match member.state {
                State::Computes { deadline } if targets.is_some() => {
                    Some(SettingTargets { deadline: now + member.timeout, asks_by: deadline })
                }
                _ => None,
            };
            let claim = self.claim;
            member.state = State::Waits { remaining: steps, claim, is_counted: false, sets_targets, reply };
            group.steps_claim()
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

    /// Advances the world where all members have asked. One at a time does.
    fn advance_lockstep(&self) {
        {
            let mut group = self.inner.lockstep.lock();
            if group.is_stepping || !group.is_due() {
                return;
            }
            group.is_stepping = true;
        }
        let handle = self.clone();
        // A task of its own: it goes on where the caller who made it begin goes away.
        tokio::spawn(Account::Process.scope(async move {
            loop {
                let due = {
                    let mut group = handle.inner.lockstep.lock();
                    let due = group.begin();
                    group.is_stepping = due.is_some();
                    due
                };
                let Some((steps, claim)) = due else { return };
                let outcome = handle.acting_for(claim).step_alone(None, steps).await;
                handle.inner.lockstep.lock().done(steps, &outcome);
                handle.inner.lockstep.changed.notify_waiters();
            }
        }));
    }

    /// Ends a membership whose time is over, or whose connection has ended.
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

    /// `None`: there is no such member, or it asked just in time.
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

#[cfg(test)]
mod tests;
