//! Rates of recorded answers.

use simd_client::proto::{SimulationState, Stamp};

use super::*;

/// Returns an answer at a time after the beginning, with this number of steps and calls.
pub(in super::super) fn answer(begin: Instant, seconds: f64, steps: u64, calls: u64) -> Answer {
    let histogram = |each: f64| DurationHistogram {
        sum: each * steps as f64,
        upper_bounds: vec![1e-4, 1e-3, f64::INFINITY],
        counts: vec![steps - steps / 50, steps / 50, 0],
    };
    let statistics = WorldStatistics {
        state: SimulationState::Playing.into(),
        stamp: Some(Stamp { sim_time: steps as f64 / 1e3, ..Default::default() }),
        target_real_time_factor: 1.0,
        real_time_factor: 0.997,
        iterations: steps,
        robots: 3,
        overruns: 2,
        dropped_lag: 0.25,
        step_duration: 5e-5,
        ..Default::default()
    };
    let daemon = DaemonStatistics {
        calls,
        failed_calls: calls / 10,
        streams: 4,
        claims: 1,
        resident_bytes: 64 << 20,
        step_duration: Some(histogram(5e-5)),
        step_lateness: Some(histogram(2e-5)),
        ..Default::default()
    };
    Answer {
        at: begin + Duration::from_secs_f64(seconds),
        round_trip: Duration::from_micros(400),
        statistics,
        daemon: Some(daemon),
        details: None,
    }
}

fn near(value: Option<f64>, expected: f64) -> bool {
    (value.unwrap() - expected).abs() < 1e-9 * expected
}

#[test]
fn rates_are_those_between_two_answers() {
    let begin = Instant::now();
    let mut world = World::new("lab:1".into());
    world.answered(answer(begin, 0.0, 1_000, 10));
    assert_eq!((world.link, world.steps_per_second, world.calls_per_second), (Link::Here, None, None));
    assert_eq!(world.step_duration, Some(5e-5), "the daemon's own mean");
    world.answered(answer(begin, 2.0, 3_000, 50));
    assert!(near(world.steps_per_second, 1_000.0) && near(world.calls_per_second, 20.0), "{world:?}");
    assert!(near(world.failed_calls_per_second, 2.0) && near(world.step_duration, 5e-5), "{world:?}");
    assert!(near(world.step_lateness, 2e-5), "{world:?}");
    // 2 of 100 are in the second bucket.
    assert_eq!((world.step_duration_p99, world.step_lateness_p99), (Some(1e-3), Some(1e-3)));
}

#[test]
fn a_restarted_daemon_has_no_negative_rates() {
    let begin = Instant::now();
    let mut world = World::new("lab:1".into());
    world.answered(answer(begin, 0.0, 1_000_000, 10_000));
    world.answered(answer(begin, 1.0, 50, 3));
    assert_eq!((world.steps_per_second, world.calls_per_second), (None, None));
    world.answered(answer(begin, 2.0, 1_050, 13));
    assert!(near(world.steps_per_second, 1_000.0), "{world:?}");
    // At the same moment there is no rate.
    world.answered(answer(begin, 2.0, 2_050, 13));
    assert_eq!(world.steps_per_second, None);
}

#[test]
fn a_lost_world_keeps_its_name_and_nothing_of_the_moment() {
    let mut world = World::new("lab:1".into());
    world.name = Some("lab".into());
    world.answered(answer(Instant::now(), 0.0, 10, 1));
    world.lost("gone".into());
    assert_eq!((world.link, world.label(), world.endpoint.as_str()), (Link::Lost, "lab", "lab:1"));
    assert_eq!((world.real_time_factor, world.error.as_deref()), (None, Some("gone")));
    world.answered(answer(Instant::now(), 9.0, 20, 2));
    assert_eq!((world.link, &world.error), (Link::Here, &None));
}

#[test]
fn a_step_that_does_not_end_is_shown() {
    let begin = Instant::now();
    let mut world = World::new("lab:1".into());
    world.answered(answer(begin, 0.0, 10, 1));
    let mut stuck = answer(begin, 1.0, 20, 2);
    stuck.statistics.step_duration = 7.0;
    world.answered(stuck);
    assert_eq!(world.step_duration, Some(7.0));
}

#[test]
fn histograms_that_do_not_fit_have_no_figures() {
    let histogram =
        |counts: Vec<u64>| DurationHistogram { sum: 1.0, upper_bounds: vec![1.0, f64::INFINITY], counts };
    for (then, now) in [(vec![1, 0], vec![1]), (vec![], vec![1, 2]), (vec![3, 3], vec![3, 3])] {
        assert!(Between::new(&histogram(then), &histogram(now)).is_none());
    }
    let (then, now) = (histogram(vec![0, 0]), histogram(vec![0, 5]));
    assert_eq!(Between::new(&then, &now).unwrap().quantile(0.99), f64::INFINITY);
}
