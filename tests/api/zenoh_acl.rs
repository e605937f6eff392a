//! A Zenoh router with the output of `simd zenoh-acl` limits each session to its role.

use prost::Message;
use simd_client::proto::SetJointTargetsRequest;
use simd_client::{Client, ConnectOptions, Network, every_joint};
use simd_proto::keys;
use simd_server::config::{Config, Zenoh};
use simd_tests::network;
use simd_tests::process::soon;

use crate::load_arm;
use crate::zenoh_untrusted::position;

/// A free port.
const ANY: &str = "tcp/127.0.0.1:0";

/// Returns the output of `simd zenoh-acl` for these names. The daemon is known by the id of its session
/// instead of a certificate, and any session belongs to `everybody`.
fn access_control(arguments: &[&str], everybody: &str) -> String {
    let arguments: Vec<_> = ["simd", "zenoh-acl"].iter().chain(arguments).map(Into::into).collect();
    let said = simd_server::zenoh_acl::run(&arguments).unwrap().unwrap();
    let mut settings: serde_json::Value = serde_json::from_str(&said).unwrap();
    for subject in settings["access_control"]["subjects"].as_array_mut().unwrap() {
        let subject = subject.as_object_mut().unwrap();
        if subject["id"] == everybody || subject["id"] == "daemons" {
            subject.remove("cert_common_names");
        }
        if subject["id"] == "daemons" {
            subject.insert("zids".into(), serde_json::json!(["d1"]));
        }
    }
    settings["access_control"].to_string()
}

/// Returns a daemon with the session `d1` at a router.
async fn daemon_behind(router: &network::Router, folder: &std::path::Path) -> simd_server::daemon::Running {
    let file = folder.join("zenoh.json5");
    std::fs::write(&file, r#"{ id: "d1" }"#).unwrap();
    let zenoh = Zenoh { connect: vec![router.locator.clone()], file: Some(file), ..Zenoh::default() };
    let config = Config { listen: ([127, 0, 0, 1], 0).into(), zenoh, ..Default::default() };
    simd_server::daemon::start(config).await.unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_router_lets_viewers_read_and_nothing_else() {
    let rules = access_control(&["--viewer", "viewer"], "viewers");
    let router = network::Router::start_with(ANY, &[("access_control", &rules)]).await;
    let folder = tempfile::tempdir().unwrap();
    let daemon = daemon_behind(&router, folder.path()).await;
    let admin = Client::connect(&daemon.address.to_string()).await.unwrap();
    load_arm(&admin, "arm").await;

    let viewer =
        Client::connect(&router.locator).await.unwrap().with_timeout(std::time::Duration::from_secs(1));
    assert_eq!(viewer.robots().await.unwrap()[0].name, "arm");
    let published = network::session("client", &router.locator).await;
    let states = published.declare_subscriber("simd/simd/joint_states/arm").await.unwrap();
    soon("a state", states.recv_async()).await.unwrap();
    // No call, and no publication, reaches the daemon that changes something.
    viewer.delete_robot("arm").await.unwrap_err();
    viewer
        .set_targets(SetJointTargetsRequest { robots: position("arm", 0.25), ..Default::default() })
        .await
        .unwrap_err();
    let target = SetJointTargetsRequest { robots: position("arm", 0.5), ..Default::default() };
    published.put(keys::joint_targets("simd"), target.encode_to_vec()).await.unwrap();
    // Both take the same path in order: this one arrives after it.
    viewer.robots().await.unwrap();
    soon("two more states", async {
        for _ in 0..2 {
            states.recv_async().await.unwrap();
        }
    })
    .await;
    assert_eq!(admin.joint_states(vec![every_joint("arm")]).await.unwrap().robots[0].target[0], 0.0);
    daemon.drain().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_routers_access_control_holds_clients_to_their_part() {
    let rules = access_control(&[], "clients");
    let router = network::Router::start_with(ANY, &[("access_control", &rules)]).await;
    let folder = tempfile::tempdir().unwrap();
    let daemon = daemon_behind(&router, folder.path()).await;
    let client = Client::connect(&router.locator).await.unwrap();
    load_arm(&client, "arm").await;

    // Forbidden to an untrusted session: answering queries, appearing as a daemon, publishing states, reading
    // what others send.
    let untrusted = network::session("client", &router.locator).await;
    let (asked, mut questions) = tokio::sync::mpsc::unbounded_channel();
    let heard = asked.clone();
    let queryable = untrusted.declare_queryable("simd/**").callback(move |query| {
        let _ = asked.send(query.key_expr().to_string());
    });
    queryable.background().await.unwrap();
    let reading = untrusted.declare_subscriber("simd/*/joint_targets").callback(move |sample| {
        let _ = heard.send(sample.key_expr().to_string());
    });
    reading.background().await.unwrap();
    let zid = untrusted.zid().to_string();
    let _token = untrusted.liveliness().declare_token(keys::daemon("simd", &zid)).await.unwrap();
    untrusted.put("simd/simd/joint_states/arm", "forged").await.unwrap();

    // A client's calls continue, and only the daemon receives them.
    let states = network::session("client", &router.locator).await;
    let states = states.declare_subscriber("simd/simd/joint_states/arm").await.unwrap();
    let sample = soon("a state", states.recv_async()).await.unwrap();
    assert_eq!(sample.source_info().unwrap().source_id().zid().to_string(), "d1");
    let target = SetJointTargetsRequest { robots: position("arm", 0.25), ..Default::default() };
    let publisher = network::session("client", &router.locator).await;
    publisher.put(keys::joint_targets("simd"), target.encode_to_vec()).await.unwrap();
    let target = async || client.joint_states(vec![every_joint("arm")]).await.unwrap().robots[0].target[0];
    soon("the target", async { while target().await != 0.25 {} }).await;
    let network = Network::join(&router.locator, Default::default()).await.unwrap();
    let there: Vec<String> = network.daemons().await.unwrap().into_iter().map(|daemon| daemon.zid).collect();
    assert_eq!(there, ["d1"]);
    assert!(questions.try_recv().is_err());
    daemon.drain().await;
}

/// Certificates of an authority, and Zenoh's settings for their holders.
struct Certificates(tempfile::TempDir);

impl Certificates {
    /// Makes the router's certificate and one for each of these clients.
    fn of(clients: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let run = |words: &[&str]| {
            let arguments: Vec<_> = ["simd", "tls"].iter().chain(words).map(Into::into).collect();
            simd_server::authority::run(&arguments).unwrap().unwrap();
        };
        let path = folder.path().display().to_string();
        run(&["init", &path]);
        clients.iter().for_each(|name| run(&["client", &path, name]));
        Self(folder)
    }

    fn path(&self, file: &str) -> std::path::PathBuf {
        self.0.path().join(file)
    }

    /// Returns the settings of a session that listens or connects.
    fn settings(&self, side: &str, name: &str) -> String {
        let mut settings =
            serde_json::json!({ "root_ca_certificate": self.path("ca.pem"), "enable_mtls": true });
        settings[format!("{side}_certificate")] = serde_json::json!(self.path(&format!("{name}.pem")));
        settings[format!("{side}_private_key")] = serde_json::json!(self.path(&format!("{name}.key")));
        settings.to_string()
    }

    fn options(&self, name: &str) -> ConnectOptions {
        ConnectOptions {
            tls_authorities: Some(self.path("ca.pem")),
            tls_certificate: Some(self.path(&format!("{name}.pem"))),
            tls_key: Some(self.path(&format!("{name}.key"))),
            connect_timeout: std::time::Duration::from_secs(1),
            timeout: std::time::Duration::from_secs(1),
            ..ConnectOptions::default()
        }
    }
}

/// As printed, without any change: sessions are known by the certificates that `simd tls client` made.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_router_knows_sessions_by_their_certificates_and_one_that_is_in_no_list_does_nothing() {
    const TLS: &str = "transport/link/tls";
    const NAME: &str =
        "zenoh_acl::a_router_knows_sessions_by_their_certificates_and_one_that_is_in_no_list_does_nothing";
    if !network::has_one_thread(NAME) {
        return;
    }
    let certificates = Certificates::of(&["simd", "alice", "bob", "mallory"]);
    let words = ["simd", "zenoh-acl", "--client", "alice", "--viewer", "bob"].map(Into::into);
    let printed = simd_server::zenoh_acl::run(&words).unwrap().unwrap();
    let printed: serde_json::Value = serde_json::from_str(&printed).unwrap();
    let rules = printed["access_control"].to_string();
    let listens = certificates.settings("listen", "server");
    let changes = [("access_control", rules.as_str()), (TLS, listens.as_str())];
    let router = network::Router::start_with("tls/127.0.0.1:0", &changes).await;
    let file = certificates.path("zenoh.json5");
    let connects = certificates.settings("connect", "simd");
    std::fs::write(&file, format!("{{ transport: {{ link: {{ tls: {connects} }} }} }}")).unwrap();
    let zenoh = Zenoh { connect: vec![router.locator.clone()], file: Some(file), ..Zenoh::default() };
    let config = Config { listen: ([127, 0, 0, 1], 0).into(), zenoh, ..Default::default() };
    let daemon = simd_server::daemon::start(config).await.unwrap();
    let admin = Client::connect(&daemon.address.to_string()).await.unwrap();
    load_arm(&admin, "arm").await;

    let connect = async |name| Client::connect_with(&router.locator, certificates.options(name)).await;
    let target = |value| SetJointTargetsRequest { robots: position("arm", value), ..Default::default() };
    let now = async || admin.joint_states(vec![every_joint("arm")]).await.unwrap().robots[0].target[0];
    connect("alice").await.unwrap().set_targets(target(0.25)).await.unwrap();
    assert_eq!(now().await, 0.25);
    let bob = connect("bob").await.unwrap();
    assert_eq!(bob.robots().await.unwrap()[0].name, "arm");
    bob.set_targets(target(0.5)).await.unwrap_err();
    // Its certificate is valid, but the printed rules do not list it.
    connect("mallory").await.unwrap_err();
    let own = certificates.settings("connect", "mallory");
    let session = network::session_with("client", &router.locator, &[(TLS, own.as_str())]).await;
    let states = session.declare_subscriber("simd/simd/joint_states/arm").await.unwrap();
    session.put(keys::joint_targets("simd"), target(0.75).encode_to_vec()).await.unwrap();
    for _ in 0..2 {
        bob.robots().await.unwrap();
    }
    assert_eq!(now().await, 0.25);
    assert!(states.try_recv().unwrap().is_none(), "it hears nothing either");
    daemon.drain().await;
}
