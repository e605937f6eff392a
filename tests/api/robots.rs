//! Robots are loaded over the network, changed and removed.

use simd_client::proto::{self, JointType};
use simd_client::{Package, Target, joint_target, some_joints};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;

use crate::{arm, set, shoulder};

async fn a_solidworks_export_loads_without_a_warning_and_says_what_it_is(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let package = assets().join("Bench_Arm-1.2 rev B");
    let spawned = daemon.client.load(&package, fixed("")).await.unwrap();
    assert_eq!(spawned.entity.name, "bench_arm");
    let warnings = |finding: &&proto::Finding| finding.severity() >= proto::Severity::Warning;
    assert_eq!(spawned.report.findings.iter().filter(warnings).count(), 0);
    let layout = daemon.client.joint_layout("bench_arm").await.unwrap();
    let joint = &layout.joints[0];
    assert_eq!((joint.name.as_str(), joint.r#type()), ("shoulder", JointType::Continuous));
    assert_eq!((joint.parent_link.as_str(), joint.child_link.as_str()), ("base_link", "arm"));
    // Absent is absent, not 0.
    assert_eq!(joint.limits.unwrap_or_default(), proto::JointLimits::default());
    // The mesh files came along.
    let scene = daemon.client.scene(&[]).await.unwrap();
    for shape in &scene.robots[0].visuals {
        let Some(proto::shape::Geometry::Mesh(mesh)) = &shape.geometry else { panic!("{shape:?}") };
        assert!(!daemon.client.asset(&mesh.sha256).await.unwrap().is_empty());
    }
}

async fn names_with_spaces_work_from_the_folder_to_the_target(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    daemon.client.load(assets().join("Two Link.v2"), fixed("two")).await.unwrap();
    let layout = daemon.client.joint_layout("two").await.unwrap();
    let spaced = layout.joints.iter().find(|joint| joint.name.contains(' ')).unwrap();
    let target = joint_target(spaced.name.clone(), Target::position(0.3));
    daemon.client.set_robot_targets("two", [target]).await.unwrap();
    daemon.pass(1.0).await;
    let seen = daemon.client.read_joints(&some_joints("two", [spaced.name.clone()])).await.unwrap();
    assert!((seen.joints[0].position[0] - 0.3).abs() < 1e-3, "{seen:?}");
}

/// The report names the overlapping links and a free place; there the next robot overlaps nothing.
async fn a_report_names_what_a_robot_was_loaded_into_and_a_free_place(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let package = assets().join("Bench_Arm-1.2 rev B");
    let overlaps = |spawned: &simd_client::Spawned| {
        let found = spawned.report.findings.iter().filter(|finding| finding.message.contains("inside link"));
        found.map(|finding| format!("{} {}", finding.element, finding.message)).collect::<Vec<_>>()
    };
    let first = daemon.client.load(&package, fixed("first")).await.unwrap();
    assert_eq!(overlaps(&first), Vec::<String>::new());
    let second = daemon.client.load(&package, fixed("second")).await.unwrap();
    let said = overlaps(&second);
    assert!(said[0].contains("of \"second\" starts") && said[0].contains("of \"first\""), "{said:?}");
    let place = said[0].split("--pose ").nth(1).unwrap().trim_end_matches('`');
    let [x, y, z] = [0, 1, 2].map(|axis| place.split(',').nth(axis).unwrap().parse::<f64>().unwrap());
    let pose = proto::Pose { position: Some(proto::Vector3 { x, y, z }), ..Default::default() };
    let third = proto::SpawnEntityRequest { pose: Some(pose), ..fixed("third") };
    let third = daemon.client.load(&package, third).await.unwrap();
    assert_eq!(overlaps(&third), Vec::<String>::new(), "at {place}");
    // The daemon finds the place at the spawn itself, also if another robot is spawned at the same time.
    let below =
        proto::Pose { position: Some(proto::Vector3 { x: 0.0, y: 0.0, z: -0.5 }), ..Default::default() };
    let asked = |name: &str| proto::SpawnEntityRequest {
        pose: Some(below),
        beside_others: true,
        on_ground: true,
        ..fixed(name)
    };
    let (fourth, fifth) = tokio::join!(
        daemon.client.load(&package, asked("fourth")),
        daemon.client.load(&package, asked("fifth"))
    );
    for spawned in [fourth, fifth] {
        let spawned = spawned.unwrap();
        assert_eq!(overlaps(&spawned), Vec::<String>::new());
        let pose = daemon.client.robot_state(&spawned.entity.name).await.unwrap().pose.unwrap();
        let Some(proto::Vector3 { x, y, z }) = pose.position else { panic!("{pose:?}") };
        assert!(x == 0.0 && y > 0.2 && z >= -1e-3, "{pose:?}");
    }
}

async fn the_report_says_that_a_free_robot_falls_without_ground_and_how_to_hold_it(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let package = assets().join("Bench_Arm-1.2 rev B");
    let said = async |name: &str, base: proto::Base| {
        let request = proto::SpawnEntityRequest { base: base.into(), ..fixed(name) };
        let spawned = daemon.client.load(&package, request).await.unwrap();
        let falls =
            spawned.report.findings.into_iter().find(|finding| finding.message.contains("so it falls"));
        falls.map(|finding| (finding.element, finding.message))
    };
    let (element, message) = said("free", proto::Base::Free).await.unwrap();
    assert_eq!(element, "robot \"free\"");
    assert!(message.contains("`simctl robot shape plane`") && message.contains("--fixed"), "{message}");
    assert_eq!(said("held", proto::Base::Fixed).await, None);
    assert_eq!(said("above", proto::Base::Free).await, None, "a fixed robot may hold it");
}

/// The second upload of the same package sends no file: the daemon has them by hash.
async fn files_of_the_daemon_are_not_sent_again(via: Via) {
    let daemon = arm(via).await;
    let package = Package::open(assets().join("Bench_Arm-1.2 rev B")).unwrap();
    let source = daemon.client.upload(&package).await.unwrap();
    let request = proto::SpawnEntityRequest { source: Some(source), ..fixed("again") };
    daemon.client.spawn(request).await.unwrap();
    let names: Vec<String> = daemon.client.robots().await.unwrap().into_iter().map(|r| r.name).collect();
    assert_eq!(names, ["arm", "again"]);
}

/// The number of progress messages depends on timing; the last is the robot or the error.
async fn a_robot_can_be_watched_on_its_way_in(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let package = Package::open(assets().join("seven_arm")).unwrap();
    let source = Some(daemon.client.upload(&package).await.unwrap());
    let request = proto::SpawnEntityRequest { source, ..fixed("arm") };
    let mut phases = Vec::new();
    let heard = |progress: &proto::LoadProgress| phases.push(progress.phase);
    let spawned = daemon.client.spawn_with_progress(request.clone(), heard).await.unwrap();
    assert_eq!(spawned.entity.name, "arm");
    assert!(phases.is_sorted(), "{phases:?}");
    let refused = daemon.client.spawn_with_progress(request, |_| ()).await.unwrap_err();
    assert_eq!(refused.reason(), Some(proto::ErrorReason::RobotExists));
}

async fn a_ball_and_a_box_are_spawned_without_a_description(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let ball = proto::primitive::Geometry::Sphere(proto::SphereGeometry { radius: 0.1 });
    let primitive = proto::Primitive { geometry: Some(ball), mass: 2.0, color: None };
    let source = proto::DescriptionSource {
        source: Some(proto::description_source::Source::Primitive(primitive)),
        ..Default::default()
    };
    let request = proto::SpawnEntityRequest { source: Some(source), strict: true, ..Default::default() };
    let spawned = daemon.client.spawn(request).await.unwrap();
    assert_eq!((spawned.entity.name.as_str(), spawned.entity.mass), ("sphere", 2.0));
    assert_eq!(spawned.entity.base(), proto::Base::Free);
    // It falls by g t^2 / 2.
    daemon.pass(0.1).await;
    let state = daemon.client.robot_state("sphere").await.unwrap();
    let fallen = -9.81 * 0.1 * 0.1 / 2.0;
    let z = state.pose.unwrap().position.unwrap().z;
    assert!((z - fallen).abs() < 1e-12, "{z} {fallen}");
}

async fn a_missing_mesh_is_a_warning_that_names_the_places_searched(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let folder = tempfile::tempdir().unwrap();
    let urdf = folder.path().join("robot.urdf");
    let text = r#"<robot name="r"><link name="l"><visual><geometry>
        <mesh filename="package://lost/meshes/part.STL"/></geometry></visual></link></robot>"#;
    std::fs::write(&urdf, text).unwrap();
    let spawned = daemon.client.load(&urdf, fixed("")).await.unwrap();
    let finding = spawned.report.findings.iter().find(|f| f.message.contains("part.STL")).unwrap();
    assert_eq!(finding.severity(), proto::Severity::Warning);
    assert!(finding.message.contains(&folder.path().display().to_string()), "{}", finding.message);
}

async fn a_reload_keeps_what_both_exports_have(via: Via) {
    let daemon = arm(via).await;
    set(&daemon, Target::position(0.4)).await;
    daemon.pass(0.5).await;
    let before = shoulder(&daemon).await;
    let version = daemon.client.joint_layout("arm").await.unwrap().layout_version;
    let request = proto::ReloadEntityRequest { robot: "arm".into(), ..Default::default() };
    daemon.client.reload_from(assets().join("Bench_Arm-1.2 rev B"), request).await.unwrap();
    let after = shoulder(&daemon).await;
    assert_eq!((after.position, after.target), (before.position, 0.4));
    assert_ne!(daemon.client.joint_layout("arm").await.unwrap().layout_version, version);
}

async fn pose_scale_start_positions_and_passive_are_as_the_request_says(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let request = proto::SpawnEntityRequest {
        pose: Some(proto::Pose {
            position: Some(proto::Vector3 { x: 1.0, y: 2.0, z: 3.0 }),
            orientation: None,
        }),
        initial_mode: proto::InitialMode::Passive.into(),
        joint_positions: [("shoulder".to_owned(), 0.25)].into(),
        scale: Some(2.0),
        ..fixed("arm")
    };
    daemon.client.load(assets().join("Bench_Arm-1.2 rev B"), request).await.unwrap();
    let seen = shoulder(&daemon).await;
    assert_eq!((seen.position, seen.mode), (0.25, proto::JointMode::Passive));
    let poses = daemon.client.link_poses(&["arm"]).await.unwrap();
    let [x, y, z] = poses.robots[0].poses[7..10] else { panic!("{poses:?}") };
    // The joint's origin, (0, -0.022595, 0.19765), doubled.
    assert!((x - 1.0).abs() < 1e-12 && (y - 2.0 + 0.04519).abs() < 1e-12 && (z - 3.3953).abs() < 1e-12);
}

async fn a_path_on_the_daemons_disk_works_below_an_asset_root_only(via: Via) {
    let daemon = Daemon::start_via(via, |config| config.asset_roots = vec![assets().join("seven_arm")]).await;
    let inside = assets().join("seven_arm/urdf/seven_arm.urdf").display().to_string();
    let outside = assets().join("Two Link.v2").display().to_string();
    daemon.client.load_on_daemon(&inside, fixed("inside")).await.unwrap();
    for path in [outside.as_str(), "/etc/passwd", "../../../etc/passwd"] {
        let error = daemon.client.load_on_daemon(path, fixed("outside")).await.unwrap_err();
        assert_eq!(error.reason(), Some(proto::ErrorReason::PathNotAllowed), "{path}: {error}");
    }
}

crate::over_every_transport![
    a_solidworks_export_loads_without_a_warning_and_says_what_it_is,
    names_with_spaces_work_from_the_folder_to_the_target,
    a_report_names_what_a_robot_was_loaded_into_and_a_free_place,
    the_report_says_that_a_free_robot_falls_without_ground_and_how_to_hold_it,
    files_of_the_daemon_are_not_sent_again,
    a_robot_can_be_watched_on_its_way_in,
    a_ball_and_a_box_are_spawned_without_a_description,
    a_missing_mesh_is_a_warning_that_names_the_places_searched,
    a_reload_keeps_what_both_exports_have,
    pose_scale_start_positions_and_passive_are_as_the_request_says,
    a_path_on_the_daemons_disk_works_below_an_asset_root_only,
];
