//! Floods of HTTP/2 that none of our clients makes: frames byte for byte. Their sender is disconnected, and
//! others are served.

use simd_tests::http;
use simd_tests::process::{Process, soon};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

pub(crate) const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
// Kinds of frames, and their flags (RFC 9113, section 6).
pub(crate) const DATA: u8 = 0;
pub(crate) const HEADERS: u8 = 1;
const RST_STREAM: u8 = 3;
pub(crate) const SETTINGS: u8 = 4;
const PING: u8 = 6;
const CONTINUATION: u8 = 9;
pub(crate) const END_STREAM: u8 = 1;
pub(crate) const END_HEADERS: u8 = 4;
/// Maximum bytes of a flood: nearly a million frames, hundreds of times as many as end a connection.
const MAX: usize = 8 << 20;

pub(crate) fn frame(kind: u8, flags: u8, stream: u32, payload: &[u8]) -> Vec<u8> {
    let length = u32::try_from(payload.len()).unwrap().to_be_bytes();
    [&length[1..], &[kind, flags], &stream.to_be_bytes(), payload].concat()
}

fn headers() -> Vec<u8> {
    headers_of("/simd.v1.SimulationService/GetSimulatorInfo")
}

/// Returns a header block without compression (RFC 7541): POST of a call's path.
pub(crate) fn headers_of(path: &str) -> Vec<u8> {
    let text = |name: &[u8], bytes: &[u8]| [name, &[u8::try_from(bytes.len()).unwrap()], bytes].concat();
    // Names by their places in the static table: :method POST, :scheme http, :path, :authority, content-type.
    let fields = [
        vec![0x83, 0x86],
        text(&[0x04], path.as_bytes()),
        text(&[0x01], b"localhost"),
        text(&[0x0f, 0x10], b"application/grpc"),
    ];
    fields.concat()
}

/// Sends the beginning and then the frames that `next` makes, until the daemon closes the connection or all
/// are sent. Returns true if it closed it.
async fn flood(daemon: &Process, mut next: impl FnMut(u32) -> Vec<u8>) -> bool {
    let stream = TcpStream::connect(daemon.address()).await.unwrap();
    let (mut from, mut to) = stream.into_split();
    to.write_all(&[PREFACE, &frame(SETTINGS, 0, 0, &[])].concat()).await.unwrap();
    // Reads the daemon's output, so that a full buffer is not the reason to stop.
    let listening = async {
        let mut answer = vec![0; 65_536];
        while !matches!(from.read(&mut answer).await, Ok(0) | Err(_)) {}
    };
    let sending = async {
        let (mut sent, mut number) = (0, 0);
        while sent < MAX {
            let mut part = Vec::new();
            while part.len() < 65_536 {
                part.extend(next(number));
                number += 1;
            }
            sent += part.len();
            if to.write_all(&part).await.is_err() {
                return true;
            }
        }
        false
    };
    soon("the end of a flood", async {
        tokio::select! {
            () = listening => true,
            had_enough = sending => had_enough,
        }
    })
    .await
}

async fn is_well(daemon: &mut Process) {
    let client = daemon.client().await;
    assert_eq!(client.robots().await.unwrap().len(), 1);
}

/// Returns the number of a client's stream: odd and increasing.
fn stream(number: u32) -> u32 {
    2 * number + 1
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn calls_that_are_reset_as_soon_as_they_are_made_end_their_connection() {
    let mut daemon = crate::demo().await;
    let headers = headers();
    let had_enough = flood(&daemon, |number| {
        let stream = stream(number);
        // CANCEL.
        let reset = frame(RST_STREAM, 0, stream, &[0, 0, 0, 8]);
        [frame(HEADERS, END_HEADERS, stream, &headers), reset].concat()
    })
    .await;
    assert!(had_enough);
    is_well(&mut daemon).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn headers_without_an_end_end_their_connection() {
    let mut daemon = crate::demo().await;
    // A header that is not indexed: its name, and its value of 1,000 bytes.
    let value = [b'v'; 1000];
    let one = [&[0x00, 0x01, b'n', 0x7f, 0xe9, 0x06][..], &value[..]].concat();
    let headers = headers();
    let had_enough = flood(&daemon, |number| match number {
        0 => frame(HEADERS, 0, 1, &headers),
        _ => frame(CONTINUATION, 0, 1, &one),
    })
    .await;
    assert!(had_enough);
    is_well(&mut daemon).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn frames_that_ask_for_answers_and_nothing_else_do_no_harm() {
    let mut daemon = crate::demo().await;
    for (kind, payload) in [(PING, vec![0; 8]), (SETTINGS, Vec::new())] {
        // Each is answered: a daemon may take them for as long as the answers are read.
        flood(&daemon, |_| frame(kind, 0, 0, &payload)).await;
        is_well(&mut daemon).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn empty_parts_of_a_message_do_no_harm() {
    let mut daemon = crate::demo().await;
    let headers = headers();
    flood(&daemon, |number| match number {
        0 => frame(HEADERS, END_HEADERS, 1, &headers),
        _ => frame(DATA, 0, 1, &[]),
    })
    .await;
    is_well(&mut daemon).await;
    // As a call, the message that ends it has no bytes.
    flood(&daemon, |number| frame(HEADERS, END_HEADERS | END_STREAM, stream(number), &headers)).await;
    is_well(&mut daemon).await;
}

/// A message is never decompressed, so it cannot become larger than it is.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn compressed_messages_are_refused_by_a_sentence() {
    let mut daemon = crate::demo().await;
    let address = daemon.address().parse().unwrap();
    let packed = [1, 0, 0, 0, 4, 0x1f, 0x8b, 0x08, 0x00];
    for encoding in ["gzip", "deflate", "zstd", "identity"] {
        let headers = [("Content-Type", "application/grpc-web+proto"), ("grpc-encoding", encoding)];
        let path = "/simd.v1.SimulationService/GetSimulatorInfo";
        let answer = http::send(address, "POST", path, &headers, &packed).await;
        let status = answer.header("grpc-status").to_owned();
        let said = if status.is_empty() { answer.text() } else { status };
        // UNIMPLEMENTED for compressed messages, INVALID_ARGUMENT for a false flag.
        let expected = if encoding == "identity" { "3" } else { "12" };
        assert!(said.contains(expected), "{encoding}: {said:?}");
    }
    is_well(&mut daemon).await;
}
