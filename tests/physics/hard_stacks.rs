//! Stacks and heaps that sweeps without a direct solution solve badly: thirty high, masses as 1 to 1000,
//! chosen at random.

use fastrand::Rng;
use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::simulation::SolverChoice;
use simd_core::simulation::command::Spawn;
use simd_core::{Command, Simulation};
use simd_tests::scenes::*;

use crate::seeds::{held, seeds};

const G: f64 = 9.81;

/// Overlap of two boxes of a stack that is not corrected, metres.
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

/// From the first half second on each box carries the boxes above it and sinks by no more than the slop.
/// Within two seconds all sleep.
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

/// A box that lies on another exactly, or up to rounding, has four contact points.
#[test]
fn faces_that_lie_on_each_other_exactly_touch_at_four_corners() {
    let shifts = [0.0, 1e-17, 1.4e-17, 3e-17, 1e-16, 2e-16, 1e-15, 1e-12];
    let shifts = || shifts.into_iter().flat_map(|shift| [shift, -shift]);
    for (dx, dy, turn) in
        shifts().flat_map(|dx| shifts().flat_map(move |dy| [0.0, 1e-17, 1e-16].map(|turn| (dx, dy, turn))))
    {
        let mut world = world(1e-3);
        for (i, at) in [DVec3::Z * 0.1, DVec3::new(dx, dy, 0.3)].into_iter().enumerate() {
            let pose = DPose3::from_parts(at, DQuat::from_rotation_z(turn * i as f64));
            spawn(&mut world, robot(&name(i), &cuboid(DVec3::splat(0.2), 1.0), pose, i == 0));
        }
        world.step();
        let corners = contacts(&world, None);
        assert_eq!(corners.len(), 4, "by {dx:e} and {dy:e} m, {turn:e} rad");
        for corner in corners {
            let off = (corner.point.abs() - DVec3::new(0.1, 0.1, 0.2)).length();
            assert!(off < 1e-9, "by {dx:e} and {dy:e} m, {turn:e} rad: at {}", corner.point);
        }
    }
}

/// Returns a random tower of boxes of random sizes and masses as 1 to 1000, each with its middle well over
/// the one below. They have random friction and stand on level ground; some are turned about the vertical.
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

/// Returns the largest distance of any contact force of a tower from the least forces, N; for boxes that rest
/// on three points or more.
///
/// A box and those above it load their support by a known force F, and a torque T about the middle of the
/// points. The points are at r_k from there. The forces with this sum and torque and the least sum of squares
/// are `F / n + m x r_k` with `S m = T`, S the sum of `|r|^2 - r r'`. These are Lagrange's conditions, which
/// also hold if points without pressure are left out.
fn error_of_least_forces(world: &Simulation, masses: &[f64]) -> Option<f64> {
    let places = places(world);
    let mut largest: Option<f64> = None;
    for i in 0..masses.len() {
        let below = if i == 0 { "ground".to_owned() } else { name(i - 1) };
        let under = contacts(world, Some(&name(i))).into_iter().filter(|it| it.robots.contains(&below));
        let points: Vec<(DVec3, DVec3)> = under
            .filter(|it| it.normal_force > 0.0)
            .map(|it| {
                let on_second = it.normal * it.normal_force + it.friction_force;
                (it.point, if it.robots[0] == below { on_second } else { -on_second })
            })
            .collect();
        let n = points.len() as f64;
        let middle = points.iter().map(|(point, _)| *point).sum::<DVec3>() / n;
        let mut spread = DMat3::ZERO;
        for (point, _) in &points {
            let r = *point - middle;
            spread += DMat3::from_diagonal(DVec3::splat(r.length_squared()));
            spread -= DMat3::from_cols(r * r.x, r * r.y, r * r.z);
        }
        let size = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
        // Points on a line, about which they hold nothing.
        if points.len() < 3 || spread.determinant() < 1e-6 * size.powi(3) {
            continue;
        }
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        // The ground is the first of all places.
        for (mass, at) in masses.iter().zip(&places[1..]).skip(i) {
            let weight = DVec3::Z * G * *mass;
            force += weight;
            torque += (*at - middle).cross(weight);
        }
        let slope = spread.inverse() * torque;
        for (point, found) in points {
            let expected = force / n + slope.cross(point - middle);
            largest = Some(largest.unwrap_or(0.0).max(found.distance(expected)));
        }
    }
    largest
}

/// Returns two results for the tower of a seed. The first is the largest part of the energy of correcting
/// [`SLOP`] by which its energy grew. The second says whether that is below 1 and the tower is at rest after
/// two seconds. Then the forces on the lowest box sum to all weights, and all forces are the least, within
/// 1e-6 of all weights. Nothing creeps, and all sleep.
fn comes_to_rest(seed: u64) -> (f64, bool) {
    let (mut world, masses) = random_tower(&mut Rng::with_seed(seed));
    let weight = G * masses.iter().sum::<f64>();
    let start = energy(&world);
    let bound = weight * SLOP * masses.len() as f64;
    let (mut gain, mut holds) = (0.0f64, true);
    for _ in 0..2_000 {
        world.step();
        let now = energy(&world);
        gain = gain.max((now - start) / bound);
        holds &= now < start + bound;
    }
    let own = contacts(&world, Some("ground"));
    let force: f64 = own.iter().map(|it| it.normal_force).sum();
    let error = error_of_least_forces(&world, &masses);
    let before = places(&world);
    (0..2_000).for_each(|_| world.step());
    let creep = before.iter().zip(places(&world)).map(|(before, after)| before.distance(after));
    let creep = creep.fold(0.0, f64::max);
    let sleeps = all_sleep(&mut world);
    println!(
        "seed {seed}: {force} of {weight} N, {error:?} N from the least, gain {gain:.3} of the bound, \
         creeps by {creep} m, sleeps: {sleeps}"
    );
    let is_least = error.is_some_and(|error| error < 1e-6 * weight);
    (gain, holds && is_least && (force / weight - 1.0).abs() < 1e-6 && creep < 1e-9 && sleeps)
}

/// Returns the largest residual of the steps from a fifth of a second to half of one, m/s.
fn residual(world: &mut Simulation, choice: SolverChoice) -> f64 {
    world.measure_solver(choice);
    (0..200).for_each(|_| world.step());
    world.take_solver_residual();
    (0..300).for_each(|_| world.step());
    world.take_solver_residual().unwrap_or_default()
}

/// The scene that `make bench` draws over time: thirty boxes, which 50 sweeps a step do not solve, compared
/// with the default solver.
#[test]
fn the_residual_says_how_far_sweeps_are_from_what_is_solved_directly() {
    let mut fresh = tower(&[1.0; 30]);
    fresh.step();
    assert_eq!(fresh.take_solver_residual(), None, "it is measured where that is asked for");
    let [own, direct, sweeps] = [SolverChoice::Automatic, SolverChoice::Direct, SolverChoice::Sweeps]
        .map(|choice| residual(&mut tower(&[1.0; 30]), choice));
    println!("residuals: {own:e} m/s, {direct:e} directly, {sweeps:e} by sweeps");
    assert!(own < 1e-6 && direct < 1e-6 && sweeps > 10.0 * own.max(direct), "{own:e} {direct:e} {sweeps:e}");
}

/// Masses up to 1 : 1000. `TOWERS` of the environment gives another number of seeds.
#[test]
fn random_towers_gain_no_energy_and_come_to_rest_on_the_least_forces_and_sleep() {
    let count = seeds("TOWERS", 30);
    let (mut largest, mut failed) = (0.0f64, Vec::new());
    for seed in 0..count {
        let (gain, rests) = comes_to_rest(seed);
        largest = largest.max(gain);
        if !rests {
            failed.push(seed);
        }
    }
    held("random towers gain no energy, rest on the least forces and sleep", count, largest, &failed);
}
