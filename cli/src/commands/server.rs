//! `simctl server`: the daemon, and its response time.

use std::time::{Duration, Instant};

use clap::Subcommand;
use serde::Serialize;
use simd_client::{API_VERSION, Client, proto::GetSimulatorInfoResponse};

use super::present;
use crate::output::{
    Output, View,
    json::Stamp,
    number::{count, fixed},
    table::Page,
};

#[derive(Debug, Subcommand)]
pub(crate) enum Server {
    /// Shows the daemon's version, limits and features
    Info,
    /// Measures round trips
    Ping {
        /// Number of pings
        #[arg(short, long, default_value_t = 4, value_parser = clap::value_parser!(u64).range(1..))]
        count: u64,
        /// Milliseconds between pings
        #[arg(long, default_value_t = 200, value_name = "MS")]
        interval: u64,
    },
}

pub(crate) async fn run(command: Server, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Server::Info => {
            let info = client.simulator_info().await?;
            output.one(&Info::new(client.endpoint(), info))
        }
        Server::Ping { count, interval } => {
            tokio::select! {
                done = ping(client, output, count, Duration::from_millis(interval)) => done,
                // Interrupting a ping is not a failure.
                _ = tokio::signal::ctrl_c() => Ok(()),
            }
        }
    }
}

async fn ping(client: &Client, output: Output, number: u64, interval: Duration) -> anyhow::Result<()> {
    let mut round_trips = Vec::new();
    for sequence in 1..=number {
        if sequence > 1 && !interval.is_zero() {
            tokio::time::sleep(interval).await;
        }
        let sent = Instant::now();
        let statistics = client.world_statistics().await?;
        let round_trip_ms = sent.elapsed().as_secs_f64() * 1e3;
        round_trips.push(round_trip_ms);
        let stamp = present(statistics.stamp, "stamp")?.into();
        output.item(&Ping { sequence, round_trip_ms, stamp })?;
    }
    round_trips.sort_by(f64::total_cmp);
    // Nearest rank: of four answers, the slowest is the 99th percentile.
    let at = |part: usize| {
        let rank = (round_trips.len() * part).div_ceil(100);
        round_trips.get(rank.saturating_sub(1)).copied().unwrap_or_default()
    };
    output.remark(&Page::of_line(format!(
        "{}: min {} ms, median {} ms, 99 % {} ms, max {} ms",
        count(round_trips.len(), "answer"),
        fixed(at(0), 3),
        fixed(at(50), 3),
        fixed(at(99), 3),
        fixed(at(100), 3),
    )))
}

/// A line of `server ping`.
#[derive(Serialize)]
struct Ping {
    sequence: u64,
    round_trip_ms: f64,
    stamp: Stamp,
}

impl View for Ping {
    fn page(&self) -> Page {
        let line = format!("{}: {} ms, at {}", self.sequence, fixed(self.round_trip_ms, 3), self.stamp);
        Page::of_line(line)
    }
}

/// `server info`.
#[derive(Serialize)]
struct Info {
    endpoint: String,
    simulator: String,
    version: String,
    /// `MAJOR.MINOR` of the daemon's schema.
    api_version: String,
    /// `MAJOR.MINOR` of this client's schema.
    client_api_version: String,
    name: String,
    features: Vec<String>,
    limits: Option<RequestLimits>,
}

#[derive(Serialize)]
struct RequestLimits {
    max_robots: u32,
    max_links: u32,
    max_description_bytes: u64,
    max_asset_bytes: u64,
    max_upload_store_bytes: u64,
    max_message_bytes: u64,
    max_steps: u64,
    max_saved_states: u32,
    max_parameters: u32,
}

impl Info {
    fn new(endpoint: &str, info: GetSimulatorInfoResponse) -> Self {
        Self {
            endpoint: endpoint.to_owned(),
            simulator: info.simulator,
            version: info.version,
            api_version: format!("{}.{}", info.api_major, info.api_minor),
            client_api_version: API_VERSION.to_string(),
            name: info.name,
            features: info.features,
            limits: info.limits.map(|limits| RequestLimits {
                max_robots: limits.max_robots,
                max_links: limits.max_links,
                max_description_bytes: limits.max_description_bytes,
                max_asset_bytes: limits.max_asset_bytes,
                max_upload_store_bytes: limits.max_upload_store_bytes,
                max_message_bytes: limits.max_message_bytes,
                max_steps: limits.max_steps,
                max_saved_states: limits.max_saved_states,
                max_parameters: limits.max_parameters,
            }),
        }
    }
}

impl View for Info {
    fn page(&self) -> Page {
        let mut pairs = vec![
            ("daemon", format!("{} {}", self.simulator, self.version)),
            ("name", self.name.clone()),
            ("endpoint", self.endpoint.clone()),
            ("API", format!("{} (simctl has {})", self.api_version, self.client_api_version)),
            ("features", self.features.join(", ")),
        ];
        if let Some(limits) = &self.limits {
            pairs.extend([
                ("robots", format!("at most {}", limits.max_robots)),
                ("links of a robot", format!("at most {}", limits.max_links)),
                ("description", format!("at most {}", size(limits.max_description_bytes))),
                ("asset", format!("at most {}", size(limits.max_asset_bytes))),
                ("kept uploads", format!("at most {}", size(limits.max_upload_store_bytes))),
                ("message", format!("at most {}", size(limits.max_message_bytes))),
                ("steps of a call", format!("at most {}", limits.max_steps)),
                ("saved states", format!("at most {}", limits.max_saved_states)),
                ("parameters", format!("at most {}", limits.max_parameters)),
            ]);
        }
        Page::new().pairs(pairs)
    }
}

fn size(bytes: u64) -> String {
    match bytes {
        0..=1023 => format!("{bytes} B"),
        1024..=1_048_575 => format!("{} KiB", bytes / 1024),
        _ => format!("{} MiB", bytes / (1024 * 1024)),
    }
}
