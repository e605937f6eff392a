//! Recordings: made, listed, read, replayed and deleted, alike over every transport.

use std::time::Duration;

use simd_client::proto::event::Kind;
use simd_client::proto::{self, sensor};
use simd_client::proto::{ErrorReason, RecordingEndCause, RecordingState, StartRecordingRequest};
use simd_client::{Client, Target};
use simd_tests::daemon::{Daemon, Via};
use simd_tests::process::soon;
use simd_world::handle::RunState;
use simd_world::recording::{Replayed, replay};
use tempfile::TempDir;

use crate::cameras::{camera, draw};
use crate::{load_arm, over_every_transport, set};

over_every_transport! {
    a_downloaded_recording_replays_to_the_same_bits,
    readings_of_sensors_are_recorded_each_once,
    pictures_of_cameras_are_recorded_while_a_renderer_draws_them,
    without_a_folder_the_error_names_the_setting,
    names_that_are_no_names_and_numbers_that_cannot_be_are_refused,
    commands_of_several_clients_are_recorded_with_their_names,
    robots_joints_and_recordings_keep_the_letters_of_their_names,
}

/// Returns a paused daemon that keeps recordings, and their folder.
async fn daemon(via: Via) -> (Daemon, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let directory = Some(folder.path().to_owned());
    let daemon = Daemon::start_via(via, |config| {
        config.driver.state = RunState::Paused;
        config.recording.directory = directory;
    })
    .await;
    (daemon, folder)
}

fn named(name: &str) -> StartRecordingRequest {
    StartRecordingRequest { name: name.into(), ..StartRecordingRequest::default() }
}

async fn replayed(file: &[u8]) -> Replayed {
    let replayed = replay(|| Ok(file), None).await.unwrap();
    assert_eq!((&replayed.difference, &replayed.ends_early, &replayed.damaged), (&None, &None, &None));
    replayed
}

async fn a_downloaded_recording_replays_to_the_same_bits(via: Via) {
    let (daemon, _folder) = daemon(via).await;
    load_arm(&daemon.client, "arm").await;
    let recording = daemon.client.start_recording(named("run")).await.unwrap();
    assert_eq!((&*recording.name, recording.state()), ("run", RecordingState::Recording));
    set(&daemon, Target::position(0.5)).await;
    daemon.client.step(100).await.unwrap();
    load_arm(&daemon.client, "other").await;
    daemon.client.step(50).await.unwrap();
    daemon.client.delete_robot("arm").await.unwrap();
    daemon.client.step(7).await.unwrap();
    let listed = daemon.client.recordings().await.unwrap();
    assert_eq!(listed.len(), 1);
    assert_eq!(listed[0].state(), RecordingState::Recording);
    let recording = daemon.client.stop_recording("run").await.unwrap();
    assert_eq!(recording.state(), RecordingState::Complete);
    let info = daemon.client.recording("run").await.unwrap();
    let messages = |topic: &str| info.topics.iter().find(|it| it.topic == topic).map(|it| it.messages);
    assert_eq!(messages("/simd/commands"), Some(3));
    assert_eq!(messages("/simd/worlds"), Some(2));
    let here = tempfile::tempdir().unwrap();
    let (files, bytes) = daemon.client.download_recording("run", here.path()).await.unwrap();
    assert_eq!((&*files, bytes), (&["run.mcap".to_owned()][..], recording.bytes));
    let came_to = replayed(&std::fs::read(here.path().join("run.mcap")).unwrap()).await;
    assert_eq!((came_to.steps, came_to.commands, came_to.worlds), (157, 3, 2));
    daemon.client.delete_recording("run").await.unwrap();
    assert!(daemon.client.recordings().await.unwrap().is_empty());
    let gone = daemon.client.recording("run").await.unwrap_err();
    assert_eq!(gone.reason(), Some(ErrorReason::RecordingNotFound));
    let events = daemon.client.next_events(0, Duration::ZERO).await.unwrap().events;
    let of_recordings: Vec<_> = events
        .into_iter()
        .filter_map(|event| match event.kind? {
            Kind::RecordingStarted(it) => Some((it.recording, None)),
            Kind::RecordingEnded(it) => Some((it.recording.clone(), Some(it.cause()))),
            _ => None,
        })
        .collect();
    assert_eq!(of_recordings, [("run".into(), None), ("run".into(), Some(RecordingEndCause::Stopped))]);
}

/// Each reading from the beginning on, as a ROS message if it has one.
async fn readings_of_sensors_are_recorded_each_once(via: Via) {
    let (daemon, _folder) = daemon(via).await;
    let client = &daemon.client;
    load_arm(client, "arm").await;
    let kinds = [
        ("imu", sensor::Kind::Imu(proto::ImuSensor {})),
        ("foot-1", sensor::Kind::Contact(proto::ContactSensor::default())),
        ("eye", sensor::Kind::Range(proto::RangeSensor { min: 0.0, max: 1.0 })),
    ];
    for (name, kind) in kinds {
        // A random walk is part of the state that a replay restores.
        let walking = proto::SensorNoise {
            channel: proto::SensorChannel::AngularVelocity.into(),
            standard_deviation: 0.1,
            random_walk: 0.01,
            ..Default::default()
        };
        let noise = if name == "imu" { vec![walking] } else { Vec::new() };
        let (robot, name) = ("arm".into(), name.into());
        let sensor = proto::Sensor { robot, name, kind: Some(kind), noise, seed: 5, ..Default::default() };
        client.create_sensor(sensor).await.unwrap();
    }
    client.step(10).await.unwrap();
    client.start_recording(named("run")).await.unwrap();
    client.step(100).await.unwrap();
    // Also of the last step.
    client.sensor_readings(Vec::new()).await.unwrap();
    let recording = client.stop_recording("run").await.unwrap();
    assert_eq!(recording.state(), RecordingState::Complete);
    let info = client.recording("run").await.unwrap();
    let topic = |topic: &str| {
        let found =
            info.topics.iter().find(|it| it.topic == topic).unwrap_or_else(|| panic!("{:?}", info.topics));
        (found.schema.as_str(), found.messages)
    };
    assert_eq!(topic("/arm/sensors/imu"), ("sensor_msgs/msg/Imu", 100));
    assert_eq!(topic("/arm/sensors/foot_1"), ("simd.v1.SensorReading", 100));
    let (schema, messages) = topic("/arm/sensors/eye");
    // Those that took longer than a step are left out.
    assert!(schema == "sensor_msgs/msg/Range" && (1..=100).contains(&messages), "{messages}");
    let here = tempfile::tempdir().unwrap();
    client.download_recording("run", here.path()).await.unwrap();
    replayed(&std::fs::read(here.path().join("run.mcap")).unwrap()).await;
}

/// Nothing but the recording makes the renderer draw.
async fn pictures_of_cameras_are_recorded_while_a_renderer_draws_them(via: Via) {
    let (daemon, folder) = daemon(via).await;
    let client = &daemon.client;
    load_arm(client, "arm").await;
    client.create_sensor(camera("eye", Some(100.0))).await.unwrap();
    client.start_recording(named("dark")).await.unwrap();
    client.step(20).await.unwrap();
    client.stop_recording("dark").await.unwrap();
    let dark = std::fs::read(folder.path().join("dark.mcap")).unwrap();
    assert_eq!(messages(&dark, "/arm/sensors/eye/image_raw"), Vec::<Vec<u8>>::new());
    assert_eq!(said_of_camera(&dark), "no picture of it was drawn");

    assert!(client.next_picture("one", Duration::ZERO).await.unwrap().is_none());
    client.start_recording(named("run")).await.unwrap();
    let followed = async { while !client.list_cameras().await.unwrap().cameras[0].followed {} };
    soon("a recording that wants pictures", followed).await;
    for step in [30, 40, 50] {
        client.step(10).await.unwrap();
        let task = soon("a picture that is to be drawn", draw(client, "one")).await;
        assert_eq!(task.stamp.unwrap().step, step);
    }
    client.stop_recording("run").await.unwrap();
    let run = std::fs::read(folder.path().join("run.mcap")).unwrap();
    let colors = messages(&run, "/arm/sensors/eye/image_raw");
    // The newest wins if two came between two looks. Each pixel of the drawing is the step number.
    assert!((1..=3).contains(&colors.len()), "{}", colors.len());
    assert!(colors.last().unwrap().ends_with(&[50; 3 * 4 * 3]));
    let depths = messages(&run, "/arm/sensors/eye/depth/image_raw");
    assert!(depths.last().unwrap().ends_with(&50_f32.to_le_bytes().repeat(4 * 3)));
    let infos = messages(&run, "/arm/sensors/eye/camera_info");
    assert_eq!((depths.len(), infos.len()), (colors.len(), colors.len()));
    assert_eq!(messages(&run, "/arm/sensors/eye/segmentation/image_raw").len(), 0);
    assert!(
        said_of_camera(&run).starts_with(&format!("{} pictures", colors.len())),
        "{}",
        said_of_camera(&run)
    );
    assert_eq!(replayed(&run).await.steps, 30);
}

/// Returns the messages of a topic.
fn messages(file: &[u8], topic: &str) -> Vec<Vec<u8>> {
    let mut reader = simd_mcap::Reader::new(file, simd_mcap::ReadLimits::default()).unwrap();
    let mut found = Vec::new();
    while let Some(item) = reader.next().unwrap() {
        if let simd_mcap::Item::Message { channel, data, .. } = item
            && channel.topic == topic
        {
            found.push(data.to_vec());
        }
    }
    found
}

/// Returns the file's data about the arm's camera.
fn said_of_camera(file: &[u8]) -> String {
    let mut reader = simd_mcap::Reader::new(file, simd_mcap::ReadLimits::default()).unwrap();
    while let Some(item) = reader.next().unwrap() {
        if let simd_mcap::Item::Metadata { name, mut metadata } = item
            && name == "simd.cameras"
        {
            return metadata.remove("arm/eye").unwrap();
        }
    }
    panic!("it says nothing of cameras");
}

async fn robots_joints_and_recordings_keep_the_letters_of_their_names(via: Via) {
    let (daemon, folder) = daemon(via).await;
    let urdf = "<robot name='тест 机器人'><link name='основа'/><link name='рука'><inertial><mass value='1'/>\
                <inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='плечо' type='continuous'>\
                <parent link='основа'/><child link='рука'/><axis xyz='0 0 1'/></joint></robot>";
    let source = proto::DescriptionSource {
        source: Some(proto::description_source::Source::Urdf(urdf.into())),
        ..Default::default()
    };
    daemon.client.start_recording(named("опыт-1")).await.unwrap();
    let request = proto::SpawnEntityRequest { source: Some(source), ..simd_tests::daemon::fixed("") };
    let robot = daemon.client.spawn(request).await.unwrap().entity.name;
    assert_eq!(robot, "тест_机器人");
    let target = simd_client::joint_target("плечо", Target::velocity(1.0));
    daemon.client.set_robot_targets(&robot, [target]).await.unwrap();
    daemon.client.step(100).await.unwrap();
    let seen = daemon.client.read_joints(&simd_client::every_joint(&robot)).await.unwrap();
    assert_eq!((seen.robot.as_str(), &seen.joints[0].name[..]), ("тест_机器人", "плечо"));
    assert!(seen.joints[0].position[0] > 0.05);
    daemon.client.stop_recording("опыт-1").await.unwrap();
    assert!(folder.path().join("опыт-1.mcap").is_file());
    let names: Vec<String> =
        daemon.client.recordings().await.unwrap().into_iter().map(|recording| recording.name).collect();
    assert_eq!(names, ["опыт-1"]);
}

async fn without_a_folder_the_error_names_the_setting(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let refused = daemon.client.start_recording(named("run")).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::RecordingNotPossible));
    assert!(refused.to_string().contains("--recordings FOLDER"), "{refused}");
    let refused = daemon.client.stop_recording("").await.unwrap_err();
    assert_eq!(refused.to_string(), "no recording is being made");
}

async fn names_that_are_no_names_and_numbers_that_cannot_be_are_refused(via: Via) {
    let (daemon, folder) = daemon(via).await;
    for name in ["..", "a/b", "/etc/passwd", "a.000001", "ä b", "\0", &"a".repeat(65)] {
        let refused = daemon.client.start_recording(named(name)).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{name:?}: {refused}");
        daemon.client.recording(name).await.unwrap_err();
        daemon.client.delete_recording(name).await.unwrap_err();
    }
    let with = |change: fn(&mut StartRecordingRequest)| {
        let mut request = named("run");
        change(&mut request);
        request
    };
    for (field, request) in [
        ("state_rate", with(|it| it.state_rate = Some(f64::NAN))),
        ("state_rate", with(|it| it.state_rate = Some(-1.0))),
        ("keep_last", with(|it| it.keep_last = 0.5)),
        ("keep_last", with(|it| it.keep_last = f64::INFINITY)),
        ("max_duration", with(|it| it.max_duration = -1.0)),
    ] {
        let refused = daemon.client.start_recording(request).await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidValue), "{field}");
        assert!(refused.to_string().contains(field), "{refused}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    daemon.client.start_recording(named("run")).await.unwrap();
    let second = daemon.client.start_recording(named("other")).await.unwrap_err();
    assert_eq!(second.reason(), Some(ErrorReason::RecordingNotPossible));
    daemon.client.stop_recording("run").await.unwrap();
    let taken = daemon.client.start_recording(named("run")).await.unwrap_err();
    assert_eq!(taken.reason(), Some(ErrorReason::RecordingExists));
}

async fn commands_of_several_clients_are_recorded_with_their_names(via: Via) {
    let (daemon, folder) = daemon(via).await;
    load_arm(&daemon.client, "arm").await;
    daemon.client.start_recording(named("run")).await.unwrap();
    let clients: Vec<Client> =
        ["first", "second"].map(|name| daemon.client.clone().with_name(name)).into_iter().collect();
    for (number, client) in clients.iter().cycle().take(6).enumerate() {
        let target = simd_client::joint_target("shoulder", Target::position(0.1 * number as f64));
        client.set_robot_targets("arm", [target]).await.unwrap();
        client.step(10).await.unwrap();
    }
    clients[1].save_state("kept").await.unwrap();
    daemon.client.stop_recording("").await.unwrap();
    let file = std::fs::read(folder.path().join("run.mcap")).unwrap();
    assert_eq!(replayed(&file).await.steps, 60);
    let mut reader = simd_mcap::Reader::new(&file[..], simd_mcap::ReadLimits::default()).unwrap();
    let mut commands = Vec::new();
    while let Some(item) = reader.next().unwrap() {
        if let simd_mcap::Item::Message { channel, data, .. } = item
            && channel.topic == "/simd/commands"
        {
            assert_eq!(channel.schema.as_ref().unwrap().name, "simd.v1.RecordedCommand");
            let command: simd_client::proto::RecordedCommand = prost::Message::decode(data).unwrap();
            commands.push((command.client, command.steps, command.kind));
        }
    }
    let expected: Vec<_> = (0..6u64)
        .map(|number| {
            let client = if number % 2 == 0 { "first" } else { "second" };
            (client.to_owned(), 10 * number, "SetTargets".to_owned())
        })
        .chain([("second".to_owned(), 60, "SaveState".to_owned())])
        .collect();
    assert_eq!(commands, expected);
}
