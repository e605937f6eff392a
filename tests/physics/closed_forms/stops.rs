//! Dry friction that stops and holds, a limit that is arrived at.

use glamx::{DPose3, DQuat, DVec3};
use simd_core::{Integrator, Simulation};
use simd_model::robot::{JointKind, JointLimits};

use super::{by, met, put, spring, steps, tell, with};
use crate::chains::chain;
use simd_tests::world::{look, run};

/// 1 kg on a slide that leads down by this angle.
fn slide(angle: f64, friction: f64, limits: JointLimits, time_step: f64) -> Simulation {
    let mut model = chain(1);
    let joint = &mut model.joints[0];
    joint.kind = JointKind::Prismatic;
    joint.axis = DVec3::X;
    // A positive angle about y turns x below the horizon.
    joint.parent_from_joint = DPose3::from_parts(DVec3::ZERO, DQuat::from_rotation_y(angle));
    joint.friction = friction;
    joint.limits = limits;
    with(model, false, 9.81, time_step)
}

/// Coulomb: from v0 it stops after m v0 / f, at a distance of m v0^2 / (2 f). Steps of Euler leave out `v0 h
/// / 2` of the distance, and up to `f h^2 / m` if the last step is not a whole one. Then it stays, to
/// rounding.
#[test]
fn dry_friction_stops_a_slider_when_and_where_coulomb_says() {
    let (start, friction) = (0.7, 1.3);
    let all =
        [(Integrator::Leapfrog, 0.0), (Integrator::Euler, 0.5)].map(|of| [1e-4, 1e-3, 4e-3].map(|h| (of, h)));
    for ((integrator, left_out), time_step) in all.into_iter().flatten() {
        let mut world = by(integrator, slide(0.0, friction, JointLimits::default(), time_step));
        put(&mut world, "joint-1", 0.0, start);
        let mut stopped = None;
        for (step, seen) in steps(&mut world, (1.0 / time_step) as usize).enumerate() {
            if stopped.is_none() && seen.velocities[0].abs() < 1e-10 {
                stopped = Some((step + 1) as f64 * time_step);
            }
            assert!(seen.velocities[0] > -1e-10, "it does not turn back");
        }
        met("Coulomb: time to stop, s", time_step, start / friction, stopped.unwrap(), time_step);
        let (way, found) = (start * start / (2.0 * friction), look(&world).positions[0]);
        let tolerance = friction * time_step * time_step;
        let form = format!("Coulomb, {integrator:?}: way to stop, less {left_out} v0 h, m");
        met(&form, time_step, way - left_out * start * time_step, found, tolerance);
        met("Coulomb: way in the next 10 s, m", time_step, found, run(&mut world, 10.0).positions[0], 1e-9);
    }
}

/// On a slope of 30 degrees a kilogram sticks if friction is above m g sin, even by 1 in 10,000. With less it
/// slides by g sin - f / m, as in free fall. 1e-9 m is far below any creep in 10 s: a soft friction that
/// gives way by f / (2 / h) moves 1e-4 m.
#[test]
fn dry_friction_holds_on_a_slope_or_lets_slide_with_what_is_left() {
    let pull = 9.81 * 30f64.to_radians().sin();
    for time_step in [1e-4, 1e-3, 4e-3] {
        let mut world = slide(30f64.to_radians(), pull * 1.0001, JointLimits::default(), time_step);
        let crept = run(&mut world, 10.0).positions[0];
        met("slope, friction 1.0001 m g sin: creep in 10 s, m", time_step, 0.0, crept, 1e-9);

        let mut world = slide(30f64.to_radians(), pull * 0.9, JointLimits::default(), time_step);
        let slid = run(&mut world, 1.0).positions[0];
        met("slope, friction 0.9 m g sin: way in 1 s, m", time_step, 0.05 * pull, slid, 1e-10);
    }
}

/// From rest it falls d to its stop in sqrt(2 d / g), the discrete fall being early by h / 2, seen within a
/// step. It never passes the stop, does not bounce, and rests on it, to rounding.
#[test]
fn a_falling_slider_arrives_at_its_limit_and_rests_there() {
    let distance = 0.5;
    let limits = JointLimits { lower: Some(-1.0), upper: Some(distance), ..JointLimits::default() };
    for time_step in [1e-4, 1e-3, 4e-3] {
        let mut world = slide(90f64.to_radians(), 0.0, limits, time_step);
        let mut arrived = None;
        for (step, seen) in steps(&mut world, (2.0 / time_step) as usize).enumerate() {
            let at = seen.positions[0];
            assert!(at <= distance + 1e-9, "it passes the stop by {:e}", at - distance);
            if arrived.is_none() && at >= distance - 1e-9 {
                arrived = Some((step + 1) as f64 * time_step);
            }
            assert!(arrived.is_none() || at > distance - 1e-9, "it bounces to {at}");
        }
        let fall = (2.0f64 * distance / 9.81).sqrt();
        met("fall to a limit: time of arrival, s", time_step, fall, arrived.unwrap(), time_step);
        let seen = look(&world);
        met("fall to a limit: place of rest, m", time_step, distance, seen.positions[0], 1e-9);
        met("fall to a limit: velocity at rest, m/s", time_step, 0.0, seen.velocities[0], 1e-9);
    }
}

/// A rod that falls onto a stop at 30 degrees below the horizon, held by a spring that pulls it back up. It
/// rests where k q = torque of gravity, if that is before the stop. Statics: q solves `k q = m g l / 2 cos
/// q`.
#[test]
fn a_rod_rests_on_its_stop_or_on_its_spring_whichever_is_first() {
    let limits = JointLimits { lower: Some(-3.0), upper: Some(30f64.to_radians()), ..JointLimits::default() };
    for (stiffness, rests_on_stop) in [(5.0, true), (20.0, false)] {
        let mut model = chain(1);
        model.joints[0].kind = JointKind::Revolute;
        model.joints[0].limits = limits;
        let mut world = with(model, false, 9.81, 1e-3);
        tell(&mut world, "joint-1", spring(stiffness, 3.0, 0.0));
        let found = run(&mut world, 20.0).positions[0];
        let mut q = 0.2;
        for _ in 0..100 {
            q -= (stiffness * q - 4.905 * f64::cos(q)) / (stiffness + 4.905 * f64::sin(q));
        }
        assert_eq!(q > 30f64.to_radians(), rests_on_stop);
        let form = format!("rod on a spring of {stiffness} N m/rad and a stop: angle at rest, rad");
        met(&form, 1e-3, q.min(30f64.to_radians()), found, 1e-9);
    }
}

/// A joint that meets its limit reaches it in one step, and is stopped there in the next. The velocities at
/// the end of that step are not extrapolated from the stopping force, so that it is never reported as going
/// back.
#[test]
fn a_slider_that_meets_its_limit_is_reported_at_rest_and_never_as_going_back() {
    for distance in [0.1, 0.1003, 0.1007] {
        let limits = JointLimits { lower: Some(-1.0), upper: Some(distance), ..JointLimits::default() };
        let mut world = slide(0.0, 0.0, limits, 1e-3);
        put(&mut world, "joint-1", 0.0, 1.0);
        let mut slowest = f64::INFINITY;
        for _ in 0..200 {
            world.step();
            slowest = slowest.min(look(&world).velocities[0]);
        }
        let form = format!("slide of 1 m/s to a limit at {distance} m: slowest, m/s");
        met(&form, 1e-3, 0.0, slowest, 1e-12);
        met("the same: place of rest, m", 1e-3, distance, look(&world).positions[0], 1e-12);
    }
}
