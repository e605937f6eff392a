//! How far a robot can move before it can touch anything: a bound from boxes and spheres, for who steps it without looking.

use super::colliders::{Placed, RobotColliders};
use super::filter::Filter;
use crate::dynamics::Tree;
use crate::dynamics::tree::JointType;

/// At least so far apart are two colliders, metres, without how far around them contacts are looked for.
fn gap(a: &Placed, b: &Placed) -> f64 {
    a.bounds.gap(&b.bounds).max(a.sphere_gap(b) - a.margin - b.margin)
}

impl RobotColliders {
    /// The least gap between this robot and another one that comes after it, of shapes of which one moves, where the last step has put
    /// them, metres: negative where they may meet, infinite where they never touch. `filter` is that of the two.
    pub fn gap_to(&self, other: &Self, filter: Filter<'_>) -> f64 {
        let pairs = self.placed.iter().flat_map(|a| other.placed.iter().map(move |b| (a, b)));
        let can_meet =
            |(a, b): &(&Placed, &Placed)| (a.body.is_some() || b.body.is_some()) && filter.allows(a, b);
        pairs.filter(can_meet).map(|(a, b)| gap(a, b)).fold(f64::INFINITY, f64::min)
    }

    /// The same between its own, of which each moves.
    pub fn own_gap(&self) -> f64 {
        let gap = |pair: &[usize; 2]| match pair.map(|index| self.placed.get(index)) {
            [Some(a), Some(b)] => gap(a, b),
            _ => f64::NEG_INFINITY,
        };
        self.own_pairs.iter().map(gap).fold(f64::INFINITY, f64::min)
    }

    /// How far any point of what hangs on each body moves at the most where its joint moves by one unit, from `positions` of all
    /// joints, as long as those that slide move by less than `slide`: metres a radian, or 1. For trees of joints of one axis.
    pub fn levers(&self, tree: &Tree, positions: &[f64], slide: f64) -> Vec<f64> {
        let mut far = vec![f64::NEG_INFINITY; tree.bodies.len()];
        for placed in &self.placed {
            if let Some(far) = placed.body.and_then(|body| far.get_mut(body)) {
                *far = far.max(placed.farthest());
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
