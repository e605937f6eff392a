//! Heaps, whose contacts are swept with momentum.

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::Simulation;
use simd_core::simulation::SolverChoice;
use simd_core::simulation::command::Spawn;
use simd_tests::scenes::*;

use crate::passive_worlds::{any_body, direction, energy};
use crate::seeds::{held, seeds};

const G: f64 = 9.81;
const H: f64 = 1e-3;
/// Overlap that is not corrected, metres.
const SLOP: f64 = 2e-5;
const BALLS: usize = 320;
const RADIUS: f64 = 0.05;
const MASS: f64 = 0.2;

/// Balls that fall into a box, eight by eight on five floors, none exactly above another.
fn falling(friction: f64, restitution: f64) -> Simulation {
    let mut world = world(H);
    let own = surface(friction, restitution);
    let walls = robot("walls", &container(DVec3::new(0.9, 0.9, 2.0)), DPose3::IDENTITY, true);
    spawn(&mut world, Spawn { contact_settings: own.clone(), ..walls });
    let model = ball(RADIUS, MASS);
    for i in 0..BALLS {
        let (floor, row, column) = (i / 64, i / 8 % 8, i % 8);
        let shift = |seed: usize| 0.008 * ((seed * 7 % 11) as f64 / 10.0 - 0.5);
        let at = DVec3::new(
            (column as f64 - 3.5) * 0.108 + shift(i),
            (row as f64 - 3.5) * 0.108 + shift(i + 5),
            RADIUS + 0.01 + 0.11 * floor as f64,
        );
        let own_ball = robot(&format!("ball-{i}"), &model, DPose3::from_translation(at), false);
        spawn(&mut world, Spawn { contact_settings: own.clone(), ..own_ball });
    }
    world
}

/// Returns the geometric mean of the residuals of 300 steps as it comes to rest, m/s.
fn residual(choice: SolverChoice) -> f64 {
    let mut world = falling(0.5, 0.0);
    (0..250).for_each(|_| world.step());
    world.measure_solver(choice);
    let logarithms: Vec<f64> = (0..300)
        .map(|_| {
            world.step();
            world.take_solver_residual().unwrap_or_default().max(1e-12).ln()
        })
        .collect();
    (logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp()
}

#[test]
fn half_as_many_sweeps_with_momentum_come_as_near_as_without() {
    let [own, plain] = [SolverChoice::Automatic, SolverChoice::Sweeps].map(residual);
    println!("residuals: {own:e} m/s, {plain:e} by twice as many sweeps without momentum");
    assert!(own < plain, "{own:e} {plain:e}");
}

/// The bound of `passive_worlds` applies; docs/physics.md derives it.
#[test]
fn a_heap_that_is_swept_with_momentum_gains_no_energy() {
    for friction in [0.0, 0.5] {
        let mut world = falling(friction, 0.0);
        let (mut least, mut top, mut worst) = (f64::INFINITY, 0.0f64, f64::NEG_INFINITY);
        for _ in 0..800 {
            world.step();
            let (now, fastest) = energy(&world);
            top = top.max(fastest);
            let bound = BALLS as f64 * MASS * G * (SLOP * BALLS as f64 + 0.5 * H * top);
            worst = worst.max((now - least) / bound);
            least = least.min(now);
        }
        println!("friction {friction}: {worst:e} of the bound at the most");
        assert!(worst < 1.0, "friction {friction}: {worst}");
    }
}

#[test]
fn a_heap_that_bounces_stays_below_the_energy_that_it_began_with() {
    for restitution in [0.5, 0.9] {
        let mut world = falling(0.2, restitution);
        let (begin, _) = energy(&world);
        let mut highest = 0.0f64;
        for _ in 0..800 {
            world.step();
            highest = highest.max(energy(&world).0);
        }
        println!(
            "restitution {restitution}: {highest} of {begin} J at the most, {} J at the end",
            energy(&world).0
        );
        // In free fall it is kept to rounding.
        assert!(
            highest < begin * (1.0 + 1e-12),
            "restitution {restitution}: {highest} J, {begin} J at the start"
        );
    }
}

/// Returns a hundred hulls, boxes and balls with masses up to 1 : 1000, above each other in a box, and their
/// mass in all.
fn falling_hulls(seed: u64, restitution: f64) -> (Simulation, f64) {
    let rng = &mut Rng::with_seed(seed);
    let own = surface(rng.f64(), restitution);
    let mut world = world(H);
    let walls = robot("walls", &container(DVec3::new(1.4, 1.4, 3.0)), DPose3::IDENTITY, true);
    spawn(&mut world, Spawn { contact_settings: own.clone(), ..walls });
    let mut total = 0.0;
    for number in 0..100u8 {
        let mass = 10f64.powf(3.0 * rng.f64() - 1.5);
        let (model, _) = any_body(rng, mass, number);
        let place = [number % 4, number / 4 % 4, number / 16].map(f64::from);
        let at = DVec3::new(place[0] - 1.5, place[1] - 1.5, place[2] + 0.5) * 0.32;
        let turn = DQuat::from_scaled_axis(direction(rng) * 3.0 * rng.f64());
        let body = robot(&format!("body-{number}"), &model, DPose3::from_parts(at, turn), false);
        spawn(&mut world, Spawn { contact_settings: own.clone(), ..body });
        total += mass;
    }
    (world, total)
}

/// `HULL_HEAPS` of the environment gives another number of seeds. The bound of `passive_worlds` applies.
#[test]
fn heaps_of_a_hundred_hulls_gain_no_energy_and_stay_in_their_box() {
    let count = seeds("HULL_HEAPS", 1);
    let (mut worst, mut failed) = (0.0f64, Vec::new());
    for seed in 0..count {
        let (mut world, mass) = falling_hulls(seed, 0.0);
        let (mut least, mut top, mut gain) = (f64::INFINITY, 0.0f64, 0.0f64);
        for _ in 0..1_500 {
            world.step();
            let (now, fastest) = energy(&world);
            top = top.max(fastest);
            gain = gain.max((now - least) / (mass * G * (SLOP * 100.0 + 0.5 * H * top)));
            least = least.min(now);
        }
        let within = look(&world).roots.iter().skip(1).all(|root| {
            let at = root.pose.translation;
            at.x.abs().max(at.y.abs()) < 0.7 && at.z > 0.0
        });
        let deepest = contacts(&world, None).iter().map(|it| it.depth).fold(0.0, f64::max);
        println!("seed {seed}: gain {gain:.3} of the bound, in the box: {within}, deepest {deepest:.2e} m");
        worst = worst.max(gain);
        if gain >= 1.0 || !within {
            failed.push(seed);
        }
    }
    held("heaps of a hundred hulls gain no energy and stay in their box", count, worst, &failed);
}
