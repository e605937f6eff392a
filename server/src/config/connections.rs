//! What connections of gRPC and HTTP are held to. The page, gRPC-Web and gRPC share one port.

use std::time::Duration;

/// Limits of connections. A peer is an IPv4 address or an IPv6 network of 64 bits. The loopback address (127.0.0.1
/// and ::1) is no peer in this sense: it may have all of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Connections {
    /// At one time. The default is well below the 1024 files that a process may usually open.
    pub max: usize,
    /// Of one peer.
    pub max_per_peer: usize,
    /// That only the loopback address may have.
    pub loopback_reserve: usize,
    /// Of HTTP/1.1, which are among the others. A peer's share of them, and what is kept for the loopback address,
    /// are in proportion. Browsers keep theirs, six each, and must not keep programs out.
    pub max_http1: usize,
    /// How long a connection may take to say which HTTP it speaks.
    pub begin: Duration,
    /// How long a connection may be idle: it has no call, or waits for its client to send the rest of a request or to
    /// read an answer. Keepalive is no call.
    pub idle: Duration,
    /// How long nothing may go over a connection of HTTP/1.1 in either direction, also where a call waits.
    pub http1_silence: Duration,
    /// How long the body of a request may take to arrive, beside what [`Self::body_bytes_per_second`] allows.
    pub body: Duration,
    /// What arrived earns time at this rate.
    pub body_bytes_per_second: u64,
    /// How long a client may send nothing into a stream of requests that it keeps open.
    pub stream_silence: Duration,
    /// Calls of one connection that may be at work; more wait.
    pub calls: usize,
    /// Calls of one connection that may be open, those that wait included; clients keep more to themselves.
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
    /// What they must be together; each one's own range is in the table of keys.
    pub(super) fn check(&self) -> Result<(), String> {
        let at_most = |name: &str, value: usize, most: usize| {
            if value <= most {
                return Ok(());
            }
            let max = self.max;
            Err(format!(
                "connections.{name} is {value}; it must be at most {most} where connections.max is {max}"
            ))
        };
        at_most("max_per_peer", self.max_per_peer, self.max)?;
        // One is left for others.
        at_most("loopback_reserve", self.loopback_reserve, self.max.saturating_sub(1))?;
        at_most("max_http1", self.max_http1, self.max)
    }
}
