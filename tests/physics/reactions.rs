//! Joint reactions, compared with Newton's and Euler's equations and with the step.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::dynamics::reactions::{Motion, joint_reactions};
use simd_core::dynamics::spatial::Spatial;
use simd_core::dynamics::tree::JointType;
use simd_core::dynamics::{Articulation, Axis, Integrator, Tree};
use simd_core::simulation::command::{LinkWrench, Spawn, WrenchDuration};
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::JointKind;

use crate::chains::chain;
use crate::random_robots::robot;
use simd_tests::world::{apply, look, passive, run, world};

const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);

/// Positions and velocities of a robot with one position to each velocity.
fn reactions(
    model: &RobotModel,
    positions: &[f64],
    velocities: &[f64],
    external: &[(usize, Spatial)],
) -> Vec<Spatial> {
    let tree = Tree::new(model, true);
    let still = vec![0.0; velocities.len()];
    let motion = Motion { positions, velocities, accelerations: &still };
    joint_reactions(model, &tree, motion, GRAVITY, external)
}

/// Two rods of 1 kg and 1 m, level and at rest. The first joint carries 2 g at a lever of 1 m, the second g
/// at half a metre. The axis is y, and the force points up. Exact except for rounding.
#[test]
fn joints_at_rest_carry_the_weight_of_what_hangs_on_them() {
    let mut model = chain(2);
    for second in [JointKind::Continuous, JointKind::Fixed] {
        model.joints[1].kind = second;
        let velocities = if second == JointKind::Fixed { 1 } else { 2 };
        let carried = reactions(&model, &vec![0.0; velocities], &vec![0.0; velocities], &[]);
        for (carried, (mass, lever)) in carried.iter().zip([(2.0, 1.0), (1.0, 0.5)]) {
            let weight = mass * 9.81;
            assert!((carried.linear - DVec3::Z * weight).length() < 1e-12, "{carried:?}");
            assert!((carried.angular - DVec3::Y * -weight * lever).length() < 1e-12, "{carried:?}");
        }
    }
}

/// A rod that turns at w without being accelerated is pulled to the middle: m w^2 r.
#[test]
fn a_turning_rod_pulls_at_its_joint() {
    let model = chain(1);
    let carried = reactions(&model, &[0.0], &[3.0], &[])[0];
    let expected = DVec3::new(-9.0 * 0.5, 0.0, 9.81);
    assert!((carried.linear - expected).length() < 1e-12, "{carried:?}");
}

/// The joint is relieved of a push on the link from outside.
#[test]
fn an_applied_wrench_relieves_the_joint() {
    let model = chain(1);
    // The weight of the rod at its middle, half a metre from the link's origin.
    let push = Spatial::new(DVec3::new(0.5, 0.0, 0.0).cross(DVec3::Z * 9.81), DVec3::Z * 9.81);
    let carried = reactions(&model, &[0.0], &[0.0], &[(1, push)])[0];
    assert!(carried.linear.length() < 1e-12 && carried.angular.length() < 1e-12, "{carried:?}");
}

/// An undriven joint carries nothing along its axis, in any motion. The accelerations are those of a step,
/// which come from the articulated-body algorithm. Random trees, fixed and free; relative to the whole
/// reaction of the joint, to rounding.
#[test]
fn passive_joints_carry_nothing_along_their_axes() {
    let h = 1e-3;
    let mut checked = 0;
    for seed in 0..150 {
        let rng = &mut Rng::with_seed(seed);
        let mut model = robot(rng);
        for joint in &mut model.joints {
            joint.mimic = None;
            joint.limits = Default::default();
            (joint.damping, joint.friction) = (0.0, 0.0);
        }
        // With massless parts a passive tree has no accelerations.
        for link in &mut model.links {
            link.inertial.mass += 0.5;
            link.inertial.inertia += glamx::DMat3::from_diagonal(DVec3::splat(0.01));
        }
        let tree = Arc::new(Tree::new(&model, rng.bool()));
        let n = tree.velocity_count;
        let turned = DQuat::from_rotation_x(0.7) * DQuat::from_rotation_z(0.3);
        let root = DPose3::from_parts(DVec3::new(0.1, 0.2, 0.3), turned);
        let mut body = Articulation::new(Arc::clone(&tree), root, vec![Axis::default(); n], &[]);
        for part in &tree.bodies {
            match part.joint_type {
                JointType::Free { .. } if part.joint.is_some() => {
                    body.positions_mut()[part.position + 6] = 1.0
                }
                JointType::Free { .. } => {}
                JointType::Spherical { axis: 0 } => {
                    let orientation = DQuat::from_rotation_y(rng.f64()) * DQuat::from_rotation_z(rng.f64());
                    body.positions_mut()[part.position..part.position + 4]
                        .copy_from_slice(&orientation.to_array());
                }
                JointType::Spherical { .. } => {}
                _ => body.positions_mut()[part.position] = rng.f64() - 0.5,
            }
        }
        body.velocities_mut().iter_mut().for_each(|velocity| *velocity = rng.f64() - 0.5);
        let (positions, velocities) = (body.positions().to_vec(), body.velocities().to_vec());
        body.step(GRAVITY, h, Integrator::Euler);
        let accelerations: Vec<f64> =
            body.velocities().iter().zip(&velocities).map(|(after, before)| (after - before) / h).collect();
        let motion = Motion { positions: &positions, velocities: &velocities, accelerations: &accelerations };
        let gravity = if tree.fixed_base { turned.inverse() * GRAVITY } else { GRAVITY };
        let carried = joint_reactions(&model, &tree, motion, gravity, &[]);
        for (joint, carried) in model.joints.iter().zip(&carried) {
            let along = match joint.kind {
                JointKind::Revolute | JointKind::Continuous => carried.angular.dot(joint.axis),
                JointKind::Prismatic => carried.linear.dot(joint.axis),
                JointKind::Spherical => carried.angular.length(),
                JointKind::Floating => carried.linear.length() + carried.angular.length(),
                JointKind::Planar | JointKind::Fixed => continue,
            };
            let size = carried.linear.length() + carried.angular.length();
            let most = accelerations.iter().fold(1.0f64, |most, a| most.max(a.abs()));
            assert!(along.abs() < 1e-8 * (size + most), "seed {seed}, {joint:?}: {along} of {size}");
            checked += 1;
        }
    }
    assert!(checked > 300, "{checked}");
}

fn carried(world: &Simulation, robot: &str) -> Vec<[DVec3; 2]> {
    let seen = look(world);
    let (robot, _) = seen.entity(robot).unwrap();
    seen.joint_reactions(robot, world.settings().gravity).unwrap()
}

/// Two level rods that hold their position: at rest the joints carry the links beyond them, torque included.
/// 1e-6 allows for the remaining motion of the springs after two seconds.
#[test]
fn joints_of_a_robot_that_holds_itself_carry_its_weight() {
    let mut world = world(1e-3);
    let spawn = Spawn { passive: false, ..passive(&Arc::new(chain(2)), false, &[]) };
    apply(&mut world, Command::Spawn(Box::new(spawn)));
    run(&mut world, 2.0);
    for ([force, torque], (mass, lever)) in carried(&world, "robot").into_iter().zip([(2.0, 1.0), (1.0, 0.5)])
    {
        let weight = mass * 9.81;
        assert!((force.length() - weight).abs() < 1e-6, "{force}");
        // The rods sag by less than a milliradian: the lever is shorter by its square.
        assert!((torque.y + weight * lever).abs() < 1e-4, "{torque}");
    }
}

/// The joints of a falling robot carry nothing. It is pushed at the tip with its weight, also for one step.
#[test]
fn joints_of_a_falling_robot_carry_nothing_until_it_is_pushed() {
    let mut world = world(1e-3);
    let mut model = chain(2);
    model.joints[1].kind = JointKind::Fixed;
    model.joints[0].kind = JointKind::Fixed;
    model.links[0].inertial = crate::chains::rod(1.0);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(model), true, &[]))));
    run(&mut world, 0.1);
    for [force, torque] in carried(&world, "robot") {
        assert!(force.length() < 1e-9 && torque.length() < 1e-9, "{force} {torque}");
    }
    // Along the rods: nothing turns, and each joint carries the force that moves the part beyond it.
    apply(
        &mut world,
        Command::ApplyWrench(LinkWrench {
            robot: "robot".into(),
            link: "link-2".into(),
            force: DVec3::X * 3.0,
            torque: DVec3::ZERO,
            in_link_axes: true,
            point: DVec3::ZERO,
            duration: WrenchDuration::NextStep,
        }),
    );
    world.step();
    for ([force, _], expected) in carried(&world, "robot").into_iter().zip([-1.0, -2.0]) {
        assert!((force - DVec3::X * expected).length() < 1e-9, "{force} {expected}");
    }
}
