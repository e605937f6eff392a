//! A world that was exported to a file and imported elsewhere continues equal to the bit.
//!
//! Compares the hash over everything that a step reads, after each step, without tolerance.

use std::collections::BTreeMap;
use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::dynamics::actuator::Drive;
use simd_core::simulation::Saved;
use simd_core::simulation::command::*;
use simd_core::simulation::world_state::{RestPose, RobotState, WorldState};
use simd_core::{Command, Integrator, Simulation, SurfaceCombination};
use simd_model::RobotModel;
use simd_model::robot::Sha256;
use simd_tests::robots;
use simd_tests::scenes::*;
use simd_world::loading::saved_state_file::{Content, RobotSource, open, seal};

use crate::random_commands::random_command;
use crate::random_robots;

/// Returns a saved state that was written to a file and read again. The models exist on the other side, and
/// the shapes are made again.
pub(crate) fn through_a_file(world: &Simulation, name: &str) -> Saved {
    through_a_file_with(world, name, MeshShapes::Hull)
}

/// Like [`through_a_file`], for a world whose meshes have other shapes than hulls.
pub(crate) fn through_a_file_with(world: &Simulation, name: &str, mesh_shapes: MeshShapes) -> Saved {
    let seen = look(world);
    let saved = seen.saved(name).unwrap().saved();
    let source = |robot: &RobotState| RobotSource {
        description: Sha256::of(b""),
        assets: BTreeMap::new(),
        scale: 1f64.to_bits(),
        mesh_shapes,
        fixed_base: robot.entity.fixed_base,
    };
    let sources: Vec<RobotSource> = saved.world_state().robots.iter().map(source).collect();
    let file = seal(&Content::new(name, saved, sources.clone(), Vec::new()));
    let content = open(&file, 1_000).unwrap().content;
    let made = |(model, source): (&Arc<RobotModel>, &RobotSource)| {
        let shapes = Shapes::reusing(model, source.fixed_base, source.mesh_shapes, &[]);
        (Arc::clone(model), Arc::new(shapes))
    };
    let made = saved.models().zip(&sources).map(made).collect();
    let again = content.into_saved(made).unwrap();
    let second = seal(&Content::new(name, &again, sources, Vec::new()));
    assert_eq!(file, second, "an equal world is an equal file");
    again
}

/// Robots with limits, mimic, free and fixed roots, and a meshed arm that collides with itself. Balls, boxes,
/// cylinders and capsules fall on a plane among them; two of them overlap at first.
fn scene(rng: &mut Rng) -> Simulation {
    let mut world = world(1e-3);
    spawn(
        &mut world,
        Spawn {
            contact_settings: surface(0.7, 0.1),
            ..robot("ground", &plane(DVec3::Z), at(DVec3::ZERO), true)
        },
    );
    for i in 0..3 {
        let model = Arc::new(random_robots::robot(rng));
        let pose = at(DVec3::new(2.0 * f64::from(i), 3.0, 1.0 + rng.f64()));
        let contact_settings = ContactSettings { self_collision: rng.bool(), ..ContactSettings::default() };
        let passive = rng.u8(0..4) == 0;
        spawn(
            &mut world,
            Spawn { passive, contact_settings, ..robot(&format!("robot-{i}"), &model, pose, rng.bool()) },
        );
    }
    let (arm, _) = robots::read("Two Link.v2/urdf/Two Link.v2.urdf");
    for (name, x) in [("arm", 0.0), ("other-arm", 0.05)] {
        let contact_settings = ContactSettings { self_collision: true, ..ContactSettings::default() };
        let passive = name == "other-arm";
        spawn(&mut world, Spawn { passive, contact_settings, ..robot(name, &arm, at(DVec3::X * x), true) });
    }
    for i in 0..8 {
        let size = 0.05 + 0.05 * rng.f64();
        let model = match i % 4 {
            0 => ball(size, 0.5),
            1 => cuboid(DVec3::new(size, 1.5 * size, 2.0 * size), 0.5),
            2 => solid(
                &[(DPose3::IDENTITY, simd_model::robot::Geometry::Cylinder { radius: size, length: size })],
                0.5,
            ),
            _ => solid(
                &[(DPose3::IDENTITY, simd_model::robot::Geometry::Capsule { radius: size, length: size })],
                0.5,
            ),
        };
        let turn = DQuat::from_scaled_axis(DVec3::new(rng.f64(), rng.f64(), rng.f64()) * 3.0);
        let place = DVec3::new(0.4 * rng.f64() - 0.2, 0.4 * rng.f64() - 0.2, 0.1 + 0.1 * f64::from(i));
        spawn(&mut world, robot(&format!("body-{i}"), &model, DPose3::from_parts(place, turn), false));
    }
    // A body that has long been still by the time of the first saved state.
    let brick = cuboid(DVec3::splat(0.1), 1.0);
    spawn(&mut world, robot("brick", &brick, at(DVec3::new(0.0, -1.0, 0.05)), false));
    world
}

pub(crate) fn at(place: DVec3) -> DPose3 {
    DPose3::from_translation(place)
}

/// Saved at random steps, with requests of clients before and after. At each later step the imported world is
/// equal to the original, even after commands, which both get, and after a reset.
#[test]
fn an_imported_world_runs_on_to_the_bit() {
    let (mut slept, mut touched, mut wrenches, mut ignored, mut saturated) = (0, 0, 0, 0, 0);
    for seed in 0..6 {
        let rng = &mut Rng::with_seed(seed);
        let mut world = scene(rng);
        for round in 0..4 {
            for _ in 0..rng.usize(1..8) {
                let _either_way = world.apply(&random_command(rng, &world));
                (0..rng.usize(1..300)).for_each(|_| world.step());
            }
            apply(&mut world, Command::SaveState { name: "here".into() });
            let saved = through_a_file(&world, "here");
            let state = saved.world_state();
            slept += state.robots.iter().filter(|robot| robot.entity.asleep).count();
            wrenches += state.robots.iter().map(|robot| robot.entity.applied_wrenches.len()).sum::<usize>();
            let drives = state.robots.iter().flat_map(|robot| &robot.body.drives);
            saturated += drives.filter(|drive| drive.saturated.is_some()).count();
            touched += state.contacts.len();
            ignored += state.ignored_overlaps.len();

            let mut other = simd_tests::scenes::world(2e-3);
            spawn(&mut other, robot("another", &ball(0.1, 1.0), DPose3::IDENTITY, false));
            other.step();
            apply(&mut other, Command::ImportSavedState { name: "there".into(), saved });
            apply(&mut other, Command::RestoreState { name: "there".into() });
            assert_eq!(other.fingerprint(), world.fingerprint(), "seed {seed}, round {round}: at once");
            for part in 0..4 {
                for step in 0..rng.usize(1..200) {
                    world.step();
                    other.step();
                    let place = format!("seed {seed}, round {round}, part {part}, step {step}");
                    assert_eq!(other.fingerprint(), world.fingerprint(), "{place}");
                }
                let command = random_command(rng, &world);
                assert_eq!(world.apply(&command).is_ok(), other.apply(&command).is_ok(), "{command:?}");
            }
        }
    }
    println!(
        "{slept} slept, {touched} touched, {wrenches} wrenches, {ignored} ignored, {saturated} saturated"
    );
    assert!(slept > 2 && touched > 100 && wrenches > 5 && ignored > 0 && saturated > 5);
}

/// Any change of a state, however small, changes the hash: it covers all that relies on it.
#[test]
fn the_hash_sees_every_part_of_a_state() {
    let rng = &mut Rng::with_seed(1);
    let mut world = scene(rng);
    let push = |link: &str, duration| {
        Command::ApplyWrench(LinkWrench {
            robot: "body-0".into(),
            link: link.into(),
            force: DVec3::new(0.0, 0.1, 0.0),
            torque: DVec3::ZERO,
            in_link_axes: false,
            point: DVec3::ZERO,
            duration,
        })
    };
    apply(&mut world, push("body", WrenchDuration::UntilCleared));
    (0..1_500).for_each(|_| world.step());
    let joints = vec![JointTarget {
        joint: "shoulder joint".into(),
        axis: 0,
        target: Target::Position {
            position: 1.0,
            velocity: 0.0,
            stiffness: Some(1e4),
            damping: Some(0.0),
            feed_forward: 0.0,
            max_effort: Some(0.01),
            max_velocity: None,
        },
    }];
    let robots = vec![RobotTargets { robot: "arm".into(), joints, ..Default::default() }];
    apply(&mut world, Command::SetTargets(SetTargets { robots, ..Default::default() }));
    (0..3).for_each(|_| world.step());
    apply(&mut world, Command::SaveState { name: "here".into() });
    let saved = through_a_file(&world, "here");

    type Change = (&'static str, fn(&mut WorldState));
    /// Makes the smallest possible change of a number.
    fn nudge(value: &mut f64) {
        *value = value.next_up();
    }
    fn arm(state: &mut WorldState) -> &mut RobotState {
        state.robots.iter_mut().find(|robot| robot.entity.name == "arm").unwrap()
    }
    fn sleeper(state: &mut WorldState) -> &mut RobotState {
        state.robots.iter_mut().find(|robot| robot.entity.asleep).unwrap()
    }
    fn rest(state: &mut WorldState) -> &mut RestPose {
        &mut sleeper(state).entity.rest_poses[0]
    }
    fn law(state: &mut WorldState) -> &mut Drive {
        arm(state).body.drives.iter_mut().find(|drive| drive.saturated.is_some()).unwrap()
    }
    fn with_wrench(state: &mut WorldState) -> &mut RobotState {
        state.robots.iter_mut().find(|robot| !robot.entity.applied_wrenches.is_empty()).unwrap()
    }
    let changes: &[Change] = &[
        ("step", |it| it.step += 1),
        ("sim time", |it| nudge(&mut it.sim_time)),
        ("step of the time base", |it| it.time_base.0 += 1),
        ("time of the time base", |it| nudge(&mut it.time_base.1)),
        ("gravity", |it| it.settings.gravity.x = -0.0),
        ("substeps", |it| it.settings.substeps += 1),
        ("integrator", |it| it.settings.integrator = Integrator::Euler),
        ("sleeping", |it| it.settings.sleeping = false),
        ("combination of surfaces", |it| it.settings.surface_combination = SurfaceCombination::Max),
        ("a position", |it| nudge(&mut arm(it).body.positions[0])),
        ("a velocity", |it| nudge(&mut arm(it).body.velocities[0])),
        ("a target", |it| nudge(&mut arm(it).body.axes[0].actuator.target)),
        ("a setpoint", |it| nudge(&mut arm(it).body.axes[0].actuator.setpoint)),
        ("damping", |it| nudge(&mut arm(it).body.axes[0].settings.damping)),
        ("a limit", |it| arm(it).body.axes[0].settings.limits.effort = Some(1234.5)),
        ("what a saturated actuator applied", |it| law(it).saturated = None),
        ("the law of a saturated actuator", |it| nudge(&mut law(it).stiffness)),
        ("an impulse of friction", |it| nudge(&mut arm(it).body.impulses.friction[0])),
        ("an impulse of a limit", |it| nudge(&mut arm(it).body.impulses.upper[0])),
        ("a force from outside", |it| nudge(&mut with_wrench(it).body.external[0].linear.x)),
        ("a wrench", |it| nudge(&mut with_wrench(it).entity.applied_wrenches[0].force.z)),
        ("the duration of a wrench", |it| {
            with_wrench(it).entity.applied_wrenches[0].duration = WrenchDuration::NextStep
        }),
        ("whether a wrench is suspended", |it| with_wrench(it).entity.applied_wrenches[0].suspended = true),
        ("a surface", |it| nudge(&mut arm(it).entity.surfaces[0].friction)),
        ("where a sleeper's collider is", |it| nudge(&mut rest(it).world_from_shape.translation.x)),
        ("the margin of a sleeper's collider", |it| nudge(&mut rest(it).margin)),
        ("the motion of a sleeper's collider", |it| nudge(&mut rest(it).drift.x)),
        ("sleep", |it| {
            let sleeper = sleeper(it);
            sleeper.entity.asleep = false;
            sleeper.entity.rest_poses.clear();
        }),
        ("the time of rest", |it| nudge(&mut arm(it).entity.still_for)),
        ("that it was teleported", |it| arm(it).entity.teleported ^= true),
        ("that it is out of the simulation", |it| arm(it).entity.disabled = Some("a reason".into())),
        ("an effort", |it| nudge(&mut arm(it).body.efforts[0])),
        ("a velocity in the middle of the last step", |it| nudge(&mut arm(it).body.half_velocities[0])),
        ("a change of velocity", |it| nudge(&mut arm(it).body.changes[0])),
        ("a change of velocity before", |it| nudge(&mut arm(it).body.changes_before[0])),
        ("what a reset puts back", |it| {
            nudge(&mut Arc::make_mut(&mut arm(it).entity.spawned).positions[0]);
        }),
        ("the state before the last step", |it| nudge(&mut arm(it).entity.last_good.0[0])),
        ("a contact's impulse", |it| nudge(&mut it.contacts[0].impulse.z)),
        ("the impulse of its torque", |it| nudge(&mut it.contacts[0].turning_impulse.z)),
        ("its friction against rolling", |it| nudge(&mut it.contacts[0].point.surface.rolling_friction)),
        ("its friction against spinning", |it| nudge(&mut it.contacts[0].point.surface.spinning_friction)),
        ("its stiffness", |it| it.contacts[0].point.surface.stiffness += 1.0),
        ("its damping", |it| nudge(&mut it.contacts[0].point.surface.damping)),
        ("where a contact is", |it| nudge(&mut it.contacts[0].point.on[1].x)),
        ("a contact", |it| it.contacts.truncate(it.contacts.len() - 1)),
        ("an ignored overlap", |it| it.ignored_overlaps.truncate(it.ignored_overlaps.len() - 1)),
    ];
    let parts = saved.parts();
    let hash = |state: WorldState| {
        let mut world = simd_tests::scenes::world(1e-3);
        apply(
            &mut world,
            Command::ImportSavedState { name: "it".into(), saved: Saved::new(state, parts.clone()).unwrap() },
        );
        apply(&mut world, Command::RestoreState { name: "it".into() });
        world.fingerprint()
    };
    assert_eq!(hash(saved.world_state().clone()), world.fingerprint());
    for (what, change) in changes {
        let mut state = saved.world_state().clone();
        change(&mut state);
        // A disabled robot has no contacts.
        if state.robots.iter().any(|robot| robot.entity.disabled.is_some()) {
            state.contacts.clear();
            state.ignored_overlaps.clear();
        }
        assert_ne!(hash(state), world.fingerprint(), "{what}");
    }
}

/// Versions name layouts that clients remember: none may come twice.
#[test]
fn imported_robots_have_new_versions() {
    let mut world = stack(1e-3);
    apply(&mut world, Command::SaveState { name: "here".into() });
    let saved = through_a_file(&world, "here");
    let mut other = stack(1e-3);
    let versions = |world: &Simulation| -> Vec<u64> {
        world.layout().entities.iter().map(|entity| entity.version).collect()
    };
    let before = versions(&other);
    apply(&mut other, Command::ImportSavedState { name: "there".into(), saved });
    apply(&mut other, Command::RestoreState { name: "there".into() });
    let after = versions(&other);
    assert!(before.iter().all(|version| !after.contains(version)), "{before:?} and {after:?}");
    apply(&mut other, Command::RestoreState { name: "there".into() });
    assert_eq!(versions(&other), after, "the same robots again");
    spawn(&mut other, robot("last", &ball(0.1, 1.0), at(DVec3::X * 9.0), false));
    let last = *versions(&other).last().unwrap();
    assert!(!after.contains(&last) && !before.contains(&last));
}
