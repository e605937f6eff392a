//! Meshes of robots in memory.

use super::*;

/// Uploads a mesh, and spawns a robot that uses it.
async fn with_mesh(handle: &SimHandle, name: &str, mesh: Vec<u8>) -> Result<(), CallError> {
    let mesh = Bytes::from(mesh);
    let (sha256, total) = (Sha256::of(&mesh), mesh.len() as u64);
    handle.upload(FilePart { sha256, total, offset: 0, data: mesh }).await?;
    let urdf = format!(
        "<robot name=\"{name}\"><link name=\"base\"><collision><geometry><mesh filename=\"a.stl\"/></geometry>\
         </collision></link></robot>"
    );
    let assets = BTreeMap::from([("a.stl".to_owned(), sha256)]);
    let source = Source::Inline { urdf: urdf.into(), assets, missing: BTreeMap::new() };
    handle.spawn(request(source)).await.map(drop)
}

#[tokio::test]
async fn robots_with_the_same_mesh_share_it_in_memory() {
    let handle = daemon(DaemonLimits::default(), &[]);
    for name in ["a", "b"] {
        with_mesh(&handle, name, stl(1.0)).await.unwrap();
    }
    let newest = handle.newest();
    let asset = |name: &str| {
        let (_, entity) = newest.state.entity(name).unwrap();
        match &entity.model.links[0].collisions[0].geometry {
            simd_model::robot::Geometry::Mesh { asset, .. } => asset.clone().unwrap(),
            other => panic!("{other:?}"),
        }
    };
    assert!(Arc::ptr_eq(&asset("a"), &asset("b")));
}

#[tokio::test]
async fn meshes_of_all_robots_together_stay_within_a_limit() {
    let limits = DaemonLimits { decoded_bytes: 2_000, ..DaemonLimits::default() };
    let handle = daemon(limits, &[]);
    let mut loaded: u8 = 0;
    let refused = loop {
        match with_mesh(&handle, &format!("robot-{loaded}"), stl(f32::from(loaded) + 1.0)).await {
            Ok(()) => loaded += 1,
            Err(refused) => break refused,
        }
    };
    // A triangle has three corners of three numbers and three indices, and a box replaces it.
    assert!((2..20).contains(&loaded), "{loaded}");
    assert!(matches!(refused, CallError::LimitExceeded { limit: 2_000, value: 2_001.., .. }), "{refused}");
    assert!(handle.newest().state.entity(&format!("robot-{loaded}")).is_none());
    with_mesh(&handle, "same", stl(1.0)).await.unwrap();
}

/// Each scale is a separate surface, whose neighbours and tree take more memory than the mesh.
#[tokio::test]
async fn surfaces_made_of_one_mesh_in_many_scales_count_too() {
    let limits = DaemonLimits { decoded_bytes: 2_000, ..DaemonLimits::default() };
    let handle = daemon(limits, &[]);
    let spawn = async |name: &str, scale: f64| {
        let mesh = Bytes::from(stl(1.0));
        let (sha256, total) = (Sha256::of(&mesh), mesh.len() as u64);
        handle.upload(FilePart { sha256, total, offset: 0, data: mesh }).await?;
        let urdf = format!(
            "<robot name=\"{name}\"><link name=\"world\"><collision><geometry><mesh filename=\"a.stl\" \
             scale=\"{scale} 1 1\"/></geometry></collision></link></robot>"
        );
        let assets = BTreeMap::from([("a.stl".to_owned(), sha256)]);
        let source = Source::Inline { urdf: urdf.into(), assets, missing: BTreeMap::new() };
        handle.spawn(request(source)).await.map(drop)
    };
    spawn("first", 1.0).await.unwrap();
    for again in 0..3 {
        spawn(&format!("again-{again}"), 1.0).await.unwrap();
    }
    let mut scales = 0;
    let refused = loop {
        match spawn(&format!("scale-{scales}"), 2.0 + f64::from(scales)).await {
            Ok(()) => scales += 1,
            Err(refused) => break refused,
        }
    };
    assert!((1..10).contains(&scales), "{scales}");
    assert!(refused.to_string().contains("the size of all robots' meshes in memory"), "{refused}");
}

#[tokio::test]
async fn meshes_of_robots_that_are_gone_make_room() {
    let limits = DaemonLimits { decoded_bytes: 2_000, ..DaemonLimits::default() };
    let handle = daemon(limits, &[]);
    let mut loaded: u8 = 0;
    while with_mesh(&handle, &format!("robot-{loaded}"), stl(f32::from(loaded) + 1.0)).await.is_ok() {
        loaded += 1;
    }
    handle.command(Command::Delete { robot: "robot-0".into() }).await.unwrap();
    // Overwrites earlier states, which still show the robot.
    handle.step(100).await.unwrap();
    with_mesh(&handle, "another", stl(f32::from(loaded) + 1.0)).await.unwrap();
}
