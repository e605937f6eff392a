//! Statistics of noise compared with the parameters. Bounds are four to five standard deviations of the
//! estimate.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use simd_core::Simulation;
use simd_core::simulation::command::CreateSensor;
use simd_core::simulation::measure::Measurement;
use simd_model::sensor::{ChannelNoise, Channels, Noise, SensorKind};
use simd_tests::scenes::apply;

use super::{add, create, measured};
use crate::chains::chain;
use simd_tests::world::{passive, world};

/// Returns a rod at rest under no gravity, on a joint.
fn still() -> Simulation {
    let mut world = world(1e-3);
    let gravity = Some(DVec3::ZERO);
    let change = simd_core::simulation::command::PhysicsChange { gravity, ..Default::default() };
    apply(&mut world, simd_core::Command::SetPhysics(change));
    let start = passive(&Arc::new(chain(1)), false, &[0.0]);
    apply(&mut world, simd_core::Command::Spawn(Box::new(start)));
    world
}

fn encoder(seed: u64, noise: Noise) -> CreateSensor {
    let noise = vec![ChannelNoise { channels: Channels::JointPosition, axis: None, noise }];
    let encoder = create("robot", "joint-1", DPose3::IDENTITY, SensorKind::Encoder { backlash: 0.0 });
    CreateSensor { noise, seed: Some(seed), ..encoder }
}

/// Returns the readings of encoders at a joint position of 0.
fn positions(world: &mut Simulation) -> Vec<f64> {
    let of = |measurement| match measurement {
        Measurement::Encoder(encoder) => encoder.position,
        other => panic!("{other:?}"),
    };
    measured(world).into_iter().map(of).collect()
}

fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
    (mean, (square / values.len() as f64).sqrt())
}

/// For 64 sensors with separate biases, the samples of each scatter about its bias.
#[test]
fn samples_scatter_about_a_bias_that_is_drawn_once() {
    let mut world = still();
    let noise =
        Noise { standard_deviation: 0.01, bias_mean: 0.5, bias_standard_deviation: 0.2, ..Noise::default() };
    (0..64).for_each(|seed| add(&mut world, encoder(seed, noise)));
    let mut of_each = vec![Vec::new(); 64];
    for _ in 0..2_000 {
        for (of, position) in of_each.iter_mut().zip(positions(&mut world)) {
            of.push(position);
        }
    }
    let mut biases = Vec::new();
    for of in &of_each {
        let (mean, deviation) = mean_and_deviation(of);
        // The deviation of 2,000 samples is known to 1.6 %.
        assert!((deviation / 0.01 - 1.0).abs() < 0.08, "{deviation}");
        biases.push(mean);
    }
    // For 64 biases the error of the mean is 0.025, and the error of the deviation 9 %.
    let (mean, deviation) = mean_and_deviation(&biases);
    assert!((mean - 0.5).abs() < 0.1, "{mean}");
    assert!((deviation / 0.2 - 1.0).abs() < 0.4, "{deviation}");
}

/// One sample after the other is independent: their correlation is 0 within 4.5 / sqrt(n).
#[test]
fn samples_that_follow_each_other_are_independent() {
    let mut world = still();
    add(&mut world, encoder(3, Noise { standard_deviation: 1.0, ..Noise::default() }));
    let values: Vec<f64> = (0..20_000).map(|_| positions(&mut world)[0]).collect();
    let products: f64 = values.windows(2).map(|pair| pair[0] * pair[1]).sum();
    assert!((products / 20_000.0).abs() < 0.032, "{products}");
}

/// A walk of 0.3 a root of a second reaches 0.3 sqrt(t), over 64 sensors. With a correlation time of tau it
/// converges to 0.3 sqrt(tau / 2). The deviation of 64 is known to 9 %.
#[test]
fn a_walk_goes_with_the_root_of_time_and_comes_to_rest_where_it_is_forgotten() {
    for (correlation_time, at_one, at_four) in
        [(None, 0.3, 0.6), (Some(0.2), 0.3 * 0.1f64.sqrt(), 0.3 * 0.1f64.sqrt())]
    {
        let mut world = still();
        let noise = Noise { random_walk: 0.3, correlation_time, ..Noise::default() };
        (0..64).for_each(|seed| add(&mut world, encoder(seed, noise)));
        for (steps, expected) in [(1_000, at_one), (3_000, at_four)] {
            let mut last = Vec::new();
            (0..steps).for_each(|_| last = positions(&mut world));
            let (mean, deviation) = mean_and_deviation(&last);
            assert!(mean.abs() < 0.6 * expected, "{mean}");
            assert!((deviation / expected - 1.0).abs() < 0.4, "{deviation}, not {expected}");
        }
    }
}

/// The walk does not depend on the sampling rate: a tenth of the samples have steps that are sqrt(10) as
/// long.
#[test]
fn a_walk_does_not_depend_on_the_rate() {
    let mut world = still();
    let noise = Noise { random_walk: 0.3, ..Noise::default() };
    (0..64).for_each(|seed| add(&mut world, CreateSensor { rate: Some(100.0), ..encoder(seed, noise) }));
    let mut last = Vec::new();
    for _ in 0..1_000 {
        let positions = positions(&mut world);
        if !positions.is_empty() {
            last = positions;
        }
    }
    let (_, deviation) = mean_and_deviation(&last);
    assert!((deviation / 0.3 - 1.0).abs() < 0.4, "{deviation}");
}

#[test]
fn an_encoder_shows_whole_multiples_of_its_resolution() {
    let mut world = still();
    let quantum = 0.01;
    add(&mut world, encoder(0, Noise { standard_deviation: 0.1, quantum, ..Noise::default() }));
    let mut different = std::collections::BTreeSet::new();
    for _ in 0..1_000 {
        let counted = positions(&mut world)[0] / quantum;
        assert!((counted - counted.round()).abs() < 1e-9, "{counted}");
        different.insert(counted.round() as i64);
    }
    assert!(different.len() > 30, "{}", different.len());
}

/// A fifth of 10,000 samples is lost, within four standard deviations of 0.004; the remaining ones keep their
/// numbers.
#[test]
fn lost_samples_leave_gaps() {
    let mut world = still();
    add(&mut world, encoder(0, Noise { dropout: 0.2, ..Noise::default() }));
    let mut numbers = Vec::new();
    for _ in 0..10_000 {
        numbers.extend(super::sample(&mut world).iter().map(|reading| reading.sample));
    }
    let lost = 1.0 - numbers.len() as f64 / 10_000.0;
    assert!((lost - 0.2).abs() < 0.016, "{lost}");
    assert!(numbers.windows(2).all(|pair| pair[0] < pair[1]));
    assert!(numbers.last().is_some_and(|last| *last > 9_950 && *last <= 10_000));
}

/// Noise of one axis leaves the others as they are; the later entry of a list wins.
#[test]
fn noise_of_an_axis_is_of_that_axis_alone() {
    let mut world = still();
    let of = |axis, bias_mean| ChannelNoise {
        channels: Channels::AngularVelocity,
        axis,
        noise: Noise { bias_mean, ..Noise::default() },
    };
    let imu = create("robot", "link-1", DPose3::IDENTITY, SensorKind::Imu);
    add(&mut world, CreateSensor { noise: vec![of(None, 1.0), of(Some(1), 5.0)], ..imu });
    match &measured(&mut world)[..] {
        [Measurement::Imu(imu)] => {
            assert_eq!(imu.angular_velocity, DVec3::new(1.0, 5.0, 1.0));
            assert_eq!(imu.linear_acceleration, DVec3::ZERO);
        }
        other => panic!("{other:?}"),
    }
}
