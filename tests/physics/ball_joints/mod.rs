//! Ball joints compared with closed forms, conserved quantities, and smaller steps.

mod driven;
mod mujoco;
mod trees;

use std::sync::Arc;

use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::dynamics::mass_matrix::mass_matrix;
use simd_core::dynamics::spherical::{orientation, rotation_vector, turn, write_orientation};
use simd_core::dynamics::{Articulation, Axis, Integrator, Tree};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Joint, JointKind, JointLimits, Link};

const GRAVITY: DVec3 = DVec3::new(0.0, 0.0, -9.81);
const BOTH: [Integrator; 2] = [Integrator::Euler, Integrator::Leapfrog];

/// Returns a link on a ball joint at the origin of a link that has no mass.
fn pendulum(inertial: Inertial) -> RobotModel {
    let link = |name: &str, inertial| Link {
        name: name.into(),
        inertial,
        visuals: Vec::new(),
        collisions: Vec::new(),
    };
    RobotModel {
        name: "pendulum".into(),
        links: vec![link("base", Inertial::ZERO), link("bob", inertial)],
        joints: vec![Joint {
            name: "ball".into(),
            kind: JointKind::Spherical,
            parent: 0,
            child: 1,
            parent_from_joint: DPose3::IDENTITY,
            axis: DVec3::X,
            limits: JointLimits::default(),
            damping: 0.0,
            friction: 0.0,
            mimic: None,
        }],
        ..RobotModel::default()
    }
}

fn fixed(model: &RobotModel) -> Articulation {
    let tree = Arc::new(Tree::new(model, true));
    let axes = vec![Axis::default(); tree.velocity_count];
    Articulation::new(tree, DPose3::IDENTITY, axes, &[0.0, 0.0, 0.0, 1.0])
}

fn put(body: &mut Articulation, place: DQuat, velocity: DVec3) {
    write_orientation(body.positions_mut(), place);
    body.velocities_mut().copy_from_slice(&velocity.to_array());
}

fn kinetic(body: &Articulation) -> f64 {
    let (matrix, v) = (mass_matrix(body.tree(), body.positions()), body.velocities());
    let n = v.len();
    (0..n * n).map(|i| v[i / n] * matrix[i] * v[i % n]).sum::<f64>() / 2.0
}

/// Returns a rod with a disc, symmetric about z, below its joint.
fn symmetric(side: f64, spin: f64) -> Inertial {
    Inertial {
        mass: 1.5,
        center_of_mass: DVec3::new(0.0, 0.0, -0.4),
        inertia: DMat3::from_diagonal(DVec3::new(side, side, spin)),
    }
}

/// A rigid pendulum that moves on a cone: `W^2 = m g l / ((I1 - I3) cos(lean))` about the vertical, moments
/// about the joint (Goldstein, Classical Mechanics, 5.7 without spin). In the child's axes nothing changes,
/// so that both integrators are exact.
#[test]
fn a_conical_pendulum_goes_round_at_the_velocity_of_the_closed_form() {
    let (lean, side, spin) = (0.7f64, 0.05, 0.02);
    let inertial = symmetric(side, spin);
    let about_joint = side + inertial.mass * 0.16 - spin;
    let velocity = (inertial.mass * 9.81 * 0.4 / (about_joint * lean.cos())).sqrt();
    let start = DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(lean);
    for integrator in BOTH {
        let mut body = fixed(&pendulum(inertial));
        put(&mut body, start, start.inverse() * (DVec3::Z * velocity));
        for step in 1..=4_000u32 {
            body.step(GRAVITY, 1e-3, integrator);
            let expected = DQuat::from_rotation_z(velocity * f64::from(step) * 1e-3) * start;
            let off = rotation_vector(expected.inverse() * orientation(body.positions())).length();
            assert!(off < 1e-11, "{integrator:?}: {off:e}");
        }
    }
}

/// A body that turns freely about its centre on a ball joint, up to half a radian a step. It keeps its energy
/// and, in the world, its angular momentum over five seconds, with an error of second order.
#[test]
fn a_body_that_spins_fast_on_its_joint_keeps_its_energy() {
    let moments = DVec3::new(0.02, 0.03, 0.045);
    let inertial =
        Inertial { mass: 1.0, center_of_mass: DVec3::ZERO, inertia: DMat3::from_diagonal(moments) };
    for (spin, most) in [(5.0, 1e-5), (60.0, 2e-3), (500.0, 5e-2)] {
        let mut body = fixed(&pendulum(inertial));
        put(&mut body, turn(DVec3::new(0.2, -0.4, 1.0)), DVec3::new(0.3, 1.0, 0.2).normalize() * spin);
        let first = kinetic(&body);
        let momentum = |body: &Articulation| {
            let w = DVec3::from_slice(body.velocities());
            orientation(body.positions()) * (moments * w)
        };
        let start = momentum(&body);
        let mut worst = [0.0f64; 2];
        for _ in 0..5_000 {
            body.step(DVec3::ZERO, 1e-3, Integrator::Leapfrog);
            let apart = (momentum(&body) - start).length() / start.length();
            worst = [worst[0].max((kinetic(&body) / first - 1.0).abs()), worst[1].max(apart)];
        }
        println!("{spin} rad/s: energy off by {:.1e}, angular momentum by {:.1e}", worst[0], worst[1]);
        assert!(worst.iter().all(|worst| *worst < most), "{spin}: {worst:?}");
    }
}

/// Ten minutes at 1 ms: each step normalises the quaternion.
#[test]
fn the_quaternion_stays_of_unit_length() {
    let mut body = fixed(&pendulum(symmetric(0.03, 0.01)));
    put(&mut body, turn(DVec3::new(1.0, 0.5, 0.0)), DVec3::new(3.0, -2.0, 20.0));
    let mut worst = 0.0f64;
    for _ in 0..600_000 {
        body.step(GRAVITY, 1e-3, Integrator::Leapfrog);
        worst = worst.max((orientation(body.positions()).length() - 1.0).abs());
    }
    assert!(worst < 1e-15 && body.is_finite(), "{worst:e}");
}

/// The same top on a ball joint and on three hinges with massless links between them, away from their gimbal
/// lock. They are two computations of the same motion, each with its own error of second order.
#[test]
fn a_ball_joint_moves_as_three_hinges_do_where_they_can() {
    let inertial = Inertial { center_of_mass: DVec3::new(0.0, 0.0, 0.2), ..symmetric(0.004, 0.003) };
    let mut hinges = crate::chains::chain(3);
    for (joint, axis) in hinges.joints.iter_mut().zip([DVec3::Z, DVec3::X, DVec3::Z]) {
        (joint.axis, joint.parent_from_joint) = (axis, DPose3::IDENTITY);
    }
    hinges.links[1].inertial = Inertial::ZERO;
    hinges.links[2].inertial = Inertial::ZERO;
    hinges.links[3].inertial = inertial;
    let spin = 50.0;
    let differences = [1e-3, 2.5e-4].map(|h| {
        let mut ball = fixed(&pendulum(inertial));
        put(&mut ball, DQuat::from_rotation_x(0.6), DVec3::Z * spin);
        let tree = Arc::new(Tree::new(&hinges, true));
        let axes = vec![Axis::default(); 3];
        let mut three = Articulation::new(tree, DPose3::IDENTITY, axes, &[0.0, 0.6, 0.0]);
        three.velocities_mut()[2] = spin;
        for _ in 0..(1.0 / h) as u32 {
            ball.step(GRAVITY, h, Integrator::Leapfrog);
            three.step(GRAVITY, h, Integrator::Leapfrog);
        }
        let q = three.positions();
        let expected =
            DQuat::from_rotation_z(q[0]) * DQuat::from_rotation_x(q[1]) * DQuat::from_rotation_z(q[2]);
        rotation_vector(expected.inverse() * orientation(ball.positions())).length()
    });
    let slope = (differences[0] / differences[1]).log2() / 2.0;
    println!("{differences:?}, slope {slope:.2}");
    assert!(differences[1] < 2e-3 && slope > 1.8, "{differences:?}");
}

/// A rod without a moment about itself turns like a plane pendulum, whatever its direction in the child's
/// axes. The singular direction of the three axes stays as it is, and adds no noise.
#[test]
fn a_rod_without_a_moment_about_itself_swings_as_a_plane_pendulum() {
    let along = DVec3::new(0.48, 0.6, -0.64);
    let inertial = Inertial { mass: 1.0, center_of_mass: along * 0.5, inertia: DMat3::ZERO };
    // It is level at first: a plane pendulum from there.
    let level = DQuat::from_rotation_arc(along, DVec3::X);
    let mut hinge = crate::chains::chain(1);
    hinge.links[1].inertial = Inertial { center_of_mass: DVec3::X * 0.5, ..inertial };
    let tree = Arc::new(Tree::new(&hinge, true));
    let worst = [1e-3, 2.5e-4].map(|h| {
        let mut ball = fixed(&pendulum(inertial));
        put(&mut ball, level, DVec3::ZERO);
        let axes = vec![Axis::default(); 1];
        let mut plane = Articulation::new(Arc::clone(&tree), DPose3::IDENTITY, axes, &[]);
        let mut worst = 0.0f64;
        for _ in 0..(2.0 / h) as u32 {
            ball.step(GRAVITY, h, Integrator::Leapfrog);
            plane.step(GRAVITY, h, Integrator::Leapfrog);
            let line = orientation(ball.positions()) * along;
            let angle = plane.positions()[0];
            worst = worst.max((line - DVec3::new(angle.cos(), 0.0, -angle.sin())).length());
        }
        worst
    });
    let slope = (worst[0] / worst[1]).log2() / 2.0;
    println!("apart by {worst:?}, slope {slope:.2}");
    assert!(worst[0] < 1e-3 && slope > 1.8, "{worst:?}");
}
