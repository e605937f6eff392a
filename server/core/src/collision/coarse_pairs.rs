//! Links of one robot that touch each other with a hull that is too coarse.

use std::collections::BTreeMap;
use std::sync::Arc;

use simd_model::RobotModel;
use simd_model::setup::LinkPair as DescribedPair;

use super::colliders::RobotColliders;
use super::filter::{LinkPair, MAX_OWN_PAIRS};
use super::groups::Groups;
use super::part::Part;
use super::shapes::Shapes;
use crate::dynamics::Tree;
use crate::dynamics::contact_point::Surface;

/// Two links of one robot that touch each other with a hull that is too coarse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarsePair {
    /// Indices of the links, the smaller first.
    pub links: [usize; 2],
    /// How far the hull lies from its mesh, metres: the larger one of the two.
    pub distance: f64,
}

impl Shapes {
    /// Returns pairs of links that touch each other with a coarse hull whose mesh is not measured, if the description
    /// asks for self-collision. Each pair once, in order.
    pub fn coarse_pairs(self: &Arc<Self>, model: &RobotModel, fixed_base: bool) -> Vec<CoarsePair> {
        let is_hull = |part: &Part| part.is_coarse() && part.tree.is_none();
        if !model.setup.self_collision || !self.parts.iter().any(is_hull) {
            return Vec::new();
        }
        let tree = Tree::new(model, fixed_base);
        let mut colliders = RobotColliders::new(&tree, self, Surface::default());
        if colliders.most_own_pairs() > MAX_OWN_PAIRS {
            return Vec::new();
        }
        let mut groups = vec![Groups::default(); model.links.len()];
        for given in &model.setup.groups {
            if let Some(groups) = groups.get_mut(given.link) {
                *groups = Groups { group: given.group, mask: given.mask };
            }
        }
        let in_order = |[i, j]: [usize; 2]| [i.min(j), i.max(j)];
        let enabled = |pair: &DescribedPair| LinkPair { links: in_order(pair.links), enabled: pair.enabled };
        let mut pairs: Vec<LinkPair> = model.setup.pairs.iter().map(enabled).collect();
        pairs.sort_unstable();
        colliders.set_filter(&tree, true, &groups, &pairs);
        let mut found: BTreeMap<[usize; 2], f64> = BTreeMap::new();
        for [i, j] in colliders.own_collider_pairs() {
            let parts = [i, j].map(|index| colliders.part(index));
            if parts.into_iter().any(is_hull) {
                let links = in_order(parts.map(|part| part.link));
                let distance = parts[0].hull_error.max(parts[1].hull_error);
                let known = found.entry(links).or_default();
                *known = known.max(distance);
            }
        }
        found.into_iter().map(|(links, distance)| CoarsePair { links, distance }).collect()
    }
}
