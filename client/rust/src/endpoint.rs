//! Reads where a daemon is: `host`, `host:port` or `http://host:port`.

use simd_proto::DEFAULT_PORT;

use crate::Error;

/// The URL of the daemon at `text`. The port may be left out.
pub(crate) fn url(text: &str) -> Result<String, Error> {
    let refuse = |reason: &str| Error::Endpoint { endpoint: text.to_owned(), reason: reason.to_owned() };
    let trimmed = text.trim();
    let authority = match trimmed.split_once("://") {
        None => trimmed,
        Some(("http", rest)) => rest,
        Some(("https", _)) => return Err(refuse("this client does not speak TLS yet; use http")),
        Some(_) => return Err(refuse("the scheme must be http")),
    };
    let authority = authority.trim_end_matches('/');
    if authority.is_empty() {
        return Err(refuse("it names no host"));
    }
    if authority.contains(['/', '@', '?', '#']) || authority.contains(char::is_whitespace) {
        return Err(refuse("it must be a host and a port, and nothing else"));
    }
    // An IPv6 address has its colons in brackets; one without is all host.
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
    Ok(format!("http://{host}:{port}"))
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
        ] {
            assert_eq!(url(text).unwrap(), expected, "{text}");
        }
    }

    #[test]
    fn an_endpoint_that_cannot_be_is_refused_in_one_sentence() {
        for text in
            ["", "http://", ":7400", "lab:0", "lab:seventy", "lab/x", "ftp://lab", "https://lab", "a b"]
        {
            let refused = url(text).unwrap_err().to_string();
            assert!(refused.starts_with(&format!("`{text}` is not an endpoint: ")), "{refused}");
        }
    }
}
