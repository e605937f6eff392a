//! A recorded run has the same result in a replay; damaged files are refused with a sentence.

mod variation;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::time::Duration;

use bytes::Bytes;
use glamx::{DPose3, DVec3};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::{
    ClaimRequest, JointSelection, JointTarget, LinkWrench, PhysicsChange, ResetScope, RobotTargets,
    SetTargets, Target, WrenchDuration,
};
use simd_core::{Command, PhysicsSettings, Simulation};

use super::*;
use crate::access::Access;
use crate::blocking_threads::BlockingThreads;
use crate::driver;
use crate::handle::{
    CallContext, Caller, DaemonInfo, DaemonLimits, RunState, SimHandle, Source, SpawnRequest, Transport,
};

/// An arm with two joints, whose hand is a ball.
const ARM: &str = r#"<robot name="arm"><link name="world"/>
    <link name="upper"><inertial><origin xyz="0.1 0 0"/><mass value="1"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01"
    iyz="0" izz="0.01"/></inertial></link>
    <link name="hand"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/><inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01"
    iyz="0" izz="0.01"/></inertial><collision><geometry><sphere radius="0.05"/></geometry></collision></link>
    <joint name="shoulder" type="continuous"><parent link="world"/><child link="upper"/><origin xyz="0 0 0.3"/>
    <axis xyz="0 1 0"/></joint>
    <joint name="elbow" type="continuous"><parent link="upper"/><child link="hand"/><origin xyz="0.2 0 0"/>
    <axis xyz="0 1 0"/></joint></robot>"#;
/// A ball of 1 kg.
const BALL: &str = r#"<robot name="ball"><link name="ball"><inertial><mass value="1"/><inertia ixx="0.001" ixy="0" ixz="0"
    iyy="0.001" iyz="0" izz="0.001"/></inertial><collision><geometry><sphere radius="0.05"/></geometry></collision>
    </link></robot>"#;
/// A floor with its top at z = 0.
const FLOOR: &str = r#"<robot name="floor"><link name="world"><collision><origin xyz="0 0 -0.5"/><geometry><box
    size="10 10 1"/></geometry></collision></link></robot>"#;

fn daemon(directory: &Path) -> SimHandle {
    let world = Simulation::new(PhysicsSettings::default(), WorldLimits { robots: 10, saved_states: 10 });
    let config = driver::Config { state: RunState::Paused, ..Default::default() };
    let link = driver::start(world, config).unwrap();
    let limits = DaemonLimits::default();
    let info = DaemonInfo { name: "test".into(), version: "0", limits };
    let loader = Loader::new(limits, &[], BlockingThreads::computing().unwrap()).unwrap();
    let settings = Settings { directory: Some(directory.to_owned()), ..Settings::default() };
    let recordings = Recordings { settings: Arc::new(settings), ..Recordings::none() };
    SimHandle::with_access(link, loader, info, Access::open(), recordings)
}

async fn spawn(handle: &SimHandle, urdf: &str, name: &str, xyz: [f64; 3]) {
    let request = SpawnRequest {
        srdf: Bytes::new(),
        collision_pairs: Vec::new(),
        model: String::new(),
        source: Source::Inline {
            urdf: urdf.to_owned().into(),
            assets: BTreeMap::new(),
            missing: BTreeMap::new(),
        },
        name: name.into(),
        allow_renaming: true,
        pose: DPose3::from_translation(DVec3::from(xyz)),
        free_place: Default::default(),
        fixed_base: None,
        passive: false,
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        scale: 1.0,
        strict: false,
        mesh_shapes: Default::default(),
        contact_settings: Default::default(),
    };
    handle.spawn(request).await.unwrap();
}

fn named(name: &str) -> RecordingRequest {
    RecordingRequest {
        name: name.into(),
        state_period: Some(0.01),
        keep_last: None,
        max_bytes: None,
        max_duration: None,
    }
}

fn target(position: f64) -> Command {
    let joint = JointTarget { joint: "elbow".into(), axis: 0, target: Target::position(position) };
    let robot = RobotTargets { robot: "arm".into(), joints: vec![joint], ..RobotTargets::default() };
    Command::SetTargets(SetTargets { robots: vec![robot], ..SetTargets::default() })
}

/// Runs all commands that a client can send to a world, in a wrong order and more than once. Leaves the world
/// paused.
async fn run(handle: &SimHandle) {
    let other = {
        let caller = Caller::said("other", Transport::Handle);
        handle.of_call(CallContext { caller, ..handle.call().clone() })
    };
    for round in 0..20 {
        handle.command(target(0.1 * f64::from(round))).await.unwrap();
        handle.step(17).await.unwrap();
        other.command(target(-0.05 * f64::from(round))).await.unwrap();
    }
    handle.command(push("ball", "ball")).await.unwrap();
    handle.step(30).await.unwrap();
    handle.command(Command::SaveState { name: "later".into() }).await.unwrap();
    spawn(handle, BALL, "ball", [0.02, 0.0, 0.6]).await;
    handle.step(250).await.unwrap();
    handle.command(Command::RestoreState { name: "early".into() }).await.unwrap();
    handle.step(40).await.unwrap();
    handle.command(Command::RestoreState { name: "later".into() }).await.unwrap();
    let change = PhysicsChange { time_step: Some(0.0007), substeps: Some(2), ..PhysicsChange::default() };
    handle.command(Command::SetPhysics(change)).await.unwrap();
    handle.step(100).await.unwrap();
    handle.command(Command::Delete { robot: "ball".into() }).await.unwrap();
    handle.command(Command::Reset(ResetScope { state: true, ..ResetScope::default() })).await.unwrap();
    spawn(handle, BALL, "", [0.2, 0.0, 0.4]).await;
    handle.reload("arm".into(), None, false).await.unwrap();
    handle.step(60).await.unwrap();
    // Refused, and so not recorded.
    handle.command(Command::Delete { robot: "missing".into() }).await.unwrap_err();
    handle
        .command(Command::SetEntityState {
            robot: "ball".into(),
            pose: Some(DPose3::from_translation(DVec3::new(0.0, 0.3, 0.2))),
            twist: Some((DVec3::X, DVec3::Z)),
        })
        .await
        .unwrap();
    handle.step_with(Some(SetTargets::default()), 33).await.unwrap();
    handle.set_state(RunState::Stopped).await.unwrap();
    handle.step(20).await.unwrap();
}

/// Pushes a link for 20 ms.
fn push(robot: &str, link: &str) -> Command {
    Command::ApplyWrench(LinkWrench {
        robot: robot.into(),
        link: link.into(),
        force: DVec3::new(30.0, 0.0, 1.0),
        torque: DVec3::new(0.0, 0.1, 0.0),
        in_link_axes: true,
        point: DVec3::ZERO,
        duration: WrenchDuration::For(0.02),
    })
}

async fn claim(handle: &SimHandle) -> SimHandle {
    let request = ClaimRequest {
        holder: "holder".into(),
        joints: vec![JointSelection { robot: "arm".into(), joints: vec!["shoulder".into()] }],
        ..ClaimRequest::default()
    };
    let (secret, _) = handle.claim(request, Duration::from_secs(3600), None).await.unwrap();
    handle.acting_for(Some(handle.claim_of(&secret).unwrap()))
}

/// Records a run.
async fn recorded(directory: &Path) -> PathBuf {
    let handle = daemon(directory);
    spawn(&handle, FLOOR, "floor", [0.0; 3]).await;
    spawn(&handle, ARM, "arm", [0.0; 3]).await;
    spawn(&handle, BALL, "ball", [0.3, 0.0, 0.1]).await;
    handle.step(25).await.unwrap();
    handle.command(Command::SaveState { name: "early".into() }).await.unwrap();
    let holder = claim(&handle).await;
    // The holder's motions continue in the world that the recording begins with.
    holder.command(push("arm", "hand")).await.unwrap();
    handle.step(5).await.unwrap();
    handle.start_recording(named("run")).await.unwrap();
    let joint = JointTarget { joint: "shoulder".into(), axis: 0, target: Target::velocity(0.5) };
    let robot = RobotTargets { robot: "arm".into(), joints: vec![joint], ..RobotTargets::default() };
    let targets = SetTargets { robots: vec![robot], ..SetTargets::default() };
    holder.command(Command::SetTargets(targets)).await.unwrap();
    handle.step(10).await.unwrap();
    holder.release().await.unwrap();
    run(&handle).await;
    let (info, _) = handle.stop_recording("").await.unwrap();
    assert_eq!((info.state, &*info.files[0].0), (RecordingState::Complete, "run.mcap"));
    directory.join("run.mcap")
}

async fn replayed(file: &[u8], from: Option<f64>) -> Result<Replayed, String> {
    replay(|| Ok(file), from).await
}

#[tokio::test]
async fn a_run_with_loads_claims_contacts_and_restored_states_comes_to_the_same_again() {
    let directory = tempfile::tempdir().unwrap();
    let path = recorded(directory.path()).await;
    let file = fs::read(path).unwrap();
    let came_to = replayed(&file, None).await.unwrap();
    assert_eq!((&came_to.difference, &came_to.ends_early, &came_to.damaged), (&None, &None, &None));
    // 10 + 20 * 17 + 30 + 250 + 40 + 100 + 60 + 33 + 20 steps.
    assert_eq!((came_to.steps, came_to.worlds), (883, 2));
    assert!(came_to.commands > 50, "{}", came_to.commands);
    assert_eq!(
        replayed(&file, Some(-1.0)).await.unwrap_err(),
        "it has no world before -1 s; the first is at 0.03 s"
    );
}

#[tokio::test]
async fn a_run_that_is_changed_differs_and_says_where() {
    let directory = tempfile::tempdir().unwrap();
    let path = recorded(directory.path()).await;
    let file = fs::read(path).unwrap();
    // The same messages, with another target in one command.
    let mut reader = simd_mcap::Reader::new(&file[..], simd_mcap::ReadLimits::default()).unwrap();
    let mut writer = simd_mcap::Writer::new(Vec::new(), "", "").unwrap();
    let mut commands = 0;
    while let Some(item) = reader.next().unwrap() {
        match item {
            simd_mcap::Item::Metadata { name, metadata } => writer.add_metadata(&name, &metadata).unwrap(),
            simd_mcap::Item::Message { channel, time, data } => {
                let mut data = data.to_vec();
                if channel.topic == "/simd/commands" {
                    commands += 1;
                    let mut command: simd_proto::v1::RecordedCommand = commands::message(&data).unwrap();
                    if commands == 9 {
                        assert_eq!(command.kind, "SetTargets");
                        command.data = postcard::to_allocvec(&target(1.5)).unwrap();
                    }
                    data = prost::Message::encode_to_vec(&command);
                }
                let topic = writer.add_channel(0, &channel.topic, "protobuf", &BTreeMap::new()).unwrap();
                writer.write(topic, time, &data).unwrap();
            }
        }
    }
    let came_to = replayed(&writer.finish().unwrap(), None).await.unwrap();
    let sentence = came_to.difference.unwrap();
    assert!(sentence.contains("is the first that differs"), "{sentence}");
    assert!(came_to.steps > 10 && came_to.steps < 400, "{}", came_to.steps);
}

#[tokio::test]
async fn a_file_that_is_cut_is_replayed_as_far_as_it_goes() {
    let directory = tempfile::tempdir().unwrap();
    let path = recorded(directory.path()).await;
    let file = fs::read(path).unwrap();
    let mut ends = 0;
    for part in 1..40 {
        let cut = &file[..file.len() * part / 40];
        match replayed(cut, None).await {
            Ok(came_to) => {
                assert_eq!((&came_to.difference, &came_to.damaged), (&None, &None), "{part}");
                ends += usize::from(came_to.ends_early.is_some());
            }
            Err(sentence) => {
                assert!(sentence.contains("no world") || sentence.contains("ends at byte"), "{sentence}")
            }
        }
    }
    assert!(ends > 0);
}

#[tokio::test]
async fn other_files_than_recordings_are_refused_with_a_sentence() {
    let refusal = |file: Vec<u8>| async move { replayed(&file, None).await.unwrap_err() };
    assert_eq!(refusal(b"solid ascii".to_vec()).await, "it does not begin like an MCAP file");
    let writer = simd_mcap::Writer::new(Vec::new(), "ros2", "other").unwrap();
    assert!(refusal(writer.finish().unwrap()).await.starts_with("it is not a recording of simd"));
    let mut writer = simd_mcap::Writer::new(Vec::new(), "ros2", "other").unwrap();
    let newer = file::FORMAT + 1;
    let metadata = BTreeMap::from([("format".to_owned(), newer.to_string())]);
    writer.add_metadata("simd.recording", &metadata).unwrap();
    let sentence = refusal(writer.finish().unwrap()).await;
    let formats =
        format!("of format {newer}, and this release reads only {}; it was made by a newer", file::FORMAT);
    assert!(sentence.contains(&formats), "{sentence}");
}

#[tokio::test]
async fn a_ring_keeps_its_last_files_and_each_is_replayed_alone() {
    let directory = tempfile::tempdir().unwrap();
    let handle = daemon(directory.path());
    spawn(&handle, ARM, "arm", [0.0; 3]).await;
    let request = RecordingRequest { keep_last: Some(Duration::from_secs(1)), ..named("ring") };
    handle.start_recording(request).await.unwrap();
    // Steps let wall time pass, until the first file is gone.
    let first = directory.path().join("ring.000001.mcap");
    let mut rounds = 0;
    while first.exists() {
        handle.command(target(f64::from(rounds % 7) * 0.1)).await.unwrap();
        // Few steps, so that the writer keeps up on a busy machine.
        handle.step(10).await.unwrap();
        rounds += 1;
        let made = handle.recordings().await.unwrap();
        assert_eq!(made[0].state, RecordingState::Recording, "it ended: {made:?}");
    }
    handle.step(10).await.unwrap();
    let (info, _) = handle.stop_recording("ring").await.unwrap();
    // Only one if the machine stood still for longer than a second.
    assert!((1..=8).contains(&info.files.len()), "{:?}", info.files);
    let mut steps = 0;
    for (name, _) in &info.files {
        let file = fs::read(directory.path().join(name)).unwrap();
        let came_to = replayed(&file, None).await.unwrap();
        assert_eq!(
            (&came_to.difference, &came_to.ends_early, &came_to.damaged),
            (&None, &None, &None),
            "{name}"
        );
        steps += came_to.steps;
    }
    assert!(steps >= 10, "{steps}");
}

#[tokio::test]
async fn names_are_taken_once_and_one_recording_is_made_at_a_time() {
    let directory = tempfile::tempdir().unwrap();
    let handle = daemon(directory.path());
    handle.start_recording(named("a")).await.unwrap();
    let second = handle.start_recording(named("b")).await.unwrap_err();
    assert_eq!(second.to_string(), "recording \"a\" is being made; stop it first");
    assert!(handle.delete_recording("a".into()).await.unwrap_err().to_string().contains("stop it first"));
    handle.stop_recording("b").await.unwrap_err();
    handle.stop_recording("a").await.unwrap();
    handle.stop_recording("a").await.unwrap_err();
    let taken = handle.start_recording(named("a")).await.unwrap_err();
    assert!(matches!(taken, CallError::RecordingExists { .. }), "{taken}");
    handle.start_recording(named("b")).await.unwrap();
    handle.stop_recording("").await.unwrap();
    let names: Vec<String> = handle.recordings().await.unwrap().into_iter().map(|info| info.name).collect();
    assert_eq!(names, ["a", "b"]);
    handle.delete_recording("a".into()).await.unwrap();
    assert!(matches!(handle.recording("a".into()).await.unwrap_err(), CallError::RecordingNotFound { .. }));
}

#[tokio::test]
async fn a_limit_ends_the_recording_with_an_event_and_the_file_is_complete() {
    let directory = tempfile::tempdir().unwrap();
    let handle = daemon(directory.path());
    spawn(&handle, ARM, "arm", [0.0; 3]).await;
    handle.start_recording(RecordingRequest { max_bytes: Some(4000), ..named("small") }).await.unwrap();
    // More than the limit, and far less than may wait for a slow disk.
    for _ in 0..20 {
        handle.command(target(0.1)).await.unwrap();
        handle.step(100).await.unwrap();
    }
    let mut after = 0;
    let ended = loop {
        let batch = handle.next_events(after, Duration::from_secs(60)).await.unwrap();
        after = batch.last_sequence;
        let ended = batch.events.into_iter().find_map(|event| match event.what {
            crate::handle::LogEvent::RecordingEnded { cause, message, .. } => Some((cause, message)),
            _ => None,
        });
        if let Some(ended) = ended {
            break ended;
        }
    };
    assert_eq!(ended.0, crate::handle::RecordingEnd::LimitReached);
    assert!(ended.1.contains("4000 bytes"), "{}", ended.1);
    handle.recording_ended().await;
    assert_eq!(handle.recording("small".into()).await.unwrap().state, RecordingState::Complete);
    handle.step(10).await.unwrap();
}
