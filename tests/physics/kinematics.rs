//! Jacobians, inertia and inverse dynamics compared with finite differences, the step itself, each other, and
//! Pinocchio.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use serde::Deserialize;
use simd_core::dynamics::integrate::advance;
use simd_core::dynamics::inverse_dynamics::{Resistance, inertia_matrix, inverse_dynamics};
use simd_core::dynamics::jacobian::jacobian;
use simd_core::dynamics::{Actuator, Articulation, Axis, Configuration, Integrator, Mode, Tree};
use simd_tests::robots;

use crate::random_robots::robot;

const ROBOTS: u64 = 100;
const ARMATURE: f64 = 1e-3;

fn vector(rng: &mut Rng) -> DVec3 {
    DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, rng.f64() - 0.5) * 2.0
}

/// Returns a random tree at a random pose, moving, as the step has it.
fn moving(rng: &mut Rng) -> Articulation {
    let mut model = robot(rng);
    // Rows of constraints change the result of a step.
    model.joints.iter_mut().for_each(|joint| joint.mimic = None);
    let tree = Arc::new(Tree::new(&model, rng.bool()));
    let mut axes = vec![Axis::default(); tree.velocity_count];
    // Enough that a massless joint has something to divide by.
    axes.iter_mut().for_each(|axis| axis.settings.armature = ARMATURE);
    let pose = DPose3::from_parts(vector(rng), DQuat::from_scaled_axis(vector(rng) * 3.0));
    let mut body = Articulation::new(Arc::clone(&tree), pose, axes, &[]);
    for at in &tree.bodies {
        let q = &mut body.positions_mut()[at.position..];
        match at.joint_type.positions() {
            7 if at.joint.is_none() => {}
            7 => {
                q[..3].copy_from_slice(&vector(rng).to_array());
                q[3..7].copy_from_slice(&DQuat::from_scaled_axis(vector(rng) * 3.0).to_array());
            }
            4 => q[..4].copy_from_slice(&DQuat::from_scaled_axis(vector(rng) * 3.0).to_array()),
            // The first axis of a ball joint has the position of all.
            0 => {}
            _ => q[0] = 2.0 * rng.f64() - 1.0,
        }
    }
    body.velocities_mut().iter_mut().for_each(|velocity| *velocity = 2.0 * rng.f64() - 1.0);
    body
}

fn seen(body: &Articulation) -> Configuration {
    let (linear, angular) = body.root_twist();
    Configuration {
        root: body.root_pose(),
        linear,
        angular,
        positions: body.positions()[body.tree().root_positions()..].to_vec(),
        velocities: body.velocities()[body.tree().root_velocities()..].to_vec(),
    }
}

/// Returns velocities in the convention of `Configuration`: a free root's angular entries in world axes.
fn in_world_axes(body: &Articulation, values: &[f64]) -> Vec<f64> {
    let mut out = values.to_vec();
    if !body.tree().fixed_base {
        let turned = body.root_pose().rotation * DVec3::new(out[3], out[4], out[5]);
        out[3..6].copy_from_slice(&turned.to_array());
    }
    out
}

/// Central differences of link poses along the velocities have an error of second order. It is about 1e-10 of
/// a metre a second for a step of 1e-5, and rounding has the same size.
#[test]
fn twists_and_jacobians_are_what_link_poses_change_by() {
    let mut worst = 0.0f64;
    for seed in 0..ROBOTS {
        let rng = &mut Rng::with_seed(seed);
        let body = moving(rng);
        let (tree, here) = (Arc::clone(body.tree()), seen(&body));
        let h = 1e-5;
        let beside = |sign: f64| {
            let mut body = Articulation::with_state(Arc::clone(body.tree()), body.state().clone());
            let velocities = body.velocities().to_vec();
            advance(&tree, body.positions_mut(), &velocities, sign * h);
            let there = seen(&body);
            tree.link_poses(there.root, &there.positions)
        };
        let (before, after) = (beside(-1.0), beside(1.0));
        let twists = tree.link_twists(&here);
        let velocities = in_world_axes(&body, body.velocities());
        for (link, (linear, angular)) in twists.into_iter().enumerate() {
            let (a, b) = (before[link], after[link]);
            let turned = (b.rotation * a.rotation.inverse()).to_scaled_axis() / (2.0 * h);
            let moved = (b.translation - a.translation) / (2.0 * h);
            let error = (moved - linear).length() + (turned - angular).length();
            worst = worst.max(error / (1.0 + linear.length() + angular.length()));

            // The Jacobian times the velocities is the same, at the origin and at any point.
            let point = vector(rng);
            let columns = jacobian(&tree, &here, link, point);
            let sum = |part: fn(&simd_core::dynamics::spatial::Spatial) -> DVec3| {
                columns
                    .iter()
                    .zip(&velocities)
                    .map(|(column, velocity)| part(column) * *velocity)
                    .sum::<DVec3>()
            };
            let pose = tree.link_poses(here.root, &here.positions)[link];
            let at_point = linear + angular.cross(pose.rotation * point);
            let error = (sum(|c| c.linear) - at_point).length() + (sum(|c| c.angular) - angular).length();
            assert!(error < 1e-11 * (1.0 + at_point.length()), "seed {seed}, link {link}: {error:e}");
        }
    }
    println!("largest difference {worst:.1e}");
    assert!(worst < 1e-7, "{worst:e}");
}

/// Inverse dynamics of the step's own accelerations gives back its efforts: to 1e-10 of the largest effort on
/// the path. There is no damping, which a step applies at its end.
#[test]
fn inverse_dynamics_undoes_the_step() {
    let gravity = DVec3::new(0.3, -0.2, -9.81);
    let (mut tried, mut worst) = (0, 0.0f64);
    for seed in 0..ROBOTS {
        let rng = &mut Rng::with_seed(seed);
        let mut body = moving(rng);
        let tree = Arc::clone(body.tree());
        let single = |velocity: usize| {
            tree.bodies.iter().any(|body| body.velocity == velocity && body.joint_type.velocities() == 1)
        };
        // A free massless body has no acceleration.
        let free = |index: &usize| tree.bodies[*index].joint_type.positions() == 7;
        if (0..tree.bodies.len()).filter(free).any(|index| tree.bodies[index].inertia.mass == 0.0) {
            continue;
        }
        tried += 1;
        let mut efforts = vec![0.0; tree.velocity_count];
        for velocity in (0..tree.velocity_count).filter(|velocity| single(*velocity)) {
            efforts[velocity] = rng.f64() - 0.5;
            let effort = efforts[velocity];
            body.axes_mut()[velocity].actuator =
                Actuator { mode: Mode::Effort, target: effort, ..Actuator::default() };
        }
        let (here, before, start) = (seen(&body), body.velocities().to_vec(), body.state().clone());
        let start = Articulation::with_state(Arc::clone(&tree), start);
        let h = 0.125;
        body.step(gravity, h, Integrator::Euler);
        let accelerations: Vec<f64> =
            body.velocities().iter().zip(&before).map(|(a, b)| (a - b) / h).collect();
        let accelerations = in_world_axes(&start, &accelerations);
        let armature = |velocity| if single(velocity) { ARMATURE } else { 0.0 };
        let resistance: Vec<Resistance> = (0..tree.velocity_count)
            .map(|velocity| Resistance { armature: armature(velocity), ..Resistance::default() })
            .collect();
        let found = inverse_dynamics(&tree, &here, gravity, &accelerations, &resistance);
        let terms = accelerations.iter().map(|a| a.abs()).fold(1.0, f64::max);
        for (velocity, (found, expected)) in found.iter().zip(&efforts).enumerate() {
            let error = (found - expected).abs() / terms;
            worst = worst.max(error);
            assert!(error < 1e-10, "seed {seed}, velocity {velocity}: {found} and {expected}");
        }
    }
    println!("{tried} robots, largest difference {worst:.1e}");
    assert!(tried > 30);
}

/// A column of M is the result of inverse dynamics for a unit of acceleration, at rest and without gravity.
#[test]
fn the_mass_matrix_has_a_column_for_each_unit_of_acceleration() {
    for seed in 0..ROBOTS {
        let rng = &mut Rng::with_seed(seed);
        let body = moving(rng);
        let (tree, here) = (body.tree(), seen(&body));
        let here = Configuration::at(here.root, here.positions);
        let n = tree.velocity_count;
        let resistance = vec![Resistance { armature: 0.25, damping: 9.0, ..Resistance::default() }; n];
        let matrix = inertia_matrix(tree, &here, &resistance);
        let largest = matrix.iter().fold(0.0f64, |largest, value| largest.max(value.abs()));
        for column in 0..n {
            let mut unit = vec![0.0; n];
            unit[column] = 1.0;
            let efforts = inverse_dynamics(tree, &here, DVec3::ZERO, &unit, &resistance);
            for (row, effort) in efforts.into_iter().enumerate() {
                let value = matrix[row * n + column];
                assert!((value - effort).abs() < 1e-12 * largest, "seed {seed}: {row}, {column}");
                assert_eq!(value, matrix[column * n + row], "seed {seed}: not symmetric");
            }
        }
    }
}

/// The torque that holds the test arm, by its mass and centre of mass.
#[test]
fn gravity_alone_asks_for_the_torque_of_the_closed_form() {
    let (model, _) = robots::read("Bench_Arm-1.2 rev B/urdf/Bench_Arm-1.2 rev B.urdf");
    let tree = Tree::new(&model, true);
    for q in [-1.0, 0.0, 0.5, 2.0] {
        let here = Configuration::at(DPose3::IDENTITY, vec![q]);
        let torque = inverse_dynamics(&tree, &here, DVec3::new(0.0, 0.0, -9.81), &[], &[])[0];
        let expected = -0.3255029 * (q - 0.039919f64).cos();
        assert!((torque - expected).abs() < 1e-6, "{torque} and {expected}");
    }
}

#[derive(Deserialize)]
struct Reference {
    cases: Vec<Case>,
}

#[derive(Deserialize)]
struct Case {
    name: String,
    urdf: String,
    link: String,
    free: bool,
    /// The order in which Pinocchio has them.
    joints: Vec<String>,
    root: Vec<f64>,
    root_twist: Vec<f64>,
    gravity: [f64; 3],
    positions: Vec<f64>,
    velocities: Vec<f64>,
    accelerations: Vec<f64>,
    link_twist: Vec<f64>,
    jacobian: Vec<f64>,
    mass_matrix: Vec<f64>,
    efforts: Vec<f64>,
}

/// The figures are in `tests/reference/kinematics.json`, with the script that made them. Both codes do the
/// same sums in another order, of terms up to some hundred: 1e-9 is generous.
#[test]
fn jacobians_mass_matrices_and_inverse_dynamics_equal_pinocchios() {
    let reference: Reference = serde_json::from_str(include_str!("../reference/kinematics.json")).unwrap();
    assert!(reference.cases.len() > 3);
    for case in &reference.cases {
        let (model, _) = robots::read(&case.urdf);
        let tree = Tree::new(&model, !case.free);
        let root = tree.root_velocities();
        let n = tree.velocity_count;
        // For each of our velocities, its index among Pinocchio's.
        let index_of = |name: &str| case.joints.iter().position(|joint| joint == name).unwrap();
        let joints: Vec<usize> =
            tree.bodies.iter().filter_map(|body| Some(index_of(&model.joints[body.joint?].name))).collect();
        let order: Vec<usize> = (0..root).chain(joints.iter().map(|index| root + index)).collect();
        let sorted = |values: &[f64]| joints.iter().map(|&index| values[index]).collect::<Vec<_>>();
        let three = |values: &[f64]| DVec3::new(values[0], values[1], values[2]);
        let mut here = Configuration::at(DPose3::IDENTITY, sorted(&case.positions));
        here.velocities = sorted(&case.velocities);
        if case.free {
            let rotation = DQuat::from_slice(&case.root[3..]);
            here.root = DPose3::from_parts(three(&case.root), rotation);
            (here.linear, here.angular) = (three(&case.root_twist), three(&case.root_twist[3..]));
        }
        let mut worst = 0.0f64;
        let mut compare = |ours: f64, theirs: f64| worst = worst.max((ours - theirs).abs());

        let link = model.links.iter().position(|link| link.name == case.link).unwrap();
        let (linear, angular) = tree.link_twists(&here)[link];
        for (ours, theirs) in linear.to_array().into_iter().chain(angular.to_array()).zip(&case.link_twist) {
            compare(ours, *theirs);
        }
        for (velocity, column) in jacobian(&tree, &here, link, DVec3::ZERO).into_iter().enumerate() {
            let rows = column.linear.to_array().into_iter().chain(column.angular.to_array());
            rows.enumerate().for_each(|(row, ours)| compare(ours, case.jacobian[row * n + order[velocity]]));
        }
        let matrix = inertia_matrix(&tree, &here, &[]);
        let accelerations: Vec<f64> = order.iter().map(|&index| case.accelerations[index]).collect();
        let gravity = DVec3::from(case.gravity);
        let efforts = inverse_dynamics(&tree, &here, gravity, &accelerations, &[]);
        for row in 0..n {
            compare(efforts[row], case.efforts[order[row]]);
            for column in 0..n {
                compare(matrix[row * n + column], case.mass_matrix[order[row] * n + order[column]]);
            }
        }
        println!("{}: {n} velocities, largest difference {worst:.1e}", case.name);
        assert!(worst < 1e-9, "{}: {worst:e}", case.name);
    }
}
