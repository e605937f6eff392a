//! Shapes of robots at one moment, for queries: placed at their links' poses. A scene is made for some
//! queries and then discarded: no step reads it.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::bounding_volume::Aabb;
use rapier3d_f64::parry::partitioning::{Bvh, BvhBuildStrategy};
use rapier3d_f64::parry::shape::{ShapeType, SharedShape};
use simd_model::robot::Geometry;

use super::facets::{Facets, Neighbours, ground};
use super::shapes::{Shapes, own_shape};
use crate::dynamics::Tree;

/// Shape of a query, which belongs to no robot.
pub struct QueryShape {
    pub(super) shape: SharedShape,
    pub(super) own_from_shape: DPose3,
}

impl QueryShape {
    /// Returns `None` for a mesh without a hull.
    pub fn new(geometry: &Geometry) -> Option<Self> {
        own_shape(geometry).map(|(shape, own_from_shape)| Self { shape, own_from_shape })
    }
}

/// Robot index of a shape that belongs to none.
pub const NO_ROBOT: usize = usize::MAX;

/// Shape of a robot's link, in the world.
#[derive(Clone)]
pub struct PlacedShape {
    /// Robot, as passed to [`posed_shapes`], or [`NO_ROBOT`].
    pub robot: usize,
    /// Link, by index.
    pub link: usize,
    /// Body of the link, by index; `None` is the base.
    pub body: Option<usize>,
    /// Index of the shape among the robot's shapes.
    pub(super) collider: usize,
    pub(super) shape: SharedShape,
    pub(super) world_from_shape: DPose3,
    pub(super) bounds: Aabb,
    /// Neighbours of the triangles of a mesh.
    neighbours: Option<Arc<Neighbours>>,
}

impl PlacedShape {
    /// Creates a shape that belongs to no robot, at a pose.
    pub fn of_no_robot(query: &QueryShape, pose: DPose3) -> Self {
        let world_from_shape = pose * query.own_from_shape;
        Self {
            robot: NO_ROBOT,
            link: 0,
            body: None,
            collider: 0,
            bounds: query.shape.compute_aabb(&world_from_shape),
            shape: query.shape.clone(),
            world_from_shape,
            neighbours: None,
        }
    }

    /// Returns whether it belongs to no robot.
    pub fn is_of_no_robot(&self) -> bool {
        self.robot == NO_ROBOT
    }

    /// Returns its sort key.
    pub(super) fn key(&self) -> (usize, usize) {
        (self.robot, self.collider)
    }

    /// Returns whether it is a plane.
    pub fn is_plane(&self) -> bool {
        self.shape.shape_type() == ShapeType::HalfSpace
    }

    /// Returns whether the tree can hold it. It takes no infinite boxes, such as those of planes, and of
    /// shapes that are too large or too far away.
    fn is_bounded(&self) -> bool {
        let Aabb { mins, maxs } = self.solid_bounds();
        !self.is_plane() && mins.is_finite() && maxs.is_finite()
    }

    /// Returns whether it is a mesh of triangles or a height field.
    pub fn is_surface(&self) -> bool {
        matches!(self.shape.shape_type(), ShapeType::TriMesh | ShapeType::HeightField)
    }

    /// Returns its triangles, if it consists of them.
    pub(super) fn facets(&self) -> Option<Facets<'_>> {
        Facets::of(&*self.shape, self.neighbours.as_ref())
    }

    /// Returns the bounds of its interior; for a height field with the ground below.
    pub(super) fn solid_bounds(&self) -> Aabb {
        let field = self.shape.as_heightfield();
        field.map_or(self.bounds, |field| ground(field).transform_by(&self.world_from_shape))
    }
}

/// Returns the shapes of a robot, of all its links or of one, with `world_from_link` of each link. A plane
/// that could move touches nothing, and is left out.
pub fn posed_shapes(
    robot: usize,
    tree: &Tree,
    shapes: &Shapes,
    poses: &[DPose3],
    link: Option<usize>,
) -> Vec<PlacedShape> {
    let wanted =
        shapes.parts.iter().enumerate().filter(|(_, part)| link.is_none_or(|link| link == part.link));
    let placed = wanted.filter_map(|(collider, part)| {
        let (pose, frame) = (poses.get(part.link)?, tree.links.get(part.link)?);
        let world_from_shape = *pose * part.link_from_shape;
        let placed = PlacedShape {
            robot,
            link: part.link,
            body: frame.body,
            collider,
            bounds: part.shape.compute_aabb(&world_from_shape),
            shape: part.shape.clone(),
            world_from_shape,
            neighbours: part.neighbours.clone(),
        };
        (frame.body.is_none() || !placed.is_plane()).then_some(placed)
    });
    placed.collect()
}

/// Box around a shape of a link, which moves with it.
#[derive(Clone, Copy, Debug)]
pub struct LinkBox {
    /// Link, by index.
    pub link: usize,
    /// Centre and axes of the box in the link.
    pub link_from_box: DPose3,
    /// Half of its lengths, metres.
    pub half: DVec3,
}

impl Shapes {
    /// Returns boxes around the shapes of all links, or of one; for planes and triangle surfaces they are
    /// infinite.
    pub fn boxes(&self, link: Option<usize>) -> impl Iterator<Item = LinkBox> {
        let wanted = self.parts.iter().filter(move |part| link.is_none_or(|link| link == part.link));
        wanted.map(|part| {
            let [middle, half] = part.local_box;
            let kind = part.shape.shape_type();
            let is_convex =
                !matches!(kind, ShapeType::HalfSpace | ShapeType::TriMesh | ShapeType::HeightField);
            LinkBox {
                link: part.link,
                link_from_box: part.link_from_shape * DPose3::from_translation(middle),
                half: if is_convex { half } else { DVec3::INFINITY },
            }
        })
    }
}

/// Returns lower and upper corner of the box along the world's axes around each link with shapes; planes are
/// left out.
pub fn link_bounds(shapes: &[PlacedShape], links: usize) -> Vec<Option<[DVec3; 2]>> {
    let mut bounds: Vec<Option<[DVec3; 2]>> = vec![None; links];
    for placed in shapes.iter().filter(|placed| !placed.is_plane()) {
        if let Some(of_link) = bounds.get_mut(placed.link) {
            let Aabb { mins, maxs } = placed.bounds;
            let [least, most] = of_link.unwrap_or([mins, maxs]);
            *of_link = Some([least.min(mins), most.max(maxs)]);
        }
    }
    bounds
}

/// Shapes of robots at one moment.
pub struct Scene {
    /// Shapes with finite bounds, in the order of the tree's leaves, and after them planes and shapes without
    /// a finite box.
    pub(super) shapes: Vec<PlacedShape>,
    pub(super) bounded: usize,
    pub(super) tree: Bvh,
}

impl Scene {
    /// Creates the scene. Shapes at a pose that is not finite are left out.
    pub fn new(shapes: Vec<PlacedShape>) -> Self {
        let somewhere = shapes.into_iter().filter(|placed| placed.world_from_shape.is_finite());
        let (mut shapes, mut others): (Vec<_>, Vec<_>) = somewhere.partition(PlacedShape::is_bounded);
        let bounds: Vec<Aabb> = shapes.iter().map(PlacedShape::solid_bounds).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &bounds);
        let bounded = shapes.len();
        shapes.append(&mut others);
        Self { shapes, bounded, tree }
    }

    /// Returns the shapes whose bounds meet a box, and all that are not in the tree.
    pub(super) fn near<'a>(&'a self, bounds: &'a Aabb) -> impl Iterator<Item = &'a PlacedShape> {
        let near = self.tree.intersect_aabb(bounds).map(|leaf| leaf as usize);
        near.chain(self.bounded..self.shapes.len()).filter_map(|index| self.shapes.get(index))
    }
}
