//! Collision shapes of a mesh: a surface of its triangles, its convex hull, or several convex parts.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::shape::SharedShape;
use rapier3d_f64::parry::transformation::vhacd::{VHACD, VHACDParameters};
use rapier3d_f64::parry::transformation::voxelization::FillMode;
use simd_model::robot::MeshAsset;

use super::convex_mesh::ConvexMesh;
use super::hull::Graph;
use super::mesh_facets;
use super::part::{COARSE_HULL, MAX_MEASURED_TRIANGLES, Made, Way};
use super::proxy::{ProxyShape, largest_distance};
use super::simplify::simplified;
use super::triangle_tree::TriangleTree;

/// Smallest thickness of a plate with a volume, metres.
const THINNEST: f64 = 1e-6;

/// Number of corners above which a hull is simplified. This bounds the time to make a hull and the cost of
/// its contacts.
const MAX_POINTS: usize = 1_000;

/// Number of triangles above which a mesh is not decomposed; its hull replaces it.
const MAX_DECOMPOSED_TRIANGLES: usize = 100_000;

/// Resolution and maximum number of parts of a convex decomposition.
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

/// Shapes made of a mesh.
#[derive(Clone)]
pub(super) struct MadeMesh {
    pub(super) shapes: Vec<Made>,
    pub(super) kind: ProxyShape,
    /// See [`Proxy::distance`].
    pub(super) distance: f64,
    /// See [`Proxy::simpler_by`].
    pub(super) simpler_by: Option<f64>,
}

/// Returns whether the triangles of a mesh form a height field.
pub(super) fn is_field(mesh: &MeshAsset, scale: DVec3) -> bool {
    mesh.grid.is_some() && scale.min_element() > 0.0
}

/// Returns the shapes of a mesh, or a replacement if they cannot be made.
pub(super) fn mesh_shapes(mesh: &MeshAsset, scale: DVec3, way: Way) -> MadeMesh {
    let facets = || match &mesh.grid {
        Some(grid) if is_field(mesh, scale) => mesh_facets::height_field(mesh, grid, scale),
        _ => mesh_facets::triangles(mesh, scale),
    };
    let exact = match way {
        Way::Facets => facets(),
        Way::Hull | Way::MeasuredHull | Way::Decomposition => None,
    };
    if let Some(made) = exact {
        return MadeMesh { shapes: vec![made], kind: ProxyShape::Mesh, distance: 0.0, simpler_by: None };
    }
    let parts = if way == Way::Decomposition { decomposition(mesh, scale) } else { Vec::new() };
    let (mut shapes, kind, simpler_by) = if parts.is_empty() {
        let hull = hull(mesh, scale);
        let simpler_by = hull.as_ref().and_then(|(_, by)| *by);
        (hull.into_iter().map(|(made, _)| made).collect(), ProxyShape::Hull, simpler_by)
    } else {
        let count = parts.len();
        (parts, ProxyShape::Parts(count), None)
    };
    let distance = largest_distance(mesh, scale, &shapes);
    if let ([hull], Way::MeasuredHull) = (&mut shapes[..], way)
        && distance > COARSE_HULL
    {
        hull.tree = tree(mesh, scale, hull.own_from_shape.inverse()).map(Arc::new);
    }
    MadeMesh { shapes, kind, distance, simpler_by }
}

/// The triangles of a mesh in a shape's axes; `None` where they are too many.
fn tree(mesh: &MeshAsset, scale: DVec3, shape_from_own: DPose3) -> Option<TriangleTree> {
    let corner = |index: u32| shape_from_own.transform_point(mesh.vertices[index as usize] * scale);
    let few = mesh.triangles.len() <= MAX_MEASURED_TRIANGLES;
    few.then(|| TriangleTree::new(mesh.triangles.iter().map(|triangle| triangle.map(corner))))?
}

/// Convex parts of a mesh; none where it cannot be taken apart.
fn decomposition(mesh: &MeshAsset, scale: DVec3) -> Vec<Made> {
    let points: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let first = points.first().copied().unwrap_or_default();
    let (least, most) = points.iter().fold((first, first), |(l, m), p| (l.min(*p), m.max(*p)));
    if mesh.triangles.len() > MAX_DECOMPOSED_TRIANGLES || (most - least).min_element() <= THINNEST {
        return Vec::new();
    }
    let parts = VHACD::decompose(&DECOMPOSITION, &points, &mesh.triangles, true);
    let parts = parts.compute_exact_convex_hulls(&points, &mesh.triangles);
    parts.into_iter().filter_map(|(points, _)| convex(&fewer(points).0)).collect()
}

/// Returns corners with nearly the same hull. If they are fewer, also returns how far any other corner lies
/// outside of its faces, metres.
fn fewer(points: Vec<DVec3>) -> (Vec<DVec3>, Option<f64>) {
    if points.len() <= MAX_POINTS {
        return (points, None);
    }
    let (kept, error) = simplified(&points);
    (kept, Some(error))
}

/// Returns the convex hull of a mesh, and the error of its simplification; for a flat mesh, its bounding box.
fn hull(mesh: &MeshAsset, scale: DVec3) -> Option<(Made, Option<f64>)> {
    let points: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let (points, simpler_by) = fewer(points);
    let first = *points.first()?;
    let (least, most) = points.iter().fold((first, first), |(l, m), p| (l.min(*p), m.max(*p)));
    let solid = (most - least).min_element() > THINNEST;
    if let Some(hull) = solid.then(|| convex(&points)).flatten() {
        return Some((hull, simpler_by));
    }
    // The box is centred at the points, not at the origin.
    let half = ((most - least) / 2.0).max(DVec3::splat(THINNEST));
    let around = Made {
        own_from_shape: DPose3::from_translation((most + least) / 2.0),
        ..Made::new(SharedShape::cuboid(half.x, half.y, half.z))
    };
    Some((around, None))
}

/// Returns the convex hull of points, or `None` if they have none.
fn convex(points: &[DVec3]) -> Option<Made> {
    let shape = SharedShape::convex_hull(points)?;
    let surface = ConvexMesh::of(&*shape).map(|mesh| mesh.sha256());
    let graph = shape.as_convex_polyhedron().and_then(Graph::of).map(Arc::new);
    Some(Made { graph, surface, ..Made::new(shape) })
}
