//! When a step can be interrupted, so that pausing, stopping, deleting, resetting and ending work however long
//! a step takes. Owns no clock: it is given the time.

use std::time::Duration;

use simd_core::Command;

/// A step that took longer is followed by one that can be interrupted, which costs a copy of the world's state.
const SLOW: Duration = Duration::from_millis(50);
/// A step runs at least for so long before it is interrupted.
const LEAST: Duration = Duration::from_millis(50);
/// The longest of such times is this many doublings long: beyond any step.
const DOUBLINGS: u32 = 20;

/// What is known of steps that take long.
///
/// An interrupted step is put back and begins anew. Each time in a row that this happens, the step is left
/// alone for twice as long as the time before: a client that interrupts without end makes the world slower by
/// a factor, and does not stop it.
#[derive(Debug)]
pub(super) struct LongSteps {
    /// The next step may take long.
    is_expected: bool,
    /// Attempts at the present step that were interrupted.
    interrupted: u32,
    /// How long the last of them had run.
    ran: Duration,
    /// How long the first attempt at a step is left alone.
    least: Duration,
}

impl Default for LongSteps {
    fn default() -> Self {
        Self { is_expected: true, interrupted: 0, ran: Duration::ZERO, least: LEAST }
    }
}

impl LongSteps {
    /// Whether the next step is to be one that can be interrupted.
    pub(super) fn is_expected(&self) -> bool {
        self.is_expected
    }

    /// How long the next attempt is left alone.
    pub(super) fn uninterrupted(&self) -> Duration {
        self.least * 2_u32.pow(self.interrupted.min(DOUBLINGS))
    }

    /// How long the last attempt at the present step had run when it was interrupted.
    pub(super) fn ran(&self) -> Duration {
        self.ran
    }

    /// A command was applied.
    pub(super) fn applied(&mut self, command: &Command) {
        self.is_expected |= may_make_steps_long(command);
    }

    /// A step is done.
    pub(super) fn ended(&mut self, took: Duration) {
        *self = Self { is_expected: took > SLOW, interrupted: 0, ran: Duration::ZERO, least: self.least };
    }

    /// A step was put back after this time.
    pub(super) fn interrupted(&mut self, ran: Duration) {
        self.is_expected = true;
        self.interrupted += 1;
        self.ran = ran;
    }

    /// Interrupts at once, the first time.
    #[cfg(test)]
    pub(super) fn interrupt_at_once(&mut self) {
        self.least = Duration::ZERO;
    }
}

/// Whether the step after it may take much longer than the one before: more may touch then.
fn may_make_steps_long(command: &Command) -> bool {
    match command {
        Command::Spawn(_)
        | Command::SpawnAll(_)
        | Command::Reload(_)
        | Command::Delete { .. }
        | Command::ResetJoints { .. }
        | Command::SetEntityState { .. }
        | Command::SetPhysics(_)
        | Command::Reset(_)
        | Command::RestoreState { .. } => true,
        Command::SetTargets(_)
        | Command::FollowTrajectory(_)
        | Command::CancelTrajectory { .. }
        | Command::SetJointProperties { .. }
        | Command::SetLinkProperties { .. }
        | Command::SetCollisionFilter(_)
        | Command::CreateConstraint(_)
        | Command::ChangeConstraint(_)
        | Command::DeleteConstraint { .. }
        | Command::CreateSensor(_)
        | Command::DeleteSensor { .. }
        | Command::Claim { .. }
        | Command::Release { .. }
        | Command::ApplyWrench(_)
        | Command::PullLink(_)
        | Command::SaveState { .. }
        | Command::DeleteSavedState { .. }
        | Command::ImportSavedState { .. } => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_attempt_at_a_step_is_left_alone_for_twice_as_long() {
        let mut steps = LongSteps::default();
        let mut waited = Vec::new();
        for _ in 0..4 {
            waited.push(steps.uninterrupted().as_millis());
            steps.interrupted(steps.uninterrupted());
        }
        assert_eq!(waited, [50, 100, 200, 400]);
        assert!(steps.is_expected());
        (0..100).for_each(|_| steps.interrupted(Duration::ZERO));
        assert!(steps.uninterrupted() > Duration::from_secs(3600));
        steps.ended(Duration::from_millis(1));
        assert_eq!((steps.uninterrupted(), steps.ran()), (LEAST, Duration::ZERO));
    }

    #[test]
    fn a_copy_is_kept_after_a_slow_step_and_after_a_command_that_may_cause_one() {
        let mut steps = LongSteps::default();
        assert!(steps.is_expected(), "nothing is known of the first");
        steps.ended(Duration::from_millis(1));
        steps.applied(&Command::SetTargets(Default::default()));
        assert!(!steps.is_expected());
        steps.applied(&Command::SetEntityState { robot: "box".into(), pose: None, twist: None });
        assert!(steps.is_expected());
        steps.ended(Duration::from_millis(1));
        assert!(!steps.is_expected());
        steps.ended(Duration::from_millis(51));
        assert!(steps.is_expected());
    }
}
