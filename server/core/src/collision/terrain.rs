//! Shapes below the surface of terrain by mistake.

use std::cell::Cell;

use glamx::DVec3;
use rapier3d_f64::parry::query::{Ray, RayCast as _};
use rapier3d_f64::parry::shape::{Shape, ShapeType, TriMesh, TypedShape};

use super::facets::{Facets, above};
use super::scene::PlacedShape;
use super::shapes::Shapes;

/// Largest height above a shape at which surfaces are looked for, metres.
const FARTHEST: f64 = 1e4;

/// Displacement of the ray that counts triangles, as a part of the coordinates: edges that meet above the
/// centre would count as two.
const CENTRE_OFFSET: f64 = 1e-6;

impl Shapes {
    /// Returns whether some shapes consist of triangles.
    pub fn has_terrain(&self) -> bool {
        self.parts.iter().any(|part| is_terrain(&*part.shape))
    }
}

fn is_terrain(shape: &dyn Shape) -> bool {
    matches!(shape.shape_type(), ShapeType::TriMesh | ShapeType::HeightField)
}

impl PlacedShape {
    /// Returns whether it consists of triangles.
    pub fn is_terrain(&self) -> bool {
        is_terrain(&*self.shape)
    }

    /// Returns the depth of this movable shape's centre below terrain, metres, upwards. Returns `None` if it
    /// is not below, or if the other shape does not consist of triangles.
    ///
    /// All below a height field is ground, and all inside a closed mesh. Another mesh may be a roof: a shape
    /// below its upper side is below the surface if no part of the mesh is beneath.
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
                // Within a room, the triangle above faces down.
                let has_upper_side = normal.dot(up) > 0.0;
                let is_bottomless = || first(mesh, middle, -up).is_none();
                let is_solid =
                    || terrain.facets().is_some_and(Facets::is_closed) && is_inside(mesh, middle, up);
                (has_upper_side && (is_bottomless() || is_solid())).then_some(depth)
            }
            _ => None,
        }
    }
}

/// Returns the distance of the first triangle in a direction, and its normal.
fn first(mesh: &TriMesh, from: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
    let hit = mesh.cast_local_ray_and_get_normal(&Ray::new(from, direction), FARTHEST, false)?;
    let triangle = mesh.triangle(hit.subshape);
    Some((hit.time_of_impact, (triangle.b - triangle.a).cross(triangle.c - triangle.a)))
}

/// Returns whether a point is inside a closed mesh: an odd number of its triangles is above.
fn is_inside(mesh: &TriMesh, point: DVec3, up: DVec3) -> bool {
    let (u, v) = up.any_orthonormal_pair();
    let aside = (u * 0.83 + v * 0.55) * (CENTRE_OFFSET * (1.0 + point.abs().max_element()));
    let ray = Ray::new(point + aside, up);
    let above = Cell::new(0_u32);
    // No hit ends the search: all that the ray meets are counted.
    mesh.bvh().cast_ray(&ray, FARTHEST, |id, _| {
        let is_met = mesh.triangle(id).cast_local_ray(&ray, FARTHEST, false).is_some();
        above.set(above.get() + u32::from(is_met));
        None
    });
    above.get() % 2 == 1
}
