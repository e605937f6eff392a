//! Members of a lockstep: which of them have asked, and for how many steps.

use std::sync::Arc;
use std::time::Duration;

use simd_core::simulation::command::ClaimId;
use tokio::sync::oneshot;
use tokio::time::Instant;

use super::super::CallError;
use super::super::claims::Leases;
use crate::driver::Stepped;

#[derive(Debug, Default)]
pub(super) struct Group {
    pub(super) members: Vec<Member>,
    /// Whether the world is advancing for them.
    pub(super) is_stepping: bool,
}

#[derive(Debug)]
pub(super) struct Member {
    /// Secret id that identifies the member.
    pub(super) id: Arc<str>,
    pub(super) client: Arc<str>,
    pub(super) timeout: Duration,
    /// Claim of its last request, or of its joining.
    pub(super) claim: Option<ClaimId>,
    pub(super) state: State,
}

#[derive(Debug)]
pub(super) enum State {
    /// It must ask before the deadline.
    Computes { deadline: Instant },
    /// It has asked for steps, of which `remaining` are still to be done.
    Waits {
        remaining: u64,
        /// Whether the steps in progress count for it: it asked before they began.
        is_counted: bool,
        /// Present while its targets are being set: until then it has not asked.
        sets_targets: Option<SettingTargets>,
        reply: oneshot::Sender<Result<Stepped, CallError>>,
    },
}

/// Deadlines of a member while its targets are on their way to the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct SettingTargets {
    /// Deadline for setting the targets: a caller may have stopped polling.
    pub(super) deadline: Instant,
    /// Deadline for its next request if the targets are refused, or its caller disconnects. The time until
    /// then counts as its own, or it could hold the others forever.
    pub(super) asks_by: Instant,
}

impl Member {
    pub(super) fn has_asked(&self) -> bool {
        matches!(self.state, State::Waits { sets_targets: None, .. })
    }
}

impl Group {
    pub(super) fn find(&mut self, id: &str) -> Result<&mut Member, CallError> {
        let found = self.members.iter_mut().find(|member| *member.id == *id);
        found.ok_or(CallError::LockstepMemberNotFound)
    }

    /// Returns the member with this id, which must not have asked.
    pub(super) fn asks(&mut self, id: &str) -> Result<&mut Member, CallError> {
        self.forget_gone();
        let member = self.find(id)?;
        if matches!(member.state, State::Waits { .. }) {
            return Err(CallError::InvalidValue {
                element: "lockstep_member".into(),
                value: "already waiting for steps".into(),
                expected: "a member asks again only after its answer".into(),
            });
        }
        Ok(member)
    }

    /// Makes members whose callers disconnected count as not having asked.
    pub(super) fn forget_gone(&mut self) {
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

    /// Returns whether all members have asked that the steps wait for. If a member that has asked holds a
    /// claim on the world, these are the members with that claim.
    pub(super) fn is_due(&mut self, leases: &Leases) -> bool {
        self.forget_gone();
        self.members.iter().any(Member::has_asked) && self.all_waited_for(leases, Member::has_asked)
    }

    /// Returns the claim for the next steps: the claim on the world, else the first claim of a member in
    /// joining order. The outer `None` means that a member has yet to ask.
    pub(super) fn steps_claim(&self, leases: &Leases) -> Option<Option<ClaimId>> {
        let asks = |member: &Member| matches!(member.state, State::Waits { .. });
        self.all_waited_for(leases, asks).then(|| {
            let claims =
                || self.members.iter().filter(|member| asks(member)).filter_map(|member| member.claim);
            claims().find(|claim| leases.holds_world(*claim)).or_else(|| claims().next())
        })
    }

    /// Returns whether `has_asked` holds for each member that the steps wait for.
    pub(super) fn all_waited_for(&self, leases: &Leases, has_asked: impl Fn(&Member) -> bool) -> bool {
        let holds = |member: &Member| member.claim.is_some_and(|claim| leases.holds_world(claim));
        let is_held = self.members.iter().any(|member| has_asked(member) && holds(member));
        self.members.iter().filter(|member| !is_held || holds(member)).all(has_asked)
    }

    /// Notes that the member's targets are set, so that it has asked.
    pub(super) fn targets_are_set(&mut self, id: &str) {
        if let Ok(Member { state: State::Waits { sets_targets, .. }, .. }) = self.find(id) {
            *sets_targets = None;
        }
    }

    /// Begins the next steps if they are due. Returns their number, up to the nearest step that a member asked
    /// for, and their claim. The steps then count for all members that have asked.
    pub(super) fn begin(&mut self, leases: &Leases) -> Option<(u64, Option<ClaimId>)> {
        if !self.is_due(leases) {
            return None;
        }
        let claim = self.steps_claim(leases).flatten();
        let mut steps = u64::MAX;
        for member in self.members.iter_mut().filter(|member| member.has_asked()) {
            if let State::Waits { remaining, is_counted, .. } = &mut member.state {
                *is_counted = true;
                steps = steps.min(*remaining);
            }
        }
        Some((steps, claim))
    }

    /// Subtracts completed steps from the members' remaining ones, and answers members that are done; after a
    /// refusal, all.
    pub(super) fn done(&mut self, steps: u64, outcome: &Result<Stepped, CallError>) {
        for member in &mut self.members {
            let State::Waits { remaining, is_counted: true, .. } = &mut member.state else { continue };
            *remaining = remaining.saturating_sub(steps);
            if *remaining > 0 && outcome.is_ok() {
                continue;
            }
            let asked = State::Computes { deadline: Instant::now() + member.timeout };
            if let State::Waits { reply, .. } = std::mem::replace(&mut member.state, asked) {
                // A disconnected caller needs no answer.
                let _ = reply.send(outcome.clone());
            }
        }
    }
}
