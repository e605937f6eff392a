//! What a mesh becomes: a surface of its triangles, its convex hull, or several convex parts.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::shape::SharedShape;
use rapier3d_f64::parry::transformation::vhacd::{VHACD, VHACDParameters};
use rapier3d_f64::parry::transformation::voxelization::FillMode;
use simd_model::extremes;
use simd_model::robot::MeshAsset;

use super::facets;
use super::geometry::ConvexMesh;
use super::hull::Graph;
use super::shapes::{Made, Way};
use super::stand_in::{StandInShape, largest_distance};

/// A plate this thin still has a volume, metres.
const THINNEST: f64 = 1e-6;

/// A mesh with more corners than this has its hull made of its extremes alone: the time
/// that a hull takes is then bounded, and so is what a contact with it costs.
const MOST_POINTS: usize = 1_000;

/// Directions in which extremes are looked for.
const DIRECTIONS: usize = 256;

/// A mesh with more triangles than this is not taken apart: its hull stands for it.
const MOST_DIVIDED: usize = 100_000;

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

/// What a mesh became.
#[derive(Clone)]
pub(super) struct MadeMesh {
    pub(super) shapes: Vec<Made>,
    pub(super) kind: StandInShape,
    /// See [`StandIn::distance`].
    pub(super) distance: f64,
}

/// Whether the triangles of a mesh are those of a height field.
pub(super) fn is_field(mesh: &MeshAsset, scale: DVec3) -> bool {
    mesh.grid.is_some() && scale.min_element() > 0.0
}

/// What a mesh becomes, or what stands in where that cannot be.
pub(super) fn mesh_shapes(mesh: &MeshAsset, scale: DVec3, way: Way) -> MadeMesh {
    let facets = || match &mesh.grid {
        Some(grid) if is_field(mesh, scale) => facets::height_field(mesh, grid, scale),
        _ => facets::triangles(mesh, scale),
    };
    let exact = match way {
        Way::Facets => facets(),
        Way::Hull | Way::Decomposition => None,
    };
    if let Some(made) = exact {
        return MadeMesh { shapes: vec![made], kind: StandInShape::Mesh, distance: 0.0 };
    }
    let parts = if way == Way::Decomposition { decomposition(mesh, scale) } else { Vec::new() };
    let (shapes, kind) = if parts.is_empty() {
        (hull(mesh, scale).into_iter().collect(), StandInShape::Hull)
    } else {
        let count = parts.len();
        (parts, StandInShape::Parts(count))
    };
    let distance = largest_distance(mesh, scale, &shapes);
    MadeMesh { shapes, kind, distance }
}

/// Convex parts of a mesh; none where it cannot be taken apart.
fn decomposition(mesh: &MeshAsset, scale: DVec3) -> Vec<Made> {
    let points: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let first = points.first().copied().unwrap_or_default();
    let (least, most) = points.iter().fold((first, first), |(l, m), p| (l.min(*p), m.max(*p)));
    if mesh.triangles.len() > MOST_DIVIDED || (most - least).min_element() <= THINNEST {
        return Vec::new();
    }
    let parts = VHACD::decompose(&DECOMPOSITION, &points, &mesh.triangles, true);
    let parts = parts.compute_exact_convex_hulls(&points, &mesh.triangles);
    let hull = |(points, _): (Vec<DVec3>, Vec<[u32; 3]>)| {
        convex(&if points.len() > MOST_POINTS { extremes(&points, DIRECTIONS) } else { points })
    };
    parts.into_iter().filter_map(hull).collect()
}

/// The convex hull of a mesh; of one that is flat, its bounding box.
fn hull(mesh: &MeshAsset, scale: DVec3) -> Option<Made> {
    let points: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let points = if points.len() > MOST_POINTS { extremes(&points, DIRECTIONS) } else { points };
    let first = *points.first()?;
    let (least, most) = points.iter().fold((first, first), |(l, m), p| (l.min(*p), m.max(*p)));
    let solid = (most - least).min_element() > THINNEST;
    if let Some(hull) = solid.then(|| convex(&points)).flatten() {
        return Some(hull);
    }
    // The box stands where the points are, not about the origin.
    let half = ((most - least) / 2.0).max(DVec3::splat(THINNEST));
    Some(Made {
        own_from_shape: DPose3::from_translation((most + least) / 2.0),
        ..Made::new(SharedShape::cuboid(half.x, half.y, half.z))
    })
}

/// The convex hull of points, or `None` where they have none.
fn convex(points: &[DVec3]) -> Option<Made> {
    let shape = SharedShape::convex_hull(points)?;
    let surface = ConvexMesh::of(&*shape).map(|mesh| mesh.sha256());
    let graph = shape.as_convex_polyhedron().and_then(Graph::of).map(Arc::new);
    Some(Made { graph, surface, ..Made::new(shape) })
}
