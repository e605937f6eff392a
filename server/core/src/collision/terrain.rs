//! What is below the surface of terrain, where it was not meant to be put.

use glamx::DVec3;
use rapier3d_f64::parry::query::{Ray, RayCast as _};
use rapier3d_f64::parry::shape::{Shape, ShapeType, TriMesh, TypedShape};

use super::Shapes;
use super::facets::above;
use super::scene::PlacedShape;

/// Surfaces farther above than this are not looked for, metres.
const FARTHEST: f64 = 1e4;

impl Shapes {
    /// Whether some of it are of triangles.
    pub fn has_terrain(&self) -> bool {
        self.parts.iter().any(|part| is_terrain(&*part.shape))
    }
}

fn is_terrain(shape: &dyn Shape) -> bool {
    matches!(shape.shape_type(), ShapeType::TriMesh | ShapeType::HeightField)
}

impl PlacedShape {
    /// Whether it is of triangles.
    pub fn is_terrain(&self) -> bool {
        is_terrain(&*self.shape)
    }

    /// How far the middle of this shape, which can move, is below terrain, metres, upwards; `None` where it is not, and where the
    /// other shape is not of triangles. All below a height field is ground. A mesh may be a roof: what is below its upper side is
    /// below the surface where nothing of the mesh is beneath.
    pub fn depth_below(&self, terrain: &Self, up: DVec3) -> Option<f64> {
        self.body?;
        let middle = self.world_from_shape.transform_point(self.shape.compute_local_bounding_sphere().center);
        let middle = terrain.world_from_shape.inverse_transform_point(middle);
        let up = terrain.world_from_shape.rotation.inverse() * up;
        match terrain.shape.as_typed_shape() {
            TypedShape::HeightField(field) => {
                let triangle = above(field, middle)?;
                let normal = (triangle.b - triangle.a).cross(triangle.c - triangle.a);
                Some((triangle.a - middle).dot(normal) / up.dot(normal)).filter(|depth| *depth > 0.0)
            }
            TypedShape::TriMesh(mesh) => {
                let (depth, normal) = first(mesh, middle, up)?;
                (normal.dot(up) > 0.0 && first(mesh, middle, -up).is_none()).then_some(depth)
            }
            _ => None,
        }
    }
}

/// How far the first triangle is in a direction, and its normal.
fn first(mesh: &TriMesh, from: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
    let hit = mesh.cast_local_ray_and_get_normal(&Ray::new(from, direction), FARTHEST, false)?;
    let triangle = mesh.triangle(hit.subshape);
    Some((hit.time_of_impact, (triangle.b - triangle.a).cross(triangle.c - triangle.a)))
}
