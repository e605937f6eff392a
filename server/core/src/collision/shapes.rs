//! The shapes of a robot: primitives as they are, meshes as their convex hulls.

use std::f64::consts::FRAC_PI_2;
use std::fmt;

use glamx::{DPose3, DQuat, DVec3};
use rapier3d_f64::geometry::SharedShape;
use simd_model::RobotModel;
use simd_model::robot::{Geometry, MeshAsset};

/// A plate this thin still has a volume, metres.
const THINNEST: f64 = 1e-6;

/// What a robot touches with, link by link. Hulls of large meshes take long to make:
/// not on the physics thread.
#[derive(Clone, Default)]
pub struct Shapes {
    pub(super) parts: Vec<Part>,
}

/// A shape of a link.
#[derive(Clone)]
pub(super) struct Part {
    /// Index of the link.
    pub(super) link: usize,
    /// `link_from_shape`, in rapier's own convention for the shape.
    pub(super) link_from_shape: DPose3,
    pub(super) shape: SharedShape,
}

impl fmt::Debug for Shapes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} shapes", self.parts.len())
    }
}

impl Shapes {
    /// Those of a robot. A mesh that is missing touches nothing; the load report said so.
    pub fn new(model: &RobotModel) -> Self {
        let parts = model.links.iter().enumerate().flat_map(|(link, of)| {
            of.collisions.iter().filter_map(move |collision| {
                let (shape, turn) = shape(&collision.geometry)?;
                let link_from_shape = collision.link_from_shape * DPose3::from_rotation(turn);
                Some(Part { link, link_from_shape, shape })
            })
        });
        Self { parts: parts.collect() }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.parts.len()
    }

    /// Whether the robot touches nothing.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }
}

/// rapier's shape, and the turn from its axes to ours: its cylinders stand along y, URDF's along z.
fn shape(geometry: &Geometry) -> Option<(SharedShape, DQuat)> {
    let upright = DQuat::from_rotation_x(FRAC_PI_2);
    Some(match geometry {
        Geometry::Box { size } => {
            (SharedShape::cuboid(size.x / 2.0, size.y / 2.0, size.z / 2.0), DQuat::IDENTITY)
        }
        Geometry::Sphere { radius } => (SharedShape::ball(*radius), DQuat::IDENTITY),
        Geometry::Cylinder { radius, length } => (SharedShape::cylinder(length / 2.0, *radius), upright),
        Geometry::Capsule { radius, length } => {
            (SharedShape::capsule_z(length / 2.0, *radius), DQuat::IDENTITY)
        }
        Geometry::Mesh { scale, asset, .. } => (hull(asset.as_deref()?, *scale)?, DQuat::IDENTITY),
    })
}

/// The convex hull of a mesh; of one that is flat, its bounding box.
fn hull(mesh: &MeshAsset, scale: DVec3) -> Option<SharedShape> {
    let points: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let first = *points.first()?;
    let (least, most) = points.iter().fold((first, first), |(l, m), p| (l.min(*p), m.max(*p)));
    let solid = (most - least).min_element() > THINNEST;
    if let Some(hull) = solid.then(|| SharedShape::convex_hull(&points)).flatten() {
        return Some(hull);
    }
    // The box stands where the points are, not about the origin.
    let half = ((most - least) / 2.0).max(DVec3::splat(THINNEST));
    let centre = DPose3::from_translation((most + least) / 2.0);
    Some(SharedShape::compound(vec![(centre, SharedShape::cuboid(half.x, half.y, half.z))]))
}
