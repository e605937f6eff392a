//! Limits of velocities in Bullet's law (`maxCoordinateVelocity`).

use glamx::{DQuat, DVec3};

use super::{Articulation, StepScratch};
use crate::dynamics::bullet::MAX_VELOCITY;
use crate::dynamics::tree::JointType;

impl Articulation {
    /// Limits the new velocities if the law is Bullet's. A joint has the velocity of its limits, by default
    /// [`MAX_VELOCITY`]. Each component of a free root has the default, in world axes.
    pub(super) fn limit_velocities(&mut self) {
        if self.scratch.integrator.bullet().is_none() {
            return;
        }
        let StepScratch { new_velocities, passes, .. } = &mut self.scratch;
        for (body, at) in self.tree.bodies.iter().zip(&passes.bodies) {
            let own = &mut new_velocities[body.velocity..][..body.joint_type.velocities()];
            if let (JointType::Free { .. }, [vx, vy, vz, wx, wy, wz]) = (&body.joint_type, &mut *own) {
                let turn = self.state.base.rotation * DQuat::from_mat3(&at.rotation);
                let linear = DVec3::new(*vx, *vy, *vz);
                let angular = turn * DVec3::new(*wx, *wy, *wz);
                let clamped = |of: DVec3| {
                    DVec3::from_array(of.to_array().map(|value| value.clamp(-MAX_VELOCITY, MAX_VELOCITY)))
                };
                if clamped(linear) != linear {
                    [*vx, *vy, *vz] = clamped(linear).to_array();
                }
                if clamped(angular) != angular {
                    [*wx, *wy, *wz] = (turn.inverse() * clamped(angular)).to_array();
                }
                continue;
            }
            for (velocity, axis) in own.iter_mut().zip(&self.state.axes[body.velocity..]) {
                let most = axis.settings.limits.velocity.unwrap_or(MAX_VELOCITY);
                *velocity = velocity.clamp(-most, most);
            }
        }
    }
}
