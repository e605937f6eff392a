//! Sleeping bodies, and those that just woke or fell asleep, report the forces that they carry.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DVec3};
use simd_core::simulation::Saved;
use simd_core::simulation::command::*;
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::JointKind;
use simd_tests::scenes::*;

use crate::saved_state_files::through_a_file;

const G: f64 = 9.81;

/// N. Sweeps end if no velocity changes by more than 1e-6 m/s, and the shortest part here is 7e-5 s.
const SETTLED: f64 = 0.05;

fn at(place: DVec3) -> DPose3 {
    DPose3::from_translation(place)
}

fn set_physics(world: &mut Simulation, change: PhysicsChange) {
    apply(world, Command::SetPhysics(change));
}

/// Returns the total contact force on a robot over the last step, N.
fn force_on(world: &Simulation, robot: &str) -> DVec3 {
    let forces = contacts(world, Some(robot)).into_iter().map(|contact| {
        let force = contact.normal * contact.normal_force + contact.friction_force;
        if contact.robots[1] == robot { force } else { -force }
    });
    forces.sum()
}

pub(crate) fn is_asleep(world: &mut Simulation, robot: &str) -> bool {
    let saved = saved(world);
    saved.world_state().robots.iter().any(|known| known.entity.name == robot && known.entity.asleep)
}

fn saved(world: &mut Simulation) -> Saved {
    apply(world, Command::SaveState { name: "here".into() });
    look(world).saved("here").unwrap().saved().clone()
}

/// Returns a box of 1 kg that has just fallen asleep on the ground.
fn sleeper(time_step: f64, substeps: u32) -> Simulation {
    let mut world = world(time_step);
    set_physics(&mut world, PhysicsChange { substeps: Some(substeps), ..Default::default() });
    spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
    spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at(DVec3::Z * 0.1), false));
    (0..(1.5 / time_step) as u64).find(|_| {
        world.step();
        is_asleep(&mut world, "box")
    });
    assert!(is_asleep(&mut world, "box"));
    world
}

/// With each time step the second of rest ends in another part of a step. The force equals the weight at
/// once, from then on, and in worlds that took over the state.
#[test]
fn a_sleeping_box_pushes_the_ground_with_its_weight_at_any_number_of_substeps() {
    for substeps in 1..=10 {
        for time_step in [1e-3, 7e-4, 3e-3, 0.011] {
            let mut world = sleeper(time_step, substeps);
            let mut imported = simd_tests::scenes::world(1e-3);
            let here = saved(&mut world);
            let state = Saved::new(here.world_state().clone(), here.parts()).unwrap();
            apply(&mut imported, Command::ImportSavedState { name: "it".into(), saved: state });
            apply(&mut imported, Command::RestoreState { name: "it".into() });
            for step in 0..5 {
                for world in [&mut world, &mut imported] {
                    let force = force_on(world, "box");
                    let error = force.distance(DVec3::Z * G);
                    assert!(error < SETTLED, "{substeps} parts of {time_step} s, step {step}: {force}");
                    world.step();
                }
            }
            apply(&mut world, Command::RestoreState { name: "here".into() });
            let force = force_on(&world, "box");
            assert!(force.distance(DVec3::Z * G) < SETTLED, "{substeps} parts, restored: {force}");
        }
    }
}

/// The base of a moving arm does not move, and wakes nothing.
#[test]
fn a_box_that_sleeps_on_the_base_of_a_moving_arm_pushes_it_with_its_weight() {
    for substeps in [1, 3, 4] {
        let mut world = world(1e-3);
        set_physics(&mut world, PhysicsChange { substeps: Some(substeps), ..Default::default() });
        let mut model = crate::chains::chain(1);
        model.links[0].collisions = cuboid(DVec3::new(1.0, 1.0, 0.2), 1.0).links[0].collisions.clone();
        spawn(&mut world, robot("arm", &Arc::new(model), DPose3::IDENTITY, true));
        spawn(&mut world, robot("box", &cuboid(DVec3::splat(0.2), 1.0), at(DVec3::Z * 0.2), false));
        (0..1_500).for_each(|_| world.step());
        assert!(is_asleep(&mut world, "box") && look(&world).velocities[0].abs() > 1e-3);
        for _ in 0..20 {
            world.step();
            let force = force_on(&world, "box");
            assert!(force.distance(DVec3::Z * G) < SETTLED, "{substeps} parts: {force}");
        }
    }
}

/// Newton's second law over the step in which a ball hits it, which may be in any of its parts. Until then it
/// carried its weight. m dv / dt = F - m g; the hit is some thousand newtons.
#[test]
fn a_box_that_is_woken_within_a_step_has_borne_its_weight_until_then() {
    let mut parts = 0;
    for height in 0..40 {
        for substeps in [1, 4, 10] {
            let mut world = sleeper(1e-3, substeps);
            let start = at(DVec3::Z * (0.25 + 0.01 + 1e-4 * f64::from(height)));
            spawn(&mut world, robot("ball", &ball(0.05, 1.0), start, false));
            throw(&mut world, "ball", DVec3::Z * -3.0, DVec3::ZERO);
            (0..20).find(|_| {
                world.step();
                !is_asleep(&mut world, "box")
            });
            let velocity = look(&world).roots[1].linear;
            let force = force_on(&world, "box");
            let error = (velocity / 1e-3 + DVec3::Z * G).distance(force);
            assert!(error < 0.1, "{substeps} parts, {height}: {force} N for {velocity} m/s, off by {error}");
            parts += contacts(&world, Some("ball")).len();
        }
    }
    assert!(parts > 50, "{parts} hits");
}

/// A post bolted to a foot: their joint carries the post's weight, awake and asleep.
#[test]
fn a_joint_of_a_sleeping_robot_carries_what_hangs_on_it() {
    for substeps in 1..=10 {
        let mut world = world(1e-3);
        set_physics(&mut world, PhysicsChange { substeps: Some(substeps), ..Default::default() });
        let foot = cuboid(DVec3::new(0.4, 0.4, 0.1), 1.0).links[0].clone();
        let mut model = crate::chains::chain(1);
        (model.joints[0].kind, model.joints[0].axis) = (JointKind::Fixed, DVec3::Z);
        model.links[0] = foot;
        model.links[1].inertial.center_of_mass = DVec3::ZERO;
        let model: Arc<RobotModel> = Arc::new(model);
        spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
        spawn(&mut world, robot("post", &model, at(DVec3::Z * 0.05), false));
        let mut asleep = 0;
        for step in 0..1_200 {
            world.step();
            if step < 900 {
                continue;
            }
            asleep += usize::from(is_asleep(&mut world, "post"));
            let seen = look(&world);
            let (post, _) = seen.entity("post").unwrap();
            let wrenches = seen.joint_reactions(post, world.settings().gravity).unwrap();
            let [force, torque] = wrenches[0];
            assert!(force.distance(DVec3::Z * G) < SETTLED, "{substeps} parts, step {step}: {force}");
            assert!(torque.length() < SETTLED, "{substeps} parts, step {step}: {torque}");
        }
        assert!(asleep > 100);
    }
}

/// Forces are those of the last step, with its length.
#[test]
fn another_time_step_does_not_change_the_forces_of_the_last_step() {
    let mut world = sleeper(1e-3, 4);
    for (time_step, substeps) in [(4e-3, 1), (1e-3, 3), (0.01, 10), (1e-3, 1)] {
        let change = PhysicsChange {
            time_step: Some(time_step),
            substeps: Some(substeps),
            ..PhysicsChange::default()
        };
        set_physics(&mut world, change);
        let force = force_on(&world, "box");
        assert!(force.distance(DVec3::Z * G) < SETTLED, "{time_step} s in {substeps}: {force}");
        world.step();
    }
}

/// Boxes and a table, some of which are deleted, spawned, thrown, disabled and given substeps. A body that
/// lies still for a while, asleep or not, is supported with its weight and its load.
#[test]
fn bodies_at_rest_are_carried_whatever_came_and_went() {
    let mut checked = [0; 2];
    for seed in 0..12 {
        let rng = &mut Rng::with_seed(seed);
        let mut world = world([1e-3, 2e-3][rng.usize(0..2)]);
        spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
        let mut count = 0;
        for _ in 0..14 {
            match rng.u8(0..6) {
                0..=2 => {
                    let x = 0.5 * f64::from(rng.u8(0..4));
                    let top = 0.15 + 0.25 * f64::from(count as u8 / 4);
                    let model = cuboid(DVec3::splat(0.2), 1.0 + rng.f64());
                    spawn(
                        &mut world,
                        robot(&format!("box-{count}"), &model, at(DVec3::new(x, 0.0, top)), false),
                    );
                    count += 1;
                }
                3 if count > 0 => {
                    let name = format!("box-{}", rng.usize(..count));
                    let _gone_before = world.apply(&Command::Delete { robot: name });
                }
                4 => {
                    let substeps = Some(rng.u32(1..=10));
                    set_physics(&mut world, PhysicsChange { substeps, ..Default::default() });
                }
                _ => apply(&mut world, Command::SaveState { name: "before".into() }),
            }
            for _ in 0..rng.usize(100..900) {
                world.step();
            }
            if rng.u8(0..4) == 0 && world.apply(&Command::RestoreState { name: "before".into() }).is_ok() {
                (0..2).for_each(|_| world.step());
            }
            let before = look(&world);
            world.step();
            let seen = look(&world);
            let saved = saved(&mut world);
            let h = world.settings().time_step;
            for (index, root) in seen.roots.iter().enumerate().skip(1) {
                let entity = &seen.world.entities[index];
                let mass = entity.model.links[0].inertial.mass;
                let change = (root.linear - before.roots[index].linear) * (mass / h);
                let force = force_on(&world, &entity.name);
                let error = (force - DVec3::Z * (mass * G)).distance(change);
                checked[usize::from(saved.world_state().robots[index].entity.asleep)] += 1;
                assert!(error < 0.2, "seed {seed}, {}: {force} N, off by {error}", entity.name);
            }
        }
    }
    println!("{} awake, {} asleep", checked[0], checked[1]);
    assert!(checked[0] > 50 && checked[1] > 100, "{checked:?}");
}

/// One that stays awake keeps what it touches awake, also after its state went through a file, and sleeps once it may.
#[test]
fn a_robot_that_stays_awake_does_not_sleep_and_says_so_in_its_state() {
    let set = |world: &mut Simulation, awake: bool| {
        let stays_awake = Some(awake);
        apply(world, Command::SetLinkProperties { robot: "box".into(), links: Vec::new(), stays_awake });
    };
    let mut world = sleeper(1e-3, 1);
    spawn(&mut world, robot("upper", &cuboid(DVec3::splat(0.1), 1.0), at(DVec3::Z * 0.25), false));
    set(&mut world, true);
    assert!(!is_asleep(&mut world, "box"), "it wakes at once");
    assert!(look(&world).settings[1].stays_awake);
    (0..2_000).for_each(|_| world.step());
    assert!(!is_asleep(&mut world, "box") && !is_asleep(&mut world, "upper"));
    let mut other = simd_tests::scenes::world(1e-3);
    let saved = through_a_file(&world, "here");
    apply(&mut other, Command::ImportSavedState { name: "it".into(), saved });
    apply(&mut other, Command::RestoreState { name: "it".into() });
    assert_eq!(other.fingerprint(), world.fingerprint());
    (0..2_000).for_each(|_| other.step());
    assert!(!is_asleep(&mut other, "box"));
    set(&mut other, false);
    (0..2_000).for_each(|_| other.step());
    assert!(is_asleep(&mut other, "box") && is_asleep(&mut other, "upper"));
}
