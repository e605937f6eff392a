//! Energy of a swinging robot.

use std::sync::Arc;

use simd_core::dynamics::mass_matrix::mass_matrix;
use simd_core::{Command, PublishedState};
use simd_model::RobotModel;
use simd_model::robot::JointLimits;
use simd_tests::robots;

use crate::chains::chain;
use crate::closed_forms::met;
use simd_tests::world::{apply, euler, leapfrog, look, passive};

/// Kinetic energy qd' M qd / 2 and potential energy m g z, joules; fixed base only.
pub(crate) fn energy(model: &RobotModel, seen: &PublishedState) -> f64 {
    let tree = &seen.world.entities[0].tree;
    let n = tree.velocity_count;
    let matrix = mass_matrix(tree, &seen.positions);
    let qd = &seen.velocities;
    let kinetic: f64 = (0..n * n).map(|i| qd[i / n] * matrix[i] * qd[i % n]).sum::<f64>() / 2.0;
    kinetic + potential(model, seen)
}

/// m g z, joules.
fn potential(model: &RobotModel, seen: &PublishedState) -> f64 {
    let poses = seen.link_poses(0).unwrap();
    let heights = model.links.iter().zip(&poses);
    heights
        .map(|(link, pose)| {
            let center = pose.transform_point(link.inertial.center_of_mass);
            link.inertial.mass * 9.81 * center.z
        })
        .sum()
}

/// Semi-implicit Euler is symplectic: the energy of an undamped double pendulum oscillates with the time step
/// and does not drift away. The requirement is 1 % of the energy above its lowest point over 10 s at 0.1 ms.
#[test]
fn an_undamped_double_pendulum_keeps_its_energy() {
    let model = Arc::new(chain(2));
    let mut world = euler(1e-4);
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

/// Released at rest, a double pendulum from near level and the seven-joint arm swing for a minute at 1 ms.
/// Leapfrog loses or gains less than this part of the energy above the lowest point of a swing. `make truth`
/// has MuJoCo's figures of the same swings (`swings` in `tests/reference/cases.py`) beside these.
#[test]
fn a_minute_of_leapfrog_keeps_the_energy() {
    let pendulum = ("double pendulum", "../reference/robots/double_pendulum.urdf", vec![0.0, 0.5], 1e-3);
    let bent = vec![0.3, -0.5, 0.7, -1.1, 0.2, 0.9, -0.4];
    let arm = ("seven_arm", "seven_arm/urdf/seven_arm.urdf", bent, 1e-2);
    for (name, urdf, start, most) in [pendulum, arm] {
        let mut model = (*robots::read(urdf).0).clone();
        for joint in &mut model.joints {
            (joint.damping, joint.friction, joint.limits) = (0.0, 0.0, JointLimits::default());
        }
        let model = Arc::new(model);
        let mut world = leapfrog(1e-3);
        apply(&mut world, Command::Spawn(Box::new(passive(&model, false, &start))));
        let first = energy(&model, &look(&world));
        let (mut lowest, mut worst) = (first, 0.0f64);
        for _ in 0..600 {
            (0..100).for_each(|_| world.step());
            let seen = look(&world);
            worst = worst.max((energy(&model, &seen) - first).abs());
            lowest = lowest.min(potential(&model, &seen));
        }
        let part = worst / (first - lowest);
        println!("{name}: {worst:.2e} J, {part:.2e} of {:.3} J", first - lowest);
        let form = format!("energy over a minute, {name}: largest change, of that above the lowest point");
        met(&form, 1e-3, 0.0, part, most);
    }
}
