//! Properties of every robot and every command.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DQuat, DVec3};
use simd_core::dynamics::mass_matrix::mass_matrix;
use simd_core::dynamics::{Articulation, Axis, Tree};
use simd_core::simulation::EventKind;
use simd_core::{Command, Integrator, Simulation};

use crate::random_robots::{command, robot, spawn};
use simd_tests::world::{apply, look, world};

const ROBOTS: u64 = 150;

/// A refusal changes nothing, to the bit. After an accepted command, every number that a client sees is
/// finite. A physically impossible robot (all of it massless, say) may be disabled, but never causes a NaN.
#[test]
fn random_robots_under_random_commands_stay_finite_and_refusals_change_nothing() {
    let (mut refused, mut accepted, mut disabled) = (0, 0, 0);
    for seed in 0..ROBOTS {
        let rng = &mut Rng::with_seed(seed);
        let mut world = world([1e-4, 1e-3, 4e-3][rng.usize(0..3)]);
        apply(&mut world, Command::Spawn(Box::new(spawn(rng, "random"))));
        let model = Arc::clone(&world.layout().entities[0].model);
        for _ in 0..60 {
            let before = world.fingerprint();
            match world.apply(&command(rng, "random", &model)) {
                Ok(_) => accepted += 1,
                Err(_) => {
                    refused += 1;
                    assert_eq!(world.fingerprint(), before, "seed {seed}");
                }
            }
            for _ in 0..5 {
                world.step();
            }
            let seen = look(&world);
            let numbers = [&seen.positions, &seen.velocities, &seen.efforts, &seen.targets];
            let finite = numbers.into_iter().flatten().all(|value| value.is_finite());
            assert!(finite && seen.roots[0].pose.is_finite(), "seed {seed}: {:?}", seen.roots[0]);
        }
        let events = world.take_events();
        disabled += events.iter().filter(|e| matches!(e.kind, EventKind::EntityDisabled { .. })).count();
    }
    println!("{accepted} accepted, {refused} refused, {disabled} robots disabled");
    assert!(refused > 500 && accepted > 2000);
}

/// `M M^-1 J' = J'`: one backward and one forward pass over the tree give the same response to an impulse as
/// the dense matrix. The tolerance allows for the condition of M, whose links differ by a thousand in mass.
#[test]
fn the_response_to_an_impulse_is_that_of_the_dense_mass_matrix() {
    let mut worst = 0.0f64;
    for seed in 0..ROBOTS {
        let rng = &mut Rng::with_seed(seed);
        let mut model = robot(rng);
        // A mimic row would move the robot, but the step must leave it in place.
        model.joints.iter_mut().for_each(|joint| joint.mimic = None);
        let tree = Arc::new(Tree::new(&model, rng.bool()));
        let n = tree.velocity_count;
        let mut axes = vec![Axis::default(); n];
        for axis in &mut axes {
            // Enough that a massless joint has something to divide by.
            axis.settings.armature = 1e-3;
            axis.settings.damping = rng.f64();
        }
        let mut q = vec![0.0; tree.position_count];
        for body in &tree.bodies {
            match body.joint_type.positions() {
                7 => q[body.position + 6] = 1.0,
                4 => {
                    let turn = DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 3.0;
                    let orientation = DQuat::from_scaled_axis(turn).to_array();
                    q[body.position..body.position + 4].copy_from_slice(&orientation);
                }
                0 => {}
                _ => q[body.position] = rng.f64() - 0.5,
            }
        }
        // A free body without mass has no inverse.
        let massless = |i: usize| tree.bodies[i].joint_type.positions() == 7 && !carries(&tree, i);
        if (0..tree.bodies.len()).any(massless) {
            continue;
        }
        let root = tree.root_positions();
        let pose = glamx::DPose3::IDENTITY;
        let mut body = Articulation::new(Arc::clone(&tree), pose, axes, &q[root..]);
        let positions = body.positions().to_vec();
        body.step(glamx::DVec3::ZERO, 1e-3, [Integrator::Leapfrog, Integrator::Euler][rng.usize(0..2)]);
        let mut matrix = mass_matrix(&tree, &positions);
        for (i, resistance) in body.resistance(1e-3).into_iter().enumerate() {
            let free = tree
                .bodies
                .iter()
                .any(|b| b.velocity <= i && i < b.velocity + 6 && b.joint_type.velocities() == 6);
            matrix[i * n + i] += if free { 0.0 } else { resistance };
        }
        for (index, moving) in tree.bodies.iter().enumerate().filter(|(_, b)| b.joint_type.velocities() == 1)
        {
            let response = body.response(index);
            for row in 0..n {
                let product: f64 = (0..n).map(|k| matrix[row * n + k] * response[k]).sum();
                let size: f64 = (0..n).map(|k| (matrix[row * n + k] * response[k]).abs()).sum();
                let expected = f64::from(row == moving.velocity);
                let error = (product - expected).abs() / size.max(1.0);
                worst = worst.max(error);
                assert!(error < 1e-8, "seed {seed}, body {index}, row {row}: {product}");
            }
        }
    }
    println!("largest relative error {worst:.1e}");
}

/// Returns whether a body, or one that hangs on it without a free joint between, has inertia in all
/// directions.
fn carries(tree: &Tree, body: usize) -> bool {
    (body..tree.bodies.len()).any(|i| {
        let mut at = i;
        while at != body && tree.bodies[at].joint_type.positions() != 7 {
            match tree.bodies[at].parent {
                Some(parent) => at = parent,
                None => return false,
            }
        }
        at == body
            && tree.bodies[i].inertia.mass > 0.0
            && tree.bodies[i].inertia.moment.matrix().determinant() > 0.0
    })
}

/// Equal inputs, equal bits: two worlds given the same commands.
#[test]
fn equal_inputs_give_equal_bits() {
    let play = |seed: u64| -> (u64, Simulation) {
        let rng = &mut Rng::with_seed(seed);
        let mut world = world(1e-3);
        apply(&mut world, Command::Spawn(Box::new(spawn(rng, "random"))));
        let model = Arc::clone(&world.layout().entities[0].model);
        for _ in 0..100 {
            let _ = world.apply(&command(rng, "random", &model));
            world.step();
        }
        (world.fingerprint(), world)
    };
    for seed in 0..20 {
        assert_eq!(play(seed).0, play(seed).0, "seed {seed}");
    }
}
