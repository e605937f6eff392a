//! Forces from outside on the links of a robot.

use std::hash::Hasher;
use std::sync::Arc;

use glamx::{DPose3, DVec3};

use super::Entity;
use crate::dynamics::spatial::{Placement, Spatial};

/// A force and a torque on a link.
#[derive(Clone, Debug, PartialEq)]
pub struct Push {
    /// Index of the link.
    pub link: usize,
    /// Newtons, at `point`.
    pub force: DVec3,
    /// Newton metres.
    pub torque: DVec3,
    /// In the link's axes, not the world's.
    pub in_link_axes: bool,
    /// In the link's frame, metres.
    pub point: DVec3,
    /// Until replaced or cleared.
    pub persistent: bool,
}

impl Push {
    /// Feeds everything that a step reads to a hasher.
    pub(in crate::simulation) fn hash_into(&self, hasher: &mut impl Hasher) {
        let Self { link, force, torque, in_link_axes, point, persistent } = self;
        hasher.write_usize(*link);
        hasher.write_u8(u8::from(*in_link_axes) | u8::from(*persistent) << 1);
        for value in [force, torque, point].into_iter().flat_map(|vector| vector.to_array()) {
            hasher.write_u64(value.to_bits());
        }
    }
}

impl Entity {
    /// Writes the pushes into the dynamics, each body's sum in its own frame.
    pub(in crate::simulation) fn push_links(&mut self) {
        self.body.external_mut().fill(Spatial::ZERO);
        if self.pushes.is_empty() {
            return;
        }
        let tree = Arc::clone(self.body.tree());
        let root = tree.root_positions();
        let poses = tree.link_poses(self.body.root_pose(), &self.body.positions()[root..]);
        for push in &self.pushes {
            let (Some(pose), Some(frame)) = (poses.get(push.link), tree.links.get(push.link)) else {
                continue;
            };
            let Some(place) = frame.body else { continue };
            let to_link = |v: DVec3| if push.in_link_axes { v } else { pose.rotation.inverse() * v };
            let (force, torque) = (to_link(push.force), to_link(push.torque));
            let about_link = Spatial::new(torque + push.point.cross(force), force);
            let link = Placement::new(frame.body_from_link.rotation, frame.body_from_link.translation);
            self.body.external_mut()[place] += link.force_to_parent(about_link);
        }
    }

    /// Adds a push: a lasting one in the place of the one before on that link, a passing one
    /// to those that wait for the next step, so that there are never more than a few a link.
    pub(in crate::simulation) fn push(&mut self, push: Push) {
        let Push { link, force, torque, in_link_axes, point, persistent } = push;
        if persistent {
            self.pushes.retain(|known| !(known.persistent && known.link == link));
            if force != DVec3::ZERO || torque != DVec3::ZERO {
                self.pushes.push(push);
            }
            return;
        }
        // About the link's origin, so that passing pushes add up.
        let (pose, arm) = if in_link_axes { (None, point) } else { (self.link_pose(link), point) };
        let arm = pose.map_or(arm, |pose| pose.rotation * arm);
        let torque = torque + arm.cross(force);
        let same =
            |known: &&mut Push| !known.persistent && known.link == link && known.in_link_axes == in_link_axes;
        match self.pushes.iter_mut().find(same) {
            Some(known) => {
                known.force += force;
                known.torque += torque;
            }
            None => self.pushes.push(Push { torque, point: DVec3::ZERO, ..push }),
        }
    }

    /// `world_from_link`.
    fn link_pose(&self, link: usize) -> Option<DPose3> {
        let tree = self.body.tree();
        let root = tree.root_positions();
        tree.link_poses(self.body.root_pose(), &self.body.positions()[root..]).get(link).copied()
    }
}
