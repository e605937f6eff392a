//! Saved states out to a file and into another daemon. An equal world is an equal file: that two worlds are
//! equal in everything that a step reads is shown by exporting both.

use std::path::{Path, PathBuf};

use simd_client::proto::{self, ErrorReason};
use simd_client::{Client, Package, Target, joint_target};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;
use simd_world::loading::saved_state_file::FORMAT;

use crate::{arm, set};

/// Returns a shape, in the world at a place.
fn shape(name: &str, geometry: proto::primitive::Geometry, [x, y, z]: [f64; 3]) -> proto::SpawnEntityRequest {
    let primitive = proto::Primitive { geometry: Some(geometry), ..Default::default() };
    proto::SpawnEntityRequest {
        source: Some(proto::DescriptionSource {
            source: Some(proto::description_source::Source::Primitive(primitive)),
            ..Default::default()
        }),
        pose: Some(proto::Pose { position: Some(proto::Vector3 { x, y, z }), orientation: None }),
        name: name.into(),
        ..Default::default()
    }
}

/// A plane with falling balls, boxes and capsules, and arms with meshes. One arm is scaled, one collides with
/// itself with meshes in parts, and one is held up in the air by a wrench.
async fn fill(client: &Client) {
    use proto::primitive::Geometry;
    let plane = shape("ground", Geometry::Plane(proto::PlaneGeometry::default()), [0.0; 3]);
    client.spawn(proto::SpawnEntityRequest { base: proto::Base::Fixed.into(), ..plane }).await.unwrap();
    for i in 0..4 {
        let size = 0.04 + 0.01 * f64::from(i);
        let at = [0.1 * f64::from(i % 2), 0.03 * f64::from(i), 0.1 + 0.2 * f64::from(i)];
        let sides = proto::Vector3 { x: size, y: 2.0 * size, z: size };
        let geometry = match i % 3 {
            0 => Geometry::Box(proto::BoxGeometry { size: Some(sides) }),
            1 => Geometry::Sphere(proto::SphereGeometry { radius: size }),
            _ => Geometry::Capsule(proto::CapsuleGeometry { radius: size, length: size }),
        };
        client.spawn(shape(&format!("body-{i}"), geometry, at)).await.unwrap();
    }
    let package = Package::open(assets().join("Bench_Arm-1.2 rev B")).unwrap();
    let source = Some(client.upload(&package).await.unwrap());
    let again = proto::SpawnEntityRequest { source, scale: Some(0.5), ..fixed("small") };
    client.spawn(again).await.unwrap();
    let two = proto::SpawnEntityRequest {
        self_collision: true,
        mesh_shapes: proto::MeshShapes::Decomposition.into(),
        ..fixed("two")
    };
    client.load(assets().join("Two Link.v2"), two).await.unwrap();
    let free = proto::SpawnEntityRequest {
        pose: Some(proto::Pose {
            position: Some(proto::Vector3 { x: 0.0, y: 2.0, z: 0.4 }),
            orientation: None,
        }),
        name: "free".into(),
        ..Default::default()
    };
    client.load(assets().join("seven_arm"), free).await.unwrap();
}

/// Settings, surfaces, applied wrenches and targets on their way.
async fn change(client: &Client) {
    let layout = client.joint_layout("two").await.unwrap();
    let joint = layout.joints.iter().find(|joint| joint.name.contains(' ')).unwrap().name.clone();
    let target = joint_target(joint.clone(), Target::position(0.9));
    client.set_robot_targets("two", [target]).await.unwrap();
    let properties =
        proto::JointProperties { joint, damping: Some(0.3), friction: Some(0.2), ..Default::default() };
    client.set_joint_properties("two", vec![properties]).await.unwrap();
    let slippery = proto::LinkProperties { friction: Some(0.05), ..Default::default() };
    client.set_link_properties("body-0", vec![slippery]).await.unwrap();
    let force = proto::Vector3 { x: 0.0, y: 0.1, z: 20.0 };
    let push = proto::ApplyLinkWrenchRequest {
        robot: "body-3".into(),
        link: "link".into(),
        wrench: Some(proto::Wrench { force: Some(force), torque: None }),
        persistent: true,
        ..Default::default()
    };
    client.apply_wrench(push).await.unwrap();
}

async fn export(client: &Client, folder: &Path, name: &str) -> (PathBuf, Vec<u8>) {
    let file = folder.join(format!("{name}.simdstate"));
    let size = client.export_saved_state(name, &file).await.unwrap();
    let bytes = std::fs::read(&file).unwrap();
    assert_eq!(bytes.len() as u64, size);
    (file, bytes)
}

async fn a_world_is_taken_to_another_daemon_and_runs_on_to_the_same_bits(via: Via) {
    let folder = tempfile::tempdir().unwrap();
    let here = Daemon::paused_via(via).await;
    fill(&here.client).await;
    here.client.step(1_700).await.unwrap();
    change(&here.client).await;
    here.client.step(30).await.unwrap();
    let saved = here.client.save_state("mark").await.unwrap();
    let (file, first) = export(&here.client, folder.path(), "mark").await;

    // Another world, with other versions of its robots.
    let there = arm(via).await;
    there.client.step(5).await.unwrap();
    let imported = there.client.import_saved_state(&file, "").await.unwrap();
    assert_eq!((imported.name.as_str(), imported.robots), ("mark", saved.robots));
    assert_eq!(imported.stamp.unwrap().step, 1_730);
    let robots = |robots: Vec<proto::EntityInfo>| robots.into_iter().map(|it| it.name).collect::<Vec<_>>();
    assert_eq!(robots(there.client.robots().await.unwrap()), ["arm"], "the world is left as it is");
    let stamp = there.client.restore_state("mark").await.unwrap();
    assert_eq!((stamp.step, stamp.epoch), (1_730, 1));
    let names = robots(here.client.robots().await.unwrap());
    assert_eq!(robots(there.client.robots().await.unwrap()), names);
    assert_eq!(
        export(&there.client, folder.path(), "mark").await.1,
        first,
        "what was imported is the same file"
    );

    for client in [&here.client, &there.client] {
        client.step(400).await.unwrap();
        set_small(client).await;
        client.step(300).await.unwrap();
        client.save_state("later").await.unwrap();
    }
    let later = export(&here.client, folder.path(), "later").await.1;
    assert_ne!(later, first);
    assert!(
        export(&there.client, folder.path(), "later").await.1 == later,
        "both worlds are equal to the bit"
    );
    // The meshes came along, for viewers and for reloading the robots.
    let request = proto::ReloadEntityRequest { robot: "two".into(), ..Default::default() };
    assert_eq!(there.client.reload(request).await.unwrap().removed_joints, Vec::<String>::new());
}

async fn set_small(client: &Client) {
    let target = joint_target("shoulder", Target::velocity(-1.0));
    client.set_robot_targets("small", [target]).await.unwrap();
}

async fn other_files_than_saved_states_are_refused_and_change_nothing(via: Via) {
    let folder = tempfile::tempdir().unwrap();
    let daemon = arm(via).await;
    set(&daemon, Target::position(0.5)).await;
    daemon.pass(0.1).await;
    daemon.client.save_state("mark").await.unwrap();
    let (file, bytes) = export(&daemon.client, folder.path(), "mark").await;
    let import = async |bytes: &[u8]| {
        std::fs::write(&file, bytes).unwrap();
        let refused = daemon.client.import_saved_state(&file, "other").await.unwrap_err();
        assert_eq!(refused.reason(), Some(ErrorReason::InvalidSavedState), "{refused}");
        refused.to_string()
    };
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 4;
    assert!(import(&flipped).await.contains("damaged"));
    assert!(import(&bytes[..bytes.len() - 1]).await.contains("damaged"));
    assert!(import(b"<robot name=\"a\"/>").await.contains("not a saved state"));
    let mut newer = bytes.clone();
    let format = FORMAT + 1;
    newer[8] = format as u8;
    let sentence = import(&newer).await;
    assert!(
        sentence.contains(&format!("format {format}")) && sentence.contains("the daemon is older"),
        "{sentence}"
    );
    let kept = daemon.client.saved_states().await.unwrap();
    assert_eq!(kept.len(), 1);
    let (_, again) = export(&daemon.client, folder.path(), "mark").await;
    assert_eq!(again, bytes);

    let unknown = daemon.client.export_saved_state("nothing", &file).await.unwrap_err();
    assert_eq!(unknown.reason(), Some(ErrorReason::SavedStateNotFound));
    let missing = daemon.client.import_saved_state(folder.path().join("none"), "").await.unwrap_err();
    assert!(matches!(missing, simd_client::Error::File { .. }), "{missing}");
    let nowhere =
        daemon.client.export_saved_state("mark", folder.path().join("no/folder")).await.unwrap_err();
    assert!(matches!(nowhere, simd_client::Error::Write { .. }), "{nowhere}");
}

/// A file is bounded as an upload is, and a daemon for fewer robots refuses it.
async fn limits_hold_for_saved_states_in_files(via: Via) {
    let folder = tempfile::tempdir().unwrap();
    let here = arm(via).await;
    crate::load_arm(&here.client, "second").await;
    here.client.save_state("mark").await.unwrap();
    let (file, bytes) = export(&here.client, folder.path(), "mark").await;

    let small = Daemon::start_via(via, |config| config.limits.robots = 1).await;
    let refused = small.client.import_saved_state(&file, "").await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::LimitExceeded), "{refused}");
    let few = Daemon::start_via(via, |config| config.limits.saved_states = 1).await;
    few.client.save_state("mine").await.unwrap();
    let refused = few.client.import_saved_state(&file, "").await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::LimitExceeded), "{refused}");
    let replaced = few.client.import_saved_state(&file, "mine").await.unwrap();
    assert_eq!((replaced.name.as_str(), replaced.robots), ("mine", 2));

    let limit = bytes.len() as u64 - 1;
    let tight = Daemon::start_via(via, |config| config.limits.asset_bytes = limit).await;
    crate::load_arm(&tight.client, "arm").await;
    crate::load_arm(&tight.client, "second").await;
    tight.client.save_state("mark").await.unwrap();
    let refused = tight.client.export_saved_state("mark", &file).await.unwrap_err();
    assert_eq!(refused.reason(), Some(ErrorReason::LimitExceeded), "{refused}");
    assert!(refused.to_string().contains("the saved state's file"), "{refused}");
}

async fn named_states_of_an_srdf_survive_a_file_and_a_reload(via: Via) {
    let folder = tempfile::tempdir().unwrap();
    let here = Daemon::paused_via(via).await;
    let layout_of = async |client: &Client| client.joint_layout("arm").await.unwrap();
    let package = Package::open(assets().join("seven_arm")).unwrap();
    let source = Some(here.client.upload(&package).await.unwrap());
    here.client.spawn(proto::SpawnEntityRequest { source: source.clone(), ..fixed("probe") }).await.unwrap();
    let joint = here.client.joint_layout("probe").await.unwrap().joints[0].name.clone();
    let srdf = format!(
        "<robot name='seven_arm'><group_state name='home' group='arm'><joint name='{joint}' value='0.25'/></group_state></robot>"
    );
    let request = proto::SpawnEntityRequest { source, srdf: srdf.into(), ..fixed("arm") };
    let spawned = here.client.spawn(request).await.unwrap();
    let names =
        |entity: &proto::EntityInfo| entity.states.iter().map(|state| state.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&spawned.entity), ["home"]);
    let reload = proto::ReloadEntityRequest { robot: "arm".into(), ..Default::default() };
    let reloaded = here.client.reload(reload.clone()).await.unwrap();
    assert_eq!(names(&reloaded.entity), ["home"]);
    let source = Some(here.client.upload(&package).await.unwrap());
    let anew = here.client.reload(proto::ReloadEntityRequest { source, ..reload.clone() }).await.unwrap();
    assert_eq!(names(&anew.entity), ["home"], "the SRDF is read for the new description too");

    here.client.save_state("mark").await.unwrap();
    let (file, _) = export(&here.client, folder.path(), "mark").await;
    let there = Daemon::paused_via(via).await;
    there.client.import_saved_state(&file, "").await.unwrap();
    there.client.restore_state("mark").await.unwrap();
    let robots = there.client.robots().await.unwrap();
    let arm = robots.iter().find(|robot| robot.name == "arm").unwrap();
    assert_eq!(names(arm), ["home"]);
    let reloaded = there.client.reload(reload).await.unwrap();
    assert_eq!(names(&reloaded.entity), ["home"]);
    assert_eq!(layout_of(&there.client).await.joints.len(), layout_of(&here.client).await.joints.len());
}

/// An MJCF with a mesh that has vertices instead of a file. It is sent, or read from the daemon's disk.
async fn meshes_of_numbers_go_along_with_their_robots(via: Via) {
    const MJCF: &str = "<mujoco model='rock'><asset><mesh name='stone' vertex='0 0 0 2 0 0 0 3 0 0 0 1'/></asset>\
                        <worldbody><body name='rock'><freejoint/><geom type='mesh' mesh='stone'/></body></worldbody></mujoco>";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rock.xml");
    std::fs::write(&path, MJCF).unwrap();
    let root = folder.path().to_owned();
    let here = Daemon::start_via(via, |config| config.asset_roots = vec![root]).await;
    here.client.load(&path, fixed("sent")).await.unwrap();
    let on_disk = proto::description_source::Source::Path(path.to_str().unwrap().to_owned());
    let source = Some(proto::DescriptionSource { source: Some(on_disk), ..Default::default() });
    here.client.spawn(proto::SpawnEntityRequest { source, ..fixed("read") }).await.unwrap();
    here.client.save_state("mark").await.unwrap();
    let (file, _) = export(&here.client, folder.path(), "mark").await;
    std::fs::remove_file(&path).unwrap();

    let there = Daemon::paused_via(via).await;
    there.client.import_saved_state(&file, "").await.unwrap();
    there.client.restore_state("mark").await.unwrap();
    for (daemon, robot) in [(&here, "sent"), (&there, "sent"), (&there, "read")] {
        let scene = daemon.client.scene(&[robot]).await.unwrap();
        let Some(proto::shape::Geometry::Mesh(mesh)) = &scene.robots[0].visuals[0].geometry else {
            panic!("{scene:?}")
        };
        assert_eq!(&daemon.client.mesh(&mesh.sha256).await.unwrap()[..4], b"glTF");
        let request = proto::ReloadEntityRequest { robot: robot.into(), ..Default::default() };
        let reloaded = daemon.client.reload(request).await.unwrap();
        // A cubic metre of 1,000 kg.
        assert!((reloaded.entity.mass - 1000.0).abs() < 1e-6, "{robot}: {}", reloaded.entity.mass);
    }
}

crate::over_every_transport![
    meshes_of_numbers_go_along_with_their_robots,
    named_states_of_an_srdf_survive_a_file_and_a_reload,
    a_world_is_taken_to_another_daemon_and_runs_on_to_the_same_bits,
    other_files_than_saved_states_are_refused_and_change_nothing,
    limits_hold_for_saved_states_in_files,
];
