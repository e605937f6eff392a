//! What a swinging robot keeps.

use std::sync::Arc;

use simd_core::dynamics::mass_matrix::mass_matrix;
use simd_core::{Command, PublishedState};
use simd_model::RobotModel;

use crate::chains::chain;
use crate::world::{apply, look, passive, world};

/// Kinetic energy qd' M qd / 2 and potential energy m g z, joules; fixed base only.
fn energy(model: &RobotModel, seen: &PublishedState) -> f64 {
    let tree = &seen.world.entities[0].tree;
    let n = tree.velocity_count;
    let matrix = mass_matrix(tree, &seen.positions);
    let qd = &seen.velocities;
    let kinetic: f64 = (0..n * n).map(|i| qd[i / n] * matrix[i] * qd[i % n]).sum::<f64>() / 2.0;
    let poses = seen.link_poses(0).unwrap();
    let heights = model.links.iter().zip(&poses);
    let potential: f64 = heights
        .map(|(link, pose)| {
            let center = pose.transform_point(link.inertial.center_of_mass);
            link.inertial.mass * 9.81 * center.z
        })
        .sum();
    kinetic + potential
}

/// Semi-implicit Euler is symplectic: the energy of an undamped double pendulum
/// oscillates with the time step and does not run away. 1 % of the energy above its
/// lowest point over 10 s at 0.1 ms is what was asked.
#[test]
fn an_undamped_double_pendulum_keeps_its_energy() {
    let model = Arc::new(chain(2));
    let mut world = world(1e-4);
    apply(&mut world, Command::Spawn(Box::new(passive(&model, false, &[0.0, 0.5]))));
    let start = energy(&model, &look(&world));
    // Hanging straight down: centres at 0.5 and 1.5 m below the base.
    let above_lowest = start + 9.81 * (0.5 + 1.5);
    let mut worst = 0.0f64;
    for _ in 0..1000 {
        for _ in 0..100 {
            world.step();
        }
        worst = worst.max((energy(&model, &look(&world)) - start).abs());
    }
    println!("largest drift {:.3} % of {above_lowest:.3} J", 100.0 * worst / above_lowest);
    assert!(worst < 0.01 * above_lowest, "{worst}");
}
