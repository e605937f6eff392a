//! The shapes of a robot: primitives as they are, meshes as their convex hulls or, where
//! that is asked for, as several convex parts.
//! Planes are half-spaces: all below them is inside.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::fmt;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use parry3d_f64::shape::SharedShape;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};
use parry3d_f64::transformation::voxelization::FillMode;
use serde::{Deserialize, Serialize};
use simd_model::RobotModel;
use simd_model::robot::{Geometry, Material, MeshAsset, Sha256};

use super::geometry::ConvexMesh;
use super::separation::Inner;

/// A plate this thin still has a volume, metres.
const THINNEST: f64 = 1e-6;

/// A mesh with more corners than this has its hull made of its extremes alone: the time
/// that a hull takes is then bounded, and so is what a contact with it costs.
const MOST_POINTS: usize = 1_000;

/// Directions in which extremes are looked for.
const DIRECTIONS: usize = 256;

/// A mesh with more triangles than this is not taken apart: its hull stands for it.
const MOST_TRIANGLES: usize = 100_000;

/// How finely a mesh is taken apart, and into how many parts at the most.
const DECOMPOSITION: VHACDParameters = VHACDParameters {
    concavity: 0.01,
    alpha: 0.05,
    beta: 0.05,
    resolution: 64,
    plane_downsampling: 4,
    convex_hull_downsampling: 4,
    fill_mode: FillMode::FloodFill { detect_cavities: false },
    convex_hull_approximation: true,
    max_convex_hulls: 32,
};

/// What collision meshes become.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum MeshShapes {
    /// Their convex hull.
    #[default]
    Hull,
    /// At most 32 convex parts, by hierarchical approximate decomposition on 64 voxels a side
    /// (Mamou, "Volumetric Hierarchical Approximate Convex Decomposition", 2016). What is
    /// narrower than a voxel may be closed.
    Decomposition,
}

/// What a robot touches with, link by link. Hulls of large meshes take long to make:
/// not on the physics thread.
#[derive(Clone, Default)]
pub struct Shapes {
    pub(super) parts: Vec<Part>,
    /// Of its meshes, for other robots with the same.
    hulls: Hulls,
}

/// A shape of a link.
#[derive(Clone)]
pub(super) struct Part {
    /// Index of the link.
    pub(super) link: usize,
    /// `link_from_shape`, in parry's own convention for the shape.
    pub(super) link_from_shape: DPose3,
    pub(super) shape: SharedShape,
    pub(super) inner: Inner,
    /// Of a convex hull or part of a mesh: the hash of its vertices and triangles.
    pub(super) convex: Option<Sha256>,
    /// As the description gives it.
    pub(super) material: Material,
}

impl fmt::Debug for Shapes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} shapes", self.parts.len())
    }
}

impl Shapes {
    /// Those of a robot. A mesh that is missing touches nothing; the load report said so.
    pub fn new(model: &RobotModel) -> Self {
        Self::reusing(model, MeshShapes::Hull, &[])
    }

    /// The same, with the hulls that other robots have of the same meshes in the same
    /// scale: they are what would be made here.
    pub fn reusing(model: &RobotModel, meshes: MeshShapes, others: &[Arc<Self>]) -> Self {
        // A mesh that is used many times has its hull made once.
        let mut hulls = Hulls::new();
        let mut parts = Vec::new();
        for (link, of) in model.links.iter().enumerate() {
            for collision in &of.collisions {
                for made in shapes(&collision.geometry, meshes, &mut hulls, others) {
                    let Made { shape, own_from_shape, convex } = made;
                    let link_from_shape = collision.link_from_shape * own_from_shape;
                    let (inner, material) = (Inner::of(&*shape), collision.material);
                    parts.push(Part { link, link_from_shape, shape, inner, convex, material });
                }
            }
        }
        Self { parts, hulls }
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

/// A shape of a geometry.
#[derive(Clone)]
struct Made {
    shape: SharedShape,
    /// parry's axes for the shape in those of the description.
    own_from_shape: DPose3,
    /// See [`Part::convex`].
    convex: Option<Sha256>,
}

impl Made {
    /// A shape whose axes are those of the description.
    fn new(shape: SharedShape) -> Self {
        Self { shape, own_from_shape: DPose3::IDENTITY, convex: None }
    }

    /// The convex hull of points, or `None` where they have none.
    fn convex(points: &[DVec3]) -> Option<Self> {
        let shape = SharedShape::convex_hull(points)?;
        let convex = shape.as_convex_polyhedron().map(|hull| ConvexMesh::of(hull).sha256());
        Some(Self { convex, ..Self::new(shape) })
    }
}

/// What meshes became, by hash, scale and way.
type Hulls = BTreeMap<(Sha256, [u64; 3], MeshShapes), Vec<Made>>;

/// What a geometry touches with; nothing where its mesh is missing.
fn shapes(geometry: &Geometry, meshes: MeshShapes, hulls: &mut Hulls, others: &[Arc<Shapes>]) -> Vec<Made> {
    vec![match geometry {
        Geometry::Box { size } => Made::new(SharedShape::cuboid(size.x / 2.0, size.y / 2.0, size.z / 2.0)),
        Geometry::Sphere { radius } => Made::new(SharedShape::ball(*radius)),
        Geometry::Cylinder { radius, length } => {
            Made { own_from_shape: upright(), ..Made::new(SharedShape::cylinder(length / 2.0, *radius)) }
        }
        Geometry::Capsule { radius, length } => Made::new(SharedShape::capsule_z(length / 2.0, *radius)),
        Geometry::Plane { normal } => Made::new(SharedShape::halfspace(normal.normalize_or(DVec3::Z))),
        Geometry::Mesh { scale, asset, .. } => {
            let Some(asset) = asset.as_deref() else { return Vec::new() };
            let key = (asset.sha256, scale.to_array().map(f64::to_bits), meshes);
            let known = || others.iter().find_map(|other| other.hulls.get(&key)).cloned();
            let make = || match meshes {
                MeshShapes::Decomposition => decomposition(asset, *scale),
                MeshShapes::Hull => hull(asset, *scale).into_iter().collect(),
            };
            return hulls.entry(key).or_insert_with(|| known().unwrap_or_else(make)).clone();
        }
    }]
}

/// parry's cylinders stand along y, URDF's along z.
pub(super) fn upright() -> DPose3 {
    DPose3::from_rotation(DQuat::from_rotation_x(FRAC_PI_2))
}

/// Convex parts of a mesh; its hull where it cannot be taken apart.
fn decomposition(mesh: &MeshAsset, scale: DVec3) -> Vec<Made> {
    let points: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let whole = || hull(mesh, scale).into_iter().collect();
    let first = points.first().copied().unwrap_or_default();
    let (least, most) = points.iter().fold((first, first), |(l, m), p| (l.min(*p), m.max(*p)));
    if mesh.triangles.len() > MOST_TRIANGLES || (most - least).min_element() <= THINNEST {
        return whole();
    }
    let parts = VHACD::decompose(&DECOMPOSITION, &points, &mesh.triangles, true);
    let parts = parts.compute_exact_convex_hulls(&points, &mesh.triangles);
    let hull = |(points, _): (Vec<DVec3>, Vec<[u32; 3]>)| {
        Made::convex(&if points.len() > MOST_POINTS { extremes(&points) } else { points })
    };
    let parts: Vec<Made> = parts.into_iter().filter_map(hull).collect();
    if parts.is_empty() { whole() } else { parts }
}

/// The convex hull of a mesh; of one that is flat, its bounding box.
fn hull(mesh: &MeshAsset, scale: DVec3) -> Option<Made> {
    let points: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let points = if points.len() > MOST_POINTS { extremes(&points) } else { points };
    let first = *points.first()?;
    let (least, most) = points.iter().fold((first, first), |(l, m), p| (l.min(*p), m.max(*p)));
    let solid = (most - least).min_element() > THINNEST;
    if let Some(hull) = solid.then(|| Made::convex(&points)).flatten() {
        return Some(hull);
    }
    // The box stands where the points are, not about the origin.
    let half = ((most - least) / 2.0).max(DVec3::splat(THINNEST));
    Some(Made {
        own_from_shape: DPose3::from_translation((most + least) / 2.0),
        ..Made::new(SharedShape::cuboid(half.x, half.y, half.z))
    })
}

/// The points that are farthest in directions spread evenly over the sphere (a Fibonacci
/// lattice), each once. Their hull lies within that of all points.
fn extremes(points: &[DVec3]) -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let mut kept: Vec<usize> = (0..DIRECTIONS)
        .filter_map(|i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / DIRECTIONS as f64;
            let (sin, cos) = (golden * i as f64).sin_cos();
            let across = (1.0 - z * z).sqrt();
            let direction = DVec3::new(across * cos, across * sin, z);
            let far = |a: &usize, b: &usize| points[*a].dot(direction).total_cmp(&points[*b].dot(direction));
            (0..points.len()).max_by(far)
        })
        .collect();
    kept.sort_unstable();
    kept.dedup();
    kept.into_iter().map(|i| points[i]).collect()
}
