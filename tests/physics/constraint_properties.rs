//! Effects of constraints between links of robots of any shape: the forces of the dense equations, and
//! momenta.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::dynamics::jacobian::jacobian;
use simd_core::dynamics::mass_matrix::mass_matrix;
use simd_core::dynamics::{Configuration, Tree};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PhysicsSettings, PublishedState, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, JointKind};

use crate::constraints::{held, tree, vector};
use simd_tests::world::{apply, euler, look, passive, run};

const G: f64 = 9.81;

/// Returns a passive robot with its joints anywhere.
pub(crate) fn bent(rng: &mut Rng, model: &Arc<RobotModel>, free: bool) -> Spawn {
    let mut spawn = passive(model, free, &[]);
    for joint in &model.joints {
        let name = joint.name.clone();
        if joint.kind == JointKind::Spherical {
            let orientation = DQuat::from_scaled_axis(vector(rng, 1.5));
            spawn.joint_orientations.push(JointOrientation { joint: name, orientation });
        } else {
            spawn.joint_positions.push((name, 0.3 * rng.f64()));
        }
    }
    spawn
}

/// Returns the solution of a linear system by Gauss' elimination with pivots; its columns are the right
/// sides.
pub(crate) fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let n = matrix.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| matrix[i][k].abs().total_cmp(&matrix[j][k].abs())).unwrap();
        matrix.swap(k, pivot);
        right.swap(k, pivot);
        for i in (0..n).filter(|&i| i != k) {
            let factor = matrix[i][k] / matrix[k][k];
            let pivot = matrix[k].clone();
            matrix[i].iter_mut().zip(&pivot).skip(k).for_each(|(value, pivot)| *value -= factor * pivot);
            for j in 0..right[i].len() {
                right[i][j] -= factor * right[k][j];
            }
        }
    }
    for (k, row) in right.iter_mut().enumerate() {
        row.iter_mut().for_each(|value| *value /= matrix[k][k]);
    }
    right
}

/// A point on a link is held at another link or at the world. From rest under gravity, it gets the impulse p
/// of `(J M^-1 J' + R) p = -J M^-1 f h`. J and M are dense, and R is 1e-5 of the mean of the diagonal. So J
/// M^-1 J' equals the product of the dense matrices. The step is so short that nothing leaves its tangent.
#[test]
fn a_constraint_has_the_force_of_the_dense_equations() {
    let (mut compared, mut worst, h) = (0, 0.0f64, 1e-4);
    for seed in 0..400 {
        let rng = &mut Rng::with_seed(seed);
        let model = tree(rng);
        let mut world = euler(h);
        let spawn = bent(rng, &model, false);
        apply(&mut world, Command::Spawn(Box::new(spawn)));
        let seen = look(&world);
        let (poses, robot) = (seen.link_poses(0).unwrap(), Tree::new(&model, true));
        let n = robot.velocity_count;
        let last = model.links.len() - 1;
        if n < 4 {
            continue;
        }
        let other = rng.usize(0..last);
        let place = poses[other].transform_point(vector(rng, 0.2));
        let of = |link: usize| {
            let pose = Some(DPose3::from_translation(poses[link].inverse_transform_point(place)));
            RequestedEnd { robot: "robot".into(), link: format!("link-{link}"), pose, ..Default::default() }
        };
        let create = held(RequestedConstraint::PointToPoint, of(other), of(last));
        apply(&mut world, Command::CreateConstraint(Box::new(create)));

        let now = Configuration::at(DPose3::IDENTITY, seen.positions.clone());
        let columns = |link: usize, at: DVec3| -> Vec<DVec3> {
            let point = poses[link].inverse_transform_point(at);
            jacobian(&robot, &now, link, point).into_iter().map(|column| column.linear).collect()
        };
        let rows: Vec<DVec3> =
            columns(last, place).into_iter().zip(columns(other, place)).map(|(b, a)| b - a).collect();
        let mut force = vec![0.0; n];
        for (link, pose) in poses.iter().enumerate() {
            let Inertial { mass, center_of_mass, .. } = model.links[link].inertial;
            let lifted = columns(link, pose.transform_point(center_of_mass));
            force.iter_mut().zip(lifted).for_each(|(force, column)| *force -= mass * G * column.z);
        }
        let dense = mass_matrix(&robot, &seen.positions);
        let matrix: Vec<Vec<f64>> = dense.chunks(n).map(<[f64]>::to_vec).collect();
        // M^-1 of J' and of the forces.
        let right = (0..n).map(|i| vec![rows[i].x, rows[i].y, rows[i].z, force[i]]).collect();
        let solved = solve(matrix, right);
        let mut effect = DMat3::ZERO;
        let mut free = DVec3::ZERO;
        for (row, solved) in rows.iter().zip(&solved) {
            let response = DVec3::new(solved[0], solved[1], solved[2]);
            effect += DMat3::from_cols(*row * response.x, *row * response.y, *row * response.z);
            free += *row * solved[3];
        }
        let trace = effect.x_axis.x + effect.y_axis.y + effect.z_axis.z;
        // Directions in which hardly anything moves have no row.
        if effect.determinant() < 1e-6 * trace * trace * trace {
            continue;
        }
        let softened = effect + DMat3::from_diagonal(DVec3::splat(1e-5 * trace / 3.0));
        let expected = -(softened.inverse() * free);
        world.step();
        let seen = look(&world).constraint_states[0];
        let error = (seen.force - expected).length() / expected.length();
        worst = worst.max(error);
        assert!(error < 1e-7, "{seed}: {} {expected} {error:e}", seen.force);
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}

/// Momentum, angular momentum about the world's origin, and the sums of their sizes.
pub(crate) fn momenta(state: &PublishedState) -> ([DVec3; 2], [f64; 2]) {
    let (mut sums, mut sizes) = ([DVec3::ZERO; 2], [0.0; 2]);
    for (index, entity) in state.world.entities.iter().enumerate() {
        let (poses, twists) = (state.link_poses(index).unwrap(), state.link_twists(index).unwrap());
        for ((link, pose), (linear, angular)) in entity.model.links.iter().zip(poses).zip(twists) {
            let Inertial { mass, center_of_mass, inertia } = link.inertial;
            let arm = pose.rotation * center_of_mass;
            let momentum = mass * (linear + angular.cross(arm));
            let spin = pose.rotation * (inertia * (pose.rotation.inverse() * angular));
            let turning = spin + (pose.translation + arm).cross(momentum);
            for (k, part) in [momentum, turning].into_iter().enumerate() {
                sums[k] += part;
                sizes[k] += part.length();
            }
        }
    }
    (sums, sizes)
}

fn world_without_gravity(integrator: Integrator) -> Simulation {
    let settings =
        PhysicsSettings { time_step: 1e-3, integrator, gravity: DVec3::ZERO, ..PhysicsSettings::default() };
    Simulation::new(settings, WorldLimits::default())
}

/// Free bodies with random twists, held together in a ring, are released one constraint after the other. The
/// command does not change their motion, and the steps around it keep momenta. Trees keep them as well as
/// robots with joints do.
#[test]
fn letting_go_leaves_momenta_as_they_were() {
    for (joints, most) in [(false, [1e-13, 2e-6, 1e-8]), (true, [5e-3, 5e-3, 1e-3])] {
        let found = let_go(joints);
        assert!(found.iter().zip(most).all(|(found, most)| *found < most), "{found:?}");
    }
}

/// Returns the changes of linear and angular momentum, as parts of the sums of their magnitudes, and both in
/// the step after.
fn let_go(joints: bool) -> [f64; 3] {
    let (mut linear, mut angular, mut at_once) = (0.0f64, 0.0f64, 0.0f64);
    for seed in 0..40 {
        let rng = &mut Rng::with_seed(seed);
        let mut world = world_without_gravity(Integrator::Leapfrog);
        let count = rng.usize(2..=4);
        for number in 0..count {
            let fits = |model: &Arc<RobotModel>| joints || model.joints.is_empty();
            let model = std::iter::repeat_with(|| tree(rng)).find(fits).unwrap();
            let pose = DPose3::from_parts(vector(rng, 0.5), DQuat::from_scaled_axis(vector(rng, 3.0)));
            let name = format!("robot-{number}");
            let spawn = Spawn { name: name.clone(), pose, ..bent(rng, &model, true) };
            apply(&mut world, Command::Spawn(Box::new(spawn)));
            let twist = Some((vector(rng, 0.5), vector(rng, 1.0)));
            apply(&mut world, Command::SetEntityState { robot: name, pose: None, twist });
        }
        for number in 0..count {
            let kind = match number % 5 {
                0 => RequestedConstraint::PointToPoint,
                1 => RequestedConstraint::Weld,
                2 => RequestedConstraint::Hinge { axis: DVec3::Y },
                3 => RequestedConstraint::Slide { axis: DVec3::Z },
                _ => RequestedConstraint::Distance { length: None, is_rope: false },
            };
            let end = |number: usize| RequestedEnd {
                robot: format!("robot-{}", number % count),
                ..RequestedEnd::default()
            };
            apply(&mut world, Command::CreateConstraint(Box::new(held(kind, end(number), end(number + 1)))));
        }
        let (before, sizes) = momenta(&look(&world));
        for name in look(&world).constraints.iter().map(|of| of.name.clone()) {
            run(&mut world, 0.1);
            let held = momenta(&look(&world)).0;
            apply(&mut world, Command::DeleteConstraint { name });
            assert_eq!(momenta(&look(&world)).0, held, "{seed}: the command itself");
            world.step();
            let after = momenta(&look(&world)).0;
            at_once = at_once.max((after[0] - held[0]).length() / sizes[0]);
            at_once = at_once.max((after[1] - held[1]).length() / sizes[1]);
        }
        let (after, _) = momenta(&run(&mut world, 0.1));
        linear = linear.max((after[0] - before[0]).length() / sizes[0]);
        angular = angular.max((after[1] - before[1]).length() / sizes[1]);
    }
    [linear, angular, at_once]
}
