//! Readings are kept in order and within bounds, lost ones are counted, and scans are measured newest first.

use std::time::{Duration, SystemTime};

use glamx::DPose3;
use simd_core::simulation::measure::{EncoderMeasurement, Measurement};
use simd_core::simulation::published_state::WorldLayout;
use simd_core::simulation::sensors::{DueSample, SensorDefinition};
use simd_core::{Moment, PhysicsSettings, PublishedState};
use simd_model::sensor::{SensorKind, SensorMount, WrenchAxes, WrenchDirection};

use super::ring::MAX_READINGS;
use super::*;
use crate::driver::published::{Pace, Statistics};
use crate::driver::published_state_cell::Publisher;
use crate::run_state::RunState;

/// A log, and a publisher whose states have sensors with these ids.
struct Bench {
    publisher: Publisher,
    log: Arc<SensorLog>,
    writer: SensorWriter,
}

impl Bench {
    fn new(ids: &[u64]) -> Self {
        let statistics = Statistics::at_start(RunState::Paused, Pace::default());
        let publisher = Publisher::new(PublishedState::default(), PhysicsSettings::default(), statistics);
        let (log, writer) = SensorLog::new(publisher.state_cell().clone());
        let mut bench = Self { publisher, log, writer };
        bench.has(ids);
        bench
    }

    /// Sets the present sensors.
    fn has(&mut self, ids: &[u64]) {
        let sensors = ids.iter().map(|id| WorldSensor { id: *id, robot: 0, definition: definition() });
        let sensors = Arc::new(sensors.collect::<Vec<_>>());
        self.publisher.publish(|state| state.state.sensors = sensors);
        self.writer.published();
    }

    /// Makes a step with a reading of each of these sensors, whose value is the step's number.
    fn step(&mut self, ids: &[u64], step: u32) {
        let readings = ids.iter().map(|id| reading(*id, step)).collect();
        self.writer.put(of_state(), readings);
    }

    /// Returns the values of a sensor's readings after a number, the number of lost ones, and the number for
    /// the next call.
    fn after(&self, id: u64, after: u64) -> (Vec<u32>, u64, u64) {
        let batch = self.log.after(&[(id, after)], usize::MAX).remove(0);
        (batch.readings.iter().map(said).collect(), batch.missed, batch.after)
    }
}

fn definition() -> Arc<SensorDefinition> {
    Arc::new(SensorDefinition {
        name: "it".into(),
        on: SensorMount::Joint(0),
        link: 0,
        pose: DPose3::IDENTITY,
        rate: None,
        kind: SensorKind::ForceTorque { axes: WrenchAxes::Child, direction: WrenchDirection::ChildOnParent },
        noise: Vec::new(),
        seed: 0,
        is_described: false,
    })
}

fn with(id: u64, measurement: Measurement) -> SensorReading {
    let (definition, world, at) = (definition(), Arc::new(WorldLayout::default()), Moment::default());
    SensorReading { id, definition, robot: 0, world, sample: 1, at, period: 1e-3, measurement }
}

fn reading(id: u64, step: u32) -> SensorReading {
    with(id, Measurement::Encoder(EncoderMeasurement { position: f64::from(step), velocity: 0.0 }))
}

fn of_state() -> OfState {
    OfState { wall_time: SystemTime::UNIX_EPOCH, sequence: 1 }
}

fn said(reading: &LoggedReading) -> u32 {
    let Measured::Encoder(encoder) = &reading.measured else { panic!("{reading:?}") };
    encoder.position as u32
}

#[test]
fn readings_are_numbered_by_sensor_and_read_after_a_number() {
    let mut bench = Bench::new(&[7, 8]);
    assert_eq!(bench.after(7, 0), (vec![], 0, 0));
    (1..=3).for_each(|step| bench.step(&[7, 8], step));
    assert_eq!(bench.after(7, 0), (vec![1, 2, 3], 0, 3));
    assert_eq!(bench.after(8, 2), (vec![3], 0, 3));
    assert_eq!(bench.after(8, 3), (vec![], 0, 3));
    assert_eq!(bench.after(9, 5), (vec![], 0, 5), "there is no such sensor");
    assert_eq!(bench.after(8, 99), (vec![1, 2, 3], 0, 3), "the number is of another life of the daemon");
    let newest = bench.log.newest([8]).remove(0);
    assert_eq!((newest.readings.iter().map(said).collect::<Vec<_>>(), newest.after), (vec![3], 3));
}

#[test]
fn a_slow_reader_gets_the_number_of_those_that_it_missed() {
    let mut bench = Bench::new(&[7]);
    let steps = MAX_READINGS as u32 + 10;
    for step in 1..=steps {
        bench.step(&[7], step);
        // More than the queue holds.
        bench.log.tidy();
    }
    let (readings, missed, after) = bench.after(7, 4);
    assert_eq!((readings.len(), readings[0], missed, after), (MAX_READINGS, 11, 6, u64::from(steps)));
}

#[test]
fn a_full_queue_drops_the_oldest_and_counts_them_where_they_are_missing() {
    let mut bench = Bench::new(&[7]);
    let full = MAX_STEPS as u32;
    (1..=10).for_each(|step| bench.step(&[7], step));
    // A look in between.
    bench.log.tidy();
    (11..=full + 30).for_each(|step| bench.step(&[7], step));
    // The ring is as long as the queue, so earlier readings are lost too.
    let (readings, missed, after) = bench.after(7, 5);
    assert_eq!((readings.len(), readings[0], missed), (MAX_READINGS, 31, 25));
    assert_eq!(after, u64::from(full) + 30);
    assert_eq!(bench.log.waiting.load(Ordering::Relaxed), 0);
}

#[test]
fn dropped_readings_are_counted_at_their_place() {
    let mut bench = Bench::new(&[7]);
    (1..=10).for_each(|step| bench.step(&[7], step));
    bench.log.tidy();
    (11..=20).for_each(|step| bench.step(&[7], step));
    // Readings that did not fit.
    (0..4).for_each(|_| drop(bench.log.arrived.pop()));
    assert_eq!(bench.after(7, 0), ((1..=10).chain(15..=20).collect(), 4, 20));
    assert_eq!(bench.after(7, 10), ((15..=20).collect(), 4, 20));
    assert_eq!(bench.after(7, 12), ((15..=20).collect(), 2, 20));
}

#[test]
fn large_readings_are_kept_in_bytes_and_the_newest_always() {
    let ids: Vec<u64> = (1..=64).collect();
    let mut bench = Bench::new(&ids);
    // With 64 sensors, each has 1 MiB.
    let scan = |rays: usize| with(7, Measurement::Lidar(vec![1.0; rays]));
    for _ in 0..10 {
        bench.writer.put(of_state(), vec![scan(100_000)]);
    }
    let kept = bench.log.after(&[(7, 0)], usize::MAX).remove(0);
    assert_eq!((kept.readings.len(), kept.missed, kept.after), (2, 8, 10));
    bench.writer.put(of_state(), vec![scan(1_000_000)]);
    let kept = bench.log.after(&[(7, 10)], 1).remove(0);
    assert_eq!((kept.readings.len(), kept.missed), (1, 0), "one is read however small the room is");
    assert_eq!(bench.log.after(&[(7, 0)], usize::MAX).remove(0).readings.len(), 1);
}

#[test]
fn each_sensor_has_its_part_of_an_answer_and_the_rest_comes_with_the_next() {
    let mut bench = Bench::new(&[7, 8]);
    (1..=100).for_each(|step| bench.step(&[7, 8], step));
    let of_one = bench.log.newest([7])[0].readings[0].bytes();
    let first = bench.log.after(&[(7, 0), (8, 0)], 20 * of_one);
    let figures = |batch: &ReadingBatch| (batch.readings.len(), batch.missed, batch.after);
    assert_eq!(first.iter().map(figures).collect::<Vec<_>>(), [(10, 0, 10), (10, 0, 10)]);
    let rest = bench.log.after(&[(7, first[0].after)], usize::MAX);
    assert_eq!(figures(&rest[0]), (90, 0, 100));
}

#[test]
fn a_sensor_that_is_created_again_continues_the_numbers_of_the_earlier_one() {
    let mut bench = Bench::new(&[7]);
    (1..=5).for_each(|step| bench.step(&[7], step));
    let (_, _, after) = bench.after(7, 0);
    bench.has(&[8]);
    bench.step(&[8], 6);
    assert_eq!(bench.after(8, after), (vec![6], 0, after + 1));
    // A reading that arrives after its sensor was deleted is dropped.
    bench.step(&[7], 7);
    assert_eq!(bench.after(7, 0), (vec![], 0, 0));
    assert_eq!(bench.log.last_sequences([7, 8]), [0, after + 1]);
}

#[tokio::test]
async fn a_waiting_reader_is_woken() {
    let mut bench = Bench::new(&[7]);
    let log = bench.log.clone();
    let read = async {
        loop {
            let grown = log.grown();
            let batch = log.after(&[(7, 0)], usize::MAX).remove(0);
            if batch.is_news() {
                return batch.readings.len();
            }
            grown.await;
        }
    };
    let read = async {
        tokio::select! {
            read = tokio::time::timeout(Duration::from_secs(60), read) => read,
            () = log.announce() => unreachable!("it goes on"),
        }
    };
    let write = async {
        // Yields until the reader waits.
        tokio::task::yield_now().await;
        bench.step(&[7], 1);
        bench.writer.announce();
    };
    let (read, ()) = tokio::join!(read, write);
    assert_eq!(read, Ok(1));
}

mod scans {
    use glamx::DVec3;

    use super::*;
    use crate::driver::published::Published;

    fn due(state: &Arc<Published>, ids: &[u64]) -> DueSamples {
        let sample = |id: &u64| DueSample {
            id: *id,
            definition: definition(),
            robot: 0,
            sample: state.sequence,
            at: Moment::default(),
            period: 0.1,
            gravity: DVec3::ZERO,
            stream: 0,
            walk: Default::default(),
            start: DPose3::IDENTITY,
            shaft: Default::default(),
        };
        let counted = |id| CountedSample { count: state.sequence, sample: sample(id) };
        DueSamples { state: Arc::clone(state), samples: ids.iter().map(counted).collect() }
    }

    /// Returns states with increasing sequences.
    fn states(count: usize) -> Vec<Arc<Published>> {
        let mut bench = Bench::new(&[]);
        let state = |_| {
            bench.publisher.publish(|_| ());
            bench.publisher.state_cell().newest()
        };
        (0..count).map(state).collect()
    }

    #[test]
    fn the_newest_sample_of_each_sensor_waits_and_one_is_measured_at_a_time() {
        let (states, mut scans) = (states(3), Scans::default());
        scans.add(due(&states[0], &[1, 2]));
        let (state, sample) = scans.begin().unwrap();
        assert_eq!((state.sequence, sample.sample.id), (states[0].sequence, 1));
        scans.add(due(&states[1], &[1, 2]));
        scans.add(due(&states[2], &[1]));
        assert_eq!(scans.due_by(1), Some(states[2].sequence));
        assert_eq!(
            scans.begin().map(|(state, sample)| (state.sequence, sample.sample.id)),
            Some((states[1].sequence, 2))
        );
        assert!(scans.begin().is_none() && !scans.is_ready(), "one of 1 and one of 2 are being measured");
        scans.end(1);
        assert_eq!(
            scans.begin().map(|(state, sample)| (state.sequence, sample.sample.id)),
            Some((states[2].sequence, 1))
        );
        assert_eq!(scans.due_by(1), Some(states[2].sequence), "it is being measured");
        scans.end(1);
        assert_eq!(scans.due_by(1), None);
    }

    #[test]
    fn sensors_take_turns_if_not_all_can_be_measured() {
        let (states, mut scans) = (states(9), Scans::default());
        scans.add(due(&states[0], &[1, 2, 3]));
        let mut measured = Vec::new();
        for state in &states[1..7] {
            let (_, sample) = scans.begin().unwrap();
            scans.add(due(state, &[1, 2, 3]));
            scans.end(sample.sample.id);
            measured.push(sample.sample.id);
        }
        assert_eq!(measured, [1, 2, 3, 1, 2, 3]);
        // A sensor is not preferred because its sample has an older state.
        let mut scans = Scans::default();
        scans.add(due(&states[6], &[1, 2]));
        assert_eq!(scans.begin().map(|(_, sample)| sample.sample.id), Some(1));
        scans.add(due(&states[7], &[1]));
        scans.add(due(&states[8], &[2]));
        scans.end(1);
        assert_eq!(scans.begin().map(|(_, sample)| sample.sample.id), Some(2));
    }

    #[tokio::test]
    async fn measuring_threads_neither_wait_for_the_log_nor_hold_it() {
        let bench = Bench::new(&[1]);
        let state = bench.publisher.state_cell().newest();
        bench.log.due.force_push(due(&state, &[1]));
        let mut scan = bench.log.next_scan().await;
        let kept = bench.log.collected();
        let measured = std::thread::spawn(move || {
            scan.measure(&|| false);
            scan
        });
        let scan = measured.join().unwrap();
        drop(kept);
        assert!(!bench.log.are_measured(&[(1, state.sequence)]), "it is not handed over yet");
        drop(scan);
        assert!(bench.log.are_measured(&[(1, state.sequence)]));
    }

    #[test]
    fn few_states_are_held_and_none_for_sensors_that_went() {
        let (states, mut scans) = (states(40), Scans::default());
        (0..40).for_each(|index| scans.add(due(&states[index], &[index as u64])));
        let held: Vec<u64> = (0..40).filter(|id| scans.due_by(*id).is_some()).collect();
        assert_eq!(held, (24..40).collect::<Vec<u64>>(), "sixteen states are held");
        scans.retain(|id| id == 39);
        assert_eq!(scans.begin().map(|(_, sample)| sample.sample.id), Some(39));
        assert!(scans.begin().is_none());
    }

    #[tokio::test]
    async fn a_scan_that_gives_nothing_lets_the_next_begin_which_counts_it_as_missed() {
        let mut bench = Bench::new(&[1]);
        let state = bench.publisher.state_cell().newest();
        let scan_of = |count| {
            let mut due = due(&state, &[1]);
            due.samples[0].count = count;
            bench.log.due.force_push(due);
            bench.log.next_scan()
        };
        let mut scan = scan_of(1).await;
        assert_eq!(bench.log.scans_due([1]), [(1, state.sequence)]);
        assert!(!bench.log.are_measured(&[(1, state.sequence)]));
        // The state has no robot.
        scan.measure(&|| false);
        drop(scan);
        assert!(bench.log.are_measured(&[(1, state.sequence)]));
        assert_eq!(bench.after(1, 0), (vec![], 0, 0));
        let mut scan = scan_of(2).await;
        scan.reading = Some(reading(1, 5));
        drop(scan);
        assert_eq!(bench.after(1, 0), (vec![5], 1, 2));
        bench.has(&[]);
        assert!(bench.log.scans_due([1]).is_empty());
    }
}
