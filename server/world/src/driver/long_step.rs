//! Decides when a step can be interrupted, so that pausing, stopping, deleting, resetting and ending work
//! during a step of any duration. It owns no clock: the caller passes the time.

use std::time::Duration;

use simd_core::Command;

/// Duration beyond which the next step is interruptible, which costs a copy of the world's state.
const SLOW: Duration = Duration::from_millis(50);
/// Time for which a step runs at least before it is interrupted.
const LEAST: Duration = Duration::from_millis(50);
/// Maximum number of doublings of that time: longer than any step.
const DOUBLINGS: u32 = 20;

/// Knowledge about steps that take long.
///
/// An interrupted step is undone and restarted. After each interruption in a row, the step is left alone for
/// twice the previous time. So a client that interrupts without end slows the world by a factor, and does not
/// stop it.
#[derive(Debug)]
pub(super) struct LongSteps {
    /// Whether the next step may take long.
    is_expected: bool,
    /// Number of interrupted attempts at the present step.
    interrupted: u32,
    /// Time that the last of them had run.
    ran: Duration,
    /// Time for which the first attempt at a step is left alone.
    least: Duration,
}

impl Default for LongSteps {
    fn default() -> Self {
        Self { is_expected: true, interrupted: 0, ran: Duration::ZERO, least: LEAST }
    }
}

impl LongSteps {
    /// Returns whether the next step must be interruptible.
    pub(super) fn is_expected(&self) -> bool {
        self.is_expected
    }

    /// Returns the time for which the next attempt is left alone.
    pub(super) fn uninterrupted(&self) -> Duration {
        self.least * 2_u32.pow(self.interrupted.min(DOUBLINGS))
    }

    /// Returns how long the last attempt at the present step ran before its interruption.
    pub(super) fn ran(&self) -> Duration {
        self.ran
    }

    /// Notes that a command was applied.
    pub(super) fn applied(&mut self, command: &Command) {
        self.is_expected |= may_make_steps_long(command);
    }

    /// Notes that a step was completed.
    pub(super) fn ended(&mut self, took: Duration) {
        *self = Self { is_expected: took > SLOW, interrupted: 0, ran: Duration::ZERO, least: self.least };
    }

    /// Notes that a step was undone after this time.
    pub(super) fn interrupted(&mut self, ran: Duration) {
        self.is_expected = true;
        self.interrupted += 1;
        self.ran = ran;
    }

    /// Lets the first attempt be interrupted at once.
    #[cfg(test)]
    pub(super) fn interrupt_at_once(&mut self) {
        self.least = Duration::ZERO;
    }
}

/// Returns whether a step after this command may take much longer than the one before, since more bodies may
/// touch.
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
