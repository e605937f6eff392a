//! Ball joints with springs, dampers, torques and friction.

use std::f64::consts::PI;

use fastrand::Rng;
use simd_core::dynamics::{Actuator, Mode};

use super::*;

fn spring(body: &mut Articulation, target: DVec3, stiffness: f64, damping: f64) {
    for k in 0..3 {
        let actuator = Actuator {
            mode: Mode::Position,
            target: target[k],
            stiffness: Some(stiffness),
            damping: Some(damping),
            setpoint: target[k],
            ..Actuator::default()
        };
        body.set_actuator(k, actuator);
    }
}

fn any(rng: &mut Rng) -> DVec3 {
    DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, rng.f64() - 0.5) * 2.0
}

/// Returns a body of some inertia, its centre of mass off the joint.
fn lump(rng: &mut Rng) -> Inertial {
    let spread = DVec3::new(rng.f64() + 0.1, rng.f64() + 0.1, rng.f64() + 0.1) * 0.02;
    let moments = DVec3::new(spread.y + spread.z, spread.x + spread.z, spread.x + spread.y);
    let axes = DMat3::from_quat(turn(any(rng) * 3.0));
    Inertial {
        mass: 1.0,
        center_of_mass: any(rng) * 0.3,
        inertia: axes * DMat3::from_diagonal(moments) * axes.transpose(),
    }
}

/// A ball turned from its target about one axis and released swings as a harmonic oscillator at any angle up
/// to half a turn. The torque is k times the angle, and the frequency sqrt(k / I).
#[test]
fn a_spring_towards_an_orientation_is_harmonic_at_any_angle() {
    let (moment, stiffness) = (0.05, 2.0);
    let inertial = Inertial {
        mass: 1.0,
        center_of_mass: DVec3::ZERO,
        inertia: DMat3::from_diagonal(DVec3::splat(moment)),
    };
    let axis = DVec3::new(0.48, 0.6, -0.64);
    let rest = DVec3::new(0.4, -0.9, 0.3);
    let frequency = f64::sqrt(stiffness / moment);
    for angle in [0.1, 1.0, 3.0] {
        let errors = [1e-3, 2.5e-4].map(|h| {
            let mut body = fixed(&pendulum(inertial));
            put(&mut body, turn(rest) * turn(axis * angle), DVec3::ZERO);
            spring(&mut body, rest, stiffness, 0.0);
            (0..(2.0 / h) as u32).for_each(|_| body.step(DVec3::ZERO, h, Integrator::Leapfrog));
            let there = rotation_vector(turn(rest).inverse() * orientation(body.positions()));
            (there - axis * (angle * (frequency * 2.0).cos())).length()
        });
        let slope = (errors[0] / errors[1]).log2() / 2.0;
        println!("{angle} rad: {errors:?}, slope {slope:.2}");
        assert!(errors[0] < 1e-3 * angle && (slope - 2.0).abs() < 0.1, "{errors:?}");
    }
}

fn fastest(integrator: Integrator) -> f64 {
    if integrator == Integrator::Euler { 2.0 } else { 30.0 }
}

/// The energy of motion and spring never grows by more than the integrators' own error. Tested from any
/// orientation, with gains up to 1e9 and light or heavy bodies, with and without a damper, by both
/// integrators. At 30 rad/s only leapfrog is tested: Euler's gyroscopic terms are explicit, and add energy to
/// a fast spinning body, with a spring or without.
#[test]
fn springs_of_any_stiffness_are_stable() {
    let mut failures = Vec::new();
    for seed in 0..240 {
        let rng = &mut Rng::with_seed(seed);
        let mut inertial = lump(rng);
        let scale = 10f64.powf(rng.f64() * 6.0 - 4.0);
        (inertial.mass, inertial.inertia) = (inertial.mass * scale, inertial.inertia * scale);
        let stiffness = 10f64.powf(rng.f64() * 9.0);
        let damping = if rng.bool() { 0.0 } else { 10f64.powf(rng.f64() * 9.0 - 3.0) };
        let integrator = BOTH[seed as usize % 2];
        let rest = any(rng) * 1.7;
        let mut body = fixed(&pendulum(inertial));
        put(&mut body, turn(any(rng) * 2.0), any(rng) * fastest(integrator));
        spring(&mut body, rest, stiffness, damping);
        let energy = |body: &Articulation| {
            let apart = rotation_vector(turn(rest).inverse() * orientation(body.positions()));
            kinetic(body) + 0.5 * stiffness * apart.length_squared()
        };
        let first = energy(&body);
        let mut most = 0.0f64;
        for _ in 0..3_000 {
            body.step(DVec3::ZERO, 1e-3, integrator);
            most = most.max(energy(&body) / first);
        }
        if !body.is_finite() || most >= 1.3 {
            failures.push(format!(
                "seed {seed}, {integrator:?}, k {stiffness:.1e}, d {damping:.1e}, {scale:.1e} kg: {most}"
            ));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// With gains of 1e9 a target 179 degrees away is reached, and then held against gravity.
#[test]
fn a_stiff_target_is_reached_and_held() {
    for integrator in BOTH {
        let rng = &mut Rng::with_seed(5);
        for _ in 0..20 {
            let mut body = fixed(&pendulum(lump(rng)));
            let rest = any(rng);
            let away = any(rng).normalize() * (179.0 / 180.0 * PI);
            put(&mut body, turn(rest) * turn(away), any(rng) * 10.0);
            spring(&mut body, rest, 1e9, 1e5);
            (0..2_000).for_each(|_| body.step(GRAVITY, 1e-3, integrator));
            let apart = rotation_vector(turn(rest).inverse() * orientation(body.positions())).length();
            let speed = DVec3::from_slice(body.velocities()).length();
            assert!(apart < 1e-7 && speed < 1e-7, "{integrator:?}: {apart:e} {speed:e}");
        }
    }
}

/// At rest the spring's torque balances gravity: exactly k times the angle.
#[test]
fn a_soft_spring_sags_by_the_torque_over_its_stiffness() {
    let inertial = symmetric(0.02, 0.01);
    for integrator in BOTH {
        let mut body = fixed(&pendulum(inertial));
        let (rest, stiffness) = (turn(DVec3::new(0.3, 1.2, -0.4)), 40.0);
        put(&mut body, rest, DVec3::ZERO);
        spring(&mut body, rotation_vector(rest), stiffness, 2.0);
        (0..20_000).for_each(|_| body.step(GRAVITY, 1e-3, integrator));
        let here = orientation(body.positions());
        let pull = rotation_vector(here.inverse() * rest) * stiffness;
        let weight = inertial.center_of_mass.cross(here.inverse() * (GRAVITY * inertial.mass));
        assert!((pull + weight).length() < 1e-9, "{integrator:?}: {pull} {weight}");
        let efforts = DVec3::from_slice(body.efforts());
        assert!((efforts - pull).length() < 1e-9, "{integrator:?}: {efforts} {pull}");
    }
}

/// A damper alone only removes energy, at any size, except for the integrators' own error.
#[test]
fn a_damper_only_takes_energy() {
    for seed in 0..60 {
        let rng = &mut Rng::with_seed(seed);
        let mut body = fixed(&pendulum(lump(rng)));
        let damping = 10f64.powf(rng.f64() * 9.0 - 4.0);
        body.axes_mut().iter_mut().for_each(|axis| axis.settings.damping = damping);
        let integrator = BOTH[seed as usize % 2];
        put(&mut body, turn(any(rng) * 2.0), any(rng) * fastest(integrator));
        let first = kinetic(&body);
        let mut most = 0.0f64;
        for _ in 0..1_000 {
            body.step(DVec3::ZERO, 1e-3, integrator);
            most = most.max(kinetic(&body) / first);
        }
        println!("seed {seed}, {damping:.1e}: {} at the most", most - 1.0);
        assert!(most < 1.0 + 1e-3, "seed {seed}, {damping}: {most}");
    }
}

/// Dry friction as in MuJoCo, with one bound for each axis, holds a leaning pendulum, which does not creep.
#[test]
fn dry_friction_holds_a_pendulum_that_leans() {
    let mut body = fixed(&pendulum(symmetric(0.02, 0.01)));
    let torque = 1.5 * 9.81 * 0.4 * 0.5f64.sin();
    body.axes_mut().iter_mut().for_each(|axis| axis.settings.friction = 1.05 * torque);
    put(&mut body, DQuat::from_rotation_x(0.5), DVec3::ZERO);
    (0..500).for_each(|_| body.step(GRAVITY, 1e-3, Integrator::Leapfrog));
    let first = orientation(body.positions());
    (0..5_000).for_each(|_| body.step(GRAVITY, 1e-3, Integrator::Leapfrog));
    assert!((first - orientation(body.positions())).length() < 1e-9);
    assert!(first.angle_between(DQuat::from_rotation_x(0.5)) < 1e-4);
    body.axes_mut().iter_mut().for_each(|axis| axis.settings.friction = 0.9 * torque);
    (0..2_000).for_each(|_| body.step(GRAVITY, 1e-3, Integrator::Leapfrog));
    assert!(first.angle_between(orientation(body.positions())) > 0.05, "with less it slips");
}

/// A velocity in the child's axes and an effort limit about each of them.
#[test]
fn a_velocity_target_is_kept_and_an_effort_limit_holds() {
    let mut body = fixed(&pendulum(symmetric(0.02, 0.01)));
    body.set_default_gains();
    let wanted = DVec3::new(0.5, -1.0, 2.0);
    for k in 0..3 {
        let target = wanted[k];
        body.set_actuator(k, Actuator { mode: Mode::Velocity, target, ..Actuator::default() });
    }
    (0..500).for_each(|_| body.step(GRAVITY, 1e-3, Integrator::Leapfrog));
    let velocity = DVec3::from_slice(body.velocities());
    assert!((velocity - wanted).length() < 2e-2, "{velocity}");
    // Straight up, and far too heavy for its limit: it falls, with no more than that.
    spring(&mut body, DVec3::X * PI * 0.9, 1e6, 1e3);
    body.axes_mut().iter_mut().for_each(|axis| axis.settings.limits.effort = Some(0.3));
    put(&mut body, turn(DVec3::X * PI * 0.9), DVec3::ZERO);
    let mut furthest = 0.0f64;
    for _ in 0..3_000 {
        body.step(GRAVITY, 1e-3, Integrator::Leapfrog);
        furthest = furthest.max(orientation(body.positions()).angle_between(turn(DVec3::X * PI * 0.9)));
        assert!(body.efforts().iter().all(|effort| effort.abs() <= 0.3), "{:?}", body.efforts());
    }
    assert!(furthest > 1.0, "{furthest}");
}
