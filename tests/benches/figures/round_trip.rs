//! Round trips to a daemon process, beside raw TCP echo processes in the same run. One blocks in the system
//! calls, which is the floor of the machine. One uses tokio at both ends, which is the floor of any server
//! for many clients. For the daemon's Unix socket, there is a blocking echo at another.

use std::io::{BufRead as _, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Instant, SystemTime};

use prost::Message as _;
use simd_client::proto::{ControlWait, GetJointStatesRequest, JointStates};
use simd_client::{Client, Control, ControlOptions, Target, every_joint, joint_target};
use simd_tests::robots::assets;
use simd_tests::statistics::percentile;
use tempfile::TempDir;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::runtime::{Builder, Runtime};
use zenoh::Wait as _;
use zenoh::handlers::{FifoChannelHandler, RingChannel, RingChannelHandler};
use zenoh::pubsub::Subscriber;
use zenoh::query::{ConsolidationMode, Reply};
use zenoh::sample::Sample;

/// The arguments that make this program an echo.
pub(crate) const ECHO: &str = "--echo";
pub(crate) const ASYNC_ECHO: &str = "--async-echo";
pub(crate) const UNIX_ECHO: &str = "--unix-echo";

/// Sizes of a request and a reply of six joints.
const REQUEST: usize = 110;
const REPLY: usize = 306;

/// Rounds, each of which times every path in turn, so that noise affects all alike.
const ROUNDS: usize = 20;
const CALLS: usize = 500;

/// Answers each request of [`REQUEST`] bytes with [`REPLY`] bytes, or with the numbers of bytes in its
/// argument.
pub(crate) fn echo() {
    let sizes = std::env::args().nth(2);
    let sizes = sizes.as_deref().and_then(|sizes| sizes.split_once(','));
    let size = |text: &str| text.parse().expect("a number of bytes");
    let (request, reply) = sizes.map_or((REQUEST, REPLY), |(sent, received)| (size(sent), size(received)));
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    println!("{}", listener.local_addr().expect("it is bound"));
    let (stream, _) = listener.accept().expect("a client");
    stream.set_nodelay(true).expect("a TCP socket");
    answer(stream, request, reply);
}

/// Like [`echo`], at a Unix socket in a folder that is removed with it.
pub(crate) fn unix_echo() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("echo.sock");
    let listener = UnixListener::bind(&path).expect("a free name");
    println!("{}", path.display());
    answer(listener.accept().expect("a client").0, REQUEST, REPLY);
}

fn answer(mut stream: impl Read + Write, request: usize, reply: usize) {
    let (mut request, reply) = (vec![0; request], vec![0; reply]);
    while stream.read_exact(&mut request).is_ok() && stream.write_all(&reply).is_ok() {}
}

/// Like [`echo`], on tokio with the daemon's number of workers.
pub(crate) fn async_echo() {
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().expect("a runtime");
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("a free port");
        println!("{}", listener.local_addr().expect("it is bound"));
        let (mut stream, _) = listener.accept().await.expect("a client");
        stream.set_nodelay(true).expect("a TCP socket");
        let serve = async move {
            let (mut request, reply) = ([0; REQUEST], [0; REPLY]);
            while stream.read_exact(&mut request).await.is_ok() && stream.write_all(&reply).await.is_ok() {}
        };
        tokio::spawn(serve).await.expect("the echo ends with its client");
    });
}

/// A process that is ended with its guard.
pub(crate) struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Process {
    /// Starts it and reads its first line.
    pub(crate) fn start(mut command: Command) -> (Self, String) {
        let mut child =
            command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it can be started");
        let stdout = child.stdout.take().expect("it is piped");
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line).expect("a first line");
        (Self(child), line.trim().to_owned())
    }
}

/// A daemon with a seven-joint arm in a playing world, and its address.
pub(crate) struct Daemon {
    pub(crate) address: String,
    pub(crate) locator: String,
    socket: PathBuf,
    _process: Process,
    _settings: TempDir,
}

/// Starts the daemon beside this program, with a configuration.
pub(crate) fn daemon(configuration: &str) -> Daemon {
    let this = std::env::current_exe().expect("this program");
    let folder = this.ancestors().nth(2).expect("target/PROFILE/deps");
    let settings = tempfile::tempdir().expect("a folder");
    let file = settings.path().join("simd.toml");
    std::fs::write(&file, configuration).expect("a file");
    let mut command = Command::new(folder.join("simd"));
    command.args(["--listen", "127.0.0.1:0", "--zenoh", "tcp/127.0.0.1:0", "--config"]).arg(&file);
    let socket = settings.path().join("simd.sock");
    command.arg("--unix-socket").arg(&socket);
    command.arg("--load").arg(assets().join("seven_arm/urdf/seven_arm.urdf"));
    let (process, ready) = Process::start(command);
    let (address, locator) = ready
        .split_once("http://")
        .and_then(|(_, places)| places.split_once(" and "))
        .and_then(|(address, places)| Some((address, places.split_once(" and ")?.0)))
        .expect("the daemon says where it listens");
    let (address, locator) = (address.to_owned(), locator.to_owned());
    Daemon { address, locator, socket, _process: process, _settings: settings }
}

/// Prints the table.
pub(crate) fn print() {
    let this = std::env::current_exe().expect("this program");
    let echo = |argument| {
        let mut command = Command::new(&this);
        command.arg(argument);
        Process::start(command)
    };
    let (_blocking, blocking_address) = echo(ECHO);
    let (_tokio, tokio_address) = echo(ASYNC_ECHO);
    let (_unix, unix_path) = echo(UNIX_ECHO);

    // A state a step, so that each publication is fresh.
    let simd = daemon("[zenoh]\nstate_rate = 1000\n");
    let mut times = [const { Vec::new() }; PATHS.len()];
    // Zenoh needs a runtime with workers; the others are measured without.
    let runtime = Builder::new_current_thread().enable_all().build().expect("a runtime");
    let workers = Builder::new_multi_thread().enable_all().build().expect("a runtime");
    let mut stream = TcpStream::connect(&blocking_address).expect("the echo listens");
    stream.set_nodelay(true).expect("a TCP socket");
    let mut async_stream = runtime.block_on(async {
        let stream = tokio::net::TcpStream::connect(&tokio_address).await.expect("the echo listens");
        stream.set_nodelay(true).expect("a TCP socket");
        stream
    });
    let mut unix_stream = UnixStream::connect(&unix_path).expect("the echo listens");
    let mut grpc = Peer::new(&runtime, &simd.address);
    let mut over_unix = Peer::new(&runtime, &format!("unix:{}", simd.socket.display()));
    let mut over_zenoh = Peer::new(&workers, &simd.locator);
    let plain = Plain::new(&workers, &simd.locator);
    for round in 0..ROUNDS {
        let value = round as f64 * 1e-3;
        let [
            blocking,
            tokio,
            unix,
            set,
            get,
            control,
            unix_set,
            unix_get,
            unix_control,
            zenoh_set,
            zenoh_get,
            zenoh_control,
            raw,
            state,
        ] = &mut times;
        echo_round(&mut stream, blocking);
        echo_round(&mut unix_stream, unix);
        runtime.block_on(async_echo_round(&mut async_stream, tokio));
        grpc.round(&runtime, value, [set, get, control]);
        over_unix.round(&runtime, value, [unix_set, unix_get, unix_control]);
        over_zenoh.round(&workers, value, [zenoh_set, zenoh_get, zenoh_control]);
        plain.get_round(raw);
        plain.state_round(state);
    }
    report(&mut times);
}

/// Measured paths, in this order.
const PATHS: [&str; 14] = [
    "raw TCP echo, 110 B and 306 B, blocking",
    "the same on tokio at both ends",
    "the same at a Unix socket, blocking",
    "gRPC SetJointTargets, seven joints",
    "gRPC GetJointStates, seven joints",
    "gRPC Control, seven targets, answered at once",
    "the first of them at a Unix socket",
    "the second",
    "the third",
    "Zenoh SetJointTargets, Rust client",
    "Zenoh GetJointStates, Rust client",
    "Zenoh Control, a query each, Rust client",
    "Zenoh get of GetJointStates, plain session",
    "Zenoh publication, step to subscriber, one way",
];

fn report(times: &mut [Vec<f64>; PATHS.len()]) {
    println!(
        "\nround trips, one in flight, world playing at 1 kHz: microseconds ({} calls each)",
        ROUNDS * CALLS
    );
    println!("  {:46} {:>8} {:>8}   p50 and p99 to the three echoes", "", "p50", "p99");
    for times in times.iter_mut() {
        times.sort_by(f64::total_cmp);
    }
    let both = |times: &[f64]| [percentile(times, 0.5), percentile(times, 0.99)];
    let echoes = [0, 1, 2].map(|echo| both(&times[echo]));
    for (name, times) in PATHS.iter().zip(times.iter()) {
        let [p50, p99] = both(times);
        let ratios = echoes.map(|echo| format!("{:5.2} {:5.2}", p50 / echo[0], p99 / echo[1]));
        println!("  {name:46} {p50:8.1} {p99:8.1}   {}", ratios.join("   "));
    }
}

fn micros(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e6
}

fn echo_round(stream: &mut (impl Read + Write), times: &mut Vec<f64>) {
    let (request, mut reply) = ([0; REQUEST], [0; REPLY]);
    for _ in 0..CALLS {
        let start = Instant::now();
        stream.write_all(&request).expect("the echo reads");
        stream.read_exact(&mut reply).expect("the echo answers");
        times.push(micros(start));
    }
}

async fn async_echo_round(stream: &mut tokio::net::TcpStream, times: &mut Vec<f64>) {
    let (request, mut reply) = ([0; REQUEST], [0; REPLY]);
    for _ in 0..CALLS {
        let start = Instant::now();
        stream.write_all(&request).await.expect("the echo reads");
        stream.read_exact(&mut reply).await.expect("the echo answers");
        times.push(micros(start));
    }
}

/// The Rust client, over any transport.
struct Peer {
    client: Client,
    control: Control,
    joints: Vec<String>,
}

impl Peer {
    fn new(runtime: &Runtime, endpoint: &str) -> Self {
        runtime.block_on(async {
            let client = Client::connect(endpoint).await.expect("the daemon listens");
            let layout = client.joint_layout("seven_arm").await.expect("the robot is there");
            let moving = layout.joints.iter().filter(|joint| joint.velocity_count == 1);
            let joints = moving.map(|joint| joint.name.clone()).collect();
            let options = ControlOptions {
                selections: vec![every_joint("seven_arm")],
                wait: ControlWait::None,
                ..ControlOptions::default()
            };
            let control = client.control(options).await.expect("a stream");
            Self { client, control, joints }
        })
    }

    fn round(&mut self, runtime: &Runtime, value: f64, times: [&mut Vec<f64>; 3]) {
        let [set, get, exchange] = times;
        let Self { client, control, joints } = self;
        let targets = || joints.iter().map(|joint| joint_target(joint, Target::position(value)));
        runtime.block_on(async {
            for _ in 0..CALLS {
                let start = Instant::now();
                client.set_robot_targets("seven_arm", targets()).await.expect("they are taken");
                set.push(micros(start));
            }
            for _ in 0..CALLS {
                let start = Instant::now();
                client.joint_states(vec![every_joint("seven_arm")]).await.expect("an answer");
                get.push(micros(start));
            }
            for _ in 0..CALLS {
                let start = Instant::now();
                control.exchange("seven_arm", targets()).await.expect("an answer");
                exchange.push(micros(start));
            }
        });
    }
}

/// A session that knows only the keys, and waits on a separate thread.
struct Plain {
    session: zenoh::Session,
    states: Subscriber<RingChannelHandler<Sample>>,
}

impl Plain {
    fn new(runtime: &Runtime, locator: &str) -> Self {
        runtime.block_on(async {
            let session = simd_tests::network::session("client", locator).await;
            let states = session.declare_subscriber("simd/simd/joint_states/seven_arm");
            let states = states.with(RingChannel::new(1)).await.expect("a subscriber");
            Self { session, states }
        })
    }

    fn get_round(&self, times: &mut Vec<f64>) {
        let request = GetJointStatesRequest { selections: vec![every_joint("seven_arm")] };
        for _ in 0..CALLS {
            let start = Instant::now();
            let replies: FifoChannelHandler<Reply> = self
                .session
                .get("simd/simd/rpc/JointService/GetJointStates")
                .payload(request.encode_to_vec())
                .consolidation(ConsolidationMode::None)
                .express(true)
                .wait()
                .expect("a query");
            let reply = replies.recv().expect("a reply");
            assert!(reply.result().is_ok());
            times.push(micros(start));
        }
    }

    /// From the time in the state to its arrival here, by the clock of the system.
    fn state_round(&self, times: &mut Vec<f64>) {
        // States already in the ring are old.
        let _ = self.states.recv();
        for _ in 0..CALLS {
            let sample = self.states.recv().expect("a state");
            let now = SystemTime::now();
            let states = JointStates::decode(&*sample.payload().to_bytes()).expect("a message");
            let stamp = states.stamp.and_then(|stamp| stamp.wall_time).expect("a moment");
            let then = SystemTime::try_from(stamp).expect("a time");
            times.push(now.duration_since(then).unwrap_or_default().as_secs_f64() * 1e6);
        }
    }
}
