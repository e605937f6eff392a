//! Pose and motion of a robot apart from any world: the input of kinematics, inertia and their inverses.

use glamx::{DMat3, DPose3, DVec3};

use super::articulated::write_free;
use super::integrate::write_free_pose;
use super::kinematics::update_kinematics;
use super::scratch::BodyScratch;
use super::spatial::{Placement, Spatial};
use super::tree::Tree;

/// Poses and velocities of a robot's root and joints.
///
/// Quantities derived from it are ordered by velocity. A free root has the first six entries: its origin's
/// linear velocity and its angular velocity, both in world axes. (Within a step a free root's angular
/// velocity is in its own axes.)
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Configuration {
    /// `world_from_root`.
    pub root: DPose3,
    /// Velocity of the root link's origin, world axes, m/s; zero if fixed.
    pub linear: DVec3,
    /// Angular velocity of the root link, world axes, rad/s; zero if fixed.
    pub angular: DVec3,
    /// Positions of the joints without the root: rad or m. A floating joint has x y z and a quaternion x y z
    /// w, a spherical one a quaternion.
    pub positions: Vec<f64>,
    /// Velocities of the joints without the root: rad/s or m/s. A floating joint has its linear velocity in
    /// the parent's axes, then the angular one in its own. A spherical joint has its angular velocity in the
    /// child's axes.
    pub velocities: Vec<f64>,
}

impl Configuration {
    /// Creates a configuration at rest.
    pub fn at(root: DPose3, positions: Vec<f64>) -> Self {
        Self { root, linear: DVec3::ZERO, angular: DVec3::ZERO, positions, velocities: Vec::new() }
    }

    /// Returns `world_from_base`: the pose of a fixed root link, else the world's origin.
    pub(super) fn base(&self, tree: &Tree) -> Placement {
        if tree.fixed_base {
            Placement::new(self.root.rotation, self.root.translation)
        } else {
            Placement::IDENTITY
        }
    }

    /// Returns q and qd in the order of a step. Missing values are zero.
    pub(crate) fn state(&self, tree: &Tree) -> (Vec<f64>, Vec<f64>) {
        let (mut q, mut qd) = (vec![0.0; tree.root_positions()], vec![0.0; tree.root_velocities()]);
        if !tree.fixed_base {
            write_free_pose(&mut q, self.root.translation, self.root.rotation);
            write_free(&mut qd, self.linear, self.root.rotation.inverse() * self.angular);
        }
        q.extend_from_slice(&self.positions);
        q.resize(tree.position_count, 0.0);
        qd.extend_from_slice(&self.velocities);
        qd.resize(tree.velocity_count, 0.0);
        (q, qd)
    }
}

/// All bodies at a moment, in the base's axes.
pub(super) struct Kinematics {
    /// Results of a step's first pass.
    pub(super) scratch: Vec<BodyScratch>,
    /// Positions of body origins relative to the base's origin.
    pub(super) origins: Vec<DVec3>,
}

impl Kinematics {
    /// Runs the first pass for all bodies.
    pub(super) fn new(tree: &Tree, q: &[f64], qd: &[f64]) -> Self {
        let mut kinematics = Self {
            scratch: vec![BodyScratch::default(); tree.bodies.len()],
            origins: vec![DVec3::ZERO; tree.bodies.len()],
        };
        kinematics.update(tree, q, qd);
        kinematics
    }

    /// Runs the first pass for another state of the same tree.
    pub(super) fn update(&mut self, tree: &Tree, q: &[f64], qd: &[f64]) {
        update_kinematics(tree, q, qd, &mut self.scratch);
        for (i, body) in tree.bodies.iter().enumerate() {
            let above = body.parent.map_or(DVec3::ZERO, |parent| self.origins[parent]);
            self.origins[i] = above + self.scratch[i].reach;
        }
    }

    /// Returns `base_from_link`.
    pub(super) fn link(&self, tree: &Tree, link: usize) -> Placement {
        let frame = &tree.links[link];
        let own = Placement::new(frame.body_from_link.rotation, frame.body_from_link.translation);
        match frame.body {
            Some(body) => {
                Placement { rotation: self.scratch[body].rotation, origin: self.origins[body] }.then(&own)
            }
            None => own,
        }
    }
}

impl Tree {
    /// Returns the velocity of each link of the model: linear of its frame's origin, then angular, both in
    /// world axes.
    pub fn link_twists(&self, configuration: &Configuration) -> Vec<(DVec3, DVec3)> {
        let (q, qd) = configuration.state(self);
        let world_from_base: DMat3 = configuration.base(self).rotation;
        let kinematics = Kinematics::new(self, &q, &qd);
        let twist = |(link, frame): (usize, &super::tree::LinkFrame)| {
            let Some(body) = frame.body else { return (DVec3::ZERO, DVec3::ZERO) };
            let reach = kinematics.link(self, link).origin - kinematics.origins[body];
            let Spatial { angular, linear } = kinematics.scratch[body].velocity.motion_at(reach);
            (world_from_base * linear, world_from_base * angular)
        };
        self.links.iter().enumerate().map(twist).collect()
    }
}
