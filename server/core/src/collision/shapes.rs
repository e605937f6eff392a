//! Shapes of a robot. Primitives are unchanged, and planes are half-spaces: all below them is inside. Meshes
//! of immovable links become their triangles. Meshes of other links become their convex hulls or, on request,
//! several convex parts.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::shape::SharedShape;
use simd_model::RobotModel;
use simd_model::robot::{Geometry, JointKind, Sha256, Visual};

use super::bounds::Bounds;
use super::convex_mesh::tree_of;
use super::mesh::{MadeMesh, is_field, mesh_shapes};
use super::part::{Made, MeshShapes, Part, SAMPLE_BYTES, TRIANGLE_BYTES, Way, upright};
use super::proxy::{Proxy, ProxyShape};
use super::separation::Inner;

/// Maximum memory of one robot's meshes as triangles, bytes; hulls replace further meshes. A million
/// triangles.
const MAX_FACET_BYTES: u64 = 1_000_000 * TRIANGLE_BYTES;

/// Collision shapes of a robot, link by link. Hulls of large meshes take long to make: not on the physics
/// thread.
#[derive(Clone, Default)]
pub struct Shapes {
    pub(super) parts: Vec<Part>,
    /// Shapes of its meshes, to be reused by other robots.
    meshes: MadeMeshes,
    proxies: Vec<Proxy>,
    /// Boxes around the visuals of links without collision shapes, by link, in the link's frame.
    drawn: Vec<(usize, Bounds)>,
}

impl fmt::Debug for Shapes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} shapes", self.parts.len())
    }
}

impl Shapes {
    /// Creates the shapes of a robot, with its meshes as hulls. A missing mesh touches nothing; the load
    /// report said so.
    pub fn new(model: &RobotModel) -> Self {
        Self::reusing(model, false, MeshShapes::Hull, &[])
    }

    /// Creates the shapes of a robot whose root link can move or, with `fixed_base`, cannot. Shapes of the
    /// same meshes at the same scale are taken from other robots: they are equal.
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
        let mut drawn = Vec::new();
        let welded = welded_to_world(model, fixed_base);
        let mut bytes = TriangleBytes::default();
        let has_links_that_meet = model.joints.iter().any(|joint| joint.kind != JointKind::Fixed);
        for ((link, of), is_welded) in model.links.iter().enumerate().zip(welded) {
            let way = Way::of(mesh_shapes, is_welded, has_links_that_meet);
            for collision in &of.collisions {
                let made = shapes(&collision.geometry, way, &mut bytes, &mut meshes, others);
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
                        is_measured: made.shapes.iter().any(|made| made.tree.is_some()),
                    };
                    if !proxies.contains(&proxy) {
                        proxies.push(proxy);
                    }
                }
                let hull = made.mesh.filter(|mesh| mesh.kind == ProxyShape::Hull);
                let hull_error = hull.map_or(0.0, |hull| hull.distance);
                for Made { shape, own_from_shape, neighbours, graph, surface, tree } in made.shapes {
                    let link_from_shape = collision.link_from_shape * own_from_shape;
                    let (inner, material) = (Inner::of(&*shape), collision.material);
                    // Computed once: parry scans all corners of a hull.
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
                        hull_error,
                        tree,
                        material,
                    });
                }
            }
            if parts.last().is_none_or(|part: &Part| part.link != link) {
                let around = of.visuals.iter().filter_map(drawn_box).reduce(Bounds::around);
                drawn.extend(around.map(|around| (link, around)));
            }
        }
        if parts.iter().any(|part| part.tree.is_some()) {
            for part in parts.iter_mut().filter(|part| part.tree.is_none() && !part.is_coarse()) {
                part.tree = tree_of(&*part.shape).map(Arc::new);
            }
        }
        Self { parts, meshes, proxies, drawn }
    }

    /// Returns the shapes that replace its collision meshes, each once.
    pub fn proxies(&self) -> &[Proxy] {
        &self.proxies
    }

    /// Returns the shapes of its meshes by their keys, each with its approximate number of bytes. Robots with
    /// equal keys share them.
    pub fn mesh_bytes(&self) -> impl Iterator<Item = (MeshKey, u64)> + '_ {
        self.meshes.iter().map(|(key, made)| (*key, made.shapes.iter().map(Made::bytes).sum()))
    }

    /// Returns lower and upper corner of a box along the world's axes for each link that has visuals and no
    /// collision shapes. The box is around the box of the visuals in the link's frame.
    pub fn drawn_bounds<'a>(
        &'a self,
        world_from_link: &'a [DPose3],
    ) -> impl Iterator<Item = [DVec3; 2]> + 'a {
        self.drawn.iter().filter_map(|(link, around)| {
            let own = [around.least.midpoint(around.most), (around.most - around.least) / 2.0];
            let Bounds { least, most } = Bounds::of_box(own, world_from_link.get(*link)?, 0.0);
            Some([least, most])
        })
    }

    /// Returns the number of shapes.
    pub fn len(&self) -> usize {
        self.parts.len()
    }

    /// Returns whether the robot touches nothing.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }
}

/// Returns for each link whether it can never move: a fixed root, and everything welded to it.
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

/// Key of a mesh's shapes: the hash of its file, its scale and the kind of shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MeshKey(Sha256, [u64; 3], Way);

/// Shapes of meshes by key.
type MadeMeshes = BTreeMap<MeshKey, MadeMesh>;

/// Bytes of the triangles of a robot's meshes: of those that touch as they are, and of those that are measured.
#[derive(Default)]
struct TriangleBytes {
    facets: u64,
    measured: u64,
}

impl TriangleBytes {
    fn exceeds_facets(&mut self, bytes: u64) -> bool {
        self.facets = self.facets.saturating_add(bytes);
        self.facets > MAX_FACET_BYTES
    }

    fn exceeds_measured(&mut self, bytes: u64) -> bool {
        self.measured = self.measured.saturating_add(bytes);
        self.measured > MAX_FACET_BYTES
    }
}

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

/// Returns the shapes of a geometry; none if its mesh is missing. `facet_bytes` counts the memory of meshes
/// that collide as triangles.
fn shapes(
    geometry: &Geometry,
    way: Way,
    bytes: &mut TriangleBytes,
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
            if !meshes.contains_key(&key(way)) {
                let triangles = asset.triangles.len() as u64 * TRIANGLE_BYTES;
                let is_over = match way {
                    Way::Facets if is_field(asset, *scale) => {
                        bytes.exceeds_facets(asset.vertices.len() as u64 * SAMPLE_BYTES)
                    }
                    Way::Facets => bytes.exceeds_facets(triangles),
                    Way::MeasuredHull => bytes.exceeds_measured(triangles),
                    Way::Hull | Way::Decomposition => false,
                };
                if is_over {
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

/// Returns the shape of a primitive, and parry's axes for it in its own; `None` for a mesh without a hull.
pub(super) fn own_shape(geometry: &Geometry) -> Option<(SharedShape, DPose3)> {
    let made = shapes(geometry, Way::Hull, &mut TriangleBytes::default(), &mut MadeMeshes::new(), &[]);
    made.shapes.into_iter().next().map(|made| (made.shape, made.own_from_shape))
}

/// Returns a box around a visual in the frame of its link; `None` for a plane and a missing mesh.
fn drawn_box(visual: &Visual) -> Option<Bounds> {
    match &visual.geometry {
        Geometry::Plane { .. } => None,
        Geometry::Mesh { scale, asset, .. } => {
            let corners = asset.as_deref()?.vertices.iter();
            let corners = corners.map(|vertex| visual.link_from_shape.transform_point(*scale * *vertex));
            corners.map(|corner| Bounds::about(corner, DVec3::ZERO)).reduce(Bounds::around)
        }
        primitive => {
            let (shape, own_from_shape) = own_shape(primitive)?;
            Some(Bounds::of(&*shape, &(visual.link_from_shape * own_from_shape), 0.0))
        }
    }
}
