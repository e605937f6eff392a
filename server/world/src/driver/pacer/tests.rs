//! The pacer, with given times.

use super::*;

const LIMIT: Duration = Duration::from_millis(200);
const MS: Duration = Duration::from_millis(1);

/// Plays until `end`, with waits that end `late` after their deadline and steps that take `cost`. Returns the
/// number of steps and the time after the last.
fn play(pacer: &mut Pacer, from: Instant, end: Instant, late: Duration, cost: Duration) -> (u64, Instant) {
    let (mut now, mut steps) = (from, 0);
    loop {
        if let Due::At(deadline) = pacer.next(now) {
            now = deadline + late;
        }
        if now >= end {
            return (steps, now);
        }
        pacer.stepped();
        steps += 1;
        now += cost;
    }
}

#[test]
fn a_million_late_wakeups_do_not_add_up_to_drift() {
    let start = Instant::now();
    // A third of a millisecond is not a whole number of nanoseconds.
    let period = 1e-3 / 3.0;
    let mut pacer = Pacer::new(Some(period), LIMIT, start);
    for step in 1..=1_000_000_u64 {
        let Due::At(deadline) = pacer.next(start + Duration::from_secs_f64(period * (step - 1) as f64))
        else {
            panic!("step {step} is due before its time");
        };
        let error = (deadline - start).as_secs_f64() - period * step as f64;
        assert!(error.abs() < 2e-9, "step {step} is off by {error} s");
        pacer.stepped();
    }
    assert_eq!(pacer.overruns(), 0);
}

#[test]
fn steps_shorter_than_the_timer_run_in_real_time_by_several_a_wakeup() {
    let start = Instant::now();
    let mut pacer = Pacer::new(Some(1e-4), LIMIT, start);
    let late = Duration::from_micros(350);
    let (steps, _) = play(&mut pacer, start, start + Duration::from_secs(10), late, Duration::from_micros(5));
    assert!(steps.abs_diff(100_000) < 10, "{steps} steps of 0.1 ms in 10 s");
    assert_eq!(pacer.overruns(), 0);
}

#[test]
fn lag_within_the_limit_is_made_good() {
    let start = Instant::now();
    let mut pacer = Pacer::new(Some(1e-3), LIMIT, start);
    let mut now = start + 100 * MS;
    let mut without_waiting = 0;
    while pacer.next(now) == Due::Now {
        pacer.stepped();
        without_waiting += 1;
        now += Duration::from_nanos(100);
    }
    assert_eq!(without_waiting, 100);
    assert_eq!((pacer.overruns(), pacer.dropped_lag()), (0, 0.0));
}

#[test]
fn lag_beyond_the_limit_is_dropped_counted_and_never_repaid() {
    let start = Instant::now();
    let mut pacer = Pacer::new(Some(1e-3), LIMIT, start);
    let now = start + 501 * MS;
    assert_eq!(pacer.next(now), Due::Now);
    assert_eq!(pacer.overruns(), 1);
    assert!((pacer.dropped_lag() - 0.5).abs() < 1e-9);
    pacer.stepped();
    assert_eq!(pacer.next(now), Due::At(now + MS), "the lag is not repaid");
    let (steps, _) = play(&mut pacer, now, now + Duration::from_secs(1), Duration::ZERO, Duration::ZERO);
    assert_eq!(steps, 999);
}

#[test]
fn a_world_that_is_too_slow_drops_what_it_cannot_do() {
    let start = Instant::now();
    let mut pacer = Pacer::new(Some(1e-3), LIMIT, start);
    let (steps, end) = play(&mut pacer, start, start + Duration::from_secs(10), Duration::ZERO, 2 * MS);
    let lag = (end - start).as_secs_f64() - steps as f64 * 1e-3;
    assert!(pacer.dropped_lag() > lag - 0.25 && pacer.dropped_lag() <= lag);
    // A lag of 0.2 s accumulates in 0.4 s.
    assert!((20..30).contains(&pacer.overruns()), "{}", pacer.overruns());
}

#[test]
fn lag_is_reported_at_once_and_then_once_a_second() {
    let start = Instant::now();
    let mut pacer = Pacer::new(Some(1e-3), LIMIT, start);
    assert_eq!(pacer.report(start), None);
    let mut now = start + 301 * MS;
    pacer.next(now);
    assert!((pacer.report(now).unwrap() - 0.3).abs() < 1e-9);
    now += 301 * MS;
    pacer.next(now);
    assert_eq!(pacer.report(now), None, "too soon");
    now += Duration::from_secs(1);
    assert!((pacer.report(now).unwrap() - 0.301).abs() < 1e-9);
}

#[test]
fn a_pause_is_not_a_lag() {
    let start = Instant::now();
    let mut pacer = Pacer::new(Some(1e-3), LIMIT, start);
    let played = start + Duration::from_secs(3600);
    pacer.restart(played);
    assert_eq!(pacer.next(played), Due::At(played + MS));
    assert_eq!(pacer.overruns(), 0);
}

#[test]
fn a_new_period_holds_from_the_next_step_on() {
    let start = Instant::now();
    let mut pacer = Pacer::new(Some(1e-3), LIMIT, start);
    pacer.stepped();
    pacer.set_period(Some(1e-2), start);
    assert_eq!(pacer.next(start + MS), Due::At(start + 11 * MS));
}

#[test]
fn as_fast_as_possible_never_waits_and_is_never_late() {
    let start = Instant::now();
    let mut pacer = Pacer::new(None, LIMIT, start);
    let now = start + Duration::from_secs(5);
    assert_eq!(pacer.next(now), Due::Now);
    pacer.set_period(Some(1e-3), now);
    assert_eq!(pacer.next(now), Due::At(now + MS));
    assert_eq!(pacer.overruns(), 0);
}
