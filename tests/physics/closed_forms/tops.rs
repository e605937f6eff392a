//! Tops and a tumbling box: bodies that turn freely, or on a point.

use glamx::{DMat3, DQuat, DVec3};
use simd_core::{Command, Integrator, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Link};

use super::elliptic::{complete, jacobi};
use super::{by, extrapolated, met, put, with};
use crate::chains::chain;
use simd_tests::world::{apply, look, run};

/// Returns a free body with these moments, turning at a velocity, in its own axes, that start as the world's.
fn body(moments: DVec3, velocity: DVec3, time_step: f64) -> Simulation {
    let inertial =
        Inertial { mass: 1.0, center_of_mass: DVec3::ZERO, inertia: DMat3::from_diagonal(moments) };
    let link = Link { name: "body".into(), inertial, visuals: Vec::new(), collisions: Vec::new() };
    let model =
        RobotModel { name: "body".into(), links: vec![link], joints: Vec::new(), ..RobotModel::default() };
    let mut world = with(model, true, 0.0, time_step);
    let twist = Some((DVec3::ZERO, velocity));
    apply(&mut world, Command::SetEntityState { robot: "robot".into(), pose: None, twist });
    world
}

/// Its angular momentum in world axes, and its kinetic energy.
fn kept(world: &Simulation, moments: DVec3) -> (DVec3, f64) {
    let (turn, velocity) = turning(world);
    (turn * (moments * velocity), velocity.dot(moments * velocity) / 2.0)
}

/// `world_from_body`, and the velocity in the body's own axes.
fn turning(world: &Simulation) -> (DQuat, DVec3) {
    let root = look(world).roots[0].clone();
    (root.pose.rotation, root.pose.rotation.inverse() * root.angular)
}

/// Landau and Lifshitz, Mechanics, paragraph 33: the axis of a symmetric top goes around the angular momentum
/// L at |L| / I1, whatever its spin. After 2 s, extrapolated from 1 and 0.5 ms and from 0.1 and 0.05 ms. The
/// remaining error is of second order, (velocity h)^2 t / 2 with the fastest velocity of 13 rad/s.
#[test]
fn a_free_symmetric_top_precesses_about_its_angular_momentum() {
    let (moments, velocity) = (DVec3::new(0.02, 0.02, 0.03), DVec3::new(2.0, 0.0, 8.0));
    let momentum = moments * velocity;
    let expected = DQuat::from_scaled_axis(momentum / moments.x * 2.0) * DVec3::Z;
    for time_step in [1e-3, 1e-4] {
        let axis = |h: f64| {
            let mut world = body(moments, velocity, h);
            run(&mut world, 2.0);
            turning(&world).0 * DVec3::Z
        };
        let (coarse, half) = (axis(time_step), axis(time_step / 2.0));
        let tolerance = (13.0 * time_step).powi(2);
        for (name, i) in [("x", 0), ("y", 1), ("z", 2)] {
            let found = extrapolated(coarse[i], half[i]);
            met(
                &format!("free top: axis after 2 s, {name}, extrapolated"),
                time_step,
                expected[i],
                found,
                tolerance,
            );
        }
    }
}

/// Steady precession at W of a top that leans by theta: `m g l = I3 w3 W - I1 W^2 cos theta`, `w3 = spin + W
/// cos theta`. I1 is about the point that it stands on (Goldstein, Classical Mechanics, 5.7). Euler's angles
/// are three joints here, between massless rings. No joint accelerates, so a step can only get the forces
/// wrong. Rounding remains, which the nodding of the top does not amplify: 1e-9 rad after a second.
#[test]
fn a_heavy_top_precesses_steadily() {
    let (mass, arm, side, spin_moment): (f64, f64, f64, f64) = (1.0, 0.1, 0.002, 0.003);
    let (lean, precession): (f64, f64) = (0.6, 3.0);
    let about_point = side + mass * arm * arm;
    let fast =
        (mass * 9.81 * arm + about_point * precession.powi(2) * lean.cos()) / (spin_moment * precession);
    for time_step in [1e-4, 1e-3, 4e-3] {
        let mut model = chain(3);
        for (joint, axis) in model.joints.iter_mut().zip([DVec3::Z, DVec3::X, DVec3::Z]) {
            (joint.axis, joint.parent_from_joint) = (axis, glamx::DPose3::IDENTITY);
        }
        (model.links[1].inertial, model.links[2].inertial) = (Inertial::ZERO, Inertial::ZERO);
        model.links[3].inertial = Inertial {
            mass,
            center_of_mass: DVec3::Z * arm,
            inertia: DMat3::from_diagonal(DVec3::new(side, side, spin_moment)),
        };
        let mut world = with(model, false, 9.81, time_step);
        put(&mut world, "joint-1", 0.0, precession);
        put(&mut world, "joint-2", lean, 0.0);
        put(&mut world, "joint-3", 0.0, fast - precession * lean.cos());
        let found = run(&mut world, 1.0).positions;
        met("heavy top: precession after 1 s, rad", time_step, precession, found[0], 1e-9);
        met("heavy top: lean after 1 s, rad", time_step, lean, found[1], 1e-9);
    }
}

const MOMENTS: DVec3 = DVec3::new(0.005, 0.010, 0.013);
const VELOCITY: DVec3 = DVec3::new(4.99, 0.0, 4.0);

/// Landau and Lifshitz, Mechanics, paragraph 37, for `I1 < I2 < I3`, `L^2 > 2 E I2` and w2 = 0 at first: `w1
/// = a cn u`, `w2 = b sn u`, `w3 = c dn u`. L is just beside the middle axis, about which the box turns over
/// repeatedly. Tested at the quarter of the period where it turns over, and after one and a half periods.
/// Extrapolated like the top; the remaining error of second order is (velocity h)^2 = 50 h^2 for each
/// quarter.
#[test]
fn a_box_tumbles_about_its_middle_axis_as_jacobis_functions_do() {
    let (energy2, momentum2) = (VELOCITY.dot(MOMENTS * VELOCITY), (MOMENTS * VELOCITY).length_squared());
    let DVec3 { x: i1, y: i2, z: i3 } = MOMENTS;
    let (above, below) = (energy2 * i3 - momentum2, momentum2 - energy2 * i1);
    let k = (((i2 - i1) * above) / ((i3 - i2) * below)).sqrt();
    let speed = (((i3 - i2) * below) / (i1 * i2 * i3)).sqrt();
    let b = (above / (i2 * (i3 - i2))).sqrt();
    assert!((0.99..1.0).contains(&k), "{k}");
    for quarters in [1.0, 6.0] {
        let time = quarters * complete(k) / speed;
        for time_step in [1e-3, 1e-4] {
            // A whole number of steps, so that both runs end at the same time.
            let time = (time / time_step).round() * time_step;
            let (sn, cn, dn) = jacobi(speed * time, k);
            let expected = DVec3::new(VELOCITY.x * cn, b * sn, VELOCITY.z * dn);
            let velocity = |h: f64| {
                let mut world = body(MOMENTS, VELOCITY, h);
                run(&mut world, time);
                turning(&world).1
            };
            let (coarse, half) = (velocity(time_step), velocity(time_step / 2.0));
            for (name, i) in [("small", 0), ("middle", 1), ("large", 2)] {
                let found = extrapolated(coarse[i], half[i]);
                let form =
                    format!("tumbling box: {name} axis' velocity after {quarters} K, rad/s, extrapolated");
                met(&form, time_step, expected[i], found, quarters * 50.0 * time_step * time_step);
            }
        }
    }
}

/// Nothing acts on it, so angular momentum and energy should stay, and leapfrog keeps them. Semi-implicit
/// Euler keeps them to first order, like MuJoCo's with the same steps. In two seconds both change by less
/// than 0.5 % at 1 ms, and by a tenth of that at a tenth of the time step.
#[test]
fn a_tumbling_box_keeps_momentum_and_energy() {
    let drift = |integrator, time_step: f64| {
        let mut world = by(integrator, body(MOMENTS, VELOCITY, time_step));
        let (momentum, energy) = kept(&world, MOMENTS);
        let (mut turned, mut gained) = (0.0f64, 0.0f64);
        for _ in 0..100 {
            run(&mut world, 0.02);
            let (now, left) = kept(&world, MOMENTS);
            turned = turned.max((now - momentum).length() / momentum.length());
            gained = gained.max((left - energy).abs() / energy);
        }
        [turned, gained]
    };
    let kept = drift(Integrator::Leapfrog, 1e-3);
    met("tumbling box: drift of angular momentum in 2 s, relative", 1e-3, 0.0, kept[0], 1e-12);
    met("tumbling box: drift of energy in 2 s, relative", 1e-3, 0.0, kept[1], 1e-12);
    let (coarse, fine) = (drift(Integrator::Euler, 1e-3), drift(Integrator::Euler, 1e-4));
    for (i, name) in ["angular momentum", "energy"].into_iter().enumerate() {
        let form = format!("tumbling box, Euler: drift of {name} in 2 s, relative");
        met(&form, 1e-3, 0.0, coarse[i], 0.005);
        met(&form, 1e-4, 0.0, fine[i], 0.0005);
        assert!((8.0..12.0).contains(&(coarse[i] / fine[i])), "{name}: {} {}", coarse[i], fine[i]);
    }
}
