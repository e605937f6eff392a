//! Surfaces of shapes as triangles.

use glamx::DVec3;
use rapier3d_f64::parry::shape::{Shape, TypedShape};
use simd_model::robot::Sha256;

use super::part::MAX_MEASURED_TRIANGLES;
use super::triangle_tree::TriangleTree;

/// Sides of a round shape whose triangles are measured.
const ROUND: u32 = 64;

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
