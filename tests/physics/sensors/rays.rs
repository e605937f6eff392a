//! Range finders and lidars: distances to planes, by trigonometry. Ranges of scans are f32: the tolerance of
//! 1e-6 of a range is for their rounding.

use simd_tests::world::at;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::{CreateSensor, PhysicsChange};
use simd_core::simulation::measure::Measurement;
use simd_core::{Command, Simulation};
use simd_model::sensor::{ChannelNoise, Channels, Noise, RangeLimits, Scan, SensorKind, Sweep};
use simd_tests::scenes::{apply, ball, container, cuboid, plane, robot, spawn, throw, world};

use super::{add, create, measured};

fn range(world: &mut Simulation) -> f64 {
    match &measured(world)[..] {
        [Measurement::Range(range)] => *range,
        other => panic!("{other:?}"),
    }
}

fn ranges(world: &mut Simulation) -> Vec<f32> {
    match measured(world).pop() {
        Some(Measurement::Lidar(ranges)) => ranges,
        other => panic!("{other:?}"),
    }
}

/// A robot of a box at this place with the sensor in its middle, which looks along x.
fn bearer(world: &mut Simulation, place: DPose3) {
    spawn(world, robot("bearer", &cuboid(DVec3::splat(0.1), 1.0), place, true));
}

/// REP 117: a distance, too near, no hit. Its own body does not block it, and a body beside it does.
#[test]
fn a_range_finder_tells_near_and_far_from_a_distance() {
    let limits = RangeLimits { least: 0.3, most: 4.0 };
    for (distance, expected) in [(2.0, 2.0), (3.999, 3.999), (0.2, f64::NEG_INFINITY), (4.1, f64::INFINITY)] {
        let mut world = world(1e-3);
        bearer(&mut world, at(1.0, 2.0, 3.0));
        let wall = at(1.0 + distance + 0.5, 2.0, 3.0);
        spawn(&mut world, robot("wall", &cuboid(DVec3::new(1.0, 5.0, 5.0), 1.0), wall, true));
        add(&mut world, create("bearer", "body", DPose3::IDENTITY, SensorKind::Range(limits)));
        let range = range(&mut world);
        assert!(range == expected || (range - expected).abs() < 1e-9, "{range}, not {expected}");
    }
}

/// The range of a ray does not affect its precision: 1e-9 of the distance at 1e12 m, for a box, a ball and a
/// plane.
#[test]
fn a_far_reach_takes_nothing_from_what_is_near() {
    for most in [10.0, 1e6, 1e12] {
        for (shape, near) in
            [(cuboid(DVec3::splat(1.0), 1.0), 2.5), (ball(0.5, 1.0), 2.5), (plane(-DVec3::X), 3.0)]
        {
            let mut world = world(1e-3);
            bearer(&mut world, DPose3::IDENTITY);
            spawn(&mut world, robot("wall", &shape, at(3.0, 0.0, 0.0), true));
            let limits = RangeLimits { least: 0.1, most };
            add(&mut world, create("bearer", "body", DPose3::IDENTITY, SensorKind::Range(limits)));
            let range = range(&mut world);
            assert!((range / near - 1.0).abs() < 1e-9, "{range}, not {near}, of {most}");
        }
    }
}

/// In the middle of a room of 8 m by 6 m: `4 / |cos|` to the walls at x or `3 / |sin|` to those at y. The
/// sensor is turned, so that its angles count from its orientation.
#[test]
fn a_lidar_in_a_room_measures_its_walls() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("room", &container(DVec3::new(8.0, 6.0, 3.0)), DPose3::IDENTITY, true));
    bearer(&mut world, at(0.0, 0.0, 1.0));
    let horizontal = Sweep { samples: 361, least: -PI, most: PI };
    let range = RangeLimits { least: 0.1, most: 30.0 };
    let scan = Scan { horizontal, vertical: Sweep::one(0.0), range, rolling: false };
    let turned = 0.3;
    let pose = DPose3::from_rotation(DQuat::from_rotation_z(turned));
    add(&mut world, create("bearer", "body", pose, SensorKind::Lidar(scan)));
    let ranges = ranges(&mut world);
    assert_eq!(ranges.len(), 361);
    for (index, measured) in (0..).zip(ranges) {
        let angle = horizontal.angle(index) + turned;
        let expected = (4.0 / angle.cos().abs()).min(3.0 / angle.sin().abs());
        assert!((f64::from(measured) / expected - 1.0).abs() < 1e-6, "{angle}: {measured}, not {expected}");
    }
}

/// Lines of a 3D lidar 1.5 m above the ground: a ray downwards by v hits it after 1.5 / sin v, at any
/// horizontal angle. Level and upwards there is no hit. Lines begin at the least angle.
#[test]
fn a_lidar_of_several_lines_measures_the_ground() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    bearer(&mut world, at(0.0, 0.0, 1.5));
    let horizontal = Sweep { samples: 8, least: -FRAC_PI_2, most: FRAC_PI_2 };
    let vertical = Sweep { samples: 5, least: -FRAC_PI_4, most: FRAC_PI_4 };
    let scan = Scan { horizontal, vertical, range: RangeLimits { least: 0.0, most: 100.0 }, rolling: false };
    add(&mut world, create("bearer", "body", DPose3::IDENTITY, SensorKind::Lidar(scan)));
    let ranges = ranges(&mut world);
    assert_eq!(ranges.len(), 40);
    for (line, measured) in ranges.chunks(8).enumerate() {
        let down = -vertical.angle(u32::try_from(line).unwrap());
        for measured in measured {
            if line < 2 {
                let expected = 1.5 / down.sin();
                assert!((f64::from(*measured) / expected - 1.0).abs() < 1e-6, "{line}: {measured}");
            } else {
                assert_eq!(*measured, f32::INFINITY, "{line}");
            }
        }
    }
}

/// A free ball with a lidar of 10 Hz at its side, in front of a wall at x = 5 m. Column i of n was measured
/// `(n - 1 - i) / n` of 0.1 s before the sample, from the sensor's pose at that time. The range is (5 - x) /
/// cos of the angle. Exact for straight motion and for rotation, since its twist in its own axes is constant.
#[test]
fn columns_of_a_rolling_scan_have_different_times() {
    let (rate, reach, columns) = (10.0, 0.3, 5);
    for (linear, angular) in [(DVec3::new(2.0, 0.5, 0.0), 0.0), (DVec3::ZERO, 2.5)] {
        let mut world = world(1e-3);
        let change = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
        apply(&mut world, Command::SetPhysics(change));
        spawn(&mut world, robot("wall", &plane(-DVec3::X), at(5.0, 0.0, 0.0), true));
        spawn(&mut world, robot("bearer", &ball(0.1, 1.0), DPose3::IDENTITY, false));
        throw(&mut world, "bearer", linear, DVec3::Z * angular);
        let horizontal = Sweep { samples: columns, least: -0.4, most: 0.4 };
        let range = RangeLimits { least: 0.0, most: 30.0 };
        for rolling in [true, false] {
            let scan = Scan { horizontal, vertical: Sweep::one(0.0), range, rolling };
            let lidar = create("bearer", "body", at(reach, 0.0, 0.0), SensorKind::Lidar(scan));
            add(&mut world, CreateSensor { rate: Some(rate), ..lidar });
        }
        let scans = (0..150).map(|_| measured(&mut world)).find(|seen| !seen.is_empty()).unwrap();
        let [Measurement::Lidar(rolling), Measurement::Lidar(still)] = &scans[..] else {
            panic!("{scans:?}")
        };
        for column in 0..columns {
            let expected = |time: f64| {
                let turned = angular * time;
                let angle = turned + horizontal.angle(column);
                (5.0 - linear.x * time - reach * turned.cos()) / angle.cos()
            };
            let before = f64::from(columns - 1 - column) / f64::from(columns) / rate;
            let [rolling, still] = [rolling, still].map(|ranges| f64::from(ranges[column as usize]));
            assert!((rolling - expected(0.1 - before)).abs() < 1e-5, "{column}: {rolling}");
            assert!((still - expected(0.1)).abs() < 1e-5, "{column}: {still}");
        }
        assert!(rolling[0] != still[0] && rolling[4] == still[4], "{rolling:?} {still:?}");
    }
}

/// Bias and walk are the same for all rays of a scan, so that rays at one distance from the wall do not
/// differ otherwise. They continue from scan to scan. Ranges are f32: 1e-6.
#[test]
fn all_rays_of_a_scan_have_one_bias_and_one_walk() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("wall", &plane(-DVec3::X), at(5.0, 0.0, 0.0), true));
    bearer(&mut world, DPose3::IDENTITY);
    let horizontal = Sweep { samples: 5, least: -1e-6, most: 1e-6 };
    let range = RangeLimits { least: 0.0, most: 9.0 };
    let scan = Scan { horizontal, vertical: Sweep::one(0.0), range, rolling: false };
    let noise = Noise { bias_standard_deviation: 0.1, random_walk: 0.5, ..Noise::default() };
    let noise = vec![ChannelNoise { channels: Channels::Range, axis: None, noise }];
    let lidar = create("bearer", "body", DPose3::IDENTITY, SensorKind::Lidar(scan));
    add(&mut world, CreateSensor { noise, ..lidar });
    let mut firsts: Vec<f32> = Vec::new();
    for _ in 0..200 {
        let ranges = ranges(&mut world);
        assert!(ranges.iter().all(|range| (range - ranges[0]).abs() < 5e-6), "{ranges:?}");
        firsts.push(ranges[0]);
    }
    assert!((firsts[0] - 5.0).abs() > 1e-4, "a bias, {}", firsts[0]);
    assert!(firsts.windows(2).filter(|pair| pair[0] != pair[1]).count() > 190, "a walk");
}

/// A tenth of 4,000 rays is lost, within four standard deviations of 0.0047. The remaining ones have the
/// given deviation, within 5 %, about a common bias.
#[test]
fn rays_have_their_own_noise_and_one_bias() {
    let mut world = world(1e-3);
    spawn(&mut world, robot("wall", &plane(-DVec3::X), at(5.0, 0.0, 0.0), true));
    bearer(&mut world, DPose3::IDENTITY);
    let horizontal = Sweep { samples: 4_000, least: -1e-6, most: 1e-6 };
    let scan = Scan {
        horizontal,
        vertical: Sweep::one(0.0),
        range: RangeLimits { least: 0.0, most: 9.0 },
        rolling: false,
    };
    let noise = Noise { standard_deviation: 0.02, bias_mean: 0.3, dropout: 0.1, ..Noise::default() };
    let noise = vec![ChannelNoise { channels: Channels::Range, axis: None, noise }];
    let lidar = create("bearer", "body", DPose3::IDENTITY, SensorKind::Lidar(scan));
    add(&mut world, CreateSensor { noise, ..lidar });
    let ranges = ranges(&mut world);
    let left: Vec<f64> =
        ranges.iter().filter(|range| !range.is_nan()).map(|range| f64::from(*range)).collect();
    let lost = 1.0 - left.len() as f64 / 4_000.0;
    assert!((lost - 0.1).abs() < 0.019, "{lost}");
    let mean = left.iter().sum::<f64>() / left.len() as f64;
    let square = left.iter().map(|range| (range - mean) * (range - mean)).sum::<f64>() / left.len() as f64;
    // The mean of 3,600 errs by 0.0003.
    assert!((mean - 5.3).abs() < 0.0015, "{mean}");
    assert!((square.sqrt() / 0.02 - 1.0).abs() < 0.05, "{}", square.sqrt());
}
