//! Requests of a browser to the same port: the page, meshes, robots, and calls over gRPC-Web.

use std::collections::BTreeMap;

use prost::Message as _;
use simd_client::proto;
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::http::{Answer, get, send};
use simd_tests::robots::assets;

use crate::arm;

/// Returns a call of one message in gRPC-Web's framing.
async fn call(daemon: &Daemon, method: &str, message: &[u8], headers: &[(&str, &str)]) -> Answer {
    let length = u32::try_from(message.len()).unwrap().to_be_bytes();
    let body = [&[0], &length[..], message].concat();
    let headers = [&[("content-type", "application/grpc-web+proto"), ("x-grpc-web", "1")], headers].concat();
    send(daemon.address, "POST", &format!("/simd.v1.{method}"), &headers, &body).await
}

/// Returns the message and the trailers of an answer.
fn opened(answer: &Answer) -> (Vec<u8>, String) {
    let (mut message, mut trailers, mut rest) = (Vec::new(), String::new(), &answer.body[..]);
    while let [flag, a, b, c, d, after @ ..] = rest {
        let (frame, after) = after.split_at(u32::from_be_bytes([*a, *b, *c, *d]) as usize);
        if *flag == 0 {
            message = frame.to_vec()
        } else {
            trailers = String::from_utf8(frame.to_vec()).unwrap()
        }
        rest = after;
    }
    (message, trailers)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_browser_calls_every_service_over_http_1() {
    let daemon = arm(Via::Grpc).await;
    daemon.client.step(7).await.unwrap();
    let request = proto::NextJointStatesRequest { return_link_poses: true, ..Default::default() };
    let headers = [("simd-client", "viewer-1a2b"), ("simd-api-version", "1.0")];
    let answer = call(&daemon, "JointService/NextJointStates", &request.encode_to_vec(), &headers).await;
    assert_eq!((answer.status, answer.header("content-type")), (200, "application/grpc-web+proto"));
    let (message, trailers) = opened(&answer);
    let states = proto::NextJointStatesResponse::decode(&message[..]).unwrap();
    assert_eq!(states.states.unwrap().stamp.unwrap().step, 7);
    assert_eq!(states.link_poses.len(), 1);
    assert!(trailers.contains("grpc-status:0"), "{trailers}");

    let answer = call(&daemon, "ClientService/ListClients", &[], &headers).await;
    let listed = proto::ListClientsResponse::decode(&opened(&answer).0[..]).unwrap().clients;
    let page = listed.iter().find(|client| client.name == "viewer-1a2b").unwrap();
    assert_eq!((page.transport.as_str(), page.is_caller), ("grpc-web", true));

    // A refusal has its reason.
    let request = proto::GetJointLayoutRequest { robot: "missing".into() };
    let answer = call(&daemon, "JointService/GetJointLayout", &request.encode_to_vec(), &headers).await;
    let said = format!("{} {:?}", opened(&answer).1, answer.headers);
    assert!(said.contains("grpc-status") && said.contains("grpc-message"), "{said}");
    let answer = call(&daemon, "NoService/Call", &[], &headers).await;
    assert_eq!(answer.header("grpc-status"), "12", "{answer:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn other_sites_are_refused_with_a_sentence() {
    let daemon = arm(Via::Grpc).await;
    let own = format!("http://{}", daemon.address);
    for (headers, status) in [
        (vec![("Origin", own.as_str())], 200),
        (vec![("Host", "localhost:1")], 200),
        (vec![("Host", "evil.example")], 403),
        (vec![("Origin", "http://evil.example")], 403),
        (vec![("Origin", "null")], 403),
    ] {
        for path in ["/", "/robots", "/nothing"] {
            let answer = get(daemon.address, path, &headers).await;
            let found = if path == "/nothing" && status == 200 { 404 } else { status };
            assert_eq!(answer.status, found, "{path} {headers:?}");
            assert!(answer.status != 403 || answer.text().ends_with('\n'), "{answer:?}");
        }
        let answer = call(&daemon, "SimulationService/GetPhysics", &[], &headers).await;
        assert_eq!(answer.status, status, "{headers:?}");
    }
    // A preflight is a question of another site.
    let asks = [("Origin", "http://evil.example"), ("Access-Control-Request-Method", "POST")];
    let path = "/simd.v1.SimulationService/GetPhysics";
    let answer = send(daemon.address, "OPTIONS", path, &asks, &[]).await;
    assert_eq!(answer.status, 403);
    assert!(answer.headers.keys().all(|name| !name.starts_with("access-control")), "{answer:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_name_that_the_operator_allowed_is_served() {
    let daemon = Daemon::start(|config| config.allow_hosts = vec!["lab.example".into()]).await;
    assert_eq!(get(daemon.address, "/robots", &[("Host", "Lab.Example:80")]).await.status, 200);
    assert_eq!(get(daemon.address, "/robots", &[("Host", "lab.example.evil")]).await.status, 403);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_page_is_framed_by_the_sites_that_the_operator_named_and_by_no_other() {
    let daemon = Daemon::start(|config| config.frame_ancestors = vec!["https://lab.example".into()]).await;
    let policy = get(daemon.address, "/", &[]).await.header("content-security-policy").to_owned();
    assert!(policy.ends_with("frame-ancestors 'self' https://lab.example"), "{policy}");
    assert!(policy.starts_with("default-src 'self';") && !policy.contains("unsafe"), "{policy}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_answer_tells_the_browser_to_keep_to_this_daemon() {
    let daemon = arm(Via::Grpc).await;
    for path in ["/", "/robots", "/nothing", "/assets/none.js", "/robots/arm/robot.urdf"] {
        let answer = get(daemon.address, path, &[]).await;
        let policy = answer.header("content-security-policy");
        assert!(
            policy.starts_with("default-src 'self';") || policy.starts_with("default-src 'none';"),
            "{policy}"
        );
        assert!(policy.contains("frame-ancestors 'none'") && !policy.contains("unsafe"), "{policy}");
        assert_eq!(answer.header("x-content-type-options"), "nosniff");
        assert_eq!(answer.header("referrer-policy"), "no-referrer");
        assert_eq!(answer.header("cross-origin-opener-policy"), "same-origin");
        assert_eq!(answer.header("cross-origin-resource-policy"), "same-origin");
        assert!(answer.headers.keys().all(|name| !name.starts_with("access-control")));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_page_is_there_and_what_it_names_too() {
    let daemon = arm(Via::Grpc).await;
    let page = get(daemon.address, "/", &[]).await;
    assert_eq!((page.status, page.header("content-type")), (200, "text/html; charset=utf-8"));
    assert_eq!(page.header("cache-control"), "no-cache");
    let text = page.text();
    assert!(!text.contains("\"http"), "nothing from elsewhere: {text}");
    let names = text.split('"').filter(|word| word.starts_with('/') && word.contains('.'));
    let mut found = 0;
    for name in names {
        let file = get(daemon.address, name, &[]).await;
        assert_eq!(file.status, 200, "{name}");
        found += 1;
    }
    assert!(found >= 2, "{text}");
    // Unchanged is not sent again.
    let tag = page.header("etag").to_owned();
    let again = get(daemon.address, "/", &[("If-None-Match", &tag)]).await;
    assert_eq!((again.status, again.body.len()), (304, 0));
    assert_eq!(send(daemon.address, "HEAD", "/", &[], &[]).await.body.len(), 0);
    assert_eq!(send(daemon.address, "POST", "/", &[], &[]).await.status, 404);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_path_leads_to_a_disk() {
    let daemon = arm(Via::Grpc).await;
    let hash = "0".repeat(64);
    for path in [
        "/assets/../../etc/passwd",
        "/assets/..%2f..%2fetc%2fpasswd",
        "/assets/%2e%2e/%2e%2e/etc/passwd",
        "/assets//etc/passwd",
        "/assets/%2fetc%2fpasswd",
        "/../etc/passwd",
        "/%2e%2e/etc/passwd",
        "/etc/passwd",
        "/Cargo.toml",
        "/robots/..%2f..%2fetc/robot.urdf",
        "/robots/missing/robot.urdf",
        "/robots/arm/../../etc/passwd",
        "/meshes/../assets/x.glb",
        "/meshes/x.glb",
        &format!("/meshes/{hash}.glb"),
        &format!("/meshes/{hash}"),
        &format!("/assets/{hash}.stl"),
        &format!("/assets/{hash}/../../x"),
        "/assets/%00",
        "/assets/%ff",
    ] {
        let answer = get(daemon.address, path, &[]).await;
        assert!([400, 404].contains(&answer.status), "{path}: {answer:?}");
        assert!(!answer.text().contains("root:"), "{path}");
    }
}

/// Returns a number of the JSON by names and indices.
fn number(json: &serde_json::Value, path: &str) -> u64 {
    json.pointer(path).and_then(serde_json::Value::as_u64).unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn meshes_of_the_scene_are_there_as_gltf_and_as_they_were_sent() {
    let daemon = arm(Via::Grpc).await;
    let scene = daemon.client.scene(&["arm"]).await.unwrap();
    let mut seen = 0;
    for shape in &scene.robots[0].visuals {
        let Some(proto::shape::Geometry::Mesh(mesh)) = &shape.geometry else { continue };
        let file = daemon.client.asset(&mesh.sha256).await.unwrap();
        let sent = get(daemon.address, &format!("/assets/{}.stl", mesh.sha256), &[]).await;
        assert_eq!((sent.status, sent.header("content-type")), (200, "model/stl"));
        assert_eq!(sent.body, file);
        assert!(sent.header("cache-control").contains("immutable"));
        assert!(sent.header("content-security-policy").contains("sandbox"));

        let path = format!("/meshes/{}.glb", mesh.sha256);
        let glb = get(daemon.address, &path, &[]).await;
        assert_eq!((glb.status, glb.header("content-type")), (200, "model/gltf-binary"));
        assert!(glb.header("cache-control").contains("immutable"));
        let word = |at: usize| u32::from_le_bytes(glb.body[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&glb.body[..4], word(4), word(8)), (&b"glTF"[..], 2, glb.body.len()));
        let json: serde_json::Value = serde_json::from_slice(&glb.body[20..20 + word(12)]).unwrap();
        // Binary STL: the count of triangles is after 80 bytes of header.
        let triangles = u64::from(u32::from_le_bytes(file[80..84].try_into().unwrap()));
        assert_eq!(number(&json, "/accessors/2/count"), 3 * triangles);
        assert_eq!(number(&json, "/buffers/0/byteLength") as usize, glb.body.len() - 28 - word(12));

        let packed = get(daemon.address, &path, &[("Accept-Encoding", "gzip")]).await;
        assert!(packed.header("content-encoding") == "gzip" || packed.body == glb.body);
        let known = get(daemon.address, &path, &[("If-None-Match", glb.header("etag"))]).await;
        assert_eq!((known.status, known.body.len()), (304, 0));
        seen += 1;
    }
    assert!(seen > 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn convex_colliders_of_the_scene_are_there_as_gltf() {
    let daemon = arm(Via::Grpc).await;
    let scene = daemon.client.scene(&["arm"]).await.unwrap();
    let mut seen = 0;
    for shape in &scene.robots[0].colliders {
        let Some(proto::shape::Geometry::Convex(convex)) = &shape.geometry else { continue };
        let path = format!("/colliders/{}.glb", convex.sha256);
        let glb = get(daemon.address, &path, &[]).await;
        assert_eq!((glb.status, glb.header("content-type")), (200, "model/gltf-binary"));
        assert!(glb.header("cache-control").contains("immutable"));
        assert_eq!(&glb.body[..4], b"glTF");
        let known = get(daemon.address, &path, &[("If-None-Match", glb.header("etag"))]).await;
        assert_eq!((known.status, known.body.len()), (304, 0));
        seen += 1;
    }
    assert!(seen > 0, "{:?}", scene.robots[0].colliders);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn robots_from_the_daemons_own_disk_have_their_meshes_too() {
    let root = assets().join("Bench_Arm-1.2 rev B");
    let daemon = Daemon::start(|config| config.asset_roots = vec![root.clone()]).await;
    daemon.client.load_on_daemon(&root.display().to_string(), fixed("arm")).await.unwrap();
    let scene = daemon.client.scene(&["arm"]).await.unwrap();
    let meshes = scene.robots[0].visuals.iter().filter_map(|shape| match &shape.geometry {
        Some(proto::shape::Geometry::Mesh(mesh)) => Some(mesh.sha256.clone()),
        _ => None,
    });
    let mut seen = 0;
    for sha256 in meshes {
        for path in [format!("/assets/{sha256}.stl"), format!("/meshes/{sha256}.glb")] {
            assert_eq!(get(daemon.address, &path, &[]).await.status, 200, "{path}");
            seen += 1;
        }
    }
    assert!(seen > 0);
}

/// simd itself reads the description that tools get, as the same robot.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_urdf_loads_again_with_meshes_from_their_addresses() {
    let daemon = arm(Via::Grpc).await;
    let answer = get(daemon.address, "/robots/arm/robot.urdf", &[]).await;
    assert_eq!((answer.status, answer.header("content-type")), (200, "application/xml; charset=utf-8"));
    let text = answer.text();
    let uris = simd_model::describe(text.as_bytes(), &Default::default()).unwrap().asset_uris;
    assert!(!uris.is_empty());
    let mut files = BTreeMap::new();
    for uri in uris {
        assert!(uri.starts_with("/assets/") && uri.ends_with(".stl"), "{uri}");
        let file = get(daemon.address, &uri, &[]).await;
        assert_eq!(file.status, 200, "{uri}");
        let name = uri.trim_start_matches('/').to_owned();
        files.insert(uri, (name, file.body));
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("assets")).unwrap();
    let mut local = text;
    for (uri, (name, bytes)) in files {
        std::fs::write(folder.path().join(&name), bytes).unwrap();
        local = local.replace(&uri, &name);
    }
    std::fs::write(folder.path().join("robot.urdf"), local).unwrap();
    daemon.client.load(folder.path().join("robot.urdf"), fixed("again")).await.unwrap();
    let [one, two] = ["arm", "again"].map(|name| name.to_owned());
    let (one, two) =
        (daemon.client.robot_info(&one).await.unwrap(), daemon.client.robot_info(&two).await.unwrap());
    assert_eq!((one.mass, one.links), (two.mass, two.links));
    let scenes = daemon.client.scene(&[]).await.unwrap().robots;
    let hashes = |scene: &proto::RobotScene| -> Vec<String> {
        let shapes = scene.visuals.iter().chain(&scene.collisions);
        let mesh = |shape: &proto::Shape| match &shape.geometry {
            Some(proto::shape::Geometry::Mesh(mesh)) => Some(mesh.sha256.clone()),
            _ => None,
        };
        shapes.filter_map(mesh).collect()
    };
    assert_eq!(hashes(&scenes[0]), hashes(&scenes[1]));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn robots_are_there_as_json() {
    let daemon = arm(Via::Grpc).await;
    daemon.client.step(3).await.unwrap();
    let answer = get(daemon.address, "/robots", &[]).await;
    assert_eq!((answer.status, answer.header("content-type")), (200, "application/json"));
    let world: serde_json::Value = serde_json::from_slice(&answer.body).unwrap();
    assert_eq!(world["state"], "paused");
    assert_eq!(world["step"], 3);
    let joint = &world["robots"][0]["joints"][0];
    assert_eq!((&world["robots"][0]["name"], &joint["name"]), (&"arm".into(), &"shoulder".into()));
    assert_eq!(joint["mode"], serde_json::json!(["hold"]));
    let states = daemon.client.joint_states(Vec::new()).await.unwrap();
    // serde_json reads the last bit of a number as it likes.
    for (name, value) in [("position", states.robots[0].position[0]), ("effort", states.robots[0].effort[0])]
    {
        let said = joint[name][0].as_f64().unwrap();
        assert!((said - value).abs() <= 1e-15 * value.abs(), "{name}: {said} {value}");
    }
}
