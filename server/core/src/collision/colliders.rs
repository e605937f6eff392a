//! The colliders of all robots in a world: one rapier body for each moving body that
//! has a shape, and one for the base.

use std::fmt;

use glamx::DPose3;
use rapier3d_f64::dynamics::{IslandManager, RigidBodyBuilder, RigidBodyHandle, RigidBodySet};
use rapier3d_f64::geometry::{ColliderBuilder, ColliderHandle, ColliderSet};
use rapier3d_f64::prelude::{ImpulseJointSet, MultibodyJointSet, SoftBodySet};

use super::Shapes;
use crate::dynamics::Tree;

/// The colliders of a world.
#[derive(Default)]
pub struct Colliders {
    bodies: RigidBodySet,
    colliders: ColliderSet,
    islands: IslandManager,
    /// rapier wants to take joints and soft bodies of a removed body out; there are none.
    unused: (ImpulseJointSet, MultibodyJointSet, SoftBodySet),
}

/// The colliders of one robot.
#[derive(Clone, Debug, Default)]
pub struct RobotColliders {
    /// Which body of the tree, `None` the base, goes with which of rapier's.
    bodies: Vec<(Option<usize>, RigidBodyHandle)>,
    /// In the order of the shapes, with the link.
    parts: Vec<(usize, ColliderHandle)>,
}

/// Where a collider is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColliderPose {
    /// Index of the link that it belongs to.
    pub link: usize,
    /// World from the shape.
    pub world_from_shape: DPose3,
}

impl fmt::Debug for Colliders {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} colliders on {} bodies", self.colliders.len(), self.bodies.len())
    }
}

impl Colliders {
    /// Adds those of a robot. They are nowhere until [`Colliders::place`] puts them.
    pub fn insert(&mut self, tree: &Tree, shapes: &Shapes) -> RobotColliders {
        let mut robot = RobotColliders::default();
        for part in &shapes.parts {
            let Some(frame) = tree.links.get(part.link) else { continue };
            let known = robot.bodies.iter().find(|(body, _)| *body == frame.body).map(|(_, handle)| *handle);
            let handle = known.unwrap_or_else(|| {
                // Moved by us alone: rapier finds contacts, our solver resolves them.
                let handle = self.bodies.insert(RigidBodyBuilder::kinematic_position_based());
                robot.bodies.push((frame.body, handle));
                handle
            });
            let collider = ColliderBuilder::new(part.shape.clone())
                .position(frame.body_from_link * part.link_from_shape)
                .build();
            let collider = self.colliders.insert_with_parent(collider, handle, &mut self.bodies);
            robot.parts.push((part.link, collider));
        }
        robot
    }

    /// Takes those of a robot out.
    pub fn remove(&mut self, robot: &RobotColliders) {
        for (_, handle) in &robot.bodies {
            let (impulse, multibody, soft) = &mut self.unused;
            let (islands, colliders) = (&mut self.islands, &mut self.colliders);
            self.bodies.remove(*handle, islands, colliders, impulse, multibody, soft, true);
        }
    }

    /// Puts those of a robot where its bodies are.
    pub fn place(&mut self, robot: &RobotColliders, world_from_base: DPose3, world_from_body: &[DPose3]) {
        for (body, handle) in &robot.bodies {
            let pose = match body {
                None => Some(&world_from_base),
                Some(body) => world_from_body.get(*body),
            };
            if let (Some(pose), Some(body)) = (pose, self.bodies.get_mut(*handle)) {
                body.set_position(*pose, false);
            }
        }
        self.bodies.propagate_modified_body_positions_to_colliders(&mut self.colliders);
    }

    /// Where those of a robot are, in the order of its shapes.
    pub fn poses(&self, robot: &RobotColliders) -> Vec<ColliderPose> {
        let pose = |&(link, handle): &(usize, ColliderHandle)| {
            let world_from_shape = *self.colliders.get(handle)?.position();
            Some(ColliderPose { link, world_from_shape })
        };
        robot.parts.iter().filter_map(pose).collect()
    }

    /// How many there are, and on how many bodies.
    pub fn count(&self) -> (usize, usize) {
        (self.colliders.len(), self.bodies.len())
    }
}
