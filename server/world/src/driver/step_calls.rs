//! Checks before requested steps: whether they are allowed, and their targets.

use simd_core::simulation::command::{ClaimId, Clamped, SetTargets};
use simd_core::{Command, Reply};

use super::main_loop::Driver;
use super::published::Done;
use super::recorder_queue::Sender;
use super::world::World;
use crate::call_error::CallError;
use crate::run_state::RunState;

impl<W: World> Driver<W> {
    /// Begins the steps of a call outside of a lockstep. Its targets are applied but not published: the first
    /// step shows them.
    pub(super) fn begin_steps(
        &mut self,
        targets: Option<SetTargets>,
        claim: Option<ClaimId>,
        sender: Sender,
    ) -> Result<Vec<Clamped>, CallError> {
        self.may_step(Some(claim))?;
        let Some(targets) = targets else { return Ok(Vec::new()) };
        let applied = self.apply(&Command::SetTargets(targets), claim, sender)?;
        self.has_unpublished = true;
        match applied.reply {
            Reply::Targets { clamped, changed_law: _ } => Ok(clamped),
            _ => Ok(Vec::new()),
        }
    }

    /// Applies the targets of a lockstep member. The steps follow once the other members have asked too, with
    /// `steps_claim`.
    pub(super) fn targets_of_member(
        &mut self,
        targets: &Command,
        claim: Option<ClaimId>,
        steps_claim: Option<Option<ClaimId>>,
        sender: Sender,
    ) -> Result<Done, CallError> {
        self.may_step(steps_claim)?;
        self.command(targets, claim, sender)
    }

    /// Checks whether steps are allowed with a claim or without one; the outer `None` means that the claim is
    /// not known yet.
    fn may_step(&self, claim: Option<Option<ClaimId>>) -> Result<(), CallError> {
        if self.state == RunState::Playing {
            return Err(CallError::WrongState {
                state: self.state,
                message: "simulation is playing; pause it before stepping".into(),
            });
        }
        if let Some(claim) = claim {
            self.world.allow_step(claim)?;
        }
        self.steps.has_room()
    }
}
