//! Limits of gRPC and HTTP connections. The page, gRPC-Web and gRPC share one port.

use std::time::Duration;

/// Limits of connections. A peer is an IPv4 address or an IPv6 network of 64 bits. The loopback addresses
/// (127.0.0.1 and ::1) are not peers in this sense: they may have all connections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connections {
    /// Maximum number of connections. The default is well below the 1024 files that a process may usually
    /// open.
    pub max: usize,
    /// Maximum number of one peer's connections.
    pub max_per_peer: usize,
    /// Number of connections reserved for the loopback addresses.
    pub loopback_reserve: usize,
    /// Maximum number of HTTP/1.1 connections, which are among the others. A peer's share of them, and the
    /// reserve for the loopback addresses, are in proportion. Browsers keep theirs open, six each, and must
    /// not keep programs out.
    pub max_http1: usize,
    /// Maximum time for a connection to show its HTTP version.
    pub begin: Duration,
    /// Maximum idle time of a connection. It is idle without a call, or while it waits for its client to send
    /// the rest of a request or to read an answer. Keepalive does not count as a call.
    pub idle: Duration,
    /// Maximum time without bytes in either direction on an HTTP/1.1 connection, even while a call waits.
    pub http1_silence: Duration,
    /// Maximum time for the body of a request to arrive, in addition to the time earned by
    /// [`Self::body_bytes_per_second`].
    pub body: Duration,
    /// Rate at which arrived bytes earn time, bytes per second.
    pub body_bytes_per_second: u64,
    /// Maximum silence of a client in an open stream of requests.
    pub stream_silence: Duration,
    /// Maximum number of one connection's calls in progress; more wait.
    pub calls: usize,
    /// Maximum number of one connection's open calls, including waiting ones; clients queue more.
    pub open_calls: u32,
}

impl Default for Connections {
    fn default() -> Self {
        Self {
            max: 512,
            max_per_peer: 128,
            loopback_reserve: 64,
            max_http1: 192,
            begin: Duration::from_secs(5),
            idle: Duration::from_secs(300),
            http1_silence: Duration::from_secs(600),
            body: Duration::from_secs(30),
            body_bytes_per_second: 65_536,
            stream_silence: Duration::from_secs(3600),
            calls: 1024,
            open_calls: 2048,
        }
    }
}

impl Connections {
    /// Checks the limits together; each one's own range is in the table of keys.
    pub(super) fn check(&self) -> Result<(), String> {
        let at_most = |name: &str, value: usize, most: usize| {
            if value <= most {
                return Ok(());
            }
            let max = self.max;
            Err(format!(
                "connections.{name} is {value}; it must be at most {most} if connections.max is {max}"
            ))
        };
        at_most("max_per_peer", self.max_per_peer, self.max)?;
        // One connection remains for other addresses.
        at_most("loopback_reserve", self.loopback_reserve, self.max.saturating_sub(1))?;
        at_most("max_http1", self.max_http1, self.max)
    }
}
