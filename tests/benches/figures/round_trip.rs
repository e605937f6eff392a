//! Round trips to a daemon process, beside raw TCP echo processes in the same run: one that
//! blocks in the system calls, which is the floor of the machine, and one on tokio at both
//! ends, which is the floor of anything that serves many clients.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use simd_client::proto::{ControlWait, StepSimulationRequest};
use simd_client::{Client, ControlOptions, Target, every_joint, joint_target, robot_targets};
use simd_tests::robots::assets;
use simd_tests::statistics::percentile;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};

/// The arguments that make this program an echo.
pub(crate) const ECHO: &str = "--echo";
pub(crate) const ASYNC_ECHO: &str = "--async-echo";

/// Sizes of a request and a reply of six joints.
const REQUEST: usize = 110;
const REPLY: usize = 306;

/// Rounds, each of which times every path in turn, so that noise hits all alike.
const ROUNDS: usize = 20;
const CALLS: usize = 500;
/// What is timed.
const PATHS: usize = 6;

/// Answers each request of [`REQUEST`] bytes with [`REPLY`] bytes.
pub(crate) fn echo() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    println!("{}", listener.local_addr().expect("it is bound"));
    let (mut stream, _) = listener.accept().expect("a client");
    stream.set_nodelay(true).expect("a TCP socket");
    let (mut request, reply) = ([0; REQUEST], [0; REPLY]);
    while stream.read_exact(&mut request).is_ok() && stream.write_all(&reply).is_ok() {}
}

/// The same on tokio, with as many workers as the daemon has.
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
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Process {
    /// Starts it and reads its first line.
    fn start(mut command: Command) -> (Self, String) {
        let mut child =
            command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it can be started");
        let stdout = child.stdout.take().expect("it is piped");
        let mut line = String::new();
        BufReader::new(stdout).read_line(&mut line).expect("a first line");
        (Self(child), line.trim().to_owned())
    }
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

    let folder = this.ancestors().nth(2).map(PathBuf::from).expect("target/PROFILE/deps");
    let daemon = |more: &[&str]| {
        let mut command = Command::new(folder.join("simd"));
        command.args(["--listen", "127.0.0.1:0"]).args(more);
        command.arg("--load").arg(assets().join("seven_arm/urdf/seven_arm.urdf"));
        let (daemon, ready) = Process::start(command);
        (daemon, ready.rsplit("http://").next().unwrap_or_default().to_owned())
    };
    let (_playing, playing_address) = daemon(&[]);
    let (_paused, paused_address) = daemon(&["--paused"]);

    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    let mut times = [const { Vec::new() }; PATHS];
    let echoes = [blocking_address.as_str(), tokio_address.as_str()];
    runtime.block_on(measure(echoes, [&playing_address, &paused_address], &mut times));
    println!(
        "\nround trips, one in flight, world playing at 1 kHz unless paused: microseconds ({} calls each)",
        ROUNDS * CALLS
    );
    println!("  {:44} {:>8} {:>8}   p50 and p99 to the blocking echo, to tokio's", "", "p50", "p99");
    let names = [
        "raw TCP echo, 110 B and 306 B, blocking",
        "the same on tokio at both ends",
        "unary SetJointTargets, seven joints",
        "unary GetJointStates, seven joints",
        "Control, seven targets, answered at once",
        "paused: seven targets, a step, the states",
    ];
    for times in &mut times {
        times.sort_by(f64::total_cmp);
    }
    let both = |times: &[f64]| [percentile(times, 0.5), percentile(times, 0.99)];
    let (floor, tokio) = (both(&times[0]), both(&times[1]));
    for (name, times) in names.iter().zip(&times) {
        let [p50, p99] = both(times);
        println!(
            "  {name:44} {p50:8.1} {p99:8.1}   {:5.2} {:5.2}   {:5.2} {:5.2}",
            p50 / floor[0],
            p99 / floor[1],
            p50 / tokio[0],
            p99 / tokio[1],
        );
    }
}

async fn measure(echoes: [&str; 2], daemons: [&str; 2], times: &mut [Vec<f64>; PATHS]) {
    let mut stream = TcpStream::connect(echoes[0]).expect("the echo listens");
    stream.set_nodelay(true).expect("a TCP socket");
    let mut async_stream = tokio::net::TcpStream::connect(echoes[1]).await.expect("the echo listens");
    async_stream.set_nodelay(true).expect("a TCP socket");
    let client = Client::connect(daemons[0]).await.expect("the daemon listens");
    let stepped = Client::connect(daemons[1]).await.expect("the daemon listens");
    let layout = client.joint_layout("seven_arm").await.expect("the robot is there");
    let joints: Vec<String> =
        layout.joints.iter().filter(|j| j.velocity_count == 1).map(|j| j.name.clone()).collect();
    let targets = |value: f64| joints.iter().map(move |joint| joint_target(joint, Target::position(value)));
    let options = ControlOptions {
        selections: vec![every_joint("seven_arm")],
        wait: ControlWait::None,
        ..ControlOptions::default()
    };
    let mut control = client.control(options).await.expect("a stream");
    let (request, mut reply) = ([0; REQUEST], [0; REPLY]);
    let micros = |start: Instant| start.elapsed().as_secs_f64() * 1e6;
    for round in 0..ROUNDS {
        let value = round as f64 * 1e-3;
        for _ in 0..CALLS {
            let start = Instant::now();
            stream.write_all(&request).expect("the echo reads");
            stream.read_exact(&mut reply).expect("the echo answers");
            times[0].push(micros(start));
        }
        for _ in 0..CALLS {
            let start = Instant::now();
            async_stream.write_all(&request).await.expect("the echo reads");
            async_stream.read_exact(&mut reply).await.expect("the echo answers");
            times[1].push(micros(start));
        }
        for _ in 0..CALLS {
            let start = Instant::now();
            client.set_robot_targets("seven_arm", targets(value)).await.expect("they are taken");
            times[2].push(micros(start));
        }
        for _ in 0..CALLS {
            let start = Instant::now();
            client.joint_states(vec![every_joint("seven_arm")]).await.expect("an answer");
            times[3].push(micros(start));
        }
        for _ in 0..CALLS {
            let start = Instant::now();
            control.exchange("seven_arm", targets(value)).await.expect("an answer");
            times[4].push(micros(start));
        }
        for _ in 0..CALLS {
            let start = Instant::now();
            let turn = StepSimulationRequest {
                steps: 1,
                robots: vec![robot_targets("seven_arm", targets(value))],
                return_states: true,
                selections: vec![every_joint("seven_arm")],
                ..Default::default()
            };
            stepped.step_with(turn).await.expect("an answer");
            times[5].push(micros(start));
        }
    }
}
