//! Constant torque, viscous coasting, free fall.

use glamx::{DMat3, DVec3};
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Link};

use super::{by, met, put, steps, tell, with};
use crate::chains::chain;
use simd_tests::world::{apply, look, run};

/// Returns a rod that turns about a vertical axis through its end: 1/3 kg m^2, which gravity does not turn.
fn turntable(time_step: f64) -> simd_core::Simulation {
    let mut model = chain(1);
    model.joints[0].axis = DVec3::Z;
    with(model, false, 9.81, time_step)
}

const INERTIA: f64 = 1.0 / 3.0;

fn damp(world: &mut simd_core::Simulation, damping: f64) {
    let joints = vec![JointProperties {
        joint: "joint-1".into(),
        damping: Some(damping),
        ..JointProperties::default()
    }];
    apply(world, Command::SetJointProperties { robot: "robot".into(), joints });
}

/// `q = a t^2 / 2`, which leapfrog reproduces. Each step of Euler adds a h to the velocity first, so after n
/// steps it is `a h^2 n (n + 1) / 2`, which is `a t h / 2` more. Only rounding remains: 1e-12 of 0.9 rad.
#[test]
fn a_constant_torque_gives_a_constant_acceleration() {
    for time_step in [1e-4, 1e-3, 4e-3] {
        let mut world = turntable(time_step);
        tell(&mut world, "joint-1", Target::Effort(0.6));
        let found = run(&mut world, 1.0);
        met("constant torque: angle after 1 s, rad", time_step, 0.3 / INERTIA, found.positions[0], 1e-12);
        met(
            "constant torque: velocity after 1 s, rad/s",
            time_step,
            0.6 / INERTIA,
            found.velocities[0],
            1e-12,
        );

        let mut world = by(Integrator::Euler, turntable(time_step));
        tell(&mut world, "joint-1", Target::Effort(0.6));
        let found = run(&mut world, 1.0);
        let velocity = 0.6 / INERTIA;
        let n = (1.0 / time_step).round();
        let discrete = velocity * time_step * time_step * n * (n + 1.0) / 2.0;
        met(
            "constant torque, Euler: angle after 1 s, discrete, rad",
            time_step,
            discrete,
            found.positions[0],
            1e-12,
        );
        met(
            "constant torque, Euler: velocity after 1 s, rad/s",
            time_step,
            velocity,
            found.velocities[0],
            1e-12,
        );
    }
}

/// velocity = `w e^(-c t / I)`. Joint damping is implicit: Euler's is `w / (1 + h c / I)^n`, to rounding, and
/// leapfrog's is of second order: `(h c / I)^2 / 4` of the velocity. The angle until it rests is w I / c in
/// both, at any time step.
#[test]
fn coasting_with_viscous_damping_decays_and_goes_as_far_as_it_should() {
    let (start, damping) = (5.0, 0.5);
    let decay: f64 = damping / INERTIA;
    for time_step in [1e-4, 1e-3, 4e-3] {
        let mut world = turntable(time_step);
        damp(&mut world, damping);
        put(&mut world, "joint-1", 0.0, start);
        let found = run(&mut world, 1.0).velocities[0];
        let exact = start * (-decay).exp();
        let tolerance = exact * (time_step * decay).powi(2) / 3.0 + 1e-11;
        met("viscous coasting: velocity after 1 s, rad/s", time_step, exact, found, tolerance);
        let way = run(&mut world, 24.0).positions[0];
        met("viscous coasting: whole way, rad", time_step, start / decay, way, 1e-11);

        let mut world = by(Integrator::Euler, turntable(time_step));
        damp(&mut world, damping);
        put(&mut world, "joint-1", 0.0, start);
        let found = run(&mut world, 1.0).velocities[0];
        let discrete = start / (1.0 + time_step * decay).powf((1.0 / time_step).round());
        met(
            "viscous coasting, Euler: velocity after 1 s, discrete, rad/s",
            time_step,
            discrete,
            found,
            1e-11,
        );
        // (1 + x)^-n is e^(-n x + n x^2 / 2 - ...).
        let exact = start * (-decay).exp();
        let tolerance = exact * decay * decay * time_step / 2.0;
        met("viscous coasting, Euler: velocity after 1 s, rad/s", time_step, exact, found, tolerance);
        let way = run(&mut world, 24.0).positions[0];
        met("viscous coasting, Euler: whole way, rad", time_step, start / decay, way, 1e-11);
    }
}

/// Far above damping h / I = 2 an explicit damper reverses the velocity each step, and grows. The implicit
/// one divides it by 1 + h c / I and more. The sign never changes, no step is faster than the previous one,
/// and the whole angle is w I / c.
#[test]
fn heavy_damping_brakes_without_oscillation() {
    let factors = [0.3, 1.0, 3.0, 1e3, 1e6, 1e12];
    let all = [Integrator::Leapfrog, Integrator::Euler]
        .map(|integrator| factors.map(|factor| (integrator, factor)));
    for (integrator, factor) in all.into_iter().flatten() {
        let time_step = 1e-3;
        let damping = factor * INERTIA / time_step;
        let mut world = by(integrator, turntable(time_step));
        damp(&mut world, damping);
        put(&mut world, "joint-1", 0.0, 5.0);
        let mut before: f64 = 5.0;
        for seen in steps(&mut world, 1000) {
            let velocity = seen.velocities[0];
            // Rounding may pass zero.
            assert!((-1e-15..=before.max(1e-15)).contains(&velocity), "{velocity} after {before}");
            before = velocity;
        }
        let form = format!("damping h / I = {factor}, {integrator:?}: whole way, rad");
        let way = 5.0 * INERTIA / damping;
        met(&form, time_step, way, look(&world).positions[0], 1e-12 * way + 1e-15);
    }
}

/// A box that is thrown up while it turns: `z = v t - g t^2 / 2` of its centre of mass. By Euler it is `v t -
/// g h^2 n (n + 1) / 2`, to rounding. The rotation has no effect.
#[test]
fn a_thrown_box_falls_as_the_discrete_formula_says() {
    let inertia = DMat3::from_diagonal(DVec3::new(0.005, 0.010, 0.013));
    let inertial = Inertial { mass: 1.2, center_of_mass: DVec3::ZERO, inertia };
    let link = Link { name: "box".into(), inertial, visuals: Vec::new(), collisions: Vec::new() };
    let model =
        RobotModel { name: "box".into(), links: vec![link], joints: Vec::new(), ..RobotModel::default() };
    for time_step in [1e-4, 1e-3, 4e-3] {
        let integrators = [(Integrator::Leapfrog, 0.0), (Integrator::Euler, 1.0)];
        for (integrator, early) in integrators {
            let mut world = by(integrator, with(model.clone(), true, 9.81, time_step));
            let twist = Some((DVec3::new(1.0, 0.0, 5.0), DVec3::new(1.0, 2.0, 3.0)));
            apply(&mut world, Command::SetEntityState { robot: "robot".into(), pose: None, twist });
            let at = run(&mut world, 1.0).roots[0].pose.translation;
            let n = (1.0 / time_step).round();
            let height = 5.0 - 9.81 * time_step * time_step * n * (n + early) / 2.0;
            let form = format!("thrown box, {integrator:?}");
            met(&format!("{form}: height after 1 s, discrete, m"), time_step, height, at.z, 1e-12);
            met(&format!("{form}: way after 1 s, m"), time_step, 1.0, at.x, 1e-12);
        }
    }
}
