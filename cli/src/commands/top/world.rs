//! State of one world, and the rates between two answers of its daemon.

#[cfg(test)]
pub(super) mod tests;

use std::time::{Duration, Instant};

use serde::Serialize;
use simd_client::proto::{
    ClientInfo, DaemonStatistics, DurationHistogram, EntityInfo, ListClientsResponse, WorldStatistics,
};

use crate::output::{
    json,
    number::{ABSENT, fixed, optional},
};

/// Maximum number of robots, and of clients, that are kept for a world; a larger daemon has its own limits.
const KEPT: usize = 10_000;

/// Whether a daemon answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Link {
    /// Not polled yet.
    #[default]
    Connecting,
    /// It answered.
    Here,
    /// It did not answer the last poll.
    Lost,
}

/// One world, as in `-o json`. Unknown values are null.
#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct World {
    pub(super) endpoint: String,
    pub(super) name: Option<String>,
    pub(super) version: Option<String>,
    pub(super) link: Link,
    /// Reason why it is lost.
    pub(super) error: Option<String>,
    /// `playing`, `paused` or `stopped`.
    pub(super) state: Option<String>,
    /// Seconds.
    pub(super) sim_time: Option<f64>,
    /// Null as fast as possible.
    target_real_time_factor: Option<f64>,
    pub(super) real_time_factor: Option<f64>,
    steps_per_second: Option<f64>,
    /// Wall seconds, mean of the steps since the last poll.
    pub(super) step_duration: Option<f64>,
    /// Wall seconds, 99th percentile of these steps.
    step_duration_p99: Option<f64>,
    /// Wall seconds from the due time of a step to its beginning, mean since the last poll.
    step_lateness: Option<f64>,
    step_lateness_p99: Option<f64>,
    overruns: Option<u64>,
    /// Wall seconds.
    dropped_lag: Option<f64>,
    pub(super) robot_count: Option<u32>,
    pub(super) calls_per_second: Option<f64>,
    failed_calls_per_second: Option<f64>,
    streams: Option<u32>,
    claims: Option<u32>,
    mailbox_waiting: Option<u32>,
    mailbox_refusals: Option<u64>,
    resident_bytes: Option<u64>,
    open_files: Option<u32>,
    /// Wall seconds.
    round_trip: Option<f64>,
    /// Holder of a claim on the world.
    claimed_by: Option<String>,
    pub(super) robots: Vec<RobotRow>,
    pub(super) clients: Vec<ClientRow>,
    #[serde(skip)]
    last: Option<(Instant, WorldStatistics, Option<DaemonStatistics>)>,
}

/// Answer of a daemon at one time.
#[derive(Clone, Debug)]
pub(super) struct Answer {
    pub(super) at: Instant,
    pub(super) round_trip: Duration,
    pub(super) statistics: WorldStatistics,
    pub(super) daemon: Option<DaemonStatistics>,
    /// Robots and clients, if requested.
    pub(super) details: Option<(Vec<EntityInfo>, ListClientsResponse)>,
}

/// A robot of the world.
#[derive(Clone, Debug, Serialize)]
pub(super) struct RobotRow {
    pub(super) name: String,
    pub(super) links: usize,
    pub(super) moving_joints: u32,
    /// Kilograms.
    pub(super) mass: f64,
    pub(super) claimed_by: Option<String>,
    /// Reason why it is disabled.
    disabled_reason: Option<String>,
}

/// A client of the daemon.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ClientRow {
    name: String,
    transport: String,
    /// Wall seconds since its last call.
    idle: f64,
    /// Number of joints whose last target is from it.
    targets: usize,
    is_caller: bool,
}

impl World {
    pub(super) fn new(endpoint: String) -> Self {
        Self { endpoint, ..Self::default() }
    }

    /// Returns its name, or its endpoint.
    pub(super) fn label(&self) -> &str {
        self.name.as_deref().unwrap_or(&self.endpoint)
    }

    /// Records an answer of its daemon.
    pub(super) fn answered(&mut self, answer: Answer) {
        let Answer { at, round_trip, statistics, daemon, details } = answer;
        (self.link, self.error) = (Link::Here, None);
        self.state = Some(json::name("SIMULATION_STATE_", statistics.state().as_str_name()));
        self.sim_time = statistics.stamp.map(|stamp| stamp.sim_time);
        self.target_real_time_factor = Some(statistics.target_real_time_factor).filter(|of| of.is_finite());
        self.real_time_factor = Some(statistics.real_time_factor);
        (self.overruns, self.dropped_lag) = (Some(statistics.overruns), Some(statistics.dropped_lag));
        self.robot_count = Some(statistics.robots);
        self.mailbox_refusals = Some(statistics.mailbox_refusals);
        self.claimed_by = Some(statistics.claimed_by.clone()).filter(|holder| !holder.is_empty());
        self.round_trip = Some(round_trip.as_secs_f64());
        // A restarted daemon restarts its counts: rates come with the next answer.
        let before = self.last.take().filter(|(_, world, before)| {
            let calls = |of: &Option<DaemonStatistics>| of.as_ref().map(|of| of.calls);
            world.iterations <= statistics.iterations && calls(before) <= calls(&daemon)
        });
        let seconds = before.as_ref().map(|(then, ..)| at.saturating_duration_since(*then).as_secs_f64());
        let seconds = seconds.filter(|seconds| *seconds > 0.0);
        let rate = |now: u64, then: u64| seconds.map(|seconds| now.saturating_sub(then) as f64 / seconds);
        self.steps_per_second =
            before.as_ref().and_then(|(_, world, _)| rate(statistics.iterations, world.iterations));
        let both = before.as_ref().and_then(|(_, _, then)| then.as_ref()).zip(daemon.as_ref());
        self.calls_per_second = both.and_then(|(then, now)| rate(now.calls, then.calls));
        self.failed_calls_per_second = both.and_then(|(then, now)| rate(now.failed_calls, then.failed_calls));
        let between = |of: fn(&DaemonStatistics) -> Option<&DurationHistogram>| {
            both.and_then(|(then, now)| Between::new(of(then)?, of(now)?))
        };
        let durations = between(|of| of.step_duration.as_ref());
        let mean = durations.as_ref().map(Between::mean);
        self.step_duration_p99 = durations.as_ref().map(|of| of.quantile(0.99));
        // A long step that still runs is in no histogram yet.
        let is_stuck = mean.is_none_or(|mean| statistics.step_duration > 10.0 * mean);
        self.step_duration = if is_stuck { Some(statistics.step_duration) } else { mean };
        let lateness = between(|of| of.step_lateness.as_ref());
        self.step_lateness = lateness.as_ref().map(Between::mean);
        self.step_lateness_p99 = lateness.as_ref().map(|of| of.quantile(0.99));
        let now = daemon.as_ref();
        self.streams = now.map(|of| of.streams);
        self.claims = now.map(|of| of.claims);
        self.mailbox_waiting = now.map(|of| of.mailbox_waiting);
        self.resident_bytes = now.map(|of| of.resident_bytes).filter(|bytes| *bytes > 0);
        self.open_files = now.map(|of| of.open_files).filter(|files| *files > 0);
        self.last = Some((at, statistics, daemon));
        if let Some((robots, clients)) = details {
            self.robots = robots.into_iter().take(KEPT).map(RobotRow::from).collect();
            let ListClientsResponse { clients, targets } = clients;
            let of = |client: ClientInfo| ClientRow {
                targets: targets.iter().filter(|target| target.client == client.name).count(),
                name: client.name,
                transport: client.transport,
                idle: client.idle,
                is_caller: client.is_caller,
            };
            self.clients = clients.into_iter().take(KEPT).map(of).collect();
        }
    }

    /// Records a missing answer. Known values stay, except the momentary ones.
    pub(super) fn lost(&mut self, error: String) {
        let known = std::mem::replace(self, Self::new(String::new()));
        *self = Self {
            endpoint: known.endpoint,
            name: known.name,
            version: known.version,
            link: Link::Lost,
            error: Some(error),
            ..Self::default()
        };
    }
}

impl From<EntityInfo> for RobotRow {
    fn from(robot: EntityInfo) -> Self {
        let some = |text: String| Some(text).filter(|text| !text.is_empty());
        Self {
            name: robot.name,
            links: robot.links.len(),
            moving_joints: robot.moving_joints,
            mass: robot.mass,
            claimed_by: some(robot.claimed_by),
            disabled_reason: some(robot.disabled_reason),
        }
    }
}

impl RobotRow {
    /// Headings, and whether their cells are right-aligned.
    pub(super) const HEADINGS: [(&str, bool); 6] = [
        ("ROBOT", false),
        ("LINKS", true),
        ("JOINTS", true),
        ("MASS [kg]", true),
        ("CLAIMED BY", false),
        ("DISABLED", false),
    ];

    pub(super) fn cells(&self) -> Vec<String> {
        let or_absent = |text: &Option<String>| text.clone().unwrap_or_else(|| ABSENT.to_owned());
        vec![
            self.name.clone(),
            self.links.to_string(),
            self.moving_joints.to_string(),
            fixed(self.mass, 3),
            or_absent(&self.claimed_by),
            self.disabled_reason.as_ref().map_or(ABSENT, |_| "yes").to_owned(),
        ]
    }
}

impl ClientRow {
    pub(super) const HEADINGS: [(&str, bool); 4] =
        [("CLIENT", false), ("TRANSPORT", false), ("IDLE [s]", true), ("TARGETS", true)];

    pub(super) fn cells(&self) -> Vec<String> {
        let name = if self.is_caller { format!("{} (this)", self.name) } else { self.name.clone() };
        vec![name, self.transport.clone(), fixed(self.idle, 1), self.targets.to_string()]
    }
}

/// A column of the table of worlds.
pub(super) struct WorldColumn {
    pub(super) heading: &'static str,
    pub(super) is_right: bool,
    /// Maximum width of its cells on a screen.
    pub(super) width: u16,
    /// On a narrow screen, columns with the highest rank are left out first.
    pub(super) rank: u8,
    pub(super) cell: fn(&World) -> String,
}

const fn column(
    heading: &'static str,
    (is_right, width, rank): (bool, u16, u8),
    cell: fn(&World) -> String,
) -> WorldColumn {
    WorldColumn { heading, is_right, width, rank, cell }
}

pub(super) const COLUMNS: [WorldColumn; 16] = [
    column("WORLD", (false, 20, 0), |of| of.label().to_owned()),
    column("STATE", (false, 10, 1), state),
    column("RTF", (true, 6, 2), |of| optional(of.real_time_factor, 2)),
    column("STEPS/S", (true, 8, 6), |of| optional(of.steps_per_second, 0)),
    column("STEP [ms]", (true, 9, 5), |of| milliseconds(of.step_duration)),
    column("99 %", (true, 7, 9), |of| milliseconds_at_most(of.step_duration_p99)),
    column("LATE [ms]", (true, 9, 4), |of| milliseconds(of.step_lateness)),
    column("99 %", (true, 7, 8), |of| milliseconds_at_most(of.step_lateness_p99)),
    column("OVERRUNS", (true, 8, 7), |of| whole(of.overruns)),
    column("DROPPED [s]", (true, 11, 10), |of| optional(of.dropped_lag, 3)),
    column("ROBOTS", (true, 6, 3), |of| whole(of.robot_count)),
    column("CALLS/S", (true, 8, 11), |of| optional(of.calls_per_second, 1)),
    column("STREAMS", (true, 7, 12), |of| whole(of.streams)),
    column("CLAIMS", (true, 6, 13), |of| whole(of.claims)),
    column("MEMORY", (true, 9, 14), |of| {
        of.resident_bytes.map_or_else(|| ABSENT.to_owned(), |bytes| format!("{} MiB", bytes >> 20))
    }),
    column("ENDPOINT", (false, 30, 15), |of| of.endpoint.clone()),
];

fn state(of: &World) -> String {
    match (of.link, &of.state) {
        (Link::Lost, _) => "lost".to_owned(),
        (Link::Here, Some(state)) => state.clone(),
        (Link::Connecting, _) | (Link::Here, None) => "connecting".to_owned(),
    }
}

fn whole(value: Option<impl ToString>) -> String {
    value.map_or_else(|| ABSENT.to_owned(), |value| value.to_string())
}

fn milliseconds(seconds: Option<f64>) -> String {
    optional(seconds.map(|seconds| seconds * 1e3), 3)
}

/// Formats the upper bound of a bucket.
fn milliseconds_at_most(seconds: Option<f64>) -> String {
    match seconds {
        None => ABSENT.to_owned(),
        Some(seconds) if seconds.is_infinite() => "> 5000".to_owned(),
        Some(seconds) => format!("<{}", crate::output::number::exact((seconds * 1e6).round() / 1e3)),
    }
}

/// Durations between two answers.
struct Between<'a> {
    upper_bounds: &'a [f64],
    counts: Vec<u64>,
    sum: f64,
}

impl<'a> Between<'a> {
    /// Makes it; `None` if there are none, or if the answers do not match.
    fn new(then: &DurationHistogram, now: &'a DurationHistogram) -> Option<Self> {
        let is_alike = then.upper_bounds == now.upper_bounds
            && then.counts.len() == now.upper_bounds.len()
            && now.counts.len() == now.upper_bounds.len();
        let counts: Vec<u64> =
            now.counts.iter().zip(&then.counts).map(|(now, then)| now.saturating_sub(*then)).collect();
        let is_any = is_alike && counts.iter().any(|count| *count > 0);
        is_any.then_some(Self { upper_bounds: &now.upper_bounds, counts, sum: (now.sum - then.sum).max(0.0) })
    }

    fn total(&self) -> u64 {
        self.counts.iter().fold(0, |total: u64, count| total.saturating_add(*count))
    }

    fn mean(&self) -> f64 {
        self.sum / self.total() as f64
    }

    /// Returns the upper bound of the bucket that contains a quantile.
    fn quantile(&self, part: f64) -> f64 {
        let rank = part * self.total() as f64;
        let mut below = 0.0;
        for (bound, count) in self.upper_bounds.iter().zip(&self.counts) {
            below += *count as f64;
            if below >= rank {
                return *bound;
            }
        }
        f64::INFINITY
    }
}
