//! Settings of the Zenoh session that follow from the configuration.
//!
//! Zenoh's own defaults are open: it looks for others by multicast, listens on every address, and takes
//! messages of a gibibyte. The daemon's defaults are closed, and the operator's file can override any of
//! them.

use std::path::Path;

use serde_json::{Map, Value, json};
use simd_assets::files;

use super::super::TlsFiles;
use super::{Zenoh, is_loopback};

/// Maximum size of the operator's file, bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Maximum message size, bytes: larger ones are refused before they are read, so that an untrusted client
/// cannot fill the memory.
const MAX_MESSAGE_BYTES: u64 = 64 * 1024 * 1024;
/// Time without a sign of life after which a session counts as gone: its queries and its token end.
const LEASE_MS: u64 = 5_000;
/// Longest wait of a reply for a session that does not read; then the session is closed.
const REPLY_WAIT_US: u64 = 500_000;
/// Longest time for a client to open a session; further pending sessions above a number are closed at once.
/// So silent connections keep others out at most for this time. Zenoh counts all clients together, so the
/// time is short and the number large.
const ACCEPT_MS: u64 = 5_000;
const ACCEPT_PENDING: usize = 128;
/// Maximum number of sessions. With the connections of gRPC and HTTP they are fewer than the 1024 files that
/// a process may usually open.
const MAX_SESSIONS: usize = 200;
/// Longest wait of a start for the given routers.
const CONNECT_MS: i64 = 2_000;

impl Zenoh {
    /// Returns all settings of the session. The error is a sentence.
    pub(crate) fn settings(&self) -> Result<zenoh::Config, String> {
        let mut settings = self.ours();
        let mut whose = "the settings of Zenoh".to_owned();
        if let Some(path) = &self.file {
            whose = format!("Zenoh's settings in {}", path.display());
            merge(&mut settings, read(path)?);
        }
        zenoh::Config::from_json5(&settings.to_string())
            .map_err(|error| format!("{whose} are refused: {}", one_line(&error.to_string())))
    }

    /// Returns the daemon's defaults. Routers relay between clients, and not between peers. So a daemon that
    /// joins one and listens nowhere is its client, and daemons see each other's names.
    fn ours(&self) -> Value {
        let is_client = !self.connect.is_empty() && self.listens_on().is_empty();
        let (mode, connect_ms) = if is_client { ("client", CONNECT_MS) } else { ("peer", -1) };
        json!({
            "mode": mode,
            "listen": { "endpoints": self.listens_on(), "timeout_ms": 0, "exit_on_failure": true },
            "connect": {
                "endpoints": self.connect, "timeout_ms": connect_ms, "exit_on_failure": is_client,
                "retry": { "period_init_ms": 100, "period_max_ms": 1000 },
            },
            "scouting": {
                // Longest wait of a start for its routers, despite Zenoh's name for it.
                "delay": CONNECT_MS,
                "multicast": { "enabled": false },
                "gossip": { "enabled": false },
            },
            // A reply has the priority of its query. It has a separate queue from publications, which must
            // not wait for it.
            "qos": { "network": [{
                "messages": ["query"], "flows": ["ingress"], "overwrite": { "priority": "data_high" },
            }] },
            "adminspace": { "enabled": false },
            "timestamping": { "enabled": false },
            "transport": {
                "unicast": {
                    "lowlatency": false,
                    "accept_timeout": ACCEPT_MS, "accept_pending": ACCEPT_PENDING,
                    "max_sessions": MAX_SESSIONS,
                },
                "link": {
                    "tx": {
                        "lease": LEASE_MS,
                        "queue": { "congestion_control": { "block": { "wait_before_close": REPLY_WAIT_US } } },
                    },
                    "rx": { "max_message_size": MAX_MESSAGE_BYTES },
                    "tls": self.tls_settings(),
                },
                "shared_memory": { "enabled": false },
            },
        })
    }

    fn tls_settings(&self) -> Value {
        let Some(TlsFiles { certificate, key, client_authorities }) = &self.tls else { return json!({}) };
        let mut settings = json!({ "listen_certificate": certificate, "listen_private_key": key });
        if let Some(authorities) = client_authorities {
            merge(&mut settings, json!({ "enable_mtls": true, "root_ca_certificate": authorities }));
        }
        settings
    }

    /// Checks that Zenoh accepts the settings, and that they are safe. An address that others can reach
    /// requires `insecure`, or tokens for calls and certificates for sessions, since publications go to every
    /// session. Routers of other machines require `insecure`, or TLS and tokens for calls.
    pub(in crate::config) fn check(&self, insecure: bool, has_tokens: bool) -> Result<(), String> {
        if !self.enabled {
            return Ok(());
        }
        let settings = self.settings()?;
        if insecure {
            return Ok(());
        }
        // Effective values, from any source.
        let value = |key: &str| -> Result<Value, String> {
            let text = settings.get_json(key).map_err(|error| format!("{key} of Zenoh: {error}"))?;
            serde_json::from_str(&text).map_err(|error| format!("{key} of Zenoh: {error}"))
        };
        let elsewhere = |key: &str| -> Result<Vec<String>, String> {
            let all = strings(&value(key)?);
            Ok(all.into_iter().filter(|locator| !is_loopback(locator)).collect())
        };
        // Settings of the locator itself, after #, may undo the protection of TLS.
        let is_private =
            |locator: &str| has_tokens && locator.split('/').next() == Some("tls") && !locator.contains('#');
        let tls = value("transport/link/tls")?;
        let has_authority =
            ["root_ca_certificate", "root_ca_certificate_base64"].iter().any(|key| tls[*key].is_string());
        let has_certificates = tls["enable_mtls"] == true && has_authority;
        let is_closed = |locator: &str| has_certificates && is_private(locator);
        for found in ["multicast", "gossip"] {
            if value(&format!("scouting/{found}/enabled"))? == true {
                return Err(format!(
                    "scouting.{found} joins whatever it finds on the network, and anyone there commands the robots: switch it \
                     off, or use --insecure"
                ));
            }
        }
        if let Some(locator) = elsewhere("listen/endpoints")?.iter().find(|locator| !is_closed(locator)) {
            return Err(format!(
                "{locator} can be reached from other machines: give --tokens, --tls-certificate, --tls-key and \
                 --tls-client-authorities, and listen on tls/ADDRESS:PORT; or \
                 listen on tcp/127.0.0.1:7447, or use --insecure, with which anyone who reaches it reads its \
                 states"
            ));
        }
        match elsewhere("connect/endpoints")?.iter().find(|locator| !is_private(locator)) {
            Some(locator) => Err(format!(
                "the router {locator} is on another machine, and anyone who reaches it commands the robots: give --tokens, \
                 and connect to tls/ADDRESS:PORT; or use --insecure"
            )),
            None => Ok(()),
        }
    }
}

/// Returns every text in a value: endpoints are a list, or lists by mode.
fn strings(value: &Value) -> Vec<String> {
    match value {
        Value::String(text) => vec![text.clone()],
        Value::Array(items) => items.iter().flat_map(strings).collect(),
        Value::Object(fields) => fields.values().flat_map(strings).collect(),
        Value::Null | Value::Bool(_) | Value::Number(_) => Vec::new(),
    }
}

fn read(path: &Path) -> Result<Value, String> {
    let text = files::read_text(path, MAX_BYTES)
        .map_err(|error| format!("{} cannot be read: {error}", path.display()))?;
    let settings: Value = json5::from_str(&text)
        .map_err(|error| format!("{} is not JSON5: {}", path.display(), one_line(&error.to_string())))?;
    match settings {
        Value::Object(_) => Ok(settings),
        _ => Err(format!("{} is not a JSON5 object", path.display())),
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Merges settings field by field; `over` wins.
fn merge(under: &mut Value, over: Value) {
    match (under, over) {
        (Value::Object(under), Value::Object(over)) => merge_fields(under, over),
        (under, over) => *under = over,
    }
}

fn merge_fields(under: &mut Map<String, Value>, over: Map<String, Value>) {
    for (field, value) in over {
        merge(under.entry(field).or_insert(Value::Null), value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_file(text: &str) -> Result<zenoh::Config, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("zenoh.json5");
        std::fs::write(&path, text).unwrap();
        Zenoh { file: Some(path), ..Zenoh::default() }.settings()
    }

    fn value(settings: &zenoh::Config, key: &str) -> Value {
        serde_json::from_str(&settings.get_json(key).unwrap()).unwrap()
    }

    #[test]
    fn nothing_said_is_loopback_and_looks_for_no_peers() {
        let settings = Zenoh::default().settings().unwrap();
        assert_eq!(strings(&value(&settings, "listen/endpoints")), ["tcp/127.0.0.1:7447"]);
        for key in ["scouting/multicast/enabled", "scouting/gossip/enabled", "adminspace/enabled"] {
            assert_eq!(value(&settings, key), false, "{key}");
        }
        for key in ["transport/shared_memory/enabled", "transport/unicast/lowlatency"] {
            assert_eq!(value(&settings, key), false, "{key}");
        }
        assert_eq!(value(&settings, "transport/link/rx/max_message_size"), 64 * 1024 * 1024);
    }

    #[test]
    fn a_daemon_that_joins_a_router_need_not_listen() {
        let mut zenoh = Zenoh::default();
        zenoh.set_connect(vec!["tcp/10.0.0.1:7447".into()]).unwrap();
        assert!(zenoh.listens_on().is_empty());
        zenoh.set_listen(vec!["tcp/127.0.0.1:0".into()]).unwrap();
        assert_eq!(zenoh.listens_on(), ["tcp/127.0.0.1:0"]);
    }

    #[test]
    fn a_file_is_put_over_our_settings_field_by_field() {
        let settings =
            with_file("{ transport: { link: { tx: { lease: 1234 } } }, /* ours stay */ }").unwrap();
        assert_eq!(value(&settings, "transport/link/tx/lease"), 1234);
        assert_eq!(value(&settings, "transport/link/rx/max_message_size"), 64 * 1024 * 1024);
        assert_eq!(value(&settings, "scouting/multicast/enabled"), false);
    }

    #[test]
    fn a_slip_in_the_file_is_a_sentence_that_names_it() {
        for text in ["{ mode: ", "[]", "{ transprot: {} }", "{ mode: 'king' }"] {
            let sentence = with_file(text).unwrap_err();
            assert!(sentence.contains("zenoh.json5") && !sentence.contains('\n'), "{text}: {sentence}");
        }
    }

    #[test]
    fn a_file_that_opens_the_daemon_to_others_must_be_meant() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("open.json5");
        std::fs::write(&path, "{ listen: { endpoints: { peer: ['tcp/[::]:7447'] } } }").unwrap();
        let zenoh = Zenoh { file: Some(path), ..Zenoh::default() };
        assert!(zenoh.check(false, false).unwrap_err().contains("--insecure"));
        zenoh.check(true, false).unwrap();
    }

    #[test]
    fn a_router_of_another_machine_is_joined_by_tls_with_tokens_or_where_it_is_meant() {
        let joins = |router: &str| Zenoh { connect: vec![router.into()], ..Zenoh::default() };
        joins("tcp/127.0.0.1:7447").check(false, false).unwrap();
        joins("tls/lab:7447").check(false, true).unwrap();
        for (router, has_tokens) in [("tcp/10.0.0.1:7447", true), ("tls/lab:7447", false)] {
            let sentence = joins(router).check(false, has_tokens).unwrap_err();
            assert!(sentence.contains(router) && sentence.contains("--insecure"), "{sentence}");
            joins(router).check(true, has_tokens).unwrap();
        }
    }

    #[test]
    fn others_may_reach_it_where_sessions_need_certificates_and_calls_tokens() {
        let files = |client_authorities: Option<&str>| TlsFiles {
            certificate: "server.pem".into(),
            key: "server.key".into(),
            client_authorities: client_authorities.map(Into::into),
        };
        let mut zenoh = Zenoh { tls: Some(files(Some("ca.pem"))), ..Zenoh::default() };
        zenoh.set_listen(vec!["tls/0.0.0.0:7447".into()]).unwrap();
        zenoh.check(false, true).unwrap();
        assert!(zenoh.check(false, false).is_err(), "without tokens");
        let settings = zenoh.settings().unwrap();
        assert_eq!(value(&settings, "transport/link/tls/enable_mtls"), true);
        zenoh.tls = Some(files(None));
        assert!(zenoh.check(false, true).is_err(), "without certificates of clients");
        zenoh.tls = Some(files(Some("ca.pem")));
        zenoh.set_listen(vec!["tls/0.0.0.0:7447#enable_mtls=false".into()]).unwrap();
        assert!(zenoh.check(false, true).is_err(), "with a locator that takes it back");
        zenoh.set_listen(vec!["tls/0.0.0.0:7447".into()]).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("zenoh.json5");
        for text in [
            "{ transport: { link: { tls: { enable_mtls: false } } } }",
            "{ transport: { link: { tls: { root_ca_certificate: null } } } }",
            "{ scouting: { multicast: { enabled: true } } }",
            "{ scouting: { gossip: { enabled: true } } }",
        ] {
            std::fs::write(&path, text).unwrap();
            let with_file = Zenoh { file: Some(path.clone()), ..zenoh.clone() };
            assert!(with_file.check(false, true).is_err(), "{text}");
            with_file.check(true, true).unwrap();
        }
        zenoh.set_listen(vec!["tcp/0.0.0.0:7447".into()]).unwrap();
        assert!(zenoh.check(false, true).is_err(), "without TLS");
    }
}
