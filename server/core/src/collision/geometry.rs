//! Colliders as plain data for drawing, read back from the shapes that the physics uses.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::shape::{Shape, ShapeType, TypedShape};
use simd_model::robot::Sha256;

use super::Shapes;
use super::mesh::MAX_MEASURED_TRIANGLES;
use super::shapes::{Part, upright};
use super::triangle_tree::TriangleTree;
use crate::dynamics::Tree;

/// Sides of a round shape whose triangles are measured.
const ROUND: u32 = 64;

/// A shape that a robot touches with.
#[derive(Clone, Debug, PartialEq)]
pub struct Collider {
    /// Link, by index.
    pub link: usize,
    /// `link_from_shape`.
    pub link_from_shape: DPose3,
    /// Geometry in the shape's frame.
    pub geometry: ColliderGeometry,
}

/// Geometry of a collider, metres; the axis of cylinders, capsules and cones is z.
#[derive(Clone, Debug, PartialEq)]
pub enum ColliderGeometry {
    /// Box, centred on the origin.
    Box {
        /// Full side lengths along each axis.
        size: DVec3,
    },
    /// Sphere, centred on the origin.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// Cylinder, centred on the origin.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Length along z.
        length: f64,
    },
    /// Capsule, centred on the origin.
    Capsule {
        /// Radius of the cylinder and of the caps.
        radius: f64,
        /// Length along z, without the caps.
        length: f64,
    },
    /// Cone with its base at -`length` / 2 and its apex at `length` / 2.
    Cone {
        /// Radius of the base.
        radius: f64,
        /// Length along z.
        length: f64,
    },
    /// Half-space: all below the plane through the origin is inside.
    Plane {
        /// Unit normal.
        normal: DVec3,
    },
    /// Convex hull of a mesh, one of its convex parts, or its triangles, with the mesh's scale applied.
    Convex {
        /// Hash by which [`Shapes::convex_mesh`] finds it.
        sha256: Sha256,
    },
}

/// Surface of a collider that is convex or consists of triangles, in the shape's frame.
#[derive(Clone, Debug, PartialEq)]
pub struct ConvexMesh {
    /// Vertices, metres.
    pub vertices: Vec<DVec3>,
    /// Indices into `vertices`, counterclockwise as seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl ConvexMesh {
    /// Returns the surface of parry's polyhedron, whose faces become fans of triangles, or of a triangle
    /// shape; `None` for other shapes.
    pub(super) fn of(shape: &dyn Shape) -> Option<Self> {
        let (vertices, triangles) = match shape.as_typed_shape() {
            TypedShape::ConvexPolyhedron(hull) => hull.to_trimesh(),
            TypedShape::TriMesh(mesh) => (mesh.vertices().to_vec(), mesh.indices().to_vec()),
            TypedShape::HeightField(field) => field.to_trimesh(),
            _ => return None,
        };
        Some(Self { vertices, triangles })
    }

    /// Returns the hash of the numbers, little-endian.
    pub fn sha256(&self) -> Sha256 {
        let coordinates =
            self.vertices.iter().flat_map(|vertex| vertex.to_array()).flat_map(f64::to_le_bytes);
        let indices = self.triangles.iter().flatten().flat_map(|index| index.to_le_bytes());
        Sha256::of(&coordinates.chain(indices).collect::<Vec<u8>>())
    }
}

/// The surface of a shape in triangles, round ones in at least [`ROUND`] around; `None` of a plane and a height field.
pub(super) fn tree_of(shape: &dyn Shape) -> Option<TriangleTree> {
    let (corners, triangles) = match shape.as_typed_shape() {
        TypedShape::Cuboid(cuboid) => cuboid.to_trimesh(),
        TypedShape::Ball(ball) => ball.to_trimesh(ROUND, ROUND / 2),
        TypedShape::Cylinder(cylinder) => cylinder.to_trimesh(ROUND),
        TypedShape::Cone(cone) => cone.to_trimesh(ROUND),
        TypedShape::Capsule(capsule) => capsule.to_trimesh(ROUND, ROUND / 2),
        TypedShape::ConvexPolyhedron(hull) => hull.to_trimesh(),
        TypedShape::TriMesh(mesh) if mesh.indices().len() <= MAX_MEASURED_TRIANGLES => {
            (mesh.vertices().to_vec(), mesh.indices().to_vec())
        }
        _ => return None,
    };
    TriangleTree::new(triangles.iter().map(|triangle| triangle.map(|corner| corners[corner as usize])))
}

impl Part {
    /// Returns whether it touches anything; a plane that could move does not.
    pub(super) fn is_used(&self, tree: &Tree) -> bool {
        let is_plane = self.shape.shape_type() == ShapeType::HalfSpace;
        tree.links.get(self.link).is_some_and(|frame| frame.body.is_none() || !is_plane)
    }

    fn collider(&self) -> Option<Collider> {
        let mut link_from_shape = self.link_from_shape;
        let geometry = match self.shape.as_typed_shape() {
            TypedShape::Cuboid(cuboid) => ColliderGeometry::Box { size: 2.0 * cuboid.half_extents },
            TypedShape::Ball(ball) => ColliderGeometry::Sphere { radius: ball.radius },
            TypedShape::Cylinder(cylinder) => {
                link_from_shape *= upright().inverse();
                ColliderGeometry::Cylinder { radius: cylinder.radius, length: 2.0 * cylinder.half_height }
            }
            TypedShape::Cone(cone) => {
                link_from_shape *= upright().inverse();
                ColliderGeometry::Cone { radius: cone.radius, length: 2.0 * cone.half_height }
            }
            TypedShape::Capsule(capsule) => {
                ColliderGeometry::Capsule { radius: capsule.radius, length: capsule.height() }
            }
            TypedShape::HalfSpace(plane) => ColliderGeometry::Plane { normal: plane.normal },
            // `shapes` creates no other.
            _ => ColliderGeometry::Convex { sha256: self.surface? },
        };
        Some(Collider { link: self.link, link_from_shape, geometry })
    }
}

impl Shapes {
    /// Returns the colliders of a robot of this tree, link by link.
    pub fn colliders(&self, tree: &Tree) -> impl Iterator<Item = Collider> {
        self.parts.iter().filter(|part| part.is_used(tree)).filter_map(Part::collider)
    }

    /// Returns the collider of this hash; `None` if the robot has none.
    pub fn convex_mesh(&self, sha256: &Sha256) -> Option<ConvexMesh> {
        let part = self.parts.iter().find(|part| part.surface.as_ref() == Some(sha256))?;
        ConvexMesh::of(&*part.shape)
    }
}
