//! Tree of immovable boxes, so that their number hardly affects the cost of moving ones.

use rapier3d_f64::parry::bounding_volume::Aabb;
use rapier3d_f64::parry::partitioning::{Bvh, BvhBuildStrategy};

use super::bounds::Bounds;

/// Number of boxes below which all are scanned.
const WORTH_A_TREE: usize = 16;

/// Numbered boxes. It is rebuilt when one of them has moved. Its results are sorted and compared exactly, so
/// that nothing depends on how it was built.
#[derive(Default)]
pub(super) struct Still {
    tree: Option<Bvh>,
    /// Numbers of the tree's leaves.
    leaves: Vec<usize>,
    /// Boxes outside the tree: few, or infinite ones.
    others: Vec<usize>,
}

impl Still {
    /// Replaces all boxes.
    pub(super) fn replace(&mut self, boxes: impl Iterator<Item = (usize, Bounds)>) {
        self.leaves.clear();
        self.others.clear();
        let mut bounds = Vec::new();
        for (number, Bounds { least, most }) in boxes {
            // The tree takes only finite boxes, and a plane would be everywhere in it.
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

    /// Adds the numbers of boxes that may meet a box, unordered: at least all that do.
    pub(super) fn candidates(&self, bounds: &Bounds, found: &mut Vec<usize>) {
        found.extend_from_slice(&self.others);
        if let Some(tree) = &self.tree {
            // The tree's own search, which ends where nothing meets the box.
            let near = Aabb::new(bounds.least, bounds.most);
            found.extend(tree.intersect_aabb(&near).filter_map(|leaf| self.leaves.get(leaf as usize)));
        }
    }
}
