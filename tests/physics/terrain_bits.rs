//! Runs on terrain, and in towns, are equal to the bit.

use crate::seeds::seeds;
use fastrand::Rng;
use glamx::{DPose3, DVec3};
use simd_core::collision::MeshShapes;
use simd_core::simulation::command::{LinkWrench, PhysicsChange, Spawn, WrenchDuration};
use simd_core::{Command, Integrator, Simulation};
use simd_model::robot::Geometry;
use simd_tests::scenes::*;

use crate::grounds::{field, ground, room};
use crate::saved_state_files::through_a_file_with;
use crate::terrain::{houses, rough};
use simd_tests::world::at;

/// Bits, over everything that a step reads: one world runs undisturbed, the other is saved, runs ahead and is
/// restored.
#[test]
fn runs_on_terrain_are_equal_to_the_bit_also_across_restores() {
    let [mut alone, mut restored] = [0, 0].map(|_| rough(&mut Rng::with_seed(21)));
    let mut rng = Rng::with_seed(22);
    let (mut touching, mut ahead) = (0, 0);
    for step in 0..4_000 {
        if step % 500 == 0 {
            touching += contacts(&alone, None).len();
            let (linear, angular) =
                (DVec3::new(rng.f64() - 0.5, rng.f64() - 0.5, 2.0), DVec3::ONE * rng.f64());
            for world in [&mut alone, &mut restored] {
                throw(world, &format!("body-{}", step / 500), linear, angular);
            }
        }
        ahead += go_back_at_times(&mut restored, &mut rng, 200, 40);
        alone.step();
        restored.step();
        assert_eq!(alone.fingerprint(), restored.fingerprint(), "step {step}");
    }
    assert!(touching > 50 && ahead > 100, "{touching} {ahead}");
    let fell = look(&alone).roots.iter().any(|root| root.pose.translation.z < -5.0);
    println!("one fell off: {fell}");
}

/// A step leaves out immovable bodies unless the world had a request. One world is asked for a saved state
/// before each step, so that it leaves out nothing. Both are equal to the bit, whatever happens to their
/// houses.
#[test]
fn a_step_that_leaves_out_what_cannot_move_is_equal_to_the_bit() {
    let [mut left_alone, mut asked] = [0, 1].map(|_| {
        let mut world = rough(&mut Rng::with_seed(31));
        for (i, (pose, shape)) in houses(60).into_iter().enumerate() {
            let house = solid(&[(DPose3::IDENTITY, shape)], 1.0);
            spawn(&mut world, robot(&format!("house-{i}"), &house, pose, true));
        }
        world
    });
    let wrench = |robot: &str, duration| {
        Command::ApplyWrench(LinkWrench {
            robot: robot.into(),
            link: "body".into(),
            force: DVec3::new(1.0, 2.0, 30.0),
            torque: DVec3::ZERO,
            in_link_axes: false,
            point: DVec3::ZERO,
            duration,
        })
    };
    let to =
        |robot: &str, pose| Command::SetEntityState { robot: robot.into(), pose: Some(pose), twist: None };
    for step in 0..2_000 {
        let body = look(&left_alone).roots[1].pose.translation;
        let happens = match step {
            100 => Some(to("house-7", DPose3::from_translation(body - DVec3::Z * 0.6))),
            300 => Some(Command::Delete { robot: "house-3".into() }),
            400 => Some(wrench("house-8", WrenchDuration::For(0.05))),
            420 => Some(wrench("house-9", WrenchDuration::NextStep)),
            500 => Some(wrench("body-1", WrenchDuration::NextStep)),
            700 => Some(Command::SetPhysics(PhysicsChange { substeps: Some(3), ..PhysicsChange::default() })),
            900 => Some(to("ground", at(0.3, 0.2, 0.4))),
            1_200 => Some(Command::SaveState { name: "before".into() }),
            1_500 => Some(Command::RestoreState { name: "before".into() }),
            _ => None,
        };
        for world in [&mut left_alone, &mut asked] {
            happens.iter().for_each(|command| apply(world, command.clone()));
        }
        apply(&mut asked, Command::SaveState { name: "each".into() });
        left_alone.step();
        asked.step();
        assert_eq!(left_alone.fingerprint(), asked.fingerprint(), "step {step}");
    }
}

/// Bits, for as long as the runs without terrain: bodies are thrown about and put back onto the mesh. One
/// world runs undisturbed, the other is saved, runs ahead and is restored.
#[test]
fn long_runs_on_terrain_are_equal_to_the_bit() {
    let [mut alone, mut restored] = [0, 0].map(|_| rough(&mut Rng::with_seed(41)));
    let mut rng = Rng::with_seed(42);
    let (mut touching, mut ahead) = (0, 0);
    let steps = seeds("EQUAL_STEPS", 8_000) as usize;
    for step in 0..steps {
        if step % 250 == 0 {
            touching += contacts(&alone, None).len();
            let mut any = || rng.f64() - 0.5;
            let (pose, linear) = (at(3.0 * any() + 0.8, 2.0 * any(), 1.0), DVec3::new(any(), any(), 0.0));
            let twist = Some((linear, DVec3::new(any(), any(), any()) * 8.0));
            let robot = format!("body-{}", rng.usize(0..12));
            for world in [&mut alone, &mut restored] {
                let robot = robot.clone();
                apply(world, Command::SetEntityState { robot, pose: Some(pose), twist });
            }
        }
        ahead += go_back_at_times(&mut restored, &mut rng, 500, 50);
        alone.step();
        restored.step();
        if step % 10 == 0 {
            assert_eq!(alone.fingerprint(), restored.fingerprint(), "step {step}");
        }
    }
    println!("{touching} contacts looked at, {ahead} steps taken back");
    assert!(touching > steps / 100 && ahead > steps / 100, "{touching} {ahead}");
}

/// Returns a room that is one mesh, a hill in it that is a height field, and twelve bodies that fall onto
/// both.
fn room_with_a_hill(rng: &mut Rng, integrator: Integrator) -> Simulation {
    let mut world = world(2e-3);
    let integrator = Some(integrator);
    apply(&mut world, Command::SetPhysics(PhysicsChange { integrator, ..PhysicsChange::default() }));
    spawn(&mut world, ground(&room()));
    let hill = field(17, 1.6, |x, y| 0.2 * (1.9 * x).cos() * (1.9 * y).cos());
    spawn(&mut world, Spawn { name: "hill".into(), ..ground(&hill) });
    let cylinder = solid(&[(DPose3::IDENTITY, Geometry::Cylinder { radius: 0.08, length: 0.1 })], 0.5);
    let cone = solid(&[(DPose3::IDENTITY, Geometry::Cone { radius: 0.08, length: 0.15 })], 0.5);
    let bodies = [ball(0.08, 0.5), cuboid(DVec3::new(0.2, 0.15, 0.1), 0.5), cylinder, cone];
    for i in 0..12 {
        spawn(&mut world, robot(&format!("body-{i}"), &bodies[i % 4], anywhere(rng), false));
    }
    world
}

/// Above the floor of the room.
fn anywhere(rng: &mut Rng) -> DPose3 {
    let mut any = || 2.4 * rng.f64() - 1.2;
    at(any(), any(), 0.5)
}

/// Puts one of the bodies elsewhere in the room, where it flies against a wall.
fn stirring(rng: &mut Rng) -> Command {
    let pose = Some(anywhere(rng));
    let mut any = || 6.0 * rng.f64() - 3.0;
    let twist = Some((DVec3::new(any(), any(), 0.0), DVec3::new(any(), any(), any())));
    Command::SetEntityState { robot: format!("body-{}", rng.usize(0..12)), pose, twist }
}

/// Returns the number of contact points on the mesh, and on the height field.
fn on_both(world: &Simulation) -> [usize; 2] {
    ["ground", "hill"].map(|terrain| contacts(world, Some(terrain)).len())
}

/// Bits, after each step: the shapes of an imported world are made again from its models.
#[test]
fn an_imported_world_with_terrain_runs_on_to_the_bit() {
    let mut touched = [0, 0];
    for (seed, integrator) in [(51, Integrator::Leapfrog), (52, Integrator::Euler)] {
        println!("seed {seed}, {integrator:?}");
        let rng = &mut Rng::with_seed(seed);
        let mut world = room_with_a_hill(rng, integrator);
        for round in 0..8 {
            for _ in 0..rng.usize(1..6) {
                (0..rng.usize(1..200)).for_each(|_| world.step());
                apply(&mut world, stirring(rng));
            }
            // Directly after something was moved, or once it lies there.
            (0..rng.usize(0..100)).for_each(|_| world.step());
            let [on_mesh, on_field] = on_both(&world);
            touched = [touched[0] + on_mesh, touched[1] + on_field];
            apply(&mut world, Command::SaveState { name: "here".into() });
            let saved = through_a_file_with(&world, "here", MeshShapes::Mesh);
            let mut other = simd_tests::scenes::world(1e-3);
            apply(&mut other, Command::ImportSavedState { name: "there".into(), saved });
            apply(&mut other, Command::RestoreState { name: "there".into() });
            let place = format!("seed {seed}, round {round}");
            assert_eq!(other.fingerprint(), world.fingerprint(), "{place}: at once");
            for step in 0..300 {
                if step % 100 == 50 {
                    let command = stirring(rng);
                    apply(&mut world, command.clone());
                    apply(&mut other, command);
                }
                world.step();
                other.step();
                assert_eq!(other.fingerprint(), world.fingerprint(), "{place}, step {step}");
            }
        }
    }
    println!("{touched:?} contacts looked at, on the mesh and on the height field");
    assert!(touched[0] > 30 && touched[1] > 5, "{touched:?}");
}

/// Bits, over everything that a step reads, by both methods of a step.
#[test]
fn steps_on_terrain_by_either_integrator_are_equal_across_restores() {
    for (seed, integrator) in [(61, Integrator::Leapfrog), (62, Integrator::Euler)] {
        println!("seed {seed}, {integrator:?}");
        let [mut alone, mut restored] =
            [0, 0].map(|_| room_with_a_hill(&mut Rng::with_seed(seed), integrator));
        let rng = &mut Rng::with_seed(seed + 100);
        let (mut touched, mut ahead) = ([0, 0], 0);
        for step in 0..5_000 {
            if step % 100 == 0 {
                let [on_mesh, on_field] = on_both(&alone);
                touched = [touched[0] + on_mesh, touched[1] + on_field];
                let command = stirring(rng);
                apply(&mut alone, command.clone());
                apply(&mut restored, command);
            }
            ahead += go_back_at_times(&mut restored, rng, 100, 50);
            alone.step();
            restored.step();
            assert_eq!(alone.fingerprint(), restored.fingerprint(), "seed {seed}, step {step}");
        }
        println!("{touched:?} contacts looked at, {ahead} steps taken back");
        assert!(touched[0] > 100 && touched[1] > 10 && ahead > 300, "{touched:?} {ahead}");
    }
}
