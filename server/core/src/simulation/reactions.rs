//! What a robot's joints carried over the last step.

use glamx::DVec3;

use super::entity::Push;
use super::error::Error;
use super::query::Answer;
use super::{PhysicsSettings, Simulation};
use crate::dynamics::reactions::{Motion, joint_reactions};
use crate::dynamics::spatial::Spatial;

impl Simulation {
    /// One for each joint of the model: force and torque of the parent link on the child, in the
    /// child link's frame and about its origin. At the present pose, with the accelerations and
    /// the contacts of the last step, or of its last part; without accelerations where the robot
    /// was put somewhere since.
    pub(super) fn reactions(&self, robot: &str) -> Result<Answer, Error> {
        let place = self.place(robot)?;
        let entity = &self.entities[place];
        let PhysicsSettings { gravity, time_step, substeps } = self.settings;
        let h = time_step / f64::from(substeps);
        let (body, tree) = (&entity.body, entity.body.tree());
        let to_base = body.base().rotation.inverse();
        let poses = tree.link_poses(body.root_pose(), &body.positions()[tree.root_positions()..]);

        let pushes = entity.pushes.iter().filter(|push| !push.waits).chain(&entity.passed).map(|push| {
            let Push { link, force, torque, in_link_axes, point, .. } = *push;
            let turn = to_base * poses[link].rotation;
            let turned = |v: DVec3| if in_link_axes { turn * v } else { to_base * v };
            let (force, torque) = (turned(force), turned(torque));
            (link, Spatial::new(torque + (turn * point).cross(force), force))
        });
        let touches = self.contacts.list.iter().flat_map(|contact| {
            // The impulse is that on the second.
            let force = contact.impulse / h;
            let sides = [(0, -force), (1, force)].into_iter();
            sides.filter(move |(side, _)| contact.robots[*side] == place).map(|(side, force)| {
                let link = contact.touch.links[side];
                let arm = contact.touch.point - poses[link].translation;
                (link, Spatial::new(to_base * arm.cross(force), to_base * force))
            })
        });
        let pushes: Vec<(usize, Spatial)> = pushes.chain(touches).collect();
        let accelerations = body.last_accelerations(h);
        let motion =
            Motion { positions: body.positions(), rates: body.rates(), accelerations: &accelerations };
        let carried = joint_reactions(&entity.model, tree, motion, to_base * gravity, &pushes);
        let parts = carried.into_iter().map(|wrench| [wrench.linear, wrench.angular]);
        Ok(Answer::Reactions { layout_version: entity.version, wrenches: parts.collect() })
    }
}
