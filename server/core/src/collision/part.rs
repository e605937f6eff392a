//! Shapes of links, one by one, and how a mesh becomes shapes.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use rapier3d_f64::parry::shape::{ShapeType, SharedShape, TypedShape};
use serde::{Deserialize, Serialize};
use simd_model::robot::{Material, Sha256};

use super::facets::Neighbours;
use super::hull::Graph;
use super::separation::Inner;
use super::triangle_tree::TriangleTree;
use crate::dynamics::Tree;

/// Memory of a triangle of a mesh, bytes: its corners, its neighbours and its part of a tree.
pub(super) const TRIANGLE_BYTES: u64 = 300;

/// Memory of a sample of a height field, bytes.
pub(super) const SAMPLE_BYTES: u64 = 9;

/// Memory of a corner of a convex hull, bytes, with its edges and its part of the faces.
const CORNER_BYTES: u64 = 700;

/// A hull that lies farther from its mesh is too coarse to touch other links of its robot with, metres.
pub(super) const COARSE_HULL: f64 = 3e-3;

/// The distance of a mesh with more triangles than this from other links is not measured: its hull touches them.
pub(super) const MAX_MEASURED_TRIANGLES: usize = 100_000;

/// Shapes to make of collision meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum MeshShapes {
    /// Triangles for links that cannot move, convex hulls for other links.
    #[default]
    Mesh,
    /// Convex hulls.
    Hull,
    /// At most 32 convex parts, by hierarchical approximate decomposition on 64 voxels a side (Mamou,
    /// "Volumetric Hierarchical Approximate Convex Decomposition", 2016). Gaps narrower than a voxel may be
    /// closed.
    Decomposition,
}

/// Shape of a link.
#[derive(Clone)]
pub(super) struct Part {
    /// Link, by index.
    pub(super) link: usize,
    /// `link_from_shape`, in parry's convention for the shape.
    pub(super) link_from_shape: DPose3,
    pub(super) shape: SharedShape,
    pub(super) inner: Inner,
    /// Neighbours of triangles.
    pub(super) neighbours: Option<Arc<Neighbours>>,
    /// Edges of a convex hull of many corners.
    pub(super) graph: Option<Arc<Graph>>,
    /// Box around it, as centre and half lengths in its axes.
    pub(super) local_box: [DVec3; 2],
    /// Hash of the vertices and triangles, for a shape made of a mesh.
    pub(super) surface: Option<Sha256>,
    /// How far a convex hull lies from its mesh, metres; 0 of other shapes.
    pub(super) hull_error: f64,
    /// Its triangles, or those of the mesh that a hull stands for: of robots with a hull that is too coarse.
    pub(super) tree: Option<Arc<TriangleTree>>,
    /// As the description gives it.
    pub(super) material: Material,
}

impl Part {
    /// Whether it is a hull that lies too far from its mesh to touch other links of its robot with.
    pub(super) fn is_coarse(&self) -> bool {
        self.hull_error > COARSE_HULL
    }

    /// Returns whether it touches anything; a plane that could move does not.
    pub(super) fn is_used(&self, tree: &Tree) -> bool {
        let is_plane = self.shape.shape_type() == ShapeType::HalfSpace;
        tree.links.get(self.link).is_some_and(|frame| frame.body.is_none() || !is_plane)
    }
}

/// Shapes to make of the mesh of one link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Way {
    Facets,
    Hull,
    /// With the triangles of the mesh if it is too coarse.
    MeasuredHull,
    Decomposition,
}

impl Way {
    pub(super) fn of(asked: MeshShapes, is_welded: bool, has_links_that_meet: bool) -> Self {
        match asked {
            MeshShapes::Mesh if is_welded => Self::Facets,
            MeshShapes::Mesh if has_links_that_meet => Self::MeasuredHull,
            MeshShapes::Mesh | MeshShapes::Hull => Self::Hull,
            MeshShapes::Decomposition => Self::Decomposition,
        }
    }
}

/// Shape of a geometry.
#[derive(Clone)]
pub(super) struct Made {
    pub(super) shape: SharedShape,
    /// Pose of parry's axes for the shape in the description's axes.
    pub(super) own_from_shape: DPose3,
    /// See [`Part::neighbours`].
    pub(super) neighbours: Option<Arc<Neighbours>>,
    /// See [`Part::graph`].
    pub(super) graph: Option<Arc<Graph>>,
    /// See [`Part::surface`].
    pub(super) surface: Option<Sha256>,
    /// See [`Part::tree`].
    pub(super) tree: Option<Arc<TriangleTree>>,
}

impl Made {
    /// A shape whose axes are those of the description.
    pub(super) fn new(shape: SharedShape) -> Self {
        Self {
            shape,
            own_from_shape: DPose3::IDENTITY,
            neighbours: None,
            graph: None,
            surface: None,
            tree: None,
        }
    }

    /// Returns its approximate memory in bytes, if it was made of a mesh.
    pub(super) fn bytes(&self) -> u64 {
        let tree = self.tree.as_ref().map_or(0, |tree| tree.bytes());
        tree + match self.shape.as_typed_shape() {
            TypedShape::TriMesh(mesh) => mesh.indices().len() as u64 * TRIANGLE_BYTES,
            TypedShape::HeightField(field) => field.heights().data().len() as u64 * SAMPLE_BYTES,
            TypedShape::ConvexPolyhedron(hull) => hull.points().len() as u64 * CORNER_BYTES,
            _ => size_of::<Self>() as u64,
        }
    }
}

/// Returns the rotation for parry's cylinders and cones, whose axis is y, while URDF's is z.
pub(super) fn upright() -> DPose3 {
    DPose3::from_rotation(DQuat::from_rotation_x(FRAC_PI_2))
}
