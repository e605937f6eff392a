//! Collision filtering: groups and masks of links, pairs of links that are disabled or enabled, and
//! self-collision.
//!
//! The rule, in order of precedence:
//!
//! 1. Shapes of one body never touch; those of one robot only with self-collision.
//! 2. A disabled pair does not touch, and an enabled one does.
//! 3. Links of one robot that a joint connects do not touch.
//! 4. Other links touch if one of the two is in a group that the other one touches. This is MuJoCo's rule for
//!    `contype` and `conaffinity`, and PyBullet's for groups and masks.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::colliders::{Placed, RobotColliders};
use super::groups::Groups;
use crate::dynamics::Tree;

/// Maximum number of pairs of colliders of different bodies for a robot with self-collision. They are stored,
/// and a step in which the robot moves checks each.
pub const MAX_OWN_PAIRS: u64 = 1_000_000;

/// Pair of links that is disabled or enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct LinkPair {
    /// Links, by index; for one robot the smaller first.
    pub links: [usize; 2],
    /// Whether they touch, regardless of groups and joints; if false, they never touch.
    pub enabled: bool,
}

/// Pair of links of two robots that is disabled or enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RobotLinkPair {
    /// Robots, by index, the smaller first.
    pub robots: [usize; 2],
    /// Pair of one link of each.
    pub pair: LinkPair,
}

/// Collision filter between two robots.
#[derive(Clone, Copy, Debug, Default)]
pub struct Filter<'a> {
    /// Pairs of the two robots, in order.
    pairs: &'a [RobotLinkPair],
}

impl<'a> Filter<'a> {
    /// Returns the filter for two robots, the smaller index first, from all sorted pairs of a world.
    pub fn between(robots: [usize; 2], pairs: &'a [RobotLinkPair]) -> Self {
        if pairs.is_empty() {
            return Self::default();
        }
        let start = pairs.partition_point(|pair| pair.robots < robots);
        let length = pairs[start..].partition_point(|pair| pair.robots == robots);
        Self { pairs: &pairs[start..start + length] }
    }

    /// Returns whether a pair of links was enabled or disabled; `None` if neither.
    pub fn switched(&self, links: [usize; 2]) -> Option<bool> {
        let index = self.pairs.binary_search_by_key(&links, |of| of.pair.links).ok()?;
        Some(self.pairs[index].pair.enabled)
    }

    pub(super) fn allows(&self, a: &Placed, b: &Placed) -> bool {
        self.switched([a.link, b.link]).unwrap_or_else(|| a.groups.allow(b.groups))
    }
}

impl RobotColliders {
    /// Sets the filter: whether the robot touches itself, the groups of each of its links, and its own
    /// disabled or enabled pairs, in order. Links beyond the list keep the default groups. A robot that
    /// touches itself has at most [`MAX_OWN_PAIRS`], which the caller must check.
    pub fn set_filter(&mut self, tree: &Tree, self_collision: bool, groups: &[Groups], pairs: &[LinkPair]) {
        for placed in &mut self.placed {
            placed.groups = groups.get(placed.link).copied().unwrap_or_default();
        }
        self.own_pairs.clear();
        if !self_collision {
            return;
        }
        // Colliders of a link are adjacent, and those of two links all touch each other or none does.
        let mut start = 0;
        let of_link = |colliders: &[Placed]| {
            let range = start..start + colliders.len();
            start = range.end;
            range
        };
        let links: Vec<Range<usize>> = self.placed.chunk_by(|a, b| a.link == b.link).map(of_link).collect();
        let mut touched: Vec<Range<usize>> = Vec::new();
        for (index, link) in links.iter().enumerate() {
            let a = &self.placed[link.start];
            let may_touch = |other: &&Range<usize>| {
                let b = &self.placed[other.start];
                if a.body == b.body {
                    return false;
                }
                let both = [a.link.min(b.link), a.link.max(b.link)];
                match pairs.binary_search_by_key(&both, |pair| pair.links) {
                    Ok(index) => pairs[index].enabled,
                    Err(_) => !is_joined(tree, a.body, b.body) && a.groups.allow(b.groups),
                }
            };
            touched.clear();
            touched.extend(links[index + 1..].iter().filter(may_touch).cloned());
            for i in link.clone() {
                self.own_pairs.extend(touched.iter().flat_map(|other| other.clone().map(move |j| [i, j])));
            }
        }
    }

    /// Returns the number of pairs of colliders of different bodies, an upper bound for self-collision with
    /// any filter.
    pub fn most_own_pairs(&self) -> u64 {
        let mut of_body: BTreeMap<Option<usize>, u64> = BTreeMap::new();
        for placed in &self.placed {
            *of_body.entry(placed.body).or_default() += 1;
        }
        let (mut pairs, mut before) = (0_u64, 0_u64);
        for count in of_body.into_values() {
            pairs = pairs.saturating_add(before.saturating_mul(count));
            before += count;
        }
        pairs
    }

    /// Returns whether two colliders, of this robot and of another one, may touch.
    pub fn may_touch(
        &self,
        collider: usize,
        other: &Self,
        other_collider: usize,
        filter: Filter<'_>,
    ) -> bool {
        match (self.placed.get(collider), other.placed.get(other_collider)) {
            (Some(a), Some(b)) => filter.allows(a, b),
            _ => false,
        }
    }

    /// Returns whether two colliders of this robot may touch; the smaller index comes first.
    pub fn may_self_collide(&self, colliders: [usize; 2]) -> bool {
        self.own_pairs.binary_search(&colliders).is_ok()
    }
}

/// Returns whether a joint connects two bodies of a robot. The bodies of a planar joint are one link.
pub fn is_joined(tree: &Tree, a: Option<usize>, b: Option<usize>) -> bool {
    let above = |body: Option<usize>| {
        let mut at = body?;
        let joint = tree.bodies[at].joint;
        while let Some(parent) = tree.bodies[at].parent.filter(|&up| tree.bodies[up].joint == joint) {
            at = parent;
        }
        // A free root has no parent that it could touch.
        Some(tree.bodies[at].parent)
    };
    above(a) == Some(b) || above(b) == Some(a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_must_be_in_a_group_that_the_other_touches() {
        let groups = |group, mask| Groups { group, mask };
        assert!(Groups::default().allow(Groups::default()));
        assert!(groups(1, 2).allow(groups(2, 1)));
        assert!(groups(1, 2).allow(groups(2, 2)), "the first touches the second");
        assert!(!groups(1, 1).allow(groups(2, 2)));
        assert!(groups(1, 0).allow(Groups::default()) && groups(0, 1).allow(Groups::default()));
        assert!(!groups(0, 0).allow(Groups::default()), "what is in no group and touches none");
    }

    #[test]
    fn pairs_are_found_among_those_of_many_robots() {
        let pair = |robots, links, enabled| RobotLinkPair { robots, pair: LinkPair { links, enabled } };
        let mut pairs =
            vec![pair([0, 2], [1, 1], false), pair([0, 1], [3, 0], true), pair([0, 1], [2, 9], false)];
        pairs.sort_unstable();
        let filter = Filter::between([0, 1], &pairs);
        assert_eq!(filter.switched([2, 9]), Some(false));
        assert_eq!(filter.switched([3, 0]), Some(true));
        assert_eq!(filter.switched([1, 1]), None);
        assert_eq!(Filter::between([1, 2], &pairs).switched([1, 1]), None);
        assert_eq!(Filter::between([0, 2], &pairs).switched([1, 1]), Some(false));
    }
}
