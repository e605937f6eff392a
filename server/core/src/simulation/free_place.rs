//! Free place for a robot: beside all others, and above z = 0.

use glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

use crate::collision::Shapes;
use crate::collision::scene::{NO_ROBOT, PlacedShape, link_bounds, posed_shapes};
use crate::dynamics::Tree;

/// Distance of a free place from others, metres.
const GAP: f64 = 0.2;

/// Distance of a robot without shapes, whose size is unknown, from others, metres.
const GAP_WITHOUT_SHAPES: f64 = 1.0;

/// Width along x and y from which an object counts as ground, metres.
const GROUND_WIDTH: f64 = 10.0;

/// Depth below which shapes touch the ground, and are not in it, metres.
const TOUCHES: f64 = 1e-3;

/// Coordinates of a new robot that the world chooses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct FreePlace {
    /// Moves it along y, if necessary, until it stands beside all other robots but the ground.
    pub beside_others: bool,
    /// Raises it, if necessary, until its shapes are above z = 0.
    pub on_ground: bool,
}

/// Extent of a robot: the box around its shapes and the origins of its links, world axes, metres. Shapes of a
/// link are its collision shapes, or without any its visuals.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    lower: DVec3,
    upper: DVec3,
    /// Lowest z of its shapes; infinite without shapes.
    bottom: f64,
    /// Whether it has a plane or is wide.
    is_ground: bool,
}

impl Extent {
    /// Returns the extent of a robot with these shapes and poses `world_from_link`.
    pub fn new(tree: &Tree, shapes: &Shapes, poses: &[DPose3]) -> Self {
        let origins = poses.iter().map(|pose| (pose.translation, pose.translation));
        let (lower, upper) = origins
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
            .unwrap_or((DVec3::INFINITY, DVec3::NEG_INFINITY));
        let placed = posed_shapes(NO_ROBOT, tree, shapes, poses, None);
        let is_ground = placed.iter().any(PlacedShape::is_plane);
        let mut extent = Self { lower, upper, bottom: f64::INFINITY, is_ground };
        let bounds = link_bounds(&placed, tree.links.len()).into_iter().flatten();
        for [least, most] in bounds.chain(shapes.drawn_bounds(poses)) {
            extent.lower = extent.lower.min(least);
            extent.upper = extent.upper.max(most);
            extent.bottom = extent.bottom.min(least.z);
        }
        let size = extent.upper - extent.lower;
        extent.is_ground |= size.x > GROUND_WIDTH && size.y > GROUND_WIDTH;
        extent
    }

    /// Returns the extent of two robots that are spawned together.
    pub fn union(self, other: Self) -> Self {
        Self {
            lower: self.lower.min(other.lower),
            upper: self.upper.max(other.upper),
            bottom: self.bottom.min(other.bottom),
            is_ground: self.is_ground || other.is_ground,
        }
    }

    /// Returns the distance along y that a robot must move to stand beside all others, metres.
    pub fn way_beside(&self, others: impl Iterator<Item = Self>) -> f64 {
        let ends = others.filter(|other| !other.is_ground).map(|other| other.upper.y);
        let end = ends.fold(f64::NEG_INFINITY, f64::max);
        let gap = if self.bottom.is_finite() { GAP } else { GAP_WITHOUT_SHAPES };
        let way = end + gap - self.lower.y;
        if way.is_finite() && !self.is_ground { way.max(0.0) } else { 0.0 }
    }

    /// Returns the distance along z that brings its shapes above z = 0, metres.
    pub fn way_up(&self) -> f64 {
        if self.bottom < -TOUCHES && self.bottom.is_finite() && !self.is_ground { -self.bottom } else { 0.0 }
    }
}
