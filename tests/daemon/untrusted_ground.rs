//! Harmful files for ground: each gives a sentence that names it, the daemon continues, and its memory stays
//! bounded.
#![cfg(target_os = "linux")]

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::time::Duration;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use simd_client::proto::{self, Base, MeshShapes, Severity, SpawnEntityRequest};
use simd_client::{Client, Spawned};
use simd_tests::daemon::fixed;
use simd_tests::pictures::grey_png;
use simd_tests::process::Process;

use crate::paused;

/// Returns the peak memory of the daemon, MiB.
fn peak(daemon: &Process) -> u64 {
    let status = fs::read_to_string(format!("/proc/{}/status", daemon.pid().unwrap())).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() / 1024
}

/// Returns a robot of one link that has this for visuals and collisions.
async fn load(client: &Client, folder: &Path, shapes: &str) -> Spawned {
    let urdf = format!(
        "<robot name='ground'><link name='link'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' \
         ixz='0' iyz='0'/></inertial>{shapes}</link></robot>"
    );
    fs::write(folder.join("ground.urdf"), urdf).unwrap();
    let request = SpawnEntityRequest {
        base: Base::Fixed.into(),
        mesh_shapes: MeshShapes::Mesh.into(),
        allow_renaming: true,
        ..fixed("ground")
    };
    client.load(folder.join("ground.urdf"), request).await.unwrap()
}

/// Spawns a body with this file as its collision mesh.
async fn load_mesh(client: &Client, folder: &Path, file: &str, content: &[u8]) -> Spawned {
    fs::write(folder.join(file), content).unwrap();
    let shapes = format!("<collision><geometry><mesh filename='{file}'/></geometry></collision>");
    load(client, folder, &shapes).await
}

/// Returns a shape that is this file: rows of numbers come so.
async fn spawn_rows(client: &Client, folder: &Path, file: &str, content: &[u8]) -> Spawned {
    let path = folder.join(file);
    fs::write(&path, content).unwrap();
    let mesh = proto::MeshGeometry { uri: file.into(), ..Default::default() };
    let geometry = Some(proto::primitive::Geometry::Mesh(mesh));
    let primitive = proto::Primitive { geometry, mass: 1.0, color: None };
    let source = client.upload_primitive(&path, file, primitive).await.unwrap();
    let request = SpawnEntityRequest { source: Some(source), allow_renaming: true, ..fixed("ground") };
    client.spawn(request).await.unwrap()
}

/// Returns the warnings about a file.
fn warnings<'a>(spawned: &'a Spawned, file: &str) -> Vec<&'a str> {
    let about = |finding: &&proto::Finding| finding.file == file && finding.severity() >= Severity::Warning;
    spawned.report.findings.iter().filter(about).map(|finding| finding.message.as_str()).collect()
}

/// 256 MiB of zeros, in a thousandth of that.
fn bomb() -> Vec<u8> {
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
    let zeros = vec![0; 1 << 20];
    (0..256).for_each(|_| packed.write_all(&zeros).unwrap());
    packed.finish().unwrap()
}

/// Returns a binary STL of this many triangles without an area, each from a point of a line to the next one
/// and back.
fn lines(triangles: u32) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend(triangles.to_le_bytes());
    for triangle in 0..triangles {
        bytes.extend_from_slice(&[0; 12]);
        for corner in [triangle, triangle + 1, triangle] {
            // Exact in a small number, so that all are on one line to the last digit.
            let along = (corner as f32 / 1024.0).to_le_bytes();
            (0..3).for_each(|_| bytes.extend_from_slice(&along));
        }
        bytes.extend_from_slice(&[0; 2]);
    }
    bytes
}

/// All of them together raise the daemon's peak by less than 128 MiB. The pictures at their stated sizes
/// would be ten gigabytes, and an unpacked stream a quarter of one.
#[tokio::test]
async fn heights_that_are_none_are_a_sentence_and_take_no_memory() {
    let daemon = paused().await;
    let client = daemon.client().await.with_timeout(Duration::from_secs(120));
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let robots = client.robots().await.unwrap().len();
    let bomb = bomb();
    let before = peak(&daemon);

    let row = "0.5 ".repeat(500_000);
    let spawned = spawn_rows(&client, folder, "row.csv", row.as_bytes()).await;
    let said = warnings(&spawned, "row.csv");
    let phrase = "it has 1 rows of 500000 samples; a height field has at least 2 by 2";
    assert!(said.iter().any(|said| said.contains(phrase) && said.contains("row.csv")), "{said:?}");

    let mut stl = lines(1);
    stl[96..100].copy_from_slice(&f32::NAN.to_le_bytes());
    for (file, content, phrase) in [
        ("line.png", grey_png(8, [1, 900_000], &bomb), "it has 900000 rows of 1 samples; a height field"),
        (
            "wide.png",
            grey_png(8, [100_000, 100_000], &bomb),
            "it has 100000 rows of 100000 samples; the limit",
        ),
        ("nan.stl", stl, "a corner is not finite"),
    ] {
        let spawned = load_mesh(&client, folder, file, &content).await;
        let said = warnings(&spawned, file);
        assert_eq!(said.len(), 1, "{file}: {said:?}");
        assert!(said[0].contains(phrase) && said[0].contains(file), "{said:?}");
    }

    // As the picture of a material too.
    fs::write(folder.join("picture.png"), grey_png(8, [100_000, 100_000], &bomb)).unwrap();
    let material = "<material name='m'><texture filename='picture.png'/></material>";
    let visual = format!("<visual><geometry><box size='1 1 1'/></geometry>{material}</visual>");
    let spawned = load(&client, folder, &visual).await;
    let said = warnings(&spawned, "picture.png");
    let phrase = "\"picture.png\" is not read: it has 100000 by 100000 pixels";
    assert!(said.len() == 1 && said[0].contains(phrase), "{said:?}");

    // A stream that continues after the last pixel is not unpacked any further: the ground is loaded, and is
    // flat.
    let spawned = load_mesh(&client, folder, "stream.png", &grey_png(8, [200, 200], &bomb)).await;
    assert_eq!(warnings(&spawned, "stream.png"), [""; 0]);

    let grown = peak(&daemon) - before;
    println!("{grown} MiB more at one time");
    assert!(grown < 128, "{grown} MiB");
    client.step(10).await.unwrap();
    assert_eq!(client.robots().await.unwrap().len(), robots + 6);
}

/// A kilobyte for each triangle, at once. The file has 50 bytes of each, and the daemon grants 300 to a
/// triangle that collides (a mesh that takes more becomes its hull).
#[tokio::test]
async fn a_million_triangles_without_an_area_are_a_sentence_within_a_gigabyte() {
    let daemon = paused().await;
    let client = daemon.client().await.with_timeout(Duration::from_secs(120));
    let folder = tempfile::tempdir().unwrap();
    let robots = client.robots().await.unwrap().len();
    let content = lines(1_000_000);
    let before = peak(&daemon);
    let spawned = load_mesh(&client, folder.path(), "lines.stl", &content).await;
    let grown = peak(&daemon) - before;
    println!("{} bytes of file, {grown} MiB more at one time", content.len());
    let said = warnings(&spawned, "lines.stl");
    let phrase = "of the collision mesh of 1000000 triangles is used instead of its triangles, because they \
                  have no area";
    assert!(said.len() == 1 && said[0].contains(phrase), "{said:?}");
    assert!(grown < 1_024, "{grown} MiB");
    client.step(10).await.unwrap();
    assert_eq!(client.robots().await.unwrap().len(), robots + 1);
}
