//! Reactions of a robot's joints over the last step, from only a published state.

use glamx::{DPose3, DQuat, DVec3};

use super::published_state::{AppliedWrench, ConstraintKind, PublishedState};
use crate::dynamics::link_motion::{LinkMotion, Motion, link_motions};
use crate::dynamics::reactions::reactions_of;
use crate::dynamics::spatial::Spatial;

impl PublishedState {
    /// Returns the reaction of each joint of the robot at this index, N and N m. It is the force and torque
    /// of the parent link on the child. They are in the child link's frame and about its origin. They belong
    /// to the present pose, with the accelerations and the contacts of the last step, or of its last part. If
    /// the robot was moved since, accelerations are left out.
    pub fn joint_reactions(&self, robot: usize, gravity: DVec3) -> Option<Vec<[DVec3; 2]>> {
        self.reactions_of(robot, &self.link_poses(robot)?, &self.link_motions(robot)?, gravity)
    }

    /// Returns the motion of each link of the robot at this index, relative to its base and in the base's
    /// axes. It has the accelerations of the last step, or of its last part: see
    /// [`link_motions`](crate::dynamics::link_motion::link_motions).
    pub fn link_motions(&self, robot: usize) -> Option<Vec<LinkMotion>> {
        let entity = self.world.entities.get(robot)?;
        let root = self.roots.get(robot)?;
        let tree = &*entity.tree;
        let (positions, velocities) = self.configuration(robot)?.state(tree);
        let mut accelerations = root.accelerations[..tree.root_velocities()].to_vec();
        accelerations.extend_from_slice(self.accelerations.get(entity.velocities.clone())?);
        let motion = Motion { positions: &positions, velocities: &velocities, accelerations: &accelerations };
        Some(link_motions(tree, motion))
    }

    /// Returns the rotation from base axes to world axes: the root link's if it is fixed.
    pub(super) fn world_from_base(&self, robot: usize) -> Option<DQuat> {
        let is_fixed = self.world.entities.get(robot)?.tree.fixed_base;
        let rotation = self.roots.get(robot)?.pose.rotation;
        Some(if is_fixed { rotation } else { DQuat::IDENTITY })
    }

    /// Returns [`Self::joint_reactions`] of a robot with this motion of its links.
    pub(super) fn reactions_of(
        &self,
        robot: usize,
        poses: &[DPose3],
        links: &[LinkMotion],
        gravity: DVec3,
    ) -> Option<Vec<[DVec3; 2]>> {
        let entity = self.world.entities.get(robot)?;
        let to_base = self.world_from_base(robot)?.inverse();

        let of_robot = self.applied_wrenches.iter().filter(|wrench| wrench.robot == robot);
        let applied = of_robot.filter_map(|wrench| {
            let AppliedWrench { robot: _, link, force, torque, in_link_axes, point } = *wrench;
            let turn = to_base * poses.get(link)?.rotation;
            let turned = |v: DVec3| if in_link_axes { turn * v } else { to_base * v };
            let (force, torque) = (turned(force), turned(torque));
            Some((link, Spatial::new(torque + (turn * point).cross(force), force)))
        });
        let contacts = self.contacts.iter().flat_map(|contact| {
            let sides = [(0, -contact.last_force), (1, contact.last_force)].into_iter();
            let of_robot = sides.filter(move |(side, _)| contact.robots[*side] == robot);
            of_robot.filter_map(|(side, force)| {
                let link = contact.links[side];
                let arm = contact.point - poses.get(link)?.translation;
                Some((link, Spatial::new(to_base * arm.cross(force), to_base * force)))
            })
        });
        let constraints =
            self.constraints.iter().zip(&self.constraint_states).flat_map(|(definition, state)| {
                let sides = definition.ends.into_iter().zip([-1.0, 1.0]);
                // A gear acts within joints, as their actuators do.
                let of_links = sides.filter(|_| !matches!(definition.kind, ConstraintKind::Gear { .. }));
                of_links.filter_map(|(end, sign)| {
                    let (_, link) = end.link.filter(|(of, _)| *of == robot)?;
                    let [force, torque] = state.last.map(|vector| sign * vector);
                    let arm = state.point - poses.get(link)?.translation;
                    Some((link, Spatial::new(to_base * (torque + arm.cross(force)), to_base * force)))
                })
            });
        let damped = self.settings.get(robot).map(|settings| &settings.link_damping[..]).unwrap_or_default();
        let damping = damped.iter().zip(&entity.model.links).zip(links).enumerate().map(
            |(link, ((damping, of_model), at))| {
                let motion = Spatial::new(at.angular, at.velocity);
                (link, damping.force(&of_model.inertial, &at.rotation, motion, 0.0))
            },
        );
        let acting = applied.chain(contacts).chain(constraints).chain(damping);
        let wrenches: Vec<(usize, Spatial)> = acting.collect();
        let carried = reactions_of(&entity.model, links, to_base * gravity, &wrenches);
        Some(carried.into_iter().map(|wrench| [wrench.linear, wrench.angular]).collect())
    }
}
