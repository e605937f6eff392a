//! Fast spinning bodies stay finite, and free ones keep energy and momentum.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::dynamics::mass_matrix::mass_matrix;
use simd_core::dynamics::{Articulation, Axis, Integrator, Tree};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, JointKind, Link};

use crate::chains::chain;
use crate::seeds::{held, seeds};

const H: f64 = 1e-3;

/// Newton's method ends within four units in the last place in each step, and their errors add up at random.
const ROUNDING: f64 = 1e-11;

fn free_body(inertial: Inertial) -> Arc<RobotModel> {
    let link = Link { name: "body".into(), inertial, visuals: Vec::new(), collisions: Vec::new() };
    Arc::new(RobotModel {
        name: "body".into(),
        links: vec![link],
        joints: Vec::new(),
        ..RobotModel::default()
    })
}

fn placed(model: &RobotModel, fixed: bool, pose: DPose3) -> Articulation {
    let tree = Arc::new(Tree::new(model, fixed));
    let axes = vec![Axis::default(); tree.velocity_count];
    Articulation::new(tree, pose, axes, &[])
}

fn kinetic(body: &Articulation) -> f64 {
    let (matrix, v) = (mass_matrix(body.tree(), body.positions()), body.velocities());
    let n = v.len();
    (0..n * n).map(|i| v[i / n] * matrix[i] * v[i % n]).sum::<f64>() / 2.0
}

/// Returns the velocity of a free body's centre of mass and its angular momentum about it, world.
fn momentum(body: &Articulation, inertial: &Inertial) -> [DVec3; 2] {
    let turn = body.root_pose().rotation;
    let (linear, angular) = body.root_twist();
    let own = turn.inverse() * angular;
    [linear + turn * own.cross(inertial.center_of_mass), turn * (inertial.inertia * own)]
}

/// Returns possible moments of inertia, in possible axes. The mass is spread by some lengths along three
/// axes, one of which may be zero.
fn any_inertial(rng: &mut Rng) -> Inertial {
    let mut any = || rng.f64() - 0.5;
    let center_of_mass = DVec3::new(any(), any(), any()) * 0.4;
    let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(any(), any(), any()) * 6.0));
    let mass = 10f64.powf(rng.f64() * 4.0 - 2.0);
    let mut spread = [0, 1, 2].map(|_| mass * 10f64.powf(rng.f64() * 4.0 - 4.0));
    match rng.u8(0..6) {
        0 => spread[0] = 0.0,
        1 => spread[0] = spread[1],
        2 => spread = [spread[0]; 3],
        // A thin rod.
        3 => (spread[0], spread[1]) = (0.0, 0.0),
        _ => {}
    }
    let [x, y, z] = spread;
    let moments = DMat3::from_diagonal(DVec3::new(y + z, x + z, x + y));
    Inertial { mass, center_of_mass, inertia: turn * moments * turn.transpose() }
}

/// The disc of 0.13 m with three degrees of wobble, five seconds at 1 ms. At 60 rad/s explicit gyroscopic
/// terms turn its 2.7 J into 128,000 J.
#[test]
fn a_wobbling_disc_keeps_its_energy_at_any_spin() {
    let moments = DVec3::new(0.25, 0.25, 0.5) * 0.13 * 0.13;
    let inertial =
        Inertial { mass: 1.0, center_of_mass: DVec3::ZERO, inertia: DMat3::from_diagonal(moments) };
    for spin in [60.0, 200.0, 1_000.0, 2_000.0] {
        let mut body = placed(&free_body(inertial), false, DPose3::IDENTITY);
        let lean = 3f64.to_radians();
        body.set_root_twist(DVec3::ZERO, DVec3::new(lean.sin(), 0.0, lean.cos()) * spin);
        let (energy, start) = (kinetic(&body), momentum(&body, &inertial)[1]);
        for _ in 0..5_000 {
            body.step(DVec3::ZERO, H, Integrator::Leapfrog);
        }
        let kept = kinetic(&body) / energy;
        let apart = (momentum(&body, &inertial)[1] - start).length() / start.length();
        println!("{spin} rad/s: energy {kept:.12}, angular momentum off by {apart:.1e}");
        assert!((kept - 1.0).abs() < ROUNDING && apart < ROUNDING, "{spin}: {kept} {apart}");
    }
}

/// Energy, angular momentum and the velocity of the centre of mass stay, except for rounding. This holds for
/// any valid inertia, at any spin up to 2,000 rad/s and any place of the centre of mass. `SPINNING_BODIES` of
/// the environment gives another number of seeds.
#[test]
fn free_bodies_keep_energy_and_momentum_at_any_spin() {
    let count = seeds("SPINNING_BODIES", 200);
    let (mut worst, mut largest, mut failed) = ([0.0f64; 3], 0.0f64, Vec::new());
    for seed in 0..count {
        let rng = &mut Rng::with_seed(seed);
        let inertial = any_inertial(rng);
        let mut any = || rng.f64() - 0.5;
        let axis = DVec3::new(any(), any(), any()).normalize();
        let (linear, turn) = (DVec3::new(any(), any(), any()) * 10.0, DVec3::new(any(), any(), any()) * 6.0);
        let spin = [1.0, 30.0, 300.0, 2_000.0][seed as usize % 4];
        let pose = DPose3::from_parts(linear, DQuat::from_scaled_axis(turn));
        let mut body = placed(&free_body(inertial), false, pose);
        body.set_root_twist(linear, axis * spin);
        let (energy, [velocity, angular]) = (kinetic(&body), momentum(&body, &inertial));
        for _ in 0..1_000 {
            body.step(DVec3::ZERO, H, Integrator::Leapfrog);
        }
        let [velocity_after, angular_after] = momentum(&body, &inertial);
        let fastest = velocity.length() + spin * inertial.center_of_mass.length();
        let moment = inertial.inertia;
        let mean = (moment.x_axis.x + moment.y_axis.y + moment.z_axis.z) / 3.0;
        let errors = [
            (kinetic(&body) / energy - 1.0).abs(),
            (velocity_after - velocity).length() / fastest,
            (angular_after - angular).length() / (mean * spin),
        ];
        // A thin rod's own axis counts as one with a millionth of its other moments.
        let bound = if moment.determinant() < 1e-5 * mean.powi(3) { 1e-5 } else { 1e-9 };
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
            largest = largest.max(error / bound);
        }
        let all = errors.iter().all(|error| *error < bound);
        if !all {
            println!("seed {seed}, {spin} rad/s, {inertial:?}: {errors:?}");
            failed.push(seed);
        }
    }
    println!("largest errors of energy, velocity, angular momentum: {worst:?}");
    held("free bodies keep energy and momentum at any spin", count, largest, &failed);
}

/// Chains with one end that turns by 0.4 rad a step. Short ones are solved with the derivative of their
/// velocity terms, long ones only by iteration. Their mass matrix changes much within a step as they fold,
/// so that energy is not kept, but it stays below twice its initial value.
#[test]
fn a_chain_that_whips_stays_finite_however_long() {
    for count in [40, 300] {
        let tree = Arc::new(Tree::new(&chain(count), true));
        let axes = vec![Axis::default(); tree.velocity_count];
        let bent: Vec<f64> = (0..count).map(|i| 0.3 * f64::from((i as u32 * 7) % 5)).collect();
        let mut body = Articulation::new(tree, DPose3::IDENTITY, axes, &bent);
        body.velocities_mut()[count - 1] = 400.0;
        let energy = kinetic(&body);
        let mut most = 0.0f64;
        for _ in 0..200 {
            body.step(DVec3::ZERO, H, Integrator::Leapfrog);
            most = most.max(kinetic(&body) / energy);
        }
        println!("{count} joints: {} of the energy is left, {most} at the most", kinetic(&body) / energy);
        assert!(most < 2.0, "{count} joints: {most}");
    }
}

/// In free fall the centre of mass is on its parabola exactly, whatever the rotation of the body.
#[test]
fn a_spinning_body_falls_on_its_parabola() {
    let gravity = DVec3::new(0.0, 0.0, -9.81);
    for seed in 0..20 {
        let rng = &mut Rng::with_seed(seed);
        let inertial = any_inertial(rng);
        let mut body = placed(&free_body(inertial), false, DPose3::IDENTITY);
        body.set_root_twist(DVec3::new(1.0, 2.0, 3.0), DVec3::new(20.0, -30.0, 40.0));
        let [velocity, _] = momentum(&body, &inertial);
        let center = |body: &Articulation| body.root_pose().transform_point(inertial.center_of_mass);
        let start = center(&body);
        for _ in 0..1_000 {
            body.step(gravity, H, Integrator::Leapfrog);
        }
        let expected = start + velocity + gravity * 0.5;
        assert!((center(&body) - expected).length() < 1e-10, "seed {seed}");
        assert!((momentum(&body, &inertial)[0] - velocity - gravity).length() < 1e-10, "seed {seed}");
    }
}

/// Returns a wheel on a base that is free, off the axes of both.
fn flywheel() -> RobotModel {
    let mut model = chain(1);
    let disc = DVec3::new(0.25, 0.25, 0.5) * (0.5 * 0.1 * 0.1);
    model.links[0].inertial = Inertial {
        mass: 1.0,
        center_of_mass: DVec3::new(0.01, 0.02, -0.03),
        inertia: DMat3::from_diagonal(DVec3::new(4e-3, 5e-3, 6e-3)),
    };
    model.links[1].inertial =
        Inertial { mass: 0.5, center_of_mass: DVec3::ZERO, inertia: DMat3::from_diagonal(disc) };
    (model.joints[0].kind, model.joints[0].axis) = (JointKind::Continuous, DVec3::Z);
    model.joints[0].parent_from_joint =
        DPose3::from_parts(DVec3::new(0.05, 0.0, 0.1), DQuat::from_rotation_x(0.4));
    model
}

/// A flywheel of 600 rad/s on a free base that is pushed over. The mass matrix does not depend on the wheel's
/// angle, and the implicit midpoint keeps the energy. The remaining error comes from the base's slow
/// rotation, and is of second order.
#[test]
fn a_fast_flywheel_does_not_shake_its_base_apart() {
    for (spin, bound) in [(600.0, 1e-6), (2_000.0, 1e-6)] {
        let mut body = placed(&flywheel(), false, DPose3::IDENTITY);
        body.set_root_twist(DVec3::new(0.1, 0.0, 0.2), DVec3::new(1.0, -0.5, 0.3));
        body.velocities_mut()[6] = spin;
        let energy = kinetic(&body);
        let mut fastest = 0.0f64;
        for _ in 0..5_000 {
            body.step(DVec3::ZERO, H, Integrator::Leapfrog);
            fastest = fastest.max(body.root_twist().1.length());
        }
        let kept = kinetic(&body) / energy;
        println!("{spin} rad/s: energy {kept:.9}, base at most {fastest:.3} rad/s");
        assert!((kept - 1.0).abs() < bound && fastest < 3.0, "{kept} {fastest}");
    }
}

/// A top on three hinges, leaning by 0.6 rad and released. At 1,000 rad/s it precesses at `m g l / (I3 w3)`
/// in the mean, and nods by up to `2 m g l sin(lean) I1 / (I3 w3)^2 = 1.5e-3 rad`. Its spin gives w3 - W
/// cos(lean), W up to twice the mean (Goldstein, Classical Mechanics, 5.7).
#[test]
fn a_top_of_a_thousand_rad_s_precesses_slowly() {
    let (mass, arm, side, spin_moment, spin) = (1.0, 0.1, 0.002, 0.003, 1_000.0);
    let mut model = chain(3);
    for (joint, axis) in model.joints.iter_mut().zip([DVec3::Z, DVec3::X, DVec3::Z]) {
        (joint.axis, joint.parent_from_joint) = (axis, DPose3::IDENTITY);
    }
    model.links[1].inertial = Inertial::ZERO;
    model.links[2].inertial = Inertial::ZERO;
    model.links[3].inertial = Inertial {
        mass,
        center_of_mass: DVec3::Z * arm,
        inertia: DMat3::from_diagonal(DVec3::new(side, side, spin_moment)),
    };
    for h in [1e-3, 1e-4_f64] {
        let mut body = placed(&model, true, DPose3::IDENTITY);
        body.positions_mut()[1] = 0.6;
        body.velocities_mut()[2] = spin;
        let seconds: f64 = 2.0;
        for _ in 0..(seconds / h).round() as u64 {
            body.step(DVec3::new(0.0, 0.0, -9.81), h, Integrator::Leapfrog);
        }
        let expected = mass * 9.81 * arm / (spin_moment * spin) * seconds;
        let (q, spins) = (body.positions(), body.velocities()[2]);
        println!("{h} s: precession {} of {expected}, lean {}, spin {spins}", q[0], q[1]);
        assert!((q[0] / expected - 1.0).abs() < 2e-3, "{q:?}");
        assert!((-1e-4..1.6e-3).contains(&(q[1] - 0.6)), "{q:?}");
        assert!((-0.55..1e-2).contains(&(spins - spin)), "{spins}");
    }
}
