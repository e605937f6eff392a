//! Each rule of security, tested by attempts to break it.

use std::path::{Path, PathBuf};

use simd_client::access::{Role, TOKEN_HEADER, TokenEntry, bearer, token, token_hash, write_tokens};
use simd_client::proto::ErrorReason;
use simd_client::{Client, ConnectOptions, Target, Token, joint_target};
use simd_proto::raw::RawCodec;
use simd_proto::{keys, methods};
use simd_server::config::{Config, TlsFiles};
use simd_server::daemon::{self, Running};
use simd_tests::process::soon;
use simd_world::access::role_of;
use tempfile::TempDir;
use tonic::codegen::http::uri::PathAndQuery;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Request, Status};
use zenoh::Wait as _;

/// A daemon that asks for tokens, over TLS or not, and the files that it has.
pub(crate) struct Guarded {
    pub(crate) running: Running,
    pub(crate) folder: TempDir,
}

/// Returns the token of this role.
pub(crate) fn of(role: Role) -> String {
    token(&[role as u8 + 1; 32])
}

/// Returns the token of another admin.
pub(crate) fn of_second() -> String {
    token(&[6; 32])
}

/// Returns the token for only the robot "arm".
pub(crate) fn of_arm() -> String {
    token(&[7; 32])
}

pub(crate) fn entry(name: &str, role: Role, token: &str, expires: Option<&str>) -> TokenEntry {
    let expires = expires.map(|time| time.parse().unwrap());
    TokenEntry { name: name.into(), role, hash: token_hash(token).unwrap(), expires, robots: Vec::new() }
}

/// A file that others cannot read.
pub(crate) fn write(path: &Path, text: &str) {
    std::fs::write(path, text).unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).unwrap();
    }
}

pub(crate) fn entries() -> Vec<TokenEntry> {
    let mut entries: Vec<_> =
        Role::ALL.into_iter().map(|role| entry(role.name(), role, &of(role), None)).collect();
    // An admin limited to one robot: the limit applies in every role.
    let of_arm = entry("of_arm", Role::Admin, &of_arm(), None);
    entries.push(TokenEntry { robots: vec!["arm".into()], ..of_arm });
    entries.push(entry("second", Role::Admin, &of_second(), None));
    entries.push(entry("late", Role::Admin, &token(&[9; 32]), Some("2020-01-01T00:00:00Z")));
    entries
}

/// Certificates as `simd tls init` makes them.
pub(crate) fn certificates(folder: &Path) -> TlsFiles {
    let arguments = ["simd", "tls", "init"].map(Into::into).into_iter().chain([folder.into()]);
    simd_server::authority::run(&arguments.collect::<Vec<_>>()).unwrap().unwrap();
    TlsFiles {
        certificate: folder.join("server.pem"),
        key: folder.join("server.key"),
        client_authorities: None,
    }
}

pub(crate) async fn guarded(change: impl FnOnce(&mut Config, &Path)) -> Guarded {
    let folder = TempDir::new().unwrap();
    let tokens = folder.path().join("tokens");
    write(&tokens, &write_tokens(&entries()));
    let zenoh = simd_server::config::Zenoh::on_free_port();
    let listen = std::net::SocketAddr::from(([127, 0, 0, 1], 0));
    let mut config = Config { listen, zenoh, tokens: Some(tokens), ..Config::default() };
    change(&mut config, folder.path());
    Guarded { running: daemon::start(config).await.unwrap(), folder }
}

pub(crate) fn options(token: Option<String>, tls_authorities: Option<PathBuf>) -> ConnectOptions {
    ConnectOptions { token: token.map(Token::from), tls_authorities, ..ConnectOptions::default() }
}

impl Guarded {
    pub(crate) fn grpc(&self) -> String {
        format!("{}://localhost:{}", self.running.scheme(), self.running.address.port())
    }

    pub(crate) fn authority(&self) -> PathBuf {
        self.folder.path().join("ca.pem")
    }

    pub(crate) async fn client(&self, token: &str) -> Client {
        Client::connect_with(&self.grpc(), options(Some(token.into()), Some(self.authority()))).await.unwrap()
    }

    pub(crate) fn rewrite(&self, entries: &[TokenEntry]) {
        // Another length, since a file system may have coarse times.
        write(&self.folder.path().join("tokens"), &format!("# again\n{}", write_tokens(entries)));
    }
}

/// Returns the daemon's status for a request without a body, by a method's path.
async fn call_grpc(running: &Running, path: &'static str, token: Option<&str>) -> Status {
    call_over(channel(running).await, path, token).await
}

pub(crate) async fn channel(running: &Running) -> Channel {
    Endpoint::from_shared(format!("http://{}", running.address)).unwrap().connect().await.unwrap()
}

pub(crate) async fn call_over(channel: Channel, path: &'static str, token: Option<&str>) -> Status {
    let mut grpc = tonic::client::Grpc::new(channel);
    grpc.ready().await.unwrap();
    let mut request = Request::new(tokio_stream::iter([bytes::Bytes::new()]));
    if let Some(token) = token {
        request.metadata_mut().insert(TOKEN_HEADER, bearer(token).parse().unwrap());
    }
    match grpc.streaming(request, PathAndQuery::from_static(path), RawCodec).await {
        Err(status) => status,
        Ok(mut answers) => match answers.get_mut().message().await {
            Err(status) => status,
            Ok(_) => Status::ok(""),
        },
    }
}

fn reason(status: &Status) -> String {
    use tonic_types::StatusExt as _;
    status.get_details_error_info().map(|info| info.reason).unwrap_or_default()
}

/// Streams without an immediate answer would block the test.
fn answers_at_once(method: &methods::Method) -> bool {
    !method.gives_many && !method.path.ends_with("/NextEvents") && !method.path.ends_with("/NextParameters")
}

#[tokio::test(flavor = "multi_thread")]
async fn each_method_asks_for_its_role() {
    let guarded = guarded(|config, _| config.driver.state = simd_world::handle::RunState::Paused).await;
    for (service, name, method) in methods::all() {
        for token in [None, Some("simd_1".to_owned()), Some(token(&[8; 32])), Some(token(&[9; 32]))] {
            let status = call_grpc(&guarded.running, &method.path, token.as_deref()).await;
            assert_eq!(status.code(), Code::Unauthenticated, "{} {token:?}: {status:?}", method.path);
            assert_eq!(reason(&status), "UNAUTHENTICATED");
        }
        for role in Role::ALL {
            let needed = role_of(service, name);
            if role >= needed && !answers_at_once(method) {
                continue;
            }
            let status = call_grpc(&guarded.running, &method.path, Some(&of(role))).await;
            let is_refused = reason(&status) == "ROLE_TOO_LOW";
            assert_eq!(is_refused, role < needed, "{} as {role}: {status:?}", method.path);
            assert_eq!(status.code() == Code::PermissionDenied, role < needed, "{}", method.path);
            assert_ne!(status.code(), Code::Unauthenticated, "{} as {role}", method.path);
        }
    }
}

/// Returns the attachment of a query.
fn headers(token: Option<&str>) -> Option<String> {
    token.map(|token| keys::attachment([(TOKEN_HEADER, bearer(token).as_str())]))
}

#[tokio::test(flavor = "multi_thread")]
async fn each_method_asks_for_its_role_over_zenoh_too() {
    let guarded = guarded(|config, _| config.driver.state = simd_world::handle::RunState::Paused).await;
    let mut settings = zenoh::Config::default();
    settings.insert_json5("mode", "\"client\"").unwrap();
    settings.insert_json5("connect/endpoints", &format!("[{:?}]", guarded.running.locators()[0])).unwrap();
    let session = zenoh::open(settings).await.unwrap();
    let ask = |service: &str, name: &str, token: Option<&str>| {
        let key = keys::rpc("simd", service, name);
        let replies = session.get(key).attachment(headers(token)).wait().unwrap();
        let reply = replies.recv().unwrap();
        match reply.into_result() {
            Ok(_answer) => String::new(),
            Err(error) => String::from_utf8_lossy(&error.payload().to_bytes()).into_owned(),
        }
    };
    // Wrong tokens slow down, so that not every method is asked with them.
    let mut wrong = [token(&[8; 32]), token(&[9; 32])].into_iter().map(Some);
    for (service, name, method) in methods::all() {
        let needed = role_of(service, name);
        for token in [None].into_iter().chain(wrong.next()) {
            let said = ask(service, name, token.as_deref());
            assert!(said.contains("UNAUTHENTICATED"), "{service}/{name} {token:?}: {said}");
        }
        for role in Role::ALL.into_iter().filter(|role| *role < needed || answers_at_once(method)) {
            let said = ask(service, name, Some(&of(role)));
            assert_eq!(said.contains("ROLE_TOO_LOW"), role < needed, "{service}/{name} as {role}: {said}");
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_learns_what_its_token_allows() {
    let until = "2999-01-01T00:00:00Z";
    let limited = token(&[10; 32]);
    let guarded = guarded(|_, folder| {
        let mut entries = entries();
        entries.push(entry("limited", Role::Viewer, &limited, Some(until)));
        write(&folder.join("tokens"), &write_tokens(&entries));
    })
    .await;
    for place in [guarded.grpc(), guarded.running.locators()[0].clone()] {
        for (token, name, role, expires) in [
            (of(Role::Operator), "operator", "operator", None),
            (limited.clone(), "limited", "viewer", Some(until)),
        ] {
            let client = Client::connect_with(&place, options(Some(token), None)).await.unwrap();
            let info = client.simulator_info().await.unwrap().token.unwrap();
            let until = info.expires.map(|time| time.to_string());
            assert_eq!((&*info.name, &*info.role, until.as_deref()), (name, role, expires), "{place}");
        }
    }
}

/// Publications have no answer: a viewer's are ignored, an operator's are applied.
#[tokio::test(flavor = "multi_thread")]
async fn published_targets_are_taken_from_operators_alone() {
    use prost::Message as _;
    let guarded = guarded(|_, _| {}).await;
    let admin = guarded.client(&of(Role::Admin)).await;
    crate::load_arm(&admin, "bench_arm").await;
    let mut settings = zenoh::Config::default();
    settings.insert_json5("mode", "\"client\"").unwrap();
    settings.insert_json5("connect/endpoints", &format!("[{:?}]", guarded.running.locators()[0])).unwrap();
    let session = zenoh::open(settings).await.unwrap();
    let publish = |position: f64, token: Option<&str>| {
        let robot =
            simd_client::robot_targets("bench_arm", [joint_target("shoulder", Target::position(position))]);
        let request =
            simd_client::proto::SetJointTargetsRequest { robots: vec![robot], ..Default::default() };
        let put = session.put(keys::joint_targets("simd"), request.encode_to_vec());
        put.attachment(headers(token)).wait().unwrap();
    };
    let target = async || {
        let joints = admin.read_joints(&simd_client::every_joint("bench_arm")).await.unwrap().joints;
        joints[0].target[0]
    };
    let before = target().await;
    for token in [None, Some(of(Role::Viewer)), Some(token(&[8; 32])), Some(token(&[9; 32]))] {
        publish(0.9, token.as_deref());
    }
    // They are taken in the order in which they come.
    publish(0.25, Some(&of(Role::Operator)));
    assert_ne!(before, 0.25);
    soon("the operator's target", async {
        loop {
            match target().await {
                0.25 => break,
                now => assert_eq!(now, before, "no other target is taken"),
            }
        }
    })
    .await;
}

/// The page's own files say nothing about the world. All else needs the token, in the header or in the
/// cookie.
#[tokio::test(flavor = "multi_thread")]
async fn a_browser_gets_the_page_and_nothing_else_without_a_token() {
    use simd_tests::http::{get, send};
    let guarded = guarded(|_, _| {}).await;
    let admin = guarded.client(&of(Role::Admin)).await;
    crate::load_arm(&admin, "arm").await;
    let address = guarded.running.address;
    assert_eq!(get(address, "/", &[]).await.status, 200);
    let hash = "0".repeat(64);
    for path in [
        "/robots".to_owned(),
        "/metrics".to_owned(),
        "/robots/arm/robot.urdf".to_owned(),
        format!("/meshes/{hash}.glb"),
        format!("/colliders/{hash}.glb"),
        format!("/assets/{hash}.stl"),
    ] {
        let status = async |headers: &[(&str, &str)]| get(address, &path, headers).await.status;
        assert_eq!(status(&[]).await, 401, "{path}");
        assert_eq!(status(&[("Cookie", "simd_token=simd_1")]).await, 401, "{path}");
        let cookie = format!("a=b; simd_token={}", of(Role::Viewer));
        assert_ne!(status(&[("Cookie", &cookie)]).await, 401, "{path}");
        assert_ne!(status(&[("Authorization", &bearer(&of(Role::Viewer)))]).await, 401, "{path}");
    }
    let log_in = async |token: &str, more: &[(&str, &str)]| {
        let said = bearer(token);
        let headers: Vec<_> = more.iter().copied().chain([("Authorization", said.as_str())]).collect();
        send(address, "POST", "/login", &headers, &[]).await
    };
    let taken = log_in(&of(Role::Operator), &[]).await;
    assert_eq!(taken.status, 204);
    for word in [&*of(Role::Operator), "HttpOnly", "SameSite=Strict"] {
        assert!(taken.header("set-cookie").contains(word), "{}", taken.header("set-cookie"));
    }
    // A browser would drop a secure cookie over plain HTTP.
    assert!(!taken.header("set-cookie").contains("Secure"), "{}", taken.header("set-cookie"));
    assert_eq!(log_in("simd_1", &[]).await.status, 401);
    assert_eq!(log_in(&token(&[9; 32]), &[]).await.status, 401, "it has expired");
    let foreign = log_in(&of(Role::Operator), &[("Origin", "http://elsewhere.example")]).await;
    assert_eq!(foreign.status, 403);
    let foreign = log_in(&of(Role::Operator), &[("Host", "elsewhere.example")]).await;
    assert_eq!(foreign.status, 403);
    assert!(send(address, "DELETE", "/login", &[], &[]).await.header("set-cookie").contains("Max-Age=0"));
}

/// Over gRPC and over Zenoh; publications too.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_for_some_robots_changes_no_other_and_not_the_world() {
    let guarded = guarded(|_, _| {}).await;
    let admin = Client::connect_with(&guarded.grpc(), options(Some(of(Role::Admin)), None)).await.unwrap();
    for robot in ["arm", "other"] {
        crate::load_arm(&admin, robot).await;
    }
    for endpoint in [guarded.grpc(), guarded.running.locators()[0].clone()] {
        let client = Client::connect_with(&endpoint, options(Some(of_arm()), None)).await.unwrap();
        assert_eq!(client.robots().await.unwrap().len(), 2, "it reads all");
        let target = || [joint_target("shoulder", Target::position(0.1))];
        client.set_robot_targets("arm", target()).await.unwrap();
        let mut control = client.control(simd_client::ControlOptions::default()).await.unwrap();
        control.exchange("arm", target()).await.unwrap().accepted().unwrap();
        let refusals = [
            ("targets", client.set_robot_targets("other", target()).await.map(drop)),
            ("a stream", control.exchange("other", target()).await.unwrap().accepted().map(drop)),
            ("a reset", client.reset_joints("other", Vec::new()).await.map(drop)),
            (
                "a claim",
                client
                    .claim_joints(
                        vec![simd_client::every_joint("other")],
                        "me",
                        std::time::Duration::from_secs(1),
                    )
                    .await
                    .map(drop),
            ),
            ("an end", client.delete_robot("other").await.map(drop)),
            ("a pause", client.pause().await.map(drop)),
            ("a saved state", client.save_state("mine").await.map(drop)),
            ("a lockstep", client.join_lockstep(std::time::Duration::from_secs(60)).await.map(drop)),
        ];
        for (what, outcome) in refusals {
            let refused = outcome.expect_err(what);
            assert_eq!(refused.reason(), Some(ErrorReason::RobotNotAllowed), "{what}: {refused}");
            assert!(refused.to_string().contains("the token is only for arm"), "{what}: {refused}");
        }
    }
    let states = admin.joint_states(vec![simd_client::every_joint("other")]).await.unwrap();
    assert_eq!(states.robots[0].target, [0.0]);
}
