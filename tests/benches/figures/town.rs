//! Microseconds per step of a quadruped that stands among fixed things.

use std::sync::Arc;
use std::time::Instant;

use glamx::{DPose3, DVec3};
use simd_core::Simulation;
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::command::Spawn;
use simd_model::RobotModel;
use simd_model::robot::{Geometry, MeshAsset, Sha256};
use simd_tests::statistics::Spread;
use simd_tests::{robots, scenes};

const BATCHES: usize = 40;
const STEPS: usize = 200;

/// Prints the table.
pub(crate) fn print() {
    let (model, _) = robots::read("pybullet_data/a1/a1.urdf");
    println!(
        "A1 standing among immovable objects, 1 ms, one thread: microseconds a step (median of {BATCHES} batches)"
    );
    let mut worlds: Vec<(String, Simulation)> = vec![("on a plane".into(), scenes::a1(1e-3, &model))];
    for count in [1_000, 10_000, 100_000] {
        worlds.push((format!("{count} boxes of one robot"), town(&model, boxes(count))));
    }
    for count in [100, 1_000] {
        let mut world = scenes::a1(1e-3, &model);
        for (i, (pose, shape)) in boxes(count).into_iter().enumerate() {
            let house = scenes::solid(&[(DPose3::IDENTITY, shape)], 1.0);
            scenes::spawn(&mut world, scenes::robot(&format!("house-{i}"), &house, pose, true));
        }
        worlds.push((format!("{count} robots of one box"), world));
    }
    for cells in [22, 70, 223] {
        let name = format!("{} triangles of one mesh", 2 * cells * cells);
        worlds.push((name, town(&model, vec![(DPose3::IDENTITY, hills(cells))])));
    }
    // One after the other in turn, so that other load of the machine is the same for all.
    let mut times = vec![Vec::new(); worlds.len()];
    for _ in 0..BATCHES {
        for ((_, world), times) in worlds.iter_mut().zip(&mut times) {
            let start = Instant::now();
            (0..STEPS).for_each(|_| world.step());
            times.push(start.elapsed().as_secs_f64() * 1e6 / STEPS as f64);
        }
    }
    for ((name, _), times) in worlds.iter().zip(times) {
        println!("  {name:30} {}", Spread::of(times));
    }
}

fn town(model: &Arc<RobotModel>, shapes: Vec<(DPose3, Geometry)>) -> Simulation {
    let mut world = scenes::a1(1e-3, model);
    let town = scenes::solid(&shapes, 1.0);
    let shapes = Arc::new(Shapes::reusing(&town, true, MeshShapes::Mesh, &[]));
    scenes::spawn(&mut world, Spawn { shapes, ..scenes::robot("town", &town, DPose3::IDENTITY, true) });
    world
}

/// Returns boxes of a metre, in a square and three metres apart; the quadruped stands between four of them.
fn boxes(count: usize) -> Vec<(DPose3, Geometry)> {
    let side = (count as f64).sqrt().ceil() as usize;
    let at = |index: usize| 3.0 * (index as f64 - (side / 2) as f64) + 1.5;
    let house = |i: usize| {
        let place = DVec3::new(at(i % side), at(i / side), 0.5);
        (DPose3::from_translation(place), Geometry::Box { size: DVec3::ONE })
    };
    (0..count).map(house).collect()
}

/// Returns ground with this many cells a side, below the plane on which the quadruped stands. This holds even
/// if a cell is so large that its corners are on the slopes around.
fn hills(cells: usize) -> Geometry {
    let n = cells + 1;
    let at = |i: usize| (i as f64 / cells as f64 - 0.5) * 60.0;
    let corner = |i: usize| {
        let (x, y) = (at(i % n), at(i / n));
        DVec3::new(x, y, 0.02 * (x * x + y * y).min(100.0) - 0.05)
    };
    let cell = |i: usize| {
        let a = (i / cells * n + i % cells) as u32;
        let (b, c, d) = (a + 1, a + n as u32, a + n as u32 + 1);
        [[a, b, d], [a, d, c]]
    };
    let mesh = MeshAsset {
        sha256: Sha256::of(&cells.to_le_bytes()),
        vertices: (0..n * n).map(corner).collect(),
        triangles: (0..cells * cells).flat_map(cell).collect(),
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    };
    Geometry::Mesh { uri: "hills.stl".into(), scale: DVec3::ONE, asset: Some(Arc::new(mesh)) }
}
