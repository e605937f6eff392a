//! Forces from outside on the links of a robot.

use std::hash::Hasher;
use std::sync::Arc;

use glamx::{DPose3, DVec3};

use super::Entity;
use crate::dynamics::spatial::{Placement, Spatial};
use crate::simulation::command::Lasts;

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
    /// For how long; counts down.
    pub lasts: Lasts,
    /// Waits until one for a time on the same link has passed.
    pub waits: bool,
}

impl Push {
    /// Whether it lasts for a time.
    fn is_timed(&self) -> bool {
        matches!(self.lasts, Lasts::For(_))
    }

    /// Feeds everything that a step reads to a hasher.
    pub(in crate::simulation) fn hash_into(&self, hasher: &mut impl Hasher) {
        let Self { link, force, torque, in_link_axes, point, lasts, waits } = *self;
        hasher.write_usize(link);
        let (kind, left) = match lasts {
            Lasts::NextStep => (0, 0.0),
            Lasts::For(left) => (1, left),
            Lasts::UntilCleared => (2, 0.0),
        };
        hasher.write(&[kind, in_link_axes.into(), waits.into()]);
        let vectors = [force, torque, point];
        for value in vectors.into_iter().flat_map(|vector| vector.to_array()).chain([left]) {
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
        for push in self.pushes.iter().filter(|push| !push.waits) {
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

    /// Adds a push: a lasting one in the place of those before on that link, a passing one
    /// to those that wait for the next step, so that there are never more than a few a link.
    pub(in crate::simulation) fn push(&mut self, push: Push) {
        let Push { link, force, torque, in_link_axes, point, lasts, .. } = push;
        let is_something = force != DVec3::ZERO || torque != DVec3::ZERO;
        match lasts {
            Lasts::NextStep => {}
            Lasts::For(_) => {
                self.pushes.retain(|known| known.link != link || !known.is_timed());
                self.let_wait(link, is_something);
                self.pushes.extend(is_something.then_some(push));
                return;
            }
            Lasts::UntilCleared => {
                self.pushes.retain(|known| known.link != link || known.lasts == Lasts::NextStep);
                self.pushes.extend(is_something.then_some(push));
                return;
            }
        }
        // About the link's origin, so that passing pushes add up.
        let (pose, arm) = if in_link_axes { (None, point) } else { (self.link_pose(link), point) };
        let arm = pose.map_or(arm, |pose| pose.rotation * arm);
        let torque = torque + arm.cross(force);
        let same = |known: &&mut Push| {
            known.lasts == Lasts::NextStep && known.link == link && known.in_link_axes == in_link_axes
        };
        match self.pushes.iter_mut().find(same) {
            Some(known) => {
                known.force += force;
                known.torque += torque;
            }
            None => self.pushes.push(Push { torque, point: DVec3::ZERO, ..push }),
        }
    }

    /// What is there until it is cleared gives way on a link, or acts again.
    fn let_wait(&mut self, link: usize, waits: bool) {
        let lasting = |known: &&mut Push| known.link == link && known.lasts == Lasts::UntilCleared;
        self.pushes.iter_mut().filter(lasting).for_each(|known| known.waits = waits);
    }

    /// Before a step: what gave way to a push that has passed acts again.
    pub(in crate::simulation) fn begin_pushes(&mut self) {
        while let Some(over) = self.passed.pop() {
            let is_timed = |known: &Push| known.link == over.link && known.is_timed();
            if over.is_timed() && !self.pushes.iter().any(is_timed) {
                self.let_wait(over.link, false);
            }
        }
    }

    /// After a step of so many seconds: takes out what is over.
    pub(in crate::simulation) fn end_pushes(&mut self, time_step: f64) {
        for push in &mut self.pushes {
            if let Lasts::For(left) = &mut push.lasts {
                *left -= time_step;
            }
        }
        let is_over = |push: &mut Push| match push.lasts {
            Lasts::NextStep => true,
            Lasts::For(left) => left < 0.5 * time_step,
            Lasts::UntilCleared => false,
        };
        let before = self.passed.len();
        self.passed.extend(self.pushes.extract_if(.., is_over));
        if self.passed.len() > before {
            self.push_links();
        }
    }

    /// `world_from_link`.
    fn link_pose(&self, link: usize) -> Option<DPose3> {
        let tree = self.body.tree();
        let root = tree.root_positions();
        tree.link_poses(self.body.root_pose(), &self.body.positions()[root..]).get(link).copied()
    }
}
