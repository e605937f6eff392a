//! Calls in JSON as curl makes them, and the document that lists them.

use serde_json::{Value, json};
use simd_client::proto::ErrorReason;
use simd_proto::methods;
use simd_tests::daemon::{Daemon, Via};
use simd_tests::http::{Answer, get, send};

use crate::arm;

const JSON: [(&str, &str); 1] = [("content-type", "application/json")];
const STREAM: [(&str, &str); 1] = [("content-type", "application/connect+json")];

async fn post(daemon: &Daemon, method: &str, body: &str) -> Answer {
    send(daemon.address, "POST", &format!("/simd.v1.{method}"), &JSON, body.as_bytes()).await
}

fn read(answer: &Answer) -> Value {
    serde_json::from_str(&answer.text()).unwrap_or_else(|error| panic!("{error}: {}", answer.text()))
}

/// Returns a request or an answer in the form of streams.
fn framed(text: &str) -> Vec<u8> {
    [&[0], &u32::try_from(text.len()).unwrap().to_be_bytes()[..], text.as_bytes()].concat()
}

/// Returns flags and messages of a stream.
fn opened(mut bytes: &[u8]) -> Vec<(u8, Value)> {
    let mut messages = Vec::new();
    while let [flags, a, b, c, d, rest @ ..] = bytes {
        let (text, rest) = rest.split_at(u32::from_be_bytes([*a, *b, *c, *d]) as usize);
        messages.push((*flags, serde_json::from_slice(text).unwrap()));
        bytes = rest;
    }
    messages
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn targets_are_set_and_states_are_read_in_json() {
    let daemon = arm(Via::Grpc).await;
    let targets = json!({ "robots": [{ "robot": "arm", "joints": [{ "joint": "shoulder", "position": { "position": 0.5 } }] }] });
    let answer = post(&daemon, "JointService/SetJointTargets", &targets.to_string()).await;
    assert_eq!(
        (answer.status, answer.header("content-type")),
        (200, "application/json"),
        "{}",
        answer.text()
    );
    daemon.client.step(3000).await.unwrap();
    // No body at all is an empty message.
    let answer = post(&daemon, "JointService/GetJointStates", "").await;
    let states = read(&answer);
    let position = states["states"]["robots"][0]["position"][0].as_f64().unwrap();
    assert!((position - 0.5).abs() < 1e-3, "{states}");
    // Integers of 64 bits are text, as protobuf's JSON has it.
    assert_eq!(states["states"]["stamp"]["step"], "3000");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_error_has_the_code_and_the_reason_of_grpc_with_its_http_status() {
    let daemon = arm(Via::Grpc).await;
    let answer = post(&daemon, "JointService/GetJointLayout", r#"{"robot":"missing"}"#).await;
    let error = read(&answer);
    assert_eq!((answer.status, &error["code"]), (404, &json!("not_found")), "{error}");
    assert!(error["message"].as_str().unwrap().contains("missing"), "{error}");
    let details = error["details"].as_array().unwrap();
    assert!(details.iter().any(|detail| detail["type"] == "google.rpc.ErrorInfo"), "{error}");
    let by_client = simd_tests::json::client(daemon.address).joint_layout("missing").await.unwrap_err();
    assert_eq!(by_client.reason(), Some(ErrorReason::RobotNotFound), "{by_client}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_mistake_in_json_is_named_with_its_place() {
    let daemon = arm(Via::Grpc).await;
    for (body, part) in [
        (r#"{"robt":"arm"}"#, "robt"),
        (r#"{"robot":7}"#, "line 1"),
        ("{", "line 1"),
        (r#"{"robot":"arm"} {}"#, "trailing"),
        ("[]", "GetJointLayoutRequest"),
        ("\u{0}", "GetJointLayoutRequest"),
    ] {
        let answer = post(&daemon, "JointService/GetJointLayout", body).await;
        let error = read(&answer);
        assert_eq!((answer.status, &error["code"]), (400, &json!("invalid_argument")), "{body}: {error}");
        assert!(error["message"].as_str().unwrap().contains(part), "{body}: {error}");
    }
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    assert_eq!(post(&daemon, "JointService/GetJointLayout", &deep).await.status, 400);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_request_that_is_not_json_learns_what_to_send() {
    let daemon = arm(Via::Grpc).await;
    let path = "/simd.v1.JointService/GetJointStates";
    for headers in
        [&[][..], &[("content-type", "application/x-www-form-urlencoded")], &[("content-type", "text/plain")]]
    {
        let answer = send(daemon.address, "POST", path, headers, b"{}").await;
        assert_eq!(answer.status, 415, "{headers:?}");
        assert!(answer.text().contains("-H 'Content-Type: application/json'"), "{}", answer.text());
    }
    // A watch is a stream, and a method with a stream of requests has no JSON.
    for (method, part) in [
        ("JointService/WatchJointStates", "application/connect+json"),
        ("JointService/Control", "stream of requests"),
    ] {
        let answer = post(&daemon, method, "{}").await;
        let error = read(&answer);
        assert_eq!((answer.status, &error["code"]), (501, &json!("unimplemented")), "{error}");
        assert!(error["message"].as_str().unwrap().contains(part), "{error}");
    }
    for large in
        [format!(r#"{{"robot":"{}"}}"#, "x".repeat(17 << 20)), format!("[{}0]", "0,".repeat(600_000))]
    {
        let answer = post(&daemon, "JointService/GetJointLayout", &large).await;
        assert_eq!((answer.status, &read(&answer)["code"]), (429, &json!("resource_exhausted")));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stream_is_json_with_prefixes_and_ends_with_its_error() {
    let daemon = arm(Via::Grpc).await;
    let watch = "/simd.v1.JointService/WatchJointStates";
    // A busy machine may need longer than the first limit for its first state.
    let mut limit = 250;
    let messages = loop {
        let text = limit.to_string();
        let headers = [STREAM[0], ("connect-timeout-ms", &text)];
        let answer = send(daemon.address, "POST", watch, &headers, &framed("{}")).await;
        assert_eq!((answer.status, answer.header("content-type")), (200, "application/connect+json"));
        let messages = opened(&answer.body);
        let (flags, end) = messages.last().unwrap();
        assert_eq!((*flags, &end["error"]["code"]), (2, &json!("deadline_exceeded")), "{messages:?}");
        if messages.len() > 1 {
            break messages;
        }
        limit *= 2;
    };
    assert!(messages[0].0 == 0 && messages[0].1["states"]["robots"][0]["robot"] == "arm", "{messages:?}");

    for body in
        [&b""[..], b"{}", &framed("{")[..], &[1, 0, 0, 0, 2, b'{', b'}'], &[0, 255, 255, 255, 255, b'{']]
    {
        let answer = send(daemon.address, "POST", watch, &STREAM, body).await;
        let messages = opened(&answer.body);
        let code = &messages[0].1["error"]["code"];
        assert_eq!((answer.status, messages[0].0), (200, 2), "{body:?}");
        assert!(code == "invalid_argument" || code == "unimplemented", "{body:?}: {messages:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn pages_of_other_sites_cannot_call_in_json() {
    let daemon = arm(Via::Grpc).await;
    let path = "/simd.v1.JointService/GetJointStates";
    for headers in [("origin", "http://evil.example"), ("host", "evil.example")] {
        let answer = send(daemon.address, "POST", path, &[JSON[0], headers], b"{}").await;
        assert_eq!(answer.status, 403, "{headers:?}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn openapi_lists_each_method_and_a_page_calls_them() {
    let daemon = arm(Via::Grpc).await;
    let document = read(&get(daemon.address, "/openapi.json", &[]).await);
    let paths = document["paths"].as_object().unwrap();
    for (_, _, method) in methods::all() {
        assert_eq!(paths.contains_key(&method.path), !method.takes_many, "{}", method.path);
    }
    // Each reference leads somewhere.
    let schemas = document["components"]["schemas"].as_object().unwrap();
    let text = document.to_string();
    for part in text.split("#/components/schemas/").skip(1) {
        let name = part.split('"').next().unwrap();
        assert!(schemas.contains_key(name), "{name}");
    }
    let page = get(daemon.address, "/api/", &[]).await;
    assert!(page.text().contains("api.js") && page.header("content-security-policy").contains("'self'"));
    for path in ["/api/api.js", "/api/api.css"] {
        assert_eq!(get(daemon.address, path, &[]).await.status, 200, "{path}");
    }
    assert_eq!(get(daemon.address, "/api", &[]).await.header("location"), "/api/");
}
