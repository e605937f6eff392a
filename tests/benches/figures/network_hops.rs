//! Time of a call over the network by layers: the daemon's own messages, with fewer and fewer layers. Each
//! row has a separate process at the other end, over TCP. The difference between two rows is the cost of the
//! layers by which they differ.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::process::Command;
use std::time::Instant;

use prost::Message as _;
use simd_client::proto::joint_service_client::JointServiceClient;
use simd_client::proto::{
    ControlRequest, ControlResponse, ControlWait, GetJointStatesRequest, SetJointTargetsRequest,
};
use simd_client::{API_VERSION, Client, Target, every_joint, joint_target, robot_targets};
use simd_tests::statistics::percentile;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::Streaming;
use tonic::transport::{Channel, Endpoint};
use zenoh::Wait as _;
use zenoh::handlers::FifoChannelHandler;
use zenoh::query::{ConsolidationMode, Reply};

use crate::bare;
use crate::round_trip::{ECHO, Process, daemon};

/// Rounds, each of which times every row in turn, so that noise affects all alike.
const ROUNDS: usize = 20;
const CALLS: usize = 500;

const ROWS: [&str; 16] = [
    "TCP echo of the bytes of Control, blocking",
    "a stream of tonic, bare",
    "Control, no targets: no command",
    "Control, seven targets",
    "Control, seven targets, paused",
    "GetJointStates of tonic, bare",
    "GetJointStates",
    "SetJointTargets of tonic, bare",
    "SetJointTargets",
    "SetJointTargets, paused",
    "Zenoh get of the same bytes, bare",
    "Zenoh get of GetJointStates",
    "Zenoh get of SetJointTargets",
    "Control, seven targets, spinning",
    "GetJointStates, spinning",
    "SetJointTargets, spinning",
];

/// Prints the table.
pub(crate) fn print() {
    let one = Builder::new_current_thread().enable_all().build().expect("a runtime");
    let workers = Builder::new_multi_thread().enable_all().build().expect("a runtime");
    let simd = daemon("");
    // Paused between its rows: while it plays it keeps a processor busy for a fifth of the time.
    let spinning = daemon("[realtime]\nspin_us = 200\n");
    let spinning_client = one.block_on(Client::connect(&spinning.address)).expect("the daemon listens");
    one.block_on(spinning_client.pause()).expect("it pauses");
    let client = one.block_on(Client::connect(&simd.address)).expect("the daemon listens");
    let joints = one.block_on(async {
        let layout = client.joint_layout("seven_arm").await.expect("the robot is there");
        layout.joints.into_iter().filter(|joint| joint.velocity_count == 1).map(|joint| joint.name)
    });
    let targets = joints.map(|joint| joint_target(&joint, Target::position(0.1)));
    let robots = vec![robot_targets("seven_arm", targets)];
    let selections = || vec![every_joint("seven_arm")];
    let states = one.block_on(client.joint_states(selections())).expect("states");

    let this = |kind, argument: &str| {
        let mut command = Command::new(std::env::current_exe().expect("this program"));
        command.args([kind, argument]);
        Process::start(command)
    };
    let wait = ControlWait::None.into();
    let empty = ControlRequest { wait, selections: selections(), ..ControlRequest::default() };
    let request = ControlRequest { robots: robots.clone(), wait, ..ControlRequest::default() };
    let answer = ControlResponse { states: Some(states.clone()), ..ControlResponse::default() };
    // Five bytes before each message of gRPC.
    let [sent, received] = [5 + request.encoded_len(), 5 + answer.encoded_len()];
    let (_echo, echo) = this(ECHO, &format!("{sent},{received}"));
    let (_tonic, tonic) = this(bare::TONIC, &bare::argument(&states));
    let (_queryable, locator) = this(bare::ZENOH, &bare::argument(&states));

    let mut stream = TcpStream::connect(&echo).expect("the echo listens");
    stream.set_nodelay(true).expect("a TCP socket");
    let mut bare = Grpc::new(&one, &tonic, &empty);
    let mut ours = Grpc::new(&one, &simd.address, &empty);
    let mut quick = Grpc::new(&one, &spinning.address, &empty);
    let get = GetJointStatesRequest { selections: selections() };
    let set = SetJointTargetsRequest { robots, ..SetJointTargetsRequest::default() };
    let [bare_session, session] = [&locator, &simd.locator]
        .map(|locator| workers.block_on(simd_tests::network::session("client", locator)));
    let key = |method: &str| format!("simd/simd/rpc/JointService/{method}");
    let [get_bytes, set_bytes] = [get.encode_to_vec(), set.encode_to_vec()];

    let mut times = [const { Vec::new() }; ROWS.len()];
    for _ in 0..ROUNDS {
        let [
            echoed,
            streamed,
            looked,
            controlled,
            still_controlled,
            bare_got,
            got,
            bare_set,
            was_set,
            still_set,
            zenoh_bare,
            zenoh_got,
            zenoh_set,
            quick_controlled,
            quick_got,
            quick_set,
        ] = &mut times;
        let (bytes, mut reply) = (vec![0; sent], vec![0; received]);
        timed(echoed, || {
            stream.write_all(&bytes).expect("the echo reads");
            stream.read_exact(&mut reply).expect("the echo answers");
        });
        bare.control(&one, &request, streamed);
        ours.control(&one, &empty, looked);
        ours.control(&one, &request, controlled);
        bare.get(&one, &get, bare_got);
        ours.get(&one, &get, got);
        bare.set(&one, &set, bare_set);
        ours.set(&one, &set, was_set);
        timed(zenoh_bare, || query(&bare_session, "bare/states", &get_bytes));
        timed(zenoh_got, || query(&session, &key("GetJointStates"), &get_bytes));
        timed(zenoh_set, || query(&session, &key("SetJointTargets"), &set_bytes));
        one.block_on(client.pause()).expect("it pauses");
        ours.control(&one, &request, still_controlled);
        ours.set(&one, &set, still_set);
        one.block_on(spinning_client.play()).expect("it plays");
        quick.control(&one, &request, quick_controlled);
        quick.get(&one, &get, quick_got);
        quick.set(&one, &set, quick_set);
        one.block_on(spinning_client.pause()).expect("it pauses");
        one.block_on(client.play()).expect("it plays");
    }
    report(&mut times, sent, received);
}

fn report(times: &mut [Vec<f64>; ROWS.len()], sent: usize, received: usize) {
    println!(
        "\ncalls over TCP, one in flight, {sent} and {received} bytes, playing at 1 kHz unless noted, spinning with spin_us = 200: \
         microseconds ({} of each)",
        ROUNDS * CALLS
    );
    println!("  {:46} {:>8} {:>8} {:>10} {:>10}", "", "p50", "p99", "p50 / echo", "p99 / echo");
    for times in times.iter_mut() {
        times.sort_by(f64::total_cmp);
    }
    let [echo, late_echo] = [0.5, 0.99].map(|part| percentile(&times[0], part));
    for (name, times) in ROWS.iter().zip(times.iter()) {
        let [p50, p99] = [0.5, 0.99].map(|part| percentile(times, part));
        println!("  {name:46} {p50:8.1} {p99:8.1} {:10.2} {:10.2}", p50 / echo, p99 / late_echo);
    }
}

fn timed(times: &mut Vec<f64>, mut call: impl FnMut()) {
    for _ in 0..CALLS {
        let begun = Instant::now();
        call();
        times.push(begun.elapsed().as_secs_f64() * 1e6);
    }
}

fn query(session: &zenoh::Session, key: &str, request: &[u8]) {
    let replies: FifoChannelHandler<Reply> = session
        .get(key)
        .payload(request)
        .consolidation(ConsolidationMode::None)
        .express(true)
        .wait()
        .expect("a query");
    assert!(replies.recv().expect("a reply").result().is_ok());
}

/// A client generated by tonic, of the daemon or of the bare service.
struct Grpc {
    client: JointServiceClient<Channel>,
    requests: mpsc::Sender<ControlRequest>,
    answers: Streaming<ControlResponse>,
}

impl Grpc {
    fn new(runtime: &Runtime, address: &str, first: &ControlRequest) -> Self {
        runtime.block_on(async {
            let endpoint = Endpoint::from_shared(format!("http://{address}")).expect("an address");
            let channel = endpoint.tcp_nodelay(true).connect().await.expect("it listens");
            let mut client = JointServiceClient::new(channel);
            let (requests, receiver) = mpsc::channel(1);
            requests.try_send(first.clone()).expect("there is room");
            let mut stream = tonic::Request::new(ReceiverStream::new(receiver));
            stamp(&mut stream);
            let mut answers = client.control(stream).await.expect("a stream").into_inner();
            answers.message().await.expect("an answer");
            Self { client, requests, answers }
        })
    }

    fn control(&mut self, runtime: &Runtime, request: &ControlRequest, times: &mut Vec<f64>) {
        timed(times, || {
            runtime.block_on(async {
                self.requests.try_send(request.clone()).expect("there is room");
                let answer = self.answers.message().await.expect("an answer").expect("the stream goes on");
                assert!(answer.refusal.is_none() && answer.states.is_some());
            });
        });
    }

    fn get(&mut self, runtime: &Runtime, request: &GetJointStatesRequest, times: &mut Vec<f64>) {
        timed(times, || {
            let mut request = tonic::Request::new(request.clone());
            stamp(&mut request);
            runtime.block_on(self.client.get_joint_states(request)).expect("an answer");
        });
    }

    fn set(&mut self, runtime: &Runtime, request: &SetJointTargetsRequest, times: &mut Vec<f64>) {
        timed(times, || {
            let mut request = tonic::Request::new(request.clone());
            stamp(&mut request);
            runtime.block_on(self.client.set_joint_targets(request)).expect("they are taken");
        });
    }
}

/// Adds the version of the schema, as clients do.
fn stamp<T>(request: &mut tonic::Request<T>) {
    let version = format!("{}.{}", API_VERSION.major, API_VERSION.minor);
    request.metadata_mut().insert("simd-api-version", version.parse().expect("a header"));
}
