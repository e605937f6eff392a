//! Clearance of a robot: a bound from boxes and spheres on its motion without contact, for a step without
//! collision detection.

use super::bounds::Bounds;
use super::colliders::{Frame, Placed, RobotColliders};
use super::filter::Filter;
use crate::dynamics::Tree;
use crate::dynamics::tree::JointType;

/// Returns a lower bound of the distance between two colliders, metres, less their contact margins.
fn gap([(of_a, i), (of_b, j)]: [(&RobotColliders, usize); 2]) -> f64 {
    let (a, b) = (&of_a.placed[i], &of_b.placed[j]);
    let distance = a.bounds.gap(&b.bounds).max(a.sphere_gap(b) - a.margin - b.margin);
    distance.max(above((of_a, i), b)).max(above((of_b, j), a))
}

/// Returns the gap between a plane and a shape above it; the bounds of a plane meet everything. Minus
/// infinity if the first is not a plane.
fn above((of_plane, index): (&RobotColliders, usize), other: &Placed) -> f64 {
    let (plane, frame) = (&of_plane.placed[index], &of_plane.frames[index]);
    let Some(half_space) = of_plane.shape(plane).as_halfspace() else { return f64::NEG_INFINITY };
    let Bounds { least, most } = other.bounds;
    let normal = frame.world_from_shape.rotation * half_space.normal;
    let (middle, half) = (0.5 * (least + most), 0.5 * (most - least));
    normal.dot(middle - frame.world_from_shape.translation) - normal.abs().dot(half) - plane.margin
}

impl Placed {
    /// Returns the largest distance of its points from its body's origin, metres.
    pub(super) fn farthest(&self, frame: &Frame) -> f64 {
        frame.body_from_shape.transform_point(frame.middle).length() + self.radius
    }
}

impl RobotColliders {
    /// Returns the smallest gap, metres, between this robot and a later one, at their poses of the last step.
    /// At least one shape of each pair must move. It is negative if they may meet, and infinite if they never
    /// touch. `filter` belongs to the two robots. Planes are left out unless it `counts_planes`.
    pub fn gap_to(&self, other: &Self, filter: Filter<'_>, counts_planes: bool) -> f64 {
        let pairs = (0..self.len()).flat_map(|i| (0..other.len()).map(move |j| (i, j)));
        let can_meet = |&(i, j): &(usize, usize)| {
            let (a, b) = (&self.placed[i], &other.placed[j]);
            let is_plane = self.shape(a).as_halfspace().is_some() || other.shape(b).as_halfspace().is_some();
            (a.body.is_some() || b.body.is_some()) && (counts_planes || !is_plane) && filter.allows(a, b)
        };
        pairs.filter(can_meet).map(|(i, j)| gap([(self, i), (other, j)])).fold(f64::INFINITY, f64::min)
    }

    /// Returns the smallest gap between the robot's own colliders of moving bodies.
    pub fn own_gap(&self) -> f64 {
        let between = |pair: &[usize; 2]| {
            let is_known = pair.iter().all(|index| *index < self.len());
            if is_known { gap(pair.map(|index| (self, index))) } else { f64::NEG_INFINITY }
        };
        self.own_pairs.iter().map(between).fold(f64::INFINITY, f64::min)
    }

    /// Returns for each body the largest displacement of any point of its subtree per unit of its joint:
    /// metres per radian, or 1. For a free root it is per radian. `positions` are those of all joints;
    /// prismatic joints must move by less than `slide`. For trees of joints of one axis.
    pub fn levers(&self, tree: &Tree, positions: &[f64], slide: f64) -> Vec<f64> {
        let mut far = vec![f64::NEG_INFINITY; tree.bodies.len()];
        for (placed, frame) in self.placed.iter().zip(&self.frames) {
            if let Some(far) = placed.body.and_then(|body| far.get_mut(body)) {
                *far = far.max(placed.farthest(frame));
            }
        }
        for (index, body) in tree.bodies.iter().enumerate().rev() {
            let slides = match body.joint_type {
                JointType::Prismatic => {
                    positions.get(body.position).map_or(f64::INFINITY, |q| q.abs() + slide)
                }
                _ => 0.0,
            };
            if let Some(parent) = body.parent {
                far[parent] = far[parent].max(far[index] + body.at_zero.origin.length() + slides);
            }
        }
        let lever = |(body, far): (&crate::dynamics::tree::Body, f64)| match body.joint_type {
            _ if far < 0.0 => 0.0,
            JointType::Prismatic => 1.0,
            _ => far,
        };
        tree.bodies.iter().zip(far).map(lever).collect()
    }
}
