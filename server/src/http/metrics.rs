//! Endpoints for operators: `/metrics` for Prometheus, `/healthz` and `/readyz` for tools that restart the
//! daemon or route to it.

use std::fmt;
use std::fs;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use axum::body::Body;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, Response, StatusCode, header};
use axum::response::IntoResponse as _;
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeLabelSet, EncodeMetric as _, MetricEncoder};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::{Registry, Unit};
use tonic::Code;

use super::Page;
use simd_world::handle::RunState;
use simd_world::histogram::Counts;
use simd_world::{SimHandle, process};

/// OpenMetrics, which Prometheus asks for by name.
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// The format of all other readers.
const TEXT: &str = "text/plain; version=0.0.4; charset=utf-8";
/// Ticks of a second, in which Linux counts processor time for programs on every architecture.
const TICKS: f64 = 100.0;

/// `GET /metrics`, in OpenMetrics if `Accept` names it.
pub(super) async fn metrics(State(page): State<Arc<Page>>, asked: HeaderMap) -> Response<Body> {
    let mut registry = Registry::default();
    registry.register_collector(Box::new(Scrape(page.handle.clone())));
    let mut text = String::new();
    if let Err(error) = prometheus_client::encoding::text::encode(&mut text, &registry) {
        return (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response();
    }
    let (media, text) = match takes_open_metrics(&asked) {
        true => (OPEN_METRICS, text),
        false => (TEXT, plain(&text)),
    };
    ([(header::CONTENT_TYPE, HeaderValue::from_static(media))], text).into_response()
}

fn takes_open_metrics(asked: &HeaderMap) -> bool {
    let values = asked.get_all(header::ACCEPT).iter().filter_map(|value| value.to_str().ok());
    let mut media =
        values.flat_map(|value| value.split(',')).map(|kind| kind.split(';').next().unwrap_or_default());
    media.any(|kind| kind.trim().eq_ignore_ascii_case("application/openmetrics-text"))
}

/// OpenMetrics as the older text: counters are named as their samples are, and there are no units and no end.
fn plain(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut help: Option<(&str, &str)> = None;
    for line in text.lines() {
        if let Some(rest) = line.strip_prefix("# HELP ") {
            help = rest.split_once(' ');
        } else if let Some((name, kind)) = line.strip_prefix("# TYPE ").and_then(|rest| rest.split_once(' '))
        {
            let suffix = if kind == "counter" { "_total" } else { "" };
            if let Some((_, words)) = help.take().filter(|(of, _)| *of == name) {
                plain.extend(["# HELP ", name, suffix, " ", words, "\n"]);
            }
            plain.extend(["# TYPE ", name, suffix, " ", kind, "\n"]);
        } else if !line.starts_with("# ") {
            plain.extend([line, "\n"]);
        }
    }
    plain
}

/// `GET /healthz`: 503 if the daemon should be restarted.
pub(super) async fn health(State(page): State<Arc<Page>>) -> Response<Body> {
    answer(page.handle.health(Instant::now()))
}

/// `GET /readyz`: 503 also while the daemon drains.
pub(super) async fn readiness(State(page): State<Arc<Page>>) -> Response<Body> {
    answer(page.handle.readiness(Instant::now()))
}

fn answer(how: Result<(), String>) -> Response<Body> {
    match how {
        Ok(()) => (StatusCode::OK, "ok\n").into_response(),
        Err(sentence) => (StatusCode::SERVICE_UNAVAILABLE, format!("{sentence}\n")).into_response(),
    }
}

/// Reads everything at the time of a scrape, so that nothing is stored twice.
#[derive(Debug)]
struct Scrape(SimHandle);

impl Collector for Scrape {
    fn encode(&self, encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let mut families = Families(encoder);
        self.world(&mut families)?;
        self.clients(&mut families)?;
        self.uploads_and_answers(&mut families)?;
        of_process(&mut families)
    }
}

impl Scrape {
    fn world(&self, families: &mut Families<'_>) -> fmt::Result {
        let newest = self.0.newest();
        let statistics = self.0.statistics_at(&newest);
        let (duration, lateness) = self.0.step_times();
        families.histogram("simd_step_duration", "Wall time that steps took to compute.", &duration)?;
        families.histogram(
            "simd_step_lateness",
            "Delay of steps: time from when a step was due to its start.",
            &lateness,
        )?;
        families.counter("simd_steps", "Steps since the start.", statistics.iterations)?;
        families.counter("simd_overruns", "Number of times that lag was dropped.", statistics.overruns)?;
        let dropped = "Lag that was dropped: how far the world is behind a clock that never waited.";
        families.seconds_counter("simd_dropped_lag", dropped, statistics.dropped_lag)?;
        let factor = "Simulated seconds to a wall second, over about the last second of playing.";
        families.gauge("simd_real_time_factor", factor, statistics.real_time_factor)?;
        let time = "Simulated time.";
        families.seconds_gauge("simd_sim_time", time, newest.state.at.sim_time)?;
        let states =
            [("playing", RunState::Playing), ("paused", RunState::Paused), ("stopped", RunState::Stopped)];
        families.gauges(
            "simd_simulation_state",
            "1 for the current state of the world, 0 for the others.",
            states.map(|(name, state)| ([("state", name)], f64::from(u8::from(state == statistics.state)))),
        )?;
        families.gauge("simd_robots", "Robots in the world.", newest.state.world.entities.len() as f64)?;
        families.gauge("simd_contacts", "Contact points.", newest.state.contacts.len() as f64)?;
        families.gauge("simd_saved_states", "Saved states.", newest.state.saved.len() as f64)?;
        families.gauge("simd_claims", "Claims in force.", self.0.claim_count() as f64)?;
        families.gauge(
            "simd_parameters",
            "Sliders and buttons.",
            self.0.parameters().parameters.len() as f64,
        )?;
        let (waiting, refusals) = self.0.mailbox();
        families.gauge("simd_mailbox_waiting", "Calls that wait for the physics thread.", waiting as f64)?;
        families.counter("simd_mailbox_refusals", "Calls that found the mailbox full.", refusals)
    }

    fn clients(&self, families: &mut Families<'_>) -> fmt::Result {
        let mut by_transport = std::collections::BTreeMap::new();
        for client in self.0.clients() {
            *by_transport.entry(client.caller.transport.name()).or_insert(0_u32) += 1;
        }
        let here = by_transport.into_iter().map(|(name, count)| ([("transport", name)], f64::from(count)));
        families.gauges("simd_clients", "Clients that gave a name and called within five seconds.", here)?;
        let calls = self.0.call_counts();
        let ended = calls.iter().flat_map(|of| {
            of.ended.iter().map(|&((code, reason), count)| {
                let code = format!("{:?}", Code::from(code));
                let labels = [
                    ("method", of.method.to_owned()),
                    ("transport", of.transport.name().to_owned()),
                    ("code", code),
                    ("reason", reason.to_owned()),
                ];
                (labels, count)
            })
        });
        families.counters("simd_calls", "Calls that were answered, by how they ended.", ended)?;
        let refused = self.0.refused_unanswered();
        let unanswered = [
            ("connections", &refused.connections),
            ("published targets", &refused.targets),
            ("published targets that came too fast", &refused.lost_targets),
        ];
        families.counters(
            "simd_refused_unanswered",
            "Refusals without an answer to the client, by reason.",
            unanswered.map(|(what, count)| ([("what", what)], count.load(Ordering::Relaxed))),
        )?;
        let wrong = self.0.access().wrong_tokens();
        families.counter("simd_wrong_tokens", "Calls with a token that the daemon does not know.", wrong)?;
        let labels = |of: &simd_world::handle::MethodCalls| {
            [("method", of.method), ("transport", of.transport.name())]
        };
        let open = calls.iter().filter(|of| of.streams > 0).map(|of| (labels(of), of.streams as f64));
        families.gauges("simd_streams", "Open streams.", open)?;
        let took = "Wall time until calls were answered; until the first answer of streams.";
        families.histograms("simd_call_duration", took, calls.iter().map(|of| (labels(of), &of.duration)))
    }

    fn uploads_and_answers(&self, families: &mut Families<'_>) -> fmt::Result {
        let (uploads, bytes) = self.0.loader().uploads_under_way();
        families.gauge("simd_uploads", "Uploads in progress.", uploads as f64)?;
        let help = "Received bytes of these uploads.";
        families.gauge_of("simd_upload", help, Some(&Unit::Bytes), bytes as f64)?;
        let help = "Bytes of answers that clients have yet to read.";
        let unread = self.0.unread_answers().bytes();
        families.gauge_of("simd_unread_answers", help, Some(&Unit::Bytes), unread as f64)
    }
}

/// Writes the system's facts about the process, under Prometheus's names. Unreadable ones are left out.
fn of_process(families: &mut Families<'_>) -> fmt::Result {
    if let Some(bytes) = process::heap_bytes() {
        let help = "Allocated memory of the process.";
        families.gauge_of("simd_heap", help, Some(&Unit::Bytes), bytes as f64)?;
    }
    if let Some(bytes) = process::resident_bytes() {
        let help = "Resident memory of the process.";
        families.gauge_of("process_resident_memory", help, Some(&Unit::Bytes), bytes as f64)?;
    }
    if let Some(files) = process::open_files() {
        families.gauge("process_open_fds", "Files, sockets and pipes that are open.", files as f64)?;
    }
    let limit = fs::read_to_string("/proc/self/limits").ok().and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("Max open files"))?;
        line.split_whitespace().next()?.parse::<f64>().ok()
    });
    if let Some(limit) = limit {
        families.gauge("process_max_fds", "Maximum number of open files.", limit)?;
    }
    let busy = fs::read_to_string("/proc/self/stat").ok().and_then(|text| {
        // The name before it is in brackets, and may contain spaces.
        let mut fields = text.rsplit_once(')')?.1.split_whitespace().skip(11);
        let ticks: f64 = fields.next()?.parse::<f64>().ok()? + fields.next()?.parse::<f64>().ok()?;
        Some(ticks / TICKS)
    });
    match busy {
        Some(seconds) => families.seconds_counter("process_cpu", "Processor time of the process.", seconds),
        None => Ok(()),
    }
}

/// Writes families of metrics. Names are without the suffixes that the format adds.
struct Families<'a>(DescriptorEncoder<'a>);

impl Families<'_> {
    fn begin(
        &mut self,
        (name, help, unit): (&str, &str, Option<&Unit>),
        kind: MetricType,
        write: impl FnOnce(MetricEncoder<'_>) -> fmt::Result,
    ) -> fmt::Result {
        write(self.0.encode_descriptor(name, help, unit, kind)?)
    }

    fn counter(&mut self, name: &str, help: &str, value: u64) -> fmt::Result {
        let write = |encoder: MetricEncoder<'_>| ConstCounter::new(value).encode(encoder);
        self.begin((name, help, None), MetricType::Counter, write)
    }

    fn seconds_counter(&mut self, name: &str, help: &str, value: f64) -> fmt::Result {
        let write = |encoder: MetricEncoder<'_>| ConstCounter::new(value).encode(encoder);
        self.begin((name, help, Some(&Unit::Seconds)), MetricType::Counter, write)
    }

    fn gauge(&mut self, name: &str, help: &str, value: f64) -> fmt::Result {
        self.gauge_of(name, help, None, value)
    }

    fn seconds_gauge(&mut self, name: &str, help: &str, value: f64) -> fmt::Result {
        self.gauge_of(name, help, Some(&Unit::Seconds), value)
    }

    fn gauge_of(&mut self, name: &str, help: &str, unit: Option<&Unit>, value: f64) -> fmt::Result {
        let write = |encoder: MetricEncoder<'_>| ConstGauge::new(value).encode(encoder);
        self.begin((name, help, unit), MetricType::Gauge, write)
    }

    fn gauges<S: EncodeLabelSet>(
        &mut self,
        name: &str,
        help: &str,
        values: impl IntoIterator<Item = (S, f64)>,
    ) -> fmt::Result {
        self.begin((name, help, None), MetricType::Gauge, |mut encoder| {
            let mut values = values.into_iter();
            values.try_for_each(|(labels, value)| {
                ConstGauge::new(value).encode(encoder.encode_family(&labels)?)
            })
        })
    }

    fn counters<S: EncodeLabelSet>(
        &mut self,
        name: &str,
        help: &str,
        values: impl IntoIterator<Item = (S, u64)>,
    ) -> fmt::Result {
        self.begin((name, help, None), MetricType::Counter, |mut encoder| {
            let mut values = values.into_iter();
            values.try_for_each(|(labels, value)| {
                ConstCounter::new(value).encode(encoder.encode_family(&labels)?)
            })
        })
    }

    fn histogram(&mut self, name: &str, help: &str, of: &Counts) -> fmt::Result {
        let write = |encoder: MetricEncoder<'_>| encode(encoder, of);
        self.begin((name, help, Some(&Unit::Seconds)), MetricType::Histogram, write)
    }

    fn histograms<'c, S: EncodeLabelSet>(
        &mut self,
        name: &str,
        help: &str,
        values: impl IntoIterator<Item = (S, &'c Counts)>,
    ) -> fmt::Result {
        self.begin((name, help, Some(&Unit::Seconds)), MetricType::Histogram, |mut encoder| {
            values.into_iter().try_for_each(|(labels, of)| encode(encoder.encode_family(&labels)?, of))
        })
    }
}

fn encode(mut encoder: MetricEncoder<'_>, of: &Counts) -> fmt::Result {
    encoder.encode_histogram::<[(&str, &str); 0]>(of.sum, of.count, &of.buckets, None)
}
