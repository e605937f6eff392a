//! The front-end without a network: requests to the routes, and their answers.

use std::collections::BTreeSet;

use axum::http::HeaderMap;
use glamx::{DPose3, DVec3};
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::WorldLimits;
use simd_core::{Command, PhysicsSettings, Simulation};
use simd_model::robot::{Collision, Geometry, Material, MeshAsset, Sha256};
use simd_proto::v1;
use tonic::codegen::Service as _;
use tonic::service::Routes;

use super::*;
use simd_api::convert::test_world::spawn;
use simd_api::convert::to_proto;
use simd_world::account::Account;
use simd_world::blocking_threads::BlockingThreads;
use simd_world::driver;
use simd_world::handle::testing::{crowd, waits};
use simd_world::handle::{DaemonInfo, DaemonLimits, Peer, RunState, Transport};
use simd_world::loading::Loader;

/// Returns the routes of a daemon with `arm`, as in a build without the viewer.
async fn routes() -> Router {
    beside_a_world(spawn("arm", &[])).await.0
}

async fn beside_a_world(spawn: Command) -> (Router, SimHandle) {
    within(DaemonLimits::default(), spawn).await
}

async fn within(limits: DaemonLimits, spawn: Command) -> (Router, SimHandle) {
    let world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    let driver =
        driver::start(world, driver::Config { state: RunState::Paused, ..Default::default() }).unwrap();
    let info = DaemonInfo { name: "test".into(), version: "0.0.0", limits };
    let handle = SimHandle::new(
        driver,
        Loader::new(limits, &[], BlockingThreads::computing().unwrap()).unwrap(),
        info,
    );
    handle.command(spawn).await.unwrap();
    let services: Routes = simd_api::service::routes(&handle, Transport::Grpc);
    let settings = Settings { bundle: Bundle::fallback(), ..Settings::default() };
    (beside(services.into_axum_router(), &handle, settings), handle)
}

async fn get(routes: &mut Router, path: &str) -> (StatusCode, HeaderMap, String) {
    let (status, headers, bytes) = get_bytes(routes, path).await;
    (status, headers, String::from_utf8(bytes).unwrap())
}

async fn get_bytes(routes: &mut Router, path: &str) -> (StatusCode, HeaderMap, Vec<u8>) {
    let request = Request::builder().uri(path).header(header::HOST, "localhost").body(Body::empty()).unwrap();
    let response = routes.call(request).await.unwrap();
    let (parts, body) = response.into_parts();
    let bytes = axum::body::to_bytes(body, 1 << 20).await.unwrap();
    (parts.status, parts.headers, bytes.to_vec())
}

/// Sends a request over a connection of this machine.
async fn get_over(mut routes: Router, path: String, number: u64) -> (StatusCode, String) {
    let peer = Peer::Connection { number, address: std::net::Ipv4Addr::LOCALHOST.into() };
    let request = Request::builder().uri(path).header(header::HOST, "localhost").extension(peer);
    let response = routes.call(request.body(Body::empty()).unwrap()).await.unwrap();
    let status = response.status();
    let bytes = axum::body::to_bytes(response.into_body(), 1 << 20).await.unwrap();
    (status, String::from_utf8_lossy(&bytes).into_owned())
}

#[tokio::test]
async fn without_the_viewer_a_page_has_the_tables_and_says_how_to_get_it() {
    let mut routes = routes().await;
    let (status, headers, page) = get(&mut routes, "/").await;
    assert_eq!(
        (status, &headers[header::CONTENT_TYPE]),
        (StatusCode::OK, &"text/html; charset=utf-8".parse().unwrap())
    );
    assert!(page.contains("make build") && page.contains("Node"), "{page}");
    // The page has nothing that the policy forbids.
    assert!(!page.contains("<style") && !page.contains("style=") && !page.contains("onclick"), "{page}");
    assert!(page.split("<script").skip(1).all(|script| script.contains("src=")), "{page}");
    for path in ["/style.css", "/page.js", "/robots"] {
        assert!(page.contains(&format!("\"{path}\"")), "{path}");
        assert_eq!(get(&mut routes, path).await.0, StatusCode::OK, "{path}");
    }
    assert!(get(&mut routes, "/page.js").await.2.contains("\"/robots\""));
}

#[tokio::test]
async fn a_robot_whose_description_is_not_kept_has_none() {
    let mut routes = routes().await;
    let (status, _, sentence) = get(&mut routes, "/robots/arm/robot.urdf").await;
    assert_eq!(status, StatusCode::NOT_FOUND);
    assert!(sentence.contains("no longer kept"), "{sentence}");
}

/// Returns two boxes of a metre, two metres apart, as one mesh.
fn two_boxes() -> Arc<MeshAsset> {
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2 & 1].map(f64::from);
    let sides: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let of_box = |first: u32| {
        let halves = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
        halves.map(move |triangle| triangle.map(|corner| first + corner))
    };
    let vertices =
        (0..16).map(|i| DVec3::from_array(corner(i % 8)) + DVec3::X * if i < 8 { 0.0 } else { 3.0 });
    let triangles = of_box(0).chain(of_box(8)).collect();
    Arc::new(MeshAsset {
        sha256: Sha256::of(b"boxes"),
        vertices: vertices.collect(),
        triangles,
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    })
}

/// Returns a spawn of `arm` with that mesh on its first link.
fn spawn_with_a_mesh(meshes: MeshShapes) -> Command {
    let Command::Spawn(mut spawn) = spawn("arm", &[]) else { panic!("it is not a spawn") };
    let mut model = (*spawn.model).clone();
    model.links[0].collisions = vec![Collision {
        link_from_shape: DPose3::IDENTITY,
        geometry: Geometry::Mesh { uri: "boxes.stl".into(), scale: DVec3::ONE, asset: Some(two_boxes()) },
        material: Material::default(),
    }];
    spawn.shapes = Arc::new(Shapes::reusing(&model, false, meshes, &[]));
    spawn.model = Arc::new(model);
    Command::Spawn(spawn)
}

/// Returns the corners of a mesh that [`glb::write`] wrote, which are first in the binary chunk, as sorted
/// bits.
fn corners(glb: &[u8]) -> BTreeSet<[u32; 3]> {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap());
    let json = word(12) as usize;
    let said: serde_json::Value = serde_json::from_slice(&glb[20..20 + json]).unwrap();
    let count = said["accessors"][0]["count"].as_u64().unwrap() as usize;
    (0..count).map(|n| [0, 1, 2].map(|axis| word(28 + json + 12 * n + 4 * axis))).collect()
}

/// The hull is one box of four metres, its parts are the two boxes.
#[tokio::test]
async fn convex_colliders_of_the_scene_are_those_that_the_physics_touches_with() {
    for (meshes, count) in [(MeshShapes::Hull, 1), (MeshShapes::Decomposition, 2)] {
        let (mut routes, handle) = beside_a_world(spawn_with_a_mesh(meshes)).await;
        let newest = handle.newest();
        let (_, robot) = newest.state.entity("arm").unwrap();
        let scene = to_proto::scene::robot_scene(robot);
        assert!(matches!(scene.collisions[0].geometry, Some(v1::shape::Geometry::Mesh(_))));
        assert!(scene.colliders.len() >= count, "{:?}", scene.colliders);
        for shape in &scene.colliders {
            let Some(v1::shape::Geometry::Convex(convex)) = &shape.geometry else { panic!("{shape:?}") };
            let path = format!("/colliders/{}.glb", convex.sha256);
            let (status, headers, glb) = get_bytes(&mut routes, &path).await;
            assert_eq!(
                (status, headers[header::CONTENT_TYPE].as_bytes()),
                (StatusCode::OK, &b"model/gltf-binary"[..])
            );
            let touches = robot.shapes.convex_mesh(&Sha256::parse(&convex.sha256).unwrap()).unwrap();
            let touches =
                touches.vertices.iter().map(|vertex| vertex.to_array().map(|x| (x as f32).to_bits()));
            assert_eq!(corners(&glb), touches.collect(), "{meshes:?}");
            let (status, _, sentence) = get(&mut routes, &path.replace("colliders", "meshes")).await;
            assert_eq!(
                (status, sentence.as_str()),
                (StatusCode::NOT_FOUND, "no robot uses a mesh of this hash\n")
            );
        }
    }
}

#[tokio::test]
async fn a_collider_that_no_robot_has_is_not_found() {
    let mut routes = routes().await;
    let unknown = format!("/colliders/{}.glb", Sha256::of(b"none"));
    assert_eq!(get(&mut routes, &unknown).await.2, "no robot has a convex collider of this hash\n");
    let sentence = "the address of a collider is /colliders/SHA256.glb\n";
    for path in ["/colliders/x.glb", "/colliders/.glb", "/colliders/..%2f..%2fetc%2fpasswd"] {
        let (status, _, said) = get(&mut routes, path).await;
        assert_eq!((status, said.as_str()), (StatusCode::NOT_FOUND, sentence), "{path}");
    }
}

#[tokio::test]
async fn requests_of_a_page_wait_like_calls_of_its_client() {
    let (routes, handle) = beside_a_world(spawn_with_a_mesh(MeshShapes::Hull)).await;
    let newest = handle.newest();
    let (_, robot) = newest.state.entity("arm").unwrap();
    let scene = to_proto::scene::robot_scene(robot);
    let Some(v1::shape::Geometry::Convex(convex)) = &scene.colliders[0].geometry else { panic!("{scene:?}") };
    let path = format!("/colliders/{}.glb", convex.sha256);
    let crowd = crowd(&handle, &Account::Connection(1)).await;
    let (status, sentence) = get_over(routes.clone(), path.clone(), 1).await;
    assert_eq!(status, StatusCode::SERVICE_UNAVAILABLE);
    assert!(sentence.contains("of one client would be 33, and the limit is 32"), "{sentence}");
    let mut other = Box::pin(get_over(routes, path, 2));
    waits(other.as_mut()).await;
    drop(crowd);
    assert_eq!(other.await.0, StatusCode::OK);
}

#[tokio::test(start_paused = true)]
async fn requests_beyond_what_a_client_may_ask_in_a_second_are_refused() {
    let limits = DaemonLimits { calls_per_second_of_client: 2, ..DaemonLimits::default() };
    let (routes, _handle) = within(limits, spawn("arm", &[])).await;
    let file = format!("/assets/{}.stl", Sha256::of(b"none"));
    let get = |path: &str, number| get_over(routes.clone(), path.to_owned(), number);
    assert_eq!(get("/robots", 1).await.0, StatusCode::OK);
    assert_eq!(get(&file, 1).await.0, StatusCode::NOT_FOUND);
    for path in ["/robots", "/metrics", file.as_str()] {
        let (status, sentence) = get(path, 1).await;
        assert_eq!(status, StatusCode::SERVICE_UNAVAILABLE, "{path}");
        let expected = "calls a second by connection 1 would be 3, and the limit is 2";
        assert!(sentence.contains(expected), "{path}: {sentence}");
    }
    assert_eq!(get("/page.js", 1).await.0, StatusCode::OK, "the page's own files are not calls");
    assert_eq!(get("/robots", 2).await.0, StatusCode::OK, "another has a share of its own");
}

#[tokio::test]
async fn the_port_says_where_zenoh_is_without_settings_and_within_a_bound() {
    let (routes, handle) = beside_a_world(spawn("arm", &[])).await;
    drop(routes);
    let mut listen = vec!["tls/127.0.0.1:7447#root_ca_certificate=/etc/secret.pem".to_owned()];
    listen.extend((0..100).map(|port| format!("tcp/127.0.0.1:{port}?prio=6-7")));
    let zenoh = ZenohWays { routers: listen.clone(), listen };
    let settings = Settings { bundle: Bundle::fallback(), zenoh, ..Settings::default() };
    let services: Routes = simd_api::service::routes(&handle, Transport::Grpc);
    let mut routes = beside(services.into_axum_router(), &handle, settings);
    let (status, _, text) = get(&mut routes, "/.well-known/simd.json").await;
    assert_eq!(status, StatusCode::OK);
    assert!(
        text.starts_with(
            r#"{"name":"test","version":"0.0.0","zenoh":["tls/127.0.0.1:7447","tcp/127.0.0.1:0","#
        ),
        "{text}"
    );
    assert!(!text.contains("secret") && !text.contains("prio") && text.len() < 2_000, "{text}");
}
