//! Robots begin as their description says, and several come at one moment.

use simd_model::setup::{DriveMode, JointSetup, Setup};

use super::*;

/// The arm, of whose joint something is said.
fn arm_that(setup: JointSetup) -> Arc<RobotModel> {
    let mut model = RobotModel::clone(&arm());
    model.setup = Setup { joints: vec![setup], ..Setup::default() };
    Arc::new(model)
}

fn axis(world: &Simulation) -> &crate::dynamics::Axis {
    let body = &world.entities[0].body;
    let index = body.tree().joints[0].clone().next().unwrap();
    &body.axes()[body.tree().bodies[index].velocity]
}

#[test]
fn a_joint_starts_where_and_as_its_description_says() {
    let setup = JointSetup {
        armature: 0.01,
        position: Some(0.5),
        stiffness: Some(40.0),
        damping: Some(2.0),
        ..JointSetup::default()
    };
    let world = world_with(1e-3, spawn("arm", arm_that(setup)));
    let seen = look(&world);
    assert_eq!(seen.positions, [0.5]);
    let axis = axis(&world);
    assert_eq!(axis.actuator.mode, crate::dynamics::Mode::Hold);
    assert_eq!(axis.actuator.target, 0.5);
    let settings = &axis.settings;
    assert_eq!((settings.armature, settings.default_stiffness, settings.default_damping), (0.01, 40.0, 2.0));
}

#[test]
fn what_a_spawn_asks_for_comes_before_the_description() {
    let setup = JointSetup { position: Some(0.5), ..JointSetup::default() };
    let asked = Spawn { joint_positions: vec![("shoulder".into(), 0.2)], ..spawn("arm", arm_that(setup)) };
    assert_eq!(look(&world_with(1e-3, asked)).positions, [0.2]);
}

#[test]
fn modes_are_the_descriptions_unless_nothing_is_to_be_driven() {
    use crate::dynamics::Mode;
    for (said, driven, passive) in [
        (DriveMode::Passive, Mode::Passive, Mode::Passive),
        (DriveMode::Velocity, Mode::Velocity, Mode::Passive),
        (DriveMode::Effort, Mode::Effort, Mode::Passive),
        (DriveMode::Spring(0.3), Mode::Position, Mode::Position),
    ] {
        let setup = JointSetup { mode: Some(said), stiffness: Some(5.0), ..JointSetup::default() };
        for (asked, expected) in [(false, driven), (true, passive)] {
            let world = world_with(1e-3, Spawn { passive: asked, ..spawn("arm", arm_that(setup)) });
            assert_eq!(axis(&world).actuator.mode, expected, "{said:?}, passive: {asked}");
        }
    }
}

#[test]
fn several_robots_come_at_one_moment_or_none_of_them() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    let before = world.fingerprint();
    let both = |names: [&str; 2]| Command::SpawnAll(names.map(|name| spawn(name, arm())).into());
    for refused in [["a", "arm"], ["a", "a"], ["a", "no name"]] {
        world.apply(&both(refused)).unwrap_err();
        assert_eq!((world.fingerprint(), world.entities.len()), (before, 1), "{refused:?}");
    }
    let applied = world.apply(&both(["a", "b"])).unwrap();
    assert_eq!(applied.reply, Reply::SpawnedAll { names: vec!["a".into(), "b".into()] });
    let versions: Vec<u64> = world.entities.iter().map(|entity| entity.version).collect();
    assert!(versions.windows(2).all(|pair| pair[0] < pair[1]), "{versions:?}");
    let renamed = [spawn("a", arm()), spawn("a", arm())];
    let renamed = renamed.map(|spawn| Spawn { allow_renaming: true, ..spawn }).into();
    let applied = world.apply(&Command::SpawnAll(renamed)).unwrap();
    assert_eq!(applied.reply, Reply::SpawnedAll { names: vec!["a_1".into(), "a_2".into()] });
}
