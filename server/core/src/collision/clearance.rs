//! How far a robot can move before it can touch anything: a bound from boxes and spheres, for a step without collision detection.

use super::bounds::Bounds;
use super::colliders::{Frame, Placed, RobotColliders};
use super::filter::Filter;
use crate::dynamics::Tree;
use crate::dynamics::tree::JointType;

/// A lower bound of the distance between two colliders, metres, less their contact margins.
fn gap([(of_a, i), (of_b, j)]: [(&RobotColliders, usize); 2]) -> f64 {
    let (a, b) = (&of_a.placed[i], &of_b.placed[j]);
    let distance = a.bounds.gap(&b.bounds).max(a.sphere_gap(b) - a.margin - b.margin);
    distance.max(above((of_a, i), b)).max(above((of_b, j), a))
}

/// The same for a plane and what lies above it, whose bounds meet everything; minus infinity of what is no plane.
fn above((of_plane, index): (&RobotColliders, usize), other: &Placed) -> f64 {
    let (plane, frame) = (&of_plane.placed[index], &of_plane.frames[index]);
    let Some(half_space) = of_plane.shape(plane).as_halfspace() else { return f64::NEG_INFINITY };
    let Bounds { least, most } = other.bounds;
    let normal = frame.world_from_shape.rotation * half_space.normal;
    let (middle, half) = (0.5 * (least + most), 0.5 * (most - least));
    normal.dot(middle - frame.world_from_shape.translation) - normal.abs().dot(half) - plane.margin
}

impl Placed {
    /// How far from its body's origin any point of it is at the most.
    pub(super) fn farthest(&self, frame: &Frame) -> f64 {
        frame.body_from_shape.transform_point(frame.middle).length() + self.radius
    }
}

impl RobotColliders {
    /// The least gap between this robot and another one that comes after it, of shapes of which one moves, where the last step has put
    /// them, metres: negative where they may meet, infinite where they never touch. `filter` is that of the two.
    /// Planes are left out unless it `counts_planes`.
    pub fn gap_to(&self, other: &Self, filter: Filter<'_>, counts_planes: bool) -> f64 {
        let pairs = (0..self.len()).flat_map(|i| (0..other.len()).map(move |j| (i, j)));
        let can_meet = |&(i, j): &(usize, usize)| {
            let (a, b) = (&self.placed[i], &other.placed[j]);
            let is_plane = self.shape(a).as_halfspace().is_some() || other.shape(b).as_halfspace().is_some();
            (a.body.is_some() || b.body.is_some()) && (counts_planes || !is_plane) && filter.allows(a, b)
        };
        pairs.filter(can_meet).map(|(i, j)| gap([(self, i), (other, j)])).fold(f64::INFINITY, f64::min)
    }

    /// The same between its own, of which each moves.
    pub fn own_gap(&self) -> f64 {
        let between = |pair: &[usize; 2]| {
            let is_known = pair.iter().all(|index| *index < self.len());
            if is_known { gap(pair.map(|index| (self, index))) } else { f64::NEG_INFINITY }
        };
        self.own_pairs.iter().map(between).fold(f64::INFINITY, f64::min)
    }

    /// How far any point of what hangs on each body moves at the most where its joint moves by one unit, from `positions` of all
    /// joints, as long as those that slide move by less than `slide`: metres a radian, or 1. Of a free root, where it turns by a
    /// radian: what it is moved by comes to that. For trees of joints of one axis.
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
