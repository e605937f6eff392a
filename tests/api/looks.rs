//! Looks of robots: pictures and materials come with their meshes and are drawn with them.

use simd_client::proto::{self, shape::Geometry};
use simd_client::{Client, Package};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::http::get;
use simd_tests::robots::assets;

use crate::{arm, over_every_transport};

over_every_transport! {
    a_mesh_comes_as_gltf,
}

fn picture() -> Vec<u8> {
    std::fs::read(assets().join("textured/pictures/squares.png")).unwrap()
}

/// Returns the only visual of a robot.
async fn visual(client: &Client, robot: &str) -> proto::Shape {
    client.scene(&[robot]).await.unwrap().robots[0].visuals[0].clone()
}

async fn load(
    daemon: &Daemon,
    urdf: &std::path::Path,
    name: &str,
) -> (proto::LoadReport, proto::MeshGeometry) {
    let spawned = daemon.client.load(urdf, fixed(name)).await.unwrap();
    let shape = visual(&daemon.client, name).await;
    let Some(Geometry::Mesh(mesh)) = shape.geometry else { panic!("{shape:?}") };
    (spawned.report, mesh)
}

/// JSON and binary part of the mesh as it looks.
async fn glb(daemon: &Daemon, mesh: &proto::MeshGeometry) -> (serde_json::Value, Vec<u8>) {
    let answer = get(daemon.address, &format!("/meshes/{}.glb", mesh.look), &[]).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    let json = u32::from_le_bytes(answer.body[12..16].try_into().unwrap()) as usize;
    (serde_json::from_slice(&answer.body[20..20 + json]).unwrap(), answer.body[28 + json..].to_vec())
}

fn contains(bytes: &[u8], part: &[u8]) -> bool {
    bytes.windows(part.len()).any(|window| window == part)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pictures_of_each_format_come_along_and_are_in_the_mesh_as_it_is_drawn() {
    let daemon = Daemon::paused_via(Via::Grpc).await;
    for kind in ["dae", "obj", "glb", "gltf"] {
        let (report, mesh) = load(&daemon, &assets().join(format!("textured/urdf/{kind}.urdf")), kind).await;
        let warnings = |finding: &&proto::Finding| finding.severity() >= proto::Severity::Warning;
        assert_eq!(report.findings.iter().filter(warnings).count(), 0, "{kind}: {report:?}");
        // The daemon stores the file under its own hash, and the complete look under another if it names
        // files.
        assert!(!daemon.client.asset(&mesh.sha256).await.unwrap().is_empty());
        assert_eq!(mesh.look == mesh.sha256, kind == "glb", "{mesh:?}");
        let (json, binary) = glb(&daemon, &mesh).await;
        assert_eq!(json["images"][0]["mimeType"], "image/png", "{kind}");
        assert!(contains(&binary, &picture()), "{kind}");
        assert_eq!(json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
        assert!(json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"].is_u64());
    }
    daemon.client.load(assets().join("textured/urdf/shape.urdf"), fixed("shape")).await.unwrap();
    let shape = visual(&daemon.client, "shape").await;
    assert_eq!(daemon.client.asset(&shape.texture).await.unwrap(), picture());
}

/// Ground as most scenes of MuJoCo have it: its picture is made here and served like any other.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_pattern_that_mujoco_makes_is_a_picture_that_is_repeated() {
    let daemon = Daemon::paused_via(Via::Grpc).await;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.xml");
    let scene = "<mujoco model='scene'><asset><texture name='t' type='2d' builtin='checker' width='8' height='8'/>\
        <material name='floor' texture='t' texrepeat='2 1' texuniform='true'/></asset>\
        <worldbody><geom type='plane' size='0 0 1' material='floor'/></worldbody></mujoco>";
    std::fs::write(&path, scene).unwrap();
    daemon.client.load(&path, fixed("scene")).await.unwrap();
    let shape = visual(&daemon.client, "scene").await;
    assert_eq!(shape.texture_repeat, Some(proto::TextureRepeat { x: 1.0, y: 0.5, per_metre: true }));
    let picture = daemon.client.asset(&shape.texture).await.unwrap();
    assert!(picture.starts_with(b"\x89PNG"));
    let answer = get(daemon.address, &format!("/assets/{}.png", shape.texture), &[]).await;
    assert_eq!((answer.status, answer.body), (200, picture.to_vec()));
}

/// The same mesh with another picture has another look. Without its picture it is still drawn, and the report
/// says so.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_same_mesh_with_other_pictures_looks_otherwise() {
    let daemon = Daemon::paused_via(Via::Grpc).await;
    let (_, first) = load(&daemon, &assets().join("textured/urdf/dae.urdf"), "first").await;
    let folder = tempfile::tempdir().unwrap();
    for part in ["urdf", "meshes", "pictures"] {
        let to = folder.path().join(part);
        std::fs::create_dir(&to).unwrap();
        for file in std::fs::read_dir(assets().join("textured").join(part)).unwrap() {
            let file = file.unwrap();
            std::fs::copy(file.path(), to.join(file.file_name())).unwrap();
        }
    }
    let other = [picture(), b"behind its end".to_vec()].concat();
    let path = folder.path().join("pictures/squares.png");
    std::fs::write(&path, &other).unwrap();
    let urdf = folder.path().join("urdf/dae.urdf");
    let (_, second) = load(&daemon, &urdf, "second").await;
    assert_eq!(first.sha256, second.sha256);
    assert_ne!(first.look, second.look);
    assert!(contains(&glb(&daemon, &second).await.1, b"behind its end"));
    assert!(!contains(&glb(&daemon, &first).await.1, b"behind its end"));
    std::fs::remove_file(&path).unwrap();
    let (report, third) = load(&daemon, &urdf, "third").await;
    let said = report.findings.iter().find(|finding| finding.message.contains("squares.png")).unwrap();
    assert_eq!(said.severity(), proto::Severity::Warning);
    assert!(
        said.message.contains("is not found") && said.message.contains(path.to_str().unwrap()),
        "{said:?}"
    );
    assert!(glb(&daemon, &third).await.0.get("images").is_none());
}

/// A mesh's files are a part of the source, even if the daemon has them already.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn files_on_the_daemon_are_not_sent_again_even_if_a_mesh_names_them() {
    let daemon = Daemon::paused_via(Via::Grpc).await;
    let package = Package::open(assets().join("textured/urdf/obj.urdf")).unwrap();
    let once = daemon.client.upload(&package).await.unwrap();
    let again = daemon.client.upload(&package).await.unwrap();
    assert_eq!(once, again);
    let named: Vec<&str> = once.assets.keys().map(String::as_str).collect();
    let expected = ["../meshes/../pictures/squares.png", "../meshes/box.mtl", "../meshes/box.obj"];
    assert_eq!(named, expected);
    assert!(once.missing.is_empty(), "{once:?}");
}

async fn a_mesh_comes_as_gltf(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let scene = client.scene(&["arm"]).await.unwrap();
    let mesh = scene.robots[0].visuals.iter().find_map(|shape| match &shape.geometry {
        Some(Geometry::Mesh(mesh)) if !mesh.sha256.is_empty() => Some(mesh.sha256.clone()),
        _ => None,
    });
    let bytes = client.mesh(&mesh.unwrap()).await.unwrap();
    assert_eq!(&bytes[..4], b"glTF");
    assert_eq!(u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize, bytes.len());
    let unknown = client.mesh(&"0".repeat(64)).await.unwrap_err();
    assert_eq!(unknown.reason(), Some(proto::ErrorReason::AssetNotUploaded), "{unknown}");
}
