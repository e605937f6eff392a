//! Noise of each quantity of each kind of sensor, compared with the parameters. Every number has a separate
//! deviation, bias and quantum, and separate random numbers.

use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::{CreateSensor, PhysicsChange};
use simd_core::simulation::measure::Measurement;
use simd_core::{Command, Simulation};
use simd_model::sensor::{ChannelNoise, Channels, Noise, RangeLimits, SensorKind};
use simd_tests::scenes::{apply, plane, robot, spawn};

use super::{add, create, measured};
use crate::chains::chain;
use simd_tests::world::{passive, world};

const SAMPLES: usize = 4_000;

/// Returns all kinds with noise except lidars, whose rays have separate tests.
fn kinds() -> [SensorKind; 7] {
    [
        SensorKind::Imu,
        SensorKind::ForceTorque { axes: Default::default(), direction: Default::default() },
        SensorKind::Contact { threshold: 0.0 },
        SensorKind::Range(RangeLimits { least: 0.0, most: 90.0 }),
        SensorKind::LinkState,
        SensorKind::Encoder { backlash: 0.0 },
        SensorKind::Odometry,
    ]
}

/// Returns a rod that stands still, level, without gravity, in front of a wall. It has one sensor of each
/// kind, with this noise for each of its numbers.
fn still(seed: u64, noise: impl Fn(Channels, usize) -> Noise) -> Simulation {
    let mut world = world(1e-3);
    let change = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    apply(&mut world, Command::SetPhysics(change));
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(chain(1)), false, &[0.0]))));
    let at = DPose3::from_translation(DVec3::X * 50.0);
    spawn(&mut world, robot("wall", &plane(-DVec3::X), at, true));
    for kind in kinds() {
        let on = if kind.is_of_joint() { "joint-1" } else { "link-1" };
        let of = |&(channels, count): &(Channels, usize)| -> Vec<ChannelNoise> {
            let one = |axis| ChannelNoise { channels, axis: Some(axis as u8), noise: noise(channels, axis) };
            (0..count).map(one).collect()
        };
        let noise = kind.channels().iter().flat_map(of).collect();
        let sensor = create("robot", on, DPose3::IDENTITY, kind);
        add(&mut world, CreateSensor { noise, seed: Some(seed), ..sensor });
    }
    world
}

/// Returns the numbers of a measurement as they are drawn, in the order of `SensorKind::channels`: of an
/// orientation the small turn.
fn numbers(of: &Measurement) -> Vec<f64> {
    let turn = |turn: DQuat| turn.to_scaled_axis();
    let vectors: Vec<DVec3> = match of {
        Measurement::Imu(imu) => vec![imu.linear_acceleration, imu.angular_velocity, turn(imu.orientation)],
        Measurement::ForceTorque(wrench) => vec![wrench.force, wrench.torque],
        Measurement::Contact(contact) => vec![contact.force],
        Measurement::Range(range) => return vec![*range],
        Measurement::Encoder(encoder) => return vec![encoder.position, encoder.velocity],
        Measurement::LinkState(motion) | Measurement::Odometry(motion) => {
            vec![motion.pose.translation, turn(motion.pose.rotation), motion.linear, motion.angular]
        }
        Measurement::Lidar(_) => panic!("there is no lidar"),
    };
    vectors.into_iter().flat_map(|vector| vector.to_array()).collect()
}

/// Returns all numbers of all sensors after a step.
fn all(world: &mut Simulation) -> Vec<f64> {
    measured(world).iter().flat_map(numbers).collect()
}

/// Returns the channel and the axis of each number, in the same order.
fn names() -> Vec<(SensorKind, Channels, usize)> {
    let of = |kind: SensorKind| {
        let channels = kind.channels().iter();
        channels.flat_map(move |&(channels, count)| (0..count).map(move |axis| (kind, channels, axis)))
    };
    kinds().into_iter().flat_map(of).collect()
}

/// Different for each quantity, by the letters of its name, and for each axis; and small.
fn deviation(channels: Channels, axis: usize) -> f64 {
    let quantity = f64::from(format!("{channels:?}").len() as u32);
    1e-3 * (quantity + 0.3 * axis as f64)
}

/// For 4,000 samples, the error of a deviation is 1.1 %, and the error of their mean s / 63. The error of the
/// correlation of two independent ones is 0.016. Bounds are four and a half times that.
#[test]
fn every_number_scatters_by_what_was_asked_for_it_and_on_its_own() {
    let mut silent = still(11, |_, _| Noise::default());
    let truth = all(&mut silent);
    let mut world = still(11, |channels, axis| Noise {
        standard_deviation: deviation(channels, axis),
        ..Noise::default()
    });
    let mut drawn: Vec<Vec<f64>> = vec![Vec::with_capacity(SAMPLES); truth.len()];
    for _ in 0..SAMPLES {
        for ((drawn, measured), truth) in drawn.iter_mut().zip(all(&mut world)).zip(&truth) {
            drawn.push(measured - truth);
        }
    }
    let names = names();
    assert_eq!(names.len(), truth.len());
    let count = SAMPLES as f64;
    for ((kind, channels, axis), drawn) in names.iter().zip(&mut drawn) {
        let asked = deviation(*channels, *axis);
        let mean = drawn.iter().sum::<f64>() / count;
        let found = (drawn.iter().map(|value| value * value).sum::<f64>() / count).sqrt();
        assert!((found / asked - 1.0).abs() < 0.05, "{kind:?} {channels:?} {axis}: {found}, not {asked}");
        assert!(mean.abs() < 4.5 * asked / count.sqrt(), "{kind:?} {channels:?} {axis}: {mean} on average");
        drawn.iter_mut().for_each(|value| *value /= asked);
    }
    for (one, first) in drawn.iter().enumerate() {
        for (other, second) in drawn.iter().enumerate().skip(one + 1) {
            let product: f64 = first.iter().zip(second).map(|(a, b)| a * b).sum();
            let correlation = product / count;
            assert!(correlation.abs() < 0.08, "{:?} and {:?}: {correlation}", names[one], names[other]);
        }
    }
}

/// A constant bias shifts each number separately, to rounding; an orientation is turned by it.
#[test]
fn every_number_has_its_own_bias() {
    let truth = all(&mut still(11, |_, _| Noise::default()));
    let mut world =
        still(11, |channels, axis| Noise { bias_mean: deviation(channels, axis), ..Noise::default() });
    for _ in 0..3 {
        for (((kind, channels, axis), measured), truth) in names().iter().zip(all(&mut world)).zip(&truth) {
            let moved = measured - truth;
            let asked = deviation(*channels, *axis);
            assert!((moved - asked).abs() < 1e-12, "{kind:?} {channels:?} {axis}: {moved}, not {asked}");
        }
    }
}

/// Whole multiples of the quantum, and several of them. An orientation has no quantum.
#[test]
fn every_number_has_its_own_quantum() {
    let quantum = |channels, axis| match channels {
        Channels::Orientation => 0.0,
        _ => deviation(channels, axis),
    };
    let mut world = still(11, |channels, axis| Noise {
        standard_deviation: 2.0 * deviation(channels, axis),
        quantum: quantum(channels, axis),
        ..Noise::default()
    });
    let names = names();
    let mut different = vec![std::collections::BTreeSet::new(); names.len()];
    for _ in 0..200 {
        for (index, measured) in all(&mut world).into_iter().enumerate() {
            let (kind, channels, axis) = names[index];
            let quantum = quantum(channels, axis);
            if quantum > 0.0 {
                let counted = measured / quantum;
                let error = (counted - counted.round()).abs();
                assert!(error < 1e-9 * counted.abs().max(1.0), "{kind:?} {channels:?} {axis}: {counted}");
                different[index].insert(counted.round() as i64);
            }
        }
    }
    let few = names
        .iter()
        .zip(&different)
        .find(|((_, of, _), seen)| *of != Channels::Orientation && seen.len() < 5);
    assert!(few.is_none(), "{few:?}");
}

/// For 64 walks of each number, by as many seeds, the deviation is the given one: it is known to 9 %.
#[test]
fn every_number_walks_as_far_as_was_asked() {
    let truth = all(&mut still(11, |_, _| Noise::default()));
    let names = names();
    let mut squares = vec![0.0; names.len()];
    for seed in 0..64 {
        // After a tenth of a second a walk has reached sqrt(0.1) of its distance after one.
        let mut world = still(seed, |channels, axis| Noise {
            random_walk: deviation(channels, axis),
            ..Noise::default()
        });
        let mut last = Vec::new();
        (0..100).for_each(|_| last = all(&mut world));
        for ((square, measured), truth) in squares.iter_mut().zip(last).zip(&truth) {
            *square += (measured - truth).powi(2) / 64.0;
        }
    }
    for ((kind, channels, axis), square) in names.iter().zip(squares) {
        let asked = deviation(*channels, *axis) * 0.1f64.sqrt();
        let found = f64::sqrt(square);
        assert!((found / asked - 1.0).abs() < 0.4, "{kind:?} {channels:?} {axis}: {found}, not {asked}");
    }
}

/// If several quantities lose samples, the largest part applies, within four standard deviations of 10,000.
#[test]
fn the_largest_of_several_dropouts_counts() {
    let mut world = world(1e-3);
    apply(&mut world, Command::Spawn(Box::new(passive(&Arc::new(chain(1)), false, &[0.0]))));
    let lost = |channels, dropout| ChannelNoise {
        channels,
        axis: None,
        noise: Noise { dropout, ..Noise::default() },
    };
    let noise = vec![
        lost(Channels::LinearAcceleration, 0.1),
        lost(Channels::AngularVelocity, 0.3),
        lost(Channels::Orientation, 0.2),
    ];
    let imu = create("robot", "link-1", DPose3::IDENTITY, SensorKind::Imu);
    add(&mut world, CreateSensor { noise, ..imu });
    let kept: usize = (0..10_000).map(|_| measured(&mut world).len()).sum();
    let lost = 1.0 - kept as f64 / 10_000.0;
    assert!((lost - 0.3).abs() < 0.0184, "{lost}");
}
