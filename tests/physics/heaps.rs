//! Heaps, whose contacts are swept with momentum.

use glamx::{DPose3, DVec3};
use simd_core::Simulation;
use simd_core::simulation::SolverChoice;
use simd_core::simulation::command::Spawn;
use simd_tests::scenes::*;

const G: f64 = 9.81;
const H: f64 = 1e-3;
/// Overlap that is left alone, metres.
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

/// The geometric mean of the residuals of 300 steps as it comes to rest, m/s.
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

/// Kinetic and potential, J, and the speed of the fastest, m/s.
fn energy(world: &Simulation) -> (f64, f64) {
    let (mut sum, mut fastest) = (0.0, 0.0f64);
    // The walls come first.
    for root in look(world).roots.iter().skip(1) {
        let moment = 0.4 * MASS * RADIUS * RADIUS;
        sum += MASS * (0.5 * root.linear.length_squared() + G * root.pose.translation.z);
        sum += 0.5 * moment * root.angular.length_squared();
        fastest = fastest.max(root.linear.length());
    }
    (sum, fastest)
}

/// The bound is that of `passive_worlds`; docs/physics.md derives it.
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
