//! Checks whether a daemon answers, and its statements about its caller and itself.

#[cfg(test)]
mod tests;

use std::{
    io,
    net::IpAddr,
    time::{Duration, Instant, SystemTime},
};

use simd_client::{
    API_VERSION, Client, ConnectOptions, DEFAULT_PORT, Error, Refusal,
    proto::{
        DaemonStatistics, ErrorReason, GetSimulatorInfoResponse, ListCamerasResponse, SimulationState,
        TokenInfo, WorldStatistics,
    },
};
use tokio::{net::TcpStream, time::timeout};

use super::{Finding, away, certificate, unix_seconds};
use crate::{
    credentials::Source,
    output::number::{count, fixed},
};

/// Time before its expiry at which a token should be renewed.
const SOON: i64 = 7 * 86_400;
/// Clocks with a larger difference disagree on expiry, s.
const MAX_SKEW: f64 = 1.0;

/// Findings about a daemon, and its name if known.
#[derive(Debug, Default)]
pub(super) struct Seen {
    pub(super) findings: Vec<Finding>,
    pub(super) name: Option<String>,
}

/// Address of gRPC.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Address {
    is_tls: bool,
    host: String,
    port: u16,
}

impl Address {
    /// Parses an address like the client; the client refuses invalid ones.
    fn read(endpoint: &str) -> Option<Self> {
        let (is_tls, rest) = match endpoint.trim().split_once("://") {
            Some(("https", rest)) => (true, rest),
            Some(("http", rest)) => (false, rest),
            Some(_) => return None,
            None => (false, endpoint.trim()),
        };
        let rest = rest.split('/').next().unwrap_or(rest);
        let (host, port) = match rest.strip_prefix('[').and_then(|rest| rest.split_once(']')) {
            Some((host, port)) => (host, port.strip_prefix(':')),
            None => match rest.rsplit_once(':') {
                Some((host, port)) => (host, Some(port)),
                None => (rest, None),
            },
        };
        let port = port.map_or(Some(DEFAULT_PORT), |port| port.parse().ok())?;
        Some(Self { is_tls, host: host.to_owned(), port })
    }

    async fn connect(&self, connect_timeout: Duration) -> io::Result<TcpStream> {
        let connect = TcpStream::connect((self.host.as_str(), self.port));
        timeout(connect_timeout, connect).await.unwrap_or_else(|_| Err(io::ErrorKind::TimedOut.into()))
    }
}

/// Returns whether an endpoint, of gRPC or of Zenoh, is on this machine.
pub(super) fn is_loopback(endpoint: &str) -> bool {
    let grpc = match endpoint.split_once('/') {
        Some((_, rest)) if simd_client::is_zenoh(endpoint) => rest.split('#').next().unwrap_or(rest),
        _ => endpoint,
    };
    let Some(Address { host, .. }) = Address::read(grpc) else { return false };
    host == "localhost" || host.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

/// Checks a daemon over gRPC: its port, its certificate, and its answers.
pub(super) async fn over_grpc(
    endpoint: &str,
    options: &ConnectOptions,
    token: Option<Source>,
    now: SystemTime,
) -> Seen {
    let Some(address) = Address::read(endpoint) else {
        return refused(Finding::problem(
            "endpoint",
            format!("`{endpoint}` is none"),
            "an endpoint is host, host:port, https://host:port, or a locator of Zenoh like tcp/host:7447",
        ));
    };
    let connection = match address.connect(options.connect_timeout).await {
        Ok(connection) => connection,
        Err(error) => return refused(unreachable(&address, &error)),
    };
    let mut seen = Seen::default();
    let place = format!("{}:{}", address.host, address.port);
    seen.findings.push(Finding::ok("port", format!("a program listens at {place}")));
    let chain = certificate::shown(&address.host, connection, options.connect_timeout).await;
    match (address.is_tls, chain) {
        (true, Some(chain)) => seen.findings.extend(certificate::served(&address.host, &chain, now)),
        (true, None) => {
            seen.findings.push(Finding::problem(
                "TLS",
                format!("the server at {place} does not use TLS"),
                format!("use http://{place}, or start the daemon with --tls-certificate and --tls-key"),
            ));
            return seen;
        }
        (false, Some(_)) => {
            seen.findings.push(Finding::problem(
                "TLS",
                format!("the server at {place} uses TLS, and the endpoint does not"),
                format!("use https://{place}, with the daemon's ca.pem as --tls-ca"),
            ));
            return seen;
        }
        (false, None) => {}
    }
    let is_plain = !address.is_tls && !is_loopback(endpoint);
    match Client::connect_with(endpoint, options.clone()).await {
        Ok(client) => asked(&client, token, is_plain, now, &mut seen).await,
        Err(error) => seen.findings.push(silent(&error, &place)),
    }
    seen
}

fn refused(finding: Finding) -> Seen {
    Seen { findings: vec![finding], name: None }
}

/// Returns the finding of a failed connection.
fn unreachable(address: &Address, error: &io::Error) -> Finding {
    let Address { host, port, .. } = address;
    let place = format!("{host}:{port}");
    match error.kind() {
        io::ErrorKind::ConnectionRefused => Finding::problem(
            "port",
            format!("nothing listens at {place}"),
            format!("start a daemon there (`simd --listen {place}`), or name another endpoint"),
        ),
        io::ErrorKind::TimedOut => Finding::problem(
            "port",
            format!("{place} does not answer"),
            "check that the machine is up, and that no firewall blocks the port",
        ),
        _ => Finding::problem(
            "port",
            format!("{place} cannot be reached: {error}"),
            "check the host name and the network",
        ),
    }
}

/// Returns the finding of a server that is not a usable daemon.
fn silent(error: &Error, place: &str) -> Finding {
    match error {
        Error::Untrusted { reason, sentence, .. } if !reason.contains("invalid peer certificate") => {
            Finding::problem(
                "certificate",
                sentence.clone(),
                "correct what --tls-ca, --tls-client-cert and --tls-client-key name",
            )
        }
        Error::Certificate { reason } => Finding::problem(
            "certificate",
            reason.clone(),
            "correct what --tls-ca, --tls-client-cert and --tls-client-key name",
        ),
        Error::Untrusted { reason, .. } => Finding::problem(
            "certificate",
            format!("it is not trusted: {reason}"),
            "--tls-ca, SIMD_TLS_CA or the context must name the `ca.pem` of this daemon's authority",
        ),
        Error::Endpoint { reason, .. } => Finding::problem(
            "endpoint",
            reason.clone(),
            "correct the endpoint, or the other settings of the context",
        ),
        Error::Unreachable { .. } => Finding::problem(
            "daemon",
            format!("another program has the port of {place}: it does not speak gRPC"),
            "find the program with `ss -ltnp` and end it, or give the daemon another port with --listen",
        ),
        Error::TimedOut { after, .. } => Finding::problem(
            "daemon",
            format!("the server at {place} did not answer within {} s", after.as_secs_f64()),
            "see whether it is a daemon that hangs (its log, `/healthz`), or another program",
        ),
        error => Finding::problem("daemon", error.to_string(), "see the daemon's log"),
    }
}

/// Returns the findings from a connected daemon's answers.
pub(super) async fn asked(
    client: &Client,
    token: Option<Source>,
    is_plain: bool,
    now: SystemTime,
    seen: &mut Seen,
) {
    let found = &mut seen.findings;
    let info = match client.simulator_info().await {
        Ok(info) => info,
        Err(Error::Refused(refusal)) if refusal.reason == ErrorReason::Unauthenticated => {
            found.push(Finding::ok("daemon", "one answers"));
            return found.push(unauthenticated(&refusal, token));
        }
        Err(error) => return found.push(silent(&error, client.endpoint())),
    };
    found.push(Finding::ok("daemon", format!("{} {} called {}", info.simulator, info.version, info.name)));
    found.push(versions(&info));
    found.push(self::token(info.token.as_ref(), token, is_plain, now));
    let sent = (Instant::now(), SystemTime::now());
    match client.daemon_statistics().await {
        Ok((world, daemon)) => {
            found.extend(daemon.as_ref().and_then(|daemon| clock(daemon, sent.1, sent.0.elapsed())));
            found.push(self::world(&world));
            // A token without rights to the world has no cameras to check.
            found.extend(client.list_cameras().await.ok().and_then(|listed| cameras_of(&listed)));
        }
        Err(Error::Refused(refusal)) if refusal.reason == ErrorReason::VersionMismatch => {
            found.push(Finding::problem(
                "versions",
                refusal.message,
                "install simctl and simd of one release",
            ));
        }
        Err(error) => found.push(silent(&error, client.endpoint())),
    }
    seen.name = Some(info.name);
}

fn versions(info: &GetSimulatorInfoResponse) -> Finding {
    const CHECK: &str = "versions";
    let own = env!("CARGO_PKG_VERSION");
    let api = format!("{}.{}", info.api_major, info.api_minor);
    let found = format!("simd {} with API {api}, simctl {own} with API {API_VERSION}", info.version);
    let advice = "install simctl and simd of one release";
    let is_served = info.api_major == API_VERSION.major
        && API_VERSION.minor.checked_sub(info.api_minor).is_none_or(|behind| behind == 0);
    if !is_served {
        return Finding::problem(CHECK, found, advice);
    }
    match info.version == own {
        true => Finding::ok(CHECK, found),
        false => Finding::warning(CHECK, found, advice),
    }
}

fn unauthenticated(refusal: &Refusal, token: Option<Source>) -> Finding {
    match token {
        None => Finding::problem(
            "token",
            "the daemon asks for one, and none is given",
            "set SIMD_TOKEN, or `token` of the context; `simctl token add` makes one on the daemon's machine",
        ),
        Some(source) => Finding::problem(
            "token",
            format!("the one from {} is refused: {}", source.name(), refusal.message),
            "on the daemon's machine, `simctl token list` shows the tokens and `simctl token add` makes another",
        ),
    }
}

fn token(known: Option<&TokenInfo>, given: Option<Source>, is_plain: bool, now: SystemTime) -> Finding {
    const CHECK: &str = "token";
    match (known, given) {
        (Some(known), Some(source)) => {
            let left = known.expires.map(|expires| expires.seconds - unix_seconds(now));
            let until =
                left.map_or_else(|| "does not expire".to_owned(), |left| format!("expires {}", away(left)));
            let found =
                format!("the token of {}, from {}: {}, {until}", known.name, source.name(), known.role);
            if is_plain {
                return Finding::warning(
                    CHECK,
                    format!("{found}, sent in plain text"),
                    "use https:// (docs/security.md)",
                );
            }
            match left {
                Some(left) if left < SOON => {
                    Finding::warning(CHECK, found, "`simctl token add` makes another")
                }
                _ => Finding::ok(CHECK, found),
            }
        }
        (Some(known), None) => Finding::ok(CHECK, format!("the token of {}: {}", known.name, known.role)),
        (None, _) if is_plain => Finding::warning(
            CHECK,
            "the daemon asks for none, and others can reach it",
            "give it --tokens and a certificate (docs/security.md): everyone commands its robots",
        ),
        (None, Some(source)) => Finding::ok(
            CHECK,
            format!("the daemon asks for none; the one from {} is not needed", source.name()),
        ),
        (None, None) => Finding::ok(CHECK, "the daemon asks for none"),
    }
}

/// Compares its clock with ours: it read its clock at some time between the request and the answer.
fn clock(daemon: &DaemonStatistics, sent: SystemTime, took: Duration) -> Option<Finding> {
    const CHECK: &str = "clock";
    let theirs = daemon.wall_time?;
    let since = sent.duration_since(SystemTime::UNIX_EPOCH).ok()?;
    let seconds = (theirs.seconds - i64::try_from(since.as_secs()).ok()?) as f64;
    let ahead = seconds + (f64::from(theirs.nanos) - f64::from(since.subsec_nanos())) * 1e-9;
    // Smaller differences cannot be detected.
    let skew = ahead - ahead.clamp(0.0, took.as_secs_f64());
    Some(match skew.abs() > MAX_SKEW {
        true => Finding::warning(
            CHECK,
            format!(
                "the daemon's is {} s {}",
                fixed(skew.abs(), 3),
                if skew < 0.0 { "behind" } else { "ahead" }
            ),
            "let both machines follow one time (chrony, systemd-timesyncd): tokens and certificates expire by it",
        ),
        false => Finding::ok(CHECK, format!("the daemon's is within {} s of this one's", fixed(MAX_SKEW, 0))),
    })
}

/// Checks whether it keeps time.
fn world(statistics: &WorldStatistics) -> Finding {
    const CHECK: &str = "world";
    let (wanted, reached) = (statistics.target_real_time_factor, statistics.real_time_factor);
    let is_playing = statistics.state() == SimulationState::Playing;
    let found = format!(
        "{}; real-time factor {} of {}, {} overruns, {} s dropped",
        count(usize::try_from(statistics.robots).unwrap_or(usize::MAX), "robot"),
        fixed(reached, 2),
        fixed(wanted, 2),
        statistics.overruns,
        fixed(statistics.dropped_lag, 3)
    );
    // Right after it begins to play, no value was measured yet.
    let is_slow = is_playing && wanted.is_finite() && reached > 0.0 && reached < 0.9 * wanted;
    match is_slow || statistics.overruns > 0 {
        true => Finding::warning(
            CHECK,
            found,
            "`simctl top` shows how long steps take; see docs/performance.md, or lower `simctl sim physics --rtf`",
        ),
        false => Finding::ok(CHECK, found),
    }
}

/// Checks whether its cameras have pictures; nothing without cameras.
fn cameras_of(listed: &ListCamerasResponse) -> Option<Finding> {
    const CHECK: &str = "cameras";
    let ListCamerasResponse { cameras, renderers, .. } = listed;
    if cameras.is_empty() {
        return None;
    }
    let found = count(cameras.len(), "camera");
    Some(match renderers.is_empty() {
        true => Finding::warning(
            CHECK,
            format!("{found}, and no renderer: they have no pictures"),
            "start `simd-camera --endpoint ...` here or on a machine with a GPU (docs/sensors.md)",
        ),
        false => Finding::ok(CHECK, format!("{found} and {}", count(renderers.len(), "renderer"))),
    })
}
