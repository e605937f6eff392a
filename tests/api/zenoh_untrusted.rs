//! Attacks by an untrusted session on the same Zenoh network that reads everything and answers everything. It
//! cannot affect claimed joints, nor a client that knows its daemon.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use prost::Message;
use simd_client::proto::{
    GetJointStatesResponse, ReleaseJointsRequest, SetJointTargetsRequest, StepSimulationRequest,
};
use simd_client::{
    Client, ControlOptions, Error, Network, Target, every_joint, joint_target, proto, robot_targets,
};
use simd_proto::keys;
use simd_proto::proof::{PROOF_HEADER, Proof, next_counter};
use simd_server::config::{Config, Zenoh};
use simd_tests::daemon::{Daemon, Via};
use simd_tests::network;
use simd_tests::process::soon;
use zenoh::Wait as _;
use zenoh::bytes::ZBytes;

use crate::{arm, load_arm};

/// A message on the network: key, payload, attachment.
#[derive(Clone, Debug)]
struct Heard {
    key: String,
    is_query: bool,
    payload: Vec<u8>,
    attachment: String,
}

/// A session that subscribes to everything and answers every query.
struct Untrusted {
    session: zenoh::Session,
    heard: Arc<Mutex<Vec<Heard>>>,
}

impl Untrusted {
    async fn of(daemon: &Daemon) -> Self {
        let session = network::session("client", &daemon.running.locators()[0]).await;
        let heard = Arc::new(Mutex::new(Vec::new()));
        let bytes =
            |payload: Option<&ZBytes>| payload.map(|it| it.to_bytes().into_owned()).unwrap_or_default();
        let text = move |it: Option<&ZBytes>| String::from_utf8(bytes(it)).unwrap();
        let put = heard.clone();
        let subscriber = session.declare_subscriber("simd/**").callback(move |sample| {
            let key = sample.key_expr().to_string();
            let payload = sample.payload().to_bytes().into_owned();
            let attachment = text(sample.attachment());
            put.lock().unwrap().push(Heard { key, is_query: false, payload, attachment });
        });
        subscriber.background().await.unwrap();
        let asked = heard.clone();
        // It declares to have all answers, and gives none.
        let queryable = session.declare_queryable("simd/**").complete(true).callback(move |query| {
            let key = query.key_expr().to_string();
            let (payload, attachment) = (bytes(query.payload()), text(query.attachment()));
            asked.lock().unwrap().push(Heard { key, is_query: true, payload, attachment });
        });
        queryable.background().await.unwrap();
        // Its declarations take time to reach the others.
        let is_asked = || heard.lock().unwrap().iter().any(|heard: &Heard| heard.is_query);
        let ask = async {
            while !is_asked() {
                daemon.client.joint_layout("arm").await.unwrap();
            }
        };
        soon("the first query that it hears", ask).await;
        Self { session, heard }
    }

    /// Sends any message, and waits for the daemon's answer if there is one.
    async fn send(&self, heard: &Heard) {
        if !heard.is_query {
            let put = self.session.put(&heard.key, heard.payload.clone());
            return put.attachment(heard.attachment.clone()).wait().unwrap();
        }
        let query = self.session.get(format!("{}?for=1", heard.key)).payload(heard.payload.clone());
        let query = query.attachment(heard.attachment.clone()).target(zenoh::query::QueryTarget::All);
        let replies = query.consolidation(zenoh::query::ConsolidationMode::None).await.unwrap();
        let first = soon("the daemon's answer", replies.recv_async()).await.unwrap();
        // A Control stream has its error in an answer, all others have it in an error.
        if let Ok(sample) = first.result() {
            let answer = proto::ControlResponse::decode(&*sample.payload().to_bytes()).unwrap();
            assert!(answer.refusal.is_some(), "{heard:?}: {answer:?}");
        }
    }
}

pub(crate) fn position(robot: &str, value: f64) -> Vec<proto::RobotTargets> {
    vec![robot_targets(robot, [joint_target("shoulder", Target::position(value))])]
}

async fn target(client: &Client) -> f64 {
    client.joint_states(vec![every_joint("arm")]).await.unwrap().robots[0].target[0]
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_overheard_claim_drives_nothing() {
    let daemon = arm(Via::Zenoh).await;
    load_arm(&daemon.client, "other").await;
    let untrusted = Untrusted::of(&daemon).await;
    let holder = &daemon.client;
    let joints = vec![every_joint("arm")];
    let secret = holder.claim_joints(joints.clone(), "holder", Duration::from_secs(3600)).await.unwrap();
    let claim = secret.clone();

    // The holder drives its joints in every possible way.
    let robots = position("arm", 0.5);
    holder
        .set_targets(SetJointTargetsRequest { robots, claim: claim.clone(), ..Default::default() })
        .await
        .unwrap();
    let options = ControlOptions { selections: joints, claim: claim.clone(), ..Default::default() };
    let mut control = holder.control(options).await.unwrap();
    let shoulder = |value| [joint_target("shoulder", Target::position(value))];
    control.exchange("arm", shoulder(0.6)).await.unwrap().accepted().unwrap();
    let step = StepSimulationRequest { steps: 1, robots: position("arm", 0.7), claim, ..Default::default() };
    holder.step_with(step).await.unwrap();
    let publisher = network::session("client", &daemon.running.locators()[0]).await;
    let key = keys::joint_targets("simd");
    let (id, _) = secret.split_once('.').unwrap();
    let request =
        SetJointTargetsRequest { robots: position("arm", 0.1), claim: id.into(), ..Default::default() };
    let payload = request.encode_to_vec();
    let proof = Proof::new(&secret, next_counter(0), &key, &payload).unwrap();
    publisher.put(&key, payload).attachment(format!("{PROOF_HEADER}: {proof}")).await.unwrap();
    soon("the published target", async { while target(holder).await != 0.1 {} }).await;

    // The secret was not sent.
    let random = secret.split_once('.').unwrap().1;
    let heard = untrusted.heard.lock().unwrap().clone();
    for heard in &heard {
        assert!(!String::from_utf8_lossy(&heard.payload).contains(random), "{heard:?}");
        assert!(!heard.attachment.contains(random), "{heard:?}");
    }
    let rpc = |service: &str, method: &str| keys::rpc("simd", service, method);
    let ways = [
        rpc("JointService", "SetJointTargets"),
        rpc("JointService", "Control"),
        rpc("SimulationService", "StepSimulation"),
        key.clone(),
    ];
    let release = Heard {
        key: rpc("JointService", "ReleaseJoints"),
        is_query: true,
        payload: ReleaseJointsRequest { claim: id.into(), ..Default::default() }.encode_to_vec(),
        attachment: String::new(),
    };
    for way in &ways {
        let sent: Vec<&Heard> = heard.iter().filter(|heard| heard.key == *way).collect();
        let [heard] = sent.as_slice() else { panic!("{way}: {sent:?}") };
        let heard: &Heard = heard;
        assert!(heard.attachment.contains(PROOF_HEADER), "{heard:?}");
        // Again; with other targets; with the next counter; without the proof; by another way; to release.
        untrusted.send(heard).await;
        let other =
            SetJointTargetsRequest { robots: position("arm", -1.0), claim: id.into(), ..Default::default() };
        let proof = Proof::parse(keys::parse_attachment(&heard.attachment, PROOF_HEADER).unwrap()).unwrap();
        let (counter, later) = (proof.counter.to_string(), (proof.counter + 1_000_000_000).to_string());
        let later = heard.attachment.replace(&counter, &later);
        untrusted
            .send(&Heard {
                key: ways[0].clone(),
                is_query: true,
                payload: other.encode_to_vec(),
                ..heard.clone()
            })
            .await;
        untrusted.send(&Heard { attachment: later.clone(), ..heard.clone() }).await;
        untrusted.send(&Heard { attachment: String::new(), ..heard.clone() }).await;
        untrusted
            .send(&Heard { key: key.clone(), is_query: false, attachment: later.clone(), ..heard.clone() })
            .await;
        untrusted.send(&Heard { attachment: heard.attachment.clone(), ..release.clone() }).await;
        untrusted.send(&Heard { attachment: later, ..release.clone() }).await;
    }
    untrusted.send(&release).await;

    // The session's publications are read in order: once this one holds, all earlier ones were refused.
    let last = SetJointTargetsRequest { robots: position("other", 0.3), ..Default::default() };
    let put = untrusted.session.put(&key, last.encode_to_vec());
    put.await.unwrap();
    let of_other =
        async || holder.joint_states(vec![every_joint("other")]).await.unwrap().robots[0].target[0];
    soon("the untrusted session's own target", async { while of_other().await != 0.3 {} }).await;
    assert_eq!(target(holder).await, 0.1);
    assert_eq!(holder.joint_layout("arm").await.unwrap().joints[0].claimed_by, "holder");

    // And the holder continues, to the end.
    control.exchange("arm", shoulder(0.2)).await.unwrap().accepted().unwrap();
    holder.release_joints(&secret).await.unwrap();
    assert_eq!(holder.joint_layout("arm").await.unwrap().joints[0].claimed_by, "");
}

/// A secret that was sent is everybody's: the daemon does not get used to it.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_secret_is_refused_where_others_can_read_it() {
    let daemon = arm(Via::Zenoh).await;
    let secret = daemon
        .client
        .claim_joints(vec![every_joint("arm")], "holder", Duration::from_secs(60))
        .await
        .unwrap();
    let session = network::session("client", &daemon.running.locators()[0]).await;
    let request =
        SetJointTargetsRequest { robots: position("arm", 0.5), claim: secret, ..Default::default() };
    let query =
        session.get(keys::rpc("simd", "JointService", "SetJointTargets")).payload(request.encode_to_vec());
    let replies = query.await.unwrap();
    let reply = soon("the refusal", replies.recv_async()).await.unwrap();
    let refusal = reply.into_result().unwrap_err();
    let status = tonic_types::pb::Status::decode(&*refusal.payload().to_bytes()).unwrap();
    assert!(status.message.contains("claim is a secret"), "{}", status.message);
}

/// A session that answers at once, and declares to have all answers.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn answers_of_an_untrusted_session_are_not_read() {
    let daemon = arm(Via::Zenoh).await;
    let session = network::session("client", &daemon.running.locators()[0]).await;
    let queryable = session.declare_queryable("simd/**").complete(true).callback(|query| {
        let forged = proto::JointStates { robots: Vec::new(), stamp: None };
        let forged = GetJointStatesResponse { states: Some(forged) }.encode_to_vec();
        query.reply(query.key_expr(), forged).wait().unwrap();
        query.reply_err("Timeout").wait().unwrap();
    });
    queryable.background().await.unwrap();
    for _ in 0..20 {
        let states = daemon.client.joint_states(vec![every_joint("arm")]).await.unwrap();
        assert_eq!(states.robots.len(), 1);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_token_that_is_none_leaves_the_only_daemon_the_only_one() {
    let daemon = arm(Via::Zenoh).await;
    let locator = &daemon.running.locators()[0];
    let session = network::session("client", locator).await;
    let mut tokens = Vec::new();
    for key in
        ["@simd/daemons/other/x", "@simd/daemons/simd/X1", "@simd/daemons/simd/0", "@simd/daemons/a/1/2"]
    {
        tokens.push(session.liveliness().declare_token(key).await.unwrap());
    }
    let client = Client::connect(locator).await.unwrap();
    assert_eq!(client.joint_states(Vec::new()).await.unwrap().robots.len(), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn two_sessions_with_the_name_of_a_daemon_are_both_named_and_a_client_keeps_its_own() {
    let daemon = arm(Via::Zenoh).await;
    let locator = &daemon.running.locators()[0];
    let session = network::session("client", locator).await;
    let forged = session.zid().to_string();
    let network = Network::join(locator, Default::default()).await.unwrap();
    let own = network.daemons().await.unwrap()[0].zid.clone();
    let _token = session.liveliness().declare_token(keys::daemon("simd", &forged)).await.unwrap();
    soon("the token", async { while network.daemons().await.unwrap().len() < 2 {} }).await;
    for endpoint in [locator.clone(), format!("{locator}#simd")] {
        let error = Client::connect(&endpoint).await.unwrap_err();
        assert!(matches!(error, Error::Endpoint { .. }), "{error:?}");
        let sentence = error.to_string();
        assert!(sentence.contains(&own) && sentence.contains(&forged), "{sentence}");
    }
    // An earlier client continues.
    assert_eq!(daemon.client.joint_states(Vec::new()).await.unwrap().robots.len(), 1);
}

/// A restarted daemon counts its states from the start: its clients continue at once.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn streams_continue_after_a_restart_of_the_daemon() {
    let router = network::Router::start().await;
    let start = || async {
        let zenoh = Zenoh { connect: vec![router.locator.clone()], ..Zenoh::default() };
        let mut config = Config { listen: ([127, 0, 0, 1], 0).into(), zenoh, ..Default::default() };
        config.driver.state = simd_world::handle::RunState::Paused;
        simd_server::daemon::start(config).await.unwrap()
    };
    let first = start().await;
    let client = Client::connect(&router.locator).await.unwrap();
    load_arm(&client, "arm").await;
    for _ in 0..200 {
        client.step(1).await.unwrap();
    }
    let mut control = client.control(ControlOptions::default()).await.unwrap();
    let mut watch = client.watch(vec![every_joint("arm")], 30.0).await.unwrap();
    let before = control.next().await.unwrap().accepted().unwrap().stamp.unwrap().sequence;
    watch.next().await.unwrap().unwrap();
    first.drain().await;
    let second = start().await;
    let network = Network::join(&router.locator, Default::default()).await.unwrap();
    let again = network.client("simd");
    load_arm(&again, "arm").await;
    let now = again.joint_states(Vec::new()).await.unwrap().stamp.unwrap().sequence;
    assert!(now < before, "{now} {before}");
    let shown = soon("a state of the second daemon", watch.next()).await.unwrap().unwrap();
    assert!(shown.stamp.unwrap().sequence < before);
    let answer = soon("an answer of the second daemon", control.next()).await.unwrap().accepted().unwrap();
    assert!(answer.stamp.unwrap().sequence < before);
    second.drain().await;
}
