//! Grounds of triangles: meshes and height fields that tests make.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::command::Spawn;
use simd_model::RobotModel;
use simd_model::robot::{Geometry, Grid, MeshAsset, Sha256};
use simd_tests::scenes::{robot, solid};

/// Returns a mesh of one link, in this scale.
pub(crate) fn mesh(
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    grid: Option<Grid>,
    scale: DVec3,
) -> Arc<RobotModel> {
    let bytes: Vec<u8> =
        vertices.iter().flat_map(|vertex| vertex.to_array()).flat_map(f64::to_le_bytes).collect();
    let asset = MeshAsset {
        sha256: Sha256::of(&bytes),
        vertices,
        triangles,
        paints: Vec::new(),
        files: Vec::new(),
        grid,
    };
    solid(
        &[(
            DPose3::IDENTITY,
            Geometry::Mesh { uri: "ground.stl".into(), scale, asset: Some(Arc::new(asset)) },
        )],
        1.0,
    )
}

/// Returns the surface above a grid of `cells` by `cells` of `size` metres a side. Each corner is moved in
/// its plane by up to `shift` of a cell and set to the given height.
pub(crate) fn grid(
    cells: usize,
    size: f64,
    mut shift: impl FnMut() -> f64,
    height: impl Fn(f64, f64) -> f64,
) -> Arc<RobotModel> {
    let n = cells + 1;
    let mut vertices = Vec::new();
    for row in 0..n {
        for column in 0..n {
            let at = |i: usize, shift: f64| ((i as f64 + shift) / cells as f64 - 0.5) * size;
            let (x, y) = (at(column, shift()), at(row, shift()));
            vertices.push(DVec3::new(x, y, height(x, y)));
        }
    }
    let mut triangles = Vec::new();
    for row in 0..cells {
        for column in 0..cells {
            let corner = |down: usize, right: usize| ((row + down) * n + column + right) as u32;
            let [a, b, c, d] = [corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh(vertices, triangles, None, DVec3::ONE)
}

/// Returns a height field of `samples` by `samples`, `size` metres a side.
pub(crate) fn field(samples: usize, size: f64, height: impl Fn(f64, f64) -> f64) -> Arc<RobotModel> {
    let mut vertices = Vec::new();
    let part = |i: usize| i as f64 / (samples - 1) as f64 - 0.5;
    for row in 0..samples {
        for column in 0..samples {
            let (x, y) = (part(column), -part(row));
            vertices.push(DVec3::new(x, y, height(x * size, y * size)));
        }
    }
    let scale = DVec3::new(size, size, 1.0);
    // The physics takes the triangles of the grid.
    mesh(vertices, vec![[0, 1, 2]], Some(Grid { rows: samples, columns: samples }), scale)
}

/// It does not move, and its mesh is taken as it is.
pub(crate) fn ground(model: &Arc<RobotModel>) -> Spawn {
    let shapes = Arc::new(Shapes::reusing(model, true, MeshShapes::Mesh, &[]));
    Spawn { shapes, ..robot("ground", model, DPose3::IDENTITY, true) }
}

/// Three steps of 8 cm, as one mesh.
pub(crate) fn stairs() -> Arc<RobotModel> {
    let profile = [
        (-2.0, 0.0),
        (0.0, 0.0),
        (0.0, 0.08),
        (0.3, 0.08),
        (0.3, 0.16),
        (0.6, 0.16),
        (0.6, 0.24),
        (2.0, 0.24),
    ];
    let vertices =
        profile.iter().flat_map(|&(x, z)| [DVec3::new(x, -1.0, z), DVec3::new(x, 1.0, z)]).collect();
    let triangles = (0..profile.len() as u32 - 1)
        .flat_map(|i| [[2 * i, 2 * i + 2, 2 * i + 1], [2 * i + 1, 2 * i + 2, 2 * i + 3]])
        .collect();
    mesh(vertices, triangles, None, DVec3::ONE)
}

/// Returns the floor and the four walls of a room of 3 m by 3 m by 1 m, as one mesh, open above.
pub(crate) fn room() -> Arc<RobotModel> {
    let corners = [(-1.5, -1.5), (1.5, -1.5), (1.5, 1.5), (-1.5, 1.5)];
    let below = corners.iter().map(|&(x, y)| DVec3::new(x, y, 0.0));
    let vertices = below.chain(corners.iter().map(|&(x, y)| DVec3::new(x, y, 1.0))).collect();
    let walls = (0..4).flat_map(|a| {
        let b = (a + 1) % 4;
        [[a, b, b + 4], [a, b + 4, a + 4]]
    });
    mesh(vertices, walls.chain([[0, 1, 2], [0, 2, 3]]).collect(), None, DVec3::ONE)
}
