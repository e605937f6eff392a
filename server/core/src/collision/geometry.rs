//! Colliders as plain data for drawing, read back from the shapes that the physics uses.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::shape::TypedShape;
use simd_model::robot::Sha256;

use super::convex_mesh::ConvexMesh;
use super::part::{Part, upright};
use super::shapes::Shapes;
use crate::dynamics::Tree;

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

impl Part {
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
