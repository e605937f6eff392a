//! Boxes that stay where they are in a tree, so that their number does not matter to what moves among them.

use rapier3d_f64::parry::bounding_volume::Aabb;
use rapier3d_f64::parry::partitioning::{Bvh, BvhBuildStrategy};

use super::bounds::Bounds;

/// Fewer than this are looked at one by one.
const WORTH_A_TREE: usize = 16;

/// Numbered boxes. It is made anew when one of them has moved: what it finds is put in order and compared
/// exactly, so that nothing depends on how it was made.
#[derive(Default)]
pub(super) struct Still {
    tree: Option<Bvh>,
    /// The numbers of the tree's leaves.
    leaves: Vec<usize>,
    /// Those that are not in the tree: few, or without an end.
    others: Vec<usize>,
}

impl Still {
    /// Takes these instead of what there was.
    pub(super) fn replace(&mut self, boxes: impl Iterator<Item = (usize, Bounds)>) {
        self.leaves.clear();
        self.others.clear();
        let mut bounds = Vec::new();
        for (number, Bounds { least, most }) in boxes {
            // The tree takes no numbers that are not finite, and a plane would be everywhere in it.
            if least.is_finite() && most.is_finite() {
                self.leaves.push(number);
                bounds.push(Aabb::new(least, most));
            } else {
                self.others.push(number);
            }
        }
        if bounds.len() < WORTH_A_TREE {
            self.others.append(&mut self.leaves);
            self.others.sort_unstable();
            self.tree = None;
        } else {
            self.tree = Some(Bvh::from_leaves(BvhBuildStrategy::Binned, &bounds));
        }
    }

    /// Adds the numbers of those that may meet a box, in no order: at least all that do.
    pub(super) fn candidates(&self, bounds: &Bounds, found: &mut Vec<usize>) {
        found.extend_from_slice(&self.others);
        if let Some(tree) = &self.tree {
            // The tree's own search, which ends where nothing meets the box.
            let near = Aabb::new(bounds.least, bounds.most);
            found.extend(tree.intersect_aabb(&near).filter_map(|leaf| self.leaves.get(leaf as usize)));
        }
    }
}
