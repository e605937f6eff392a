//! The shapes of a robot: primitives as they are; meshes of links that cannot move as the triangles that they are,
//! those of other links as their convex hulls or, where that is asked for, as several convex parts.
//! Planes are half-spaces: all below them is inside.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::fmt;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use rapier3d_f64::parry::shape::{SharedShape, TypedShape};
use serde::{Deserialize, Serialize};
use simd_model::RobotModel;
use simd_model::robot::{Geometry, JointKind, Material, Sha256};

use super::facets::Neighbours;
use super::hull::Graph;
use super::mesh::{MadeMesh, is_field, mesh_shapes};
use super::proxy::Proxy;
use super::separation::Inner;

/// Meshes of one robot that take more bytes than this in all are not collided with as they are: from there on hulls stand
/// for them. A million triangles.
const MOST_FACET_BYTES: u64 = 1_000_000 * TRIANGLE_BYTES;

/// What a triangle takes of a mesh: its corners, its neighbours and its part of a tree.
const TRIANGLE_BYTES: u64 = 300;

/// What a sample of a height field takes.
const SAMPLE_BYTES: u64 = 9;

/// What a corner of a convex hull takes, with its edges and its part of the faces.
const CORNER_BYTES: u64 = 700;

/// What collision meshes become.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum MeshShapes {
    /// Of links that cannot move the triangles that they are, of other links their convex hull.
    #[default]
    Mesh,
    /// Their convex hull.
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
    meshes: MadeMeshes,
    proxies: Vec<Proxy>,
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
    /// Of triangles: which are next to each other.
    pub(super) neighbours: Option<Arc<Neighbours>>,
    /// Of a convex hull of many corners: its edges.
    pub(super) graph: Option<Arc<Graph>>,
    /// The box around it, as middle and half lengths in its axes.
    pub(super) local_box: [DVec3; 2],
    /// Of what a mesh became: the hash of its vertices and triangles.
    pub(super) surface: Option<Sha256>,
    /// As the description gives it.
    pub(super) material: Material,
}

impl fmt::Debug for Shapes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} shapes", self.parts.len())
    }
}

impl Shapes {
    /// Those of a robot, its meshes as their hulls. A mesh that is missing touches nothing; the load report said so.
    pub fn new(model: &RobotModel) -> Self {
        Self::reusing(model, false, MeshShapes::Hull, &[])
    }

    /// Those of a robot whose root link can move or, with `fixed_base`, not. What other robots have of the same meshes
    /// in the same scale is taken from them: it is what would be made here.
    pub fn reusing(
        model: &RobotModel,
        fixed_base: bool,
        mesh_shapes: MeshShapes,
        others: &[Arc<Self>],
    ) -> Self {
        // A mesh that is used many times is made once.
        let mut meshes = MadeMeshes::new();
        let mut parts = Vec::new();
        let mut proxies: Vec<Proxy> = Vec::new();
        let welded = welded_to_world(model, fixed_base);
        let mut facet_bytes = 0;
        for ((link, of), is_welded) in model.links.iter().enumerate().zip(welded) {
            let way = Way::of(mesh_shapes, is_welded);
            for collision in &of.collisions {
                let made = shapes(&collision.geometry, way, &mut facet_bytes, &mut meshes, others);
                if let (Geometry::Mesh { uri, asset: Some(asset), .. }, Some(made)) =
                    (&collision.geometry, &made.mesh)
                {
                    let proxy = Proxy {
                        uri: uri.clone(),
                        triangles: asset.triangles.len(),
                        shape: made.kind,
                        asked: mesh_shapes,
                        is_fixed: is_welded,
                        distance: made.distance,
                        simpler_by: made.simpler_by,
                    };
                    if !proxies.contains(&proxy) {
                        proxies.push(proxy);
                    }
                }
                for Made { shape, own_from_shape, neighbours, graph, surface } in made.shapes {
                    let link_from_shape = collision.link_from_shape * own_from_shape;
                    let (inner, material) = (Inner::of(&*shape), collision.material);
                    // Looked for once: parry looks at all corners of a hull.
                    let around = shape.compute_local_aabb();
                    let local_box = [around.center(), around.half_extents()];
                    parts.push(Part {
                        link,
                        link_from_shape,
                        shape,
                        inner,
                        neighbours,
                        graph,
                        local_box,
                        surface,
                        material,
                    });
                }
            }
        }
        Self { parts, meshes, proxies }
    }

    /// What its collision meshes became, each once.
    pub fn proxies(&self) -> &[Proxy] {
        &self.proxies
    }

    /// What its meshes became, by what they were made from, and about how many bytes that takes. Robots whose meshes were
    /// made from the same share it.
    pub fn mesh_bytes(&self) -> impl Iterator<Item = (MeshKey, u64)> + '_ {
        self.meshes.iter().map(|(key, made)| (*key, made.shapes.iter().map(Made::bytes).sum()))
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

/// Of each link, whether it can never move: a root that is fixed, and what is welded to it.
fn welded_to_world(model: &RobotModel, fixed_base: bool) -> Vec<bool> {
    let mut welded = vec![false; model.links.len()];
    if let Some(root) = welded.first_mut() {
        *root = fixed_base;
    }
    // A parent comes before its children.
    for joint in &model.joints {
        let holds = joint.kind == JointKind::Fixed && welded.get(joint.parent) == Some(&true);
        if let Some(child) = welded.get_mut(joint.child) {
            *child = holds;
        }
    }
    welded
}

/// What the mesh of one link is to become.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Way {
    Facets,
    Hull,
    Decomposition,
}

impl Way {
    fn of(asked: MeshShapes, is_welded: bool) -> Self {
        match asked {
            MeshShapes::Mesh if is_welded => Self::Facets,
            MeshShapes::Mesh | MeshShapes::Hull => Self::Hull,
            MeshShapes::Decomposition => Self::Decomposition,
        }
    }
}

/// A shape of a geometry.
#[derive(Clone)]
pub(super) struct Made {
    pub(super) shape: SharedShape,
    /// parry's axes for the shape in those of the description.
    pub(super) own_from_shape: DPose3,
    /// See [`Part::neighbours`].
    pub(super) neighbours: Option<Arc<Neighbours>>,
    /// See [`Part::graph`].
    pub(super) graph: Option<Arc<Graph>>,
    /// See [`Part::surface`].
    pub(super) surface: Option<Sha256>,
}

impl Made {
    /// A shape whose axes are those of the description.
    pub(super) fn new(shape: SharedShape) -> Self {
        Self { shape, own_from_shape: DPose3::IDENTITY, neighbours: None, graph: None, surface: None }
    }

    /// About what it takes in memory, where it was made of a mesh.
    fn bytes(&self) -> u64 {
        match self.shape.as_typed_shape() {
            TypedShape::TriMesh(mesh) => mesh.indices().len() as u64 * TRIANGLE_BYTES,
            TypedShape::HeightField(field) => field.heights().data().len() as u64 * SAMPLE_BYTES,
            TypedShape::ConvexPolyhedron(hull) => hull.points().len() as u64 * CORNER_BYTES,
            _ => size_of::<Self>() as u64,
        }
    }
}

/// What a mesh is made from: the hash of its file, its scale and what it is to become.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MeshKey(Sha256, [u64; 3], Way);

/// What meshes became.
type MadeMeshes = BTreeMap<MeshKey, MadeMesh>;

/// The shapes of a geometry, and what is to be said of it where it is a mesh.
#[derive(Default)]
struct Whole {
    shapes: Vec<Made>,
    mesh: Option<MadeMesh>,
}

impl From<Made> for Whole {
    fn from(made: Made) -> Self {
        Self { shapes: vec![made], mesh: None }
    }
}

/// What a geometry touches with; nothing where its mesh is missing.
/// `facet_bytes` counts what meshes take that are collided with as they are.
fn shapes(
    geometry: &Geometry,
    way: Way,
    facet_bytes: &mut u64,
    meshes: &mut MadeMeshes,
    others: &[Arc<Shapes>],
) -> Whole {
    match geometry {
        Geometry::Box { size } => {
            Made::new(SharedShape::cuboid(size.x / 2.0, size.y / 2.0, size.z / 2.0)).into()
        }
        Geometry::Sphere { radius } => Made::new(SharedShape::ball(*radius)).into(),
        Geometry::Cylinder { radius, length } => {
            Made { own_from_shape: upright(), ..Made::new(SharedShape::cylinder(length / 2.0, *radius)) }
                .into()
        }
        Geometry::Capsule { radius, length } => {
            Made::new(SharedShape::capsule_z(length / 2.0, *radius)).into()
        }
        Geometry::Cone { radius, length } => {
            Made { own_from_shape: upright(), ..Made::new(SharedShape::cone(length / 2.0, *radius)) }.into()
        }
        Geometry::Plane { normal } => Made::new(SharedShape::halfspace(normal.normalize_or(DVec3::Z))).into(),
        Geometry::Mesh { scale, asset, .. } => {
            let Some(asset) = asset.as_deref() else { return Whole::default() };
            let key = |way| MeshKey(asset.sha256, scale.to_array().map(f64::to_bits), way);
            let mut way = way;
            if way == Way::Facets && !meshes.contains_key(&key(way)) {
                *facet_bytes = facet_bytes.saturating_add(if is_field(asset, *scale) {
                    asset.vertices.len() as u64 * SAMPLE_BYTES
                } else {
                    asset.triangles.len() as u64 * TRIANGLE_BYTES
                });
                if *facet_bytes > MOST_FACET_BYTES {
                    way = Way::Hull;
                }
            }
            let key = key(way);
            let known = || others.iter().find_map(|other| other.meshes.get(&key)).cloned();
            let make = || mesh_shapes(asset, *scale, way);
            let made = meshes.entry(key).or_insert_with(|| known().unwrap_or_else(make)).clone();
            Whole { shapes: made.shapes.clone(), mesh: Some(made) }
        }
    }
}

/// The shape of a primitive, and parry's axes for it in its own; `None` for a mesh without a hull.
pub(super) fn own_shape(geometry: &Geometry) -> Option<(SharedShape, DPose3)> {
    let made = shapes(geometry, Way::Hull, &mut 0, &mut MadeMeshes::new(), &[]);
    made.shapes.into_iter().next().map(|made| (made.shape, made.own_from_shape))
}

/// parry's cylinders and cones stand along y, URDF's along z.
pub(super) fn upright() -> DPose3 {
    DPose3::from_rotation(DQuat::from_rotation_x(FRAC_PI_2))
}
