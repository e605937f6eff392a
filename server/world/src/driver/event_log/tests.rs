//! The log of events, without a driver.

use simd_core::simulation::event::Claimed;

use super::*;

const KEPT: usize = 1024;

fn overrun(log: &EventLog) {
    log.push(SystemTime::UNIX_EPOCH, 0, LogEvent::Overrun { at: Moment::default(), dropped_lag: 1.0 });
}

#[test]
fn events_are_numbered_from_one_and_read_after_a_number() {
    let log = EventLog::new(KEPT);
    assert_eq!(log.after(0), EventBatch::default());
    (0..3).for_each(|_| overrun(&log));
    let batch = log.after(1);
    assert_eq!(batch.events.iter().map(|e| e.sequence).collect::<Vec<_>>(), [2, 3]);
    assert_eq!((batch.missed, batch.last_sequence), (0, 3));
}

#[test]
fn a_slow_reader_learns_how_many_it_missed() {
    let log = EventLog::new(KEPT);
    (0..KEPT + 10).for_each(|_| overrun(&log));
    let batch = log.after(4);
    assert_eq!(batch.events.len(), KEPT);
    assert_eq!(batch.events[0].sequence, 11);
    assert_eq!(batch.missed, 6);
}

#[test]
fn long_events_are_kept_in_bytes_and_the_newest_always() {
    let log = EventLog::new(KEPT);
    let claimed = |joints: usize| {
        let claimed = Claimed { joints: vec!["j".repeat(1024); joints], ..Claimed::default() };
        let kind = EventKind::JointsClaimed { holder: "me".into(), claimed };
        let event = Event { at: Moment::default(), kind };
        log.push(SystemTime::UNIX_EPOCH, 0, LogEvent::World(event));
    };
    (0..100).for_each(|_| claimed(1000));
    let batch = log.after(0);
    assert_eq!((batch.events.len(), batch.missed), (2, 98));
    claimed(10_000);
    assert_eq!(log.after(0).events.len(), 1);
    (0..KEPT).for_each(|_| overrun(&log));
    assert_eq!(log.after(0).events.len(), KEPT);
    assert_eq!(log.collected().bytes, 0);
}

#[test]
fn a_number_from_another_life_of_the_daemon_reads_nothing() {
    let log = EventLog::new(KEPT);
    overrun(&log);
    assert_eq!(log.after(99).events, []);
}

#[tokio::test]
async fn a_waiting_reader_gets_the_next_event() {
    let log = EventLog::new(KEPT);
    let read = async {
        tokio::select! {
            read = log.next(0, Duration::from_secs(60)) => read,
            () = log.announce() => unreachable!("it goes on"),
        }
    };
    let write = async { overrun(&log) };
    let (batch, ()) = tokio::join!(read, write);
    assert_eq!(batch.events.len(), 1);
}

/// The driver logs events, and must not wait for readers.
#[test]
fn events_are_logged_while_a_reader_holds_those_that_are_kept() {
    let log = EventLog::new(KEPT);
    let held = log.kept.lock().unwrap();
    (0..3).for_each(|_| overrun(&log));
    drop(held);
    assert_eq!(log.after(0).events.iter().map(|e| e.sequence).collect::<Vec<_>>(), [1, 2, 3]);
}

#[test]
fn events_without_end_that_no_reader_looks_at_take_no_more_memory() {
    let log = EventLog::new(KEPT);
    (0..3 * MAX_WAITING).for_each(|_| overrun(&log));
    let batch = log.after(0);
    assert_eq!((batch.events.len(), batch.last_sequence), (KEPT, 3 * MAX_WAITING as u64));
    assert!(log.collected().early.is_empty());
}

/// Two threads log, and the one with the larger number is faster.
#[test]
fn an_event_is_read_once_those_before_it_are_there() {
    let log = EventLog::new(KEPT);
    let event = |sequence| {
        let what = LogEvent::Overrun { at: Moment::default(), dropped_lag: 1.0 };
        Arc::new(LoggedEvent { sequence, wall_time: SystemTime::UNIX_EPOCH, state_sequence: 0, what })
    };
    log.arrived.push(event(2)).unwrap();
    assert_eq!(log.after(0), EventBatch::default());
    log.arrived.push(event(1)).unwrap();
    assert_eq!(log.after(0).events.iter().map(|e| e.sequence).collect::<Vec<_>>(), [1, 2]);
}
