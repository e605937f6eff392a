//! Equal worlds give equal readings: after a restore, through a file, and in a second run, without tolerance.

use std::sync::Arc;

use glamx::DPose3;
use simd_core::simulation::command::CreateSensor;
use simd_core::{Command, Simulation};
use simd_model::sensor::{ChannelNoise, Channels, Noise, RangeLimits, Scan, SensorKind, Sweep};
use simd_tests::scenes::apply;

use super::{add, create, sample};
use crate::chains::chain;
use crate::saved_state_files::through_a_file;
use simd_tests::world::{passive, world};

fn noisy(channels: Channels) -> ChannelNoise {
    let noise = Noise {
        standard_deviation: 0.1,
        bias_mean: 0.2,
        bias_standard_deviation: 0.3,
        random_walk: 0.4,
        correlation_time: None,
        quantum: 0.0,
        dropout: 0.05,
    };
    ChannelNoise { channels, axis: None, noise }
}

/// Two rods that swing, with a sensor of each kind, all of them noisy.
fn swinging(seed: u64) -> Simulation {
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(chain(2)), false, &[0.4, -0.9]))));
    let range = RangeLimits { least: 0.0, most: 9.0 };
    let scan = Scan {
        horizontal: Sweep { samples: 3, least: -1.0, most: 1.0 },
        vertical: Sweep::one(0.0),
        range,
        rolling: false,
    };
    let kinds = [
        SensorKind::Imu,
        SensorKind::ForceTorque { axes: Default::default(), direction: Default::default() },
        SensorKind::Contact { threshold: 0.0 },
        SensorKind::Range(range),
        SensorKind::Lidar(scan),
        SensorKind::LinkState,
        SensorKind::Encoder { backlash: 0.3 },
        SensorKind::Odometry,
    ];
    for (index, kind) in kinds.into_iter().enumerate() {
        let on = if kind.is_of_joint() { "joint-2" } else { "link-2" };
        let noise = kind.channels().iter().map(|(channels, _)| noisy(*channels)).collect();
        let rate = (index % 2 == 0).then_some(300.0);
        add(
            &mut world,
            CreateSensor { noise, rate, seed: Some(seed), ..create("robot", on, DPose3::IDENTITY, kind) },
        );
    }
    world
}

/// Readings as bits: NaN is equal to itself there.
fn run(world: &mut Simulation, steps: usize) -> Vec<(String, u64, u64, String)> {
    let mut list = Vec::new();
    for _ in 0..steps {
        for reading in sample(world) {
            // Debug has all digits of a number.
            let measured = format!("{:?}", reading.measurement);
            list.push((reading.definition.name.clone(), reading.sample, reading.at.step, measured));
        }
    }
    list
}

#[test]
fn the_same_readings_follow_after_a_restore() {
    let mut world = swinging(7);
    run(&mut world, 137);
    apply(&mut world, Command::SaveState { name: "half".into() });
    let before = world.fingerprint();
    let first = run(&mut world, 200);
    assert!(first.len() > 500, "{}", first.len());
    apply(&mut world, Command::RestoreState { name: "half".into() });
    assert_eq!(world.fingerprint(), before);
    assert_eq!(run(&mut world, 200), first);

    // Through a file, into a world of another history.
    let saved = through_a_file(&world, "half");
    let mut other = simd_tests::world::world(1e-3);
    other.step();
    apply(&mut other, Command::ImportSavedState { name: "half".into(), saved });
    apply(&mut other, Command::RestoreState { name: "half".into() });
    assert_eq!(other.fingerprint(), before);
    assert_eq!(run(&mut other, 200), first);
}

#[test]
fn a_second_run_gives_the_same_readings_and_another_seed_others() {
    let all = run(&mut swinging(7), 300);
    assert_eq!(run(&mut swinging(7), 300), all);
    let other = run(&mut swinging(8), 300);
    let imus = |of: &[(String, u64, u64, String)]| -> Vec<_> {
        of.iter().filter(|reading| reading.0 == "imu_1").cloned().collect()
    };
    let (one, two) = (imus(&all), imus(&other));
    assert!(one.len() > 50 && two.len() > 50, "{} {}", one.len(), two.len());
    assert!(one.iter().all(|reading| !two.contains(reading)));
}

/// Sensors do not affect motion.
#[test]
fn a_world_with_sensors_moves_as_one_without() {
    let (mut with, mut without) = (swinging(7), world(1e-3));
    apply(&mut without, Command::Spawn(Box::new(passive(&Arc::new(chain(2)), false, &[0.4, -0.9]))));
    for _ in 0..500 {
        with.step();
        without.step();
        let states = [&with, &without].map(|world| simd_tests::world::look(world).fingerprint());
        assert_eq!(states[0], states[1]);
    }
}

/// The next step drops them: their data is gone with the state that was published then.
#[test]
fn samples_that_are_not_taken_do_not_gather() {
    let mut world = swinging(7);
    (0..3_000).for_each(|_| world.step());
    let mut due = Vec::new();
    world.take_due_samples(&mut due);
    assert!((4..=8).contains(&due.len()), "{}", due.len());
    assert!(due.iter().all(|sample| sample.at.step == 3_000));
    let taken = due.len();
    world.take_due_samples(&mut due);
    assert_eq!(due.len(), taken);
    // An older state has no readings.
    let (state, mut readings) = (simd_tests::world::look(&world), Vec::new());
    world.step();
    let mut next = Vec::new();
    world.take_due_samples(&mut next);
    state.readings(&next, &mut readings);
    assert_eq!(readings.len(), 0);
    state.readings(&due, &mut readings);
    assert!(!readings.is_empty());
}
