//! Surfaces of triangles of a mesh, as it is.

use std::sync::Arc;

use glamx::DVec3;
use rapier3d_f64::parry::shape::{HeightField, SharedShape, TriMesh, TriMeshFlags};
use rapier3d_f64::parry::utils::Array2;
use simd_model::robot::{Grid, MeshAsset, Sha256};

use super::facets::neighbours;
use super::part::{Made, upright};

/// Smallest area of a triangle, as a part of its longest side's square; below it is a line.
const LINE: f64 = 1e-12;

/// Returns the triangles of a mesh that have an area; `None` if none has.
pub(super) fn triangles(mesh: &MeshAsset, scale: DVec3) -> Option<Made> {
    let corners: Vec<DVec3> = mesh.vertices.iter().map(|vertex| *vertex * scale).collect();
    let has_area = |triangle: &&[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
        let longest = [b - a, c - b, a - c].map(|side| side.length_squared()).into_iter().fold(0.0, f64::max);
        (b - a).cross(c - a).length() > LINE * longest
    };
    let kept: Vec<[u32; 3]> = mesh.triangles.iter().filter(has_area).copied().collect();
    let flags = TriMeshFlags::MERGE_DUPLICATE_VERTICES
        | TriMeshFlags::DELETE_DEGENERATE_TRIANGLES
        | TriMeshFlags::DELETE_DUPLICATE_TRIANGLES;
    let made = TriMesh::with_flags(corners, kept, flags).ok()?;
    let neighbours = Some(Arc::new(neighbours(made.indices())));
    let surface = Some(surface_hash(mesh, scale));
    Some(Made { neighbours, surface, ..Made::new(SharedShape::new(made)) })
}

/// Returns the height field of a mesh that is a grid, with a positive scale.
pub(super) fn height_field(mesh: &MeshAsset, grid: &Grid, scale: DVec3) -> Option<Made> {
    let Grid { rows, columns } = *grid;
    let is_grid = rows > 1 && columns > 1 && rows.checked_mul(columns) == Some(mesh.vertices.len());
    // parry stores the rows of a column in sequence.
    let height = |at: usize| mesh.vertices.get(at % rows * columns + at / rows).map(|corner| corner.z);
    let heights: Option<Vec<f64>> = is_grid.then(|| (0..rows * columns).map(height).collect())?;
    let field = HeightField::new(Array2::new(rows, columns, heights?), DVec3::new(scale.x, scale.z, scale.y));
    let surface = Some(surface_hash(mesh, scale));
    Some(Made { own_from_shape: upright(), surface, ..Made::new(SharedShape::new(field)) })
}

/// Returns the key of a surface: the hash of the file, its scale and a tag.
fn surface_hash(mesh: &MeshAsset, scale: DVec3) -> Sha256 {
    let scale = scale.to_array().into_iter().flat_map(f64::to_le_bytes);
    Sha256::of(&mesh.sha256.0.into_iter().chain(scale).chain(*b"facets").collect::<Vec<u8>>())
}
