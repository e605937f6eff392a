//! Every Zenoh key of simd, built and parsed: the one place that knows their form.
//!
//! | key | what |
//! |---|---|
//! | `simd/NAME/rpc/SERVICE/METHOD` | a queryable for each method of `simd.v1` |
//! | `simd/NAME/joint_states/ROBOT` | publications of states |
//! | `simd/NAME/link_poses/ROBOT` | publications of poses |
//! | `simd/NAME/sensor_readings/ROBOT/SENSOR` | publications of readings |
//! | `simd/NAME/pictures/ROBOT/SENSOR` | publications of a camera's pictures |
//! | `simd/NAME/world_statistics` | publications, ten a second |
//! | `simd/NAME/events` | publications |
//! | `simd/NAME/parameters` | publications |
//! | `simd/NAME/joint_targets` | targets that the daemon subscribes to |
//! | `@simd/daemons/NAME/ZID` | a liveliness token for each daemon |
//!
//! NAME is the daemon's, of `[A-Za-z0-9_-]+`. ROBOT is a robot's and SENSOR a sensor's, of letters and digits of any
//! script, `_` and `-`. So none can reach into another's keys. Wildcards never match a chunk that begins with `@`: a subscription to everything does
//! not receive the tokens.

/// Default name of a daemon.
pub const DEFAULT_NAME: &str = "simd";

/// Default locator at which a daemon listens for Zenoh.
pub const DEFAULT_LOCATOR: &str = "tcp/127.0.0.1:7447";

/// Encoding of a refusal, which is a `google.rpc.Status`.
pub const STATUS_ENCODING: &str = "application/protobuf;google.rpc.Status";

/// Maximum length of a daemon's name.
const MAX_NAME: usize = 64;

/// Returns whether the text is a valid name of a daemon: 1 to 64 of `A-Z a-z 0-9 _ -`.
pub fn is_daemon_name(text: &str) -> bool {
    text.len() <= MAX_NAME && is_word(text)
}

fn is_word(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-'))
}

/// Returns the key of one method, by its names in the schema: `JointService`, `GetJointStates`.
pub fn rpc(daemon: &str, service: &str, method: &str) -> String {
    format!("simd/{daemon}/rpc/{service}/{method}")
}

/// Returns a key expression that matches all methods.
pub fn every_rpc(daemon: &str) -> String {
    rpc(daemon, "*", "*")
}

/// Returns service and method of a key. `None` if it is not the key of a method, or has a wildcard.
pub fn parse_rpc(key: &str) -> Option<(&str, &str)> {
    let mut chunks = key.split('/');
    if chunks.next() != Some("simd") || !chunks.next().is_some_and(is_word) || chunks.next() != Some("rpc") {
        return None;
    }
    let service = chunks.next().filter(|chunk| is_word(chunk))?;
    let method = chunks.next().filter(|chunk| is_word(chunk))?;
    chunks.next().is_none().then_some((service, method))
}

/// Returns the key of one robot's joint states.
pub fn joint_states(daemon: &str, robot: &str) -> String {
    format!("simd/{daemon}/joint_states/{robot}")
}

/// Returns the key of one robot's link poses.
pub fn link_poses(daemon: &str, robot: &str) -> String {
    format!("simd/{daemon}/link_poses/{robot}")
}

/// Returns the key of one sensor's readings.
pub fn sensor_readings(daemon: &str, robot: &str, sensor: &str) -> String {
    format!("simd/{daemon}/sensor_readings/{robot}/{sensor}")
}

/// Returns the key of one camera's pictures.
pub fn pictures(daemon: &str, robot: &str, sensor: &str) -> String {
    format!("simd/{daemon}/pictures/{robot}/{sensor}")
}

/// Returns the key of the world's statistics.
pub fn world_statistics(daemon: &str) -> String {
    format!("simd/{daemon}/world_statistics")
}

/// Returns the key of the daemon's events.
pub fn events(daemon: &str) -> String {
    format!("simd/{daemon}/events")
}

/// Returns the key of sliders and buttons.
pub fn parameters(daemon: &str) -> String {
    format!("simd/{daemon}/parameters")
}

/// Returns the key at which the daemon takes joint targets without an answer.
pub fn joint_targets(daemon: &str) -> String {
    format!("simd/{daemon}/joint_targets")
}

/// Returns the key of a daemon's liveliness token; `zid` is the id of its session.
pub fn daemon(name: &str, zid: &str) -> String {
    format!("@simd/daemons/{name}/{zid}")
}

/// Returns a key expression that matches the tokens of all daemons.
pub fn every_daemon() -> String {
    daemon("*", "*")
}

/// Returns a key expression that matches the tokens of all daemons with one name; there should be one.
pub fn daemons_named(name: &str) -> String {
    daemon(name, "*")
}

/// Parses a daemon's name and its session's id. `None` if the key is not a daemon's token.
pub fn parse_daemon(key: &str) -> Option<(&str, &str)> {
    let (name, zid) = key.strip_prefix("@simd/daemons/")?.split_once('/')?;
    (is_daemon_name(name) && is_session_id(zid)).then_some((name, zid))
}

/// Returns the key of the liveliness token of a daemon's client; `zid` is the id of the client's session.
pub fn client(daemon: &str, zid: &str) -> String {
    format!("@simd/clients/{daemon}/{zid}")
}

/// Returns a key expression that matches the tokens of all clients of a daemon.
pub fn every_client(daemon: &str) -> String {
    client(daemon, "*")
}

/// Returns the session id of a client of this daemon. `None` if the key is not a token of a client.
pub fn parse_client<'a>(daemon: &str, key: &'a str) -> Option<&'a str> {
    let zid = key.strip_prefix("@simd/clients/")?.strip_prefix(daemon)?.strip_prefix('/')?;
    is_session_id(zid).then_some(zid)
}

/// Returns whether the text is a session id as Zenoh writes it: up to 16 bytes in lowercase hexadecimal, and
/// not zero.
fn is_session_id(text: &str) -> bool {
    let is_digit = |byte: u8| matches!(byte, b'0'..=b'9' | b'a'..=b'f');
    (1..=32).contains(&text.len()) && !text.starts_with('0') && text.bytes().all(is_digit)
}

/// Returns the encoding of a message of `simd.v1`, by its name without the package.
pub fn encoding(message: &str) -> String {
    format!("application/protobuf;simd.v1.{message}")
}

/// Returns the attachment of a query or a publication: lines of `NAME: VALUE`, for the contents of gRPC
/// headers.
pub fn attachment<'a>(headers: impl IntoIterator<Item = (&'a str, &'a str)>) -> String {
    let lines: Vec<String> = headers.into_iter().map(|(name, value)| format!("{name}: {value}")).collect();
    lines.join("\n")
}

/// Returns the value of an attachment's line with this name: all after the colon.
pub fn parse_attachment<'a>(text: &'a str, header: &str) -> Option<&'a str> {
    let mut lines = text.lines().filter_map(|line| line.split_once(':'));
    lines.find_map(|(name, said)| name.trim().eq_ignore_ascii_case(header).then_some(said.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_methods_key_reads_back() {
        let key = rpc("lab-2", "JointService", "GetJointStates");
        assert_eq!(key, "simd/lab-2/rpc/JointService/GetJointStates");
        assert_eq!(parse_rpc(&key), Some(("JointService", "GetJointStates")));
    }

    #[test]
    fn other_keys_name_no_method() {
        for key in [
            "",
            "simd/lab/rpc/JointService",
            "simd/lab/rpc/JointService/Get/Twice",
            "simd/lab/rpc/*/GetJointStates",
            "simd/lab/rpc/JointService/**",
            "simd/*/rpc/JointService/GetJointStates",
            "simd/lab/joint_states/arm",
            "other/lab/rpc/JointService/GetJointStates",
            "simd//rpc/JointService/GetJointStates",
        ] {
            assert_eq!(parse_rpc(key), None, "{key}");
        }
    }

    #[test]
    fn publications_are_below_the_daemons_name() {
        assert_eq!(joint_states("lab", "arm"), "simd/lab/joint_states/arm");
        assert_eq!(link_poses("lab", "arm"), "simd/lab/link_poses/arm");
        assert_eq!(pictures("lab", "arm", "eye"), "simd/lab/pictures/arm/eye");
        assert_eq!(sensor_readings("lab", "arm", "wrist"), "simd/lab/sensor_readings/arm/wrist");
        assert_eq!(world_statistics("lab"), "simd/lab/world_statistics");
        assert_eq!(events("lab"), "simd/lab/events");
        assert_eq!(parameters("lab"), "simd/lab/parameters");
        assert_eq!(joint_targets("lab"), "simd/lab/joint_targets");
        assert_eq!(every_rpc("lab"), "simd/lab/rpc/*/*");
    }

    #[test]
    fn a_token_reads_back_and_begins_where_no_wildcard_reaches() {
        let key = daemon("lab", "3f9a");
        assert!(key.starts_with('@'));
        assert_eq!(parse_daemon(&key), Some(("lab", "3f9a")));
        assert_eq!(every_daemon(), "@simd/daemons/*/*");
        assert_eq!(daemons_named("lab"), "@simd/daemons/lab/*");
        for key in ["@simd/daemons/lab", "@simd/daemons/*/*", "@simd/daemons/lab/1/2", "simd/daemons/lab/1"] {
            assert_eq!(parse_daemon(key), None, "{key}");
        }
        for zid in ["", "x", "0", "03f9a", "3F9A", "3f9a-", &"1".repeat(33)] {
            assert_eq!(parse_daemon(&daemon("lab", zid)), None, "{zid}");
        }
        assert_eq!(parse_daemon(&daemon(&"a".repeat(65), "3f9a")), None);
    }

    #[test]
    fn names_are_words_of_at_most_64() {
        assert!(is_daemon_name("simd") && is_daemon_name("Lab_2-b") && is_daemon_name(&"a".repeat(64)));
        for name in ["", "a/b", "a b", "*", "@a", "$a", "ä", &"a".repeat(65)] {
            assert!(!is_daemon_name(name), "{name}");
        }
    }

    #[test]
    fn headers_are_lines_of_the_attachment() {
        let version = crate::API_VERSION.to_string();
        let said =
            attachment([(crate::API_VERSION_HEADER, version.as_str()), (crate::CLIENT_HEADER, "bench: a")]);
        assert_eq!(said, "simd-api-version: 1.0\nsimd-client: bench: a");
        assert_eq!(parse_attachment(&said, crate::API_VERSION_HEADER), Some("1.0"));
        assert_eq!(parse_attachment(&said, crate::CLIENT_HEADER), Some("bench: a"));
        let read = |text| parse_attachment(text, crate::API_VERSION_HEADER);
        assert_eq!(read("trace: 7\nSimd-Api-Version:9.9\n"), Some("9.9"));
        assert_eq!(read("simd-api-version: soon"), Some("soon"));
        for text in ["", "1.0", "trace: 7"] {
            assert_eq!(parse_attachment(text, crate::API_VERSION_HEADER), None, "{text}");
        }
    }

    #[test]
    fn encodings_name_the_message() {
        assert_eq!(encoding("JointStates"), "application/protobuf;simd.v1.JointStates");
    }
}
