//! Publications and keys of Zenoh, as a program sees them that knows only the keys.

use std::sync::Arc;
use std::time::Duration;

use prost::Message;
use simd_client::proto::{
    JointStates, SetJointTargetsRequest, WatchEventsResponse, WatchJointStatesRequest, WorldStatistics, event,
};
use simd_client::proto::{ParameterList, joint_target as wire};
use simd_client::{Client, Error, Network, Target, every_joint, joint_target, robot_targets};
use simd_proto::{SESSION_HEADER, keys};
use simd_server::config::Zenoh;
use simd_tests::daemon::{Daemon, Via};
use simd_tests::network;
use simd_tests::process::soon;
use simd_world::handle::{RunState, Transport};
use tokio::sync::Notify;
use zenoh::handlers::{FifoChannel, RingChannel};

use crate::{arm, load_arm};

/// Returns a session without any code of simd.
async fn session(daemon: &Daemon) -> zenoh::Session {
    network::session("client", &daemon.running.locators()[0]).await
}

async fn subscribe(
    session: &zenoh::Session,
    key: &str,
) -> zenoh::pubsub::Subscriber<zenoh::handlers::FifoChannelHandler<zenoh::sample::Sample>> {
    session.declare_subscriber(key).with(FifoChannel::new(256)).await.unwrap()
}

fn read<M: Message + Default>(sample: &zenoh::sample::Sample) -> M {
    M::decode(&*sample.payload().to_bytes()).unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn states_are_published_by_robot_and_only_grow() {
    let daemon = Daemon::start_via(Via::Zenoh, |_| {}).await;
    load_arm(&daemon.client, "arm").await;
    load_arm(&daemon.client, "other").await;
    let session = session(&daemon).await;
    let states = subscribe(&session, "simd/simd/joint_states/other").await;
    let mut last = 0;
    for _ in 0..10 {
        let sample = soon("a state", states.recv_async()).await.unwrap();
        assert_eq!(sample.encoding().to_string(), "application/protobuf;simd.v1.JointStates");
        let states: JointStates = read(&sample);
        assert_eq!(states.robots.iter().map(|it| it.robot.as_str()).collect::<Vec<_>>(), ["other"]);
        let sequence = states.stamp.unwrap().sequence;
        assert!(sequence > last);
        last = sequence;
    }
}

/// A reader with a ring of one that looks away for two thousand steps reads the newest.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_subscriber_that_stalled_reads_the_newest_state() {
    let daemon = arm(Via::Zenoh).await;
    let session = session(&daemon).await;
    let key = "simd/simd/joint_states/arm";
    let ring = session.declare_subscriber(key).with(RingChannel::new(1)).await.unwrap();
    let witness = subscribe(&session, key).await;
    for _ in 0..20 {
        daemon.client.step(100).await.unwrap();
    }
    // The witness reads until the last state was published; meanwhile nothing read the ring.
    let mut step = 0;
    while step < 2000 {
        let sample = soon("the last state", witness.recv_async()).await.unwrap();
        step = read::<JointStates>(&sample).stamp.unwrap().step;
    }
    let newest = soon("the newest", ring.recv_async()).await.unwrap();
    assert_eq!(read::<JointStates>(&newest).stamp.unwrap().step, 2000);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn targets_are_taken_without_an_answer_and_bad_ones_do_no_harm() {
    let daemon = arm(Via::Zenoh).await;
    let session = session(&daemon).await;
    let publisher = session.declare_publisher("simd/simd/joint_targets").await.unwrap();
    let target = |robot: &str, value: f64| SetJointTargetsRequest {
        robots: vec![robot_targets(robot, [joint_target("shoulder", Target::position(value))])],
        ..Default::default()
    };
    publisher.put("no message").await.unwrap();
    publisher.put(target("missing", 0.1).encode_to_vec()).await.unwrap();
    for i in 1..=100 {
        let put = publisher.put(target("arm", f64::from(i) * 1e-3).encode_to_vec());
        put.attachment("simd-client: publisher").await.unwrap();
    }
    // In order: at the end the last one holds.
    let mut control = daemon.client.control(Default::default()).await.unwrap();
    let last = async { while control.next().await.unwrap().accepted().unwrap().robots[0].target != [0.1] {} };
    soon("the last target", last).await;
    // The publisher is known soon after its targets hold.
    let named = async {
        while daemon.client.clients().await.unwrap().targets.iter().all(|from| from.client != "publisher") {}
    };
    soon("who set the target", named).await;
    let listed = daemon.client.clients().await.unwrap().clients;
    assert!(listed.iter().any(|client| client.name == "publisher" && client.transport == "zenoh"));
    assert!(matches!(target("arm", 0.0).robots[0].joints[0].target, Some(wire::Target::Position(_))));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn events_statistics_and_parameters_are_published() {
    let daemon = arm(Via::Zenoh).await;
    let session = session(&daemon).await;
    let events = subscribe(&session, "simd/simd/events").await;
    let statistics = subscribe(&session, "simd/simd/world_statistics").await;
    let parameters = subscribe(&session, "simd/simd/parameters").await;
    let sample = soon("statistics", statistics.recv_async()).await.unwrap();
    assert_eq!(read::<WorldStatistics>(&sample).iterations, 0);
    // A subscriber exists: from now on changes are published.
    soon("parameters", parameters.recv_async()).await.unwrap();
    let refuse = simd_client::proto::NameTakenPolicy::Refuse;
    daemon.client.add_button("go", refuse).await.unwrap();
    let named = async {
        while read::<ParameterList>(&parameters.recv_async().await.unwrap()).parameters.is_empty() {}
    };
    soon("the parameter", named).await;
    let deleted = async {
        daemon.client.delete_robot("arm").await.unwrap();
        loop {
            let event: WatchEventsResponse = read(&events.recv_async().await.unwrap());
            if let Some(event::Kind::EntityDeleted(deleted)) = event.event.unwrap().kind {
                return deleted.robot;
            }
        }
    };
    assert_eq!(soon("the event", deleted).await, "arm");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_locator_without_a_daemon_says_so() {
    let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let error = Client::connect(&format!("tcp/{free}")).await.unwrap_err();
    assert!(matches!(error, Error::Unreachable { .. }), "{error:?}");
    let router = network::Router::start().await;
    let error = Client::connect(&router.locator).await.unwrap_err();
    assert!(matches!(error, Error::Unreachable { .. }), "{error:?}");
    let error = Client::connect("tcp/nowhere").await.unwrap_err();
    assert!(matches!(error, Error::Endpoint { .. } | Error::Unreachable { .. }), "{error:?}");
}

/// Two at once behind one router: never both.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn at_most_one_of_two_daemons_with_one_name_starts() {
    let router = network::Router::start().await;
    let start = || async {
        let zenoh = Zenoh { connect: vec![router.locator.clone()], ..Zenoh::default() };
        let config =
            simd_server::config::Config { listen: ([127, 0, 0, 1], 0).into(), zenoh, ..Default::default() };
        simd_server::daemon::start(config).await
    };
    let (one, two) = tokio::join!(start(), start());
    let refused: Vec<String> =
        [&one, &two].iter().filter_map(|it| it.as_ref().err()).map(|e| e.to_string()).collect();
    assert!(!refused.is_empty());
    assert!(refused.iter().all(|sentence| sentence.contains("--name")), "{refused:?}");
    let network = Network::join(&router.locator, Default::default()).await.unwrap();
    let present = network.daemons().await.unwrap();
    assert_eq!(present.len(), 2 - refused.len());
    // If one started, a third does not.
    if !present.is_empty() {
        let third = start().await.unwrap_err();
        assert_eq!(third.exit_code(), 6, "{third}");
    }
}

/// Calls continue while the replies to another client are not read.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_that_does_not_read_its_replies_delays_no_other() {
    let daemon = Daemon::start_via(Via::Zenoh, |config| config.driver.state = RunState::Playing).await;
    load_arm(&daemon.client, "arm").await;
    let session = session(&daemon).await;
    // A subscriber whose only place is taken and never emptied blocks its session's reading.
    let stalled =
        session.declare_subscriber("simd/simd/joint_states/arm").with(FifoChannel::new(1)).await.unwrap();
    let mut control = daemon.client.control(Default::default()).await.unwrap();
    let exchanges = async {
        for _ in 0..200 {
            control.next().await.unwrap().accepted().unwrap();
            daemon.client.joint_states(vec![every_joint("arm")]).await.unwrap();
        }
    };
    tokio::time::timeout(Duration::from_secs(60), exchanges).await.unwrap();
    drop(stalled);
}

/// Streams that are served at one time.
const STREAMS: usize = 512;

/// A client of a thousand streams that stops reading: gRPC continues, and so do others over Zenoh.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_asker_that_stops_to_read_does_not_stop_others() {
    // Zenoh closes no session while the test runs.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("zenoh.json5");
    let patient = "{ transport: { link: { tx: { lease: 600000, queue: { congestion_control: { \
                   block: { wait_before_close: 600000000 } } } } } } }";
    std::fs::write(&file, patient).unwrap();
    let daemon = Daemon::start_via(Via::Zenoh, |config| {
        config.limits.streams_of_client = 1024;
        config.limits.zenoh_unnamed_stream_time = config.limits.zenoh_stream_time;
        config.driver.state = RunState::Playing;
        config.zenoh.file = Some(file);
    })
    .await;
    load_arm(&daemon.client, "arm").await;
    let grpc = Client::connect(&daemon.address.to_string()).await.unwrap();
    let stop = Arc::new(Notify::new());
    let proxy = network::stopping_proxy(&daemon.running.locators()[0], stop.clone()).await;
    let asker = network::session_with("client", &proxy, &[("transport/link/tx/lease", "600000")]).await;
    let request = WatchJointStatesRequest { rate: 100.0, ..Default::default() }.encode_to_vec();
    let (answered, mut answers) = tokio::sync::mpsc::unbounded_channel();
    for _ in 0..1000 {
        let answered = answered.clone();
        let query =
            asker.get("simd/simd/rpc/JointService/WatchJointStates?for=3600").payload(request.clone());
        let query = query.consolidation(zenoh::query::ConsolidationMode::None);
        query
            .callback(move |_reply| {
                let _ = answered.send(());
            })
            .await
            .unwrap();
    }
    for _ in 0..1000 {
        soon("each stream's answer", answers.recv()).await.unwrap();
    }
    stop.notify_one();
    // All of its streams wait, and none continues, while calls are answered.
    let answered_meanwhile = async {
        loop {
            let before = daemon.running.zenoh_replies().unwrap();
            grpc.joint_states(vec![every_joint("arm")]).await.unwrap();
            let after = daemon.running.zenoh_replies().unwrap();
            if before == after && after.waiting >= STREAMS {
                return;
            }
        }
    };
    soon("calls to be answered while the asker's replies wait", answered_meanwhile).await;
    // Over Zenoh too.
    soon("an answer", daemon.client.joint_states(vec![every_joint("arm")])).await.unwrap();
    assert!(daemon.running.zenoh_replies().unwrap().waiting >= STREAMS);
    stop.notify_one();
    let released = async {
        while daemon.running.zenoh_replies().unwrap().waiting >= STREAMS {
            tokio::task::yield_now().await;
        }
    };
    soon("the end of the asker", released).await;
}

/// Streams over Zenoh that the daemon serves.
fn streams(daemon: &Daemon) -> usize {
    let counts = daemon.running.handle.call_counts();
    counts.iter().filter(|of| of.transport == Transport::Zenoh).map(|of| of.streams as usize).sum()
}

/// Returns the attachment of a query that names its session.
fn named(asker: &zenoh::Session) -> String {
    keys::attachment([(SESSION_HEADER, asker.zid().to_string().as_str())])
}

/// Asks for streams that last an hour, each with a reply or more.
async fn ask_for_streams(asker: &zenoh::Session, count: usize, attachment: Option<String>) {
    let request = WatchJointStatesRequest { rate: 100.0, ..Default::default() }.encode_to_vec();
    let (answered, mut answers) = tokio::sync::mpsc::unbounded_channel();
    for number in 0..count {
        let answered = answered.clone();
        let query =
            asker.get("simd/simd/rpc/JointService/WatchJointStates?for=3600").payload(request.clone());
        let query = query.consolidation(zenoh::query::ConsolidationMode::None).attachment(attachment.clone());
        let reply = move |_reply| {
            let _ = answered.send(number);
        };
        query.callback(reply).await.unwrap();
    }
    let mut served = std::collections::BTreeSet::new();
    while served.len() < count {
        served.insert(soon("each stream's answer", answers.recv()).await.unwrap());
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn claims_of_a_vanished_session_are_free() {
    let daemon = Daemon::start_via(Via::Zenoh, |config| config.driver.state = RunState::Playing).await;
    load_arm(&daemon.client, "arm").await;
    for _ in 0..2 {
        let stop = Arc::new(Notify::new());
        let proxy = network::stopping_proxy(&daemon.running.locators()[0], stop.clone()).await;
        let asker = network::session("client", &proxy).await;
        // The maximum for one client.
        ask_for_streams(&asker, 256, Some(named(&asker))).await;
        let freed = async {
            while streams(&daemon) > 0 {
                // The connection is closed, as if the client was killed.
                stop.notify_one();
                tokio::task::yield_now().await;
            }
        };
        soon("the end of its streams", freed).await;
    }
}

/// The daemon does not know whose queries these are.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn claims_of_a_vanished_unnamed_session_are_free() {
    let daemon = Daemon::start_via(Via::Zenoh, |config| {
        config.driver.state = RunState::Playing;
        config.limits.zenoh_unnamed_stream_time = Duration::from_secs(2);
    })
    .await;
    load_arm(&daemon.client, "arm").await;
    let stop = Arc::new(Notify::new());
    let proxy = network::stopping_proxy(&daemon.running.locators()[0], stop.clone()).await;
    let asker = network::session("client", &proxy).await;
    // The name of a session that does not exist is not a name.
    ask_for_streams(&asker, 1, None).await;
    ask_for_streams(&asker, 1, Some(keys::attachment([(SESSION_HEADER, "abc")]))).await;
    stop.notify_one();
    let freed = async {
        while streams(&daemon) > 0 {
            tokio::task::yield_now().await;
        }
    };
    soon("the end of its streams", freed).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stream_whose_query_does_not_name_its_session_says_why_it_ends_early() {
    let daemon = Daemon::start_via(Via::Zenoh, |config| {
        config.limits.zenoh_unnamed_stream_time = Duration::from_millis(10);
    })
    .await;
    let asker = network::session("client", &daemon.running.locators()[0]).await;
    let ask = async |attachment: Option<String>, seconds: f64| {
        let key = format!("simd/simd/rpc/EventService/WatchEvents?for={seconds}");
        let query = asker.get(key).consolidation(zenoh::query::ConsolidationMode::None);
        let replies = query.attachment(attachment).await.unwrap();
        loop {
            let reply = soon("the end of a stream", replies.recv_async()).await.unwrap();
            if let Err(last) = reply.into_result() {
                return String::from_utf8_lossy(&last.payload().to_bytes()).into_owned();
            }
        }
    };
    let said = ask(None, 5.0).await;
    assert!(said.contains("0.01 s are over, the most") && said.contains("simd-session"), "{said}");
    let said = ask(Some(named(&asker)), 0.02).await;
    assert!(said.contains("0.02 s are over; ask again, or for longer"), "{said}");
}
