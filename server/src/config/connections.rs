//! What connections of gRPC and HTTP are held to. The page, gRPC-Web and gRPC share one port.

use std::time::Duration;

use serde::Deserialize;

/// Connections that can be configured at one time.
const MOST: usize = 65_536;
/// Times that can be configured, in seconds.
const SECONDS: std::ops::RangeInclusive<f64> = 0.1..=604_800.0;

/// Limits of connections. A peer is an IPv4 address or an IPv6 network of 64 bits. The loopback address (127.0.0.1
/// and ::1) is no peer in this sense: it may have all places.
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
        }
    }
}

/// The same in the configuration file.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ConnectionsTable {
    max: Option<usize>,
    max_per_peer: Option<usize>,
    loopback_reserve: Option<usize>,
    max_http1: Option<usize>,
    begin_seconds: Option<f64>,
    idle_seconds: Option<f64>,
    http1_silence_seconds: Option<f64>,
    body_seconds: Option<f64>,
    body_bytes_per_second: Option<u64>,
    stream_silence_seconds: Option<f64>,
}

impl ConnectionsTable {
    /// Puts what the file says over the limits. The error is a sentence.
    pub(super) fn apply(self, limits: &mut Connections) -> Result<(), String> {
        let Self { max, max_per_peer, loopback_reserve, max_http1, body_bytes_per_second, .. } = self;
        limits.max = max.unwrap_or(limits.max);
        // Shares that are left out stay within a smaller number of connections.
        limits.max_per_peer = max_per_peer.unwrap_or(limits.max_per_peer.min(limits.max));
        limits.loopback_reserve = loopback_reserve.unwrap_or(limits.loopback_reserve.min(limits.max / 2));
        limits.max_http1 = max_http1.unwrap_or(limits.max_http1.min(limits.max));
        limits.body_bytes_per_second = body_bytes_per_second.unwrap_or(limits.body_bytes_per_second);
        for (name, value, limit) in [
            ("begin_seconds", self.begin_seconds, &mut limits.begin),
            ("idle_seconds", self.idle_seconds, &mut limits.idle),
            ("http1_silence_seconds", self.http1_silence_seconds, &mut limits.http1_silence),
            ("body_seconds", self.body_seconds, &mut limits.body),
            ("stream_silence_seconds", self.stream_silence_seconds, &mut limits.stream_silence),
        ] {
            let Some(seconds) = value else { continue };
            if !SECONDS.contains(&seconds) {
                let (least, most) = (SECONDS.start(), SECONDS.end());
                return Err(format!(
                    "connections.{name} is {seconds}; it must be between {least} and {most}"
                ));
            }
            *limit = Duration::from_secs_f64(seconds);
        }
        limits.check()
    }
}

impl Connections {
    fn check(&self) -> Result<(), String> {
        let within = |name: &str, value: usize, least: usize, most: usize| {
            if (least..=most).contains(&value) {
                return Ok(());
            }
            Err(format!("connections.{name} is {value}; it must be between {least} and {most}"))
        };
        within("max", self.max, 2, MOST)?;
        within("max_per_peer", self.max_per_peer, 1, self.max)?;
        // One place is left for others.
        within("loopback_reserve", self.loopback_reserve, 0, self.max - 1)?;
        within("max_http1", self.max_http1, 1, self.max)?;
        if self.body_bytes_per_second == 0 {
            return Err("connections.body_bytes_per_second is 0; it must be 1 or more".into());
        }
        Ok(())
    }
}
