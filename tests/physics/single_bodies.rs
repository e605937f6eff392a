//! Heaps of single bodies, whose contacts are swept in a form of their own.

use glamx::{DPose3, DQuat, DVec3};
use simd_core::simulation::command::Spawn;
use simd_core::simulation::{Integrator, SolverChoice, WorldLimits};
use simd_core::{PhysicsSettings, Simulation};
use simd_tests::scenes::{ball, contacts, container, cuboid, robot, spawn, surface};

/// More than are ever solved directly.
const BODIES: usize = 320;

/// Balls and boxes of many weights and frictions, some of which rebound, which fall into a box.
fn heap(settings: PhysicsSettings) -> Simulation {
    let mut heap = Simulation::new(settings, WorldLimits { robots: BODIES + 1, saved_states: 0 });
    spawn(&mut heap, robot("box", &container(DVec3::new(0.8, 0.8, 2.0)), DPose3::IDENTITY, true));
    let mut random = fastrand::Rng::with_seed(15);
    for index in 0..BODIES {
        let [x, y, z] = [index % 6, index / 6 % 6, index / 36].map(|at| at as f64);
        let mass = 10f64.powf(2.0 * random.f64() - 1.0);
        let size = 0.03 + 0.02 * random.f64();
        let model = match index % 3 {
            0 => cuboid(DVec3::new(size, 1.5 * size, 2.0 * size), mass),
            _ => ball(size, mass),
        };
        let turned = DQuat::from_euler(glamx::EulerRot::XYZ, random.f64(), random.f64(), random.f64());
        let at = DVec3::new(0.12 * (x - 2.5), 0.12 * (y - 2.5), 0.1 + 0.11 * z);
        let contact_settings = surface(random.f64(), if index % 7 == 0 { 0.5 } else { 0.0 });
        let of = robot(&format!("body-{index}"), &model, DPose3::from_parts(at, turned), false);
        spawn(&mut heap, Spawn { contact_settings, ..of });
    }
    heap
}

/// A world whose solver is measured sweeps through the rows that all other islands have.
#[test]
fn a_heap_of_single_bodies_has_the_bits_that_it_has_with_the_rows_of_any_island() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let settings = PhysicsSettings { time_step: 2e-3, integrator, ..PhysicsSettings::default() };
        let (mut heap, mut by_rows) = (self::heap(settings), self::heap(settings));
        by_rows.measure_solver(SolverChoice::Automatic);
        let mut swept = 0;
        for step in 0..300 {
            heap.step();
            by_rows.step();
            swept += heap.swept_single_bodies();
            assert_eq!(by_rows.swept_single_bodies(), 0);
            if step % 10 == 0 {
                assert_eq!(heap.fingerprint(), by_rows.fingerprint(), "{integrator:?} step {step}");
            }
        }
        assert!(swept > 100 * BODIES, "only {swept} contacts were swept so");
        assert!(contacts(&heap, None).len() > 2 * BODIES, "they lie on each other");
    }
}
