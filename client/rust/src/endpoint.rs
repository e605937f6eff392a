//! Parses the endpoint of a daemon.
//!
//! Endpoints are `host`, `host:port`, `http://host:port`, `https://host:port`, `unix:/path/of/its/socket`, or
//! the Zenoh locator `tcp/host:port`, with `#NAME` if several daemons are behind it.

use simd_proto::{DEFAULT_PORT, keys};

use crate::Error;

/// Protocols of Zenoh locators: the part before the `/`.
const ZENOH_PROTOCOLS: [&str; 9] =
    ["tcp", "tls", "udp", "quic", "ws", "serial", "vsock", "unixpipe", "unixsock-stream"];

/// Address of a daemon, with its transport.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum DaemonEndpoint {
    /// For gRPC. A daemon of another name is refused.
    Grpc { url: String, name: Option<String> },
    /// Locator of a daemon or of a router.
    Zenoh { locator: String, name: Option<String> },
}

/// Returns whether an endpoint is a Zenoh locator, and not a gRPC address.
pub fn is_zenoh(text: &str) -> bool {
    text.trim().split_once('/').is_some_and(|(protocol, _)| ZENOH_PROTOCOLS.contains(&protocol))
}

/// Parses an endpoint.
pub(crate) fn read(text: &str) -> Result<DaemonEndpoint, Error> {
    let trimmed = text.trim();
    let refuse = |reason: String| Error::Endpoint { endpoint: text.to_owned(), reason };
    let checked = |name: &str| match keys::is_daemon_name(name) {
        true => Ok(Some(name.to_owned())),
        false => Err(refuse(format!(
            "`{name}` is not a valid name of a daemon: use the characters A-Z a-z 0-9 _ -"
        ))),
    };
    if let Some(rest) = trimmed.strip_prefix("simd://") {
        let (host, name) = rest.split_once('/').unwrap_or((rest, ""));
        let name = if name.is_empty() { None } else { checked(name)? };
        return url(text, &format!("http://{host}")).map(|url| DaemonEndpoint::Grpc { url, name });
    }
    if !is_zenoh(trimmed) {
        return url(text, without_view(trimmed)).map(|url| DaemonEndpoint::Grpc { url, name: None });
    }
    if trimmed.contains("://") {
        return Err(refuse("a Zenoh locator has one slash, as in tcp/127.0.0.1:7447".to_owned()));
    }
    if lacks_port(trimmed) {
        let port = keys::DEFAULT_LOCATOR.rsplit(':').next().unwrap_or_default();
        let locator = trimmed.split(['#', '?']).next().unwrap_or(trimmed).trim_end_matches(':');
        return Err(refuse(format!("it has no port; with the default one it is {locator}:{port}")));
    }
    match trimmed.rsplit_once('#') {
        // Zenoh's own settings of a locator come after a # too, as KEY=VALUE.
        Some((locator, name)) if !name.contains('=') => {
            Ok(DaemonEndpoint::Zenoh { locator: locator.to_owned(), name: checked(name)? })
        }
        Some(_) | None => Ok(DaemonEndpoint::Zenoh { locator: trimmed.to_owned(), name: None }),
    }
}

/// Returns whether a locator lacks a port that its protocol needs.
fn lacks_port(locator: &str) -> bool {
    let Some((protocol, address)) = locator.split_once('/') else { return false };
    let address = address.split(['#', '?']).next().unwrap_or(address);
    let port = address.rsplit_once(':').map_or("", |(_, port)| port);
    let is_port = !port.is_empty() && port.bytes().all(|byte| byte.is_ascii_digit());
    ["tcp", "tls", "udp", "quic", "ws"].contains(&protocol) && !is_port
}

/// Returns the address of the page without its query and fragment, which say what it shows.
fn without_view(address: &str) -> &str {
    match address.starts_with("http://") || address.starts_with("https://") {
        true => address.split(['?', '#']).next().unwrap_or(address),
        false => address,
    }
}

/// The URL of the daemon at `trimmed`, which the user gave as `text`. The port may be left out.
fn url(text: &str, trimmed: &str) -> Result<String, Error> {
    let refuse = |reason: &str| Error::Endpoint { endpoint: text.to_owned(), reason: reason.to_owned() };
    if let Some(path) = trimmed.strip_prefix("unix:") {
        let path = path.strip_prefix("//").unwrap_or(path);
        return match path.is_empty() {
            true => Err(refuse("it names no socket, as in unix:/run/simd/simd.sock")),
            false => Ok(format!("unix:{path}")),
        };
    }
    let (scheme, authority) = match trimmed.split_once("://") {
        None => ("http", trimmed),
        Some((scheme @ ("http" | "https"), rest)) => (scheme, rest),
        Some(_) => return Err(refuse("the scheme must be simd, http or https")),
    };
    let authority = authority.trim_end_matches('/');
    if authority.is_empty() {
        return Err(refuse("it names no host"));
    }
    if authority.contains(['/', '@', '?', '#']) || authority.contains(char::is_whitespace) {
        return Err(refuse(
            "it must be HOST, HOST:PORT, simd://HOST:PORT, http://HOST:PORT or https://HOST:PORT, and nothing else",
        ));
    }
    // An IPv6 address with a port is in brackets; one without brackets is all host.
    let (host, port) = match authority.rsplit_once(':') {
        Some((_, inside)) if inside.ends_with(']') => (authority.to_owned(), None),
        Some((host, _)) if host.contains(':') && !host.ends_with(']') => (format!("[{authority}]"), None),
        Some((host, port)) => (host.to_owned(), Some(port)),
        None => (authority.to_owned(), None),
    };
    if host.is_empty() {
        return Err(refuse("it names no host"));
    }
    let port = match port {
        None => DEFAULT_PORT,
        Some(port) => match port.parse::<u16>() {
            Ok(port) if port > 0 => port,
            _ => return Err(refuse("its port is not a number from 1 to 65535")),
        },
    };
    Ok(format!("{scheme}://{host}:{port}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_is_a_host_with_or_without_scheme_and_port() {
        for (text, expected) in [
            ("127.0.0.1:7400", "http://127.0.0.1:7400"),
            ("http://lab:9000", "http://lab:9000"),
            ("http://lab:9000/", "http://lab:9000"),
            ("lab", "http://lab:7400"),
            ("[::1]", "http://[::1]:7400"),
            ("[::1]:5", "http://[::1]:5"),
            ("::1", "http://[::1]:7400"),
            ("https://lab", "https://lab:7400"),
            ("unix:/run/simd/simd.sock", "unix:/run/simd/simd.sock"),
            ("unix:///run/simd/simd.sock", "unix:/run/simd/simd.sock"),
            ("unix:simd.sock", "unix:simd.sock"),
        ] {
            assert_eq!(url(text, text).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn one_form_and_the_address_of_the_page_name_the_same_daemon() {
        for (text, expected, named) in [
            ("simd://lab", "http://lab:7400", None),
            ("simd://lab:9000/", "http://lab:9000", None),
            (" simd://[::1]:5/lab-2 ", "http://[::1]:5", Some("lab-2")),
            ("http://lab:7400/?view=1#arm", "http://lab:7400", None),
            ("https://lab/#arm", "https://lab:7400", None),
        ] {
            let expected = DaemonEndpoint::Grpc { url: expected.into(), name: named.map(str::to_owned) };
            assert_eq!(read(text).unwrap(), expected, "{text}");
        }
        for text in
            ["simd://", "simd:///lab", "simd://lab/a b", "simd://lab/a/b", "simd://lab:0", "simd://a@b"]
        {
            let refused = read(text).unwrap_err().to_string();
            assert!(refused.starts_with(&format!("`{text}` is not an endpoint: ")), "{refused}");
        }
    }

    #[test]
    fn a_zenoh_locator_may_name_a_daemon() {
        for (text, locator, name) in [
            ("tcp/127.0.0.1:7447", "tcp/127.0.0.1:7447", None),
            (" tcp/[::1]:7447#lab-2 ", "tcp/[::1]:7447", Some("lab-2")),
            ("tls/lab:7447#root_ca_certificate=/ca.pem", "tls/lab:7447#root_ca_certificate=/ca.pem", None),
            (
                "tls/lab:7447#root_ca_certificate=/ca.pem#a",
                "tls/lab:7447#root_ca_certificate=/ca.pem",
                Some("a"),
            ),
        ] {
            let expected = DaemonEndpoint::Zenoh { locator: locator.into(), name: name.map(str::to_owned) };
            assert_eq!(read(text).unwrap(), expected, "{text}");
        }
        for text in ["tcp://127.0.0.1:7447", "tcp/lab:1#", "tcp/lab:1#a b", "tcp/lab:1#a/b"] {
            let refused = read(text).unwrap_err().to_string();
            assert!(refused.starts_with(&format!("`{text}` is not an endpoint: ")), "{refused}");
        }
        for (text, whole) in [
            ("tcp/lab", "tcp/lab:7447"),
            ("tls/lab#one", "tls/lab:7447"),
            ("tcp/[::1]", "tcp/[::1]:7447"),
            ("tcp/lab:", "tcp/lab:7447"),
        ] {
            let sentence =
                format!("`{text}` is not an endpoint: it has no port; with the default one it is {whole}");
            assert_eq!(read(text).unwrap_err().to_string(), sentence);
        }
        assert_eq!(read("lab").unwrap(), DaemonEndpoint::Grpc { url: "http://lab:7400".into(), name: None });
    }

    #[test]
    fn an_endpoint_that_cannot_be_is_refused_in_one_sentence() {
        for text in
            ["", "http://", ":7400", "lab:0", "lab:seventy", "lab/x", "ftp://lab", "a b", "unix:", "unix://"]
        {
            let refused = read(text).unwrap_err().to_string();
            assert!(refused.starts_with(&format!("`{text}` is not an endpoint: ")), "{refused}");
        }
    }
}
