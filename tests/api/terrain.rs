//! Meshes and height fields as ground: load reports, and unusable files.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use simd_client::proto::{self, Base, MeshShapes, SpawnEntityRequest};
use simd_client::{Client, Error, Spawned};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::pictures::grey_png;

/// Writes a robot of one link that is this mesh.
fn write_robot(folder: &Path, file: &str, content: &[u8]) {
    fs::write(folder.join(file), content).unwrap();
    let shape = format!("<geometry><mesh filename='{file}'/></geometry>");
    let urdf = format!(
        "<robot name='ground'><link name='link'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' \
         ixz='0' iyz='0'/></inertial><visual>{shape}</visual><collision>{shape}</collision></link></robot>"
    );
    fs::write(folder.join("ground.urdf"), urdf).unwrap();
}

async fn load(client: &Client, folder: &Path, base: Base, meshes: MeshShapes) -> Result<Spawned, Error> {
    let request = SpawnEntityRequest {
        base: base.into(),
        mesh_shapes: meshes.into(),
        allow_renaming: true,
        ..fixed("ground")
    };
    client.load(folder.join("ground.urdf"), request).await
}

/// Returns a shape that is this file.
async fn spawn_file(client: &Client, path: &Path, uri: &str) -> Spawned {
    let mesh = proto::MeshGeometry { uri: uri.into(), ..Default::default() };
    let geometry = Some(proto::primitive::Geometry::Mesh(mesh));
    let primitive = proto::Primitive { geometry, mass: 1.0, color: None };
    let source = client.upload_primitive(path, uri, primitive).await.unwrap();
    let request = SpawnEntityRequest { source: Some(source), allow_renaming: true, ..fixed("ground") };
    client.spawn(request).await.unwrap()
}

/// Returns the report's messages about the collision mesh.
fn said(spawned: &Spawned) -> Vec<&str> {
    let collision = |finding: &&proto::Finding| finding.element == "collision";
    spawned.report.findings.iter().filter(collision).map(|finding| finding.message.as_str()).collect()
}

/// A box of a metre without a lid, as an OBJ file.
const TUB: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                   f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// Half a metre: from the middle of the lid that its hull has to the nearest wall.
async fn a_load_report_says_what_a_mesh_became(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let folder = tempfile::tempdir().unwrap();
    write_robot(folder.path(), "tub.obj", TUB.as_bytes());
    for (base, meshes, expected) in [
        (
            Base::Fixed,
            MeshShapes::Unspecified,
            "the collision mesh of 10 triangles collides by its triangles",
        ),
        (Base::Fixed, MeshShapes::Mesh, "its link cannot move; it does not collide with other fixed shapes"),
        (
            Base::Free,
            MeshShapes::Mesh,
            "the convex hull of the collision mesh of 10 triangles is used instead",
        ),
        (Base::Fixed, MeshShapes::Hull, "the largest distance found between the two is 0."),
        (Base::Fixed, MeshShapes::Decomposition, "convex part"),
    ] {
        let spawned = load(&daemon.client, folder.path(), base, meshes).await.unwrap();
        let said = said(&spawned);
        assert!(said.len() == 1 && said[0].contains(expected), "{meshes:?}: {said:?}");
        if meshes == MeshShapes::Hull {
            let distance =
                said[0].rsplit_once(" is ").unwrap().1.trim_end_matches(" m").parse::<f64>().unwrap();
            assert!((0.25..=0.5).contains(&distance), "{said:?}");
        }
    }
    // A ball of 2,000 corners within a percent of its radius: a hull's maximum number of corners is too small
    // for half a percent.
    let corner = |i: u32| {
        let (z, turn) = (1.0 - f64::from(2 * i + 1) / 2_000.0, f64::from(i) * 2.4);
        let across = (1.0 - z * z).sqrt();
        format!("v {} {} {z}\n", across * turn.cos(), across * turn.sin())
    };
    write_robot(folder.path(), "ball.obj", (0..2_000).map(corner).collect::<String>().as_bytes());
    let spawned = load(&daemon.client, folder.path(), Base::Free, MeshShapes::Hull).await.unwrap();
    let (_, rest) = said(&spawned)[0].split_once("of some of its corners; the others lie at most ").unwrap();
    let beyond: f64 = rest.split_once(" m").unwrap().0.parse().unwrap();
    assert!(beyond > 0.0 && beyond < 1e-2, "{beyond}");
    // The colliding surface is drawn, even if it is not a hull.
    let scene = daemon.client.scene(&["ground"]).await.unwrap();
    assert!(
        matches!(&scene.robots[0].colliders[0].geometry, Some(proto::shape::Geometry::Convex(_))),
        "{scene:?}"
    );
}

/// An impossible request is a warning, which a strict load refuses; then no robot is added.
async fn a_strict_load_refuses_unusable_meshes_and_parts(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let folder = tempfile::tempdir().unwrap();
    let load_strictly = async |base: Base, meshes: MeshShapes| {
        let request = SpawnEntityRequest {
            base: base.into(),
            mesh_shapes: meshes.into(),
            strict: true,
            allow_renaming: true,
            ..fixed("ground")
        };
        daemon.client.load(folder.path().join("ground.urdf"), request).await
    };
    // A sheet has no parts, and a line no triangles.
    let sheet = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n";
    write_robot(folder.path(), "sheet.obj", sheet.as_bytes());
    let refused = load_strictly(Base::Free, MeshShapes::Decomposition).await.unwrap_err();
    let said = refused.to_string();
    assert!(
        said.contains("is not divided into convex parts") && said.contains("strict loading refuses"),
        "{said}"
    );
    assert!(load_strictly(Base::Free, MeshShapes::Hull).await.is_ok());
    assert!(load_strictly(Base::Fixed, MeshShapes::Mesh).await.is_ok());
    write_robot(folder.path(), "line.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    let refused = load_strictly(Base::Fixed, MeshShapes::Mesh).await.unwrap_err();
    assert!(refused.to_string().contains("they have no area"), "{refused}");
    assert_eq!(daemon.client.robots().await.unwrap().len(), 2);
}

/// A ball that falls into the tub stays in it; a hull would carry it on a lid.
async fn a_ball_falls_into_what_is_open(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let folder = tempfile::tempdir().unwrap();
    write_robot(folder.path(), "tub.obj", TUB.as_bytes());
    load(&daemon.client, folder.path(), Base::Fixed, MeshShapes::Unspecified).await.unwrap();
    let sphere = proto::primitive::Geometry::Sphere(proto::SphereGeometry { radius: 0.1 });
    let primitive = proto::Primitive { geometry: Some(sphere), mass: 1.0, color: None };
    let source = proto::description_source::Source::Primitive(primitive);
    let request = SpawnEntityRequest {
        source: Some(proto::DescriptionSource { source: Some(source), ..Default::default() }),
        name: "ball".into(),
        base: Base::Free.into(),
        pose: Some(proto::Pose {
            position: Some(proto::Vector3 { x: 0.5, y: 0.4, z: 1.5 }),
            ..Default::default()
        }),
        ..Default::default()
    };
    daemon.client.spawn(request).await.unwrap();
    daemon.pass(2.0).await;
    let at = daemon.client.robot_state("ball").await.unwrap().pose.unwrap().position.unwrap();
    assert!((at.z - 0.1).abs() < 1e-3, "{at:?}");
}

/// Returns a ball of 10 cm at this height above the middle of the ground.
async fn spawn_ball(client: &Client, z: f64) -> Spawned {
    let sphere = proto::primitive::Geometry::Sphere(proto::SphereGeometry { radius: 0.1 });
    let primitive = proto::Primitive { geometry: Some(sphere), mass: 1.0, color: None };
    let source = proto::description_source::Source::Primitive(primitive);
    let position = Some(proto::Vector3 { x: 0.25, y: 0.25, z });
    let request = SpawnEntityRequest {
        source: Some(proto::DescriptionSource { source: Some(source), ..Default::default() }),
        name: "ball".into(),
        allow_renaming: true,
        base: Base::Free.into(),
        pose: Some(proto::Pose { position, ..Default::default() }),
        ..Default::default()
    };
    client.spawn(request).await.unwrap()
}

/// Returns the report's messages about links below a surface.
fn sunk(spawned: &Spawned) -> Vec<String> {
    let sentences =
        spawned.report.findings.iter().map(|finding| format!("{} {}", finding.element, finding.message));
    sentences.filter(|sentence| sentence.contains("below the surface")).collect()
}

/// Links below a sheet and a height field are reported, for later bodies and for earlier ones. Links in a
/// tub, which has no upper side above them, and links above a surface are not.
async fn starts_below_a_surface_are_reported(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let client = &daemon.client;
    let folder = tempfile::tempdir().unwrap();
    let sheet = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n";
    write_robot(folder.path(), "sheet.obj", sheet.as_bytes());
    let before = spawn_ball(client, -0.4).await;
    assert!(sunk(&before).is_empty(), "{before:?}");
    let ground = load(client, folder.path(), Base::Fixed, MeshShapes::Mesh).await.unwrap();
    let expected = "link \"link\" of \"ball\" starts 0.400 m below the surface of \"ground\"";
    assert!(sunk(&ground).len() == 1 && sunk(&ground)[0].contains(expected), "{ground:?}");
    let [above, below] = [spawn_ball(client, 0.05).await, spawn_ball(client, -0.25).await];
    assert!(sunk(&above).is_empty(), "{above:?}");
    assert!(sunk(&below).len() == 1 && sunk(&below)[0].contains("starts 0.250 m below"), "{below:?}");
    client.delete_robot("ground").await.unwrap();
    write_robot(folder.path(), "tub.obj", TUB.as_bytes());
    let tub = load(client, folder.path(), Base::Fixed, MeshShapes::Mesh).await.unwrap();
    let inside = spawn_ball(client, 0.5).await;
    assert!(sunk(&inside).is_empty(), "{tub:?} {inside:?}");
    let heights = folder.path().join("flat.csv");
    fs::write(&heights, "2,2\n2,2\n").unwrap();
    let field = spawn_file(client, &heights, "flat.csv").await;
    assert!(sunk(&field).iter().any(|message| message.contains("starts 1.500 m below")), "{field:?}");
}

/// Returns a binary STL of this many triangles with these corners.
fn stl(triangles: u32, corners: [[f32; 3]; 3]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend(triangles.to_le_bytes());
    let mut triangle = vec![0; 12];
    triangle.extend(corners.iter().flatten().flat_map(|number| number.to_le_bytes()));
    triangle.extend([0; 2]);
    for _ in 0..triangles {
        bytes.write_all(&triangle).unwrap();
    }
    bytes
}

/// Each is a sentence in the report of a robot that collides with nothing, or with a hull. The daemon
/// continues.
async fn files_that_are_no_ground_are_a_sentence(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let folder = tempfile::tempdir().unwrap();
    let nan = [[f32::NAN, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    // Files of numbers are sent if a client names them, but not because a URDF does.
    for (file, content, phrase) in [
        ("row.csv", b"1 2 3 4\n".to_vec(), "it has 1 rows of 4 samples; a height field has at least 2 by 2"),
        ("nan.csv", b"1 2\n3 nan\n".to_vec(), "line 2: \"nan\" is not a number"),
        (
            "huge.png",
            grey_png(16, [100_000, 100_000], &[]),
            "100000 rows of 100000 samples; the limit is 1000000 in all",
        ),
        // A stream of zeros a thousand times as long as the picture: unpacking stops at the picture's size.
        ("short.png", grey_png(16, [900, 900], b"\x78\x9c\x03\x00\x00\x00\x00\x01"), "cannot be unpacked"),
        ("nan.stl", stl(2, nan), "a corner is not finite"),
    ] {
        write_robot(folder.path(), file, &content);
        let spawned = if file.ends_with(".csv") {
            spawn_file(&daemon.client, &folder.path().join(file), file).await
        } else {
            load(&daemon.client, folder.path(), Base::Fixed, MeshShapes::Mesh).await.unwrap()
        };
        let findings = &spawned.report.findings;
        assert!(findings.iter().any(|it| it.message.contains(phrase)), "{file}: {findings:?}");
        assert_eq!(said(&spawned), [""; 0], "{file}");
    }
    // Triangles without an area: they can collide only as their hull, a plate around a line.
    let line = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]];
    write_robot(folder.path(), "line.stl", &stl(100_000, line));
    let spawned = load(&daemon.client, folder.path(), Base::Fixed, MeshShapes::Mesh).await.unwrap();
    assert!(
        said(&spawned)[0].contains("the convex hull of the collision mesh of 100000 triangles"),
        "{spawned:?}"
    );
    daemon.pass(0.1).await;
    assert_eq!(daemon.client.robots().await.unwrap().len(), 6);
}

crate::over_every_transport! {
    a_load_report_says_what_a_mesh_became,
    a_ball_falls_into_what_is_open,
    starts_below_a_surface_are_reported,
    a_strict_load_refuses_unusable_meshes_and_parts,
    files_that_are_no_ground_are_a_sentence,
}
