//! Stacks and heaps that sweeps alone solve badly: thirty high, masses as 1 to 1000, chosen at random.

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::Spawn;
use simd_core::{Command, Simulation};
use simd_tests::scenes::*;

const G: f64 = 9.81;

/// What a stack may give way where two boxes touch, metres: overlap that is left alone.
const SLOP: f64 = 2e-5;

fn ground(friction: f64) -> Simulation {
    let mut world = world(1e-3);
    let ground = robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true);
    spawn(&mut world, Spawn { contact_settings: surface(friction, 0.0), ..ground });
    world
}

fn name(i: usize) -> String {
    format!("box-{i}")
}

/// Boxes of 0.2 m, one on the other.
fn tower(masses: &[f64]) -> Simulation {
    let mut world = ground(0.8);
    for (i, &mass) in masses.iter().enumerate() {
        let at = DPose3::from_translation(DVec3::Z * (0.1 + 0.2 * i as f64));
        let own = robot(&name(i), &cuboid(DVec3::splat(0.2), mass), at, false);
        spawn(&mut world, Spawn { contact_settings: surface(0.8, 0.0), ..own });
    }
    world
}

fn places(world: &Simulation) -> Vec<DVec3> {
    look(world).roots.iter().map(|root| root.pose.translation).collect()
}

fn all_sleep(world: &mut Simulation) -> bool {
    apply(world, Command::SaveState { name: "asleep?".into() });
    let saved = look(world).saved("asleep?").unwrap().saved().clone();
    let robots = &saved.world_state().robots;
    robots.iter().filter(|robot| !robot.entity.fixed_base).all(|robot| robot.entity.asleep)
}

/// Each box bears what is above it, from the first half second on, gives way by no more than slop, and within two
/// seconds all sleep.
#[test]
fn masses_of_a_thousand_to_one_stand_either_way_up() {
    let thirty = [1.0; 30];
    for masses in [&[1.0, 1e3][..], &[1e3, 1.0], &[1.0, 1e3, 1.0, 1e3], &[1e3, 1.0, 1e3, 1.0], &thirty] {
        let mut world = tower(masses);
        let start = places(&world);
        for step in 0..2_000 {
            world.step();
            if step < 500 {
                continue;
            }
            for (i, _) in masses.iter().enumerate() {
                let below = if i == 0 { "ground".to_owned() } else { name(i - 1) };
                let own = contacts(&world, Some(&name(i)));
                let under = own.iter().filter(|it| it.robots.contains(&below));
                let force: f64 = under.map(|it| it.normal_force).sum();
                let expected = G * masses[i..].iter().sum::<f64>();
                assert!(
                    (force / expected - 1.0).abs() < 1e-6,
                    "{masses:?} after {step} steps: box {i} bears {force} N, not {expected}"
                );
            }
        }
        for (i, (at, start)) in places(&world).iter().zip(&start).enumerate() {
            assert!(at.distance(*start) < SLOP * i as f64 + 1e-12, "{masses:?}: box {i} is at {at}");
        }
        assert!(all_sleep(&mut world), "{masses:?}");
    }
}

/// A random tower of boxes of random sizes and masses as 1 to 1000, each with its middle well over the one below, of
/// random friction, on level ground; some are turned about the vertical.
fn random_tower(rng: &mut Rng) -> (Simulation, Vec<f64>) {
    let mut world = ground(0.2 + rng.f64());
    let (mut height, mut below, mut masses) = (0.0, DVec3::splat(0.4), Vec::new());
    let mut middle = DVec3::ZERO;
    for i in 0..rng.usize(2..12) {
        let size = DVec3::new(0.2 + 0.2 * rng.f64(), 0.2 + 0.2 * rng.f64(), 0.05 + 0.1 * rng.f64());
        let mass = 10f64.powf(3.0 * rng.f64() - 1.5);
        // All that is above stays over the middle half of each.
        let reach = 0.04 * below.x.min(below.y);
        middle += DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, 0.0) * reach;
        let turn = if rng.bool() { DQuat::from_rotation_z(rng.f64()) } else { DQuat::IDENTITY };
        let gap = if rng.bool() { 0.0 } else { 1e-6 * rng.f64() };
        let place = middle + DVec3::Z * (height + gap + 0.5 * size.z);
        let own = robot(&name(i), &cuboid(size, mass), DPose3::from_parts(place, turn), false);
        spawn(&mut world, Spawn { contact_settings: surface(0.2 + rng.f64(), 0.0), ..own });
        height += gap + size.z;
        below = size;
        masses.push(mass);
    }
    (world, masses)
}

/// Kinetic and potential energy of boxes, J.
fn energy(world: &Simulation) -> f64 {
    let seen = look(world);
    let of = seen.roots.iter().zip(&seen.world.entities).filter(|(_, entity)| !entity.fixed_base);
    of.map(|(root, entity)| {
        let inertial = &entity.model.links[0].inertial;
        let own = root.pose.rotation.inverse() * root.angular;
        inertial.mass * (0.5 * root.linear.length_squared() + G * root.pose.translation.z)
            + 0.5 * own.dot(inertial.inertia * own)
    })
    .sum()
}

/// What holds of every tower, by seed: energy does not grow by more than correcting [`SLOP`] lifts; after two seconds it
/// is at rest, and the forces on the lowest sum to all weights within 1e-6; nothing creeps; all sleep.
fn a_tower_comes_to_rest(seed: u64) {
    let (mut world, masses) = random_tower(&mut Rng::with_seed(seed));
    let weight = G * masses.iter().sum::<f64>();
    let start = energy(&world);
    let bound = weight * SLOP * masses.len() as f64;
    for step in 0..2_000 {
        world.step();
        let now = energy(&world);
        assert!(now < start + bound, "seed {seed}, step {step}: {start} J became {now}");
    }
    let own = contacts(&world, Some("ground"));
    let force: f64 = own.iter().map(|it| it.normal_force).sum();
    assert!((force / weight - 1.0).abs() < 1e-6, "seed {seed}: {force} N, not {weight}");
    let before = places(&world);
    (0..2_000).for_each(|_| world.step());
    for (before, after) in before.iter().zip(places(&world)) {
        assert!(before.distance(after) < 1e-9, "seed {seed}: creeps by {}", before.distance(after));
    }
    assert!(all_sleep(&mut world), "seed {seed}: not all sleep after four seconds");
}

/// Thirty seeds; `TOWERS` of the environment gives another number.
#[test]
#[ignore = "some towers of mass ratios to 1000 are not solved as they land, and fall"]
fn random_towers_come_to_rest_and_sleep() {
    let count = std::env::var("TOWERS").ok().and_then(|count| count.parse().ok()).unwrap_or(30);
    for seed in 0..count {
        println!("seed {seed}");
        a_tower_comes_to_rest(seed);
    }
}
