//! What a robot's joints carried over the last step, found from a published state alone.

use glamx::{DPose3, DQuat, DVec3};

use super::published_state::{AppliedWrench, ConstraintKind, PublishedState};
use crate::dynamics::link_motion::{LinkMotion, Motion, link_motions};
use crate::dynamics::reactions::reactions_of;
use crate::dynamics::spatial::Spatial;

impl PublishedState {
    /// One for each joint of the model of the robot at this index: force and torque of the parent link on
    /// the child, in the child link's frame and about its origin, N and N m. At the present pose, with the
    /// accelerations and the contacts of the last step, or of its last part; without accelerations where
    /// the robot was put somewhere since.
    pub fn joint_reactions(&self, robot: usize, gravity: DVec3) -> Option<Vec<[DVec3; 2]>> {
        self.reactions_of(robot, &self.link_poses(robot)?, &self.link_motions(robot)?, gravity)
    }

    /// How each link of the robot at this index moves, against its base and in the base's axes, with the accelerations of the last step,
    /// or of its last part: see [`link_motions`](crate::dynamics::link_motion::link_motions).
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

    /// World axes from those of a robot's base: the root link's where that is fixed.
    pub(super) fn world_from_base(&self, robot: usize) -> Option<DQuat> {
        let is_fixed = self.world.entities.get(robot)?.tree.fixed_base;
        let rotation = self.roots.get(robot)?.pose.rotation;
        Some(if is_fixed { rotation } else { DQuat::IDENTITY })
    }

    /// [`Self::joint_reactions`] of a robot whose links are and move so.
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
        let wrenches: Vec<(usize, Spatial)> = applied.chain(contacts).chain(constraints).collect();
        let carried = reactions_of(&entity.model, links, to_base * gravity, &wrenches);
        Some(carried.into_iter().map(|wrench| [wrench.linear, wrench.angular]).collect())
    }
}
