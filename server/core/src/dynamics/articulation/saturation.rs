//! Detection of saturated actuators in a step.

use super::{Articulation, BodyState, StepScratch};
use crate::dynamics::actuator::Drive;
use crate::dynamics::spherical;
use crate::dynamics::tree::JointType;

/// Maximum number of rounds that determine exactly which actuators saturate. Each is a step of Newton's
/// method for bounded efforts; two are usual.
pub(in crate::dynamics) const EXACT_ROUNDS: usize = 4;

/// Round up to which actuators are [weakened](Drive::weaken) and strengthened if exact rounds cycle; from
/// then on they are only weakened.
pub(in crate::dynamics) const BOTH_WAYS_UNTIL: usize = EXACT_ROUNDS + 4;

/// Maximum number of rounds.
pub(in crate::dynamics) const MAX_ROUNDS: usize = BOTH_WAYS_UNTIL + 8;

impl Articulation {
    /// Finds the actuators whose solved effort exceeds their limit, and saturated ones that no longer need to
    /// be. Returns whether any changed, so that another round is needed.
    ///
    /// If [`EXACT_ROUNDS`] do not converge, actuators are weakened from there on.
    pub(in crate::dynamics) fn saturate(&mut self, h: f64, round: usize) -> bool {
        if round + 1 == MAX_ROUNDS {
            return false;
        }
        let mut changed = false;
        if !self.scratch.is_weakened {
            changed = self.change_limited_drives(h, |drive, law, _| drive.saturate(law, round == 0));
            if changed && round + 1 >= EXACT_ROUNDS {
                self.scratch.is_weakened = true;
                self.scratch.parts.fill(1.0);
            }
        }
        if self.scratch.is_weakened {
            changed |= self.change_limited_drives(h, |drive, law, part| {
                drive.weaken(law, round >= BOTH_WAYS_UNTIL, part)
            });
        }
        self.scratch.is_kinked |= changed;
        changed
    }

    /// Updates each actuator with a limit, from the effort that its law requests at the new velocities and
    /// the remaining part of its gains. Returns whether any has changed.
    fn change_limited_drives(
        &mut self,
        h: f64,
        mut change: impl FnMut(&mut Drive, f64, &mut f64) -> bool,
    ) -> bool {
        let Self { tree, state, scratch } = self;
        let mut changed = false;
        for (body, at) in tree.bodies.iter().zip(&scratch.passes.bodies) {
            let dof = body.velocity;
            let drive = &mut state.drives[dof];
            let has_no_limit =
                matches!(body.joint_type, JointType::Free { .. }) || drive.limit == f64::INFINITY;
            // The row of a tendon keeps its limit.
            if has_no_limit || body.is_tendon {
                continue;
            }
            let velocities = [state.half_velocities[dof], scratch.new_velocities[dof]];
            let law = drive.law(state.positions[body.position], velocities, h, at.of_law);
            changed |= change(drive, law, &mut scratch.parts[dof]);
        }
        changed
    }

    /// Clears saturation and restores all gains.
    pub(super) fn forget_saturation(&mut self) {
        let StepScratch { parts, is_weakened, .. } = &mut self.scratch;
        for (drive, part) in self.state.drives.iter_mut().zip(parts) {
            if *is_weakened {
                drive.strengthen(*part);
            }
            drive.saturated = None;
        }
        *is_weakened = false;
    }

    /// Stores the efforts that the actuators apply at the new velocities, and keeps setpoints of saturated
    /// ones within reach.
    pub(super) fn note_efforts(&mut self, h: f64) {
        let mut saturates = false;
        let StepScratch { passes, new_velocities, parts, is_weakened, .. } = &mut self.scratch;
        for (body, at) in self.tree.bodies.iter().zip(&passes.bodies) {
            if !matches!(body.joint_type, JointType::Free { .. }) {
                let dof = body.velocity;
                let (q, velocities) = (
                    self.state.positions[body.position],
                    [self.state.half_velocities[dof], new_velocities[dof]],
                );
                let drive = &mut self.state.drives[dof];
                if body.is_tendon {
                    let law = drive.law(q, velocities, h, at.of_law);
                    drive.saturated = (law.abs() > drive.limit).then(|| drive.limit.copysign(law));
                } else if *is_weakened {
                    drive.recover(drive.law(q, velocities, h, at.of_law), parts[dof]);
                }
                self.state.efforts[dof] = drive.effort(q, velocities, h, at.of_law);
                saturates |= drive.saturated.is_some();
            }
        }
        *is_weakened = false;
        if saturates {
            self.keep_setpoints_near(h);
        }
    }

    /// See [`Axis::anti_windup`](crate::dynamics::Axis::anti_windup).
    fn keep_setpoints_near(&mut self, h: f64) {
        let Self { tree, state, scratch } = self;
        let BodyState { positions, half_velocities, axes, drives, .. } = state;
        for (index, body) in tree.bodies.iter().enumerate() {
            let dof = body.velocity;
            let law = |ahead: usize| {
                let (dof, at) = (dof + ahead, &scratch.passes.bodies[index + ahead]);
                let velocities = [half_velocities[dof], scratch.new_velocities[dof]];
                drives[dof].law(positions[body.position], velocities, h, at.of_law)
            };
            match body.joint_type {
                JointType::Revolute | JointType::Prismatic => {
                    axes[dof].anti_windup(&drives[dof], law(0), scratch.new_velocities[dof]);
                }
                // The other two bodies of the joint come next.
                JointType::Spherical { axis: 0 } => {
                    let (laws, dofs) = ([0, 1, 2].map(law), dof..dof + 3);
                    let velocities = &scratch.new_velocities[dofs.clone()];
                    let actuators = (&mut axes[dofs.clone()], &drives[dofs]);
                    spherical::anti_windup(&positions[body.position..], actuators, laws, velocities);
                }
                JointType::Spherical { .. } | JointType::Free { .. } => {}
            }
        }
    }
}
