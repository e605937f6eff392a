//! Clients that request more than they read, on every transport: the daemon's memory stays within a bound,
//! and others are served.

use std::path::PathBuf;
use std::sync::Arc;

use prost::Message as _;
use simd_client::proto::{GetAssetRequest, Marker, MarkerLines, UploadAssetRequest, marker};
use simd_client::{Client, Target, joint_target};
use simd_model::robot::Sha256;
use simd_proto::methods;
use simd_proto::raw::RawCodec;
use simd_tests::process::{Home, Process, soon};
use simd_tests::{json, network};
use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::net::{TcpStream, UnixStream};
use tokio::sync::Notify;
use tonic::codegen::http::uri::PathAndQuery;

use crate::floods::{DATA, END_HEADERS, END_STREAM, HEADERS, PREFACE, SETTINGS, frame, headers_of};

/// Most memory, in bytes, that clients who do not read may add to the daemon's. The allocator of the system
/// keeps some of the freed memory, so this is twice the bound of the packages. Without a budget it was 0.9 to
/// 1.7 GB.
const MAX: u64 = 512 << 20;
/// Calls of each kind: their answers would have a gigabyte.
const CALLS: u32 = 128;
/// Bytes of each answer, about.
const ANSWER: usize = 10 << 20;
/// Bytes of each large request in JSON. The daemon holds 32 MiB of them at the same time, so two.
const REQUEST: usize = 14 << 20;

/// A daemon with large answers, and the requests for them.
struct Attacked {
    daemon: Process,
    socket: PathBuf,
    _folder: Home,
    /// Before anybody asks.
    quiet: u64,
    /// A path of a call, and its message.
    asked: [(&'static str, Vec<u8>); 2],
}

impl Attacked {
    async fn start() -> Self {
        let folder = Home::new();
        let socket = folder.path().join("simd.sock");
        let config = ["--name", "unread", "--config", "tests/assets/demo.toml", "--unix-socket"];
        let flags = config.map(str::to_owned).into_iter().chain([socket.display().to_string()]);
        let daemon = Process::start_with(["--zenoh", "tcp/127.0.0.1:0"], flags).await;
        let client = daemon.client().await;
        let points = vec![0.5_f32; ANSWER / 4 / 6 * 6];
        let lines = MarkerLines { points, ..Default::default() };
        let marker = Marker { shape: Some(marker::Shape::Lines(lines)), ..Default::default() };
        client.add_markers([marker], false).await.unwrap();
        let data: Vec<u8> = (0..ANSWER).map(|index| ((index * index) >> 7) as u8).collect();
        let (sha256, total_bytes) = (Sha256::of(&data).to_string(), data.len() as u64);
        let asset = GetAssetRequest { sha256: sha256.clone(), ..Default::default() };
        let upload = UploadAssetRequest { sha256, total_bytes, data, ..Default::default() };
        call(&daemon, "/simd.v1.EntityService/UploadAsset", upload.encode_to_vec()).await;
        let asked = [
            ("/simd.v1.ViewService/ListMarkers", Vec::new()),
            ("/simd.v1.EntityService/GetAsset", asset.encode_to_vec()),
        ];
        // The memory that an answer needs while it is made is allocated before.
        client.markers().await.unwrap();
        let quiet = resident(&daemon);
        Self { daemon, socket, _folder: folder, quiet, asked }
    }

    /// Returns once this many calls have ended; fails if they take more than `MAX`.
    async fn withstands(&mut self, calls: u32) {
        let client = self.daemon.client().await;
        let ended = async {
            while ended(&self.daemon).await < u64::from(calls) {
                tokio::task::yield_now().await;
            }
        };
        soon("the calls of those who do not read", ended).await;
        let grown = resident(&self.daemon).saturating_sub(self.quiet);
        assert!(grown < MAX, "{} MiB above the quiet daemon", grown >> 20);
        works(&client).await;
        works(&Client::connect(&format!("unix:{}", self.socket.display())).await.unwrap()).await;
    }
}

async fn call(daemon: &Process, path: &'static str, message: Vec<u8>) {
    let endpoint = tonic::transport::Endpoint::from_shared(daemon.endpoint.clone()).unwrap();
    let mut grpc = tonic::client::Grpc::new(endpoint.connect().await.unwrap());
    grpc.ready().await.unwrap();
    let request = tonic::Request::new(message.into());
    grpc.unary(request, PathAndQuery::from_static(path), RawCodec).await.unwrap();
}

async fn works(client: &Client) {
    client.set_robot_targets("bench_arm", [joint_target("shoulder", Target::position(0.1))]).await.unwrap();
}

/// Bytes that a process has in memory.
fn resident(daemon: &Process) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", daemon.pid().unwrap())).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() << 10
}

async fn metrics(daemon: &Process) -> String {
    simd_tests::http::get(daemon.address().parse().unwrap(), "/metrics", &[]).await.text()
}

/// Bytes of answers that clients have yet to read.
async fn unread(daemon: &Process) -> u64 {
    let metrics = metrics(daemon).await;
    let bytes = metrics.lines().find_map(|line| line.strip_prefix("simd_unread_answers_bytes "));
    bytes.unwrap().parse::<f64>().unwrap() as u64
}

/// Returns how many of the repeated calls have ended.
async fn ended(daemon: &Process) -> u64 {
    let metrics = metrics(daemon).await;
    let of_call = |line: &&str| {
        line.starts_with("simd_calls_total{")
            && ["ViewService/ListMarkers", "EntityService/GetAsset"].iter().any(|call| line.contains(call))
    };
    let counts = metrics.lines().filter(of_call).map(|line| line.rsplit(' ').next().unwrap().parse::<u64>());
    counts.map(Result::unwrap).sum()
}

/// Returns a message as gRPC frames it.
fn framed(message: &[u8]) -> Vec<u8> {
    [&[0][..], &u32::try_from(message.len()).unwrap().to_be_bytes(), message].concat()
}

/// Sends all requests over HTTP/2, and reads nothing. Streams begin with this window.
async fn ask_http2(stream: &mut (impl AsyncWrite + Unpin), window: u32, asked: &[(&str, Vec<u8>)]) {
    const INITIAL_WINDOW_SIZE: u16 = 4;
    let setting = [&INITIAL_WINDOW_SIZE.to_be_bytes()[..], &window.to_be_bytes()].concat();
    let window_update = frame(8, 0, 0, &0x7fff_0000_u32.to_be_bytes());
    let mut sent = [PREFACE, &frame(SETTINGS, 0, 0, &setting), &window_update].concat();
    for number in 0..CALLS {
        let (path, message) = &asked[number as usize % asked.len()];
        let id = 2 * number + 1;
        sent.extend(frame(HEADERS, END_HEADERS, id, &headers_of(path)));
        sent.extend(frame(DATA, END_STREAM, id, &framed(message)));
    }
    stream.write_all(&sent).await.unwrap();
}

/// Connections, which stay open as long as this exists.
type Held = Vec<Box<dyn AsyncRead + Send>>;

/// Sends the requests over HTTP/1.1, each on a separate connection, and reads nothing.
async fn ask_http1(daemon: &Process, media_type: &str, calls: u32, asked: &[(&str, Vec<u8>)]) -> Held {
    let mut held: Held = Vec::new();
    for number in 0..calls as usize {
        let (path, message) = &asked[number % asked.len()];
        let message = match media_type {
            "application/json" => in_json(path, message),
            _ if media_type.contains("text") => base64(&framed(message)),
            _ => framed(message),
        };
        let length = message.len();
        let head = format!(
            "POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: {media_type}\r\nContent-Length: {length}\r\n\r\n"
        );
        let mut stream = TcpStream::connect(daemon.address()).await.unwrap();
        stream.write_all(&[head.as_bytes(), &message].concat()).await.unwrap();
        held.push(Box::new(stream));
    }
    held
}

fn in_json(path: &str, message: &[u8]) -> Vec<u8> {
    let (service, method) = methods::parse_path(path).unwrap();
    let method = methods::find(service, method).unwrap();
    json::to_json(&method.request, message.to_vec().into()).unwrap()
}

fn base64(bytes: &[u8]) -> Vec<u8> {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = |three: &[u8]| {
        let bits = (0..3).fold(0_u32, |bits, index| (bits << 8) | u32::from(*three.get(index).unwrap_or(&0)));
        let digit = |index: usize| match index <= three.len() {
            true => DIGITS[((bits >> (18 - 6 * index)) & 63) as usize],
            false => b'=',
        };
        [0, 1, 2, 3].map(digit)
    };
    bytes.chunks(3).flat_map(digits).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn grpc_answers_without_a_window_stay_within_their_budget() {
    let mut attacked = Attacked::start().await;
    let mut stream = TcpStream::connect(attacked.daemon.address()).await.unwrap();
    ask_http2(&mut stream, 0, &attacked.asked).await;
    attacked.withstands(CALLS).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn grpc_answers_with_large_windows_stay_within_their_budget() {
    let mut attacked = Attacked::start().await;
    let mut stream = TcpStream::connect(attacked.daemon.address()).await.unwrap();
    ask_http2(&mut stream, 0x7fff_ffff, &attacked.asked).await;
    attacked.withstands(CALLS).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn answers_at_a_unix_socket_stay_within_their_budget() {
    let mut attacked = Attacked::start().await;
    let mut stream = UnixStream::connect(&attacked.socket).await.unwrap();
    ask_http2(&mut stream, 0x7fff_ffff, &attacked.asked).await;
    attacked.withstands(CALLS).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn answers_to_pages_stay_within_their_budget() {
    let mut attacked = Attacked::start().await;
    let _held = ask_http1(&attacked.daemon, "application/grpc-web+proto", CALLS, &attacked.asked).await;
    attacked.withstands(CALLS).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn answers_to_pages_in_base64_stay_within_their_budget() {
    let mut attacked = Attacked::start().await;
    let _held = ask_http1(&attacked.daemon, "application/grpc-web-text+proto", CALLS, &attacked.asked).await;
    attacked.withstands(CALLS).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn answers_in_json_stay_within_their_budget() {
    let mut attacked = Attacked::start().await;
    // An answer in JSON is a third longer, and takes the daemon ten times as long.
    let calls = CALLS / 2;
    let _held = ask_http1(&attacked.daemon, "application/json", calls, &attacked.asked).await;
    attacked.withstands(calls).await;
}

/// Sends a body of a request in JSON, and returns the answer. A client that is refused while it sends may not read why.
async fn send_json(address: String, length: usize, body: Arc<[u8]>) -> String {
    let head = format!(
        "POST /simd.v1.ViewService/GetCameras HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
         Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n"
    );
    let mut stream = TcpStream::connect(address).await.unwrap();
    let mut answer = Vec::new();
    let _ = stream.write_all(head.as_bytes()).await;
    let _ = stream.write_all(&body).await;
    let _ = stream.read_to_end(&mut answer).await;
    String::from_utf8_lossy(&answer).into_owned()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn large_requests_in_json_that_never_end_stay_within_their_budget() {
    let attacked = Attacked::start().await;
    let address = attacked.daemon.address().to_string();
    let body: Arc<[u8]> = [&vec![b' '; REQUEST - 2][..], b"{}"].concat().into();
    let mut clients = tokio::task::JoinSet::new();
    for _ in 0..CALLS {
        clients.spawn(send_json(address.clone(), REQUEST + 1, Arc::clone(&body)));
    }
    for _ in 2..CALLS {
        let answer = soon("a refusal", clients.join_next()).await.unwrap().unwrap();
        assert!(answer.is_empty() || answer.contains("try again later"), "{answer}");
    }
    let grown = resident(&attacked.daemon).saturating_sub(attacked.quiet);
    assert!(grown < MAX, "{} MiB above the quiet daemon", grown >> 20);
    works(&json::client(address.parse().unwrap())).await;
    // Their share is free once they are gone.
    clients.abort_all();
    let taken = async {
        while !send_json(address.clone(), REQUEST, Arc::clone(&body)).await.starts_with("HTTP/1.1 200") {}
    };
    soon("the share of those who went", taken).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn replies_over_zenoh_stay_within_their_budget() {
    let mut attacked = Attacked::start().await;
    let stop = Arc::new(Notify::new());
    let proxy = network::stopping_proxy(attacked.daemon.locator.as_ref().unwrap(), stop.clone()).await;
    let asker = network::session("client", &proxy).await;
    stop.notify_one();
    let mut held = Vec::new();
    for number in 0..CALLS as usize {
        let (path, message) = &attacked.asked[number % attacked.asked.len()];
        let key = format!("simd/unread/rpc/{}", path.trim_start_matches("/simd.v1."));
        held.push(asker.get(key).payload(message.clone()).await.unwrap());
    }
    attacked.withstands(1).await;
    // The session is closed, and its unread data is dropped.
    let dropped = async { while unread(&attacked.daemon).await > 0 {} };
    soon("the end of the replies", dropped).await;
    attacked.withstands(1).await;
    stop.notify_one();
}
