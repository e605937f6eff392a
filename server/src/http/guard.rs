//! Access checks for browsers, and their security headers.
//!
//! A page of another site must not reach the daemon through a user's browser. It could use a name that its
//! owner points at 127.0.0.1 (DNS rebinding), which `Host` reveals, or a cross-site request, which `Origin`
//! reveals. Programs that speak gRPC are not browsers.

use std::net::IpAddr;
use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::header::{self, HeaderName, HeaderValue};
use axum::http::{HeaderMap, StatusCode, Version};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::connect;
use simd_world::handle::Transport;

/// Policy that lets the page load from and connect to its own daemon only. three.js makes pictures and reads
/// pictures within meshes (`blob:`, of the page itself), and style sheets contain small ones (`data:`).
const POLICY: &str = "default-src 'self'; connect-src 'self' blob:; img-src 'self' data: blob:; font-src 'self' data:; \
                      object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors ";

/// Sites that may show the page in a frame.
#[derive(Clone, Debug)]
pub struct FrameAncestors(HeaderValue);

impl FrameAncestors {
    /// Allows these origins; without any, none.
    pub fn new(origins: &[String]) -> Self {
        let allowed =
            if origins.is_empty() { "'none'".to_owned() } else { format!("'self' {}", origins.join(" ")) };
        // Origins of the configuration are plain text: any other would not be a valid header.
        let none = || HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'");
        Self(HeaderValue::try_from(format!("{POLICY}{allowed}")).unwrap_or_else(|_| none()))
    }
}

impl Default for FrameAncestors {
    fn default() -> Self {
        Self::new(&[])
    }
}

/// Returns the headers of every answer to a browser.
fn headers(FrameAncestors(policy): FrameAncestors) -> [(HeaderName, HeaderValue); 5] {
    [
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")),
        (header::REFERRER_POLICY, HeaderValue::from_static("no-referrer")),
        (HeaderName::from_static("cross-origin-opener-policy"), HeaderValue::from_static("same-origin")),
        (HeaderName::from_static("cross-origin-resource-policy"), HeaderValue::from_static("same-origin")),
    ]
}

/// Names by which the daemon may be addressed, in addition to addresses and `localhost`.
#[derive(Clone, Debug, Default)]
pub struct Hosts(Arc<[String]>);

impl Hosts {
    /// Allows these names, as in `Host` without the port.
    pub fn new(names: &[String]) -> Self {
        Self(names.iter().map(|name| name.to_ascii_lowercase()).collect())
    }

    /// Returns whether no other site can make its pages appear to come from this host.
    fn allow(&self, host: &str) -> bool {
        let name = without_port(host);
        let address = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
        address.parse::<IpAddr>().is_ok() || name == "localhost" || self.0.iter().any(|known| known == name)
    }
}

/// Returns `name` of `name:port`, and `[::1]` of `[::1]:port`.
fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if !port.is_empty() && port.bytes().all(|digit| digit.is_ascii_digit()) => name,
        _ => host,
    }
}

/// Passes a request, or refuses it with 403 and a sentence.
pub(super) async fn guard(
    State((hosts, ancestors)): State<(Hosts, FrameAncestors)>,
    mut request: Request,
    next: Next,
) -> Response {
    let media = request.headers().get(header::CONTENT_TYPE).and_then(|media| media.to_str().ok());
    let is_web = media.is_some_and(|media| media.starts_with("application/grpc-web"));
    let is_grpc = !is_web && media.is_some_and(|media| media.starts_with("application/grpc"));
    let origins = request.headers().contains_key(header::ORIGIN);
    if is_grpc && request.version() == Version::HTTP_2 && !origins {
        return next.run(request).await;
    }
    let mut response = match check(&request, &hosts) {
        Ok(()) => {
            if is_web {
                request.extensions_mut().insert(Transport::GrpcWeb);
            } else if connect::is_json(request.headers()) {
                request.extensions_mut().insert(Transport::Json);
            }
            next.run(request).await
        }
        Err(sentence) => (StatusCode::FORBIDDEN, sentence).into_response(),
    };
    for (name, value) in headers(ancestors) {
        // An untrusted file has a stricter policy.
        response.headers_mut().entry(name).or_insert(value);
    }
    response
}

fn check(request: &Request<Body>, hosts: &Hosts) -> Result<(), String> {
    let host = host(request)?;
    if !hosts.allow(&host) {
        let name = without_port(&host);
        return Err(format!(
            "the daemon does not serve the host name {name:?}: use its address or localhost, or start it \
             with --allow-host {name}\n"
        ));
    }
    let Some(origin) = single(request.headers(), header::ORIGIN)? else { return Ok(()) };
    let site = origin.to_ascii_lowercase();
    let authority = site.strip_prefix("http://").or_else(|| site.strip_prefix("https://"));
    if authority.is_some_and(|authority| with_port(authority, &site) == with_port(&host, &site)) {
        return Ok(());
    }
    Err(format!("a page from {origin:?} must not call the daemon at {host:?}\n"))
}

/// Returns the client's name of the daemon in lower case: `Host`, or its equivalent in HTTP/2.
fn host(request: &Request<Body>) -> Result<String, String> {
    let said = single(request.headers(), header::HOST)?;
    let authority = request.uri().authority().map(|authority| authority.as_str());
    let host = said.or(authority).filter(|host| !host.is_empty());
    host.map(str::to_ascii_lowercase).ok_or_else(|| "the request has no Host header\n".to_owned())
}

/// Returns a header that may occur once.
fn single(headers: &HeaderMap, name: HeaderName) -> Result<Option<&str>, String> {
    let mut values = headers.get_all(&name).iter();
    let (first, second) = (values.next(), values.next());
    let text = first.map(|value| value.to_str().map_err(|_| format!("{name} is not text\n"))).transpose()?;
    if second.is_some() { Err(format!("{name} is given twice\n")) } else { Ok(text) }
}

/// Adds the scheme's default port, if it is left out.
fn with_port(authority: &str, site: &str) -> String {
    if without_port(authority) != authority {
        return authority.to_owned();
    }
    let port = if site.starts_with("https://") { 443 } else { 80 };
    format!("{authority}:{port}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(host: &str, origin: Option<&str>) -> Result<(), String> {
        let mut request = Request::builder().uri("/").header(header::HOST, host);
        if let Some(origin) = origin {
            request = request.header(header::ORIGIN, origin);
        }
        check(&request.body(Body::empty()).unwrap(), &Hosts::new(&["Lab.example".to_owned()]))
    }

    #[test]
    fn addresses_localhost_and_names_that_the_operator_gave_are_served() {
        for host in [
            "127.0.0.1:7400",
            "127.0.0.1",
            "[::1]:7400",
            "[::1]",
            "192.168.0.7:80",
            "localhost:7400",
            "LocalHost",
            "lab.example:7400",
            "LAB.example",
        ] {
            assert_eq!(answer(host, None), Ok(()), "{host}");
        }
    }

    #[test]
    fn a_name_that_untrusted_parties_can_point_here_is_refused() {
        for host in [
            "evil.example",
            "evil.example:7400",
            "127.0.0.1.evil.example",
            "localhost.evil.example",
            "lab.example.evil",
            "localhost:7400:1",
            "127.0.0.1@evil.example",
            "",
        ] {
            assert!(answer(host, None).is_err(), "{host}");
        }
        assert!(answer("evil.example:1", None).unwrap_err().contains("--allow-host evil.example"));
        let nameless = Request::builder().uri("/").body(Body::empty()).unwrap();
        assert!(check(&nameless, &Hosts::default()).is_err());
        let twice = Request::builder().uri("/").header("host", "localhost").header("host", "evil.example");
        assert!(check(&twice.body(Body::empty()).unwrap(), &Hosts::default()).is_err());
    }

    #[test]
    fn a_page_asks_where_it_comes_from_and_nowhere_else() {
        for (host, origin) in [
            ("127.0.0.1:7400", "http://127.0.0.1:7400"),
            ("localhost:7400", "http://LOCALHOST:7400"),
            ("localhost", "http://localhost"),
            ("localhost:80", "http://localhost"),
            // Behind a proxy that speaks TLS.
            ("lab.example", "https://lab.example"),
            ("lab.example:443", "https://lab.example"),
        ] {
            assert_eq!(answer(host, Some(origin)), Ok(()), "{host} {origin}");
        }
        for (host, origin) in [
            ("127.0.0.1:7400", "http://evil.example"),
            ("127.0.0.1:7400", "http://127.0.0.1:7401"),
            ("127.0.0.1:7400", "http://localhost:7400"),
            ("127.0.0.1:7400", "null"),
            ("127.0.0.1:7400", "file://"),
            ("127.0.0.1:7400", "127.0.0.1:7400"),
            ("localhost", "https://localhost:80"),
            ("evil.example", "http://evil.example"),
        ] {
            assert!(answer(host, Some(origin)).is_err(), "{host} {origin}");
        }
    }
}
