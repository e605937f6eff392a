//! Rules of sensors: mounts, names, creation and deletion.

use simd_model::sensor::{
    Camera, ChannelNoise, Channels, MAX_SENSORS_PER_ROBOT, Noise, Picture, RangeLimits, Scan, Sensor,
    SensorKind, SensorMount, Sweep,
};

use super::*;
use crate::simulation::sensors::{MAX_SENSORS, SensorState, WorldSensor};

fn imu(name: &str, link: &str) -> CreateSensor {
    CreateSensor {
        robot: "arm".into(),
        name: name.into(),
        link: link.into(),
        joint: String::new(),
        pose: DPose3::IDENTITY,
        rate: None,
        kind: SensorKind::Imu,
        noise: Vec::new(),
        seed: None,
    }
}

fn encoder(joint: &str) -> CreateSensor {
    CreateSensor { joint: joint.into(), kind: SensorKind::Encoder { backlash: 0.0 }, ..imu("", "") }
}

fn create(world: &mut Simulation, create: CreateSensor) -> Result<Applied, Error> {
    world.apply(&Command::CreateSensor(Box::new(create)))
}

fn delete(world: &mut Simulation, name: &str) -> Result<Applied, Error> {
    world.apply(&Command::DeleteSensor { robot: "arm".into(), name: name.into() })
}

/// Returns the names of all sensors, with the index of their robot.
fn listed(world: &Simulation) -> Vec<(usize, String)> {
    let name = |sensor: &WorldSensor| (sensor.robot, sensor.definition.name.clone());
    look(world).sensors.iter().map(name).collect()
}

/// Returns the tutorial's arm with sensors in its description.
fn arm_with_sensors(names: &[&str]) -> Arc<RobotModel> {
    let mut model = RobotModel::clone(&arm());
    model.setup.sensors = names
        .iter()
        .map(|name| Sensor {
            name: (*name).into(),
            on: SensorMount::Link(1),
            pose: DPose3::IDENTITY,
            rate: Some(100.0),
            kind: SensorKind::Imu,
            noise: Vec::new(),
            seed: 9,
        })
        .collect();
    Arc::new(model)
}

fn reload(world: &mut Simulation, model: Arc<RobotModel>) {
    let reload = Reload { robot: "arm".into(), model, shapes: Default::default() };
    world.apply(&Command::Reload(Box::new(reload))).unwrap();
}

#[test]
fn sensors_are_named_by_their_kind_or_as_asked() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.take_events();
    for (asked, expected) in [("", "imu_1"), ("", "imu_2"), ("left-eye", "left-eye")] {
        let applied = create(&mut world, imu(asked, "arm")).unwrap();
        assert_eq!(applied.reply, Reply::SensorCreated { name: expected.into() });
    }
    delete(&mut world, "imu_1").unwrap();
    create(&mut world, imu("", "")).unwrap();
    create(&mut world, encoder("shoulder")).unwrap();
    let names: Vec<String> = listed(&world).into_iter().map(|(_, name)| name).collect();
    assert_eq!(names, ["imu_2", "left-eye", "imu_1", "encoder_1"]);
    let events: Vec<EventKind> = world.take_events().into_iter().map(|event| event.kind).collect();
    let of = |sensor: &str| (String::from("arm"), String::from(sensor));
    let (robot, sensor) = of("imu_1");
    assert_eq!(events.first(), Some(&EventKind::SensorCreated { robot, sensor }));
    let (robot, sensor) = of("imu_1");
    assert_eq!(events.get(3), Some(&EventKind::SensorDeleted { robot, sensor }));
    // A sensor that was added again is a different one.
    let ids: std::collections::BTreeSet<u64> = look(&world).sensors.iter().map(|sensor| sensor.id).collect();
    assert_eq!(ids.len(), 4);
    assert!(!ids.contains(&1));
}

#[test]
fn invalid_sensors_are_refused_with_the_field() {
    let lidar = |samples, least, most| {
        let range = RangeLimits { least: 0.0, most: 9.0 };
        let horizontal = Sweep { samples, least, most };
        SensorKind::Lidar(Scan { horizontal, vertical: Sweep::one(0.0), range, rolling: false })
    };
    let camera = |near, far, horizontal_field_of_view| {
        let (picture, width, height) = (Picture::Color, 4, 3);
        let camera = Camera { picture, width, height, horizontal_field_of_view, near, far };
        CreateSensor { kind: SensorKind::Camera(camera), ..imu("", "") }
    };
    let noisy = |channels, noise: Noise| vec![ChannelNoise { channels, axis: None, noise }];
    let mut world = world_with(1e-3, spawn("arm", arm()));
    create(&mut world, imu("taken", "")).unwrap();
    for (asked, why) in [
        (CreateSensor { robot: "leg".into(), ..imu("", "") }, "there is no robot \"leg\""),
        (imu("", "hand"), "has no link \"hand\""),
        (imu("taken", ""), "has a sensor \"taken\" already"),
        (imu("a b", ""), "name is \"a b\""),
        (encoder("hip"), "has no joint \"hip\""),
        (encoder(""), "joint is empty; a sensor of the kind encoder is on a joint"),
        (CreateSensor { link: "arm".into(), ..encoder("shoulder") }, "link is \"arm\""),
        (CreateSensor { joint: "shoulder".into(), ..imu("", "") }, "joint is \"shoulder\""),
        (CreateSensor { rate: Some(0.0), ..imu("", "") }, "rate is 0"),
        (CreateSensor { rate: Some(f64::NAN), ..imu("", "") }, "rate is NaN"),
        (CreateSensor { rate: Some(1e300), ..imu("", "") }, "rate is 1e300;"),
        (
            CreateSensor { pose: DPose3::from_translation(DVec3::NAN), ..imu("", "") },
            "pose.position.x is NaN",
        ),
        (CreateSensor { kind: SensorKind::Contact { threshold: -1.0 }, ..imu("", "") }, "contact.threshold"),
        (
            CreateSensor { kind: SensorKind::Range(RangeLimits { least: 2.0, most: 1.0 }), ..imu("", "") },
            "range.max is 1",
        ),
        (
            CreateSensor { kind: SensorKind::Range(RangeLimits { least: 0.5, most: 1e13 }), ..imu("", "") },
            "range.max is 10000000000000; it must be more than 0.5 and at most 1e12",
        ),
        (camera(1e-7, 1.0, 1.0), "camera.near is 0.0000001; it must be between 1e-6 and 1e12"),
        (camera(0.1, f64::INFINITY, 1.0), "camera.far is inf; it must be more than 0.1 and at most 1e12"),
        (camera(0.1, 0.05, 1.0), "camera.far is 0.05"),
        (camera(0.1, 1.0, 1e-7), "camera.horizontal_field_of_view is 0.0000001"),
        (camera(0.1, 1.0, f64::NAN), "camera.horizontal_field_of_view is NaN"),
        (CreateSensor { kind: lidar(0, 0.0, 1.0), ..imu("", "") }, "lidar.horizontal.samples is 0"),
        (CreateSensor { kind: lidar(9, 1.0, 0.0), ..imu("", "") }, "lidar.horizontal.max is 0"),
        (CreateSensor { kind: lidar(9, -4.0, 4.0), ..imu("", "") }, "lidar.horizontal.max is 4"),
        (CreateSensor { kind: lidar(u32::MAX, 0.0, 1.0), ..imu("", "") }, "131072 rays"),
        (
            CreateSensor { pose: DPose3::from_translation(DVec3::splat(1e308)), ..imu("", "") },
            "pose.position.x is 1e308",
        ),
        (
            CreateSensor { noise: noisy(Channels::Range, Noise::default()), ..imu("", "") },
            "noise[0].channel is range;",
        ),
        (
            // Its result would be infinite, and a world saved with it could not be read again.
            CreateSensor {
                noise: noisy(Channels::AngularVelocity, Noise { random_walk: 1e308, ..Noise::default() }),
                ..imu("", "")
            },
            "noise[0].random_walk is 1e308; it must be between 0 and 1e12",
        ),
        (
            CreateSensor {
                noise: noisy(Channels::Orientation, Noise { bias_mean: -1e13, ..Noise::default() }),
                ..imu("", "")
            },
            "noise[0].bias_mean is -10000000000000; it must be between -1e12 and 1e12",
        ),
        (
            CreateSensor {
                noise: noisy(Channels::AngularVelocity, Noise { dropout: 1.5, ..Noise::default() }),
                ..imu("", "")
            },
            "noise[0].dropout is 1.5",
        ),
        (
            CreateSensor {
                noise: noisy(Channels::Orientation, Noise { quantum: 0.1, ..Noise::default() }),
                ..imu("", "")
            },
            "noise[0].quantum",
        ),
    ] {
        let before = world.fingerprint();
        let refused = create(&mut world, asked).expect_err(why).to_string();
        assert!(refused.contains(why), "{refused}, not {why}");
        assert_eq!(world.fingerprint(), before);
    }
    let refused = delete(&mut world, "gone").unwrap_err().to_string();
    assert_eq!(refused, "robot \"arm\" has no sensor \"gone\"; its sensors are \"taken\"");
}

#[test]
fn sensors_are_bounded_by_robot_and_by_world() {
    let mut world = world(1e-3);
    for robot in 0..MAX_SENSORS / MAX_SENSORS_PER_ROBOT {
        let name = format!("arm-{robot}");
        world.apply(&Command::Spawn(Box::new(spawn(&name, arm())))).unwrap();
        for _ in 0..MAX_SENSORS_PER_ROBOT {
            create(&mut world, CreateSensor { robot: name.clone(), ..imu("", "") }).unwrap();
        }
    }
    let more = create(&mut world, CreateSensor { robot: "arm-0".into(), ..imu("", "") });
    assert_eq!(more.unwrap_err().to_string(), "the number of sensors would be 1025, and the limit is 1024");
    let described = spawn("arm", arm_with_sensors(&["a"]));
    let refused = world.apply(&Command::Spawn(Box::new(described))).unwrap_err();
    assert_eq!(refused.to_string(), "the number of sensors would be 1025, and the limit is 1024");
    assert!(look(&world).entity("arm").is_none());
    let name = look(&world).sensors[0].definition.name.clone();
    world.apply(&Command::DeleteSensor { robot: "arm-0".into(), name }).unwrap();
    world.apply(&Command::Spawn(Box::new(spawn("arm", arm_with_sensors(&["a"]))))).unwrap();
    let more = create(&mut world, CreateSensor { robot: "arm-1".into(), ..imu("", "") });
    assert!(more.is_err());
}

#[test]
fn a_robot_has_at_most_64_sensors() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    (0..MAX_SENSORS_PER_ROBOT).for_each(|_| drop(create(&mut world, imu("", "")).unwrap()));
    let refused = create(&mut world, imu("", "")).unwrap_err().to_string();
    assert_eq!(refused, "the number of sensors of robot \"arm\" would be 65, and the limit is 64");
}

#[test]
fn sensors_of_a_description_come_and_go_with_their_robot() {
    let mut world = world_with(1e-3, spawn("first", arm_with_sensors(&["a"])));
    world.apply(&Command::Spawn(Box::new(spawn("arm", arm_with_sensors(&["b", "c"]))))).unwrap();
    let of = |list: &[(usize, &str)]| -> Vec<(usize, String)> {
        list.iter().map(|(robot, name)| (*robot, (*name).to_owned())).collect()
    };
    assert_eq!(listed(&world), of(&[(0, "a"), (1, "b"), (1, "c")]));
    assert!(look(&world).sensors.iter().all(|sensor| sensor.definition.is_described));
    assert!(look(&world).sensors.iter().all(|sensor| sensor.definition.seed == 9));
    world.apply(&Command::Delete { robot: "first".into() }).unwrap();
    assert_eq!(listed(&world), of(&[(0, "b"), (0, "c")]));
    // A state shares the list with the previous one until something changes.
    let before = Arc::clone(&look(&world).sensors);
    world.step();
    assert!(Arc::ptr_eq(&before, &look(&world).sensors));
}

#[test]
fn a_reload_creates_described_sensors_again_and_keeps_those_of_clients_that_have_a_place() {
    let mut world = world_with(1e-3, spawn("arm", arm_with_sensors(&["old", "both"])));
    create(&mut world, imu("kept", "arm")).unwrap();
    create(&mut world, imu("clash", "arm")).unwrap();
    let id = |world: &Simulation, name: &str| {
        let state = look(world);
        state.sensors.iter().find(|sensor| sensor.definition.name == name).map(|sensor| sensor.id)
    };
    let (kept, both) = (id(&world, "kept"), id(&world, "both"));
    (0..150).for_each(|_| world.step());
    world.take_events();
    reload(&mut world, arm_with_sensors(&["both", "clash"]));
    let names: Vec<String> = listed(&world).into_iter().map(|(_, name)| name).collect();
    assert_eq!(names, ["both", "clash", "kept"]);
    assert_eq!(id(&world, "kept"), kept);
    assert_ne!(id(&world, "both"), both);
    let gone: Vec<EventKind> = world.take_events().into_iter().map(|event| event.kind).collect();
    let (robot, sensor) = ("arm".to_owned(), "clash".to_owned());
    assert!(gone.contains(&EventKind::SensorDeleted { robot, sensor }), "{gone:?}");

    // A model without the link.
    let mut bare = RobotModel::clone(&arm());
    bare.links[1].name = "forearm".into();
    reload(&mut world, Arc::new(bare));
    assert_eq!(listed(&world), []);
}

#[test]
fn a_claimed_robot_takes_sensors_of_its_holder_alone() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    create(&mut world, imu("mine", "")).unwrap();
    let claim = ClaimId(7);
    let joints = vec![JointSelection { robot: "arm".into(), joints: Vec::new() }];
    let request = ClaimRequest { claim, holder: "me".into(), joints, ..ClaimRequest::default() };
    world.apply(&Command::Claim(request)).unwrap();
    let add = Command::CreateSensor(Box::new(imu("other", "")));
    let remove = Command::DeleteSensor { robot: "arm".into(), name: "mine".into() };
    for command in [&add, &remove] {
        let refused = world.apply(command).unwrap_err();
        assert_eq!(refused.to_string(), "robot \"arm\" is claimed by \"me\"");
        world.apply_for(command, Some(claim)).unwrap();
    }
    assert_eq!(listed(&world), [(0, "other".to_owned())]);
}

/// A disabled robot's sensor measures nothing, and continues when the robot is restored.
#[test]
fn a_robot_that_is_disabled_takes_no_samples() {
    let mut world = world_with(1e-3, Spawn { passive: true, ..spawn("arm", arm()) });
    create(&mut world, imu("", "")).unwrap();
    world.entities[0].body.velocities_mut()[0] = f64::NAN;
    let mut due = Vec::new();
    (0..5).for_each(|_| world.step());
    world.take_due_samples(&mut due);
    assert!(due.is_empty(), "{due:?}");
    let scope = ResetScope { state: true, ..ResetScope::default() };
    world.apply(&Command::Reset(scope)).unwrap();
    (0..5).for_each(|_| world.step());
    world.take_due_samples(&mut due);
    assert_eq!(due.len(), 1);
}

#[test]
fn a_restored_state_has_the_sensors_that_it_had() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    create(&mut world, imu("one", "")).unwrap();
    world.apply(&Command::SaveState { name: "s".into() }).unwrap();
    let id = look(&world).sensors[0].id;
    delete(&mut world, "one").unwrap();
    create(&mut world, imu("two", "")).unwrap();
    world.apply(&Command::RestoreState { name: "s".into() }).unwrap();
    assert_eq!(listed(&world), [(0, "one".to_owned())]);
    assert_eq!(look(&world).sensors[0].id, id);
    // The same state from elsewhere: its sensors are different ones here.
    let saved = look(&world).saved("s").unwrap().saved().clone();
    world.apply(&Command::ImportSavedState { name: "t".into(), saved }).unwrap();
    world.apply(&Command::RestoreState { name: "t".into() }).unwrap();
    assert_eq!(listed(&world), [(0, "one".to_owned())]);
    assert!(look(&world).sensors[0].id > id);
}

/// A state that no world can be in.
#[test]
fn a_state_with_sensors_that_cannot_be_is_refused() {
    type Change = fn(&mut SensorState);
    let mut world = world_with(1e-3, spawn("arm", arm()));
    create(&mut world, imu("one", "")).unwrap();
    create(&mut world, imu("two", "")).unwrap();
    let changes: [(Change, &str); 6] = [
        (|sensor| sensor.begun = 9.0, "times beyond"),
        (|sensor| sensor.walk[0] = f64::NAN, "walks"),
        (|sensor| Arc::make_mut(&mut sensor.definition).name = "two".into(), "that of another"),
        (|sensor| Arc::make_mut(&mut sensor.definition).link = 1, "cannot have it"),
        (|sensor| Arc::make_mut(&mut sensor.definition).on = SensorMount::Joint(0), "cannot have it"),
        (|sensor| Arc::make_mut(&mut sensor.definition).rate = Some(-1.0), "rate"),
    ];
    for (change, why) in changes {
        let saved = world.to_saved();
        let mut state = saved.world_state().clone();
        assert!(Saved::new(state.clone(), saved.parts()).is_ok());
        change(&mut state.robots[0].entity.sensors[0]);
        let refused = Saved::new(state, saved.parts()).unwrap_err().to_string();
        assert!(refused.contains(why), "{refused}, not {why}");
    }
}

#[test]
fn a_state_with_more_sensors_than_a_world_may_have_is_refused() {
    let mut world = world_with(1e-3, spawn("arm", arm()));
    create(&mut world, imu("one", "")).unwrap();
    let saved = world.to_saved();
    let mut state = saved.world_state().clone();
    let sensors = &mut state.robots[0].entity.sensors;
    for index in 0..MAX_SENSORS_PER_ROBOT {
        let mut sensor = sensors[0].clone();
        Arc::make_mut(&mut sensor.definition).name = format!("more-{index}");
        sensors.push(sensor);
    }
    let refused = Saved::new(state, saved.parts()).unwrap_err().to_string();
    assert!(refused.contains("65 sensors, of 64"), "{refused}");
}

/// The newest reading of each sensor is stored, however large.
#[test]
fn the_rays_of_a_world_are_bounded() {
    let range = RangeLimits { least: 0.0, most: 9.0 };
    let horizontal = Sweep { samples: 131_072, least: 0.0, most: 1.0 };
    let largest = SensorKind::Lidar(Scan { horizontal, vertical: Sweep::one(0.0), range, rolling: false });
    let mut world = world_with(1e-3, spawn("arm", arm()));
    world.apply(&Command::Spawn(Box::new(spawn("other", arm())))).unwrap();
    for _ in 0..MAX_SENSORS_PER_ROBOT {
        create(&mut world, CreateSensor { kind: largest, ..imu("", "") }).unwrap();
    }
    let one_ray = || CreateSensor { robot: "other".into(), kind: SensorKind::Range(range), ..imu("", "") };
    let refused = create(&mut world, one_ray()).unwrap_err().to_string();
    assert_eq!(refused, "the number of rays of all sensors would be 8388609, and the limit is 8388608");
    create(&mut world, CreateSensor { robot: "other".into(), ..imu("", "") }).unwrap();
    delete(&mut world, "lidar_1").unwrap();
    create(&mut world, one_ray()).unwrap();
}
