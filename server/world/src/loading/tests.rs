//! Robots in a world from bytes and paths.

mod meshes;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use bytes::Bytes;
use glamx::DPose3;
use simd_core::simulation::WorldLimits;
use simd_core::{Command, PhysicsSettings, Simulation};

use super::*;
use crate::account::Account;
use crate::blocking_threads::BlockingThreads;
use crate::driver;
use crate::handle::{AssetState, DaemonInfo, FilePart, RunState, SimHandle, Source, SpawnRequest};

/// Returns a robot with these joints, each with a separate child link, and a mesh.
fn urdf(name: &str, joints: &[&str]) -> String {
    let mut text = format!(
        r#"<robot name="{name}"><link name="base"><visual><geometry>
        <mesh filename="package://{name}/meshes/base.STL"/></geometry></visual></link>"#
    );
    for joint in joints {
        text += &format!(
            r#"<link name="{joint}_link"><inertial><mass value="1"/>
            <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
            <joint name="{joint}" type="continuous"><parent link="base"/><child link="{joint}_link"/>
            <axis xyz="0 0 1"/></joint>"#
        );
    }
    text + "</robot>"
}

/// Returns a binary STL with one triangle.
fn stl(size: f32) -> Vec<u8> {
    let mut file = vec![0; 80];
    file.extend(1_u32.to_le_bytes());
    for number in [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, size, 0.0, 0.0, 0.0, size, 0.0_f32] {
        file.extend(number.to_le_bytes());
    }
    file.extend([0, 0]);
    file
}

fn daemon(limits: DaemonLimits, roots: &[PathBuf]) -> SimHandle {
    let limits_of_world = WorldLimits { robots: 10, saved_states: 10 };
    let world = Simulation::new(PhysicsSettings::default(), limits_of_world);
    let config = driver::Config { state: RunState::Paused, ..Default::default() };
    let link = driver::start(world, config).unwrap();
    let info = DaemonInfo { name: "test".into(), version: "0", limits };
    SimHandle::new(link, Loader::new(limits, roots, BlockingThreads::computing().unwrap()).unwrap(), info)
}

fn request(source: Source) -> SpawnRequest {
    SpawnRequest {
        srdf: Bytes::new(),
        collision_pairs: Vec::new(),
        model: String::new(),
        source,
        name: String::new(),
        allow_renaming: false,
        pose: DPose3::IDENTITY,
        free_place: Default::default(),
        fixed_base: Some(true),
        passive: false,
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        scale: 1.0,
        strict: false,
        mesh_shapes: Default::default(),
        contact_settings: Default::default(),
    }
}

fn inline(urdf: String) -> Source {
    Source::Inline { urdf: urdf.into(), assets: BTreeMap::new(), missing: BTreeMap::new() }
}

const URI: &str = "package://arm/meshes/base.STL";

#[tokio::test]
async fn a_robot_comes_by_prepare_upload_and_spawn() {
    let handle = daemon(DaemonLimits::default(), &[]);
    let (text, mesh) = (Bytes::from(urdf("arm", &["elbow"])), Bytes::from(stl(1.0)));
    let prepared = handle.prepare(text.clone(), BTreeMap::new()).await.unwrap();
    assert_eq!(prepared.name, "arm");
    assert_eq!(prepared.assets, [(URI.to_owned(), AssetState::Unresolved)]);
    let sha256 = Sha256::of(&mesh);
    let assets = BTreeMap::from([(URI.to_owned(), sha256)]);
    let prepared = handle.prepare(text, assets.clone()).await.unwrap();
    assert_eq!(prepared.assets, [(URI.to_owned(), AssetState::Lacking)]);

    let description = prepared.description;
    let source = Source::Uploaded { description, assets: assets.clone(), missing: BTreeMap::new() };
    let early = handle.spawn(request(source.clone())).await.unwrap_err();
    assert!(matches!(&early, CallError::AssetNotUploaded { uri, .. } if uri == URI), "{early}");

    let total = mesh.len() as u64;
    assert_eq!(
        handle.upload(FilePart { sha256, total, offset: 0, data: mesh.slice(..100) }).await.unwrap(),
        100
    );
    assert_eq!(
        handle.upload(FilePart { sha256, total, offset: 100, data: mesh.slice(100..) }).await.unwrap(),
        total
    );
    assert_eq!(handle.asset(&sha256), Some(mesh));

    let loaded = handle.spawn(request(source)).await.unwrap();
    assert_eq!((loaded.name.as_str(), loaded.summary.as_str()), ("arm", "arm: 2 links, 1 moving joint"));
    assert_eq!(handle.description_of("arm"), Some(description));
    assert!(handle.newest().state.entity("arm").is_some(), "it is there once the answer is");
}

#[tokio::test]
async fn bytes_that_have_another_hash_are_refused() {
    let handle = daemon(DaemonLimits::default(), &[]);
    let refused = handle
        .upload(FilePart { sha256: Sha256::of(b"a"), total: 1, offset: 0, data: Bytes::from_static(b"b") })
        .await
        .unwrap_err();
    assert!(matches!(refused, CallError::UploadMismatch { .. }), "{refused}");
    assert_eq!(handle.asset(&Sha256::of(b"a")), None);
    let beyond = handle
        .upload(FilePart { sha256: Sha256::of(b"a"), total: 1 << 40, offset: 0, data: Bytes::new() })
        .await;
    assert!(matches!(beyond, Err(CallError::LimitExceeded { .. })));
}

#[tokio::test]
async fn a_description_that_was_never_sent_is_asked_for() {
    let handle = daemon(DaemonLimits::default(), &[]);
    let description = Sha256::of(b"");
    let source = Source::Uploaded { description, assets: BTreeMap::new(), missing: BTreeMap::new() };
    let refused = handle.spawn(request(source)).await.unwrap_err();
    assert!(matches!(refused, CallError::DescriptionNotUploaded { .. }));
}

#[tokio::test]
async fn names_are_made_fit_for_the_wire() {
    let handle = daemon(DaemonLimits::default(), &[]);
    let loaded = handle.spawn(request(inline(urdf("Bench Arm", &[])))).await.unwrap();
    assert_eq!(loaded.name, "Bench_Arm");
    let named = SpawnRequest { name: "my/arm 2".into(), ..request(inline(urdf("arm", &[]))) };
    assert_eq!(handle.spawn(named).await.unwrap().name, "my_arm_2");
}

#[tokio::test]
async fn a_missing_mesh_is_a_warning_that_names_the_places() {
    let handle = daemon(DaemonLimits::default(), &[]);
    let missing = BTreeMap::from([(URI.to_owned(), vec!["/home/me/arm/meshes/base.STL".to_owned()])]);
    let source = Source::Inline { urdf: urdf("arm", &[]).into(), assets: BTreeMap::new(), missing };
    let loaded = handle.spawn(request(source)).await.unwrap();
    assert!(loaded.summary.ends_with("; 1 warning"), "{}", loaded.summary);
    let report = format!("{:?}", loaded.report);
    assert!(report.contains("/home/me/arm/meshes/base.STL"), "{report}");
}

#[tokio::test]
async fn descriptions_without_a_robot_are_refused_and_validation_says_why() {
    let handle = daemon(DaemonLimits::default(), &[]);
    let garbage = || inline("<robot".into());
    let refused = handle.spawn(request(garbage())).await.unwrap_err();
    assert!(matches!(refused, CallError::InvalidDescription { .. }), "{refused}");
    let validated = handle.validate(garbage(), 1.0, "").await.unwrap();
    assert!(validated.robots.is_empty() && validated.summary.starts_with("refused: "));
    assert!(!validated.report.findings.is_empty());
    let validated = handle.validate(inline(urdf("arm", &["a", "b"])), 1.0, "").await.unwrap();
    assert_eq!(validated.summary, "arm: 3 links, 2 moving joints; 1 warning");
    assert!(handle.newest().state.world.entities.is_empty());
    for scale in [0.0, -1.0, f64::NAN, 1001.0] {
        let refused = handle.validate(garbage(), scale, "").await.unwrap_err();
        assert!(matches!(refused, CallError::InvalidValue { .. }), "{scale}");
    }
}

#[tokio::test]
async fn a_description_beyond_the_limit_is_refused_before_it_is_read() {
    let limits = DaemonLimits { description_bytes: 100, ..DaemonLimits::default() };
    let handle = daemon(limits, &[]);
    let text = urdf("arm", &[]);
    let prepared = handle.prepare(text.clone().into(), BTreeMap::new()).await;
    assert!(matches!(prepared, Err(CallError::LimitExceeded { limit: 100, .. })));
    let spawned = handle.spawn(request(inline(text))).await;
    assert!(matches!(spawned, Err(CallError::LimitExceeded { limit: 100, .. })));
}

fn write_package(root: &Path, joints: &[&str]) {
    let folder = root.join("arm");
    fs::create_dir_all(folder.join("urdf")).unwrap();
    fs::create_dir_all(folder.join("meshes")).unwrap();
    fs::write(folder.join("urdf/arm.urdf"), urdf("arm", joints)).unwrap();
    fs::write(folder.join("meshes/base.STL"), stl(1.0)).unwrap();
}

#[tokio::test]
async fn a_robot_from_disk_is_read_again_at_a_reload_and_keeps_its_scale() {
    let dir = tempfile::tempdir().unwrap();
    write_package(dir.path(), &["elbow"]);
    let handle = daemon(DaemonLimits::default(), &[dir.path().to_path_buf()]);
    let spawned = SpawnRequest { scale: 2.0, ..request(Source::Path("arm".into())) };
    let loaded = handle.spawn(spawned).await.unwrap();
    assert_eq!(loaded.summary, "arm: 2 links, 1 moving joint");
    assert!(handle.asset(&Sha256::of(&stl(1.0))).is_some(), "viewers can have its mesh");
    let before = handle.description_of("arm");

    write_package(dir.path(), &["shoulder", "wrist"]);
    let reloaded = handle.reload("arm".into(), None, false).await.unwrap();
    assert_eq!(
        (reloaded.added, reloaded.removed),
        (vec!["shoulder".into(), "wrist".into()], vec!["elbow".into()])
    );
    assert_ne!(handle.description_of("arm"), before);
    let newest = handle.newest();
    let (_, entity) = newest.state.entity("arm").unwrap();
    assert_eq!(handle.loader().with_known(&entity.model, |known| known.scale), Some(2.0));

    let missing = handle.reload("missing".into(), None, false).await.unwrap_err();
    assert!(missing.to_string().contains("\"arm\""), "{missing}");
}

#[tokio::test]
async fn the_source_of_each_of_several_robots_is_known() {
    let handle = daemon(DaemonLimits::default(), &[]);
    for scale in 1..=3 {
        let description = inline(urdf("arm", &["elbow"]));
        let scaled = SpawnRequest { scale: f64::from(scale), allow_renaming: true, ..request(description) };
        handle.spawn(scaled).await.unwrap();
    }
    let newest = handle.newest();
    let models = newest.state.world.entities.iter().map(|entity| &entity.model);
    let scales: Vec<_> = models.map(|model| handle.loader().with_known(model, |known| known.scale)).collect();
    assert_eq!(scales, [Some(1.0), Some(2.0), Some(3.0)]);
    let unknown = Arc::new(RobotModel::default());
    assert_eq!(handle.loader().with_known(&unknown, |known| known.scale), None);
}

#[tokio::test]
async fn the_operator_may_load_from_anywhere_and_reload_from_there() {
    let dir = tempfile::tempdir().unwrap();
    write_package(dir.path(), &["elbow"]);
    let handle = daemon(DaemonLimits::default(), &[]);
    let path = dir.path().join("arm");
    let source = Source::Path(path.display().to_string());
    let refused = handle.spawn(request(source.clone())).await.unwrap_err();
    assert!(matches!(refused, CallError::PathNotAllowed { .. }), "{refused}");
    let loaded = handle.spawn_at_start(path, request(source)).await.unwrap();
    assert!(handle.newest().state.entity(&loaded.name).unwrap().1.loaded_at_start);
    handle.reload(loaded.name, None, false).await.unwrap();
}

#[tokio::test]
async fn files_of_robots_stay_and_those_of_deleted_robots_make_room() {
    // Room for two descriptions.
    let text = |n: u8| urdf(&format!("arm{n}"), &["elbow"]);
    let each = text(0).len() as u64 + 1024;
    let limits = DaemonLimits { upload_store_bytes: 2 * each, ..DaemonLimits::default() };
    let handle = daemon(limits, &[]);
    for n in 0..2 {
        handle.spawn(request(inline(text(n)))).await.unwrap();
    }
    let full = handle.spawn(request(inline(text(2)))).await.unwrap_err();
    assert!(matches!(full, CallError::LimitExceeded { .. }), "{full}");
    handle.command(Command::Delete { robot: "arm0".into() }).await.unwrap();
    // Overwrites earlier states, which still show the robot.
    handle.step(100).await.unwrap();
    handle.spawn(request(inline(text(2)))).await.unwrap();
    assert!(handle.asset(&Sha256::of(text(0).as_bytes())).is_none());
    assert!(handle.asset(&Sha256::of(text(1).as_bytes())).is_some());
}

/// Returns fourteen megabytes of searched paths of a file, under its URI and under others.
fn missing() -> BTreeMap<String, Vec<String>> {
    let places = |uri: &str| (uri.to_owned(), vec!["/nowhere/at/all".to_owned(); 200_000]);
    [URI, "package://arm/meshes/unasked.stl"].into_iter().map(places).collect()
}

#[tokio::test]
async fn deleting_robots_frees_what_they_held_also_in_a_paused_world() {
    let handle = daemon(DaemonLimits::default(), &[]);
    let names: Vec<String> = (0..10).map(|n| format!("arm{n}")).collect();
    for name in &names {
        let urdf = urdf(name, &["elbow"]).replace(&format!("package://{name}/meshes/base.STL"), URI);
        let source = Source::Inline { urdf: urdf.into(), assets: BTreeMap::new(), missing: missing() };
        let loaded = handle.spawn(request(source)).await.unwrap();
        let longest = loaded.report.findings.iter().map(|finding| finding.message.len()).max();
        assert!(longest < Some(1000), "{longest:?} bytes in one finding");
    }
    let held = handle.loader().held();
    assert!(held < names.len() * (4 << 20), "{held} bytes");
    for robot in names {
        handle.command(Command::Delete { robot }).await.unwrap();
    }
    handle.tidy(Instant::now());
    let files = handle.loader().held();
    assert!(files < 10 * 3000, "{files} bytes");
    tokio::time::pause();
    tokio::time::advance(std::time::Duration::from_secs(600)).await;
    handle.tidy(Instant::now());
    assert_eq!(handle.loader().held(), 0);
}

#[tokio::test]
async fn abandoned_uploads_are_dropped_although_no_other_comes() {
    let handle = daemon(DaemonLimits::default(), &[]);
    handle
        .upload(FilePart { sha256: Sha256::of(b"a"), total: 1 << 20, offset: 0, data: vec![0; 1000].into() })
        .await
        .unwrap();
    handle.tidy(Instant::now());
    assert!(handle.loader().held() >= 1000);
    tokio::time::pause();
    tokio::time::advance(std::time::Duration::from_secs(60)).await;
    handle.tidy(Instant::now());
    assert_eq!(handle.loader().held(), 0);
}

#[tokio::test]
async fn a_fault_while_reading_is_a_fault_of_one_call() {
    let handle = daemon(DaemonLimits::default(), &[]);
    for _ in 0..DaemonLimits::default().waiting_descriptions {
        let failed =
            handle.loader().off_thread::<()>(&Account::Process, || panic!("on purpose")).await.unwrap_err();
        assert!(matches!(&failed, CallError::Internal { message } if message.contains("on purpose")));
    }
    handle.spawn(request(inline(urdf("arm", &[])))).await.unwrap();
}

#[tokio::test]
async fn a_call_that_waits_too_long_for_a_reading_is_refused_and_the_work_ends_all_the_same() {
    let limits = DaemonLimits { reading_seconds: 0, ..DaemonLimits::default() };
    let handle = daemon(limits, &[]);
    let (go, wait) = std::sync::mpsc::channel::<()>();
    let (end, ended) = tokio::sync::oneshot::channel();
    let refused =
        handle.loader().off_thread(&Account::Process, move || (wait.recv(), end.send(()))).await.unwrap_err();
    let sentence = refused.to_string();
    assert!(sentence.starts_with("the time for reading a description or a file, in seconds,"), "{sentence}");
    go.send(()).unwrap();
    ended.await.unwrap();
}
