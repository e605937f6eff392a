//! The deadline that a client gives its call: the daemon answers with status 4, and works no longer.

use prost::Message as _;
use simd_client::proto::{NextInputRequest, WatchEventsRequest};
use simd_tests::process::soon;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

use crate::floods::{DATA, END_HEADERS, END_STREAM, HEADERS, PREFACE, SETTINGS, frame, headers_of};

/// The header `grpc-status: 4`, as HPACK has its texts (RFC 7541, appendix B), each after its length.
const STATUS_4: [u8; 11] = [0x88, 0x9a, 0xca, 0xc8, 0xb2, 0x12, 0x34, 0xda, 0x8f, 0x81, 0x6b];

/// Makes a call with a deadline of 100 ms, and waits for status 4. The bytes are HTTP/2, since the timer of
/// our client would answer in the daemon's place.
async fn ends_with_status_4(path: &str, request: &[u8]) {
    let daemon = crate::paused().await;
    let text = |text: &[u8]| [&[u8::try_from(text.len()).unwrap()][..], text].concat();
    let deadline = [vec![0x00], text(b"grpc-timeout"), text(b"100m")].concat();
    let headers = [headers_of(path), deadline].concat();
    let length = u32::try_from(request.len()).unwrap().to_be_bytes();
    let message = [&[0][..], &length, request].concat();
    let mut connection = TcpStream::connect(daemon.address()).await.unwrap();
    let sent = [
        PREFACE.to_vec(),
        frame(SETTINGS, 0, 0, &[]),
        frame(HEADERS, END_HEADERS, 1, &headers),
        frame(DATA, END_STREAM, 1, &message),
    ];
    connection.write_all(&sent.concat()).await.unwrap();
    let mut answer = Vec::new();
    soon("the status", async {
        while !answer.windows(STATUS_4.len()).any(|window| window == STATUS_4) {
            assert_ne!(connection.read_buf(&mut answer).await.unwrap(), 0, "{answer:02x?}");
        }
    })
    .await;
}

#[tokio::test]
async fn a_call_beyond_its_deadline_ends_with_status_4() {
    // No page is open that has keys.
    let request = NextInputRequest { after_sequence: Some(0), timeout: 60.0 };
    ends_with_status_4("/simd.v1.ViewService/NextInput", &request.encode_to_vec()).await;
}

#[tokio::test]
async fn a_stream_beyond_its_deadline_ends_with_status_4() {
    let request = WatchEventsRequest::default();
    ends_with_status_4("/simd.v1.EventService/WatchEvents", &request.encode_to_vec()).await;
}
