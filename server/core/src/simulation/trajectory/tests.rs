//! Interpolation of a trajectory's points by polynomials.

use super::*;

fn one(points: Vec<TrajectoryPoint>, start: (f64, f64)) -> ActiveTrajectory {
    let tolerance = Tolerance::default();
    ActiveTrajectory {
        id: 1,
        joints: vec![TrajectoryJoint { joint: 0, start, path: tolerance, goal: tolerance }],
        points: Arc::new(points),
        begin: Begin::Now,
        elapsed: 0.0,
        next: 0,
        goal_time_tolerance: None,
        ended: None,
    }
}

fn point(time: f64, position: f64, velocity: &[f64], acceleration: &[f64]) -> TrajectoryPoint {
    TrajectoryPoint {
        time,
        positions: vec![position],
        velocities: velocity.to_vec(),
        accelerations: acceleration.to_vec(),
        efforts: Vec::new(),
    }
}

fn at(trajectory: &ActiveTrajectory, time: f64) -> Sample {
    let mut copy = trajectory.clone();
    copy.advance(time);
    copy.sample(0)
}

#[test]
fn positions_alone_are_joined_by_lines() {
    let line = one(vec![point(1.0, 2.0, &[], &[]), point(3.0, -2.0, &[], &[])], (0.0, 9.0));
    assert_eq!((at(&line, 0.25).position, at(&line, 0.25).velocity), (0.5, 2.0));
    assert_eq!((at(&line, 2.0).position, at(&line, 2.0).velocity), (0.0, -2.0));
    assert_eq!((at(&line, 5.0).position, at(&line, 5.0).velocity), (-2.0, 0.0));
}

#[test]
fn velocities_make_cubics_and_accelerations_quintics_that_meet_both_ends() {
    // t^3 - t and t^5 - 2 t^2 are their own interpolations.
    let cubic = |t: f64| (t.powi(3) - t, 3.0 * t * t - 1.0, 6.0 * t);
    let quintic = |t: f64| (t.powi(5) - 2.0 * t * t, 5.0 * t.powi(4) - 4.0 * t, 20.0 * t.powi(3) - 4.0);
    let knots = [0.5, 1.25, 2.0];
    let thirds: Vec<_> = knots.iter().map(|&t| point(t, cubic(t).0, &[cubic(t).1], &[])).collect();
    let third = one(thirds, (0.0, -1.0));
    let fifths: Vec<_> =
        knots.iter().map(|&t| point(t, quintic(t).0, &[quintic(t).1], &[quintic(t).2])).collect();
    let fifth = one(fifths, (0.0, 0.0));
    for t in [0.1, 0.5, 0.7, 1.3, 1.9, 2.0] {
        let (sample, (p, v, a)) = (at(&third, t), cubic(t));
        assert!((sample.position - p).abs() < 1e-12, "{t}: {sample:?}");
        assert!((sample.velocity - v).abs() < 1e-11 && (sample.acceleration - a).abs() < 1e-10);
        // The first segment begins without acceleration, where the polynomial has one.
        if t > 0.5 {
            let (sample, (p, v, a)) = (at(&fifth, t), quintic(t));
            assert!((sample.position - p).abs() < 1e-11, "{t}: {sample:?}");
            assert!((sample.velocity - v).abs() < 1e-10 && (sample.acceleration - a).abs() < 1e-9);
        }
    }
}
